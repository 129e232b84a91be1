#include "layers.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <sstream>

namespace sentree::layers {
namespace {

// What a user of a library would have to install and compile because of our header.
constexpr std::array<std::string_view, 12> kHeavy = {"thrift/",   "boost/",   "duktape",   "duk_config",
                                                     "yaml-cpp/", "simdjson", "nlohmann/", "openssl/",
                                                     "fmt/",      "CLI/",     "gtest/",    "zmq"};

struct Include {
  int line;
  bool quoted;
  std::string path;
};

// `#include "x"` or `#include <x>`, with blanks anywhere the preprocessor allows them.
std::optional<Include> parse_include(std::string_view line, int number) {
  const auto skip_blanks = [&] { line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size())); };
  const auto eat = [&](std::string_view word) {
    skip_blanks();
    if (!line.starts_with(word)) return false;
    line.remove_prefix(word.size());
    return true;
  };
  if (!eat("#") || !eat("include")) return std::nullopt;
  skip_blanks();
  if (line.empty() || (line[0] != '"' && line[0] != '<')) return std::nullopt;
  const bool quoted = line[0] == '"';
  const std::size_t end = line.find(quoted ? '"' : '>', 1);
  if (end == std::string_view::npos) return std::nullopt;
  return Include{number, quoted, std::string(line.substr(1, end - 1))};
}

std::vector<Include> includes_of(const SourceFile& file) {
  std::vector<Include> includes;
  std::istringstream lines(file.text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    if (auto include = parse_include(line, ++number)) includes.push_back(std::move(*include));
  }
  return includes;
}

std::string library_of(std::string_view path) { return std::string(path.substr(0, path.find('/'))); }

constexpr std::string_view kOurs = "sentree/";

// As cmake/Install.cmake has it: headers of a library's folder, but no helpers of its tests, and none of folders
// within.
bool is_installed(std::string_view path) {
  const std::size_t slash = path.find('/');
  return slash == path.rfind('/') && !path.substr(slash + 1).starts_with("test_");
}

// Also what tests share, which stands in detail/. The command `test` is none.
bool is_of_tests(std::string_view path) {
  return (path.ends_with("_test.cpp") && !path.ends_with("/cmd_test.cpp")) ||
         path.find("/detail/test_") != std::string_view::npos;
}

class Checker {
 public:
  explicit Checker(const std::vector<SourceFile>& files) {
    for (const SourceFile& file : files) includes_[file.path] = includes_of(file);
  }

  std::vector<std::string> run() {
    for (const auto& [path, includes] : includes_) {
      for (const Include& include : includes) check(path, include);
      for (const SecrecyRule& rule : secrecy_rules()) {
        if (path.starts_with(rule.files) && !path.ends_with("_test.cpp")) check_secrecy(path, rule);
      }
    }
    return std::move(found_);
  }

  [[nodiscard]] std::set<std::string> needlessly_public(std::vector<std::string> needed) const {
    std::set<std::string> out;
    for (const auto& [path, includes] : includes_) {
      if (path.ends_with(".h") && is_installed(path) && library_of(path) != "cli") out.insert(path);
      for (const Include& include : includes) {
        if (include.path.starts_with(kOurs) && library_of(include.path.substr(kOurs.size())) != library_of(path) &&
            !is_of_tests(path))
          needed.push_back(include.path.substr(kOurs.size()));
      }
    }
    while (!needed.empty()) {
      const std::string header = std::move(needed.back());
      needed.pop_back();
      if (out.erase(header) == 0) continue;
      for (const Include& include : includes_.at(header)) {
        if (include.path.starts_with(kOurs)) needed.push_back(include.path.substr(kOurs.size()));
      }
    }
    return out;
  }

 private:
  void report(const std::string& path, int line, const std::string& what) {
    found_.push_back("src/" + path + ":" + std::to_string(line) + ": " + what);
  }

  void check(const std::string& path, const Include& include) {
    if (path.ends_with(".h") && is_installed(path)) {
      if (include.path.starts_with(kOurs) && !is_installed(include.path.substr(kOurs.size())))
        report(path, include.line, "public header includes the private \"" + include.path + "\"");
      for (const std::string_view heavy : kHeavy) {
        if (include.path.starts_with(heavy))
          report(path, include.line, "public header includes <" + include.path + ">; keep it in a .cpp");
      }
    }
    if (!include.path.starts_with(kOurs)) {
      const std::string beside = library_of(path) + "/" + include.path;
      // The command is a program of its own, not a library that others include.
      if (include.quoted && library_of(path) != "cli" && includes_.count(beside) != 0) {
        report(path, include.line, "write \"sentree/" + beside + "\" instead of \"" + include.path + "\"");
      }
      return;
    }
    const std::string target = include.path.substr(kOurs.size());
    const std::string from = library_of(path);
    const std::string to = library_of(target);
    if (includes_.count(target) == 0) report(path, include.line, "there is no header \"" + include.path + "\"");
    if (from == to) return;
    if (!is_installed(target) && !is_of_tests(path))
      report(path, include.line, "\"" + include.path + "\" is private to " + to);
    const auto& rules = library_rules();
    const auto rule = std::find_if(rules.begin(), rules.end(), [&](const LibraryRule& r) { return r.library == from; });
    if (rule == rules.end()) {
      report(path, include.line, "library " + from + " is not in the table of layers");
    } else if (std::find(rule->may_include.begin(), rule->may_include.end(), to) == rule->may_include.end()) {
      report(path, include.line, from + " must not include " + to);
    }
  }

  // Follows includes breadth first; reports the include of the file itself through which the secret comes.
  void check_secrecy(const std::string& path, const SecrecyRule& rule) {
    for (const Include& first : includes_.at(path)) {
      std::vector<std::string> queue = {first.path};
      std::set<std::string> seen;
      while (!queue.empty()) {
        const std::string current = queue.back();
        queue.pop_back();
        const std::string header = current.starts_with("sentree/") ? current.substr(8) : current;
        if (!seen.insert(header).second) continue;
        if (header == rule.header) {
          report(path, first.line,
                 "must not see \"sentree/" + header + "\", not even through others: " + std::string(rule.why));
          break;
        }
        if (const auto known = includes_.find(header); known != includes_.end()) {
          for (const Include& next : known->second) queue.push_back(next.path);
        }
      }
    }
  }

  std::map<std::string, std::vector<Include>> includes_;
  std::vector<std::string> found_;
};

}  // namespace

const std::vector<LibraryRule>& library_rules() {
  static const std::vector<LibraryRule> kRules = {
      {"base", {}},
      {"text", {"base"}},
      {"idl", {"base", "text"}},
      {"draw", {"base"}},
      {"bt", {"base", "text"}},
      {"nav2", {"base", "bt"}},
      {"exec", {"base", "bt"}},
      {"groot", {"base", "text", "bt", "exec"}},
      {"scxml", {"base", "text"}},
      {"graph", {"base", "text", "draw", "bt", "scxml"}},
      {"monitor", {"base", "text", "scxml"}},
      {"http", {"base", "text"}},
      {"rpc", {"base", "text", "idl"}},
      {"yarp", {"base", "text", "idl", "rpc"}},
      {"ros", {"base", "idl", "rpc"}},
      {"sim", {"base", "text"}},
      {"record", {"base", "text", "idl"}},
      {"project", {"base", "text", "idl", "bt", "nav2", "scxml", "monitor", "rpc", "sim"}},
      {"design", {"base", "text", "idl", "draw", "bt", "scxml", "graph", "monitor", "sim", "project"}},
      {"lsp", {"base", "text", "idl", "draw", "bt", "scxml", "graph", "monitor", "record", "project", "design"}},
      {"import", {"base", "text", "idl", "bt", "nav2", "scxml", "project"}},
      {"mission", {"base", "text", "idl", "bt", "scxml", "monitor", "sim", "project"}},
      {"verify", {"base", "text", "idl", "bt", "scxml", "monitor", "project", "mission"}},
      {"runtime", {"base", "text", "idl", "bt", "scxml", "monitor", "sim", "project", "mission"}},
      {"processes", {"base", "text", "idl", "bt", "scxml", "monitor", "rpc", "sim", "project", "mission", "runtime"}},
      {"campaign", {"base", "text", "idl", "bt", "scxml", "monitor", "sim", "project", "mission", "runtime"}},
      {"replay", {"base", "text", "idl", "bt", "scxml", "monitor", "sim", "record", "project", "mission", "runtime"}},
      {"studio",
       {"base", "text", "idl", "draw", "bt", "scxml", "graph", "monitor", "http", "sim", "record", "project", "design",
        "lsp", "mission", "runtime", "campaign", "replay", "groot"}},
      {"cli",
       {"base",    "text",      "idl",      "draw",   "bt",      "nav2",   "exec", "scxml",  "graph",   "monitor",
        "http",    "rpc",       "sim",      "record", "project", "design", "lsp",  "import", "mission", "verify",
        "runtime", "processes", "campaign", "replay", "studio",  "groot",  "yarp", "ros"}},
  };
  return kRules;
}

const std::vector<SecrecyRule>& secrecy_rules() {
  static const std::vector<SecrecyRule> kRules = {
      {"sim/localization", "sim/ground_truth.h", "localization estimates from sensors only"},
      {"sim/likelihood_field", "sim/ground_truth.h", "localization estimates from sensors only"},
      {"sim/localization", "sim/state.h", "the simulation's state holds the true pose"},
      {"sim/particle_filter", "sim/ground_truth.h", "localization estimates from sensors only"},
      {"sim/navigator", "sim/ground_truth.h", "navigation goes by what localization believes"},
      {"sim/route", "sim/ground_truth.h", "navigation goes by what localization believes"},
      {"sim/obstacle_layer", "sim/ground_truth.h", "navigation goes by what the laser sees"},
  };
  return kRules;
}

std::vector<std::string> violations(const std::vector<SourceFile>& files) { return Checker(files).run(); }

std::set<std::string> needlessly_public(const std::vector<SourceFile>& files, std::vector<std::string> for_embedders) {
  return Checker(files).needlessly_public(std::move(for_embedders));
}

}  // namespace sentree::layers
