// The charts that are written from the twelve requirements, in Qt SCXML and in ours, fed with the same observations:
// after each of them the same states are active and the same verdicts have been given. Ours runs in virtual time, Qt in
// real time. So Qt gets the charts with other delays: too long to end while events come, or short where silence
// decides.
#include <QBuffer>
#include <QCoreApplication>
#include <QDeadlineTimer>
#include <QEventLoop>
#include <QJsonDocument>
#include <QScxmlStateMachine>
#include <algorithm>
#include <iostream>
#include <map>
#include <memory>
#include <regex>
#include <string>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/monitor/monitor.h"
#include "sentree/text/file.h"
#include "sentree/text/json.h"

namespace {

using namespace sentree;

constexpr int kTraces = 25;
constexpr int kTraceLength = 40;

Message observation(std::string name, Map data, std::string source = "Leaf") {
  Message message;
  message.name = std::move(name);
  message.source = std::move(source);
  message.data = std::move(data);
  return message;
}

Message reply(const std::string& method, Value result, Map args = {}) {
  return observation(method + ".reply", Map{{"args", std::move(args)}, {"result", std::move(result)}});
}
Message request(const std::string& method, Map args = {}) {
  return observation(method + ".request", Map{{"args", std::move(args)}});
}

// Every observation that one of the twelve listens to, with values on both sides of each limit.
std::vector<Message> vocabulary() {
  std::vector<Message> all{request("safety.halt"),
                           request("safety.stop"),
                           request("safety.reset"),
                           request("arm.place"),
                           reply("arm.pick", true),
                           observation("mission.tick", Map{{"tick", 1}}, "mission"),
                           observation("node.status", Map{{"to", "FAILURE"}}, "GotoGoal"),
                           observation("node.status", Map{{"to", "IDLE"}}, "GotoGoal"),
                           observation("node.status", Map{{"to", "FAILURE"}}, "Another")};
  for (const double level : {0.15, 0.2, 0.25, 0.31, 1.0})
    all.push_back(reply("battery.getBatteryState", Map{{"percentage", level}}));
  for (const double speed : {0.0, 0.3}) all.push_back(reply("base.getLastVelocityCommand", Map{{"vx", speed}}));
  for (const char* place : {"goal", "station"}) {
    all.push_back(request("navigation.gotoTargetByLocationName", Map{{"name", place}}));
    for (const bool near : {false, true})
      all.push_back(reply("navigation.checkNearToLocation", near, Map{{"name", place}}));
  }
  for (const char* status : {"WAITING_OBSTACLE", "MOVING"})
    all.push_back(reply("navigation.getNavigationState", Map{{"status", status}}));
  for (const char* status : {"NOT_YET_LOCALIZED", "LOCALIZED_OK"})
    all.push_back(reply("localization.getLocalizationStatus", status));
  for (const bool yes : {false, true}) {
    all.push_back(reply("battery.isCharging", yes));
    for (const char* gripper : {"OPEN", "CLOSED"})
      all.push_back(reply("arm.getArmState", Map{{"moving", yes}, {"gripper", gripper}}));
  }
  return all;
}

// How a monitor stands: its active states, unless it has ended, and what it has said.
struct Standing {
  std::vector<std::string> states;
  int violated = 0;
  int satisfied = 0;
  friend bool operator==(const Standing&, const Standing&) = default;
};

std::string to_string(const Standing& standing) {
  std::string text = standing.states.empty() ? "ended" : "in";
  for (const std::string& state : standing.states) text += " " + state;
  return text + ", " + std::to_string(standing.violated) + " violated, " + std::to_string(standing.satisfied) +
         " satisfied";
}

class Ours {
 public:
  explicit Ours(const monitor::Model& model) : model_(model), state_(monitor::start(model, {})) {}

  void see(const Message& message) { count(monitor::observe(model_, state_, message)); }
  /// Until the next timer has fired.
  void wait() { count(monitor::advance(model_, state_, monitor::next_timer(model_, state_))); }
  Standing standing() {
    if (state_.session.running()) {
      standing_.states = state_.session.active_ids(model_.chart());
      std::sort(standing_.states.begin(), standing_.states.end());
    } else {
      standing_.states.clear();
    }
    return standing_;
  }

 private:
  void count(const monitor::Decisions& decisions) {
    for (const monitor::Decision& decision : decisions)
      ++(decision.verdict == monitor::Verdict::kViolated ? standing_.violated : standing_.satisfied);
  }
  const monitor::Model& model_;
  monitor::State state_;
  Standing standing_;
};

class Theirs {
 public:
  Theirs(const std::string& chart, const std::string& delay) {
    source_ =
        QByteArray::fromStdString(std::regex_replace(chart, std::regex("delay=\"[^\"]*\""), "delay=\"" + delay + "\""));
    QBuffer buffer(&source_);
    buffer.open(QIODevice::ReadOnly);
    machine_.reset(QScxmlStateMachine::fromData(&buffer));
    for (const QScxmlError& error : machine_->parseErrors()) std::cerr << error.toString().toStdString() << "\n";
    machine_->connectToState("violated", [this](bool entered) { standing_.violated += entered ? 1 : 0; });
    machine_->connectToState("satisfied", [this](bool entered) { standing_.satisfied += entered ? 1 : 0; });
    machine_->start();
    settle();
  }

  void see(const Message& message) {
    if (!machine_->isRunning()) return;
    Map data{{"source", message.source}};
    for (const auto& [name, value] : *message.data.as_map()) data.append(name, value);
    const auto json = QJsonDocument::fromJson(QByteArray::fromStdString(to_json(Value(std::move(data)))));
    machine_->submitEvent(QString::fromStdString(message.name), json.toVariant());
    settle();
  }
  /// Until it stands like that, for a minute at most.
  void wait_for(const Standing& expected) {
    for (QDeadlineTimer deadline(60'000); standing() != expected && !deadline.hasExpired();)
      QCoreApplication::processEvents(QEventLoop::WaitForMoreEvents, 100);
  }
  Standing standing() {
    standing_.states.clear();
    if (machine_->isRunning()) {
      for (const QString& name : machine_->activeStateNames(false)) standing_.states.push_back(name.toStdString());
      std::sort(standing_.states.begin(), standing_.states.end());
    }
    return standing_;
  }

 private:
  // Qt spreads one event over several turns of its loop.
  static void settle() {
    for (int i = 0; i < 5; ++i) QCoreApplication::processEvents();
  }
  QByteArray source_;
  std::unique_ptr<QScxmlStateMachine> machine_;
  Standing standing_;
};

struct Subject {
  monitor::Model model;
  std::string chart;
};

int compared = 0;
int different = 0;
int decided = 0;

bool compare(const std::string& what, const Standing& theirs, const Standing& ours) {
  ++compared;
  if (theirs == ours) return true;
  ++different;
  std::cerr << what << ":\n  Qt   " << to_string(theirs) << "\n  ours " << to_string(ours) << "\n";
  return false;
}

void play_events(const Subject& subject, std::uint64_t seed) {
  const std::string& name = subject.model.name();
  std::vector<Message> heard;
  for (const Message& message : vocabulary()) {
    if (subject.model.listens_to(message.name)) heard.push_back(message);
  }
  Rng rng(seed);
  Ours ours(subject.model);
  Theirs theirs(subject.chart, "100000s");
  std::string trace = name + " seed " + std::to_string(seed) + " start";
  bool same = compare(trace, theirs.standing(), ours.standing());
  for (int i = 0; same && i < kTraceLength; ++i) {
    const Message& message = heard[rng.below(heard.size())];
    trace += "\n  " + message.name + " " + to_json(message.data);
    ours.see(message);
    theirs.see(message);
    same = compare(trace, theirs.standing(), ours.standing());
  }
  decided += ours.standing().violated + ours.standing().satisfied > 0 ? 1 : 0;
}

// After `events`, the last of which sets the timer, nothing comes.
void play_silence(const Subject& subject, const std::vector<Message>& events) {
  Ours ours(subject.model);
  Theirs theirs(subject.chart, "50ms");
  for (const Message& message : events) {
    ours.see(message);
    theirs.see(message);
  }
  const Standing before = ours.standing();
  ours.wait();
  theirs.wait_for(ours.standing());
  if (before == ours.standing()) {
    ++different;
    std::cerr << subject.model.name() << ": silence changes nothing\n";
  }
  compare(subject.model.name() + " in silence", theirs.standing(), ours.standing());
}

}  // namespace

int main(int argc, char** argv) {
  QCoreApplication application(argc, argv);
  if (argc < 2) {
    std::cerr << "usage: differential_qt_monitors FILE.req\n";
    return 2;
  }
  const auto source = text::read_file(argv[1]);
  const auto file = monitor::parse_requirements(source ? *source : "", argv[1]);
  if (!source || !file.ok()) {
    std::cerr << to_string(source ? file.diagnostics.front() : source.error()) << "\n";
    return 3;
  }
  std::size_t silences = 0;
  for (const monitor::Requirement& requirement : file.value->requirements) {
    Diagnostics diagnostics;
    const monitor::Typing typing = monitor::check_requirement(requirement, nullptr, diagnostics);
    const Subject subject{*monitor::Model::make(requirement).value, monitor::synthesize(requirement, typing).chart};
    for (std::uint64_t seed = 1; seed <= kTraces; ++seed) play_events(subject, seed);
    const auto level = [](double ratio) { return reply("battery.getBatteryState", Map{{"percentage", ratio}}); };
    const std::map<std::string, std::vector<Message>> silent{
        {"R3", {reply("base.getLastVelocityCommand", Map{{"vx", 0.3}}), request("safety.halt")}},
        {"R6", {}},
        {"R10", {}},
        {"R11", {level(0.31), level(0.29)}}};
    if (const auto events = silent.find(requirement.name); events != silent.end()) {
      play_silence(subject, events->second);
      ++silences;
    }
  }
  std::cout << "{\"charts\":" << file.value->requirements.size() << ",\"compared\":" << compared
            << ",\"decided\":" << decided << ",\"silences\":" << silences << ",\"different\":" << different << "}\n";
  return different == 0 && decided > 0 && silences == 4 ? 0 : 1;
}
