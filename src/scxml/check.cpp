#include "sentree/scxml/check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <string_view>
#include <unordered_set>
#include <utility>

#include "sentree/scxml/detail/missing_builtins.h"
#include "sentree/scxml/detail/script_heap.h"
#include "sentree/scxml/event.h"
#include "sentree/scxml/loader.h"
#include "sentree/scxml/model.h"
#include "sentree/scxml/reach.h"
#include "sentree/scxml/script_syntax.h"

namespace sentree::scxml {
namespace {

class Checker {
 public:
  Checker(const Chart& chart, const CheckOptions& options) : chart_(chart), model_(chart.model()), options_(options) {}

  Diagnostics run() {
    if (model_.data_model != DataModelKind::kForeign) expressions();
    if (model_.data_model == DataModelKind::kEcmaScript) names_of_hosts();
    transitions();
    // What has been passed over may send, use and lead to anything.
    if (!model_.passed_over) {
      states();
      events();
      data();
    }
    children();
    sort_by_place(diagnostics_);
    return std::move(diagnostics_);
  }

 private:
  void report(Severity severity, std::string code, std::string message, const Place& place) {
    diagnostics_.push_back({severity, std::move(code), std::move(message), chart_.span(place)});
  }
  void warn(std::string code, std::string message, const Place& place) {
    report(Severity::kWarning, std::move(code), std::move(message), place);
  }

  [[nodiscard]] std::string name(StateIndex s) const {
    return model_.states[s].id.empty() ? fmt::format("<{}>", to_string(model_.states[s].kind))
                                       : fmt::format("\"{}\"", model_.states[s].id);
  }

  [[nodiscard]] std::vector<std::string> state_ids() const {
    std::vector<std::string> ids;
    for (const State& state : model_.states) {
      if (!state.id.empty()) ids.push_back(state.id);
    }
    return ids;
  }

  void expressions() {
    // They may be of a language that is not known here.
    const Severity syntax = model_.obstacle || model_.guessed_data_model ? Severity::kWarning : Severity::kError;
    // A heap keeps what it has compiled, and where it is nearly full it looks for room at each expression.
    constexpr std::size_t kHeapBytesMax = std::size_t{64} << 10U;  // of source, and as much for each as a short one
    constexpr std::size_t kExpressionBytes = 64;
    std::shared_ptr<ScriptHeap> heap;
    std::size_t held = 0;
    for (ExpressionId id = 0; id < model_.expressions.size(); ++id) {
      const Expression& expression = model_.expressions[id];
      states_asked_for_in(expression);
      if (!expression.native.empty() || expression.slot) continue;
      if (model_.data_model == DataModelKind::kNull) {
        report(syntax, "scxml.expression-syntax",
               fmt::format("the null data model has no expressions but In('state'); write datamodel=\"ecmascript\" at "
                           "<scxml> for \"{}\"",
                           expression.text),
               expression.place);
        continue;
      }
      if (!heap || held > kHeapBytesMax) {
        held = 0;
        auto created = ScriptHeap::create_for_syntax(model_, Limits().script_memory_max);
        if (!created) return;
        heap = *std::move(created);
      }
      held += kExpressionBytes + expression.text.size();
      int line = expression.place.line;
      if (auto problem = heap->syntax_error(id, line)) {
        Place place = expression.place;
        // An attribute is one line to the script, whatever its lines in the file.
        if (line != place.line && expression.use == ExpressionUse::kScript) place = {line, 1, 0};
        std::string shown = expression.text;
        if (shown.size() > 60) shown.replace(57, std::string::npos, "...");
        report(syntax, "scxml.expression-syntax",
               (expression.use == ExpressionUse::kScript ? "the script does not parse: "
                                                         : fmt::format("\"{}\" does not parse: ", shown)) +
                   *problem + newer_language(expression.text),
               place);
      }
    }
  }

  void states_asked_for_in(const Expression& expression) {
    std::set<std::string_view> told;
    for (const std::string_view state : states_asked_for(expression.text, model_.data_model == DataModelKind::kNull)) {
      if (chart_.find(state) || !told.insert(state).second) continue;
      warn("scxml.unknown-state",
           fmt::format("In('{}') is never true: there is no such state{}", state, did_you_mean(state, state_ids())),
           place_in(expression, state));
    }
  }

  // Of a script, the line in which that part of it stands.
  static Place place_in(const Expression& expression, std::string_view part) {
    const auto before =
        std::string_view(expression.text).substr(0, static_cast<std::size_t>(part.data() - expression.text.data()));
    const auto lines = static_cast<int>(std::count(before.begin(), before.end(), '\n'));
    if (lines == 0 || expression.use != ExpressionUse::kScript) return expression.place;
    return {expression.place.line + lines, 1, 0};
  }

  // What a syntax error may come from.
  static std::string newer_language(const std::string& text) {
    const bool is_newer = text.find("=>") != std::string::npos || text.find('`') != std::string::npos ||
                          names_in_script(text).contains("let") || names_in_script(text).contains("class");
    return is_newer ? "; scripts are ECMAScript 5.1, without let, class, arrow functions and templates" : "";
  }

  // What browsers, Node.js and newer engines have, and charts have not, unless they define it.
  void names_of_hosts() {
    static constexpr std::array kOfHosts{"console", "window", "require", "alert", "setTimeout", "setInterval"};
    for (const Expression& expression : model_.expressions) {
      for (const char* const name : kOfHosts) {
        if (expression.text.find(name) == std::string::npos) continue;
        const auto names = names_in_script(expression.text);
        const bool may_be_own = names.contains("typeof") || names.contains("function") || names.contains("var") ||
                                std::any_of(model_.variables.begin(), model_.variables.end(),
                                            [&](const Variable& variable) { return variable.id == name; });
        if (!names.contains(name) || may_be_own) continue;
        warn("scxml.unknown-name",
             fmt::format("charts have no \"{}\": write <log> to print, <send delay> to wait", name), expression.place);
      }
    }
    for (const MissingBuiltin& missing : missing_builtins(model_))
      warn("scxml.unknown-name", missing.message, place_in(model_.expressions[missing.expression], missing.where));
  }

  void states() {
    const std::vector<bool> reached = reachable_states(chart_);
    for (StateIndex s = 1; s < model_.states.size(); ++s) {
      const State& state = model_.states[s];
      if (reached[s] || !reached[state.parent]) continue;  // of nested ones, the outermost is enough
      warn("scxml.unreachable-state",
           fmt::format("state {} is never entered: no transition of a reachable state leads to it", name(s)),
           state.place);
    }
  }

  [[nodiscard]] static bool covers(const Transition& earlier, const Transition& later) {
    if (!earlier.condition.empty() || earlier.events.empty() != later.events.empty()) return false;
    return std::all_of(later.events.begin(), later.events.end(), [&](const std::string& event) {
      return std::any_of(earlier.events.begin(), earlier.events.end(), [&](const std::string& wider) {
        return wider == "*" || (event != "*" && event_matches(wider, event));
      });
    });
  }

  void transitions() {
    for (StateIndex s = 0; s < model_.states.size(); ++s) {
      const auto& list = model_.states[s].transitions;
      for (const TransitionIndex t : list) {
        const Transition& transition = model_.transitions[t];
        const bool stays = std::all_of(transition.targets.begin(), transition.targets.end(),
                                       [&](StateIndex target) { return target == s; });
        if (!stays || !transition.events.empty() || !transition.condition.empty()) continue;
        warn("scxml.endless-transition",
             fmt::format("this transition of state {} has neither an event nor a condition and leads back to it: it is "
                         "taken for ever",
                         name(s)),
             transition.place);
      }
      // Transitions of one state are few; a state with thousands would only be slow to check, so it is looked at in
      // part.
      for (std::size_t i = 1; i < std::min<std::size_t>(list.size(), 500); ++i) {
        for (std::size_t k = 0; k < i; ++k) {
          const Transition& earlier = model_.transitions[list[k]];
          const Transition& later = model_.transitions[list[i]];
          if (!covers(earlier, later)) continue;
          warn("scxml.transition-never-taken",
               fmt::format("this transition of state {} is never taken: the one in line {} has no condition and takes "
                           "the same events first",
                           name(s), earlier.place.line),
               later.place);
          break;
        }
      }
    }
  }

  [[nodiscard]] bool handled(std::string_view event) const {
    const auto& all = model_.descriptors.all();
    return std::any_of(all.begin(), all.end(),
                       [&](const std::string& descriptor) { return event_matches(descriptor, event); });
  }

  // What a <send> of the SCXML processor names (SCXML C.1): another target is one that nobody is.
  void receivers() {
    std::vector<std::string> known{"#_internal", "#_parent"};
    bool all_known = true;
    for (const Invoke& invoke : model_.invokes) {
      all_known = all_known && !invoke.id.empty();
      if (!invoke.id.empty()) known.push_back("#_" + invoke.id);
    }
    for (const SendInfo& send : model_.sends) {
      if (!send.type || !is_scxml_processor(*send.type) || !send.target || send.target->empty()) continue;
      const std::string& target = *send.target;
      const bool may_be = std::find(known.begin(), known.end(), target) != known.end() ||
                          target.starts_with("#_scxml_") || (target.starts_with("#_") && !all_known) ||
                          target.find(':') != std::string::npos;
      if (may_be) continue;
      warn("scxml.unknown-target",
           fmt::format(
               "nobody is \"{}\": write #_internal, #_parent, #_ and the id of an <invoke>, or no target for the "
               "chart itself{}",
               target, did_you_mean(target, known)),
           send.target_place);
    }
  }

  void events() {
    std::vector<std::string> inside;
    const std::vector<std::string> handled_names = chart_.events_handled();
    const auto sent = [&](const std::string& event, const Place& place) {
      inside.push_back(event);
      const auto& seen = options_.seen_outside;
      if (!handled(event) && std::find(seen.begin(), seen.end(), event) == seen.end()) {
        warn("scxml.event-not-handled",
             fmt::format("event \"{}\" is raised, but no transition handles it{}", event,
                         did_you_mean(event, handled_names)),
             place);
      }
    };
    for (const auto& [event, place] : model_.raises) sent(event, place);
    for (const SendInfo& send : model_.sends) {
      const bool to_self =
          send.type && (send.type->empty() || *send.type == kScxmlProcessor || *send.type == kScxmlProcessorShort) &&
          send.target && (send.target->empty() || *send.target == "#_internal");
      if (to_self && send.event && !send.event->empty()) sent(*send.event, send.event_place);
    }
    receivers();
    for (const StateCode& code : model_.state_code) inside.push_back(code.done_event);
    for (TransitionIndex t = 0; t < model_.transitions.size(); ++t) {
      const Transition& transition = model_.transitions[t];
      for (const std::string& descriptor : transition.events) handled_event(descriptor, transition, inside);
    }
  }

  void handled_event(const std::string& descriptor, const Transition& transition,
                     const std::vector<std::string>& inside) {
    if (descriptor == "*" || descriptor == "error" || descriptor.starts_with("error.")) return;
    if (descriptor.starts_with("done.state.")) {
      const std::string id = descriptor.substr(11);
      if (!chart_.find(id)) {
        warn("scxml.event-not-sent",
             fmt::format("event \"{}\" never comes: there is no state \"{}\"{}", descriptor, id,
                         did_you_mean(id, state_ids())),
             transition.place);
      }
      return;
    }
    if (!options_.external_events || descriptor == "done" || descriptor.starts_with("done.")) return;
    std::vector<std::string> known = *options_.external_events;
    known.insert(known.end(), inside.begin(), inside.end());
    const bool comes = std::any_of(known.begin(), known.end(),
                                   [&](const std::string& event) { return event_matches(descriptor, event); });
    if (!comes)
      warn("scxml.event-not-sent",
           fmt::format("event \"{}\" is handled, but nobody sends it{}", descriptor, did_you_mean(descriptor, known)),
           transition.place);
  }

  void data() {
    std::unordered_set<std::string_view> used;
    const auto is_name = [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '$' ||
             static_cast<unsigned char>(c) >= 0x80;
    };
    for (const Expression& expression : model_.expressions) {
      const std::string_view text = expression.text;
      for (std::size_t i = 0; i < text.size();) {
        if (!is_name(text[i])) {
          ++i;
          continue;
        }
        const std::size_t begin = i;
        while (i < text.size() && is_name(text[i])) ++i;
        used.insert(text.substr(begin, i - begin));
      }
    }
    for (const Variable& variable : model_.variables) {
      if (!variable.failure.empty())
        warn("scxml.unreadable-data", fmt::format("data \"{}\" cannot be read: {}", variable.id, variable.failure),
             variable.place);
      if (!used.contains(variable.id))
        warn("scxml.unused-data", fmt::format("data \"{}\" is never used", variable.id), variable.place);
    }
  }

  void children() {
    for (const Invoke& invoke : model_.invokes) {
      if (invoke.child) {
        parameters(invoke);
        for (Diagnostic& diagnostic : check(*invoke.child)) diagnostics_.push_back(std::move(diagnostic));
        continue;
      }
      const bool is_chart =
          invoke.type.expr == kNoExpression && (invoke.type.constant.empty() || invoke.type.constant == "scxml" ||
                                                invoke.type.constant.starts_with("http://www.w3.org/TR/scxml"));
      if (is_chart && !invoke.src_missing.empty()) {
        warn("scxml.unreadable-chart",
             fmt::format("\"{}\" cannot be invoked: {}", invoke.src.constant, invoke.src_missing), invoke.place);
      }
      const bool is_inline = invoke.payload.content && invoke.payload.content_expr == kNoExpression;
      const std::string& source = is_inline ? invoke.payload.content_source : invoke.src_text;
      if (!is_chart || source.empty()) continue;
      for (const Diagnostic& diagnostic :
           load(source, is_inline ? std::string() : seen_from(folder_of(model_.file), invoke.src.constant),
                {.to_run = !model_.obstacle})
               .diagnostics) {
        if (diagnostic.severity != Severity::kError) continue;
        report(Severity::kError, diagnostic.code,
               "the invoked chart cannot be loaded: " + (is_inline ? diagnostic.message : to_string(diagnostic)),
               invoke.place);
      }
    }
  }

  // What is given to a chart that has no <data> for it (SCXML 6.4.3: of its top level).
  void parameters(const Invoke& invoke) {
    const Model& child = invoke.child->model();
    if (child.data_model != DataModelKind::kEcmaScript || child.passed_over) return;
    std::vector<std::string> ids;
    for (const Variable& variable : child.variables) {
      if (variable.state == 0) ids.push_back(variable.id);
    }
    for (const auto* list : {&invoke.payload.namelist, &invoke.payload.params}) {
      for (const Param& param : *list) {
        if (param.name.empty() || std::find(ids.begin(), ids.end(), param.name) != ids.end()) continue;
        warn("scxml.unknown-data",
             fmt::format("\"{0}\" reaches nothing: the invoked chart has no <data id=\"{0}\"> at its top level{1}",
                         param.name, did_you_mean(param.name, ids)),
             param.expr == kNoExpression ? invoke.place : model_.expressions[param.expr].place);
      }
    }
  }

  const Chart& chart_;
  const Model& model_;
  const CheckOptions& options_;
  Diagnostics diagnostics_;
};

}  // namespace

Diagnostics check(const Chart& chart, const CheckOptions& options) { return Checker(chart, options).run(); }

}  // namespace sentree::scxml
