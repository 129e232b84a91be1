#pragma once

#include <filesystem>
#include <initializer_list>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/rng.h"
#include "sentree/text/file.h"

namespace sentree::runtime {

struct RandomNode {
  std::string open;  // "<Sequence" with its attributes
  std::vector<RandomNode> children;
  friend bool operator==(const RandomNode&, const RandomNode&) = default;
};

// What one seed stands for.
struct RandomMission {
  RandomNode tree;
  std::map<std::string, std::string> charts;  // by ID
  std::vector<std::string> timeline;
  std::uint64_t seed = 0;
};

inline std::string text_of(const RandomNode& node) {
  if (node.children.empty()) return node.open + "/>";
  std::string text = node.open + ">";
  for (const RandomNode& child : node.children) text += text_of(child);
  return text + "</" + node.open.substr(1, node.open.find(' ') - 1) + ">";
}

inline std::string mission_text(const RandomMission& mission) {
  return "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\">" + text_of(mission.tree) +
         "</BehaviorTree><BehaviorTree ID=\"Part\"><ReactiveSequence><Condition ID=\"Ask\"/><Action ID=\"Any\"/>"
         "</ReactiveSequence></BehaviorTree><TreeNodesModel><Condition ID=\"BatteryLevelAbove\"><input_port "
         "name=\"threshold\" "
         "type=\"double\"/></Condition><Condition ID=\"AtLocation\"><input_port name=\"location\" "
         "type=\"std::string\"/></Condition><Action ID=\"GoToLocation\"><input_port name=\"destination\" "
         "type=\"std::string\"/><output_port name=\"reason\" type=\"std::string\"/></Action><Action ID=\"Any\"/>"
         "<Condition ID=\"Ask\"/></TreeNodesModel></root>\n";
}

inline std::string project_text() {
  return "mission: {file: mission.xml, tree: Main, rate: 10 Hz}\nworld: world/world.yaml\nservices:\n"
         "  battery:    {interface: robot.thrift/Battery,    at: sim}\n"
         "  navigation: {interface: robot.thrift/Navigation, at: sim}\n";
}

inline std::string scenario_text(const RandomMission& mission) {
  std::string text = "duration: 40 s\nseed: " + std::to_string(mission.seed % 1000 + 1) + "\n";
  if (!mission.timeline.empty()) text += "timeline:\n";
  for (const std::string& entry : mission.timeline) text += "  - " + entry + "\n";
  return text;
}

class MissionGenerator {
 public:
  explicit MissionGenerator(std::uint64_t seed) : rng_(seed) { mission_.seed = seed; }

  RandomMission make() {
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

  RandomNode node(int depth) {
    if (depth == 0 || below(4) == 0) return leaf();
    if (below(3) == 0) {
      const std::string open = pick({"<Inverter", "<ForceSuccess", "<ForceFailure", "<Repeat num_cycles=\"2\"",
                                     "<RetryUntilSuccessful num_attempts=\"2\"", "<KeepRunningUntilFailure"});
      if (below(4) == 0) return {"<Timeout msec=\"" + number(100, 5000) + "\"", {node(depth - 1)}};
      if (below(6) == 0) return {"<Delay delay_msec=\"" + number(50, 900) + "\"", {node(depth - 1)}};
      return {open, {node(depth - 1)}};
    }
    RandomNode made{pick({"<Sequence", "<Fallback", "<ReactiveSequence", "<ReactiveFallback", "<SequenceWithMemory",
                          "<Parallel success_count=\"1\" failure_count=\"1\""}),
                    {}};
    const std::uint64_t children = 1 + below(3);
    for (std::uint64_t i = 0; i < children; ++i) made.children.push_back(node(depth - 1));
    return made;
  }

  // A script at some moment of a node, one of which fails.
  std::string hook() {
    if (below(6) != 0) return "";
    return " " + pick({"_onHalted", "_onSuccess", "_onFailure", "_post"}) + "=\"" +
           pick({"n := 1", "m := 2", "m := m + 1"}) + "\"";
  }

  RandomNode leaf() {
    if (below(8) == 0) return {"<Script code=\"" + pick({"n := 1", "m := 3"}) + "\"" + hook(), {}};
    if (below(12) == 0) return {"<SubTree ID=\"Part\" name=\"P" + std::to_string(++parts_) + "\"" + hook(), {}};
    const std::string name = " name=\"L" + std::to_string(++leaves_) + "\"" + hook();
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
        if (below(2) != 0) continue;
        // One that asks again at once what cannot be reached would do nothing else.
        const std::string to = event == std::string_view("error") ? pick({"success", "failure", "halted"}) : target();
        text += std::string("<transition event=\"") + event + "\" target=\"" + to + "\"/>";
      }
      if (condition) text += "<transition event=\"*\" target=\"" + pick({"success", "failure"}) + "\"/>";
      text += "</state>\n";
    }
    return text + "<final id=\"success\"/><final id=\"failure\"/><final id=\"halted\"/></scxml>\n";
  }

  std::string entry() {
    const std::string at = "{at: " + number(0, 39000) + " ms, ";
    const std::string some_leaf = leaves_ > 0 ? "L" + number(1, leaves_) : "";
    switch (below(some_leaf.empty() ? 10 : 14)) {
      case 0: return at + "call: simulation.setBatteryCharge, args: {percent: " + number(5, 100) + "}}";
      case 1: return at + "delay: {message: battery.*, by: " + number(1, 900) + " ms, count: " + number(1, 20) + "}}";
      case 2:
        return at + "falsify: {call: battery.getBatteryState, path: percentage, value: 0." + number(1, 9) +
               ", count: 5}}";
      case 3: return at + "kill: battery}";
      case 4: return at + "delay: {message: \"*.halt\", by: " + number(1, 3000) + " ms, count: 3}}";
      case 5: return at + "restart: " + pick({"battery", "sim"}) + "}";
      case 6: return at + "unreachable: battery.getBatteryState}";
      case 7: return at + "late: battery.getBatteryState}";
      case 8: return at + "clear: " + number(1, 4) + "}";
      case 9: return at + "kill: sim}";
      case 10: return at + "kill: " + some_leaf + "}";
      case 11: return at + "restart: " + some_leaf + "}";
      case 12: return at + "force: {leaf: " + some_leaf + ", status: " + pick({"SUCCESS", "FAILURE", "RUNNING"}) + "}}";
      default: return at + "delay: {message: \"*.tick\", by: " + number(1, 400) + " ms, count: " + number(1, 30) + "}}";
    }
  }

  Rng rng_;
  RandomMission mission_;
  std::uint64_t leaves_ = 0;
  std::uint64_t parts_ = 0;
};

/// A project in a folder that is not there yet, for missions of one generator after the other.
class RandomProject {
 public:
  explicit RandomProject(std::filesystem::path folder) : folder_(std::move(folder)) {
    namespace fs = std::filesystem;
    fs::copy(fs::path(SENTREE_SOURCE_DIR) / "examples/recharge", folder_, fs::copy_options::recursive);
    std::error_code ignored;
    fs::remove_all(folder_ / "scenarios", ignored);
    fs::create_directory(folder_ / "scenarios");
  }
  /// Returns its scenario.
  [[nodiscard]] Result<std::filesystem::path> write(const RandomMission& mission) const {
    std::map<std::string, std::string> files{{"sentree.yaml", project_text()},
                                             {"mission.xml", mission_text(mission)},
                                             {"scenarios/random.yaml", scenario_text(mission)}};
    for (const auto& [id, chart] : mission.charts) files["skills/" + id + ".scxml"] = chart;
    for (const auto& [name, text] : files) {
      if (auto written = text::write_file(folder_ / name, text); !written) return tl::unexpected(written.error());
    }
    return folder_ / "scenarios/random.yaml";
  }

 private:
  const std::filesystem::path folder_;
};

}  // namespace sentree::runtime
