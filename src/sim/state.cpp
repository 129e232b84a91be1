#include "sentree/sim/state.h"

#include <bit>
#include <cmath>
#include <cstddef>
#include <utility>

#include "sentree/sim/archive.h"

namespace sentree::sim {

namespace {

// Hashing.

struct Hasher {
  std::uint64_t value = 0;

  void operator()(std::string_view, bool v) { mix(v ? 1U : 0U); }
  template <class T>
  requires(std::is_integral_v<T> || std::is_enum_v<T>) void operator()(std::string_view, const T& v) {
    mix(static_cast<std::uint64_t>(v));
  }
  // -0.0 == 0.0, so they hash alike.
  void operator()(std::string_view, double v) { mix(std::bit_cast<std::uint64_t>(v + 0.0)); }
  void operator()(std::string_view, TimePoint v) { mix(static_cast<std::uint64_t>(v.time_since_epoch().count())); }
  void operator()(std::string_view, const std::string& v) { mix(hash_bytes(v)); }
  void operator()(std::string_view, const Rng& v) { mix(v.state()); }
  template <class T>
  void operator()(std::string_view name, const std::vector<T>& items) {
    for (const T& item : items) (*this)(name, item);
    mix(items.size());
  }
  template <class T, std::size_t N>
  void operator()(std::string_view name, const std::array<T, N>& items) {
    for (const T& item : items) (*this)(name, item);
  }
  template <class T>
  requires(std::is_class_v<T>) void operator()(std::string_view, const T& object) { visit_members(object, *this); }
  void mix(std::uint64_t v) { value = hash_combine(value, v); }
};

// Saving.

struct Saver {
  Map map;

  void operator()(std::string_view name, const auto& member) { map[name] = saved(member); }

  static Value saved(bool v) { return v; }
  // Unsigned words keep their bits.
  template <class T>
  requires(std::is_integral_v<T> || std::is_enum_v<T>) static Value saved(T v) { return static_cast<std::int64_t>(v); }
  static Value saved(double v) { return v; }
  static Value saved(TimePoint v) { return static_cast<std::int64_t>(v.time_since_epoch().count()); }
  static Value saved(const std::string& v) { return v; }
  static Value saved(const Rng& v) { return static_cast<std::int64_t>(v.state()); }
  template <class T>
  static Value saved(const std::vector<T>& items) {
    List list;
    list.reserve(items.size());
    for (const T& item : items) list.push_back(saved(item));
    return list;
  }
  template <class T, std::size_t N>
  static Value saved(const std::array<T, N>& items) {
    List list;
    for (const T& item : items) list.push_back(saved(item));
    return list;
  }
  template <class T>
  requires(std::is_class_v<T>) static Value saved(const T& object) {
    Saver inner;
    visit_members(object, inner);
    return std::move(inner.map);
  }
};

// Restoring. The first thing that does not fit is remembered by its path; the rest is left as it is.

struct Restorer {
  const Value* from;
  std::string path;
  std::string* problem;

  template <class T>
  void operator()(std::string_view name, T& member) {
    if (!problem->empty()) return;
    const Value* value = from->find(name);
    const std::string here = path.empty() ? std::string(name) : path + "." + std::string(name);
    if (value == nullptr)
      *problem = here + " is missing";
    else
      restored(*value, here, member);
  }

  void wrong(const std::string& here, const Value& value) const {
    if (problem->empty()) *problem = here + " is " + std::string(to_string(value.type()));
  }
  void restored(const Value& value, const std::string& here, bool& out) const {
    if (const bool* v = value.as_bool())
      out = *v;
    else
      wrong(here, value);
  }
  template <class T>
  requires(std::is_integral_v<T> || std::is_enum_v<T>) void restored(const Value& value, const std::string& here,
                                                                     T& out) const {
    const std::int64_t* v = value.as_int();
    if (v == nullptr) return wrong(here, value);
    out = static_cast<T>(*v);
    if (static_cast<std::int64_t>(out) != *v) *problem = here + " is out of range";
  }
  void restored(const Value& value, const std::string& here, double& out) const {
    const double* v = value.as_double();
    if (v == nullptr) return wrong(here, value);
    out = *v;
  }
  void restored(const Value& value, const std::string& here, TimePoint& out) const {
    std::int64_t ns = 0;
    restored(value, here, ns);
    out = TimePoint(Duration(ns));
  }
  void restored(const Value& value, const std::string& here, std::string& out) const {
    if (const std::string* v = value.as_string())
      out = *v;
    else
      wrong(here, value);
  }
  void restored(const Value& value, const std::string& here, Rng& out) const {
    std::int64_t word = 0;
    restored(value, here, word);
    out = Rng(static_cast<std::uint64_t>(word));
  }
  template <class T>
  void restored(const Value& value, const std::string& here, std::vector<T>& out) const {
    const List* list = value.as_list();
    if (list == nullptr) return wrong(here, value);
    out.assign(list->size(), T{});
    for (std::size_t i = 0; i < list->size() && problem->empty(); ++i) {
      restored((*list)[i], here + "[" + std::to_string(i) + "]", out[i]);
    }
  }
  template <class T, std::size_t N>
  void restored(const Value& value, const std::string& here, std::array<T, N>& out) const {
    const List* list = value.as_list();
    if (list == nullptr || list->size() != N) return wrong(here, value);
    for (std::size_t i = 0; i < N; ++i) restored((*list)[i], here + "[" + std::to_string(i) + "]", out[i]);
  }
  template <class T>
  requires(std::is_class_v<T>) void restored(const Value& value, const std::string& here, T& out) const {
    if (value.as_map() == nullptr) return wrong(here, value);
    visit_members(out, Restorer{&value, here, problem});
  }
};

// What indices of a state may be: everything else that is well formed is harmless.
std::string broken_reference(const World& world, const State& state) {
  if (state.robots.size() != world.robots.size()) {
    return "it has " + std::to_string(state.robots.size()) + " robots and the world " +
           std::to_string(world.robots.size());
  }
  if (state.time < TimePoint{} || state.time.time_since_epoch() % world.step != Duration(0)) {
    return "time is no multiple of the world's step";
  }
  for (std::size_t i = 0; i < state.robots.size(); ++i) {
    const RobotState& robot = state.robots[i];
    const Navigator& navigator = robot.navigator;
    const std::string name = "robots[" + std::to_string(i) + "]";
    if (robot.station < -1 || robot.station >= static_cast<int>(world.stations.size()))
      return name + ".station is none";
    if (is_active(navigator.status) && !navigator.goal.waypoints.empty() &&
        navigator.waypoint >= navigator.goal.waypoints.size()) {
      return name + ".navigator.waypoint is beyond the goal's last";
    }
    if (robot.scan.ranges.size() != static_cast<std::size_t>(world.robots[i].laser.beams)) {
      return name + ".scan has another number of beams";
    }
    const auto slots = world.robots[i].costs.weights().size();
    for (const std::uint32_t slot : navigator.seen) {
      if (slot >= slots) return name + ".navigator.seen names a cell outside the map";
    }
  }
  return {};
}

}  // namespace

std::uint64_t State::hash() const {
  Hasher hasher;
  visit_members(*this, hasher);
  return hasher.value;
}

Value save(const State& state) { return Saver::saved(state); }

Result<State> restore(const World& world, const Value& saved) {
  State state;
  std::string problem;
  Restorer{&saved, {}, &problem}.restored(saved, {}, state);
  if (problem.empty()) problem = broken_reference(world, state);
  if (!problem.empty()) return fail("sim.bad-state", "the saved state does not fit this world: " + problem);
  return state;
}

}  // namespace sentree::sim
