#include "sentree/studio/detail/design_values.h"

#include <fmt/format.h>

#include <algorithm>

#include "sentree/draw/chart.h"
#include "sentree/draw/fold.h"
#include "sentree/draw/tree.h"
#include "sentree/graph/chart.h"
#include "sentree/project/interface_file.h"
#include "sentree/scxml/model.h"
#include "sentree/text/xml.h"
#include "sentree/text/yaml.h"

namespace sentree::studio {

namespace {

Value number_value(std::size_t value) { return static_cast<std::int64_t>(value); }

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

Value tree_value(const design::OutlineTree& tree) {
  draw::Tree drawing;
  List nodes;
  for (const design::OutlineNode& node : tree.nodes) {
    List attributes;
    for (const auto& [name, value] : node.attributes) attributes.push_back(List{name, value});
    drawing.nodes.push_back(design::drawing_of(node));
    nodes.push_back(Map{{"element", static_cast<std::int64_t>(node.element)},
                        {"parent", node.parent},
                        {"id", node.id},
                        {"name", node.name},
                        {"kind", name_of(node.category)},
                        {"known", node.known},
                        {"children_min", number_value(node.children_min)},
                        {"children_max", number_value(node.children_max)},
                        {"from", number_value(node.from)},
                        {"open_end", number_value(node.open_end)},
                        {"to", number_value(node.to)},
                        {"attributes", std::move(attributes)}});
  }
  drawing.direction = draw::best_direction(drawing);
  return Map{{"element", static_cast<std::int64_t>(tree.element)},
             {"id", tree.id},
             {"from", number_value(tree.from)},
             {"to", number_value(tree.to)},
             {"direction", drawing.direction == draw::Direction::kRight ? "right" : "down"},
             {"nodes", std::move(nodes)},
             {"layout", draw::to_value(drawing, draw::layout(drawing))}};
}

Value sentence_value(const design::Sentence& sentence) {
  List parts;
  for (const design::SentencePart& part : sentence.parts)
    parts.push_back(Map{
        {"part", part.part}, {"from", number_value(part.from)}, {"to", number_value(part.to)}, {"text", part.text}});
  return Map{{"name", sentence.name},
             {"prose", sentence.prose},
             {"scope", sentence.scope},
             {"pattern", sentence.pattern},
             {"from", number_value(sentence.from)},
             {"to", number_value(sentence.to)},
             {"parts", std::move(parts)}};
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

List texts_value(const std::vector<std::string>& texts) {
  List values;
  for (const std::string& text : texts) values.emplace_back(text);
  return values;
}

// The picture of a chart that can be edited, with what its parts say.
Value edited_chart_value(const scxml::Chart& chart) {
  std::vector<scxml::StateIndex> drawn_states;
  std::vector<scxml::TransitionIndex> drawn_transitions;
  const draw::Chart drawing =
      graph::drawing_of(chart, nullptr, scxml::kNoTransition, &drawn_states, &drawn_transitions);
  const design::ChartParts parts = design::parts_of(chart);
  List states;
  for (const scxml::StateIndex state : drawn_states) {
    static const design::ChartParts::StateParts kDot;
    const bool written = state != scxml::kNoState;
    const design::ChartParts::StateParts& part = written ? parts.states[state] : kDot;
    const scxml::StateIndex parent = written ? chart.states()[state].parent : 0;
    states.push_back(Map{{"id", written ? chart.states()[state].id : ""},
                         {"line", written ? chart.states()[state].place.line : 0},
                         {"kind", part.kind},
                         {"inside", parent != scxml::kNoState ? chart.states()[parent].id : ""},
                         {"initial", part.initial},
                         {"from", number_value(part.from)},
                         {"to", number_value(part.to)},
                         {"onentry", texts_value(part.onentry)},
                         {"onexit", texts_value(part.onexit)}});
  }
  List transitions;
  for (const scxml::TransitionIndex transition : drawn_transitions) {
    const design::ChartParts::TransitionParts& part = parts.transitions[transition];
    const scxml::Transition& read = chart.transitions()[transition];
    transitions.push_back(Map{{"line", read.place.line},
                              {"transition", static_cast<std::int64_t>(transition)},
                              {"source", chart.states()[read.source].id},
                              {"written", part.written},
                              {"event", part.event},
                              {"condition", part.condition},
                              {"target", part.target},
                              {"actions", texts_value(part.actions)}});
  }
  return Map{{"layout", draw::to_value(drawing, draw::layout(drawing))},
             {"states", std::move(states)},
             {"transitions", std::move(transitions)},
             {"data", texts_value(parts.data)}};
}

std::optional<Diagnostic> why_no_chart(const Loaded<scxml::Chart>& chart) {
  if (chart.value) return std::nullopt;
  const auto error = std::find_if(chart.diagnostics.begin(), chart.diagnostics.end(),
                                  [](const Diagnostic& d) { return d.severity == Severity::kError; });
  return error != chart.diagnostics.end() ? std::optional(*error) : std::nullopt;
}

}  // namespace

Value chart_value(const scxml::Chart& chart) {
  std::vector<scxml::StateIndex> states;
  std::vector<scxml::TransitionIndex> transitions_drawn;
  const draw::Chart drawing = graph::drawing_of(chart, nullptr, 0xFFFFFFFFU, &states, &transitions_drawn);
  List state_values;
  for (const scxml::StateIndex state : states) {
    const bool written = state != scxml::kNoState;
    state_values.push_back(
        Map{{"id", written ? chart.states()[state].id : ""}, {"line", written ? chart.states()[state].place.line : 0}});
  }
  List transitions;
  for (const scxml::TransitionIndex transition : transitions_drawn)
    transitions.push_back(Map{{"line", chart.transitions()[transition].place.line}});
  return Map{{"layout", draw::to_value(drawing, draw::layout(drawing))},
             {"states", std::move(state_values)},
             {"transitions", std::move(transitions)}};
}

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
            {"unreadable", document.unreadable},
            {"error", nullptr},
            {"main", nullptr},
            {"trees", nullptr},
            {"chart", nullptr},
            {"requirements", nullptr}};
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
    if (chart.value)
      value["chart"] = edited_chart_value(*chart.value);
    else if (const auto why = why_no_chart(chart))
      wrong(*why);
  } else if (file.ends_with(".yaml") || file.ends_with(".yml")) {
    if (const auto read = text::parse_yaml(document.text, file); !read) wrong(read.error());
  } else if (kind == "requirement") {
    if (const auto sentences = design::sentences_of(document.text, file)) {
      List requirements;
      for (const design::Sentence& sentence : *sentences) requirements.push_back(sentence_value(sentence));
      value["requirements"] = std::move(requirements);
    } else {
      wrong(sentences.error());
    }
  }
  return value;
}

std::optional<Diagnostic> unreadable(const std::string& file, std::string_view text, const design::Kinds& kinds) {
  const auto why_not = [](const auto& read) {
    return read ? std::optional<Diagnostic>() : std::optional<Diagnostic>(read.error());
  };
  if (kind_of_file(file, text) == "mission") return why_not(design::outline_of(text, kinds, file));
  if (file.ends_with(".xml")) return why_not(text::XmlDocument::parse(std::string(text), file, {.lenient = true}));
  if (file.ends_with(".scxml")) return why_no_chart(scxml::load(text, file));
  if (file.ends_with(".yaml") || file.ends_with(".yml")) return why_not(text::parse_yaml(text, file));
  if (file.ends_with(".req")) return why_not(design::sentences_of(text, file));
  return std::nullopt;
}

namespace {

List marks_value(const std::vector<design::Mark>& marks) {
  List values;
  for (const design::Mark mark : marks) values.emplace_back(to_string(mark));
  return values;
}

List moves_value(const std::vector<std::pair<int, int>>& moves) {
  List values;
  for (const auto& [from, to] : moves) values.push_back(List{from, to});
  return values;
}

std::string_view name_of(text::Difference::Kind kind) {
  switch (kind) {
    case text::Difference::Kind::kAdded: return "added";
    case text::Difference::Kind::kRemoved: return "removed";
    case text::Difference::Kind::kChanged: return "changed";
    case text::Difference::Kind::kMoved: return "moved";
  }
  return "";
}

// The whole file came, or went.
void mark_all(design::Comparison& comparison, const std::string& file, bool came) {
  const auto mark = [&](std::vector<design::Mark>& marks) {
    std::fill(marks.begin(), marks.end(), came ? design::Mark::kAdded : design::Mark::kRemoved);
  };
  for (design::ComparedTree& tree : comparison.trees) mark(tree.marks);
  if (comparison.chart) {
    mark(comparison.chart->states);
    mark(comparison.chart->transitions);
  }
  const SourceSpan beginning{file, 1, 1, 0};
  comparison.differences = {{came ? text::Difference::Kind::kAdded : text::Difference::Kind::kRemoved, file,
                             came ? "file added" : "file removed", came ? SourceSpan{} : beginning,
                             came ? beginning : SourceSpan{}}};
  comparison.places = {{comparison.trees.empty() ? -1 : 0, 0, -1}};
}

}  // namespace

Value comparison_value(const std::string* before, const std::string* after, const design::Kinds& kinds,
                       const std::string& file) {
  Map value{{"file", file},
            {"before", before != nullptr ? Value(*before) : Value()},
            {"after", after != nullptr ? Value(*after) : Value()},
            {"problem", ""},
            {"differences", List()},
            {"trees", nullptr},
            {"chart", nullptr}};
  const std::string& there = after != nullptr ? *after : *before;
  auto comparison = design::compare(before != nullptr ? *before : there, there, kinds, file, file);
  if (comparison && (before == nullptr || after == nullptr)) mark_all(*comparison, file, before == nullptr);
  if (!comparison) {
    const Diagnostic& why = comparison.error();
    value["problem"] = why.span.line > 0 ? to_string(why) : why.message;
    return value;
  }
  List differences;
  for (std::size_t i = 0; i < comparison->differences.size(); ++i) {
    const text::Difference& difference = comparison->differences[i];
    const design::ComparedPlace& place = comparison->places[i];
    differences.push_back(Map{{"kind", name_of(difference.kind)},
                              {"path", difference.path},
                              {"what", difference.what},
                              {"before_line", difference.before.line},
                              {"after_line", difference.after.line},
                              {"tree", place.tree},
                              {"part", place.part},
                              {"transition", place.transition}});
  }
  value["differences"] = std::move(differences);
  if (comparison->chart) {
    const design::ComparedChart& chart = *comparison->chart;
    value["chart"] = Map{{"layout", draw::to_value(chart.drawing, draw::layout(chart.drawing))},
                         {"states", marks_value(chart.states)},
                         {"transitions", marks_value(chart.transitions)},
                         {"moves", moves_value(chart.moves)}};
    return value;
  }
  List trees;
  for (const design::ComparedTree& tree : comparison->trees) {
    trees.push_back(Map{{"id", tree.id},
                        {"layout", draw::to_value(tree.drawing, draw::layout(tree.drawing))},
                        {"marks", marks_value(tree.marks)},
                        {"moves", moves_value(tree.moves)}});
  }
  value["trees"] = std::move(trees);
  return value;
}

Result<Value> folded_value(const std::string& file, const design::Document& document,
                           const std::set<std::string>& closed) {
  const auto chart = scxml::load(document.text, file);
  if (!chart.value) return fail("studio.request", file + " is no chart that can be drawn");
  std::vector<scxml::StateIndex> states;
  const draw::Chart whole = graph::drawing_of(*chart.value, nullptr, scxml::kNoTransition, &states);
  std::vector<bool> is_closed(states.size());
  for (std::size_t i = 0; i < states.size(); ++i)
    is_closed[i] = states[i] != scxml::kNoState && closed.contains(chart.value->states()[states[i]].id);
  Map value = draw::to_value(draw::folded(whole, is_closed));
  value["version"] = static_cast<std::int64_t>(document.version);
  return Value(std::move(value));
}

Value finding_value(const design::Finding& finding) {
  List fixes;
  for (const design::Fix& fix : finding.fixes) {
    fixes.push_back(Map{{"title", fix.title},
                        {"from", number_value(fix.edit.from)},
                        {"to", number_value(fix.edit.to)},
                        {"text", fix.edit.text}});
  }
  const Diagnostic& diagnostic = finding.diagnostic;
  return Map{{"file", finding.file},
             {"line", diagnostic.span.line},
             {"column", diagnostic.span.column},
             {"from", number_value(finding.from)},
             {"to", number_value(finding.to)},
             {"severity", to_string(diagnostic.severity)},
             {"code", diagnostic.code},
             {"message", diagnostic.message},
             {"fixes", std::move(fixes)}};
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
                         {"children_max", number_value(kinds.kind(id, model).children_max)},
                         {"own", is_own},
                         {"description", model.description},
                         {"ports", std::move(ports)}});
  }
  return values;
}

List interfaces_value(const std::filesystem::path& folder, const std::map<std::string, std::string>& texts) {
  constexpr std::string_view kOwn = "interfaces/";
  std::vector<std::string> files;
  for (const auto& [file, text] : texts) {
    if (file.starts_with(kOwn) && file.ends_with(".thrift")) files.push_back(file.substr(kOwn.size()));
  }
  files.emplace_back("robot.thrift");
  List names;
  for (const std::string& file : files) {
    const auto path = project::find_interface(folder / "interfaces", file);
    if (!path) continue;
    const auto schema = project::load_interface(*path, file);
    if (!schema.value) continue;
    for (const std::string& service : schema.value->service_names())
      names.emplace_back(fmt::format("{}/{}", file, service));
  }
  return names;
}

namespace {

Result<design::TreeGesture> gesture_on_one(const Value& gesture) {
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
  if (what == "extract") return design::ExtractTree{node, string_of(gesture, "id")};
  if (what == "inline") return design::InlineTree{node};
  if (what == "paste") return design::PasteNodes{string_of(gesture, "xml"), slot};
  if (what == "add_tree") return design::AddTree{string_of(gesture, "id")};
  if (what == "delete_tree") return design::DeleteTree{node};
  if (what == "set") {
    const Value* value = gesture.find("value");
    const bool given = value != nullptr && value->as_string() != nullptr;
    return design::SetAttribute{node, string_of(gesture, "name"),
                                given ? std::optional(*value->as_string()) : std::nullopt};
  }
  return fail("studio.request", fmt::format("\"{}\" is no gesture", what));
}

// Of one: the same on several, if it can be.
template <class Gesture, class Several>
Result<Gesture> on_several(const Value& gesture, const Gesture& one, Several several) {
  const bool can = std::visit(
      [&](const auto& what) {
        constexpr bool kCan = std::is_assignable_v<decltype(several.gesture)&, decltype(what)>;
        if constexpr (kCan) several.gesture = what;
        return kCan;
      },
      one);
  if (!can)
    return fail("studio.request", fmt::format("\"{}\" is no gesture on several at once", string_of(gesture, "what")));
  return several;
}

Result<design::TreeGesture> gesture_of(const Value& gesture) {
  auto one = gesture_on_one(gesture);
  const Value* const nodes = gesture.find("nodes");
  if (!one || nodes == nullptr || nodes->as_list() == nullptr) return one;
  design::EditNodes several;
  for (const Value& node : *nodes->as_list()) {
    constexpr std::int64_t kNoElement = 0xFFFFFFFF;
    several.nodes.push_back(static_cast<std::uint32_t>(
        std::clamp(node.as_int() != nullptr ? *node.as_int() : kNoElement, std::int64_t{0}, kNoElement)));
  }
  return on_several(gesture, *one, std::move(several));
}

std::optional<std::string> text_if_given(const Value& value, std::string_view name) {
  const Value* found = value.find(name);
  return found != nullptr && found->as_string() != nullptr ? std::optional(*found->as_string()) : std::nullopt;
}

// Absent: nothing has that number.
scxml::TransitionIndex transition_of(const Value& gesture) {
  const Value* given = gesture.find("transition");
  return given == nullptr || given->as_int() == nullptr ? scxml::kNoTransition
                                                        : static_cast<scxml::TransitionIndex>(std::min<std::size_t>(
                                                              count_of(gesture, "transition"), scxml::kNoTransition));
}

design::ActionPlace action_place_of(const Value& gesture) {
  design::ActionPlace place{std::nullopt, string_of(gesture, "state"), string_of(gesture, "block")};
  if (gesture.find("transition") != nullptr) place.transition = transition_of(gesture);
  return place;
}

Result<design::ChartGesture> chart_gesture_on_one(const Value& gesture) {
  const std::string what = string_of(gesture, "what");
  const std::string state = string_of(gesture, "state");
  const std::string id = string_of(gesture, "id");
  const std::string xml = string_of(gesture, "xml");
  const std::size_t index = count_of(gesture, "index");
  if (what == "rename_state") return design::RenameState{state, id};
  if (what == "add_state") return design::AddState{string_of(gesture, "inside"), id, string_of(gesture, "kind")};
  if (what == "remove_state") return design::RemoveState{state};
  if (what == "move_state") return design::MoveState{state, string_of(gesture, "inside")};
  if (what == "wrap_state") return design::WrapState{state, id, string_of(gesture, "kind")};
  if (what == "paste_states") return design::PasteStates{string_of(gesture, "inside"), xml};
  if (what == "set_kind") return design::SetKind{state, string_of(gesture, "kind")};
  if (what == "set_initial") return design::SetInitial{state};
  if (what == "add_transition") {
    return design::AddTransition{state, string_of(gesture, "target"), string_of(gesture, "event"),
                                 string_of(gesture, "condition"), flag_of(gesture, "fresh")};
  }
  if (what == "set_transition") {
    return design::SetTransition{transition_of(gesture), text_if_given(gesture, "event"),
                                 text_if_given(gesture, "condition"), text_if_given(gesture, "target")};
  }
  if (what == "remove_transition") return design::RemoveTransition{transition_of(gesture)};
  if (what == "move_transition") return design::MoveTransition{transition_of(gesture), state, index};
  if (what == "insert_action") return design::InsertAction{action_place_of(gesture), index, xml};
  if (what == "set_action") return design::SetAction{action_place_of(gesture), index, xml};
  if (what == "remove_action") return design::RemoveAction{action_place_of(gesture), index};
  if (what == "move_action") return design::MoveAction{action_place_of(gesture), index, count_of(gesture, "to")};
  return fail("studio.request", fmt::format("\"{}\" is no gesture on a chart", what));
}

Result<design::ChartGesture> chart_gesture_of(const Value& gesture) {
  auto one = chart_gesture_on_one(gesture);
  const Value* const states = gesture.find("states");
  if (!one || states == nullptr || states->as_list() == nullptr) return one;
  design::EditStates several;
  for (const Value& state : *states->as_list()) several.states.emplace_back(state.text());
  return on_several(gesture, *one, std::move(several));
}

Result<design::RequirementGesture> requirement_gesture_of(const Value& gesture) {
  const std::string what = string_of(gesture, "what");
  const std::string requirement = string_of(gesture, "requirement");
  if (what == "set_part") return design::SetPart{requirement, string_of(gesture, "part"), string_of(gesture, "text")};
  if (what == "set_scope") return design::SetScope{requirement, string_of(gesture, "scope")};
  if (what == "set_pattern") return design::SetPattern{requirement, string_of(gesture, "pattern")};
  return fail("studio.request", fmt::format("\"{}\" is no gesture on requirements", what));
}

Result<design::YamlGesture> yaml_gesture_of(const Value& gesture) {
  const std::string what = string_of(gesture, "what");
  text::YamlPath path;
  const Value* steps = gesture.find("path");
  if (steps == nullptr || steps->as_list() == nullptr) return fail("studio.request", "a gesture needs a path");
  for (const Value& step : *steps->as_list()) {
    if (step.as_string() != nullptr)
      path.emplace_back(*step.as_string());
    else if (step.as_int() != nullptr && *step.as_int() >= 0)
      path.emplace_back(static_cast<std::size_t>(*step.as_int()));
    else
      return fail("studio.request", "a path has keys and places from 0");
  }
  const Value* value = gesture.find("value");
  if (what == "yaml_remove") return design::RemoveYaml{std::move(path)};
  if (value == nullptr) return fail("studio.request", what + " needs a value");
  if (what == "yaml_set") return design::SetYaml{std::move(path), *value};
  if (what == "yaml_insert") return design::InsertYaml{std::move(path), count_of(gesture, "index"), *value};
  return fail("studio.request", fmt::format("\"{}\" is no gesture on a file of settings", what));
}

}  // namespace

Result<design::GestureResult> edited_by(const Value& gesture, const std::string& file, std::string_view text,
                                        const design::Kinds& kinds) {
  if (file.ends_with(".scxml")) {
    const auto wanted = chart_gesture_of(gesture);
    return wanted ? design::edit_chart(text, *wanted, file) : tl::unexpected(wanted.error());
  }
  if (file.ends_with(".req")) {
    const auto wanted = requirement_gesture_of(gesture);
    return wanted ? design::edit_requirement(text, *wanted, file) : tl::unexpected(wanted.error());
  }
  if (file.ends_with(".yaml") || file.ends_with(".yml")) {
    const auto wanted = yaml_gesture_of(gesture);
    return wanted ? design::edit_yaml(text, *wanted, file) : tl::unexpected(wanted.error());
  }
  const auto wanted = gesture_of(gesture);
  return wanted ? design::edit_tree(text, *wanted, kinds, file) : tl::unexpected(wanted.error());
}

}  // namespace sentree::studio
