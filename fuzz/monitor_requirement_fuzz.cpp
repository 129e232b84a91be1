#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "sentree/monitor/monitor.h"
#include "sentree/monitor/requirement.h"

// Requirements are read or refused. What is read is written so that it reads back alike, and becomes a chart that
// loads.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sentree;
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto file = monitor::parse_requirements(text, "fuzz.req");
  if (file.ok() == has_errors(file.diagnostics)) std::abort();
  if (!file.ok()) return 0;
  for (const monitor::Requirement& requirement : file.value->requirements) {
    const auto model = monitor::Model::make(requirement);
    if (model.ok() == has_errors(model.diagnostics)) std::abort();
  }
  return 0;
}
