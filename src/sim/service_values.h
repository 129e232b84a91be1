#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/base/value.h"
#include "sentree/sim/state.h"
#include "sentree/sim/world.h"

namespace sentree::sim {

/// Between the simulator's types and the shapes of interfaces/robot.thrift.

/// A map of names and values, given in turn: without the copies that an initializer list makes.
template <class... Rest>
[[nodiscard]] Map record(Rest&&... names_and_values) {
  static_assert(sizeof...(Rest) % 2 == 0);
  Map map;
  map.reserve(sizeof...(Rest) / 2);
  const auto add = [&map](const auto& self, std::string_view name, auto&& value, auto&&... rest) -> void {
    map.append(std::string(name), Value(std::forward<decltype(value)>(value)));
    if constexpr (sizeof...(rest) > 0) self(self, std::forward<decltype(rest)>(rest)...);
  };
  if constexpr (sizeof...(Rest) > 0) add(add, std::forward<Rest>(names_and_values)...);
  return map;
}

/// The same into a value that may be a former answer: entries that it has already are used again.
class Record {
 public:
  Record(Value& out, std::size_t entries) {
    if (out.as_map() == nullptr) {
      out = Map();
      out.as_map()->reserve(entries);
    }
    map_ = out.as_map();
  }
  ~Record() {
    if (next_ < map_->size()) cut();
  }
  Record(const Record&) = delete;
  Record& operator=(const Record&) = delete;

  /// The next entry, with what it was.
  Value& entry(std::string_view name) {
    if (next_ < map_->size()) {
      auto& [known, value] = *(map_->begin() + static_cast<std::ptrdiff_t>(next_));
      if (known == name) {
        ++next_;
        return value;
      }
      cut();
    }
    map_->append(std::string(name), Value());
    return (map_->begin() + static_cast<std::ptrdiff_t>(next_++))->second;
  }
  void set(std::string_view name, Value value) { entry(name) = std::move(value); }
  void set(std::string_view name, double number) {
    Value& value = entry(name);
    // In place: most are numbers again.
    if (const double* const before = value.as_double())
      *const_cast<double*>(before) = number;
    else
      value = number;
  }
  void set(std::string_view name, std::string_view text) {
    Value& value = entry(name);
    if (value.as_string() == nullptr || *value.as_string() != text) value = text;
  }

 private:
  void cut();  // what is behind the last entry

  Map* map_ = nullptr;
  std::size_t next_ = 0;
};

[[nodiscard]] Value return_code(std::string_view name);  ///< "OK", "ERROR", …
[[nodiscard]] Value to_value(const Pose2& pose);
[[nodiscard]] Value to_value(Vec2 point);
[[nodiscard]] Value to_value(const Twist2& twist);
[[nodiscard]] Value to_value(NavigationStatus status);
[[nodiscard]] Value to_value(NavigationError error);
[[nodiscard]] Value to_value(LocalizationStatus status);
[[nodiscard]] Value to_value(PowerSupplyStatus status);
[[nodiscard]] Value to_value(BatteryWarning warning);
[[nodiscard]] Value header(const State& state, std::string_view frame = "map");
[[nodiscard]] Value location(const World& world, const Pose2& pose, std::string_view description = {});
void put_header(Value& out, const State& state, std::string_view frame = "map");
void put_location(Value& out, const World& world, const Pose2& pose, std::string_view description = {});
[[nodiscard]] Value area(const World& world, const NamedArea& area);
[[nodiscard]] Value odometry(const State& state, const Pose2& pose, const Twist2& twist, std::string_view frame);

/// An OccupancyGridReply.
[[nodiscard]] Value occupancy_grid(const State& state, std::string_view code, std::string_view map_id,
                                   const GridMap& map);

/// Takes the arguments of a call one by one. The first that is missing or of another type is remembered, with its
/// path; a default is returned for it.
class Arguments {
 public:
  explicit Arguments(const Map& args) : args_(args) {}

  [[nodiscard]] double number(std::string_view name);  ///< Finite.
  [[nodiscard]] std::int64_t integer(std::string_view name);
  [[nodiscard]] bool boolean(std::string_view name);
  [[nodiscard]] std::string text(std::string_view name);
  [[nodiscard]] Pose2 pose(std::string_view name);
  [[nodiscard]] Vec2 point(std::string_view name);
  [[nodiscard]] Twist2 twist(std::string_view name, double* sideways);
  /// The pose of a Location; `map_id` gets the map that it names.
  [[nodiscard]] Pose2 location(std::string_view name, std::string& map_id, std::string& description);
  [[nodiscard]] std::vector<Vec2> area(std::string_view name, std::string& map_id, std::string& description);
  [[nodiscard]] std::vector<Pose2> path(std::string_view name);
  [[nodiscard]] PoseEstimate estimate(std::string_view name);
  /// x, y, z, roll, pitch, yaw of a MapObject.
  [[nodiscard]] std::array<double, 6> object(std::string_view name, std::string& map_id, std::string& description);
  /// Position of the argument, an enumerator's name or number, in `names`.
  [[nodiscard]] std::size_t choice(std::string_view name, std::span<const std::string_view> names);

  /// What is wrong, or empty.
  [[nodiscard]] const std::string& problem() const { return problem_; }

 private:
  [[nodiscard]] const Value* member(const Value* of, std::string_view name, const std::string& path);
  [[nodiscard]] double number_in(const Value* of, std::string_view name, const std::string& path);
  [[nodiscard]] Pose2 pose_in(const Value* value, const std::string& path);
  [[nodiscard]] const Value* argument(std::string_view name);
  void wrong(const std::string& path, std::string_view expected, const Value* value);

  const Map& args_;
  std::string problem_;
};

}  // namespace sentree::sim
