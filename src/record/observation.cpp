#include "sentree/record/observation.h"

#include <cstring>

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

// What every observation has, before the data that are particular to it.
struct Facts {
  std::uint64_t sequence = 0;
  TimePoint time{};
  CausalStamp stamp = 0;
  std::uint64_t call = 0;
  std::uint64_t tick = 0;
  MessageKind kind = MessageKind::kEvent;
  // Sizes of texts.
  std::uint32_t source = 0;
  std::uint32_t target = 0;
  std::uint32_t name = 0;
};

Facts facts_of(const Message& message) {
  return {.sequence = message.sequence,
          .time = message.time,
          .stamp = message.stamp,
          .call = message.call,
          .tick = message.tick,
          .kind = message.kind,
          .source = static_cast<std::uint32_t>(message.source.size()),
          .target = static_cast<std::uint32_t>(message.target.size()),
          .name = static_cast<std::uint32_t>(message.name.size())};
}

// The object stays open.
void append_facts(std::string& out, const Facts& facts, std::string_view source, std::string_view target,
                  std::string_view name) {
  out += R"({"sequence":)";
  append_integer(out, facts.sequence);
  out += R"(,"time":)";
  append_seconds(out, facts.time);
  out += R"(,"stamp":)";
  append_integer(out, facts.stamp);
  out += R"(,"kind":")";
  out += to_string(facts.kind);
  out += R"(","source":)";
  append_json_string(out, source);
  if (!target.empty()) {
    out += R"(,"target":)";
    append_json_string(out, target);
  }
  out += R"(,"name":)";
  append_json_string(out, name);
  if (facts.call != 0) {
    out += R"(,"call":)";
    append_integer(out, facts.call);
  }
  out += R"(,"tick":)";
  append_integer(out, facts.tick);
}

}  // namespace

void append_observation(std::string& out, const Message& message) {
  append_facts(out, facts_of(message), message.source, message.target, message.name);
  if (!message.data.is_null()) {
    out += R"(,"data":)";
    append_json(out, message.data);
  }
  out += '}';
}

void pack_observation(PackedJson& out, const Message& message) {
  const Facts facts = facts_of(message);
  char* to = out.later(
      [](std::string& json, std::string_view bytes) {
        Facts packed;
        std::memcpy(&packed, bytes.data(), sizeof packed);
        bytes.remove_prefix(sizeof packed);
        const std::string_view source = bytes.substr(0, packed.source);
        const std::string_view target = bytes.substr(packed.source, packed.target);
        append_facts(json, packed, source, target, bytes.substr(packed.source + packed.target));
      },
      sizeof facts + facts.source + facts.target + facts.name);
  const auto put = [&to](const void* bytes, std::size_t size) {
    std::memcpy(to, bytes, size);
    to += size;
  };
  put(&facts, sizeof facts);
  put(message.source.data(), facts.source);
  put(message.target.data(), facts.target);
  put(message.name.data(), facts.name);
  if (!message.data.is_null()) {
    out.raw(R"(,"data":)");
    out.value(message.data);
  }
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
