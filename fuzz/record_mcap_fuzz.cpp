// Reads the bytes as a recording: everything in it, in order, within bounds.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "sentree/record/observation.h"
#include "sentree/record/reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view file(reinterpret_cast<const char*>(data), size);
  auto reader = sentree::record::Reader::open(std::make_unique<sentree::record::StringSource>(file), "fuzz.mcap");
  if (!reader) return 0;
  std::uint64_t last = 0;
  (void)(*reader)->read({}, [&](const sentree::record::RawMessage& message) {
    if (message.log_time < last) std::abort();
    last = message.log_time;
    (void)sentree::record::read_observation(message);
    return true;
  });
  for (const auto& index : (*reader)->attachments()) (void)(*reader)->attachment(index);
  for (const auto& index : (*reader)->metadata()) (void)(*reader)->metadata(index);
  return 0;
}
