#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/page.h"
#include "sentree/http/http.h"
#include "sentree/processes/control.h"
#include "sentree/text/json.h"

namespace sentree::cli {

namespace {

/// How long a process may take to say what it is.
constexpr std::chrono::seconds kPatience{2};
/// How long a run may take to read its own recording.
constexpr std::chrono::minutes kOpeningMax{2};
/// Bytes of what a page says about itself.
constexpr std::uint64_t kHealthMax = 4096;

std::optional<int> process_id(const std::string& text) {
  int pid = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), pid);
  if (error != std::errc() || end != text.data() + text.size() || pid <= 0) return std::nullopt;
  return pid;
}

// ---- A page elsewhere ----

struct PageAddress {
  std::string where;  // HOST:PORT
  std::string rest;   // behind "/": the token
};

std::optional<PageAddress> page_address(std::string_view text) {
  constexpr std::string_view kScheme = "http://";
  if (text.starts_with(kScheme)) text.remove_prefix(kScheme.size());
  const std::size_t slash = std::min(text.find('/'), text.size());
  PageAddress address{std::string(text.substr(0, slash)), std::string(text.substr(std::min(slash + 1, text.size())))};
  if (address.where.find(':') == std::string::npos) return std::nullopt;
  return address;
}

int not_an_address(const std::string& text) {
  say(fmt::format("--attach {}: neither the process id of a run nor the address of a page, HOST:PORT", text));
  return kUsage;
}

int attach_to_page(const PageAddress& address, bool open) {
  const std::string& where = address.where;
  const auto answer =
      http::send(fmt::format("http://{}/api/health", where), {}, {.body_bytes_max = kHealthMax, .timeout = kPatience});
  if (!answer && answer.error().code == "http.bad-url") return not_an_address(where);
  if (!answer && (answer.error().code == "http.unreachable" || answer.error().code == "http.timeout")) {
    say(
        fmt::format("nobody answers at {}; a run there has a page if it was started with --studio, and others may "
                    "reach it with --studio=HOST:PORT --insecure",
                    where));
    return kEnvironment;
  }
  const auto health = answer ? text::parse_json(answer->body) : tl::unexpected(answer.error());
  if (!health || health->find("mode") == nullptr || health->find("version") == nullptr) {
    say(fmt::format("what answers at {} is no page of Sentree", where));
    return kEnvironment;
  }
  announce(fmt::format("http://{}/{}", where, address.rest), open);
  if (health->find("mode")->text() != "live") say("it shows a recording");
  return kOk;
}

// ---- A run on this machine ----

// The run that is meant if nobody says which.
std::optional<int> only_run() {
  std::vector<processes::RunningRun> runs = processes::running_runs(kPatience);
  std::erase_if(runs, [](const processes::RunningRun& run) { return !run.has_page; });
  if (runs.size() == 1) return runs.front().pid;
  if (runs.empty()) {
    say("no mission runs in real time on this machine; start one with: sentree run PROJECT --clock real, or with a "
        "page: sentree run PROJECT --studio");
    return std::nullopt;
  }
  say("several missions run; choose one with --attach PID");
  for (const processes::RunningRun& run : runs)
    say(fmt::format("  {}  {}, at {} s", run.pid, run.scenario, shortest_decimal(run.time)));
  return std::nullopt;
}

int attach_to_run(int pid, const StudioCommand& command) {
  const auto run = processes::connect_control(pid);
  if (!run) {
    say(run.error().message);
    return kEnvironment;
  }
  const auto page = (*run)->call("page", Map{{"at", command.at}, {"insecure", command.insecure}},
                                 std::chrono::steady_clock::now() + kOpeningMax);
  if (!page) {
    const std::string process = fmt::format("process {}", pid);
    if (page.error().kind == rpc::CallErrorKind::kUnreachable)
      say(process + " is no run that goes on, or is one of another user");
    else
      say(fmt::format("{} does not open its page: {}", process, page.error().message));
    return kEnvironment;
  }
  const std::string url(page->find("url")->text());
  if (url.empty()) {
    say(fmt::format("process {} cannot be attached to: {}", pid, page->find("problem")->text()));
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
  return not_an_address(*command.attach);
}

}  // namespace sentree::cli
