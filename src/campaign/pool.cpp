#include "sentree/campaign/detail/pool.h"

#include <fmt/format.h>

#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <deque>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "sentree/base/exit_status.h"
#include "sentree/base/write_all.h"

namespace sentree::campaign {

namespace {

// Pieces that a child has at a time, so that it never waits for the next.
constexpr std::size_t kRunsAheadMax = 2;
constexpr int kWakeMs = 100;

struct Answer {
  std::uint64_t what;
  std::uint32_t length;
  std::uint32_t is_last;  // the child ends behind it
};

// As a pipe carries it between processes of one program.
template <class Plain>
std::string_view octets_of(const Plain& plain) {
  return {reinterpret_cast<const char*>(&plain), sizeof plain};
}

bool read_all(int file, void* data, std::size_t size) {
  char* at = static_cast<char*>(data);
  while (size > 0) {
    const ssize_t got = ::read(file, at, size);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    at += got;
    size -= static_cast<std::size_t>(got);
  }
  return true;
}

[[noreturn]] void serve(const PoolTask& task, int in, int out) {
  // A key pressed reaches the whole group; the parent says when it is over.
  signal(SIGINT, SIG_IGN);
  signal(SIGPIPE, SIG_IGN);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  std::uint64_t what = 0;
  while (read_all(in, &what, sizeof what)) {
    const std::string text = task.work(what);
    const Answer answer{what, static_cast<std::uint32_t>(text.size()), task.spoilt && task.spoilt() ? 1U : 0U};
    if (!write_all(out, octets_of(answer)) || !write_all(out, text) || answer.is_last != 0) break;
  }
  _exit(0);
}

class Pool {
  using Clock = std::chrono::steady_clock;

 public:
  explicit Pool(const PoolTask& task) : task_(task) {}
  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;
  ~Pool() {
    for (Child& child : children_) {
      kill(child.pid, SIGKILL);
      close(child);
    }
  }

  Result<void> run() {
    for (;;) {
      if (!task_.goes_on()) return {};
      if (auto started = give(); !started) return started;
      if (std::all_of(children_.begin(), children_.end(), [](const Child& c) { return c.given.empty(); }) &&
          again_.empty())
        return {};
      std::vector<pollfd> waiting;
      for (const Child& child : children_) waiting.push_back({child.out, POLLIN, 0});
      const int ready = poll(waiting.data(), waiting.size(), kWakeMs);
      for (std::size_t i = waiting.size(); ready > 0 && i-- > 0;) {
        if (waiting[i].revents != 0) take(i);
      }
      end_stopped();
    }
  }

 private:
  struct Child {
    pid_t pid = -1;
    int in = -1;   // what it is given
    int out = -1;  // what it answers
    std::deque<std::uint64_t> given;
    std::string answers;  // not yet whole
    std::optional<Clock::time_point> stopped_since;
  };

  std::optional<std::uint64_t> next() {
    if (!again_.empty()) {
      const std::uint64_t what = again_.front();
      again_.pop_front();
      return what;
    }
    return task_.next();
  }

  Result<void> give() {
    for (std::size_t ahead = 1; ahead <= kRunsAheadMax; ++ahead) {
      for (std::size_t i = 0; i < std::max<std::size_t>(1, task_.jobs); ++i) {
        if (i < children_.size() && children_[i].given.size() >= ahead) continue;
        const auto what = next();
        if (!what) return {};
        if (i >= children_.size()) {
          if (auto started = start(); !started) return started;
        }
        children_[i].given.push_back(*what);
        // A child that is gone is found out where its answers are read.
        (void)write_all(children_[i].in, octets_of(*what));
      }
    }
    return {};
  }

  Result<void> start() {
    int to[2];
    int from[2];
    if (pipe(to) != 0)
      return fail("campaign.process", "no pipe for another process: " + std::generic_category().message(errno));
    if (pipe(from) != 0) {
      ::close(to[0]), ::close(to[1]);
      return fail("campaign.process", "no pipe for another process: " + std::generic_category().message(errno));
    }
    const pid_t pid = fork();
    if (pid < 0) {
      for (const int file : {to[0], to[1], from[0], from[1]}) ::close(file);
      return fail("campaign.process", "no process can be started: " + std::generic_category().message(errno));
    }
    if (pid == 0) {
      ::close(to[1]), ::close(from[0]);
      for (const Child& other : children_) ::close(other.in), ::close(other.out);
      serve(task_, to[0], from[1]);
    }
    ::close(to[0]), ::close(from[1]);
    children_.push_back({.pid = pid, .in = to[1], .out = from[0], .given = {}, .answers = {}, .stopped_since = {}});
    return {};
  }

  // What a child has answered so far: it may be stopped in the midst of an answer.
  void take(std::size_t index) {
    Child& child = children_[index];
    char octets[1 << 16];
    const ssize_t got = ::read(child.out, octets, sizeof octets);
    if (got < 0 && errno == EINTR) return;
    if (got <= 0) return end(index, "its process ended with ");
    child.answers.append(octets, static_cast<std::size_t>(got));
    std::size_t at = 0;
    Answer answer{};
    while (child.answers.size() - at >= sizeof answer) {
      std::memcpy(&answer, child.answers.data() + at, sizeof answer);
      if (child.answers.size() - at - sizeof answer < answer.length) break;
      if (child.given.empty() || child.given.front() != answer.what) return end(index, "its process ended with ");
      child.given.pop_front();
      task_.done(answer.what, child.answers.substr(at + sizeof answer, answer.length));
      if (answer.is_last != 0) {
        kill(child.pid, SIGKILL);
        return end(index);
      }
      at += sizeof answer + answer.length;
    }
    child.answers.erase(0, at);
  }

  // Where all are stopped together (Ctrl-Z) this process is too, and sees them go on.
  void end_stopped() {
    const auto now = Clock::now();
    if (now < next_look_) return;
    next_look_ = now + std::chrono::milliseconds(kWakeMs);
    for (std::size_t i = children_.size(); i-- > 0;) {
      Child& child = children_[i];
      siginfo_t change{};
      if (waitid(P_PID, static_cast<id_t>(child.pid), &change, WSTOPPED | WNOHANG | WNOWAIT) != 0 ||
          change.si_pid == 0) {
        child.stopped_since.reset();
        continue;
      }
      if (!child.stopped_since) child.stopped_since = now;
      if (now - *child.stopped_since < task_.stopped_max) continue;
      kill(child.pid, SIGKILL);
      end(i, fmt::format("its process was stopped for {} s, and then ended with ",
                         std::chrono::duration<double>(task_.stopped_max).count()));
    }
  }

  // The child is gone, or going: what it was at is lost, if it died of it, as `how` begins to say.
  void end(std::size_t index, const std::string& how = {}) {
    Child child = std::move(children_[index]);
    children_.erase(children_.begin() + static_cast<std::ptrdiff_t>(index));
    const int status = close(child);
    if (!how.empty() && !child.given.empty()) {
      const std::uint64_t what = child.given.front();
      child.given.pop_front();
      task_.lost(what, how + describe_exit(status));
    }
    again_.insert(again_.begin(), child.given.begin(), child.given.end());
  }

  static int close(Child& child) {
    ::close(child.in);
    ::close(child.out);
    int status = 0;
    while (waitpid(child.pid, &status, 0) < 0 && errno == EINTR) {
    }
    return status;
  }

  const PoolTask& task_;
  std::vector<Child> children_;
  std::deque<std::uint64_t> again_;
  Clock::time_point next_look_{};  // for those that are stopped
};

}  // namespace

Result<void> run_pool(const PoolTask& task) {
  // A child that died is told by what it answers, not by a signal.
  struct sigaction ignore {};
  struct sigaction before {};
  ignore.sa_handler = SIG_IGN;
  sigaction(SIGPIPE, &ignore, &before);
  auto result = Pool(task).run();
  sigaction(SIGPIPE, &before, nullptr);
  return result;
}

}  // namespace sentree::campaign
