#include "sentree/project/requirements.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "sentree/bt/model.h"
#include "sentree/idl/schema.h"
#include "sentree/project/model_choices.h"
#include "sentree/scxml/model.h"
#include "sentree/scxml/script_syntax.h"
#include "sentree/sim/world.h"
#include "sentree/text/file.h"

namespace sentree::project {

namespace {

using monitor::DataType;

// Structs inside structs that a requirement can name members of.
constexpr int kMembersNestingMax = 8;

// The types of interfaces. A struct has the same members wherever it stands as deep, and they are made once.
class DataTypes {
 public:
  DataType of(const idl::Type& type, const std::string& unit, bool may_be_absent, int depth = 0) {
    DataType result{.name = type.name, .unit = unit, .may_be_absent = may_be_absent};
    switch (type.kind) {
      case idl::Kind::kBool: result.kind = DataType::Kind::kTruth; break;
      case idl::Kind::kI8:
      case idl::Kind::kI16:
      case idl::Kind::kI32:
      case idl::Kind::kDouble: result.kind = DataType::Kind::kNumber; break;
      case idl::Kind::kI64:
        result.kind = DataType::Kind::kNumber;
        result.is_wide = true;
        break;
      case idl::Kind::kString: result.kind = DataType::Kind::kText; break;
      case idl::Kind::kEnum:
        result.kind = DataType::Kind::kText;
        for (const idl::Enumerator& one : type.enumeration->enumerators) result.words.push_back(one.name);
        break;
      case idl::Kind::kStruct: return record(*type.structure, may_be_absent, depth);
      case idl::Kind::kList:
      case idl::Kind::kSet:
      case idl::Kind::kMap:
        result.kind = DataType::Kind::kOther;
        // A map of other keys is a list of pairs.
        if ((type.key == nullptr || type.key->kind == idl::Kind::kString) && depth < kMembersNestingMax)
          result.items.push_back({"", of(*type.element, "", true, depth + 1)});
        break;
      default: result.kind = DataType::Kind::kOther; break;
    }
    return result;
  }

  DataType record(const idl::Struct& structure, bool may_be_absent, int depth = 0) {
    if (depth >= kMembersNestingMax) return {.kind = DataType::Kind::kOther, .name = structure.name};
    const std::pair key(&structure, depth);
    auto made = made_.find(key);
    if (made == made_.end()) {
      monitor::DataMembers members;
      for (const idl::Field& field : structure.fields) {
        const bool absent =
            field.requiredness == idl::Requiredness::kOptional || structure.kind == idl::StructKind::kUnion;
        members.push_back({field.name, of(*field.type, field.unit, absent, depth + 1)});
      }
      made = made_.emplace(key, std::move(members)).first;
    }
    return {.kind = DataType::Kind::kRecord,
            .name = structure.name,
            .may_be_absent = may_be_absent,
            .members = made->second};
  }

 private:
  std::map<std::pair<const idl::Struct*, int>, monitor::DataMembers> made_;
};

// Every call of every skill, if that can be told from the charts.
std::optional<std::vector<monitor::Vocabulary::Call>> calls_of(const std::vector<LeafPlan>& leaves) {
  std::vector<monitor::Vocabulary::Call> calls;
  for (const LeafPlan& leaf : leaves) {
    if (!leaf.chart || scxml::invokes_unknown(*leaf.chart)) return std::nullopt;
    for (const scxml::SendInfo& send : scxml::sends_with_invoked(*leaf.chart)) {
      if (send.type && *send.type != "thrift") continue;
      if (!send.type || !send.target || !send.event) return std::nullopt;
      calls.push_back({leaf.name, *send.target, *send.event});
    }
  }
  return calls;
}

// What a method throws, by the names of the types.
DataType exceptions_of(const idl::Method& method, DataTypes& types) {
  DataType exceptions{.kind = DataType::Kind::kRecord, .name = "an exception of " + method.name};
  for (const idl::Field& field : method.exceptions)
    exceptions.members.push_back({field.type->structure->name, types.record(*field.type->structure, true)});
  return exceptions;
}

// Gives texts in a type, those of its members too, examples of what they are. A record stands for all that share its
// members, and is made once.
class Sampled {
 public:
  explicit Sampled(const std::set<std::string>& texts) : texts_(texts) {}

  DataType operator()(DataType type) {
    if (type.kind == DataType::Kind::kText && type.words.empty()) {
      std::set<std::string> all = texts_;
      all.insert(type.samples.begin(), type.samples.end());
      type.samples.assign(all.begin(), all.end());
    }
    if (type.kind != DataType::Kind::kRecord || type.members.empty()) return type;
    const auto [made, is_new] = made_.try_emplace(type.members.begin());
    if (is_new) {
      monitor::DataMembers members;
      for (const monitor::DataMember& member : type.members) members.push_back({member.name, (*this)(member.type)});
      made->second = {type.members, std::move(members)};
    }
    type.members = made->second.second;
    return type;
  }

 private:
  const std::set<std::string>& texts_;
  // By the place of the members before, which are kept there.
  std::map<const monitor::DataMember*, std::pair<monitor::DataMembers, monitor::DataMembers>> made_;
};

// Enumerators of all that calls can hold.
std::set<std::string> enumerators_of(const monitor::Vocabulary& vocabulary) {
  std::set<std::string> words;
  std::set<const monitor::DataMember*> met;  // records by their members, which are made once
  const auto add = [&](const auto& self, const DataType& type) -> void {
    words.insert(type.words.begin(), type.words.end());
    if (type.members.empty() || !met.insert(type.members.begin()).second) return;
    for (const monitor::DataMember& member : type.members) self(self, member.type);
  };
  for (const auto& [service, methods] : vocabulary.services) {
    for (const auto& [method, types] : methods) {
      add(add, types.arguments);
      add(add, types.result);
    }
  }
  return words;
}

// What may come from elsewhere than the skills: replies, exceptions, what others publish and call.
void add_texts_of_others(const std::set<std::string>& texts, monitor::Vocabulary& vocabulary) {
  if (texts.empty()) return;
  Sampled sampled(texts);
  for (auto& [service, methods] : vocabulary.services) {
    for (auto& [method, types] : methods) {
      types.result = sampled(std::move(types.result));
      types.exceptions = sampled(std::move(types.exceptions));
      if (types.oneway || types.overheard) types.arguments = sampled(std::move(types.arguments));
    }
  }
}

// What the ports of a leaf are called: those of the tree, and what its chart gives back.
monitor::Vocabulary::Ports ports_of(const bt::Tree& tree, const LeafPlan& leaf, const std::set<std::string>& words,
                                    ChartMemory& charts) {
  monitor::Vocabulary::Ports ports;
  ports.inputs = {.kind = DataType::Kind::kRecord, .name = "the input of " + leaf.name, .may_be_absent = false};
  for (const bt::PortFact& port : tree.ports(leaf.node)) {
    if (port.input) ports.inputs.members.push_back({std::string(port.name), {}});
  }
  if (!leaf.chart || leaf.protocol) return ports;
  std::set<std::string> given{"reason"};
  const scxml::Chart& chart = *leaf.chart;
  for (std::size_t s = 0; s < chart.states().size(); ++s) {
    if (chart.states()[s].parent != 0) continue;
    const auto& donedata = chart.model().state_code[s].donedata;
    if (donedata && donedata->has_content) return ports;
    given.insert(chart.states()[s].donedata.begin(), chart.states()[s].donedata.end());
  }
  ports.outputs = {.kind = DataType::Kind::kRecord, .name = "the output of " + leaf.name};
  // They can be texts of the chart, and enumerators that it passes on.
  std::set<std::string> texts = words;
  const std::set<std::string>& own = charts.words(chart).texts;
  texts.insert(own.begin(), own.end());
  const std::vector<std::string> samples(texts.begin(), texts.end());
  for (const std::string& name : given) ports.outputs.members.push_back({name, {.samples = samples}});
  return ports;
}

// Names that the world's file gives to things.
std::set<std::string> names_of_world(const sim::World* world) {
  std::set<std::string> names;
  if (world == nullptr) return names;
  names.insert(world->map_id);
  for (const auto& robot : world->robots) names.insert(robot.name);
  for (const auto& station : world->stations) names.insert(station.name);
  for (const auto& location : world->locations) names.insert(location.name);
  for (const auto& area : world->areas) names.insert(area.name);
  for (const auto& obstacle : world->obstacles) names.insert(obstacle.id);
  for (const auto& door : world->doors) names.insert(door.id);
  return names;
}

// The texts that skills give for arguments, where their charts tell them.
class GivenTexts {
 public:
  GivenTexts(const bt::Tree& tree, const std::vector<LeafPlan>& leaves, ChartMemory& charts) : charts_(charts) {
    std::set<bt::NodeId> seen;
    for (const LeafPlan& leaf : leaves) {
      for (const bt::PortFact& port : tree.ports(leaf.node)) {
        if (port.input && !port.text.empty() && port.text.front() != '{') all_.emplace(port.text);
      }
      // What a SubTree above gives as a constant.
      for (bt::NodeId above = subtree_of(tree, leaf.node); above != bt::kNoNode && seen.insert(above).second;
           above = subtree_of(tree, above)) {
        for (const bt::PortFact& port : tree.ports(above)) {
          if (!port.text.empty() && port.text.front() != '{') all_.emplace(port.text);
        }
      }
      if (leaf.chart) add(tree, leaf);
    }
  }

  // Every text that some skill or some port gives for anything.
  [[nodiscard]] const std::set<std::string>& all() const { return all_; }
  // Whether every text of that argument is among them.
  [[nodiscard]] bool are_all(const std::string& argument) const { return !open_.contains(argument); }

 private:
  void add(const bt::Tree& tree, const LeafPlan& leaf) {
    for (const scxml::SendInfo& send : leaf.chart->sends()) {
      if (!send.target || !send.event) continue;
      const std::string call = fmt::format("{}.{}", *send.target, *send.event);
      for (const scxml::SendParam& param : send.params) {
        if (!add(tree, leaf, param)) open_.insert(fmt::format("{} {}", call, param.name));
      }
      if (send.has_content) open_.insert(call);
    }
  }

  static bt::NodeId subtree_of(const bt::Tree& tree, bt::NodeId node) {
    const bt::Model& model = tree.model();
    return model.trees[model.infos[node].tree].subtree;
  }

  // False: it can be anything.
  bool add(const bt::Tree& tree, const LeafPlan& leaf, const scxml::SendParam& param) {
    if (param.constant) {
      if (const std::string* text = param.constant->as_string()) all_.insert(*text);
      return true;
    }
    const auto& data = leaf.chart->data();
    const auto item =
        std::find_if(data.begin(), data.end(), [&](const scxml::DataItem& d) { return d.id == param.expression; });
    // An input that nobody but the tree, or sentree.yaml, gives a value.
    if (item == data.end() || charts_.facts(*leaf.chart).is_written(item->id)) return false;
    for (const SkillConstant& constant : leaf.constants) {
      if (constant.id != item->id) continue;
      if (const std::string* text = constant.value.as_string()) all_.insert(*text);
      return true;
    }
    if (item->has_value) return false;
    for (const bt::PortFact& port : tree.ports(leaf.node)) {
      if (port.name == item->id && !port.text.empty()) return port.text.front() != '{';
    }
    return false;
  }

  ChartMemory& charts_;
  std::set<std::string> all_;
  std::set<std::string> open_;
};

void add_samples(monitor::Vocabulary& vocabulary, const bt::Tree& tree, const std::vector<LeafPlan>& leaves,
                 const sim::World* world, ChartMemory& charts) {
  const GivenTexts given(tree, leaves, charts);
  std::set<std::string> names = names_of_world(world);
  names.insert(given.all().begin(), given.all().end());
  if (names.empty()) return;
  const std::vector<std::string> samples(names.begin(), names.end());
  for (auto& [service, methods] : vocabulary.services) {
    for (auto& [method, types] : methods) {
      if (types.oneway || types.overheard) continue;  // others publish and call
      const std::string call = fmt::format("{}.{}", service, method);
      monitor::DataMembers arguments;
      for (monitor::DataMember argument : types.arguments.members) {
        if (argument.type.kind == DataType::Kind::kText && argument.type.words.empty()) {
          argument.type.samples = samples;
          argument.type.samples_are_all =
              vocabulary.calls && given.are_all(call) && given.are_all(fmt::format("{} {}", call, argument.name));
        }
        arguments.push_back(std::move(argument));
      }
      types.arguments.members = std::move(arguments);
    }
  }
  add_texts_of_others(names, vocabulary);
}

}  // namespace

std::vector<MonitorEntry> expand_requirements(const Project& project, MonitorEntry entry) {
  const std::filesystem::path file(entry.file.path);
  if (file.extension() != ".req") return {std::move(entry)};
  const auto source = text::read_file(project.folder / file, {}, monitor::kRequirementBytesMax);
  if (!source) return {std::move(entry)};
  const auto parsed = monitor::parse_requirements(*source);
  if (!parsed.ok() || parsed.value->requirements.empty()) return {std::move(entry)};
  const bool is_named = entry.name != file.stem().string();
  std::vector<MonitorEntry> expanded;
  for (const monitor::Requirement& requirement : parsed.value->requirements) {
    expanded.push_back(entry);
    expanded.back().requirement = requirement.name;
    if (!is_named || parsed.value->requirements.size() > 1) expanded.back().name = requirement.name;
  }
  return expanded;
}

bool is_unread_requirements(const MonitorEntry& entry) {
  return entry.requirement.empty() && std::filesystem::path(entry.file.path).extension() == ".req";
}

monitor::Vocabulary vocabulary_of(const std::map<std::string, ServicePlan>& services, const bt::Tree* tree,
                                  const std::vector<LeafPlan>& leaves, const sim::World* world, ChartMemory& charts) {
  monitor::Vocabulary vocabulary;
  DataTypes types;
  for (const auto& [name, service] : services) {
    auto& methods = vocabulary.services[name];
    for (const idl::Method* method : service.service->methods) {
      DataType arguments = types.record(method->arguments, false);
      arguments.name = fmt::format("{}.{}", name, method->name);
      methods[method->name] = {std::move(arguments), types.of(*method->result, method->unit, false), method->oneway,
                               !service.observed.empty(), exceptions_of(*method, types)};
    }
  }
  if (tree == nullptr) return vocabulary;
  for (bt::NodeId node = 0; node < tree->size(); ++node) vocabulary.nodes.push_back(tree->path(node));
  const std::set<std::string> words = enumerators_of(vocabulary);
  for (const LeafPlan& leaf : leaves) {
    vocabulary.leaves.push_back(leaf.name);
    vocabulary.ports.emplace(leaf.name, ports_of(*tree, leaf, words, charts));
  }
  if (leaves.size() == tree->external_leaves().size()) vocabulary.calls = calls_of(leaves);
  add_samples(vocabulary, *tree, leaves, world, charts);
  return vocabulary;
}

monitor::Vocabulary vocabulary_of(const Plan& plan) {
  ChartMemory charts;
  monitor::Vocabulary vocabulary = vocabulary_of(plan.services, &plan.tree, plan.leaves, plan.world.get(), charts);
  std::vector<std::string> names;
  std::vector<std::pair<std::string, scxml::Chart>> models;
  for (const ModelPlan& model : plan.models) {
    names.push_back(model.name);
    models.emplace_back(model.name, model.chart);
  }
  add_models(names, models, charts, vocabulary);
  return vocabulary;
}

void add_models(const std::vector<std::string>& names, const std::vector<std::pair<std::string, scxml::Chart>>& charts,
                ChartMemory& memory, monitor::Vocabulary& vocabulary) {
  vocabulary.models.insert(vocabulary.models.end(), names.begin(), names.end());
  std::set<std::string> texts;
  for (const auto& [name, chart] : charts) {
    const ChartMemory::Words& words = memory.words(chart);
    texts.insert(words.texts.begin(), words.texts.end());
    const KnownChoices& known = words.choices;
    std::set<std::string> values;
    for (const Value& value : known.all.values) {
      if (const std::string* text = value.as_string())
        values.insert(*text);
      else if (value.as_bool() != nullptr)
        values.insert({"true", "false"});
    }
    vocabulary.choices[name] = {.name = {.kind = DataType::Kind::kText,
                                         .name = "name of a choice",
                                         .samples = known.names(),
                                         .samples_are_all = !known.open},
                                .value = {.samples = {values.begin(), values.end()}}};
  }
  add_texts_of_others(texts, vocabulary);
}

}  // namespace sentree::project
