// Any bytes as an SCXML document: loading and checking end with a chart or a message, never with a crash.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "sentree/graph/chart.h"
#include "sentree/scxml/chart.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 100'000) return 0;
  const auto loaded = sentree::scxml::load({reinterpret_cast<const char*>(data), size}, "fuzz.scxml");
  if (loaded.ok())
    static_cast<void>(sentree::graph::drawing_of(*loaded.value));
  else if (loaded.diagnostics.empty())
    __builtin_trap();
  return 0;
}
