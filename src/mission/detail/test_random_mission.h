#pragma once

#include <filesystem>
#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/rng.h"
#include "sentree/text/file.h"

namespace sentree::mission {

struct RandomNode {
  std::string open;  // "<Sequence" with its attributes
  std::vector<RandomNode> children;
  friend bool operator==(const RandomNode&, const RandomNode&) = default;
};

// A value of an interface, as the IDL names its type, and as charts write it.
struct RandomType {
  std::string name;
  std::vector<std::string> values;
};

struct RandomMethod {
  std::string name;
  bool oneway = false;
  std::vector<RandomType> arguments;
  RandomType result;    // none: void
  bool throws = false;  // Broken
};

struct RandomService {
  std::string name;
  bool is_served = true;  // by a model; else it has topics alone
  std::vector<RandomMethod> methods;
};

// What one seed stands for.
struct RandomMission {
  RandomNode tree;
  std::map<std::string, std::string> charts;  // of skills, by ID
  std::vector<RandomService> services;
  std::map<std::string, std::string> models;                  // charts, by name, each of the service that is so called
  std::map<std::string, std::vector<std::string>> subscribe;  // by ID of a skill or name of a model
  std::vector<std::string> timeline;
  std::uint64_t seed = 0;
  bool repeats = false;
  bool simulated = true;  // a robot; else a model stands for it, and all is a value
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

inline std::string idl_text(const RandomMission& mission) {
  std::string text =
      "enum Mode { OFF, SLOW, FAST }\nstruct Spot { 1: double x, 2: string name, 3: optional Mode mode }\n"
      "exception Broken { 1: string why, 2: i32 code }\n";
  for (const RandomService& service : mission.services) {
    text += "service " + service.name + " {\n";
    for (const RandomMethod& method : service.methods) {
      text +=
          method.oneway ? "  oneway void " : "  " + (method.result.name.empty() ? "void" : method.result.name) + " ";
      text += method.name + "(";
      for (std::size_t i = 0; i < method.arguments.size(); ++i) {
        const std::string number = std::to_string(i + 1);
        text += (i > 0 ? ", " : "") + number + ": " + method.arguments[i].name + " a" + number;
      }
      text += std::string(")") + (method.throws ? " throws (1: Broken broken)" : "") + "\n";
    }
    text += "}\n";
  }
  return text;
}

inline std::string project_text(const RandomMission& mission) {
  const auto subscribed = [&](const std::string& who) {
    std::string text;
    if (const auto of = mission.subscribe.find(who); of != mission.subscribe.end()) {
      for (const std::string& topic : of->second) text += (text.empty() ? "" : ", ") + topic;
    }
    return text.empty() ? text : ", subscribe: [" + text + "]";
  };
  const std::string at = mission.simulated ? "sim" : "model";
  std::string text = "mission: {file: mission.xml, tree: Main, rate: 10 Hz" +
                     std::string(mission.repeats ? ", repeat: true" : "") + "}\n";
  if (mission.simulated) text += "world: world/world.yaml\n";
  text += "services:\n  battery: {interface: robot.thrift/Battery, at: " + at +
          "}\n  navigation: {interface: robot.thrift/Navigation, at: " + at + "}\n";
  if (mission.simulated)
    text += "  robot: {interface: robot.thrift/Telemetry, at: sim, publish: {battery: 2 Hz, position: 1 Hz}}\n";
  for (const RandomService& service : mission.services) {
    text += "  " + service.name + ": {interface: parts.thrift/" + service.name +
            ", at: " + (service.is_served ? "model" : "topics") + "}\n";
  }
  text += "models:\n  - {file: models/robot.scxml, name: the_robot, serves: [battery, navigation]}\n";
  for (const auto& [name, chart] : mission.models)
    text += "  - {file: models/" + name + ".scxml, name: the_" + name + ", serves: [" + name + "]" + subscribed(name) +
            "}\n";
  std::string skills;
  for (const auto& [id, chart] : mission.charts) {
    if (const std::string topics = subscribed(id); !topics.empty())
      skills += "  " + id + ": {file: skills/" + id + ".scxml" + topics + "}\n";
  }
  return text + (skills.empty() ? "" : "skills:\n" + skills);
}

inline std::string scenario_text(const RandomMission& mission) {
  std::string text = "duration: 40 s\nseed: " + std::to_string(mission.seed % 1000 + 1) + "\n";
  if (!mission.timeline.empty()) text += "timeline:\n";
  for (const std::string& entry : mission.timeline) text += "  - " + entry + "\n";
  return text;
}

// All files of its project that are not those of examples/recharge.
inline std::map<std::string, std::string> files_of(const RandomMission& mission) {
  std::map<std::string, std::string> files{{"sentree.yaml", project_text(mission)},
                                           {"mission.xml", mission_text(mission)},
                                           {"interfaces/parts.thrift", idl_text(mission)},
                                           {"scenarios/random.yaml", scenario_text(mission)}};
  for (const auto& [id, chart] : mission.charts) files["skills/" + id + ".scxml"] = chart;
  for (const auto& [name, chart] : mission.models) files["models/" + name + ".scxml"] = chart;
  return files;
}

class MissionGenerator {
 public:
  /// @param simulated  There is a simulated robot.
  explicit MissionGenerator(std::uint64_t seed, bool simulated = true) : rng_(seed) {
    mission_.seed = seed;
    mission_.simulated = simulated;
  }

  RandomMission make() {
    const std::uint64_t services = below(4);
    for (std::uint64_t i = 0; i < services; ++i) mission_.services.push_back(service(i));
    if (mission_.simulated) topics_.insert(topics_.end(), {"robot.battery", "robot.position"});
    for (const RandomService& of : mission_.services) {
      if (of.is_served) mission_.models[of.name] = model(of);
    }
    mission_.repeats = below(3) == 0;
    mission_.tree = node(4);
    mission_.charts["Any"] = chart("Any", false);
    mission_.charts["Ask"] = chart("Ask", true);
    const std::uint64_t entries = below(6);
    for (std::uint64_t i = 0; i < entries; ++i) mission_.timeline.push_back(entry());
    return std::move(mission_);
  }

 private:
  std::uint64_t below(std::uint64_t bound) { return rng_.below(bound); }
  std::string pick(std::initializer_list<const char*> words) { return *(words.begin() + below(words.size())); }
  template <class T>
  const T& any_of(const std::vector<T>& all) {
    return all[below(all.size())];
  }
  std::string number(std::uint64_t from, std::uint64_t to) { return std::to_string(from + below(to - from + 1)); }

  RandomType type() {
    switch (below(10)) {
      case 0: return {"bool", {"true", "false"}};
      case 1: return {"i32", {"0", "7", "-2147483648"}};
      case 2: return {"i64", {"1", "-5", "4503599627370496"}};
      case 3: return {"double", {"0.5", "-1e300", "3"}};
      case 4: return {"string", {"''", "'a'", "'\u00e4 &lt;'"}};
      case 5: return {"Mode", {"'OFF'", "'SLOW'", "'FAST'"}};
      case 6: return {"Spot", {"({x: 1, name: 'here'})", "({x: -0.5, name: '', mode: 'FAST'})"}};
      case 7: return {"list<i16>", {"[]", "[1]", "[3, 2, 1]"}};
      case 8: return {"map<string, Spot>", {"({})", "({a: {x: 0, name: 'b'}})"}};
      default: return {"list<Mode>", {"['SLOW']", "['OFF', 'FAST']"}};
    }
  }

  RandomService service(std::uint64_t index) {
    RandomService made{"part" + std::to_string(index), below(4) != 0, {}};
    const std::uint64_t methods = 1 + below(4);
    for (std::uint64_t i = 0; i < methods; ++i) {
      RandomMethod method{"m" + std::to_string(i), !made.is_served || below(4) == 0, {}, {}, false};
      for (std::uint64_t a = below(3); a > 0; --a) method.arguments.push_back(type());
      if (!method.oneway && below(4) != 0) method.result = type();
      method.throws = !method.oneway && below(3) == 0;
      if (method.oneway) topics_.push_back(made.name + "." + method.name);
      made.methods.push_back(std::move(method));
    }
    return made;
  }

  std::string call(const RandomService& of, const RandomMethod& method) {
    std::string text = "<send type=\"thrift\" target=\"" + of.name + "\" event=\"" + method.name + "\"";
    if (method.arguments.empty()) return text + "/>";
    text += ">";
    for (std::size_t i = 0; i < method.arguments.size(); ++i)
      text += "<param name=\"a" + std::to_string(i + 1) + "\" expr=\"" + any_of(method.arguments[i].values) + "\"/>";
    return text + "</send>";
  }

  // Publishes on a topic; empty: there is none.
  // @param by  Models publish on what they serve, and on what nobody does.
  std::string publication(const std::string& by) {
    std::vector<std::string> all;
    for (const RandomService& of : mission_.services) {
      for (const RandomMethod& method : of.methods) {
        if (method.oneway && (by.empty() || !of.is_served || of.name == by)) all.push_back(call(of, method));
      }
    }
    return all.empty() ? "" : any_of(all);
  }

  // A call of what a chart may ask, and the name of its outcome's events.
  std::pair<std::string, std::string> question() {
    std::vector<std::pair<std::string, std::string>> all{
        {"<send type=\"thrift\" target=\"battery\" event=\"getBatteryState\"/>", "battery.getBatteryState"},
        {"<send type=\"thrift\" target=\"navigation\" event=\"getNavigationState\"/>",
         "navigation.getNavigationState"}};
    for (const RandomService& of : mission_.services) {
      for (const RandomMethod& method : of.methods) {
        if (!method.oneway) all.emplace_back(call(of, method), of.name + "." + method.name);
      }
    }
    return any_of(all);
  }

  // Hears some of the topics there are.
  std::vector<std::string> subscribed(const std::string& who) {
    std::vector<std::string> heard;
    for (const std::string& topic : topics_) {
      if (below(3) == 0) heard.push_back(topic);
    }
    if (!heard.empty()) mission_.subscribe[who] = heard;
    return heard;
  }

  static std::string head() {
    return "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\">\n";
  }

  // What answers a request: at once or later, rightly, wrongly, twice, or not at all.
  std::string answer(const RandomService& of, const RandomMethod& method) {
    const std::string open = "<send type=\"thrift\" target=\"" + of.name + "\" event=\"" + method.name + ".";
    const std::string delay =
        below(2) == 0 ? "" : " delay=\"" + pick({"1", "5", "20", "39", "40", "41", "90", "350"}) + "ms\"";
    switch (below(12)) {
      case 0: return "";
      case 1: return open + "error\"" + delay + "><param name=\"message\" expr=\"'no ' + v\"/></send>";
      case 2:
        if (!method.throws) break;
        return open + "error\"" + delay +
               "><param name=\"exception\" expr=\"({Broken: {why: 'v', code: v}})\"/></send>";
      case 3: return open + "reply\"" + delay + "><param name=\"result\" expr=\"v === -1 ? 0 : [[v]]\"/></send>";
      default: break;
    }
    std::string reply = open + "reply\"" + delay;
    if (method.result.name.empty()) {
      reply += "/>";
    } else {
      const std::string one = any_of(method.result.values);
      const std::string other = any_of(method.result.values);
      const std::string chosen = pick({"choose(", "pick('says', "}) + one + ", " + other + ")";
      reply += "><param name=\"result\" expr=\"" +
               (below(3) == 0   ? chosen
                : below(2) == 0 ? "v % 2 ? " + one + " : " + other
                                : one) +
               "\"/></send>";
    }
    return below(10) == 0 ? reply + reply : reply;
  }

  // A component that answers, changes by itself and publishes, as chance has it.
  std::string model(const RandomService& of) {
    const std::uint64_t states = 1 + below(3);
    const auto maybe_target = [&] { return below(3) == 0 ? " target=\"m" + std::to_string(below(states)) + "\"" : ""; };
    std::string text =
        head() + "<datamodel><data id=\"v\" expr=\"" + pick({"0", "3", "between(0, 4)"}) + "\"/></datamodel>\n";
    const std::vector<std::string> heard = subscribed(of.name);
    for (std::uint64_t i = 0; i < states; ++i) {
      text += "<state id=\"m" + std::to_string(i) + "\"><onentry>";
      // One timer at a time.
      const bool has_timer = below(3) != 0;
      const std::string timer =
          has_timer ? "<send event=\"time\" id=\"timer\" delay=\"" + number(20, 3000) + "ms\"/>" : "";
      const std::string to = maybe_target();
      text += timer + "</onentry>" + (has_timer ? "<onexit><cancel sendid=\"timer\"/></onexit>" : "") + "\n";
      text +=
          "<transition event=\"time\"" + to + "><assign location=\"v\" expr=\"" +
          pick({"(v + 1) % 5", "choose(0, v)", "chance(0.25) ? 4 : v", "draw([[0.5, v], [0.5, 1]])", "fresh() % 7"}) +
          "\"/>" + (below(2) == 0 ? publication(of.name) : "") + (to.empty() ? timer : "") + "</transition>\n";
      for (const RandomMethod& method : of.methods) {
        if (below(8) == 0) continue;  // late, then
        text += "<transition event=\"" + of.name + "." + method.name + ".request\"" + maybe_target() + ">";
        if (below(3) == 0)
          text += "<assign location=\"v\" expr=\"" + pick({"(v + 1) % 5", "between(0, 3)", "0"}) + "\"/>";
        text += (method.oneway ? "" : answer(of, method)) + "</transition>\n";
      }
      for (const std::string& topic : heard) {
        text += "<transition event=\"" + topic + "\"" + maybe_target() +
                "><assign location=\"v\" expr=\"(v + 2) % 5\"/></transition>\n";
      }
      text += "</state>\n";
    }
    return text + "</scxml>\n";
  }

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

  // A chart that waits, asks, publishes, hears, answers and ends as chance has it; a condition ends soon.
  std::string chart(const std::string& id, bool condition) {
    const std::uint64_t states = 2 + below(3);
    std::string text = head();
    const auto target = [&](std::uint64_t from) {
      const std::uint64_t to = from + below(states + 3 - from);
      if (to < states) return "s" + std::to_string(to);
      return std::string(to == states ? "success" : to == states + 1 ? "failure" : "halted");
    };
    const std::vector<std::string> heard = subscribed(id);
    for (std::uint64_t i = 0; i < states; ++i) {
      const std::string name = "s" + std::to_string(i);
      text += "<state id=\"" + name + "\"><onentry>";
      if (below(2) == 0) text += "<send event=\"later\" delay=\"" + number(10, 1500) + "ms\"/>";
      std::vector<std::string> asked;
      for (std::uint64_t k = below(3); k > 0; --k) {
        const auto [call, event] = question();
        text += call;
        asked.push_back(event);
      }
      if (below(6) == 0) text += publication("");
      if (below(4) == 0) text += "<log label=\"at\" expr=\"'" + name + "'\"/>";
      text += "</onentry>";
      for (const char* event : {"tick", "later", "error", "halt"}) {
        if (below(2) != 0 && !(i == 0 && event == std::string_view("error"))) continue;
        // One that asks again at once what cannot be reached would do nothing else.
        const std::string to = event == std::string_view("error") ? pick({"success", "failure", "halted"}) : target(0);
        text += std::string("<transition event=\"") + event + "\" target=\"" + to + "\"/>";
      }
      // Likewise what is answered or heard, which leads on.
      for (const std::string& event : asked) {
        if (below(4) != 0) text += "<transition event=\"" + event + ".reply\" target=\"" + target(i + 1) + "\"/>";
        if (below(4) == 0) text += "<transition event=\"" + event + ".error\" target=\"" + target(i + 1) + "\"/>";
      }
      for (const std::string& topic : heard) {
        if (below(2) == 0 || i == 0) text += "<transition event=\"" + topic + "\" target=\"" + target(i + 1) + "\"/>";
      }
      if (condition) text += "<transition event=\"*\" target=\"" + pick({"success", "failure"}) + "\"/>";
      text += "</state>\n";
    }
    return text + "<final id=\"success\"/><final id=\"failure\"/><final id=\"halted\"/></scxml>\n";
  }

  std::string entry() {
    const std::string at = "{at: " + number(0, 39000) + " ms, ";
    const std::string some_leaf = leaves_ > 0 ? "L" + number(1, leaves_) : "";
    const RandomService& of =
        mission_.services.empty() || below(2) == 0 ? kBattery : mission_.services[below(mission_.services.size())];
    const RandomMethod& method = any_of(of.methods);
    const std::string called = of.name + "." + method.name;
    switch (below(some_leaf.empty() ? 10 : 14)) {
      case 0:
        if (!mission_.simulated) return at + "late: \"battery.*\"}";
        return at + "call: simulation.setBatteryCharge, args: {percent: " + number(5, 100) + "}}";
      case 1:
        return at + "delay: {message: " + of.name + ".*, by: " + number(1, 900) + " ms, count: " + number(1, 20) + "}}";
      case 2:
        if (method.result.name == "i32")
          return at + "falsify: {call: " + called + ", value: " + number(0, 9) + ", count: 5}}";
        return at + "falsify: {call: battery.getBatteryState, path: percentage, value: 0." + number(1, 9) +
               ", count: 5}}";
      case 3: return at + "kill: " + (of.is_served ? of.name : "battery") + "}";
      case 4: return at + "delay: {message: \"*.halt\", by: " + number(1, 3000) + " ms, count: 3}}";
      case 5:
        return at + "restart: " +
               (mission_.simulated ? pick({"battery", "sim"})
                : of.is_served     ? of.name
                                   : "battery") +
               "}";
      case 6: return at + "unreachable: " + (method.oneway ? "battery.*" : called) + "}";
      case 7: return at + "late: " + (method.oneway ? "battery.*" : called) + "}";
      case 8: return at + "clear: " + number(1, 4) + "}";
      case 9: return at + "kill: " + (mission_.simulated ? "sim" : "navigation") + "}";
      case 10: return at + "kill: " + some_leaf + "}";
      case 11: return at + "restart: " + some_leaf + "}";
      case 12: return at + "force: {leaf: " + some_leaf + ", status: " + pick({"SUCCESS", "FAILURE", "RUNNING"}) + "}}";
      default: return at + "delay: {message: \"*.tick\", by: " + number(1, 400) + " ms, count: " + number(1, 30) + "}}";
    }
  }

  inline static const RandomService kBattery{"battery", true, {{"getBatteryState", false, {}, {}, false}}};

  Rng rng_;
  RandomMission mission_;
  std::vector<std::string> topics_;
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
    fs::create_directory(folder_ / "interfaces");
  }
  /// Returns its scenario.
  [[nodiscard]] Result<std::filesystem::path> write(const RandomMission& mission) const {
    for (const auto& [name, text] : files_of(mission)) {
      if (auto written = text::write_file(folder_ / name, text); !written) return tl::unexpected(written.error());
    }
    return folder_ / "scenarios/random.yaml";
  }

 private:
  const std::filesystem::path folder_;
};

}  // namespace sentree::mission
