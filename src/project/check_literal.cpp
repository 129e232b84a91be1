#include "sentree/project/detail/check_literal.h"

#include <cstdint>
#include <utility>

#include "sentree/idl/conform.h"

namespace sentree::project {

namespace {

using scxml::ScriptNode;
using scxml::ScriptTree;
using Node = ScriptNode::Kind;

/// Structs in structs of something that is only computed.
constexpr int kDepthMax = idl::kValueNestingMax;

// Some value that a type takes.
Value any_of(const idl::Type& type, int depth = 0) {
  switch (type.kind) {
    case idl::Kind::kVoid: return {};
    case idl::Kind::kBool: return Value(false);
    case idl::Kind::kI8:
    case idl::Kind::kI16:
    case idl::Kind::kI32:
    case idl::Kind::kI64: return Value(std::int64_t{0});
    case idl::Kind::kDouble: return Value(0.0);
    case idl::Kind::kString:
    case idl::Kind::kBinary: return Value(std::string());
    case idl::Kind::kEnum: {
      const auto& all = type.enumeration->enumerators;
      return all.empty() ? Value(std::int64_t{0}) : Value(all.front().name);
    }
    case idl::Kind::kList:
    case idl::Kind::kSet: return Value(List());
    case idl::Kind::kMap: return Value(Map());
    case idl::Kind::kStruct: {
      Map made;
      for (const idl::Field& field : type.structure->fields) {
        const bool is_union = type.structure->kind == idl::StructKind::kUnion;
        const bool is_needed = field.requiredness != idl::Requiredness::kOptional && !field.default_value;
        if ((is_union ? made.empty() : is_needed) && depth < kDepthMax)
          made.append(field.name, any_of(*field.type, depth + 1));
      }
      return Value(std::move(made));
    }
  }
  return {};
}

bool is_computed(const ScriptNode& node) {
  switch (node.kind) {
    case Node::kNumber:
    case Node::kText:
    case Node::kTruth:
    case Node::kNothing:
    case Node::kList:
    case Node::kRecord: return false;
    default: return true;
  }
}

// What is written, with something that fits wherever it is computed.
Value written(const ScriptTree& tree, std::uint32_t id, const idl::Type& type) {
  const ScriptNode& node = tree.at(id);
  switch (node.kind) {
    case Node::kNumber: return Value(node.number);
    case Node::kText: return Value(node.text);
    case Node::kTruth: return Value(node.number != 0);
    case Node::kNothing: return {};
    case Node::kUnary:
      if (node.text == "-" && tree.at(node.operands[0]).kind == Node::kNumber)
        return Value(-tree.at(node.operands[0]).number);
      return any_of(type);
    case Node::kList: {
      List items;
      static const idl::Type kAnything;
      for (const std::uint32_t item : node.operands)
        items.push_back(written(tree, item, type.element != nullptr ? *type.element : kAnything));
      return Value(std::move(items));
    }
    case Node::kRecord: {
      const idl::Struct* const structure = type.kind == idl::Kind::kStruct ? type.structure : nullptr;
      const bool is_union = structure != nullptr && structure->kind == idl::StructKind::kUnion;
      Map members;
      for (std::size_t i = 0; i < node.operands.size(); ++i) {
        const idl::Field* const field = structure != nullptr ? structure->find(node.names[i]) : nullptr;
        if (field == nullptr) {
          const bool is_map = type.kind == idl::Kind::kMap;
          members[node.names[i]] = is_map ? written(tree, node.operands[i], *type.element) : Value(true);
          continue;
        }
        // Of several that are computed all but one may be undefined.
        if (is_union && node.operands.size() > 1 && is_computed(tree.at(node.operands[i]))) continue;
        members[node.names[i]] = written(tree, node.operands[i], *field->type);
      }
      if (is_union && members.empty() && !node.operands.empty()) return any_of(type);
      return Value(std::move(members));
    }
    default: return any_of(type);
  }
}

}  // namespace

void check_literal(const idl::Type& type, const ScriptTree& tree, const std::string& what, const SourceSpan& span,
                   Diagnostics& diagnostics) {
  const ScriptNode& root = tree.at(tree.root());
  if (root.kind != Node::kRecord && root.kind != Node::kList) return;
  auto fits = idl::conform(type, written(tree, tree.root(), type), what);
  if (fits) return;
  fits.error().span = span;
  diagnostics.push_back(std::move(fits.error()));
}

}  // namespace sentree::project
