#include "sentree/scxml/enabled.h"

#include <algorithm>
#include <string_view>

#include "sentree/scxml/detail/interpreter.h"
#include "sentree/scxml/model.h"

namespace sentree::scxml {

namespace {

// Every expression in a block of executable content.
class Walk {
 public:
  explicit Walk(std::vector<ExpressionId>& found) : found_(found) {}

  void block(const Block& block) {
    for (const Action& action : block) std::visit(*this, action.what);
  }
  void operator()(const Raise&) {}
  void operator()(const Log& log) { add(log.expr); }
  void operator()(const Assign& assign) {
    add(assign.location);
    add(assign.expr);
  }
  void operator()(const Script& script) { add(script.code); }
  void operator()(const Cancel& cancel) { add(cancel.sendid_expr); }
  void operator()(const Send& send) {
    for (const Text* text : {&send.event, &send.target, &send.type, &send.delay}) add(text->expr);
    add(send.idlocation);
    for (const auto* params : {&send.payload.namelist, &send.payload.params}) {
      for (const Param& param : *params) {
        add(param.expr);
        add(param.location);
      }
    }
    add(send.payload.content_expr);
  }
  void operator()(const If& choice) {
    for (const If::Branch& branch : choice.branches) {
      add(branch.condition);
      block(branch.body);
    }
  }
  void operator()(const Foreach& loop) {
    add(loop.array);
    add(loop.item);
    add(loop.index);
    block(*loop.body);
  }

 private:
  void add(ExpressionId id) {
    if (id != kNoExpression) found_.push_back(id);
  }
  std::vector<ExpressionId>& found_;
};

}  // namespace

EventReads::EventReads(const Chart& chart) : content_(chart.model().transition_code.size(), false) {
  const Model& model = chart.model();
  // Children get the event as it is.
  elsewhere_ = !model.invokes.empty();
  std::vector<bool> reads(model.expressions.size(), false);
  for (ExpressionId id = 0; id < reads.size(); ++id)
    reads[id] = model.expressions[id].text.find("_event") != std::string::npos;
  for (TransitionIndex t = 0; t < content_.size(); ++t) {
    const TransitionCode& code = model.transition_code[t];
    if (code.eventless || code.descriptors.empty()) continue;
    if (code.condition != kNoExpression) reads[code.condition] = false;
    std::vector<ExpressionId> content;
    Walk(content).block(code.content);
    for (const ExpressionId id : content) {
      content_[t] = content_[t] || reads[id];
      reads[id] = false;
    }
  }
  elsewhere_ = elsewhere_ || std::find(reads.begin(), reads.end(), true) != reads.end();
}

std::optional<std::vector<TransitionIndex>> enabled_by(const Chart& chart, const Session& session, const Event& event,
                                                       TimePoint now) {
  Session copy = session;
  Effects effects;
  const Host host;
  Run run{copy, now, effects, host, {}};
  return Interpreter(run, chart, copy, nullptr).enabled_by(event);
}

bool is_native(const Chart& chart) {
  const Model& model = chart.model();
  return model.scripts.empty() && model.invokes.empty() &&
         std::all_of(model.expressions.begin(), model.expressions.end(), [](const Expression& expression) {
           return !expression.native.empty() || (expression.use == ExpressionUse::kLocation && expression.slot);
         });
}

}  // namespace sentree::scxml
