#include <benchmark/benchmark.h>
#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <optional>
#include <string>

#ifdef SENTREE_BENCH_PEER
#include "bt_peer.h"
#endif
#include "sentree/bt/encode.h"
#include "sentree/bt/load.h"
#include "sentree/bt/registry.h"
#include "sentree/bt/runner.h"
#include "sentree/bt/step.h"

// One iteration is one tick, or one load. Counters: nodes visited, ns per node, heap allocations per tick in the steady
// state.

namespace {

std::atomic<std::size_t> allocations{0};
std::atomic<std::size_t> held_bytes{0};  // with what malloc adds to round them up

}  // namespace

void* operator new(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  void* const memory = std::malloc(size);
  if (memory == nullptr) throw std::bad_alloc();
  held_bytes.fetch_add(malloc_usable_size(memory), std::memory_order_relaxed);
  return memory;
}
// Not inlined: g++ would see free() given what it believes to be operator new's.
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  if (memory != nullptr) held_bytes.fetch_sub(malloc_usable_size(memory), std::memory_order_relaxed);
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { operator delete(memory); }

namespace {

using namespace sentree;

std::string tree(const std::string& body, const std::string& more = {}) {
  return "<root BTCPP_format=\"4\" main_tree_to_execute=\"Main\"><BehaviorTree ID=\"Main\">" + body +
         "</BehaviorTree>" + more + "</root>";
}

std::string repeat(int count, const std::string& text) {
  std::string all;
  for (int i = 0; i < count; ++i) all += text;
  return all;
}

bt::Registry registry() {
  bt::Registry r;
  r.action("UserSync", [](bt::Context&) { return bt::Status::kSuccess; });
  r.action("AddOne", {bt::input<double>("in"), bt::output<double>("out")}, [](bt::Context& self) {
    const auto value = self.input<double>("in");
    if (!value) return bt::Status::kFailure;
    return self.output<double>("out", *value + 1.0) ? bt::Status::kSuccess : bt::Status::kFailure;
  });
  r.condition("BatteryLow", [](bt::Context&) { return bt::Status::kFailure; });
  r.condition("BatteryOk", [](bt::Context&) { return bt::Status::kSuccess; });
  struct GoTo {
    bt::Status on_start(bt::Context&) { return bt::Status::kRunning; }
    bt::Status on_running(bt::Context&) { return bt::Status::kRunning; }
    void on_halted(bt::Context&) {}
  };
  r.add<GoTo>("GoTo");
  struct Turn {
    bt::Status on_start(bt::Context&) { return bt::Status::kSuccess; }
    bt::Status on_running(bt::Context&) { return bt::Status::kSuccess; }
    void on_halted(bt::Context&) {}
  };
  r.add<Turn>("Turn");
  return r;
}

#ifdef SENTREE_BENCH_PEER
bool on_peer = false;  // the benchmark measures BehaviorTree.CPP instead of us
#endif

void tick(benchmark::State& bench, const std::string& xml, double visited, bool once_per_tick = true) {
#ifdef SENTREE_BENCH_PEER
  if (on_peer) return peer::tick(bench, xml, once_per_tick);
#endif
  const bt::Registry nodes = registry();
  auto loaded = bt::load(xml, {.registry = &nodes});
  if (!loaded.ok()) {
    bench.SkipWithError(to_string(loaded.diagnostics.front()).c_str());
    return;
  }
  bt::Runner runner(std::move(*loaded.value));
  for (int i = 0; i < 10; ++i) runner.tick();
  const std::size_t before = allocations;
  std::size_t ticks = 0;
  for (auto _ : bench) {
    benchmark::DoNotOptimize(once_per_tick ? runner.tick() : runner.tick_until_waiting());
    ++ticks;
  }
  bench.counters["allocs"] = static_cast<double>(allocations - before) / static_cast<double>(ticks);
  bench.counters["nodes"] = visited;
  bench.counters["s/node"] =
      benchmark::Counter(visited, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void sequence10(benchmark::State& s) {
  tick(s, tree("<Sequence>" + repeat(10, "<AlwaysSuccess/>") + "</Sequence>"), 11);
}
void sequence100(benchmark::State& s) {
  tick(s, tree("<Sequence>" + repeat(100, "<AlwaysSuccess/>") + "</Sequence>"), 101);
}
void sequence1000(benchmark::State& s) {
  tick(s, tree("<Sequence>" + repeat(1000, "<AlwaysSuccess/>") + "</Sequence>"), 1001);
}
void sequence100_user_sync(benchmark::State& s) {
  tick(s, tree("<Sequence>" + repeat(100, "<UserSync/>") + "</Sequence>"), 101);
}

void sequence100_conditions(benchmark::State& s) {
  tick(s, tree("<Sequence>" + repeat(100, "<BatteryOk/>") + "</Sequence>"), 101);
}
void sequence100_stateful(benchmark::State& s) {
  tick(s, tree("<Sequence>" + repeat(100, "<Turn/>") + "</Sequence>"), 101);
}
void reactive_sequence1000(benchmark::State& s) {
  tick(s, tree("<ReactiveSequence>" + repeat(999, "<BatteryOk/>") + "<GoTo/></ReactiveSequence>"), 1001);
}
void reactive_fallback1000(benchmark::State& s) {
  tick(s, tree("<ReactiveFallback>" + repeat(999, "<BatteryLow/>") + "<GoTo/></ReactiveFallback>"), 1001);
}
void parallel100_running(benchmark::State& s) {
  tick(s, tree("<Parallel success_count=\"-1\" failure_count=\"1\">" + repeat(100, "<GoTo/>") + "</Parallel>"), 101);
}
void parallel100_conditions(benchmark::State& s) {
  tick(s, tree("<Parallel success_count=\"-1\" failure_count=\"1\">" + repeat(100, "<BatteryOk/>") + "</Parallel>"),
       101);
}
void parallel_all100(benchmark::State& s) {
  tick(s, tree("<ParallelAll max_failures=\"1\">" + repeat(99, "<BatteryOk/>") + "<GoTo/></ParallelAll>"), 101);
}
void switch10x5(benchmark::State& s) {
  const std::string one =
      "<Switch5 variable=\"{mode}\" case_1=\"a\" case_2=\"b\" case_3=\"c\" case_4=\"d\" case_5=\"e\">" +
      repeat(6, "<BatteryOk/>") + "</Switch5>";
  tick(s, tree("<Sequence><Script code=\"mode := 'd'\"/>" + repeat(10, one) + "</Sequence>"), 22);
}

std::string mission(const std::string& battery, const std::string& at) {
  return tree("<ReactiveSequence><ReactiveFallback><ReactiveSequence><" + battery +
              "/><BatteryOk/></ReactiveSequence>"
              "<GoTo/></ReactiveFallback><ReactiveFallback><" +
              at + "/><GoTo/></ReactiveFallback></ReactiveSequence>");
}
void battery_ok_going_to_destination(benchmark::State& s) { tick(s, mission("BatteryOk", "BatteryLow"), 8); }
void battery_ok_going_to_destination_tick_once(benchmark::State& s) {
  tick(s, mission("BatteryOk", "BatteryLow"), 8, false);
}
void battery_low_going_to_charge(benchmark::State& s) { tick(s, mission("BatteryLow", "BatteryLow"), 5); }
void battery_ok_at_destination(benchmark::State& s) { tick(s, mission("BatteryOk", "BatteryOk"), 7); }

/// A complete ternary tree: Sequence, Fallback and Parallel in turn, all of whose leaves are visited. With `decorated`,
/// every second inner node is under an Inverter, a ForceSuccess or a ForceFailure.
std::string balanced(int depth, bool succeeds, bool decorated, int& inner, int& nodes) {
  ++nodes;
  if (depth == 0) return succeeds ? "<UserSync/>" : "<BatteryLow/>";
  const int number = inner++;
  std::string close;
  std::string text;
  if (decorated && number % 2 == 0) {
    ++nodes;
    const std::string tag = number % 4 == 0 ? "Inverter" : succeeds ? "ForceSuccess" : "ForceFailure";
    text = "<" + tag + ">";
    close = "</" + tag + ">";
    if (tag == "Inverter") succeeds = !succeeds;
  }
  const auto child = [&](bool success) { text += balanced(depth - 1, success, decorated, inner, nodes); };
  const bool fallback = number % 3 == 1;
  const std::string tag = fallback ? "Fallback" : number % 3 == 0 ? "Sequence" : "Parallel";
  text += "<" + tag + (tag == "Parallel" ? " success_count=\"3\"" : "") + ">";
  child(!fallback);
  child(!fallback);
  child(succeeds);
  return text + "</" + tag + ">" + close;
}
void balanced_tree(benchmark::State& s, bool decorated) {
  int inner = 0;
  int nodes = 0;
  const std::string body = balanced(6, true, decorated, inner, nodes);
  tick(s, tree(body), nodes);
}
void balanced_mixed_1093(benchmark::State& s) { balanced_tree(s, false); }
void balanced_decorated(benchmark::State& s) { balanced_tree(s, true); }

/// The recharge mission on its way to the kitchen; its leaves are skills, which answer after the step that asks them.
struct Recharge {
  Recharge() {
    auto loaded = bt::load_file(SENTREE_SOURCE_DIR "/examples/recharge/mission.xml");
    if (!loaded.ok()) return;
    tree.emplace(std::move(*loaded.value));
    state = bt::State(*tree);
    for (int i = 0; i < 10; ++i) tick();
  }
  void tick() {
    bt::StepResult result = bt::step(*tree, state, bt::Input::tick(), now, effects);
    while (result.waiting()) {
      const bool at_kitchen = result.leaf + 2 == tree->size();
      const bt::Status answer = tree->category(result.leaf) == bt::Category::kAction ? bt::Status::kRunning
                                : at_kitchen                                         ? bt::Status::kFailure
                                                                                     : bt::Status::kSuccess;
      result = bt::step(*tree, state, bt::Input::answer(result.leaf, answer), now, effects);
    }
  }
  std::optional<bt::Tree> tree;
  bt::State state;
  bt::Effects effects;
  TimePoint now{};
};
template <class Work>
void recharge(benchmark::State& bench, Work work) {
  Recharge mission;
  if (!mission.tree) return bench.SkipWithError("examples/recharge does not load");
  const std::size_t before = allocations;
  std::size_t count = 0;
  for (auto _ : bench) {
    work(mission);
    ++count;
  }
  bench.counters["allocs"] = static_cast<double>(allocations - before) / static_cast<double>(count);
  bench.counters["nodes"] = static_cast<double>(mission.tree->size());
}
void recharge_tick_of_4_suspended_skills(benchmark::State& s) {
  recharge(s, [](Recharge& mission) { mission.tick(); });
}
void recharge_copy_state(benchmark::State& s) {
  recharge(s, [](Recharge& mission) {
    bt::State copy = mission.state;
    benchmark::DoNotOptimize(copy);
  });
}
void recharge_encode_state(benchmark::State& s) {
  recharge(s, [form = std::string()](Recharge& mission) mutable {
    form.clear();
    benchmark::DoNotOptimize(bt::encode(*mission.tree, mission.state, mission.now, form));
  });
}

std::string ten_leaves() { return "<Sequence>" + repeat(10, "<AddOne in=\"{a}\" out=\"{b}\"/>") + "</Sequence>"; }
void subtree10x10_remapped_ports(benchmark::State& s) {
  tick(s,
       tree("<Sequence><Script code=\"x := 1.0\"/>" + repeat(10, "<SubTree ID=\"Ten\" a=\"{x}\" b=\"{y}\"/>") +
                "</Sequence>",
            "<BehaviorTree ID=\"Ten\">" + ten_leaves() + "</BehaviorTree>"),
       122);
}
void flat100_ports(benchmark::State& s) {
  tick(s,
       tree("<Sequence><Script code=\"a := 1.0\"/>" + repeat(100, "<AddOne in=\"{a}\" out=\"{b}\"/>") + "</Sequence>"),
       102);
}
void nested4_subtree_100_ports(benchmark::State& s) {
  std::string more;
  for (int i = 1; i <= 3; ++i) {
    more += "<BehaviorTree ID=\"T" + std::to_string(i) + "\"><SubTree ID=\"T" + std::to_string(i + 1) +
            "\" a=\"{a}\" b=\"{b}\"/></BehaviorTree>";
  }
  more += "<BehaviorTree ID=\"T4\"><Sequence>" + repeat(100, "<AddOne in=\"{a}\" out=\"{b}\"/>") +
          "</Sequence></BehaviorTree>";
  tick(s, tree("<Sequence><Script code=\"x := 1.0\"/><SubTree ID=\"T1\" a=\"{x}\" b=\"{y}\"/></Sequence>", more), 107);
}
void script10_increment(benchmark::State& s) {
  tick(s,
       tree("<Sequence><RunOnce then_skip=\"false\"><Script code=\"n := 1\"/></RunOnce>" +
            repeat(10, "<Script code=\"n += 1\"/>") + "</Sequence>"),
       12);
}
void skipIf100_false(benchmark::State& s) {
  tick(s,
       tree("<Sequence><Script code=\"n := 1\"/>" + repeat(100, "<AlwaysSuccess _skipIf=\"n &gt; 5\"/>") +
            "</Sequence>"),
       102);
}
void skipIf100_true(benchmark::State& s) {
  tick(s,
       tree("<Sequence><Script code=\"n := 9\"/>" + repeat(100, "<AlwaysSuccess _skipIf=\"n &gt; 5\"/>") +
            "</Sequence>"),
       102);
}

void post_conditions100(benchmark::State& s) {
  tick(s,
       tree("<Sequence><Script code=\"n := 1\"/>" + repeat(100, "<BatteryOk _onSuccess=\"n = 2\"/>") + "</Sequence>"),
       102);
}
void while100(benchmark::State& s) {
  tick(s, tree("<Sequence><Script code=\"n := 1\"/>" + repeat(100, "<BatteryOk _while=\"n &lt; 5\"/>") + "</Sequence>"),
       102);
}
void script_condition100(benchmark::State& s) {
  tick(s,
       tree("<Sequence><Script code=\"n := 1; m := 2\"/>" +
            repeat(100, "<ScriptCondition code=\"n &lt; 5 &amp;&amp; m == 2\"/>") + "</Sequence>"),
       102);
}

void load_tree(benchmark::State& bench, const std::string& xml) {
#ifdef SENTREE_BENCH_PEER
  if (on_peer) return peer::load(bench, xml);
#endif
  const bt::Registry nodes = registry();
  std::size_t size = 0;
  for (auto _ : bench) {
    auto loaded = bt::load(xml, {.registry = &nodes});
    if (!loaded.ok()) {
      bench.SkipWithError(to_string(loaded.diagnostics.front()).c_str());
      return;
    }
    size = loaded.value->size();
  }
  // What a tree and a state of it hold, the registry's nodes not counted.
  const std::size_t before = held_bytes;
  auto loaded = bt::load(xml, {.registry = &nodes});
  loaded.diagnostics = {};
  const bt::State state(*loaded.value);
  bench.counters["nodes"] = static_cast<double>(size);
  bench.counters["B/node"] = static_cast<double>(held_bytes - before) / static_cast<double>(size);
}
void load_plain(benchmark::State& s) {
  load_tree(
      s, tree("<Sequence>" + repeat(static_cast<int>(s.range(0)), "<AlwaysSuccess name=\"abcd\"/>\n") + "</Sequence>"));
}
void load_ports(benchmark::State& s) {
  load_tree(s,
            tree("<Sequence>" + repeat(static_cast<int>(s.range(0)), "<AddOne in=\"{abcdef}\" out=\"{bcdefg}\"/>\n") +
                 "</Sequence>"));
}
void load_skip_if(benchmark::State& s) {
  load_tree(s, tree("<Sequence><Script code=\"n := 1\"/>" +
                    repeat(static_cast<int>(s.range(0)), "<AlwaysSuccess name=\"abcd\" _skipIf=\"n &gt; 5\"/>\n") +
                    "</Sequence>"));
}
void load_unique_keys(benchmark::State& s) {
  std::string leaves;
  for (int i = 0; i < s.range(0); ++i) {
    const std::string number = std::to_string(i);
    leaves += "<AddOne in=\"{in_" + number + "}\" out=\"{out_" + number + "}\"/>\n";
  }
  load_tree(s, tree("<Sequence>" + leaves + "</Sequence>"));
}

// Side by side, so that whatever else the machine does slows both.
#ifdef SENTREE_BENCH_PEER
template <void (*kMeasure)(benchmark::State&)>
void measure_peer(benchmark::State& bench) {
  on_peer = true;
  kMeasure(bench);
  on_peer = false;
}
#define MEASURE(name, ...)     \
  BENCHMARK(name) __VA_ARGS__; \
  BENCHMARK(measure_peer<name>)->Name("BehaviorTree.CPP:" #name) __VA_ARGS__
#else
#define MEASURE(name, ...) BENCHMARK(name) __VA_ARGS__
#endif

// Leaves that people have: skills, conditions and actions in C++, with and without ports.
BENCHMARK(recharge_tick_of_4_suspended_skills);
BENCHMARK(recharge_copy_state);
BENCHMARK(recharge_encode_state);
MEASURE(battery_ok_going_to_destination);
MEASURE(battery_ok_going_to_destination_tick_once);
MEASURE(battery_low_going_to_charge);
MEASURE(battery_ok_at_destination);
MEASURE(sequence100_user_sync);
MEASURE(sequence100_conditions);
MEASURE(sequence100_stateful);
MEASURE(reactive_sequence1000);
MEASURE(reactive_fallback1000);
MEASURE(parallel100_running);
MEASURE(parallel100_conditions);
MEASURE(parallel_all100);
MEASURE(switch10x5);
MEASURE(balanced_mixed_1093);
MEASURE(balanced_decorated);
MEASURE(subtree10x10_remapped_ports);
MEASURE(flat100_ports);
MEASURE(nested4_subtree_100_ports);
// Built-in leaves and scripts.
MEASURE(script10_increment);
MEASURE(skipIf100_false);
MEASURE(skipIf100_true);
MEASURE(while100);
MEASURE(post_conditions100);
MEASURE(script_condition100);
MEASURE(sequence10);
MEASURE(sequence100);
MEASURE(sequence1000);
MEASURE(load_plain, ->Arg(1000)->Arg(10000));
MEASURE(load_ports, ->Arg(1000)->Arg(10000));
MEASURE(load_skip_if, ->Arg(1000)->Arg(10000));
MEASURE(load_unique_keys, ->Arg(1000)->Arg(10000));

}  // namespace

#ifdef SENTREE_BENCH_PEER
int main(int argc, char** argv) { return sentree::peer::main(argc, argv); }
#else
BENCHMARK_MAIN();
#endif
