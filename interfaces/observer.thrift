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
  3: i64 stamp,            // causal stamp (Lamport)
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
  3: i64 stamp = 0,        // greater than the message's
  4: string by = ""        // who vetoes, if not this observer itself
}

service Observer {
  ObserverInfo info()
  Verdict observe(1: Message message)
}
