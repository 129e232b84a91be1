#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/project/plan.h"
#include "sentree/text/yaml.h"

namespace sentree::campaign {

/// Most parameters and entries of a timeline that one file may draw, each.
inline constexpr std::size_t kFactorsMax = 200;
/// Most runs of a campaign; the seed of run N of the campaign with seed S is S times this, and N.
inline constexpr std::uint64_t kRunsMax = 1'000'000;

/// What a value is drawn from, as a file writes it: {uniform: [20 %, 100 %]}.
struct Distribution {
  enum class Kind : std::uint8_t {
    kUniform,      ///< From `a` to `b`.
    kInteger,      ///< Whole numbers from `a` to `b`, both among them.
    kNormal,       ///< Mean `a`, standard deviation `b`.
    kLogNormal,    ///< Median `a`, and the factor `b` that a standard deviation makes.
    kExponential,  ///< Mean `a`.
    kChoice,       ///< One of `alternatives`.
    kPose,         ///< Where the robot can stand: everywhere, or in `area`; heading any.
  };
  Kind kind = Kind::kUniform;
  double a = 0;
  double b = 0;
  std::optional<double> min;  ///< kNormal, kLogNormal, kExponential: only what lies within.
  std::optional<double> max;
  std::string unit;  ///< Behind the number: "%", "s"; empty: none.
  std::vector<text::YamlNode> alternatives;
  std::vector<double> weights;  ///< Of the alternatives, their sum 1.
  std::string area;
  SourceSpan span;
};

/// Something that is drawn anew for each run.
struct Parameter {
  std::string name;  ///< Where a scenario's `override:` has it: "world.battery.initial".
  Distribution from;
  SourceSpan span{};  ///< Of the name.
};

/// An entry of the timeline that may happen.
struct Event {
  std::string name;
  text::YamlNode entry;  ///< As a scenario's, but for what is drawn.
  double probability = 1.0;
  bool is_fault = false;  ///< One of those of which `faults_at_most` come.
  struct Part {
    std::vector<std::string> path;  ///< Where in the entry: {"args", "percent"}.
    Distribution from;
  };
  std::vector<Part> parts;
};

/// What a campaign varies.
struct Vary {
  std::string file;                               ///< As shown in messages; empty: nothing is varied but the seed.
  std::optional<std::filesystem::path> scenario;  ///< What every run begins with.
  SourceSpan scenario_span;
  std::optional<text::YamlNode> changes;  ///< Its `override:`, for every run.
  std::optional<std::uint64_t> runs;
  std::optional<Duration> duration;
  std::vector<Parameter> parameters;
  std::vector<Event> events;
  std::size_t faults_at_most = 0;
  std::uint64_t content = 0;  ///< Hash of the file.
};

/// Reads a file of what is varied. Codes: campaign.*, yaml.*, file.*.
/// @param project  Whose `verify:` has faults, which `faults: {at_most: N}` alone means.
[[nodiscard]] Loaded<Vary> load_vary(const std::filesystem::path& file, const project::Project& project);

/// What was drawn for one run; a plain value, which shrinking makes less.
struct Draw {
  std::uint64_t seed = 1;
  Duration duration{};
  /// By parameter; nothing: as the project says.
  std::vector<std::optional<text::YamlNode>> parameters;
  /// By event: the entry of the timeline; nothing: it does not happen.
  std::vector<std::optional<text::YamlNode>> events;
};

/// What a run is drawn from: a seed for each thing that is drawn by itself, so that parts of one run can be taken over
/// into another.
using Seeds = std::vector<std::uint64_t>;

/// A column of the results, and what may matter to them: a parameter, whether something happens, a part of it.
struct Factor {
  std::string name;
  enum class Kind : std::uint8_t { kNumber, kChoice, kHappens };
  Kind kind = Kind::kNumber;
  /// For plots. Of kNumber: the bounds of equally likely tenths, nine; of kChoice: the alternatives.
  std::vector<std::string> bins;
  bool may_be_absent = false;  ///< Of an event that need not happen.
};
inline constexpr std::size_t kTenths = 10;

/// What a run had of a factor.
struct Level {
  std::size_t bin = 0;  ///< Below the number of bins; with `may_be_absent`, 0 is that it was absent.
  std::string text;     ///< For tables; empty: absent.
};

/// Draws runs. Each factor has a generator of its own, so that one more does not change the others.
class Drawing {
 public:
  /// @param vary   Borrowed.
  /// @param world  For poses; null: the project has none. Borrowed.
  Drawing(const Vary& vary, const sim::World* world, Duration duration);

  /// The same seed for everything.
  [[nodiscard]] Seeds seeds(std::uint64_t seed) const;
  /// Places among the seeds of which another seed may make another run.
  [[nodiscard]] std::vector<std::size_t> free_sources() const;
  [[nodiscard]] Draw draw(const Seeds& seeds) const;
  [[nodiscard]] Draw draw(std::uint64_t seed) const { return draw(seeds(seed)); }
  [[nodiscard]] const std::vector<Factor>& factors() const { return factors_; }
  /// By factor, what `draw` has.
  [[nodiscard]] std::vector<Level> levels(const Seeds& seeds) const;
  [[nodiscard]] std::vector<Level> levels(std::uint64_t seed) const { return levels(seeds(seed)); }

 private:
  struct Value {
    text::YamlNode node;
    std::size_t bin = 0;
  };
  [[nodiscard]] Value value(const Distribution& from, std::uint64_t seed, const std::string& name) const;
  [[nodiscard]] Value drawn_part(std::size_t event, std::size_t part, const Seeds& seeds) const;
  [[nodiscard]] std::vector<bool> happening(const Seeds& seeds) const;
  void add_factor(const std::string& name, const Distribution& from, bool may_be_absent);

  const Vary& vary_;
  const sim::World* world_;
  Duration duration_;
  std::vector<Factor> factors_;
  // Places among the seeds: of the run itself, of which faults come, of each parameter, and of each event whether it
  // happens, behind which those of its parts are.
  static constexpr std::size_t kRun = 0;
  static constexpr std::size_t kFaults = 1;
  static constexpr std::size_t kParameters = 2;
  std::vector<std::size_t> places_;  // by event
  std::size_t sources_ = kParameters;
};

/// The scenario of a run: `base` with what was drawn. Codes: as `load_scenario`.
[[nodiscard]] Loaded<project::Scenario> scenario_of(const project::Scenario& base, const Vary& vary, const Draw& draw);

}  // namespace sentree::campaign
