#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

#include "sentree/cli/commands.h"
#include "sentree/cli/interrupts.h"
#include "sentree/cli/output.h"
#include "sentree/cli/report.h"
#include "sentree/cli/verify_against.h"
#include "sentree/cli/verify_mutate.h"
#include "sentree/cli/verify_options.h"
#include "sentree/cli/verify_statistics.h"
#include "sentree/cli/watched_work.h"
#include "sentree/project/part_cache.h"
#include "sentree/record/sink.h"
#include "sentree/replay/recording.h"
#include "sentree/studio/reached.h"
#include "sentree/studio/verified.h"
#include "sentree/text/file.h"
#include "sentree/verify/any_reply.h"
#include "sentree/verify/verify.h"

namespace sentree::cli {

namespace {

namespace fs = std::filesystem;

struct Shown {
  std::string scenario;
  std::string recording;
  std::size_t choices = 0;
  std::size_t loop_ticks = 0;
  std::size_t orders = 0;
  std::map<std::string, std::size_t> faults = {};  // in words, and how often each comes
};

std::string grouped(std::uint64_t number) {
  std::string text = std::to_string(number);
  for (int at = static_cast<int>(text.size()) - 3; at > 0; at -= 3) text.insert(static_cast<std::size_t>(at), ",");
  return text;
}

// What was written, and what makes a project use it.
std::string models_text(const std::vector<verify::MadeModel>& made) {
  if (made.empty()) return "every service has a model\n";
  std::string out;
  for (const verify::MadeModel& model : made) {
    out += model.file + "\n";
    for (const std::string& line : model.tried) out += fmt::format("  {}\n", line);
    if (model.unsure) out += fmt::format("  that is not all: {}\n", to_string(*model.unsure));
  }
  out += "to use them, in sentree.yaml:\nmodels:\n";
  for (const verify::MadeModel& model : made)
    out += fmt::format("  - {{file: {0}, name: any_{1}, serves: [{1}]}}\n", model.file, model.service);
  return out;
}

// Executes a scenario in the run-time system: whether it comes out as it says.
// @param violated  If given, receives the names of all monitors that are.
bool confirmed(const project::Plan& plan, std::unique_ptr<replay::RunRecorder> recorder,
               std::vector<std::string>* violated = nullptr) {
  runtime::RunOptions options;
  if (recorder) recorder->install(options);
  runtime::Run run(plan, std::move(options));
  const runtime::RunReport report = run.execute();
  if (recorder) (void)recorder->finish(report);
  for (const runtime::MonitorReport& monitor : report.monitors) {
    if (violated != nullptr && monitor.verdict == monitor::Verdict::kViolated) violated->push_back(monitor.name);
  }
  return report.error.empty() && report.unmet.empty();
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
    if (!command_.graph.empty() && !command_.graph.ends_with(".aut") && !command_.graph.ends_with(".dot")) {
      say(fmt::format("--graph {}: a file that ends in .aut or .dot", command_.graph));
      return kUsage;
    }
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
    print(command_.json ? to_json(json(asked)) + "\n" : text(asked));
    return code();
  }

 private:
  // Writes the counterexample as a scenario, and what comes of it in the run-time system as a recording. Error: why
  // there is none.
  tl::expected<void, std::string> show(const verify::Judgement& judgement) {
    Shown shown;
    auto example = verify::counterexample(result_.graph, judgement, plan_.scenario);
    if (auto written = write(judgement, example, shown); !written) return written;
    if (judgement.path->loop) shown.loop_ticks = judgement.path->edges.size() - *judgement.path->loop;
    shown_[judgement.requirement] = std::move(shown);
    return {};
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

  tl::expected<void, std::string> write(const verify::Judgement& judgement, project::Scenario& example, Shown& shown) {
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
        return plan.ok() && confirmed(*plan.value, nullptr);
      });
    }
    // What else it violates is expected of it too: as a test, it would fail by that.
    std::vector<std::string> violated;
    if (const auto plan = prepared(example); plan.ok()) (void)confirmed(*plan.value, nullptr, &violated);
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
      if (!plan.ok()) say(plan.diagnostics);
      return tl::unexpected(fmt::format(
          "refuted at {} s, but {}", shortest_decimal(seconds(judgement.at)),
          plan.ok() ? to_string(sink.error()) : file.string() + " cannot be written, or not be read again"));
    }
    auto recorder = std::make_unique<replay::RunRecorder>(
        *plan.value, files.files(), std::move(*sink),
        replay::RecordingOptions{.library = "sentree " SENTREE_VERSION,
                                 .on_failure = [](const std::string& what) { say("! " + what); },
                                 .story = story_without_witness});
    if (!confirmed(*plan.value, std::move(recorder))) {
      return tl::unexpected(
          fmt::format("internal error: the counterexample {} does not come out so in a run; please report it with the "
                      "project. Nothing is claimed of {}",
                      file.string(), judgement.requirement));
    }
    if (command_.explain) story_[judgement.requirement] = story_of(*plan.value, judgement);
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

  [[nodiscard]] std::string basis(const verify::Asked& asked) const {
    std::string text =
        asked.explore.faults.empty()
            ? "no faults"
            : fmt::format("{} faults, {} at a time", asked.explore.faults.size(), asked.explore.faults_at_most);
    return text +
           (asked.explore.order == verify::Order::kAny ? ", any order at one instant" : ", order of virtual time");
  }

  std::string text(const verify::Asked& asked) const {
    const verify::Graph& graph = result_.graph;
    std::string models;
    for (const project::ModelPlan& model : plan_.models) {
      std::string serves;
      for (const std::string& service : model.serves) serves += (serves.empty() ? "" : ", ") + service;
      const bool is_any =
          std::any_of(any_.begin(), any_.end(), [&](const auto& m) { return "any_" + m.service == model.name; });
      models += (models.empty() ? "" : ", ") + (is_any ? serves : model.name) +
                (is_any ? ": any reply" : fmt::format(" ({})", serves));
    }
    std::string out = fmt::format("models      {}   {}\n", models.empty() ? "none" : models, basis(asked));
    for (const verify::MadeModel& any : any_) {
      for (const std::string& tried : any.tried) out += fmt::format("any reply   {}.{}\n", any.service, tried);
    }
    out += fmt::format("explored    {} states, {} periods, {}   {:.2f} s\n", grouped(graph.nodes.size()),
                       grouped(graph.edges.size()),
                       graph.complete ? "complete" : fmt::format("up to tick {}: {}", graph.complete_to, graph.limit),
                       result_.explored_s);
    if (!graph.grows.empty()) out += fmt::format("            most values had {}\n", graph.grows);
    std::size_t width = 0;
    for (const auto& judgement : result_.judgements) width = std::max(width, judgement.requirement.size());
    for (const auto& judgement : result_.judgements) {
      out += fmt::format("{:<{}}   {}\n", judgement.requirement, width, told(judgement));
      if (const auto story = story_.find(judgement.requirement); story != story_.end()) out += story->second;
    }
    for (const std::string& problem : graph.problems) out += fmt::format("! {}\n", problem);
    constexpr std::size_t kShownMax = 12;
    for (std::size_t i = 0; i < std::min(result_.not_reached.size(), kShownMax); ++i)
      out += fmt::format("{}{}\n", i == 0 ? "not reached " : "            ", result_.not_reached[i]);
    if (result_.not_reached.size() > kShownMax)
      out += fmt::format("            … and {} more (--json has all)\n", result_.not_reached.size() - kShownMax);
    return out;
  }

  // What models chose in one place, or which faults came, on a path.
  struct Chosen {
    std::string name;
    std::string place;
    std::vector<std::string> values;  // as JSON; what faults do in words
    std::size_t times = 0;
  };

  // In the order of their first; of faults those that the scenario still has.
  std::vector<Chosen> chosen(const verify::Judgement& judgement) const {
    const verify::Path& path = *judgement.path;
    const verify::Graph& graph = result_.graph;
    std::map<std::string, std::size_t> faults = shown_.at(judgement.requirement).faults;
    std::vector<Chosen> all;
    for (const std::uint32_t edge : path.edges) {
      for (const verify::Made& made : graph.decisions[graph.edges[edge].made]) {
        const bool is_fault = made.kind == verify::Made::Kind::kFault && made.alternative > 0;
        if (!is_fault && (made.kind != verify::Made::Kind::kChoice || made.count < 2)) continue;
        const verify::ChoicePoint& point = graph.choices[made.what];
        const std::string name = is_fault ? point.function : point.model + (point.name.empty() ? "" : "." + point.name);
        const std::string& place = graph.places[made.place];
        const std::string& value = is_fault ? point.name : point.value;
        if (is_fault && point.function == "fault" && !path.loop && faults[value]-- == 0) {
          faults[value] = 0;
          continue;
        }
        auto one = std::find_if(all.begin(), all.end(),
                                [&](const Chosen& known) { return known.name == name && known.place == place; });
        if (one == all.end()) one = all.insert(all.end(), {name, place, {}, 0});
        ++one->times;
        if (std::find(one->values.begin(), one->values.end(), value) == one->values.end()) one->values.push_back(value);
      }
    }
    return all;
  }

  // "robot.plugs_in = false at models/robot.scxml:33 (9 times)"
  static std::string text_of(const std::vector<Chosen>& all) {
    constexpr std::size_t kShownMax = 6;
    std::string out;
    for (std::size_t i = 0; i < std::min(all.size(), kShownMax); ++i) {
      const Chosen& one = all[i];
      out += fmt::format("{}{} = ", i == 0 ? "" : ", ", one.name);
      for (std::size_t v = 0; v < std::min(one.values.size(), kShownMax); ++v)
        out += (v == 0 ? "" : " | ") + one.values[v];
      if (one.values.size() > kShownMax) out += " | …";
      if (!one.place.empty()) out += " at " + one.place;
      if (one.times > 1) out += fmt::format(" ({} times)", one.times);
    }
    return all.size() > kShownMax ? out + ", …" : out;
  }

  List chosen_value(const verify::Judgement& judgement) const {
    List out;
    for (const Chosen& one : chosen(judgement)) {
      List values;
      for (const std::string& value : one.values) values.emplace_back(value);
      Map entry{{"name", one.name}, {"values", std::move(values)}, {"times", static_cast<std::int64_t>(one.times)}};
      entry["place"] = one.place.empty() ? Value() : Value(one.place);
      out.emplace_back(std::move(entry));
    }
    return out;
  }

  // The first ones, which will do.
  static std::string few(const std::vector<std::string>& all) {
    constexpr std::size_t kShownMax = 8;
    if (all.size() <= kShownMax) return fmt::format("{}", fmt::join(all, ", "));
    return fmt::format("{}, … ({} in all)", fmt::join(all.begin(), all.begin() + kShownMax, ", "), all.size());
  }

  // At which it happens, or with which what comes again for ever begins.
  static std::size_t tick_of(const verify::Path& path) { return path.loop ? *path.loop : path.edges.size(); }

  // Of an instant that is none of a tick: on which side of that tick it is.
  std::string_view beside_tick(std::size_t tick, TimePoint at) const {
    const TimePoint of_tick = TimePoint{} + result_.graph.period * (static_cast<std::int64_t>(tick) - 1);
    return at < of_tick ? "before " : at > of_tick ? "behind " : "";
  }

  std::string told(const verify::Judgement& judgement) const {
    if (!judgement.error.empty()) return "ERROR    " + judgement.error;
    std::string out;
    if (judgement.finding == verify::Finding::kRefuted) {
      const Shown& shown = shown_.at(judgement.requirement);
      const std::size_t tick = tick_of(*judgement.path);
      out = fmt::format("REFUTED  {}tick {} ({} s)", judgement.path->loop ? "" : beside_tick(tick, judgement.at), tick,
                        shortest_decimal(seconds(judgement.at)));
      if (judgement.path->loop)
        out += fmt::format(": from here {} ticks can come again for ever", shown.loop_ticks);
      else if (judgement.state == "the mission ends")
        out += ": the mission ends, and it is still owed";
      else
        out += judgement.observation.empty() ? ": time passed" : ": " + judgement.observation;
      out += fmt::format("   {} .mcap", shown.scenario);
      if (const std::string what = text_of(chosen(judgement)); !what.empty()) out += "\n  chosen: " + what;
      if (shown.orders > 0) {
        out +=
            fmt::format("\n  needs messages of one instant in another order than that of virtual time, at {} instant{}",
                        shown.orders, shown.orders == 1 ? "" : "s");
      }
      if (!judgement.avoided.empty()) {
        out += "\n  holds if what is offered again and again is taken again and again; the loop avoids " +
               few(judgement.avoided);
      }
    } else if (judgement.finding == verify::Finding::kHolds) {
      out = judgement.vacuous.empty() ? "holds" : "holds VACUOUSLY: " + judgement.vacuous;
      if (judgement.vacuous.empty()) out += fmt::format("    {} states with it", grouped(judgement.states));
      if (judgement.vacuous.empty() && !judgement.never_seen.empty())
        out += fmt::format("\n  never seen: {}", fmt::join(judgement.never_seen, ", "));
    } else {
      out = judgement.limit.empty() ? fmt::format("not refuted up to tick {}", result_.graph.complete_to)
                                    : "not decided: " + judgement.limit;
    }
    if (!judgement.fair.empty() && judgement.finding == verify::Finding::kHolds)
      out += fmt::format(" (if fair: {})", few(judgement.fair));
    if (judgement.can_stay_open)
      out += fmt::format("\n  can stay open when the mission ends, at tick {}", judgement.can_stay_open->edges.size());
    if (judgement.least) {
      constexpr double kAlike = 1e-9;
      out += fmt::format("\n  violated with probability {:.10g}", judgement.least->low);
      if (judgement.greatest->low - judgement.least->high > kAlike)
        out += fmt::format(" to {:.10g}, as what is left open is chosen", judgement.greatest->low);
      if (judgement.greatest->high - judgement.greatest->low > kAlike)
        out += fmt::format("; bounds: {:.10g} to {:.10g}", judgement.least->low, judgement.greatest->high);
    }
    return out;
  }

  // A bound on the probability that two of the states that were taken for one are not: as if hashes were drawn.
  double same_hash(const verify::Asked& asked) const {
    const auto states = static_cast<double>(result_.graph.nodes.size());
    return asked.explore.exact ? 0 : std::ldexp(states * states, -129);
  }

  Value json(const verify::Asked& asked) const {
    const verify::Graph& graph = result_.graph;
    List requirements;
    for (const auto& judgement : result_.judgements) {
      Map one{{"name", judgement.requirement},
              {"verdict", to_string(judgement.finding)},
              {"vacuous", !judgement.vacuous.empty()},
              {"complete", graph.complete && judgement.limit.empty()},
              {"states", static_cast<std::int64_t>(judgement.states)},
              {"first_violation", Value()},
              {"counterexample", Value()},
              {"probability", Value()}};
      if (!judgement.vacuous.empty()) one["vacuous_because"] = judgement.vacuous;
      if (!judgement.never_seen.empty()) {
        List never_seen;
        for (const std::string& what : judgement.never_seen) never_seen.emplace_back(what);
        one["never_seen"] = std::move(never_seen);
      }
      if (!judgement.error.empty()) one["error"] = judgement.error;
      List fair;
      for (const std::string& name : judgement.fair) fair.emplace_back(name);
      one["fair"] = std::move(fair);
      if (judgement.path) {
        one["first_violation"] = Map{{"tick", static_cast<std::int64_t>(tick_of(*judgement.path))},
                                     {"time", seconds(judgement.at)},
                                     {"observation", judgement.observation}};
        const Shown& shown = shown_.at(judgement.requirement);
        Map example{{"scenario", shown.scenario},
                    {"recording", shown.recording},
                    {"choices", static_cast<std::int64_t>(shown.choices)},
                    {"chosen", chosen_value(judgement)},
                    {"orders", static_cast<std::int64_t>(shown.orders)}};
        if (judgement.path->loop) {
          example["loop"] = Map{{"from", static_cast<std::int64_t>(*judgement.path->loop)},
                                {"ticks", static_cast<std::int64_t>(shown.loop_ticks)}};
        }
        one["counterexample"] = std::move(example);
      }
      if (!judgement.avoided.empty()) {
        List avoided;
        for (const std::string& name : judgement.avoided) avoided.emplace_back(name);
        one["holds_if_fair"] = std::move(avoided);
      }
      one["can_stay_open"] = judgement.can_stay_open.has_value();
      if (judgement.least) {
        const auto bounds = [](const verify::Judgement::Probability& p) {
          return Map{{"low", p.low}, {"high", p.high}};
        };
        one["probability"] = Map{{"low", judgement.least->low},       {"high", judgement.greatest->high},
                                 {"least", bounds(*judgement.least)}, {"greatest", bounds(*judgement.greatest)},
                                 {"method", "interval iteration"},    {"confidence", 1.0}};
      }
      requirements.emplace_back(std::move(one));
    }
    List not_reached;
    for (const std::string& what : result_.not_reached) not_reached.emplace_back(what);
    List problems;
    for (const std::string& what : graph.problems) problems.emplace_back(what);
    List models;
    for (const project::ModelPlan& model : plan_.models) {
      List serves;
      for (const std::string& service : model.serves) serves.emplace_back(service);
      models.emplace_back(Map{{"name", model.name},
                              {"chart", model.chart.name()},
                              {"fingerprint", fmt::format("{:016x}", model.chart.fingerprint())},
                              {"serves", std::move(serves)}});
    }
    Map any;
    for (const verify::MadeModel& model : any_) {
      List tried;
      for (const std::string& line : model.tried) tried.emplace_back(line);
      any[model.service] = Map{{"file", model.file}, {"tried", std::move(tried)}};
    }
    Map limits{{"complete_to_tick", static_cast<std::int64_t>(graph.complete_to)}, {"same_hash", same_hash(asked)}};
    if (!graph.complete) limits["ended_by"] = graph.limit;
    if (!graph.grows.empty()) limits["most_values"] = graph.grows;
    return Map{
        {"tool", "sentree verify"},
        {"version", SENTREE_VERSION},
        {"models", std::move(models)},
        {"any_reply", std::move(any)},
        {"order", command_.order},
        {"orders_left_out", graph.reduced},
        {"faults", static_cast<std::int64_t>(asked.explore.faults.size())},
        {"faults_at_most", static_cast<std::int64_t>(asked.explore.faults_at_most)},
        {"requirements", std::move(requirements)},
        {"states", static_cast<std::int64_t>(graph.nodes.size())},
        {"transitions", static_cast<std::int64_t>(graph.edges.size())},
        {"complete", graph.complete},
        {"coverage", Map{{"not_reached", std::move(not_reached)},
                         {"kinds", *studio::coverage_value(reached(), plan_.scenario.project.folder).find("kinds")}}},
        {"problems", std::move(problems)},
        {"limits", std::move(limits)},
        {"wall_s", result_.explored_s}};
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
  std::map<std::string, Shown> shown_;
  std::map<std::string, std::string> story_;
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
