#include "sentree/monitor/synthesis.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "sentree/monitor/monitor.h"
#include "sentree/scxml/check.h"
#include "sentree/text/file.h"

namespace sentree::monitor {
namespace {

using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr const char* kRobotDefinitions =
    "let level = reply(battery.level)\n"
    "let ok = reply(s.ok)\n"
    "event ask = request(s.ask)\n"
    "event answer = reply(s.ask)\n"
    "event open = reply(s.open)\n"
    "event shut = reply(s.shut)\n";

Requirement requirement(const std::string& text) {
  auto file = parse_requirements(kRobotDefinitions + ("R: " + text), "r.req");
  for (const Diagnostic& diagnostic : file.diagnostics) ADD_FAILURE() << to_string(diagnostic);
  return file.ok() ? file.value->requirements.at(0) : Requirement();
}

// Plays observations to a requirement's monitor.
class Player {
 public:
  explicit Player(const std::string& text) : model_(*Model::make(requirement(text)).value), state_(start(model_, {})) {}

  Player& see(TimePoint at, const std::string& name, Value result = {}) {
    Message m;
    m.name = name;
    m.time = at;
    m.sequence = ++sequence_;
    m.data = Map{{"args", Map()}, {"result", std::move(result)}};
    for (const Decision& decision : observe(model_, state_, m)) decisions_.push_back(decision);
    return *this;
  }
  Player& tick(int times = 1) {
    for (int i = 0; i < times; ++i) see(TimePoint(milliseconds(100 * ++ticks_)), "mission.tick");
    return *this;
  }
  Player& silence(TimePoint until) {
    for (const Decision& decision : advance(model_, state_, until)) decisions_.push_back(decision);
    return *this;
  }
  [[nodiscard]] std::vector<TimePoint> violations() const {
    std::vector<TimePoint> times;
    for (const Decision& d : decisions_) {
      if (d.verdict == Verdict::kViolated) times.push_back(d.at);
    }
    return times;
  }
  [[nodiscard]] bool satisfied() const {
    return !decisions_.empty() && decisions_.back().verdict == Verdict::kSatisfied;
  }
  [[nodiscard]] Standing standing() const { return monitor::standing(model_, state_); }
  [[nodiscard]] std::string vacuity() const { return monitor::vacuity(model_, state_); }
  [[nodiscard]] const Decisions& decisions() const { return decisions_; }

 private:
  Model model_;
  State state_;
  Decisions decisions_;
  std::uint64_t sequence_ = 0;
  int ticks_ = 0;
};

std::string encoded(const Model& model, const Core& core, TimePoint now) {
  std::string bytes;
  EXPECT_TRUE(encode(model, core, now, bytes));
  return bytes;
}

constexpr TimePoint at(int ms) { return TimePoint(milliseconds(ms)); }
constexpr Duration kNs{1};

// ---- Deadlines, to the nanosecond ----

TEST(Synthesis, ATickThatOnlyCountsTriggersNothing) {
  // The level is low when it is read, once; what it asks for is answered, once. Ticks go on.
  for (const char* bound : {"2 ticks", "200 ms"}) {
    SCOPED_TRACE(bound);
    Player p("whenever level < 30, event(answer) within " + std::string(bound) + ".");
    p.see(at(10), "battery.level.reply", 20).see(at(50), "s.ask.reply").tick(20);
    EXPECT_THAT(p.violations(), IsEmpty());
    EXPECT_FALSE(p.standing().pending);
  }
  // Read again, and not answered.
  Player p("whenever level < 30, event(answer) within 2 ticks.");
  p.see(at(10), "battery.level.reply", 20).see(at(50), "s.ask.reply").tick(1).see(at(110), "battery.level.reply", 20);
  EXPECT_THAT(p.tick(2).violations(), IsEmpty());
  EXPECT_THAT(p.tick(1).violations(), testing::ElementsAre(at(400)));
}

TEST(Synthesis, AWindowOfTicksIsNotProlongedByTicks) {
  Player p("whenever level < 30, keep ok for 2 ticks.");
  p.see(at(1), "s.ok.reply", true).see(at(10), "battery.level.reply", 20).tick(3);
  EXPECT_FALSE(p.standing().pending);
}

TEST(Core, DecidesAsTheWholeMonitorDoesAndLeavesNoTrail) {
  const Model m = *Model::make(requirement("whenever level < 30, event(answer) within 200 ms.")).value;
  Core core = begin(m, at(0));
  Message low;
  low.name = "battery.level.reply";
  low.time = at(100);
  low.data = Map{{"result", 20}};
  EXPECT_EQ(step(m, core, low).verdict, Verdict::kUndecided);
  EXPECT_EQ(next_timer(m, core), at(300));
  Core copy = core;
  Message answer = low;
  answer.name = "s.ask.reply";
  answer.time = at(200);
  EXPECT_EQ(step(m, copy, answer).verdict, Verdict::kUndecided);
  EXPECT_EQ(next_timer(m, copy), kNever);
  EXPECT_EQ(step_timers(m, core, at(299)).verdict, Verdict::kUndecided);
  EXPECT_EQ(step_timers(m, core, at(300)).verdict, Verdict::kViolated);
  EXPECT_EQ(core.verdict, Verdict::kViolated);
  EXPECT_EQ(step(m, core, answer).verdict, Verdict::kUndecided) << "it is over";
}

TEST(Core, EncodesAlikeWhateverLedThere) {
  const Model m = *Model::make(requirement("whenever rises(level < 30), event(answer) within 200 ms.")).value;
  Message message;
  const auto see = [&](Core& core, int ms, const char* name, int level) {
    message.name = name;
    message.time = at(ms);
    message.data = Map{{"result", level}};
    step_timers(m, core, at(ms - 1));
    EXPECT_EQ(step(m, core, message).verdict, Verdict::kUndecided);
  };
  Core a = begin(m, at(0));
  see(a, 100, "battery.level.reply", 90);
  see(a, 200, "battery.level.reply", 20);
  Core b = begin(m, at(0));
  see(b, 1000, "battery.level.reply", 90);
  see(b, 1100, "battery.level.reply", 20);
  see(b, 1150, "s.ask.reply", 0);
  see(b, 1200, "battery.level.reply", 90);
  see(b, 1300, "battery.level.reply", 20);
  EXPECT_EQ(encoded(m, a, at(250)), encoded(m, b, at(1350)));
  EXPECT_NE(encoded(m, a, at(250)), encoded(m, b, at(1351)));
  see(a, 260, "s.ask.reply", 0);
  EXPECT_NE(encoded(m, a, at(300)), encoded(m, b, at(1350)));
}

TEST(Deadline, AResponseExactlyAtItIsInTime) {
  const std::string text = "whenever event(ask), event(answer) within 500 ms.";
  EXPECT_THAT(Player(text).see(at(10), "s.ask.request").see(at(510), "s.ask.reply").silence(at(9000)).violations(),
              IsEmpty());
  EXPECT_THAT(Player(text).see(at(10), "s.ask.request").see(at(510) + kNs, "s.ask.reply").violations(),
              ElementsAre(at(510)));
}

TEST(Deadline, SilenceIsNoticedAtTheDeadline) {
  Player late("whenever event(ask), event(answer) within 500 ms.");
  EXPECT_THAT(late.see(at(10), "s.ask.request").silence(at(510) - kNs).violations(), IsEmpty());
  EXPECT_THAT(late.silence(at(510)).violations(), ElementsAre(at(510)));
  EXPECT_FALSE(late.decisions().front().deciding);
  EXPECT_EQ(late.decisions().front().since, at(10));
}

TEST(Deadline, TenTicksAreOverAtTheEleventh) {
  const std::string text = "whenever event(ask), event(answer) within 10 ticks.";
  Player tenth(text);
  tenth.tick(3).see(at(305), "s.ask.request").tick(10).see(at(1305), "s.ask.reply").tick(5);
  EXPECT_THAT(tenth.violations(), IsEmpty());
  Player eleventh(text);
  eleventh.tick(3).see(at(305), "s.ask.request").tick(10);
  EXPECT_THAT(eleventh.violations(), IsEmpty());
  EXPECT_THAT(eleventh.tick().violations(), ElementsAre(at(1400)));
  EXPECT_EQ(eleventh.decisions().front().deciding->name, "mission.tick");
}

TEST(Deadline, ThreeEventsAreOverWithTheThird) {
  const std::string text = "whenever event(ask), ok within 3 events.";
  Player late(text);
  late.see(at(1), "s.ask.request").see(at(2), "s.ask.request").see(at(3), "s.ok.reply", false);
  EXPECT_THAT(late.violations(), IsEmpty());
  Player in_time = late;
  EXPECT_THAT(in_time.see(at(4), "s.ok.reply", true).violations(), IsEmpty());
  EXPECT_THAT(late.see(at(4), "s.ok.reply", false).violations(), ElementsAre(at(4)));
}

TEST(Deadline, TheOldestTriggerCounts) {
  Player p("whenever event(ask), event(answer) within 500 ms.");
  p.see(at(0), "s.ask.request").see(at(400), "s.ask.request").silence(at(600));
  EXPECT_THAT(p.violations(), ElementsAre(at(500)));
}

TEST(Deadline, WhatIsKeptIsKeptThroughTheEnd) {
  const std::string text = "whenever event(ask), keep ok for 500 ms.";
  EXPECT_THAT(Player(text).see(at(0), "s.ask.request").see(at(500), "s.ok.reply", false).violations(),
              ElementsAre(at(500)));
  EXPECT_THAT(Player(text).see(at(0), "s.ask.request").see(at(500) + kNs, "s.ok.reply", false).violations(), IsEmpty());
}

TEST(Deadline, WhatIsForbiddenBeginsAfterTheTrigger) {
  const std::string text = "whenever event(ask), not event(ask) for 500 ms.";
  EXPECT_THAT(Player(text).see(at(0), "s.ask.request").violations(), IsEmpty());
  EXPECT_THAT(Player(text).see(at(0), "s.ask.request").see(at(500), "s.ask.request").violations(),
              ElementsAre(at(500)));
  EXPECT_THAT(Player(text).see(at(0), "s.ask.request").see(at(500) + kNs, "s.ask.request").violations(), IsEmpty());
}

TEST(Deadline, OfRecurrenceWindowAndPrecedenceAreClosed) {
  EXPECT_THAT(Player("event(ask) at least every 500 ms.").see(at(500), "s.ask.request").silence(at(999)).violations(),
              IsEmpty());
  EXPECT_THAT(Player("event(ask) at least every 500 ms.").see(at(500) + kNs, "s.ask.request").violations(),
              ElementsAre(at(500)));
  EXPECT_THAT(Player("event(ask) at most 1 times per 500 ms.")
                  .see(at(0), "s.ask.request")
                  .see(at(500), "s.ask.request")
                  .violations(),
              ElementsAre(at(500)));
  EXPECT_THAT(Player("event(ask) at most 1 times per 500 ms.")
                  .see(at(0), "s.ask.request")
                  .see(at(500) + kNs, "s.ask.request")
                  .violations(),
              IsEmpty());
  const std::string precedes = "event(ask) precedes event(answer) by at most 500 ms.";
  EXPECT_THAT(Player(precedes).see(at(0), "s.ask.request").see(at(500), "s.ask.reply").violations(), IsEmpty());
  EXPECT_THAT(Player(precedes).see(at(0), "s.ask.request").see(at(500) + kNs, "s.ask.reply").violations(),
              ElementsAre(at(500) + kNs));
}

// ---- Where something begins and ends to count ----

TEST(Scopes, AtLeastEveryAsksOnlyWhileTheyLast) {
  Player p("while ok, event(ask) at least every 500 ms.");
  p.see(at(0), "s.ok.reply", true).see(at(300), "s.ok.reply", false);
  EXPECT_THAT(p.silence(at(5000)).violations(), IsEmpty());
  EXPECT_THAT(p.see(at(6000), "s.ok.reply", true).silence(at(9000)).violations(), ElementsAre(at(6500)));
}

TEST(Unknown, IsNothingThatHoldsForAtLeastBeginsWith) {
  Player p("ok holds for at least 500 ms.");
  EXPECT_THAT(p.see(at(0), "s.ok.reply", true).see(at(100), "s.ok.reply", false).violations(), IsEmpty());
  EXPECT_THAT(p.see(at(200), "s.ok.reply", true).see(at(300), "s.ok.reply", false).violations(), ElementsAre(at(300)));
}

TEST(AtMost, DoesNotCountWhatHoldsAlreadyWhenTheScopeOpens) {
  Player p("after event(open), ok at most 0 times.");
  p.see(at(0), "s.ok.reply", true).see(at(10), "s.open.reply").see(at(20), "s.ok.reply", true);
  EXPECT_THAT(p.violations(), IsEmpty());
  EXPECT_THAT(p.see(at(30), "s.ok.reply", false).see(at(40), "s.ok.reply", true).violations(), ElementsAre(at(40)));
  EXPECT_THAT(Player("ok at most 0 times.").see(at(0), "s.ok.reply", true).violations(), ElementsAre(at(0)));
}

TEST(AtMost, CountsWithinAWindowThroughAnInterruption) {
  const auto played = [](const std::string& text) {
    Player p(text);
    p.see(at(0), "s.ok.reply", true).see(at(10), "s.ask.request").see(at(20), "s.ok.reply", false);
    return p.see(at(30), "s.ok.reply", true).see(at(40), "s.ask.request").violations();
  };
  EXPECT_THAT(played("event(ask) at most 1 times per 500 ms assuming ok."), ElementsAre(at(40)));
  EXPECT_THAT(played("event(ask) at most 1 times assuming ok."), IsEmpty());
}

// ---- Between two events: segments ----

constexpr const char* kSegment = "between event(open) and event(shut), ";

TEST(Segments, WhatIsOwedFromAClosedOneIsDecidedByItself) {
  Player p(std::string(kSegment) + "whenever event(ask), event(answer) within 500 ms.");
  p.see(at(0), "s.open.reply").see(at(10), "s.ask.request").see(at(20), "s.shut.reply");
  p.see(at(400), "s.open.reply").see(at(450), "s.ask.request");
  EXPECT_THAT(p.silence(at(509)).violations(), IsEmpty());
  EXPECT_THAT(p.silence(at(510)).violations(), ElementsAre(at(510)));
}

TEST(Segments, WhatIsOwedFromTheOpenOneWaitsForItsEnd) {
  for (const char* response : {"event(answer) within 500 ms", "keep ok for 500 ms", "not event(ask) for 500 ms"}) {
    SCOPED_TRACE(response);
    Player p(kSegment + ("whenever event(ask), " + std::string(response) + "."));
    p.see(at(0), "s.open.reply").see(at(10), "s.ask.request");
    p.see(at(300), "s.ok.reply", false).see(at(310), "s.ask.request");
    EXPECT_THAT(p.silence(at(5000)).violations(), IsEmpty());
    EXPECT_EQ(p.standing().text(), "pending: is broken, if its scope ends");
    EXPECT_THAT(p.see(at(6000), "s.shut.reply").violations(), ElementsAre(at(6000)));
  }
}

// From the closed one until 510, from the open one until 900: ok is lost where only the latter speaks of it.
TEST(Segments, KeepTheirWindowsApart) {
  const std::string text = kSegment + std::string("whenever event(ask), keep ok for 500 ms.");
  const auto played = [&](TimePoint lost) {
    Player p(text);
    p.see(at(0), "s.open.reply").see(at(10), "s.ask.request").see(at(20), "s.shut.reply");
    p.see(at(300), "s.open.reply").see(at(350), "s.ask.request").see(at(400), "s.ask.request");
    return p.see(lost, "s.ok.reply", false);
  };
  EXPECT_THAT(played(at(510)).violations(), ElementsAre(at(510)));
  EXPECT_THAT(played(at(510) + kNs).silence(at(5000)).violations(), IsEmpty());
  EXPECT_THAT(played(at(900)).see(at(6000), "s.shut.reply").violations(), ElementsAre(at(6000)));
  EXPECT_THAT(played(at(900) + kNs).see(at(6000), "s.shut.reply").violations(), IsEmpty());
  // Closed in between, it is the latter that is still owed.
  Player p(text);
  p.see(at(0), "s.open.reply").see(at(10), "s.ask.request").see(at(20), "s.shut.reply");
  p.see(at(300), "s.open.reply").see(at(400), "s.ask.request").see(at(450), "s.shut.reply");
  EXPECT_THAT(p.see(at(900), "s.ok.reply", false).violations(), ElementsAre(at(900)));
}

TEST(Segments, LeaveNothingBehindThatGrows) {
  for (const char* bound : {"500 ms", "3 ticks", "3 events"}) {
    SCOPED_TRACE(bound);
    const Model m =
        *Model::make(requirement(kSegment + ("whenever event(ask), keep ok for " + std::string(bound) + "."))).value;
    Core core = begin(m, at(0));
    std::set<std::string> forms;
    for (int round = 0; round < 50; ++round) {
      Message message;
      for (const auto& [ms, name] : {std::pair{0, "s.open.reply"},
                                     {50, "s.ask.request"},
                                     {100, "mission.tick"},
                                     {150, "s.ask.request"},
                                     {160, "s.shut.reply"}}) {
        message.name = name;
        message.time = at(round * 300 + ms);
        step_timers(m, core, message.time - kNs);
        EXPECT_EQ(step(m, core, message).verdict, Verdict::kUndecided);
        forms.insert(encoded(m, core, message.time));
      }
    }
    EXPECT_LE(forms.size(), 20U);
  }
}

TEST(Counting, HoldsNoPlaceInTheRun) {
  for (const char* bound : {"2 ticks", "2 events"}) {
    SCOPED_TRACE(bound);
    const Model m = *Model::make(requirement("event(ask) at most 3 times per " + std::string(bound) + ".")).value;
    Core core = begin(m, at(0));
    std::set<std::string> forms;
    for (int i = 0; i < 200; ++i) {
      Message message;
      message.name = i % 4 == 0 ? "s.ask.request" : "mission.tick";
      message.time = at(i * 100);
      EXPECT_EQ(step(m, core, message).verdict, Verdict::kUndecided);
      forms.insert(encoded(m, core, message.time));
    }
    EXPECT_LE(forms.size(), 20U);
  }
}

// ---- Values that have not been seen ----

TEST(Unknown, DecidesNothing) {
  EXPECT_THAT(Player("always level >= 20.").see(at(1), "battery.level.reply").violations(), IsEmpty());
  EXPECT_THAT(Player("always level >= 20.").see(at(1), "battery.level.reply", 19).violations(), ElementsAre(at(1)));
  EXPECT_THAT(Player("always not ok.").see(at(1), "battery.level.reply", 1).violations(), IsEmpty());
  EXPECT_THAT(Player("whenever level < 30, ok immediately.").see(at(1), "battery.level.reply", 1).violations(),
              IsEmpty());
  EXPECT_THAT(Player("whenever rises(level < 30), ok within 1 s.")
                  .see(at(1), "battery.level.reply", 1)
                  .silence(at(9000))
                  .violations(),
              IsEmpty());
  EXPECT_THAT(Player("whenever rises(level < 30), ok within 1 s.")
                  .see(at(1), "battery.level.reply", 31)
                  .see(at(2), "battery.level.reply", 1)
                  .silence(at(9000))
                  .violations(),
              ElementsAre(at(1002)));
}

TEST(Unknown, IsWhatAnObservationHasNoHolderOf) {
  for (const char* text :
       {"never event(reply(s.info where result.inner.n = 3)).", "never event(reply(s.info where result.inner.n > 2)).",
        "never event(reply(s.info where result.inner.is_on)).",
        "never event(reply(s.info where not result.inner.n != 3)).",
        "never event(reply(s.info where result.inner.n + 1 = 4))."}) {
    SCOPED_TRACE(text);
    Player p(text);
    p.see(at(1), "s.info.reply", Map{{"k", 1}}).see(at(2), "s.info.reply", Map{{"inner", Map{}}});
    EXPECT_THAT(p.violations(), IsEmpty());
    p.see(at(3), "s.info.reply", Map{{"inner", Map{{"n", 3}, {"is_on", true}}}});
    EXPECT_THAT(p.violations(), testing::ElementsAre(at(3)));
  }
}

TEST(Unknown, AreNotEqualToEachOther) {
  const auto two = [](const std::string& condition) {
    auto file = parse_requirements("let x = reply(s.a)\nlet y = reply(s.b)\nR: never " + condition + ".");
    const Model model = *Model::make(file.value->requirements.at(0)).value;
    State state = start(model, {});
    std::vector<std::size_t> violations;
    std::size_t number = 0;
    for (const auto& [name, value] : std::vector<std::pair<std::string, Value>>{
             {"s.a.reply", Value()}, {"s.b.reply", Value()}, {"s.a.reply", 7}, {"s.b.reply", 7}}) {
      Message m;
      m.time = at(static_cast<int>(++number));
      m.name = name;
      m.data = value.is_null() ? Map{} : Map{{"result", value}};
      for (const Decision& decision : observe(model, state, m)) {
        if (decision.verdict == Verdict::kViolated) violations.push_back(number);
      }
    }
    return violations;
  };
  EXPECT_THAT(two("x = y"), ElementsAre(4));
  EXPECT_THAT(two("x - y = 0"), ElementsAre(4));
  EXPECT_THAT(two("(x = y or x = 8)"), ElementsAre(4));
}

// ---- Verdicts ----

TEST(Verdicts, AreIrrevocableUnlessReArming) {
  Player once("always level >= 20.");
  once.see(at(1), "battery.level.reply", 1).see(at(2), "battery.level.reply", 50).see(at(3), "battery.level.reply", 1);
  EXPECT_THAT(once.violations(), ElementsAre(at(1)));
  auto file = parse_requirements(std::string(kRobotDefinitions) + "R (re-arming): always level >= 20.");
  const Model model = *Model::make(file.value->requirements[0]).value;
  State state = start(model, {});
  std::vector<std::uint64_t> numbers;
  for (const int level : {1, 2, 50, 3}) {
    Message m;
    m.name = "battery.level.reply";
    m.data = Map{{"result", level}};
    for (const Decision& decision : observe(model, state, m)) numbers.push_back(decision.number);
  }
  EXPECT_THAT(numbers, ElementsAre(1, 2));
}

TEST(Verdicts, OfOpenMonitorsHaveAReason) {
  Player p("whenever event(ask), event(answer) within 500 ms.");
  EXPECT_EQ(p.standing().text(), "holds so far: waits for event(ask)");
  EXPECT_EQ(p.see(at(10), "s.ask.request").standing().text(),
            "pending: owes event(answer) since 0.010 s, until 0.510 s");
  Player ticks("whenever event(ask), event(answer) within 10 ticks.");
  EXPECT_EQ(ticks.see(at(10), "s.ask.request").tick(3).standing().text(),
            "pending: owes event(answer) since 0.010 s, 3 of 10 ticks");
}

TEST(Verdicts, SatisfiedIsForGood) {
  EXPECT_TRUE(Player("eventually ok within 1 s.").see(at(1000), "s.ok.reply", true).satisfied());
  EXPECT_TRUE(Player("ok precedes event(ask).").see(at(1), "s.ok.reply", true).satisfied());
  EXPECT_TRUE(Player("before event(ask), always level > 3.").see(at(1), "s.ask.request").satisfied());
}

// ---- Charts ----

std::string chart_of(const std::string& text) { return Model::make(requirement(text)).value->chart().source(); }

TEST(Chart, ReadsLikeTheRequirement) {
  const std::string chart = chart_of("whenever level < 30, ok within 500 ms.");
  EXPECT_THAT(chart, HasSubstr("Requirement R (major), r.req:7\n  globally, whenever level < 30, ok within 500 ms\n"));
  EXPECT_THAT(chart, HasSubstr("<data id=\"level\"/> <!-- reply(battery.level) -->"));
  EXPECT_THAT(chart, HasSubstr("<state id=\"waits_for_level_below_30\">\n      <transition "
                               "event=\"battery.level.reply\" cond=\"typeof _event.data.result === 'number' &amp;&amp; "
                               "_event.data.result &lt; 30 &amp;&amp; ok !== true\" target=\"owes_ok\">"));
  EXPECT_THAT(chart, HasSubstr("<send event=\"deadline\" id=\"deadline\" delay=\"500ms\"/>"));
}

TEST(Chart, IsStandardAndHasNothingToComplainAbout) {
  const auto source =
      text::read_file(std::string(SENTREE_SOURCE_DIR) + "/examples/requirements/requirements/twelve.req");
  const auto file = parse_requirements(*source, "twelve.req");
  for (const Requirement& r : file.value->requirements) {
    const auto model = Model::make(r);
    ASSERT_TRUE(model.ok()) << r.name;
    EXPECT_THAT(model.diagnostics, IsEmpty()) << r.name;
    EXPECT_THAT(scxml::check(model.value->chart()), IsEmpty()) << model.value->chart().source();
    EXPECT_THAT(model.value->chart().source(), Not(HasSubstr("xmlns:")));
    EXPECT_EQ(model.value->chart().source(), Model::make(r).value->chart().source());
  }
}

TEST(Chart, WritesDelaysExactly) {
  EXPECT_THAT(chart_of("event(ask) at least every 2 min."), HasSubstr("delay=\"120s\""));
  EXPECT_THAT(chart_of("event(ask) at least every 1500 ms."), HasSubstr("delay=\"1500ms\""));
  EXPECT_THAT(chart_of("event(ask) at least every 1.5 us."), HasSubstr("delay=\"0.0015ms\""));
}

TEST(Chart, KeepsNamesApart) {
  const std::string chart = chart_of("whenever ok, level > 3 within 1 s.");
  EXPECT_TRUE(scxml::load(chart).ok());
  const auto file = parse_requirements(
      "let watching = reply(a.b)\nlet count = reply(a.c)\nlet delete = reply(a.d)\n"
      "R: always (watching or count or delete).");
  ASSERT_TRUE(file.ok());
  const auto model = Model::make(file.value->requirements[0]);
  ASSERT_TRUE(model.ok());
  EXPECT_THAT(model.value->chart().source(), HasSubstr("<data id=\"watching_2\"/>"));
  EXPECT_THAT(model.value->chart().source(), HasSubstr("<data id=\"count_2\"/>"));
  EXPECT_THAT(model.value->chart().source(), HasSubstr("<data id=\"delete_value\"/>"));
}

TEST(Chart, LooksAtTheObservationItselfAndRemembersWhatOthersNeed) {
  const auto chart = [](const char* text) { return Model::make(requirement(text)).value->chart().source(); };
  for (const char* text :
       {"always level >= 20.", "never level < 20.", "level >= 20 at least every 1 s.",
        "while level < 50, always level >= 20.", "whenever level < 30, level >= 30 within 10 s.",
        "whenever event(ask), event(answer) within 1 s.", "whenever level < 30, event(answer) within 1 s.",
        "event(ask) precedes event(answer) by at most 1 s.", "always level < 90 assuming level > 50.",
        "while ok, event(ask) at least every 1 s."}) {
    EXPECT_THAT(chart(text), AllOf(Not(HasSubstr("observed\"")), Not(HasSubstr("remembered")))) << text;
  }
  // A value of another observation, of before, or whether its scope is open has to be.
  for (const char* text :
       {"whenever event(ask), level >= 20 immediately.", "always level >= 20 or ok.",
        "whenever rises(level < 30), event(answer) within 1 s.", "after event(ask), always level >= 20."}) {
    EXPECT_THAT(chart(text), AllOf(Not(HasSubstr("observed\"")), HasSubstr("remembered"))) << text;
  }
  // Ticks and occurrences are counted where they matter.
  for (const char* text : {"whenever event(ask), event(answer) within 3 ticks.", "event(ask) at most 3 times."})
    EXPECT_THAT(chart(text), Not(HasSubstr("observed\""))) << text;
  // All observations count, or segments and windows are told apart.
  for (const char* text : {"between event(ask) and event(answer), always ok.", "ok at least every 3 events.",
                           "event(ask) at most 3 times per 2 ticks."})
    EXPECT_THAT(chart(text), HasSubstr("<raise event=\"observed\"/>")) << text;
  // What does not concern the scope leaves it alone.
  const std::string scoped = chart("after ok until level > 90, never event(ask).");
  EXPECT_THAT(scoped, HasSubstr("<transition event=\"s.ask.request\" cond=\"in_scope\" target=\"violated\">"));
  // What a message may come without is no text that is compared with a number.
  EXPECT_THAT(chart("always level >= 20."),
              HasSubstr("cond=\"typeof _event.data.result === 'number' &amp;&amp; _event.data.result &lt; 20\""));
}

TEST(Core, OfOneThatRemembersNothingIsTheSameWhateverWasObserved) {
  const Model m = *Model::make(requirement("whenever level < 30, level >= 30 within 1 s.")).value;
  Message message;
  message.name = "battery.level.reply";
  const auto after = [&](std::initializer_list<int> levels) {
    Core core = begin(m, at(0));
    for (const int level : levels) {
      message.data = Map{{"result", level}};
      EXPECT_EQ(step(m, core, message).verdict, Verdict::kUndecided);
    }
    return encoded(m, core, at(0));
  };
  EXPECT_EQ(after({20}), after({25, 24}));
  EXPECT_EQ(after({90}), after({20, 70}));
  EXPECT_NE(after({90}), after({20}));
}

// ---- What was never put to the test ----

TEST(Vacuity, TellsAMonitorThatGotNoEvent) {
  Player p("always level >= 20.");
  EXPECT_EQ(p.vacuity(), "never got any event it waits for");
  p.see(at(1), "s.ask.request");
  EXPECT_EQ(p.vacuity(), "never got any event it waits for");
  p.see(at(2), "battery.level.reply", 30);
  EXPECT_EQ(p.vacuity(), "");
  p.see(at(3), "battery.level.reply", 10);
  EXPECT_EQ(p.vacuity(), "");
}

TEST(Vacuity, TellsARequirementThatWasNeverTriggered) {
  for (const char* response : {"event(answer) within 1 s", "keep ok for 1 s", "not event(answer) for 1 s"}) {
    Player p("whenever level < 30, " + std::string(response) + ".");
    p.see(at(1), "battery.level.reply", 50);
    EXPECT_THAT(p.vacuity(), HasSubstr("was never triggered: level < 30 never held")) << response;
    p.see(at(2), "s.ok.reply", true).see(at(3), "battery.level.reply", 10).silence(at(5000));
    EXPECT_EQ(p.vacuity(), "") << response;
  }
}

TEST(Vacuity, TellsARequirementThatNothingWhereItAppliesCouldViolate) {
  Player scoped("after ok, always level >= 20.");
  scoped.see(at(1), "battery.level.reply", 30).see(at(2), "s.ok.reply", false);
  EXPECT_EQ(scoped.vacuity(), "was never put to the test: level >= 20 was never known where it applies");
  scoped.see(at(3), "s.ok.reply", true);
  EXPECT_EQ(scoped.vacuity(), "");
  // That nobody answers is what is asked for.
  EXPECT_EQ(Player("never event(answer).").vacuity(), "");
  // Satisfied for good, and nothing that had to wait for it.
  Player first("ok precedes event(ask).");
  first.see(at(1), "s.ok.reply", true);
  EXPECT_EQ(first.vacuity(), "was never triggered: event(ask) never held");
  first.see(at(2), "s.ask.request");
  EXPECT_EQ(first.vacuity(), "");
}

}  // namespace
}  // namespace sentree::monitor
