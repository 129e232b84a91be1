#include "sentree/project/detail/check_model.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <optional>
#include <set>
#include <span>

#include <fmt/format.h>

#include "sentree/base/value.h"
#include "sentree/idl/conform.h"
#include "sentree/idl/schema.h"
#include "sentree/project/detail/check_monitor.h"
#include "sentree/scxml/event.h"
#include "sentree/scxml/model.h"
#include "sentree/scxml/script_syntax.h"

namespace sentree::project {

namespace {

constexpr std::string_view kChoices[] = {"choose", "pick", "between", "chance", "draw", "fresh"};

class ModelCheck {
 public:
  ModelCheck(const ModelEntry& entry, const scxml::Chart& chart, const std::map<std::string, ServicePlan>& services,
             Diagnostics& diagnostics)
      : entry_(entry), chart_(chart), services_(services), diagnostics_(diagnostics) {}

  void run(const std::vector<LeafPlan>& leaves) {
    for (const scxml::SendInfo& send : chart_.sends()) {
      if (send.type == "thrift") answer(send);
    }
    check_receivers(chart_, services_, diagnostics_);
    for (const scxml::Transition& transition : chart_.transitions()) {
      for (const std::string& event : transition.events) request(event, transition);
    }
    calls(leaves);
    for (const scxml::Chart& chart : scxml::with_invoked(chart_)) {
      choices(chart);
      alternatives(chart);
    }
    const std::vector<scxml::SendInfo> sends = scxml::sends_with_invoked(chart_);
    const bool sends_nothing =
        !scxml::invokes_unknown(chart_) && std::none_of(sends.begin(), sends.end(), [](const scxml::SendInfo& send) {
          return send.type.value_or("thrift") == "thrift";
        });
    if (entry_.serves.empty() && entry_.subscribes.topics.empty() && sends_nothing) {
      error("check.model",
            fmt::format("model \"{}\" does nothing for anybody; write \"serves\": the services that it stands for, or "
                        "\"subscribe\"",
                        entry_.name),
            entry_.span);
    }
  }

 private:
  void error(std::string code, std::string message, const SourceSpan& span) {
    diagnostics_.push_back({Severity::kError, std::move(code), std::move(message), span});
  }

  [[nodiscard]] bool serves(const std::string& service) const {
    return std::find(entry_.serves.begin(), entry_.serves.end(), service) != entry_.serves.end();
  }

  void answer(const scxml::SendInfo& send) {
    if (!send.target) return;
    if (const auto topics = services_.find(*send.target); topics != services_.end() && topics->second.at == "topics") {
      if (send.event) publication(send, *topics->second.service);
      return;
    }
    if (!serves(*send.target)) {
      error("check.model-answer",
            fmt::format("the model does not serve \"{}\"{}", *send.target, did_you_mean(*send.target, entry_.serves)),
            chart_.span(send.target_place));
      return;
    }
    const auto service = services_.find(*send.target);
    if (!send.event || service == services_.end()) return;
    const idl::Method* const topic = service->second.service->find(*send.event);
    if (topic != nullptr && topic->oneway) return publication(send, *service->second.service);
    const std::size_t dot = send.event->rfind('.');
    const std::string what = dot == std::string::npos ? "" : send.event->substr(dot + 1);
    if (dot == std::string::npos && topic == nullptr) return publication(send, *service->second.service);
    if (what != "reply" && what != "error") {
      error("check.model-answer", fmt::format("\"{}\" is no answer; send METHOD.reply or METHOD.error", *send.event),
            chart_.span(send.event_place));
      return;
    }
    const auto method = idl::find_method(*service->second.service, send.event->substr(0, dot), *send.target,
                                         chart_.span(send.event_place));
    if (!method) {
      diagnostics_.push_back(method.error());
      return;
    }
    if (!send.has_content) params(send, **method, what == "reply");
  }

  void publication(const scxml::SendInfo& send, const idl::Service& service) {
    const auto method = idl::find_method(service, *send.event, *send.target, chart_.span(send.event_place));
    if (!method) {
      diagnostics_.push_back(method.error());
      return;
    }
    if (send.has_content) return;
    std::vector<idl::WrittenArgument> arguments;
    for (const scxml::SendParam& param : send.params)
      arguments.push_back({param.name, param.constant, chart_.span(param.place)});
    const Diagnostics found = idl::check_arguments(**method, arguments, chart_.span(send.place));
    diagnostics_.insert(diagnostics_.end(), found.begin(), found.end());
  }

  void params(const scxml::SendInfo& send, const idl::Method& method, bool is_reply) {
    const std::vector<std::string> known = is_reply ? std::vector<std::string>{"result", "id"}
                                                    : std::vector<std::string>{"kind", "message", "exception", "id"};
    bool has_result = false;
    for (const scxml::SendParam& param : send.params) {
      has_result = has_result || param.name == "result";
      if (std::find(known.begin(), known.end(), param.name) == known.end()) {
        error("check.model-answer",
              fmt::format("an answer has no param \"{}\"{}", param.name, did_you_mean(param.name, known)),
              chart_.span(param.place));
      } else if (param.name == "result" && param.constant && method.result->kind != idl::Kind::kVoid) {
        const auto conforming = idl::conform(*method.result, *param.constant, "result");
        if (!conforming) error(conforming.error().code, conforming.error().message, chart_.span(param.place));
      } else if (param.name == "exception" && param.constant) {
        const auto conforming = idl::conform_exception(method, *param.constant);
        if (!conforming) error(conforming.error().code, conforming.error().message, chart_.span(param.place));
      }
    }
    if (is_reply && !has_result && method.result->kind != idl::Kind::kVoid) {
      error("check.model-answer",
            fmt::format("the reply of {}.{} needs a param \"result\": a {}", *send.target, method.name,
                        method.result->name),
            chart_.span(send.place));
    }
  }

  // Whether the event can come from the chart itself, from what it invokes, or from the engine.
  [[nodiscard]] bool may_be_own(const std::string& event) const {
    const auto is_it = [&](const std::string& name) { return scxml::event_matches(event, name); };
    if (event.starts_with("done.") || event.starts_with("error.") || !chart_.model().invokes.empty()) return true;
    const auto& raises = chart_.model().raises;
    const std::span<const scxml::SendInfo> sends = chart_.sends();
    return std::any_of(raises.begin(), raises.end(), [&](const auto& raised) { return is_it(raised.first); }) ||
           std::any_of(sends.begin(), sends.end(), [&](const scxml::SendInfo& send) {
             return send.type != "thrift" && (!send.event || is_it(*send.event));
           });
  }

  // "battery.getBateryState.request" never comes.
  void request(const std::string& event, const scxml::Transition& transition) {
    const std::size_t dot = event.find('.');
    if (dot == std::string::npos) return;
    const std::string service = event.substr(0, dot);
    const bool is_of_service = services_.contains(service);
    // One that could not be read has been told.
    if (!is_of_service && (serves(service) || may_be_own(event))) return;
    std::vector<std::string> known = entry_.subscribes.topics;
    for (const scxml::SendInfo& send : chart_.sends()) {
      if (send.type == "thrift" && send.target && send.event)
        known.push_back(fmt::format("{}.{}.error", *send.target, *send.event));
    }
    for (const std::string& name : entry_.serves) {
      const auto served = services_.find(name);
      if (served == services_.end()) continue;
      for (const std::string& method : served->second.service->method_names())
        known.push_back(fmt::format("{}.{}.request", name, method));
    }
    if (std::any_of(known.begin(), known.end(),
                    [&](const std::string& request) { return scxml::event_matches(event, request); }))
      return;
    // Of what no service is called like, only what is nearly a call.
    const std::string hint = did_you_mean(event, known);
    if (!is_of_service && hint.empty() && !event.ends_with(".request")) return;
    error("check.model",
          fmt::format("event \"{}\" never comes: no call of what the model serves is named so{}{}", event,
                      entry_.subscribes.topics.empty() ? "" : ", and no topic that it subscribes to", hint),
          chart_.span(transition.place));
  }

  void choices(const scxml::Chart& chart) {
    for (const scxml::Transition& transition : chart.transitions()) {
      const std::string name = choice_in(transition.condition);
      if (name.empty()) continue;
      error("check.choice",
            fmt::format("{}() in the condition of a transition, which is evaluated as often as the engine needs to; "
                        "choose in an <assign> or an <if> before",
                        name),
            chart.span(transition.place));
    }
  }

  // What a choice leaves open, as far as it is written down.
  void alternatives(const scxml::Chart& chart) {
    for (const scxml::Expression& expression : chart.model().expressions) {
      if (expression.use == scxml::ExpressionUse::kScript) continue;
      const auto tree = scxml::parse_script_expression(expression.text);
      if (!tree) continue;
      for (const scxml::ScriptNode& node : tree->nodes) {
        if (node.kind != scxml::ScriptNode::Kind::kCall) continue;
        if (std::string why = wrong_choice(*tree, node); !why.empty())
          error("check.choice", std::move(why), chart.span(expression.place));
      }
    }
  }

  // Empty: nothing is wrong, or it cannot be told.
  std::string wrong_choice(const scxml::ScriptTree& tree, const scxml::ScriptNode& call) const {
    using Part = scxml::ScriptNode::Kind;
    const std::string function = tree.path(call.operands[0]);
    const std::size_t given = call.operands.size() - 1;
    if (function == "choose" && given == 0) return "choose() needs something to choose from";
    if (function == "pick") return wrong_name(tree, call);
    if (function == "chance" && given == 1) {
      const auto p = constant_number(tree, call.operands[1]);
      return p && !(*p >= 0 && *p <= 1) ? fmt::format("chance({}) needs a probability from 0 to 1", plain_decimal(*p))
                                        : "";
    }
    if (function == "between" && given >= 2) {
      const auto low = constant_number(tree, call.operands[1]);
      const auto high = constant_number(tree, call.operands[2]);
      return low && high && *low > *high ? fmt::format("between({}, {}) leaves nothing open; the lower one comes first",
                                                       plain_decimal(*low), plain_decimal(*high))
                                         : "";
    }
    if (function != "draw" || given != 1 || tree.at(call.operands[1]).kind != Part::kList) return "";
    double sum = 0;
    for (const std::uint32_t pair : tree.at(call.operands[1]).operands) {
      const scxml::ScriptNode& list = tree.at(pair);
      if (list.kind != Part::kList) return "";
      const auto p = list.operands.size() == 2 ? constant_number(tree, list.operands[0]) : std::nullopt;
      if (list.operands.size() == 2 && !p) return "";
      if (!p || *p < 0) return "draw([[p, a], …]) needs pairs of a probability and an alternative";
      sum += *p;
    }
    return std::abs(sum - 1) > 1e-9
               ? fmt::format(
                     "draw([[p, a], …]) needs pairs whose probabilities add up to 1, and these add up to {:.10g}", sum)
               : "";
  }

  // pick('800ms', '1500ms') has its first alternative for a name.
  std::string wrong_name(const scxml::ScriptTree& tree, const scxml::ScriptNode& call) const {
    using Part = scxml::ScriptNode::Kind;
    if (call.operands.size() < 2) return "pick('NAME', a, …) needs a name and something to pick";
    const scxml::ScriptNode& name = tree.at(call.operands[1]);
    const bool is_constant = name.kind == Part::kText || name.kind == Part::kNumber || name.kind == Part::kTruth;
    if (!is_constant) return "";
    const std::string& text = name.text;
    const auto first = static_cast<unsigned char>(text.empty() ? ' ' : text.front());
    if (name.kind == Part::kText && (std::isalpha(first) != 0 || first == '_' || first >= 0x80)) {
      if (call.operands.size() == 2) return fmt::format("pick('{}') needs something to pick beside its name", text);
      if (!are_of_one_enumeration(tree, call)) return "";
    }
    return fmt::format("pick('NAME', a, …) begins with the name of the choice, and {} looks like an alternative",
                       name.kind == Part::kText ? "'" + text + "'" : "this");
  }

  // The name too.
  bool are_of_one_enumeration(const scxml::ScriptTree& tree, const scxml::ScriptNode& call) const {
    std::vector<std::string> all;
    for (std::size_t i = 1; i < call.operands.size(); ++i) {
      const scxml::ScriptNode& one = tree.at(call.operands[i]);
      if (one.kind != scxml::ScriptNode::Kind::kText) return false;
      all.push_back(one.text);
    }
    const auto has_all = [&](const idl::Type& type) {
      if (type.kind != idl::Kind::kEnum) return false;
      const auto& words = type.enumeration->enumerators;
      return std::all_of(all.begin(), all.end(), [&](const std::string& text) {
        return std::any_of(words.begin(), words.end(), [&](const idl::Enumerator& word) { return word.name == text; });
      });
    };
    for (const auto& [service, plan] : services_) {
      for (const idl::Method* method : plan.service->methods) {
        const idl::Type& result = *method->result;
        if (has_all(result)) return true;
        if (result.kind != idl::Kind::kStruct) continue;
        for (const idl::Field& field : result.structure->fields) {
          if (has_all(*field.type)) return true;
        }
      }
    }
    return false;
  }

  // 1/6, -0.5
  static std::optional<double> constant_number(const scxml::ScriptTree& tree, std::uint32_t id) {
    using Part = scxml::ScriptNode::Kind;
    const scxml::ScriptNode& node = tree.at(id);
    if (node.kind == Part::kNumber) return node.number;
    if (node.kind == Part::kUnary && node.text == "-") {
      const auto of = constant_number(tree, node.operands[0]);
      return of ? std::optional(-*of) : std::nullopt;
    }
    if (node.kind != Part::kBinary) return std::nullopt;
    const auto a = constant_number(tree, node.operands[0]);
    const auto b = constant_number(tree, node.operands[1]);
    if (!a || !b) return std::nullopt;
    if (node.text == "+") return *a + *b;
    if (node.text == "-") return *a - *b;
    if (node.text == "*") return *a * *b;
    return node.text == "/" ? std::optional(*a / *b) : std::nullopt;
  }

  // The function that a condition chooses by; empty: none. What a script's functions do is not looked into.
  static std::string choice_in(const std::string& condition) {
    const auto is_choosing = [](const std::string& name) {
      return std::find(std::begin(kChoices), std::end(kChoices), name) != std::end(kChoices);
    };
    if (const auto tree = scxml::parse_script_expression(condition)) {
      for (const scxml::ScriptNode& node : tree->nodes) {
        if (node.kind != scxml::ScriptNode::Kind::kCall) continue;
        const std::string path = tree->path(node.operands[0]);
        // "choose", "choose.call"
        if (std::string name = path.substr(0, path.find('.')); is_choosing(name)) return name;
      }
      return {};
    }
    const std::set<std::string> names = scxml::names_in_script(condition);
    const auto found = std::find_if(names.begin(), names.end(), is_choosing);
    return found != names.end() ? *found : "";
  }

  // Calls of the skills that no transition takes would all be late.
  void calls(const std::vector<LeafPlan>& leaves) {
    std::map<std::string, SourceSpan> called;
    for (const LeafPlan& leaf : leaves) {
      if (!leaf.chart) continue;
      for (const scxml::SendInfo& send : leaf.chart->sends()) {
        if (send.type != "thrift" || !send.target || !send.event || !serves(*send.target)) continue;
        const auto service = services_.find(*send.target);
        const idl::Method* const method =
            service != services_.end() ? service->second.service->find(*send.event) : nullptr;
        if (method != nullptr && !method->oneway)
          called.emplace(fmt::format("{}.{}", *send.target, *send.event), leaf.chart->span(send.place));
      }
    }
    std::size_t answered = 0;
    const std::vector<std::string> handled = chart_.events_handled();
    const auto takes = [&](const std::string& request) {
      return std::any_of(handled.begin(), handled.end(),
                         [&](const std::string& event) { return scxml::event_matches(event, request); });
    };
    for (const auto& [name, span] : called) answered += takes(name + ".request") ? 1U : 0U;
    for (const auto& [name, span] : called) {
      if (takes(name + ".request")) continue;
      error("check.unanswered",
            fmt::format("no transition of {} takes {}.request, so this call is always late; it answers {} of the {} "
                        "methods that skills call",
                        chart_.file(), name, answered, called.size()),
            span);
    }
  }

  const ModelEntry& entry_;
  const scxml::Chart& chart_;
  const std::map<std::string, ServicePlan>& services_;
  Diagnostics& diagnostics_;
};

}  // namespace

void check_model(const ModelEntry& entry, const scxml::Chart& chart, const std::map<std::string, ServicePlan>& services,
                 const std::vector<LeafPlan>& leaves, Diagnostics& diagnostics) {
  ModelCheck(entry, chart, services, diagnostics).run(leaves);
}

}  // namespace sentree::project
