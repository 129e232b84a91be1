#include "sentree/runtime/process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace sentree::runtime {

namespace {

using SteadyClock = std::chrono::steady_clock;

// Reads up to the first line that names the address. Empty: the process ended or took too long.
std::string read_address(int output, std::chrono::milliseconds patience) {
  constexpr std::string_view kAnnouncement = "listening on ";
  constexpr std::size_t kOutputMax = 64 * 1024;
  const auto until = SteadyClock::now() + patience;
  std::string text;
  while (text.size() < kOutputMax) {
    if (const auto at = text.find(kAnnouncement); at != std::string::npos) {
      if (const auto end = text.find('\n', at); end != std::string::npos) {
        return text.substr(at + kAnnouncement.size(), end - at - kAnnouncement.size());
      }
    }
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - SteadyClock::now());
    pollfd ready{output, POLLIN, 0};
    if (left.count() <= 0 || poll(&ready, 1, static_cast<int>(left.count())) <= 0) return {};
    char buffer[512];
    const ssize_t got = read(output, buffer, sizeof buffer);
    if (got <= 0) return {};
    text.append(buffer, static_cast<std::size_t>(got));
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<Process>> Process::start(const std::string& name, const std::string& program,
                                                const std::vector<std::string>& arguments,
                                                std::chrono::milliseconds patience) {
  int pipes[2];
  if (pipe2(pipes, O_CLOEXEC) != 0)
    return fail("process.start", "process \"" + name + "\" cannot be started: " + std::strerror(errno));
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);

  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0) {
    // Between fork and exec only what is safe in a process that had threads.
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) _exit(127);
    dup2(pipes[1], STDOUT_FILENO);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);
    // Ctrl-C in the terminal is for the run, which ends its processes in order.
    setpgid(0, 0);
    execv(program.c_str(), argv.data());
    _exit(127);
  }
  close(pipes[1]);
  if (pid < 0) {
    close(pipes[0]);
    return fail("process.start", "process \"" + name + "\" cannot be started: " + std::strerror(errno));
  }
  std::unique_ptr<Process> process(new Process(pid, pipes[0]));
  process->address_ = read_address(pipes[0], patience);
  if (process->address_.empty()) {
    return fail("process.no-address", "process \"" + name + "\" did not say within " +
                                          std::to_string(patience.count()) +
                                          " ms where it listens; its own message stands above");
  }
  return process;
}

Process::~Process() {
  end(std::chrono::milliseconds(2000));
  close(output_);
}

void Process::end(std::chrono::milliseconds patience) {
  if (pid_ <= 0) return;
  ::kill(pid_, SIGTERM);
  const auto until = SteadyClock::now() + patience;
  for (;;) {
    const pid_t ended = waitpid(pid_, nullptr, WNOHANG);
    if (ended != 0) break;
    if (SteadyClock::now() >= until) {
      ::kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
      break;
    }
    poll(nullptr, 0, 5);
  }
  pid_ = -1;
}

void Process::kill() {
  if (pid_ <= 0) return;
  ::kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
  pid_ = -1;
}

std::string own_program() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).string();
}

}  // namespace sentree::runtime
