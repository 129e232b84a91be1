// Any JSON as the data of an event, and as a saved session: native expressions, scripts and `restore` survive it.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "sentree/scxml/chart.h"
#include "sentree/scxml/step.h"
#include "sentree/text/json.h"

namespace {

constexpr std::string_view kChart =
    R"xml(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
  <datamodel><data id="x"/><data id="n" expr="0"/></datamodel>
  <state id="a">
    <transition event="e" cond="_event.data.level &gt; n || _event.data.result.name === 'x'"><assign location="x" expr="_event.data.level"/></transition>
    <transition event="e" cond="typeof _event.data === 'object'"><assign location="x" expr="_event.data"/><assign location="n" expr="n + 1"/></transition>
    <transition event="e"><script>x = String(_event.data);</script></transition>
  </state></scxml>)xml";

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sentree;
  static const scxml::Chart chart = *scxml::load(kChart).value;
  const auto value = text::parse_json({reinterpret_cast<const char*>(data), size});
  if (!value) return 0;
  scxml::Session session;
  scxml::Effects effects;
  scxml::start(chart, session, {.data = {{"x", *value}}}, {}, effects);
  for (int i = 0; i < 2; ++i) scxml::step(chart, session, {.name = "e", .data = *value}, {}, effects);
  if (session.unsaveable()) return 0;
  const auto saved = scxml::save(chart, session);
  if (!saved || !(scxml::restore(chart, *saved).value() == session)) __builtin_trap();
  static_cast<void>(scxml::restore(chart, *value));
  return 0;
}
