#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <set>
#include <string>
#include <string_view>

#include "sentree/scxml/loader.h"
#include "sentree/scxml/script_syntax.h"

namespace sentree::scxml {

void Loader::resolve() {
  for (const Reference& reference : references_) {
    resolve_targets(reference);
  }
  add_default_initials();
  add_default_histories();
  choose_data_model();
  if (has_errors(diagnostics_)) return;
  compute_domains();
  compile_expressions();
  load_children();
  find_ambient();
  model_->atomic = StateSet(model_->states.size());
  for (StateIndex s = 0; s < model_->states.size(); ++s) {
    if (model_->states[s].is_atomic()) model_->atomic.insert(s);
  }
}

void Loader::resolve_targets(const Reference& reference) {
  const Place& place = reference.place;
  Transition& transition = model_->transitions[reference.transition];
  for_each_name(reference.ids, [&](std::string_view id) {
    const auto found = model_->ids.find(id);
    if (found == model_->ids.end()) {
      std::vector<std::string> candidates;
      for (const State& state : model_->states) {
        if (!state.id.empty()) candidates.push_back(state.id);
      }
      const bool attribute = reference.initial && transition.place == place;
      const std::string message =
          fmt::format("{} \"{}\" is not a state{}", attribute ? "initial state" : "transition target", id,
                      did_you_mean(id, candidates));
      const char* const code = attribute ? "scxml.unknown-initial" : "scxml.unknown-target";
      if (reference.foreign || in_parts_)
        refuse(code, message, place);
      else
        error(code, message, place);
      return;
    }
    transition.targets.push_back(found->second);
  });
  check_targets(reference.transition, place, reference.initial);
}

void Loader::check_targets(TransitionIndex index, const Place& place, bool initial) {
  const Transition& transition = model_->transitions[index];
  const auto name = [&](StateIndex s) { return fmt::format("\"{}\"", model_->states[s].id); };
  for (const StateIndex target : transition.targets) {
    if (initial && model_->states[target].is_history() && is_history_default(index)) {
      error("scxml.bad-targets", "the default of a <history> cannot be a <history>", place);
    }
    // SCXML 3.3.2, 3.10.2: initial and default states lie inside the state whose they are.
    if (initial && !model_->is_descendant(target, transition.source)) {
      error("scxml.bad-initial",
            fmt::format("initial state {} is not inside {}", name(target),
                        transition.source == 0 ? "<scxml>" : name(transition.source)),
            place);
    }
  }
  // SCXML 3.5: several targets must fit into one configuration, so any two of them lie in different regions of a
  // <parallel>.
  for (std::size_t i = 0; i < transition.targets.size(); ++i) {
    for (std::size_t k = i + 1; k < transition.targets.size(); ++k) {
      StateIndex a = transition.targets[i];
      const StateIndex b = transition.targets[k];
      const bool nested = a == b || model_->is_descendant(a, b) || model_->is_descendant(b, a);
      while (!nested && !model_->is_descendant(b, a)) a = model_->states[a].parent;
      if (nested || model_->states[a].kind != StateKind::kParallel) {
        error("scxml.bad-targets",
              fmt::format("targets {} and {} cannot be active together", name(transition.targets[i]), name(b)), place);
        return;
      }
    }
  }
}

void Loader::add_default_initials() {
  for (StateIndex s = 0; s < model_->states.size(); ++s) {
    const State& state = model_->states[s];
    StateCode& code = model_->state_code[s];
    if ((state.kind != StateKind::kCompound && state.kind != StateKind::kRoot) || code.initial != kNoTransition)
      continue;
    const auto first = std::find_if(state.children.begin(), state.children.end(),
                                    [&](StateIndex child) { return !model_->states[child].is_history(); });
    if (first == state.children.end()) continue;
    code.initial = static_cast<TransitionIndex>(model_->transitions.size());
    Transition& transition = model_->transitions.emplace_back();
    model_->transition_code.emplace_back();
    transition.source = s;
    transition.targets = {*first};
    transition.place = state.place;
  }
}

// SCXML 3.10 wants a default. Without one: the states that its parent is entered with.
void Loader::add_default_histories() {
  for (StateIndex s = 0; s < model_->states.size(); ++s) {
    if (!model_->states[s].is_history() || model_->state_code[s].initial != kNoTransition) continue;
    const StateIndex parent = model_->states[s].parent;
    const auto is_history = [&](StateIndex state) { return model_->states[state].is_history(); };
    std::vector<StateIndex> targets;
    for (const StateIndex child : model_->states[parent].children) {
      if (!is_history(child) && (targets.empty() || model_->states[parent].kind == StateKind::kParallel))
        targets.push_back(child);
    }
    const TransitionIndex initial = model_->state_code[parent].initial;
    if (initial != kNoTransition) {
      const auto& entered = model_->transitions[initial].targets;
      if (!entered.empty() && std::none_of(entered.begin(), entered.end(), is_history)) targets = entered;
    }
    const State& state = model_->states[s];
    if (targets.empty()) {
      refuse("scxml.missing-element",
             fmt::format("<history> \"{}\" has no default state, and there is none beside it", state.id), state.place);
      continue;
    }
    warn("scxml.no-default",
         fmt::format("<history> \"{}\" has no <transition> to its default state; before {} has been left once it leads "
                     "to where that begins",
                     state.id, parent == 0 ? "the chart" : fmt::format("\"{}\"", model_->states[parent].id)),
         state.place);
    model_->state_code[s].initial = static_cast<TransitionIndex>(model_->transitions.size());
    Transition& transition = model_->transitions.emplace_back();
    model_->transition_code.emplace_back();
    transition.source = parent;
    transition.targets = std::move(targets);
    transition.place = state.place;
  }
}

// The null data model has no expressions but In().
void Loader::choose_data_model() {
  if (model_->data_model != DataModelKind::kNull) return;
  const auto beyond = std::find_if(model_->expressions.begin(), model_->expressions.end(),
                                   [](const Expression& e) { return compile_null(e.text).empty(); });
  if (beyond == model_->expressions.end()) return;
  if (!has_data_model_) {
    model_->data_model = DataModelKind::kEcmaScript;
    model_->guessed_data_model = !options_.to_run;
    warn("scxml.no-data-model",
         fmt::format("no data model is named, but there are expressions, the first in line {}; they are taken as "
                     "ecmascript: write datamodel=\"ecmascript\"",
                     beyond->place.line),
         model_->states[0].place);
  } else if (!options_.to_run && !model_->obstacle) {
    model_->obstacle = Diagnostic{Severity::kError,
                                  "scxml.data-model",
                                  "the null data model has no expressions but In('state')",
                                  {model_->file, beyond->place.line, beyond->place.column, beyond->place.length}};
  }
}

// SCXML Appendix D, getTransitionDomain, for the transitions where it does not depend on history.
void Loader::compute_domains() {
  for (TransitionIndex t = 0; t < model_->transitions.size(); ++t) {
    const Transition& transition = model_->transitions[t];
    TransitionCode& code = model_->transition_code[t];
    if (transition.targets.empty()) continue;
    const StateIndex source = transition.source;
    bool inside = true;
    for (const StateIndex target : transition.targets) {
      code.dynamic |= model_->states[target].is_history();
      inside &= model_->is_descendant(target, source);
    }
    if (transition.internal && inside && model_->states[source].kind == StateKind::kCompound) {
      code.domain = source;
      continue;
    }
    StateIndex domain = source == 0 ? 0 : model_->states[source].parent;
    const auto fits = [&](StateIndex s) {
      if (model_->states[s].kind != StateKind::kCompound && model_->states[s].kind != StateKind::kRoot) return false;
      return std::all_of(transition.targets.begin(), transition.targets.end(),
                         [&](StateIndex target) { return model_->is_descendant(target, s); });
    };
    while (!fits(domain)) domain = model_->states[domain].parent;
    code.domain = domain;
  }
}

// Charts of <invoke> whose text is in the document, or in a file that it names, are loaded with it. One that is wrong
// is found when it is invoked (SCXML 6.4), and by `check`.
void Loader::load_children() {
  if (depth_ >= kChildDepthMax) return;
  for (Invoke& invoke : model_->invokes) {
    const bool inline_chart =
        invoke.payload.content && invoke.payload.content_expr == kNoExpression && invoke.src.absent();
    std::string source = inline_chart ? invoke.payload.content_source : invoke.src_text;
    if (source.find('<') == std::string::npos) continue;
    if (inline_chart) {
      // Padded, so that messages and observers name lines of this document.
      source.erase(0, source.find('<'));
      source.insert(
          0, std::string(static_cast<std::size_t>(std::max(0, invoke.payload.content_place.line - 1)), '\n') +
                 std::string(static_cast<std::size_t>(std::max(0, invoke.payload.content_place.column - 1)), ' '));
    }
    const std::string file = seen_from(model_->folder, invoke.src.constant);
    // Named as this document is, which may be seen from elsewhere.
    auto document = text::XmlDocument::parse(
        std::move(source), inline_chart ? model_->file : seen_from(folder_of(model_->file), invoke.src.constant));
    if (!document) continue;
    Loader loader(*document, options_, inline_chart ? model_->folder : folder_of(file), depth_ + 1);
    if (auto child = loader.run()) invoke.child.emplace(std::move(child));
  }
}

bool Loader::is_history_default(TransitionIndex transition) const {
  return std::any_of(model_->states.begin(), model_->states.end(), [&](const State& state) {
    return state.is_history() &&
           model_->state_code[static_cast<std::size_t>(&state - model_->states.data())].initial == transition;
  });
}

namespace {

// Evaluating it changes no data: there is no call, no assignment, no "new" and no accessor of scripts in it.
bool is_pure(std::string_view text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '(' || c == '{' || c == '`' || text.substr(i).starts_with("++") || text.substr(i).starts_with("--"))
      return false;
    if (c != '=') continue;
    const bool comparison =
        (i > 0 && (text[i - 1] == '=' || text[i - 1] == '!' || text[i - 1] == '<' || text[i - 1] == '>')) ||
        (i + 1 < text.size() && text[i + 1] == '=');
    if (!comparison || text.substr(i).starts_with("=>")) return false;
    if (i >= 2 && (text.substr(i - 2, 3) == "<<=" || text.substr(i - 2, 3) == ">>=")) return false;
  }
  return text.find("delete") == std::string_view::npos && text.find("new") == std::string_view::npos;
}

// Whether a script may make members that are hidden, read-only or accessors, or objects without an end of their own.
bool makes_plain_objects(std::string_view text) {
  constexpr std::array<std::string_view, 5> kSuspects{"Object", "Reflect", "Proxy", "__", "constructor"};
  const auto is_suspect = [text](std::string_view word) { return text.find(word) != std::string_view::npos; };
  if (std::none_of(kSuspects.begin(), kSuspects.end(), is_suspect) && !is_suspect("get ") && !is_suspect("set ") &&
      !is_suspect("eval") && !is_suspect("Function") && !is_suspect("this"))
    return true;
  const auto tokens = script_tokens(text);
  if (!tokens) return false;
  for (std::size_t i = 0; i < tokens->size(); ++i) {
    const std::string_view word = (*tokens)[i].raw;
    const auto behind = [&](std::size_t n) {
      return i + n < tokens->size() ? (*tokens)[i + n].raw : std::string_view();
    };
    if ((*tokens)[i].kind != ScriptToken::Kind::kName) {
      // A member that is named by a text.
      if ((*tokens)[i].kind == ScriptToken::Kind::kLiteral &&
          (word.find("__") != std::string_view::npos || word.find("constructor") != std::string_view::npos))
        return false;
      continue;
    }
    if (word == "Object") {
      constexpr std::array<std::string_view, 6> kHarmless{
          "keys", "getOwnPropertyNames", "getPrototypeOf", "isFrozen", "isSealed", "isExtensible"};
      if (behind(1) != "." || std::find(kHarmless.begin(), kHarmless.end(), behind(2)) == kHarmless.end()) return false;
    } else if (word == "Reflect" || word == "Proxy" || word == "constructor" || word == "eval" || word == "Function" ||
               word == "globalThis" || word.starts_with("__")) {
      return false;
    } else if (word == "this" && behind(1) != ".") {
      return false;
    } else if ((word == "get" || word == "set") && i + 1 < tokens->size() &&
               (*tokens)[i + 1].kind != ScriptToken::Kind::kSign) {
      return false;
    }
  }
  return true;
}

// Names of built-in objects and of functions of the embedding program that no script of a chart gives to anything else.
class UntouchedNames {
 public:
  explicit UntouchedNames(const Model& model) : model_(model) {}

  bool contains(std::string_view name) {
    if (!model_.plain_objects) return false;
    if (!looked_) look();
    return !unread_ && touched_.find(name) == touched_.end() && (name == "Math" || !is_script_global(name));
  }

 private:
  // A function that is only called, and a built-in object of which only members are used, are what they are elsewhere.
  void look() {
    looked_ = true;
    for (const Expression& expression : model_.expressions) {
      const auto tokens = script_tokens(expression.text);
      unread_ = unread_ || !tokens;
      if (unread_) return;
      for (std::size_t i = 0; i < tokens->size(); ++i) {
        const ScriptToken& token = (*tokens)[i];
        if (token.kind != ScriptToken::Kind::kName) continue;
        const std::string_view before = i > 0 ? (*tokens)[i - 1].raw : std::string_view();
        const std::string_view behind = i + 1 < tokens->size() ? (*tokens)[i + 1].raw : std::string_view();
        const bool is_used = behind == (token.raw == "Math" ? "." : "(");
        if (before != "." && (!is_used || before == "function" || before == "new")) touched_.emplace(token.raw);
      }
    }
  }

  const Model& model_;
  bool looked_ = false;
  bool unread_ = false;
  std::set<std::string, std::less<>> touched_;
};

}  // namespace

void Loader::look_into_scripts() {
  std::vector<std::string_view> scripts;
  for (const ExpressionId script : model_->scripts) {
    if (script != kNoExpression) scripts.push_back(model_->expressions[script].text);  // else it could not be read
  }
  std::vector<std::string_view> others;
  for (ExpressionId id = 0; id < model_->expressions.size(); ++id) {
    const std::string& text = model_->expressions[id].text;
    model_->plain_objects = model_->plain_objects && makes_plain_objects(text);
    if (std::find(model_->scripts.begin(), model_->scripts.end(), id) == model_->scripts.end()) others.push_back(text);
  }
  if (scripts.empty()) return;
  model_->functions = look_into_functions(
      scripts, others, [this](std::string_view name) { return model_->slots.find(name) != model_->slots.end(); });
}

void Loader::compile_expressions() {
  if (model_->data_model == DataModelKind::kForeign) return;
  if (model_->data_model != DataModelKind::kEcmaScript) {
    for (Expression& expression : model_->expressions) expression.native = compile_null(expression.text);
    return;
  }
  look_into_scripts();
  const SlotLookup slots = [this](std::string_view name) -> std::optional<std::uint32_t> {
    const auto found = model_->slots.find(name);
    return found == model_->slots.end() ? std::nullopt : std::optional(found->second);
  };
  UntouchedNames untouched(*model_);
  const IsGlobal is_global = [&untouched](std::string_view name) { return untouched.contains(name); };
  for (Expression& expression : model_->expressions) {
    expression.pure = expression.use != ExpressionUse::kScript && is_pure(expression.text);
    if (expression.use == ExpressionUse::kLocation)
      expression.slot = as_variable(expression.text, slots);
    else if (expression.use == ExpressionUse::kValue || expression.use == ExpressionUse::kCondition)
      expression.native = compile_native(expression.text, slots, is_global);
  }
}

}  // namespace sentree::scxml
