#pragma once

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/base/time.h"
#include "sentree/text/yaml.h"

namespace sentree::project {

/// Reads the members of one mapping and collects what is wrong with them: missing, misspelt, of the wrong type.
/// Unknown keys are reported when it is destroyed, with the known ones as suggestions.
class YamlReader {
 public:
  /// `what` names the mapping in messages: "service \"battery\"".
  YamlReader(const text::YamlNode& node, std::string what, Diagnostics& diagnostics);
  YamlReader(const YamlReader&) = delete;
  YamlReader& operator=(const YamlReader&) = delete;
  ~YamlReader();

  [[nodiscard]] const text::YamlNode* node(const std::string& key);
  /// A key that is read otherwise.
  void know(const std::string& key) { known_.push_back(key); }
  [[nodiscard]] std::optional<std::string> string(const std::string& key);
  [[nodiscard]] std::string required_string(const std::string& key);
  [[nodiscard]] std::optional<double> number(const std::string& key);
  [[nodiscard]] std::optional<std::int64_t> integer(const std::string& key);
  [[nodiscard]] std::optional<bool> boolean(const std::string& key);
  [[nodiscard]] std::optional<Duration> duration(const std::string& key);
  /// A sequence of texts, or one text.
  [[nodiscard]] std::vector<std::string> strings(const std::string& key);
  /// A mapping or a sequence; null (and reported) if it is something else.
  [[nodiscard]] const text::YamlNode* mapping(const std::string& key);
  [[nodiscard]] const text::YamlNode* sequence(const std::string& key);
  [[nodiscard]] SourceSpan span(const std::string& key) const;

  void error(const SourceSpan& span, std::string code, std::string message);
  /// Reading ends here: nobody knows about the other keys.
  void give_up() { given_up_ = true; }

 private:
  const text::YamlNode& node_;
  std::string what_;
  Diagnostics& diagnostics_;
  std::vector<std::string> known_;
  bool given_up_ = false;
};

struct Project;
struct SkillEntry;
/// Reads one entry of `skills:` over what `skill` has already.
void read_skill(YamlReader& reader, const Project& project, SkillEntry& skill, Diagnostics& diagnostics);
/// Reads the entries of `protocols:`.
void read_protocols(const text::YamlNode& node, Project& project, Diagnostics& diagnostics);
/// Reads `deadlines:` over the present ones, completes them with their defaults, and checks that they nest.
void read_deadlines(const text::YamlNode* node, Project& project, Diagnostics& diagnostics);
/// Whose entries are read: a scenario's stand in place of the project's.
enum class EntriesOf : std::uint8_t { kProject, kScenario };
/// Reads the entries of `monitors:`. One with the name of another replaces it, or is an error.
void read_monitors(const text::YamlNode& node, EntriesOf whose, Project& project, Diagnostics& diagnostics);
/// Reads the entries of `models:`, to those that are there.
void read_models(const text::YamlNode& node, Project& project, Diagnostics& diagnostics);
/// Reads `mission:`, whole or over what is there.
void read_mission(const text::YamlNode& node, EntriesOf whose, Project& project, Diagnostics& diagnostics);
/// Reads the entries of `observers:`.
void read_observers(const text::YamlNode& node, Project& project, Diagnostics& diagnostics);

}  // namespace sentree::project
