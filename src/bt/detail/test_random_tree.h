#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/bt/load.h"
#include "sentree/bt/registry.h"

namespace sentree::bt {

/// A random tree of built-in nodes over external and scripted leaves, timers included.
class RandomTree {
 public:
  struct Parts {
    bool timers = true;     ///< Sleep, Delay, Timeout.
    bool loops = true;      ///< Repeat and RetryUntilSuccessful.
    bool bounded = false;   ///< Scripts give few values, so that a run comes back to where it was.
    bool branches = false;  ///< Also nodes that choose among their children, and those that wait for writes.
  };
  explicit RandomTree(std::uint64_t seed) : RandomTree(seed, Parts{}) {}
  RandomTree(std::uint64_t seed, Parts parts) : rng_(seed), parts_(parts) {}

  std::string xml() {
    return "<root BTCPP_format=\"4\" main_tree_to_execute=\"Main\"><BehaviorTree ID=\"Main\"><Sequence>"
           "<RunOnce then_skip=\"false\"><Script code=\"n := 1; s := 'a'\"/></RunOnce>" +
           node(parts_.bounded ? 3 : 5) + "</Sequence></BehaviorTree><BehaviorTree ID=\"Sub\">" +
           "<Fallback><Script code=\"" + script("n += 1") + "\"/>" +
           "<AlwaysSuccess/></Fallback></BehaviorTree></root>";
  }

 private:
  [[nodiscard]] std::string script(const std::string& text) const {
    return parts_.bounded ? "n := n &gt; 7 ? 0 : n + 1" : text;
  }
  std::string children(int depth, std::uint64_t least, std::uint64_t most) {
    std::string text;
    const std::uint64_t count = least + rng_.below(most - least + 1);
    for (std::uint64_t i = 0; i < count; ++i) text += node(depth - 1);
    return text;
  }
  std::string condition() {
    const std::vector<std::string> conditions = {"",
                                                 "",
                                                 "",
                                                 " _skipIf=\"n &gt; 6\"",
                                                 " _while=\"n &lt; 9\"",
                                                 " _onSuccess=\"" + script("n := n + 1") + "\"",
                                                 " _onHalted=\"n := 0\"",
                                                 " _failureIf=\"n == 4\""};
    return conditions[rng_.below(conditions.size())];
  }
  std::string leaf() {
    const std::string name = " name=\"l" + std::to_string(++leaves_) + "\"";
    switch (rng_.below(10)) {
      case 8: return "<AlwaysSuccess" + condition() + "/>";
      case 9: return "<AlwaysFailure/>";
      case 0: return "<Script code=\"" + script("n := n * 2 - 3") + "\"/>";
      case 1: return "<ScriptCondition code=\"n &gt; 2\"/>";
      case 2: return "<SubTree ID=\"Sub\"" + name + " n=\"{n}\"/>";
      case 3: return parts_.timers ? "<Sleep msec=\"150\"/>" : "<Script code=\"" + script("n := n - 1") + "\"/>";
      case 4: return "<Condition ID=\"Ask\"" + name + condition() + "/>";
      default:
        return "<Action ID=\"Do\"" + name + " in=\"{n}\" out=\"{o" + std::to_string(leaves_) + "}\"" + condition() +
               "/>";
    }
  }
  /// With "branches"; empty: something else.
  std::string branch(int depth) {
    const auto with = [&](const std::string& tag, const std::string& ports, std::uint64_t least, std::uint64_t most) {
      return "<" + tag + ports + ">" + children(depth, least, most) + "</" + tag + ">";
    };
    switch (rng_.below(12)) {
      case 0: return with("IfThenElse", "", 2, 3);
      case 1: return with("WhileDoElse", "", 2, 3);
      case 2: return with("Switch2", " variable=\"{n}\" case_1=\"1\" case_2=\"2\"", 3, 3);
      case 3: return with("ManualSelector", " selection=\"1\" repeat_last_selection=\"true\"", 2, 2);
      case 4: return with("LoopInt", " queue=\"1;2;3\" value=\"{i}\"", 1, 1);
      case 5: return with("Precondition", " if=\"n &lt; 5\" else=\"FAILURE\"", 1, 1);
      case 6: return with("WaitValueUpdate", " entry=\"{n}\"", 1, 1);
      case 7: return "<WasEntryUpdated entry=\"{n}\"/>";
      default: return {};
    }
  }
  std::string node(int depth) {
    if (parts_.branches && depth > 0) {
      if (std::string chosen = branch(depth); !chosen.empty()) return chosen;
    }
    if (depth == 0 || rng_.below(5) == 0) return leaf();
    static const std::vector<std::string> kControls = {"Sequence",         "Fallback",           "ReactiveSequence",
                                                       "ReactiveFallback", "SequenceWithMemory", "AsyncSequence",
                                                       "AsyncFallback",    "ParallelAll"};
    static const std::vector<std::string> kDecorators = {"Inverter",
                                                         "ForceSuccess",
                                                         "ForceFailure",
                                                         "KeepRunningUntilFailure",
                                                         "RunOnce",
                                                         "Repeat num_cycles=\"2\"",
                                                         "RetryUntilSuccessful num_attempts=\"3\"",
                                                         "Timeout msec=\"250\"",
                                                         "Delay delay_msec=\"100\"",
                                                         "SkipUnlessUpdated entry=\"{n}\""};
    switch (rng_.below(6)) {
      case 0: {
        std::string tag = kDecorators[rng_.below(kDecorators.size())];
        const bool timer = tag.starts_with("Timeout") || tag.starts_with("Delay");
        const bool loop = tag.starts_with("Re");
        if ((timer && !parts_.timers) || (loop && !parts_.loops)) tag = "Inverter";
        return "<" + tag + ">" + node(depth - 1) + "</" + tag.substr(0, tag.find(' ')) + ">";
      }
      case 1: return "<TryCatch>" + children(depth, 2, 3) + "</TryCatch>";
      case 2: return "<Parallel success_count=\"1\" failure_count=\"1\">" + children(depth, 2, 3) + "</Parallel>";
      default: {
        const std::string& tag = kControls[rng_.below(kControls.size())];
        return "<" + tag + condition() + ">" + children(depth, 1, 4) + "</" + tag + ">";
      }
    }
  }

  Rng rng_;
  Parts parts_;
  int leaves_ = 0;
};

inline Tree random_tree(std::uint64_t seed, RandomTree::Parts parts = {}, const Registry* registry = nullptr) {
  RandomTree random(seed, parts);
  LoadOptions options;
  options.registry = registry;
  auto loaded = load(random.xml(), options);
  for (const Diagnostic& d : loaded.diagnostics) {
    if (d.severity == Severity::kError) ADD_FAILURE() << "seed " << seed << ": " << to_string(d);
  }
  return std::move(*loaded.value);
}

}  // namespace sentree::bt
