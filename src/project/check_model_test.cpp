#include "sentree/project/detail/check_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "sentree/base/temporary_folder.h"

namespace sentree::project {
namespace {

namespace fs = std::filesystem;

struct ModelCase {
  const char* file;
  const char* before;
  const char* after;
  const char* message;
};

std::vector<std::string> messages_of(const ModelCase& one, const char* example = "modelled") {
  const TemporaryFolder temporary("check-model");
  const fs::path folder = temporary.path() / "project";
  fs::copy(fs::path(SENTREE_SOURCE_DIR) / "examples" / example, folder, fs::copy_options::recursive);
  std::stringstream text;
  text << std::ifstream(folder / one.file).rdbuf();
  std::string content = text.str();
  const auto at = content.find(one.before);
  EXPECT_NE(at, std::string::npos) << "the example no longer has " << one.before;
  content.replace(at, std::string(one.before).size(), one.after);
  std::ofstream(folder / one.file) << content;
  auto project = load_project(folder);
  Diagnostics diagnostics = project.diagnostics;
  if (project.ok()) diagnostics = prepare(plain_scenario(std::move(*project.value))).diagnostics;
  std::vector<std::string> messages;
  for (const Diagnostic& diagnostic : diagnostics) {
    std::string said = to_string(diagnostic);
    const std::string prefix = folder.string() + "/";
    for (auto place = said.find(prefix); place != std::string::npos; place = said.find(prefix))
      said.erase(place, prefix.size());
    messages.push_back(said);
  }
  return messages;
}

TEST(CheckModel, ASoundOneHasNothingToComplainAbout) {
  EXPECT_THAT(messages_of({"sentree.yaml", "models/hall", "models/hall", ""}), testing::IsEmpty());
}

TEST(CheckModel, TellsWhatIsWrongWithItsPlace) {
  const ModelCase cases[] = {
      {"sentree.yaml", "serves: [door, lamp]", "serves: [dor, lamp]",
       "sentree.yaml:9:39: model \"hall\" serves \"dor\", which is no service of the project; did you mean \"door\"?"},
      {"sentree.yaml", "serves: [door, lamp]", "serves: [lamp]",
       "sentree.yaml:5:3: service \"door\" is at: model, but no entry of \"models\" serves it; write models: [{file: "
       "models/X.scxml, serves: [door]}]"},
      {"models/hall.scxml", "event=\"door.open.request\" target", "event=\"door.opn.request\" target",
       "models/hall.scxml:13:9: event \"door.opn.request\" never comes: no call of what the model serves is named so; "
       "did "
       "you mean \"door.open.request\"?"},
      {"models/hall.scxml", "event=\"door.open.request\" target", "event=\"dor.open.request\" target",
       "models/hall.scxml:13:9: event \"dor.open.request\" never comes: no call of what the model serves is named so; "
       "did you mean \"door.open.request\"?"},
      {"models/hall.scxml", "event=\"door.open.request\" target", "event=\"gate.shut.request\" target",
       "models/hall.scxml:13:9: event \"gate.shut.request\" never comes: no call of what the model serves is named so"},
      {"models/hall.scxml", "event=\"getState.reply\"", "event=\"getStat.reply\"",
       "models/hall.scxml:15:52: service \"door\" (Door) has no method \"getStat\"; did you mean \"getState\"?"},
      {"models/hall.scxml", "event=\"getState.reply\"", "event=\"getState.repl\"",
       "models/hall.scxml:15:52: \"getState.repl\" is no answer; send METHOD.reply or METHOD.error"},
      {"models/hall.scxml", "expr=\"'CLOSED'\"", "expr=\"'CLOSE'\"",
       "models/hall.scxml:15:68: result: enum DoorState has no \"CLOSE\"; did you mean \"CLOSED\"?"},
      {"models/hall.scxml", "cond=\"!lit\"", "cond=\"chance(0.5)\"",
       "models/hall.scxml:42:7: chance() in the condition of a transition, which is evaluated as often as the engine "
       "needs "
       "to; choose in an <assign> or an <if> before"},
      {"models/hall.scxml", "event=\"lamp.brightness.request\"", "event=\"lamp.unknown\"",
       "skills/SwitchOn.scxml:14:14: no transition of models/hall.scxml takes lamp.brightness.request, so this call is "
       "always "
       "late; it answers 3 of the 4 methods that skills call"},
      {"models/hall.scxml", "pick('opens_in'", "pik('opens_in'",
       "models/hall.scxml:28:50: \"pik\" is declared nowhere: no <data> is called so; did you mean \"pick\"?"},
      {"models/hall.scxml", "pick('opens_in', ", "pick(",
       "models/hall.scxml:28:50: pick('NAME', a, …) begins with the name of the choice, and '800ms' looks like an "
       "alternative"},
      {"models/hall.scxml", "pick('opens_in', ", "pick('OPEN', 'CLOSED') + pick('opens_in', ",
       "models/hall.scxml:28:50: pick('NAME', a, …) begins with the name of the choice, and 'OPEN' looks like an "
       "alternative"},
      {"models/hall.scxml", "chance(0.8)", "chance(8)",
       "models/hall.scxml:21:46: chance(8) needs a probability from 0 to 1"},
      {"models/hall.scxml", "chance(0.8)", "between(2, 1)",
       "models/hall.scxml:21:46: between(2, 1) leaves nothing open; the lower one comes first"},
      {"models/hall.scxml", "[0.3, false]", "[0.2, false]",
       "models/hall.scxml:43:38: draw([[p, a], …]) needs pairs whose probabilities add up to 1, and these add up to "
       "0.9"},
      {"models/hall.scxml", "'1500ms'", "'1500mss'",
       "models/hall.scxml:28:50: \"1500mss\" is no time; write a number with s or ms, as in '1.5s'"},
      {"sentree.yaml", "serves: [door, lamp]", "name: door, serves: [door, lamp]",
       "sentree.yaml:9:5: model \"door\" and a service have the same name, so their messages would look alike; give it "
       "another with \"name\""},
  };
  for (const ModelCase& one : cases)
    EXPECT_THAT(messages_of(one), testing::Contains(std::string(one.message))) << one.after;
}

TEST(CheckModel, TellsWhatItsDataCannotAnswer) {
  const auto robot = [](const char* before, const char* after) {
    return messages_of({"models/robot.scxml", before, after, ""}, "recharge");
  };
  EXPECT_THAT(robot("GOAL_REACHED", "GOAL_REACHD"),
              testing::Contains(testing::HasSubstr("'GOAL_REACHD' is no NavigationStatus; did you mean "
                                                   "\"GOAL_REACHED\"?")));
}

TEST(CheckTopics, ASoundProjectHasNothingToComplainAbout) {
  EXPECT_THAT(messages_of({"sentree.yaml", "models/pack", "models/pack", ""}, "topics"), testing::IsEmpty());
}

TEST(CheckTopics, TellsWhatIsWrongWithItsPlace) {
  const ModelCase cases[] = {
      {"sentree.yaml", "[battery.state]", "[battery.stat]",
       "sentree.yaml:13:29: skill \"WaitUntilLow\" subscribes to \"battery.stat\", which is no topic: no service of "
       "the "
       "project has such a method; did you mean \"battery.state\"?"},
      {"sentree.yaml", "{subscribe: [battery.state]}", "{latest: [battery.stat]}",
       "sentree.yaml:13:26: skill \"WaitUntilLow\" subscribes to \"battery.stat\", which is no topic: no service of "
       "the project has such a method; did you mean \"battery.state\"?"},
      {"sentree.yaml", "subscribe: [notices.said]", "subscribe: [battery.state]",
       "sentree.yaml:10:45: model \"display\" subscribes to \"battery.state\", but models/display.scxml has no "
       "transition for that event"},
      {"sentree.yaml", "  WaitUntilLow: {subscribe: [battery.state]}", "  WaitUntilLow: {data: {}}",
       "skills/WaitUntilLow.scxml:6:5: event \"battery.state\" never arrives: the skill does not subscribe to this "
       "topic; write subscribe: [battery.state] in its entry of sentree.yaml"},
      {"sentree.yaml", "{subscribe: [battery.state]}", "{subscribe: [battery.state], at: \"unix:/x\"}",
       "sentree.yaml:13:29: skill \"WaitUntilLow\" runs in another process, which topics do not reach; leave \"at\" "
       "out, or \"subscribe\""},
      {"skills/WaitUntilLow.scxml", "_event.data.percentage &lt;", "_event.data.percent &lt;",
       "skills/WaitUntilLow.scxml:6:45: _event.data.percent: the data of battery.state has no member \"percent\"; "
       "there are percentage, charging"},
      {"skills/WaitUntilLow.scxml", "event=\"battery.state\"", "event=\"battery.state.reply\"",
       "skills/WaitUntilLow.scxml:6:5: event \"battery.state.reply\" never comes: state is one-way, and nobody answers "
       "it"},
      {"models/pack.scxml", "name=\"charging\" expr=\"false\"", "name=\"charging\" expr=\"'no'\"",
       "models/pack.scxml:8:9: argument \"charging\" of Battery.state: expected bool, got string \"no\""},
      {"models/pack.scxml", "event=\"state\"", "event=\"stat\"",
       "models/pack.scxml:6:51: service \"battery\" (Battery) has no method \"stat\"; did you mean \"state\"?"},
      {"interfaces/robot_state.thrift", "oneway void said", "void said",
       "sentree.yaml:6:3: service \"notices\" is at: topics, where nobody answers, but said is not one-way; write "
       "\"oneway void said(…)\" in robot_state.thrift, or say who serves it"},
      {"models/pack.scxml", "target=\"battery\" event=\"state\"", "target=\"notices\" event=\"said\"",
       "sentree.yaml:13:29: warning: no chart of the project publishes \"battery.state\"; it comes only from "
       "scenarios, "
       "people and other processes"},
      {"requirements/low.req", "request(battery.state)", "reply(battery.state)",
       "requirements/low.req:2:23: battery.state is one-way: nobody answers it; what is published is "
       "request(battery.state)"},
  };
  for (const ModelCase& one : cases)
    EXPECT_THAT(messages_of(one, "topics"), testing::Contains(std::string(one.message))) << one.after;
}

TEST(CheckTopics, TheSimulatorPublishesWhatItKnows) {
  const auto said = [](const char* before, const char* after) {
    return messages_of({"sentree.yaml", before, after, ""}, "telemetry");
  };
  EXPECT_THAT(said("battery: 2 Hz", "battery: 2 Hz"), testing::IsEmpty());
  EXPECT_THAT(said("battery: 2 Hz", "batery: 2 Hz"),
              testing::Contains("sentree.yaml:6:65: the simulator publishes no topic \"batery\"; did you mean "
                                "\"battery\"?"));
  EXPECT_THAT(said("battery: 2 Hz", "battery: 2 Hzz"),
              testing::Contains("sentree.yaml:6:74: \"2 Hzz\" is no rate from 0.01 Hz to 1000 Hz, e.g. 2 Hz"));
  EXPECT_THAT(said("battery: 2 Hz, ", ""),
              testing::Contains("sentree.yaml:9:29: warning: the simulator does not publish \"robot.battery\": write "
                                "publish: {battery: 2 Hz} in the entry of the service"));
  EXPECT_THAT(
      said("at: sim", "at: topics"),
      testing::Contains(testing::HasSubstr("only the simulator in the process of the run publishes at a rate")));
}

}  // namespace
}  // namespace sentree::project
