#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>

#include "sentree/base/rng.h"
#include "sentree/bt/detail/test_support.h"
#include "sentree/bt/load.h"
#include "sentree/bt/registry.h"
#include "sentree/bt/runner.h"

// Scripts in which nothing but numbers meets take a short way. A text that is known only when it runs never does, so
// the same script can be run both ways.

namespace sentree::bt {
namespace {

Registry with_entries(const std::string& script) {
  Registry registry;
  registry.action("Begin",
                  {output<double>("real"), output<std::int64_t>("whole"), output<bool>("truth"),
                   output<std::string>("text"), output<std::string>("code")},
                  [script](Context& self) {
                    const bool ok = self.output<double>("real", 2.5) && self.output<std::int64_t>("whole", 7) &&
                                    self.output<bool>("truth", true) && self.output<std::string>("text", "3") &&
                                    self.output<std::string>("code", script);
                    return ok ? Status::kSuccess : Status::kFailure;
                  });
  return registry;
}

std::string escaped(const std::string& script) {
  std::string out;
  for (const char c : script) out += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
  return out;
}

/// Status, error and entries after three ticks of a leaf, beside which the script is the text of an entry.
std::string after(const std::string& leaf, const std::string& script) {
  const Registry registry = with_entries(script);
  auto loaded = load(
      in_tree(
          "<Sequence><Script code=\"made := 1\"/><RunOnce then_skip=\"false\"><Begin real=\"{real}\" whole=\"{whole}\" "
          "truth=\"{truth}\" text=\"{text}\" code=\"{code}\"/></RunOnce>" +
          leaf + "</Sequence>"),
      {.registry = &registry});
  if (!loaded.ok()) return "refused";
  Runner runner(std::move(*loaded.value));
  std::string out;
  for (int i = 0; i < 3; ++i) {
    out += std::string(to_string(runner.tick()));
    // Where the script stands is in the message, and differs.
    if (const auto& error = runner.error()) out += " " + error->code + error->message.substr(error->message.find(": "));
    out += "\n";
  }
  for (const EntryFact& fact : blackboard(runner.tree(), runner.state())) {
    if (fact.name == "code") continue;
    out += fact.name + " = " + (fact.value != nullptr ? to_json(*fact.value) : "-") + " " +
           std::to_string(fact.sequence) + "\n";
  }
  return out;
}

std::string expression(Rng& rng, int depth) {
  static const char* const kOperands[] = {"real", "whole", "truth",   "text", "made", "nobody", "1",
                                          "2.5",  "0",     "-3",      "1e9",  "true", "0x10",   "9007199254740993",
                                          "7",    "0.1",   "'three'", "'7'",  "7.0",  "1e300"};
  // One that is always there is likelier: most scripts should go through.
  if (depth == 0 || rng.below(3) == 0) return kOperands[rng.below(4) == 0 ? rng.below(20) : rng.below(3)];
  static const char* const kOperators[] = {"+", "-", "*", "/", "&&", "||", "==", "!=", "<", "<=", ">", ">="};
  const std::string a = expression(rng, depth - 1);
  const std::string b = expression(rng, depth - 1);
  switch (rng.below(8)) {
    case 0: return "!(" + a + ")";
    case 1: return "-(" + a + ")";
    case 2: return "(" + a + " ? " + b + " : 1)";
    default: return "(" + a + " " + kOperators[rng.below(12)] + " " + b + ")";
  }
}

TEST(ScriptNumbers, GiveWhatTheLongWayGives) {
  constexpr std::uint64_t kSeed = 22;
  Rng rng(kSeed);
  int through = 0;
  for (int i = 0; i < 4'000; ++i) {
    std::string script = expression(rng, static_cast<int>(rng.below(4)));
    static const char* const kAssignments[] = {":=", "=", "+=", "-=", "*=", "/="};
    static const char* const kEntries[] = {"real", "whole", "truth", "made", "text", "fresh"};
    const bool assigns = rng.below(3) == 0;
    if (assigns) script = kEntries[rng.below(6)] + std::string(" ") + kAssignments[rng.below(6)] + " " + script;
    const std::string leaf = assigns ? "Script" : "ScriptCondition";
    const std::string at_once = after("<" + leaf + " code=\"" + escaped(script) + "\"/>", script);
    if (at_once == "refused") continue;
    ASSERT_EQ(at_once, after("<" + leaf + " code=\"{code}\"/>", script))
        << leaf << ": " << script << "\nseed " << kSeed << ", script " << i;
    if (at_once.find("bt.script") == std::string::npos) ++through;
  }
  EXPECT_GT(through, 2'000);
}

TEST(ScriptNumbers, DecideInPreconditionsWhatTheyDecideInALeaf) {
  constexpr std::uint64_t kSeed = 23;
  Rng rng(kSeed);
  int through = 0;
  for (int i = 0; i < 3'000; ++i) {
    const std::string script = expression(rng, static_cast<int>(rng.below(3)));
    // Each makes the sequence succeed where the script holds.
    static const char* const kLeaves[] = {"<AlwaysFailure _skipIf=\"%\"/>", "<AlwaysFailure _successIf=\"%\"/>",
                                          "<Fallback><AlwaysSuccess _while=\"%\"/><AlwaysFailure/></Fallback>"};
    std::string leaf = kLeaves[rng.below(3)];
    leaf.replace(leaf.find('%'), 1, escaped(script));
    const std::string there = after(leaf, script);
    if (there == "refused") continue;
    ASSERT_EQ(there, after("<ScriptCondition code=\"{code}\"/>", script))
        << leaf << "\nseed " << kSeed << ", script " << i;
    if (there.find("bt.script") == std::string::npos) ++through;
  }
  EXPECT_GT(through, 1'500);
}

}  // namespace
}  // namespace sentree::bt
