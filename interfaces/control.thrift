// What a run offers on its control socket, $XDG_RUNTIME_DIR/sentree/PID.sock: to people at a terminal and to tools.
// Data are JSON, because the services of a run are known to its project only.

namespace cpp sentree.control
namespace py sentree.control

struct RunInfo {
  1: string scenario,
  2: i64 pid,
  3: double time,          // run time [s]
}

struct CallReply {
  1: bool ok,
  2: string result = "",   // JSON, if ok
  3: string kind = "",     // else: exception, unreachable, late, protocol or arguments
  4: string message = ""
}

struct Observed {
  1: i64 upto,             // number of the last message looked at; the next `after`
  2: i64 missed = 0,       // messages that were asked for too late
  3: list<string> messages // JSON, in the run's order
}

service Control {
  RunInfo info()
  // JSON: [{"name": …, "interface": …, "at": …, "methods": ["signature", …]}, …]; "simulation" is the simulator's test control.
  string services()
  // Calls a service as the run itself would; the call is observed, its source is "control".
  CallReply call(1: string target, 2: string method, 3: string arguments = "{}")
  // Messages from number `after` + 1 on whose names match (* stands for any characters); waits up to wait_ms (at most
  // 2000) for one. -1: from now on. The run keeps messages only while somebody asks.
  Observed observe(1: i64 after = -1, 2: string pattern = "*", 3: i32 wait_ms = 1000)
}
