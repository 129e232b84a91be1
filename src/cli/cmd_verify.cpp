#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

#include "sentree/base/shown.h"
#include "sentree/cli/commands.h"
#include "sentree/cli/interrupts.h"
#include "sentree/cli/output.h"
#include "sentree/cli/report.h"
#include "sentree/cli/verify_against.h"
#include "sentree/cli/verify_findings.h"
#include "sentree/cli/verify_mutate.h"
#include "sentree/cli/verify_options.h"
#include "sentree/cli/verify_statistics.h"
#include "sentree/cli/watched_work.h"
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

// Executes a scenario in the run-time system: whether it comes out as it says of the requirement, and of all others but
// those that cannot be judged.
// @param violated  If given, receives the names of all monitors that are.
bool confirmed(const project::Plan& plan, const std::string& requirement, std::unique_ptr<replay::RunRecorder> recorder,
               std::vector<std::string>* violated = nullptr) {
  runtime::RunOptions options;
  if (recorder) recorder->install(options);
  runtime::Run run(plan, std::move(options));
  const runtime::RunReport report = run.execute();
  if (recorder) (void)recorder->finish(report);
  std::size_t given_up = 0;
  for (const runtime::MonitorReport& monitor : report.monitors) {
    const bool is_violated = monitor.verdict == monitor::Verdict::kViolated || monitor.violations > 0;
    if (violated != nullptr && is_violated) violated->push_back(monitor.name);
    if (!monitor.failure.empty() && monitor.name != requirement) ++given_up;
  }
  return report.error.empty() && report.given_up.empty() && report.unmet.size() == given_up;
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
    if (has_errors(result_.errors)) {
      if (command_.json) print(to_json(Value(Map{{"errors", to_value(result_.errors)}})) + "\n");
      say(result_.errors);
      return kInvalidInput;
    }
    if (!command_.graph.empty() && !write_graph()) return kEnvironment;
    write_reached();
    for (verify::Judgement& judgement : result_.judgements) {
      if (judgement.finding != verify::Finding::kRefuted) continue;
      if (auto shown = show(judgement); !shown) {
        // Nothing is claimed of that one; what is known of the others stays.
        is_unshown_ = true;
        judgement.finding = verify::Finding::kUnknown;
        judgement.error = std::move(shown.error());
        judgement.path.reset();
      }
    }
    say_what_is_left();
    const Findings findings{plan_, asked, result_, any_, std::move(shown_)};
    print(command_.json ? to_json(to_value(findings, reached())) + "\n" : to_text(findings));
    return code();
  }

 private:
  // Writes the counterexample as a scenario, and what comes of it in the run-time system as a recording. Error: why
  // there is none.
  tl::expected<void, std::string> show(const verify::Judgement& judgement) {
    ShownCounterexample shown;
    auto example = verify::counterexample(result_.graph, judgement, plan_.scenario);
    if (auto written = write(judgement, example, shown); !written) return written;
    if (judgement.path->loop) shown.loop_ticks = judgement.path->edges.size() - *judgement.path->loop;
    shown_[judgement.requirement] = std::move(shown);
    return {};
  }

  // Counterexamples of an earlier verification: nobody takes them for this one's.
  void say_what_is_left() const {
    std::error_code error;
    for (const verify::Judgement& judgement : result_.judgements) {
      const fs::path file = out_folder() / (judgement.requirement + ".yaml");
      if (judgement.finding == verify::Finding::kHolds && fs::exists(file, error))
        say(fmt::format("{} is from before: {} holds now", file.string(), judgement.requirement));
    }
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

  tl::expected<void, std::string> write(const verify::Judgement& judgement, project::Scenario& example,
                                        ShownCounterexample& shown) {
    const fs::path project = plan_.scenario.project.folder;
    const fs::path folder = out_folder();
    std::error_code error;
    const fs::path file = folder / (judgement.requirement + ".yaml");
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
        return plan.ok() && confirmed(*plan.value, judgement.requirement, nullptr);
      });
    }
    // What else it violates is expected of it too: as a test, it would fail by that.
    std::vector<std::string> violated;
    if (const auto plan = prepared(example); plan.ok())
      (void)confirmed(*plan.value, judgement.requirement, nullptr, &violated);
    for (const std::string& name : violated) example.verdicts.try_emplace(name, "violated");
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
      return tl::unexpected(fmt::format(
          "refuted at {} s, but {}", shortest_decimal(seconds(judgement.at)),
          plan.ok() ? to_string(sink.error()) : file.string() + " cannot be written, or not be read again"));
    }
    auto recorder = std::make_unique<replay::RunRecorder>(
        *plan.value, files.files(), std::move(*sink),
        replay::RecordingOptions{.library = "sentree " SENTREE_VERSION,
                                 .on_failure = [](const std::string& what) { say("! " + what); },
                                 .story = story_without_witness});
    if (!confirmed(*plan.value, judgement.requirement, std::move(recorder))) {
      return tl::unexpected(
          fmt::format("internal error: the counterexample {} does not come out so in a run; please report it with the "
                      "project. Nothing is claimed of {}",
                      file.string(), judgement.requirement));
    }
    if (command_.explain) shown.story = story_of(*plan.value, judgement);
    return {};
  }

  // What is not as in `before`, which it becomes: of a structure the members, cut to what one reads at a glance.
  static std::string changed_in(Value& before, const Value& result) {
    constexpr std::size_t kShownMax = 72;
    if (before == result) return {};
    const Map* old = before.as_map();
    const Map* present = result.as_map();
    std::string text;
    if (old != nullptr && present != nullptr) {
      for (const auto& [name, value] : *present) {
        const Value* was = old->find(name);
        if (was == nullptr || !(*was == value))
          text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, to_json(value));
      }
    } else {
      text = to_json(result);
    }
    before = result;
    if (text.size() <= kShownMax) return text;
    std::size_t end = kShownMax;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
    return text.substr(0, end) + "…";
  }

  // " (robot#3, not true; models/robot.scxml:33)": what else it could have been, as `sentree run --choose` wants it.
  static std::string others(const verify::Told& tick, std::size_t index, const std::string& model,
                            const std::string& value, const Value* place) {
    if (index >= tick.choices.size() || tick.choices[index].count < 2) return {};
    const verify::Told::Choice& choice = tick.choices[index];
    std::string text;
    for (const std::string& other : choice.alternatives) {
      if (other != value) text += (text.empty() ? "" : ", ") + other;
    }
    if (choice.count > choice.alternatives.size()) text += ", …";
    return fmt::format(" ({}#{}, not {}{})", model, choice.number, text,
                       place != nullptr ? fmt::format("; {}", place->text()) : "");
  }

  // Tick by tick, what is not as it was.
  static std::string story_of(const project::Plan& plan, const verify::Judgement& judgement) {
    const auto told = verify::retell(plan);
    if (!told) return fmt::format("{}\n", to_string(told.error()));
    std::string out;
    std::map<std::string, std::string> last;
    std::map<std::string, Value> results;
    const auto& loop = judgement.path->loop;
    for (const verify::Told& tick : *told) {
      if (loop && tick.tick > judgement.path->edges.size()) break;
      if (loop && tick.tick == *loop + 1)
        out += fmt::format("    from here on the same for ever, and {} is owed:\n", judgement.requirement);
      std::string line;
      std::size_t choices = 0;
      // What timers do comes before the tick of its period, and has a line of its own.
      const TimePoint at_tick = TimePoint{} + plan.scenario.project.period * static_cast<std::int64_t>(tick.tick - 1);
      TimePoint at = at_tick;
      const auto end_line = [&] {
        if (!line.empty()) {
          const std::string label = at == at_tick ? fmt::format("tick {:<4}", tick.tick) : std::string();
          out += fmt::format("    {:<9} {:>8} s  {}\n", label, shortest_decimal(seconds(at)), line);
        }
        line.clear();
      };
      const auto add = [&](const std::string& what) { line += (line.empty() ? "" : ", ") + what; };
      for (const Message& message : tick.messages) {
        if (!loop && message.time > judgement.at) break;
        if (message.time != at) end_line();
        at = message.time;
        if (message.name.ends_with(".choice")) {
          const Value* name = message.data.find("name");
          const std::string value = to_json(*message.data.find("value"));
          const Value* place = message.data.find("place");
          add(fmt::format("{} chooses {}{}{}", message.source,
                          name != nullptr ? fmt::format("{} = ", name->text()) : "", value,
                          others(tick, choices++, message.source, value, place)));
        } else if (message.name == "scenario.injection") {
          add(fmt::format("fault: {} {}", message.data.find("what")->text(), message.target));
        } else if (message.name.ends_with(".tick.reply")) {
          const std::string status(message.data.find("status")->text());
          if (std::exchange(last[message.name], status) != status) add(fmt::format("{} {}", message.source, status));
        } else if (message.kind == MessageKind::kReply && message.data.find("result") != nullptr) {
          const std::string call = message.name.substr(0, message.name.size() - 6);
          const Value* args = message.data.find("args");
          const std::string asked = args != nullptr && !args->as_map()->empty() ? to_json(*args) : "";
          const std::string changed = changed_in(results[call + asked], *message.data.find("result"));
          if (!changed.empty()) add(fmt::format("{}{} → {}", call, asked, changed));
        } else if (message.kind == MessageKind::kError) {
          add(message.name);
        }
      }
      end_line();
    }
    if (loop) return out;
    out += fmt::format("    {:>20} s  {}\n", shortest_decimal(seconds(judgement.at)),
                       judgement.state == "the mission ends"
                           ? fmt::format("the mission ends, and {} is owed", judgement.requirement)
                           : judgement.requirement + " is VIOLATED");
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
};

}  // namespace

int verify(const VerifyCommand& command) {
  std::optional<text::ReadLog> files(std::in_place);
  auto loaded = load_verified(command);
  say(loaded.diagnostics);
  if (!loaded.ok()) return kInvalidInput;
  project::Scenario scenario = std::move(*loaded.value);
  project::PartCache parts;
  auto plan = project::prepare(verify::with_models(scenario), parts);
  say(plan.diagnostics);
  if (!plan.ok()) return kInvalidInput;
  std::vector<text::ReadFile> read = files->files();
  files.reset();  // one at a time
  if (!command.against.empty()) {
    return watched_work(*plan.value, command.json, [&] { return verify_against(command, *plan.value); });
  }
  const fs::path folder = scenario.project.folder;
  const fs::path out = command.out.empty() ? folder / "verify" : fs::path(command.out);
  const auto any =
      verify::add_models(scenario, *plan.value, command.model ? folder / "models" : out / "any", command.model);
  if (!any) {
    say(to_string(any.error()));
    if (command.json) print(to_json(Value(Map{{"errors", to_value(Diagnostics{any.error()})}})) + "\n");
    return kInvalidInput;
  }
  if (command.model) {
    print(models_text(*any));
    return kOk;
  }
  if (!any->empty()) {
    plan = project::prepare(verify::with_models(std::move(scenario)), parts);
    say(plan.diagnostics);
    if (!plan.ok()) return kInvalidInput;
  }
  return watched_work(*plan.value, command.json, [&] {
    if (command.mutate) return verify_mutants(command, *plan.value);
    if (command.runs || !command.at_least.empty() || !command.split.empty()) {
      const Diagnostics in_the_way = verify::obstacles(*plan.value);
      say(in_the_way);
      return has_errors(in_the_way) ? kInvalidInput : verify_by_runs(command, *plan.value);
    }
    return Verifying(command, *plan.value, *any, std::move(read), parts)();
  });
}

}  // namespace sentree::cli
