// Every small change to a synthesized chart changes some verdict: the charts have nothing in them that does not matter,
// and the evaluator sees it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/monitor/detail/requirement_script.h"
#include "sentree/monitor/monitor.h"
#include "sentree/monitor/oracle/evaluator.h"
#include "sentree/monitor/oracle/random.h"

namespace sentree::monitor::oracle {
namespace {

std::vector<Outcome> run_mutant(const Model& model, const std::vector<Message>& trace, TimePoint end) {
  std::vector<Outcome> outcomes;
  State state = start(model, TimePoint{});
  const auto take = [&](const Decisions& decisions) {
    for (const Decision& d : decisions)
      outcomes.push_back({d.verdict == Verdict::kViolated, d.at, d.deciding ? d.deciding->sequence : 0});
  };
  for (const Message& message : trace) take(observe(model, state, message));
  take(advance(model, state, end));
  if (state.failure()) outcomes.push_back({});
  return outcomes;
}

struct Change {
  std::string from;
  std::string to;
};

// Whether the line sets a datum that nothing reads, or one behind which nothing comes.
bool only_explains(const std::string& chart, std::size_t line, std::size_t end) {
  constexpr std::string_view kAssign = "<assign location=\"";
  const std::size_t at = chart.find(kAssign, line);
  if (at >= end) return false;
  const std::size_t begin = at + kAssign.size();
  const std::string name = chart.substr(begin, chart.find('"', begin) - begin);
  // Of the transition around it, if there is one.
  const std::size_t taken = std::min(chart.rfind("<transition", line), line);
  const std::string transition = chart.substr(taken, chart.find('>', taken) - taken);
  if (transition.find("target=\"violated\"") != std::string::npos ||
      transition.find("target=\"satisfied\"") != std::string::npos)
    return chart.find("<final id=\"violated\"/>") != std::string::npos;
  for (const std::string_view where : {"cond=\"", "expr=\""}) {
    for (std::size_t from = chart.find(where); from != std::string::npos; from = chart.find(where, from + 1)) {
      const std::size_t first = from + where.size();
      if (reads({chart.substr(first, chart.find('"', first) - first), 0}, name)) return false;
    }
  }
  return true;
}

// One changed place each. Comments and the first lines are left alone, and data that decide nothing.
std::vector<std::string> mutants(const std::string& chart) {
  const std::vector<Change> changes = {
      {" &lt; ", " &lt;= "},
      {" &gt; ", " &gt;= "},
      {" &gt;= ", " &gt; "},
      {" &lt;= ", " &lt; "},
      {" &amp;&amp; ", " || "},
      {" || ", " &amp;&amp; "},
      {" === ", " !== "},
      {" !== ", " === "},
      {"\"!", "\""},
      {" + 1\"", " + 2\""},
      {"delay=\"5ms\"", "delay=\"5.000001ms\""},
      {"delay=\"5ms\"", "delay=\"4.999999ms\""},
      {"<cancel sendid=\"deadline\"/>", ""},
      {"<send event=\"deadline\" id=\"deadline\" delay=\"5ms\"/>", ""},
      {"<raise event=\"observed\"/>", ""},
      {"<assign location=", ""},  // all of it
      {"event=\"s.", "event=\"n."},
      {"event=\"mission.tick", "event=\"mission.tock"},
      {"expr=\"true\"", "expr=\"false\""},
      {"from_closed\" expr=\"false\"", "from_closed\" expr=\"true\""},
      {"newer_owed\" expr=\"false\"", "newer_owed\" expr=\"true\""},
      {"second_timer\" expr=\"false\"", "second_timer\" expr=\"true\""},
      {"deadline_2\"", "deadline_3\""},
      {"event=\"deadline\"", "event=\"never\""},
      {"event=\"observed\"", "event=\"never\""},
      {"target=\"violated\"", "target=\"satisfied\""},
      {"target=\"satisfied\"", "target=\"violated\""},
      {" === 3", " === 2"},
      {" &gt; 3", " &gt; 2"},
      {" &gt; 2\"", " &gt; 3\""},
      {" &gt;= 2\"", " &gt;= 3\""},
  };
  std::vector<std::string> all;
  const std::size_t body = chart.find("<state id=\"watching\"");
  const std::size_t remembers = chart.find("<!-- What is remembered");
  const std::size_t states = chart.find("<state id=", chart.find("<state id=") + 1);
  for (const Change& change : changes) {
    for (std::size_t at = chart.find(change.from, body); at != std::string::npos;
         at = chart.find(change.from, at + 1)) {
      const std::size_t line = chart.rfind('\n', at);
      const std::size_t end = chart.find('\n', line + 1);
      if (chart.find("<!--", line) < end || only_explains(chart, line, end)) continue;
      // A transition that leaves the state may note what is not needed there.
      if (change.from.starts_with("<assign") && (line < remembers || line > states)) continue;
      std::string mutant = chart;
      if (change.from.starts_with("<assign"))
        mutant.erase(at, chart.find("/>", at) + 2 - at);
      else
        mutant.replace(at, change.from.size(), change.to);
      if (mutant.find("id=\"satisfied\"") == std::string::npos)
        mutant.insert(mutant.rfind("</scxml>"), "  <final id=\"satisfied\"/>\n");
      all.push_back(std::move(mutant));
    }
  }
  return all;
}

std::string difference(const std::string& a, const std::string& b) {
  std::size_t at = 0;
  while (at < a.size() && at < b.size() && a[at] == b[at]) ++at;
  const std::size_t begin = a.rfind('\n', at) + 1;
  return a.substr(begin, at - begin) + "[" + a.substr(at, 24) + "] became [" + b.substr(at, 24) + "]";
}

// Changes that no trace can show.
struct Equivalent {
  const char* requirement;
  const char* place;
  const char* why;
};
constexpr Equivalent kEquivalents[] = {
    {"eventually b", "[cancel", "it ends when it leaves this state"},
    {"event(e), event(f)", "cond=\"e [&amp;&amp; !f", "only e and f are observed, never both at once"},
    {"event(f) within 2 events", "observations + [1", "in the transition of f, which is the response"},
    {"x > 1 and w", "_event.data.args [", "a request without arguments does not exist"},
    {"b immediately", "observed", "in the transition of b, without which e is not"},
    {"not event(e)", "[cancel", "it is left by the deadline or by a violation only"},
    {"holds for", "[cancel", "it is left by the deadline or by a violation only"},
    {"at(pear) within", "\"at_pear\" expr=", "what is not known is not true either"},
    {"holds for", "\"not_b_before\" expr=", "what is not known is not false either"},
    {"event(e) until", "in_scope", "in the transition of e or f, which decides alone"},
    {"event(e) until", "observed", "in the transition of f, which only closes"},
    {"event(f), always b", "in_scope", "in the transition of e or f, which decides alone"},
    {"apples), b within", "<raise event=\"", "in the transition of e, which only opens"},
    {"apples), b within", "in_scope\"", "in the transition of e or f, which decides alone"},
};
bool is_equivalent(const std::string& requirement, const std::string& what) {
  for (const Equivalent& known : kEquivalents) {
    if (requirement.find(known.requirement) != std::string::npos && what.find(known.place) != std::string::npos)
      return true;
  }
  return false;
}

TEST(Mutants, OfSynthesizedChartsAreKilled) {
  constexpr std::uint64_t kSeed = 5;
  constexpr int kTraces = 3000;
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  Rng rng(kSeed);
  std::vector<std::pair<std::vector<Message>, TimePoint>> traces;
  for (int i = 0; i < kTraces; ++i) {
    auto trace = random_trace(rng);
    const TimePoint end = (trace.empty() ? TimePoint{} : trace.back().time) + Duration(rng.below(6'000'000));
    traces.emplace_back(std::move(trace), end);
  }
  // Pairs of observations around 5 ms apart, to the nanosecond.
  for (int i = 0; i < kTraces; ++i) {
    auto trace = random_trace(rng);
    if (trace.size() < 3) continue;
    trace.resize(3 + rng.below(2));
    TimePoint at(std::chrono::milliseconds(1));
    for (std::size_t k = 0; k < trace.size(); ++k) {
      if (k + 1 == trace.size()) at += Duration(4'999'999 + static_cast<std::int64_t>(rng.below(3)));
      trace[k].time = at;
    }
    traces.emplace_back(std::move(trace), at);
  }
  // Segments close while something is owed from them.
  for (int i = 0; i < kTraces; ++i) {
    auto trace = random_segments(rng);
    const TimePoint end = (trace.empty() ? TimePoint{} : trace.back().time) + Duration(rng.below(6'000'000));
    traces.emplace_back(std::move(trace), end);
  }
  // Few kinds of observations, each often: what one remembers meets what the next says.
  for (int i = 0; i < kTraces; ++i) {
    std::vector<Message> trace;
    TimePoint now{};
    for (int k = 0; k < 12; ++k) {
      for (Message& m : random_trace(rng)) {
        if (m.name != "s.x.reply" && m.name != "s.w.request" && m.name != "s.at.reply" && m.name != "mission.tick")
          continue;
        now += std::chrono::milliseconds(1);
        m.time = now;
        m.sequence = trace.size() + 1;
        trace.push_back(std::move(m));
      }
    }
    traces.emplace_back(std::move(trace), now);
  }
  for (const std::int64_t apart_ns : {4'999'999, 5'000'000, 5'000'001}) {
    std::vector<Message> trace;
    for (const bool b : {false, true, false}) {
      Message m;
      m.name = "s.b.reply";
      m.sequence = trace.size() + 1;
      m.time = TimePoint(trace.size() < 2 ? Duration(0) : Duration(apart_ns));
      m.data = Map{{"args", Map()}, {"result", b}};
      trace.push_back(std::move(m));
    }
    traces.emplace_back(trace, trace.back().time);
  }
  int total = 0;
  std::vector<std::string> survivors;
  for (const std::string text : {
           "R: always x < 3.",
           "R: never (b and x > 1).",
           "R: eventually b within 5 ms.",
           "R: whenever event(e), b within 5 ms.",
           "R: whenever event(e), event(f) within 5 ms.",
           "R: whenever x > 1 and w = pear, at(pear) within 2 ticks.",
           "R: whenever event(e), event(f) within 2 events.",
           "R: whenever event(e), b immediately.",
           "R: whenever event(e), keep b for 5 ms.",
           "R: whenever event(e), keep x < 2 until b.",
           "R: whenever event(e), not event(e) for 5 ms.",
           "R: b precedes event(e).",
           "R: event(f) precedes event(e) by at most 5 ms.",
           "R: x updated at least every 5 ms.",
           "R: b at least every 2 ticks.",
           "R: event(e) at most 1 times per 5 ms.",
           "R: event(e) at most 2 times.",
           "R: b holds for at least 5 ms.",
           "R: after event(e) until event(f), never x = 3.",
           "R: between event(e) and event(f), always b.",
           "R: between event(e) and event(f), whenever event(apples), b within 5 ms.",
           "R (re-arming): between event(e) and event(f), whenever event(apples), not (x = 3) for 5 ms.",
           "R (re-arming): between event(e) and event(f), whenever event(apples), keep b for 2 events.",
           "R: while b, x updated at least every 5 ms.",
           "R: before event(e), never x = 3.",
           "R: whenever event(e), x = 3 within 5 ms assuming b.",
       }) {
    const auto file = parse_requirements(random_definitions() + text, "r.req");
    ASSERT_TRUE(file.ok()) << to_string(file.diagnostics.front());
    const Requirement& requirement = file.value->requirements.at(0);
    const auto original = Model::make(requirement);
    std::vector<std::vector<Outcome>> expected;
    for (const auto& [trace, end] : traces) {
      expected.push_back(evaluate(requirement, trace, end));
      ASSERT_EQ(run_mutant(*original.value, trace, end), expected.back()) << text;
    }
    for (const std::string& mutant : mutants(original.value->chart().source())) {
      ++total;
      const auto chart = scxml::load(mutant, "mutant.scxml");
      if (!chart.ok()) continue;
      const auto model = Model::make(Spec{.name = "mutant", .chart = *chart.value});
      if (!model.ok()) continue;
      bool killed = false;
      for (std::size_t i = 0; i < traces.size() && !killed; ++i)
        killed = run_mutant(*model.value, traces[i].first, traces[i].second) != expected[i];
      if (killed) continue;
      const std::string what = difference(original.value->chart().source(), mutant);
      if (!is_equivalent(text, what)) survivors.push_back(text + "  " + what);
    }
  }
  std::printf("%d mutants\n", total);
  EXPECT_GT(total, 250);
  EXPECT_THAT(survivors, testing::IsEmpty());
}

}  // namespace
}  // namespace sentree::monitor::oracle
