#include "sentree/scxml/event.h"

namespace sentree::scxml {

std::string_view to_string(EventType type) {
  switch (type) {
    case EventType::kPlatform: return "platform";
    case EventType::kInternal: return "internal";
    case EventType::kExternal: return "external";
  }
  return "external";
}

bool event_matches(std::string_view descriptor, std::string_view event_name) {
  if (descriptor == "*") return true;
  if (descriptor.ends_with(".*"))
    descriptor.remove_suffix(2);
  else if (descriptor.ends_with('.'))
    descriptor.remove_suffix(1);
  if (!event_name.starts_with(descriptor)) return false;
  return event_name.size() == descriptor.size() || event_name[descriptor.size()] == '.';
}

}  // namespace sentree::scxml
