// Reads the bytes as JSON; what was read is written and read again, and must be the same.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "sentree/text/json.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto value = sentree::text::parse_json({reinterpret_cast<const char*>(data), size});
  if (!value) return 0;
  const auto again = sentree::text::parse_json(to_json(*value));
  if (!again || !(*again == *value)) std::abort();
  return 0;
}
