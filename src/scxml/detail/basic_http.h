#pragma once

#include <string>
#include <string_view>

#include "sentree/scxml/event.h"
#include "sentree/scxml/host.h"

namespace sentree::scxml {

// The BasicHTTP event I/O processor (SCXML C.2) without its sockets: what a <send> becomes as a request, and what a
// request becomes as an event. A program that offers it lists kBasicHttpProcessor among `Host::processors`, with the
// address it listens on as location, posts `to_http` of each such `OutgoingSend`, and steps the session with
// `from_http` of each request.

struct HttpPost {
  std::string content_type;
  std::string body;
};

/// The event's name as `_scxmleventname`, then params, form-encoded; or the content.
[[nodiscard]] HttpPost to_http(const OutgoingSend& send);

/// @param raw  The whole request, for `_event.raw`.
/// The event is called after `_scxmleventname` if the form has that, else "HTTP.POST" (after the method).
[[nodiscard]] Event from_http(std::string_view method, std::string_view content_type, std::string_view body,
                              std::string raw);

}  // namespace sentree::scxml
