#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "sentree/bt/detail/test_support.h"
#include "sentree/bt/load.h"
#include "sentree/bt/model.h"
#include "sentree/bt/runner.h"
#include "sentree/bt/step.h"

namespace sentree::bt {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kMission = R"(<root BTCPP_format="4" main_tree_to_execute="Main">
  <BehaviorTree ID="Main">
    <ReactiveSequence>
      <ReactiveFallback>
        <BatteryOk name="Battery" threshold="30"/>
        <SubTree ID="Recharge" name="Recharge" station="{home}"/>
      </ReactiveFallback>
      <GoTo name="GoToKitchen" destination="kitchen" reason="{why}" carrier="x"/>
    </ReactiveSequence>
  </BehaviorTree>
  <BehaviorTree ID="Recharge"><GoTo name="Go" destination="{station}"/></BehaviorTree>
  <TreeNodesModel>
    <Condition ID="BatteryOk"><input_port name="threshold" type="double"/></Condition>
    <Action ID="GoTo"><input_port name="destination" type="std::string"/><output_port name="reason" type="std::string"/></Action>
  </TreeNodesModel>
</root>)";

/// A tree with external leaves, answered by the test.
struct Mission {
  explicit Mission(const std::string& xml, LoadOptions options = {}) : loaded(load(xml, options, "mission.xml")) {
    for (const Diagnostic& d : loaded.diagnostics) messages += to_string(d) + "\n";
    if (loaded.ok()) state = State(tree());
  }
  [[nodiscard]] const Tree& tree() const { return *loaded.value; }
  [[nodiscard]] NodeId leaf(const std::string& path) const { return tree().find(path); }
  StepResult step(const Input& input) { return bt::step(tree(), state, input, now, effects); }
  StepResult answer(const std::string& path, Status status, Map outputs = {}) {
    return step(Input::answer(leaf(path), status, std::move(outputs)));
  }
  [[nodiscard]] std::string todo() const {
    std::string text;
    for (const Effect& e : effects.list) {
      text += e.kind == Effect::Kind::kTickLeaf   ? (e.started ? "start " : "tick ")
              : e.kind == Effect::Kind::kHaltLeaf ? "halt "
                                                  : "cancel ";
      text += tree().path(e.leaf) + " ";
    }
    return text;
  }

  Loaded<Tree> loaded;
  std::string messages;
  State state;
  Effects effects;
  TimePoint now{};
};

TEST(Step, SuspendsForAnExternalLeafAndGoesOnWithItsAnswer) {
  Mission m(kMission);
  ASSERT_TRUE(m.loaded.ok()) << m.messages;
  StepResult result = m.step(Input::tick());
  ASSERT_TRUE(result.waiting());
  EXPECT_EQ(m.tree().path(result.leaf), "Battery");
  EXPECT_EQ(m.todo(), "start Battery ");
  EXPECT_EQ(m.effects.list[0].inputs, (Map{{"threshold", 30.0}}));
  EXPECT_TRUE(m.answer("Battery", Status::kSuccess).waiting());
  EXPECT_EQ(m.todo(), "start GoToKitchen ");
  result = m.answer("GoToKitchen", Status::kRunning);
  EXPECT_TRUE(result.done());
  EXPECT_EQ(result.status, Status::kRunning);
}

// Of a C++ node with a port of any type the entry would be of any type, and lose the text, as in BehaviorTree.CPP.
TEST(Step, AnUntypedPortOfAnExternalLeafSaysNothingOfItsEntry) {
  for (const char* port : {"", "<input_port name='text'/>", "<input_port name='text' type='Pose'/>"}) {
    Mission m(std::string("<root BTCPP_format='4'><BehaviorTree ID='M'><Sequence>"
                          "<SetBlackboard output_key='goal' value='a;b'/><Say text='{goal}'/></Sequence></BehaviorTree>"
                          "<TreeNodesModel><Action ID='Say'>") +
              port + "</Action></TreeNodesModel></root>");
    ASSERT_TRUE(m.loaded.ok()) << m.messages;
    ASSERT_TRUE(m.step(Input::tick()).waiting());
    EXPECT_EQ(m.effects.list[0].inputs, (Map{{"text", "a;b"}}));
  }
}

TEST(Step, TicksTheSuccessorBeforeItsPredecessorIsHalted) {
  Mission m(kMission);
  m.step(Input::tick());
  m.answer("Battery", Status::kSuccess);
  m.answer("GoToKitchen", Status::kRunning);
  m.step(Input::tick());
  m.answer("Battery", Status::kFailure);
  EXPECT_EQ(m.todo(), "start Recharge.Go ");
  m.answer("Recharge.Go", Status::kRunning);
  EXPECT_EQ(m.todo(), "halt GoToKitchen ");
  EXPECT_THAT(m.state.outstanding_halts(), ElementsAre(m.leaf("GoToKitchen")));
}

TEST(Step, ALeafTickedWhileItIsHaltingIsRunningAndStartsAnewAfterwards) {
  Mission m(kMission);
  m.step(Input::tick());
  m.answer("Battery", Status::kSuccess);
  m.answer("GoToKitchen", Status::kRunning);
  m.step(Input::tick());
  m.answer("Battery", Status::kFailure);
  m.answer("Recharge.Go", Status::kRunning);
  m.step(Input::tick());
  const StepResult result = m.answer("Battery", Status::kSuccess);
  EXPECT_TRUE(result.done());
  EXPECT_EQ(result.status, Status::kRunning);
  EXPECT_EQ(m.todo(), "halt Recharge.Go ");
  m.step(Input::leaf_halted(m.leaf("GoToKitchen")));
  EXPECT_TRUE(m.effects.wake);
  m.step(Input::tick());
  m.answer("Battery", Status::kSuccess);
  EXPECT_EQ(m.todo(), "start GoToKitchen ");
}

// It may have begun something, also in the tick that it has not answered.
TEST(Step, HaltingTheTreeHaltsTheActionThatIsWaitedFor) {
  Mission m(kMission);
  for (const bool began_before : {false, true}) {
    SCOPED_TRACE(began_before);
    m.step(Input::tick());
    m.answer("Battery", Status::kSuccess);
    if (began_before) {
      m.answer("GoToKitchen", Status::kRunning);
      m.step(Input::tick());
      m.answer("Battery", Status::kSuccess);
    }
    EXPECT_EQ(m.step(Input::halt()).kind, StepResult::Kind::kApplied);
    EXPECT_EQ(m.todo(), "halt GoToKitchen ");
    EXPECT_EQ(m.state.waiting_leaf(), kNoNode);
    EXPECT_EQ(m.answer("GoToKitchen", Status::kSuccess).kind, StepResult::Kind::kIgnored);
    EXPECT_THAT(m.state.outstanding_halts(), ElementsAre(m.leaf("GoToKitchen")));
    m.step(Input::leaf_halted(m.leaf("GoToKitchen")));
    EXPECT_THAT(m.state.outstanding_halts(), ElementsAre());
  }
}

TEST(Step, HaltingTheTreeCancelsTheConditionThatIsWaitedFor) {
  Mission m(kMission);
  m.step(Input::tick());
  EXPECT_EQ(m.step(Input::halt()).kind, StepResult::Kind::kApplied);
  EXPECT_EQ(m.todo(), "cancel Battery ");
  EXPECT_EQ(m.state.waiting_leaf(), kNoNode);
  EXPECT_EQ(m.answer("Battery", Status::kSuccess).kind, StepResult::Kind::kIgnored);
}

TEST(Step, IgnoresWhatDoesNotFit) {
  Mission m(kMission);
  EXPECT_EQ(m.answer("Battery", Status::kSuccess).kind, StepResult::Kind::kIgnored);
  m.step(Input::tick());
  EXPECT_EQ(m.step(Input::tick()).kind, StepResult::Kind::kIgnored);
  EXPECT_EQ(m.step(Input::leaf_halted(m.leaf("Battery"))).kind, StepResult::Kind::kIgnored);
  EXPECT_EQ(m.answer("GoToKitchen", Status::kSuccess).kind, StepResult::Kind::kIgnored);
}

TEST(Step, WritesTheOutputsOfAnAnswer) {
  Mission m(kMission);
  m.step(Input::tick());
  m.answer("Battery", Status::kSuccess);
  m.answer("GoToKitchen", Status::kFailure, {{"reason", "NO_VALID_PATH"}});
  const Value* why = entry(m.tree(), m.state, "why");
  ASSERT_NE(why, nullptr);
  EXPECT_EQ(*why, Value("NO_VALID_PATH"));
}

// What a script does next must not depend on whether a skill's number was whole.
TEST(Step, OutputsAreConvertedToWhatTheirPortDeclares) {
  const auto run = [](Map outputs, const std::string& script) {
    Mission m(
        "<root BTCPP_format=\"4\"><BehaviorTree ID=\"M\"><Sequence>"
        "<Read real=\"{d}\" whole=\"{i}\" text=\"{s}\" status=\"{st}\"/><Script code=\"" +
        script +
        "\"/></Sequence></BehaviorTree><TreeNodesModel><Action ID=\"Read\">"
        "<output_port name=\"real\" type=\"double\"/><output_port name=\"whole\" type=\"int\"/>"
        "<output_port name=\"text\" type=\"std::string\"/><output_port name=\"status\" type=\"NodeStatus\"/>"
        "</Action></TreeNodesModel></root>");
    m.step(Input::tick());
    const StepResult result = m.answer("Read", Status::kSuccess, std::move(outputs));
    if (result.kind == StepResult::Kind::kFailed) return m.effects.error->message;
    return to_json(export_blackboard(m.tree(), m.state));
  };
  EXPECT_EQ(run({{"real", 1}}, "d := d / 2"), R"({"":{"d":0.5}})");
  EXPECT_EQ(run({{"real", 1.5}}, "d += 0.25"), R"({"":{"d":1.75}})");
  EXPECT_EQ(run({{"real", "2.5"}, {"whole", 3.0}}, "d *= i"), R"({"":{"d":7.5,"i":3}})");
  EXPECT_EQ(run({{"text", 7}}, "s := 'a text'"), R"({"":{"s":"a text"}})");
  EXPECT_EQ(run({{"real", Value()}}, "i := 1"), R"({"":{"i":1}})");
  EXPECT_THAT(run({{"real", "abc"}}, "i := 1"), HasSubstr("\"Read\": output \"real\": \"abc\" is no double"));
  EXPECT_THAT(run({{"whole", 3.5}}, "i := 1"), HasSubstr("output \"whole\": 3.5 is no int"));
  EXPECT_THAT(run({{"whole", 3e9}}, "i := 1"), HasSubstr("is no int"));
  EXPECT_THAT(run({{"text", Map{{"a", 1}}}}, "i := 1"), HasSubstr("output \"text\": {\"a\":1} is no std::string"));
  EXPECT_THAT(run({{"status", "DONE"}}, "i := 1"), HasSubstr("is no BT::NodeStatus"));
}

// Tutorial 6 of BehaviorTree.CPP: the port inside makes the entry outside, whose type may be known to nobody here.
TEST(Script, AssignsToAnEntryThatAPortInsideASubTreeNames) {
  for (const std::string type : {"", "type=\"Position2D\"", "type=\"std::string\""}) {
    Mission m(
        "<root BTCPP_format=\"4\" main_tree_to_execute=\"M\"><BehaviorTree ID=\"M\"><Sequence>"
        "<Script code=\" move_goal='1;2;3' \"/><SubTree ID=\"Move\" target=\"{move_goal}\"/></Sequence>"
        "</BehaviorTree><BehaviorTree ID=\"Move\"><MoveBase goal=\"{target}\"/></BehaviorTree>"
        "<TreeNodesModel><Action ID=\"MoveBase\"><input_port name=\"goal\" " +
        type + "/></Action></TreeNodesModel></root>");
    EXPECT_EQ(m.messages, "") << type;
    ASSERT_TRUE(m.loaded.ok());
    EXPECT_TRUE(m.tree().model().unwritten.empty()) << type;
    EXPECT_TRUE(m.step(Input::tick()).waiting()) << (m.effects.error ? to_string(*m.effects.error) : type);
    EXPECT_EQ(m.effects.list.front().inputs, (Map{{"goal", "1;2;3"}})) << type;
  }
}

TEST(Script, AssignsToNothingThatNoPortNames) {
  Mission m(in_tree("<Script code=\"goal = 1; goal += 1\"/>"));
  EXPECT_THAT(m.messages, HasSubstr("entry \"goal\", which nothing in the tree creates"));
  EXPECT_EQ(m.step(Input::tick()).kind, StepResult::Kind::kFailed);
  // What is there without a value is none yet for "+=".
  Mission added(
      in_tree("<Sequence><Script code=\"n += 1\"/><Repeat num_cycles=\"{n}\"><AlwaysSuccess/></Repeat></Sequence>"));
  EXPECT_THAT(added.messages, HasSubstr("entry \"n\", which nothing in the tree creates"));
}

TEST(Load, WarnsOfAnAttributeThatNobodyDeclaredAndKeepsIt) {
  Mission m(kMission);
  EXPECT_THAT(m.messages, HasSubstr("carrier"));
  m.step(Input::tick());
  m.answer("Battery", Status::kSuccess);
  EXPECT_NE(m.effects.list[0].inputs.find("carrier"), nullptr);
}

TEST(Runner, TicksAnXmlWithACppLeaf) {
  int greeted = 0;
  Registry registry;
  registry.action("SayHello", {input<std::string>("to")}, [&](Context& self) {
    if (self.input_or<std::string>("to", "") == "world") ++greeted;
    return Status::kSuccess;
  });
  auto loaded = load(R"(<root BTCPP_format="4"><BehaviorTree ID="Main"><SayHello to="world"/></BehaviorTree></root>)",
                     {.registry = &registry});
  ASSERT_TRUE(loaded.ok());
  Runner runner(std::move(*loaded.value));
  EXPECT_EQ(runner.tick(), Status::kSuccess);
  EXPECT_EQ(greeted, 1);
}

}  // namespace
}  // namespace sentree::bt
