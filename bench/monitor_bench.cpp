// Speed of monitors: recordings of a million observations in memory, evaluated by the very functions that watch runs.
#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/monitor/monitor_set.h"
#include "sentree/monitor/requirement.h"
#include "sentree/scxml/chart.h"

namespace {

using namespace sentree;

constexpr const char* kDefinitions =
    "let level = reply(battery.getBatteryState).percentage * 100\n"
    "let destination = request(navigation.gotoTargetByLocationName).name\n";

// A requirement, and the chart that somebody would draw for it who knows SCXML and wants it quick: states instead of
// flags, conditions at the observations, data only where something has to be remembered.
struct Pair {
  const char* name;
  const char* requirement;
  const char* drawn;  // inside of <scxml>
};

#define READING "battery.getBatteryState.reply"
#define GOING "navigation.gotoTargetByLocationName.request"
#define LEVEL "_event.data.result.percentage * 100"
#define PLACE "_event.data.args.name"
#define ON(event, condition, target) "<transition event='" event "' cond=\"" condition "\" target='" target "'/>"
#define KEEP(event, datum, value) \
  "<transition event='" event "'><assign location='" datum "' expr='" value "'/></transition>"

constexpr Pair kPairs[] = {
    {"always", "always level >= 20", "<state id='ok'>" ON(READING, LEVEL " &lt; 20", "violated") "</state>"},
    {"never", "never destination = cellar", "<state id='ok'>" ON(GOING, PLACE " === 'cellar'", "violated") "</state>"},
    {"respond_in_ticks", "whenever level < 30 and destination = kitchen, destination = station within 10 ticks",
     "<datamodel><data id='level'/><data id='place'/><data id='ticks' expr='0'/></datamodel>"
     "<state id='calm'>"
     "<transition event='" READING "' cond=\"" LEVEL " &lt; 30 &amp;&amp; place === 'kitchen'\" target='owes'>"
     "<assign location='level' expr='" LEVEL "'/></transition>" KEEP(
         READING, "level",
         LEVEL) "<transition event='" GOING "' cond=\"" PLACE " === 'kitchen' &amp;&amp; level &lt; 30\" target='owes'>"
                "<assign location='place' expr='" PLACE "'/></transition>" KEEP(
                    GOING, "place",
                    PLACE) "</state><state id='owes'><onexit><assign location='ticks' expr='0'/></onexit>"
                           "<transition event='" GOING "' cond=\"" PLACE " === 'station'\" target='calm'>"
                           "<assign location='place' expr='" PLACE "'/></transition>" KEEP(GOING, "place", PLACE)
                               KEEP(READING, "level", LEVEL) ON("mission.tick", "ticks >= 10", "violated")
                                   KEEP("mission.tick", "ticks", "ticks + 1") "</state>"},
    {"respond_in_time", "whenever level < 30, level >= 30 within 10 s",
     "<state id='calm'>" ON(READING, LEVEL " &lt; 30",
                            "owes") "</state>"
                                    "<state id='owes'><onentry><send event='late' id='late' "
                                    "delay='10s'/></onentry><onexit><cancel sendid='late'/>"
                                    "</onexit>" ON(READING, LEVEL " >= 30",
                                                   "calm") "<transition event='late' target='violated'/></state>"},
    {"keep_until", "whenever destination = kitchen, keep level >= 20 until destination = station",
     "<datamodel><data id='low' expr='false'/></datamodel>"
     "<state id='calm'>" ON(GOING, PLACE " === 'kitchen' &amp;&amp; low", "violated")
         ON(GOING, PLACE " === 'kitchen'", "keeps")
             KEEP(READING, "low", LEVEL " &lt; 20") "</state>"
                                                    "<state id='keeps'>" ON(GOING, PLACE " === 'station'", "calm")
                                                        ON(READING, LEVEL " &lt; 20", "violated") "</state>"},
    {"not_for",
     "whenever event(request(navigation.gotoTargetByLocationName where args.name = kitchen)), not (level < 20) for 50 "
     "ms",
     "<datamodel><data id='low' expr='false'/></datamodel>"
     "<state id='calm'>" ON(GOING, PLACE " === 'kitchen'", "quiet")
         KEEP(READING, "low", LEVEL " &lt; 20") "</state>"
                                                "<state id='quiet'><onentry><send event='over' id='over' "
                                                "delay='50ms'/></onentry><onexit><cancel sendid='over'/>"
                                                "</onexit>" ON(READING, LEVEL " &lt; 20", "violated")
                                                    ON(GOING, PLACE " === 'kitchen'",
                                                       "quiet") "<transition event='over' target='calm'/></state>"},
    {"in_a_scope", "after destination = kitchen until destination = station, always level >= 20",
     "<datamodel><data id='low' expr='false'/></datamodel>"
     "<state id='outside'>" ON(GOING, PLACE " === 'kitchen' &amp;&amp; low", "violated")
         ON(GOING, PLACE " === 'kitchen'", "inside")
             KEEP(READING, "low", LEVEL " &lt; 20") "</state>"
                                                    "<state id='inside'>" ON(GOING, PLACE " === 'station'", "outside")
                                                        ON(READING, LEVEL " &lt; 20", "violated") "</state>"},
    {"changed", "whenever rises(level < 25), level >= 25 within 20 ticks",
     "<datamodel><data id='ticks' expr='0'/></datamodel>"
     "<state id='new'>" ON(
         READING, LEVEL " >= 25",
         "above") "</state>"
                  "<state id='above'>" ON(
                      READING, LEVEL " &lt; 25",
                      "owes") "</state>"
                              "<state id='owes'><onexit><assign location='ticks' expr='0'/></onexit>" ON(
                                  READING, LEVEL " >= 25", "above") ON("mission.tick", "ticks >= 20", "violated")
                                  KEEP("mission.tick", "ticks", "ticks + 1") "</state>"},
    {"at_most", "destination = kitchen at most 6 times per 1 s",
     "<datamodel><data id='count' expr='0'/></datamodel>"
     "<state id='away'>" ON(
         GOING, PLACE " === 'kitchen' &amp;&amp; count >= 6",
         "violated") "<transition event='" GOING "' cond=\"" PLACE " === 'kitchen'\" target='there'>"
                     "<assign location='count' expr='count + 1'/><send event='forget' delay='1s'/></transition>" KEEP(
                         "forget", "count", "count - 1") "</state>"
                                                         "<state id='there'>" ON(GOING, PLACE " !== 'kitchen'", "away")
                                                             KEEP("forget", "count", "count - 1") "</state>"},
    {"at_least_every", "event(request(navigation.gotoTargetByLocationName)) at least every 5 s",
     "<state id='owes'><onentry><send event='late' id='late' delay='5s'/></onentry><onexit><cancel sendid='late'/>"
     "</onexit><transition event='" GOING "' target='owes'/><transition event='late' target='violated'/></state>"},
};

// As the reply of the simulated battery.
Message reading(double ratio) {
  Message m;
  m.kind = MessageKind::kReply;
  m.source = "BatteryLevelAbove30";
  m.target = "battery";
  m.name = "battery.getBatteryState.reply";
  m.call = 7;
  m.data = Map{{"args", Map()},
               {"result", Map{{"header", Map{{"stamp", 12.5}, {"frame_id", "map"}}},
                              {"voltage", 24.1},
                              {"current", -1.5},
                              {"percentage", ratio},
                              {"temperature", 25.0},
                              {"power_supply_status", "DISCHARGING"},
                              {"warning", "NONE"},
                              {"present", true}}}};
  return m;
}

Message going(const char* place) {
  Message m;
  m.kind = MessageKind::kRequest;
  m.source = "GoTo";
  m.target = "navigation";
  m.name = "navigation.gotoTargetByLocationName.request";
  m.data = Map{{"args", Map{{"name", place}}}};
  return m;
}

Message tick(std::int64_t number) {
  Message m;
  m.source = "mission";
  m.name = "mission.tick";
  m.data = Map{{"tick", number}};
  return m;
}

// Readings, ticks and goals; nothing is violated.
const std::vector<Message>& recording() {
  static const std::vector<Message> kAll = [] {
    std::vector<Message> all;
    Rng rng(1);
    // Fewer for whoever counts instructions.
    const char* given = std::getenv("SENTREE_BENCH_OBSERVATIONS");
    const std::size_t size = given != nullptr ? std::strtoull(given, nullptr, 10) : 1'000'000;
    all.reserve(size);
    for (std::size_t i = 0; i < size; ++i) {
      const auto kind = i % 10;
      all.push_back(kind == 0   ? tick(static_cast<std::int64_t>(i / 10))
                    : kind == 5 ? going(i % 20 == 5 ? "kitchen" : "station")
                                : reading(0.21 + 0.7 * rng.uniform()));
      all.back().time = TimePoint(std::chrono::milliseconds(i * 10));
      all.back().sequence = i + 1;
    }
    return all;
  }();
  return kAll;
}

// What a project knows of its interfaces, and who draws a chart too: a reply has its level.
const monitor::Vocabulary& robot() {
  using monitor::DataType;
  static const monitor::Vocabulary kRobot = [] {
    const DataType level{.kind = DataType::Kind::kNumber, .may_be_absent = false};
    const DataType place{.kind = DataType::Kind::kText, .may_be_absent = false};
    const auto record = [](const char* member, const DataType& type) {
      return DataType{.kind = DataType::Kind::kRecord, .may_be_absent = false, .members = {{member, type}}};
    };
    monitor::Vocabulary robot;
    robot.services["battery"]["getBatteryState"].result = record("percentage", level);
    robot.services["navigation"]["gotoTargetByLocationName"].arguments = record("name", place);
    return robot;
  }();
  return kRobot;
}

monitor::Model model(const std::string& body, const std::string& name = "R",
                     const monitor::Vocabulary* known = &robot()) {
  const auto file = monitor::parse_requirements(kDefinitions + name + ": " + body + ".", "bench.req");
  if (!file.ok()) {
    std::fprintf(stderr, "%s\n", to_string(file.diagnostics.front()).c_str());
    std::exit(1);
  }
  const auto made = monitor::Model::make(file.value->requirements.front(), known);
  if (!made.ok()) {
    std::fprintf(stderr, "%s\n", to_string(made.diagnostics.front()).c_str());
    std::exit(1);
  }
  return *made.value;
}

monitor::Model drawn(const char* inside) {
  auto chart = scxml::load("<scxml xmlns='http://www.w3.org/2005/07/scxml' version='1.0' datamodel='ecmascript'>" +
                               std::string(inside) + "<final id='violated'/></scxml>",
                           "drawn.scxml");
  if (!chart.ok()) {
    std::fprintf(stderr, "%s\n", to_string(chart.diagnostics.front()).c_str());
    std::exit(1);
  }
  return *monitor::Model::make({.name = "drawn", .chart = *std::move(chart.value)}).value;
}

void run(benchmark::State& state, const std::vector<monitor::Model>& models) {
  const std::vector<Message>& all = recording();
  for (auto _ : state) {
    const auto decided = monitor::evaluate(models, all, TimePoint{}, all.back().time);
    if (!decided.empty()) state.SkipWithError("something is violated");
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(all.size()));
}

// `listening` monitors of what is recorded, and others that listen to nothing of it.
std::vector<monitor::Model> many(std::size_t listening, std::size_t idle) {
  std::vector<monitor::Model> models;
  for (std::size_t i = 0; i < listening; ++i)
    models.push_back(model("always level >= " + std::to_string(i % 20), "Listens" + std::to_string(i)));
  for (std::size_t i = 0; i < idle; ++i) {
    const std::string n = std::to_string(i);
    models.push_back(
        model("whenever event(other" + n + ".method.request), event(other" + n + ".method.reply) within 1 s",
              "Idle" + n, nullptr));
  }
  return models;
}

}  // namespace

int main(int argc, char** argv) {
  const auto bench = [](const std::string& name, std::vector<monitor::Model> models) {
    benchmark::RegisterBenchmark(name.c_str(), [models = std::move(models)](benchmark::State& s) {
      run(s, models);
    })->Unit(benchmark::kMillisecond);
  };
  for (const Pair& pair : kPairs) {
    bench(std::string(pair.name) + "/synthesized", {model(pair.requirement)});
    bench(std::string(pair.name) + "/drawn", {drawn(pair.drawn)});
  }
  bench("always_beside_idle/0", many(1, 0));
  bench("always_beside_idle/999", many(1, 999));
  bench("none_listens/1000", many(0, 1000));
  bench("ten_of_1000_listen", many(10, 990));
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
