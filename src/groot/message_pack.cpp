#include "sentree/groot/message_pack.h"

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <unordered_set>

#include "sentree/base/json.h"

namespace sentree::groot {

namespace {

class Writer {
 public:
  explicit Writer(std::string& out) : out_(out) {}

  void write(const Value& value, int depth) {
    switch (value.type()) {
      case Value::Type::kNull: byte(0xC0); break;
      case Value::Type::kBool: byte(*value.as_bool() ? 0xC3 : 0xC2); break;
      case Value::Type::kInt: integer(*value.as_int()); break;
      case Value::Type::kDouble: real(*value.as_double()); break;
      case Value::Type::kString: text(*value.as_string()); break;
      case Value::Type::kBytes: {
        const auto& octets = value.as_bytes()->octets;
        length(octets.size(), 0xC4, 0xC5, 0xC6);
        out_.append(reinterpret_cast<const char*>(octets.data()), octets.size());
        break;
      }
      case Value::Type::kList: {
        if (depth >= kPackNestingMax) return byte(0xC0);
        const List& list = *value.as_list();
        count(list.size(), 0x90, 0xDC);
        for (const Value& item : list) write(item, depth + 1);
        break;
      }
      case Value::Type::kMap: {
        if (depth >= kPackNestingMax) return byte(0xC0);
        const Map& map = *value.as_map();
        count(map.size(), 0x80, 0xDE);
        for (const auto& [key, item] : map) {
          text(key);
          write(item, depth + 1);
        }
        break;
      }
    }
  }

 private:
  void byte(unsigned char b) { out_ += static_cast<char>(b); }
  void big_endian(std::uint64_t number, int bytes) {
    for (int i = bytes - 1; i >= 0; --i) byte(static_cast<unsigned char>(number >> (8 * i) & 255));
  }
  void length(std::size_t size, unsigned char one, unsigned char two, unsigned char four) {
    if (size <= 0xFF) {
      byte(one);
      big_endian(size, 1);
    } else if (size <= 0xFFFF) {
      byte(two);
      big_endian(size, 2);
    } else {
      byte(four);
      big_endian(size, 4);
    }
  }
  void text(std::string_view text) {
    if (text.size() < 32)
      byte(static_cast<unsigned char>(0xA0 | text.size()));
    else
      length(text.size(), 0xD9, 0xDA, 0xDB);
    out_ += text;
  }
  void count(std::size_t items, unsigned char fix, unsigned char two) {
    if (items < 16) {
      byte(static_cast<unsigned char>(fix | items));
    } else if (items <= 0xFFFF) {
      byte(two);
      big_endian(items, 2);
    } else {
      byte(static_cast<unsigned char>(two + 1));
      big_endian(items, 4);
    }
  }
  void integer(std::int64_t n) {
    const auto bits = static_cast<std::uint64_t>(n);
    if (n >= 0) {
      if (n < 0x80) return byte(static_cast<unsigned char>(n));
      const int size = bits <= 0xFF ? 0 : bits <= 0xFFFF ? 1 : bits <= 0xFFFFFFFF ? 2 : 3;
      byte(static_cast<unsigned char>(0xCC + size));
      return big_endian(bits, 1 << size);
    }
    if (n >= -32) return byte(static_cast<unsigned char>(bits & 0xFF));
    const int size = n >= INT8_MIN ? 0 : n >= INT16_MIN ? 1 : n >= INT32_MIN ? 2 : 3;
    byte(static_cast<unsigned char>(0xD0 + size));
    big_endian(bits, 1 << size);
  }
  void real(double number) {
    const bool fits = number >= -static_cast<double>(std::numeric_limits<float>::max()) &&
                      number <= static_cast<double>(std::numeric_limits<float>::max());
    if (fits && static_cast<double>(static_cast<float>(number)) == number) {
      byte(0xCA);
      big_endian(std::bit_cast<std::uint32_t>(static_cast<float>(number)), 4);
    } else {
      byte(0xCB);
      big_endian(std::bit_cast<std::uint64_t>(number), 8);
    }
  }
  std::string& out_;
};

class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}

  std::optional<Value> value(int depth) {
    if (depth > kPackNestingMax) return refuse("lists and maps lie too deep");
    const auto head = number(1);
    if (!head) return std::nullopt;
    const auto b = static_cast<unsigned char>(*head);
    if (b < 0x80) return Value(static_cast<std::int64_t>(b));
    if (b >= 0xE0) return Value(static_cast<std::int64_t>(static_cast<std::int8_t>(b)));
    if (b < 0x90) return map(b & 15U, depth);
    if (b < 0xA0) return list(b & 15U, depth);
    if (b < 0xC0) return text(b & 31U);
    switch (b) {
      case 0xC0: return Value();
      case 0xC2: return Value(false);
      case 0xC3: return Value(true);
      case 0xC4:
      case 0xC5:
      case 0xC6: return sized(b - 0xC4, [this](std::size_t n) { return octets(n); });
      case 0xC7:
      case 0xC8:
      case 0xC9: return sized(b - 0xC7, [this](std::size_t n) { return octets(n + 1); });
      case 0xCA: {
        const auto bits = number(4);
        if (!bits) return std::nullopt;
        return Value(static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(*bits))));
      }
      case 0xCB: {
        const auto bits = number(8);
        if (!bits) return std::nullopt;
        return Value(std::bit_cast<double>(*bits));
      }
      case 0xCC:
      case 0xCD:
      case 0xCE:
      case 0xCF: {
        const auto n = number(std::size_t{1} << (b - 0xCC));
        if (!n) return std::nullopt;
        if (*n > static_cast<std::uint64_t>(INT64_MAX)) return Value(static_cast<double>(*n));
        return Value(static_cast<std::int64_t>(*n));
      }
      case 0xD0: return signed_number<std::int8_t>();
      case 0xD1: return signed_number<std::int16_t>();
      case 0xD2: return signed_number<std::int32_t>();
      case 0xD3: return signed_number<std::int64_t>();
      case 0xD4:
      case 0xD5:
      case 0xD6:
      case 0xD7:
      case 0xD8: return octets((std::size_t{1} << (b - 0xD4)) + 1);
      case 0xD9:
      case 0xDA:
      case 0xDB: return sized(b - 0xD9, [this](std::size_t n) { return text(n); });
      case 0xDC:
      case 0xDD: return sized(b - 0xDC + 1, [&](std::size_t n) { return list(n, depth); });
      case 0xDE:
      case 0xDF: return sized(b - 0xDE + 1, [&](std::size_t n) { return map(n, depth); });
      default: return refuse("a byte begins no value");
    }
  }
  [[nodiscard]] bool at_end() const { return at_ == bytes_.size(); }
  [[nodiscard]] Diagnostic why() const {
    return {Severity::kError, "groot.pack", fmt::format("not MessagePack at byte {}: {}", at_, why_), {}};
  }
  std::nullopt_t refuse(std::string why) {
    if (why_.empty()) why_ = std::move(why);
    return std::nullopt;
  }

 private:
  std::optional<std::uint64_t> number(std::size_t size) {
    if (bytes_.size() - at_ < size) return refuse("it is cut off");
    std::uint64_t n = 0;
    for (std::size_t i = 0; i < size; ++i) n = n << 8U | static_cast<unsigned char>(bytes_[at_ + i]);
    at_ += size;
    return n;
  }
  template <class Take>
  std::optional<Value> sized(int width, const Take& take) {
    const auto n = number(std::size_t{1} << width);
    if (!n) return std::nullopt;
    return take(static_cast<std::size_t>(*n));
  }
  template <class Integer>
  std::optional<Value> signed_number() {
    const auto n = number(sizeof(Integer));
    if (!n) return std::nullopt;
    return Value(static_cast<std::int64_t>(static_cast<Integer>(*n)));
  }
  std::optional<std::string_view> part(std::size_t size) {
    if (bytes_.size() - at_ < size) return refuse("it is cut off");
    at_ += size;
    return bytes_.substr(at_ - size, size);
  }
  std::optional<Value> text(std::size_t size) {
    const auto taken = part(size);
    if (!taken) return std::nullopt;
    return Value(std::string(*taken));
  }
  std::optional<Value> octets(std::size_t size) {
    const auto taken = part(size);
    if (!taken) return std::nullopt;
    Bytes bytes;
    bytes.octets.resize(taken->size());
    if (!taken->empty()) std::memcpy(bytes.octets.data(), taken->data(), taken->size());
    return Value(std::move(bytes));
  }
  // What is claimed must be there, a byte for each at least, before memory is taken for it.
  bool is_there(std::size_t items, std::size_t bytes_each) {
    if ((bytes_.size() - at_) / bytes_each >= items) return true;
    refuse("it is cut off");
    return false;
  }
  std::optional<Value> list(std::size_t items, int depth) {
    if (!is_there(items, 1)) return std::nullopt;
    List list;
    for (std::size_t i = 0; i < items; ++i) {
      auto item = value(depth + 1);
      if (!item) return std::nullopt;
      list.push_back(std::move(*item));
    }
    return Value(std::move(list));
  }
  std::optional<Value> map(std::size_t items, int depth) {
    if (!is_there(items, 2)) return std::nullopt;
    Map map;
    std::unordered_set<std::string> known;  // a map of many entries is read in time that grows with it
    for (std::size_t i = 0; i < items; ++i) {
      const auto key = value(depth + 1);
      auto item = key ? value(depth + 1) : std::nullopt;
      if (!item) return std::nullopt;
      const auto [name, is_new] = known.insert(key->as_string() != nullptr ? *key->as_string() : to_json(*key));
      if (is_new) map.append(*name, std::move(*item));
    }
    return Value(std::move(map));
  }

  std::string_view bytes_;
  std::size_t at_ = 0;
  std::string why_;
};

}  // namespace

std::string message_pack(const Value& value) {
  std::string out;
  Writer(out).write(value, 0);
  return out;
}

Result<Value> parse_message_pack(std::string_view bytes) {
  Reader reader(bytes);
  auto value = reader.value(0);
  if (value && !reader.at_end()) value = reader.refuse("something stands behind the value");
  if (!value) return tl::unexpected(reader.why());
  return std::move(*value);
}

}  // namespace sentree::groot
