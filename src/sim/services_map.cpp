#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "sentree/sim/detail/service_handlers.h"

namespace sentree::sim {

namespace {

bool is_known_map(const Context& c, std::string_view map_id) { return map_id.empty() || map_id == c.world.map_id; }

Value get_map(const Context& c) {
  const std::string id = c.args.text("map_id");
  if (!c.args.problem().empty()) return {};
  if (!is_known_map(c, id)) return occupancy_grid(c.state, "UNKNOWN_NAME", id, GridMap());
  return occupancy_grid(c.state, "OK", c.world.map_id, c.world.map);
}

Value map_names(const Context& c) { return List{c.world.map_id}; }

template <class Named>
Value names(const std::vector<Named>& items) {
  List list;
  for (const Named& item : items) list.emplace_back(item.name);
  return list;
}

template <class Named>
auto find_named(std::vector<Named>& items, std::string_view name) {
  return std::find_if(items.begin(), items.end(), [&](const Named& item) { return item.name == name; });
}

// Replaces what has the name, else adds it; false if there is no room for more.
template <class Named>
bool store(std::vector<Named>& items, Named item) {
  const auto known = find_named(items, item.name);
  if (known != items.end()) {
    *known = std::move(item);
    return true;
  }
  if (items.size() >= kLocationsMax) return false;
  items.push_back(std::move(item));
  return true;
}

// Locations, areas, paths and objects are kept alike. A name means one place: a location or an area.
template <auto Items>
Value list_names(const Context& c) {
  return names(c.state.*Items);
}

template <auto Items>
Value remove(const Context& c) {
  const std::string name = c.args.text("name");
  if (!c.args.problem().empty()) return {};
  const auto known = find_named(c.state.*Items, name);
  if (known == (c.state.*Items).end()) return return_code("UNKNOWN_NAME");
  (c.state.*Items).erase(known);
  return return_code("OK");
}

template <auto Items>
Value clear(const Context& c) {
  (c.state.*Items).clear();
  return return_code("OK");
}

bool is_place(const State& state, std::string_view name) {
  const auto is_named = [&](const auto& item) { return item.name == name; };
  return std::any_of(state.locations.begin(), state.locations.end(), is_named) ||
         std::any_of(state.areas.begin(), state.areas.end(), is_named);
}

template <auto Items>
Value rename(const Context& c) {
  const std::string name = c.args.text("name");
  const std::string wanted = c.args.text("new_name");
  if (!c.args.problem().empty()) return {};
  auto& items = c.state.*Items;
  const auto known = find_named(items, name);
  if (known == items.end() || wanted.empty()) return return_code("UNKNOWN_NAME");
  if (wanted == name) return return_code("OK");
  constexpr bool kPlaces = std::is_same_v<decltype(Items), std::vector<NamedLocation> State::*> ||
                           std::is_same_v<decltype(Items), std::vector<NamedArea> State::*>;
  if (find_named(items, wanted) != items.end() || (kPlaces && is_place(c.state, wanted))) return return_code("ERROR");
  known->name = wanted;
  return return_code("OK");
}

Value get_location(const Context& c) {
  const std::string name = c.args.text("name");
  if (!c.args.problem().empty()) return {};
  const auto known = find_named(c.state.locations, name);
  if (known == c.state.locations.end()) return Map{{"code", "UNKNOWN_NAME"}, {"location", location(c.world, {})}};
  return Map{{"code", "OK"}, {"location", location(c.world, known->pose, known->description)}};
}

Value store_location(const Context& c) {
  NamedLocation stored{.name = c.args.text("name")};
  std::string map_id;
  stored.pose = c.args.location("location", map_id, stored.description);
  if (!c.args.problem().empty()) return {};
  if (stored.name.empty() || !is_known_map(c, map_id)) return return_code("UNKNOWN_NAME");
  if (find_named(c.state.areas, stored.name) != c.state.areas.end()) return return_code("ERROR");
  return return_code(store(c.state.locations, std::move(stored)) ? "OK" : "OUT_OF_BOUNDS");
}

Value get_area(const Context& c) {
  const std::string name = c.args.text("name");
  if (!c.args.problem().empty()) return {};
  const auto known = find_named(c.state.areas, name);
  if (known == c.state.areas.end()) return Map{{"code", "UNKNOWN_NAME"}, {"area", area(c.world, {})}};
  return Map{{"code", "OK"}, {"area", area(c.world, *known)}};
}

Value store_area(const Context& c) {
  NamedArea stored{.name = c.args.text("name")};
  std::string map_id;
  stored.points = c.args.area("area", map_id, stored.description);
  if (!c.args.problem().empty()) return {};
  if (stored.name.empty() || !is_known_map(c, map_id)) return return_code("UNKNOWN_NAME");
  if (stored.points.size() < 3 || find_named(c.state.locations, stored.name) != c.state.locations.end()) {
    return return_code("ERROR");
  }
  return return_code(store(c.state.areas, std::move(stored)) ? "OK" : "OUT_OF_BOUNDS");
}

Value get_path(const Context& c) {
  const std::string name = c.args.text("name");
  if (!c.args.problem().empty()) return {};
  const auto known = find_named(c.state.paths, name);
  const bool found = known != c.state.paths.end();
  List poses;
  if (found) {
    for (const Pose2& pose : known->poses) poses.push_back(to_value(pose));
  }
  return Map{{"code", found ? "OK" : "UNKNOWN_NAME"},
             {"path", Map{{"header", header(c.state)}, {"poses", std::move(poses)}}}};
}

Value store_path(const Context& c) {
  NamedPath stored{.name = c.args.text("name"), .poses = c.args.path("path")};
  if (!c.args.problem().empty()) return {};
  if (stored.name.empty()) return return_code("UNKNOWN_NAME");
  if (stored.poses.empty()) return return_code("ERROR");
  return return_code(store(c.state.paths, std::move(stored)) ? "OK" : "OUT_OF_BOUNDS");
}

Value get_object(const Context& c) {
  const std::string name = c.args.text("name");
  if (!c.args.problem().empty()) return {};
  const auto known = find_named(c.state.objects, name);
  const bool found = known != c.state.objects.end();
  const NamedObject object = found ? *known : NamedObject{};
  const auto& p = object.pose;
  return Map{{"code", found ? "OK" : "UNKNOWN_NAME"},
             {"object", Map{{"map_id", c.world.map_id},
                            {"x", p[0]},
                            {"y", p[1]},
                            {"z", p[2]},
                            {"roll", p[3]},
                            {"pitch", p[4]},
                            {"yaw", p[5]},
                            {"description", object.description}}}};
}

Value store_object(const Context& c) {
  NamedObject stored{.name = c.args.text("name")};
  std::string map_id;
  stored.pose = c.args.object("object", map_id, stored.description);
  if (!c.args.problem().empty()) return {};
  if (stored.name.empty() || !is_known_map(c, map_id)) return return_code("UNKNOWN_NAME");
  return return_code(store(c.state.objects, std::move(stored)) ? "OK" : "OUT_OF_BOUNDS");
}

}  // namespace

std::span<const Method> map_server_methods() {
  static constexpr std::array kMethods{
      Method{"getMap", get_map},
      Method{"getMapNames", map_names},
      Method{"getLocationsList", list_names<&State::locations>},
      Method{"getLocation", get_location},
      Method{"storeLocation", store_location},
      Method{"deleteLocation", remove<&State::locations>},
      Method{"renameLocation", rename<&State::locations>},
      Method{"clearAllLocations", clear<&State::locations>},
      Method{"getAreasList", list_names<&State::areas>},
      Method{"getArea", get_area},
      Method{"storeArea", store_area},
      Method{"deleteArea", remove<&State::areas>},
      Method{"renameArea", rename<&State::areas>},
      Method{"clearAllAreas", clear<&State::areas>},
      Method{"getPathsList", list_names<&State::paths>},
      Method{"getPath", get_path},
      Method{"storePath", store_path},
      Method{"deletePath", remove<&State::paths>},
      Method{"renamePath", rename<&State::paths>},
      Method{"clearAllPaths", clear<&State::paths>},
      Method{"getObjectsList", list_names<&State::objects>},
      Method{"getObject", get_object},
      Method{"storeObject", store_object},
      Method{"deleteObject", remove<&State::objects>},
      Method{"renameObject", rename<&State::objects>},
      Method{"clearAllObjects", clear<&State::objects>},
  };
  return kMethods;
}

}  // namespace sentree::sim
