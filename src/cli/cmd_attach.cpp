#include <netdb.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <memory>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/page.h"
#include "sentree/runtime/control.h"
#include "sentree/text/json.h"

namespace sentree::cli {

namespace {

/// How long a process may take to say what it is.
constexpr std::chrono::seconds kPatience{2};
/// How long a run may take to read its own recording.
constexpr std::chrono::minutes kOpeningMax{2};
/// Of what a page says about itself.
constexpr std::size_t kHealthMax = 4096;

std::optional<int> process_id(const std::string& text) {
  int pid = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), pid);
  if (error != std::errc() || end != text.data() + text.size() || pid <= 0) return std::nullopt;
  return pid;
}

// ---- A page elsewhere ----

struct PageAddress {
  std::string host;
  std::string port;
  std::string rest;  // behind "/": the token
};

std::optional<PageAddress> page_address(std::string text) {
  constexpr std::string_view kScheme = "http://";
  if (text.starts_with(kScheme)) text.erase(0, kScheme.size());
  PageAddress address;
  const std::size_t slash = text.find('/');
  if (slash != std::string::npos) {
    address.rest = text.substr(slash + 1);
    text.erase(slash);
  }
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) return std::nullopt;
  address.host = text.substr(0, colon);
  address.port = text.substr(colon + 1);
  const auto port = process_id(address.port);
  if (!port || *port > 65535 || address.host.find_first_of("@ ") != std::string::npos) return std::nullopt;
  return address;
}

struct Closing {
  int socket = -1;
  ~Closing() {
    if (socket >= 0) ::close(socket);
  }
};

// The answer to a request for `path`, head and body. Nothing if nobody answers.
std::optional<std::string> fetch(const PageAddress& address, const std::string& path) {
  std::string host = address.host;
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* list = nullptr;
  if (::getaddrinfo(host.c_str(), address.port.c_str(), &hints, &list) != 0) return std::nullopt;
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(list, &::freeaddrinfo);
  for (const addrinfo* each = list; each != nullptr; each = each->ai_next) {
    const Closing closing{::socket(each->ai_family, each->ai_socktype | SOCK_CLOEXEC, each->ai_protocol)};
    const timeval patience{.tv_sec = kPatience.count(), .tv_usec = 0};
    ::setsockopt(closing.socket, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    ::setsockopt(closing.socket, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    if (::connect(closing.socket, each->ai_addr, each->ai_addrlen) != 0) continue;
    const std::string request =
        "GET " + path + " HTTP/1.1\r\nHost: " + address.host + ":" + address.port + "\r\nConnection: close\r\n\r\n";
    if (::send(closing.socket, request.data(), request.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(request.size()))
      continue;
    std::string answer;
    char piece[1024];
    for (ssize_t got = 0; answer.size() < kHealthMax && (got = ::recv(closing.socket, piece, sizeof piece, 0)) > 0;)
      answer.append(piece, static_cast<std::size_t>(got));
    return answer;
  }
  return std::nullopt;
}

int attach_to_page(const PageAddress& address, bool open) {
  const std::string where = address.host + ":" + address.port;
  const auto answer = fetch(address, "/api/health");
  if (!answer) {
    say("nobody answers at " + where +
        "; a run there has a page if it was started with --studio, and others may reach " +
        "it with --studio=HOST:PORT --insecure");
    return kEnvironment;
  }
  const std::size_t body = answer->find("\r\n\r\n");
  const auto health = body != std::string::npos ? text::parse_json(std::string_view(*answer).substr(body + 4))
                                                : fail("attach.no-page", "no answer of HTTP");
  if (!health || health->find("mode") == nullptr || health->find("version") == nullptr) {
    say("what answers at " + where + " is no page of Sentree");
    return kEnvironment;
  }
  announce("http://" + where + "/" + address.rest, open);
  if (health->find("mode")->text() != "live") say("it shows a recording");
  return kOk;
}

// ---- A run on this machine ----

// The run that is meant if nobody says which.
std::optional<int> only_run() {
  std::vector<runtime::RunningRun> runs = runtime::running_runs(kPatience);
  std::erase_if(runs, [](const runtime::RunningRun& run) { return !run.has_page; });
  if (runs.size() == 1) return runs.front().pid;
  if (runs.empty()) {
    say("no mission runs in real time on this machine; start one with: sentree run PROJECT --clock real, or with a "
        "page: sentree run PROJECT --studio");
    return std::nullopt;
  }
  say("several missions run; choose one with --attach PID");
  for (const runtime::RunningRun& run : runs)
    say("  " + std::to_string(run.pid) + "  " + run.scenario + ", at " + shortest_decimal(run.time) + " s");
  return std::nullopt;
}

int attach_to_run(int pid, const StudioCommand& command) {
  const auto run = runtime::connect_control(pid);
  if (!run) {
    say(run.error().message);
    return kEnvironment;
  }
  const auto page =
      (*run)->call("page", Map{{"at", command.at}, {"insecure", command.insecure}},
                   {.source = "control", .call = 0, .deadline = std::chrono::steady_clock::now() + kOpeningMax});
  if (!page) {
    const std::string process = "process " + std::to_string(pid);
    if (page.error().kind == rpc::CallErrorKind::kUnreachable)
      say(process + " is no run that goes on, or is one of another user");
    else
      say(process + " does not open its page: " + page.error().message);
    return kEnvironment;
  }
  const std::string url(page->find("url")->text());
  if (url.empty()) {
    say("process " + std::to_string(pid) + " cannot be attached to: " + std::string(page->find("problem")->text()));
    return kEnvironment;
  }
  announce(url, command.open);
  return kOk;
}

}  // namespace

int attach(const StudioCommand& command) {
  // What is wrong with it is said here, not by the run.
  if (!command.at.empty() && !page_options(command.at, command.insecure)) return kUsage;
  if (command.attach->empty()) {
    const auto pid = only_run();
    return pid ? attach_to_run(*pid, command) : kEnvironment;
  }
  if (const auto pid = process_id(*command.attach)) return attach_to_run(*pid, command);
  if (const auto address = page_address(*command.attach)) return attach_to_page(*address, command.open);
  say("--attach " + *command.attach + ": neither the process id of a run nor the address of a page, HOST:PORT");
  return kUsage;
}

}  // namespace sentree::cli
