// An observer in another process, in any language: a monitor, a recorder, a gate.
// It is given every message between the layers, in causal order, and may veto requests if it is a gate.

namespace cpp sentree.observer
namespace py sentree.observer

enum MessageKind {
  REQUEST = 0,
  REPLY = 1,
  ERROR = 2,
  EVENT = 3
}

struct Message {
  1: i64 sequence,         // place in the run's total order, from 1
  2: i64 time_ns,          // since the start of the run
  4: MessageKind kind,
  5: string source,
  6: string target,
  7: string name,          // e.g. "battery.getBatteryState.reply"
  8: i64 call = 0,         // joins a request with its outcome
  9: i64 tick = 0,         // number of the root tick
  10: string data = "{}"   // JSON
}

struct ObserverInfo {
  1: string name,
  2: i64 pid,
  3: list<string> observes = ["*"], // names of messages; * stands for any characters
  4: list<string> gates = []        // requests on which it must be asked before they are sent
}

struct Verdict {
  1: bool accept = true,   // false vetoes a request; ignored for all other messages
  2: string reason = "",
  4: string by = "",       // who vetoes, if not this observer itself
  // What an observer that is a monitor says once, with the message that decided.
  5: string verdict = "",  // "violated" or "satisfied"; empty: not decided, or said already
  6: string state = "",    // the chart's state that decided
  7: i64 decided_at_ns = 0, // run time of the decision; 0: the message's
  8: string witness = "[]", // JSON: the messages that led there
  9: bool witness_complete = true,  // false: some that led there are missing
  10: bool witness_minimal = false  // true: leaving out any one would not give the verdict
}

service Observer {
  ObserverInfo info()
  // Each message that it observes, in the run's order. A request that it gates comes before that too, with sequence 0: a
  // question, whether it may be sent.
  Verdict observe(1: Message message)
  // The run is over: time has passed until now, and nothing more is observed.
  Verdict finish(1: i64 time_ns)
}

/// An observer of a durable run: it can be taken back to where it was. `sentree monitor` serves this.
service KeptObserver extends Observer {
  // Begins as it was when it gave `memory`, or anew where that is empty. What was observed since then follows.
  void recall(1: binary memory)
  // What it is after all that it observed.
  binary remember()
}
