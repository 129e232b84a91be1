#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <new>

#include "sentree/base/shown.h"
#include "sentree/cli/commands.h"
#include "sentree/cli/interrupts.h"
#include "sentree/cli/output.h"
#include "sentree/cli/report.h"
#include "sentree/cli/verify_against.h"
#include "sentree/cli/verify_findings.h"
#include "sentree/cli/verify_mutate.h"
#include "sentree/cli/verify_options.h"
#include "sentree/cli/verify_result.h"
#include "sentree/cli/verify_statistics.h"
#include "sentree/cli/verify_story.h"
#include "sentree/cli/watched_work.h"
#include "sentree/project/cpp_nodes.h"
#include "sentree/project/part_cache.h"
#include "sentree/record/sink.h"
#include "sentree/replay/recording.h"
#include "sentree/studio/verified.h"
#include "sentree/text/file.h"
#include "sentree/verify/any_reply.h"
#include "sentree/verify/verify.h"

namespace sentree::cli {

namespace {

namespace fs = std::filesystem;

// What was written, and what makes a project use it.
std::string models_text(const std::vector<verify::MadeModel>& made) {
  if (made.empty()) return "every service has a model\n";
  std::string out;
  for (const verify::MadeModel& model : made) {
    out += model.file + "\n";
    for (const std::string& line : model.tried) out += fmt::format("  {}\n", line);
    if (model.unsure) out += fmt::format("  that is not all: {}\n", to_string(*model.unsure));
    for (const verify::Untried& one : model.untried) out += fmt::format("  that is not all: {}\n", to_string(one.told));
  }
  out += "to use them, in sentree.yaml:\nmodels:\n";
  for (const verify::MadeModel& model : made)
    out += fmt::format("  - {{file: {0}, name: any_{1}, serves: [{1}]}}\n", model.file, model.service);
  return out;
}

// What is wanted of a run besides whether it comes out as it should.
struct Course {
  std::vector<std::string> violated;  // names of all monitors that are
  // Choices of models before the requirement was violated first, or all of them.
  std::size_t choices = 0;
  std::size_t led_there() const { return led_there_.value_or(choices); }

  // @param options  Of the run; the course stays where it is until that has ended.
  void watch(const project::Plan& plan, const std::string& requirement, runtime::RunOptions& options) {
    for (const project::ModelPlan& model : plan.models) {
      options.listeners_of.emplace_back(model.name + ".choice", [this, name = model.name](const Message& message) {
        if (message.source != name) return;
        ++choices;
        if (deciding_ == message.sequence) ++*led_there_;  // monitors hear of it first
      });
    }
    options.on_decision = [this, &requirement](const runtime::MonitorReport& monitor) {
      const auto& decision = monitor.decision;
      if (led_there_ || monitor.name != requirement || !decision || decision->verdict != monitor::Verdict::kViolated)
        return;
      led_there_ = choices;
      if (decision->deciding) deciding_ = decision->deciding->sequence;
    };
  }

 private:
  std::optional<std::size_t> led_there_;
  std::uint64_t deciding_ = 0;
};

// Executes a scenario in the run-time system: whether it comes out as it says of the requirement of what is shown, and
// of all others but those that cannot be judged.
bool confirmed(const project::Plan& plan, const verify::Judgement& judgement,
               std::unique_ptr<replay::RunRecorder> recorder, Course* course = nullptr) {
  runtime::RunOptions options;
  if (recorder) recorder->install(options);
  if (course != nullptr) course->watch(plan, judgement.requirement, options);
  runtime::Run run(plan, std::move(options));
  const runtime::RunReport report = run.execute();
  if (recorder) (void)recorder->finish(report);
  std::size_t given_up = 0;
  for (const runtime::MonitorReport& monitor : report.monitors) {
    const bool is_violated = monitor.verdict == monitor::Verdict::kViolated || monitor.violations > 0;
    if (course != nullptr && is_violated) course->violated.push_back(monitor.name);
    if (!monitor.failure.empty() && monitor.name != judgement.requirement) ++given_up;
  }
  // What is owed when the duration is over need not be so when the mission ends.
  const bool has_ended = judgement.state != "the mission ends" || !report.timed_out;
  return has_ended && report.error.empty() && report.given_up.empty() && report.unmet.size() == given_up;
}

class Verifying {
 public:
  /// @param plan  Borrowed.
  /// @param any  Models that were made for the services without one.
  /// @param read  What the project was read from,
  /// @param parts  and its charts, interfaces and map; borrowed.
  Verifying(const VerifyCommand& command, const project::Plan& plan, std::vector<verify::MadeModel> any,
            std::vector<text::ReadFile> read, project::PartCache& parts)
      : command_(command), plan_(plan), any_(std::move(any)), read_(std::move(read)), parts_(parts) {}

  int operator()() {
    verify::Asked asked;
    if (!read_options(command_, plan_, asked)) return kUsage;
    asked.untried = verify::untried(any_);
    if (!command_.graph.empty() && !command_.graph.ends_with(".aut") && !command_.graph.ends_with(".dot")) {
      say(fmt::format("--graph {}: a file that ends in .aut or .dot", command_.graph));
      return kUsage;
    }
    if (plan_.monitors.empty())
      say("the project has no requirements and no monitors, so nothing is proved; sentree add monitor NAME writes one");
    const Interrupts interrupts;
    asked.explore.interrupted = is_interrupted;
    asked.explore.progress = [](std::size_t states, std::size_t edges) {
      show_status(fmt::format("{} states, {} periods", grouped(states), grouped(edges)));
    };
    result_ = verify::verify(plan_, asked);
    show_status("");
    if (has_errors(result_.errors)) return refuse(command_, result_.errors);
    if (!command_.graph.empty() && !write_graph()) return kEnvironment;
    write_reached();
    for (verify::Judgement& judgement : result_.judgements) {
      const bool is_refuted = judgement.finding == verify::Finding::kRefuted;
      if (!is_refuted && !judgement.can_stay_open) continue;
      const auto shown = is_refuted ? show(judgement, "", shown_) : show(left_open(judgement), kOpen, open_);
      if (shown) continue;
      if (!is_refuted && !shown.error().disagrees) {
        say(fmt::format("{} {}", judgement.requirement, shown.error().why));
        continue;
      }
      // Nothing is claimed of that one; what is known of the others stays.
      is_unshown_ = true;
      judgement.finding = verify::Finding::kUnknown;
      judgement.error = shown.error().why;
      judgement.path.reset();
      judgement.can_stay_open.reset();
    }
    say_what_is_left();
    const Findings findings{command_, plan_, asked, result_, any_, std::move(shown_), std::move(open_)};
    print(command_.json ? to_json(to_value(findings, reached())) + "\n" : to_text(findings));
    return code();
  }

 private:
  // Why something is not shown.
  struct Unshown {
    std::string why;
    bool disagrees = false;  // a run of it comes out differently
  };

  // Writes what the judgement's path shows as a scenario, and what comes of it in the run-time system as a recording.
  // @param kind  Of the files, behind the requirement's name.
  tl::expected<void, Unshown> show(const verify::Judgement& judgement, std::string_view kind,
                                   std::map<std::string, ShownCounterexample>& all) {
    ShownCounterexample shown;
    auto example = verify::counterexample(result_.graph, judgement, plan_.scenario);
    if (auto written = write(judgement, kind, example, shown); !written) return written;
    if (judgement.path->loop) shown.loop_ticks = judgement.path->edges.size() - *judgement.path->loop;
    all[judgement.requirement] = std::move(shown);
    return {};
  }

  // What an earlier verification showed: nobody takes it for this one's.
  void say_what_is_left() const {
    std::error_code error;
    for (const verify::Judgement& judgement : result_.judgements) {
      const fs::path file = file_of(judgement, "");
      if (judgement.finding == verify::Finding::kHolds && fs::exists(file, error))
        say(fmt::format("{} is from before: {} holds now", file.string(), judgement.requirement));
      const fs::path open = file_of(judgement, kOpen);
      const bool is_settled = judgement.finding == verify::Finding::kHolds && !judgement.can_stay_open;
      if (is_settled && fs::exists(open, error))
        say(fmt::format("{} is from before: {} cannot stay open now", open.string(), judgement.requirement));
    }
  }

  fs::path file_of(const verify::Judgement& judgement, std::string_view kind) const {
    return out_folder() / fmt::format("{}{}.yaml", judgement.requirement, kind);
  }

  // Where what is found is written.
  fs::path out_folder() const {
    fs::path folder = command_.out.empty() ? plan_.scenario.project.folder / "verify" : fs::path(command_.out);
    std::error_code error;
    fs::create_directories(folder, error);
    return folder;
  }

  campaign::Coverage reached() const {
    const verify::Graph& graph = result_.graph;
    campaign::Coverage coverage;
    coverage.add(plan_);
    campaign::Coverage::Met met(plan_);
    for (std::size_t node = 0; node < graph.nodes_had.size(); ++node) {
      for (const bt::Status status : {bt::Status::kRunning, bt::Status::kSuccess, bt::Status::kFailure}) {
        if ((graph.nodes_had[node] >> static_cast<unsigned>(status) & 1U) != 0)
          met.nodes[node].emplace(to_string(status));
      }
    }
    for (std::size_t leaf = 0; leaf < graph.taken.size(); ++leaf) {
      for (std::size_t i = 0; i < graph.entered[leaf].size(); ++i) {
        if (graph.entered[leaf][i]) met.states[leaf].insert(static_cast<scxml::StateIndex>(i));
      }
      for (std::size_t i = 0; i < graph.taken[leaf].size(); ++i) {
        const auto index = static_cast<scxml::TransitionIndex>(i);
        if (graph.taken[leaf][i]) met.transitions[leaf].insert(index);
        for (const bool holds : {false, true}) {
          if ((graph.guards[leaf][i] & (holds ? 2U : 1U)) != 0) met.guards[leaf].emplace(index, holds);
        }
      }
    }
    met.calls = graph.calls;
    for (const verify::Judgement& judgement : result_.judgements) {
      const bool is_decided = judgement.finding != verify::Finding::kUnknown && judgement.error.empty();
      if (is_decided && judgement.vacuous.empty()) met.tested.insert(judgement.requirement);
    }
    coverage.reach(plan_, met);
    return coverage;
  }

  // For pages; a project that nobody may write is verified all the same.
  void write_reached() const {
    const fs::path folder = out_folder();
    const studio::Verified verified{.coverage = reached(),
                                    .with_requirements = command_.only.empty(),
                                    .complete = result_.graph.complete,
                                    .complete_to_tick = result_.graph.complete_to,
                                    .states = result_.graph.nodes.size()};
    const fs::path file = folder / studio::kVerifiedFile;
    const auto written =
        text::write_file(file, studio::verified_text(verified, plan_.scenario.project.folder, folder, read_));
    if (!written) say(to_string(written.error()));
  }

  tl::expected<void, Unshown> write(const verify::Judgement& judgement, std::string_view kind,
                                    project::Scenario& example, ShownCounterexample& shown) {
    const fs::path project = plan_.scenario.project.folder;
    const fs::path folder = out_folder();
    std::error_code error;
    const fs::path file = file_of(judgement, kind);
    const bool beside = fs::weakly_canonical(folder, error).parent_path() == fs::weakly_canonical(project, error);
    const std::string above =
        beside ? "" : fs::relative(fs::weakly_canonical(project, error), fs::weakly_canonical(folder, error)).string();
    const auto prepared = [&](const project::Scenario& scenario) {
      std::ofstream(file) << verify::scenario_text(scenario, judgement, above);
      auto loaded = project::load_scenario(file);
      return loaded.ok() ? project::prepare(std::move(*loaded.value), parts_) : Loaded<project::Plan>{};
    };
    if (!judgement.path->loop) {
      verify::simplify(example, plan_.scenario, [&](const project::Scenario& scenario) {
        const auto plan = prepared(scenario);
        return plan.ok() && confirmed(*plan.value, judgement, nullptr);
      });
    }
    // What else it violates is expected of it too: as a test, it would fail by that.
    Course course;
    if (const auto plan = prepared(example); plan.ok()) {
      (void)confirmed(*plan.value, judgement, nullptr, &course);
      shown.chosen = chosen(*plan.value, course.led_there(), judgement.path->edges.size());
    }
    for (const std::string& name : course.violated) example.verdicts.try_emplace(name, "violated");
    shown.choices = example.choices->size();
    shown.orders = example.orders.size();
    for (std::size_t i = plan_.scenario.timeline.size(); i < example.timeline.size(); ++i)
      ++shown.faults[project::describe(example.timeline[i].what)];
    shown.scenario = file.string();
    shown.recording = fs::path(file).replace_extension(".mcap").string();
    const text::ReadLog files;
    const auto plan = prepared(example);
    auto sink = record::FileSink::create(shown.recording);
    if (!plan.ok() || !sink) {
      if (!plan.ok()) {
        say(plan.diagnostics);
        fs::remove(file, error);  // nobody takes it for a scenario of the project
      }
      return tl::unexpected(Unshown{fmt::format(
          "{} at {} s, but {}", judgement.finding == verify::Finding::kRefuted ? "refuted" : "can be open in the end",
          shortest_decimal(seconds(judgement.at)),
          plan.ok() ? to_string(sink.error()) : file.string() + " cannot be written, or not be read again")});
    }
    auto recorder = std::make_unique<replay::RunRecorder>(
        *plan.value, files.files(), std::move(*sink),
        replay::RecordingOptions{.library = "sentree " SENTREE_VERSION,
                                 .on_failure = [](const std::string& what) { say("! " + what); },
                                 .story = story_without_witness});
    if (!confirmed(*plan.value, judgement, std::move(recorder))) {
      const std::string in_cpp = project::shown_cpp_nodes(*plan.value);
      return tl::unexpected(Unshown{
          fmt::format("{}what {} shows does not come out so in a run; {}. Nothing is claimed of {}",
                      in_cpp.empty() ? "internal error: " : "", file.string(),
                      in_cpp.empty() ? "please report it with the project"
                                     : fmt::format("the mission has nodes in C++ ({}), and one of them does not do the "
                                                   "same each time, or remembers what its `save` does not hold",
                                                   in_cpp),
                      judgement.requirement),
          true});
    }
    if (command_.explain) shown.story = story_of(*plan.value, judgement);
    return {};
  }

  // The first `count` choices of models, of the first `ticks` ticks, as far as there was something to choose.
  static std::vector<ShownCounterexample::Chosen> chosen(const project::Plan& plan, std::size_t count,
                                                         std::size_t ticks) {
    std::vector<ShownCounterexample::Chosen> out;
    const auto told = verify::retell(plan);
    if (!told) return out;
    for (const verify::Told& tick : *told) {
      if (tick.tick > ticks) break;
      std::size_t index = 0;
      for (const Message& message : tick.messages) {
        if (!is_choice(plan, message) || index == tick.choices.size()) continue;
        if (count-- == 0) return out;
        if (tick.choices[index++].count < 2) continue;
        const Value* const name = message.data.find("name");
        const Value* const place = message.data.find("place");
        out.push_back({.tick = tick.tick,
                       .name = message.source + (name != nullptr ? fmt::format(".{}", name->text()) : ""),
                       .place = place != nullptr ? std::string(place->text()) : "",
                       .value = to_json(*message.data.find("value"))});
      }
    }
    return out;
  }

  bool write_graph() const {
    const verify::Graph& graph = result_.graph;
    std::ofstream out(command_.graph);
    const bool dot = command_.graph.ends_with(".dot");
    const auto label = [&](const verify::Edge& edge) {
      std::string text;
      for (const verify::Made& made : graph.decisions[edge.made]) {
        if (made.count < 2) continue;
        if (made.kind == verify::Made::Kind::kOrder) text += fmt::format("order {} ", made.alternative);
        if (made.kind == verify::Made::Kind::kOrder ||
            (made.kind == verify::Made::Kind::kFault && made.alternative == 0))
          continue;
        const verify::ChoicePoint& point = graph.choices[made.what];
        text += fmt::format("{}{}{} ", point.model, point.name.empty() ? " " : fmt::format(".{}=", point.name),
                            point.function.find("fault") != std::string::npos ? point.function : point.value);
      }
      std::replace(text.begin(), text.end(), '"', '\'');
      return text.empty() ? std::string("tick") : text.substr(0, text.size() - 1);
    };
    if (dot) {
      out << "digraph mission {\n";
    } else {
      out << "des (0, " << graph.edges.size() << ", " << graph.nodes.size() << ")\n";
    }
    for (const verify::Edge& edge : graph.edges) {
      if (dot)
        out << "  " << edge.from << " -> " << edge.to << " [label=\"" << label(edge) << "\"];\n";
      else
        out << "(" << edge.from << ", \"" << label(edge) << "\", " << edge.to << ")\n";
    }
    if (dot) out << "}\n";
    out.flush();
    if (!out) say(fmt::format("--graph {} cannot be written", command_.graph));
    return static_cast<bool>(out);
  }

  int code() const {
    if (is_unshown_) return kEnvironment;
    bool refuted = false;
    bool error = false;
    bool unknown = !result_.graph.complete;
    for (const auto& judgement : result_.judgements) {
      unknown = unknown || judgement.finding == verify::Finding::kUnknown;
      refuted = refuted || judgement.finding == verify::Finding::kRefuted || !judgement.vacuous.empty();
      error = error || !judgement.error.empty();
    }
    if (error) return kInvalidInput;
    if (refuted) return kFindings;
    if (is_interrupted()) return kInterrupted;
    return unknown ? kTimeLimit : kOk;
  }

  const VerifyCommand& command_;
  const project::Plan& plan_;
  std::vector<verify::MadeModel> any_;
  std::vector<text::ReadFile> read_;
  project::PartCache& parts_;
  verify::Verification result_;
  bool is_unshown_ = false;  // a counterexample could not be shown
  std::map<std::string, ShownCounterexample> shown_;
  std::map<std::string, ShownCounterexample> open_;
  // Beside a counterexample's files those of what can stay open.
  static constexpr std::string_view kOpen = ".open";
};

}  // namespace

namespace {

// What nothing is known of then ends in order too.
std::function<int()> within_memory(const VerifyCommand& command, std::function<int()> work) {
  return [&command, work = std::move(work)] {
    try {
      return work();
    } catch (const std::bad_alloc&) {
      (void)refuse(command, {{Severity::kError,
                              "verify.memory",
                              "there is no more memory; give it less (--memory, --threads), or free some",
                              {}}});
      return static_cast<int>(kTimeLimit);
    }
  };
}

}  // namespace

int verify(const VerifyCommand& command) {
  std::optional<text::ReadLog> files(std::in_place);
  auto loaded = load_verified(command);
  if (!loaded.ok()) return refuse(command, loaded.diagnostics);
  say(loaded.diagnostics, command.project);
  project::Scenario scenario = std::move(*loaded.value);
  project::PartCache parts;
  auto plan = project::prepare(verify::with_models(scenario), parts);
  if (!plan.ok()) return refuse(command, plan.diagnostics);
  say(plan.diagnostics, command.project);
  std::vector<text::ReadFile> read = files->files();
  files.reset();  // one at a time
  if (!command.against.empty()) {
    return watched_work(*plan.value, command.json, [&] { return verify_against(command, *plan.value); });
  }
  const fs::path folder = scenario.project.folder;
  const fs::path out = command.out.empty() ? folder / "verify" : fs::path(command.out);
  const auto any =
      verify::add_models(scenario, *plan.value, command.model ? folder / "models" : out / "any", command.model);
  if (!any) return refuse(command, {any.error()});
  if (command.model) {
    print(models_text(*any));
    return kOk;
  }
  if (!any->empty()) {
    plan = project::prepare(verify::with_models(std::move(scenario)), parts);
    if (!plan.ok()) return refuse(command, plan.diagnostics);
    say(plan.diagnostics, command.project);
  }
  return watched_work(*plan.value, command.json, within_memory(command, [&] {
    if (command.mutate) return verify_mutants(command, *plan.value);
    if (command.runs || !command.at_least.empty() || !command.split.empty()) {
      const Diagnostics in_the_way = verify::obstacles(*plan.value);
      if (has_errors(in_the_way)) return refuse(command, in_the_way);
      say(in_the_way);
      return verify_by_runs(command, *plan.value, *any);
    }
    return Verifying(command, *plan.value, *any, std::move(read), parts)();
  }));
}

}  // namespace sentree::cli
