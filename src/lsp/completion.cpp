#include "sentree/lsp/completion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <initializer_list>
#include <map>

#include "sentree/base/ascii.h"
#include "sentree/bt/tree.h"
#include "sentree/design/findings.h"
#include "sentree/lsp/describe.h"
#include "sentree/lsp/detail/xml_cursor.h"
#include "sentree/monitor/requirement.h"
#include "sentree/project/intervention.h"
#include "sentree/project/plan.h"

namespace sentree::lsp {

namespace {

using Where = XmlCursor::Where;

// What SCXML has inside of its elements, and their attributes.
struct ElementInfo {
  std::string_view name;
  std::vector<std::string_view> children;
  std::vector<std::string_view> attributes;
};

const std::vector<ElementInfo>& scxml_elements() {
  static const std::vector<std::string_view> kContent{"raise",  "if",     "foreach", "log",
                                                      "assign", "script", "send",    "cancel"};
  static const std::vector<ElementInfo> kElements{
      {"scxml",
       {"state", "parallel", "final", "datamodel", "script"},
       {"initial", "name", "version", "datamodel", "xmlns"}},
      {"state",
       {"onentry", "onexit", "transition", "initial", "state", "parallel", "final", "history", "datamodel", "invoke"},
       {"id", "initial"}},
      {"parallel", {"onentry", "onexit", "transition", "state", "parallel", "history", "datamodel", "invoke"}, {"id"}},
      {"final", {"onentry", "onexit", "donedata"}, {"id"}},
      {"history", {"transition"}, {"id", "type"}},
      {"initial", {"transition"}, {}},
      {"transition", kContent, {"event", "cond", "target", "type"}},
      {"onentry", kContent, {}},
      {"onexit", kContent, {}},
      {"finalize", kContent, {}},
      {"if", {"raise", "if", "elseif", "else", "foreach", "log", "assign", "script", "send", "cancel"}, {"cond"}},
      {"elseif", {}, {"cond"}},
      {"else", {}, {}},
      {"foreach", kContent, {"array", "item", "index"}},
      {"raise", {}, {"event"}},
      {"log", {}, {"label", "expr"}},
      {"assign", {}, {"location", "expr"}},
      {"script", {}, {"src"}},
      {"send",
       {"param", "content"},
       {"type", "target", "event", "id", "delay", "eventexpr", "targetexpr", "typeexpr", "delayexpr", "namelist",
        "idlocation"}},
      {"cancel", {}, {"sendid", "sendidexpr"}},
      {"datamodel", {"data"}, {}},
      {"data", {}, {"id", "expr", "src"}},
      {"donedata", {"param", "content"}, {}},
      {"param", {}, {"name", "expr", "location"}},
      {"content", {}, {"expr"}},
      {"invoke",
       {"param", "finalize", "content"},
       {"type", "src", "id", "autoforward", "typeexpr", "srcexpr", "idlocation", "namelist"}}};
  return kElements;
}

const ElementInfo* scxml_element(std::string_view name) {
  for (const ElementInfo& info : scxml_elements()) {
    if (info.name == name) return &info;
  }
  return nullptr;
}

class Completer {
 public:
  Completer(const Index& index, const std::string& name, const IndexedFile& file, std::size_t offset)
      : index_(index), name_(name), file_(file), text_(file.text), offset_(std::min(offset, file.text.size())) {
    out_.from = out_.to = offset_;
  }

  Completion run() {
    switch (file_.kind) {
      case FileKind::kTree: in_tree(); break;
      case FileKind::kChart: in_chart(); break;
      case FileKind::kRequirements: in_requirements(); break;
      case FileKind::kProject:
      case FileKind::kScenario: in_yaml(); break;
      case FileKind::kInterface: in_interface(); break;
      case FileKind::kWorld:
      case FileKind::kOther: break;
    }
    return std::move(out_);
  }

 private:
  void add(std::string label, ItemKind kind, std::string detail = {}, std::string documentation = {},
           std::string insert = {}) {
    if (label.empty() || out_.items.size() >= kItemsMax) return;
    out_.items.push_back({std::move(label), kind, std::move(detail), std::move(documentation), std::move(insert)});
  }
  void add_all(std::initializer_list<const char*> labels, ItemKind kind) {
    for (const char* label : labels) add(label, kind);
  }
  void replace(std::size_t from, std::size_t to) {
    out_.from = from;
    out_.to = to;
  }
  // The word, of letters and what `more` has, that ends or goes on here.
  void replace_word(std::string_view more = {}) {
    const auto belongs = [&](char c) { return is_word(c) || more.find(c) != std::string_view::npos; };
    while (out_.from > 0 && belongs(text_[out_.from - 1])) --out_.from;
    while (out_.to < text_.size() && belongs(text_[out_.to])) ++out_.to;
  }
  [[nodiscard]] std::string_view written() const { return text_.substr(out_.from, offset_ - out_.from); }

  void locations() {
    for (const std::string& place : index_.names().locations) add(place, ItemKind::kValue, "location");
  }
  void services() {
    for (const auto& [service, info] : index_.names().services) add(service, ItemKind::kInterface, info.interface);
  }
  void methods(const Names::Service& service, std::string_view before = {}) {
    if (!service.service) return;
    const IndexedFile* const source = index_.find(service.file);
    for (const idl::Method* method : service.service->methods) {
      add(std::string(before) + method->name, ItemKind::kMethod, signature_of(*method),
          source != nullptr && method->span.file == service.file
              ? comment_at(source->text, design::offset_of(source->text, method->span))
              : "");
    }
  }
  void nodes_and_skills() {
    for (const std::string& node : index_.names().nodes) add(node, ItemKind::kReference, "node");
    for (const std::string& skill : index_.names().skills) {
      if (!index_.names().nodes.contains(skill)) add(skill, ItemKind::kReference, "skill");
    }
  }

  // ---- Trees ----

  void in_tree() {
    const XmlCursor cursor = xml_cursor(text_, offset_);
    if (cursor.where == Where::kText || cursor.where == Where::kElsewhere) return;
    replace(cursor.from, cursor.to);
    const auto is_open = [&](std::string_view name) {
      return std::any_of(cursor.open.begin(), cursor.open.end(), [&](const auto& e) { return e.name == name; });
    };
    if (cursor.where == Where::kTagName) {
      if (is_open("TreeNodesModel")) {
        if (cursor.open.size() > 2)
          add_all({"input_port", "output_port", "inout_port", "description"}, ItemKind::kClass);
        else
          add_all({"Action", "Condition", "Control", "Decorator", "SubTree"}, ItemKind::kClass);
      } else if (is_open("BehaviorTree")) {
        for (const auto& [id, model] : index_.palette().nodes()) node_item(id, model);
        add("SubTree", ItemKind::kClass, "a tree in place of a node", {}, "SubTree ID=\"\"");
      } else if (cursor.open.empty()) {
        add("root", ItemKind::kClass);
      } else {
        add_all({"BehaviorTree", "TreeNodesModel", "include"}, ItemKind::kClass);
      }
      return;
    }
    std::string id = cursor.tag.name;
    if (bt::is_explicit_tag(id)) id = std::string(cursor.tag.attribute("ID"));
    const bt::NodeModel* const model = index_.palette().find(id);
    if (cursor.where == Where::kAttributeName)
      tree_attribute_name(cursor, model, is_open("BehaviorTree"));
    else
      tree_attribute_value(cursor, model);
  }

  void node_item(const std::string& id, const bt::NodeModel& model) {
    std::string insert = id;
    for (const bt::PortInfo& port : model.ports) {
      if (port.direction == bt::PortDirection::kInput && !port.default_text)
        insert += fmt::format(" {}=\"\"", port.name);
    }
    const bool has_children = model.category == bt::Category::kControl || model.category == bt::Category::kDecorator;
    add(id, ItemKind::kClass, has_children ? "control" : "leaf", model.description, insert);
  }

  void tree_attribute_name(const XmlCursor& cursor, const bt::NodeModel* model, bool is_node) {
    const auto offer = [&](const std::string& name, const std::string& detail, const std::string& documentation) {
      const bool is_own = text_.substr(cursor.from, cursor.to - cursor.from) == name;
      if (!is_own && std::any_of(cursor.tag.attributes.begin(), cursor.tag.attributes.end(),
                                 [&](const auto& attribute) { return attribute.first == name; }))
        return;
      const bool has_value = cursor.to < text_.size() && text_[cursor.to] == '=';
      add(name, ItemKind::kProperty, detail, documentation, has_value ? "" : name + "=\"\"");
    };
    if (cursor.tag.name == "BehaviorTree" || cursor.tag.name == "SubTree") offer("ID", "", "");
    if (cursor.tag.name.ends_with("_port")) {
      for (const char* name : {"name", "type", "default"}) offer(name, "", "");
    }
    if (!is_node) return;
    if (model != nullptr) {
      for (const bt::PortInfo& port : model->ports)
        offer(port.name, port.type != nullptr ? port.type->name : port.declared_type, port.description);
    }
    offer("name", "of this node", "");
    for (const char* name : {"_skipIf", "_successIf", "_failureIf", "_while", "_onSuccess", "_onFailure", "_onHalted",
                             "_post", "_description"})
      offer(name, "", "");
  }

  void tree_attribute_value(const XmlCursor& cursor, const bt::NodeModel* model) {
    if ((cursor.tag.name == "SubTree" && cursor.attribute == "ID") || cursor.attribute == "main_tree_to_execute") {
      for (const auto& [name, file] : index_.files()) {
        for (const Occurrence& occurrence : file.occurrences) {
          if (occurrence.defines && occurrence.symbol.kind == SymbolKind::kTree)
            add(occurrence.symbol.name, ItemKind::kReference, "tree");
        }
      }
      return;
    }
    if (cursor.attribute == "ID") {
      for (const std::string& skill : index_.names().skills) add(skill, ItemKind::kClass);
      return;
    }
    if (model == nullptr || cursor.attribute == "name") return;
    for (const bt::PortInfo& port : model->ports) {
      if (port.name != cursor.attribute) continue;
      const auto kind = port.type != nullptr ? port.type->kind : bt::PortType::Class::kAny;
      if (kind == bt::PortType::Class::kBool) add_all({"true", "false"}, ItemKind::kValue);
      if (kind == bt::PortType::Class::kStatus) add_all({"SUCCESS", "FAILURE", "RUNNING"}, ItemKind::kValue);
      if (kind == bt::PortType::Class::kString || kind == bt::PortType::Class::kAny) {
        if (!index_.names().builtins.contains(model->id)) locations();
      }
    }
    for (const std::string& entry : file_.entries) add(fmt::format("{{{}}}", entry), ItemKind::kVariable, "blackboard");
  }

  // ---- Charts ----

  void in_chart() {
    const XmlCursor cursor = xml_cursor(text_, offset_);
    if (cursor.where == Where::kElsewhere) return;
    if (cursor.where == Where::kText) {
      if (!cursor.open.empty() && cursor.open.back().name == "script") expression();
      return;
    }
    replace(cursor.from, cursor.to);
    if (cursor.where == Where::kTagName) {
      if (cursor.open.empty()) return add("scxml", ItemKind::kClass);
      if (const ElementInfo* parent = scxml_element(cursor.open.back().name)) {
        for (const std::string_view child : parent->children) add(std::string(child), ItemKind::kClass);
      }
      return;
    }
    const std::string& tag = cursor.tag.name;
    if (cursor.where == Where::kAttributeName) {
      const ElementInfo* const info = scxml_element(tag);
      if (info == nullptr) return;
      const bool has_value = cursor.to < text_.size() && text_[cursor.to] == '=';
      for (const std::string_view name : info->attributes) {
        if (!cursor.tag.attribute(name).empty()) continue;
        add(std::string(name), ItemKind::kProperty, {}, {}, has_value ? "" : fmt::format("{}=\"\"", name));
      }
      return;
    }
    const std::string& attribute = cursor.attribute;
    if (attribute == "initial" || (tag == "transition" && attribute == "target")) {
      replace(offset_, offset_);
      replace_word("-.");
      states();
    } else if (tag == "transition" && attribute == "event") {
      replace(offset_, offset_);
      replace_word("-.*/");
      events();
    } else if (tag == "send" && attribute == "type") {
      add("thrift", ItemKind::kValue, "calls a service");
    } else if (tag == "send" && attribute == "target") {
      services();
      add("#_internal", ItemKind::kValue);
    } else if (tag == "send" && attribute == "event") {
      const auto service = index_.names().services.find(cursor.tag.attribute("target"));
      if (service != index_.names().services.end()) methods(service->second);
    } else if (tag == "param" && attribute == "name") {
      arguments(cursor);
    } else if (tag == "history" && attribute == "type") {
      add_all({"shallow", "deep"}, ItemKind::kValue);
    } else if (attribute == "cond" || attribute == "expr" || attribute == "location" || attribute == "namelist" ||
               attribute.ends_with("expr") || attribute == "array") {
      expression();
    }
  }

  void states() {
    for (const Occurrence& occurrence : file_.occurrences) {
      if (!occurrence.defines || occurrence.symbol.kind != SymbolKind::kState) continue;
      add(occurrence.symbol.name.substr(occurrence.symbol.name.find('#') + 1), ItemKind::kEnumMember, "state");
    }
  }

  [[nodiscard]] bool is_skill() const { return index_.names().charts.contains(name_); }

  void events() {
    if (is_skill()) add_all({"tick", "halt"}, ItemKind::kEvent);
    for (const std::string& event : file_.own_events) add(event, ItemKind::kEvent, "of this chart");
    for (const auto& [name, service] : index_.names().services) {
      if (!service.service) continue;
      for (const idl::Method* method : service.service->methods) {
        const std::string call = fmt::format("{}.{}", name, method->name);
        if (method->oneway) {
          add(call, ItemKind::kEvent, "topic");
          continue;
        }
        add(call + ".reply", ItemKind::kEvent, signature_of(*method));
        add(call + ".error", ItemKind::kEvent);
        if (!is_skill()) add(call + ".request", ItemKind::kEvent, signature_of(*method));
      }
    }
    if (!is_skill()) {
      add_all({"mission.tick", "mission.status", "node.status"}, ItemKind::kEvent);
      for (const std::string& node : index_.names().nodes) {
        for (const char* kind : {".tick.request", ".tick.reply", ".halt.request"}) add(node + kind, ItemKind::kEvent);
      }
    }
    for (const Occurrence& occurrence : file_.occurrences) {
      if (occurrence.defines && occurrence.symbol.kind == SymbolKind::kState)
        add("done.state." + occurrence.symbol.name.substr(occurrence.symbol.name.find('#') + 1), ItemKind::kEvent);
    }
    add_all({"error", "error.execution", "error.communication"}, ItemKind::kEvent);
  }

  // Of the method that the <send> around it calls.
  void arguments(const XmlCursor& cursor) {
    if (cursor.open.empty() || cursor.open.back().name != "send") return;
    const XmlCursor::Element& send = cursor.open.back();
    const auto service = index_.names().services.find(send.attribute("target"));
    if (service == index_.names().services.end() || !service->second.service) return;
    const idl::Method* const method = service->second.service->find(send.attribute("event"));
    if (method == nullptr) return;
    for (const idl::Field& field : method->arguments.fields) add(field.name, ItemKind::kField, declaration_of(field));
  }

  void members(const Observed& observation, std::string_view path) {
    const Fields fields = fields_at(observation, path);
    if (fields.arguments) add("args", ItemKind::kField, "what was asked");
    if (fields.result != nullptr) add("result", ItemKind::kField, fields.result->name);
    if (path.empty()) {
      add_all({"source", "target", "time"}, ItemKind::kField);
      if (observation.kind == "error") add_all({"kind", "message", "exception"}, ItemKind::kField);
    }
    for (const idl::Field* field : fields.fields) add(field->name, ItemKind::kField, declaration_of(*field));
  }

  // Words of the enumeration that the text before a quote is compared with.
  bool enumerators(const Observed& observation) {
    if (out_.from == 0 || (text_[out_.from - 1] != '\'' && text_[out_.from - 1] != '"')) return false;
    std::size_t end = out_.from - 1;
    while (end > 0 && (text_[end - 1] == '=' || text_[end - 1] == '!' || text_[end - 1] == ' ')) --end;
    std::size_t begin = end;
    while (begin > 0 && (is_word(text_[begin - 1]) || text_[begin - 1] == '.')) --begin;
    const std::string_view path = text_.substr(begin, end - begin);
    if (path == "_event.data.source") {
      nodes_and_skills();
      return true;
    }
    constexpr std::string_view kData = "_event.data.";
    if (!path.starts_with(kData)) return false;
    const idl::Type* const type = type_at(observation, path.substr(kData.size()), nullptr);
    if (type == nullptr || type->enumeration == nullptr) return false;
    for (const idl::Enumerator& word : type->enumeration->enumerators)
      add(word.name, ItemKind::kEnumMember, type->name);
    return true;
  }

  void expression() {
    replace(offset_, offset_);
    replace_word();
    // What is observed borrows its name.
    const std::string events = event_around(file_, offset_);
    const std::string_view event = std::string_view(events).substr(0, events.find(' '));
    const Observed handled = observed(event, index_.names());
    if (enumerators(handled)) return;
    if (out_.from >= 4 && text_.substr(out_.from - 4, 3) == "In(") return states();
    std::size_t begin = out_.from;
    while (begin > 0 && (is_word(text_[begin - 1]) || text_[begin - 1] == '.')) --begin;
    const std::string_view path = text_.substr(begin, out_.from - begin);
    constexpr std::string_view kData = "_event.data.";
    if (path == "_event.") {
      add_all({"name", "data", "type", "origin", "sendid", "invokeid"}, ItemKind::kField);
    } else if (path.starts_with(kData)) {
      members(handled, path.substr(kData.size()));
    } else if (path.empty()) {
      for (const IndexedFile::Data& data : file_.data) add(data.id, ItemKind::kVariable, "data");
      add("_event", ItemKind::kVariable);
      add("In", ItemKind::kFunction, "whether a state is active", {}, "In('')");
    }
  }

  // ---- Requirements ----

  void in_requirements() {
    replace_word();
    std::size_t begin = out_.from;
    while (begin > 0 && (is_word(text_[begin - 1]) || text_[begin - 1] == '.')) --begin;
    const std::string_view path = text_.substr(begin, out_.from - begin);
    std::size_t before = begin;
    while (before > 0 && text_[before - 1] == ' ') --before;
    const std::string_view left = text_.substr(0, before);
    const auto follows = [&](std::string_view word) {
      return left.ends_with(word) && (left.size() == word.size() || !is_word(left[left.size() - word.size() - 1]));
    };
    if (follows("from") || left.ends_with("node(")) return nodes_and_skills();
    if (path.ends_with('.')) {
      const std::string_view head = path.substr(0, path.size() - 1);
      if (const auto service = index_.names().services.find(head); service != index_.names().services.end())
        return methods(service->second);
      if (left.ends_with(')')) return reply_members(left, path.substr(1));
      return;
    }
    for (const char* source : {"reply(", "request(", "error(", "late(", "event("}) {
      if (left.ends_with(source)) return services();
    }
    if (before < begin && !left.empty() && std::isdigit(static_cast<unsigned char>(left.back())) != 0) {
      for (const std::string_view unit : monitor::units()) add(std::string(unit), ItemKind::kUnit);
      add_all({"ticks", "events"}, ItemKind::kUnit);
      return;
    }
    for (const Occurrence& occurrence : file_.occurrences) {
      if (occurrence.defines &&
          (occurrence.symbol.kind == SymbolKind::kDefinition || occurrence.symbol.kind == SymbolKind::kEvent))
        add(written_name(occurrence.symbol), ItemKind::kVariable, "definition");
    }
    locations();
    add_all({"let",      "event", "globally",   "before",   "after",    "between",   "until",       "while",
             "always",   "never", "eventually", "whenever", "within",   "shall",     "immediately", "keep",
             "for",      "not",   "precedes",   "holds",    "at least", "at most",   "times",       "per",
             "assuming", "and",   "or",         "implies",  "updated",  "rises",     "falls",       "true",
             "false",    "info",  "minor",      "major",    "critical", "re-arming", "where",       "from"},
            ItemKind::kKeyword);
    for (const char* source : {"reply", "request", "error", "late", "observation", "node"})
      add(source, ItemKind::kFunction, {}, {}, fmt::format("{}(", source));
  }

  // reply(battery.getBatteryState from X).here
  void reply_members(std::string_view left, std::string_view path) {
    int depth = 0;
    std::size_t open = left.size();
    while (open > 0) {
      --open;
      if (left[open] == ')') ++depth;
      if (left[open] == '(' && --depth == 0) break;
    }
    if (depth != 0) return;
    std::size_t begin = open;
    while (begin > 0 && is_word(left[begin - 1])) --begin;
    const std::string_view kind = left.substr(begin, open - begin);
    std::size_t end = open + 1;
    while (end < left.size() && (is_word(left[end]) || left[end] == '.')) ++end;
    const std::string event = fmt::format("{}.{}", left.substr(open + 1, end - open - 1), kind);
    const Observed observation = observed(event, index_.names());
    for (const idl::Field* field :
         fields_at(observation, (kind == "request" ? "args." : "result.") + std::string(path)).fields)
      add(field->name, ItemKind::kField, declaration_of(*field));
  }

  // ---- YAML ----

  void in_yaml() {
    replace_word("./-");
    const std::vector<std::string> path = yaml_path();
    const std::size_t line = offset_ == 0 ? 0 : text_.rfind('\n', offset_ - 1) + 1;
    const std::string_view before = text_.substr(line, out_.from - line);
    // The key whose value this is: "key: here", or "- {key: here", "[here".
    const std::string key = value_key(before);
    const bool is_project = file_.kind == FileKind::kProject;
    if (key.empty()) {
      if (path.empty()) {
        if (is_project)
          keys({"mission", "world", "services", "observe", "skills", "monitors", "models", "verify", "observers",
                "protocols", "palettes", "packages", "plugins", "deadlines", "groot", "foxglove", "yarp_server",
                "durable"});
        else
          keys({"description", "project", "override", "clock", "seed", "duration", "stop_when_violated", "timeline",
                "delays", "choices", "orders", "loop", "processes", "expect"});
      } else if (path.back() == "skills") {
        nodes_and_skills();
      } else if (path.back() == "mission") {
        keys({"file", "files", "tree", "rate", "repeat", "entries", "executed_by"});
      } else if (path.back() == "expect") {
        keys({"mission", "reason", "monitors", "distinct_processes"});
      } else if (path.back() == "monitors" && path.size() > 1) {
        for (const auto& [name, chart] : index_.names().monitors)
          add(name, ItemKind::kReference, "monitor", {}, name + ": ");
      } else if (path.back() == "services" && !is_project) {
        services();
      } else if (path.size() > 1 && path[path.size() - 2] == "services") {
        keys({"interface", "at", "robot", "publish"});
      } else if (path.size() > 1 && path[path.size() - 2] == "observe") {
        keys({"interface", "at"});
      } else if (path.back() == "timeline") {
        keys({"at", "args"});
        for (const project::Intervention& kind : project::every_kind()) {
          const project::intervention::Kind& of = project::kind_of(kind);
          add(std::string(of.word), ItemKind::kProperty, std::string(of.does), {}, fmt::format("{}: ", of.word));
        }
      } else if (const project::Intervention* const kind = kind_called(path.back())) {
        for (const std::string& name : project::keys_of(*kind)) keys({name.c_str()});
      }
      return;
    }
    // {kill: PART} and {unreachable: CALL} say what they are about in their value.
    const project::Intervention* const kind = kind_called(key);
    const std::vector<std::string> members = kind != nullptr ? project::keys_of(*kind) : std::vector<std::string>();
    const std::string about = members.size() == 1 ? members.front() : key;
    if (key == "interface") {
      interfaces();
    } else if (key == "at" && is_project) {
      add_all({"sim", "model", "topics"}, ItemKind::kValue);
    } else if (key == "groot" || key == "foxglove" || key == "yarp_server") {
      add_all({"true", "false"}, ItemKind::kValue);
    } else if (key == "durable") {
      add_all({"true", "false", "never", "interval", "each"}, ItemKind::kValue);
    } else if (key == "serves") {
      services();
    } else if (about == "part" || about == "leaf" || key == "skill") {
      nodes_and_skills();
    } else if (key == "mission" && !is_project) {
      add_all({"SUCCESS", "FAILURE", "RUNNING"}, ItemKind::kEnumMember);
    } else if (about == "call" || about == "message" || key == "gate" || key == "subscribe" || key == "latest" ||
               key == "delay") {
      for (const auto& [name, service] : index_.names().services) methods(service, name + ".");
      if (key == "call") test_control();
    } else if (key == "on") {
      events();
    } else if (key == "from") {
      nodes_and_skills();
    } else if (key == "violated") {
      violated();
    } else if (key == "file" || key == "world") {
      for (const auto& [name, file] : index_.files()) {
        const std::string inside = std::filesystem::path(name).lexically_relative(index_.folder()).generic_string();
        if (!inside.starts_with("..")) add(inside, ItemKind::kFile);
      }
    } else if (index_.names().monitors.contains(key)) {
      add_all({"violated", "satisfied", "undecided", "owed"}, ItemKind::kEnumMember);
    }
  }

  static const project::Intervention* kind_called(std::string_view word) {
    const auto& every = project::every_kind();
    const auto kind =
        std::find_if(every.begin(), every.end(), [&](const auto& k) { return project::word_of(k) == word; });
    return kind != every.end() ? &*kind : nullptr;
  }
  void keys(std::initializer_list<const char*> names) {
    for (const char* name : names) add(name, ItemKind::kProperty, {}, {}, fmt::format("{}: ", name));
  }

  // Methods of the simulator that only scenarios reach.
  void test_control() {
    const std::string file = (project::shipped_folder("interfaces") / "robot.thrift").lexically_normal().string();
    const idl::Schema* const schema = index_.schema(file);
    if (schema == nullptr) return;
    if (const auto service = schema->service("Simulation")) methods({file, "Simulation", service}, "simulation.");
  }

  void interfaces() {
    std::set<std::string> seen;
    const auto offer = [&](const std::string& file) {
      const idl::Schema* const schema = index_.schema(file);
      if (schema == nullptr) return;
      for (const std::string& service : schema->service_names()) {
        std::string label = fmt::format("{}/{}", std::filesystem::path(file).filename().string(), service);
        if (seen.insert(label).second) add(std::move(label), ItemKind::kInterface);
      }
    };
    for (const auto& [name, file] : index_.files()) {
      if (file.kind == FileKind::kInterface) offer(name);
    }
  }

  void violated() {
    const std::size_t line = offset_ == 0 ? 0 : text_.rfind('\n', offset_ - 1) + 1;
    const std::string_view whole = text_.substr(line, std::min(text_.find('\n', offset_), text_.size()) - line);
    for (const auto& [name, chart] : index_.names().monitors) {
      const std::string file = std::filesystem::path(chart).filename().string();
      if (file.empty() || whole.find(file) == std::string_view::npos) continue;
      const IndexedFile* const source = index_.find(chart);
      if (source == nullptr) continue;
      for (const Occurrence& occurrence : source->occurrences) {
        if (occurrence.defines && occurrence.symbol.kind == SymbolKind::kState)
          add(occurrence.symbol.name.substr(occurrence.symbol.name.find('#') + 1), ItemKind::kEnumMember, "state");
      }
    }
  }

  // "a: {b: [x, " is the value of b.
  [[nodiscard]] static std::string value_key(std::string_view before) {
    // Outwards over what is closed.
    int depth = 0;
    for (std::size_t at = before.size(); at > 0; --at) {
      const char c = before[at - 1];
      if (c == ']' || c == '}') ++depth;
      if (depth > 0) {
        if (c == '[' || c == '{') --depth;
        continue;
      }
      if (c == '{') return {};
      if (c == ',') {
        // In a list the key is before it; in a mapping a new key begins.
        std::size_t open = at - 1;
        int inner = 0;
        while (open > 0) {
          --open;
          if (before[open] == ']' || before[open] == '}') ++inner;
          if (before[open] == '[' || before[open] == '{') {
            if (inner == 0) break;
            --inner;
          }
        }
        if (before[open] != '[') return {};
        at = open + 1;
        continue;
      }
      if (c != ':' || at >= before.size() || before[at] != ' ') continue;
      std::size_t begin = at - 1;
      while (begin > 0 && (is_word(before[begin - 1]) || before[begin - 1] == '-')) --begin;
      return std::string(before.substr(begin, at - 1 - begin));
    }
    return {};
  }

  // Keys of the mappings around this place, by indentation, then inside of braces on its line.
  [[nodiscard]] std::vector<std::string> yaml_path() const {
    std::vector<std::string> path;
    std::size_t line = offset_ == 0 ? 0 : text_.rfind('\n', offset_ - 1) + 1;
    const auto indentation_of = [&](std::size_t from) {
      std::size_t at = from;
      while (at < text_.size() && (text_[at] == ' ' || text_[at] == '-')) ++at;
      return at - from;
    };
    std::size_t indentation = std::min(indentation_of(line), offset_ - line);
    const std::string_view own = text_.substr(line, out_.from - line);
    while (line > 0 && indentation > 0) {
      line = line < 2 ? 0 : text_.rfind('\n', line - 2) + 1;
      const std::size_t depth = indentation_of(line);
      const std::size_t at = line + depth;
      if (at >= text_.size() || text_[at] == '\n' || text_[at] == '#' || depth >= indentation) continue;
      std::size_t end = at;
      while (end < text_.size() && text_[end] != ':' && text_[end] != '\n') ++end;
      if (end < text_.size() && text_[end] == ':') path.insert(path.begin(), std::string(text_.substr(at, end - at)));
      indentation = depth;
    }
    std::vector<std::string> inside;
    for (std::size_t at = 0; at < own.size(); ++at) {
      if (own[at] == '{') {
        std::size_t end = at;
        while (end > 0 && (own[end - 1] == ' ' || own[end - 1] == ':')) --end;
        std::size_t begin = end;
        while (begin > 0 && (is_word(own[begin - 1]) || own[begin - 1] == '-')) --begin;
        inside.emplace_back(own.substr(begin, end - begin));
      } else if (own[at] == '}' && !inside.empty()) {
        inside.pop_back();
      }
    }
    for (std::string& key : inside) {
      if (!key.empty() && key != "-") path.push_back(std::move(key));
    }
    return path;
  }

  // ---- Thrift ----

  void in_interface() {
    replace_word();
    add_all({"namespace", "include", "enum", "struct", "union",    "exception", "service", "extends", "const",
             "typedef",   "oneway",  "void", "throws", "required", "optional",  "bool",    "byte",    "i8",
             "i16",       "i32",     "i64",  "double", "string",   "binary",    "list",    "set",     "map"},
            ItemKind::kKeyword);
    for (const Occurrence& occurrence : file_.occurrences) {
      if (occurrence.defines && occurrence.symbol.kind == SymbolKind::kType)
        add(occurrence.symbol.name.substr(occurrence.symbol.name.find('#') + 1), ItemKind::kClass);
    }
  }

  const Index& index_;
  const std::string& name_;
  const IndexedFile& file_;
  std::string_view text_;
  std::size_t offset_;
  Completion out_;
};

}  // namespace

Completion complete(const Index& index, const std::string& file, std::size_t offset) {
  const IndexedFile* const found = index.find(file);
  if (found == nullptr) return {offset, offset, {}};
  return Completer(index, file, *found, offset).run();
}

}  // namespace sentree::lsp
