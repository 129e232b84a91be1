#pragma once

#include <sys/types.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/runtime/elsewhere.h"

namespace sentree::processes {

/// A part of a run in a process of its own.
struct ProcessSpec {
  std::string name;
  std::vector<std::string> arguments;  ///< Of the program, without --listen.
  std::string listen;                  ///< Given as --listen; after the first start, the address that came of it.
  int restarts = 0;                    ///< How often it is started again within `kRestartWindow`.
  bool survives = false;  ///< It goes on when the program itself dies, once it has called `outlive_parent`.
};

/// Restarts are counted over this long.
inline constexpr std::chrono::seconds kRestartWindow{60};
/// Waits before a restart double from the first to the last.
inline constexpr std::chrono::milliseconds kRestartFirst{50};
inline constexpr std::chrono::milliseconds kRestartLast{2000};
/// A process that has not said by then where it listens has failed.
inline constexpr std::chrono::seconds kStartPatience{10};

/// When a process began, in clock ticks since the machine was started, so that another one of its number is told apart;
/// 0: there is none.
[[nodiscard]] std::uint64_t process_begun(pid_t pid);

/// Starts processes, watches them in a thread of its own, restarts those that end. All are ended with it, and by the
/// kernel when the program itself dies, but for those that survive it.
class Supervisor {
 public:
  /// @param on_event  Called in the supervisor's thread.
  Supervisor(std::string program, std::function<void(const runtime::ProcessEvent&)> on_event);
  ~Supervisor();
  Supervisor(const Supervisor&) = delete;
  Supervisor& operator=(const Supervisor&) = delete;

  /// Starts it and waits until it prints "listening on ADDRESS" on its standard output; what it prints on standard
  /// error goes to ours. Returns the address. Errors: process.start, process.no-address.
  [[nodiscard]] Result<std::string> start(ProcessSpec spec);

  /// Takes over a process that another supervisor has started and left behind, once it listens at `spec.listen`: until
  /// then it may be one that ends with who had started it. One that does not within `kStartPatience` is ended. False:
  /// it is no longer there.
  [[nodiscard]] bool adopt(ProcessSpec spec, pid_t pid, std::uint64_t begun);

  [[nodiscard]] std::string address(const std::string& name) const;
  struct Started {
    std::string name;
    pid_t pid = 0;  ///< 0: it does not run now.
    std::string address;
  };
  /// In the order started.
  [[nodiscard]] std::vector<Started> all() const;

  /// SIGKILL; its restarts apply.
  void kill(const std::string& name);
  /// Starts one again that has ended, without counting it as a restart. False: it has not ended, or all are ending.
  bool restart(const std::string& name);
  /// Asks these to end (SIGTERM), makes those that are left after `patience` (SIGKILL), starts none of them again.
  void end(const std::vector<std::string>& names, std::chrono::milliseconds patience);
  /// The same for all, and nothing is started any more. Idempotent.
  void end(std::chrono::milliseconds patience);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// The processes of this machine whose command lines end so. Costs a look at each process that there is.
[[nodiscard]] std::vector<pid_t> processes_with(const std::vector<std::string>& last_arguments);

/// In a process that was started to survive (`ProcessSpec::survives`): from now on it does, also if nobody reads any
/// more what it writes.
void outlive_parent();

/// The path of the program that runs.
[[nodiscard]] std::string own_program();

}  // namespace sentree::processes
