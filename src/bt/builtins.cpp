#include <algorithm>
#include <span>

#include "sentree/bt/model.h"

namespace sentree::bt {

const std::string_view kConditionNames[Conditions::kCount] = {"_failureIf", "_successIf", "_skipIf",    "_while",
                                                              "_onHalted",  "_onFailure", "_onSuccess", "_post"};

namespace {

constexpr std::uint32_t kAnyNumber = 0xFFFFFFFFU;

Manifest control(std::string id, Kind kind, Ports ports = {}) {
  Manifest m;
  m.id = std::move(id);
  m.category = Category::kControl;
  m.kind = kind;
  m.ports = std::move(ports);
  m.children_min = 1;
  m.children_max = kAnyNumber;
  return m;
}
Manifest decorator(std::string id, Kind kind, Ports ports = {}) {
  Manifest m = control(std::move(id), kind, std::move(ports));
  m.category = Category::kDecorator;
  m.children_max = 1;
  return m;
}
Manifest leaf(std::string id, Kind kind, Category category, Ports ports = {}) {
  Manifest m = control(std::move(id), kind, std::move(ports));
  m.category = category;
  m.children_min = m.children_max = 0;
  return m;
}

template <class T>
Manifest loop(std::string id) {
  return decorator(std::move(id), Kind::kLoop,
                   {inout<std::vector<T>>("queue", "elements separated by ';', or an entry that holds a list"),
                    input_default<Status>("if_empty", "SUCCESS", "status when there is no element"),
                    output<T>("value", "the present element")});
}

template <class T>
Manifest check(std::string id) {
  return decorator(std::move(id), Kind::kBlackboardCheck,
                   {input<T>("value_A"), input<T>("value_B"), input<Status>("return_on_mismatch")});
}

void add_common(std::vector<Manifest>& all) {
  all.push_back(control("Sequence", Kind::kSequence));
  all.push_back(control("Fallback", Kind::kFallback));
  all.push_back(control("ReactiveSequence", Kind::kReactiveSequence));
  all.push_back(control("ReactiveFallback", Kind::kReactiveFallback));
  all.push_back(control("IfThenElse", Kind::kIfThenElse));
  all.push_back(control("WhileDoElse", Kind::kWhileDoElse));
  for (int cases = 2; cases <= 6; ++cases) {
    Ports ports{input<std::string>("variable")};
    for (int i = 1; i <= cases; ++i) ports.push_back(input<std::string>("case_" + std::to_string(i)));
    all.push_back(control("Switch" + std::to_string(cases), Kind::kSwitch, std::move(ports)));
  }
  all.push_back(control("ManualSelector", Kind::kManualSelector,
                        {input_default<bool>("repeat_last_selection", "false", "choose once only"),
                         input<std::int32_t>("selection", "index of the child, from 0; negative: none yet")}));
  all.push_back(decorator("Inverter", Kind::kInverter));
  all.push_back(decorator("ForceSuccess", Kind::kForceSuccess));
  all.push_back(decorator("ForceFailure", Kind::kForceFailure));
  all.push_back(decorator("KeepRunningUntilFailure", Kind::kKeepRunningUntilFailure));
  all.push_back(
      decorator("Delay", Kind::kDelay, {input<std::uint32_t>("delay_msec", "milliseconds before the child")}));
  all.push_back(
      decorator("Timeout", Kind::kTimeout, {input<std::uint32_t>("msec", "milliseconds until the child is halted")}));
  all.push_back(leaf("AlwaysSuccess", Kind::kAlwaysSuccess, Category::kAction));
  all.push_back(leaf("AlwaysFailure", Kind::kAlwaysFailure, Category::kAction));
  all.push_back(leaf("SetBlackboard", Kind::kSetBlackboard, Category::kAction, {input("value"), inout("output_key")}));
  Manifest subtree = leaf("SubTree", Kind::kSubTree, Category::kSubTree);
  all.push_back(subtree);
}

std::vector<Manifest> make_format4() {
  std::vector<Manifest> all;
  add_common(all);
  all.push_back(control("AsyncSequence", Kind::kAsyncSequence));
  all.push_back(control("AsyncFallback", Kind::kAsyncFallback));
  all.push_back(control("SequenceWithMemory", Kind::kSequenceWithMemory));
  all.push_back(
      control("Parallel", Kind::kParallel,
              {input_default<std::int32_t>("success_count", "-1"), input_default<std::int32_t>("failure_count", "1")}));
  all.push_back(control("ParallelAll", Kind::kParallelAll, {input_default<std::int32_t>("max_failures", "1")}));
  all.push_back(control("TryCatch", Kind::kTryCatch, {input_default<bool>("catch_on_halt", "false")}));
  all.back().children_min = 2;
  all.push_back(decorator("Repeat", Kind::kRepeat, {input<std::int32_t>("num_cycles")}));
  all.push_back(decorator("RetryUntilSuccessful", Kind::kRetry, {input<std::int32_t>("num_attempts")}));
  all.push_back(decorator("RunOnce", Kind::kRunOnce, {input_default<bool>("then_skip", "true")}));
  all.push_back(decorator("Precondition", Kind::kPrecondition,
                          {input<std::string>("if"), input_default<Status>("else", "FAILURE")}));
  all.push_back(decorator("SkipUnlessUpdated", Kind::kSkipUnlessUpdated, {input<Value>("entry")}));
  all.push_back(decorator("WaitValueUpdate", Kind::kWaitValueUpdate, {input<Value>("entry")}));
  all.push_back(loop<std::int32_t>("LoopInt"));
  all.push_back(loop<double>("LoopDouble"));
  all.push_back(loop<bool>("LoopBool"));
  all.push_back(loop<std::string>("LoopString"));
  all.push_back(leaf("Script", Kind::kScript, Category::kAction, {input<std::string>("code")}));
  all.push_back(leaf("ScriptCondition", Kind::kScriptCondition, Category::kCondition, {input<std::string>("code")}));
  all.push_back(leaf("UnsetBlackboard", Kind::kUnsetBlackboard, Category::kAction, {input<std::string>("key")}));
  all.push_back(leaf("Sleep", Kind::kSleep, Category::kAction, {input<std::uint32_t>("msec")}));
  all.push_back(leaf("WasEntryUpdated", Kind::kWasEntryUpdated, Category::kAction, {input<Value>("entry")}));
  return all;
}

std::vector<Manifest> make_format3() {
  std::vector<Manifest> all;
  add_common(all);
  all.push_back(control("SequenceStar", Kind::kSequenceWithMemory));
  all.push_back(control(
      "Parallel", Kind::kParallel,
      {input_default<std::int32_t>("success_threshold", "-1"), input_default<std::int32_t>("failure_threshold", "1")}));
  all.push_back(decorator("Repeat", Kind::kRepeat, {input<std::int32_t>("num_cycles")}));
  all.push_back(decorator("RetryUntilSuccessful", Kind::kRetry, {input<std::int32_t>("num_attempts")}));
  // The misspelt name of early releases, which is still in many files.
  all.push_back(decorator("RetryUntilSuccesful", Kind::kRetry, {input<std::int32_t>("num_attempts")}));
  all.push_back(check<std::int32_t>("BlackboardCheckInt"));
  all.push_back(check<double>("BlackboardCheckDouble"));
  all.push_back(check<bool>("BlackboardCheckBool"));
  all.push_back(check<std::string>("BlackboardCheckString"));
  Manifest plus = leaf("SubTreePlus", Kind::kSubTree, Category::kSubTree);
  all.push_back(plus);
  return all;
}

std::vector<Manifest> sorted(std::vector<Manifest> all) {
  std::sort(all.begin(), all.end(), [](const Manifest& a, const Manifest& b) { return a.id < b.id; });
  for (Manifest& manifest : all) {
    // A port without a type takes part in no type check.
    for (PortInfo& port : manifest.ports) {
      if (port.type == &type_of<AnyType>()) port.type = nullptr;
    }
  }
  return all;
}

}  // namespace

const std::vector<Manifest>& builtins(int format) {
  static const std::vector<Manifest> kFormat3 = sorted(make_format3());
  static const std::vector<Manifest> kFormat4 = sorted(make_format4());
  return format == 3 ? kFormat3 : kFormat4;
}

const Manifest* find_builtin(std::string_view id, int format) {
  const auto& all = builtins(format);
  const auto found = std::lower_bound(all.begin(), all.end(), id,
                                      [](const Manifest& m, std::string_view wanted) { return m.id < wanted; });
  return found != all.end() && found->id == id ? &*found : nullptr;
}

std::span<const Word> words(Kind kind) {
  using enum Word::Lives;
  using enum Word::Range;
  // In the order of each node's Memory.
  static constexpr Word kOrdered[] = {{kAlways, kChildOrEnd}, {kUnlessIdle}, {kInTick}};
  static constexpr Word kReactive[] = {{kInTick, kChild}, {kInTick}};
  static constexpr Word kParallel[] = {
      {kInTick, kChildOrEnd}, {kAlways}, {kAlways}, {kInTick}, {kInTick}, {kInTick}, {kInTick}};
  static constexpr Word kIfThenElse[] = {{kAlways, kChild}};
  static constexpr Word kWhileDoElse[] = {{kInTick, kChild}};
  static constexpr Word kSwitch[] = {{kAlways, kCounted}, {kInTick, kChild}};
  static constexpr Word kManualSelector[] = {{kAlways, kCounted}, {kInTick, kChild}, {kAlways, kChosen}};
  static constexpr Word kTryCatch[] = {{kAlways, kChild}, {kUnlessIdle}, {kUnlessIdle}};
  static constexpr Word kRepeated[] = {{kAlways}, {kInTick}, {kInTick}};
  static constexpr Word kUpdated[] = {{kAlways}, {kAlways}, {kAlways}};
  static constexpr Word kLoop[] = {{kUnlessIdle}, {kUnlessIdle, kPosition}};
  static constexpr Word kSeen[] = {{kAlways}, {kAlways}};
  static constexpr Word kStatus[] = {{kAlways, kResult}};
  static constexpr Word kOne[] = {{kAlways}};
  switch (kind) {
    case Kind::kSequence:
    case Kind::kFallback:
    case Kind::kAsyncSequence:
    case Kind::kAsyncFallback:
    case Kind::kSequenceWithMemory: return kOrdered;
    case Kind::kReactiveSequence:
    case Kind::kReactiveFallback: return kReactive;
    case Kind::kParallel:
    case Kind::kParallelAll: return kParallel;
    case Kind::kIfThenElse: return kIfThenElse;
    case Kind::kWhileDoElse: return kWhileDoElse;
    case Kind::kSwitch: return kSwitch;
    case Kind::kManualSelector: return kManualSelector;
    case Kind::kTryCatch: return kTryCatch;
    case Kind::kRepeat:
    case Kind::kRetry: return kRepeated;
    case Kind::kSkipUnlessUpdated:
    case Kind::kWaitValueUpdate: return kUpdated;
    case Kind::kLoop: return kLoop;
    case Kind::kWasEntryUpdated: return kSeen;
    case Kind::kRunOnce: return kStatus;
    case Kind::kPrecondition:
    case Kind::kDelay:
    case Kind::kTimeout:
    case Kind::kExternalAction:
    case Kind::kExternalCondition: return kOne;
    default: return {};
  }
}

std::uint32_t memory_words(Kind kind, std::uint32_t child_count) {
  const std::uint32_t bits = kind == Kind::kParallel || kind == Kind::kParallelAll ? (child_count + 31) / 32 : 0;
  return static_cast<std::uint32_t>(words(kind).size()) + bits;
}

}  // namespace sentree::bt
