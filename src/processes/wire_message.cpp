#include "sentree/processes/wire_message.h"

#include <algorithm>
#include <array>
#include <utility>

#include "sentree/text/json.h"

namespace sentree::processes {

namespace {

// As interfaces/observer.thrift and as `to_string` have them.
constexpr std::array<std::pair<std::string_view, MessageKind>, 4> kKinds{{{"REQUEST", MessageKind::kRequest},
                                                                          {"REPLY", MessageKind::kReply},
                                                                          {"ERROR", MessageKind::kError},
                                                                          {"EVENT", MessageKind::kEvent}}};

MessageKind kind_of(std::string_view name) {
  const auto found = std::find_if(kKinds.begin(), kKinds.end(), [&](const auto& kind) {
    return kind.first == name || to_string(kind.second) == name;
  });
  return found == kKinds.end() ? MessageKind::kEvent : found->second;
}

std::string_view wire_name(MessageKind kind) {
  return std::find_if(kKinds.begin(), kKinds.end(), [&](const auto& each) { return each.second == kind; })->first;
}

// What both forms have in common.
Message facts_of(const Value& map) {
  Message message;
  message.sequence = number_of(map, "sequence");
  message.stamp = number_of(map, "stamp");
  message.kind = kind_of(text_of(map, "kind"));
  message.source = text_of(map, "source");
  message.target = text_of(map, "target");
  message.name = text_of(map, "name");
  message.call = number_of(map, "call");
  message.tick = number_of(map, "tick");
  return message;
}

}  // namespace

Map json_object(const Value* text) {
  auto value = text::parse_json(text != nullptr ? text->text() : "{}");
  if (!value || value->as_map() == nullptr) return {};
  return *value->as_map();
}

std::string text_of(const Value& map, std::string_view key) {
  const Value* value = map.find(key);
  return value != nullptr ? std::string(value->text()) : std::string();
}

std::uint64_t number_of(const Value& map, std::string_view key) {
  const Value* value = map.find(key);
  return value != nullptr && value->as_int() != nullptr ? static_cast<std::uint64_t>(*value->as_int()) : 0;
}

Value octets_of(std::string_view text) {
  const auto* octets = reinterpret_cast<const std::byte*>(text.data());
  return Bytes{{octets, octets + text.size()}};
}

std::string_view text_in(const Value* octets) {
  const Bytes* bytes = octets != nullptr ? octets->as_bytes() : nullptr;
  if (bytes == nullptr) return {};
  return {reinterpret_cast<const char*>(bytes->octets.data()), bytes->octets.size()};
}

Value to_wire(const Message& message) {
  return Map{{"sequence", static_cast<std::int64_t>(message.sequence)},
             {"time_ns", message.time.time_since_epoch().count()},
             {"kind", wire_name(message.kind)},
             {"source", message.source},
             {"target", message.target},
             {"name", message.name},
             {"call", static_cast<std::int64_t>(message.call)},
             {"tick", static_cast<std::int64_t>(message.tick)},
             {"data", message.data.is_null() ? "{}" : to_json(message.data)}};
}

Message from_wire(const Value& wire) {
  Message message = facts_of(wire);
  message.time = TimePoint(Duration(static_cast<std::int64_t>(number_of(wire, "time_ns"))));
  message.data = json_object(wire.find("data"));
  return message;
}

Message message_from_json(const Value& json) {
  Message message = facts_of(json);
  if (const Value* time = json.find("time"); time != nullptr && time->is_number())
    message.time = TimePoint(from_seconds(time->number()));
  if (const Value* data = json.find("data")) message.data = *data;
  return message;
}

}  // namespace sentree::processes
