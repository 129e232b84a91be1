#include "sentree/scxml/detail/made_up_ids.h"

#include <algorithm>
#include <array>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/scxml/script_syntax.h"

namespace sentree::scxml {

namespace {

constexpr std::array<std::string_view, 3> kIdsOfEvents{"sendid", "origin", "invokeid"};

class IdUses {
 public:
  explicit IdUses(const Model& model) : model_(model) {
    for (const StateCode& state : model.state_code) {
      for (const auto* blocks : {&state.onentry, &state.onexit}) {
        for (const Block& block : *blocks) look(block);
      }
    }
    for (const TransitionCode& transition : model.transition_code) look(transition.content);
    for (const Invoke& invoke : model.invokes) {
      look(invoke.finalize);
      keep(invoke.idlocation);
    }
    // What is kept goes on to whom it is assigned.
    for (bool grows = true; std::exchange(grows, false);) {
      for (const auto& [location, value] : assigned_) grows = (is_id(text(value)) && keep(location)) || grows;
    }
    for (const auto& [location, value] : assigned_) {
      if (is_id(text(value))) plain_.insert({location, value});
    }
  }

  std::optional<Place> where_spelled() const {
    if (odd_) return odd_;
    for (ExpressionId id = 0; id < model_.expressions.size(); ++id) {
      const Expression& expression = model_.expressions[id];
      const bool is_plain = plain_.contains(id) || (by_id_.contains(id) && is_id(expression.text));
      if (!is_plain && spells(expression)) return expression.place;
    }
    return std::nullopt;
  }

 private:
  void look(const Block& block) {
    for (const Action& action : block) {
      if (const auto* send = std::get_if<Send>(&action.what)) {
        keep(send->idlocation);
        if (send->target.expr != kNoExpression) by_id_.insert(send->target.expr);
      } else if (const auto* cancel = std::get_if<Cancel>(&action.what)) {
        if (cancel->sendid_expr != kNoExpression) by_id_.insert(cancel->sendid_expr);
      } else if (const auto* assign = std::get_if<Assign>(&action.what)) {
        if (assign->expr != kNoExpression) assigned_.emplace_back(assign->location, assign->expr);
      } else if (const auto* branches = std::get_if<If>(&action.what)) {
        for (const If::Branch& branch : branches->branches) look(branch.body);
      } else if (const auto* loop = std::get_if<Foreach>(&action.what)) {
        look(*loop->body);
      }
    }
  }

  // Whether that is new.
  bool keep(ExpressionId location) {
    if (location == kNoExpression) return false;
    const auto tree = parse_script_expression(text(location));
    if (!tree || tree->at(tree->root()).kind != ScriptNode::Kind::kName) {
      if (!odd_) odd_ = model_.expressions[location].place;
      return false;
    }
    plain_.insert(location);
    return names_.insert(tree->at(tree->root()).text).second;
  }

  [[nodiscard]] std::string_view text(ExpressionId id) const { return model_.expressions[id].text; }

  [[nodiscard]] bool is_id(std::string_view source) const {
    const auto tree = parse_script_expression(source);
    return tree && is_id_path(tree->path(tree->root()));
  }
  [[nodiscard]] bool is_id_path(const std::string& path) const {
    return names_.contains(path) || std::any_of(kIdsOfEvents.begin(), kIdsOfEvents.end(), [&](std::string_view member) {
             return path == "_event." + std::string(member);
           });
  }

  [[nodiscard]] bool spells(const Expression& expression) const {
    if (has_text_like_an_id(expression.text)) return true;
    const auto tree =
        expression.use == ExpressionUse::kScript ? std::nullopt : parse_script_expression(expression.text);
    const auto is_opaque = [](const ScriptNode& node) { return node.kind == ScriptNode::Kind::kOpaque; };
    if (tree && std::none_of(tree->nodes.begin(), tree->nodes.end(), is_opaque)) return spells(*tree, tree->root());
    const std::set<std::string> named = names_in_script(expression.text);
    const auto is_named = [&](const auto& name) { return named.contains(std::string(name)); };
    return std::any_of(names_.begin(), names_.end(), is_named) ||
           (is_named("_event") && std::any_of(kIdsOfEvents.begin(), kIdsOfEvents.end(), is_named));
  }

  [[nodiscard]] bool spells(const ScriptTree& tree, std::uint32_t at) const {
    using Kind = ScriptNode::Kind;
    const ScriptNode& node = tree.at(at);
    if (const std::string path = tree.path(at); !path.empty()) {
      const std::string first = path.substr(0, path.find('.'));
      return path == "_event" || is_id_path(path) || (first != path && names_.contains(first)) ||
             std::any_of(kIdsOfEvents.begin(), kIdsOfEvents.end(), [&](std::string_view member) {
               return path.starts_with("_event." + std::string(member) + ".");
             });
    }
    const bool compares = node.kind == Kind::kBinary &&
                          (node.text == "==" || node.text == "===" || node.text == "!=" || node.text == "!==");
    if (compares) {
      const std::uint32_t left = node.operands[0];
      const std::uint32_t right = node.operands[1];
      const bool left_is = is_id_path(tree.path(left));
      const bool right_is = is_id_path(tree.path(right));
      if (left_is && right_is) return false;
      if (left_is || right_is) return !is_never_an_id(tree.at(left_is ? right : left));
    }
    return std::any_of(node.operands.begin(), node.operands.end(),
                       [&](std::uint32_t operand) { return spells(tree, operand); });
  }

  // What is put together of it would be taken for one.
  static bool has_text_like_an_id(std::string_view source) {
    const auto tokens = script_tokens(source);
    return tokens && std::any_of(tokens->begin(), tokens->end(), [](const ScriptToken& token) {
             return token.kind == ScriptToken::Kind::kLiteral && token.raw.find(".send") != std::string_view::npos;
           });
  }

  // "SESSION.send3", "STATE.1": nothing else is one, so that a comparison says the same of all of them.
  static bool is_never_an_id(const ScriptNode& node) {
    using Kind = ScriptNode::Kind;
    if (node.kind == Kind::kNothing || node.kind == Kind::kNumber || node.kind == Kind::kTruth) return true;
    if (node.kind != Kind::kText) return false;
    const std::string& text = node.text;
    return text.find('.') == std::string::npos || text.back() < '0' || text.back() > '9';
  }

  const Model& model_;
  std::set<std::string> names_;   // of data that hold ids
  std::set<ExpressionId> plain_;  // that only keep them
  std::set<ExpressionId> by_id_;  // that say which event is cancelled, and who is sent to
  std::vector<std::pair<ExpressionId, ExpressionId>> assigned_;
  std::optional<Place> odd_;
};

}  // namespace

std::optional<Place> where_ids_are_spelled(const Model& model) { return IdUses(model).where_spelled(); }

}  // namespace sentree::scxml
