#include "sentree/project/requirements.h"

#include <algorithm>

#include "sentree/idl/schema.h"
#include "sentree/text/file.h"

namespace sentree::project {

namespace {

using monitor::DataType;

// Structs inside structs that a requirement can name members of.
constexpr int kMembersNestingMax = 8;

DataType type_of(const idl::Type& type, const std::string& unit, bool may_be_absent, int depth);

DataType record_of(const idl::Struct& structure, bool may_be_absent, int depth) {
  DataType result{.kind = DataType::Kind::kRecord, .name = structure.name, .may_be_absent = may_be_absent};
  if (depth >= kMembersNestingMax) return {.kind = DataType::Kind::kOther, .name = structure.name};
  for (const idl::Field& field : structure.fields) {
    const bool absent = field.requiredness == idl::Requiredness::kOptional || structure.kind == idl::StructKind::kUnion;
    result.members.push_back({field.name, type_of(*field.type, field.unit, absent, depth + 1)});
  }
  return result;
}

DataType type_of(const idl::Type& type, const std::string& unit, bool may_be_absent, int depth) {
  DataType result{.name = type.name, .unit = unit, .may_be_absent = may_be_absent};
  switch (type.kind) {
    case idl::Kind::kBool: result.kind = DataType::Kind::kTruth; break;
    case idl::Kind::kI8:
    case idl::Kind::kI16:
    case idl::Kind::kI32:
    case idl::Kind::kI64:
    case idl::Kind::kDouble: result.kind = DataType::Kind::kNumber; break;
    case idl::Kind::kString: result.kind = DataType::Kind::kText; break;
    case idl::Kind::kEnum:
      result.kind = DataType::Kind::kText;
      for (const idl::Enumerator& one : type.enumeration->enumerators) result.words.push_back(one.name);
      break;
    case idl::Kind::kStruct: return record_of(*type.structure, may_be_absent, depth);
    default: result.kind = DataType::Kind::kOther; break;
  }
  return result;
}

// Every call of every skill, if that can be told from the charts.
std::optional<std::vector<monitor::Vocabulary::Call>> calls_of(const std::vector<LeafPlan>& leaves) {
  std::vector<monitor::Vocabulary::Call> calls;
  for (const LeafPlan& leaf : leaves) {
    if (!leaf.chart) return std::nullopt;
    for (const scxml::SendInfo& send : leaf.chart->sends()) {
      if (send.type && *send.type != "thrift") continue;
      if (!send.type || !send.target || !send.event) return std::nullopt;
      calls.push_back({leaf.name, *send.target, *send.event});
    }
  }
  return calls;
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

monitor::Vocabulary vocabulary_of(const std::map<std::string, ServicePlan>& services, const bt::Tree* tree,
                                  const std::vector<LeafPlan>& leaves) {
  monitor::Vocabulary vocabulary;
  for (const auto& [name, service] : services) {
    auto& methods = vocabulary.services[name];
    for (const idl::Method* method : service.service->methods) {
      DataType arguments = record_of(method->arguments, false, 0);
      arguments.name = name + "." + method->name;
      methods[method->name] = {std::move(arguments), type_of(*method->result, method->unit, false, 0)};
    }
  }
  if (tree == nullptr) return vocabulary;
  for (bt::NodeId node = 0; node < tree->size(); ++node) vocabulary.nodes.push_back(tree->path(node));
  for (const LeafPlan& leaf : leaves) vocabulary.leaves.push_back(leaf.name);
  if (leaves.size() == tree->external_leaves().size()) vocabulary.calls = calls_of(leaves);
  return vocabulary;
}

}  // namespace sentree::project
