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

service Control {
  RunInfo info()
  // JSON: [{"name": …, "interface": …, "methods": ["signature", …]}, …]; "simulation" is the simulator's test control.
  string services()
  // Calls a service as the run itself would; the call is observed, its source is "control".
  CallReply call(1: string target, 2: string method, 3: string arguments = "{}")
}
