#pragma once

#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/value.h"
#include "sentree/sim/world.h"

namespace sentree::cli {

/// Sends robots to places, one after the other: what --goto asks for.
class Tour {
 public:
  using Call = std::function<Result<Value>(const std::string& robot, const std::string& method, const Map& arguments)>;

  /// Each of `stops` is "PLACE" (the first robot goes) or "ROBOT=PLACE"; a place is a location or an area.
  /// Errors: cli.unknown-robot, cli.unknown-place, with a suggestion.
  [[nodiscard]] static Result<Tour> parse(const sim::World& world, const std::vector<std::string>& stops);

  /// Starts what is next for each robot that is not under way; `call` reaches the robots' Navigation.
  void step(const Call& call);
  /// All stops were reached or given up.
  [[nodiscard]] bool is_over() const { return over_; }
  /// "PLACE: ABORTED NO_VALID_PATH (…)" for each that was not reached.
  [[nodiscard]] const std::vector<std::string>& missed() const { return missed_; }

 private:
  struct Robot {
    std::deque<std::string> stops;
    std::string under_way;
  };
  std::map<std::string, Robot> robots_;
  std::vector<std::string> missed_;
  bool over_ = true;
};

}  // namespace sentree::cli
