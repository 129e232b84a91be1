#include "sentree/base/message.h"

namespace sentree {

std::string_view to_string(MessageKind kind) {
  switch (kind) {
    case MessageKind::kRequest: return "request";
    case MessageKind::kReply: return "reply";
    case MessageKind::kError: return "error";
    case MessageKind::kEvent: return "event";
  }
  return "event";
}

Value event_data(const Message& message) {
  Map map{{"source", message.source},
          {"target", message.target},
          {"call", static_cast<std::int64_t>(message.call)},
          {"tick", static_cast<std::int64_t>(message.tick)},
          {"time", seconds(message.time)}};
  if (const Map* data = message.data.as_map()) {
    for (const auto& [key, value] : *data) {
      if (map.find(key) == nullptr) map[key] = value;
    }
  }
  return map;
}

std::string to_json(const Message& message) {
  Map map{{"sequence", static_cast<std::int64_t>(message.sequence)},
          {"time", seconds(message.time)},
          {"stamp", static_cast<std::int64_t>(message.stamp)},
          {"kind", to_string(message.kind)},
          {"source", message.source}};
  if (!message.target.empty()) map["target"] = message.target;
  map["name"] = message.name;
  if (message.call != 0) map["call"] = static_cast<std::int64_t>(message.call);
  map["tick"] = static_cast<std::int64_t>(message.tick);
  if (!message.data.is_null()) map["data"] = message.data;
  return to_json(Value(std::move(map)));
}

}  // namespace sentree
