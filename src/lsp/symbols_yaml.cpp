// Names in projects, scenarios and worlds.

#include <algorithm>
#include <filesystem>
#include <optional>

#include <fmt/format.h>

#include "sentree/lsp/detail/collector.h"
#include "sentree/lsp/lines.h"
#include "sentree/lsp/symbols.h"

namespace sentree::lsp {

namespace {

// Where a scalar's text stands; nothing where it is not written as it reads.
std::optional<std::size_t> place_of(std::string_view text, const Offsets& offsets, const text::YamlNode& scalar) {
  const std::size_t from = offsets.of(scalar.span) + (scalar.quoted ? 1 : 0);
  if (scalar.scalar.empty() || from > text.size() || text.substr(from, scalar.scalar.size()) != scalar.scalar)
    return std::nullopt;
  return from;
}

class YamlCollector : public Collector {
 public:
  YamlCollector(std::string_view text, bool is_project, std::string folder, const Names& names)
      : Collector(text, names), is_project_(is_project), folder_(std::move(folder)), offsets_(text) {}

  // What calls, constants of skills and the blackboard are given, and where worlds begin.
  void places(const text::YamlNode& node, bool is_given = false, bool in_world = false) {
    static const std::set<std::string, std::less<>> kGiven{"args",  "data",       "blackboard",
                                                           "ports", "parameters", "value"};
    if (const auto from = node.is_scalar() && is_given ? place_of(node) : std::nullopt)
      place(*from, *from + node.scalar.size());
    for (const text::YamlNode& item : node.items) places(item, is_given, in_world);
    for (const auto& [key, value] : node.entries) {
      const std::string& name = key.scalar;
      if (const auto from = place_of(key); from && name.find('.') != std::string::npos) place_in_path(*from, name);
      if (in_world && (name == "locations" || name == "areas")) {
        for (const auto& [place_name, where] : value.entries) {
          if (const auto from = place_of(place_name)) place(*from, *from + place_name.scalar.size());
        }
        continue;
      }
      const bool begins = in_world && (name == "start" || name == "pose");
      places(value, is_given || begins || kGiven.contains(name), in_world || (name == "world" && value.is_mapping()));
    }
  }

  void section(const text::YamlNode& root) {
    if (const text::YamlNode* const processes = root.find("processes")) {
      for (const auto& [name, entry] : processes->entries) processes_.insert(name.scalar);
    }
    for (const auto& [key, value] : root.entries) {
      if (key.scalar == "services" || key.scalar == "observe") {
        for (const auto& [name, entry] : value.entries) {
          scalar(name, SymbolKind::kService, is_project_);
          interface(entry);
          if (const text::YamlNode* publish = entry.find("publish")) methods(name.scalar, *publish);
        }
      } else if (key.scalar == "skills") {
        for (const auto& [name, entry] : value.entries) {
          if (const auto from = place_of(name)) path(*from, *from + name.scalar.size(), false);
          any(entry, {});
        }
      } else if (key.scalar == "monitors" && value.is_mapping()) {
        for (const auto& [name, verdict] : value.entries) scalar(name, SymbolKind::kRequirement, false);
      } else if (key.scalar == "monitors") {
        for (const text::YamlNode& entry : value.items) monitor(entry);
      } else if (key.scalar == "override" || key.scalar == "expect") {
        section(value);
      } else if (key.scalar == "orders") {
        for (const text::YamlNode& order : value.items) {
          const text::YamlNode* const first = order.find("first");
          const auto from = first != nullptr && first->is_scalar() ? place_of(*first) : std::nullopt;
          if (from) dotted(*from, *from + first->scalar.size());
        }
      } else if (key.scalar == "mission") {
        if (const text::YamlNode* tree = value.find("tree")) scalar(*tree, SymbolKind::kTree, false);
      } else {
        any(value, key.scalar);
      }
    }
  }

 private:
  // world.locations.NAME, as parameters of campaigns are written.
  void place_in_path(std::size_t from, std::string_view path) {
    for (const std::string_view section : {"locations.", "areas."}) {
      const std::size_t at = path.find(section);
      if (at == std::string_view::npos || (at > 0 && path[at - 1] != '.')) continue;
      const std::size_t begin = at + section.size();
      place(from + begin, from + std::min(path.find('.', begin), path.size()));
    }
  }

  void scalar(const text::YamlNode& node, SymbolKind kind, bool defines) {
    if (const auto from = place_of(node)) add(kind, node.scalar, *from, *from + node.scalar.size(), defines);
  }

  void interface(const text::YamlNode& entry) {
    const text::YamlNode* const written = entry.find("interface");
    if (written == nullptr) return;
    const auto from = place_of(*written);
    const std::size_t slash = written->scalar.rfind('/');
    if (!from || slash == std::string::npos) return;
    for (const auto& [name, service] : names_.services) {
      if (service.interface == written->scalar.substr(slash + 1) &&
          service.file.ends_with(written->scalar.substr(0, slash)))
        return add(SymbolKind::kInterface, fmt::format("{}#{}", service.file, service.interface), *from + slash + 1,
                   *from + written->scalar.size());
    }
  }

  void methods(const std::string& name, const text::YamlNode& publish) {
    const auto service = names_.services.find(name);
    if (service == names_.services.end() || !service->second.service) return;
    for (const auto& [method, rate] : publish.entries) {
      const idl::Method* const known = service->second.service->find(method.scalar);
      const auto from = place_of(method);
      if (known == nullptr || !from) continue;
      const Symbol symbol = method_symbol(*known, service->second.file);
      add(symbol.kind, symbol.name, *from, *from + method.scalar.size());
    }
  }

  void monitor(const text::YamlNode& entry) {
    const text::YamlNode* const file = entry.find("file");
    const std::string chart =
        file == nullptr ? "" : (std::filesystem::path(folder_) / file->scalar).lexically_normal().string();
    if (const text::YamlNode* states = entry.find("violated")) {
      const auto state = [&](const text::YamlNode& node) {
        if (const auto from = place_of(node))
          add(SymbolKind::kState, fmt::format("{}#{}", chart, node.scalar), *from, *from + node.scalar.size());
      };
      if (states->is_scalar()) state(*states);
      for (const text::YamlNode& item : states->items) state(item);
    }
    const text::YamlNode* const name = entry.find("name");
    if (name != nullptr) {
      scalar(*name, SymbolKind::kRequirement, true);
    } else if (file != nullptr && chart.ends_with(".scxml")) {
      const std::string stem = std::filesystem::path(chart).stem().string();
      if (const auto from = place_of(*file)) {
        const std::size_t in = file->scalar.rfind(stem);
        if (in != std::string::npos) add(SymbolKind::kRequirement, stem, *from + in, *from + in + stem.size(), true);
      }
    }
    for (const auto& [key, value] : entry.entries) {
      if (key.scalar == "events" || key.scalar == "gate") any(value, key.scalar);
    }
  }

  // Observations, services and nodes, wherever they are named; texts of other kinds are not looked into.
  void any(const text::YamlNode& node, std::string_view key) {
    static const std::set<std::string, std::less<>> kOther{
        "description", "file",     "world",   "at",        "data",  "args",      "reason",  "rate",
        "palette",     "title",    "plugins", "interface", "name",  "model",     "choices", "orders",
        "loop",        "fair",     "value",   "status",    "clock", "component", "listen",  "path",
        "by",          "protocol", "tree",    "number",    "count", "place",     "state",   "chart"};
    if (kOther.contains(key)) return;
    if (node.is_scalar()) {
      const auto from = place_of(node);
      if (!from) return;
      const std::size_t to = *from + node.scalar.size();
      if (key == "node")
        path(*from, to, false);
      else if (key == "monitor")
        scalar(node, SymbolKind::kRequirement, false);
      else if ((key != "kill" && key != "restart") || !processes_.contains(node.scalar))
        dotted(*from, to);
    }
    for (const text::YamlNode& item : node.items) any(item, key);
    for (const auto& [name, value] : node.entries) any(value, name.scalar);
    if (node.is_mapping()) breakpoint(node);
  }

  // {chart: "skill:LEAF", state: ID} or {chart: "monitor:NAME", state: ID}.
  void breakpoint(const text::YamlNode& node) {
    const text::YamlNode* const written = node.find("chart");
    const auto from = written != nullptr && written->is_scalar() ? place_of(*written) : std::nullopt;
    if (!from) return;
    const std::string_view chart = written->scalar;
    const std::size_t to = *from + chart.size();
    std::string file;
    if (constexpr std::string_view kSkill = "skill:"; chart.starts_with(kSkill)) {
      path(*from + kSkill.size(), to, true);
      const std::size_t dot = chart.rfind('.');
      const auto leaf = names_.leaves.find(chart.substr(dot == std::string_view::npos ? kSkill.size() : dot + 1));
      if (leaf != names_.leaves.end()) file = leaf->second;
    } else if (constexpr std::string_view kMonitor = "monitor:"; chart.starts_with(kMonitor)) {
      const std::string name(chart.substr(kMonitor.size()));
      add(SymbolKind::kRequirement, name, *from + kMonitor.size(), to);
      if (const auto monitor = names_.monitors.find(name); monitor != names_.monitors.end()) file = monitor->second;
    }
    const text::YamlNode* const state = node.find("state");
    const auto at = state != nullptr && state->is_scalar() && !file.empty() ? place_of(*state) : std::nullopt;
    if (at) add(SymbolKind::kState, fmt::format("{}#{}", file, state->scalar), *at, *at + state->scalar.size());
  }

  [[nodiscard]] std::optional<std::size_t> place_of(const text::YamlNode& scalar) const {
    return lsp::place_of(text_, offsets_, scalar);
  }

  bool is_project_;
  std::string folder_;
  Offsets offsets_;
  std::set<std::string, std::less<>> processes_;  // of a scenario: what they are called is killed first
};

}  // namespace

Occurrences occurrences_in_yaml(std::string_view text, const text::YamlNode& root, bool is_project,
                                const std::string& folder, const Names& names) {
  YamlCollector collector(text, is_project, folder, names);
  collector.section(root);
  collector.places(root);
  return std::move(collector.found);
}

Occurrences occurrences_in_world(std::string_view text, const text::YamlNode& root) {
  Occurrences found;
  const Offsets offsets(text);
  std::set<std::string, std::less<>> names;
  for (const char* section : {"locations", "areas"}) {
    const text::YamlNode* const places = root.find(section);
    if (places == nullptr) continue;
    for (const auto& [name, value] : places->entries) {
      names.insert(name.scalar);
      if (const auto from = place_of(text, offsets, name))
        found.push_back({{SymbolKind::kLocation, name.scalar}, *from, *from + name.scalar.size(), true});
    }
  }
  // Where a robot begins, and where a station is.
  const auto uses = [&](const auto& self, const text::YamlNode& node) -> void {
    for (const text::YamlNode& item : node.items) self(self, item);
    for (const auto& [key, value] : node.entries) {
      self(self, value);
      if ((key.scalar != "start" && key.scalar != "pose") || !value.is_scalar() || !names.contains(value.scalar))
        continue;
      if (const auto from = place_of(text, offsets, value))
        found.push_back({{SymbolKind::kLocation, value.scalar}, *from, *from + value.scalar.size(), false});
    }
  };
  uses(uses, root);
  return found;
}

}  // namespace sentree::lsp
