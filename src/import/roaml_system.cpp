#include "sentree/import/detail/roaml_system.h"

#include <algorithm>
#include <deque>
#include <map>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "sentree/import/detail/ascxml_chart.h"
#include "sentree/import/detail/project_writer.h"
#include "sentree/import/detail/snippet.h"
#include "sentree/import/detail/xml_rewrite.h"
#include "sentree/text/json.h"
#include "sentree/text/xml.h"

namespace sentree::import {

using text::XmlDocument;
using text::XmlElement;

namespace {

constexpr const char* kProtocol =
    "\nprotocols:\n"
    "  # How the plug-ins of AS2FM are ticked, and how they answer.\n"
    "  as2fm:\n"
    "    tick: bt_tick\n"
    "    halt: bt_halt\n"
    "    answer: {event: bt_return_status, param: status}\n"
    "    halted: bt_return_halted\n";

struct RoamlLeaf {
  std::string name;
  std::string id;
  std::map<std::string, std::string> attributes;
  SourceSpan span;
};

struct Chart {
  std::string file;
  XmlDocument document;
  std::string name;
  bool is_plugin = false;
};

bool is_main(std::string_view root) { return root == "roaml" || root == "convince_mc_tc"; }

class RoamlSystem {
 public:
  RoamlSystem(const SourceFolder& folder, std::string main) : folder_(folder), main_(std::move(main)) {}

  Loaded<Imported> run() {
    result_.form = "as2fm";
    auto source = folder_.read(main_);
    if (!source) return failed(source.error());
    const auto document = XmlDocument::parse(std::move(*source), folder_.shown(main_), {.lenient = true});
    if (!document) return failed(document.error());
    if (!is_main(document->root().local_name())) {
      return failed(
          {Severity::kError, "import.unknown-form",
           fmt::format("the root element is <{}>; the main file of an AS2FM system has <roaml> or <convince_mc_tc>",
                       document->root().name()),
           document->root().span()});
    }
    for (const XmlElement& part : document->root().children()) read_part(part);
    if (tree_.empty()) {
      return failed(
          {Severity::kError, "import.no-tree",
           "the system has no Behavior Tree (<input type=\"bt.cpp-xml\">), and so no mission; a system of nodes alone "
           "cannot be imported",
           document->root().span()});
    }
    if (!read_tree()) return {.value = std::nullopt, .diagnostics = std::move(diagnostics_)};
    translate_charts();
    write_interfaces();
    write_project_file();
    std::stable_sort(result_.findings.begin(), result_.findings.end(),
                     [](const Finding& a, const Finding& b) { return a.span < b.span; });
    return {.value = std::move(result_), .diagnostics = std::move(diagnostics_)};
  }

 private:
  static Loaded<Imported> failed(Diagnostic diagnostic) {
    return {.value = std::nullopt, .diagnostics = {std::move(diagnostic)}};
  }

  void find(Fate fate, SourceSpan span, std::string original, std::string reason) {
    result_.findings.push_back({fate, std::move(span), std::move(original), std::move(reason)});
  }

  void read_part(const XmlElement& part) {
    const std::string_view name = part.local_name();
    if (name == "mc_parameters" || name == "parameters") {
      for (const XmlElement& parameter : part.children()) read_parameter(parameter);
      return;
    }
    for (const XmlElement& input : part.children()) {
      if (input.local_name() == "input" || input.attribute("src")) {
        read_input(input);
      } else {
        find(Fate::kByHand, input.span(), std::string(input.name()), "an element that this version does not know");
      }
    }
  }

  void read_parameter(const XmlElement& parameter) {
    const std::string name(parameter.local_name());
    const std::string value(parameter.attribute("value").value_or(""));
    if (name == "bt_tick_rate") {
      rate_ = value;
    } else if (name == "bt_tick_if_not_running") {
      repeats_ = value == "true";
    } else if (name == "max_time") {
      const std::string unit(parameter.attribute("unit").value_or("s"));
      duration_ = fmt::format("{} {}", value, unit);
    } else {
      find(Fate::kNotNeeded, parameter.span(), name, "bounds the model checker; nothing here is bounded by it");
    }
  }

  std::optional<std::string> file_of(const XmlElement& input) {
    const std::string source(input.attribute("src").value_or(""));
    auto file = SourceFolder::resolve(main_, source);
    if (file && folder_.contains(*file)) return file;
    find(Fate::kByHand, input.span(), source,
         !file ? "lies outside the imported folder and was not read; import the folder above it: sentree import FOLDER "
                 "--main "
                 "PATH/TO/main.xml"
               : "there is no such file");
    return std::nullopt;
  }

  void read_input(const XmlElement& input) {
    const std::string type(input.attribute("type").value_or(""));
    const auto file = file_of(input);
    if (!file) return;
    if (type == "bt.cpp-xml") {
      tree_ = *file;
    } else if (type.starts_with("bt-plugin")) {
      read_chart(*file, true);
    } else if (type == "ros-scxml" || type == "node-ascxml" || type == "scxml" || type.ends_with("ascxml")) {
      read_chart(*file, false);
    } else if (type == "jani") {
      read_properties(*file, input);
    } else {
      find(Fate::kByHand, input.span(), type,
           fmt::format("this type of input has no counterpart; {} was not imported", *file));
    }
  }

  void read_chart(const std::string& file, bool is_plugin) {
    auto source = folder_.read(file);
    if (!source) return find(Fate::kByHand, source.error().span, "", source.error().message);
    auto document = XmlDocument::parse(std::move(*source), folder_.shown(file), {.lenient = true});
    if (!document) return find(Fate::kByHand, document.error().span, "", "not read: " + document.error().message);
    std::string name = method_name(chart_name(*document, file));
    charts_.push_back({file, std::move(*document), std::move(name), is_plugin});
  }

  void read_properties(const std::string& file, const XmlElement& input) {
    const auto source = folder_.read(file);
    if (!source) return;
    result_.files.push_back({"properties/" + std::filesystem::path(file).filename().string(), *source});
    const auto json = text::parse_json(*source, folder_.shown(file));
    const List* properties = nullptr;
    if (json) {
      if (const Value* list = json->find("properties")) properties = list->as_list();
    }
    if (properties == nullptr) {
      return find(Fate::kByHand, input.span(), file, "no JANI properties can be read in it; it lies in properties/");
    }
    for (const Value& property : *properties) {
      const Value* const name = property.find("name");
      const Value* const comment = property.find("comment");
      std::string text = name != nullptr && name->as_string() != nullptr ? *name->as_string() : "without a name";
      if (comment != nullptr && comment->as_string() != nullptr) text += ": " + *comment->as_string();
      find(
          Fate::kByHand, SourceSpan{folder_.shown(file), line_of(*source, name), 0, 0}, shortened(text),
          "a JANI property speaks of variables of the generated automata; write it as a sentence in requirements/*.req "
          "(docs/requirements.md)");
    }
  }

  static int line_of(const std::string& source, const Value* name) {
    if (name == nullptr || name->as_string() == nullptr) return 0;
    const std::size_t at = source.find(fmt::format("\"{}\"", *name->as_string()));
    if (at == std::string::npos) return 0;
    return 1 + static_cast<int>(std::count(source.begin(), source.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
  }

  [[nodiscard]] const Chart* plugin(std::string_view id) const {
    for (const Chart& chart : charts_) {
      if (chart.is_plugin && chart.name == id) return &chart;
    }
    return nullptr;
  }

  bool read_tree() {
    auto source = folder_.read(tree_);
    if (!source) {
      diagnostics_.push_back(source.error());
      return false;
    }
    auto document = XmlDocument::parse(std::move(*source), folder_.shown(tree_), {.lenient = true});
    if (!document) {
      diagnostics_.push_back(document.error());
      return false;
    }
    text::XmlEdit edit(*document);
    std::set<std::string> names{std::string(kTopics), "elsewhere"};
    for (const Chart& chart : charts_) {
      if (!chart.is_plugin) names.insert({chart.name, model_name(chart.name)});
    }
    std::string model;
    std::set<std::string> modelled;
    std::vector<XmlElement> stack{document->root()};
    while (!stack.empty()) {
      const XmlElement element = stack.back();
      stack.pop_back();
      const std::vector<XmlElement> children = element.children();
      stack.insert(stack.end(), children.rbegin(), children.rend());
      const std::string tag(element.local_name());
      const std::string id(tag == "Action" || tag == "Condition" ? element.attribute("ID").value_or("")
                                                                 : element.local_name());
      const Chart* const chart = plugin(id);
      if (chart == nullptr) continue;
      RoamlLeaf leaf{std::string(element.attribute("name").value_or(id)), id, {}, element.span()};
      element.for_each_attribute(
          [&](std::string_view name, std::string_view value) { leaf.attributes[std::string(name)] = value; });
      // Every leaf has a name of its own here, by which its messages are known; a service has none of them.
      const std::string name = unused_name(leaf.name, names);
      if (name != leaf.name) edit.set_attribute(element, "name", name);
      leaf.name = name;
      if (modelled.insert(id).second) model += model_of(*chart, tag == "Condition");
      leaves_.push_back(std::move(leaf));
    }
    if (document->root().child("TreeNodesModel")) {
      model.clear();  // it has one
    } else if (!model.empty()) {
      edit.append_child(document->root(), fmt::format("<TreeNodesModel>\n{}  </TreeNodesModel>", model));
    }
    auto edited = edit.apply();
    if (!edited) {
      diagnostics_.push_back(edited.error());
      return false;
    }
    mission_ = "trees/" + std::filesystem::path(tree_).filename().string();
    result_.files.push_back({mission_, std::move(*edited)});
    return true;
  }

  static std::string model_of(const Chart& chart, bool is_condition) {
    std::string ports;
    for (const PortDeclaration& port : ports_of(chart.document)) {
      const std::string thrift = thrift_type(port.type).value_or("string");
      const std::string type = thrift == "string"   ? "std::string"
                               : thrift == "bool"   ? "bool"
                               : thrift == "double" ? "double"
                                                    : "int";
      ports += fmt::format("      <{}{}{}/>\n", port.is_input ? "input_port" : "output_port",
                           text::xml_attribute("name", port.key), text::xml_attribute("type", type));
    }
    const std::string tag = is_condition ? "Condition" : "Action";
    return fmt::format("    <{}{}{}", tag, text::xml_attribute("ID", chart.name),
                       ports.empty() ? "/>\n" : fmt::format(">\n{}    </{}>\n", ports, tag));
  }

  // A service and the model that serves it need names of their own.
  static std::string model_name(const std::string& node) { return node + "_node"; }

  /// A plug-in whose declarations take names from ports is a chart for each leaf.
  struct Instance {
    AscxmlChart chart;
    const Chart* original = nullptr;
    std::string path;
    std::vector<const RoamlLeaf*> leaves;
  };

  void translate_charts() {
    for (const Chart& chart : charts_) {
      if (!chart.is_plugin) {
        instances_.push_back(
            {{&chart.document, chart.name, false, {}}, &chart, fmt::format("models/{}.scxml", chart.name), {}});
        continue;
      }
      const std::vector<std::string> naming = naming_ports(chart.document);
      Instance* shared = nullptr;
      for (const RoamlLeaf& leaf : leaves_) {
        if (leaf.id != chart.name) continue;
        if (shared == nullptr || !naming.empty()) {
          AscxmlChart made{&chart.document, naming.empty() ? chart.name : method_name(leaf.name), true, {}};
          for (const std::string& key : naming) {
            const auto value = leaf.attributes.find(key);
            if (value != leaf.attributes.end() && !value->second.starts_with("{")) made.ports[key] = value->second;
          }
          const std::string path = fmt::format("skills/{}.scxml", made.name);
          instances_.push_back({std::move(made), &chart, path, {}});
          shared = &instances_.back();
        }
        shared->leaves.push_back(&leaf);
      }
      if (shared == nullptr)
        find(Fate::kByHand, SourceSpan{folder_.shown(chart.file)}, chart.name,
             "no leaf of the tree uses this plug-in; not imported");
    }
    for (Instance& instance : instances_) note_ports(instance);
    for (const Instance& instance : instances_) declare(instance.chart, world_);
    for (const Instance& instance : instances_) use(instance.chart, world_);
    int goals = 0;
    for (const Instance& instance : instances_) {
      TranslatedAscxml made = translate(instance.chart, world_);
      for (Finding& finding : made.findings) {
        const bool known = std::any_of(result_.findings.begin(), result_.findings.end(), [&](const Finding& f) {
          return f.span == finding.span && f.reason == finding.reason;
        });
        if (!known) result_.findings.push_back(std::move(finding));
      }
      // Goals of different leaves must have different numbers.
      std::string topics;
      for (const std::string& topic : made.subscribes) topics += (topics.empty() ? "" : ", ") + topic;
      const std::string subscribe = topics.empty() ? "" : fmt::format(", subscribe: [{}]", topics);
      for (const RoamlLeaf* leaf : instance.leaves) {
        std::string data;
        for (const std::string& counter : made.goal_counters)
          data += fmt::format("{}{}: {}", data.empty() ? "" : ", ", counter, 1000 * goals++);
        skills_ +=
            fmt::format("  {}: {{file: {}, protocol: as2fm{}{}}}\n", yaml_text(leaf->name), yaml_text(instance.path),
                        data.empty() ? "" : fmt::format(", data: {{{}}}", data), subscribe);
      }
      if (instance.leaves.empty()) {
        const std::string& node = instance.chart.name;
        const bool serves = world_.interfaces.services().contains(node);
        if (serves) modelled_.insert(node);
        models_ +=
            fmt::format("  - {{file: {}, name: {}{}{}}}\n", yaml_text(instance.path), yaml_text(model_name(node)),
                        serves ? fmt::format(", serves: [{}]", node) : "", subscribe);
      }
      result_.files.push_back({instance.path, std::move(made.source)});
    }
  }

  static void note_ports(Instance& instance) {
    for (const PortDeclaration& port : ports_of(instance.original->document)) {
      const auto has = [&](const RoamlLeaf* leaf) { return leaf->attributes.contains(port.key); };
      const auto& leaves = instance.leaves;
      if (!port.is_input || std::none_of(leaves.begin(), leaves.end(), has)) continue;
      const bool all = std::all_of(leaves.begin(), leaves.end(), has);
      (all ? instance.chart.given : instance.chart.sometimes).insert(port.key);
    }
  }

  void write_interfaces() {
    int port = kFirstPort;
    for (const auto& [service, methods] : world_.interfaces.services()) {
      result_.files.push_back({fmt::format("interfaces/{}.thrift", service),
                               "// Made from what the charts use.\n" + world_.interfaces.idl(service)});
      const bool is_here = service == kTopics || modelled_.contains(service);
      const std::string at = service == kTopics ? std::string(kTopics)
                             : is_here          ? "model"
                                                : fmt::format("\"tcp://127.0.0.1:{}\"", port++);
      services_ += fmt::format("  {}: {{interface: {}.thrift/{}, at: {}}}\n", service, service, service, at);
      if (!is_here) {
        needs_others_ = true;
        find(Fate::kByHand, SourceSpan{folder_.shown(main_)}, service,
             "no node of the system serves what is in interfaces/elsewhere.thrift; give the address of whoever does");
      }
      for (const auto& [name, method] : methods) {
        for (const Fields* fields : {&method.arguments, &method.result}) {
          for (const std::string& field : fields->untold()) {
            find(Fate::kReview, SourceSpan{fmt::format("interfaces/{}.thrift", service)},
                 fmt::format("{}.{}", name, field), "nothing tells the type of this field; it is written as double");
          }
        }
      }
    }
  }

  void write_project_file() {
    const auto rate = rate_.empty() ? std::string("1") : rate_;
    std::string yaml = fmt::format(
        "# Imported; IMPORT.md says from what, and what is left to do.\nmission: {{file: {}, rate: {} Hz{}}}\n{}",
        yaml_text(mission_), rate, repeats_ ? ", repeat: true" : "", kProtocol);
    if (!services_.empty()) yaml += "\nservices:\n" + services_;
    if (!models_.empty()) yaml += "\nmodels:\n" + models_;
    if (!skills_.empty()) yaml += "\nskills:\n" + skills_;
    result_.files.push_back({"sentree.yaml", yaml});
    // Only what needs nobody elsewhere can run in virtual time.
    if (!needs_others_) {
      result_.files.push_back(
          {"scenarios/run.yaml", fmt::format("description: the imported system, for as long as its model checker "
                                             "looks\nclock: virtual\nduration: {}\n",
                                             duration_.empty() ? std::string("100 s") : duration_)});
    }
  }

  const SourceFolder& folder_;
  std::string main_;
  Imported result_;
  Diagnostics diagnostics_;
  std::string tree_;
  std::string mission_;
  std::string rate_;
  std::string duration_;
  bool repeats_ = false;
  std::deque<Chart> charts_;
  std::deque<RoamlLeaf> leaves_;
  std::deque<Instance> instances_;
  RosWorld world_;
  std::string services_;
  std::string models_;
  std::set<std::string> modelled_;  // services that models serve
  bool needs_others_ = false;       // some service is at an address
  std::string skills_;
};

}  // namespace

std::vector<std::string> roaml_mains(const SourceFolder& folder) {
  std::vector<std::string> mains;
  for (const std::string& file : folder.with_ending({".xml"})) {
    const auto source = folder.read(file);
    if (!source ||
        (source->find("<roaml") == std::string::npos && source->find("<convince_mc_tc") == std::string::npos))
      continue;
    const auto document = XmlDocument::parse(*source, folder.shown(file), {.lenient = true});
    if (document && is_main(document->root().local_name())) mains.push_back(file);
  }
  return mains;
}

Loaded<Imported> import_roaml(const SourceFolder& folder, const std::string& main) {
  return RoamlSystem(folder, main).run();
}

}  // namespace sentree::import
