#pragma once

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "sentree/idl/schema.h"
#include "sentree/monitor/requirement.h"
#include "sentree/project/chart_memory.h"
#include "sentree/project/part_cache.h"
#include "sentree/project/variant.h"
#include "sentree/sim/world.h"

namespace sentree::project {

/// What was read of a project's parts, with the texts that it was read from.
struct PartCache::Impl {
  struct Text {
    std::filesystem::path file;
    std::string shown;
    std::optional<std::string> content;  // nothing: it could not be read
    [[nodiscard]] bool is_same() const;
  };
  struct Looked {
    std::string source;
    std::vector<Text> included;
    std::optional<scxml::Chart> chart;
    Diagnostics found;
  };
  struct Interface {
    std::vector<Text> files;  // the first is the one named
    Loaded<idl::Schema> schema;
  };
  struct WorldText {
    Text file;
    std::shared_ptr<const WorldSource> source;
  };
  struct Requirements {
    Text file;
    Loaded<monitor::RequirementFile> parsed;
    // By requirement, the monitor's name, and what is observed.
    std::map<std::tuple<std::string, std::string, ChartMemory::ContextId>, Loaded<monitor::Model>> monitors;
  };
  static constexpr std::size_t kChartsMax = 4096;
  static constexpr std::size_t kInterfacesMax = 256;
  static constexpr std::size_t kRequirementFilesMax = 256;
  static constexpr std::size_t kSynthesizedMax = 4096;  // of a file

  std::map<std::pair<std::string, std::vector<std::string>>, Looked> charts;  // by file, and what is seen outside of it
  ChartMemory findings;
  std::map<std::pair<std::string, std::string>, Interface> interfaces;  // by file, and how it is shown
  std::map<std::string, std::shared_ptr<Requirements>> requirements;    // by file
  std::optional<WorldText> world_text;
  std::vector<Text> map;                    // its files, the first is the one named
  std::shared_ptr<const sim::World> world;  // of that map

  static bool are_same(const std::vector<Text>& texts) {
    return std::all_of(texts.begin(), texts.end(), [](const Text& text) { return text.is_same(); });
  }

  /// The chart as it was read, or null: it was not, or something of it has changed since.
  [[nodiscard]] const Looked* chart(const std::pair<std::string, std::vector<std::string>>& key,
                                    const std::string& source) const;
  [[nodiscard]] Result<std::shared_ptr<const WorldSource>> world_source(const Project& project);
  [[nodiscard]] std::shared_ptr<Requirements> requirements_of(Text file);
  [[nodiscard]] const Loaded<idl::Schema>& interface(const std::filesystem::path& file, const std::string& shown);
};

}  // namespace sentree::project
