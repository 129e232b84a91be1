#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include "sentree/scxml/loader.h"

namespace sentree::scxml {
namespace {

constexpr std::string_view kNamespace = "http://www.w3.org/2005/07/scxml";
constexpr std::string_view kXInclude = "http://www.w3.org/2001/XInclude";

// Eight bytes at a time: a chart's whole text is read for it.
std::uint64_t fingerprint_of(std::string_view text) {
  std::uint64_t hash = text.size();
  for (; text.size() >= 8; text.remove_prefix(8)) {
    std::uint64_t word = 0;
    for (std::size_t i = 0; i < 8; ++i) word |= std::uint64_t{static_cast<unsigned char>(text[i])} << (8 * i);
    hash = (std::rotl(hash, 29) ^ word) * 0x9E3779B97F4A7C15ULL;
  }
  return hash_combine(hash, hash_bytes(text));
}

}  // namespace

Loader::Loader(const text::XmlDocument& document, const LoadOptions& options, std::string folder, int depth)
    : document_(document), options_(options), model_(std::make_unique<Model>()), depth_(depth) {
  model_->folder = std::move(folder);
}

std::shared_ptr<const Model> Loader::run() {
  const Element root = document_.root();
  model_->file = document_.file();
  model_->source = document_.source();
  model_->fingerprint = fingerprint_of(model_->source);
  namespace_ = root.namespace_uri();
  root_decides_ = only_root_declares(root);
  if (root.local_name() != "scxml" && root.local_name() != "ascxml") {
    error("scxml.no-scxml", fmt::format("the root element is <{}>, not <scxml>", root.name()), place(root));
    return nullptr;
  }
  if (root.local_name() != "scxml")
    warn("scxml.namespace", fmt::format("<{}> is read as <scxml>", root.name()), place(root));
  if (namespace_ != kNamespace) {
    warn("scxml.namespace",
         fmt::format("{}; it is read as SCXML all the same: write xmlns=\"{}\"",
                     namespace_.empty() ? "no namespace is declared"
                                        : fmt::format("\"{}\" is not SCXML's namespace", namespace_),
                     kNamespace),
         place(root));
  }
  load_root(root);
  if (!has_errors(diagnostics_)) resolve();
  if (has_errors(diagnostics_)) return nullptr;
  return std::shared_ptr<const Model>(std::move(model_));
}

void Loader::load_root(const Element& root) {
  know_attributes(root, {"initial", "initialstate", "name", "version", "datamodel", "binding", "exmode", "model_src"});
  model_->name = root.attribute("name").value_or("");
  const std::string_view version = given(root, "version").value_or("1.0");
  if (version != "1.0") {
    warn("scxml.version", fmt::format("version \"{}\" is read as \"1.0\", the only one that SCXML has", version),
         value_place(root, "version"));
  }
  const std::string_view data_model = given(root, "datamodel").value_or("");
  has_data_model_ = !data_model.empty();
  if (data_model.empty()) {
    model_->data_model = options_.default_data_model;
  } else if (data_model == "ecmascript") {
    model_->data_model = DataModelKind::kEcmaScript;
  } else if (data_model != "null") {
    const std::array<std::string, 2> known{"ecmascript", "null"};
    model_->data_model = DataModelKind::kForeign;
    refuse("scxml.data-model",
           fmt::format("data model \"{}\" cannot be run, only \"ecmascript\" and \"null\"; check, graph, fmt and diff "
                       "take the chart all the same{}",
                       data_model, did_you_mean(data_model, known)),
           value_place(root, "datamodel"));
  }
  const std::string_view binding = given(root, "binding").value_or("early");
  model_->late_binding = binding == "late";
  if (binding != "early" && binding != "late") {
    wrong("scxml.bad-attribute", fmt::format("binding \"{}\" is neither \"early\" nor \"late\"", binding),
          value_place(root, "binding"));
  }

  add_state(root, StateKind::kRoot, kNoState);
  for (Element child = root.first_child(); child; child = child.next_sibling()) {
    if (!is_scxml(child)) {
      in_parts_ |= child.namespace_uri() == kXInclude;
      continue;
    }
    const std::string_view name = child.local_name();
    if (name == "state" || name == "parallel" || name == "final")
      load_state(child, 0, 1);
    else if (name == "datamodel")
      load_datamodel(child, 0);
    else if (name == "script")
      model_->scripts.push_back(load_script(child).code);
    else if (!load_foreign_child(child, 0))
      unknown_element(child, "scxml", {"state", "parallel", "final", "datamodel", "script"});
  }
  model_->states[0].end = static_cast<StateIndex>(model_->states.size());
  for (const std::string_view name : {"initial", "initialstate"}) {
    const auto initial = given(root, name);
    if (!initial || model_->state_code[0].initial != kNoTransition) continue;
    if (name != "initial")
      warn("scxml.unknown-attribute", "\"initialstate\" of early drafts is read as \"initial\"",
           attribute_place(root, name));
    add_default(0, *initial, value_place(root, name), true);
  }
  if (model_->states[0].children.empty()) {
    if (in_parts_)
      refuse("scxml.no-state", "<scxml> has no state of its own to be in", place(root));
    else
      wrong("scxml.no-state", "<scxml> has no state to be in", place(root));
  }
}

StateIndex Loader::add_state(const Element& element, StateKind kind, StateIndex parent) {
  const auto index = static_cast<StateIndex>(model_->states.size());
  State& state = model_->states.emplace_back();
  StateCode& code = model_->state_code.emplace_back();
  state.kind = kind;
  state.parent = parent;
  state.place = place(element);
  if (parent != kNoState) {
    state.depth = model_->states[parent].depth + 1;
    model_->states[parent].children.push_back(index);
    state.id = given(element, "id").value_or("");
  }
  if (!state.id.empty() && !model_->ids.emplace(state.id, index).second) {
    const State& first = model_->states[model_->ids.at(state.id)];
    error("scxml.duplicate-id",
          fmt::format("state id \"{}\" is given twice; first in line {}", state.id, first.place.line),
          value_place(element, "id"));
  }
  // SCXML 3.14: the processor makes up an id where there is none.
  code.done_event = fmt::format("done.state.{}", state.id.empty() ? fmt::format("${}", index) : state.id);
  if (model_->states.size() == options_.limits.states_max + 1) {
    error("scxml.too-large", fmt::format("the chart has more than {} states", options_.limits.states_max), state.place);
  }
  return index;
}

void Loader::load_state(const Element& element, StateIndex parent, int depth) {
  stray_text(element);
  if (too_deep(element, depth) || model_->states.size() > options_.limits.states_max) return;
  const std::string_view name = element.local_name();
  const bool parallel = name == "parallel";
  const bool final = name == "final";
  const StateIndex index = add_state(element,
                                     parallel ? StateKind::kParallel
                                     : final  ? StateKind::kFinal
                                              : StateKind::kAtomic,
                                     parent);
  if (name == "state")
    know_attributes(element, {"id", "initial"});
  else
    know_attributes(element, {"id"});
  in_parts_ |= given(element, "src").has_value();
  for (Element child = element.first_child(); child; child = child.next_sibling()) {
    if (is_scxml(child))
      load_state_child(child, index, depth + 1);
    else
      in_parts_ |= child.namespace_uri() == kXInclude;
  }
  State& state = model_->states[index];
  state.end = static_cast<StateIndex>(model_->states.size());
  bool has_child_state = false;
  for (const StateIndex child : state.children) has_child_state |= !model_->states[child].is_history();
  if (state.kind == StateKind::kAtomic && has_child_state) state.kind = StateKind::kCompound;
  const auto initial = name == "state" ? given(element, "initial") : std::nullopt;
  if (initial && state.kind != StateKind::kCompound) {
    error("scxml.bad-initial", fmt::format("state \"{}\" has an initial state but no child states", state.id),
          value_place(element, "initial"));
  } else if (initial && model_->state_code[index].initial != kNoTransition) {
    error("scxml.bad-initial",
          fmt::format("state \"{}\" has both an initial attribute and an <initial>; keep one", state.id),
          value_place(element, "initial"));
  } else if (initial) {
    add_default(index, *initial, value_place(element, "initial"), true);
  }
}

void Loader::load_state_child(const Element& element, StateIndex state, int depth) {
  const std::string_view name = element.local_name();
  const StateKind kind = model_->states[state].kind;
  state_ = state;
  if (name == "onentry" || name == "onexit") {
    know_attributes(element, {});
    Block block = load_block(element, depth);
    auto& blocks = name == "onentry" ? model_->state_code[state].onentry : model_->state_code[state].onexit;
    blocks.push_back(std::move(block));
  } else if (kind == StateKind::kFinal) {
    if (name == "donedata")
      load_donedata(element, state);
    else if (!load_foreign_child(element, state))
      unknown_element(element, "final", {"onentry", "onexit", "donedata"});
  } else if (name == "state" || name == "parallel" || (name == "final" && kind != StateKind::kParallel)) {
    load_state(element, state, depth);
  } else if (name == "transition") {
    load_transitions(element, state);
  } else if (name == "history") {
    load_history(element, state);
  } else if (name == "datamodel") {
    load_datamodel(element, state);
  } else if (name == "invoke") {
    load_invoke(element, state);
  } else if (name == "initial" && kind != StateKind::kParallel) {
    load_initial(element, state);
  } else if (load_foreign_child(element, state)) {
    return;
  } else if (kind == StateKind::kParallel) {
    unknown_element(element, "parallel",
                    {"onentry", "onexit", "transition", "state", "parallel", "history", "datamodel", "invoke"});
  } else {
    unknown_element(
        element, "state",
        {"onentry", "onexit", "transition", "initial", "state", "parallel", "final", "history", "datamodel", "invoke"});
  }
}

// What the recommendation does not have here, but other engines do, and what a drawing needs: transitions, initial and
// history states of the whole chart, <final> in a <parallel>, and elements of dialects that lead to a target.
bool Loader::load_foreign_child(const Element& element, StateIndex state) {
  const std::string_view name = element.local_name();
  const StateKind kind = model_->states[state].kind;
  constexpr std::array<std::string_view, 6> kOfStates{"transition", "initial", "history",
                                                      "onentry",    "onexit",  "invoke"};
  const bool of_root =
      kind == StateKind::kRoot && std::find(kOfStates.begin(), kOfStates.end(), name) != kOfStates.end();
  const bool of_parallel = kind == StateKind::kParallel && name == "final";
  const bool dialect = !options_.to_run && kind != StateKind::kFinal && given(element, "target") && name != "send";
  if (of_root || of_parallel) {
    refuse("scxml.misplaced-element", fmt::format("<{}> cannot stand inside <{}>", name, element.parent().local_name()),
           place(element));
    if (of_parallel)
      load_state(element, state, static_cast<int>(model_->states[state].depth) + 1);
    else
      load_state_child(element, state, 1);
    return true;
  }
  if (!dialect) return false;
  refuse("scxml.unknown-element",
         fmt::format("<{}> is not SCXML; it is drawn as a transition, since it has a target", name), place(element));
  load_transitions(element, state);
  return true;
}

// Of one <transition>: more than one if its targets are alternatives.
void Loader::load_transitions(const Element& element, StateIndex source) {
  std::vector<Element> alternatives;
  if (!options_.to_run && !given(element, "target")) {
    for (Element child = element.first_child(); child; child = child.next_sibling()) {
      if (child.local_name() == "target") alternatives.push_back(child);
    }
  }
  if (alternatives.empty()) alternatives.emplace_back();
  for (const Element& alternative : alternatives) {
    const TransitionIndex transition = load_transition(element, source, false, alternative);
    model_->states[source].transitions.push_back(transition);
  }
}

void Loader::load_history(const Element& element, StateIndex parent) {
  if (model_->states.size() > options_.limits.states_max) return;
  know_attributes(element, {"id", "type"});
  const std::string_view type = given(element, "type").value_or("shallow");
  if (type != "shallow" && type != "deep") {
    wrong("scxml.bad-attribute", fmt::format("type \"{}\" of <history> is neither \"shallow\" nor \"deep\"", type),
          value_place(element, "type"));
  }
  const StateIndex index =
      add_state(element, type == "deep" ? StateKind::kHistoryDeep : StateKind::kHistoryShallow, parent);
  model_->states[index].end = index + 1;
  model_->state_code[parent].history.push_back(index);
  model_->has_history = true;
  for (Element child = element.first_child(); child; child = child.next_sibling()) {
    if (!is_scxml(child)) continue;
    if (child.local_name() == "transition" && model_->state_code[index].initial == kNoTransition) {
      const TransitionIndex transition = load_transition(child, parent, true, {});
      model_->state_code[index].initial = transition;
    } else {
      unknown_element(child, "history", {"transition"});
    }
  }
}

void Loader::load_initial(const Element& element, StateIndex state) {
  know_attributes(element, {});
  if (model_->state_code[state].initial != kNoTransition) {
    error("scxml.bad-initial", fmt::format("state \"{}\" has two <initial>; keep one", model_->states[state].id),
          place(element));
    return;
  }
  for (Element child = element.first_child(); child; child = child.next_sibling()) {
    if (!is_scxml(child)) continue;
    if (child.local_name() == "transition" && model_->state_code[state].initial == kNoTransition) {
      const TransitionIndex transition = load_transition(child, state, true, {});
      model_->state_code[state].initial = transition;
    } else {
      unknown_element(child, "initial", {"transition"});
    }
  }
  if (model_->state_code[state].initial == kNoTransition)
    error("scxml.missing-element", "<initial> needs a <transition>", place(element));
}

TransitionIndex Loader::load_transition(const Element& element, StateIndex source, bool pseudo,
                                        const Element& alternative) {
  const bool foreign = element.local_name() != "transition";
  if (!foreign) know_attributes(element, {"event", "cond", "target", "type"});
  const auto index = static_cast<TransitionIndex>(model_->transitions.size());
  model_->transitions.emplace_back();
  model_->transition_code.emplace_back();
  if (model_->transitions.size() == options_.limits.transitions_max + 1) {
    error("scxml.too-large", fmt::format("the chart has more than {} transitions", options_.limits.transitions_max),
          place(element));
  }
  Transition transition;
  TransitionCode code;
  transition.source = source;
  transition.place = place(element);
  for (const std::string_view name : {"event", "cond"}) {
    if (pseudo && given(element, name)) {
      wrong("scxml.bad-attribute",
            fmt::format("the <transition> of <{}> cannot have \"{}\"", element.parent().local_name(), name),
            attribute_place(element, name));
    }
  }
  // What an element of a dialect waits for is in its name.
  std::string events(given(element, "event").value_or(foreign ? element.local_name() : ""));
  if (foreign && given(element, "name")) events += fmt::format(":{}", *given(element, "name"));
  for_each_name(events, [&](std::string_view descriptor) {
    if (descriptor.front() == '.' || descriptor.find("..") != std::string_view::npos) {
      warn("scxml.bad-event", fmt::format("no event is called \"{}\": between its dots a name is missing", descriptor),
           value_place(element, "event"));
    }
    const DescriptorId id = model_->descriptors.add(descriptor);
    code.descriptors.push_back(id);
    transition.events.push_back(model_->descriptors.all()[id]);
  });
  code.eventless = code.descriptors.empty();
  if (!pseudo && code.eventless) model_->has_eventless = true;
  transition.condition = given(element, "cond").value_or("");
  code.condition = load_expression(element, "cond", ExpressionUse::kCondition);
  const std::string_view type = given(element, "type").value_or("external");
  transition.internal = type == "internal";
  if (type != "internal" && type != "external" && !foreign) {
    wrong("scxml.bad-attribute",
          fmt::format("type \"{}\" of <transition> is neither \"internal\" nor \"external\"", type),
          value_place(element, "type"));
  }
  const Element& leads = alternative ? alternative : element;
  const char* name = alternative ? (given(leads, "id") ? "id" : "next") : "target";
  if (!alternative && !foreign && !given(element, "target") && given(element, "next")) {
    name = "next";
    refuse("scxml.unknown-attribute", "\"next\" of early drafts is read as \"target\"", attribute_place(element, name));
  }
  if (const auto target = given(leads, name))
    references_.push_back({index, std::string(*target), value_place(leads, name), pseudo, foreign || alternative});
  else if (pseudo)
    required(element, "target");
  if (alternative && given(alternative, "prob"))
    transition.condition += fmt::format(" [{}]", *given(alternative, "prob"));
  code.content = load_block(element, static_cast<int>(model_->states[source].depth) + 1);
  model_->transitions[index] = std::move(transition);
  model_->transition_code[index] = std::move(code);
  return index;
}

TransitionIndex Loader::add_default(StateIndex source, std::string_view targets, const Place& place, bool initial) {
  const auto index = static_cast<TransitionIndex>(model_->transitions.size());
  Transition& transition = model_->transitions.emplace_back();
  model_->transition_code.emplace_back();
  transition.source = source;
  transition.place = place;
  model_->state_code[source].initial = index;
  references_.push_back({index, std::string(targets), place, initial});
  return index;
}

void Loader::load_datamodel(const Element& element, StateIndex state) {
  know_attributes(element, {});
  for (Element child = element.first_child(); child; child = child.next_sibling()) {
    if (!is_scxml(child)) continue;
    if (child.local_name() != "data") {
      unknown_element(child, "datamodel", {"data"});
      continue;
    }
    know_attributes(child, {"id", "src", "expr"});
    Variable variable;
    variable.id = required(child, "id");
    variable.state = state;
    variable.place = place(child);
    variable.expr = load_expression(child, "expr", ExpressionUse::kValue);
    if (variable.expr == kNoExpression) {
      if (const auto src = given(child, "src")) {
        auto text = read(*src);
        if (text)
          variable.content = value_of_text(*text);
        else
          variable.failure = fmt::format("\"{}\": {}", *src, text.error().message);
      } else {
        variable.content = inline_content(child);
      }
    }
    const auto slot = static_cast<std::uint32_t>(model_->variables.size());
    if (!model_->slots.emplace(variable.id, slot).second) {
      wrong("scxml.duplicate-id",
            fmt::format("data id \"{}\" is given twice; all data of a chart share one scope", variable.id),
            value_place(child, "id"));
      continue;
    }
    if (state == 0) {
      DataItem item;
      item.id = variable.id;
      item.has_value = variable.expr != kNoExpression || variable.content || !variable.failure.empty();
      item.initial =
          variable.expr != kNoExpression ? constant_value(model_->expressions[variable.expr].text) : variable.content;
      item.place = variable.place;
      model_->data.push_back(std::move(item));
    }
    model_->state_code[state].variables.push_back(slot);
    model_->variables.push_back(std::move(variable));
  }
}

void Loader::load_invoke(const Element& element, StateIndex state) {
  know_attributes(element, {"type", "typeexpr", "src", "srcexpr", "id", "idlocation", "namelist", "autoforward"});
  Invoke invoke;
  invoke.state = state;
  invoke.place = place(element);
  invoke.id = element.attribute("id").value_or("");
  invoke.idlocation = load_expression(element, "idlocation", ExpressionUse::kLocation);
  invoke.type = load_text(element, "type", "typeexpr");
  invoke.src = load_text(element, "src", "srcexpr");
  invoke.autoforward = element.attribute("autoforward").value_or("false") == "true";
  invoke.payload = load_payload(element, true, nullptr);
  if (!invoke.src.constant.empty()) {
    if (auto text = read(invoke.src.constant)) {
      invoke.src_text = *std::move(text);
    } else if (options_.read) {
      invoke.src_missing = std::move(text.error().message);
    }
  }
  for (Element child = element.first_child(); child; child = child.next_sibling()) {
    if (!is_scxml(child)) continue;
    const std::string_view name = child.local_name();
    if (name == "finalize") {
      know_attributes(child, {});
      invoke.has_finalize = true;
      invoke.finalize = load_block(child, static_cast<int>(model_->states[state].depth) + 2);
    } else if (name != "param" && name != "content") {
      unknown_element(child, "invoke", {"param", "content", "finalize"});
    }
  }
  model_->state_code[state].invokes.push_back(static_cast<std::uint32_t>(model_->invokes.size()));
  model_->invokes.push_back(std::move(invoke));
}

void Loader::load_donedata(const Element& element, StateIndex state) {
  know_attributes(element, {});
  auto payload = std::make_unique<Payload>(load_payload(element, false, nullptr));
  for (const Param& param : payload->params) model_->states[state].donedata.push_back(param.name);
  model_->state_code[state].donedata = std::move(payload);
}

// ---- Attributes and messages ----

namespace {

Place to_place(const SourceSpan& span) { return {span.line, span.column, span.length}; }

std::string quoted_list(std::initializer_list<std::string_view> names) {
  std::string text;
  for (const std::string_view name : names) {
    if (!text.empty()) text += ", ";
    text += name;
  }
  return text;
}

}  // namespace

// Elements are read in document order, so the lines are counted on from the last place.
Place Loader::place_at(std::size_t offset, std::size_t length) const {
  constexpr std::size_t kNear = 1000;
  const std::string& source = document_.source();
  if (offset < last_offset_ || offset - last_offset_ > kNear) {
    const auto at = document_.lines().position(offset);
    last_line_ = at.line;
    last_line_begin_ = offset + 1 - static_cast<std::size_t>(at.column);
  } else {
    // No further than the place: the next line may be far off.
    for (std::size_t at = last_offset_; at < offset; ++at) {
      if (source[at] != '\n') continue;
      ++last_line_;
      last_line_begin_ = at + 1;
    }
  }
  last_offset_ = offset;
  return {last_line_, static_cast<int>(offset - last_line_begin_ + 1), static_cast<int>(length)};
}

Place Loader::place(const Element& element) const { return place_at(element.offset(), element.name().size() + 1); }
Place Loader::attribute_place(const Element& element, std::string_view name) const {
  return to_place(element.attribute_span(name));
}
Place Loader::value_place(const Element& element, std::string_view name) const {
  // What is written may be longer than the value, which has its entities resolved.
  const std::size_t begin = element.attribute_value_offset(name);
  const std::string& source = document_.source();
  if (begin == element.offset()) return place(element);
  const std::size_t end = std::min(source.find(source[begin - 1], begin), source.size());
  return place_at(begin, end - begin);
}

bool Loader::is_scxml(const Element& element) const {
  if (root_decides_ && element.name().find(':') == std::string_view::npos) return true;
  const std::string_view uri = element.namespace_uri();
  return uri == namespace_ || uri == kNamespace;
}

bool Loader::is_editor_data(const Element& element) {
  return element.namespace_uri() == "http://www.qt.io/2015/02/scxml-ext" || element.local_name() == "editorinfo";
}

bool Loader::only_root_declares(const Element& root) const {
  std::size_t at_root = 0;
  root.for_each_attribute(
      [&](std::string_view name, std::string_view) { at_root += name.starts_with("xmlns") ? 1 : 0; });
  std::size_t all = 0;
  const std::string& source = document_.source();
  for (std::size_t at = source.find("xmlns"); at != std::string::npos; at = source.find("xmlns", at + 1)) ++all;
  return at_root == all && root.name().find(':') == std::string_view::npos;
}

std::optional<std::string_view> Loader::given(const Element& element, std::string_view name) {
  const auto value = element.attribute(name);
  return value && value->find_first_not_of(" \t\r\n") != std::string_view::npos ? value : std::nullopt;
}

bool Loader::has_prefixed_attribute(const Element& element) {
  bool found = false;
  element.for_each_attribute([&](std::string_view name, std::string_view) {
    found |= name.find(':') != std::string_view::npos && !name.starts_with("xml");
  });
  return found;
}

std::string_view Loader::required(const Element& element, std::string_view name) {
  if (const auto value = given(element, name)) return *value;
  std::string message = fmt::format("<{}> needs the attribute \"{}\"", element.local_name(), name);
  // A prefixed attribute may be another way to say it.
  if (has_prefixed_attribute(element))
    refuse("scxml.missing-attribute", std::move(message), place(element));
  else
    wrong("scxml.missing-attribute", std::move(message), place(element));
  return {};
}

void Loader::know_attributes(const Element& element, std::initializer_list<std::string_view> names) {
  element.for_each_attribute([&](std::string_view name, std::string_view value) {
    if (name.starts_with("xmlns") || name.find(':') != std::string_view::npos) return;
    for (const std::string_view known : names) {
      if (name != known) continue;
      if (value.find_first_not_of(" \t\r\n") == std::string_view::npos && name != "label" && name != "name") {
        warn("scxml.empty-attribute",
             fmt::format("the empty \"{}\" of <{}> is taken as if it were not there", name, element.local_name()),
             attribute_place(element, name));
      }
      return;
    }
    const std::vector<std::string> candidates(names.begin(), names.end());
    warn("scxml.unknown-attribute",
         fmt::format("<{}> has no attribute \"{}\"; it is ignored{}", element.local_name(), name,
                     did_you_mean(name, candidates)),
         attribute_place(element, name));
  });
}

void Loader::unknown_element(const Element& element, std::string_view inside,
                             std::initializer_list<std::string_view> allowed) {
  const std::vector<std::string> candidates(allowed.begin(), allowed.end());
  const std::string hint = did_you_mean(element.local_name(), candidates);
  std::string message = fmt::format("<{}> cannot stand inside <{}>{}", element.local_name(), inside,
                                    hint.empty() ? "; there can be " + quoted_list(allowed) : hint);
  model_->passed_over = true;
  if (hint.empty())
    refuse("scxml.unknown-element", std::move(message), place(element));
  else
    error("scxml.unknown-element", std::move(message), place(element));
}

void Loader::error(std::string code, std::string message, const Place& where) {
  diagnostics_.push_back(
      {Severity::kError, std::move(code), std::move(message), {model_->file, where.line, where.column, where.length}});
}

void Loader::refuse(std::string code, std::string message, const Place& where) {
  if (options_.to_run) return error(std::move(code), std::move(message), where);
  if (!model_->obstacle) {
    model_->obstacle =
        Diagnostic{Severity::kError, code, message, {model_->file, where.line, where.column, where.length}};
  }
  warn(std::move(code), std::move(message), where);
}

void Loader::wrong(std::string code, std::string message, const Place& where) {
  if (model_->obstacle)
    refuse(std::move(code), std::move(message), where);
  else
    error(std::move(code), std::move(message), where);
}

void Loader::warn(std::string code, std::string message, const Place& where) {
  diagnostics_.push_back({Severity::kWarning,
                          std::move(code),
                          std::move(message),
                          {model_->file, where.line, where.column, where.length}});
}

bool Loader::too_deep(const Element& element, int depth) {
  if (depth <= options_.limits.nesting_max) return false;
  error("scxml.too-deep", fmt::format("elements are nested more than {} deep", options_.limits.nesting_max),
        place(element));
  return true;
}

Loaded<Chart> load(std::string_view source, std::string file, const LoadOptions& options) {
  return load_in({}, source, std::move(file), options);
}

Loaded<Chart> load_in(std::string folder, std::string_view source, std::string file, const LoadOptions& options) {
  Loaded<Chart> loaded;
  if (source.size() > options.limits.source_bytes_max) {
    loaded.diagnostics.push_back({Severity::kError,
                                  "scxml.too-large",
                                  fmt::format("the chart is larger than {} bytes", options.limits.source_bytes_max),
                                  {file}});
    return loaded;
  }
  auto document = text::XmlDocument::parse(std::string(source), std::move(file), {.lenient = !options.to_run});
  if (!document) {
    loaded.diagnostics.push_back(std::move(document.error()));
    return loaded;
  }
  Loader loader(*document, options, std::move(folder));
  auto model = loader.run();
  loaded.diagnostics = loader.take_diagnostics();
  for (Diagnostic warning : document->warnings()) {
    // No reader of SCXML takes a document that is not well-formed; many take one with prefixes that nobody declares.
    if (warning.code != "xml.namespace") {
      warning.severity = Severity::kError;
      model = nullptr;
    }
    loaded.diagnostics.push_back(std::move(warning));
  }
  sort_by_place(loaded.diagnostics);
  if (model) loaded.value.emplace(std::move(model));
  return loaded;
}

}  // namespace sentree::scxml
