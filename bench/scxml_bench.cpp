// Speed and size of the state chart engine. One iteration is one event up to the stable configuration, by the very
// functions that run skills; qt/… is Qt SCXML where it is installed. SCXML_MACHINES=DIR takes the charts from
// DIR/NAME.scxml instead.
#include <benchmark/benchmark.h>
#include <malloc.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "sentree/scxml/chart.h"
#include "sentree/scxml/encode.h"
#include "sentree/scxml/step.h"
#include "sentree/text/file.h"
#ifdef SENTREE_BENCH_QT
#include "scxml_bench_qt.h"
#endif

namespace {

using namespace sentree;

std::string head(std::string_view data_model) {
  return R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel=")" + std::string(data_model) +
         "\">";
}

std::string flipflop(std::string_view data_model) {
  return head(data_model) +
         R"(<state id="a"><transition event="e" target="b"/></state><state id="b"><transition event="e" target="a"/></state></scxml>)";
}

std::string guardassign() {
  return head("ecmascript") + R"(<datamodel><data id="x" expr="0"/></datamodel>
    <state id="a"><transition event="e" cond="x &gt;= 0 &amp;&amp; _event.name == 'e'"><assign location="x" expr="x + 1"/></transition></state></scxml>)";
}

std::string level_monitor() {
  return head("ecmascript") + R"(
    <state id="idle"><transition event="e" cond="_event.data.level &gt;= 20" target="get"/><transition event="e" target="failure"/></state>
    <state id="get"><transition event="e" cond="_event.data.level &lt; 20" target="failure"/><transition event="e" target="idle"/></state>
    <state id="failure"/></scxml>)";
}

std::string par10() {
  std::string text = head("null") + "<parallel id=\"p\">";
  for (int i = 0; i < 10; ++i) {
    const std::string n = std::to_string(i);
    text += "<state id=\"r" + n + "\"><state id=\"a" + n + "\"><transition event=\"e\" target=\"b" + n +
            "\"/></state><state id=\"b" + n + "\"><transition event=\"e\" target=\"a" + n + "\"/></state></state>";
  }
  return text + "</parallel></scxml>";
}

std::string load1000() {
  std::string text = head("ecmascript") + "<datamodel><data id=\"x\" expr=\"0\"/></datamodel>\n";
  for (int i = 0; i < 1000; ++i) {
    text += "<state id=\"s" + std::to_string(i) + "\"><transition event=\"e\" cond=\"x &gt;= 0\" target=\"s" +
            std::to_string((i + 1) % 1000) + "\"><assign location=\"x\" expr=\"x + 1\"/></transition></state>\n";
  }
  return text + "</scxml>";
}

std::string machine(const std::string& name, std::string fallback) {
  const char* folder = std::getenv("SCXML_MACHINES");
  if (!folder) return fallback;
  auto text = text::read_file(std::filesystem::path(folder) / (name + ".scxml"));
  return text ? *std::move(text) : fallback;
}

scxml::Chart load_machine(const std::string& name, std::string fallback) {
  auto loaded = scxml::load(machine(name, std::move(fallback)), name + ".scxml");
  if (!loaded.ok()) {
    for (const auto& diagnostic : loaded.diagnostics) std::fprintf(stderr, "%s\n", to_string(diagnostic).c_str());
    std::exit(1);
  }
  return *std::move(loaded.value);
}

void run_events(benchmark::State& state, const std::string& name, std::string fallback) {
  const scxml::Chart chart = load_machine(name, std::move(fallback));
  scxml::Session session;
  scxml::Effects effects;
  const scxml::Host host;
  scxml::start(chart, session, {}, {}, effects, host);
  const std::string event_name = chart.events_handled().empty() ? "e" : chart.events_handled().front();
  const scxml::Event event{.name = event_name, .data = Value(Map{{"level", 50}})};
  for (auto _ : state) {
    effects.clear();
    benchmark::DoNotOptimize(scxml::step(chart, session, event, {}, effects, host));
  }
  if (!session.running()) state.SkipWithError("the session ended");
}

void run_load(benchmark::State& state) {
  const std::string source = machine("load1000", load1000());
  for (auto _ : state) benchmark::DoNotOptimize(scxml::load(source, "load1000.scxml"));
}

// Heap bytes for each further session of a loaded chart.
void run_size(benchmark::State& state, const std::string& name, std::string fallback) {
  const scxml::Chart chart = load_machine(name, std::move(fallback));
  scxml::Effects effects;
  const scxml::Host host;
  const scxml::Event event{.name = "e", .data = Value(Map{{"level", 50}})};
  double bytes = 0;
  for (auto _ : state) {
    constexpr std::size_t kSessions = 200;
    std::vector<scxml::Session> sessions(kSessions + 1);
    const auto begin = [&](scxml::Session& session) {
      scxml::start(chart, session, {}, {}, effects, host);
      scxml::step(chart, session, event, {}, effects, host);
      effects.clear();
    };
    begin(sessions[0]);
    const std::size_t before = mallinfo2().uordblks;
    for (std::size_t i = 1; i <= kSessions; ++i) begin(sessions[i]);
    bytes = static_cast<double>(mallinfo2().uordblks - before) / kSessions + sizeof(scxml::Session);
  }
  state.counters["bytes_per_session"] = bytes;
}

// The five skills of the recharge mission, each in the midst of a tick.
struct Skills {
  std::vector<scxml::Chart> charts;
  std::vector<scxml::Session> sessions;
};
const Skills& recharge() {
  static const Skills kSkills = [] {
    Skills skills;
    scxml::Effects effects;
    scxml::Host host;
    host.processors.push_back({"thrift", ""});
    for (const char* name :
         {"AtLocation", "BatteryLevelAbove", "BatteryNotRecharging", "GoToLocation", "WaitForUser"}) {
      const std::string file = std::string(SENTREE_SOURCE_DIR) + "/examples/recharge/skills/" + name + ".scxml";
      const auto text = text::read_file(file);
      if (!text) {
        std::fprintf(stderr, "%s\n", to_string(text.error()).c_str());
        std::exit(1);
      }
      skills.charts.push_back(*scxml::load(*text, file).value);
      scxml::start(skills.charts.back(), skills.sessions.emplace_back(), {.session_id = name}, {}, effects, host);
      scxml::step(skills.charts.back(), skills.sessions.back(), {.name = "tick"}, {}, effects, host);
    }
    return skills;
  }();
  return kSkills;
}

void run_copy(benchmark::State& state) {
  const auto& sessions = recharge().sessions;
  for (auto _ : state) {
    std::array<scxml::Session, 5> copies{sessions[0], sessions[1], sessions[2], sessions[3], sessions[4]};
    benchmark::DoNotOptimize(copies);
  }
}

void run_encode(benchmark::State& state) {
  const Skills& skills = recharge();
  std::string bytes;
  for (auto _ : state) {
    bytes.clear();
    for (std::size_t i = 0; i < skills.sessions.size(); ++i)
      benchmark::DoNotOptimize(scxml::encode(skills.charts[i], skills.sessions[i], {}, bytes));
  }
  state.counters["bytes"] = static_cast<double>(bytes.size());
}

void run_save(benchmark::State& state) {
  const Skills& skills = recharge();
  for (auto _ : state) {
    for (std::size_t i = 0; i < skills.sessions.size(); ++i)
      benchmark::DoNotOptimize(scxml::save(skills.charts[i], skills.sessions[i]));
  }
}

#ifdef SENTREE_BENCH_QT
std::string source_of(const std::string& name) {
  if (name == "flipflop_null") return machine(name, flipflop("null"));
  if (name == "flipflop_ecmascript") return machine(name, flipflop("ecmascript"));
  if (name == "guardassign") return machine(name, guardassign());
  if (name == "level_monitor") return machine(name, level_monitor());
  if (name == "par10_null") return machine(name, par10());
  return machine(name, load1000());
}
#endif

}  // namespace

int main(int argc, char** argv) {
  benchmark::RegisterBenchmark("flipflop_null",
                               [](benchmark::State& s) { run_events(s, "flipflop_null", flipflop("null")); });
  benchmark::RegisterBenchmark(
      "flipflop_ecmascript", [](benchmark::State& s) { run_events(s, "flipflop_ecmascript", flipflop("ecmascript")); });
  benchmark::RegisterBenchmark("guardassign", [](benchmark::State& s) { run_events(s, "guardassign", guardassign()); });
  benchmark::RegisterBenchmark("level_monitor",
                               [](benchmark::State& s) { run_events(s, "level_monitor", level_monitor()); });
  benchmark::RegisterBenchmark("par10_null", [](benchmark::State& s) { run_events(s, "par10_null", par10()); });
  benchmark::RegisterBenchmark("load1000", run_load)->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("recharge_copy_5_sessions", run_copy);
  benchmark::RegisterBenchmark("recharge_encode_5_sessions", run_encode);
  benchmark::RegisterBenchmark("recharge_save_5_sessions", run_save);
  benchmark::RegisterBenchmark("size_null", [](benchmark::State& s) {
    run_size(s, "flipflop_null", flipflop("null"));
  })->Iterations(1);
  benchmark::RegisterBenchmark("size_ecmascript", [](benchmark::State& s) {
    run_size(s, "guardassign", guardassign());
  })->Iterations(1);
#ifdef SENTREE_BENCH_QT
  register_qt_benchmarks(source_of);
#endif
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
