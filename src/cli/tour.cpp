#include "sentree/cli/tour.h"

#include <fmt/format.h>

#include <array>

namespace sentree::cli {

Result<Tour> Tour::parse(const sim::World& world, const std::vector<std::string>& stops) {
  Tour tour;
  std::vector<std::string> places;
  for (const auto& location : world.locations) places.push_back(location.name);
  for (const auto& area : world.areas) places.push_back(area.name);
  std::vector<std::string> robots;
  for (const auto& robot : world.robots) robots.push_back(robot.name);
  for (const std::string& stop : stops) {
    const auto equals = stop.find('=');
    const std::string place = equals == std::string::npos ? stop : stop.substr(equals + 1);
    const std::string robot = equals == std::string::npos ? robots.front() : stop.substr(0, equals);
    if (!world.robot(robot))
      return fail("cli.unknown-robot",
                  fmt::format("--goto {}: the world has no robot \"{}\"{}", stop, robot, did_you_mean(robot, robots)));
    if (std::find(places.begin(), places.end(), place) == places.end())
      return fail("cli.unknown-place",
                  fmt::format("--goto {}: the world has no place \"{}\"{}", stop, place, did_you_mean(place, places)));
    tour.robots_[robot].stops.push_back(place);
    tour.over_ = false;
  }
  return tour;
}

void Tour::step(const Call& call) {
  over_ = true;
  for (auto& [name, robot] : robots_) {
    if (!robot.under_way.empty()) {
      const auto state = call(name, "getNavigationState", {});
      const std::string status(state ? state->find("status")->text() : "ERROR");
      constexpr std::array kEnds{"GOAL_REACHED", "IDLE", "ABORTED", "FAILING", "ERROR"};
      if (std::find(kEnds.begin(), kEnds.end(), status) == kEnds.end()) {
        over_ = false;
        continue;
      }
      if (status != "GOAL_REACHED") {
        std::string what = fmt::format("{}: {}", robot.under_way, status);
        if (state) what += fmt::format(" {}", state->find("error_code")->text());
        if (state && !state->find("error_msg")->text().empty())
          what += fmt::format(" ({})", state->find("error_msg")->text());
        missed_.push_back(std::move(what));
      }
      robot.under_way.clear();
    }
    if (robot.stops.empty()) continue;
    over_ = false;
    robot.under_way = robot.stops.front();
    robot.stops.pop_front();
    (void)call(name, "gotoTargetByLocationName", {{"name", robot.under_way}});
  }
}

}  // namespace sentree::cli
