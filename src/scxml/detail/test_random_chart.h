#pragma once

#include <string>
#include <vector>

#include "sentree/base/rng.h"

namespace sentree::scxml {

/// A random chart: nested and parallel states, final and history states, guards, eventless transitions, data that
/// expressions, scripts and loops change, raised and delayed events, invoked children, early and late binding.
class RandomChart {
 public:
  enum class Data {
    kWide,   ///< Numbers that grow, random numbers.
    kSmall,  ///< Few values, so that sessions meet again; and ids that the engine makes up.
  };
  explicit RandomChart(std::uint64_t seed, Data data = Data::kWide) : rng_(seed), small_(data == Data::kSmall) {}

  std::string source() {
    for (int i = 0; i < 24; ++i) ids_.push_back("s" + std::to_string(i));
    std::string text =
        std::string(R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript")") +
        (rng_.below(2) ? " binding=\"late\"" : "") +
        R"(><datamodel><data id="n" expr="0"/><data id="list" expr="[]"/><data id="i"/></datamodel>)";
    text += "<script>function twice(x) { return 2 * x; }</script>";
    while (next_ < 12) text += state(0);
    return text + "<state id=\"back\">" + histories_ + "</state></scxml>";
  }

 private:
  std::string action() {
    if (small_) return small_action();
    switch (rng_.below(10)) {
      case 0: return "<assign location=\"n\" expr=\"n + 1\"/>";
      case 1: return "<script>list.push(n); if (list.length &gt; 5) list.shift();</script>";
      case 2:
        return "<send event=\"e" + std::to_string(rng_.below(4)) + "\" delay=\"" + std::to_string(1 + rng_.below(5)) +
               "s\"/>";
      case 3: return "<assign location=\"n\" expr=\"twice(n) % 97\"/>";
      case 4: return "<send id=\"x\" type=\"out\" event=\"o\"><param name=\"n\" expr=\"n\"/></send>";
      case 5: return "<raise event=\"i" + std::to_string(rng_.below(3)) + "\"/>";
      case 6: return "<foreach array=\"list\" item=\"i\"><assign location=\"n\" expr=\"(n + i) % 89\"/></foreach>";
      case 7: return "<if cond=\"n &gt; 40\"><assign location=\"n\" expr=\"n - 40\"/><else/><raise event=\"i0\"/></if>";
      case 8: return "<send event=\"e" + std::to_string(rng_.below(4)) + "\"/>";
      default: return "<log expr=\"n + Math.floor(Math.random() * 10)\"/>";
    }
  }

  std::string small_action() {
    switch (rng_.below(9)) {
      case 0: return "<assign location=\"n\" expr=\"(n + 1) % 3\"/>";
      case 1: return "<script>list.push(n); if (list.length &gt; 2) list = [];</script>";
      case 2:
        return "<send event=\"e" + std::to_string(rng_.below(4)) + "\" delay=\"" + std::to_string(1 + rng_.below(3)) +
               "s\"/>";
      case 3: return "<send event=\"e1\" idlocation=\"i\" delay=\"2s\"/>";
      case 4: return "<cancel sendidexpr=\"i\"/>";
      case 5: return "<send type=\"out\" event=\"o\" idlocation=\"i\"><param name=\"n\" expr=\"n\"/></send>";
      case 6: return "<send type=\"out\" event=\"o\" delay=\"1s\"/>";
      case 7: return "<if cond=\"n &gt; 1\"><assign location=\"n\" expr=\"0\"/><else/><raise event=\"i0\"/></if>";
      default: return "<log expr=\"'n is ' + n\"/>";
    }
  }

  std::string transition() {
    if (small_ && rng_.below(8) == 0)
      return "<transition event=\"error.communication\" cond=\"_event.sendid == i\" target=\"s" +
             std::to_string(rng_.below(12)) + "\"/>";
    if (rng_.below(8) == 0)
      return "<transition cond=\"n == " + std::to_string(rng_.below(small_ ? 3 : 50)) + "\" target=\"s" +
             std::to_string(rng_.below(12)) + "\"><assign location=\"n\" expr=\"" + (small_ ? "(n + 1) % 3" : "n + 1") +
             "\"/></transition>";
    std::string text = "<transition event=\"" + std::string(rng_.below(3) ? "e" : "i") + std::to_string(rng_.below(4)) +
                       (rng_.below(6) ? "" : " done.*") + "\"";
    if (rng_.below(3) == 0) text += " cond=\"n % 2 == " + std::to_string(rng_.below(2)) + "\"";
    if (rng_.below(5) != 0)
      text += rng_.below(8) ? " target=\"s" + std::to_string(rng_.below(12)) + "\"" : std::string(" target=\"back\"");
    if (rng_.below(4) == 0) text += " type=\"internal\"";
    return text + ">" + (rng_.below(2) ? action() : "") + "</transition>";
  }

  // A chart that counts, tells its parent, and ends after a while.
  std::string child() {
    return R"(<invoke autoforward="true"><param name="n" expr="n"/><content>
      <scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript"><datamodel><data id="n" expr="1"/></datamodel>
      <state id="c"><onentry><send event="tell" delay="2s"/></onentry>
      <transition event="tell" target="d"><send target="#_parent" event="i1"><param name="n" expr="n"/></send></transition>
      <transition event="e0"><assign location="n" expr="n + 1"/></transition></state>
      <final id="d"><donedata><param name="n" expr="n"/></donedata></final></scxml></content></invoke>)";
  }

  std::string state(int depth) {
    const int id = next_++;
    const bool parallel = depth < 3 && rng_.below(4) == 0;
    std::string text = std::string(parallel ? "<parallel" : "<state") + " id=\"s" + std::to_string(id) + "\">";
    if (rng_.below(2)) text += "<onentry>" + action() + "</onentry>";
    if (rng_.below(3) == 0) text += "<onexit>" + action() + "</onexit>";
    const auto transitions = rng_.below(4);
    for (std::uint64_t i = 0; i < transitions; ++i) text += transition();
    if (depth == 0 && rng_.below(3) == 0) text += child();
    if (!parallel && rng_.below(3) == 0)
      text += "<datamodel><data id=\"d" + std::to_string(id) + "\" expr=\"n + 1\"/></datamodel>";
    const std::uint64_t children = depth < 3 ? (parallel ? 2 : rng_.below(3)) : 0;
    const int first = next_;
    for (std::uint64_t i = 0; i < children; ++i) text += state(depth + 1);
    if (!parallel && children > 0 && rng_.below(3) == 0) text += "<final id=\"f" + std::to_string(id) + "\"/>";
    if (children > 0 && rng_.below(2) == 0) {
      const std::string history = "h" + std::to_string(id);
      text += "<history id=\"" + history + "\" type=\"" + (rng_.below(2) ? "deep" : "shallow") +
              "\"><transition target=\"s" + std::to_string(first) + "\"/></history>";
      histories_ += "<transition event=\"e" + std::to_string(rng_.below(4)) + "\" target=\"" + history + "\"/>";
    }
    return text + (parallel ? "</parallel>" : "</state>");
  }

  Rng rng_;
  bool small_;
  int next_ = 0;
  std::string histories_;
  std::vector<std::string> ids_;
};

}  // namespace sentree::scxml
