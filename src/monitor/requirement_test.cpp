#include "sentree/monitor/requirement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sentree::monitor {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

constexpr const char* kDefinitions =
    "let level [%] = reply(battery.getBatteryState).percentage * 100\n"
    "let dest = request(nav.goto).name\n"
    "let at(place) = reply(nav.near where args.name = place)\n"
    "let ok = reply(nav.ok)\n"
    "event halt = request(base.halt)\n"
    "event low = reply(battery.getBatteryState where result.percentage < 0.2)\n";

RequirementFile parse(const std::string& text) {
  auto loaded = parse_requirements(text, "r.req");
  for (const Diagnostic& diagnostic : loaded.diagnostics) ADD_FAILURE() << to_string(diagnostic);
  return loaded.value.value_or(RequirementFile());
}

std::string normal(const std::string& requirement) {
  const RequirementFile file = parse(kDefinitions + ("R: " + requirement));
  return file.requirements.empty() ? "" : file.requirements[0].text();
}

std::vector<std::string> messages(const std::string& text) {
  std::vector<std::string> all;
  for (const Diagnostic& diagnostic : parse_requirements(text, "r.req").diagnostics)
    all.push_back(to_string(diagnostic));
  return all;
}

std::vector<std::string> messages_of(const std::string& requirement) {
  return messages(kDefinitions + ("R: " + requirement));
}

TEST(Requirement, EveryPatternIsReadAndWrittenAlike) {
  for (const std::string text : {
           "globally, always level >= 20 %",
           "globally, never (ok and level < 5)",
           "globally, eventually at(station)",
           "globally, eventually at(station) within 5 min assuming not ok",
           "globally, whenever level < 30 and dest = goal, dest = station or at(station) within 10 ticks",
           "globally, whenever event(halt), ok immediately",
           "globally, whenever event(halt), ok eventually",
           "globally, whenever event(halt), keep ok for 1.5 ms",
           "globally, whenever ok, keep level > 3 until level = 100",
           "globally, whenever event(low), not event(low) for 3 events",
           "globally, ok precedes event(halt)",
           "globally, ok precedes event(halt) by at most 2 s",
           "globally, level updated at least every 2 s",
           "globally, node(GotoGoal) in FAILURE at most 3 times per 60 ticks",
           "globally, ok holds for at least 100 ms",
           "before event(halt), always ok",
           "after event(halt), always ok",
           "between event(halt) and (ok or level > 3), always ok",
           "after event(halt) until rises(ok), never event(low)",
           "while level < 10, event(halt) at most 2 times",
       }) {
    // What is written differs from what is read in superfluous parentheses only.
    std::string expected = text;
    if (text == "globally, never (ok and level < 5)") expected = "globally, never ok and level < 5";
    if (text.starts_with("between")) expected = "between event(halt) and ok or level > 3, always ok";
    EXPECT_EQ(normal(text + "."), expected);
  }
}

TEST(Requirement, HasANameASeverityAndASentence) {
  const RequirementFile file =
      parse("let a = reply(s.m)\nR1 (critical, re-arming) \"Never do that.\": never a = 3.\nlong_name: always a = 1.");
  ASSERT_EQ(file.requirements.size(), 2U);
  EXPECT_EQ(file.requirements[0].importance, Importance::kCritical);
  EXPECT_TRUE(file.requirements[0].re_arming);
  EXPECT_EQ(file.requirements[0].prose, "Never do that.");
  EXPECT_EQ(file.requirements[0].span, (SourceSpan{"r.req", 2, 1, 2}));
  EXPECT_EQ(file.requirements[1].name, "long_name");
  EXPECT_EQ(file.requirements[1].importance, Importance::kMajor);
}

TEST(Requirement, ThenAndWhoShallAreForTheReader) {
  EXPECT_EQ(normal("whenever ok then robot shall at(goal) within 1 s."), "globally, whenever ok, at(goal) within 1 s");
}

TEST(Requirement, BoundsAreTimeTicksOrEvents) {
  const auto bound = [](const std::string& text) {
    return *parse(kDefinitions + ("R: whenever ok, at(a) within " + text + ".")).requirements[0].bound;
  };
  EXPECT_EQ(bound("500 ms").time, milliseconds(500));
  EXPECT_EQ(bound("2 min").time, seconds(120));
  EXPECT_EQ(bound("0.5 s").time, milliseconds(500));
  EXPECT_EQ(bound("1 tick").unit, Bound::Unit::kTicks);
  EXPECT_EQ(bound("3 events").count, 3);
  EXPECT_THAT(messages_of("ok holds for at least 0 s."),
              ElementsAre(HasSubstr("a bound in time is from 1 ns to 10 years")));
  EXPECT_THAT(messages_of("ok holds for at least 4000 h."), testing::IsEmpty());
  EXPECT_THAT(messages_of("ok holds for at least 99999999 h."), ElementsAre(HasSubstr("from 1 ns to 10 years")));
  EXPECT_THAT(messages_of("ok holds for at least 1.5 ticks."), ElementsAre(HasSubstr("a whole number from 1")));
  EXPECT_THAT(messages_of("ok holds for at least 5 sec."),
              ElementsAre(HasSubstr("expected a unit of the bound (ms, s, min, h, ticks, events), got \"sec\"")));
}

TEST(Requirement, NamesTheObservationsItListensTo) {
  const RequirementFile file =
      parse(kDefinitions + std::string("R: whenever level < 3 and event(halt), at(a) within 3 ticks."));
  std::vector<std::string> names;
  for (const Source& source : sources_of(file.requirements[0])) names.push_back(source.text());
  EXPECT_THAT(names, ElementsAre("reply(battery.getBatteryState)", "request(base.halt)",
                                 "reply(nav.near where args.name = a)", "observation(mission.tick)"));
}

TEST(Requirement, ErrorsNameThePlaceAndTheWayOut) {
  EXPECT_THAT(messages_of("alwyas ok."), ElementsAre(AllOf(StartsWith("r.req:7:4: a requirement begins with always"),
                                                           HasSubstr("did you mean \"always\"?"))));
  EXPECT_THAT(messages_of("always levl >= 20."),
              ElementsAre("r.req:7:11: \"levl\" is not defined; did you mean \"level\"?"));
  EXPECT_THAT(messages_of("never event(hallt)."),
              ElementsAre("r.req:7:16: event \"hallt\" is not defined; did you mean \"halt\"?"));
  EXPECT_THAT(messages_of("always dest = dezt."),
              ElementsAre("r.req:7:18: \"dezt\" is not defined; did you mean \"dest\"? (a text that looks like it goes "
                          "in quotes)"));
  EXPECT_THAT(messages_of("always dest = \"dezt\"."), testing::IsEmpty());
  EXPECT_THAT(messages_of("always level < 1500 mm/s."),
              ElementsAre(AllOf(HasSubstr("\"mm/s\" is no unit here"), HasSubstr("m/s and rad/s"))));
  EXPECT_THAT(messages_of("whenever ok, at(a) wihtin 3 s."),
              ElementsAre("r.req:7:23: expected within, immediately or eventually after the response, got \"wihtin\"; "
                          "did you mean \"within\"?"));
  EXPECT_THAT(messages_of("always (ok."),
              ElementsAre("r.req:7:14: expected \")\" to close the parenthesis, got \".\""));
  EXPECT_THAT(messages_of("always ok"),
              ElementsAre("r.req:7:13: expected \".\" at the end of requirement R, got the end of the file"));
  EXPECT_THAT(messages_of("always at(a, b)."), ElementsAre(HasSubstr("\"at\" takes 1 argument, got 2")));
  EXPECT_THAT(messages("let a = reply(battery)\n"),
              ElementsAre("r.req:1:15: reply(…) takes SERVICE.METHOD, e.g. reply(battery.getBatteryState), got "
                          "\"battery\""));
  EXPECT_THAT(messages("let a = b\nlet b = a\nR: always a = 1.\n").front(), HasSubstr("is defined by itself"));
  EXPECT_THAT(messages("R (urgent): always true."),
              ElementsAre(HasSubstr("expected info, minor, major, critical or re-arming, got \"urgent\"")));
  EXPECT_THAT(messages("let never = 3\n"), ElementsAre(HasSubstr("is a word of the language")));
  EXPECT_THAT(messages("let a [volt] = 3\n"),
              ElementsAre(HasSubstr("r.req:1:8: \"volt\" is no unit that is known; there are ratio, %, m,")));
  EXPECT_THAT(messages("let load [kg] = reply(a.b).load\n"), ElementsAre());
  EXPECT_THAT(messages("let a = \"x\n"), ElementsAre(HasSubstr("closing \" is missing")));
  EXPECT_THAT(messages_of("always halt."),
              ElementsAre(HasSubstr("\"halt\" is not defined, but an event of that name is: write event(halt)")));
  EXPECT_THAT(messages_of("if ok then robot shall at(a) within 3 s."),
              ElementsAre(AllOf(StartsWith("r.req:7:4: "), HasSubstr("; write \"whenever\""))));
  EXPECT_THAT(messages_of("whenever ok, robot must at(a) within 3 s."),
              ElementsAre("r.req:7:23: expected \"shall\", got \"must\"; write \"shall\""));
  EXPECT_THAT(messages_of("level is at most 20."), ElementsAre(HasSubstr("; write \"<=\"")));
  EXPECT_THAT(messages_of("always level the 20."),
              ElementsAre(testing::EndsWith("expected \".\" at the end of requirement R, got \"the\"")));
  EXPECT_THAT(messages_of("always level == 20."), ElementsAre("r.req:7:17: \"==\" has no meaning here; write \"=\""));
  EXPECT_THAT(messages_of("always ok && ok || !ok."),
              ElementsAre(HasSubstr("write \"and\""), HasSubstr("write \"or\""), HasSubstr("write \"not\"")));
  EXPECT_THAT(messages("let a = 3 ~ 4\n"), testing::Contains(HasSubstr("character \"~\" has no meaning here")));
}

TEST(Requirement, ParametersThatTheirDefinitionDoesNotUseAreTold) {
  EXPECT_THAT(
      messages("event says(what) = request(door.say where args.word = waht)\nR: never event(says(ajar)).\n"),
      ElementsAre("r.req:1:55: the definition of event \"says\" does not use its parameter \"what\"; did you mean "
                  "it by \"waht\"?"));
  EXPECT_THAT(messages("let at(place) = reply(robot.isAt where args.name = pplace)\nR: never at(kitchen).\n"),
              ElementsAre(HasSubstr("does not use its parameter \"place\"; did you mean it by \"pplace\"?")));
  EXPECT_THAT(messages("let at(a, b) = reply(robot.isAt where args.name = a)\n"),
              ElementsAre("r.req:1:5: the definition of \"at\" does not use its parameter \"b\""));
  EXPECT_THAT(messages("let place = reply(robot.place)\nlet is(x, y) = place = x and x = y\n"), testing::IsEmpty());
  EXPECT_THAT(messages("let place = reply(robot.place)\nlet is(plac) = place = kitchen\n"),
              ElementsAre(testing::EndsWith("does not use its parameter \"plac\"")))
      << "a definition is no slip";
}

TEST(Requirement, ReportsOneProblemForEachStatement) {
  EXPECT_THAT(messages("let a = )\nlet b = reply(s.m)\nR1: always.\nR2: alwys b.\nR2: never b.\nR2: never b.\n"),
              ElementsAre(StartsWith("r.req:1:9:"), StartsWith("r.req:3:11:"), StartsWith("r.req:4:5:"),
                          StartsWith("r.req:6:1: requirement \"R2\" exists already, in line 5")));
}

TEST(Requirement, AnEventCannotBeAskedToLast) {
  EXPECT_THAT(messages_of("always event(halt)."), ElementsAre(HasSubstr("cannot hold always")));
  EXPECT_THAT(messages_of("always (event(halt) implies ok)."), testing::IsEmpty());
  EXPECT_THAT(messages_of("event(halt) holds for at least 1 s."), ElementsAre(HasSubstr("cannot hold for a while")));
  EXPECT_THAT(messages_of("while event(halt), always ok."), ElementsAre(HasSubstr("after … until …")));
  EXPECT_THAT(messages_of("always ok assuming event(halt)."), ElementsAre(HasSubstr("assuming takes a condition")));
  EXPECT_THAT(messages_of("always rises(event(halt)) implies ok."), ElementsAre(HasSubstr("rises and falls take")));
}

TEST(Requirement, BoundsOfFilesAreReached) {
  std::string many = "let a = reply(s.m)\n";
  for (std::size_t i = 0; i <= kRequirementsMax; ++i) many += "R" + std::to_string(i) + ": always a.\n";
  EXPECT_EQ(parse_requirements(many).diagnostics.front().code, "requirement.too-large");
  EXPECT_EQ(to_string(parse_requirements("// a\n// b\xff", "r.req").diagnostics.front()),
            "r.req:2:5: not UTF-8; convert the file, for example with iconv -f ISO-8859-1 -t UTF-8");
  EXPECT_EQ(parse_requirements(std::string(kRequirementBytesMax + 1, ' ')).diagnostics.front().code,
            "requirement.too-large");
  const std::string deep(static_cast<std::size_t>(kConditionNestingMax) + 1, '(');
  EXPECT_EQ(parse_requirements("R: always " + deep + "true").diagnostics.front().code, "requirement.too-deep");
  std::string chain = "R: always 1";
  for (int i = 0; i < kConditionNestingMax + 2; ++i) chain += " + 1";
  EXPECT_EQ(parse_requirements(chain + " = 3.").diagnostics.front().code, "requirement.too-deep");
  std::string doubling = "let d0 = reply(s.m)\n";
  for (int i = 1; i <= 20; ++i) {
    const std::string below = "d" + std::to_string(i - 1);
    doubling += "let d" + std::to_string(i) + " = " + below + " + " + below + "\n";
  }
  EXPECT_EQ(parse_requirements(doubling + "R: always d20 = 1.").diagnostics.front().code, "requirement.too-large");
  const auto times = [](std::int64_t count, const std::string& window) {
    return messages_of("event(halt) at most " + std::to_string(count) + " times per " + window + ".");
  };
  EXPECT_THAT(times(kCountedTimesMax, "5 ticks"), testing::IsEmpty());
  EXPECT_THAT(times(kCountedTimesMax + 1, "5 ticks"), ElementsAre(HasSubstr("at most 32 times")));
  EXPECT_THAT(times(kTimesMax, "5 s"), testing::IsEmpty());
  EXPECT_THAT(times(kTimesMax + 1, "5 s"), ElementsAre(HasSubstr("a whole number up to 1000")));
  const auto within = [](std::int64_t count, const std::string& unit) {
    return messages_of("whenever ok, at(a) within " + std::to_string(count) + " " + unit + ".");
  };
  EXPECT_THAT(within(kCountMax, "ticks"), testing::IsEmpty());
  EXPECT_THAT(within(kCountMax + 1, "ticks"), ElementsAre(HasSubstr("a whole number from 1 to 1000000000")));
  const std::int64_t hours = std::chrono::duration_cast<std::chrono::hours>(kBoundMax).count();
  EXPECT_THAT(within(hours, "h"), testing::IsEmpty());
  EXPECT_THAT(within(hours + 1, "h"), ElementsAre(HasSubstr("from 1 ns to 10 years")));
}

}  // namespace
}  // namespace sentree::monitor
