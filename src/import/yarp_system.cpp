#include "sentree/import/detail/yarp_system.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include <fmt/format.h>

#include "sentree/import/detail/project_writer.h"
#include "sentree/import/detail/skill_chart.h"
#include "sentree/import/detail/snippet.h"
#include "sentree/import/detail/xml_rewrite.h"
#include "sentree/project/plan.h"
#include "sentree/text/xml.h"

namespace sentree::import {

using text::XmlDocument;
using text::XmlElement;

namespace {

constexpr std::array<std::string_view, 9> kBuiltinLeaves{"AlwaysSuccess",   "AlwaysFailure",   "SetBlackboard",
                                                         "UnsetBlackboard", "Script",          "ScriptCondition",
                                                         "Sleep",           "WasEntryUpdated", "SubTree"};

std::string stem(const std::string& file) { return std::filesystem::path(file).stem().string(); }
std::string base(const std::string& file) { return std::filesystem::path(file).filename().string(); }

struct Options {
  std::string file;
  std::map<std::string, std::string> values;
  std::map<std::string, int> lines;
};

struct Skill {
  std::string file;
  XmlDocument document;
  SkillFacts facts;
};

struct Interface {
  std::string file;       ///< In the system.
  std::string file_name;  ///< In interfaces/.
  std::string source;
  idl::Schema schema;
};

struct YarpLeaf {
  std::string name;
  std::string id;
  SourceSpan span;
  bool is_condition = false;
};

std::string unquoted(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\"'");
  if (begin == std::string_view::npos) return {};
  return std::string(text.substr(begin, text.find_last_not_of(" \t\r\"'") + 1 - begin));
}

class YarpSystem {
 public:
  explicit YarpSystem(const SourceFolder& folder) : folder_(folder) {}

  Loaded<Imported> run() {
    result_.form = "yarp-skills";
    read_interfaces();
    read_charts();
    read_options();
    read_launches();
    if (!read_tree()) return {.value = std::nullopt, .diagnostics = std::move(diagnostics_)};
    name_services();
    for (const YarpLeaf& leaf : leaves_) write_leaf(leaf);
    write_unused();
    write_monitors();
    write_project_file();
    std::stable_sort(result_.findings.begin(), result_.findings.end(),
                     [](const Finding& a, const Finding& b) { return a.span < b.span; });
    return {.value = std::move(result_), .diagnostics = std::move(diagnostics_)};
  }

 private:
  void find(Fate fate, SourceSpan span, std::string original, std::string reason) {
    result_.findings.push_back({fate, std::move(span), std::move(original), std::move(reason)});
  }

  [[nodiscard]] SourceSpan whole(const std::string& file) const { return SourceSpan{folder_.shown(file)}; }

  std::optional<std::string> read(const std::string& file) {
    auto source = folder_.read(file);
    if (source) return std::move(*source);
    find(Fate::kByHand, source.error().span, "", source.error().message);
    return std::nullopt;
  }

  std::optional<XmlDocument> parse(const std::string& file) {
    auto source = read(file);
    if (!source) return std::nullopt;
    auto document = XmlDocument::parse(std::move(*source), folder_.shown(file), {.lenient = true});
    if (document) return std::move(*document);
    find(Fate::kByHand, document.error().span, "", "not read, because it is no XML: " + document.error().message);
    return std::nullopt;
  }

  void read_interfaces() {
    std::set<std::string> taken;
    for (const std::string& file : folder_.with_ending({".thrift"})) {
      const auto source = read(file);
      if (!source) continue;
      const idl::IncludeReader include = [&](std::string_view path, std::string_view) -> Result<idl::IncludedFile> {
        const auto inside = SourceFolder::resolve(file, path);
        if (!inside) return fail("import.outside", fmt::format("\"{}\" is not in the imported folder", path));
        auto included = folder_.read(*inside);
        if (!included) return tl::unexpected(included.error());
        return idl::IncludedFile{folder_.shown(*inside), std::move(*included)};
      };
      auto schema = idl::Schema::load(*source, folder_.shown(file), include);
      for (const Diagnostic& problem : schema.diagnostics) {
        if (problem.severity == Severity::kError) find(Fate::kByHand, problem.span, "", problem.message);
      }
      if (!schema.value) continue;
      if (tells_ticks(*schema.value)) {
        find(Fate::kNotNeeded, whole(file), "", "ticks and halts of skills; Sentree has its own");
        continue;
      }
      const std::string name = base(file);
      if (!taken.insert(name).second) {
        find(Fate::kByHand, whole(file), "", "another interface file has the same name; rename one");
        continue;
      }
      add_enumerators(*schema.value);
      interfaces_.push_back({file, name, *source, std::move(*schema.value)});
    }
  }

  // The protocol between tree and skills.
  static bool tells_ticks(const idl::Schema& schema) {
    const auto& services = schema.services();
    return std::any_of(services.begin(), services.end(), [](const idl::Service& service) {
      return service.find("request_ack") != nullptr || service.find("request_tick") != nullptr ||
             (service.find("tick") != nullptr && service.find("halt") != nullptr);
    });
  }

  void add_enumerators(const idl::Schema& schema) {
    for (const idl::Enum& enumeration : schema.enumerations()) {
      for (const idl::Enumerator& enumerator : enumeration.enumerators) context_.enumerators.insert(enumerator.name);
    }
    for (const idl::Struct& structure : schema.structures()) context_.structures[structure.name] = &structure;
  }

  void read_charts() {
    std::vector<std::string> files = folder_.with_ending({".scxml"});
    // A copy lies deeper than the original.
    std::stable_sort(files.begin(), files.end(), [](const std::string& a, const std::string& b) {
      return std::count(a.begin(), a.end(), '/') < std::count(b.begin(), b.end(), '/');
    });
    std::map<std::string, std::string> known;
    for (const std::string& file : files) {
      auto document = parse(file);
      if (!document) continue;
      if (!is_skill_chart(*document)) {
        monitors_.push_back(file);
        continue;
      }
      SkillFacts facts = facts_of(*document);
      if (facts.name.empty()) facts.name = stem(file);
      if (const auto [first, added] = known.emplace(facts.name, file); !added) {
        find(Fate::kNotNeeded, whole(file), "",
             fmt::format("another chart has the same name; {} is taken", first->second));
        continue;
      }
      skills_.push_back({file, std::move(*document), std::move(facts)});
    }
    std::sort(monitors_.begin(), monitors_.end());
    std::sort(skills_.begin(), skills_.end(), [](const Skill& a, const Skill& b) { return a.file < b.file; });
  }

  void read_options() {
    for (const std::string& file : folder_.with_ending({".ini"})) {
      const auto source = read(file);
      if (!source) continue;
      Options options{file, {}, {}};
      std::istringstream lines(*source);
      int number = 0;
      for (std::string line; std::getline(lines, line);) {
        ++number;
        const std::size_t begin = line.find_first_not_of(" \t");
        if (begin == std::string::npos || line[begin] == '#' || line[begin] == '[' || line[begin] == ';') continue;
        // "key = value", and YARP's "key value".
        std::size_t split = line.find('=', begin);
        if (split == std::string::npos) split = line.find_first_of(" \t", begin);
        if (split == std::string::npos) continue;
        const std::string key = unquoted(std::string_view(line).substr(begin, split - begin));
        options.values[key] = unquoted(std::string_view(line).substr(split + 1));
        options.lines[key] = number;
      }
      options_.push_back(std::move(options));
    }
  }

  // "GoToSkill --from GoToKitchen.ini", wherever programs are started.
  void read_launches() {
    for (const std::string& file : folder_.with_ending({".yml", ".yaml", ".sh", ".xml"})) {
      const auto source = folder_.read(file);
      if (!source) continue;
      if (file.ends_with(".xml")) {
        if (source->find("<application") != std::string::npos) read_application(file);
        continue;
      }
      read_command_lines(*source);
    }
  }

  void read_command_lines(const std::string& source) {
    std::vector<std::string> words;
    std::string word;
    for (const char c : source + " ") {
      if (std::string_view(" \t\r\n\"';\\").find(c) == std::string_view::npos) {
        word += c;
      } else if (!word.empty()) {
        words.push_back(std::move(word));
        word.clear();
      }
    }
    for (std::size_t i = 1; i + 1 < words.size(); ++i) {
      if (words[i] == "--from") program_of_[base(words[i + 1])] = base(words[i - 1]);
    }
  }

  void read_application(const std::string& file) {
    const auto document = parse(file);
    if (!document || document->root().local_name() != "application") return;
    for (const XmlElement& part : document->root().children()) {
      if (part.local_name() == "module") {
        const std::string parameters = part.child("parameters") ? part.child("parameters").text() : std::string();
        const std::string name = part.child("name") ? unquoted(part.child("name").text()) : std::string();
        read_command_lines(fmt::format("{} {}", name, parameters));
      } else if (part.local_name() == "connection") {
        const std::string from = part.child("from") ? unquoted(part.child("from").text()) : std::string();
        const std::string to = part.child("to") ? unquoted(part.child("to").text()) : std::string();
        const std::string protocol = part.child("protocol") ? part.child("protocol").text() : std::string();
        const bool observed = protocol.find("portmonitor") != std::string::npos;
        find(Fate::kNotNeeded, part.span(), fmt::format("{} -> {}", from, to),
             observed ? "every call is observed by itself, and no port needs to be connected"
                      : "a call finds its service by the address in sentree.yaml");
      }
    }
  }

  bool read_tree() {
    std::optional<XmlDocument> best;
    int best_score = -1;
    std::string best_file;
    std::vector<std::string> trees;
    for (const std::string& file : folder_.with_ending({".xml"})) {
      const auto source = folder_.read(file);
      if (!source || source->find("<BehaviorTree") == std::string::npos) continue;
      auto document = parse(file);
      if (!document || document->root().local_name() != "root") continue;
      trees.push_back(file);
      int score = 0;
      for (const YarpLeaf& leaf : leaves_of(*document)) score += skill_of(leaf) != nullptr ? 1 : 0;
      if (score <= best_score) continue;
      best_score = score;
      best = std::move(document);
      best_file = file;
    }
    if (!best) {
      diagnostics_.push_back({Severity::kError, "import.no-tree",
                              "there is no Behavior Tree (.xml with <BehaviorTree>) in the folder", whole("")});
      return false;
    }
    std::set<std::string> taken;
    for (const std::string& file : trees) {
      const auto source = folder_.read(file);
      if (!source) continue;
      const std::string path = fmt::format("trees/{}.xml", unused_name(stem(file), taken));
      if (file == best_file) {
        mission_ = path;
      } else {
        find(Fate::kReview, whole(file), "",
             fmt::format("kept as {}; the mission is {}, most of whose leaves have skills", path, base(best_file)));
      }
      result_.files.push_back({path, *source});
    }
    leaves_ = leaves_of(*best);
    return true;
  }

  static std::vector<YarpLeaf> leaves_of(const XmlDocument& document) {
    std::vector<YarpLeaf> leaves;
    std::set<std::string> conditions;
    if (const XmlElement model = document.root().child("TreeNodesModel")) {
      for (const XmlElement& node : model.children()) {
        if (node.local_name() == "Condition") conditions.insert(std::string(node.attribute("ID").value_or("")));
      }
    }
    std::set<std::string> seen;
    std::vector<XmlElement> stack;
    for (const XmlElement& tree : document.root().children()) {
      if (tree.local_name() == "BehaviorTree") stack.push_back(tree);
    }
    while (!stack.empty()) {
      const XmlElement element = stack.back();
      stack.pop_back();
      const std::vector<XmlElement> children = element.children();
      stack.insert(stack.end(), children.rbegin(), children.rend());
      const std::string tag(element.local_name());
      if (!children.empty() || tag == "BehaviorTree") continue;
      const bool generic = tag == "Action" || tag == "Condition";
      const std::string id(generic ? element.attribute("ID").value_or("") : element.local_name());
      if (std::find(kBuiltinLeaves.begin(), kBuiltinLeaves.end(), id) != kBuiltinLeaves.end() || tag == "SubTree")
        continue;
      const std::string name(element.attribute("name").value_or(id));
      if (!seen.insert(name).second) continue;
      leaves.push_back({name, id, element.span(), tag == "Condition" || conditions.contains(id)});
    }
    return leaves;
  }

  [[nodiscard]] const Options* options_of(const YarpLeaf& leaf) const {
    for (const Options& options : options_) {
      for (const char* key : {"skill-name", "skill_name", "name"}) {
        const auto name = options.values.find(key);
        if (name != options.values.end() && name->second == leaf.name) return &options;
      }
    }
    for (const Options& options : options_) {
      if (stem(options.file) == leaf.name) return &options;
    }
    return nullptr;
  }

  [[nodiscard]] const Skill* skill_named(std::string_view name) const {
    for (const std::string_view ending : {"", "Skill"}) {
      if (!name.ends_with(ending)) continue;
      const std::string_view shorter = name.substr(0, name.size() - ending.size());
      for (const Skill& skill : skills_) {
        if (skill.facts.name == shorter) return &skill;
      }
    }
    return nullptr;
  }

  [[nodiscard]] const Skill* skill_of(const YarpLeaf& leaf) const {
    const Options* const options = options_of(leaf);
    if (options != nullptr) {
      const auto program = program_of_.find(base(options->file));
      if (program != program_of_.end()) {
        if (const Skill* skill = skill_named(program->second)) return skill;
      }
    }
    if (const Skill* skill = skill_named(leaf.name)) return skill;
    // "GoToKitchen" is run by "GoTo" if its file of options has what that needs.
    const Skill* best = nullptr;
    for (const Skill& skill : skills_) {
      const bool fits = options != nullptr && leaf.name.starts_with(skill.facts.name) &&
                        std::all_of(skill.facts.options.begin(), skill.facts.options.end(),
                                    [&](const SkillOption& option) { return options->values.contains(option.name); });
      if (fits && (best == nullptr || skill.facts.name.size() > best->facts.name.size())) best = &skill;
    }
    return best;
  }

  // What can stand in an address of YARP.
  static bool is_port(const std::string& name) {
    return !name.empty() && std::none_of(name.begin(), name.end(), [](char c) {
      return static_cast<unsigned char>(c) <= ' ' || c == '"' || c == '\\' || c == '?';
    });
  }

  // A service for each interface of each component.
  void name_services() {
    std::set<std::string> taken;
    for (const YarpLeaf& leaf : leaves_) taken.insert(leaf.name);
    taken.insert(std::begin(project::kReservedNames), std::end(project::kReservedNames));
    for (const Skill& skill : skills_) {
      for (const ServiceUse& use : skill.facts.services) {
        const auto key = std::pair(use.server, use.interface);
        if (services_.contains(key)) continue;
        const Interface* file = nullptr;
        for (const Interface& candidate : interfaces_) {
          if (candidate.schema.service(use.interface) != nullptr) file = &candidate;
        }
        const std::string name = unused_name(safe_name(use.server.empty() ? use.interface : use.server), taken);
        services_[key] = {name, file};
        if (file != nullptr && is_port(use.server)) {
          find(Fate::kReview, use.span, use.variable,
               fmt::format("the component stays as it is, at its port /{} of YARP, where {} of sentree.yaml calls it; "
                           "sentree run --yarp-server brings a name server if there is none",
                           use.server, name));
        } else if (file != nullptr) {
          find(Fate::kByHand, use.span, use.variable,
               fmt::format(
                   "the component is C++ and stays one, and which port it has is not said: write it as the address "
                   "of {} in sentree.yaml (at: \"yarp:/PORT\"), or let it serve {} at the one that stands there",
                   name, use.interface));
        } else {
          find(Fate::kByHand, use.span, use.interface,
               "no .thrift file of the folder defines this service; its calls are not translated");
        }
      }
    }
  }

  void write_leaf(const YarpLeaf& leaf) {
    const Skill* const skill = skill_of(leaf);
    if (skill == nullptr) {
      write_placeholder(leaf);
      return;
    }
    const std::string path = fmt::format("skills/{}.scxml", safe_name(skill->facts.name));
    if (used_.insert(skill).second) write_chart(*skill, path);
    std::string data;
    const Options* const options = options_of(leaf);
    for (const SkillOption& option : skill->facts.options) {
      const bool given = options != nullptr && options->values.contains(option.name);
      if (!given) {
        find(Fate::kByHand, option.span, option.name,
             fmt::format("no file of options gives it a value for {}; write it into data: of that skill", leaf.name));
        continue;
      }
      const std::string& value = options->values.at(option.name);
      const bool is_plain =
          !option.is_text && !value.empty() &&
          (value == "true" || value == "false" || value.find_first_not_of("+-.0123456789eE") == std::string::npos);
      const std::string text = is_plain ? value : yaml_text(value);
      data += fmt::format("{}{}: {}", data.empty() ? "" : ", ", option.name, text);
    }
    skill_lines_ += fmt::format("  {}: {{file: {}{}}}   # from {}\n", yaml_text(leaf.name), yaml_text(path),
                                data.empty() ? "" : fmt::format(", data: {{{}}}", data), skill->file);
  }

  void write_chart(const Skill& skill, const std::string& path) {
    SkillContext context = context_;
    for (const ServiceUse& use : skill.facts.services) {
      const auto& [name, file] = services_.at({use.server, use.interface});
      context.remotes[use.variable] = {name, file != nullptr ? file->schema.service(use.interface) : nullptr};
    }
    TranslatedChart chart = translate_skill_chart(skill.document, context);
    std::move(chart.findings.begin(), chart.findings.end(), std::back_inserter(result_.findings));
    result_.files.push_back({path, std::move(chart.source)});
  }

  void write_placeholder(const YarpLeaf& leaf) {
    const bool waits = leaf.id == "AlwaysRunning";
    find(waits ? Fate::kReview : Fate::kByHand, leaf.span, leaf.name,
         waits ? "a C++ node; its name says that it runs until it is halted, and so does the skill written for it"
               : "no chart runs this leaf (a C++ node?); its skill fails until you write it");
    std::string chart = fmt::format(
        "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\"{} "
        "initial=\"running\">\n",
        text::xml_attribute("name", leaf.name));
    if (waits) {
      chart +=
          "  <state id=\"running\">\n    <transition event=\"halt\" target=\"halted\"/>\n  </state>\n"
          "  <final id=\"halted\"/>\n";
    } else {
      chart +=
          "  <!-- Nothing in the imported system says what this leaf does. -->\n  <state id=\"running\">\n"
          "    <transition event=\"tick\" target=\"failure\">\n      <log expr=\"'this skill is still to be "
          "written'\"/>\n"
          "    </transition>\n  </state>\n  <final id=\"success\"/>\n  <final id=\"failure\"/>\n";
    }
    const std::string path = fmt::format("skills/{}.scxml", safe_name(leaf.name));
    result_.files.push_back({path, chart + "</scxml>\n"});
    skill_lines_ += fmt::format("  {}: {{file: {}}}\n", yaml_text(leaf.name), yaml_text(path));
  }

  void write_unused() {
    for (const Skill& skill : skills_) {
      if (!used_.contains(&skill))
        find(Fate::kByHand, whole(skill.file), skill.facts.name,
             "no leaf of the mission runs this chart; not imported");
    }
  }

  void write_monitors() {
    std::set<std::string> taken;
    for (const std::string& file : monitors_) {
      const auto source = folder_.read(file);
      if (!source) continue;
      const std::string name = unused_name(safe_name(stem(file)), taken);
      result_.files.push_back({fmt::format("monitors/{}.scxml", name), *source});
      const bool fails = source->find("id=\"failure\"") != std::string::npos;
      monitor_lines_ += fmt::format("#  - file: monitors/{}.scxml\n{}#    events:\n", name,
                                    fails ? "#    violated: [failure]\n" : "");
      const auto document = parse(file);
      std::set<std::string> events;
      if (document) collect_events(document->root(), events);
      for (const std::string& event : events) {
        monitor_lines_ += event == "tick" ? "#      tick: {on: mission.tick}\n"
                                          : fmt::format("#      {}: {{on: SERVICE.METHOD.reply, data: {{}}}}\n", event);
      }
      find(
          Fate::kByHand, whole(file), name,
          "a monitor: what raises its events is C++; say in sentree.yaml which observation each event is, and take the "
          "entry out of its comment");
    }
  }

  static void collect_events(const XmlElement& element, std::set<std::string>& events) {
    if (element.local_name() == "transition") {
      std::istringstream words{std::string(element.attribute("event").value_or(""))};
      for (std::string word; words >> word;) {
        if (!word.starts_with("done.") && !word.starts_with("error")) events.insert(word);
      }
    }
    for (const XmlElement& child : element.children()) collect_events(child, events);
  }

  void write_project_file() {
    std::string yaml = fmt::format(
        "# Imported; IMPORT.md says from what, and what is left to do.\nmission: {{file: {}}}\n", yaml_text(mission_));
    std::string services;
    std::set<const Interface*> used;
    int port = kFirstPort;
    for (const auto& [key, service] : services_) {
      const auto& [name, file] = service;
      if (file == nullptr) continue;
      used.insert(file);
      const std::string at =
          is_port(key.first) ? fmt::format("yarp:/{}", key.first) : fmt::format("tcp://127.0.0.1:{}", port++);
      services += fmt::format("  {}: {{interface: {}, at: \"{}\"}}\n", yaml_text(name),
                              yaml_text(fmt::format("{}/{}", file->file_name, key.second)), at);
    }
    if (!services.empty()) yaml += "\nservices:\n" + services;
    if (!skill_lines_.empty()) yaml += "\nskills:\n" + skill_lines_;
    if (!monitor_lines_.empty()) yaml += "\n# monitors:\n" + monitor_lines_;
    for (const Interface& file : interfaces_) result_.files.push_back({"interfaces/" + file.file_name, file.source});
    result_.files.push_back({"sentree.yaml", yaml});
  }

  const SourceFolder& folder_;
  Imported result_;
  Diagnostics diagnostics_;
  SkillContext context_;
  std::vector<Interface> interfaces_;
  std::vector<Skill> skills_;
  std::vector<std::string> monitors_;
  std::vector<Options> options_;
  std::map<std::string, std::string> program_of_;  ///< File of options → program started with it.
  std::vector<YarpLeaf> leaves_;
  std::map<std::pair<std::string, std::string>, std::pair<std::string, const Interface*>> services_;
  std::set<const Skill*> used_;
  std::string mission_;
  std::string skill_lines_;
  std::string monitor_lines_;
};

}  // namespace

bool holds_yarp_skills(const SourceFolder& folder) {
  for (const std::string& file : folder.with_ending({".scxml"})) {
    const auto source = folder.read(file);
    if (!source) continue;
    const auto document = XmlDocument::parse(*source, folder.shown(file), {.lenient = true});
    if (document && is_skill_chart(*document)) return true;
  }
  return false;
}

Loaded<Imported> import_yarp_skills(const SourceFolder& folder) { return YarpSystem(folder).run(); }

}  // namespace sentree::import
