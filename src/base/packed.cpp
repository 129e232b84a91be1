#include "sentree/base/packed.h"

#include <bit>
#include <cstdint>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include "sentree/base/encoder.h"

namespace sentree {

namespace {

// After the first thing that does not fit, `ok` is false and everything reads as nothing.
class Unpacker {
 public:
  explicit Unpacker(std::string_view octets) : left_(octets) {}
  bool ok = true;

  [[nodiscard]] bool at_end() const { return left_.empty(); }
  void texts() {
    const std::size_t size = count(1);
    for (std::size_t i = 0; i < size && ok; ++i) texts_.push_back(octets(count(1)));
  }
  Value value(int depth) {
    if (depth > kPackedDepthMax || !spend(sizeof(Value))) ok = false;
    const std::uint8_t tag = byte();
    if (!ok) return {};
    if (tag >= Encoder::kSmallInt) return static_cast<std::int64_t>(tag - Encoder::kSmallInt);
    switch (tag) {
      case Encoder::kNull: return {};
      case Encoder::kFalse: return false;
      case Encoder::kTrue: return true;
      case Encoder::kInt: {
        const std::uint64_t zigzag = number();
        return static_cast<std::int64_t>(zigzag >> 1 ^ (~(zigzag & 1) + 1));
      }
      case Encoder::kDouble: return std::bit_cast<double>(word());
      case Encoder::kString: return std::string(text());
      case Encoder::kBytes: {
        const std::string_view raw = octets(count(1));
        if (!spend(raw.size())) return {};
        const auto* first = reinterpret_cast<const std::byte*>(raw.data());
        return Bytes{{first, first + raw.size()}};
      }
      case Encoder::kList: {
        List list;
        const std::size_t size = count(1);
        for (std::size_t i = 0; i < size && ok; ++i) list.push_back(value(depth + 1));
        return list;
      }
      case Encoder::kMap: return map(depth);
      default: ok = false; return {};
    }
  }

 private:
  Map map(int depth) {
    Map map;
    std::set<std::string_view> keys;
    const std::size_t size = count(2);
    for (std::size_t i = 0; i < size && ok; ++i) {
      if (byte() != Encoder::kString) ok = false;
      const std::string_view key = text();
      if (!keys.insert(key).second) ok = false;
      if (ok) map.append(std::string(key), value(depth + 1));
    }
    return map;
  }
  std::uint8_t byte() {
    if (!ok || left_.empty()) {
      ok = false;
      return 0;
    }
    const auto first = static_cast<std::uint8_t>(left_.front());
    left_.remove_prefix(1);
    return first;
  }
  std::uint64_t number() {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      const std::uint8_t digit = byte();
      value |= std::uint64_t{digit & 0x7FU} << shift;
      if (digit < 0x80) return value;
    }
    ok = false;
    return 0;
  }
  std::uint64_t word() {
    std::uint64_t value = 0;
    for (int i = 0; i < 8; ++i) value |= std::uint64_t{byte()} << (8 * i);
    return value;
  }
  // Of things that take at least `each` octets.
  std::size_t count(std::size_t each) {
    const std::uint64_t size = number();
    if (size > left_.size() / each) ok = false;
    return ok ? static_cast<std::size_t>(size) : 0;
  }
  std::string_view octets(std::size_t size) {
    const std::string_view taken = left_.substr(0, size);
    left_.remove_prefix(taken.size());
    return taken;
  }
  std::string_view text() {
    const std::uint64_t index = number();
    if (!ok || index >= texts_.size() || !spend(texts_[index].size())) {
      ok = false;
      return {};
    }
    return texts_[index];
  }
  bool spend(std::size_t memory) {
    spent_ += memory;
    if (spent_ > kUnpackedMax) ok = false;
    return ok;
  }

  std::string_view left_;
  std::vector<std::string_view> texts_;
  std::size_t spent_ = 0;
};

}  // namespace

std::string pack(const Value& value) {
  std::string body;
  Encoder encoder(body);
  std::unordered_map<std::string_view, std::uint64_t> numbers;
  std::vector<std::string_view> texts;
  encoder.value(value, [&](std::string_view text) {
    const auto [known, is_new] = numbers.try_emplace(text, texts.size());
    if (is_new) texts.push_back(text);
    encoder.byte(Encoder::kString);
    encoder.number(known->second);
  });
  std::string octets;
  Encoder head(octets);
  head.number(texts.size());
  for (const std::string_view text : texts) head.text(text);
  return octets + body;
}

Result<Value> unpack(std::string_view octets) {
  Unpacker unpacker(octets);
  unpacker.texts();
  Value value = unpacker.value(0);
  if (!unpacker.ok || !unpacker.at_end()) return fail("value.bad-octets", "these octets are no packed value");
  return value;
}

}  // namespace sentree
