#include <fmt/format.h>

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <functional>
#include <mutex>
#include <thread>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/groot/server.h"
#include "sentree/processes/control.h"
#include "sentree/processes/environment.h"
#include "sentree/processes/remote_skill.h"
#include "sentree/project/plan.h"
#include "sentree/rpc/certificates.h"
#include "sentree/rpc/middleware.h"
#include "sentree/rpc/server.h"
#include "sentree/studio/foxglove.h"

namespace sentree::cli {

namespace {

// What one check found: good, or what to do.
struct HealthFinding {
  std::string name;
  std::string detail;
  std::string remedy;    // empty: good
  bool is_there = true;  // false: this build or machine has it not, which is no fault
};

HealthFinding check_shipped() {
  const auto interfaces = project::shipped_folder("interfaces");
  if (interfaces.empty() || !processes::skill_interface() || !processes::observer_interface()) {
    return {"interfaces", "the Thrift interfaces that come with Sentree are not found",
            "install it whole: cmake --install build/release"};
  }
  return {"interfaces", interfaces.string(), ""};
}

HealthFinding check_socket(const std::string& name, const std::string& address_text) {
  const auto interface = processes::skill_interface();
  const auto address = rpc::Address::parse(address_text);
  if (!interface || !address) return {name, "not tried", "mend the findings above first"};
  auto service = std::make_shared<rpc::FunctionService>(
      *interface, [](const idl::Method&, const Value&) -> rpc::Outcome { return Value(); });
  const auto server = rpc::Server::start(*address, {{"skill", std::move(service)}});
  if (!server)
    return {name, server.error().message,
            "parts in processes of their own cannot be reached this way; use another kind of address"};
  return {name, to_string((*server)->address()), ""};
}

HealthFinding check_control_folder() {
  const auto folder = processes::control_folder();
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error || access(folder.c_str(), W_OK) != 0) {
    return {"control folder", folder.string() + " cannot be written",
            "set XDG_RUNTIME_DIR to a folder of yours; otherwise sentree call finds no run"};
  }
  return {"control folder", folder.string(), ""};
}

// Only who uses tls:// needs certificates.
HealthFinding check_certificates() {
  constexpr int kDaysWarned = 14;
  const std::string name = "certificates";
  const rpc::TlsFiles files = processes::environment_tls();
  if (files.empty()) return {name, "none; tls:// addresses need some, see docs/how-to/certificates.md", ""};
  const auto certificate = rpc::examine(files);
  if (!certificate)
    return {name, certificate.error().message, "docs/how-to/certificates.md says how to make and name them"};
  const std::string days = fmt::format(", for {} more days", certificate->days_left);
  if (certificate->names.empty())
    return {
        name, fmt::format("{} names no host{}", files.certificate, days),
        "others cannot connect to what listens here; make it with a subjectAltName, see docs/how-to/certificates.md"};
  return {name, fmt::format("{} of {}{}", files.certificate, certificate->names, days),
          certificate->days_left < kDaysWarned ? "make a new one before it expires" : ""};
}

// Nobody needs it who does not use Groot, so its absence is no fault.
HealthFinding check_groot() {
  if (groot::is_built()) return {"Groot", "sentree run --groot and sentree watch are there (ZeroMQ)", ""};
  return {"Groot",
          "built without ZeroMQ; for --groot and sentree watch install libzmq3-dev and cppzmq-dev, and build again", "",
          false};
}

// Somebody else who listens there is no fault: another port will do.
HealthFinding check_foxglove() {
  const std::string port = std::to_string(studio::kFoxglovePort);
  const bool is_free = studio::Foxglove::start({}).has_value();
  return {"Foxglove",
          is_free ? "sentree run --foxglove is there, at port " + port
                  : fmt::format("sentree run --foxglove is there; port {} is taken, so say --foxglove=PORT", port),
          ""};
}

// What addresses can be, and who would answer.
std::vector<HealthFinding> check_middlewares() {
  std::vector<HealthFinding> findings;
  for (const rpc::Middleware* each : rpc::middlewares()) {
    std::string schemes;
    for (const std::string& scheme : each->schemes()) schemes += (schemes.empty() ? "" : ", ") + scheme;
    const std::string missing = each->lacks();
    findings.push_back({schemes, missing.empty() ? each->about() : missing, "", missing.empty()});
  }
  return findings;
}

// How late a timer of 1 ms wakes up: what the machine adds to the jitter of ticks.
HealthFinding check_timer() {
  std::mutex mutex;
  std::condition_variable never;
  std::unique_lock lock(mutex);
  std::chrono::nanoseconds worst{0};
  for (int i = 0; i < 100; ++i) {
    const auto due = std::chrono::steady_clock::now() + std::chrono::milliseconds(1);
    never.wait_until(lock, due, [] { return false; });
    worst =
        std::max(worst, std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now() - due));
  }
  const double worst_ms = static_cast<double>(worst.count()) / 1e6;
  char text[64];
  std::snprintf(text, sizeof text, "a timer wakes at most %.2f ms late", worst_ms);
  if (worst_ms > 20) return {"timer", text, "the machine is busy; ticks will jitter in real time"};
  return {"timer", text, ""};
}

HealthFinding check_cores() {
  const unsigned cores = std::thread::hardware_concurrency();
  const std::string text = fmt::format("{} cores", cores);
  if (cores < 2) return {"processor", text, "real time works better with two"};
  return {"processor", text, ""};
}

std::vector<HealthFinding> examine() {
  std::vector<HealthFinding> findings{
      check_shipped(),
      check_control_folder(),
      check_socket(
          "unix sockets",
          fmt::format("unix:{}", (processes::control_folder() / fmt::format("doctor-{}.sock", getpid())).string())),
      check_socket("loopback TCP", "tcp://127.0.0.1:0"),
      check_certificates(),
      check_groot(),
      check_foxglove(),
      check_timer(),
      check_cores()};
  for (HealthFinding& finding : check_middlewares()) findings.push_back(std::move(finding));
  return findings;
}

bool all_good(const std::vector<HealthFinding>& findings) {
  return std::all_of(findings.begin(), findings.end(), [](const HealthFinding& f) { return f.remedy.empty(); });
}

Value as_value(const std::vector<HealthFinding>& findings) {
  List list;
  for (const HealthFinding& finding : findings) {
    list.push_back(Map{{"name", finding.name},
                       {"ok", finding.remedy.empty()},
                       {"there", finding.is_there},
                       {"detail", finding.detail},
                       {"remedy", finding.remedy}});
  }
  return Map{{"ok", all_good(findings)}, {"checks", std::move(list)}};
}

}  // namespace

Value examine_machine() { return as_value(examine()); }

int doctor(const DoctorCommand& command) {
  const std::vector<HealthFinding> findings = examine();
  if (command.json) {
    print(to_json(as_value(findings)) + "\n");
  } else {
    for (const HealthFinding& finding : findings) {
      const char* const mark = !finding.remedy.empty() ? "✗ " : finding.is_there ? "✓ " : "– ";
      print(fmt::format("{}{}: {}\n", mark, finding.name, finding.detail));
      if (!finding.remedy.empty()) print(fmt::format("    {}\n", finding.remedy));
    }
  }
  return all_good(findings) ? kOk : kEnvironment;
}

}  // namespace sentree::cli
