// One slip in a file of an example: `sentree check` tells it, or it changes nothing, or it is something that nobody can
// know to be a slip.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/campaign/check.h"
#include "sentree/project/part_cache.h"
#include "sentree/project/plan.h"
#include "sentree/runtime/run.h"

namespace sentree {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kSeed = 16;
constexpr std::size_t kMutations = 2000;
// Tests that share them.
constexpr std::size_t kSlices = 20;
// Virtual seconds of each run that is compared.
constexpr Duration kRunMax = std::chrono::seconds(60);
constexpr Duration kWholeRunMax = std::chrono::minutes(10);

std::string read(const fs::path& file) {
  std::stringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}
void write(const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_word(char c) { return is_letter(c) || is_digit(c); }

struct Mutation {
  std::size_t at = 0;  ///< In the text as it was.
  std::size_t length = 0;
  std::string by;
  bool is_word = false;  ///< A whole word gave way to another one.
};

std::string mutate(const std::string& text, const Mutation& m) {
  return text.substr(0, m.at) + m.by + text.substr(m.at + m.length);
}

// What slips are: a letter too many, too few, another one, two exchanged; another word of the same file; a word too
// few.
Mutation draw(const std::string& text, Rng& rng) {
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(rng.below(n)); };
  for (;;) {
    const std::size_t at = below(text.size());
    if (text[at] == '\n' || static_cast<unsigned char>(text[at]) >= 0x80) continue;
    switch (below(6)) {
      case 0: return {at, 1, ""};
      case 1: return {at, 1, std::string(2, text[at])};
      case 2: {
        constexpr std::string_view kLetters =
            "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_-.:/'\"<>=&!{}[](),0123456789 ";
        const char other = kLetters[below(kLetters.size())];
        if (other == text[at]) continue;
        return {at, 1, std::string(1, other)};
      }
      case 3:
        if (at + 1 >= text.size() || text[at] == text[at + 1] || text[at + 1] == '\n') continue;
        return {at, 2, std::string{text[at + 1], text[at]}};
      default: {
        if (!is_word(text[at])) continue;
        std::size_t begin = at, end = at;
        while (begin > 0 && is_word(text[begin - 1])) --begin;
        while (end < text.size() && is_word(text[end])) ++end;
        if (below(4) == 0) return {begin, end - begin, ""};
        const std::size_t from = below(text.size());
        if (!is_word(text[from])) continue;
        std::size_t other = from, other_end = from;
        while (other > 0 && is_word(text[other - 1])) --other;
        while (other_end < text.size() && is_word(text[other_end])) ++other_end;
        const std::string word = text.substr(other, other_end - other);
        if (word == text.substr(begin, end - begin)) continue;
        return {begin, end - begin, word, true};
      }
    }
  }
}

// Places that are written for people: comments, descriptions, sentences.
std::vector<bool> free_text(const std::string& file, const std::string& text) {
  std::vector<bool> free(text.size() + 1, false);
  const auto mark = [&](std::size_t from, std::size_t to) {
    std::fill(free.begin() + static_cast<long>(from), free.begin() + static_cast<long>(std::min(to, text.size())),
              true);
  };
  const auto spans = [&](const std::string& open, const std::string& close) {
    for (std::size_t at = text.find(open); at != std::string::npos; at = text.find(open, at + 1)) {
      const std::size_t end = text.find(close, at + open.size());
      mark(at + open.size(), end);
    }
  };
  if (file.ends_with(".xml") || file.ends_with(".scxml")) {
    spans("<!--", "-->");
    // What a port is for.
    for (const char* kind : {"input_port", "output_port"}) {
      for (std::size_t at = text.find(std::string("<") + kind); at != std::string::npos;
           at = text.find(std::string("<") + kind, at + 1)) {
        const std::size_t from = text.find('>', at);
        if (text[from - 1] != '/') mark(from + 1, text.find('<', from));
      }
    }
    return free;
  }
  spans(file.ends_with(".thrift") ? "//" : "#", "\n");
  if (file.ends_with(".yaml")) spans("description:", "\n");
  if (file.ends_with(".req")) {
    for (std::size_t at = text.find('"'); at != std::string::npos; at = text.find('"', at + 1)) {
      const std::size_t end = text.find('"', at + 1);
      mark(at + 1, end);
      at = end;
    }
  }
  return free;
}

bool is_number(std::string_view text) {
  return text.find_first_not_of("0123456789.") == std::string_view::npos &&
         text.find_first_of("0123456789") != std::string_view::npos;
}

// The word around a place, dots included.
std::string_view word_at(std::string_view text, std::size_t at) {
  std::size_t begin = at, end = at;
  const auto belongs = [&](char c) { return is_word(c) || c == '.'; };
  while (begin > 0 && belongs(text[begin - 1])) --begin;
  while (end < text.size() && belongs(text[end])) ++end;
  return text.substr(begin, end - begin);
}

// Why nobody can know that it is a slip; empty: somebody should.
std::string excuse(const std::string& file, const std::string& text, const std::string& mutated, const Mutation& m) {
  const bool is_xml = file.ends_with(".xml") || file.ends_with(".scxml");
  const std::size_t line = text.rfind('\n', m.at) + 1;
  const std::string before = text.substr(line, m.at - line);
  if (is_number(word_at(text, m.at)) && is_number(word_at(mutated, m.at))) return "another number";
  const char behind = text[m.at + m.length];
  const bool is_value = is_xml ? std::count(before.begin(), before.end(), '"') % 2 == 1 : behind != ':';
  if (m.is_word && is_value) return "another name that is there too";
  constexpr std::string_view kOperators = "<>=!&|+-*/%";
  const auto is_operator = [&](char c) { return kOperators.find(c) != std::string_view::npos; };
  if (is_operator(text[m.at]) && (m.by.empty() || is_operator(m.by[0])) && is_value) return "another operator";
  // What something is called for people, and nobody else names.
  if (file.ends_with(".req") && before.find_first_of(" :=(") == std::string::npos) return "the name of a requirement";
  if (file.ends_with(".xml") && before.rfind("name=\"") != std::string::npos &&
      before.find('"', before.rfind("name=\"") + 6) == std::string::npos)
    return "the name of a node";
  if (const auto label = before.rfind("label=\"");
      is_xml && label != std::string::npos && before.find('"', label + 7) == std::string::npos)
    return "the label of a log";
  // A model is called by its name in the recording alone.
  if (file.ends_with(".yaml") && before.find("{file:") != std::string::npos &&
      before.rfind("name: ") != std::string::npos && before.find(',', before.rfind("name: ")) == std::string::npos)
    return "the name of a part";
  // What a scenario puts there has the name that it gets.
  if (file.starts_with("scenarios/") && before.find("simulation.addObstacle") != std::string::npos &&
      before.rfind("id: ") != std::string::npos && before.find(',', before.rfind("id: ")) == std::string::npos)
    return "the name of an obstacle";
  if (file.starts_with("scenarios/") && before.starts_with("duration: ")) return "another duration";
  const bool is_quoted = is_xml && std::count(before.begin(), before.end(), '\'') % 2 == 1;
  if (is_quoted && file.starts_with("models/")) return "a text that a model makes up";
  // A sentence in quotes, in an expression.
  if (const auto open = before.rfind('\''); is_quoted) {
    const std::string_view sentence = std::string_view(text).substr(line + open + 1);
    if (sentence.substr(0, sentence.find('\'')).find(' ') != std::string_view::npos) return "a sentence in quotes";
  }
  if (text[m.at] == ' ' && m.by.find_first_not_of(' ') == std::string::npos) return "spaces in a text";
  if (m.length == 2 && m.by.find(' ') != std::string::npos && m.by.find('\'') != std::string::npos)
    return "spaces in a text";
  // "a.b." is all events of "a.b" (SCXML, 3.12.1).
  if (m.by.empty() && before.ends_with('.') && behind == '"' && before.rfind("event=\"") != std::string::npos)
    return "an event by less of its name";
  if (file.ends_with(".thrift") && is_word(text[m.at])) return "a name of the interface itself";
  if (file.ends_with(".yaml") && before.find("://") != std::string::npos) return "the name of a host";
  // examples/requirements has neither a world nor a mission that names places.
  if (file == "requirements/twelve.req" && is_word(text[m.at])) return "a name that nothing in the project knows";
  return {};
}

class Example {
 public:
  /// @param folder  A copy; its neighbours are there too, whose worlds it may name.
  explicit Example(fs::path folder) : name_(folder.filename().string()), folder_(std::move(folder)) {
    for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
      const std::string extension = entry.path().extension().string();
      if (extension == ".yaml" || extension == ".xml" || extension == ".scxml" || extension == ".req" ||
          extension == ".thrift")
        files_.push_back(fs::relative(entry.path(), folder_).string());
    }
    std::sort(files_.begin(), files_.end());
  }
  [[nodiscard]] const fs::path& folder() const { return folder_; }
  /// What checks of it have in common.
  [[nodiscard]] project::PartCache& parts() { return parts_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const std::vector<std::string>& files() const { return files_; }

  struct Behaviour {
    std::uint64_t hash = 0;
    bool as_expected = true;
  };
  // What a mission is that nothing here runs: its tree, services, charts and requirements.
  static std::uint64_t shape(const project::Plan& plan) {
    std::uint64_t hash = 0;
    const auto add = [&](std::string_view text) { hash = hash_combine(hash, hash_bytes(text)); };
    for (bt::NodeId node = 0; node < plan.tree.size(); ++node) {
      add(plan.tree.path(node));
      add(plan.tree.registration(node));
      for (const auto& port : plan.tree.ports(node)) add(std::string(port.name) + "=" + std::string(port.text));
    }
    for (const auto& [name, service] : plan.services) add(name + service.interface + service.at);
    for (const auto& leaf : plan.leaves) add(leaf.name + leaf.at);
    hash = hash_combine(hash, static_cast<std::uint64_t>(plan.scenario.duration.count()));
    for (const monitor::Model& model : plan.monitors) {
      add(model.name());
      if (model.origin() != nullptr) add(model.chart().source());
    }
    return hash;
  }

  // What runs somewhere else, or in real time.
  static bool runs_here(const project::Plan& plan) {
    return plan.scenario.virtual_time &&
           std::all_of(plan.leaves.begin(), plan.leaves.end(), [](const auto& leaf) { return leaf.at.empty(); }) &&
           std::all_of(plan.services.begin(), plan.services.end(), [](const auto& entry) {
             return entry.second.at == "sim" || entry.second.at == "model" || entry.second.at == "topics";
           });
  }

  // What every scenario does and decides, in its first `run_max`.
  [[nodiscard]] Behaviour behaviour(Duration run_max = kRunMax) const {
    Behaviour result;
    const auto mix = [&](std::uint64_t hash) { result.hash = hash_combine(result.hash, hash); };
    auto project = project::load_project(folder());
    if (!project.ok()) return result;
    std::vector<project::Scenario> scenarios;
    for (const std::string& file : files_) {
      if (!file.ends_with(".yaml") || file.find('/') == std::string::npos || file.starts_with("world/")) continue;
      if (auto scenario = project::load_scenario(folder_ / file); scenario.ok())
        scenarios.push_back(std::move(*scenario.value));
    }
    if (scenarios.empty()) {
      scenarios.push_back(project::plain_scenario(std::move(*project.value)));
      scenarios.back().virtual_time = true;
    }
    for (project::Scenario& scenario : scenarios) {
      const bool is_cut = scenario.duration > run_max;
      scenario.duration = std::min(scenario.duration, run_max);
      const auto plan = project::prepare(std::move(scenario));
      if (!plan.ok()) continue;
      if (!runs_here(*plan.value)) {
        mix(shape(*plan.value));
        continue;
      }
      runtime::RunOptions options;
      options.listeners.push_back([&](const Message& message) {
        mix(hash_bytes(message.name + message.source));
        mix(static_cast<std::uint64_t>(message.time.time_since_epoch().count()));
        mix(message.data.hash());
      });
      const auto report = runtime::Run(*plan.value, std::move(options)).execute();
      if (!report.unmet.empty() && !is_cut) result.as_expected = false;
      for (const auto& monitor : report.monitors)
        mix(hash_bytes(monitor.name + std::string(to_string(monitor.verdict)) + monitor.vacuity));
    }
    return result;
  }
  /// Of the example as it is; asked first while it is.
  [[nodiscard]] const Behaviour& before() {
    if (!before_) before_ = behaviour();
    return *before_;
  }

 private:
  std::string name_;
  fs::path folder_;
  std::vector<std::string> files_;
  std::optional<Behaviour> before_;
  project::PartCache parts_;
};

class Mutations : public testing::TestWithParam<std::size_t> {};

TEST_P(Mutations, AreToldOrChangeNothing) {
  const char* wanted = std::getenv("SENTREE_MUTATIONS");
  const char* seed_text = std::getenv("SENTREE_SEED");
  const std::uint64_t seed = seed_text != nullptr ? std::strtoull(seed_text, nullptr, 10) : kSeed;
  const std::size_t count = wanted != nullptr ? std::strtoull(wanted, nullptr, 10) : kMutations;
  std::cout << "seed " << seed << ", " << count << " mutations (SENTREE_SEED, SENTREE_MUTATIONS)\n";
  const bool tells_all = std::getenv("SENTREE_TELL") != nullptr;
  const TemporaryFolder temporary("mutation");
  std::vector<std::unique_ptr<Example>> examples;
  std::vector<std::pair<Example*, std::string>> files;
  for (const auto& entry : fs::directory_iterator(fs::path(SENTREE_SOURCE_DIR) / "examples")) {
    const fs::path project = entry.path() / "sentree.yaml";
    // Those with plug-ins must be built first.
    if (fs::exists(project) && read(project).find("\nplugins:") == std::string::npos)
      fs::copy(entry.path(), temporary.path() / entry.path().filename(), fs::copy_options::recursive);
  }
  for (const auto& entry : fs::directory_iterator(temporary.path()))
    examples.push_back(std::make_unique<Example>(entry.path()));
  std::sort(examples.begin(), examples.end(), [](const auto& a, const auto& b) { return a->name() < b->name(); });
  // Warnings that an example has as it is.
  std::map<const Example*, std::size_t> known;
  for (const auto& example : examples) {
    const Diagnostics found = campaign::check_project(example->folder());
    ASSERT_FALSE(has_errors(found)) << to_string(found.front());
    known[example.get()] = found.size();
    for (const std::string& file : example->files()) files.emplace_back(example.get(), file);
  }
  ASSERT_GT(files.size(), 40U);
  std::map<std::string, int> counts;
  for (std::size_t i = GetParam(); i < count; i += kSlices) {
    Rng rng(hash_combine(seed, i));
    const auto& [of, file] = files[i % files.size()];
    Example& example = *of;
    const fs::path path = example.folder() / file;
    const std::string text = read(path);
    const std::vector<bool> for_people = free_text(file, text);
    Mutation m = draw(text, rng);
    while (for_people[m.at]) m = draw(text, rng);
    const std::string mutated = mutate(text, m);
    write(path, mutated);
    std::string fate;
    // Most is found in what every project has.
    Diagnostics found = project::check_project(example.folder(), example.parts());
    if (found.size() <= known[&example] && !has_errors(found)) found = campaign::check_project(example.folder());
    if (found.size() > known[&example] || has_errors(found)) {
      fate = has_errors(found) ? "error" : "warning";
    } else if (const std::string why = excuse(file, text, mutated, m); !why.empty()) {
      fate = why;
    } else {
      write(path, text);
      const std::uint64_t before = example.before().hash;
      write(path, mutated);
      const Example::Behaviour after = example.behaviour();
      // What a scenario expects of its end is seen there only.
      const auto is_told = [&] { return !after.as_expected || !example.behaviour(kWholeRunMax).as_expected; };
      fate = after.hash == before ? "no change" : is_told() ? "told by the scenarios" : "SILENT";
    }
    ++counts[fate];
    if (fate == "SILENT" || (tells_all && fate != "error" && fate != "warning")) {
      const std::size_t line_begin = text.rfind('\n', m.at) == std::string::npos ? 0 : text.rfind('\n', m.at) + 1;
      const auto line_of = [&](const std::string& s) {
        return s.substr(line_begin, s.find('\n', line_begin + 1) - line_begin);
      };
      std::cout << fate << ": " << example.name() << "/" << file << "\n  - " << line_of(text) << "\n  + "
                << line_of(mutated) << "\n";
    }
    write(path, text);
  }
  for (const auto& [fate, n] : counts) std::cout << n << " " << fate << "\n";
  EXPECT_EQ(counts["SILENT"], 0);
}

INSTANTIATE_TEST_SUITE_P(Slices, Mutations, testing::Range(std::size_t{0}, kSlices));

}  // namespace
}  // namespace sentree
