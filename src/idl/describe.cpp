#include "sentree/idl/describe.h"

#include <map>
#include <set>
#include <vector>

#include <fmt/format.h>

namespace sentree::idl {
namespace {

class Describer {
 public:
  Value describe(const Service& service) {
    List methods;
    for (const Method* method : service.methods) {
      Map entry{{"name", method->name},
                {"args", fields(method->arguments.fields)},
                {"result", name(*method->result)},
                {"oneway", method->oneway}};
      if (!method->unit.empty()) entry["unit"] = method->unit;
      methods.emplace_back(std::move(entry));
    }
    // Each type may name further ones; the list grows until all are described.
    Map types;
    for (std::size_t i = 0; i < named_.size(); ++i) {
      const auto [key, type] = named_[i];
      types[key] = description(*type);
    }
    return Map{{"methods", std::move(methods)}, {"types", std::move(types)}};
  }

 private:
  // Two files may each have a type of the same name: what is named is told apart by its declaration.
  std::string name(const Type& type) {
    const void* declared = &type;
    switch (type.kind) {
      case Kind::kEnum: declared = type.enumeration; break;
      case Kind::kStruct: declared = type.structure; break;
      case Kind::kList:
      case Kind::kSet:
      case Kind::kMap: break;
      default: return type.name;
    }
    const auto found = keys_.find(declared);
    if (found != keys_.end()) return found->second;
    std::string key = type.name;
    for (int n = 2; !taken_.insert(key).second; ++n) key = fmt::format("{} ({})", type.name, n);
    keys_[declared] = key;
    named_.emplace_back(key, &type);
    return key;
  }

  Value fields(const std::vector<Field>& all) {
    List out;
    for (const Field& field : all) {
      Map entry{{"name", field.name},
                {"type", name(*field.type)},
                {"required", field.requiredness != Requiredness::kOptional && !field.default_value}};
      if (field.default_value) entry["default"] = *field.default_value;
      if (!field.unit.empty()) entry["unit"] = field.unit;
      out.emplace_back(std::move(entry));
    }
    return out;
  }

  Value description(const Type& type) {
    switch (type.kind) {
      case Kind::kEnum: {
        List values;
        for (const Enumerator& enumerator : type.enumeration->enumerators) values.emplace_back(enumerator.name);
        return Map{{"kind", "enum"}, {"values", std::move(values)}};
      }
      case Kind::kStruct: {
        const StructKind kind = type.structure->kind;
        return Map{{"kind", kind == StructKind::kUnion       ? "union"
                            : kind == StructKind::kException ? "exception"
                                                             : "struct"},
                   {"fields", fields(type.structure->fields)}};
      }
      case Kind::kMap: return Map{{"kind", "map"}, {"key", name(*type.key)}, {"element", name(*type.element)}};
      default: return Map{{"kind", type.kind == Kind::kSet ? "set" : "list"}, {"element", name(*type.element)}};
    }
  }

  std::map<const void*, std::string> keys_;
  std::set<std::string> taken_;
  std::vector<std::pair<std::string, const Type*>> named_;
};

}  // namespace

Value describe(const Service& service) { return Describer().describe(service); }

}  // namespace sentree::idl
