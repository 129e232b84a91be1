#include "sentree/record/observation.h"

#include <array>
#include <charconv>

#include "sentree/base/json.h"
#include "sentree/text/json.h"

namespace sentree::record {

namespace {

template <class Integer>
void append_integer(std::string& out, Integer number) {
  std::array<char, 24> buffer;
  out.append(buffer.data(), std::to_chars(buffer.data(), buffer.data() + buffer.size(), number).ptr);
}

// Nanoseconds as seconds with as many decimals as are needed, at least one.
void append_seconds(std::string& out, TimePoint time) {
  std::int64_t ns = time.time_since_epoch().count();
  if (ns < 0) {
    out += '-';
    ns = -ns;
  }
  append_integer(out, ns / 1'000'000'000);
  out += '.';
  std::array<char, 9> digits;
  std::int64_t rest = ns % 1'000'000'000;
  for (std::size_t i = digits.size(); i-- > 0; rest /= 10) digits[i] = static_cast<char>('0' + rest % 10);
  std::size_t length = digits.size();
  while (length > 1 && digits[length - 1] == '0') --length;
  out.append(digits.data(), length);
}

std::optional<MessageKind> kind_of(std::string_view text) {
  for (const MessageKind kind :
       {MessageKind::kRequest, MessageKind::kReply, MessageKind::kError, MessageKind::kEvent}) {
    if (to_string(kind) == text) return kind;
  }
  return std::nullopt;
}

std::uint64_t unsigned_member(const Value& value, std::string_view key) {
  const Value* member = value.find(key);
  const std::int64_t* number = member != nullptr ? member->as_int() : nullptr;
  return number != nullptr && *number > 0 ? static_cast<std::uint64_t>(*number) : 0;
}

std::string text_member(const Value& value, std::string_view key) {
  const Value* member = value.find(key);
  return member != nullptr ? std::string(member->text()) : std::string();
}

}  // namespace

void append_observation(std::string& out, const Message& message) {
  out += R"({"sequence":)";
  append_integer(out, message.sequence);
  out += R"(,"time":)";
  append_seconds(out, message.time);
  out += R"(,"stamp":)";
  append_integer(out, message.stamp);
  out += R"(,"kind":")";
  out += to_string(message.kind);
  out += R"(","source":)";
  append_json_string(out, message.source);
  if (!message.target.empty()) {
    out += R"(,"target":)";
    append_json_string(out, message.target);
  }
  out += R"(,"name":)";
  append_json_string(out, message.name);
  if (message.call != 0) {
    out += R"(,"call":)";
    append_integer(out, message.call);
  }
  out += R"(,"tick":)";
  append_integer(out, message.tick);
  if (!message.data.is_null()) {
    out += R"(,"data":)";
    append_json(out, message.data);
  }
  out += '}';
}

Result<Message> read_observation(const RawMessage& recorded) {
  auto read = text::parse_json(recorded.data);
  if (!read) return tl::unexpected(read.error());
  const auto kind = kind_of(text_member(*read, "kind"));
  if (!kind || read->find("name") == nullptr)
    return fail("record.not-an-observation", "a message of " + std::string(kObservationsTopic) + " is no observation");
  Message message;
  message.sequence = unsigned_member(*read, "sequence");
  message.time = TimePoint(Duration(static_cast<std::int64_t>(recorded.log_time)));
  message.stamp = unsigned_member(*read, "stamp");
  message.kind = *kind;
  message.source = text_member(*read, "source");
  message.target = text_member(*read, "target");
  message.name = text_member(*read, "name");
  message.call = unsigned_member(*read, "call");
  message.tick = unsigned_member(*read, "tick");
  if (Value* data = read->as_map()->find("data")) message.data = with_bytes(std::move(*data));
  return message;
}

}  // namespace sentree::record
