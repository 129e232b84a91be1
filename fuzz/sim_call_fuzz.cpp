// A world file, a zero octet, then lines "service method json": whatever they ask, there is an answer or a message, and
// the state that results can be saved and restored.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "sentree/sim/services.h"
#include "sentree/text/json.h"

namespace {

constexpr int kCallsMax = 20;

// A hall of 3 m x 3 m, whatever file is asked for.
sentree::Result<std::string> file(const std::string& name) {
  if (name.ends_with(".yaml")) return "image: hall.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n";
  std::string pgm = "P2 30 30 1\n";
  for (int i = 0; i < 900; ++i) pgm += i < 30 || i >= 870 || i % 30 == 0 || i % 30 == 29 ? "0 " : "1 ";
  return pgm;
}

std::string_view word(std::string_view& line) {
  const std::size_t end = line.find(' ');
  const std::string_view first = line.substr(0, end);
  line.remove_prefix(end == std::string_view::npos ? line.size() : end + 1);
  return first;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sentree;
  std::string_view input(reinterpret_cast<const char*>(data), size);
  const std::size_t split = input.find('\0');
  Loaded<sim::World> world = sim::parse_world(input.substr(0, split), "w.yaml", file);
  if (world.ok() == has_errors(world.diagnostics)) std::abort();
  if (!world.ok() || split == std::string_view::npos) return 0;
  // What a run may cost, not what it may do.
  if (world.value->robots.size() > 2 || world.value->robots[0].localization.particles_max > 2000 ||
      world.value->robots[0].laser.beams > 1000 || world.value->step < std::chrono::milliseconds(5)) {
    return 0;
  }
  sim::State state = sim::initial_state(*world.value, 1);
  input.remove_prefix(split + 1);
  TimePoint now{};
  for (int i = 0; i < kCallsMax && !input.empty(); ++i) {
    std::string_view line = input.substr(0, input.find('\n'));
    input.remove_prefix(std::min(input.size(), line.size() + 1));
    const std::string_view service = word(line);
    const std::string_view method = word(line);
    if (method == "step" || method == "setTimeFactor") continue;
    const auto args = text::parse_json(line);
    if (!args || args->as_map() == nullptr) continue;
    (void)sim::call(*world.value, state, {.service = service, .method = method, .args = *args->as_map()}, now);
    now += std::chrono::milliseconds(200);
  }
  const auto restored = sim::restore(*world.value, sim::save(state));
  if (!restored || !(*restored == state)) std::abort();
  return 0;
}
