#include "sentree/monitor/detail/windows.h"

#include <fmt/format.h>

#include "sentree/monitor/detail/chart_text.h"

namespace sentree::monitor {

namespace {

// The oldest has the second timer.
constexpr const char* kSecondTimer = "second_timer";

std::string stop_timer(bool second) { return fmt::format("<cancel sendid=\"deadline{}\"/>", second ? "_2" : ""); }

std::string by_timer(const std::string& of_second, const std::string& of_first) {
  return fmt::format("<if cond=\"{}\">{}<else/>{}</if>", kSecondTimer, of_second, of_first);
}

}  // namespace

std::string Windows::start_timer(bool second) const {
  return fmt::format("<send event=\"deadline\" id=\"deadline{}\" delay=\"{}\"/>", second ? "_2" : "",
                     delay(bound_.time));
}

std::vector<Windows::Datum> Windows::data() const {
  std::vector<Datum> data{{kNewer, "false", "something newer is owed too, from the present segment"}};
  if (in_time())
    data.push_back({kSecondTimer, "false", "the deadline of the oldest is the second one"});
  else
    data.push_back({clock_of_newer(), "0", clock() + " since the newer is owed"});
  return data;
}

Js Windows::newer_is_late() const {
  return bound_.unit == Bound::Unit::kTicks ? Js{fmt::format("{} > {}", clock_of_newer(), bound_.count), 5}
                                            : js_false();
}

Windows::Actions Windows::none() const {
  Actions actions{assign(kFromClosed, "false"), assign(kNewer, "false")};
  if (in_time()) {
    actions.insert(actions.end(), {stop_timer(false), stop_timer(true), assign(kSecondTimer, "false")});
  } else {
    actions.push_back(assign(clock(), "0"));
    actions.push_back(assign(clock_of_newer(), "0"));
  }
  return actions;
}

Windows::Actions Windows::begin() const { return in_time() ? Actions{start_timer(false)} : Actions(); }

Windows::Actions Windows::restart() const {
  if (!in_time()) return {assign(clock(), "0")};
  return {stop_timer(false), stop_timer(true), assign(kSecondTimer, "false"), start_timer(false)};
}

Windows::Actions Windows::restart_newer() const {
  if (!in_time()) return {assign(kNewer, "true"), assign(clock_of_newer(), "0")};
  return {assign(kNewer, "true"),
          by_timer(stop_timer(false) + start_timer(false), stop_timer(true) + start_timer(true))};
}

Windows::Actions Windows::end_oldest() const {
  Actions actions = close();
  actions.push_back(assign(kFromClosed, "false"));
  return actions;
}

Windows::Actions Windows::close() const {
  if (!in_time()) return {assign(clock(), clock_of_newer()), assign(clock_of_newer(), "0"), assign(kNewer, "false")};
  return {by_timer(stop_timer(true), stop_timer(false)), assign(kSecondTimer, fmt::format("!{}", kSecondTimer)),
          assign(kNewer, "false")};
}

std::string Windows::count_newer() const {
  if (in_time()) return {};
  return fmt::format("<if cond=\"{}\">{}</if>", kNewer, assign(clock_of_newer(), clock_of_newer() + " + 1"));
}

}  // namespace sentree::monitor
