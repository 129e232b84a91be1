// What a run offers on its control socket, $XDG_RUNTIME_DIR/sentree/PID.sock: to people at a terminal and to tools.
// Data are JSON, because the services of a run are known to its project only.

namespace cpp sentree.control
namespace py sentree.control

struct RunInfo {
  1: string scenario,
  2: i64 pid,
  3: double time,          // run time [s]
  4: bool has_page = false // whether `page` can be asked for
}

struct CallReply {
  1: bool ok,
  2: string result = "",   // JSON, if ok
  3: string kind = "",     // else: exception, unreachable, late, protocol or arguments
  4: string message = ""
}

struct Page {
  1: string url = "",      // empty: there is none
  2: string recording = "", // the file to which the run is recorded; empty: none
  3: string problem = ""   // why there is no page
}

struct Observed {
  1: i64 upto,             // number of the last message looked at; the next `after`
  2: i64 missed = 0,       // messages that were asked for too late
  3: list<string> messages // JSON, in the run's order
}

service Control {
  RunInfo info()
  // JSON: [{"name": …, "interface": …, "at": …, "methods": ["signature", …]}, …]; "simulation" is the simulator's test control;
  // "at" is sim, model, topics, or where it is served: addresses, joined by ", ".
  string services()
  // Calls a service as the run itself would; the call is observed, its source is "control".
  CallReply call(1: string target, 2: string method, 3: string arguments = "{}")
  // Opens the run's page in the studio if it is not open yet, at [HOST:]PORT or, if that is empty, at the usual place.
  Page page(1: string at = "", 2: bool insecure = false)
  // Messages from number `after` + 1 on whose names match (* stands for any characters); waits up to wait_ms (at most
  // 2000) for one. -1: from now on. The run keeps messages only while somebody asks.
  Observed observe(1: i64 after = -1, 2: string pattern = "*", 3: i32 wait_ms = 1000)
}
