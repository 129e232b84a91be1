// A model of a component that does what the bytes say: it is refused, or what the mission does with it is the same
// whether steps are looked up or each is executed.

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

#include "sentree/base/assert.h"
#include "sentree/project/part_cache.h"
#include "sentree/project/plan.h"
#include "sentree/text/overlay.h"
#include "sentree/verify/detail/test_graphs.h"
#include "sentree/verify/verify.h"

namespace {

using namespace sentree;

// How often an exploration asks whether it is to end, before it is: once for each state, and for every 64 ways.
constexpr int kAskedMax = 40;

// A chart of up to three states; each byte decides something.
class ModelWriter {
 public:
  ModelWriter(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}

  std::string operator()() {
    std::string text =
        "<scxml xmlns='http://www.w3.org/2005/07/scxml' version='1.0' datamodel='ecmascript' initial='s0'><datamodel>"
        "<data id='v' expr='" +
        pick({"0", "1", "choose(0, 2)", "between(0, 3)"}) + "'/></datamodel>";
    const std::size_t states = 1 + below(3);
    for (std::size_t i = 0; i < states; ++i) {
      text += "<state id='s" + std::to_string(i) + "'><onentry>" +
              (i == 0 ? "<send event='e' id='t' delay='50ms'/>" : "") + actions(0) + "</onentry>";
      for (const char* event : {"hand.open.request", "hand.close.request", "e", "f", "error"}) {
        // Calls that nobody takes are refused, mostly.
        if (std::string_view(event).size() < 10 && below(2) == 0) continue;
        // What follows from itself at once would go on for ever.
        const bool follows = std::string_view(event) == "f" || std::string_view(event) == "error";
        text += "<transition event='" + std::string(event) + "'";
        if (below(3) == 0) text += pick({" cond='v === 1'", " cond='v &lt; 2'", " cond='In(\"s1\")'"});
        if (!follows && below(2) == 0) text += " target='s" + std::to_string(below(states)) + "'";
        text += ">" + (follows ? "<assign location='v' expr='1'/>" : actions(0)) + "</transition>";
      }
      text += "</state>";
    }
    return text + "</scxml>";
  }

 private:
  std::size_t below(std::size_t bound) { return at_ < size_ ? data_[at_++] % bound : 0; }
  std::string pick(std::initializer_list<const char*> words) { return *(words.begin() + below(words.size())); }
  std::string expression() {
    return pick({"0", "1", "v + 1", "(v + 1) % 3", "choose(0, 1)", "between(0, 2)", "pick('p', v, 1, 2)", "fresh()",
                 "draw([[0.5, 0], [0.5, v]])", "chance(0.3) ? 1 : 2", "fresh() % 2", "choose()", "between(2, 1)",
                 "draw([[0.5, 1]])", "null", "{a: v}", "v.a"});
  }
  std::string delay() { return pick({"", " delay='0s'", " delay='20ms'", " delay='100ms'", " delay='130ms'"}); }
  std::string actions(int depth) {
    std::string text;
    while (below(3) != 0) {
      switch (below(depth < 3 ? 8 : 7)) {
        case 0: text += "<assign location='v' expr=\"" + expression() + "\"/>"; break;
        case 1: text += "<send type='thrift' target='hand' event='open.reply'" + delay() + "/>"; break;
        case 2:
          text += "<send type='thrift' target='hand' event='close.reply'" + delay() + "><param name='result' expr=\"" +
                  pick({"v === 1", "true", "chance(0.7)", "choose(true, false)", "v"}) + "\"/></send>";
          break;
        case 3: text += "<send type='thrift' target='hand' event='" + pick({"open", "close"}) + ".error'/>"; break;
        case 4: text += "<send event='e' id='t' delay='" + pick({"20", "50", "100", "130"}) + "ms'/>"; break;
        case 5: text += "<raise event='f'/>"; break;
        case 6: text += "<cancel sendid='t'/>"; break;
        case 7:
          text += "<if cond=\"" + pick({"choose(true, false)", "v === 1", "chance(0.5)"}) + "\">";
          text += actions(depth + 1) + "</if>";
          break;
      }
    }
    return text;
  }

  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t at_ = 0;
};

Result<verify::Graph> explore(const project::Plan& plan, bool memory_of_steps) {
  verify::Options options;
  options.faults = plan.scenario.project.verify.faults;
  options.ticks = 4;
  options.reduce_orders = false;
  options.memory_of_steps = memory_of_steps;
  options.interrupted = [asked = 0]() mutable { return ++asked > kAskedMax; };
  return verify::explore(plan, options);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static project::PartCache cache;
  static const std::filesystem::path folder = project::shipped_folder("examples") / "grasp";
  const text::Overlay overlay{
      {std::filesystem::absolute(folder / "models/hand.scxml").lexically_normal(), ModelWriter(data, size)()}};
  const text::ReadThrough through(overlay);
  auto project = project::load_project(folder);
  SENTREE_ASSERT(project.ok());
  const auto plan = project::prepare(verify::with_models(project::plain_scenario(std::move(*project.value))), cache);
  if (!plan.ok() || has_errors(verify::obstacles(*plan.value))) return 0;
  const auto remembered = explore(*plan.value, true);
  const auto executed = explore(*plan.value, false);
  std::string difference;
  if (remembered.has_value() != executed.has_value())
    difference = remembered ? to_string(executed.error()) : to_string(remembered.error());
  else if (remembered)
    difference = verify::difference(*remembered, *executed);
  else if (remembered.error().code != executed.error().code)
    difference = to_string(remembered.error()) + ", " + to_string(executed.error());
  if (difference.empty()) return 0;
  std::fprintf(stderr, "not the same: %s\n", difference.c_str());
  std::abort();
}
