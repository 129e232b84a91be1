#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "sentree/monitor/monitor.h"
#include "sentree/project/plan.h"
#include "sentree/runtime/control_handler.h"
#include "sentree/runtime/mission.h"
#include "sentree/runtime/observer.h"
#include "sentree/runtime/publisher.h"
#include "sentree/runtime/services.h"

namespace sentree::runtime {

struct ProcessReport {
  std::string name;
  std::int64_t pid = 0;
};

/// What happens to a process after it was started first.
struct ProcessEvent {
  enum class Kind {
    kExited,     ///< It ended without having been asked to.
    kRestarted,  ///< It listens again, at the same address.
    kGivenUp,    ///< It ended too often.
  };
  Kind kind = Kind::kExited;
  std::string process;
  std::int64_t pid = 0;
  std::string how;  ///< kExited: "signal 9 (Killed)", "exit code 3".
};

/// What a skill in another process answers; from threads of its own.
struct LeafReplies {
  std::function<void(std::uint64_t tick, bt::Status status, Map outputs)> answered;
  /// The tick that it was asked last has not reached it, or its answer has not come back: its leaf fails.
  std::function<void(std::uint64_t tick, const std::string& reason)> unreachable;
  std::function<void()> halted;
  std::function<void(const std::string&)> problem;
};

/// What a part elsewhere says of what it remembers (mission/memory_elsewhere.h).
struct ToldMemory {
  enum class Kind : std::uint8_t {
    kTold,
    kNotNow,  ///< It is not there, or not between two steps.
    kNever,   ///< It does not know the question, and is not asked again.
  };
  Kind kind = Kind::kNotNow;
  std::string octets;  ///< From anybody.
};

/// The services of a run, by name.
using Services = std::map<std::string, project::ServicePlan>;

/// The parts of a run that other programs execute, and those who look at it from outside. A run has no process, socket
/// or address of its own: it is given this (`RunOptions::elsewhere`), or everything runs in its process.
class Elsewhere {
 public:
  /// What it may reach of the run; all of it lives longer.
  struct Surroundings {
    const project::Plan& plan;
    Publisher& publisher;                               ///< Into which parts elsewhere publish by calls.
    std::function<void(Message)> publish;               ///< What has been observed already. Any thread.
    std::function<void(const std::string&)> problem;    ///< Any thread.
    std::function<void(const ProcessEvent&)> happened;  ///< Any thread.
    std::function<void(const std::string& name, const monitor::Decision&)> decided;  ///< By an observer. Any thread.
    /// Of a durable run: beside it lies what its processes share, and they survive the run. Else empty.
    std::filesystem::path journal;
    List left_behind;         ///< What `parts` said of the run that goes on.
    bool only_looks = false;  ///< No process is started and no call made.
  };
  virtual ~Elsewhere() = default;

  /// Starts the processes of the plan and connects the observers. `services`: where an address names a process or the
  /// run's folder, what that is stands there afterwards. Returns why it cannot.
  [[nodiscard]] virtual std::optional<std::string> start(Services& services) = 0;
  /// Sees what is published elsewhere on topics of the services, and what others say where they are observed; connects
  /// those whose topics are published here. Once every part is made. Returns why it cannot.
  [[nodiscard]] virtual std::optional<std::string> subscribe(const Services& services) = 0;
  /// Connected by `start`; until `close`.
  [[nodiscard]] virtual const std::vector<std::unique_ptr<Observer>>& observers() const = 0;
  /// Reaches the skill of a leaf, by its index in the plan. Errors: of the address, file.* where Sentree is not
  /// installed whole; a skill that is not there fails its leaf when it is ticked.
  [[nodiscard]] virtual Result<std::unique_ptr<LeafDriver>> make_leaf(std::size_t leaf, LeafReplies replies) = 0;
  /// Has the steps of a leaf's chart executed by its process, while the run keeps what the skill is. One that has died
  /// is waited for until it is there again, a few seconds at most; one that does not come back from a script is killed.
  /// `kHere` is never the answer. Errors: as of `make_leaf`.
  [[nodiscard]] virtual Result<std::unique_ptr<mission::ChartElsewhere>> make_chart(std::size_t leaf) = 0;
  /// Reaches a service at its address, which the plan has checked; calls have `deadline` [wall time]. The outcome of
  /// one that nobody serves is kind unreachable. Null: none can be made, which is told as a problem.
  [[nodiscard]] virtual std::unique_ptr<ServicePort> make_port(const project::ServicePlan& service,
                                                               Duration deadline) = 0;
  /// One call, which waits for its outcome, at most `patience` [wall time].
  [[nodiscard]] virtual mission::CallOutcome call(const std::string& at, const idl::ServicePtr& interface,
                                                  const std::string& name, const std::string& method, const Value& args,
                                                  Duration patience) = 0;
  /// Where a simulator elsewhere serves `control`, its test control; empty: there is none.
  [[nodiscard]] virtual std::string control_address(const Services& services, const std::string& control) const = 0;

  /// Hands on what has been observed elsewhere so far: before anything is published that may follow from it. From any
  /// thread; nothing to do costs one read of a socket.
  virtual void take_observations() = 0;
  /// Asks each skill that was made with `make_leaf`, and a simulator that the run has started, what it remembers:
  /// beside what else it is asked, so that no tick waits for that. `told` is called once for each, with the index of
  /// the leaf or `kSimulator`, within a second [wall time], from any thread. Returns how many; what was asked ends with
  /// `close`.
  static constexpr std::size_t kSimulator = static_cast<std::size_t>(-1);
  [[nodiscard]] virtual std::size_t ask_memories(std::function<void(std::size_t part, ToldMemory)> told) = 0;
  /// Serves those who look at the run from other programs of this machine, until `end_speaking`.
  virtual void serve_control(ControlHandler handler) = 0;

  [[nodiscard]] virtual std::vector<ProcessReport> processes() const = 0;
  /// What whoever resumes a durable run must know of its processes.
  [[nodiscard]] virtual List parts() const = 0;
  /// SIGKILL; its restarts apply.
  virtual void kill(const std::string& process) = 0;
  /// Starts a process again that has ended. False: it has not.
  [[nodiscard]] virtual bool restart(const std::string& process) = 0;

  /// Ends all who publish into the run, within seconds; monitors elsewhere still listen.
  virtual void end_speaking() = 0;
  /// Ends the processes that are left, and removes what they shared.
  virtual void end() = 0;
  enum class Closed : std::uint8_t {
    kWhole,
    kButLeftBehind,  ///< Threads that may be in a script that never ends are not waited for; this lives on.
  };
  /// Ends, and waits for, every thread that calls into the run. Idempotent.
  virtual void close(Closed how) = 0;
};

}  // namespace sentree::runtime
