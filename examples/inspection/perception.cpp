// A perception node: looks at a place, some ticks long, and says how sure it is of what it saw.
#include <algorithm>
#include <string>

#include "sentree/bt/registry.h"

namespace bt = sentree::bt;

namespace {

/// The picture is a row of brightnesses; a real node would take them from a camera. Averaging over the ticks, as a
/// filter does, the node is surer the longer it looks. A dark place never gets beyond half.
struct Inspect {
  double sum = 0;
  int seen = 0;

  static bt::Ports ports() {
    return {bt::input<std::string>("place"), bt::input_default<double>("light", "0.9", "[0, 1]"),
            bt::input_default<int>("frames", "5", "pictures to look at"), bt::output<double>("confidence")};
  }

  bt::Status on_start(bt::Context& self) {
    sum = 0;
    seen = 0;
    return on_running(self);
  }

  bt::Status on_running(bt::Context& self) {
    const double light = std::clamp(self.input_or("light", 0.9), 0.0, 1.0);
    // Every second picture is blurred.
    sum += seen % 2 == 0 ? light : 0.8 * light;
    ++seen;
    if (seen < self.input_or("frames", 5)) return bt::Status::kRunning;
    const double confidence = sum / seen;
    if (!self.output("confidence", confidence)) return bt::Status::kFailure;
    return confidence > kSure ? bt::Status::kSuccess : bt::Status::kFailure;
  }

  void on_halted(bt::Context&) {}

  static constexpr double kSure = 0.6;

  sentree::Value save() const { return sentree::List{sum, seen}; }
  bool restore(const sentree::Value& saved) {
    const auto* list = saved.as_list();
    if (list == nullptr || list->size() != 2) return false;
    sum = (*list)[0].number();
    seen = static_cast<int>((*list)[1].number());
    return true;
  }
};

}  // namespace

SENTREE_REGISTER_NODES(registry) { registry.add<Inspect>("Inspect"); }
