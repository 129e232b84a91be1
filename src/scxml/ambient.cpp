// What the expressions of a chart ask for that is neither its data nor an event.
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "sentree/scxml/detail/made_up_ids.h"
#include "sentree/scxml/loader.h"

namespace sentree::scxml {
namespace {

bool is_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '$' ||
         static_cast<unsigned char>(c) >= 0x80;
}

/// The names and signs of a script, without its texts, comments and regular expressions.
class Words {
 public:
  explicit Words(std::string_view script) : rest_(script) {}

  /// The next name, number or sign; empty: the end.
  std::string_view next() {
    while (skip()) {
    }
    std::size_t size = rest_.empty() ? 0 : 1;
    if (size == 1 && is_name(rest_[0])) {
      while (size < rest_.size() && is_name(rest_[size])) ++size;
    }
    last_ = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return last_;
  }

 private:
  bool drop(std::size_t size) {
    rest_.remove_prefix(std::min(size, rest_.size()));
    return true;
  }
  bool drop_past(std::string_view end) {
    const std::size_t at = rest_.find(end, 2);
    return drop(at == std::string_view::npos ? at : at + end.size());
  }
  bool skip() {
    if (rest_.empty()) return false;
    const char c = rest_[0];
    if (c == ' ' || c == '\t' || c == '\n' || c == '\r') return drop(1);
    if (rest_.starts_with("//")) return drop_past("\n");
    if (rest_.starts_with("/*")) return drop_past("*/");
    if (c == '"' || c == '\'') return drop_quoted(c);
    // Behind a value it is a division.
    const bool divides = !last_.empty() && last_ != "return" && last_ != "typeof" && last_ != "case" &&
                         (is_name(last_[0]) || last_ == ")" || last_ == "]" || last_ == "}");
    if (c == '/' && !divides) return drop_quoted(c);
    return false;
  }
  bool drop_quoted(char quote) {
    bool in_class = false;
    std::size_t i = 1;
    for (; i < rest_.size() && (rest_[i] != quote || in_class); ++i) {
      if (rest_[i] == '\\')
        ++i;
      else if (quote == '/' && (rest_[i] == '[' || rest_[i] == ']'))
        in_class = rest_[i] == '[';
    }
    last_ = ")";  // a value
    return drop(i + 1);
  }

  std::string_view rest_;
  std::string_view last_;
};

struct Found {
  Ambient what;
  std::string name;
};

std::vector<Found> asked_by(std::string_view script) {
  std::vector<Found> found;
  Words words(script);
  std::string_view before;
  std::string_view word = words.next();
  const auto member = [&]() -> std::string_view {
    word = words.next();
    if (word != ".") return {};
    word = words.next();
    return word;
  };
  while (!word.empty()) {
    const std::string_view name = word;
    const bool is_member = before == ".";
    before = name;
    if (name == "\\" || name == "constructor" ||
        (!is_member && (name == "eval" || name == "Function" || name == "globalThis"))) {
      found.push_back({Ambient::kAnything, std::string(name)});
    } else if (is_member) {
    } else if (name == "this") {
      // "this.Date" is "Date"; what is done with the whole of it cannot be told.
      word = words.next();
      if (word != ".") {
        found.push_back({Ambient::kAnything, "this"});
        continue;
      }
      before = {};
    } else if (name == "Date") {
      found.push_back({Ambient::kClock, "Date"});
    } else if (name == "_sessionid" || name == "_ioprocessors") {
      found.push_back({Ambient::kSessionId, std::string(name)});
    } else if (name == "Math") {
      const std::string_view inner = member();
      if (inner.empty()) {
        found.push_back({Ambient::kRandom, "Math"});
        continue;
      }
      if (inner == "random") found.push_back({Ambient::kRandom, "Math.random"});
      before = inner;
    } else if (name == "_event") {
      const std::string_view inner = member();
      constexpr std::array<std::string_view, 5> kPlain{"name", "type", "data", "raw", "origintype"};
      if (std::find(kPlain.begin(), kPlain.end(), inner) == kPlain.end())
        found.push_back({Ambient::kIds, inner.empty() ? "_event" : fmt::format("_event.{}", inner)});
      if (inner.empty()) continue;
      before = inner;
    }
    word = words.next();
  }
  return found;
}

// `visit(place)` for each idlocation of a <send>.
template <class Visit>
void for_each_idlocation(const Block& block, const Visit& visit) {
  for (const Action& action : block) {
    if (const auto* send = std::get_if<Send>(&action.what)) {
      if (send->idlocation != kNoExpression) visit(action.place);
    } else if (const auto* branches = std::get_if<If>(&action.what)) {
      for (const If::Branch& branch : branches->branches) for_each_idlocation(branch.body, visit);
    } else if (const auto* loop = std::get_if<Foreach>(&action.what)) {
      for_each_idlocation(*loop->body, visit);
    }
  }
}

}  // namespace

void Loader::find_ambient() {
  const auto add = [this](Ambient what, std::string name, const Place& place) {
    model_->ambient.push_back({what, std::move(name), {model_->file, place.line, place.column, place.length}});
  };
  if (model_->data_model == DataModelKind::kEcmaScript) {
    for (const Expression& expression : model_->expressions) {
      for (Found& found : asked_by(expression.text)) add(found.what, std::move(found.name), expression.place);
    }
  }
  const auto idlocation = [&](const Place& place) { add(Ambient::kIds, "idlocation", place); };
  for (const StateCode& state : model_->state_code) {
    for (const auto* blocks : {&state.onentry, &state.onexit}) {
      for (const Block& block : *blocks) for_each_idlocation(block, idlocation);
    }
  }
  for (const TransitionCode& transition : model_->transition_code) for_each_idlocation(transition.content, idlocation);
  for (const Invoke& invoke : model_->invokes) {
    for_each_idlocation(invoke.finalize, idlocation);
    if (invoke.idlocation != kNoExpression) idlocation(invoke.place);
    if (invoke.child) {
      const auto inner = invoke.child->ambient();
      model_->ambient.insert(model_->ambient.end(), inner.begin(), inner.end());
      // What answers them finds its way back by the session's name, which is another each time.
      const auto sends_outside = [](const SendInfo& send) { return !send.type || !is_scxml_processor(*send.type); };
      const std::vector<SendInfo> sends = sends_with_invoked(*invoke.child);
      if (invoke.id.empty() && std::any_of(sends.begin(), sends.end(), sends_outside))
        add(Ambient::kInvokeId, "answers to what an <invoke> without id begins", invoke.place);
    } else if (invoke.src.expr != kNoExpression || invoke.payload.content_expr != kNoExpression ||
               invoke.type.expr != kNoExpression) {
      add(Ambient::kAnything, "<invoke>", invoke.place);
    }
  }
  if (std::any_of(model_->ambient.begin(), model_->ambient.end(),
                  [](const AmbientUse& use) { return use.what == Ambient::kIds; })) {
    if (const auto place = where_ids_are_spelled(*model_))
      add(Ambient::kIdText, "the spelling of an id that the engine makes up", *place);
  }
  for (const AmbientUse& use : model_->ambient) model_->ambient_kinds |= 1U << static_cast<unsigned>(use.what);
}

}  // namespace sentree::scxml
