#include "sentree/record/observation.h"

#include "sentree/base/json.h"
#include "sentree/record/detail/print.h"
#include "sentree/text/json.h"

namespace sentree::record {

namespace {

using detail::append_integer;
using detail::append_seconds;

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

void pack_observation(PackedJson& out, const Message& message) {
  out.raw(R"({"sequence":)");
  out.unsigned_integer(message.sequence);
  out.raw(R"(,"time":)");
  out.seconds(message.time);
  out.raw(R"(,"stamp":)");
  out.unsigned_integer(message.stamp);
  switch (message.kind) {
    case MessageKind::kRequest: out.raw(R"(,"kind":"request","source":)"); break;
    case MessageKind::kReply: out.raw(R"(,"kind":"reply","source":)"); break;
    case MessageKind::kError: out.raw(R"(,"kind":"error","source":)"); break;
    case MessageKind::kEvent: out.raw(R"(,"kind":"event","source":)"); break;
  }
  out.text(message.source);
  if (!message.target.empty()) {
    out.raw(R"(,"target":)");
    out.text(message.target);
  }
  out.raw(R"(,"name":)");
  out.text(message.name);
  if (message.call != 0) {
    out.raw(R"(,"call":)");
    out.unsigned_integer(message.call);
  }
  out.raw(R"(,"tick":)");
  out.unsigned_integer(message.tick);
  if (message.data.is_null()) {
    out.raw("}");
    return;
  }
  out.raw(R"(,"data":)");
  out.value(message.data);
  out.raw("}");
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
