#pragma once

#include <sys/types.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "sentree/base/result.h"

namespace sentree::runtime {

/// A child process of this run. Ended when this is destroyed, and by the kernel when the run itself dies.
class Process {
 public:
  /// Starts `program` with `arguments` and waits until it prints "listening on ADDRESS" on its standard output.
  /// What it prints on standard error goes to ours. Errors: process.start, process.no-address.
  [[nodiscard]] static Result<std::unique_ptr<Process>> start(const std::string& name, const std::string& program,
                                                              const std::vector<std::string>& arguments,
                                                              std::chrono::milliseconds patience);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  [[nodiscard]] pid_t pid() const { return pid_; }
  [[nodiscard]] const std::string& address() const { return address_; }
  /// Asks it to end (SIGTERM), after `patience` makes it (SIGKILL). Idempotent.
  void end(std::chrono::milliseconds patience);
  /// SIGKILL, at once.
  void kill();

 private:
  Process(pid_t pid, int output) : pid_(pid), output_(output) {}
  pid_t pid_;
  int output_;
  std::string address_;
};

/// The path of the program that runs.
[[nodiscard]] std::string own_program();

}  // namespace sentree::runtime
