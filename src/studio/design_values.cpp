#include "sentree/studio/design_values.h"

#include <algorithm>

#include "sentree/draw/chart.h"
#include "sentree/draw/tree.h"
#include "sentree/graph/chart.h"
#include "sentree/graph/tree.h"
#include "sentree/scxml/chart.h"

namespace sentree::studio {

namespace {

Value number(std::size_t value) { return static_cast<std::int64_t>(value); }

std::string_view name_of(bt::Category category) {
  switch (category) {
    case bt::Category::kControl: return "control";
    case bt::Category::kDecorator: return "decorator";
    case bt::Category::kAction: return "action";
    case bt::Category::kCondition: return "condition";
    case bt::Category::kSubTree: return "subtree";
  }
  return "action";
}

draw::TreeShape shape_of(bt::Category category) {
  switch (category) {
    case bt::Category::kControl: return draw::TreeShape::kControl;
    case bt::Category::kDecorator: return draw::TreeShape::kDecorator;
    case bt::Category::kCondition: return draw::TreeShape::kCondition;
    case bt::Category::kAction: return draw::TreeShape::kAction;
    case bt::Category::kSubTree: return draw::TreeShape::kSubtree;
  }
  return draw::TreeShape::kAction;
}

Value tree_value(const design::OutlineTree& tree) {
  draw::Tree drawing;
  List nodes;
  for (const design::OutlineNode& node : tree.nodes) {
    draw::TreeNode drawn;
    drawn.parent = node.parent;
    drawn.shape = shape_of(node.category);
    if (node.category == bt::Category::kControl || node.category == bt::Category::kDecorator) {
      drawn.symbol = graph::symbol_of(node.id);
      drawn.title = node.name != node.id ? node.name : "";
    } else {
      drawn.title = node.name.empty() ? node.id : node.name;
      if (!node.name.empty() && node.name != node.id) drawn.lines.push_back(node.id);
    }
    List attributes;
    for (const auto& [name, value] : node.attributes) {
      drawn.lines.push_back(name + ": " + value);
      attributes.push_back(List{name, value});
    }
    drawing.nodes.push_back(std::move(drawn));
    nodes.push_back(Map{{"element", static_cast<std::int64_t>(node.element)},
                        {"parent", node.parent},
                        {"id", node.id},
                        {"name", node.name},
                        {"kind", name_of(node.category)},
                        {"known", node.known},
                        {"children_min", number(node.children_min)},
                        {"children_max", number(node.children_max)},
                        {"from", number(node.from)},
                        {"open_end", number(node.open_end)},
                        {"to", number(node.to)},
                        {"attributes", std::move(attributes)}});
  }
  drawing.direction = draw::best_direction(drawing);
  return Map{{"element", static_cast<std::int64_t>(tree.element)},
             {"id", tree.id},
             {"from", number(tree.from)},
             {"to", number(tree.to)},
             {"direction", drawing.direction == draw::Direction::kRight ? "right" : "down"},
             {"nodes", std::move(nodes)},
             {"layout", draw::to_value(drawing, draw::layout(drawing))}};
}

Value chart_value(const scxml::Chart& chart) {
  std::vector<scxml::StateIndex> states;
  const draw::Chart drawing = graph::drawing_of(chart, nullptr, 0xFFFFFFFFU, &states);
  List state_values;
  for (const scxml::StateIndex state : states) {
    const bool written = state != scxml::kNoState;
    state_values.push_back(
        Map{{"id", written ? chart.states()[state].id : ""}, {"line", written ? chart.states()[state].place.line : 0}});
  }
  List transitions;
  const auto written = chart.transitions();
  const bool same = written.size() == drawing.transitions.size();
  for (std::size_t i = 0; i < drawing.transitions.size(); ++i)
    transitions.push_back(Map{{"line", same ? written[i].place.line : 0}});
  return Map{{"layout", draw::to_value(drawing, draw::layout(drawing))},
             {"states", std::move(state_values)},
             {"transitions", std::move(transitions)}};
}

std::size_t count_of(const Value& value, std::string_view name) {
  const Value* found = value.find(name);
  return found != nullptr && found->as_int() != nullptr && *found->as_int() >= 0
             ? static_cast<std::size_t>(*found->as_int())
             : std::size_t{0};
}

std::string string_of(const Value& value, std::string_view name) {
  const Value* found = value.find(name);
  return found != nullptr && found->as_string() != nullptr ? *found->as_string() : std::string();
}

bool flag_of(const Value& value, std::string_view name) {
  const Value* found = value.find(name);
  return found != nullptr && found->as_bool() != nullptr && *found->as_bool();
}

}  // namespace

std::string_view kind_of_file(const std::string& file, std::string_view text) {
  const auto has_ending = [&](std::string_view ending) { return file.ends_with(ending); };
  if (file == "sentree.yaml") return "project";
  if (has_ending(".req")) return "requirement";
  if (has_ending(".thrift")) return "interface";
  if (has_ending(".scxml")) {
    if (file.starts_with("monitors/")) return "monitor";
    return file.starts_with("models/") ? "model" : "skill";
  }
  if (has_ending(".xml")) return text.find("<BehaviorTree") != std::string_view::npos ? "mission" : "other";
  if (file.starts_with("scenarios/")) return "scenario";
  return text.find("locations:") != std::string_view::npos || text.find("robot:") != std::string_view::npos ? "world"
                                                                                                            : "other";
}

Value document_value(const std::string& file, const design::Document& document, const design::Kinds& kinds) {
  const std::string_view kind = kind_of_file(file, document.text);
  Map value{{"file", file},
            {"version", static_cast<std::int64_t>(document.version)},
            {"kind", kind},
            {"text", document.text},
            {"theirs", document.theirs ? Value(*document.theirs) : Value()},
            {"error", nullptr},
            {"main", nullptr},
            {"trees", nullptr},
            {"chart", nullptr}};
  const auto wrong = [&](const Diagnostic& why) {
    value["error"] = Map{{"line", why.span.line}, {"column", why.span.column}, {"message", why.message}};
  };
  if (kind == "mission" || (kind == "other" && file.ends_with(".xml"))) {
    if (const auto outline = design::outline_of(document.text, kinds, file)) {
      List trees;
      for (const design::OutlineTree& tree : outline->trees) trees.push_back(tree_value(tree));
      value["main"] = outline->main;
      value["trees"] = std::move(trees);
    } else {
      wrong(outline.error());
    }
  } else if (file.ends_with(".scxml")) {
    const auto chart = scxml::load(document.text, file);
    if (chart.value) {
      value["chart"] = chart_value(*chart.value);
    } else {
      const auto error = std::find_if(chart.diagnostics.begin(), chart.diagnostics.end(),
                                      [](const Diagnostic& d) { return d.severity == Severity::kError; });
      if (error != chart.diagnostics.end()) wrong(*error);
    }
  }
  return value;
}

Value finding_value(const design::Finding& finding) {
  List fixes;
  for (const design::Fix& fix : finding.fixes) {
    fixes.push_back(Map{
        {"title", fix.title}, {"from", number(fix.edit.from)}, {"to", number(fix.edit.to)}, {"text", fix.edit.text}});
  }
  const Diagnostic& diagnostic = finding.diagnostic;
  return Map{
      {"file", finding.file},         {"line", diagnostic.span.line},  {"column", diagnostic.span.column},
      {"from", number(finding.from)}, {"to", number(finding.to)},      {"severity", to_string(diagnostic.severity)},
      {"code", diagnostic.code},      {"message", diagnostic.message}, {"fixes", std::move(fixes)}};
}

Value palette_value(const design::Kinds& kinds, const std::vector<bt::NodeModel>& own) {
  List values;
  for (const auto& [id, model] : kinds.palette().nodes()) {
    if (model.category == bt::Category::kSubTree) continue;
    List ports;
    for (const bt::PortInfo& port : model.ports) {
      ports.push_back(Map{{"name", port.name},
                          {"direction", to_string(port.direction)},
                          {"type", port.type != nullptr ? std::string(port.type->name) : port.declared_type},
                          {"default", port.default_text ? Value(*port.default_text) : Value()},
                          {"description", port.description}});
    }
    const bool is_own = std::any_of(own.begin(), own.end(), [&id = id](const auto& one) { return one.id == id; });
    values.push_back(Map{{"id", id},
                         {"kind", name_of(model.category)},
                         {"children_max", number(kinds.kind(id, model).children_max)},
                         {"own", is_own},
                         {"description", model.description},
                         {"ports", std::move(ports)}});
  }
  return values;
}

Result<design::TreeGesture> gesture_of(const Value& gesture) {
  const std::string what = string_of(gesture, "what");
  const auto node = static_cast<std::uint32_t>(std::min<std::size_t>(count_of(gesture, "node"), 0xFFFFFFFFU));
  const design::Slot slot{static_cast<std::uint32_t>(std::min<std::size_t>(count_of(gesture, "parent"), 0xFFFFFFFFU)),
                          count_of(gesture, "index")};
  if (what == "insert") {
    design::InsertNode insert{
        string_of(gesture, "id"), flag_of(gesture, "subtree"), string_of(gesture, "name"), {}, slot};
    if (const Value* ports = gesture.find("ports"); ports != nullptr && ports->as_map() != nullptr) {
      for (const auto& [name, value] : *ports->as_map()) insert.ports.emplace_back(name, value.text());
    }
    return insert;
  }
  if (what == "delete") return design::DeleteNode{node};
  if (what == "move") return design::MoveNode{node, slot, flag_of(gesture, "copy")};
  if (what == "wrap") return design::WrapNode{node, string_of(gesture, "id")};
  if (what == "unwrap") return design::UnwrapNode{node};
  if (what == "set") {
    const Value* value = gesture.find("value");
    const bool given = value != nullptr && value->as_string() != nullptr;
    return design::SetAttribute{node, string_of(gesture, "name"),
                                given ? std::optional(*value->as_string()) : std::nullopt};
  }
  return fail("studio.request", "\"" + what + "\" is no gesture");
}

Result<design::ChartGesture> chart_gesture_of(const Value& gesture) {
  const std::string what = string_of(gesture, "what");
  if (what == "rename_state") return design::RenameState{string_of(gesture, "state"), string_of(gesture, "id")};
  if (what == "add_state")
    return design::AddState{string_of(gesture, "inside"), string_of(gesture, "id"), flag_of(gesture, "final")};
  if (what == "remove_state") return design::RemoveState{string_of(gesture, "state")};
  if (what == "add_transition") {
    return design::AddTransition{string_of(gesture, "state"), string_of(gesture, "target"), string_of(gesture, "event"),
                                 string_of(gesture, "condition")};
  }
  return fail("studio.request", "\"" + what + "\" is no gesture on a chart");
}

}  // namespace sentree::studio
