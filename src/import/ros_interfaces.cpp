#include "sentree/import/detail/ros_interfaces.h"

#include <algorithm>

#include <fmt/format.h>

namespace sentree::import {

namespace {

const std::map<std::string, std::string, std::less<>>& plain_types() {
  static const std::map<std::string, std::string, std::less<>> kTypes = {
      {"bool", "bool"},     {"boolean", "bool"},  {"byte", "i8"},        {"char", "i16"},       {"int8", "i8"},
      {"int16", "i16"},     {"int32", "i32"},     {"int64", "i64"},      {"uint8", "i16"},      {"uint16", "i32"},
      {"uint32", "i64"},    {"uint64", "i64"},    {"float32", "double"}, {"float64", "double"}, {"double", "double"},
      {"string", "string"}, {"wstring", "string"}};
  return kTypes;
}

/// "linear.x" under "linear".
struct Tree {
  std::string name;
  std::string type;
  std::vector<Tree> members;

  Tree& member(const std::string& wanted) {
    for (Tree& known : members) {
      if (known.name == wanted) return known;
    }
    members.emplace_back().name = wanted;
    return members.back();
  }
};

Tree tree_of(const Fields& fields) {
  Tree root;
  for (const std::string& name : fields.names()) {
    Tree* at = &root;
    for (std::size_t begin = 0; begin <= name.size();) {
      const std::size_t dot = std::min(name.find('.', begin), name.size());
      at = &at->member(name.substr(begin, dot - begin));
      begin = dot + 1;
    }
    at->type = fields.type(name);
  }
  return root;
}

// The members as fields of Thrift; structs that they need are written to `structs` first.
std::string fields_text(const Tree& tree, const std::string& prefix, const std::string& separator,
                        std::string& structs) {
  std::string text;
  int number = 0;
  for (const Tree& member : tree.members) {
    std::string type = member.type;
    if (!member.members.empty()) {
      type = fmt::format("{}_{}", prefix, member.name);
      const std::string inside = fields_text(member, type, "\n", structs);
      structs += fmt::format("struct {} {{\n{}\n}}\n\n", type, inside);
    }
    text += (text.empty() ? "" : separator == "\n" ? "\n" : ", ");
    text += fmt::format("{}{}: {} {}", separator == "\n" ? "  " : "", ++number, type, member.name);
  }
  return text;
}

}  // namespace

std::optional<std::string> thrift_type(std::string_view ros_type) {
  if (const std::size_t bracket = ros_type.find('['); bracket != std::string_view::npos) {
    auto element = thrift_type(ros_type.substr(0, bracket));
    for (std::size_t at = bracket; element && at < ros_type.size(); ++at) {
      if (ros_type[at] == '[') *element = fmt::format("list<{}>", *element);
    }
    return element;
  }
  const auto type = plain_types().find(ros_type);
  return type == plain_types().end() ? std::nullopt : std::optional(type->second);
}

void Fields::use(const std::string& name, const std::string& type) {
  if (std::find(names_.begin(), names_.end(), name) == names_.end()) names_.push_back(name);
  if (!type.empty()) types_.emplace(name, type);
}

std::string Fields::type(const std::string& name) const {
  const auto type = types_.find(name);
  return type == types_.end() ? "double" : type->second;
}

std::vector<std::string> Fields::untold() const {
  std::vector<std::string> names;
  for (const std::string& name : names_) {
    if (!types_.contains(name)) names.push_back(name);
  }
  return names;
}

const KnownInterface* known_interface(std::string_view type) {
  static const std::map<std::string, KnownInterface, std::less<>> kKnown = {
      {"std_msgs/Empty", {}},
      {"std_srvs/Empty", {}},
      {"std_srvs/SetBool", {{{"data", "bool"}}, {{"success", "bool"}, {"message", "string"}}}},
      {"std_srvs/Trigger", {{}, {{"success", "bool"}, {"message", "string"}}}},
      {"example_interfaces/SetBool", {{{"data", "bool"}}, {{"success", "bool"}, {"message", "string"}}}},
      {"example_interfaces/AddTwoInts", {{{"a", "i64"}, {"b", "i64"}}, {{"sum", "i64"}}}},
      {"example_interfaces/Fibonacci", {{{"order", "i32"}}, {{"sequence", "list<i32>"}}}},
      {"geometry_msgs/Twist",
       {{{"linear.x", "double"},
         {"linear.y", "double"},
         {"linear.z", "double"},
         {"angular.x", "double"},
         {"angular.y", "double"},
         {"angular.z", "double"}},
        {}}},
      {"geometry_msgs/Point", {{{"x", "double"}, {"y", "double"}, {"z", "double"}}, {}}},
  };
  if (const auto known = kKnown.find(type); known != kKnown.end()) return &known->second;
  // std_msgs/Int16 and its like have one field.
  static const std::map<std::string, KnownInterface, std::less<>> kData = [] {
    std::map<std::string, KnownInterface, std::less<>> messages;
    for (const std::string_view name : {"Bool", "Int8", "Int16", "Int32", "Int64", "UInt8", "UInt16", "UInt32",
                                        "UInt64", "Float32", "Float64", "String"}) {
      std::string lower;
      for (const char c : name) lower += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
      messages[fmt::format("std_msgs/{}", name)].first = {{"data", *thrift_type(lower)}};
      messages[fmt::format("example_interfaces/{}", name)].first = {{"data", *thrift_type(lower)}};
    }
    return messages;
  }();
  const auto data = kData.find(type);
  return data == kData.end() ? nullptr : &data->second;
}

RosMethod& RosInterfaces::method(const std::string& service, const std::string& name) {
  return services_[service][name];
}

std::string RosInterfaces::idl(const std::string& service) const {
  const auto found = services_.find(service);
  if (found == services_.end()) return {};
  std::string structs;
  std::string methods;
  for (const auto& [name, method] : found->second) {
    std::string result = method.plain_result.empty() ? "void" : method.plain_result;
    if (!method.result.empty()) {
      result = name + "_Response";
      const std::string inside = fields_text(tree_of(method.result), result, "\n", structs);
      structs += fmt::format("struct {} {{\n{}\n}}\n\n", result, inside);
    }
    if (!method.comment.empty()) methods += fmt::format("  /** {} */\n", method.comment);
    methods += fmt::format("  {} {}({});\n", method.oneway ? "oneway void" : result, name,
                           fields_text(tree_of(method.arguments), name, ", ", structs));
  }
  return fmt::format("{}service {} {{\n{}}}\n", structs, service, methods);
}

}  // namespace sentree::import
