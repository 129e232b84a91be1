#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "sentree/project/plan.h"
#include "sentree/project/project.h"
#include "sentree/text/yaml.h"

namespace sentree::project {

/// Mappings are merged member by member; anything else is replaced.
void merge(text::YamlNode& into, const text::YamlNode& changes);

/// Changes a scenario as an `override:` in its file would, over what that says. Codes: project.*, scenario.*.
void apply_overrides(const text::YamlNode& changes, Scenario& scenario, Diagnostics& diagnostics);

/// The world file of a project, read once, for many worlds that differ in what a scenario changes.
class WorldSource {
 public:
  /// Codes: file.*, yaml.*.
  [[nodiscard]] static Result<WorldSource> read(const Project& project);
  /// The world with changes merged over the file's content.
  /// @param like  A world of this source whose map is taken over, unless `overrides` name another; null: the map is
  ///              read. Borrowed.
  /// @param read  Told of each file that is read, and what is in it.
  /// Codes: sim.*, map.*, file.*.
  using OnRead = std::function<void(const std::filesystem::path&, const std::string& shown, const std::string&)>;
  [[nodiscard]] Loaded<sim::World> with(const std::optional<text::YamlNode>& overrides,
                                        const sim::World* like = nullptr, const OnRead& read = {}) const;
  /// The file that the world names as its map; empty if it names none.
  [[nodiscard]] std::filesystem::path map_file(const std::optional<text::YamlNode>& overrides) const;

 private:
  WorldSource() = default;
  std::filesystem::path file_;
  std::string shown_;
  text::YamlNode root_;
};

}  // namespace sentree::project
