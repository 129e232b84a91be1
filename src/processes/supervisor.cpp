#include "sentree/processes/supervisor.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <mutex>
#include <optional>
#include <sstream>
#include <system_error>
#include <thread>

#include <fmt/format.h>

#include "sentree/base/exit_status.h"
#include "sentree/processes/remote_service.h"
#include "sentree/text/file.h"

namespace sentree::processes {

using runtime::ProcessEvent;

namespace {

using SteadyClock = std::chrono::steady_clock;
using SteadyTime = SteadyClock::time_point;

constexpr std::string_view kAnnouncement = "listening on ";
// Read before the announcement; a program that prints more without it is not ours.
constexpr std::size_t kOutputMax = 64 * 1024;
// How long an ended process may still be a child that cannot be waited for.
constexpr std::chrono::milliseconds kReapInterval{10};
// Whether one that was left behind listens is looked at so often.
constexpr std::chrono::milliseconds kProbeInterval{10};
constexpr std::chrono::milliseconds kEndOfKilled{2000};

struct Spawned {
  pid_t pid = -1;
  int output = -1;
};

Result<Spawned> spawn(const std::string& name, const std::string& program, const std::vector<std::string>& arguments,
                      bool survives) {
  int pipes[2];
  if (pipe2(pipes, O_CLOEXEC) != 0)
    return fail("process.start",
                fmt::format("process \"{}\" cannot be started: {}", name, std::generic_category().message(errno)));
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);

  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0) {
    // Between fork and exec only what is safe in a process that had threads.
    // Until it is known by its command line it does not survive either; `outlive_parent` ends that.
    prctl(PR_SET_PDEATHSIG, survives ? SIGKILL : SIGTERM);
    if (getppid() != parent) _exit(127);
    dup2(pipes[1], STDOUT_FILENO);
    sigset_t none;
    sigemptyset(&none);
    pthread_sigmask(SIG_SETMASK, &none, nullptr);
    // Ctrl-C in the terminal is for the run, which ends its processes in order.
    setpgid(0, 0);
    execv(program.c_str(), argv.data());
    _exit(127);
  }
  const int why = errno;
  close(pipes[1]);
  if (pid < 0) {
    close(pipes[0]);
    return fail("process.start",
                fmt::format("process \"{}\" cannot be started: {}", name, std::generic_category().message(why)));
  }
  fcntl(pipes[0], F_SETFL, O_NONBLOCK);
  return Spawned{pid, pipes[0]};
}

struct Child {
  enum class State { kStarting, kRunning, kEnding, kWaiting, kGone };

  ProcessSpec spec;
  State state = State::kStarting;
  pid_t pid = -1;
  int output = -1;                    // of an adopted one: what says that it has ended
  bool adopted = false;               // somebody else's child
  std::string text;                   // printed so far, until the announcement is found
  std::string address;                // where it listens, once it has said so
  SteadyTime due{};                   // kStarting: patience ends; kEnding: look again; kWaiting: start again
  std::optional<SteadyTime> kill_at;  // it was asked to end
  std::deque<SteadyTime> restarts;
  bool killed = false;  // by us, and not yet seen to have ended
  bool wanted = false;  // to be started again whatever its restarts say
};

}  // namespace

class Supervisor::Impl {
 public:
  Impl(std::string program, std::function<void(const ProcessEvent&)> on_event)
      : program_(std::move(program)), on_event_(std::move(on_event)), wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    thread_ = std::thread([this] { watch(); });
  }
  ~Impl() {
    end(std::chrono::milliseconds(2000));
    if (wake_ >= 0) close(wake_);
  }

  // The kernel's signal on our death comes when the *thread* that forked ends: so that thread is the watcher.
  Result<std::string> start(ProcessSpec spec) {
    std::unique_lock lock(mutex_);
    Child& child = *children_.emplace_back(std::make_unique<Child>());
    child.spec = std::move(spec);
    child.state = Child::State::kWaiting;
    child.due = SteadyClock::now();
    poke();
    changed_.wait(
        lock, [&] { return child.state == Child::State::kRunning || child.state == Child::State::kGone || closing_; });
    if (child.state == Child::State::kRunning) return child.address;
    if (start_error_) return tl::unexpected(*start_error_);
    return fail("process.no-address",
                fmt::format("process \"{}\" did not say within {} s where it listens; its own message stands above",
                            child.spec.name, kStartPatience.count()));
  }

  bool adopt(ProcessSpec spec, pid_t pid, std::uint64_t begun) {
    const int watched = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
    if (watched < 0) return false;
    if (begun == 0 || process_begun(pid) != begun || !await_listening(spec, pid, watched)) {
      close(watched);
      return false;
    }
    const std::lock_guard lock(mutex_);
    Child& child = *children_.emplace_back(std::make_unique<Child>());
    child.address = spec.listen;
    child.spec = std::move(spec);
    child.state = Child::State::kRunning;
    child.pid = pid;
    child.output = watched;
    child.adopted = true;
    poke();
    return true;
  }

  std::string address(const std::string& name) {
    const std::lock_guard lock(mutex_);
    const Child* child = find(name);
    return child != nullptr ? child->address : std::string();
  }

  std::vector<Started> all() {
    const std::lock_guard lock(mutex_);
    std::vector<Started> all;
    for (const auto& child : children_) {
      if (!child->address.empty()) all.push_back({child->spec.name, std::max(child->pid, 0), child->address});
    }
    return all;
  }

  void kill(const std::string& name) {
    const std::lock_guard lock(mutex_);
    Child* child = find(name);
    if (child == nullptr || child->pid <= 0) return;
    child->killed = true;
    ::kill(child->pid, SIGKILL);
  }

  bool restart(const std::string& name) {
    const std::lock_guard lock(mutex_);
    Child* child = find(name);
    if (child == nullptr || closing_ || child->kill_at) return false;
    if (child->state == Child::State::kGone) {
      child->state = Child::State::kWaiting;
      child->due = SteadyClock::now();
      poke();
      return true;
    }
    // One that was killed may not have been seen to end.
    child->wanted = child->killed;
    return child->wanted;
  }

  void end(const std::vector<std::string>& names, std::chrono::milliseconds patience) {
    std::unique_lock lock(mutex_);
    std::vector<const Child*> asked;
    for (const std::string& name : names) {
      if (Child* child = find(name)) {
        ask_to_end(*child, patience);
        asked.push_back(child);
      }
    }
    poke();
    changed_.wait(lock, [&] {
      return std::all_of(asked.begin(), asked.end(),
                         [](const Child* child) { return child->state == Child::State::kGone; });
    });
  }

  void end(std::chrono::milliseconds patience) {
    {
      const std::lock_guard lock(mutex_);
      if (!thread_.joinable()) return;
      closing_ = true;
      for (const auto& child : children_) ask_to_end(*child, patience);
      poke();
    }
    changed_.notify_all();
    thread_.join();
  }

 private:
  // False: it ends before. `watched` is its descriptor; one that has ended may still be listed until its parent has
  // looked.
  static bool await_listening(const ProcessSpec& spec, pid_t pid, int watched) {
    const auto address = rpc::Address::parse(spec.listen);
    auto probe = address ? Probe::to(*address, spec.name) : tl::unexpected(address.error());
    if (!probe) return false;
    const auto ended_within = [&](std::chrono::milliseconds wait) {
      pollfd ended{watched, POLLIN, 0};
      return poll(&ended, 1, static_cast<int>(wait.count())) != 0;
    };
    const SteadyTime until = SteadyClock::now() + kStartPatience;
    while (!ended_within(std::chrono::milliseconds(0))) {
      if (!probe->ask(until)) return true;
      if (SteadyClock::now() < until) {
        if (ended_within(kProbeInterval)) return false;
        continue;
      }
      ::kill(pid, SIGKILL);
      ended_within(kEndOfKilled);
      return false;
    }
    return false;
  }

  Child* find(const std::string& name) {
    const auto found =
        std::find_if(children_.begin(), children_.end(), [&](const auto& child) { return child->spec.name == name; });
    return found == children_.end() ? nullptr : found->get();
  }

  static void ask_to_end(Child& child, std::chrono::milliseconds patience) {
    if (!child.kill_at) child.kill_at = SteadyClock::now() + patience;
    if (child.state == Child::State::kWaiting) child.state = Child::State::kGone;
    if (child.pid <= 0) return;
    ::kill(child.pid, SIGTERM);
    ::kill(child.pid, SIGCONT);  // a stopped one would not hear it
  }

  void poke() const {
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = write(wake_, &one, sizeof one);
  }

  void watch() {
    std::unique_lock lock(mutex_);
    for (;;) {
      const SteadyTime now = SteadyClock::now();
      std::vector<ProcessEvent> events;
      SteadyTime next = now + std::chrono::hours(1);
      bool any_alive = false;
      for (const auto& child : children_) {
        advance(*child, now, events);
        any_alive = any_alive || child->pid > 0;
        if (child->state != Child::State::kRunning && child->state != Child::State::kGone)
          next = std::min(next, child->due);
        if (child->kill_at && child->pid > 0) next = std::min(next, now + kReapInterval);
      }
      if (closing_ && !any_alive) return;
      std::vector<pollfd> watched{{wake_, POLLIN, 0}};
      for (const auto& child : children_) {
        if (child->output >= 0) watched.push_back({child->output, POLLIN, 0});
      }
      lock.unlock();
      changed_.notify_all();
      for (const ProcessEvent& event : events) on_event_(event);
      // Without a descriptor to be woken by, it looks by itself.
      if (wake_ < 0) next = std::min(next, SteadyClock::now() + kReapInterval);
      const auto wait = std::chrono::ceil<std::chrono::milliseconds>(next - SteadyClock::now());
      if (events.empty()) poll(watched.data(), watched.size(), static_cast<int>(std::max<long>(wait.count(), 0)));
      std::uint64_t pokes = 0;
      [[maybe_unused]] const ssize_t got = read(wake_, &pokes, sizeof pokes);
      lock.lock();
    }
  }

  void advance(Child& child, SteadyTime now, std::vector<ProcessEvent>& events) {
    if (child.output >= 0) listen(child, events);
    if (child.kill_at && now >= *child.kill_at && child.pid > 0) ::kill(child.pid, SIGKILL);
    switch (child.state) {
      case Child::State::kStarting:
        if (now >= child.due) ::kill(child.pid, SIGKILL);
        break;
      case Child::State::kEnding: reap(child, now, events); break;
      case Child::State::kWaiting:
        if (now >= child.due) spawn_child(child, now, events);
        break;
      case Child::State::kRunning:
      case Child::State::kGone: break;
    }
  }

  // Reads what the child prints, so that it never waits for us; the end of its output is its end.
  void listen(Child& child, std::vector<ProcessEvent>& events) {
    char buffer[4096];
    for (; !child.adopted;) {
      const ssize_t got = read(child.output, buffer, sizeof buffer);
      if (got < 0) return;  // nothing now
      if (got == 0) break;
      if (child.state != Child::State::kStarting || child.text.size() >= kOutputMax) continue;
      child.text.append(buffer, static_cast<std::size_t>(got));
      const auto at = child.text.find(kAnnouncement);
      const auto line_end = at == std::string::npos ? at : child.text.find('\n', at);
      if (line_end == std::string::npos) continue;
      const bool first = child.address.empty();
      child.address = child.text.substr(at + kAnnouncement.size(), line_end - at - kAnnouncement.size());
      child.spec.listen = child.address;
      child.text.clear();
      child.state = Child::State::kRunning;
      if (!first) events.push_back({ProcessEvent::Kind::kRestarted, child.spec.name, child.pid, {}});
    }
    if (pollfd ended{child.output, POLLIN, 0}; child.adopted && poll(&ended, 1, 0) <= 0) return;
    close(child.output);
    child.output = -1;
    child.state = Child::State::kEnding;
    child.due = SteadyTime();
  }

  void reap(Child& child, SteadyTime now, std::vector<ProcessEvent>& events) {
    if (now < child.due) return;
    int status = 0;
    // Whose child it was has waited for an adopted one.
    const bool adopted = std::exchange(child.adopted, false);
    if (!adopted && waitpid(child.pid, &status, WNOHANG) == 0) {
      child.due = now + kReapInterval;
      return;
    }
    const pid_t pid = std::exchange(child.pid, -1);
    const bool never_listened = child.address.empty();
    if (child.kill_at || never_listened) {
      child.state = Child::State::kGone;
      return;
    }
    events.push_back({ProcessEvent::Kind::kExited, child.spec.name, pid,
                      adopted ? "how is not known, since an earlier run started it" : describe_exit(status)});
    wait_or_give_up(child, now, events);
  }

  void wait_or_give_up(Child& child, SteadyTime now, std::vector<ProcessEvent>& events) {
    while (!child.restarts.empty() && now - child.restarts.front() > kRestartWindow) child.restarts.pop_front();
    child.killed = false;
    if (std::exchange(child.wanted, false)) {
      child.state = Child::State::kWaiting;
      child.due = now;
      return;
    }
    if (static_cast<int>(child.restarts.size()) >= child.spec.restarts) {
      child.state = Child::State::kGone;
      if (child.spec.restarts > 0) events.push_back({ProcessEvent::Kind::kGivenUp, child.spec.name, 0, {}});
      return;
    }
    const auto shift = std::min<std::size_t>(child.restarts.size(), 16);
    child.restarts.push_back(now);
    child.state = Child::State::kWaiting;
    child.due = now + std::min<SteadyClock::duration>(kRestartFirst * (1 << shift), kRestartLast);
  }

  void spawn_child(Child& child, SteadyTime now, std::vector<ProcessEvent>& events) {
    std::vector<std::string> arguments = child.spec.arguments;
    arguments.insert(arguments.end(), {"--listen", child.spec.listen});
    const auto spawned = spawn(child.spec.name, program_, arguments, child.spec.survives);
    if (!spawned) {
      start_error_ = spawned.error();
      if (child.address.empty())
        child.state = Child::State::kGone;
      else
        wait_or_give_up(child, now, events);
      return;
    }
    child.pid = spawned->pid;
    child.output = spawned->output;
    child.state = Child::State::kStarting;
    child.due = now + kStartPatience;
  }

  const std::string program_;
  const std::function<void(const ProcessEvent&)> on_event_;
  const int wake_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::unique_ptr<Child>> children_;
  std::optional<Diagnostic> start_error_;
  bool closing_ = false;
  std::thread thread_;
};

Supervisor::Supervisor(std::string program, std::function<void(const ProcessEvent&)> on_event)
    : impl_(std::make_unique<Impl>(std::move(program), std::move(on_event))) {}
Supervisor::~Supervisor() = default;
Result<std::string> Supervisor::start(ProcessSpec spec) { return impl_->start(std::move(spec)); }
bool Supervisor::adopt(ProcessSpec spec, pid_t pid, std::uint64_t begun) {
  return impl_->adopt(std::move(spec), pid, begun);
}
std::string Supervisor::address(const std::string& name) const { return impl_->address(name); }
std::vector<Supervisor::Started> Supervisor::all() const { return impl_->all(); }
void Supervisor::kill(const std::string& name) { impl_->kill(name); }
bool Supervisor::restart(const std::string& name) { return impl_->restart(name); }
void Supervisor::end(const std::vector<std::string>& names, std::chrono::milliseconds patience) {
  impl_->end(names, patience);
}
void Supervisor::end(std::chrono::milliseconds patience) { impl_->end(patience); }

std::uint64_t process_begun(pid_t pid) {
  const auto stat = text::read_file(fmt::format("/proc/{}/stat", pid));
  if (!stat) return 0;
  // Behind the program's name, which may hold anything, the 20th word.
  std::istringstream words(stat->substr(stat->rfind(')') + 1));
  std::string word;
  for (int i = 0; i < 19; ++i) words >> word;
  std::uint64_t begun = 0;
  words >> begun;
  return begun;
}

std::vector<pid_t> processes_with(const std::vector<std::string>& last_arguments) {
  std::string end;
  for (const std::string& argument : last_arguments) end += '\0' + argument;
  end += '\0';
  std::vector<pid_t> found;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc", error)) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    const auto command = text::read_file(entry.path() / "cmdline");
    if (command && command->ends_with(end)) found.push_back(static_cast<pid_t>(std::stol(name)));
  }
  return found;
}

void outlive_parent() {
  // Who reads what it says may go with its parent.
  signal(SIGPIPE, SIG_IGN);
  prctl(PR_SET_PDEATHSIG, 0);
}

std::string own_program() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).string();
}

}  // namespace sentree::processes
