#include "sentree/project/detail/check_expressions.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "sentree/project/detail/check_literal.h"
#include "sentree/project/detail/expression_type.h"
#include "sentree/scxml/event.h"
#include "sentree/scxml/loader.h"
#include "sentree/scxml/model.h"

namespace sentree::project {

namespace {

using monitor::DataType;
using scxml::ScriptNode;
using TypeKind = DataType::Kind;
using Node = ScriptNode::Kind;

// Whether something may be written in it: an operator that assigns, outside of quotes.
bool may_write(std::string_view expression) {
  char quote = 0;
  for (std::size_t i = 0; i < expression.size(); ++i) {
    const char c = expression[i];
    if (quote != 0) {
      if (c == '\\') ++i;
      if (c == quote) quote = 0;
    } else if (c == '\'' || c == '"') {
      quote = c;
    } else if (c == '=') {
      const std::size_t end = std::min(expression.find_first_not_of('=', i), expression.size());
      const bool compares =
          end - i > 1 || (i > 0 && std::string_view("!<>").find(expression[i - 1]) != std::string_view::npos);
      if (!compares) return true;
      i = end - 1;
    } else if ((c == '+' || c == '-') && i + 1 < expression.size() && expression[i + 1] == c) {
      return true;
    }
  }
  return expression.find("delete") != std::string_view::npos;
}

class ChartReader {
 public:
  ChartReader(const ChartFacts& facts, const ChartEvents& events, Diagnostics& diagnostics)
      : facts_(facts), chart_(facts.chart()), model_(chart_.model()), events_(events), out_(diagnostics) {}

  void run() {
    if (model_.data_model != scxml::DataModelKind::kEcmaScript) return;
    declare();
    // What data can be follows from what is assigned to them, which may be other data.
    for (int pass = 0; pass < 2; ++pass) {
      written_.clear();
      visit_all(nullptr);
      for (auto& [id, type] : names_) {
        if (fixed_.contains(id)) continue;
        const auto written = written_.find(id);
        type = written == written_.end() ? ExpressionType() : written->second;
        if (!is_text(id)) continue;
        if (written == written_.end()) type.open = false;
        join(type, of(DataType{.kind = TypeKind::kText, .name = "text"}));
      }
    }
    visit_all(&out_);
  }

 private:
  using Id = scxml::ExpressionId;

  void declare() {
    std::set<std::string> in_scripts;
    for (const scxml::Expression& expression : model_.expressions) {
      if (expression.use == scxml::ExpressionUse::kScript) {
        in_scripts.merge(scxml::names_in_script(expression.text));
      } else if (expression.use == scxml::ExpressionUse::kItem) {
        names_[expression.text];
      }
    }
    for (Id i = 0; i < model_.expressions.size(); ++i) {
      // What cannot be read may declare and write anything that it mentions; so may functions.
      const scxml::Expression& expression = model_.expressions[i];
      const auto& tree = facts_.tree(i);
      const bool is_plain = tree && std::none_of(tree->nodes.begin(), tree->nodes.end(), [&](const auto& n) {
                              return (n.kind == Node::kOpaque && may_write(expression.text)) ||
                                     n.kind == Node::kAssignment || (n.kind == Node::kUnary && n.text.size() == 2);
                            });
      const bool writes_a_part =
          expression.use == scxml::ExpressionUse::kLocation && tree && tree->nodes.back().kind != Node::kName;
      if (expression.use != scxml::ExpressionUse::kScript && (!is_plain || writes_a_part))
        in_scripts.merge(scxml::names_in_script(expression.text));
    }
    for (const std::string& name : in_scripts) {
      names_[name];
      fixed_.insert(name);
    }
    for (const scxml::Variable& variable : model_.variables) {
      names_[variable.id];
      const bool told = variable.expr != scxml::kNoExpression && !events_.given.contains(variable.id);
      if (!told && !is_text(variable.id)) fixed_.insert(variable.id);
    }
  }

  void visit_all(Diagnostics* out) {
    told_ = out;
    ExpressionScope any{
        .names = &names_, .open = !model_.invokes.empty(), .functions = &events_.functions, .event = event_of_any()};
    for (const scxml::Variable& variable : model_.variables) {
      if (variable.expr == scxml::kNoExpression) continue;
      const ExpressionType type = expression(variable.expr, any);
      if (!is_text(variable.id)) write(variable.id, type);  // what is given takes its place
    }
    for (const scxml::StateCode& code : model_.state_code) {
      for (const auto* blocks : {&code.onentry, &code.onexit}) {
        for (const scxml::Block& block : *blocks) content(block, any);
      }
      if (code.donedata) payload(*code.donedata, any);
    }
    for (const scxml::Invoke& invoke : model_.invokes) {
      payload(invoke.payload, any);
      content(invoke.finalize, any);
    }
    for (std::size_t t = 0; t < model_.transitions.size(); ++t) {
      const scxml::Transition& transition = model_.transitions[t];
      ExpressionScope scope = any;
      if (!transition.events.empty()) scope.event = event_of(transition.events);
      const scxml::TransitionCode& code = model_.transition_code[t];
      if (code.condition != scxml::kNoExpression) expression(code.condition, scope, true);
      content(code.content, scope);
    }
  }

  void content(const scxml::Block& block, const ExpressionScope& scope) {
    for (const scxml::Action& action : block) {
      if (const auto* log = std::get_if<scxml::Log>(&action.what)) {
        expression(log->expr, scope);
      } else if (const auto* assign = std::get_if<scxml::Assign>(&action.what)) {
        expression(assign->location, scope);
        const ExpressionType value = expression(assign->expr, scope);
        if (assign->location != scxml::kNoExpression) {
          check_assigned(assign->expr, model_.expressions[assign->location].text);
          write(model_.expressions[assign->location].text, value);
        }
      } else if (const auto* send = std::get_if<scxml::Send>(&action.what)) {
        for (const scxml::Text* text : {&send->event, &send->target, &send->type}) expression(text->expr, scope);
        check_delay(send->delay, scope);
        payload(send->payload, scope, send);
      } else if (const auto* choice = std::get_if<scxml::If>(&action.what)) {
        for (const scxml::If::Branch& branch : choice->branches) {
          expression(branch.condition, scope, true);
          content(branch.body, scope);
        }
      } else if (const auto* loop = std::get_if<scxml::Foreach>(&action.what)) {
        const ExpressionType array = expression(loop->array, scope);
        if (loop->item != scxml::kNoExpression) write(model_.expressions[loop->item].text, items_of(array));
        if (loop->index != scxml::kNoExpression)
          write(model_.expressions[loop->index].text, of(DataType{.kind = TypeKind::kNumber, .name = "number"}));
        content(*loop->body, scope);
      } else if (const auto* cancel = std::get_if<scxml::Cancel>(&action.what)) {
        expression(cancel->sendid_expr, scope);
        check_cancel(*cancel, action.place);
      }
    }
  }

  // A text that nearly is one of those that the data has from outside the chart.
  void check_assigned(Id id, const std::string& location) {
    if (told_ == nullptr || id == scxml::kNoExpression || !facts_.tree(id) || facts_.tree(id)->nodes.size() != 1)
      return;
    const ScriptNode& literal = facts_.tree(id)->at(0);
    const auto data = names_.find(location);
    if (literal.kind != Node::kText || data == names_.end()) return;
    std::vector<std::string> known;
    for (const DataType& form : data->second.forms) {
      if (form.name == "text") continue;  // another constant of the chart
      known.insert(known.end(), form.words.begin(), form.words.end());
      known.insert(known.end(), form.samples.begin(), form.samples.end());
    }
    if (std::find(known.begin(), known.end(), literal.text) != known.end()) return;
    const std::string near = did_you_mean(literal.text, known);
    if (near.empty()) return;
    told_->push_back({Severity::kWarning, "check.unknown-word",
                      fmt::format("nothing else in this project makes {} '{}'{}", location, literal.text, near),
                      chart_.span(model_.expressions[id].place)});
  }

  void check_delay(const scxml::Text& delay, const ExpressionScope& scope) {
    const ExpressionType type = expression(delay.expr, scope);
    if (told_ == nullptr || type.open) return;
    for (const DataType& form : type.forms) {
      if (form.kind != TypeKind::kText || !form.samples_are_all) continue;
      for (const std::string& text : form.samples) {
        if (text.empty() || scxml::parse_delay(text)) continue;
        told_->push_back({Severity::kError, "check.delay",
                          fmt::format("\"{}\" is no time; write a number with s or ms, as in '1.5s'", text),
                          chart_.span(model_.expressions[delay.expr].place)});
      }
    }
  }

  // What is sent is compared with the interface as far as it is known before it is sent.
  void check_param(const scxml::Send& send, const scxml::Param& param, const ExpressionType& type) {
    const bool is_constant = send.event.expr == scxml::kNoExpression && send.target.expr == scxml::kNoExpression;
    if (told_ == nullptr || !events_.param_of || !is_constant || send.type.constant != "thrift") return;
    if (const auto& tree = facts_.tree(param.expr); tree && tree->nodes.size() == 1 && tree->at(0).kind == Node::kText)
      return;  // of constants it has been said
    const DataType wanted = events_.param_of(send.target.constant, send.event.constant, param.name);
    std::set<std::pair<const void*, const void*>> compared;
    const std::string what = fmt::format("param \"{}\"", param.name);
    const SourceSpan span = chart_.span(model_.expressions[param.expr].place);
    const std::size_t before = told_->size();
    check_sent(wanted, type, what, span, compared);
    const idl::Type* const exact =
        events_.type_of ? events_.type_of(send.target.constant, send.event.constant, param.name) : nullptr;
    if (told_->size() == before && exact != nullptr && facts_.tree(param.expr))
      check_literal(*exact, *facts_.tree(param.expr), what, span, *told_);
  }

  // @param compared  Records that were, which may come again at many places of those around them.
  void check_sent(const DataType& wanted, const ExpressionType& type, const std::string& path, const SourceSpan& span,
                  std::set<std::pair<const void*, const void*>>& compared) {
    if (wanted.kind == TypeKind::kUnknown || wanted.kind == TypeKind::kOther) return;
    const auto error = [&](const char* code, std::string message) {
      Diagnostic diagnostic{Severity::kError, code, std::move(message), span};
      if (std::find(told_->begin(), told_->end(), diagnostic) == told_->end()) told_->push_back(std::move(diagnostic));
    };
    for (const DataType& form : type.forms) {
      if (form.kind == TypeKind::kText && !wanted.words.empty() && form.words.empty()) {
        for (const std::string& text : form.samples) {
          if (std::find(wanted.words.begin(), wanted.words.end(), text) != wanted.words.end()) continue;
          // Data may begin with a text that is never sent.
          const std::string near = did_you_mean(text, wanted.words);
          if (!near.empty())
            error("check.unknown-word", fmt::format("{}: '{}' is no {}{}", path, text, wanted.name, near));
        }
      } else if (form.kind == TypeKind::kRecord && wanted.kind == TypeKind::kRecord) {
        if (!compared.emplace(wanted.members.begin(), form.members.begin()).second) continue;
        std::vector<std::string> known;
        for (const monitor::DataMember& member : wanted.members) known.push_back(member.name);
        for (const monitor::DataMember& member : form.members) {
          const auto found = std::find_if(wanted.members.begin(), wanted.members.end(),
                                          [&](const auto& one) { return one.name == member.name; });
          if (found != wanted.members.end()) {
            check_sent(found->type, of(member.type), fmt::format("{}.{}", path, member.name), span, compared);
          } else if (const std::string near = did_you_mean(member.name, known); !near.empty()) {
            error("check.unknown-member",
                  fmt::format("{}: {} has no member {}{}", path, wanted.name.empty() ? "it" : wanted.name,
                              fmt::format("\"{}\"", member.name), near));
          }
        }
      }
    }
  }

  void check_cancel(const scxml::Cancel& cancel, const scxml::Place& place) {
    if (told_ == nullptr || cancel.sendid.empty()) return;
    std::vector<std::string> ids;
    for (const scxml::SendInfo& send : model_.sends) {
      if (!send.id.empty()) ids.push_back(send.id);
    }
    if (std::find(ids.begin(), ids.end(), cancel.sendid) != ids.end()) return;
    told_->push_back({Severity::kError, "check.unknown-send",
                      fmt::format("no <send> of the chart has id=\"{}\", so nothing is cancelled{}", cancel.sendid,
                                  did_you_mean(cancel.sendid, ids)),
                      chart_.span(place)});
  }

  void payload(const scxml::Payload& payload, const ExpressionScope& scope, const scxml::Send* send = nullptr) {
    for (const auto* params : {&payload.params, &payload.namelist}) {
      for (const scxml::Param& param : *params) {
        const ExpressionType type = expression(param.expr, scope);
        if (send != nullptr && param.expr != scxml::kNoExpression) check_param(*send, param, type);
      }
    }
    expression(payload.content_expr, scope);
  }

  ExpressionType expression(Id id, const ExpressionScope& scope, bool is_condition = false) {
    if (id == scxml::kNoExpression || !facts_.tree(id)) return {};
    const SourceSpan span = chart_.span(model_.expressions[id].place);
    const std::size_t before = told_ == nullptr ? 0 : told_->size();
    ExpressionType type = read_expression(*facts_.tree(id), scope, span, told_, is_condition);
    for (std::size_t i = before; told_ != nullptr && i < told_->size(); ++i)
      tell_of_text(*facts_.tree(id), (*told_)[i]);
    return type;
  }

  [[nodiscard]] bool is_text(const std::string& id) const { return events_.texts.contains(id) && !fixed_.contains(id); }

  // That a value which looks like a number is none is not seen in the chart.
  void tell_of_text(const scxml::ScriptTree& tree, Diagnostic& found) const {
    if (found.code != "check.never-equal") return;
    for (const ScriptNode& node : tree.nodes) {
      if (node.kind != Node::kName || !is_text(node.text)) continue;
      found.message += fmt::format(
          "; port \"{0}\" has no type, so that its values are texts: give it one in the TreeNodesModel, such as "
          "<input_port name=\"{0}\" type=\"int\"/>",
          node.text);
      return;
    }
  }

  void write(const std::string& name, const ExpressionType& type) {
    const auto [written, first] = written_.emplace(name, type);
    if (!first) join(written->second, type);
  }

  // What `_event.data` is where one of these descriptors has fired; nothing: it cannot be told.
  std::optional<ExpressionType> event_of(const std::vector<std::string>& descriptors) {
    ExpressionType result{.open = false, .forms = {}};
    for (const std::string& descriptor : descriptors) {
      const ExpressionType& one = event_of(descriptor);
      if (one.open) return std::nullopt;
      join(result, one);
    }
    if (result.open || result.forms.empty()) return std::nullopt;
    return result;
  }

  const ExpressionType& event_of(const std::string& descriptor) {
    const auto [slot, is_new] = by_descriptor_.try_emplace(descriptor);
    if (!is_new) return slot->second;
    for (const auto& own : own_events()) {
      if (scxml::event_matches(descriptor, own)) return slot->second;
    }
    if (descriptor == "*" || scxml::event_matches("error", descriptor) || scxml::event_matches("done", descriptor))
      return slot->second;
    ExpressionType result{.open = false, .forms = {}};
    for (const std::string& name : events_.names) {
      if (scxml::event_matches(descriptor, name)) join(result, of(events_.data_of(name)));
    }
    if (!result.forms.empty()) slot->second = std::move(result);
    return slot->second;
  }

  // Events that the chart sends or raises itself.
  const std::vector<std::string>& own_events() {
    if (own_) return *own_;
    own_.emplace();
    for (const auto& [event, place] : model_.raises) own_->push_back(event);
    for (const scxml::SendInfo& send : model_.sends) {
      if (send.event && send.type != "thrift") own_->push_back(*send.event);
    }
    return *own_;
  }

  // Where any event may have come last.
  std::optional<ExpressionType> event_of_any() {
    std::vector<std::string> descriptors;
    for (const scxml::Transition& transition : model_.transitions)
      descriptors.insert(descriptors.end(), transition.events.begin(), transition.events.end());
    std::sort(descriptors.begin(), descriptors.end());
    descriptors.erase(std::unique(descriptors.begin(), descriptors.end()), descriptors.end());
    return event_of(descriptors);
  }

  const ChartFacts& facts_;
  const scxml::Chart& chart_;
  const scxml::Model& model_;
  const ChartEvents& events_;
  Diagnostics& out_;
  Diagnostics* told_ = nullptr;
  std::map<std::string, ExpressionType, std::less<>> names_;
  std::map<std::string, ExpressionType, std::less<>> written_;
  std::set<std::string, std::less<>> fixed_;  // can be anything
  std::map<std::string, ExpressionType> by_descriptor_;
  std::optional<std::vector<std::string>> own_;
};

}  // namespace

void check_expressions(const ChartFacts& facts, const ChartEvents& events, Diagnostics& diagnostics) {
  ChartReader(facts, events, diagnostics).run();
}

DataType check_renamed_data(const EventRename& rename, const std::vector<DataType>& observed,
                            Diagnostics& diagnostics) {
  std::map<std::string, ExpressionType, std::less<>> names;
  bool open = observed.empty();
  for (const DataType& one : observed) {
    open = open || one.kind != TypeKind::kRecord;
    for (const monitor::DataMember& member : one.members) {
      const auto [slot, is_new] = names.emplace(member.name, of(member.type));
      if (!is_new) join(slot->second, of(member.type));
    }
  }
  const ExpressionScope scope{.names = &names, .open = open, .event = std::nullopt};
  const auto visit = [&](const std::string& source, bool is_condition) {
    const auto tree = scxml::parse_script_expression(source);
    return tree ? read_expression(*tree, scope, rename.span, &diagnostics, is_condition) : ExpressionType();
  };
  DataType result{.kind = TypeKind::kRecord, .may_be_absent = false};
  for (const auto& [name, source] : rename.data) {
    const ExpressionType found = visit(source, false);
    result.members.push_back({name, !found.open && found.forms.size() == 1 ? DataType(found.forms[0]) : DataType{}});
  }
  // What these two are depends on what was observed before.
  names["value"] = {};
  names["last"] = {};
  if (rename.when != "changed" && !rename.when.empty()) (void)visit(rename.when, true);
  return result;
}

}  // namespace sentree::project
