#include "sentree/monitor/requirement_types.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/monitor/monitor.h"

namespace sentree::monitor {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using Kind = DataType::Kind;

DataType number(const std::string& unit = "") {
  return {.kind = Kind::kNumber, .name = "double", .unit = unit, .may_be_absent = false};
}

Vocabulary vocabulary() {
  const DataType none{.kind = Kind::kRecord, .may_be_absent = false};
  const DataType battery{.kind = Kind::kRecord,
                         .name = "BatteryState",
                         .may_be_absent = false,
                         .members = {{"percentage", number("ratio")}, {"voltage", number("V")}}};
  const DataType navigation{
      .kind = Kind::kRecord,
      .name = "NavigationState",
      .may_be_absent = false,
      .members = {{"status", {.kind = Kind::kText, .name = "NavigationStatus", .words = {"IDLE", "MOVING"}}}}};
  const DataType going{.kind = Kind::kRecord,
                       .name = "navigation.goTo",
                       .may_be_absent = false,
                       .members = {{"name", {.kind = Kind::kText, .name = "string"}}}};
  Vocabulary v;
  v.services["battery"]["getBatteryState"] = {none, battery};
  v.services["battery"]["getCharge"] = {none, number("%")};
  v.services["battery"]["isCharging"] = {none, {.kind = Kind::kTruth, .name = "bool"}};
  v.services["navigation"]["getState"] = {none, navigation};
  const DataType blocked{.kind = Kind::kRecord, .name = "Blocked", .members = {{"door", {.kind = Kind::kText}}}};
  v.services["navigation"]["goTo"] = {going, {.kind = Kind::kTruth, .name = "bool"}};
  v.services["navigation"]["goTo"].exceptions = {
      .kind = Kind::kRecord, .name = "an exception of goTo", .members = {{"Blocked", blocked}}};
  v.leaves = {"GoToKitchen", "Look"};
  v.models = {"hall"};
  v.ports["Look"] = {.inputs = {.kind = Kind::kRecord, .name = "the input of Look", .members = {{"force", {}}}},
                     .outputs = {.kind = Kind::kRecord, .name = "the output of Look", .members = {{"held", {}}}}};
  v.nodes = {"Main", "GoToKitchen", "Look"};
  v.calls = {{"GoToKitchen", "navigation", "goTo"},
             {"GoToKitchen", "navigation", "getState"},
             {"Look", "battery", "getBatteryState"}};
  return v;
}

std::vector<std::string> found(const std::string& text, bool with_project = true) {
  const auto file = parse_requirements(text, "r.req");
  std::vector<std::string> all;
  for (const Diagnostic& diagnostic : file.diagnostics) all.push_back(to_string(diagnostic));
  if (!file.ok()) return all;
  const Vocabulary v = vocabulary();
  Diagnostics diagnostics;
  for (const Requirement& requirement : file.value->requirements)
    (void)check_requirement(requirement, with_project ? &v : nullptr, diagnostics);
  for (const Diagnostic& diagnostic : diagnostics) all.push_back(to_string(diagnostic));
  return all;
}

constexpr const char* kBattery = "reply(battery.getBatteryState)";

// A record of ten of the one before, and so on.
DataType tower(int levels, const std::string& lowest) {
  DataType type{.kind = Kind::kRecord, .name = lowest};
  for (int level = 0; level < levels; ++level) {
    DataMembers members;
    for (const char* name : {"a", "b", "c", "d", "e", "f", "g", "h", "i", "j"}) members.push_back({name, type});
    type = {.kind = Kind::kRecord, .name = "level", .members = members};
  }
  return type;
}

TEST(DataMembers, OfManyPathsToFewRecordsAreComparedByRecord) {
  EXPECT_EQ(tower(30, "x"), tower(30, "x"));
  EXPECT_NE(tower(30, "x"), tower(30, "y"));
  EXPECT_EQ(tower(30, "x"), tower(30, "x"));  // what differed before is forgotten
}

TEST(DataMembers, ACopyHasItsOwn) {
  const DataMembers one{{"a", number()}};
  DataMembers other = one;
  other.push_back({"b", number()});
  EXPECT_EQ(one.size(), 1u);
  EXPECT_EQ(other.size(), 2u);
  EXPECT_EQ(other.begin()->name, "a");
}

TEST(Types, KnowServicesMethodsMembersAndLeaves) {
  EXPECT_THAT(found("R: always reply(batery.getBatteryState).voltage > 20 V."),
              ElementsAre("r.req:1:17: the project has no service \"batery\"; did you mean \"battery\"?"));
  EXPECT_THAT(found("R: always reply(battery.getBateryState).voltage > 20 V."),
              ElementsAre("r.req:1:17: service \"battery\" has no method \"getBateryState\"; did you mean "
                          "\"getBatteryState\"?"));
  EXPECT_THAT(found("R: always reply(battery.getBatteryState).percntage > 0.2."),
              ElementsAre("r.req:1:11: reply(battery.getBatteryState).percntage: BatteryState has no member "
                          "\"percntage\"; did you mean \"percentage\"?"));
  EXPECT_THAT(found("R: always reply(battery.getBatteryState from Lok).voltage > 20 V."),
              ElementsAre("r.req:1:46: the mission has no leaf \"Lok\"; did you mean \"Look\"?"));
  EXPECT_THAT(found("R: never node(GoToKichen) in FAILURE."),
              ElementsAre("r.req:1:15: the mission has no node \"GoToKichen\"; did you mean \"GoToKitchen\"?"));
  EXPECT_THAT(found("R: never node(GoToKitchen) in FAILED."),
              ElementsAre(HasSubstr("\"FAILED\" is no status; it has IDLE, RUNNING, SUCCESS, FAILURE, SKIPPED")));
  EXPECT_THAT(found("R: never event(mission.tik)."),
              ElementsAre("r.req:1:16: nothing in this project is observed as \"mission.tik\"; did you mean "
                          "\"mission.tick\"?"));
  EXPECT_THAT(found("R: never event(request(navigation.goTo where args.nam = kitchen))."),
              ElementsAre(HasSubstr("args.nam: navigation.goTo has no member \"nam\"; did you mean \"name\"?")));
}

TEST(Types, KnowWhatARunSaysOfItself) {
  EXPECT_THAT(found("R: never event(mission.resumed).\nS: never event(Look.tick.taken)."), IsEmpty());
}

TEST(Types, OfWhereAreThoseOfOneObservation) {
  const std::string goal = "let goal = request(navigation.goTo).name\n";
  EXPECT_THAT(found(goal + "R: never event(request(navigation.goTo where args.name = goal))."),
              ElementsAre(HasSubstr("r.req:2:56: where looks at members of navigation.goTo.request alone")));
  EXPECT_THAT(found("R: never event(reply(navigation.goTo where reply(battery.isCharging)))."),
              ElementsAre(HasSubstr("compare outside")));
  EXPECT_THAT(found("R: never event(request(navigation.goTo where rises(args.name = kitchen)))."),
              ElementsAre(HasSubstr("is an event, and where wants what the members")));
  EXPECT_THAT(found("let to(place) = event(request(navigation.goTo where args.name = place))\nR: never to(kitchen)."),
              IsEmpty());
}

TEST(Where, AsksForEveryMemberOfItsObservation) {
  for (const char* asked :
       {"observation(hall.choice where name = \"grips\")", "observation(hall.choice where function = pick)",
        "observation(node.status where node = 3 and from = IDLE and to = SUCCESS)",
        "error(navigation.goTo where kind = late)", "error(navigation.goTo where kind = interrupted)",
        "error(navigation.goTo where vetoed_by = \"shield\")",
        "error(navigation.goTo where exception.Blocked.door = \"hall\")",
        "observation(scenario.injection where what = drop and drop.message = \"x\")",
        "observation(Look.tick.request where inputs.force = \"12\")", "observation(Look.tick.reply where outputs.held)",
        "observation(process.exited where pid = 3 and how = \"killed\")",
        "observation(monitor.violated where monitor = shield)", "observation(mission.resumed where lost_ns > 5)",
        "observation(Look.timer.taken where number > 1)"}) {
    EXPECT_THAT(found(fmt::format("R: never event({}).", asked)), IsEmpty()) << asked;
  }
  EXPECT_THAT(found("let kind = error(navigation.goTo).kind\nR: never kind = late or late = kind."), IsEmpty());
}

TEST(Where, RefusesWhatItsObservationDoesNotHave) {
  const auto only = [](const std::string& asked, const std::string& what) {
    EXPECT_THAT(found(fmt::format("R: never event({}).", asked)), ElementsAre(HasSubstr(what))) << asked;
  };
  only("observation(mission.tick where tik = 3)", "mission.tick has no member \"tik\"; did you mean \"tick\"?");
  only("observation(mission.tick where tik > 3)", "did you mean \"tick\"?");
  only("observation(mission.tick where tick = \"three\")", "they are never equal");
  only("request(navigation.goTo where name = kitchen)", "; it has source, target, call, tick, time, args");
  only("request(navigation.goTo where target.name = kitchen)", "has no member \"name\"");
  only("request(navigation.goTo where source = Lok)", "\"Lok\" is no leaf of the mission; did you mean \"Look\"?");
  only("error(navigation.goTo where kind = latte)", "\"latte\" is no kind of error; did you mean \"late\"?");
  only("error(navigation.goTo where exception.Blocked.dor = \"x\")", "Blocked has no member \"dor\"");
  only("error(navigation.goTo where exception.Jammed.why = \"x\")", "an exception of goTo has no member \"Jammed\"");
  only("observation(Look.tick.reply where status = SUCESS)", "\"SUCESS\" is no status");
  only("observation(node.status where to = FAILED)", "\"FAILED\" is no status");
  only("observation(Look.tick.request where inputs.forc = 3)", "did you mean \"force\"?");
  only("observation(Look.tick.reply where outputs.hled)", "did you mean \"held\"?");
}

TEST(Where, TellsArgumentsFromTheMessagesOwn) {
  Vocabulary v = vocabulary();
  v.services["navigation"]["goTo"].arguments.members.push_back(
      {"target", {.kind = Kind::kRecord, .members = {{"mast", {.kind = Kind::kText}}}}});
  const auto file = parse_requirements("R: never event(request(navigation.goTo where target.mast = north)).");
  Diagnostics diagnostics;
  (void)check_requirement(file.value->requirements.at(0), &v, diagnostics);
  ASSERT_EQ(diagnostics.size(), 1u);
  EXPECT_THAT(diagnostics[0].message, HasSubstr("did you mean \"args.target.mast\"?"));
}

TEST(Where, IsLookedAtInTheObservation) {
  const auto file = parse_requirements("R: never event(observation(hall.choice where name = \"grips\")).");
  const Vocabulary v = vocabulary();
  const Model model = *Model::make(file.value->requirements.at(0), &v).value;
  State state = start(model, {});
  Message choice;
  choice.name = "hall.choice";
  choice.sequence = 1;
  choice.data = Map{{"function", "pick"}, {"name", "doors"}, {"value", 1}};
  EXPECT_THAT(observe(model, state, choice), IsEmpty());
  choice.sequence = 2;
  choice.data = Map{{"function", "pick"}, {"name", "grips"}, {"value", 1}};
  EXPECT_EQ(observe(model, state, choice).size(), 1u);
}

TEST(Types, OfConstantsAreNotCompared) {
  for (const char* compared : {"\"a\" = \"b\"", "3 > 4", "true != false", "not (1 + 1 = 2)"})
    EXPECT_THAT(found(fmt::format("R: never {}.", compared)), ElementsAre(HasSubstr("compares what never changes")));
  EXPECT_THAT(found("R: never event(request(navigation.goTo where \"a\" = \"b\"))."),
              ElementsAre(HasSubstr("compare with a member of navigation.goTo.request")));
  EXPECT_THAT(found("let over(x) = x > 3\nR: never over(4)."), ElementsAre(HasSubstr("compares what never changes")));
}

TEST(Types, OfErrorsAndChoicesAreKnown) {
  EXPECT_THAT(found("R: never observation(Look.tick.request).inputs.forc = 3."), ElementsAre(HasSubstr("\"force\"?")));
  EXPECT_THAT(found("R: never observation(hall.choice).valeu = 3."), ElementsAre(HasSubstr("\"value\"?")));
  EXPECT_THAT(found("R: never error(navigation.goTo).exception.Blocked.dor = hall."),
              ElementsAre(HasSubstr("Blocked has no member \"dor\"")));
}

TEST(Definitions, ThatNoRequirementUsesAreCheckedToo) {
  const auto told = [](const std::string& text) {
    const auto file = parse_requirements(text, "r.req");
    const Vocabulary v = vocabulary();
    Diagnostics diagnostics;
    check_definitions(*file.value, &v, diagnostics);
    std::vector<std::string> all;
    for (const Diagnostic& diagnostic : diagnostics) all.push_back(to_string(diagnostic));
    return all;
  };
  const std::string used = "R: never node(Look) in FAILURE and flag.\nlet flag = reply(battery.isCharging)\n";
  EXPECT_THAT(told(used), IsEmpty());
  EXPECT_THAT(told(used + "let v = reply(battery.getBatteryState).voltag\n"),
              ElementsAre(HasSubstr("warning: no requirement of this file uses \"v\""), HasSubstr("\"voltage\"?")));
  EXPECT_THAT(told(used + "event e = rises(flag)\nlet at(x) = x = flag\n"),
              ElementsAre(HasSubstr("uses event \"e\""), HasSubstr("uses \"at\"")));
  EXPECT_THAT(told("let v = reply(battery.getBatteryState).voltage\n"), IsEmpty());  // others may be still to come
}

TEST(Types, OfEnumerationsHaveNumbersWithoutName) {
  const auto violated = [](const std::string& required, const Value& status) {
    const auto file = parse_requirements("let s = reply(navigation.getState).status\nR: " + required);
    const Vocabulary v = vocabulary();
    const Model model = *Model::make(file.value->requirements.at(0), &v).value;
    State state = start(model, {});
    Message reply;
    reply.name = "navigation.getState.reply";
    reply.sequence = 1;
    reply.data = Map{{"args", Map()}, {"result", Map{{"status", status}}}};
    return !observe(model, state, reply).empty();
  };
  EXPECT_TRUE(violated("always s = MOVING or s = IDLE.", 7));
  EXPECT_TRUE(violated("never s != MOVING and s != IDLE.", 7));
  EXPECT_FALSE(violated("always s != MOVING.", 7));
  EXPECT_FALSE(violated("never s = MOVING.", 7));
  EXPECT_FALSE(violated("always s = MOVING.", Value()));  // nothing is known
}

TEST(Types, AreCompared) {
  EXPECT_THAT(found("R: always reply(navigation.getState).status > 3."),
              ElementsAre(HasSubstr("expected a number, but reply(navigation.getState).status is a text")));
  EXPECT_THAT(found("R: always reply(navigation.getState).status = MOVIN."),
              ElementsAre("r.req:1:47: \"MOVIN\" is no NavigationStatus; did you mean \"MOVING\"?"));
  EXPECT_THAT(found("R: always reply(battery.getCharge) = full."),
              ElementsAre(HasSubstr("they are never equal (\"full\" is not defined)")));
  EXPECT_THAT(found("R: always reply(battery.getBatteryState) > 3."),
              ElementsAre(HasSubstr("name one of its members: percentage, voltage")));
  EXPECT_THAT(
      found("let level = reply(battery.getCharge)\nR: always level > 3.\nS: never level."),
      ElementsAre("r.req:3:10: expected true or false, but level is a number", HasSubstr("never says anything")));
  EXPECT_THAT(found("R: always reply(battery.getCharge)."), ElementsAre(HasSubstr("expected true or false")));
  EXPECT_THAT(found("R: always (reply(battery.isCharging) and reply(battery.getCharge) > 3) = true."),
              ElementsAre(HasSubstr("= and != compare values")));
  // Without a project, a use tells the type.
  EXPECT_THAT(found("R: always reply(a.b) > 3 and reply(a.b) = word.", false),
              ElementsAre(HasSubstr("is a number, word is a text")));
}

TEST(Units, OfPercentAndRatioAreToldApart) {
  const std::string ratio = std::string(kBattery) + ".percentage";
  EXPECT_THAT(found("R: always " + ratio + " >= 20 %."),
              ElementsAre("r.req:1:53: reply(battery.getBatteryState).percentage is in ratio, 20 % in %; multiply the "
                          "first by 100"));
  EXPECT_THAT(found("R: always " + ratio + " >= 20."),
              ElementsAre(HasSubstr("is a ratio from 0 to 1, and 20 is beyond; write 0.2")));
  EXPECT_THAT(found("R: always " + ratio + " >= 0.2."), IsEmpty());
  EXPECT_THAT(found("R: always " + ratio + " * 100 >= 20 %."), IsEmpty());
  EXPECT_THAT(found("R: always " + ratio + " = reply(battery.getCharge)."), testing::Contains(HasSubstr("in ratio")));
  EXPECT_THAT(found("R: always reply(battery.getCharge) > 0.3."),
              testing::Contains(HasSubstr("less than one percent; write 30")));
  EXPECT_THAT(found("let l [%] = " + ratio + "\nR: always l > 3."),
              ElementsAre(HasSubstr("\"l\" is defined in %, but its value is in ratio; multiply the first by 100")));
  EXPECT_THAT(found("R: always " + std::string(kBattery) + ".voltage > 3 m."),
              ElementsAre(HasSubstr("is in V, 3 m in m")));
  EXPECT_THAT(found("R: always " + std::string(kBattery) + ".voltage * 1000 > 3 mV."), IsEmpty());
}

TEST(Units, OfSharesHaveBounds) {
  const std::string level = "let l [%] = " + std::string(kBattery) + ".percentage * 100\n";
  const auto only = [&](const std::string& text, const std::string& what) {
    EXPECT_THAT(found(level + text), ElementsAre(HasSubstr(what))) << text;
  };
  only("R: whenever l > 300 %, l < 20 within 1 s.", "l is from 0 to 100 %, so l > 300 % is never true");
  only("R: never l >= 101.", "l >= 101 is never true");
  only("R: never l = -1.", "l = -1 is never true");
  only("R: always l <= 300 %.", "l <= 300 % is always true");
  only("R: always -5 % < l.", "-5 % < l is always true");
  only("R: always l != 200.", "l != 200 is always true");
  only("R: never " + std::string(kBattery) + ".percentage > 2 ratio.", "is from 0 to 1, so");
  // Its bounds themselves, and what is no share.
  for (const char* text : {"R: always l >= 0 % and l <= 100 %.", "R: never l > 100 %.", "R: never l - 50 < -20.",
                           "R: always reply(battery.getBatteryState).voltage < 300 V."})
    EXPECT_THAT(found(level + text), IsEmpty()) << text;
}

TEST(Vacuous, RequirementsArePointedOut) {
  const auto only = [](const std::string& text, const std::string& what) {
    EXPECT_THAT(found(text), ElementsAre(HasSubstr(what))) << text;
  };
  only("R: eventually reply(battery.getBatteryState).voltage > 3.", "can never be violated while the mission runs");
  only("R: whenever event(request(navigation.goTo)), reply(battery.getBatteryState).voltage > 3 eventually.",
       "can never be violated while the mission runs");
  only("R: never event(reply(battery.isCharging)).", "because no skill calls battery.isCharging");
  only("R: never event(reply(battery.getBatteryState from GoToKitchen)).",
       "because \"GoToKitchen\" never calls battery.getBatteryState");
  only("let v = reply(battery.getBatteryState).voltage\nR: whenever v < 20 and v > 24, v = 22 within 1 s.",
       "because it contradicts itself");
  only("let n = request(navigation.goTo).name\nR: never (n = a and n = b).", "because it contradicts itself");
  only("R: after event(reply(battery.isCharging)), never event(request(navigation.goTo)).",
       "the scope of requirement R never begins");
  EXPECT_THAT(found("R: before event(request(navigation.goTo)), eventually node(Look) in SUCCESS."), IsEmpty());
}

TEST(Vacuous, ValuesThatALeafNeverBringsArePointedOut) {
  EXPECT_THAT(found("let v = reply(battery.getBatteryState from GoToKitchen).voltage\nR: always v > 3.\nS: always v > "
                    "3 and v < 9."),
              ElementsAre("r.req:1:15: warning: reply(battery.getBatteryState from GoToKitchen) is never observed: "
                          "\"GoToKitchen\" never calls battery.getBatteryState"));
  EXPECT_THAT(found("R: always error(navigation.goTo from Look).kind != late."),
              ElementsAre(HasSubstr("\"Look\" never calls navigation.goTo")));
  EXPECT_THAT(found("R: never reply(battery.getBatteryState from GoToKitchen).voltage < 3."),
              ElementsAre(HasSubstr("requirement R never says anything")))
      << "once";
  EXPECT_THAT(found("R: always reply(battery.getBatteryState where tick > 1 and GoToKitchen = source).voltage > 3."),
              testing::Contains(HasSubstr("\"GoToKitchen\" never calls battery.getBatteryState")));
  EXPECT_THAT(found("R: always reply(battery.getBatteryState where source = Look).voltage > 3."), IsEmpty());
  EXPECT_THAT(found("R: always reply(battery.getBatteryState where source != GoToKitchen).voltage > 3."), IsEmpty());
  EXPECT_THAT(found("R: always reply(battery.getBatteryState from Look).voltage > 3."), IsEmpty());
  EXPECT_THAT(found("R: always reply(battery.isCharging) = true."), IsEmpty()) << "a scenario may call it";
}

TEST(Vacuous, WhatIsOverheardOthersCall) {
  const auto told = [](const std::string& text) {
    const auto file = parse_requirements(text, "r.req");
    Vocabulary v = vocabulary();
    v.services["battery"]["isCharging"].overheard = true;
    Diagnostics diagnostics;
    (void)check_requirement(file.value->requirements.at(0), &v, diagnostics);
    return diagnostics.empty() ? std::string() : to_string(diagnostics[0]);
  };
  EXPECT_EQ(told("R: never event(reply(battery.isCharging))."), "");
  EXPECT_EQ(told("R: whenever event(request(battery.isCharging)), event(reply(battery.isCharging)) within 2 s."), "");
  EXPECT_THAT(told("R: never event(reply(battery.isCharging from Look))."),
              HasSubstr("\"Look\" never calls battery.isCharging"));
}

TEST(RequirementTypes, ABareWordIsOneThatTheProjectKnows) {
  const auto told = [](bool all, const std::string& text) {
    const auto file = parse_requirements("R: never request(navigation.goTo).name = " + text + ".", "r.req");
    Vocabulary v = vocabulary();
    DataMembers& arguments = v.services["navigation"]["goTo"].arguments.members;
    DataMember name = *arguments.begin();
    name.type.samples = {"kitchen", "station"};
    name.type.samples_are_all = all;
    arguments = {name};
    Diagnostics diagnostics;
    (void)check_requirement(file.value->requirements.at(0), &v, diagnostics);
    return diagnostics.empty() ? std::string() : to_string(diagnostics[0]);
  };
  EXPECT_EQ(told(true, "kitchen"), "");
  EXPECT_THAT(told(true, "kitchn"),
              testing::AllOf(HasSubstr("\"kitchn\" is no name in the mission, its world or its models"),
                             HasSubstr("did you mean \"kitchen\"?")));
  EXPECT_THAT(told(true, "kitchn"), testing::Not(HasSubstr("warning")));
  EXPECT_THAT(told(true, "garage"), HasSubstr("warning"));
  EXPECT_THAT(told(false, "kitchn"), HasSubstr("warning"));
  EXPECT_EQ(told(false, "garage"), "");
  EXPECT_EQ(told(true, "\"garage\""), "");
}

TEST(RequirementTypes, DataOfAnyObservationAreKnown) {
  EXPECT_THAT(found("R: never observation(Look.tick.reply).status = FAILUR."),
              ElementsAre(HasSubstr("\"FAILUR\" is no status; did you mean \"FAILURE\"?")));
  EXPECT_THAT(found("R: never observation(Look.tick.reply).stats = FAILURE."), ElementsAre(HasSubstr("no member")));
  EXPECT_THAT(found("R: never observation(mission.status).status = FAILURE."), IsEmpty());
}

}  // namespace
}  // namespace sentree::monitor
