#include "sentree/processes/control.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdlib>

#include <fmt/format.h>

#include "sentree/idl/conform.h"
#include "sentree/project/plan.h"
#include "sentree/runtime/tap.h"
#include "sentree/text/file.h"
#include "sentree/text/json.h"

namespace sentree::processes {

using runtime::ControlHandler;
using runtime::Tap;

namespace {

Result<idl::ServicePtr> control_interface() {
  const auto source = text::read_file(project::shipped_folder("interfaces") / "control.thrift", "control.thrift");
  if (!source) return tl::unexpected(source.error());
  const auto schema = idl::Schema::load(*source, "control.thrift");
  if (!schema.value) return tl::unexpected(schema.diagnostics.front());
  return idl::find_service(*schema.value, "Control");
}

rpc::Address socket_of(int pid) {
  rpc::Address address;
  address.kind = rpc::Address::Kind::kUnix;
  address.path = (control_folder() / fmt::format("{}.sock", pid)).string();
  return address;
}

rpc::Outcome serve(const ControlHandler& handler, const idl::Method& method, const Value& arguments) {
  if (method.name == "info") {
    return Map{{"scenario", handler.scenario()},
               {"pid", static_cast<std::int64_t>(getpid())},
               {"time", seconds(handler.now())},
               {"has_page", handler.open_page != nullptr}};
  }
  if (method.name == "page") {
    if (!handler.open_page) return Map{{"problem", "it has no page: it is no run of a mission"}};
    const auto page = handler.open_page(
        {.at = std::string(arguments.find("at")->text()), .insecure = *arguments.find("insecure")->as_bool()});
    if (!page) return Map{{"problem", page.error().message}};
    return Map{{"url", page->url}, {"recording", page->recording}};
  }
  if (method.name == "services") {
    List list;
    for (const auto& entry : handler.services()) {
      List methods;
      for (const idl::Method* served : entry.service->methods) methods.push_back(idl::signature(*served));
      list.push_back(Map{
          {"name", entry.name}, {"interface", entry.service->name}, {"at", entry.at}, {"methods", std::move(methods)}});
    }
    return to_json(Value(std::move(list)));
  }
  if (method.name == "observe") {
    if (handler.tap == nullptr)
      return tl::unexpected(rpc::CallError{rpc::CallErrorKind::kProtocol, "nothing is observed here", {}, {}});
    const auto wait = std::chrono::milliseconds(*arguments.find("wait_ms")->as_int());
    Tap::Batch batch = handler.tap->take(*arguments.find("after")->as_int(), arguments.find("pattern")->text(), wait);
    List messages;
    for (std::string& message : batch.messages) messages.emplace_back(std::move(message));
    return Map{{"upto", static_cast<std::int64_t>(batch.next)},
               {"missed", static_cast<std::int64_t>(batch.missed)},
               {"messages", std::move(messages)}};
  }
  const auto args = text::parse_json(arguments.find("arguments")->text());
  mission::CallOutcome outcome;
  if (!args)
    outcome = mission::CallOutcome::failed(rpc::CallErrorKind::kArguments, args.error().message);
  else
    outcome = handler.call(std::string(arguments.find("target")->text()), std::string(arguments.find("method")->text()),
                           *args);
  return Map{{"ok", outcome.ok},
             {"result", outcome.ok ? to_json(outcome.result) : ""},
             {"kind", outcome.kind_word()},
             {"message", outcome.message}};
}

// Holds the control folder: no socket comes into being in it meanwhile, or none is taken away.
class FolderLock {
 public:
  FolderLock(const std::filesystem::path& folder, int kind)
      : folder_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC)),
        is_held_(folder_ >= 0 && ::flock(folder_, kind) == 0) {}
  ~FolderLock() {
    if (folder_ >= 0) ::close(folder_);
  }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  [[nodiscard]] bool is_held() const { return is_held_; }

 private:
  int folder_;
  bool is_held_;
};

// Whether nobody listens there any more. Processes of other containers have ids that nobody lives under here.
bool is_left_behind(const std::filesystem::path& socket) {
  sockaddr_un at{};
  at.sun_family = AF_UNIX;
  struct stat facts {};
  if (socket.native().size() >= sizeof at.sun_path || ::lstat(socket.c_str(), &facts) != 0 || !S_ISSOCK(facts.st_mode))
    return false;
  socket.native().copy(at.sun_path, socket.native().size());
  const int probe = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const bool refused =
      ::connect(probe, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0 && errno == ECONNREFUSED;
  ::close(probe);
  return refused;
}

// Process ids whose sockets are there and who live. Sockets of processes that were killed are taken away.
std::vector<int> runs() {
  std::vector<int> pids;
  std::error_code error;
  const FolderLock lock(control_folder(), LOCK_EX | LOCK_NB);
  for (std::filesystem::directory_iterator it(control_folder(), error), end; !error && it != end; it.increment(error)) {
    if (it->path().extension() != ".sock") continue;
    const std::string stem = it->path().stem().string();
    int pid = 0;
    const auto read = std::from_chars(stem.data(), stem.data() + stem.size(), pid);
    if (read.ec != std::errc() || read.ptr != stem.data() + stem.size() || pid <= 0) continue;
    if (::kill(pid, 0) == 0)
      pids.push_back(pid);
    else if (errno == ESRCH && lock.is_held() && is_left_behind(it->path()))
      ::unlink(it->path().c_str());
  }
  std::sort(pids.begin(), pids.end());
  return pids;
}

}  // namespace

std::filesystem::path control_folder() {
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  if (runtime != nullptr && *runtime != '\0') return std::filesystem::path(runtime) / "sentree";
  return std::filesystem::temp_directory_path() / fmt::format("sentree-{}", getuid());
}

Result<std::unique_ptr<rpc::Server>> start_control(ControlHandler handler) {
  auto interface = control_interface();
  if (!interface) return tl::unexpected(interface.error());
  const std::filesystem::path folder = control_folder();
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  std::filesystem::permissions(folder, std::filesystem::perms::owner_all, error);
  if (error)
    return fail("file.unwritable", "the control folder cannot be made: " + error.message(),
                SourceSpan{folder.string()});
  auto service = std::make_shared<rpc::FunctionService>(
      *interface, [handler = std::move(handler)](const idl::Method& method, const Value& arguments) -> rpc::Outcome {
        return serve(handler, method, arguments);
      });
  (void)runs();  // takes away what others have left
  const FolderLock lock(folder, LOCK_SH);
  return rpc::Server::start(socket_of(getpid()), {{"control", std::move(service)}});
}

std::vector<RunningRun> running_runs(Duration patience) {
  std::vector<RunningRun> found;
  for (const int pid : runs()) {
    const auto client = connect_control(pid);
    if (!client) continue;
    const auto info = (*client)->call("info", Map(), std::chrono::steady_clock::now() + patience);
    if (!info) continue;
    const Value* has_page = info->find("has_page");
    found.push_back({pid, std::string(info->find("scenario")->text()), info->find("time")->number(),
                     has_page != nullptr && has_page->as_bool() != nullptr && *has_page->as_bool()});
  }
  return found;
}

Result<std::unique_ptr<rpc::Client>> connect_control(int pid) {
  auto interface = control_interface();
  if (!interface) return tl::unexpected(interface.error());
  if (pid == 0) {
    const std::vector<int> pids = runs();
    if (pids.empty())
      return fail(
          "control.no-run",
          "no mission runs in real time on this machine; start one with: sentree run PROJECT --clock real, or a robot "
          "alone with: sentree sim --world FILE");
    if (pids.size() > 1) {
      std::string list;
      for (const int each : pids) list += (list.empty() ? "" : ", ") + std::to_string(each);
      return fail("control.many-runs",
                  fmt::format("several missions run (process ids {}); choose one with --run PID", list));
    }
    pid = pids.front();
  }
  return rpc::Client::remote(socket_of(pid), std::move(*interface), {.target = "control"});
}

}  // namespace sentree::processes
