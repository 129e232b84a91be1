#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "sentree/studio/server.h"

namespace sentree::cli {

/// Where the page is served when nobody says where, so that a page that is open finds the next run again.
inline constexpr std::uint16_t kStudioPort = 4711;

/// Where a server of an option listens: "4711", "0.0.0.0:4711", "[::1]:4711"; "true": 127.0.0.1 and `usual_port`.
struct ListenAt {
  std::string address = "127.0.0.1";
  std::uint16_t port = 0;
};
/// Nothing, and a message that names the option, if it is none of these.
[[nodiscard]] std::optional<ListenAt> listen_at(const std::string& option, const std::string& where,
                                                std::uint16_t usual_port);

/// "4711", "0.0.0.0:4711", "[::1]:4711", or "true" for the usual place. Nothing, and a message, if it is none of these.
[[nodiscard]] std::optional<studio::ServerOptions> page_options(const std::string& where, bool insecure);

/// Starts a server by `start(options)`; where nobody asked for a port, at the next free one.
template <class Start>
auto start_page(studio::ServerOptions options, bool any_port, Start&& start) {
  auto started = start(options);
  if (started || !any_port || started.error().code != "http.port-taken") return started;
  options.port = 0;
  return start(options);
}

/// Says where the page is, and opens it in a browser if that is wanted and there is a display.
void announce(const std::string& url, bool open);

}  // namespace sentree::cli
