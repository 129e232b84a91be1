#include "sentree/campaign/vary.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/math/distributions/exponential.hpp>
#include <boost/math/distributions/lognormal.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <utility>
#include <variant>

#include "sentree/base/rng.h"
#include "sentree/project/intervention.h"
#include "sentree/project/timeline.h"
#include "sentree/project/variant.h"
#include "sentree/project/yaml_reader.h"
#include "sentree/sim/area.h"
#include "sentree/text/file.h"

namespace sentree::campaign {

namespace {

using text::YamlNode;
using DrawnKind = Distribution::Kind;

constexpr std::array<std::pair<std::string_view, DrawnKind>, 7> kKinds{{{"uniform", DrawnKind::kUniform},
                                                                        {"integer", DrawnKind::kInteger},
                                                                        {"normal", DrawnKind::kNormal},
                                                                        {"lognormal", DrawnKind::kLogNormal},
                                                                        {"exponential", DrawnKind::kExponential},
                                                                        {"choice", DrawnKind::kChoice},
                                                                        {"pose", DrawnKind::kPose}}};
// What of a project a run may change, as in a scenario's `override:`.
const std::vector<std::string> kSections{"world", "skills", "services", "mission", "deadlines"};

YamlNode scalar_node(std::string text, const SourceSpan& span) {
  YamlNode node;
  node.kind = YamlNode::Kind::kScalar;
  node.scalar = std::move(text);
  node.span = span;
  return node;
}

// Six digits, which a scenario file has as they are.
std::string number_text(double number, const std::string& unit) {
  std::string text = fmt::format("{:.6g}", number == 0.0 ? 0.0 : number);
  return unit.empty() ? text : fmt::format("{} {}", text, unit);
}

double infinity() { return std::numeric_limits<double>::infinity(); }

/// `f` of the distribution without its bounds, and of where that begins.
template <class F>
double of_unbounded(const Distribution& from, F f) {
  switch (from.kind) {
    case DrawnKind::kNormal: return f(boost::math::normal(from.a, from.b), -std::numeric_limits<double>::max());
    case DrawnKind::kLogNormal: return f(boost::math::lognormal(std::log(from.a), std::log(from.b)), 0.0);
    case DrawnKind::kExponential: return f(boost::math::exponential(1.0 / from.a), 0.0);
    default: return 0.0;
  }
}

/// The probabilities that the bounds cut off below them, or above them where both are above the median: of what lies
/// far out the other ones have no digits.
struct CutOff {
  bool is_above = false;
  double at_min = 0;
  double at_max = 1;
};

template <class Unbounded>
CutOff cut_off(const Distribution& from, const Unbounded& distribution, double lowest) {
  CutOff out;
  out.is_above = from.min && *from.min > median(distribution);
  const auto of = [&](const std::optional<double>& bound, double none) {
    if (!bound) return out.is_above ? 1.0 - none : none;
    if (*bound <= lowest) return 0.0;
    return out.is_above ? cdf(complement(distribution, *bound)) : cdf(distribution, *bound);
  };
  out.at_min = of(from.min, 0.0);
  out.at_max = of(from.max, 1.0);
  return out;
}

// Below that probability nothing is drawn between bounds.
constexpr double kWithinMin = 1e-300;
// And below that one the tail is looked at by itself.
constexpr double kFarOut = 1e-6;

std::optional<DrawnKind> kind_of(const YamlNode& node) {
  if (!node.is_mapping() || node.entries.empty()) return std::nullopt;
  for (const auto& [word, kind] : kKinds) {
    if (node.entries.front().first.scalar == word) return kind;
  }
  return std::nullopt;
}

class Reader {
 public:
  explicit Reader(Diagnostics& diagnostics) : diagnostics_(diagnostics) {}

  void error(const SourceSpan& span, std::string code, std::string message) {
    diagnostics_.push_back({Severity::kError, "campaign." + std::move(code), std::move(message), span});
  }

  std::optional<Distribution> distribution(const YamlNode& node, const std::string& what) {
    const auto kind = kind_of(node);
    if (!kind) {
      std::string words;
      for (const auto& [word, known] : kKinds) words += (words.empty() ? "" : ", ") + std::string(word);
      error(node.span, "distribution",
            fmt::format("{} needs what it is drawn from, e.g. {{uniform: [20 %, 100 %]}}; there are {}", what, words));
      return std::nullopt;
    }
    Distribution from;
    from.kind = *kind;
    from.span = node.span;
    const std::size_t before = diagnostics_.size();
    {
      project::YamlReader reader(node, what, diagnostics_);
      const YamlNode* value = reader.node(node.entries.front().first.scalar);
      if (value == nullptr) {
        error(node.span, "distribution", what + " says not what its values are");
        return std::nullopt;
      }
      if (*kind == DrawnKind::kChoice)
        choice(*value, reader, what, from);
      else if (*kind == DrawnKind::kPose)
        pose(*value, what, from);
      else
        numbers(*value, reader, what, from);
    }
    return diagnostics_.size() == before ? std::optional(std::move(from)) : std::nullopt;
  }

 private:
  // "25 %" as number and unit, which must be that of the others.
  std::optional<double> quantity(const YamlNode& node, const std::string& what, Distribution& from) {
    const char* const begin = node.scalar.c_str();
    char* end = nullptr;
    const double number = node.is_scalar() ? std::strtod(begin, &end) : 0.0;
    if (!node.is_scalar() || end == begin || !std::isfinite(number)) {
      error(node.span, "distribution", what + " needs numbers, perhaps with a unit: 25 %, 1.5 s");
      return std::nullopt;
    }
    std::string unit(end);
    unit.erase(0, unit.find_first_not_of(' '));
    if (!has_unit_) {
      from.unit = unit;
      has_unit_ = true;
    } else if (unit != from.unit) {
      error(node.span, "distribution",
            fmt::format("{} mixes the units \"{}\" and \"{}\"; write all numbers in one", what, from.unit, unit));
      return std::nullopt;
    }
    return number;
  }

  void numbers(const YamlNode& value, project::YamlReader& reader, const std::string& what, Distribution& from) {
    const std::size_t before = diagnostics_.size();
    has_unit_ = false;
    const bool single = from.kind == DrawnKind::kExponential;
    const bool fits = single ? value.is_scalar() : value.is_sequence() && value.items.size() == 2;
    if (!fits) {
      error(value.span, "distribution",
            single ? what + ": exponential needs its mean: exponential: 60 s"
                   : what +
                         " needs two numbers: uniform and integer the bounds, normal mean and standard deviation, "
                         "lognormal the median and the factor of a standard deviation");
      return;
    }
    const auto a = quantity(single ? value : value.items[0], what, from);
    // The factor of a lognormal has no unit.
    const bool is_factor = from.kind == DrawnKind::kLogNormal;
    const auto b = single      ? std::optional(0.0)
                   : is_factor ? value.items[1].number()
                               : quantity(value.items[1], what, from);
    for (const auto& [key, bound] : {std::pair{"min", &from.min}, std::pair{"max", &from.max}}) {
      if (const YamlNode* node = reader.node(key)) *bound = quantity(*node, what, from);
    }
    if (!a || !b) {
      if (is_factor && a) error(value.span, "distribution", what + ": the factor of a lognormal is a number above 1");
      return;
    }
    from.a = *a;
    from.b = *b;
    const bool bounds = from.kind == DrawnKind::kUniform || from.kind == DrawnKind::kInteger;
    if (bounds && (from.min || from.max))
      error(value.span, "distribution", what + ": uniform and integer have their bounds already");
    if (bounds && from.a > from.b) error(value.span, "distribution", what + ": the first bound is above the second");
    if (from.kind == DrawnKind::kInteger && (from.a != std::floor(from.a) || from.b != std::floor(from.b)))
      error(value.span, "distribution", what + ": bounds of integer are whole numbers");
    if (from.kind == DrawnKind::kNormal && !(from.b > 0))
      error(value.span, "distribution", what + ": a standard deviation is above 0");
    if (from.kind == DrawnKind::kLogNormal && !(from.b > 1 && from.a > 0))
      error(value.span, "distribution", what + ": a lognormal has a median above 0 and a factor above 1");
    if (from.kind == DrawnKind::kExponential && !(from.a > 0 && std::isfinite(1 / from.a)))
      error(value.span, "distribution", what + ": a mean is above 0");
    if (from.min && from.max && !(*from.min < *from.max))
      error(value.span, "distribution", what + ": min is not below max");
    if (diagnostics_.size() > before || !(from.min || from.max)) return;
    const double within = of_unbounded(from, [&](const auto& distribution, double lowest) {
      const CutOff off = cut_off(from, distribution, lowest);
      return std::abs(off.at_max - off.at_min);
    });
    if (!(within >= kWithinMin)) {
      error(
          value.span, "distribution",
          what + ": nothing of that distribution lies between its min and max; move them, or draw uniform: [MIN, MAX]");
    }
  }

  void choice(const YamlNode& value, project::YamlReader& reader, const std::string& what, Distribution& from) {
    if (!value.is_sequence() || value.items.empty()) {
      error(value.span, "distribution", what + ": choice needs a list of alternatives");
      return;
    }
    from.alternatives = value.items;
    from.weights.assign(value.items.size(), 1.0);
    if (const YamlNode* weights = reader.node("weights")) {
      bool good = weights->is_sequence() && weights->items.size() == value.items.size();
      for (std::size_t i = 0; good && i < weights->items.size(); ++i) {
        const auto weight = weights->items[i].number();
        good = weight && *weight >= 0 && std::isfinite(*weight);
        if (good) from.weights[i] = *weight;
      }
      if (!good) error(weights->span, "distribution", what + ": weights are as many numbers as there are alternatives");
    }
    double sum = 0;
    for (const double weight : from.weights) sum += weight;
    if (!(sum > 0)) error(value.span, "distribution", what + ": some alternative needs a weight above 0");
    for (double& weight : from.weights) weight /= sum;
  }

  void pose(const YamlNode& value, const std::string& what, Distribution& from) {
    if (!value.is_scalar()) {
      error(value.span, "distribution", what + ": pose is anywhere, or the name of an area of the world");
      return;
    }
    if (value.scalar != "anywhere") from.area = value.scalar;
  }

  Diagnostics& diagnostics_;
  bool has_unit_ = false;
};

// A probability: 0.2 or "20 %".
std::optional<double> probability(const YamlNode& node) {
  double factor = 1.0;
  YamlNode number = node;
  if (node.scalar.ends_with('%')) {
    factor = 0.01;
    number.scalar = node.scalar.substr(0, node.scalar.size() - 1);
    while (number.scalar.ends_with(' ')) number.scalar.pop_back();
  }
  const auto read = number.number();
  if (!read || !(*read * factor >= 0.0 && *read * factor <= 1.0)) return std::nullopt;
  return *read * factor;
}

void find_parts(const YamlNode& node, std::vector<std::string> path, Reader& reader, Event& event) {
  if (kind_of(node)) {
    std::string name = event.name;
    for (const std::string& key : path) name += "." + key;
    if (auto from = reader.distribution(node, fmt::format("\"{}\"", name)))
      event.parts.push_back({std::move(path), *from});
    return;
  }
  for (const auto& [key, member] : node.entries) {
    path.push_back(key.scalar);
    find_parts(member, path, reader, event);
    path.pop_back();
  }
}

std::string default_name(const YamlNode& entry) {
  for (const project::Intervention& kind : project::every_kind()) {
    std::string word(project::word_of(kind));
    const YamlNode* what = entry.find(word);
    if (what == nullptr) continue;
    if (what->is_scalar()) return fmt::format("{} {}", word, what->scalar);
    for (const char* key : {"message", "call", "leaf", "node", "chart"}) {
      if (const YamlNode* target = what->find(key)) return fmt::format("{} {}", word, target->scalar);
    }
    return word;
  }
  return "event";
}

/// Names of events: one that is there already gets a number.
class EventNames {
 public:
  std::string add(const std::string& base) {
    std::string name = base;
    for (int& number = last_.try_emplace(base, 1).first->second; !taken_.insert(name).second;)
      name = fmt::format("{} #{}", base, ++number);
    return name;
  }

 private:
  std::set<std::string> taken_;
  std::map<std::string, int> last_;
};

Event read_event(const YamlNode& entry, bool is_fault, EventNames& names, Reader& reader) {
  Event event;
  event.is_fault = is_fault;
  event.entry = entry;
  event.name = default_name(entry);
  std::erase_if(event.entry.entries, [&](const auto& member) {
    if (member.first.scalar == "name") {
      event.name = member.second.scalar;
      return true;
    }
    if (member.first.scalar != "probability") return false;
    if (const auto read = probability(member.second); read && !is_fault)
      event.probability = *read;
    else
      reader.error(member.second.span, "probability",
                   is_fault ? "faults come as often as `at_most` says; give a probability to an entry of `timeline`"
                            : "a probability is from 0 to 1, or from 0 % to 100 %");
    return true;
  });
  event.name = names.add(event.name);
  find_parts(event.entry, {}, reader, event);
  return event;
}

// No more than are told to be too many.
void read_events(const std::vector<YamlNode>& entries, bool is_fault, EventNames& names, Reader& reader,
                 std::vector<Event>& events) {
  for (const YamlNode& entry : entries) {
    if (events.size() > kFactorsMax) return;
    events.push_back(read_event(entry, is_fault, names, reader));
  }
}

// What is not there yet is made, as if it stood at `span`.
void set_at(YamlNode& root, std::span<const std::string> path, const YamlNode& value, const SourceSpan& span) {
  if (path.empty()) {
    root = value;
    return;
  }
  if (!root.is_mapping()) root.span = span;
  root.kind = YamlNode::Kind::kMapping;
  for (auto& [key, member] : root.entries) {
    if (key.scalar == path.front()) return set_at(member, path.subspan(1), value, span);
  }
  root.entries.emplace_back(scalar_node(path.front(), span), YamlNode());
  set_at(root.entries.back().second, path.subspan(1), value, span);
}

std::vector<std::string> split(const std::string& name) {
  std::vector<std::string> path;
  std::size_t begin = 0;
  for (std::size_t dot = name.find('.'); dot != std::string::npos; dot = name.find('.', begin)) {
    path.push_back(name.substr(begin, dot - begin));
    begin = dot + 1;
  }
  path.push_back(name.substr(begin));
  return path;
}

std::string shown(const YamlNode& node) {
  if (node.is_scalar()) return node.scalar;
  return to_json(node.value());
}

void read_parameters(const YamlNode& node, Reader& reader, Vary& vary) {
  for (const auto& [key, value] : node.entries) {
    const std::vector<std::string> path = split(key.scalar);
    if (path.size() < 2 || std::find(kSections.begin(), kSections.end(), path.front()) == kSections.end()) {
      reader.error(key.span, "parameter",
                   fmt::format("parameter \"{}\" names no place in a scenario's `override:`, such as "
                               "world.battery.initial or deadlines.call{}",
                               key.scalar, did_you_mean(path.front(), kSections)));
      continue;
    }
    const auto other = std::find_if(vary.parameters.begin(), vary.parameters.end(), [&](const Parameter& before) {
      const std::vector<std::string> its = split(before.name);
      const auto end = its.begin() + static_cast<std::ptrdiff_t>(std::min(its.size(), path.size()));
      return std::equal(its.begin(), end, path.begin());
    });
    if (other != vary.parameters.end()) {
      reader.error(key.span, "parameter",
                   fmt::format("parameter \"{}\" writes over \"{}\"; draw one of them", key.scalar, other->name));
      continue;
    }
    if (auto from = reader.distribution(value, fmt::format("parameter \"{}\"", key.scalar)))
      vary.parameters.push_back({key.scalar, std::move(*from), key.span});
  }
}

void read_faults(const YamlNode& node, const project::Project& project, EventNames& names, Reader& reader,
                 Diagnostics& diagnostics, Vary& vary) {
  project::YamlReader faults(node, "faults", diagnostics);
  vary.faults_at_most = 1;
  if (const auto most = faults.integer("at_most")) {
    if (*most < 0)
      reader.error(faults.span("at_most"), "faults", "at_most is a number from 0 on");
    else
      vary.faults_at_most = static_cast<std::size_t>(*most);
  }
  if (const YamlNode* any_of = faults.sequence("any_of")) {
    read_events(any_of->items, true, names, reader, vary.events);
    return;
  }
  for (const project::Intervention& what : project.verify.faults) {
    const auto entry = text::parse_yaml(to_json(Value(project::to_entry(what))), vary.file);
    if (entry) vary.events.push_back(read_event(*entry, true, names, reader));
  }
  if (project.verify.faults.empty())
    reader.error(node.span, "faults", "faults needs \"any_of\", or the project's `verify: {faults: …}`");
}

// The value below which the share `rank` lies, only what is within the bounds being counted.
double quantile(const Distribution& from, double rank) {
  switch (from.kind) {
    case DrawnKind::kUniform: return from.a + rank * (from.b - from.a);
    case DrawnKind::kInteger: return std::min(from.b, std::floor(from.a + rank * (from.b - from.a + 1.0)));
    default: break;
  }
  return of_unbounded(from, [&](const auto& distribution, double lowest) {
    const double low = from.min ? cdf(distribution, std::max(*from.min, lowest)) : 0.0;
    const double high = from.max ? (*from.max <= lowest ? 0.0 : cdf(distribution, *from.max)) : 1.0;
    double value = 0;
    if (high - low < kFarOut) {
      const CutOff off = cut_off(from, distribution, lowest);
      const double at = std::max(off.at_min + rank * (off.at_max - off.at_min), std::numeric_limits<double>::min());
      value = off.is_above ? quantile(complement(distribution, at)) : quantile(distribution, at);
    } else {
      value = quantile(distribution, std::clamp(low + rank * (high - low), 1e-15, 1.0 - 1e-15));
    }
    return std::clamp(value, from.min.value_or(-infinity()), from.max.value_or(infinity()));
  });
}

bool is_few_integers(const Distribution& from) {
  return from.kind == DrawnKind::kInteger && from.b - from.a < static_cast<double>(kTenths);
}

sim::Pose2 random_pose(const sim::World& world, const std::string& area, Rng& rng) {
  constexpr int kTriesMax = 10'000;
  const auto found =
      std::find_if(world.areas.begin(), world.areas.end(), [&](const auto& a) { return a.name == area; });
  const sim::CostGrid& costs = world.robots.front().costs;
  for (int i = 0; i < kTriesMax; ++i) {
    sim::Vec2 point = world.map.from_grid({rng.uniform() * world.map.width(), rng.uniform() * world.map.height()});
    const double heading = rng.uniform(-std::numbers::pi, std::numbers::pi);
    // A file has millimetres.
    point = {std::round(point.x * 1e3) / 1e3, std::round(point.y * 1e3) / 1e3};
    if (costs.at(world.map.cell_at(point)) == sim::CostGrid::kBlocked) continue;
    if (found != world.areas.end() && !sim::is_inside(found->points, point)) continue;
    return {point.x, point.y, std::round(heading * 1e3) / 1e3};
  }
  return world.robots.front().start;
}

}  // namespace

Loaded<Vary> load_vary(const std::filesystem::path& file, const project::Project& project) {
  Loaded<Vary> loaded;
  const auto source = text::read_file(file);
  if (!source) {
    loaded.diagnostics.push_back(source.error());
    return loaded;
  }
  const auto yaml = text::parse_yaml(*source, file.string());
  if (!yaml) {
    loaded.diagnostics.push_back(yaml.error());
    return loaded;
  }
  Vary vary;
  vary.file = file.string();
  vary.content = hash_bytes(*source);
  {
    Reader values(loaded.diagnostics);
    project::YamlReader reader(*yaml, "the campaign", loaded.diagnostics);
    if (const auto scenario = reader.string("scenario")) vary.scenario = (file.parent_path() / *scenario);
    vary.scenario_span = reader.span("scenario");
    if (const auto runs = reader.integer("runs")) {
      if (*runs < 1 || static_cast<std::uint64_t>(*runs) > kRunsMax)
        values.error(reader.span("runs"), "runs", fmt::format("runs are from 1 to {}", kRunsMax));
      else
        vary.runs = static_cast<std::uint64_t>(*runs);
    }
    vary.duration = reader.duration("duration");
    if (vary.duration && *vary.duration <= Duration::zero())
      values.error(reader.span("duration"), "duration", "a run that lasts no time shows nothing; give more than 0 s");
    if (const YamlNode* changes = reader.mapping("override")) vary.changes = *changes;
    if (const YamlNode* parameters = reader.mapping("parameters")) read_parameters(*parameters, values, vary);
    EventNames names;
    if (const YamlNode* timeline = reader.sequence("timeline"))
      read_events(timeline->items, false, names, values, vary.events);
    if (const YamlNode* faults = reader.mapping("faults"))
      read_faults(*faults, project, names, values, loaded.diagnostics, vary);
    if (vary.parameters.size() > kFactorsMax || vary.events.size() > kFactorsMax)
      values.error(yaml->span, "too-many", fmt::format("at most {} parameters and events are drawn", kFactorsMax));
  }
  sort_by_place(loaded.diagnostics);
  if (!has_errors(loaded.diagnostics)) loaded.value = std::move(vary);
  return loaded;
}

Drawing::Drawing(const Vary& vary, const sim::World* world, Duration duration)
    : vary_(vary), world_(world), duration_(duration), sources_(kParameters + vary.parameters.size()) {
  for (const Parameter& parameter : vary.parameters) add_factor(parameter.name, parameter.from, false);
  for (const Event& event : vary.events) {
    places_.push_back(sources_);
    sources_ += 1 + event.parts.size();
    const bool may_be_absent = event.is_fault || event.probability < 1.0;
    if (may_be_absent)
      factors_.push_back(
          {.name = event.name, .kind = Factor::Kind::kHappens, .bins = {"no", "yes"}, .may_be_absent = false});
    for (const Event::Part& part : event.parts) {
      std::string name = event.name;
      for (const std::string& key : part.path) name += "." + key;
      add_factor(name, part.from, may_be_absent);
    }
  }
}

void Drawing::add_factor(const std::string& name, const Distribution& from, bool may_be_absent) {
  Factor factor{.name = name, .kind = Factor::Kind::kNumber, .bins = {}, .may_be_absent = may_be_absent};
  if (may_be_absent) factor.bins.emplace_back("none");
  if (from.kind == DrawnKind::kChoice) {
    factor.kind = Factor::Kind::kChoice;
    for (const YamlNode& alternative : from.alternatives) factor.bins.push_back(shown(alternative));
  } else if (from.kind == DrawnKind::kPose) {
    factor.kind = Factor::Kind::kChoice;
    for (const char* quarter : {"south-west", "south-east", "north-west", "north-east"})
      factor.bins.emplace_back(quarter);
  } else if (is_few_integers(from)) {
    factor.kind = Factor::Kind::kChoice;
    for (double i = from.a; i <= from.b; ++i) factor.bins.push_back(number_text(i, from.unit));
  } else {
    for (std::size_t i = 1; i < kTenths; ++i)
      factor.bins.push_back(number_text(quantile(from, static_cast<double>(i) / kTenths), from.unit));
    factor.bins.emplace_back();  // the last has no bound
  }
  factors_.push_back(std::move(factor));
}

Drawing::Value Drawing::value(const Distribution& from, std::uint64_t seed, const std::string& name) const {
  Rng rng = Rng::of(seed, "campaign." + name);
  if (from.kind == DrawnKind::kPose && world_ != nullptr) {
    const sim::Pose2 pose = random_pose(*world_, from.area, rng);
    Value drawn;
    drawn.node.kind = YamlNode::Kind::kSequence;
    drawn.node.span = from.span;
    for (const double number : {pose.x, pose.y, pose.theta})
      drawn.node.items.push_back(scalar_node(number_text(number, ""), from.span));
    const sim::Vec2 middle = world_->map.from_grid({world_->map.width() / 2.0, world_->map.height() / 2.0});
    drawn.bin = (pose.x >= middle.x ? 1U : 0U) + (pose.y >= middle.y ? 2U : 0U);
    return drawn;
  }
  const double rank = rng.uniform();
  if (from.kind == DrawnKind::kChoice) {
    double sum = 0;
    std::size_t i = 0;
    while (i + 1 < from.weights.size() && rank >= (sum += from.weights[i])) ++i;
    return {from.alternatives[i], i};
  }
  const double number = quantile(from, rank);
  const std::size_t bin = is_few_integers(from) ? static_cast<std::size_t>(number - from.a)
                                                : static_cast<std::size_t>(rank * static_cast<double>(kTenths));
  return {scalar_node(number_text(number, from.unit), from.span), bin};
}

Seeds Drawing::seeds(std::uint64_t seed) const { return Seeds(sources_, seed); }

std::vector<std::size_t> Drawing::free_sources() const {
  std::vector<std::size_t> free{kRun};
  if (std::any_of(vary_.events.begin(), vary_.events.end(), [](const Event& event) { return event.is_fault; }))
    free.push_back(kFaults);
  for (std::size_t i = 0; i < vary_.parameters.size(); ++i) free.push_back(kParameters + i);
  for (std::size_t i = 0; i < vary_.events.size(); ++i) {
    const Event& event = vary_.events[i];
    if (!event.is_fault && event.probability < 1.0) free.push_back(places_[i]);
    for (std::size_t part = 1; part <= event.parts.size(); ++part) free.push_back(places_[i] + part);
  }
  return free;
}

std::vector<bool> Drawing::happening(const Seeds& seeds) const {
  std::vector<bool> happens(vary_.events.size(), false);
  std::vector<std::size_t> faults;
  for (std::size_t i = 0; i < vary_.events.size(); ++i) {
    const Event& event = vary_.events[i];
    if (event.is_fault)
      faults.push_back(i);
    else
      happens[i] = event.probability >= 1.0 ||
                   Rng::of(seeds[places_[i]], "campaign.happens." + event.name).uniform() < event.probability;
  }
  Rng rng = Rng::of(seeds[kFaults], "campaign.faults");
  const std::size_t most = std::min(vary_.faults_at_most, faults.size());
  const std::uint64_t count = rng.below(most + 1);
  for (std::size_t i = 0; i < count; ++i) {
    std::swap(faults[i], faults[i + rng.below(faults.size() - i)]);
    happens[faults[i]] = true;
  }
  return happens;
}

Drawing::Value Drawing::drawn_part(std::size_t event, std::size_t part, const Seeds& seeds) const {
  const Event::Part& of = vary_.events[event].parts[part];
  std::string name = vary_.events[event].name;
  for (const std::string& key : of.path) name += "." + key;
  return value(of.from, seeds[places_[event] + 1 + part], name);
}

Draw Drawing::draw(const Seeds& seeds) const {
  Draw draw;
  draw.seed = seeds[kRun];
  draw.duration = duration_;
  for (std::size_t i = 0; i < vary_.parameters.size(); ++i) {
    const Parameter& parameter = vary_.parameters[i];
    draw.parameters.emplace_back(value(parameter.from, seeds[kParameters + i], parameter.name).node);
  }
  const std::vector<bool> happens = happening(seeds);
  for (std::size_t i = 0; i < vary_.events.size(); ++i) {
    const Event& event = vary_.events[i];
    std::optional<YamlNode> entry;
    if (happens[i]) {
      entry = event.entry;
      for (std::size_t part = 0; part < event.parts.size(); ++part)
        set_at(*entry, event.parts[part].path, drawn_part(i, part, seeds).node, event.parts[part].from.span);
    }
    draw.events.push_back(std::move(entry));
  }
  return draw;
}

std::vector<Level> Drawing::levels(const Seeds& seeds) const {
  std::vector<Level> levels;
  levels.reserve(factors_.size());
  for (std::size_t i = 0; i < vary_.parameters.size(); ++i) {
    const Parameter& parameter = vary_.parameters[i];
    const Value drawn = value(parameter.from, seeds[kParameters + i], parameter.name);
    levels.push_back({drawn.bin, shown(drawn.node)});
  }
  const std::vector<bool> happens = happening(seeds);
  for (std::size_t i = 0; i < vary_.events.size(); ++i) {
    const Event& event = vary_.events[i];
    const bool may_be_absent = event.is_fault || event.probability < 1.0;
    if (may_be_absent) levels.push_back({happens[i] ? 1U : 0U, happens[i] ? "yes" : "no"});
    for (std::size_t part = 0; part < event.parts.size(); ++part) {
      if (!happens[i]) {
        levels.push_back({});
        continue;
      }
      const Value drawn = drawn_part(i, part, seeds);
      levels.push_back({drawn.bin + (may_be_absent ? 1U : 0U), shown(drawn.node)});
    }
  }
  return levels;
}

Loaded<project::Scenario> scenario_of(const project::Scenario& base, const Vary& vary, const Draw& draw) {
  Loaded<project::Scenario> made;
  project::Scenario scenario = base;
  scenario.virtual_time = true;
  scenario.factor = 1.0;
  scenario.seed = draw.seed;
  scenario.duration = draw.duration;
  scenario.expect_nothing();
  YamlNode changes;
  for (std::size_t i = 0; i < draw.parameters.size(); ++i) {
    const Parameter& parameter = vary.parameters[i];
    if (draw.parameters[i]) set_at(changes, split(parameter.name), *draw.parameters[i], parameter.span);
  }
  if (changes.is_mapping()) project::apply_overrides(changes, scenario, made.diagnostics);
  YamlNode timeline;
  timeline.kind = YamlNode::Kind::kSequence;
  for (const auto& entry : draw.events) {
    if (entry) timeline.items.push_back(*entry);
  }
  project::read_timeline(timeline, scenario, made.diagnostics);
  if (!has_errors(made.diagnostics)) made.value = std::move(scenario);
  return made;
}

}  // namespace sentree::campaign
