// A saved run whose parts are what the bytes say: it is refused, or it is a state that is saved as the same.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "sentree/base/assert.h"
#include "sentree/base/encoder.h"
#include "sentree/base/packed.h"
#include "sentree/mission/state.h"
#include "sentree/project/plan.h"

namespace {

const sentree::project::Plan& plan() {
  static const sentree::project::Plan* plan = [] {
    auto scenario = sentree::project::load_scenario(sentree::project::shipped_folder("examples") /
                                                    "recharge/scenarios/experiment1.yaml");
    SENTREE_ASSERT(scenario.ok());
    auto loaded = sentree::project::prepare(std::move(*scenario.value));
    SENTREE_ASSERT(loaded.ok());
    return new sentree::project::Plan(std::move(*loaded.value));
  }();
  return *plan;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sentree;
  const std::string_view parts(reinterpret_cast<const char*>(data), size);
  if (const auto value = unpack(parts); value && unpack(pack(*value)) != value) std::abort();
  // With the header that belongs to them: a checksum keeps no one out who can compute it.
  std::string saved("SRUN");
  Encoder header(saved);
  header.word(1);
  header.word(plan().identity);
  header.word(hash_bytes(parts));
  saved += parts;
  const auto state = mission::restore(plan(), saved);
  if (!state) return 0;
  const auto again = mission::save(plan(), *state);
  if (!again) return 0;
  const auto restored = mission::restore(plan(), *again);
  if (!restored || !(*restored == *state)) std::abort();
  return 0;
}
