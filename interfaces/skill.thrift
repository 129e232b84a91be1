// A skill in another process, in any language: what a leaf of the tree calls.
// Data are JSON objects, because ports and observations have no fixed type. An integer beyond 2^53 is a decimal string,
// octets are {"$bytes": "<base64>"}.

namespace cpp sentree.skill
namespace py sentree.skill

/// A leaf's status, with BehaviorTree.CPP's numbers.
enum Status {
  IDLE = 0,
  RUNNING = 1,
  SUCCESS = 2,
  FAILURE = 3
}

struct SkillInfo {
  1: string name,          // the ID of the leaves that it runs
  2: i64 pid,
  3: bool condition = false // answers with SUCCESS or FAILURE only
}

struct Tick {
  1: string leaf,          // the leaf's full path
  2: i64 run,              // another number than any before, in other missions too, starts the skill anew; below 2^53
  3: i64 tick,             // number of the root tick
  4: string inputs = "{}"  // present values of the input ports
}

struct TickReply {
  1: Status status,        // IDLE: a halt or a cancellation has come before the answer, which nobody waits for
  2: string outputs = "{}" // values of output ports; read when the status is SUCCESS or FAILURE
}

struct HaltReply {
  1: bool halted           // false: still halting; ask again
}

service Skill {
  SkillInfo info()
  TickReply tick(1: Tick tick)

  // Ends the run in order. A run that has ended, or was never started, is halted.
  HaltReply halt(1: string leaf, 2: i64 run)

  // Ends the run at once: halting took too long, or the mission is over.
  void cancel(1: string leaf, 2: i64 run)

  // Forgets every run, as if just started.
  void reset()
}

/// A status as programs tell it that tick skills over YARP.
enum SkillAck {
  SKILL_IDLE = 0,
  SKILL_RUNNING = 1,
  SKILL_SUCCESS = 2,
  SKILL_FAILURE = 3
}

/// What `sentree skill` serves: also the ticks of programs that know neither leaves nor runs. They all concern one leaf,
/// named like the skill.
service SkillRequest extends Skill {
  // Ticks a skill that runs. A status that ends the run is told once; then the skill is idle.
  SkillAck request_ack()

  // Starts an idle skill; one that runs goes on.
  void send_start()

  // Halts it.
  void send_stop()

  // Starts an idle skill or ticks one that runs, and tells its status.
  SkillAck request_tick()
  void request_halt()
}

/// What `sentree skill` serves beside: steps of its chart for a run that keeps the skill's state itself, because it is
/// durable. Only Sentree's own programs call it.
service SkillSteps extends SkillRequest {
  // Executes one step and changes nothing but what it remembers of `leaf` to spare the way. Asked twice, it answers the
  // same.
  // leaf: whose session it is
  // behind: number of the step that made the session; 0: `session` has it
  // number: of this step
  binary step(1: string leaf, 2: i64 behind, 3: i64 number, 4: binary session, 5: binary order)
}

/// What `sentree skill` serves beside, for runs that are recorded: a moment of such a run is gone to from the last one at
/// which every part has said what it remembers. A skill need not serve it.
service KeptSkill extends SkillSteps {
  // What the skill of that leaf is between two steps of its chart, in Sentree's own form. Empty: that cannot be said now.
  binary remember(1: string leaf)
}
