#include "sentree/record/packed_json.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "sentree/base/assert.h"
#include "sentree/base/json.h"
#include "sentree/record/detail/print.h"

namespace sentree::record {

namespace {

class Taker {
 public:
  explicit Taker(std::string_view bytes) : rest_(bytes) {}
  [[nodiscard]] bool empty() const { return rest_.empty(); }
  template <class T>
  T take() {
    T value;
    std::memcpy(&value, take(sizeof value).data(), sizeof value);
    return value;
  }
  std::string_view take(std::size_t size) {
    SENTREE_ASSERT(rest_.size() >= size);
    const std::string_view taken = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return taken;
  }

 private:
  std::string_view rest_;
};

}  // namespace

void PackedJson::grow(std::size_t bytes) {
  const std::size_t wanted = std::max({capacity_ * 2, size_ + bytes, std::size_t{1024}});
  std::unique_ptr<char[]> larger(new char[wanted]);
  if (size_ > 0) std::memcpy(larger.get(), data_.get(), size_);
  data_ = std::move(larger);
  capacity_ = wanted;
}

void PackedJson::boolean(bool truth) {
  if (truth)
    raw("true");
  else
    raw("false");
}

void PackedJson::rounded_list(std::span<const double> numbers) {
  const auto count = static_cast<std::uint32_t>(numbers.size());
  char* to = room(5 + numbers.size_bytes());
  *to = kRoundedList;
  std::memcpy(to + 1, &count, 4);
  if (count > 0) std::memcpy(to + 5, numbers.data(), numbers.size_bytes());
}

void PackedJson::value(const Value& value) {
  switch (value.type()) {
    case Value::Type::kNull: raw("null"); return;
    case Value::Type::kBool: boolean(*value.as_bool()); return;
    case Value::Type::kInt: integer(*value.as_int()); return;
    case Value::Type::kDouble: number(*value.as_double()); return;
    case Value::Type::kString: text(*value.as_string()); return;
    case Value::Type::kBytes: {
      const auto& octets = value.as_bytes()->octets;
      copy(kBytes, {reinterpret_cast<const char*>(octets.data()), octets.size()});
      return;
    }
    case Value::Type::kList: {
      char separator = '[';
      for (const Value& item : *value.as_list()) {
        mark(separator);
        this->value(item);
        separator = ',';
      }
      if (separator == '[') mark('[');
      mark(']');
      return;
    }
    case Value::Type::kMap: {
      char separator = '{';
      for (const auto& [key, item] : *value.as_map()) {
        mark(separator);
        text(key);
        mark(':');
        this->value(item);
        separator = ',';
      }
      if (separator == '{') mark('{');
      mark('}');
      return;
    }
  }
}

void PackedJson::unpack(std::string& out, std::string_view bytes) {
  Taker taker(bytes);
  while (!taker.empty()) {
    const char op = taker.take(1)[0];
    switch (op) {
      case kRaw: {
        const auto* text = taker.take<const char*>();
        out.append(text, taker.take<std::uint32_t>());
        break;
      }
      case kJson: out += taker.take(taker.take<std::uint32_t>()); break;
      case kText: append_json_string(out, taker.take(taker.take<std::uint32_t>())); break;
      case kShortText: append_json_string(out, taker.take(taker.take<std::uint8_t>())); break;
      case kInteger: detail::append_integer(out, taker.take<std::int64_t>()); break;
      case kOctet: detail::append_integer(out, unsigned{taker.take<std::uint8_t>()}); break;
      case kDouble: append_json(out, Value(taker.take<double>())); break;
      case kRounded: detail::append_rounded(out, taker.take<double>(), 6); break;
      case kRoundedList: {
        const auto count = taker.take<std::uint32_t>();
        for (std::uint32_t i = 0; i < count; ++i) {
          if (i > 0) out += ',';
          detail::append_rounded(out, taker.take<double>(), 3);
        }
        break;
      }
      case kBytes: {
        const std::string_view octets = taker.take(taker.take<std::uint32_t>());
        out += "{\"$bytes\":\"";
        append_base64(out, std::as_bytes(std::span(octets.data(), octets.size())));
        out += "\"}";
        break;
      }
      case kPrint: {
        const auto print = taker.take<Print>();
        print(out, taker.take(taker.take<std::uint32_t>()));
        break;
      }
      default: out += op;
    }
  }
}

}  // namespace sentree::record
