#include "sentree/import/detail/tree_system.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "sentree/base/ascii.h"
#include "sentree/bt/entry_uses.h"
#include "sentree/bt/library.h"
#include "sentree/bt/types.h"
#include "sentree/bt/write.h"
#include "sentree/import/detail/project_writer.h"
#include "sentree/nav2/nav2.h"
#include "sentree/project/plan.h"
#include "sentree/scxml/script_syntax.h"
#include "sentree/text/file.h"
#include "sentree/text/xml.h"

namespace sentree::import {

namespace {

namespace fs = std::filesystem;

// What is asked, rather than done, of which no file says what it is.
constexpr std::array<std::string_view, 9> kQuestions{"Is",     "Has",   "Are",   "Can", "Was",
                                                     "Should", "Check", "Needs", "Does"};

bool sounds_like_a_condition(std::string_view id) {
  return std::any_of(kQuestions.begin(), kQuestions.end(), [&](std::string_view word) {
    if (!id.starts_with(word) || id.size() == word.size()) return false;
    const char next = id[word.size()];
    return next == '_' || (next >= 'A' && next <= 'Z');
  });
}

// What a script of a chart could not read, or would miss.
constexpr std::array<std::string_view, 13> kTaken{"undefined",  "NaN",           "Infinity", "eval",   "arguments",
                                                  "In",         "Math",          "await",    "_event", "_name",
                                                  "_sessionid", "_ioprocessors", "_x"};

bool is_data_id(std::string_view name) {
  if (scxml::is_reserved_word(name) || std::find(kTaken.begin(), kTaken.end(), name) != kTaken.end()) return false;
  return !name.empty() && !is_digit(name.front()) && std::all_of(name.begin(), name.end(), is_word);
}

// "{entry}" as the name of the entry; "{=}" is the port's own.
std::string_view entry_of(const bt::PortFact& port) {
  const std::string_view text = port.text;
  if (text == "{=}" || text == "=") return port.name;
  return text.size() > 2 && text.front() == '{' && text.back() == '}' ? text.substr(1, text.size() - 2)
                                                                      : std::string_view();
}

// Entries that something has written, in the order of the file. A SubTree's are those of its own blackboard, and what
// its ports pass on.
class Written {
 public:
  explicit Written(const bt::Tree& tree) : tree_(tree) {}

  [[nodiscard]] bool contains(bt::NodeId scope, std::string_view entry) const {
    for (std::string name(entry);;) {
      if (entries_.contains({scope, name}) || name.starts_with('@')) return true;
      if (scope == kNoNode) return false;
      const auto outside = outside_of(scope, name);
      if (!outside) return false;
      if (outside->empty()) return true;  // a constant
      name = *outside;
      scope = tree_.enclosing_subtree(scope);
    }
  }
  void add(bt::NodeId scope, std::string_view entry) {
    for (std::optional<std::string> name(entry); name && !name->empty();) {
      entries_.emplace(scope, *name);
      if (scope == kNoNode) return;
      name = outside_of(scope, *name);
      scope = tree_.enclosing_subtree(scope);
    }
  }
  // What a built-in or declared node writes.
  void add_all(bt::NodeId node) {
    const bt::NodeId scope = tree_.enclosing_subtree(node);
    for (const bt::PortFact& port : tree_.ports(node)) {
      if (port.output && port.declared) add(scope, entry_of(port));
      if (port.name == "code") add_assigned(scope, port.text);
      if (port.name == "output_key") add(scope, entry_of(port).empty() ? port.text : entry_of(port));
    }
    for (const auto& [kind, script] : tree_.conditions(node)) add_assigned(scope, script);
  }

 private:
  static constexpr bt::NodeId kNoNode = bt::kNoNode;

  // Of a SubTree's entry, what it is outside: nothing if it is none there, "" for a constant.
  [[nodiscard]] std::optional<std::string> outside_of(bt::NodeId subtree, std::string_view entry) const {
    std::optional<std::string> outside;
    for (const bt::PortFact& port : tree_.ports(subtree)) {
      if (port.name == "_autoremap" && port.text != "false" && port.text != "0" && !outside)
        outside = std::string(entry);
      if (port.name == "__shared_blackboard" && port.text == "true" && !outside) outside = std::string(entry);
      // In format 3 a SubTree's port is the name of an entry, without braces; a SubTreePlus's is as in format 4.
      const bool is_name = tree_.format() == 3 && tree_.registration(subtree) == "SubTree" && entry_of(port).empty();
      if (port.name == entry) outside = std::string(is_name ? port.text : entry_of(port));
    }
    return outside;
  }
  void add_assigned(bt::NodeId scope, std::string_view script) {
    for (std::size_t at = script.find('='); at != std::string_view::npos; at = script.find('=', at + 1)) {
      const std::size_t end = script.find_last_not_of(": ", at == 0 ? 0 : at - 1);
      const bool compares = (at > 0 && script[at - 1] == '=') || (at + 1 < script.size() && script[at + 1] == '=');
      if (at == 0 || compares || end == std::string_view::npos || !is_word(script[end])) continue;
      std::size_t begin = end;
      while (begin > 0 && is_word(script[begin - 1])) --begin;
      add(scope, script.substr(begin, end + 1 - begin));
    }
  }

  const bt::Tree& tree_;
  std::set<std::pair<bt::NodeId, std::string>> entries_;
};

struct Port {
  std::string type;
  bool input = false;
  bool output = false;
  bt::EntryUses::Users users = bt::EntryUses::unused();  // of what it writes
};

// A value to begin with: of the type that a palette names, else one that those who use it can take.
std::string_view first_value(const Port& port) {
  using Class = bt::PortType::Class;
  const auto used_as = [&](bt::Wanted kind) { return port.users[static_cast<std::size_t>(kind)] != bt::kNoNode; };
  const bool is_positive = used_as(bt::Wanted::kPositive);
  const bt::PortType* const type = bt::type_named(port.type);
  switch (type == nullptr ? Class::kAny : type->kind) {
    case Class::kBool: return "false";
    case Class::kInteger:
    case Class::kReal: return is_positive ? "1" : "0";
    case Class::kStatus: return "'SUCCESS'";
    case Class::kString: return is_positive ? "'1'" : used_as(bt::Wanted::kNumber) ? "'0'" : "''";
    case Class::kOther: return "[]";
    default: break;
  }
  if (is_positive) return "1";
  if (used_as(bt::Wanted::kNumber)) return "0";
  if (used_as(bt::Wanted::kTruth)) return "false";
  if (used_as(bt::Wanted::kStatus)) return "'SUCCESS'";
  return used_as(bt::Wanted::kList) ? "[]" : "''";
}

// All leaves of one ID have one skill.
struct Skill {
  std::string id;
  bool is_condition = false;
  bool is_guess = false;  // that it is one, by its name or its place
  bool is_guard = false;  // by its place
  SourceSpan span;        // of the first
  std::map<std::string, Port, std::less<>> ports;
};

std::string chart_of(const Skill& skill, const std::string& chart) {
  // Its own, by which scenarios and the project say how it ends.
  std::string outcome = skill.is_condition ? "holds" : "succeeds";
  while (skill.ports.contains(outcome)) outcome += '_';
  std::string data = fmt::format("    <data id=\"{}\" expr=\"true\"/>\n", outcome);
  std::string given;  // to what the skill asks, as to the component that will be asked
  std::string results;
  for (const auto& [name, port] : skill.ports) {
    if (!is_data_id(name)) continue;
    if (port.input) {
      data += fmt::format("    <data id=\"{}\"/>\n", name);
      if (!port.output) given += fmt::format("        <param name=\"{0}\" expr=\"{0}\"/>\n", name);
    }
    if (!port.output) continue;
    // Nothing may have written yet what it reads and writes.
    const std::string value =
        port.input ? fmt::format("{0} == null ? {1} : {0}", name, first_value(port)) : std::string(first_value(port));
    results += fmt::format("      <param name=\"{}\" expr=\"{}\"/>\n", name, value);
  }
  const std::string head = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<!-- To begin with: {}. Write what it {}. -->\n"
      "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\" name=\"{}\" "
      "initial=\"{}\">\n  <datamodel>\n{}  </datamodel>\n",
      skill.is_condition ? "it holds" : "it succeeds after a second", skill.is_condition ? "asks" : "does", chart,
      skill.is_condition ? "asking" : "working", data);
  const std::string send = given.empty() ? "/>" : fmt::format(">\n{}      </send>", given);
  const std::string body = fmt::format(
      fmt::runtime(
          skill.is_condition
              ? "  <state id=\"asking\">\n"
                "    <!-- <send type=\"thrift\" target=\"SERVICE\" event=\"METHOD\"> asks, and its reply decides. -->\n"
                "    <onentry>\n      <send event=\"answer\" target=\"#_internal\"{1}\n    </onentry>\n"
                "    <transition event=\"answer\" cond=\"{0}\" target=\"success\"/>\n"
                "    <transition event=\"answer error\" target=\"failure\"/>\n"
                "  </state>\n"
              : "  <state id=\"working\">\n"
                "    <!-- <send type=\"thrift\" target=\"SERVICE\" event=\"METHOD\"> asks a component to begin. -->\n"
                "    <onentry>\n      <send event=\"done\" delay=\"1s\"{1}\n    </onentry>\n"
                "    <transition event=\"halt\" target=\"halted\"/>\n"
                "    <transition event=\"done\" cond=\"{0}\" target=\"success\"/>\n"
                "    <transition event=\"done error\" target=\"failure\"/>\n"
                "  </state>\n"),
      outcome, send);
  const std::string success =
      results.empty() ? "  <final id=\"success\"/>\n"
                      : "  <final id=\"success\">\n    <donedata>\n" + results + "    </donedata>\n  </final>\n";
  return head + body + success + "  <final id=\"failure\"/>\n" +
         (skill.is_condition ? "" : "  <final id=\"halted\"/>\n") + "</scxml>\n";
}

class TreeSystem {
 public:
  // Paths are relative to `folder`; `shown` is how messages name them.
  explicit TreeSystem(fs::path folder) : folder_(std::move(folder)) { nav2::add_nodes(registry_); }

  // A file of which something may be needed.
  void offer(const std::string& file) {
    const auto source = text::read_file(folder_ / file, shown(file), kFileBytesMax);
    const auto added = source ? library_.add(shown(file), *source) : tl::unexpected(source.error());
    if (!added && added.error().code != "bt.not-a-tree") unread_.push_back(added.error());
  }
  // What is wrong with files that could not be read: nobody knows what they hold.
  [[nodiscard]] const Diagnostics& unread() const { return unread_; }

  [[nodiscard]] const bt::Library& library() const { return library_; }

  Loaded<Imported> run(const std::string& main) {
    result_.form = kTreeForm;
    own_ = library_.palette();
    nav2_.add(nav2::models());
    nav2_.add(bt::models(registry_));
    for (const auto& [id, own] : own_.nodes()) {
      const bt::NodeModel* model = nav2_.find(id);
      const bool is_other =
          model != nullptr && (model->category != own.category ||
                               !std::all_of(own.ports.begin(), own.ports.end(),
                                            [&](const auto& port) { return has_port(*model, port.name); }));
      if (is_other) own_nodes_.insert(id);
    }
    bt::LoadOptions options;
    options.registry = &registry_;
    options.partial = true;
    options.read_file = [this, &main](const fs::path& file) { return include(file, main); };
    options.find_package = [this](std::string_view package) {
      auto found = bt::find_ros_package(package);
      if (found) packages_.push_back(*found);  // what is included from there lies where it lies
      return found;
    };
    Loaded<bt::Tree> tree;
    const auto source = include(shown(main), main);
    if (!source) tree.diagnostics.push_back(source.error());
    // Again without those of Nav2's nodes of which a file that was read has only the name.
    for (bool again = source.has_value(); again;) {
      const std::size_t before = own_nodes_.size();
      bt::Library library = library_;
      library.add(nav2_models());
      for (const std::string& id : own_nodes_) registry_.remove(id);
      library.serve(options);
      tree = bt::load(*source, options, shown(main));
      again = own_nodes_.size() > before;
    }
    Diagnostics outside;
    for (const Diagnostic& problem : tree.diagnostics) {
      if (problem.code != "import.outside") continue;
      outside.push_back(problem);
      outside.back().severity = Severity::kError;
    }
    // A project without them is none.
    if (!outside.empty()) return {.value = std::nullopt, .diagnostics = std::move(outside)};
    if (!tree.value) return {.value = std::nullopt, .diagnostics = std::move(tree.diagnostics)};
    for (const Diagnostic& problem : tree.diagnostics) {
      // Of the leaves there is something to say below.
      if (problem.code == "bt.unknown-node" || problem.code == "bt.unknown-tree") continue;
      const bool may_be_enum = problem.code == "bt.unknown-entry";
      find(Fate::kByHand, problem.span, "",
           problem.message +
               (may_be_enum ? "; names of enums are registered by a plug-in (docs/coming-from-behaviortree-cpp.md)"
                            : ""));
    }
    for (const Diagnostic& problem : unread_) {
      find(Fate::kByHand, problem.span, "",
           fmt::format("{}; nothing of this file is in the project: mend it, and import again", problem.message));
    }
    uses_.emplace(*tree.value);
    Written written(*tree.value);
    for (bt::NodeId node = 0; node < tree.value->size(); ++node) {
      look_at(*tree.value, node, written);
      written.add_all(node);
    }
    for (const auto& [id, skill] : skills_) {
      write(skill);
      find_uses_that_differ(*tree.value, skill);
    }
    write_missing(tree.value->format());
    std::string begin(tree.value->id());
    if (needs_goal_) begin = write_goal(begin, tree.value->format(), shown(main));
    write_project_file(main, begin);
    std::stable_sort(result_.findings.begin(), result_.findings.end(),
                     [](const Finding& a, const Finding& b) { return a.span < b.span; });
    return {.value = std::move(result_), .diagnostics = {}};
  }

 private:
  // A file that is made, beside those of the mission.
  std::string made_file(const std::string& name) {
    std::string file = "trees/" + name + ".xml";
    for (int i = 2; copied_.contains(file.substr(6)); ++i) file = fmt::format("trees/{}_{}.xml", name, i);
    return file;
  }

  void find(Fate fate, SourceSpan span, std::string original, std::string reason) {
    result_.findings.push_back({fate, std::move(span), std::move(original), std::move(reason)});
  }

  [[nodiscard]] std::string shown(const std::string& file) const { return (folder_ / file).string(); }

  // Of the nodes in a file: IDs of <Action ID=…>, which says what it is, and those that are called like one of Nav2's.
  void note_nodes(const std::string& xml) {
    const auto document = text::XmlDocument::parse(xml, {}, {.lenient = true});
    if (!document) return;
    std::vector<text::XmlElement> queue{document->root()};
    while (!queue.empty()) {
      const text::XmlElement element = queue.back();
      queue.pop_back();
      if (element.local_name() == "TreeNodesModel") continue;
      const bool is_explicit = bt::is_explicit_tag(element.local_name());
      const std::string id(is_explicit ? element.attribute("ID").value_or("") : element.local_name());
      if (element.local_name() == "Action") explicit_.insert(id);
      if (const bt::NodeModel* model = nav2_.find(id)) {
        bool is_other = is_explicit && element.local_name() != bt::to_string(model->category);
        for (const text::XmlAttribute& attribute : element.attributes()) {
          const std::string_view name = attribute.name;
          is_other = is_other || (name != "ID" && name != "name" && !name.starts_with('_') && !has_port(*model, name));
        }
        if (is_other) own_nodes_.insert(id);
      }
      for (const text::XmlElement& child : element.children()) queue.push_back(child);
    }
  }

  static bool has_port(const bt::NodeModel& model, std::string_view name) {
    return std::any_of(model.ports.begin(), model.ports.end(),
                       [&](const bt::PortInfo& port) { return port.name == name; });
  }

  // `file` as a path inside `folder`, links followed; nothing if it lies outside.
  static std::optional<std::string> inside_of(const fs::path& folder, const fs::path& file) {
    std::error_code error;
    const fs::path inside = fs::weakly_canonical(file, error).lexically_relative(fs::weakly_canonical(folder, error));
    if (inside.empty() || *inside.begin() == "..") return std::nullopt;
    return inside.generic_string();
  }

  // The refusal, with the folder that holds both.
  [[nodiscard]] Result<std::string> refuse(const fs::path& file, const std::string& main) const {
    std::error_code error;
    const fs::path here = fs::absolute(folder_, error).lexically_normal() / "";
    const fs::path there = fs::absolute(file, error).lexically_normal();
    const auto [end, _] = std::mismatch(here.begin(), here.end(), there.begin(), there.end());
    fs::path both;
    for (auto part = here.begin(); part != end; ++part) both /= *part;
    std::string out = "copy it there";
    if (both / "" == here) {
      out = "it is a link; put the file in its place";
    } else if (both.has_relative_path()) {
      const fs::path named = folder_.is_absolute() ? both : both.lexically_relative(fs::current_path(error));
      out = fmt::format("import the folder that holds both: sentree import {} --main {}", named.string(),
                        (here / main).lexically_relative(both).string());
    }
    return fail("import.outside",
                fmt::format("lies outside the imported folder, {}, and is not read: {}",
                            (folder_ / "").lexically_normal().string(), out),
                SourceSpan{file.string()});
  }

  // What the mission is made of comes into the project as it is, but for packages of ROS, which are found there as
  // here.
  Result<std::string> include(const fs::path& file, const std::string& main) {
    const std::optional<std::string> inside = inside_of(folder_, file);
    const bool is_of_package = std::any_of(packages_.begin(), packages_.end(), [&](const fs::path& package) {
      return inside_of(package, file).has_value();
    });
    if (!inside && !is_of_package) return refuse(file, main);
    auto source = text::read_file(file, file.string(), kFileBytesMax);
    if (source) note_nodes(*source);
    if (source && inside && copied_.insert(*inside).second) result_.files.push_back({"trees/" + *inside, *source});
    return source;
  }

  void look_at(const bt::Tree& tree, bt::NodeId node, Written& written) {
    if (tree.is_unknown(node) && tree.category(node) == bt::Category::kSubTree)
      missing_.emplace(std::string(tree.subtree_id(node)), tree.span(node));
    const std::string id(tree.registration(node));
    if (tree.is_unknown(node) && tree.category(node) != bt::Category::kSubTree) {
      if (!unknown_.insert(id).second) return;
      result_.plug_in_nodes.push_back(id);
      find(Fate::kByHand, tree.span(node), id,
           "a node with children, written in C++: write it as a plug-in (docs/coming-from-behaviortree-cpp.md), and "
           "name that under `plugins:`");
      return;
    }
    if (tree.is_external(node)) {
      if (!is_of_nav2(id)) return add_skill(tree, node, written);
      drives_ = true;
      for (const bt::PortFact& port : tree.ports(node)) {
        const bool is_goal = port.input && !port.output && entry_of(port) == "goal";
        needs_goal_ = needs_goal_ || (is_goal && !written.contains(tree.enclosing_subtree(node), "goal"));
      }
    } else if (registry_.find(id) == nullptr) {
      return;
    }
    if (!std::exchange(has_nav2_, true)) {
      find(Fate::kReview, tree.span(node), id,
           "taken as Nav2's; a skill of your own in skills/ counts first (docs/how-to/run-a-nav2-tree.md)");
    }
  }

  // Nav2's models, without those that the mission has nodes of its own for.
  [[nodiscard]] std::vector<bt::NodeModel> nav2_models() const {
    std::vector<bt::NodeModel> models = nav2::models();
    std::erase_if(models, [this](const bt::NodeModel& model) { return own_nodes_.contains(model.id); });
    return models;
  }

  // One whose skill comes with Sentree.
  [[nodiscard]] bool is_of_nav2(const std::string& id) const {
    if (own_nodes_.contains(id)) return false;
    const auto& models = nav2::models();
    std::error_code error;
    return std::any_of(models.begin(), models.end(), [&](const bt::NodeModel& m) { return m.id == id; }) &&
           fs::exists(project::shipped_folder("skills") / nav2::kPalette / (id + ".scxml"), error);
  }

  // Whether no file says what it is.
  [[nodiscard]] bool is_anything(const std::string& id) const {
    return own_.find(id) == nullptr && !explicit_.contains(id);
  }

  // A ReactiveSequence or ReactiveFallback asks what stands before its last child at each tick; an action there that
  // takes time would start anew for ever, and halt the others.
  static bool is_asked_again(const bt::Tree& tree, bt::NodeId node) {
    const bt::NodeId parent = tree.parent(node);
    return parent != bt::kNoNode && tree.registration(parent).starts_with("Reactive") &&
           tree.children(parent).back() != node;
  }

  void add_skill(const bt::Tree& tree, bt::NodeId node, Written& written) {
    const std::string id(tree.registration(node));
    const bool is_new = !skills_.contains(id);
    Skill& skill = skills_[id];
    if (is_new) {
      skill.id = id;
      skill.span = tree.span(node);
      const bool is_said = tree.category(node) == bt::Category::kCondition;
      skill.is_guess = !is_said && is_anything(id) && sounds_like_a_condition(id);
      skill.is_condition = is_said || skill.is_guess;
    }
    if (!skill.is_condition && is_anything(id) && is_asked_again(tree, node))
      skill.is_condition = skill.is_guess = skill.is_guard = true;
    for (const bt::PortFact& fact : tree.ports(node)) {
      Port& port = skill.ports[std::string(fact.name)];
      if (port.type.empty()) port.type = std::string(fact.type);
      const std::string_view entry = entry_of(fact);
      // What nothing has written before is written here, as far as one can guess.
      const bool is_guess = !fact.declared && !entry.empty();
      const bool writes = is_guess ? !written.contains(tree.enclosing_subtree(node), entry) : fact.output;
      port.input = port.input || (is_guess ? !writes : fact.input);
      port.output = port.output || writes;
      if (writes) {
        const bt::EntryUses::Users users = uses_->of(node, fact.name);
        for (std::size_t i = 0; i < users.size(); ++i) port.users[i] = std::min(port.users[i], users[i]);
      }
      if (!is_guess) continue;
      if (writes) written.add(tree.enclosing_subtree(node), entry);
      if (guessed_.emplace(id, std::string(fact.name)).second) {
        find(Fate::kReview, tree.span(node), fmt::format("{}=\"{}\"", fact.name, fact.text),
             fmt::format("no TreeNodesModel says whether {} reads or writes it: taken as {}", id,
                         writes ? "written, since nothing has done so before" : "read"));
      }
    }
  }

  void write(const Skill& skill) {
    const std::string name = unused_name(safe_name(skill.id), skill_files_);
    const std::string file = fmt::format("skills/{}.scxml", name);
    if (name != skill.id) skill_lines_ += fmt::format("  {}: {{file: {}}}\n", yaml_text(skill.id), yaml_text(file));
    result_.files.push_back({file, chart_of(skill, name)});
    find(Fate::kByHand, skill.span, skill.id,
         fmt::format("{} {}{}: write what it {} (docs/how-to/write-a-skill.md)", file,
                     skill.is_condition ? "holds" : "succeeds after a second",
                     skill.is_guard   ? " (a condition by its place under a Reactive node, which asks it at each tick)"
                     : skill.is_guess ? " (a condition by its name)"
                                      : "",
                     skill.is_condition ? "asks" : "does"));
    for (const auto& [port_name, port] : skill.ports) {
      if (is_data_id(port_name)) continue;
      find(Fate::kByHand, skill.span, fmt::format("{} of {}", port_name, skill.id),
           "no name of <data>: the skill does not have this port");
    }
  }

  // No one value fits them all.
  void find_uses_that_differ(const bt::Tree& tree, const Skill& skill) {
    for (const auto& [name, port] : skill.ports) {
      const auto first_of = [&users = port.users](std::initializer_list<bt::Wanted> kinds) {
        bt::NodeId first = bt::kNoNode;
        for (const bt::Wanted kind : kinds) first = std::min(first, users[static_cast<std::size_t>(kind)]);
        return first;
      };
      using bt::Wanted;
      const std::array<std::pair<std::string_view, bt::NodeId>, 3> uses{
          {{"a number", first_of({Wanted::kNumber, Wanted::kPositive, Wanted::kTruth})},
           {"text", first_of({Wanted::kText, Wanted::kStatus})},
           {"a list", first_of({Wanted::kList})}}};
      std::string list;
      int kinds = 0;
      for (const auto& [what, node] : uses) {
        if (node == bt::kNoNode) continue;
        list += fmt::format("{}as {} at {}", kinds++ == 0 ? "" : " and ", what, to_string(tree.span(node)));
      }
      if (kinds < 2) continue;
      find(Fate::kByHand, skill.span, fmt::format("{} of {}", name, skill.id),
           fmt::format("what it writes is used {}; {} to begin with fits one of them", list, first_value(port)));
    }
  }

  // The mission runs without them; BehaviorTrees of format 3 and 4 are not mixed.
  void write_missing(int format) {
    if (missing_.empty()) return;
    const std::string file = made_file("missing_trees");
    std::string xml = format == 4 ? "<root BTCPP_format=\"4\">\n" : "<root>\n";
    for (const auto& [id, span] : missing_) {
      const std::string name = text::xml_escape(id);
      xml += fmt::format("  <BehaviorTree ID=\"{}\"><AlwaysSuccess/></BehaviorTree>\n", name);
      find(Fate::kByHand, span, id,
           fmt::format("its BehaviorTree is in none of the files: {} has one that succeeds, to begin with", file));
    }
    result_.files.push_back({file, xml + "</root>\n"});
    copied_.insert(file.substr(6));
  }

  // In Nav2 the goal is there when the tree begins. The tree that puts it there.
  std::string write_goal(const std::string& tree, int format, const std::string& main) {
    constexpr const char* kWhose = "Nav2 gives it to its tree";
    if (tree.empty()) {
      find(Fate::kByHand, SourceSpan{main}, "goal",
           fmt::format("{}: give the BehaviorTree an ID, and write a tree that sets the goal and has it as a SubTree",
                       kWhose));
      return tree;
    }
    std::set<std::string> taken;
    for (const bt::TreeFile& known : library_.files()) taken.insert(known.trees.begin(), known.trees.end());
    std::string id = unused_name("Mission", taken);
    const std::string file = made_file("to_the_goal");
    result_.files.push_back(
        {file, fmt::format("<root{0}>\n  <BehaviorTree ID=\"{1}\">\n    <Sequence>\n"
                           "      <!-- stamp; frame; x; y; z; qx; qy; qz; qw -->\n"
                           "      {4}\n"
                           "      <SubTree ID=\"{2}\" {3}/>\n    </Sequence>\n  </BehaviorTree>\n</root>\n",
                           format == 4 ? " BTCPP_format=\"4\"" : "", id, text::xml_escape(tree),
                           format == 4 ? "goal=\"{goal}\"" : "__shared_blackboard=\"true\"",
                           format == 4 ? "<Script code=\"goal := '0;map;14.6;8.8;0;0;0;0;1'\"/>"
                                       : "<SetBlackboard output_key=\"goal\" value=\"0;map;14.6;8.8;0;0;0;0;1\"/>")});
    copied_.insert(file.substr(6));
    find(
        Fate::kReview, SourceSpan{file}, "goal",
        fmt::format("{}: here it is written by the mission, the kitchen of the simulated house to begin with", kWhose));
    return id;
  }

  // Models of the leaves that the mission's own files do not describe.
  std::string write_palette() {
    std::set<std::string, std::less<>> described;
    for (const ProjectFile& file : result_.files) {
      if (!file.path.starts_with("trees/")) continue;
      const auto models = bt::read_models(file.content);
      for (const bt::NodeModel& model : models ? *models : std::vector<bt::NodeModel>()) described.insert(model.id);
    }
    std::vector<bt::NodeModel> models;
    for (const auto& [id, skill] : skills_) {
      if (described.contains(id)) continue;
      if (const bt::NodeModel* known = own_.find(id)) {
        models.push_back(*known);
        continue;
      }
      bt::NodeModel& model = models.emplace_back();
      model.id = id;
      model.category = skill.is_condition ? bt::Category::kCondition : bt::Category::kAction;
      for (const auto& [name, port] : skill.ports) {
        if (!is_data_id(name)) continue;
        model.ports.push_back(!port.output ? bt::input(name) : port.input ? bt::inout(name) : bt::output(name));
      }
    }
    if (models.empty()) return {};
    std::string file = made_file("nodes");
    result_.files.push_back({file, "<root>\n" + bt::write_models(models) + "</root>\n"});
    return file;
  }

  void write_project_file(const std::string& main, const std::string& tree) {
    std::string files;
    for (const std::string& file : copied_) files += (files.empty() ? "" : ", ") + yaml_text("trees/" + file);
    std::string palettes = write_palette();
    if (has_nav2_) palettes += (palettes.empty() ? "" : ", ") + std::string(nav2::kPalette);
    std::string yaml = "# Imported; IMPORT.md says from what, and what is left to do.\n";
    const std::string begin = tree.empty() ? "" : ", tree: " + yaml_text(tree);
    yaml += copied_.size() > 1 ? fmt::format("mission: {{files: [{}]{}}}\n", files, begin)
                               : fmt::format("mission: {{file: {}{}}}\n", yaml_text("trees/" + main), begin);
    if (!palettes.empty()) yaml += fmt::format("palettes: [{}]\n", palettes);
    if (!skill_lines_.empty()) yaml += "skills:\n" + skill_lines_;
    if (drives_) {
      add_house();
      yaml +=
          "world: world/world.yaml\n"
          "services:\n"
          "  navigation:   {interface: robot.thrift/Navigation,   at: sim}\n"
          "  localization: {interface: robot.thrift/Localization, at: sim}\n"
          "  battery:      {interface: robot.thrift/Battery,      at: sim}\n";
    }
    result_.files.push_back({"sentree.yaml", yaml});
  }

  // A place to drive in, until there is the reader's own.
  void add_house() {
    const fs::path from = project::shipped_folder("examples") / "recharge" / "world";
    for (const char* name : {"house.pgm", "house.yaml"}) {
      if (const auto content = text::read_file(from / name))
        result_.files.push_back({fmt::format("world/{}", name), *content});
    }
    result_.files.push_back({"world/world.yaml",
                             "map: house.yaml\nstart: start\nlocations:\n  start:   [1.2, 1.2, 45 deg]\n"
                             "  kitchen: [14.6, 8.8, 0 deg]\n"
                             "# The tree recovers, so the robot's own navigation does not.\n"
                             "navigation: {recoveries: 0, patience: 3 s}\n"});
  }

  fs::path folder_;
  bt::Registry registry_;
  bt::Library library_;
  Diagnostics unread_;
  std::vector<fs::path> packages_;
  bt::Palette own_;  // what the mission's files say, without Nav2's
  Imported result_;
  std::set<std::string> copied_;
  std::map<std::string, Skill> skills_;
  std::set<std::string> skill_files_;
  std::string skill_lines_;
  std::set<std::string, std::less<>> explicit_;
  bt::Palette nav2_;
  std::set<std::string> own_nodes_;  // called like one of Nav2's
  std::set<std::string> unknown_;
  std::map<std::string, SourceSpan> missing_;
  std::set<std::pair<std::string, std::string>> guessed_;
  std::optional<bt::EntryUses> uses_;
  bool has_nav2_ = false;
  bool drives_ = false;  // a leaf of Nav2's does, which needs a robot
  bool needs_goal_ = false;
};

}  // namespace

bool is_tree_file(const fs::path& file) {
  const auto source = text::read_file(file, file.string(), kFileBytesMax);
  if (!source) return false;
  const auto document = text::XmlDocument::parse(*source, {}, {.lenient = true});
  return document && document->root().local_name() == "root";
}

Loaded<Imported> import_tree(const fs::path& file) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  TreeSystem system(folder);
  system.offer(file.filename().string());
  std::vector<std::string> beside;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const bool is_other = entry.path().extension() == ".xml" && entry.path().filename() != file.filename();
    if (is_other && entry.is_regular_file(error) && !entry.is_symlink(error) && beside.size() < kFilesMax)
      beside.push_back(entry.path().filename().string());
  }
  std::sort(beside.begin(), beside.end());
  for (const std::string& other : beside) system.offer(other);
  return system.run(file.filename().string());
}

Loaded<Imported> import_trees(const SourceFolder& folder, const std::string& main) {
  const fs::path base = folder.shown("");
  TreeSystem system(base);
  const auto failed = [&](std::string code, std::string message) {
    Diagnostics all{{Severity::kError, std::move(code), std::move(message), SourceSpan{folder.shown("")}}};
    all.insert(all.end(), system.unread().begin(), system.unread().end());
    return Loaded<Imported>{.value = std::nullopt, .diagnostics = std::move(all)};
  };
  for (const std::string& file : folder.with_ending({".xml"})) system.offer(file);
  if (!main.empty()) return system.run(main);
  const std::vector<std::string> roots = system.library().roots();
  std::vector<std::string> mains;
  for (const bt::TreeFile& file : system.library().files()) {
    const bool begins = std::any_of(file.trees.begin(), file.trees.end(), [&](const std::string& id) {
      return (id.empty() && file.trees.size() == 1) || std::find(roots.begin(), roots.end(), id) != roots.end();
    });
    if (begins) mains.push_back(file.path.lexically_relative(base).generic_string());
  }
  if (mains.size() == 1) return system.run(mains.front());
  if (mains.empty())
    return failed("import.no-tree", "none of its trees is one that no other uses: give one with --main");
  std::string list;
  for (std::size_t i = 0; i < mains.size() && i < 10; ++i) list += (i == 0 ? "" : ", ") + mains[i];
  return failed("import.ambiguous", fmt::format("the folder holds {} missions; choose one with --main: {}{}",
                                                mains.size(), list, mains.size() > 10 ? ", …" : ""));
}

}  // namespace sentree::import
