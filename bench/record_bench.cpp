// What recording costs: an observation as the run's thread pays it, and from message to file.

#include <benchmark/benchmark.h>

#include <cstdio>
#include <filesystem>

#include "sentree/record/observation.h"
#include "sentree/record/reader.h"
#include "sentree/record/recorder.h"
#include "sentree/record/schemas.h"

namespace sentree::record {
namespace {

// A reply as the battery of the recharge mission gives it, the most frequent observation there.
Message reply(std::uint64_t number) {
  Message message;
  message.sequence = number;
  message.time = TimePoint(Duration(static_cast<std::int64_t>(number) * 1'000'000));
  message.stamp = number;
  message.kind = MessageKind::kReply;
  message.source = "BatteryLevelAbove30";
  message.target = "battery";
  message.name = "battery.getBatteryState.reply";
  message.call = number;
  message.tick = number / 20;
  message.data = Map{{"args", Map()},
                     {"result", Map{{"header", Map{{"stamp", 12.34}, {"frame_id", "base_link"}}},
                                    {"voltage", 27.43},
                                    {"current", -3.2},
                                    {"percentage", 0.5123456},
                                    {"temperature", 24.4},
                                    {"power_supply_status", "DISCHARGING"},
                                    {"warning", "NONE"},
                                    {"present", true}}}};
  return message;
}

void append_one_observation(benchmark::State& state) {
  const Message message = reply(1000);
  std::string out;
  for (auto _ : state) {
    out.clear();
    append_observation(out, message);
    benchmark::DoNotOptimize(out.data());
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(append_one_observation);

// Everything: JSON, chunk, checksum, compression, write; the writer's thread is waited for.
void record_observations(benchmark::State& state) {
  constexpr std::uint64_t kMessages = 200'000;
  const std::string file = (std::filesystem::temp_directory_path() / "sentree-record-bench.mcap").string();
  Message message = reply(1);
  for (auto _ : state) {
    auto sink = FileSink::create(file);
    Recorder recorder(std::move(*sink), {.flush_every = Duration(0), .wait_when_full = true});
    const ChannelId channel = recorder.add_channel("/observations", "sentree.Observation", schemas::kObservation);
    for (std::uint64_t i = 1; i <= kMessages; ++i) {
      message.sequence = i;
      message.time = TimePoint(Duration(static_cast<std::int64_t>(i) * 1'000'000));
      recorder.pack(channel, message.time, [&](PackedJson& out) { pack_observation(out, message); });
    }
    recorder.close();
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kMessages));
  std::remove(file.c_str());
}
BENCHMARK(record_observations)->UseRealTime()->MeasureProcessCPUTime()->Unit(benchmark::kMillisecond);

void read_observations(benchmark::State& state) {
  constexpr std::uint64_t kMessages = 50'000;
  const std::string file = (std::filesystem::temp_directory_path() / "sentree-record-bench.mcap").string();
  {
    auto sink = FileSink::create(file);
    Recorder recorder(std::move(*sink), {.flush_every = Duration(0), .wait_when_full = true});
    const ChannelId channel = recorder.add_channel("/observations", "sentree.Observation", schemas::kObservation);
    for (std::uint64_t i = 1; i <= kMessages; ++i) {
      const Message message = reply(i);
      recorder.pack(channel, message.time, [&](PackedJson& out) { pack_observation(out, message); });
    }
  }
  for (auto _ : state) {
    auto reader = Reader::open(file);
    (void)(*reader)->read({}, [](const RawMessage& message) {
      benchmark::DoNotOptimize(read_observation(message));
      return true;
    });
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kMessages));
  std::remove(file.c_str());
}
BENCHMARK(read_observations)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace sentree::record

BENCHMARK_MAIN();
