// The whole system but the machine: random trees, charts, faults and times from one seed, in virtual time.
//
// SENTREE_SEEDS=N runs N missions instead of the usual ones, SENTREE_SEED=S only that of seed S.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/project/plan.h"
#include "sentree/runtime/run.h"
#include "sentree/text/file.h"

namespace sentree::runtime {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kSeeds = 300;

struct Node {
  std::string open;  // "<Sequence" with its attributes
  std::vector<Node> children;
  friend bool operator==(const Node&, const Node&) = default;
};

// What one seed stands for.
struct Mission {
  Node tree;
  std::map<std::string, std::string> charts;  // by ID
  std::vector<std::string> timeline;
  std::uint64_t seed = 0;
};

std::string text_of(const Node& node) {
  if (node.children.empty()) return node.open + "/>";
  std::string text = node.open + ">";
  for (const Node& child : node.children) text += text_of(child);
  return text + "</" + node.open.substr(1, node.open.find(' ') - 1) + ">";
}

std::string mission_text(const Mission& mission) {
  return "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\">" + text_of(mission.tree) +
         "</BehaviorTree><TreeNodesModel><Condition ID=\"BatteryLevelAbove\"><input_port name=\"threshold\" "
         "type=\"double\"/></Condition><Condition ID=\"AtLocation\"><input_port name=\"location\" "
         "type=\"std::string\"/></Condition><Action ID=\"GoToLocation\"><input_port name=\"destination\" "
         "type=\"std::string\"/><output_port name=\"reason\" type=\"std::string\"/></Action><Action ID=\"Any\"/>"
         "<Condition ID=\"Ask\"/></TreeNodesModel></root>\n";
}

std::string scenario_text(const Mission& mission) {
  std::string text = "duration: 40 s\nseed: " + std::to_string(mission.seed % 1000 + 1) + "\n";
  if (!mission.timeline.empty()) text += "timeline:\n";
  for (const std::string& entry : mission.timeline) text += "  - " + entry + "\n";
  return text;
}

class Generator {
 public:
  explicit Generator(std::uint64_t seed) : rng_(seed) { mission_.seed = seed; }

  Mission make() {
    mission_.tree = node(4);
    mission_.charts["Any"] = chart(false);
    mission_.charts["Ask"] = chart(true);
    const std::uint64_t entries = below(6);
    for (std::uint64_t i = 0; i < entries; ++i) mission_.timeline.push_back(entry());
    return std::move(mission_);
  }

 private:
  std::uint64_t below(std::uint64_t bound) { return rng_.below(bound); }
  std::string pick(std::initializer_list<const char*> words) { return *(words.begin() + below(words.size())); }
  std::string number(std::uint64_t from, std::uint64_t to) { return std::to_string(from + below(to - from + 1)); }

  Node node(int depth) {
    if (depth == 0 || below(4) == 0) return leaf();
    if (below(3) == 0) {
      const std::string open = pick({"<Inverter", "<ForceSuccess", "<ForceFailure", "<Repeat num_cycles=\"2\"",
                                     "<RetryUntilSuccessful num_attempts=\"2\"", "<KeepRunningUntilFailure"});
      if (below(4) == 0) return {"<Timeout msec=\"" + number(100, 5000) + "\"", {node(depth - 1)}};
      if (below(6) == 0) return {"<Delay delay_msec=\"" + number(50, 900) + "\"", {node(depth - 1)}};
      return {open, {node(depth - 1)}};
    }
    Node made{pick({"<Sequence", "<Fallback", "<ReactiveSequence", "<ReactiveFallback", "<SequenceWithMemory",
                    "<Parallel success_count=\"1\" failure_count=\"1\""}),
              {}};
    const std::uint64_t children = 1 + below(3);
    for (std::uint64_t i = 0; i < children; ++i) made.children.push_back(node(depth - 1));
    return made;
  }

  Node leaf() {
    const std::string name = " name=\"L" + std::to_string(++leaves_) + "\"";
    switch (below(7)) {
      case 0:
        return {"<Action ID=\"GoToLocation\"" + name + " destination=\"" + pick({"kitchen", "station"}) + "\"", {}};
      case 1: return {"<Condition ID=\"AtLocation\"" + name + " location=\"" + pick({"kitchen", "station"}) + "\"", {}};
      case 2: return {"<Condition ID=\"BatteryLevelAbove\"" + name + " threshold=\"" + number(10, 90) + "\"", {}};
      case 3: return {"<Condition ID=\"Ask\"" + name, {}};
      case 4: return {"<Sleep msec=\"" + number(20, 3000) + "\"" + (below(4) == 0 ? " _onHalted=\"n += 1\"" : ""), {}};
      default: return {"<Action ID=\"Any\"" + name, {}};
    }
  }

  // A chart that waits, asks, answers and ends as chance has it; a condition ends soon.
  std::string chart(bool condition) {
    const std::uint64_t states = 2 + below(3);
    std::string text = "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\">\n";
    const auto target = [&] {
      const std::uint64_t to = below(states + 3);
      if (to < states) return "s" + std::to_string(to);
      return std::string(to == states ? "success" : to == states + 1 ? "failure" : "halted");
    };
    for (std::uint64_t i = 0; i < states; ++i) {
      const std::string id = "s" + std::to_string(i);
      text += "<state id=\"" + id + "\"><onentry>";
      if (below(2) == 0) text += "<send event=\"later\" delay=\"" + number(10, 1500) + "ms\"/>";
      if (below(2) == 0) text += "<send type=\"thrift\" target=\"battery\" event=\"getBatteryState\"/>";
      if (below(4) == 0) text += "<log label=\"at\" expr=\"'" + id + "'\"/>";
      text += "</onentry>";
      for (const char* event : {"tick", "later", "battery.getBatteryState.reply", "error", "halt"}) {
        if (below(2) == 0) text += std::string("<transition event=\"") + event + "\" target=\"" + target() + "\"/>";
      }
      if (condition) text += "<transition event=\"*\" target=\"" + pick({"success", "failure"}) + "\"/>";
      text += "</state>\n";
    }
    return text + "<final id=\"success\"/><final id=\"failure\"/><final id=\"halted\"/></scxml>\n";
  }

  std::string entry() {
    const std::string at = "{at: " + number(0, 39000) + " ms, ";
    const std::string some_leaf = leaves_ > 0 ? "L" + number(1, leaves_) : "";
    switch (below(6)) {
      case 0: return at + "call: simulation.setBatteryCharge, args: {percent: " + number(5, 100) + "}}";
      case 1: return at + "delay: {message: battery.*, by: " + number(1, 900) + " ms, count: " + number(1, 20) + "}}";
      case 2:
        return at + "falsify: {call: battery.getBatteryState, path: percentage, value: 0." + number(1, 9) +
               ", count: 5}}";
      case 3: return at + "kill: battery}";
      case 4: return at + "delay: {message: \"*.halt\", by: " + number(1, 3000) + " ms, count: 3}}";
      default: return at + "delay: {message: \"*.tick\", by: " + number(1, 400) + " ms, count: " + number(1, 30) + "}}";
    }
  }

  Rng rng_;
  Mission mission_;
  std::uint64_t leaves_ = 0;
};

// A project that holds what is tried.
class Bench {
 public:
  Bench() {
    fs::copy(fs::path(SENTREE_SOURCE_DIR) / "examples/recharge", folder_.path() / "p", fs::copy_options::recursive);
    write("sentree.yaml",
          "mission: {file: mission.xml, tree: Main, rate: 10 Hz}\nworld: world/world.yaml\nservices:\n"
          "  battery:    {interface: robot.thrift/Battery,    at: sim}\n"
          "  navigation: {interface: robot.thrift/Navigation, at: sim}\n");
    std::error_code ignored;
    fs::remove_all(folder_.path() / "p/scenarios", ignored);
    fs::create_directory(folder_.path() / "p/scenarios");
  }

  // What is wrong with a mission; empty: nothing.
  std::string judge(const Mission& mission) {
    write("mission.xml", mission_text(mission));
    for (const auto& [id, chart] : mission.charts) write("skills/" + id + ".scxml", chart);
    write("scenarios/random.yaml", scenario_text(mission));
    auto scenario = project::load_scenario(folder_.path() / "p/scenarios/random.yaml");
    if (!scenario.ok()) return "";  // shrunk to what no project may be
    auto plan = project::prepare(std::move(*scenario.value));
    if (!plan.ok()) return "";

    Rng rng(mission.seed ^ 0x5eedU);
    const TimePoint moment(Duration(static_cast<std::int64_t>(rng.below(40'000'000'000U))));
    std::optional<mission::State> middle;
    const std::vector<Message> first = run(*plan.value, nullptr, [&](RunInside& inside) {
      inside.scheduler().at(inside.director(), moment, mission::Rank::kInjection, [&] { middle = inside.capture(); });
    });
    // A chart that asks again at once whenever it is answered ends its run with that message.
    if (error_.find("without time passing") != std::string::npos) return "";
    if (!error_.empty()) return "the run could not go on: " + error_;
    ++runs_;
    observations_ += first.size();
    if (std::string wrong = unanswered(first); !wrong.empty()) return wrong;
    const std::vector<Message> second = run(*plan.value, nullptr, {});
    if (first != second) return "the same seed gave another run";
    if (middle) {
      const std::vector<Message> rest = run(*plan.value, &*middle, {});
      if (!std::equal(rest.begin(), rest.end(), first.begin() + static_cast<std::ptrdiff_t>(middle->published),
                      first.end()))
        return "a copy at " + shortest_decimal(seconds(moment)) + " s went on differently";
    }
    return "";
  }

  std::uint64_t runs() const { return runs_; }
  std::uint64_t observations() const { return observations_; }

 private:
  void write(const std::string& file, const std::string& text) {
    ASSERT_TRUE(text::write_file(folder_.path() / "p" / file, text).has_value());
  }

  std::vector<Message> run(const project::Plan& plan, const mission::State* from,
                           std::function<void(RunInside&)> begin) {
    std::vector<Message> said;
    RunOptions options;
    options.from = from;
    options.listeners.push_back([&](const Message& message) { said.push_back(message); });
    options.on_begin = std::move(begin);
    runtime::Run run(plan, std::move(options));
    error_ = run.execute().error;
    return said;
  }

  // Each tick and each halt is answered once, or counted as late, or made void by a halt, a cancellation or the end.
  static std::string unanswered(const std::vector<Message>& messages) {
    std::map<std::uint64_t, const Message*> open;
    std::map<std::string, std::uint64_t> ticking;
    for (const Message& message : messages) {
      const bool asks = message.source == "mission" && message.kind == MessageKind::kRequest;
      if (asks && message.name.ends_with(".tick.request")) {
        if (ticking[message.target] != 0) return message.target + " was ticked while a tick was outstanding";
        ticking[message.target] = message.call;
      }
      if (message.source == "mission" &&
          (message.name.ends_with(".halt.request") || message.name.ends_with(".cancel"))) {
        open.erase(std::exchange(ticking[message.target], 0));
      }
      if (asks) {
        if (!open.emplace(message.call, &message).second) return "call " + std::to_string(message.call) + " twice";
      } else if (message.target == "mission" && message.call != 0) {
        if (open.erase(message.call) == 0) return message.name + " of " + message.source + " answers nothing";
        if (message.name.find(".tick.") != std::string::npos) ticking[message.source] = 0;
      }
    }
    return "";
  }

  TemporaryFolder folder_{"random"};
  std::string error_;
  std::uint64_t runs_ = 0;
  std::uint64_t observations_ = 0;
};

// Whatever is left out of a mission that fails without it failing less.
Mission shrunk(Bench& bench, Mission mission) {
  int tries = 200;
  const auto fails = [&](const Mission& less) { return tries-- > 0 && !bench.judge(less).empty(); };
  for (std::size_t i = mission.timeline.size(); i-- > 0;) {
    Mission less = mission;
    less.timeline.erase(less.timeline.begin() + static_cast<std::ptrdiff_t>(i));
    if (fails(less)) mission = std::move(less);
  }
  // Each node in turn becomes one of its children, or loses one.
  const std::function<bool(Mission&, Node&)> less_of = [&](Mission& whole, Node& node) {
    for (std::size_t i = 0; i < node.children.size(); ++i) {
      const Node before = node;
      Node child = node.children[i];
      node = std::move(child);
      if (fails(whole)) return true;
      node = before;
      if (node.children.size() > 1) {
        node.children.erase(node.children.begin() + static_cast<std::ptrdiff_t>(i));
        if (fails(whole)) return true;
        node = before;
      }
      if (less_of(whole, node.children[i])) return true;
    }
    return false;
  };
  while (tries > 0 && less_of(mission, mission.tree)) {
  }
  return mission;
}

TEST(RandomMissions, EndAnswerOnceAndAreTheSameAgain) {
  const char* only = std::getenv("SENTREE_SEED");
  const char* many = std::getenv("SENTREE_SEEDS");
  const std::uint64_t first = only != nullptr ? std::strtoull(only, nullptr, 10) : 1;
  const std::uint64_t count = only != nullptr ? 1 : many != nullptr ? std::strtoull(many, nullptr, 10) : kSeeds;
  Bench bench;
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    const Mission mission = Generator(seed).make();
    const std::string wrong = bench.judge(mission);
    if (wrong.empty()) continue;
    const Mission less = shrunk(bench, mission);
    std::string charts;
    for (const auto& [id, chart] : less.charts) charts += "skills/" + id + ".scxml:\n" + chart;
    FAIL() << "seed " << seed << ": " << wrong << "\nshrunk: " << bench.judge(less) << "\nmission.xml:\n"
           << mission_text(less) << "scenario:\n"
           << scenario_text(less) << charts;
  }
  std::cout << bench.runs() << " missions, " << bench.observations() << " observations\n";
  EXPECT_GT(bench.runs(), count / 2);  // the others are refused
}

}  // namespace
}  // namespace sentree::runtime
