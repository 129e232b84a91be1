#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sentree/idl/schema.h"
#include "sentree/scxml/model.h"
#include "sentree/scxml/script_syntax.h"

namespace sentree::verify {

/// Structures inside structures of a reply that are looked into.
inline constexpr int kReplyNestingMax = 16;
/// Places of members of one name; beyond, they are as good as countless.
inline constexpr std::size_t kReplyPlacesMax = 1000;

/// What the replies of one service are made of.
struct ReplyTypes {
  const std::set<std::string>* fields = nullptr;       ///< Names of members of all services of a project; borrowed.
  std::map<std::string, std::set<idl::Kind>> members;  ///< Kinds by name of a member, of this service.
  std::map<std::string, std::set<idl::Kind>> results;  ///< By method; of a list, also those of its elements.
  /// By name of a member: in how many places one reply has one so called, at most, and kReplyPlacesMax. What lists hold
  /// does not count.
  std::map<std::string, std::size_t> places;
  bool throws = false;                               ///< Some method may answer with an error of its own.
  const std::set<std::string>* defaulted = nullptr;  ///< Arguments of calls that need not be given; borrowed.
};

/// Where replies of one service go in a chart: into which expressions and variables.
class ReplyFlow {
 public:
  /// What an expression is there for.
  enum class Role : std::uint8_t {
    kCondition,
    kAssigned,  ///< To the variable `name`; empty: to a member of one.
    kLogged,
    kArgument,  ///< `name` of a call or a publication.
    kGiven,     ///< Param `name` of the state that ends the chart, or of the event that answers a tick.
    kDecides,   ///< Something that no comparison tells; `name` says what: "decides when an event comes".
  };
  struct Use {
    scxml::ExpressionId expression = scxml::kNoExpression;
    Role role = Role::kCondition;
    std::string name;
    std::string call = {};  ///< Of an argument: "SERVICE.METHOD"; empty: expressions say of which.
  };
  /// An event that a chart sends to itself and that answers a tick: its params are output ports, and one the status.
  struct Answer {
    std::string event;   ///< Empty: there is none.
    std::string status;  ///< Empty: all of it.
  };

  /// @param far  Variables, and members of events' data, that hold something of a reply to another leaf.
  ReplyFlow(const scxml::Chart& chart, std::string service, const ReplyTypes& types, std::set<std::string> far,
            Answer answer);

  ReplyFlow(const ReplyFlow&) = delete;
  ReplyFlow& operator=(const ReplyFlow&) = delete;
  ~ReplyFlow() = default;

  [[nodiscard]] const scxml::Chart& chart() const { return chart_; }
  [[nodiscard]] const ReplyTypes& types() const { return types_; }
  [[nodiscard]] const std::vector<Use>& uses() const { return uses_; }
  [[nodiscard]] std::size_t size() const { return trees_.size(); }
  /// Whether every event goes to what it invokes as well.
  [[nodiscard]] bool forwards() const;
  /// Nothing: it cannot be read.
  [[nodiscard]] const std::optional<scxml::ScriptTree>& tree(scxml::ExpressionId expression) const {
    return trees_[expression];
  }
  /// What is assigned to a variable, its first value included.
  [[nodiscard]] const std::vector<scxml::ExpressionId>& assigned(const std::string& variable) const;

  /// Whether more of a reply goes into a part of an expression than what its comparisons tell.
  [[nodiscard]] bool is_of_reply(const scxml::ScriptTree& tree, std::uint32_t node) const;
  [[nodiscard]] bool is_of_reply(const std::string& variable) const {
    return far_.contains(variable) || of_reply_.contains(variable);
  }
  /// The same of an expression that cannot be read, or of one with functions: as far as its words tell.
  [[nodiscard]] bool mentions_reply(scxml::ExpressionId expression) const;
  /// Whether it is what an event of the service holds, as it is: "_event.data.result.pose.x".
  [[nodiscard]] bool is_direct(const scxml::ScriptTree& tree, std::uint32_t node) const;
  /// Whether it comes, in this part of the expression or in a variable, from another leaf's reply.
  [[nodiscard]] bool is_far(const scxml::ScriptTree& tree, std::uint32_t node) const;
  /// Something else than <assign> may change it: what it holds is not known.
  [[nodiscard]] bool is_scripted(const std::string& variable) const {
    return hiding_.has_value() || scripted_.contains(variable);
  }
  /// An expression with `hides_names`.
  [[nodiscard]] std::optional<scxml::ExpressionId> hiding() const { return hiding_; }
  /// A part of an expression that holds what the chart itself has sent, and gets back in the answer: as a variable to
  /// which each of its params of that name is assigned, "_event.data.args.goal". Empty: it is no such part.
  [[nodiscard]] std::string echo(const scxml::ScriptTree& tree, std::uint32_t node) const;
  /// Whether events bring back what of a reply was sent or kept elsewhere.
  [[nodiscard]] bool is_sent() const { return is_any_sent() || !far_.empty(); }
  /// The names under which what a part of an expression holds was read.
  [[nodiscard]] std::set<std::string> sources(const scxml::ScriptTree& tree, std::uint32_t node) const;
  /// How many values that were read under this name variables hold as they are: one each, and of a structure as many
  /// as it may have inside.
  [[nodiscard]] std::size_t held(const std::string& source) const;
  /// Whether any expression may see something of a reply.
  [[nodiscard]] bool sees_reply() const;
  /// Kinds that it may be of.
  [[nodiscard]] std::set<idl::Kind> kinds(const scxml::ScriptTree& tree, std::uint32_t node) const;
  /// Whether a text of a reply goes into it, however it is changed.
  [[nodiscard]] bool is_of_text(const scxml::ScriptTree& tree, std::uint32_t node) const;
  /// Whether it is what a reply holds, as it is, or has nothing of one.
  [[nodiscard]] bool is_plain(const scxml::ScriptTree& tree, std::uint32_t node) const;
  /// Params into which something of a reply goes and that leave the chart.
  [[nodiscard]] std::set<std::string> given() const;
  /// Arguments into which something of a reply goes, of calls and publications: "SERVICE.METHOD" (see `Use`), and name.
  [[nodiscard]] std::set<std::pair<std::string, std::string>> passed() const;

 private:
  using Where = std::optional<std::set<std::string>>;  // Methods whose replies the event may be; nothing: all.

  void look(const scxml::Block& block, const Where& where);
  void look(const scxml::Payload& payload, Role role, const Where& where, const std::string& call = {});
  void look(const scxml::Send& send, const Where& where);
  void look(const scxml::Invoke& invoke);
  void use(scxml::ExpressionId expression, Role role, std::string name, const Where& where);
  [[nodiscard]] Where methods(const std::vector<std::string>& events) const;
  void note_changes();
  void follow();
  [[nodiscard]] bool is_of_reply(scxml::ExpressionId expression) const;
  [[nodiscard]] bool is_event_of_reply(const scxml::ScriptTree& tree, std::uint32_t node,
                                       const std::string& path) const;
  [[nodiscard]] bool is_any_sent() const;  // something of a reply, so that it comes back
  [[nodiscard]] bool is_of_text(const scxml::ScriptTree& tree, std::uint32_t node, std::set<std::string>& seen) const;
  // Whether no event that it sees is a reply of the service.
  [[nodiscard]] bool is_foreign(const scxml::ScriptTree& tree) const;
  [[nodiscard]] bool is_truth_value(const scxml::ScriptTree& tree, std::uint32_t node) const;
  [[nodiscard]] std::set<idl::Kind> kinds_of_member(const scxml::ScriptTree& tree, std::uint32_t node) const;
  // What a part of an expression may be, as it is: members, and what was assigned to variables.
  template <class Visit>
  void visit_plain(const scxml::ScriptTree& tree, std::uint32_t node, std::set<std::string>& seen,
                   const Visit& visit) const;

  const scxml::Chart& chart_;
  std::string service_;
  const ReplyTypes& types_;
  std::set<std::string> far_;
  Answer answer_;
  std::vector<Use> uses_;
  std::vector<std::optional<scxml::ScriptTree>> trees_;              // by expression
  std::map<const scxml::ScriptTree*, std::set<std::string>> where_;  // where not all methods' replies can be
  std::set<scxml::ExpressionId> foreign_;                            // where none can be
  std::map<std::string, std::vector<scxml::ExpressionId>> assigned_;
  std::set<std::string> of_reply_;  // variables, and what is sent, as `echo` calls it
  std::set<std::string> echoes_;    // that are looked at
  std::set<std::string> scripted_;
  std::optional<scxml::ExpressionId> hiding_;
};

/// What of what leaves a chart somebody looks at.
struct LookedAt {
  std::set<std::string> arguments;  ///< Of calls.
  /// Of calls, by name: that are only compared with what replies held under these names.
  std::map<std::string, std::set<std::string>> handed_back;
  std::set<std::string> published;  ///< Arguments of `topics`.
  std::set<std::string> topics;     ///< That models subscribe to.
  std::set<std::string> inputs;     ///< Of ticks.
  std::set<std::string> outputs;    ///< Of answers to ticks.
  bool logs = false;                ///< Texts of <log>.
};

/// A use of a reply of which it is not known what it tells apart.
struct UnknownUse {
  scxml::ExpressionId expression = scxml::kNoExpression;
  std::string why;  ///< "is given to f()"
};
/// The first one in a chart, if there is any. Understood are comparisons with constants, also after + - * / by
/// constants and after some functions of Math, truth, presence, what is kept in variables and handed on, and what comes
/// back of that; nothing else is. What is compared is not examined here.
/// @param looked_at  By monitors and models.
[[nodiscard]] std::optional<UnknownUse> unknown_use(const ReplyFlow& flow, const LookedAt& looked_at);

[[nodiscard]] bool is_comparison(const std::string& sign);
/// Words by which a script can name what its text does not: `eval`, `this`, …
[[nodiscard]] bool hides_names(const std::set<std::string>& names_in_script);
/// Functions that grow with what they are given, or fall with it, and not by more.
[[nodiscard]] bool is_steady(const std::string& function);

}  // namespace sentree::verify
