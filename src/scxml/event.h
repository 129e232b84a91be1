#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "sentree/base/value.h"

namespace sentree::scxml {

/// SCXML 5.10.1: who raised the event.
enum class EventType : std::uint8_t {
  kPlatform,  ///< By the processor itself: error.*, done.*.
  kInternal,  ///< By <raise>, or <send> to #_internal.
  kExternal,  ///< From outside, or by <send>.
};

[[nodiscard]] std::string_view to_string(EventType type);

/// An SCXML event (SCXML 5.10.1): the members of `_event`. Empty strings are `undefined` in scripts.
struct Event {
  std::string name = {};
  EventType type = EventType::kExternal;
  std::string sendid = {};
  std::string origin = {};
  std::string origintype = {};
  std::string invokeid = {};
  std::optional<Value> data = {};  ///< Nothing: `undefined`.

  std::string raw = {};  ///< The message as it came, from processors that have one (BasicHTTP); for looking at only.
  /// To `step`: the invoked chart that it is for, by what its _sessionid has behind "SESSION."; empty: the session
  /// itself. No chart sees it.
  std::string session = {};

  friend bool operator==(const Event&, const Event&) = default;
};

/// SCXML 3.12.1: "a.b" matches "a.b" and "a.b.c", not "a.bc"; "a.b.*" is "a.b"; "*" matches all.
[[nodiscard]] bool event_matches(std::string_view descriptor, std::string_view event_name);

/// URI and short name of the two I/O processors of the standard.
inline constexpr std::string_view kScxmlProcessor = "http://www.w3.org/TR/scxml/#SCXMLEventProcessor";
inline constexpr std::string_view kScxmlProcessorShort = "scxml";
/// Of a <send>; one without a type is for it, too.
[[nodiscard]] constexpr bool is_scxml_processor(std::string_view type) {
  return type.empty() || type == kScxmlProcessor || type == kScxmlProcessorShort;
}
inline constexpr std::string_view kBasicHttpProcessor = "http://www.w3.org/TR/scxml/#BasicHTTPEventProcessor";
inline constexpr std::string_view kBasicHttpProcessorShort = "basichttp";

}  // namespace sentree::scxml
