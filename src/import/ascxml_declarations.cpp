#include "sentree/import/detail/ascxml_declarations.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <filesystem>

#include <fmt/format.h>

#include "sentree/import/detail/project_writer.h"
#include "sentree/import/detail/words.h"

namespace sentree::import {

using text::XmlDocument;
using text::XmlElement;

namespace {

using Group = Declaration::Group;

std::map<std::string, std::string> data_types(const XmlDocument& document) {
  std::map<std::string, std::string> types;
  for_each_element(document.root(), [&](const XmlElement& element) {
    const std::string_view name = element.local_name();
    const bool is_data = name == "data";
    if (!is_data && !name.starts_with("bt_declare_port")) return;
    const std::string id(element.attribute(is_data ? "id" : "key").value_or(""));
    if (const auto type = thrift_type(element.attribute("type").value_or(""))) types.emplace(id, *type);
  });
  return types;
}

/// The Thrift type that an expression has, as far as it shows.
std::string type_of(const std::string& expression, const std::map<std::string, std::string>& data) {
  const std::string text = trimmed(expression);
  if (text.empty()) return {};
  if (const auto known = data.find(text); known != data.end()) return known->second;
  if (text == "true" || text == "false") return "bool";
  for (const char* sign : {"==", "!=", "<", ">", "&&", "||", "!"}) {
    if (text.find(sign) != std::string::npos) return "bool";
  }
  if (text.front() == '\'' || text.front() == '"') return "string";
  if (text.find_first_not_of("-0123456789") == std::string::npos) return "i32";
  if (text.find_first_not_of("-0123456789.") == std::string::npos) return "double";
  // "count + 1", "places[0]"
  std::size_t end = 0;
  while (end < text.size() && is_word(text[end])) ++end;
  const auto first = data.find(text.substr(0, end));
  if (first == data.end()) return {};
  const bool is_list = first->second.starts_with("list<");
  if (is_list && end < text.size() && text[end] == '[') return first->second.substr(5, first->second.size() - 6);
  return is_list ? std::string() : first->second;
}

/// Before the name of a field of an event's data.
constexpr std::array<std::string_view, 7> kSources{
    "_msg.", "_req.", "_res.", "_goal.", "_action.", "_wrapped_result.result.", "_feedback."};

/// The fields that an expression reads behind `word`.
std::vector<std::string> read_fields(const std::string& text, std::string_view word) {
  std::vector<std::string> names;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
    if (at > 0 && is_word(text[at - 1])) continue;
    std::size_t end = at + word.size();
    while (end < text.size() &&
           (is_word(text[end]) || (text[end] == '.' && end + 1 < text.size() && is_word(text[end + 1]))))
      ++end;
    std::string name = text.substr(at + word.size(), end - at - word.size());
    if (name.ends_with(".length")) name.erase(name.size() - 7);
    if (!name.empty()) names.push_back(name);
  }
  return names;
}

RosMethod& action_method(RosWorld& world, const RosPlace& place, std::string_view part) {
  const bool is_goal = part == "_send_goal";
  RosMethod& method =
      world.interfaces.method(is_goal ? place.service : std::string(kTopics), place.method + std::string(part));
  method.arguments.use("goal_id", "i32");
  if (is_goal) {
    method.plain_result = "bool";
    method.comment = "The goal of an action; the result says whether it is accepted.";
  } else {
    method.oneway = true;
    world.has_topics = true;
    if (part == "_result") method.arguments.use("status", "string");
  }
  return method;
}

RosMethod& topic_method(RosWorld& world, const std::string& ros_name) {
  RosMethod& method = world.interfaces.method(std::string(kTopics), method_name(ros_name));
  method.oneway = true;
  method.comment = "Topic " + ros_name;
  world.has_topics = true;
  return method;
}

void use_known(Fields& fields, const std::vector<std::pair<std::string, std::string>>& known) {
  for (const auto& [name, type] : known) fields.use(name, type);
}

}  // namespace

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '$'; }

std::string trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  if (begin == std::string_view::npos) return {};
  return std::string(text.substr(begin, text.find_last_not_of(" \t\r\n") + 1 - begin));
}

std::string value_of(const XmlElement& element, std::string_view name) {
  if (const auto written = element.attribute(name)) return std::string(*written);
  const XmlElement child = element.child(name);
  if (!child) return {};
  if (const XmlElement input = child.child("bt_get_input")) return std::string(input.attribute("key").value_or(""));
  return trimmed(child.text());
}

FieldValues fields_of(const XmlElement& element) {
  FieldValues fields;
  for (const XmlElement& child : element.children()) {
    const std::string_view name = child.local_name();
    if (name == "field" || name == "param")
      fields.emplace_back(child.attribute("name").value_or(""), value_of(child, "expr"));
  }
  return fields;
}

std::optional<Declaration> declaration_of(const XmlElement& element, const std::map<std::string, std::string>& ports) {
  static const std::map<std::string_view, std::pair<Group, bool>> kKinds = {
      {"ros_topic_publisher", {Group::kTopic, true}},  {"ros_topic_subscriber", {Group::kTopic, false}},
      {"ros_service_server", {Group::kService, true}}, {"ros_service_client", {Group::kService, false}},
      {"ros_action_server", {Group::kAction, true}},   {"ros_action_client", {Group::kAction, false}},
      {"ros_time_rate", {Group::kRate, true}},
  };
  const auto kind = kKinds.find(element.local_name());
  if (kind == kKinds.end()) return std::nullopt;
  Declaration made;
  made.group = kind->second.first;
  made.serves = kind->second.second;
  made.span = element.span();
  made.type = element.attribute("type").value_or("");
  const std::string attribute = made.group == Group::kTopic     ? "topic"
                                : made.group == Group::kService ? "service_name"
                                                                : "action_name";
  made.ros_name = value_of(element, attribute);
  if (const XmlElement child = element.child(attribute); child && child.child("bt_get_input")) {
    made.key = made.ros_name;
    const auto value = ports.find(made.key);
    made.ros_name = value == ports.end() ? std::string() : value->second;
  }
  made.name = element.attribute("name").value_or(made.ros_name);
  if (made.group == Group::kRate)
    made.rate_hz = std::atof(std::string(element.attribute("rate_hz").value_or("1")).c_str());
  return made;
}

std::vector<Declaration> declarations_of(const AscxmlChart& chart) {
  std::vector<Declaration> found;
  for (const XmlElement& child : chart.document->root().children()) {
    if (auto declaration = declaration_of(child, chart.ports)) found.push_back(std::move(*declaration));
  }
  return found;
}

const Declaration* find(const std::vector<Declaration>& declarations, Group group, std::string_view name,
                        std::optional<bool> serves) {
  for (const Declaration& declaration : declarations) {
    if (declaration.group == group && declaration.name == name && (!serves || declaration.serves == *serves))
      return &declaration;
  }
  return nullptr;
}

bool is_cross(const RosWorld& world, const std::string& event) {
  const auto handlers = world.handlers.find(event);
  const auto senders = world.senders.find(event);
  if (handlers == world.handlers.end() || senders == world.senders.end()) return false;
  return handlers->second.size() > 1 || senders->second.size() > 1 || handlers->second != senders->second;
}

std::string method_name(std::string_view ros_name) {
  std::string name = safe_name(ros_name);
  std::replace(name.begin(), name.end(), '-', '_');
  if (std::isdigit(static_cast<unsigned char>(name.front())) != 0) name.insert(0, "n");
  return name;
}

std::string chart_name(const XmlDocument& document, const std::string& file) {
  const std::string name(document.root().attribute("name").value_or(""));
  return name.empty() ? std::filesystem::path(file).stem().string() : name;
}

std::vector<PortDeclaration> ports_of(const XmlDocument& document) {
  std::vector<PortDeclaration> ports;
  for (const XmlElement& child : document.root().children()) {
    const std::string_view name = child.local_name();
    if (name != "bt_declare_port_in" && name != "bt_declare_port_out") continue;
    ports.push_back({std::string(child.attribute("key").value_or("")),
                     std::string(child.attribute("type").value_or("")), name.ends_with("in")});
  }
  return ports;
}

std::vector<std::string> naming_ports(const XmlDocument& document) {
  std::vector<std::string> keys;
  for (const XmlElement& child : document.root().children()) {
    const auto declaration = declaration_of(child, {});
    if (declaration && !declaration->key.empty()) keys.push_back(declaration->key);
  }
  return keys;
}

void declare(const AscxmlChart& chart, RosWorld& world) {
  std::set<std::string> methods;
  for (const Declaration& declaration : declarations_of(chart)) {
    if (declaration.ros_name.empty() || !declaration.serves) continue;
    if (declaration.group == Group::kService) {
      std::string method =
          method_name(std::string_view(declaration.ros_name).substr(declaration.ros_name.rfind('/') + 1));
      if (!methods.insert(method).second) method = method_name(declaration.ros_name);
      world.services[declaration.ros_name] = {chart.name, method};
    } else if (declaration.group == Group::kAction) {
      world.actions[declaration.ros_name] = {chart.name, method_name(declaration.ros_name)};
    }
  }
  for_each_element(chart.document->root(), [&](const XmlElement& element) {
    const bool handles = element.local_name() == "transition";
    if (!handles && element.local_name() != "send") return;
    if (!handles && (element.attribute("target") || element.attribute("type"))) return;
    for (const std::string& event : words(element.attribute("event").value_or("")))
      (handles ? world.handlers : world.senders)[event].insert(chart.name);
  });
}

void use(const AscxmlChart& chart, RosWorld& world) {
  const auto types = data_types(*chart.document);
  const std::vector<Declaration> declarations = declarations_of(chart);
  // Whom nobody of the system serves is served elsewhere.
  for (const Declaration& declaration : declarations) {
    if (declaration.ros_name.empty()) continue;
    const KnownInterface* const known = known_interface(declaration.type);
    if (declaration.group == Group::kTopic) {
      RosMethod& method = topic_method(world, declaration.ros_name);
      if (known != nullptr) use_known(method.arguments, known->first);
    } else if (declaration.group == Group::kService) {
      world.services.try_emplace(declaration.ros_name, RosPlace{"elsewhere", method_name(declaration.ros_name)});
      const RosPlace& place = world.services.at(declaration.ros_name);
      RosMethod& method = world.interfaces.method(place.service, place.method);
      method.comment = fmt::format("Service {}, {}", declaration.ros_name, declaration.type);
      if (known != nullptr) {
        use_known(method.arguments, known->first);
        use_known(method.result, known->second);
      }
    } else if (declaration.group == Group::kAction) {
      world.actions.try_emplace(declaration.ros_name, RosPlace{"elsewhere", method_name(declaration.ros_name)});
      const RosPlace& place = world.actions.at(declaration.ros_name);
      RosMethod& goal = action_method(world, place, "_send_goal");
      RosMethod& result = action_method(world, place, "_result");
      if (known != nullptr) {
        use_known(goal.arguments, known->first);
        use_known(result.arguments, known->second);
      }
    }
  }
  const auto fields = [&](const XmlElement& element) -> Fields* {
    const std::string name(element.local_name());
    const std::string ref(element.attribute("name").value_or(""));
    const bool sends_goal = name == "ros_action_send_goal";
    const bool handles_goal = name == "ros_action_handle_goal";
    if (name == "ros_topic_publish" || name == "ros_topic_callback") {
      const auto* topic = find(declarations, Group::kTopic, ref, name.ends_with("publish"));
      if (topic == nullptr || topic->ros_name.empty()) return nullptr;
      return &topic_method(world, topic->ros_name).arguments;
    }
    if (name.starts_with("ros_service_")) {
      const bool serves = name == "ros_service_handle_request" || name == "ros_service_send_response";
      const auto* service = find(declarations, Group::kService, ref, serves);
      if (service == nullptr || service->ros_name.empty()) return nullptr;
      const RosPlace& place = world.services.at(service->ros_name);
      RosMethod& method = world.interfaces.method(place.service, place.method);
      return name.ends_with("request") ? &method.arguments : &method.result;
    }
    if (!name.starts_with("ros_action_")) return nullptr;
    const bool serves = handles_goal || (!name.starts_with("ros_action_handle") && !sends_goal);
    const auto* action = find(declarations, Group::kAction, ref, serves);
    if (action == nullptr || action->ros_name.empty()) return nullptr;
    const RosPlace& place = world.actions.at(action->ros_name);
    if (sends_goal || handles_goal) return &action_method(world, place, "_send_goal").arguments;
    if (name.ends_with("feedback")) return &action_method(world, place, "_feedback").arguments;
    const bool has_result = name.ends_with("_result") || name == "ros_action_succeed" || name == "ros_action_aborted" ||
                            name == "ros_action_canceled";
    return has_result ? &action_method(world, place, "_result").arguments : nullptr;
  };
  const auto read = [&](const XmlElement& element, Fields& into, bool crossing) {
    for_each_element(element, [&](const XmlElement& inner) {
      inner.for_each_attribute([&](std::string_view attribute, std::string_view value) {
        if (attribute != "expr" && attribute != "cond") return;
        const std::string text(value);
        const auto note = [&](std::string_view word) {
          for (const std::string& field : read_fields(text, word)) {
            if (field == "goal_id") continue;
            const bool whole = text == std::string(word) + field;
            const auto target = types.find(std::string(inner.attribute("location").value_or("")));
            into.use(field, whole && target != types.end() ? target->second : "");
          }
        };
        for (const std::string_view word : kSources) note(word);
        if (crossing) note("_event.data.");
      });
    });
  };
  for_each_element(chart.document->root(), [&](const XmlElement& element) {
    Fields* into = fields(element);
    bool crossing = false;
    const std::string_view name = element.local_name();
    if (into == nullptr && (name == "transition" || name == "send")) {
      for (const std::string& event : words(element.attribute("event").value_or(""))) {
        if (!is_cross(world, event)) continue;
        into = &topic_method(world, event).arguments;
        crossing = name == "transition";
      }
    }
    if (into == nullptr) return;
    for (const auto& [field, value] : fields_of(element)) into->use(field, type_of(value, types));
    if (name == "transition" || name.find("_handle_") != std::string_view::npos || name.ends_with("_callback"))
      read(element, *into, crossing);
  });
}

}  // namespace sentree::import
