#include "sentree/project/detail/check_skills.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sentree/bt/model.h"
#include "sentree/bt/types.h"
#include "sentree/nav2/nav2.h"
#include "sentree/project/detail/check_monitor.h"

namespace sentree::project {

namespace {

void check_inputs(const bt::Tree& tree, const LeafPlan& leaf, bool has_plugins, ChartMemory& charts,
                  Diagnostics& diagnostics) {
  const ChartFacts facts = charts.facts(*leaf.chart);
  const auto ports = tree.ports(leaf.node);
  // A constant that the chart does not know has been told, and may be what is missing.
  const auto& data = leaf.chart->data();
  const bool is_told = std::any_of(leaf.constants.begin(), leaf.constants.end(), [&](const SkillConstant& constant) {
    return std::none_of(data.begin(), data.end(), [&](const auto& item) { return item.id == constant.id; });
  });
  for (const scxml::DataItem& item : leaf.chart->data()) {
    if (item.has_value || facts.is_written(item.id)) continue;
    const auto port =
        std::find_if(ports.begin(), ports.end(), [&](const bt::PortFact& p) { return p.name == item.id; });
    const bool is_output = port != ports.end() && !port->input;
    const bool is_given = port != ports.end() && !port->text.empty();
    const bool is_constant = std::any_of(leaf.constants.begin(), leaf.constants.end(),
                                         [&](const SkillConstant& constant) { return constant.id == item.id; });
    if (is_constant || is_told) continue;
    if (is_given || is_output || !facts.needs(item.id)) continue;
    add(diagnostics, Severity::kError, "check.missing-input",
        fmt::format(
            "input \"{}\" of {} has no value, and {}:{} needs one: write {}=\"…\" here, or give the <data> an expr",
            item.id, leaf.name, leaf.chart->file(), item.place.line, item.id),
        tree.span(leaf.node));
  }
  for (const bt::UnwrittenEntry& entry : tree.model().unwritten) {
    if (entry.node != leaf.node) continue;
    const auto item = std::find_if(data.begin(), data.end(), [&](const auto& d) { return d.id == entry.port; });
    const bool fails = item != data.end() && !item->has_value && !facts.is_written(item->id) && facts.needs(item->id);
    add(diagnostics, fails && !has_plugins ? Severity::kError : Severity::kWarning, "check.unwritten-entry",
        fmt::format("input \"{}\" of {} reads blackboard entry \"{}\", which nothing in the tree writes", entry.port,
                    leaf.name, entry.entry),
        tree.span(leaf.node));
  }
}

// What the node does without the entry that its port reads; empty: who knows, it is written in C++.
std::string_view without(const bt::Node& node, std::string_view port) {
  using bt::Kind;
  switch (node.kind) {
    case Kind::kSleep:
    case Kind::kDelay:
    case Kind::kTimeout:
    case Kind::kRepeat:
    case Kind::kRetry:
    case Kind::kParallel:
    case Kind::kParallelAll:
    case Kind::kSetBlackboard: return ", so its tick fails";
    case Kind::kLoop: return port == "queue" ? ", so there is no element, and its child never runs" : "";
    case Kind::kSwitch:
      return port == "variable" ? ", so its last child runs, whatever happens" : ", so this case never comes";
    default: return "";
  }
}

// Of nodes that are no skills: what nobody writes.
void check_read_entries(const bt::Tree& tree, const Project& project, Diagnostics& diagnostics) {
  if (!project.executed_by.empty()) return;  // who executes it may write what it likes
  // Nav2's own nodes do without.
  const auto is_of_nav2 = [](std::string_view id) {
    bt::Registry nav2;
    nav2::add_nodes(nav2);
    return nav2.find(id) != nullptr;
  };
  const bt::Model& model = tree.model();
  for (const bt::UnwrittenEntry& entry : model.unwritten) {
    if (tree.is_external(entry.node) || tree.is_unknown(entry.node)) continue;
    const bt::Node& node = model.nodes[entry.node];
    // What a node reads unless it is told otherwise need not be there.
    const bt::Binding* const ports = model.bindings.data() + node.ports;
    const bool is_default = std::any_of(ports, ports + node.port_count, [&](const bt::Binding& port) {
      return port.from_default && model.strings[port.name] == entry.port;
    });
    const bool is_cpp = node.kind == bt::Kind::kUser;
    if (is_default) continue;
    if (is_cpp && (project.plugins.empty() || is_of_nav2(tree.registration(entry.node)))) continue;
    const std::string_view then = without(node, entry.port);
    const bool fails = then.ends_with("fails") && project.plugins.empty();
    add(diagnostics, fails ? Severity::kError : Severity::kWarning, "check.unwritten-entry",
        fmt::format("port \"{}\" of {} reads blackboard entry \"{}\", which nothing in the tree writes{}", entry.port,
                    tree.name(entry.node), entry.entry, then),
        tree.span(entry.node));
  }
}

// The enumeration of that name in the types of all services; null: there is none.
class Enumerations {
 public:
  explicit Enumerations(const std::map<std::string, ServicePlan>& services) : services_(services) {}

  const idl::Enum* find(std::string_view name) {
    if (!is_read_) {
      is_read_ = true;
      for (const auto& [service, plan] : services_) {
        for (const idl::Method* method : plan.service->methods) {
          add(method->arguments);
          add(*method->result);
        }
      }
    }
    const auto found = all_.find(name.substr(name.rfind(':') + 1));
    return found == all_.end() ? nullptr : found->second;
  }

 private:
  void add(const idl::Struct& structure) {
    if (!seen_.insert(&structure).second) return;
    for (const idl::Field& field : structure.fields) add(*field.type);
  }
  void add(const idl::Type& type) {
    if (type.enumeration != nullptr) all_.emplace(type.enumeration->name, type.enumeration);
    if (type.structure != nullptr) add(*type.structure);
    if (type.element != nullptr) add(*type.element);
  }

  const std::map<std::string, ServicePlan>& services_;
  bool is_read_ = false;
  std::map<std::string, const idl::Enum*, std::less<>> all_;
  std::set<const idl::Struct*> seen_;
};

// The enumeration that a chart sends a port as, if it is one.
const idl::Enum* sent_as(const std::string& port, const scxml::Chart& chart,
                         const std::map<std::string, ServicePlan>& services) {
  std::set<const idl::Enum*> words;
  for (const scxml::SendInfo& send : chart.sends()) {
    if (send.type != "thrift" || !send.target || !send.event) continue;
    for (const scxml::SendParam& param : send.params) {
      if (param.expression != port) continue;
      const auto service = services.find(*send.target);
      const idl::Method* const method =
          service == services.end() ? nullptr : service->second.service->find(*send.event);
      const idl::Field* const field = method == nullptr ? nullptr : method->arguments.find(param.name);
      words.insert(field != nullptr && field->type->kind == idl::Kind::kEnum ? field->type->enumeration : nullptr);
    }
  }
  return words.size() == 1 ? *words.begin() : nullptr;
}

// What is written down for a port that is to be one of the words of an interface.
void check_words(const bt::Tree& tree, const LeafPlan& leaf, const std::map<std::string, ServicePlan>& services,
                 Enumerations& enumerations, ChartMemory& charts, Diagnostics& diagnostics) {
  for (const bt::PortFact& port : tree.ports(leaf.node)) {
    const std::string text(port.text);
    const bool is_number = text.find_first_not_of("-0123456789") == std::string::npos;
    if (!port.input || is_number || text.find('{') != std::string::npos) continue;
    const std::string name(port.name);
    const bool is_of_interface = !port.type.empty() && bt::type_named(port.type) == nullptr;
    const idl::Enum* words = is_of_interface ? enumerations.find(port.type) : nullptr;
    if (words == nullptr && !charts.facts(*leaf.chart).is_written(name)) words = sent_as(name, *leaf.chart, services);
    if (words == nullptr || words->find(text) != nullptr) continue;
    if (text.starts_with(words->name + ".") && words->find(text.substr(words->name.size() + 1)) != nullptr) continue;
    std::vector<std::string> known;
    for (const idl::Enumerator& one : words->enumerators) known.push_back(one.name);
    const std::string near = did_you_mean(text, known);
    constexpr std::size_t kShownMax = 8;
    const std::string all = known.size() <= kShownMax ? fmt::format("; there are {}", fmt::join(known, ", ")) : "";
    add(diagnostics, near.empty() ? Severity::kWarning : Severity::kError, "check.unknown-word",
        fmt::format("port \"{}\" of {}: \"{}\" is no {}{}", name, leaf.name, text, words->name,
                    near.empty() ? all : near),
        tree.span(leaf.node));
  }
}

void check_entries(const bt::Tree& tree, const Project& project, Diagnostics& diagnostics) {
  std::vector<std::string> known;
  const auto is_known = [&](const std::string& leaf) {
    return std::find(known.begin(), known.end(), leaf) != known.end();
  };
  for (const bt::NodeId node : tree.external_leaves()) {
    known.emplace_back(tree.name(node));
    known.emplace_back(tree.registration(node));
  }
  for (const SkillEntry& entry : project.skills) {
    if (is_known(entry.leaf)) continue;
    const auto leaves = tree.external_leaves();
    const auto in_messages = std::find_if(leaves.begin(), leaves.end(),
                                          [&](bt::NodeId node) { return tree.event_name(node) == entry.leaf; });
    if (in_messages != leaves.end()) {
      add(diagnostics, Severity::kError, "check.unused-skill",
          fmt::format("\"{}\" is a leaf's name in messages; skills go by the leaf's own name or ID: write \"{}\"",
                      entry.leaf, tree.registration(*in_messages)),
          entry.span);
      continue;
    }
    // Misspelt is only what nobody else is called.
    std::vector<std::string> free;
    for (const std::string& leaf : known) {
      if (project.skill(leaf, leaf) == nullptr) free.push_back(leaf);
    }
    const std::string near = did_you_mean(entry.leaf, free);
    add(diagnostics, near.empty() ? Severity::kWarning : Severity::kError, "check.unused-skill",
        fmt::format("the mission has no leaf \"{}\"{}", entry.leaf, near), entry.span);
  }
}

}  // namespace

void check_skills(const bt::Tree& tree, const std::vector<LeafPlan>& leaves,
                  const std::map<std::string, ServicePlan>& services, const monitor::Vocabulary& vocabulary,
                  const Project& project, ChartMemory& charts, Diagnostics& diagnostics) {
  check_entries(tree, project, diagnostics);
  check_read_entries(tree, project, diagnostics);
  // Of services that could not be read it has been said.
  const bool are_services_known = services.size() == project.services.size();
  Enumerations enumerations(services);
  std::set<std::string> checked;
  // Findings of skills depend on what is called alone.
  monitor::Vocabulary called;
  called.services = vocabulary.services;
  const auto context = charts.context(called, services);
  for (const LeafPlan& leaf : leaves) {
    if (!leaf.chart) continue;
    check_inputs(tree, leaf, !project.plugins.empty(), charts, diagnostics);
    check_words(tree, leaf, services, enumerations, charts, diagnostics);
    if (!are_services_known || !checked.insert(leaf.chart->file()).second) continue;
    SkillUse use;
    std::set<std::string> others;  // values that may be something else than text
    for (const LeafPlan& other : leaves) {
      if (!other.chart || !(*other.chart == *leaf.chart)) continue;
      for (const bt::PortFact& port : tree.ports(other.node)) {
        use.given.emplace(port.name);
        const bool is_text = port.type.empty() && !port.text.empty() && !port.text.starts_with('{');
        (is_text ? use.texts : others).emplace(port.name);
      }
      for (const SkillConstant& constant : other.constants) {
        use.given.insert(constant.id);
        others.insert(constant.id);
      }
      use.topics.insert(other.subscribes.begin(), other.subscribes.end());
      if (other.protocol) {
        use.protocols.push_back(*other.protocol);
      } else {
        use.is_condition = use.is_condition || other.condition;
        use.is_native = true;
      }
    }
    for (const std::string& name : others) use.texts.erase(name);
    charts.add_findings(
        *leaf.chart, use, context,
        [&](Diagnostics& found) { check_skill_events(charts.facts(*leaf.chart), services, vocabulary, use, found); },
        diagnostics);
  }
}

}  // namespace sentree::project
