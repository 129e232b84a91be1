// Services outside the run: when they are connected, and what is told of those that are away.

#include <gmock/gmock.h>

#include <mutex>
#include <vector>

#include "sentree/base/temporary_folder.h"
#include "sentree/runtime/run.h"
#include "sentree/text/file.h"

namespace sentree::runtime {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// What is done with the ports of a run and what it observes, in order.
struct PortsSeen {
  void add(std::string what) {
    const std::lock_guard lock(mutex);
    all.push_back(std::move(what));
  }
  std::mutex mutex;
  std::vector<std::string> all;
};

class FakePort final : public ServicePort {
 public:
  FakePort(PortsSeen& told, std::string name, bool is_there)
      : told_(told), name_(std::move(name)), is_there_(is_there) {}
  void open(const std::function<void()>& done) override {
    told_.add("open " + name_);
    done();
  }
  void call(const idl::Method& method, Value /*args*/, Done done) override {
    told_.add("call " + method.name);
    if (is_there_)
      done(mission::CallOutcome::returned(Value(1)));
    else
      done(mission::CallOutcome::failed(idl::CallErrorKind::kUnreachable, "nobody listens"));
  }

 private:
  PortsSeen& told_;
  std::string name_;
  bool is_there_;
};

class Ports : public testing::Test {
 protected:
  void SetUp() override {
    put("interfaces/s.thrift", "service S { i32 ask() }\nservice T { oneway void said() }\n");
    put("skills/Ask.scxml",
        R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript" initial="asking">
  <datamodel><data id="tries" expr="0"/></datamodel>
  <state id="asking">
    <onentry><send type="thrift" target="s" event="ask"/><send type="thrift" target="t" event="said"/></onentry>
    <transition event="s.ask.reply" target="success"/>
    <transition event="error.communication" cond="tries == 2" target="failure"/>
    <transition event="error.communication" target="asking"><assign location="tries" expr="tries + 1"/></transition>
    <transition event="halt" target="failure"/>
  </state>
  <final id="success"/>
  <final id="failure"/>
</scxml>)");
    put("tree.xml", R"(<root BTCPP_format="4" main_tree_to_execute="T">
  <BehaviorTree ID="T"><Action ID="Ask"/></BehaviorTree>
</root>)");
    put("sentree.yaml", R"(mission: {file: tree.xml, rate: 10 Hz}
services:
  s: {interface: s.thrift/S, at: "tcp://127.0.0.1:1"}
  t: {interface: s.thrift/T, at: topics}
)");
  }
  void put(const std::string& name, const std::string& content) {
    std::filesystem::create_directories((folder_.path() / name).parent_path());
    ASSERT_TRUE(text::write_file(folder_.path() / name, content));
  }
  RunReport run(bool is_there) {
    auto project = project::load_project(folder_.path());
    EXPECT_TRUE(project.ok());
    auto plan = prepare(project::plain_scenario(std::move(*project.value)));
    for (const Diagnostic& diagnostic : plan.diagnostics) ADD_FAILURE() << to_string(diagnostic);
    RunOptions options;
    options.make_port = [&](const project::ServicePlan& service, const std::string&) -> std::unique_ptr<ServicePort> {
      if (service.name == "t") return nullptr;
      return std::make_unique<FakePort>(told_, service.name, is_there);
    };
    options.listeners.push_back([&](const Message& message) {
      if (message.name == "mission.tick") told_.add("tick");
    });
    return runtime::Run(*plan.value, std::move(options)).execute();
  }

  PortsSeen told_;
  TemporaryFolder folder_{"ports"};
};

TEST_F(Ports, AreOpenedBeforeTheFirstTick) {
  const RunReport report = run(true);
  EXPECT_EQ(report.mission, bt::Status::kSuccess);
  EXPECT_THAT(report.problems, testing::IsEmpty());
  ASSERT_GE(told_.all.size(), 3U);
  EXPECT_EQ(told_.all[0], "open s");
  EXPECT_EQ(std::count(told_.all.begin(), told_.all.end(), "open s"), 1);
}

TEST_F(Ports, AnswerTheInvokedChartThatAsks) {
  put("skills/Ask.scxml", R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0">
  <state id="asking"><invoke id="child" src="file:Child.scxml"/>
    <transition event="done.invoke.child" target="success"/><transition event="error" target="failure"/>
  </state>
  <final id="success"/>
  <final id="failure"/>
</scxml>)");
  put("skills/Child.scxml", R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0">
  <state id="asking"><onentry><send type="thrift" target="s" event="ask"/></onentry>
    <transition event="s.ask.reply error.communication" target="answered"/></state>
  <final id="answered"/>
</scxml>)");
  for (const bool is_there : {true, false}) EXPECT_EQ(run(is_there).mission, bt::Status::kSuccess) << is_there;
}

TEST_F(Ports, WhoIsAwayIsOneProblemHoweverOftenItIsAsked) {
  const RunReport report = run(false);
  EXPECT_EQ(report.mission, bt::Status::kFailure);
  EXPECT_THAT(report.problems, ElementsAre("s.ask: nobody listens (3 times)"));
}

}  // namespace
}  // namespace sentree::runtime
