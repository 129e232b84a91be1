#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/value.h"
#include "sentree/bt/palette.h"
#include "sentree/studio/chart_player.h"
#include "sentree/studio/detail/tree_player.h"

namespace sentree::studio {

/// Charts and trees of a project that somebody runs by hand, each alone: what pages ask for with `simulate_chart` and
/// `simulate_tree` (docs/studio-protocol.md). When the text has changed, what was done is done again with the new one.
/// One thread at a time.
class Simulations {
 public:
  /// Those that are kept; the one that was used longest ago goes.
  static constexpr std::size_t kKeptMax = 8;
  /// Steps of a chart that are done again after an edit.
  static constexpr std::size_t kStepsMax = 1'000;
  /// Processor time that one step of a chart may take.
  static constexpr Duration kScriptMax = std::chrono::seconds(2);

  explicit Simulations(std::filesystem::path folder) : folder_(std::move(folder)) {}

  struct Text {
    std::string file;  ///< Inside the project.
    std::string text;
    std::uint64_t version = 0;
  };
  /// `request`: {do: "start" | "look" | "send" | "wait" | "back", event, data, time}; `data` is what an event brings,
  /// or values of the chart's own data to begin with. Errors: those of `scxml::load` and `ChartPlayer`, studio.request.
  [[nodiscard]] Result<Value> chart(const Text& text, const Value& request);
  /// `request`: {tree, do: "start" | "look" | "answer" | "tick" | "wait" | "back", leaf, status}. Errors: those of
  /// `TreePlayer`, studio.request.
  [[nodiscard]] Result<Value> tree(const Text& text, const bt::Palette& palette, const Value& request);

 private:
  struct ChartStep {
    bool is_wait = false;
    scxml::Event event;
    Duration time{};
  };
  struct PlayedChart {
    std::uint64_t version = 0;
    std::unique_ptr<ChartPlayer> player;
    Map data;  ///< Values of <data> that it begins with.
    std::vector<ChartStep> steps;
    ChartTrace trace;  ///< Of the last step.
    std::uint64_t used = 0;
  };
  struct PlayedTree {
    std::uint64_t version = 0;
    TreePlayer player;
    std::uint64_t used = 0;
  };

  [[nodiscard]] Result<void> begin(PlayedChart& played, const Text& text) const;
  [[nodiscard]] Result<void> redo(PlayedChart& played, const Text& text) const;
  [[nodiscard]] static Value shown(const PlayedChart& played);
  [[nodiscard]] static Value shown(const PlayedTree& played, const std::string& text, const std::string& tree);

  const std::filesystem::path folder_;
  std::map<std::string, PlayedChart> charts_;                        // by file
  std::map<std::pair<std::string, std::string>, PlayedTree> trees_;  // by file and tree
  std::uint64_t uses_ = 0;
};

}  // namespace sentree::studio
