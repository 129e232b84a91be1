#include "sentree/studio/subject.h"

#include <fmt/format.h>

#include <algorithm>

#include "sentree/base/json.h"
#include "sentree/draw/fold.h"
#include "sentree/draw/tree.h"
#include "sentree/graph/chart.h"
#include "sentree/graph/tree.h"
#include "sentree/idl/describe.h"
#include "sentree/monitor/requirement.h"
#include "sentree/project/check_intervention.h"

namespace sentree::studio {

namespace {

ShownChart shown(std::string id, bool is_monitor, std::string name, const scxml::Chart& chart) {
  std::vector<scxml::StateIndex> states;
  ShownChart shown{.id = std::move(id),
                   .is_monitor = is_monitor,
                   .name = std::move(name),
                   .chart = chart,
                   .drawing = graph::drawing_of(chart, nullptr, 0xFFFFFFFFU, &states),
                   .drawn_states = {}};
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (states[i] == scxml::kNoState) continue;
    const std::string& state = chart.states()[states[i]].id;
    if (!state.empty()) shown.drawn_states.emplace(state, static_cast<int>(i));
  }
  return shown;
}

Value to_value(const sim::Pose2& pose) { return List{pose.x, pose.y, pose.theta}; }

std::string_view kind_of(bt::Category category) {
  switch (category) {
    case bt::Category::kControl: return "control";
    case bt::Category::kDecorator: return "decorator";
    case bt::Category::kAction: return "action";
    case bt::Category::kCondition: return "condition";
    case bt::Category::kSubTree: return "subtree";
  }
  return "action";
}

draw::Tree drawn_tree(const bt::Tree& tree) {
  draw::Tree drawing = graph::drawing_of(tree);
  drawing.direction = draw::best_direction(drawing);
  return drawing;
}

Value tree_of_subject(const Subject& subject) {
  const bt::Tree& tree = subject.plan.tree;
  const draw::Tree drawing = drawn_tree(tree);
  std::map<bt::NodeId, std::string> leaf_names;
  for (const auto& [name, node] : subject.leaves) leaf_names[node] = name;
  List nodes;
  for (bt::NodeId id = 0; id < tree.size(); ++id) {
    List ports;
    for (const bt::PortFact& port : tree.ports(id)) {
      ports.push_back(Map{{"name", port.name},
                          {"direction", port.input && port.output ? "inout"
                                        : port.output             ? "output"
                                                                  : "input"},
                          {"value", port.text},
                          {"type", port.type}});
    }
    const auto leaf = leaf_names.find(id);
    const bool has_chart = leaf != leaf_names.end() && subject.skill_chart(leaf->second) != Subject::kNone;
    Map node{{"id", static_cast<std::int64_t>(id)},
             {"parent", nullptr},
             {"path", tree.path(id)},
             {"name", tree.name(id)},
             {"type", tree.registration(id)},
             {"kind", kind_of(tree.category(id))},
             {"symbol", drawing.nodes[id].symbol},
             {"leaf", nullptr},
             {"message_name", nullptr}};
    if (tree.parent(id) != bt::kNoNode) node["parent"] = static_cast<std::int64_t>(tree.parent(id));
    if (has_chart) node["leaf"] = "skill:" + leaf->second;
    if (leaf != leaf_names.end()) node["message_name"] = leaf->second;
    node.append("ports", std::move(ports));
    nodes.emplace_back(std::move(node));
  }
  return Map{{"id", tree.id()},
             {"direction", drawing.direction == draw::Direction::kRight ? "right" : "down"},
             {"nodes", std::move(nodes)},
             {"layout", draw::to_value(drawing, draw::layout(drawing))}};
}

Value chart_value(const ShownChart& shown) {
  List states;
  for (const draw::ChartState& state : shown.drawing.states)
    states.push_back(Map{{"id", state.name}, {"parent", state.parent}, {"kind", to_string(state.kind)}});
  List transitions;
  // The drawing has the transitions of the document in its order, but for those that begin nowhere.
  const auto written = shown.chart.transitions();
  const bool same = written.size() == shown.drawing.transitions.size();
  for (std::size_t i = 0; i < shown.drawing.transitions.size(); ++i) {
    const draw::ChartTransition& transition = shown.drawing.transitions[i];
    List targets;
    for (const int target : transition.targets) targets.emplace_back(target);
    Map drawn{{"source", transition.source},
              {"targets", std::move(targets)},
              {"event", transition.event},
              {"condition", transition.condition},
              {"actions", transition.actions}};
    if (same) drawn["line"] = written[i].place.line;
    transitions.emplace_back(std::move(drawn));
  }
  return Map{{"id", shown.id},
             {"kind", shown.is_monitor ? "monitor" : "skill"},
             {"name", shown.name},
             {"file", shown.chart.file()},
             {"layout", draw::to_value(shown.drawing, draw::layout(shown.drawing))},
             {"states", std::move(states)},
             {"transitions", std::move(transitions)}};
}

Value monitor_value(const Subject& subject, std::size_t index) {
  const ShownMonitor& shown = subject.monitors[index];
  const monitor::Origin* origin = shown.model != nullptr ? shown.model->origin() : nullptr;
  List gate;
  for (const project::GatePlan& plan : subject.plan.gates) {
    if (shown.model == nullptr || plan.monitor != index) continue;
    for (const std::string& request : plan.requests) gate.emplace_back(request);
  }
  Map value{{"name", shown.name},
            {"chart", nullptr},
            {"requirement", origin != nullptr ? origin->requirement.text() : ""},
            {"sentence", origin != nullptr ? origin->requirement.prose : ""},
            {"severity", nullptr},
            {"gate", std::move(gate)}};
  if (shown.model != nullptr) value["chart"] = "monitor:" + shown.name;
  if (origin != nullptr) value["severity"] = to_string(origin->requirement.importance);
  return value;
}

Value service_value(const std::string& name, const idl::ServicePtr& service, const std::string& at, Value robot) {
  Value value = idl::describe(*service);
  Map map;
  map.append("name", name);
  map.append("interface", service->name);
  map.append("at", at);
  map.append("robot", std::move(robot));
  for (auto& [key, part] : *value.as_map()) {
    if (map.find(key) == nullptr) map.append(key, std::move(part));
  }
  return map;
}

// The robot of the simulated world that a service belongs to, or null.
Value robot_of(const Subject& subject, const project::ServicePlan& service) {
  if (service.at != "sim" || subject.robots.empty()) return nullptr;
  return service.robot.empty() ? subject.robots.front() : service.robot;
}

List services_value(const Subject& subject, bool steerable) {
  List services;
  for (const auto& [name, service] : subject.plan.services)
    services.push_back(service_value(name, service.service, service.at, robot_of(subject, service)));
  if (steerable && subject.plan.test_control && subject.plan.world) {
    for (const std::string& name : project::test_control_names(*subject.plan.world))
      services.push_back(service_value(name, subject.plan.test_control, "sim", nullptr));
  }
  return services;
}

Value world_value(const sim::World& world) {
  List locations;
  for (const sim::NamedLocation& location : world.locations) {
    locations.push_back(
        Map{{"name", location.name}, {"x", location.pose.x}, {"y", location.pose.y}, {"theta", location.pose.theta}});
  }
  List areas;
  for (const sim::NamedArea& area : world.areas) {
    List polygon;
    for (const sim::Vec2& point : area.points) polygon.push_back(List{point.x, point.y});
    areas.push_back(Map{{"name", area.name}, {"polygon", std::move(polygon)}});
  }
  List stations;
  for (const sim::Station& station : world.stations) {
    stations.push_back(Map{{"name", station.name},
                           {"x", station.pose.x},
                           {"y", station.pose.y},
                           {"theta", station.pose.theta},
                           {"linear_tolerance", station.linear_tolerance_m},
                           {"angular_tolerance", station.angular_tolerance_rad}});
  }
  List doors;
  for (const sim::Door& door : world.doors)
    doors.push_back(Map{{"name", door.id}, {"a", List{door.a.x, door.a.y}}, {"b", List{door.b.x, door.b.y}}});
  List robots;
  for (const sim::RobotSpec& robot : world.robots) {
    const sim::LaserSpec& laser = robot.laser;
    robots.push_back(Map{{"name", robot.name},
                         {"radius", robot.radius_m},
                         {"laser", Map{{"angle_min", laser.angle_min_rad},
                                       {"angle_increment", laser.angle_increment_rad},
                                       {"beams", laser.beams},
                                       {"range_max", laser.range_max_m},
                                       {"x", laser.mount.x},
                                       {"y", laser.mount.y},
                                       {"yaw", laser.mount.theta}}}});
  }
  return Map{{"map", Map{{"width", world.map.width()},
                         {"height", world.map.height()},
                         {"resolution", world.map.resolution_m()},
                         {"origin", to_value(world.map.origin())}}},
             {"locations", std::move(locations)},
             {"areas", std::move(areas)},
             {"stations", std::move(stations)},
             {"doors", std::move(doors)},
             {"robots", std::move(robots)}};
}

Value scenario_value(const project::Scenario& scenario) {
  List timeline;
  for (const project::Injection& injection : scenario.timeline) {
    const std::string what = project::describe(injection.what);
    timeline.push_back(Map{{"at", injection.at.time_since_epoch().count()}, {"what", what}});
  }
  return Map{{"name", scenario.name}, {"description", scenario.description}, {"timeline", std::move(timeline)}};
}

List scenarios_value(const project::Project& project) {
  List names;
  for (const std::filesystem::path& file : project::scenario_files(project)) names.push_back(file.stem().string());
  return names;
}

List parts_value(const Subject& subject) {
  List parts;
  for (const project::SteeredPart& part : project::parts_of(project::scope_of(subject.plan)))
    parts.push_back(Map{{"name", part.name}, {"kind", part.kind}, {"process", part.process}});
  return parts;
}

}  // namespace

Subject::Subject(const project::Plan& run) : plan(run) {
  for (const project::LeafPlan& leaf : plan.leaves) {
    leaves[leaf.name] = leaf.node;
    if (leaf.chart) charts.push_back(shown("skill:" + leaf.name, false, leaf.name, *leaf.chart));
  }
  for (const monitor::Model& model : plan.monitors) {
    monitors.push_back({model.name(), &model});
    charts.push_back(shown("monitor:" + model.name(), true, model.name(), model.chart()));
  }
  for (const project::ObserverPlan& observer : plan.observers) {
    if (observer.is_monitor) monitors.push_back({observer.name, nullptr});
  }
  for (std::size_t i = 0; i < charts.size(); ++i) charts_by_id[charts[i].id] = i;
  if (plan.world) {
    for (const sim::RobotSpec& robot : plan.world->robots) robots.push_back(robot.name);
  }
}

std::size_t Subject::skill_chart(std::string_view leaf) const {
  const auto found = charts_by_id.find(fmt::format("skill:{}", leaf));
  return found != charts_by_id.end() ? found->second : kNone;
}

std::size_t Subject::monitor_index(std::string_view name) const {
  const auto found =
      std::find_if(monitors.begin(), monitors.end(), [&](const ShownMonitor& shown) { return shown.name == name; });
  return found != monitors.end() ? static_cast<std::size_t>(found - monitors.begin()) : kNone;
}

std::size_t Subject::robot_index(std::string_view name) const {
  const auto found = std::find(robots.begin(), robots.end(), name);
  return found != robots.end() ? static_cast<std::size_t>(found - robots.begin()) : kNone;
}

std::string model_message(const Subject& subject, bool steerable) {
  List charts;
  for (const ShownChart& chart : subject.charts) charts.push_back(chart_value(chart));
  List monitors;
  for (std::size_t i = 0; i < subject.monitors.size(); ++i) monitors.push_back(monitor_value(subject, i));
  Map model{{"type", "model"},
            {"tree", tree_of_subject(subject)},
            {"charts", std::move(charts)},
            {"monitors", std::move(monitors)},
            {"services", services_value(subject, steerable)},
            {"world", nullptr},
            {"scenario", scenario_value(subject.plan.scenario)},
            {"scenarios", scenarios_value(subject.plan.scenario.project)},
            {"parts", parts_value(subject)}};
  if (subject.plan.world) model["world"] = world_value(*subject.plan.world);
  return to_json(Value(std::move(model)));
}

Value folded_layout(const Subject& subject, const std::vector<bt::NodeId>& collapsed) {
  const bt::Tree& tree = subject.plan.tree;
  const draw::Tree whole = drawn_tree(tree);
  draw::Tree folded;
  folded.title = whole.title;
  List nodes;
  std::vector<int> place(tree.size(), -1);
  for (bt::NodeId id = 0; id < tree.size();) {
    draw::TreeNode node = whole.nodes[id];
    if (node.parent >= 0) node.parent = place[static_cast<std::size_t>(node.parent)];
    place[id] = static_cast<int>(folded.nodes.size());
    folded.nodes.push_back(std::move(node));
    nodes.emplace_back(static_cast<std::int64_t>(id));
    const bool fold = std::find(collapsed.begin(), collapsed.end(), id) != collapsed.end();
    id = fold ? tree.subtree_end(id) : id + 1;
  }
  folded.direction = draw::best_direction(folded);
  return Map{{"nodes", std::move(nodes)}, {"layout", draw::to_value(folded, draw::layout(folded))}};
}

Value folded_chart(const Subject& subject, std::string_view chart, const std::set<std::string>& closed) {
  const auto found = subject.charts_by_id.find(chart);
  if (found == subject.charts_by_id.end()) return {};
  const draw::Chart& whole = subject.charts[found->second].drawing;
  std::vector<bool> is_closed;
  for (const draw::ChartState& state : whole.states) is_closed.push_back(closed.contains(state.name));
  return draw::to_value(draw::folded(whole, is_closed));
}

std::string map_octets(const Subject& subject) {
  if (!subject.plan.world) return {};
  std::string octets;
  octets.reserve(subject.plan.world->map.cells().size());
  for (const std::int8_t cell : subject.plan.world->map.cells())
    octets += static_cast<char>(cell < 0 ? 255 : static_cast<int>(cell));
  return octets;
}

}  // namespace sentree::studio
