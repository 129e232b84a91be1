#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <string>

#include "sentree/base/rng.h"
#include "sentree/text/file.h"

namespace sentree::verify {

// A mission of at most eight nodes with charts of at most six states, and devices that leave things open. Of several,
// each has skills and a model of its own, and nothing has a probability.
class RandomProject {
 public:
  explicit RandomProject(std::uint64_t seed, std::uint64_t devices = 1) : rng_(seed), devices_(devices) {}

  void write(const std::filesystem::path& folder) {
    const auto put = [&](const std::string& file, const std::string& text) {
      std::filesystem::create_directories((folder / file).parent_path());
      ASSERT_TRUE(text::write_file(folder / file, text));
    };
    put("interfaces/device.thrift", "service Device { i32 ask(), void put(1: i32 what) }\n");
    const std::string tree = node(3);
    put("mission.xml", "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\">" + tree +
                           "</BehaviorTree><TreeNodesModel><Action ID=\"Do\"/><Action ID=\"Do2\"/>"
                           "<Action ID=\"Do3\"/><Condition ID=\"Is\"/></TreeNodesModel></root>");
    std::string services;
    std::string models;
    for (std::uint64_t i = 1; i <= devices_; ++i) {
      const std::string number = i == 1 ? "" : std::to_string(i);
      const std::string name = "device" + number;
      put("skills/Do" + number + ".scxml", skill(false, name));
      if (i == 1) put("skills/Is.scxml", skill(true, name));
      put("models/" + name + ".scxml", device(name));
      services += (i == 1 ? "" : ", ") + name + ": {interface: device.thrift/Device, at: model}";
      models += (i == 1 ? "" : ", ");
      models += "{file: models/" + name + ".scxml, name: model" + number + ", serves: [" + name + "]}";
    }
    put("r.req",
        "let said = reply(device.ask)\nsmall \"It says little.\": always said <= 1.\n"
        "answers \"It answers.\": whenever request(device.put).what = 1, robot shall said = 1 within 300 ms.\n" +
            std::string(devices_ > 1 ? "let other = reply(device2.ask)\n"
                                       "apart \"They do not say 1 both.\": never (said = 1 and other = 1).\n"
                                     : ""));
    put("monitors/gate.scxml",
        head("open") +
            "<state id=\"open\"><transition event=\"device.ask.reply\" cond=\"_event.data.result === 2\" "
            "target=\"closed\"/></state><state id=\"closed\"><onentry><send event=\"again\" "
            "delay=\"250ms\"/></onentry><transition event=\"again\" target=\"open\"/><transition "
            "event=\"device." +
            pick({"put", "ask"}) + ".request\" target=\"no\"/></state><state id=\"no\"/></scxml>\n");
    const std::string gate = below(3) == 0 ? ", {file: monitors/gate.scxml, violated: [no], gate: [device.*]}" : "";
    put("sentree.yaml", "mission: {file: mission.xml, rate: 10 Hz, repeat: " + pick({"true", "false"}) +
                            "}\nservices: {" + services + "}\nmodels: [" + models + "]\nmonitors: [{file: r.req}" +
                            (devices_ > 1 ? "" : gate) + "]\nverify: {faults: {at_most: " + number(1, 2) +
                            ", any_of: [" + faults() + "]}}\n");
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
      if (below(3) == 0) return "<Condition ID=\"Is\"" + name;
      const std::uint64_t which = devices_ > 1 ? 1 + below(devices_) : 1;
      return "<Action ID=\"Do" + (which == 1 ? "" : std::to_string(which)) + "\"" + name;
    }
    std::string open;
    std::uint64_t children = 1;
    if (below(3) == 0) {
      open = pick({"Inverter", "ForceSuccess", "KeepRunningUntilFailure", "Repeat num_cycles=\"2\"",
                   "RetryUntilSuccessful num_attempts=\"2\"", "Timeout msec=\"250\"", "Delay delay_msec=\"130\""});
    } else {
      open = devices_ > 1 && below(2) == 0
                 ? "ParallelAll"
                 : pick({"Sequence", "Fallback", "ReactiveSequence", "ReactiveFallback", "SequenceWithMemory",
                         "Parallel success_count=\"1\" failure_count=\"1\"", "ParallelAll"});
      children = 1 + below(3);
    }
    std::string text = "<" + open + ">";
    for (std::uint64_t i = 0; i < children; ++i) text += node(depth - 1);
    return text + "</" + open.substr(0, open.find(' ')) + ">";
  }

  std::string skill(bool condition, const std::string& of) {
    const std::uint64_t states = 2 + below(3);
    std::string text = head("s0") + "<datamodel><data id=\"n\" expr=\"0\"/></datamodel>";
    // What is answered leads on, so that no instant lasts for ever.
    const auto target = [&](std::uint64_t from) {
      const std::uint64_t to = from + below(states + 2 - from);
      return to < states ? "s" + std::to_string(to) : std::string(to == states ? "success" : "failure");
    };
    for (std::uint64_t i = 0; i < states; ++i) {
      text += "<state id=\"s" + std::to_string(i) + "\"><onentry>";
      if (below(3) == 0)
        text += "<send event=\"later\" delay=\"" +
                (devices_ > 1 ? pick({"20", "40", "50"}) : number(1, 5) + pick({"0", "7", "50"})) + "ms\"/>";
      if (below(2) == 0) text += "<send type=\"thrift\" target=\"" + of + "\" event=\"ask\"/>";
      if (below(3) == 0)
        text += "<send type=\"thrift\" target=\"" + of + "\" event=\"put\"><param name=\"what\" expr=\"n\"/></send>";
      if (below(3) == 0) text += "<assign location=\"n\" expr=\"(n + 1) % 3\"/>";
      if (below(4) == 0) text += "<log label=\"n\" expr=\"n\"/>";
      text += "</onentry>";
      if (below(2) == 0)
        text += "<transition event=\"" + of + ".ask.reply\" cond=\"_event.data.result === " + number(0, 2) +
                "\" target=\"" + target(i + 1) + "\"/>";
      for (const char* event : {"tick", "later", "halt"}) {
        if (below(2) == 0) text += std::string("<transition event=\"") + event + "\" target=\"" + target(0) + "\"/>";
      }
      for (const std::string& event : {of + ".ask.reply", of + ".put.reply", std::string("error")}) {
        if (below(2) == 0) text += "<transition event=\"" + event + "\" target=\"" + target(i + 1) + "\"/>";
      }
      if (i == 0) text += "<transition event=\"" + of + ".ask.error\" target=\"failure\"/>";
      if (condition) text += "<transition event=\"*\" target=\"" + pick({"success", "failure"}) + "\"/>";
      text += "</state>";
    }
    return text + "<final id=\"success\"/><final id=\"failure\"/></scxml>\n";
  }

  std::string device(const std::string& name) {
    const std::string reply = "<send type=\"thrift\" target=\"" + name + "\" event=\"";
    const auto delay = [&] {
      return below(3) == 0 ? " delay=\"" + pick({"10", "20", "40", "60", "100", "130"}) + "ms\"" : std::string();
    };
    const std::string value = devices_ > 1 ? pick({"v", "choose(0, 1)", "between(0, 2)"})
                                           : pick({"v", "choose(0, 1)", "pick('says', 1, 2)", "chance(0.5) ? 1 : 2",
                                                   "draw([[0.5, v], [0.5, 0]])", "between(0, 2)", "v + fresh() % 2"});
    std::string text = head("there") + "<datamodel><data id=\"v\" expr=\"" + pick({"0", "1", "choose(0, 2)"}) +
                       "\"/></datamodel><state id=\"there\">";
    const bool has_time = below(2) == 0;
    const std::string wait = has_time ? "<send event=\"time\" delay=\"" + pick({"50", "100", "150"}) + "ms\"/>" : "";
    text += "<onentry>" + wait + "</onentry>";
    if (has_time) {
      text += "<transition event=\"time\"><assign location=\"v\" expr=\"" +
              (devices_ > 1 ? pick({"(v + 1) % 3", "choose(v, 0)"})
                            : pick({"(v + 1) % 3", "choose(v, 0)", "chance(0.25) ? 2 : v"})) +
              "\"/>" + wait + "</transition>";
    }
    text += "<transition event=\"" + name + ".ask.request\">";
    if (below(6) == 0)
      text += reply + "ask.error\"" + delay() + "><param name=\"message\" expr=\"'no'\"/></send>";
    else
      text += reply + "ask.reply\"" + delay() + "><param name=\"result\" expr=\"" + value + "\"/></send>";
    text += "</transition><transition event=\"" + name +
            ".put.request\"><assign location=\"v\" "
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
    add("unreachable: device.ask");
    add("late: device." + pick({"*", "put"}));
    if (leaf.empty()) return all;
    add("kill: " + leaf);
    add("delay: {message: " + leaf + ".tick, by: " + number(1, 25) + "0 ms}");
    add("delay: {message: \"*.halt\", by: " + number(1, 25) + "0 ms}");
    add("force: {leaf: " + leaf + ", status: " + pick({"SUCCESS", "FAILURE", "RUNNING"}) + "}");
    return all;
  }

  Rng rng_;
  std::uint64_t devices_;
  int nodes_ = 0;
  std::uint64_t leaves_ = 0;
};

// What else can be said of such a mission, behind its own requirements: every pattern, scope and kind of bound.
class RandomRequirements {
 public:
  explicit RandomRequirements(std::uint64_t seed) : rng_(seed) {}

  std::string operator()(std::size_t count) {
    std::string text = "let put = request(device.put).what\n";
    for (std::size_t i = 0; i < count; ++i) {
      text += "R" + std::to_string(i) + (below(4) == 0 ? " (re-arming): " : ": ") + scope() + body() +
              (below(5) == 0 ? " assuming " + lasting(0) : "") + ".\n";
    }
    return text;
  }

 private:
  std::uint64_t below(std::uint64_t bound) { return rng_.below(bound); }
  std::string pick(std::initializer_list<const char*> words) { return *(words.begin() + below(words.size())); }

  std::string lasting(int depth) {
    switch (below(depth > 0 ? 7 : 4)) {
      case 0: return "said " + pick({"=", "!=", "<", ">="}) + " " + pick({"0", "1", "2"});
      case 1: return "put " + pick({"=", "!=", "<"}) + " " + pick({"0", "1", "2"});
      case 2: return pick({"said = put", "said + put < 3", "said <= 2", "reply(device.ask from L1) = 1"});
      case 3: return "node(L1) in " + pick({"RUNNING", "SUCCESS", "FAILURE"});
      case 4: return "not (" + lasting(depth - 1) + ")";
      default: return "(" + lasting(depth - 1) + pick({" and ", " or ", " implies "}) + lasting(depth - 1) + ")";
    }
  }
  std::string momentary() {
    switch (below(4)) {
      case 0: return "event(request(device." + pick({"ask", "put"}) + "))";
      case 1:
        return "event(" +
               pick({"reply(device.put)", "error(device.ask)", "reply(device.ask)",
                     "request(device.put where args.what = 1)", "late(device.ask)"}) +
               ")";
      case 2: return pick({"said", "put"}) + " updated";
      default: return pick({"rises(", "falls("}) + lasting(0) + ")";
    }
  }
  std::string any() { return below(2) == 0 ? lasting(1) : momentary(); }
  std::string bound() {
    return pick({"100 ms", "200 ms", "300 ms", "250 ms", "30 ms", "1 ticks", "2 ticks", "3 ticks", "1 events",
                 "2 events", "4 events"});
  }
  std::string scope() {
    switch (below(9)) {
      case 0: return "before " + any() + ", ";
      case 1: return "after " + any() + ", ";
      case 2: return "between " + any() + " and " + any() + ", ";
      case 3: return "after " + any() + " until " + any() + ", ";
      case 4: return "while " + lasting(1) + ", ";
      default: return "";
    }
  }
  std::string body() {
    switch (below(16)) {
      case 0: return "always " + lasting(1);
      case 1: return "never " + any();
      case 2: return "eventually " + any();
      case 3: return "eventually " + any() + " within " + bound();
      case 4:
      case 5: return "whenever " + any() + ", " + any() + " within " + bound();
      case 6: return "whenever " + any() + ", " + any() + " eventually";
      case 7: return "whenever " + any() + ", " + any() + " immediately";
      case 8: return "whenever " + any() + ", keep " + lasting(1) + " for " + bound();
      case 9: return "whenever " + any() + ", keep " + lasting(1) + " until " + any();
      case 10: return "whenever " + any() + ", not " + any() + " for " + bound();
      case 11: return any() + " precedes " + any() + (below(2) == 0 ? " by at most " + bound() : "");
      case 12: return any() + " at least every " + bound();
      case 13: return any() + " at most " + pick({"1", "2"}) + " times" + (below(2) == 0 ? " per " + bound() : "");
      default: return lasting(1) + " holds for at least " + bound();
    }
  }

  Rng rng_;
};

}  // namespace sentree::verify
