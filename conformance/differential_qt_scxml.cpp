// Random charts and event sequences, in Qt SCXML and in ours: after each event the same states are active, and the same
// log lines have been written. The charts keep to what Qt gets right: no delays, no `In` under the null model, no
// targets of <send>, no invoke, no donedata, no conflicts between regions.
#include <QBuffer>
#include <QCoreApplication>
#include <QScxmlStateMachine>
#include <algorithm>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/step.h"

namespace {

using sentree::Rng;
namespace scxml = sentree::scxml;

class RandomChart {
 public:
  explicit RandomChart(std::uint64_t seed) : rng_(seed), script_(rng_.below(2) == 0) {}

  std::string source() {
    std::string body;
    while (next_ < 10) body += state(0);
    std::string text =
        std::string(R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="random" datamodel=")") +
        (script_ ? "ecmascript" : "null") + "\">";
    if (script_) text += R"(<datamodel><data id="n" expr="0"/></datamodel>)";
    return text + body + "</scxml>";
  }

  [[nodiscard]] const std::vector<std::string>& events() const { return events_; }

 private:
  std::string some_state() { return "s" + std::to_string(rng_.below(10)); }

  std::string action() {
    if (!script_) return "";
    switch (rng_.below(3)) {
      case 0: return "<assign location=\"n\" expr=\"(n * 3 + 1) % 17\"/>";
      case 1:
        return "<if cond=\"n % 2 == 0\"><assign location=\"n\" expr=\"n + 1\"/><else/><log label=\"odd\" "
               "expr=\"n\"/></if>";
      default: return "<log label=\"n\" expr=\"n\"/>";
    }
  }

  std::string transition() {
    std::string event = (rng_.below(4) ? "e" : "i") + std::to_string(rng_.below(3));
    const bool leaves = rng_.below(6) != 0;
    // Of transitions in two regions that cannot both be taken, Qt 6.4 takes the second where Appendix D takes the first
    // in document order, and it executes the second's content first. So each region has events of its own.
    if (region_ >= 0) event += "r" + std::to_string(region_);
    events_.push_back(event);
    std::string text = "<transition event=\"" + event + "\"";
    const auto condition = rng_.below(6);
    if (script_ && condition < 2) text += " cond=\"n % 3 == " + std::to_string(rng_.below(3)) + "\"";
    if (script_ && condition == 2) text += " cond=\"In('" + some_state() + "')\"";
    if (leaves) text += " target=\"" + some_state() + "\"";
    if (rng_.below(4) == 0) text += " type=\"internal\"";
    return text + ">" + (rng_.below(2) ? action() : "") + "</transition>";
  }

  std::string state(int depth) {
    const int id = next_++;
    const bool parallel = depth < 2 && next_ < 8 && rng_.below(4) == 0;
    std::string text = std::string(parallel ? "<parallel" : "<state") + " id=\"s" + std::to_string(id) + "\">";
    if (rng_.below(3) == 0) text += "<onentry>" + action() + action() + "</onentry>";
    if (rng_.below(3) == 0) text += "<onexit>" + action() + "</onexit>";
    if (rng_.below(5) == 0) {
      const std::string region = region_ >= 0 ? "r" + std::to_string(region_) : "";
      text += "<transition event=\"raise" + region + "\"><raise event=\"e" + std::to_string(rng_.below(3)) + region +
              "\"/></transition>";
      events_.push_back("raise" + region);
    }
    const auto transitions = 1 + rng_.below(3);
    for (std::uint64_t i = 0; i < transitions; ++i) text += transition();
    const std::uint64_t children = depth < 2 ? (parallel ? 2 : rng_.below(3)) : 0;
    const int first = next_;
    const int outer = region_;
    for (std::uint64_t i = 0; i < children; ++i) {
      if (parallel) region_ = next_;
      text += state(depth + 1);
    }
    region_ = outer;
    if (children > 0 && !parallel && rng_.below(3) == 0) {
      text += "<history id=\"h" + std::to_string(id) + "\" type=\"" + (rng_.below(2) ? "deep" : "shallow") +
              "\"><transition target=\"s" + std::to_string(first) + "\"/></history>";
    }
    return text + (parallel ? "</parallel>" : "</state>");
  }

  Rng rng_;
  bool script_;
  int next_ = 0;
  int region_ = -1;
  std::vector<std::string> events_;
};

struct Trace {
  std::vector<std::string> states;
  std::vector<std::string> logs;
  friend bool operator==(const Trace&, const Trace&) = default;
};

std::string to_string(const Trace& trace) {
  std::string text = "in";
  for (const std::string& state : trace.states) text += " " + state;
  for (const std::string& line : trace.logs) text += "; " + line;
  return text;
}

std::vector<Trace> play_qt(const std::string& source, const std::vector<std::string>& events) {
  QByteArray bytes = QByteArray::fromStdString(source);
  QBuffer buffer(&bytes);
  buffer.open(QIODevice::ReadOnly);
  const std::unique_ptr<QScxmlStateMachine> machine(QScxmlStateMachine::fromData(&buffer));
  if (!machine->parseErrors().isEmpty()) return {};
  std::vector<Trace> traces(1);
  QObject::connect(machine.get(), &QScxmlStateMachine::log, [&](const QString& label, const QString& text) {
    traces.back().logs.push_back(label.toStdString() + ": " + text.toStdString());
  });
  const auto settle = [&] {
    // Qt spreads one event over several turns of its loop.
    for (int i = 0; i < 5; ++i) QCoreApplication::processEvents();
    for (const QString& name : machine->activeStateNames(false)) traces.back().states.push_back(name.toStdString());
    std::sort(traces.back().states.begin(), traces.back().states.end());
  };
  machine->start();
  settle();
  for (const std::string& event : events) {
    traces.emplace_back();
    machine->submitEvent(QString::fromStdString(event));
    settle();
  }
  return traces;
}

std::vector<Trace> play_ours(const std::string& source, const std::vector<std::string>& events) {
  const auto loaded = scxml::load(source);
  if (!loaded.ok()) return {};
  scxml::Session session;
  scxml::Effects effects;
  std::vector<Trace> traces(1);
  const auto settle = [&] {
    traces.back().states = session.active_ids(*loaded.value);
    std::sort(traces.back().states.begin(), traces.back().states.end());
    for (const scxml::Effect& effect : effects) {
      if (const auto* line = std::get_if<scxml::LogLine>(&effect))
        traces.back().logs.push_back(line->label + ": " + line->text);
    }
    effects.clear();
  };
  scxml::start(*loaded.value, session, {}, {}, effects);
  settle();
  for (const std::string& event : events) {
    traces.emplace_back();
    scxml::step(*loaded.value, session, {.name = event}, {}, effects);
    settle();
  }
  return traces;
}

}  // namespace

int main(int argc, char** argv) {
  QCoreApplication application(argc, argv);
  // What <log> writes is taken from the signal.
  qInstallMessageHandler([](QtMsgType, const QMessageLogContext&, const QString&) {});
  const std::uint64_t seeds = argc > 1 ? std::stoull(argv[1]) : 300;
  int compared = 0;
  int different = 0;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    RandomChart chart(seed);
    const std::string source = chart.source();
    Rng rng(seed);
    std::vector<std::string> events;
    for (int i = 0; i < 20; ++i) events.push_back(chart.events()[rng.below(chart.events().size())]);
    const auto theirs = play_qt(source, events);
    const auto ours = play_ours(source, events);
    if (theirs.empty() && ours.empty()) continue;  // both refuse it
    ++compared;
    if (theirs == ours) continue;
    ++different;
    std::cerr << "seed " << seed << " differs\n" << source << "\n";
    for (std::size_t i = 0; i < std::max(theirs.size(), ours.size()); ++i) {
      const std::string qt = i < theirs.size() ? to_string(theirs[i]) : "refused";
      const std::string own = i < ours.size() ? to_string(ours[i]) : "refused";
      if (qt == own) continue;
      std::cerr << (i == 0 ? "start" : events[i - 1]) << ": Qt " << qt << " | ours " << own << "\n";
      break;
    }
  }
  std::cout << "{\"compared\":" << compared << ",\"different\":" << different << "}\n";
  return different == 0 && compared > static_cast<int>(seeds) / 2 ? 0 : 1;
}
