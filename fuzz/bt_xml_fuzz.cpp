#include <cstddef>
#include <cstdint>
#include <string>

#include "sentree/bt/load.h"
#include "sentree/bt/runner.h"
#include "sentree/bt/state.h"
#include "sentree/bt/write.h"
#include "sentree/graph/tree.h"

// A file loads or is refused with a message, as a tree to run and as one to look at; what loads can be ticked, halted,
// saved, restored and drawn, and stays the same when it is formatted.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sentree;
  const std::string xml(reinterpret_cast<const char*>(data), size);
  bt::LoadOptions options;
  options.read_file = [&xml](const std::filesystem::path&) -> Result<std::string> { return xml; };
  options.partial = true;
  if (const auto part = bt::load(xml, options, "fuzz.xml"); part.ok() && part.value->size() <= 2000)
    static_cast<void>(graph::drawing_of(*part.value));
  options.partial = false;
  auto loaded = bt::load(xml, options, "fuzz.xml");
  const auto formatted = bt::format(xml);
  if (!loaded.ok()) {
    if (loaded.diagnostics.empty()) __builtin_trap();
    return 0;
  }
  if (!formatted || *bt::format(*formatted) != *formatted) __builtin_trap();
  if (loaded.value->size() > 2000) return 0;
  static_cast<void>(graph::drawing_of(*loaded.value));
  bt::Runner runner(std::move(*loaded.value));
  for (int i = 0; i < 3; ++i) runner.tick(TimePoint(std::chrono::milliseconds(100 * i)));
  const auto saved = bt::save(runner.tree(), runner.state());
  if (!saved || !(bt::restore(runner.tree(), *saved).value() == runner.state())) __builtin_trap();
  runner.halt();
  return 0;
}
