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
#include "sentree/project/plan.h"
#include "sentree/runtime/run.h"

namespace sentree {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kSeed = 16;
constexpr std::size_t kMutations = 2400;
// Tests that share them.
constexpr std::size_t kSlices = 8;
// Virtual seconds of each run that is compared.
constexpr Duration kRunMax = std::chrono::seconds(60);

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

std::string apply(const std::string& text, const Mutation& m) {
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

// Why nobody can know that it is a slip; empty: somebody should.
std::string excuse(const std::string& file, const std::string& text, const Mutation& m) {
  const std::string old = text.substr(m.at, m.length);
  std::size_t token = m.at;
  while (token > 0 && (is_word(text[token - 1]) || text[token - 1] == '.')) --token;
  if (is_digit(text[token]) || (is_digit(old[0]) && m.at == token)) return "another number";
  if (m.is_word) return "another name that is there too";
  constexpr std::string_view kOperators = "<>=!&|+-*/%";
  if (m.length == 1 && kOperators.find(old[0]) != std::string_view::npos) return "another operator";
  if (m.by.size() == 1 && kOperators.find(m.by[0]) != std::string_view::npos) return "another operator";
  const std::size_t line = text.rfind('\n', m.at) + 1;
  const std::string before = text.substr(line, m.at - line);
  // What something is called for people, and nobody else names.
  if (file.ends_with(".req") && before.find_first_of(" :=(") == std::string::npos) return "the name of a requirement";
  if (file.ends_with(".xml") && before.rfind("name=\"") != std::string::npos &&
      before.find('"', before.rfind("name=\"") + 6) == std::string::npos)
    return "the name of a node";
  if (file.ends_with(".thrift")) return "a name of the interface itself";
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
    // Those of hosts/ are for other machines.
    std::erase_if(files_, [](const std::string& file) { return file.starts_with("hosts/"); });
    std::sort(files_.begin(), files_.end());
  }
  [[nodiscard]] const fs::path& folder() const { return folder_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const std::vector<std::string>& files() const { return files_; }

  struct Behaviour {
    std::uint64_t hash = 0;
    bool as_expected = true;
  };
  // What a project is that nothing here can run: its tree, its services and its requirements.
  static std::uint64_t shape(const project::Plan& plan) {
    std::uint64_t hash = 0;
    const auto add = [&](std::string_view text) { hash = hash_combine(hash, hash_bytes(text)); };
    for (bt::NodeId node = 0; node < plan.tree.size(); ++node) {
      add(plan.tree.path(node));
      add(plan.tree.registration(node));
      for (const auto& port : plan.tree.ports(node)) add(std::string(port.name) + "=" + std::string(port.text));
    }
    for (const auto& [name, service] : plan.services) add(name + service.interface + service.at);
    for (const monitor::Model& model : plan.monitors) {
      add(model.name());
      if (model.origin() != nullptr) add(model.chart().source());
    }
    return hash;
  }

  // What every scenario in virtual time does and decides.
  [[nodiscard]] Behaviour behaviour() const {
    Behaviour result;
    auto project = project::load_project(folder());
    if (!project.ok()) return result;
    const auto scenarios = project::scenario_files(*project.value);
    if (scenarios.empty()) {
      if (const auto plan = project::prepare(project::plain_scenario(*project.value)); plan.ok())
        result.hash = shape(*plan.value);
    }
    for (const fs::path& file : scenarios) {
      auto scenario = project::load_scenario(file);
      if (!scenario.ok() || !scenario.value->virtual_time) continue;
      const bool is_cut = scenario.value->duration > kRunMax;
      scenario.value->duration = std::min(scenario.value->duration, kRunMax);
      const auto plan = project::prepare(std::move(*scenario.value));
      if (!plan.ok()) continue;
      runtime::RunOptions options;
      options.listeners.push_back([&](const Message& message) {
        result.hash = hash_combine(result.hash, hash_bytes(message.name + message.source));
        result.hash = hash_combine(result.hash, static_cast<std::uint64_t>(message.time.time_since_epoch().count()));
        result.hash = hash_combine(result.hash, message.data.hash());
      });
      const auto report = runtime::Run(*plan.value, std::move(options)).execute();
      if (!report.unmet.empty() && !is_cut) result.as_expected = false;
      for (const auto& monitor : report.monitors)
        result.hash = hash_combine(
            result.hash, hash_bytes(monitor.name + std::string(to_string(monitor.verdict)) + monitor.vacuity));
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
    if (fs::exists(entry.path() / "sentree.yaml"))
      fs::copy(entry.path(), temporary.path() / entry.path().filename(), fs::copy_options::recursive);
  }
  for (const auto& entry : fs::directory_iterator(temporary.path()))
    examples.push_back(std::make_unique<Example>(entry.path()));
  std::sort(examples.begin(), examples.end(), [](const auto& a, const auto& b) { return a->name() < b->name(); });
  for (const auto& example : examples) {
    const Diagnostics found = project::check_project(example->folder());
    ASSERT_TRUE(found.empty()) << to_string(found.front());
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
    const Mutation m = draw(text, rng);
    const std::string mutated = apply(text, m);
    write(path, mutated);
    std::string fate;
    const Diagnostics found = project::check_project(example.folder());
    if (!found.empty()) {
      fate = has_errors(found) ? "error" : "warning";
    } else if (free_text(file, text)[m.at]) {
      fate = "free text";
    } else if (const std::string why = excuse(file, text, m); !why.empty()) {
      fate = why;
    } else {
      write(path, text);
      const std::uint64_t before = example.before().hash;
      write(path, mutated);
      const Example::Behaviour after = example.behaviour();
      fate = after.hash == before ? "no change" : !after.as_expected ? "told by the scenarios" : "SILENT";
    }
    ++counts[fate];
    if (fate == "SILENT" || (tells_all && fate != "error" && fate != "warning" && fate != "free text")) {
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
