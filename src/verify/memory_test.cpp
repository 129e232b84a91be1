// What is looked up is what would have been executed: the same graph, of every example with models and of random
// projects.
//
// SENTREE_SEEDS=N tries N random projects instead of the usual ones, SENTREE_SEED=S only that of seed S.

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <initializer_list>
#include <iostream>
#include <string>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/text/file.h"
#include "sentree/verify/statistics.h"
#include "sentree/verify/verify.h"

namespace sentree::verify {
namespace {

constexpr std::uint64_t kSeeds = 120;

// The first thing in which two graphs differ; empty: nothing.
std::string difference(const Graph& a, const Graph& b) {
  if (a.nodes != b.nodes) return "states: " + std::to_string(a.nodes.size()) + ", " + std::to_string(b.nodes.size());
  if (a.edges != b.edges) return "periods";
  if (a.decisions != b.decisions) return "decisions";
  if (a.choices != b.choices) return "choices";
  if (a.observations.size() != b.observations.size()) return "how many observations";
  for (std::size_t i = 0; i < a.observations.size(); ++i) {
    if (!(a.observations[i] == b.observations[i])) return "observation " + to_json(b.observations[i].data);
  }
  if (a.sequences != b.sequences) return "sequences of observations";
  if (a.taken != b.taken) return "transitions taken";
  if (a.statuses != b.statuses) return "statuses";
  if (a.values != b.values) return "values";
  if (a.problems.empty() != b.problems.empty()) return "problems";
  return a.limit != b.limit ? "limit: " + a.limit + ", " + b.limit : "";
}

// Explores with and without a memory.
struct Both {
  // @param looks  How often it is looked whether to go on: at each state, and after 64 ways on from one.
  Both(const project::Plan& plan, Options options, int looks) {
    const auto explored = [&] {
      int left = looks;
      options.interrupted = [&left] { return --left < 0; };
      return explore(plan, options);
    };
    const auto remembered = explored();
    options.memory_of_steps = false;
    const auto executed = explored();
    if (remembered && executed) {
      states = executed->nodes.size();
      wrong = difference(*remembered, *executed);
    } else if (remembered || executed) {
      wrong = "only one of them fails: " + to_string((remembered ? executed : remembered).error());
    } else if (remembered.error().code != executed.error().code) {
      wrong = to_string(remembered.error()) + " and " + to_string(executed.error());
    }
  }
  std::size_t states = 0;
  std::string wrong;
};

TEST(PartMemory, FindsWhatIsExecutedInTheExamples) {
  for (const char* const example : {"recharge", "modelled", "topics", "grasp", "handover", "porter"}) {
    SCOPED_TRACE(example);
    auto project = project::load_project(std::string(SENTREE_SOURCE_DIR) + "/examples/" + example);
    ASSERT_TRUE(project.ok());
    const auto plan = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
    ASSERT_TRUE(plan.ok());
    for (const Order order : {Order::kAny, Order::kVirtual}) {
      Options options;
      options.order = order;
      options.faults = plan.value->scenario.project.verify.faults;
      const Both both(*plan.value, options, 600);
      EXPECT_EQ(both.wrong, "");
      EXPECT_GT(both.states, 3U);
    }
  }
}

TEST(Statistics, OfLongRunsAreTheSameAgain) {
  auto project = project::load_project(std::string(SENTREE_SOURCE_DIR) + "/examples/recharge");
  ASSERT_TRUE(project.ok());
  const auto plan = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
  ASSERT_TRUE(plan.ok());
  const auto violated = [&] {
    std::vector<std::vector<bool>> all;
    Sampling sampling;
    sampling.runs = 5;
    sampling.length = std::chrono::seconds(60);
    sampling.told = [&](const std::vector<bool>& run) {
      all.push_back(run);
      return true;
    };
    EXPECT_EQ(sample(*plan.value, sampling), sampling.runs);
    return all;
  };
  // Long enough for the monitors to throw away what no verdict needs any more.
  const auto first = violated();
  EXPECT_EQ(first, violated());
  EXPECT_EQ(first.size(), 5U);
}

// A mission of at most eight nodes with charts of at most six states, and a device that leaves things open.
class RandomProject {
 public:
  explicit RandomProject(std::uint64_t seed) : rng_(seed) {}

  void write(const std::filesystem::path& folder) {
    const auto put = [&](const std::string& file, const std::string& text) {
      std::filesystem::create_directories((folder / file).parent_path());
      ASSERT_TRUE(text::write_file(folder / file, text));
    };
    put("interfaces/device.thrift", "service Device { i32 ask(), void put(1: i32 what) }\n");
    const std::string tree = node(3);
    put("mission.xml", "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\">" + tree +
                           "</BehaviorTree><TreeNodesModel><Action ID=\"Do\"/><Condition ID=\"Is\"/>"
                           "</TreeNodesModel></root>");
    put("skills/Do.scxml", skill(false));
    put("skills/Is.scxml", skill(true));
    put("models/device.scxml", device());
    put("r.req",
        "let said = reply(device.ask)\nsmall \"It says little.\": always said <= 1.\n"
        "answers \"It answers.\": whenever request(device.put).what = 1, robot shall said = 1 within 300 ms.\n");
    put("sentree.yaml", "mission: {file: mission.xml, rate: 10 Hz, repeat: " + pick({"true", "false"}) +
                            "}\nservices: {device: {interface: device.thrift/Device, at: model}}\n"
                            "models: [{file: models/device.scxml, name: model, serves: [device]}]\n"
                            "monitors: [{file: r.req}]\nverify: {faults: {at_most: " +
                            number(1, 2) + ", any_of: [" + faults() + "]}}\n");
  }

 private:
  std::uint64_t below(std::uint64_t bound) { return rng_.below(bound); }
  std::string pick(std::initializer_list<const char*> words) { return *(words.begin() + below(words.size())); }
  std::string number(std::uint64_t from, std::uint64_t to) { return std::to_string(from + below(to - from + 1)); }

  std::string node(int depth) {
    ++nodes_;
    if (depth == 0 || nodes_ > 5 || below(4) == 0) {
      if (below(8) == 0) return "<Sleep msec=\"" + number(1, 5) + "0\"/>";
      const std::string name = " name=\"L" + std::to_string(++leaves_) + "\"/>";
      return (below(3) == 0 ? "<Condition ID=\"Is\"" : "<Action ID=\"Do\"") + name;
    }
    std::string open;
    std::uint64_t children = 1;
    if (below(3) == 0) {
      open = pick({"Inverter", "ForceSuccess", "KeepRunningUntilFailure", "Repeat num_cycles=\"2\"",
                   "RetryUntilSuccessful num_attempts=\"2\"", "Timeout msec=\"250\"", "Delay delay_msec=\"130\""});
    } else {
      open = pick({"Sequence", "Fallback", "ReactiveSequence", "ReactiveFallback", "SequenceWithMemory",
                   "Parallel success_count=\"1\" failure_count=\"1\"", "ParallelAll"});
      children = 1 + below(3);
    }
    std::string text = "<" + open + ">";
    for (std::uint64_t i = 0; i < children; ++i) text += node(depth - 1);
    return text + "</" + open.substr(0, open.find(' ')) + ">";
  }

  std::string skill(bool condition) {
    const std::uint64_t states = 2 + below(3);
    std::string text = head("s0") + "<datamodel><data id=\"n\" expr=\"0\"/></datamodel>";
    // What is answered leads on, so that no instant lasts for ever.
    const auto target = [&](std::uint64_t from) {
      const std::uint64_t to = from + below(states + 2 - from);
      return to < states ? "s" + std::to_string(to) : std::string(to == states ? "success" : "failure");
    };
    for (std::uint64_t i = 0; i < states; ++i) {
      text += "<state id=\"s" + std::to_string(i) + "\"><onentry>";
      if (below(3) == 0) text += "<send event=\"later\" delay=\"" + number(1, 5) + pick({"0", "7", "50"}) + "ms\"/>";
      if (below(2) == 0) text += "<send type=\"thrift\" target=\"device\" event=\"ask\"/>";
      if (below(3) == 0)
        text += "<send type=\"thrift\" target=\"device\" event=\"put\"><param name=\"what\" expr=\"n\"/></send>";
      if (below(3) == 0) text += "<assign location=\"n\" expr=\"(n + 1) % 3\"/>";
      if (below(4) == 0) text += "<log label=\"n\" expr=\"n\"/>";
      text += "</onentry>";
      if (below(2) == 0)
        text += "<transition event=\"device.ask.reply\" cond=\"_event.data.result === " + number(0, 2) +
                "\" target=\"" + target(i + 1) + "\"/>";
      for (const char* event : {"tick", "later", "halt"}) {
        if (below(2) == 0) text += std::string("<transition event=\"") + event + "\" target=\"" + target(0) + "\"/>";
      }
      for (const char* event : {"device.ask.reply", "device.put.reply", "error"}) {
        if (below(2) == 0)
          text += std::string("<transition event=\"") + event + "\" target=\"" + target(i + 1) + "\"/>";
      }
      if (i == 0) text += "<transition event=\"device.ask.error\" target=\"failure\"/>";
      if (condition) text += "<transition event=\"*\" target=\"" + pick({"success", "failure"}) + "\"/>";
      text += "</state>";
    }
    return text + "<final id=\"success\"/><final id=\"failure\"/></scxml>\n";
  }

  std::string device() {
    const std::string reply = "<send type=\"thrift\" target=\"device\" event=\"";
    const auto delay = [&] {
      return below(3) == 0 ? " delay=\"" + pick({"10", "20", "40", "60", "100", "130"}) + "ms\"" : std::string();
    };
    const std::string value = pick({"v", "choose(0, 1)", "pick('says', 1, 2)", "chance(0.5) ? 1 : 2",
                                    "draw([[0.5, v], [0.5, 0]])", "between(0, 2)", "v + fresh() % 2"});
    std::string text = head("there") + "<datamodel><data id=\"v\" expr=\"" + pick({"0", "1", "choose(0, 2)"}) +
                       "\"/></datamodel><state id=\"there\">";
    const bool has_time = below(2) == 0;
    const std::string wait = has_time ? "<send event=\"time\" delay=\"" + pick({"50", "100", "150"}) + "ms\"/>" : "";
    text += "<onentry>" + wait + "</onentry>";
    if (has_time) {
      text += "<transition event=\"time\"><assign location=\"v\" expr=\"" +
              pick({"(v + 1) % 3", "choose(v, 0)", "chance(0.25) ? 2 : v"}) + "\"/>" + wait + "</transition>";
    }
    text += "<transition event=\"device.ask.request\">";
    if (below(6) == 0)
      text += reply + "ask.error\"" + delay() + "><param name=\"message\" expr=\"'no'\"/></send>";
    else
      text += reply + "ask.reply\"" + delay() + "><param name=\"result\" expr=\"" + value + "\"/></send>";
    text +=
        "</transition><transition event=\"device.put.request\"><assign location=\"v\" "
        "expr=\"_event.data.args.what\"/>";
    if (below(6) != 0) text += reply + "put.reply\"" + delay() + "/>";
    return text + "</transition></state></scxml>\n";
  }

  static std::string head(const std::string& initial) {
    return "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\" initial=\"" +
           initial + "\">";
  }

  std::string faults() {
    std::string all;
    const auto add = [&](const std::string& fault) {
      if (below(5) == 0) all += (all.empty() ? "{" : ", {") + fault + "}";
    };
    const std::string leaf = leaves_ > 0 ? "L" + number(1, leaves_) : "";
    add("kill: device");
    add("delay: {message: device.*, by: " + number(1, 20) + "0 ms}");
    add("delay: {message: device.ask.reply, by: " + number(1, 20) + "0 ms, count: 2}");
    add("falsify: {call: device.ask, value: " + number(0, 2) + "}");
    if (leaf.empty()) return all;
    add("kill: " + leaf);
    add("delay: {message: " + leaf + ".tick, by: " + number(1, 25) + "0 ms}");
    add("delay: {message: \"*.halt\", by: " + number(1, 25) + "0 ms}");
    add("force: {leaf: " + leaf + ", status: " + pick({"SUCCESS", "FAILURE", "RUNNING"}) + "}");
    return all;
  }

  Rng rng_;
  int nodes_ = 0;
  std::uint64_t leaves_ = 0;
};

std::uint64_t environment(const char* name, std::uint64_t otherwise) {
  const char* const text = std::getenv(name);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

TEST(PartMemory, FindsWhatIsExecutedInRandomProjects) {
  const std::uint64_t only = environment("SENTREE_SEED", 0);
  const std::uint64_t seeds = environment("SENTREE_SEEDS", kSeeds);
  std::size_t tried = 0;
  std::size_t states = 0;
  for (std::uint64_t seed = only != 0 ? only : 1; seed <= (only != 0 ? only : seeds); ++seed) {
    const TemporaryFolder folder("memory");
    RandomProject(seed).write(folder.path());
    auto project = project::load_project(folder.path());
    ASSERT_TRUE(project.ok()) << "seed " << seed << ": " << to_string(project.diagnostics.front());
    const auto plan = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
    if (!plan.ok()) continue;  // what no project may be
    Options options;
    options.order = seed % 3 == 0 ? Order::kAny : Order::kVirtual;
    options.faults = plan.value->scenario.project.verify.faults;
    options.faults_at_most = plan.value->scenario.project.verify.faults_at_most;
    const Both both(*plan.value, options, 30);
    EXPECT_EQ(both.wrong, "") << "seed " << seed;
    if (!both.wrong.empty()) return;
    tried += both.states > 1 ? 1U : 0U;
    states += both.states;
  }
  std::cout << tried << " projects, " << states << " states\n";
  if (only != 0) return;
  EXPECT_GT(tried, seeds / 2) << "hardly any project does anything";
  EXPECT_GT(states, seeds * 5);
}

}  // namespace
}  // namespace sentree::verify
