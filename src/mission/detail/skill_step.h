#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "sentree/mission/skill.h"

namespace sentree::mission {

inline constexpr auto kKilled = "the skill was killed";

/// One delivery to one skill.
class SkillMachine::Step {
 public:
  Step(SkillMachine& machine, SkillState& state, SkillHost& host)
      : machine_(machine),
        model_(machine.model_),
        state_(state),
        host_(host),
        lives_(state.running()),
        alive_(state.running() && state.phase != SkillPhase::kResting && state.phase != SkillPhase::kReady),
        owing_(state.phase == SkillPhase::kOwing),
        halting_(state.phase == SkillPhase::kHalting),
        ended_(state.phase == SkillPhase::kEnded || state.phase == SkillPhase::kReady) {
    machine_.stepped_ = &state;
    machine_.surroundings_ = &host;
  }

  bool operator()(TickSkill&& tick);
  bool operator()(const HaltSkill&);
  bool operator()(const CancelSkill&);
  bool operator()(const KillSkill&);
  bool operator()(const RestartSkill&);
  bool operator()(const SkillTimer& timer);
  bool operator()(const Admitted& decided);
  bool operator()(const Send& send);
  bool operator()(const Published& published);
  bool operator()(Outcome&& answered);
  bool operator()(Finish&& finish);

 private:
  bool finish_with(const Call& call, std::string name, scxml::EventType type, Map data);

  // Beside a call that the chart makes itself.
  void note_sent(const Call& call, const idl::Service& service);

  // Calls to one service are answered in their order.
  void note_accepted(const Call& call, const CallOutcome& outcome);
  void note_result(const Publication& what);

  // Goals of a run that was halted and has not cancelled them itself.
  void abandon_goals();

  // What a run that ended by itself has left is its chart's business.
  void forget_goals();

  // A tick for a chart that lives on.
  bool ask(TickSkill&& tick);

  // The innermost of the active states that mean something; of parallel ones, the last in the document.
  void look_at_states();

  // @param has_ended  And nobody has been told.
  void halt_with_protocol(bool has_ended);
  void end_halt();
  void take_answer(bt::Status status, Map outputs);

  // A chart that does not say why it failed may have been told.
  void give_reason();

  // Of a run that has been asked for, or of a chart that nobody has asked yet.
  void start(const Map& inputs);

  // For the runs that begin later.
  void remember(const Shared<Publication>& what);

  // Whether the chart took it.
  bool step(scxml::Event&& event);

  // The same, without what follows of it.
  bool execute(scxml::Event&& event);

  // @param what  Tells steps apart; only with a memory.
  bool execute(std::string_view what, scxml::StepOrder&& order);

  // Nothing: it is to be done here.
  std::optional<bool> execute_elsewhere(const scxml::StepOrder& order);
  void cancel();
  void follow();
  void end_chart(const std::string& final_id, std::optional<Value> donedata);

  // The phase that follows, and the answers that come with it. An action's tick is answered after the macrostep that it
  // caused.
  bool settle();

  // True: the chart takes the event.
  bool tell(const std::string& name);
  void answer(bt::Status status, Map outputs);
  void schedule();
  void call(scxml::OutgoingSend& send);
  void make(Call call);

  // Asks for the calls to one service, one after the other, until a decision has to be waited for.
  void admit(const std::string& service);
  void admitted(const Shared<Call>& call, const Admission& admission);

  SkillMachine& machine_;
  const SkillModel& model_;
  SkillState& state_;
  SkillHost& host_;
  bool lives_;                       // the chart lives; without a protocol the same as:
  bool alive_;                       // a run goes on
  bool owing_;                       // a tick waits for its answer
  bool halting_;                     // a halt waits for the end of the run
  std::optional<std::string> lost_;  // why its chart is executed no more
  bool ended_;                       // a run has ended and its status has not been told
  bool says_running_ = false;        // the chart has answered so, in this delivery
};

}  // namespace sentree::mission
