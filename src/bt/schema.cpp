#include "sentree/bt/schema.h"

#include <fmt/format.h>

#include <string_view>

#include "sentree/bt/model.h"
#include "sentree/text/xml.h"

namespace sentree::bt {

namespace {

/// The parts that do not depend on the nodes. A port is a literal of its type or the name of an entry.
constexpr std::string_view kHead = R"(<?xml version="1.0" encoding="UTF-8"?>
<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema">
  <xs:simpleType name="entry">
    <xs:restriction base="xs:string"><xs:pattern value="\s*\{.+\}\s*|="/></xs:restriction>
  </xs:simpleType>
  <xs:simpleType name="json">
    <xs:restriction base="xs:string"><xs:pattern value="json:.*"/></xs:restriction>
  </xs:simpleType>
  <xs:simpleType name="enum">
    <xs:restriction base="xs:string"><xs:pattern value="[A-Za-z_][A-Za-z0-9_]*"/></xs:restriction>
  </xs:simpleType>
  <xs:simpleType name="status">
    <xs:restriction base="xs:string">
      <xs:enumeration value="SUCCESS"/>
      <xs:enumeration value="FAILURE"/>
      <xs:enumeration value="RUNNING"/>
      <xs:enumeration value="SKIPPED"/>
      <xs:enumeration value="IDLE"/>
    </xs:restriction>
  </xs:simpleType>
  <xs:simpleType name="truth">
    <xs:restriction base="xs:string"><xs:pattern value="0|1|true|false|True|False|TRUE|FALSE"/></xs:restriction>
  </xs:simpleType>
  <xs:simpleType name="boolPort"><xs:union memberTypes="truth entry json"/></xs:simpleType>
  <xs:simpleType name="integerPort"><xs:union memberTypes="xs:integer entry enum json"/></xs:simpleType>
  <xs:simpleType name="realPort"><xs:union memberTypes="xs:double entry enum json"/></xs:simpleType>
  <xs:simpleType name="statusPort"><xs:union memberTypes="status entry"/></xs:simpleType>
  <xs:element name="root">
    <xs:complexType>
      <xs:choice minOccurs="0" maxOccurs="unbounded">
        <xs:element ref="include"/>
        <xs:element ref="BehaviorTree"/>
        <xs:element ref="TreeNodesModel"/>
      </xs:choice>
      <xs:attribute name="BTCPP_format" type="xs:string"/>
      <xs:attribute name="main_tree_to_execute" type="xs:string"/>
      <xs:anyAttribute processContents="skip"/>
    </xs:complexType>
  </xs:element>
  <xs:element name="include">
    <xs:complexType>
      <xs:attribute name="path" type="xs:string" use="required"/>
      <xs:attribute name="ros_pkg" type="xs:string"/>
    </xs:complexType>
  </xs:element>
  <xs:element name="BehaviorTree">
    <xs:complexType>
      <xs:group ref="node"/>
      <xs:attribute name="ID" type="xs:string"/>
      <xs:anyAttribute processContents="skip"/>
    </xs:complexType>
  </xs:element>
  <xs:element name="TreeNodesModel">
    <xs:complexType>
      <xs:sequence><xs:any minOccurs="0" maxOccurs="unbounded" processContents="skip"/></xs:sequence>
    </xs:complexType>
  </xs:element>
)";

std::string_view type_of_port(const PortInfo& port) {
  if (port.type == nullptr) return "xs:string";
  switch (port.type->kind) {
    case PortType::Class::kBool: return "boolPort";
    case PortType::Class::kInteger: return "integerPort";
    case PortType::Class::kReal: return "realPort";
    case PortType::Class::kStatus: return "statusPort";
    default: return "xs:string";
  }
}

std::string_view children_word(Category category) {
  switch (category) {
    case Category::kControl: return "      <xs:group ref=\"node\" maxOccurs=\"unbounded\"/>\n";
    case Category::kDecorator: return "      <xs:group ref=\"node\"/>\n";
    default: return "";
  }
}

void element(std::string& out, std::string_view name, std::string_view body) {
  out += fmt::format("  <xs:element name=\"{}\">\n    <xs:complexType>\n{}    </xs:complexType>\n  </xs:element>\n",
                     name, body);
}

/// What can be the name of an element, and is none of the schema's own elements.
bool is_compact(const NodeModel& model) {
  const std::string& id = model.id;
  if (model.category == Category::kSubTree || id == "root" || id == "include" || id == "BehaviorTree" ||
      id == "TreeNodesModel" || id.empty()) {
    return false;
  }
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  if (!letter(id.front())) return false;
  for (const char c : id) {
    if (!letter(c) && !(c >= '0' && c <= '9') && c != '-' && c != '.') return false;
  }
  return true;
}

}  // namespace

std::string write_schema(const std::vector<NodeModel>& models) {
  static constexpr std::string_view kExplicit[] = {"Action", "Condition", "Control", "Decorator", "SubTree"};
  std::string out(kHead);
  out += "  <xs:attributeGroup name=\"common\">\n    <xs:attribute name=\"name\" type=\"xs:string\"/>\n";
  for (const std::string_view condition : kConditionNames) {
    out += fmt::format("    <xs:attribute name=\"{}\" type=\"xs:string\"/>\n", condition);
  }
  out +=
      "    <xs:attribute name=\"_description\" type=\"xs:string\"/>\n"
      "    <xs:anyAttribute namespace=\"##other\" processContents=\"skip\"/>\n"
      "  </xs:attributeGroup>\n  <xs:group name=\"node\">\n    <xs:choice>\n";
  for (const std::string_view tag : kExplicit) out += fmt::format("      <xs:element ref=\"{}\"/>\n", tag);
  for (const NodeModel& model : models) {
    if (is_compact(model)) out += fmt::format("      <xs:element ref=\"{}\"/>\n", model.id);
  }
  out += "    </xs:choice>\n  </xs:group>\n";
  // The explicit form says the ID as an attribute, so its ports are not known here.
  for (const std::string_view tag : kExplicit) {
    const std::string_view children = tag == "Control"     ? children_word(Category::kControl)
                                      : tag == "Decorator" ? children_word(Category::kDecorator)
                                                           : std::string_view();
    element(out, tag,
            fmt::format("{}      <xs:attribute name=\"ID\" type=\"xs:string\" use=\"required\"/>\n      "
                        "<xs:anyAttribute processContents=\"skip\"/>\n",
                        children));
  }
  for (const NodeModel& model : models) {
    if (!is_compact(model)) continue;
    std::string body(children_word(model.category));
    for (const PortInfo& port : model.ports) {
      const std::string name = text::xml_escape(port.name);
      body += fmt::format("      <xs:attribute name=\"{}\" type=\"{}\"", name, type_of_port(port));
      if (port.default_text) body += fmt::format(" default=\"{}\"", text::xml_escape(*port.default_text));
      body += "/>\n";
    }
    element(out, model.id, body + "      <xs:attributeGroup ref=\"common\"/>\n");
  }
  return out + "</xs:schema>\n";
}

}  // namespace sentree::bt
