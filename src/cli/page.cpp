#include "sentree/cli/page.h"

#include <fmt/format.h>

#include <fcntl.h>
#include <spawn.h>
#include <unistd.h>

#include <charconv>
#include <cstdlib>

#include "sentree/cli/output.h"
#include "sentree/studio/assets.h"

extern char** environ;

namespace sentree::cli {

namespace {

bool has_display() {
  const auto is_set = [](const char* name) {
    const char* value = std::getenv(name);
    return value != nullptr && *value != '\0';
  };
  return is_set("DISPLAY") || is_set("WAYLAND_DISPLAY");
}

void open_in_browser(const std::string& url) {
  if (!has_display()) {
    say("there is no display to open a browser on; open the address above yourself");
    return;
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  std::string program = "xdg-open";
  std::string argument = url;
  char* const arguments[] = {program.data(), argument.data(), nullptr};
  pid_t pid = 0;
  if (posix_spawnp(&pid, program.c_str(), &actions, nullptr, arguments, environ) != 0)
    say("xdg-open is not there (package xdg-utils); open the address above yourself");
  posix_spawn_file_actions_destroy(&actions);
}

}  // namespace

std::optional<ListenAt> listen_at(const std::string& option, const std::string& where, std::uint16_t usual_port) {
  ListenAt at{.port = usual_port};
  if (where == "true") return at;
  std::string port = where;
  if (const std::size_t colon = where.rfind(':'); colon != std::string::npos) {
    at.address = where.substr(0, colon);
    port = where.substr(colon + 1);
    if (at.address == "localhost") at.address = "127.0.0.1";
    if (at.address.starts_with('[') && at.address.ends_with(']'))
      at.address = at.address.substr(1, at.address.size() - 2);
  }
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), at.port);
  if (error == std::errc() && end == port.data() + port.size() && !at.address.empty()) return at;
  say(fmt::format("{}={}: neither a port nor an address such as 127.0.0.1:{}", option, where, usual_port));
  return std::nullopt;
}

std::optional<studio::ServerOptions> page_options(const std::string& where, bool insecure) {
  const auto at = listen_at("--studio", where, kStudioPort);
  if (!at) return std::nullopt;
  studio::ServerOptions options;
  options.address = at->address;
  options.port = at->port;
  options.insecure = insecure;
  options.version = SENTREE_VERSION;
  return options;
}

void announce(const std::string& url, bool open) {
  say("the page: " + url);
  if (studio::assets().empty()) {
    say("this program was built without the web page itself: install nodejs and npm, configure and build again");
  }
  if (open) open_in_browser(url);
}

}  // namespace sentree::cli
