#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include "sentree/sim/service_handlers.h"

namespace sentree::sim {

namespace {

Value grid_info(const World& world) {
  return Map{{"map_id", world.map_id},
             {"resolution", world.map.resolution_m()},
             {"width", world.map.width()},
             {"height", world.map.height()},
             {"origin", to_value(world.map.origin())}};
}

Value get_map(const Context& c) {
  const std::string id = c.args.text("map_id");
  if (!c.args.problem().empty()) return {};
  const bool known = id.empty() || id == c.world.map_id;
  Bytes data;
  if (known) {
    data.octets.reserve(c.world.map.cells().size());
    for (const std::int8_t cell : c.world.map.cells()) data.octets.push_back(static_cast<std::byte>(cell));
  }
  Value info =
      known
          ? grid_info(c.world)
          : Value(Map{{"map_id", id}, {"resolution", 0.0}, {"width", 0}, {"height", 0}, {"origin", to_value(Pose2{})}});
  return Map{{"code", known ? "OK" : "UNKNOWN_NAME"},
             {"grid", Map{{"header", header(c.state)}, {"info", std::move(info)}, {"data", std::move(data)}}}};
}

Value map_names(const Context& c) { return List{c.world.map_id}; }

template <class Named>
Value names(const std::vector<Named>& items) {
  List list;
  for (const Named& item : items) list.emplace_back(item.name);
  return list;
}

template <class Named>
auto find(std::vector<Named>& items, std::string_view name) {
  return std::find_if(items.begin(), items.end(), [&](const Named& item) { return item.name == name; });
}

// Replaces what has the name, else adds it; false if there is no room for more.
template <class Named>
bool store(std::vector<Named>& items, Named item) {
  const auto known = find(items, item.name);
  if (known != items.end()) {
    *known = std::move(item);
    return true;
  }
  if (items.size() >= kLocationsMax) return false;
  items.push_back(std::move(item));
  return true;
}

Value locations_list(const Context& c) { return names(c.state.locations); }
Value areas_list(const Context& c) { return names(c.state.areas); }

Value get_location(const Context& c) {
  const std::string name = c.args.text("name");
  if (!c.args.problem().empty()) return {};
  const auto known = find(c.state.locations, name);
  if (known == c.state.locations.end()) return Map{{"code", "UNKNOWN_NAME"}, {"location", location(c.world, {})}};
  return Map{{"code", "OK"}, {"location", location(c.world, known->pose, known->description)}};
}

Value store_location(const Context& c) {
  NamedLocation stored{.name = c.args.text("name")};
  std::string map_id;
  stored.pose = c.args.location("location", map_id, stored.description);
  if (!c.args.problem().empty()) return {};
  if (stored.name.empty() || (!map_id.empty() && map_id != c.world.map_id)) return return_code("UNKNOWN_NAME");
  // One name means one place.
  if (find(c.state.areas, stored.name) != c.state.areas.end()) return return_code("ERROR");
  return return_code(store(c.state.locations, std::move(stored)) ? "OK" : "OUT_OF_BOUNDS");
}

Value delete_location(const Context& c) {
  const std::string name = c.args.text("name");
  if (!c.args.problem().empty()) return {};
  const auto known = find(c.state.locations, name);
  if (known == c.state.locations.end()) return return_code("UNKNOWN_NAME");
  c.state.locations.erase(known);
  return return_code("OK");
}

Value get_area(const Context& c) {
  const std::string name = c.args.text("name");
  if (!c.args.problem().empty()) return {};
  const auto known = find(c.state.areas, name);
  if (known == c.state.areas.end()) return Map{{"code", "UNKNOWN_NAME"}, {"area", area(c.world, {})}};
  return Map{{"code", "OK"}, {"area", area(c.world, *known)}};
}

Value store_area(const Context& c) {
  NamedArea stored{.name = c.args.text("name")};
  std::string map_id;
  stored.points = c.args.area("area", map_id, stored.description);
  if (!c.args.problem().empty()) return {};
  if (stored.name.empty() || (!map_id.empty() && map_id != c.world.map_id)) return return_code("UNKNOWN_NAME");
  if (stored.points.size() < 3 || find(c.state.locations, stored.name) != c.state.locations.end()) {
    return return_code("ERROR");
  }
  return return_code(store(c.state.areas, std::move(stored)) ? "OK" : "OUT_OF_BOUNDS");
}

}  // namespace

std::span<const Method> map_server_methods() {
  static constexpr std::array kMethods{
      Method{"getMap", get_map},
      Method{"getMapNames", map_names},
      Method{"getLocationsList", locations_list},
      Method{"getLocation", get_location},
      Method{"storeLocation", store_location},
      Method{"deleteLocation", delete_location},
      Method{"getAreasList", areas_list},
      Method{"getArea", get_area},
      Method{"storeArea", store_area},
  };
  return kMethods;
}

}  // namespace sentree::sim
