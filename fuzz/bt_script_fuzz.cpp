#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "sentree/bt/load.h"
#include "sentree/bt/runner.h"
#include "sentree/bt/script.h"
#include "sentree/text/xml.h"

// A script compiles or is refused, and what compiles runs or fails; twice the same.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sentree;
  const std::string text(reinterpret_cast<const char*>(data), size);
  if (!bt::compile_script(text)) return 0;
  auto loaded = bt::load(
      "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\"><Sequence><Script code=\"n := 1; s := 'a'\"/>"
      "<Script code=\"" +
      text::xml_escape(text) + "\"/></Sequence></BehaviorTree></root>");
  if (!loaded.ok()) return 0;
  bt::Runner runner(std::move(*loaded.value));
  runner.tick();
  runner.tick();
  return 0;
}
