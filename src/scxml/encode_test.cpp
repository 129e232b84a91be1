#include "sentree/scxml/encode.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "sentree/scxml/detail/test_random_chart.h"
#include "sentree/scxml/step.h"

namespace sentree::scxml {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr auto kSecond = std::chrono::seconds(1);

Chart encoded_chart(std::string_view body) {
  auto loaded = load("<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\">" +
                         std::string(body) + "</scxml>",
                     "c.scxml");
  for (const Diagnostic& diagnostic : loaded.diagnostics) ADD_FAILURE() << to_string(diagnostic);
  return *std::move(loaded.value);
}

// A session and the time that it has.
struct Play {
  explicit Play(const Chart& of, std::string_view events = {}, TimePoint begin = {}) : chart(&of), now(begin) {
    host.processors.push_back({"out", ""});
    host.limits.timers_max = 20;
    start(of, session, {}, now, effects, host);
    for (const char event : events) send(std::string(1, event));
  }
  void send(const std::string& name, std::optional<Value> data = {}) { give({.name = name, .data = std::move(data)}); }
  void give(const Event& event) {
    step_timers(*chart, session, now, effects, host);
    step(*chart, session, event, now, effects, host);
  }
  [[nodiscard]] std::string encoded() const {
    std::string bytes;
    const auto done = encode(*chart, session, now, bytes);
    EXPECT_TRUE(done) << done.error().message;
    return bytes;
  }

  const Chart* chart;
  Host host;
  Session session;
  Effects effects;
  TimePoint now;
};

TEST(Encode, SendsThatHaveLeftNoTrace) {
  const Chart chart =
      encoded_chart(R"(<state id="a"><transition event="s"><send event="x" delay="1s" id="t"/><cancel sendid="t"/>
    <send type="out" event="o"/></transition></state>)");
  EXPECT_EQ(Play(chart).encoded(), Play(chart, "sss").encoded());
  EXPECT_NE(Play(chart).session, Play(chart, "s").session);
}

TEST(Encode, DelayedSendsCountByTheTimeThatIsLeft) {
  const Chart chart =
      encoded_chart(R"(<state id="a"><transition event="s"><send event="x" delay="9s"/></transition></state>)");
  Play early(chart, "s");
  Play late(chart, "", TimePoint(100 * kSecond));
  late.now += 5 * kSecond;
  late.send("s");
  EXPECT_EQ(early.encoded(), late.encoded());
  early.now += kSecond;
  EXPECT_NE(early.encoded(), late.encoded());
  late.now += kSecond;
  EXPECT_EQ(early.encoded(), late.encoded());
}

TEST(Encode, DataStatesAndHistoryCount) {
  const Chart chart = encoded_chart(R"(<datamodel><data id="v"/></datamodel>
    <state id="a"><transition event="b" target="b"/><transition event="v"><assign location="v" expr="_event.data"/></transition>
      <state id="a1"><transition event="n" target="a2"/></state><state id="a2"/>
      <history id="h"><transition target="a1"/></history></state>
    <state id="b"><transition event="a" target="h"/></state>)");
  EXPECT_NE(Play(chart, "b").encoded(), Play(chart, "nb").encoded());
  EXPECT_EQ(Play(chart, "nb").encoded(), Play(chart, "nbab").encoded());
  std::vector<std::string> all;
  for (const Value& value :
       {Value(), Value(0), Value(1), Value(300), Value(-1), Value(1.5), Value("1"), Value(""), Value(true),
        Value(List{1, 2}), Value(List{List{1}, 2}), Value(Map{{"a", 1}}), Value(Map{{"a", List{}}})}) {
    Play play(chart);
    play.send("v", value);
    all.push_back(play.encoded());
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) EXPECT_NE(all[i], all[k]) << i << " " << k;
  }
}

TEST(Encode, IdsThatTheEngineMakesUpAreNumberedByFirstUse) {
  const Chart chart = encoded_chart(R"(<datamodel><data id="a"/><data id="b"/></datamodel>
    <state id="s"><transition event="a"><send event="x" delay="9s" idlocation="a"/></transition>
    <transition event="b"><assign location="b" expr="a"/></transition>
    <transition event="c"><cancel sendidexpr="a"/></transition></state>)");
  EXPECT_EQ(Play(chart, "a").encoded(), Play(chart, "aca").encoded());
  EXPECT_EQ(Play(chart, "ab").encoded(), Play(chart, "acab").encoded());
  EXPECT_NE(Play(chart, "acab").encoded(), Play(chart, "abca").encoded()) << "b is another send's id than a";
}

TEST(Encode, InvokedChildrenCountByWhatTheyDoNotByTheirIds) {
  const Chart chart = encoded_chart(R"(<state id="idle"><transition event="g" target="run"/></state>
    <state id="run"><transition event="b" target="idle"/><invoke autoforward="true"><content>
      <scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
      <state id="x"><transition event="n" target="y"/></state><state id="y"/></scxml></content></invoke></state>)");
  EXPECT_EQ(Play(chart, "g").encoded(), Play(chart, "gnbg").encoded());
  EXPECT_NE(Play(chart, "g").encoded(), Play(chart, "gn").encoded());
}

TEST(Encode, WhatTheChartAsksForCounts) {
  const std::string_view kBody = R"(<state id="a"><transition event="r"><log expr="ASKED"/></transition></state>)";
  const auto with = [&](const std::string& asked) {
    std::string body(kBody);
    return encoded_chart(body.replace(body.find("ASKED"), 5, asked));
  };
  const Chart random = with("Math.random()");
  EXPECT_EQ(Play(random, "").encoded(), Play(random, "").encoded());
  EXPECT_NE(Play(random, "").encoded(), Play(random, "r").encoded());
  const Chart clock = with("Date.now()");
  EXPECT_NE(Play(clock, "", {}).encoded(), Play(clock, "", TimePoint(kSecond)).encoded());
  const Chart neither = with("Math.floor(1.5) + 'Date'");
  EXPECT_EQ(Play(neither, "", {}).encoded(), Play(neither, "r", TimePoint(kSecond)).encoded());
}

TEST(Encode, RefusesDataWithoutAValueForm) {
  const Chart chart = encoded_chart(R"(<datamodel><data id="f"/></datamodel>
    <state id="a"><onentry><script>f = function () {};</script></onentry></state>)");
  const Play play(chart);
  std::string bytes = "before";
  const auto refused = encode(chart, play.session, {}, bytes);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "scxml.no-value-form");
  EXPECT_EQ(bytes, "before");
}

std::vector<std::string> asked(std::string_view expression) {
  const Chart chart =
      encoded_chart("<state id=\"a\">\n<onentry><log expr=\"" + std::string(expression) + "\"/></onentry></state>");
  std::vector<std::string> names;
  for (const AmbientUse& use : chart.ambient()) {
    EXPECT_EQ(use.span.file, "c.scxml");
    EXPECT_EQ(use.span.line, 2);
    names.push_back(use.name);
  }
  return names;
}

TEST(Ambient, IsFoundByWhatExpressionsName) {
  EXPECT_THAT(asked("Math.random() + new Date().getTime()"), ElementsAre("Math.random", "Date"));
  const char* const spelled = "the spelling of an id that the engine makes up";
  EXPECT_THAT(asked("_sessionid + _event.sendid + _event.name"), ElementsAre("_sessionid", "_event.sendid", spelled));
  EXPECT_THAT(asked("JSON.stringify(_event)"), ElementsAre("_event", spelled));
  EXPECT_THAT(asked("this.Date"), ElementsAre("Date"));
  EXPECT_THAT(asked("this['Da' + 'te']"), ElementsAre("this"));
  EXPECT_THAT(asked("eval('1') + [].constructor"), ElementsAre("eval", "constructor"));
  EXPECT_THAT(asked("Math['random']()"), ElementsAre("Math"));
  EXPECT_THAT(asked("\\u0044ate()"), testing::Contains("\\"));
}

TEST(Ambient, IsNotFoundInTextsCommentsAndMembers) {
  EXPECT_THAT(asked("'Date' + a.Date + /Date'/.test('x') /* Math.random */"), IsEmpty());
  EXPECT_THAT(asked("_event.data.sendid + Math.floor(4 / 2) / Math.PI + my_Date"), IsEmpty());
}

TEST(Ambient, IsFoundInIdlocationsAndInInvokedCharts) {
  const Chart chart = encoded_chart(R"xml(<datamodel><data id="i"/></datamodel><state id="a">
    <onentry><if cond="true"><send event="x" delay="1s" idlocation="i"/></if></onentry>
    <invoke><content><scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
      <state id="c"><onentry>
        <log expr="Math.random()"/></onentry></state></scxml></content></invoke></state>)xml");
  ASSERT_EQ(chart.ambient().size(), 2U);
  EXPECT_EQ(chart.ambient()[0].what, Ambient::kIds);
  EXPECT_EQ(chart.ambient()[1].what, Ambient::kRandom);
  EXPECT_EQ(chart.ambient()[1].span.line, 5);
}

TEST(Ambient, TellsWhereItMattersHowIdsAreSpelled) {
  const auto is_spelled = [](const std::string& condition) {
    const Chart chart =
        encoded_chart(R"(<datamodel><data id="i"/><data id="kept"/><data id="n"/></datamodel><state id="a">
    <onentry><assign location="kept" expr="i"/><send event="x" delay="1s" idlocation="i"/><cancel sendidexpr="kept"/></onentry>
    <transition event="x"><send event="y" targetexpr="_event.origin"/></transition>
    <transition event="z" cond=")" +
                      condition + "\"/></state>");
    const auto uses = chart.ambient();
    return std::any_of(uses.begin(), uses.end(), [](const auto& use) { return use.what == Ambient::kIdText; });
  };
  for (const char* const condition :
       {"_event.sendid == i", "kept === i || !(n &gt; 2)", "i !== null", "_event.name == 'i'",
        "_event.sendid === 'timer1'", "_event.data.sendid.length &gt; 2 ? i == '' : n == 1"})
    EXPECT_FALSE(is_spelled(condition)) << condition;
  for (const char* const condition :
       {"i.length &gt; 3", "_event.sendid == 'c.send1'", "i &gt; kept", "JSON.stringify(_event) == ''", "i + '' == n",
        "kept.charAt(0) == 's'", "n == 'c.send' + 1", "(function () { return i; })() == n", "_event['sendid'] == n",
        "i == n", "[i].join() == n", "/1/.test(kept)"})
    EXPECT_TRUE(is_spelled(condition)) << condition;
}

// ---- Equal encodings, equal futures ----

// Ids that the engine has made up in two runs, which must correspond one to one.
class Pairs {
 public:
  [[nodiscard]] bool agree(const std::string& a, const std::string& b) {
    return forth_.emplace(a, b).first->second == b && back_.emplace(b, a).first->second == a;
  }

 private:
  std::map<std::string, std::string> forth_;
  std::map<std::string, std::string> back_;
};

void expect_alike(Effects a, Effects b, Pairs& ids) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    auto* x = std::get_if<OutgoingSend>(&a[i]);
    auto* y = std::get_if<OutgoingSend>(&b[i]);
    if (x && y) {
      EXPECT_TRUE(ids.agree(x->sendid, y->sendid)) << x->sendid << " " << y->sendid;
      EXPECT_TRUE(ids.agree(x->session, y->session)) << x->session << " " << y->session;
      y->sendid = x->sendid;
      y->session = x->session;
    }
    ASSERT_EQ(a[i], b[i]);
  }
}

std::string last_sendid(const Effects& effects) {
  for (auto effect = effects.rbegin(); effect != effects.rend(); ++effect) {
    if (const auto* send = std::get_if<OutgoingSend>(&*effect)) return send->sendid;
  }
  return {};
}

TEST(Encode, EqualEncodingsHaveEqualFutures) {
  int met = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const auto loaded = load(RandomChart(seed, RandomChart::Data::kSmall).source());
    ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.front());
    const Chart& chart = *loaded.value;
    Rng rng(seed);
    std::unordered_map<std::string, Play> seen;
    int met_here = 0;
    for (int walk = 0; walk < 8; ++walk) {
      Play play(chart, "", TimePoint(rng.below(100) * kSecond));
      for (int i = 0; i < 12; ++i) {
        play.effects.clear();
        play.now += rng.below(3) * kSecond;
        play.send("e" + std::to_string(rng.below(4)));
        if (!play.session.running()) break;
        const auto [before, is_new] = seen.emplace(play.encoded(), play);
        if (is_new || before->second.session == play.session || met_here == 10) continue;
        ++met_here;
        Play a = before->second;
        Play b = play;
        Pairs ids;
        for (int k = 0; k < 6; ++k) {
          const Duration time = rng.below(3) * kSecond;
          Event event{.name = "e" + std::to_string(rng.below(4))};
          const std::string failed_a = last_sendid(a.effects);
          const std::string failed_b = last_sendid(b.effects);
          const bool fails = k > 0 && !failed_a.empty() && rng.below(2) == 0;
          for (Play* p : {&a, &b}) {
            p->effects.clear();
            p->now += time;
            if (fails)
              p->give({.name = "error.communication",
                       .type = EventType::kPlatform,
                       .sendid = p == &a ? failed_a : failed_b});
            p->give(event);
          }
          expect_alike(a.effects, b.effects, ids);
          ASSERT_EQ(a.session.active_ids(chart), b.session.active_ids(chart));
          ASSERT_EQ(a.encoded(), b.encoded());
        }
      }
    }
    met += met_here;
  }
  EXPECT_GT(met, 100) << "sessions of different pasts that met";
}

}  // namespace
}  // namespace sentree::scxml
