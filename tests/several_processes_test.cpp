// Runs whose parts are processes of their own, and what becomes of them when those are killed or stopped.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <future>
#include <iterator>
#include <mutex>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "sentree/base/temporary_folder.h"
#include "sentree/processes/elsewhere.h"
#include "sentree/processes/remote_skill.h"
#include "sentree/processes/wire_message.h"
#include "sentree/project/distribute.h"
#include "sentree/rpc/server.h"
#include "sentree/runtime/inside.h"
#include "sentree/runtime/run.h"
#include "sentree/runtime/steering.h"
#include "sentree/text/file.h"

namespace sentree::runtime {
namespace {

using namespace project::intervention;

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::Each;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

const std::string kSource = SENTREE_SOURCE_DIR;

project::Scenario recharge(const std::string& name) {
  auto loaded = project::load_scenario(kSource + "/examples/recharge/scenarios/" + name + ".yaml");
  EXPECT_TRUE(loaded.ok());
  return std::move(*loaded.value);
}

project::Scenario resilient() {
  auto loaded = project::load_project(kSource + "/tests/projects/resilient");
  EXPECT_TRUE(loaded.ok());
  project::Scenario scenario = project::plain_scenario(std::move(*loaded.value));
  scenario.factor = 20;
  scenario.duration = std::chrono::minutes(10);
  scenario.mission = "SUCCESS";
  return scenario;
}

// Every part in a process of its own.
project::Plan distributed(project::Scenario scenario) {
  auto plan = prepare(std::move(scenario));
  EXPECT_TRUE(plan.ok());
  auto split = prepare(project::in_processes(*plan.value));
  for (const Diagnostic& diagnostic : split.diagnostics) ADD_FAILURE() << to_string(diagnostic);
  return std::move(*split.value);
}

struct Ran {
  RunReport report;
  std::vector<Message> messages;

  std::size_t count(const std::string& name) const {
    return static_cast<std::size_t>(
        std::count_if(messages.begin(), messages.end(), [&](const Message& m) { return m.name == name; }));
  }
};

// The monitor runs in a process of its own.
void watch_elsewhere(project::Scenario& scenario, project::MonitorEntry& monitor) {
  monitor.at = "{watch}";
  project::ProcessEntry& process = scenario.processes.emplace_back();
  process.name = "watch";
  process.monitor = monitor.name;
  process.listen = "unix:{run}/watch.sock";
}

Ran run(const project::Plan& plan, RunOptions options = {}) {
  Ran ran;
  options.elsewhere = processes::elsewhere({.program = SENTREE_PROGRAM});
  options.listeners.push_back([&](const Message& message) { ran.messages.push_back(message); });
  ran.report = Run(plan, std::move(options)).execute();
  // Nothing is left behind.
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);
  EXPECT_EQ(errno, ECHILD);
  return ran;
}

class Verdicts : public testing::TestWithParam<const char*> {};

TEST_P(Verdicts, AreTheSameInProcesses) {
  // A machine that is busy for a moment delays ticks, and the robot drives on meanwhile: then the scenario is run at a
  // quarter of the pace, at which such a moment counts for a quarter.
  constexpr double kPaces[] = {20, 5};
  for (const double pace : kPaces) {
    project::Scenario scenario = recharge(GetParam());
    scenario.factor = pace;
    // Of the wall's time, and not what is tested here.
    scenario.project.deadlines.call = seconds(10);
    scenario.project.deadlines.condition = seconds(20);
    scenario.project.deadlines.budget = seconds(30);
    scenario.project.deadlines.unresponsive = seconds(50);
    const project::Plan plan = distributed(std::move(scenario));
    const Ran ran = run(plan);
    EXPECT_EQ(ran.report.processes.size(), plan.scenario.processes.size() + 1);
    EXPECT_GE(ran.report.processes.size(), 7U);
    const bool may_be_late = pace != kPaces[std::size(kPaces) - 1] && ran.report.timing.missed > 0;
    if (!ran.report.unmet.empty() && may_be_late) continue;
    EXPECT_THAT(ran.report.unmet, IsEmpty());
    return;
  }
}

INSTANTIATE_TEST_SUITE_P(Recharge, Verdicts, testing::Values("experiment1", "experiment2", "recharge", "shield"));

// A monitor at an address decides as it does in the run, with the same witness.
TEST(Monitors, DecideAlikeElsewhere) {
  project::Scenario scenario = recharge("experiment1");
  scenario.virtual_time = false;
  scenario.factor = 20;
  scenario.duration = seconds(40);
  scenario.project.deadlines = recharge("distributed").project.deadlines;
  watch_elsewhere(scenario, scenario.project.monitors[0]);
  auto plan = prepare(std::move(scenario));
  ASSERT_TRUE(plan.ok());
  const Ran ran = run(*plan.value);
  EXPECT_THAT(ran.report.unmet, IsEmpty());
  const auto told = std::count_if(ran.messages.begin(), ran.messages.end(), [](const Message& message) {
    return message.name == "monitor.violated" && message.source == "battery";
  });
  EXPECT_EQ(told, 1);
  const MonitorReport& report = ran.report.monitors.back();
  ASSERT_TRUE(report.decision);
  EXPECT_EQ(report.decision->state, "failure");
  ASSERT_EQ(report.decision->witness.size(), 2U);
  EXPECT_EQ(report.decision->witness[1].name, "battery.getBatteryState.reply");
  EXPECT_EQ(report.decision->deciding->sequence, report.decision->witness[1].sequence);
  EXPECT_TRUE(report.decision->witness_complete);
  EXPECT_TRUE(report.decision->witness_minimal);
}

// An observer that a test answers for, at an address.
struct ServedObserver {
  explicit ServedObserver(std::shared_ptr<rpc::Service> observer)
      : server(rpc::Server::start(*rpc::Address::parse(at), {{"observer", std::move(observer)}})) {}
  TemporaryFolder folder{"observer"};
  std::string at = "unix:" + (folder.path() / "observer.sock").string();
  Result<std::unique_ptr<rpc::Server>> server;
};

// What a monitor elsewhere decides while the run winds up counts.
TEST(Monitors, MayDecideElsewhereWhenTheMissionIsOver) {
  const auto interface = processes::observer_interface();
  ASSERT_TRUE(interface);
  std::mutex mutex;
  std::condition_variable changed;
  bool over = false;
  int asked = 0;
  // It thinks about the first message until nothing is executed any more.
  const auto slow =
      std::make_shared<rpc::FunctionService>(*interface, [&](const idl::Method& method, const Value&) -> rpc::Outcome {
        if (method.name == "info")
          return Value(Map{{"name", "slow"}, {"pid", 0}, {"observes", List{"*"}}, {"gates", List{}}});
        std::unique_lock lock(mutex);
        if (++asked > 1) {
          changed.notify_all();
          return Value(Map{{"accept", true}});
        }
        changed.wait(lock, [&] { return over; });
        return Value(Map{{"accept", true}, {"verdict", "violated"}, {"state", "failure"}});
      });
  const ServedObserver served(slow);
  ASSERT_TRUE(served.server);

  project::Scenario scenario = recharge("normal");
  scenario.virtual_time = false;
  scenario.duration = milliseconds(300);
  scenario.project.monitors[0].at = served.at;
  auto plan = prepare(std::move(scenario));
  ASSERT_TRUE(plan.ok());
  RunOptions options;
  options.on_view = [&](RunView* view) {
    if (view != nullptr) return;
    std::unique_lock lock(mutex);
    over = true;
    changed.notify_all();
    // Once it gets the next message, its verdict has come back.
    changed.wait_for(lock, seconds(1), [&] { return asked > 1; });
  };
  const RunReport report = run(*plan.value, std::move(options)).report;
  // A machine that halts for seconds makes the verdict late, which is said.
  EXPECT_TRUE(report.monitors.back().decision || !report.problems.empty());
}

// The shield, at an address, is asked before the request is sent.
TEST(Monitors, GateFromElsewhere) {
  project::Scenario scenario = recharge("shield");
  scenario.virtual_time = false;
  scenario.factor = 20;
  scenario.project.deadlines = recharge("distributed").project.deadlines;
  watch_elsewhere(scenario, scenario.project.monitors.back());
  auto plan = prepare(std::move(scenario));
  ASSERT_TRUE(plan.ok());
  const Ran ran = run(*plan.value);
  EXPECT_THAT(ran.report.unmet, IsEmpty());
  const bool left = std::any_of(ran.messages.begin(), ran.messages.end(), [](const Message& message) {
    return message.source == "GoToKitchen" && message.name == "navigation.gotoTargetByLocationName.request";
  });
  EXPECT_FALSE(left);
}

TEST(Observers, ThatCannotBeReachedPreventTheRun) {
  project::Scenario scenario = recharge("normal");
  scenario.virtual_time = false;
  scenario.project.observers.push_back({.name = "nobody", .at = "unix:/nowhere/at.sock", .span = {}});
  auto plan = prepare(std::move(scenario));
  ASSERT_TRUE(plan.ok());
  EXPECT_THAT(run(*plan.value).report.error, HasSubstr("observer \"nobody\""));
}

// A gate elsewhere decides on what it has seen, so it must have seen what led to the request.
TEST(Observers, AreAskedAfterWhatLedToTheRequest) {
  const auto interface = processes::observer_interface();
  ASSERT_TRUE(interface);
  std::mutex mutex;
  std::set<std::string> seen;
  int questions = 0;
  int early = 0;
  const auto judge = std::make_shared<
      rpc::FunctionService>(*interface, [&](const idl::Method& method, const Value& arguments) -> rpc::Outcome {
    const std::lock_guard lock(mutex);
    if (method.name == "info")
      return Value(Map{{"name", "judge"}, {"pid", 0}, {"observes", List{"*"}}, {"gates", List{"navigation.goto*"}}});
    if (method.name == "observe") {
      const Message message = processes::from_wire(*arguments.find("message"));
      if (message.sequence > 0) {
        seen.insert(message.name);
      } else {
        ++questions;
        if (!seen.contains(message.source + ".tick.request")) ++early;
      }
    }
    return Value(Map{{"accept", true}});
  });
  const ServedObserver served(judge);
  ASSERT_TRUE(served.server);

  project::Scenario scenario = recharge("normal");
  scenario.virtual_time = false;
  scenario.factor = 20;
  scenario.duration = seconds(20);
  scenario.project.deadlines.call = seconds(10);
  scenario.project.observers.push_back({.name = "judge", .at = served.at, .span = {}});
  auto plan = prepare(std::move(scenario));
  ASSERT_TRUE(plan.ok());
  EXPECT_GT(run(*plan.value).count("navigation.gotoTargetByLocationName.reply"), 0U);
  const std::lock_guard lock(mutex);
  EXPECT_GT(questions, 0);
  EXPECT_EQ(early, 0);
}

TEST(Processes, SurviveKillsAtRandomMoments) {
  const unsigned seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  project::Scenario scenario = distributed(resilient()).scenario;
  for (project::ProcessEntry& process : scenario.processes) process.restarts = project::kRestartsMax;
  std::uniform_int_distribution<int> when_ms(500, 40'000);
  for (int i = 0; i < 8; ++i) {
    project::Injection injection;
    // The first comes long before the mission can have ended, so that it needs the restarted part.
    injection.at = i == 0 ? TimePoint(seconds(1)) : TimePoint(milliseconds(when_ms(random)));
    injection.what = project::intervention::Kill{scenario.processes[random() % scenario.processes.size()].name};
    scenario.timeline.push_back(std::move(injection));
  }
  auto plan = prepare(std::move(scenario));
  ASSERT_TRUE(plan.ok());
  const Ran ran = run(*plan.value);
  EXPECT_THAT(ran.report.unmet, IsEmpty());
  EXPECT_GT(ran.count("process.restarted"), 0U);
  // The last may still be starting when the mission succeeds, and one may be killed while it starts.
  EXPECT_LE(ran.count("process.restarted"), ran.count("process.exited"));
  EXPECT_EQ(ran.count("process.given_up"), 0U);
}

TEST(Processes, AreGivenUpWhenTheyEndTooOften) {
  project::Scenario scenario = distributed(resilient()).scenario;
  for (project::ProcessEntry& process : scenario.processes) process.restarts = 1;
  scenario.mission = "RUNNING";
  scenario.duration = seconds(80);
  // The second comes when the first restart is over: they are two seconds of wall time apart.
  for (const int at_s : {5, 45}) {
    project::Injection injection;
    injection.at = TimePoint(seconds(at_s));
    injection.what = project::intervention::Kill{"GoToLocation"};
    scenario.timeline.push_back(std::move(injection));
  }
  auto plan = prepare(std::move(scenario));
  ASSERT_TRUE(plan.ok());
  const Ran ran = run(*plan.value);
  EXPECT_THAT(ran.report.unmet, IsEmpty());
  EXPECT_EQ(ran.count("process.exited"), 2U);
  EXPECT_EQ(ran.count("process.restarted"), 1U);
  EXPECT_EQ(ran.count("process.given_up"), 1U);
  EXPECT_THAT(ran.report.problems, testing::Contains(HasSubstr("ended too often")));
}

// Without restarts of their own they are gone once killed, until somebody asks for them again.
TEST(Processes, AreUsedAgainOnceAPersonHasRestartedThem) {
  auto loaded = project::load_project(kSource + "/tests/projects/patrol");
  ASSERT_TRUE(loaded.ok());
  project::Scenario endless = project::plain_scenario(std::move(*loaded.value));
  endless.factor = 20;
  project::Scenario scenario = distributed(std::move(endless)).scenario;
  for (project::ProcessEntry& process : scenario.processes) process.restarts = 0;
  auto plan = prepare(std::move(scenario));
  ASSERT_TRUE(plan.ok());

  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::string> seen;  // names of messages, with the process they are about
  bool over = false;
  std::promise<Steering*> begun;
  RunOptions options;
  options.on_begin = [&](RunInside& inside) { begun.set_value(&inside.steering()); };
  options.on_view = [&](RunView* view) {
    const std::lock_guard lock(mutex);
    over = view == nullptr;
    changed.notify_all();
  };
  options.listeners.push_back([&](const Message& message) {
    const Value* process = message.data.find("process");
    const std::lock_guard lock(mutex);
    seen.push_back(message.name + (process != nullptr ? " " + std::string(process->text()) : ""));
    changed.notify_all();
  });
  const auto now = [&] {
    const std::lock_guard lock(mutex);
    return seen.size();
  };
  const auto await = [&](const std::string& what, std::size_t since) {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] {
      return over || std::find(seen.begin() + static_cast<std::ptrdiff_t>(since), seen.end(), what) != seen.end();
    });
    EXPECT_FALSE(over) << what;
  };
  std::thread person([&] {
    Steering& steering = *begun.get_future().get();
    const struct {
      std::string process;
      std::string used;  // what is observed when it does its work
      bool asks_at_once;
    } cases[] = {{"GoToLocation", "navigation.gotoTargetByLocationName.request", false},
                 {"sim", "navigation.getNavigationState.reply", false},
                 {"GoToLocation", "navigation.gotoTargetByLocationName.request", true},
                 {"sim", "navigation.getNavigationState.reply", true}};
    for (const auto& one : cases) {
      await(one.used, now());
      const auto untimely = steering.apply(Restart{one.process});
      EXPECT_EQ(untimely ? "" : untimely.error().code, "steering.part-state");
      const std::size_t before = now();
      EXPECT_TRUE(steering.apply(Kill{one.process}));
      if (!one.asks_at_once) await("process.exited " + one.process, before);
      EXPECT_TRUE(steering.apply(Restart{one.process}));
      await("process.restarted " + one.process, before);
      await(one.used, now());
    }
    EXPECT_TRUE(steering.apply(Stop{}));
  });
  const Ran ran = run(*plan.value, std::move(options));
  person.join();
  EXPECT_EQ(ran.report.error, "");
  EXPECT_EQ(ran.count("process.exited"), 4U);
  EXPECT_EQ(ran.count("process.restarted"), 4U);
  EXPECT_EQ(ran.count("process.given_up"), 0U);
}

// A component that stops answering is late, and used again once it answers.
TEST(Processes, ALateComponentIsUsedAgain) {
  project::Scenario scenario = resilient();
  scenario.project.deadlines.call = milliseconds(200);
  const project::Plan plan = distributed(std::move(scenario));
  RunOptions options;
  std::atomic<RunView*> view = nullptr;
  options.on_view = [&](RunView* now) { view = now; };
  int moves = 0;
  bool late = false;
  const auto signal_simulator = [&](int signal) {
    for (const ProcessReport& process : view.load()->processes()) {
      if (process.name == "sim") ::kill(static_cast<pid_t>(process.pid), signal);
    }
  };
  options.listeners.push_back([&](const Message& message) {
    if (message.name == "navigation.getNavigationState.reply" && ++moves == 5) signal_simulator(SIGSTOP);
    if (late || message.kind != MessageKind::kError) return;
    const Value* kind = message.data.find("kind");
    if (kind == nullptr || kind->text() != "late") return;
    late = true;
    signal_simulator(SIGCONT);
  });
  const Ran ran = run(plan, std::move(options));
  EXPECT_TRUE(late);
  EXPECT_THAT(ran.report.unmet, IsEmpty());
}

TEST(Processes, AStoppedOneFailsItsLeafAndIsEndedWithTheRun) {
  project::Scenario scenario = resilient();
  scenario.mission = "RUNNING";
  scenario.duration = seconds(120);
  scenario.project.deadlines.unresponsive = seconds(1);
  const project::Plan plan = distributed(std::move(scenario));
  RunOptions options;
  std::atomic<RunView*> view = nullptr;
  options.on_view = [&](RunView* now) { view = now; };
  bool stopped = false;
  options.listeners.push_back([&](const Message& message) {
    if (stopped || message.name != "GoToKitchen.tick.reply") return;
    stopped = true;
    for (const ProcessReport& process : view.load()->processes()) {
      if (process.name == "GoToLocation") ::kill(static_cast<pid_t>(process.pid), SIGSTOP);
    }
  });
  const Ran ran = run(plan, std::move(options));
  EXPECT_THAT(ran.report.unmet, IsEmpty());
  EXPECT_EQ(ran.count("process.exited"), 0U);
  const bool failed = std::any_of(ran.messages.begin(), ran.messages.end(), [](const Message& message) {
    return message.name == "GoToKitchen.tick.reply" && message.data.find("status")->text() == "FAILURE";
  });
  EXPECT_TRUE(failed);
}

// The thread that hangs is the one that reads the skill's connection: the answer closes it, and a later tick has
// another.
TEST(Processes, AScriptThatDoesNotEndFailsItsLeafAgainAndAgain) {
  auto loaded = project::load_project(kSource + "/tests/projects/endless");
  ASSERT_TRUE(loaded.ok());
  project::Scenario scenario = project::plain_scenario(std::move(*loaded.value));
  scenario.project.repeat = true;
  scenario.duration = std::chrono::minutes(10);
  const project::Plan plan = distributed(std::move(scenario));
  int told = 0;
  runtime::Run* mission = nullptr;
  RunOptions options;
  options.elsewhere = processes::elsewhere({.program = SENTREE_PROGRAM});
  options.listeners.push_back([&](const Message& message) {
    if (message.name != "Stuck.tick.reply") return;
    EXPECT_EQ(message.data.find("status")->text(), "FAILURE");
    const Value* outputs = message.data.find("outputs");
    const Value* reason = outputs != nullptr ? outputs->find("reason") : nullptr;
    const bool tells = reason != nullptr &&
                       reason->text().find("Stuck.scxml:4:15: this script does not end") != std::string_view::npos;
    if (tells && ++told == 3) mission->interrupt();
  });
  runtime::Run run(plan, std::move(options));
  mission = &run;
  (void)run.execute();
  EXPECT_GE(told, 3);
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);
}

// Whoever connects gets garbage, half a frame, nothing at all, or is hung up on.
class Liar {
 public:
  Liar(const std::string& path, unsigned seed) : random_(seed), listener_(::socket(AF_UNIX, SOCK_STREAM, 0)) {
    sockaddr_un at{};
    at.sun_family = AF_UNIX;
    std::memcpy(at.sun_path, path.c_str(), path.size() + 1);
    EXPECT_EQ(::bind(listener_, reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
    EXPECT_EQ(::listen(listener_, 16), 0);
    thread_ = std::thread([this] { serve(); });
  }
  ~Liar() {
    ::shutdown(listener_, SHUT_RDWR);
    thread_.join();
    ::close(listener_);
    for (const int peer : silent_) ::close(peer);
  }
  Liar(const Liar&) = delete;
  Liar& operator=(const Liar&) = delete;

 private:
  void serve() {
    for (int peer = 0; (peer = ::accept(listener_, nullptr, nullptr)) >= 0;) {
      char asked[4096];
      std::string answer;
      switch (random_() % 4) {
        case 0: silent_.push_back(peer); continue;
        case 1:  // a reply that breaks off
          answer = std::string("\x80\x01\0\x02\0\0\0\x04tick", 12);
          [[fallthrough]];
        case 2:
          (void)!::recv(peer, asked, sizeof asked, 0);
          for (std::size_t i = random_() % 64; i > 0; --i) answer += static_cast<char>(random_());
          (void)!::send(peer, answer.data(), answer.size(), MSG_NOSIGNAL);
          break;
        default: break;
      }
      ::close(peer);
    }
  }

  std::mt19937 random_;
  const int listener_;
  std::vector<int> silent_;  // of the thread, until it has ended
  std::thread thread_;
};

TEST(RemoteSkills, ThatLieReachNobodyOnceTheRunIsOver) {
  const unsigned seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  const TemporaryFolder folder{"liar"};
  const auto file = [&](const char* name) { return (folder.path() / name).string(); };
  ASSERT_TRUE(text::write_file(file("mission.xml"), R"(<root BTCPP_format="4"><BehaviorTree ID="M">
      <Parallel success_count="-1"><Action ID="A"/><Action ID="B"/><Action ID="C"/></Parallel></BehaviorTree></root>)"));
  ASSERT_TRUE(text::write_file(file("sentree.yaml"),
                               "mission: {file: mission.xml, rate: 200 Hz, repeat: true}\nskills:\n"
                               "  A: {at: \"unix:" +
                                   file("liar.sock") +
                                   "\"}\n"
                                   "  B: {at: \"unix:" +
                                   file("liar.sock") +
                                   "\"}\n"
                                   "  C: {at: \"unix:" +
                                   file("nobody.sock") + "\"}\n"));
  const Liar liar(file("liar.sock"), seed);
  auto loaded = project::load_project(folder.path().string());
  ASSERT_TRUE(loaded.ok());
  project::Scenario scenario = project::plain_scenario(std::move(*loaded.value));
  scenario.virtual_time = false;
  scenario.duration = milliseconds(30);
  // Some calls are in flight when the run is over.
  scenario.project.deadlines.unresponsive = seconds(2);
  scenario.project.deadlines.halt = milliseconds(5);
  auto plan = project::prepare(std::move(scenario));
  for (const Diagnostic& diagnostic : plan.diagnostics) ADD_FAILURE() << to_string(diagnostic);
  ASSERT_TRUE(plan.ok());
  std::size_t problems = 0;
  for (int i = 0; i < 40; ++i) {
    const auto over = std::make_shared<std::atomic<bool>>(false);
    const auto late = std::make_shared<std::atomic<int>>(0);
    RunOptions options;
    options.elsewhere = processes::elsewhere({.program = SENTREE_PROGRAM});
    options.on_problem = [over, late](const std::string&) {
      if (*over) ++*late;
    };
    {
      runtime::Run run(*plan.value, std::move(options));
      const RunReport report = run.execute();
      *over = true;
      EXPECT_EQ(report.error, "");
      EXPECT_THAT(report.problems, Each(Not(HasSubstr("has been closed"))));
      problems += report.problems.size();
    }
    EXPECT_EQ(*late, 0) << "run " << i;
  }
  EXPECT_GT(problems, 0U);
}

}  // namespace
}  // namespace sentree::runtime
