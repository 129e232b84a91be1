#include "sentree/cli/verify_mutate.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "sentree/base/temporary_folder.h"
#include "sentree/cli/interrupts.h"
#include "sentree/cli/output.h"
#include "sentree/cli/verify_options.h"
#include "sentree/cli/verify_result.h"
#include "sentree/project/part_cache.h"
#include "sentree/text/file.h"
#include "sentree/text/overlay.h"
#include "sentree/verify/any_reply.h"
#include "sentree/verify/mutate.h"

namespace sentree::cli {

namespace {

namespace fs = std::filesystem;

enum class Fate : std::uint8_t { kNoticed, kNotNoticed, kSame, kRefused, kUnknown };
constexpr const char* kFates[] = {"noticed", "not noticed", "same", "refused", "unknown"};

struct Tried {
  verify::Mutant mutant;
  Fate fate = Fate::kUnknown;
  std::vector<std::string> by;  // requirements that notice it
  std::string why;              // it was refused, or is unknown
};

class Mutating {
 public:
  Mutating(const VerifyCommand& command, const project::Plan& plan) : command_(command), plan_(plan) {}

  int operator()() {
    const Interrupts interrupts;
    if (!read_options(command_, plan_, asked_)) return kUsage;
    asked_.explore.interrupted = is_interrupted;
    asked_.judge.probabilities = false;
    asked_.explore.tells_what_is_said = true;
    const std::vector<text::ReadFile> files = read_files();
    original_ = verify::verify(plan_, asked_);
    if (has_errors(original_.errors)) return refuse(command_, original_.errors);
    say(original_.errors);
    // A mutant may have states without end, which is no reason to wait for them.
    asked_.explore.states = std::min<std::uint64_t>(asked_.explore.states, 4 * original_.graph.nodes.size() + 10'000);
    verify::Passed passed;
    for (const text::ReadFile& file : files) verify::collect_passed(file.content, passed);
    for (const auto& [name, service] : plan_.services) {
      if (service.service) verify::collect_passed(name, *service.service, passed);
    }
    std::vector<std::pair<const fs::path*, verify::Mutant>> all;
    for (const text::ReadFile& file : files) {
      for (verify::Mutant& mutant : verify::mutants(file.content, shown(file.path), passed))
        all.emplace_back(&file.path, std::move(mutant));
    }
    for (auto& [file, mutant] : all) {
      if (is_interrupted()) break;
      show_status(fmt::format("{} of {} mutants tried", tried_.size(), all.size()));
      Tried one = tried(*file, std::move(mutant));
      // What Ctrl-C has ended is not tried.
      if (is_interrupted() && one.fate == Fate::kUnknown) break;
      tried_.push_back(std::move(one));
    }
    not_tried_ = all.size() - tried_.size();
    show_status("");
    print(command_.json ? to_json(json()) + "\n" : text());
    return not_tried_ > 0 ? kInterrupted : kOk;
  }

 private:
  [[nodiscard]] std::string shown(const fs::path& file) const {
    return plan_.scenario.project.shown(file.lexically_relative(plan_.scenario.project.folder).string());
  }

  [[nodiscard]] Loaded<project::Plan> load() {
    auto scenario = load_verified(command_);
    Loaded<project::Plan> plan;
    plan.diagnostics = std::move(scenario.diagnostics);
    if (!scenario.ok()) return plan;
    plan = project::prepare(verify::with_models(*scenario.value), cache_);
    if (!plan.ok()) return plan;
    if (any_.path().empty()) {
      plan.value.reset();
      plan.diagnostics.push_back({Severity::kError, "verify.no-folder", "no temporary folder can be made", {}});
      return plan;
    }
    // Services without a model answer what is told apart now.
    const auto any = verify::add_models(*scenario.value, *plan.value, any_.path() / std::to_string(loaded_++));
    if (!any) {
      plan.value.reset();
      plan.diagnostics.push_back(any.error());
      return plan;
    }
    asked_.untried = verify::untried(*any);
    if (!any->empty()) plan = project::prepare(verify::with_models(std::move(*scenario.value)), cache_);
    return plan;
  }

  // The mission's trees and the charts of its skills, each once.
  [[nodiscard]] std::vector<text::ReadFile> read_files() {
    std::set<fs::path> others;
    const auto inside = [&](const std::string& file) {
      return fs::absolute(plan_.scenario.project.folder / file).lexically_normal();
    };
    const text::ReadLog log;
    const auto plan = load();
    if (!plan.ok()) return {};
    const project::Project& of = plan.value->scenario.project;
    for (const project::ModelEntry& model : of.models) others.insert(inside(model.file.path));
    for (const project::MonitorEntry& monitor : of.monitors) others.insert(inside(monitor.file.path));
    std::vector<text::ReadFile> files;
    for (const text::ReadFile& file : log.files()) {
      const std::string ending = file.path.extension().string();
      if ((ending == ".xml" || ending == ".scxml") && !others.contains(fs::absolute(file.path).lexically_normal()))
        files.push_back(file);
    }
    return files;
  }

  Tried tried(const fs::path& file, verify::Mutant mutant) {
    Tried out{.mutant = std::move(mutant), .fate = Fate::kUnknown, .by = {}, .why = {}};
    const text::Overlay overlay{{fs::absolute(file).lexically_normal(), out.mutant.text}};
    const text::ReadThrough through(overlay);
    const auto plan = load();
    if (!plan.ok()) {
      const auto error = std::find_if(plan.diagnostics.begin(), plan.diagnostics.end(),
                                      [](const Diagnostic& d) { return d.severity == Severity::kError; });
      out.fate = Fate::kRefused;
      if (error != plan.diagnostics.end()) out.why = to_string(*error);
      return out;
    }
    const verify::Verification found = verify::verify(*plan.value, asked_);
    if (has_errors(found.errors)) {
      // It cannot be explored any more: its author is told, as by a check.
      out.fate = Fate::kRefused;
      out.why = to_string(found.errors.front());
      return out;
    }
    for (std::size_t i = 0; i < std::min(found.judgements.size(), original_.judgements.size()); ++i) {
      const verify::Judgement& now = found.judgements[i];
      const verify::Judgement& before = original_.judgements[i];
      if (notices(before, now)) out.by.push_back(now.requirement);
      if (!now.error.empty()) out.why = now.error;
      if (!now.limit.empty()) out.why = fmt::format("{}: {}", now.requirement, now.limit);
      const bool is_new = now.finding == verify::Finding::kRefuted && !notices(before, now);
      if (is_new && before.finding == verify::Finding::kUnknown)
        out.why = fmt::format("{} is refuted, and was not decided before", now.requirement);
    }
    if (!found.graph.complete) out.why = found.graph.limit.empty() ? "not every reply was tried" : found.graph.limit;
    if (!out.by.empty()) {
      out.fate = Fate::kNoticed;
      out.why.clear();
    } else if (out.why.empty()) {
      out.fate = verify::same_behaviour(found.graph, original_.graph) ? Fate::kSame : Fate::kNotNoticed;
    }
    return out;
  }

  // What is refuted as it is notices nothing, nor what is not known of where the mutant is refuted.
  [[nodiscard]] bool notices(const verify::Judgement& before, const verify::Judgement& now) const {
    if (now.finding != verify::Finding::kRefuted) return !now.vacuous.empty() && before.vacuous.empty();
    if (before.finding == verify::Finding::kRefuted) return false;
    return before.finding == verify::Finding::kHolds ||
           (before.limit.empty() && !now.path->loop && now.path->edges.size() <= original_.graph.complete_to);
  }

  [[nodiscard]] std::vector<std::string> refuted_as_they_are() const {
    std::vector<std::string> out;
    for (const verify::Judgement& one : original_.judgements) {
      if (one.finding == verify::Finding::kRefuted) out.push_back(one.requirement);
    }
    return out;
  }

  [[nodiscard]] std::size_t count(Fate fate) const {
    return static_cast<std::size_t>(
        std::count_if(tried_.begin(), tried_.end(), [&](const Tried& one) { return one.fate == fate; }));
  }

  std::string text() const {
    std::string out =
        fmt::format("mutants     {} tried: {} noticed, {} not noticed, {} behave the same, {} refused, {} not known\n",
                    tried_.size(), count(Fate::kNoticed), count(Fate::kNotNoticed), count(Fate::kSame),
                    count(Fate::kRefused), count(Fate::kUnknown));
    if (not_tried_ > 0) out += fmt::format("INTERRUPTED: {} more were not tried\n", not_tried_);
    std::map<std::string, std::size_t> by;
    for (const verify::Judgement& judgement : original_.judgements) by[judgement.requirement];
    for (const Tried& one : tried_) {
      for (const std::string& requirement : one.by) ++by[requirement];
    }
    const std::vector<std::string> refuted = refuted_as_they_are();
    for (const auto& [requirement, noticed] : by) {
      const bool is_refuted = std::find(refuted.begin(), refuted.end(), requirement) != refuted.end();
      out += fmt::format("  {} notices {}{}\n", requirement, noticed,
                         is_refuted ? ", since it is refuted as it is: that a change violates it tells nothing" : "");
    }
    const auto list = [&](Fate fate, const std::string& title) {
      bool first = true;
      for (const Tried& one : tried_) {
        if (one.fate != fate) continue;
        out += (first ? title + "\n" : "") + fmt::format("  {}  {}\n", to_string(one.mutant.place), one.mutant.what);
        first = false;
      }
    };
    list(Fate::kNotNoticed, "no requirement notices");
    list(Fate::kUnknown, "not known: not everything could be tried");
    return out;
  }

  Value json() const {
    List mutants;
    for (const Tried& one : tried_) {
      List by;
      for (const std::string& requirement : one.by) by.emplace_back(requirement);
      Map entry{{"file", one.mutant.place.file},
                {"line", static_cast<std::int64_t>(one.mutant.place.line)},
                {"column", static_cast<std::int64_t>(one.mutant.place.column)},
                {"what", one.mutant.what},
                {"fate", kFates[static_cast<std::size_t>(one.fate)]},
                {"noticed_by", std::move(by)}};
      entry["why"] = one.why.empty() ? Value() : Value(one.why);
      mutants.emplace_back(std::move(entry));
    }
    Map counts;
    for (const Fate fate : {Fate::kNoticed, Fate::kNotNoticed, Fate::kSame, Fate::kRefused, Fate::kUnknown})
      counts[kFates[static_cast<std::size_t>(fate)]] = static_cast<std::int64_t>(count(fate));
    counts["not tried"] = static_cast<std::int64_t>(not_tried_);
    return Map{{"tool", "sentree verify"},
               {"version", SENTREE_VERSION},
               {"ended_by", not_tried_ > 0 ? Value("interrupted") : Value()},
               {"refuted_as_they_are", to_list(refuted_as_they_are())},
               {"counts", std::move(counts)},
               {"mutants", std::move(mutants)}};
  }

  const VerifyCommand& command_;
  const project::Plan& plan_;
  verify::Asked asked_;
  verify::Verification original_;
  project::PartCache cache_;
  TemporaryFolder any_{"mutants"};  // models of services without one
  std::size_t loaded_ = 0;
  std::vector<Tried> tried_;
  std::size_t not_tried_ = 0;  // it was interrupted
};

}  // namespace

int verify_mutants(const VerifyCommand& command, const project::Plan& plan) { return Mutating(command, plan)(); }

}  // namespace sentree::cli
