#include "sentree/verify/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <utility>

#include "sentree/base/diagnostic.h"
#include "sentree/project/any_reply.h"
#include "sentree/project/loop.h"
#include "sentree/project/mission_tree.h"
#include "sentree/project/model_choices.h"
#include "sentree/project/scenario_text.h"
#include "sentree/scxml/model.h"
#include "sentree/text/yaml_node_edit.h"

namespace sentree::verify {

namespace {

Diagnostic error(std::string code, std::string message, SourceSpan span) {
  return {Severity::kError, std::move(code), std::move(message), std::move(span)};
}

std::vector<std::string> not_reached(const project::Plan& plan, const Graph& graph) {
  std::vector<std::string> out;
  const auto never_takes = [&](const scxml::Chart& chart, std::size_t t, const std::string& whose) {
    const scxml::Transition& transition = chart.transitions()[t];
    // Into the initial states leads no transition that is taken.
    if (chart.model().state_code[transition.source].initial == t || transition.place.line == 0) return;
    out.push_back(fmt::format("{}: {} never takes this transition", to_string(chart.span(transition.place)), whose));
  };
  for (std::size_t leaf = 0; leaf < plan.leaves.size(); ++leaf) {
    const project::LeafPlan& of = plan.leaves[leaf];
    const auto& statuses = graph.statuses[leaf];
    if (std::none_of(statuses.begin(), statuses.end(), [](bool b) { return b; })) {
      constexpr unsigned kTicked = 1U << static_cast<unsigned>(bt::Status::kRunning) |
                                   1U << static_cast<unsigned>(bt::Status::kSuccess) |
                                   1U << static_cast<unsigned>(bt::Status::kFailure);
      const bool is_ticked = (graph.nodes_had[of.node] & kTicked) != 0;
      out.push_back(fmt::format("leaf {} is never ticked", of.name));
      if (is_ticked) out.back() = fmt::format("leaf {} never answers a tick in time", of.name);
      continue;
    }
    if (!statuses[1]) out.push_back(fmt::format("leaf {} never succeeds", of.name));
    if (!statuses[2]) out.push_back(fmt::format("leaf {} never fails", of.name));
    const auto transitions = of.chart->transitions();
    for (std::size_t t = 0; t < transitions.size(); ++t) {
      if (!graph.taken[leaf][t]) never_takes(*of.chart, t, "leaf " + of.name);
    }
  }
  for (std::size_t model = 0; model < plan.models.size(); ++model) {
    const project::ModelPlan& of = plan.models[model];
    for (std::size_t t = 0; t < of.chart.transitions().size(); ++t) {
      if (!graph.models_taken[model][t]) never_takes(of.chart, t, "model " + of.name);
    }
  }
  return out;
}

// Choices with a name that some model makes: what `fair:` may say.
std::vector<std::string> choice_names(const Graph& graph) {
  std::vector<std::string> names;
  for (const auto& [name, values] : graph.values) names.push_back(name);
  return names;
}

// Takes back what was said of a requirement as if everything had been tried.
void leave_open(const std::vector<Untried>& untried, Judgement& judgement) {
  const auto found = std::find_if(untried.begin(), untried.end(), [&](const Untried& one) {
    return one.monitor.empty() || one.monitor == judgement.requirement;
  });
  if (found == untried.end()) return;
  judgement.least.reset();
  judgement.greatest.reset();
  judgement.avoided.clear();
  if (judgement.finding == Finding::kRefuted) return;
  judgement.finding = Finding::kUnknown;
  judgement.vacuous.clear();
  judgement.never_seen.clear();
  judgement.fair.clear();
  if (judgement.limit.empty())
    judgement.limit = fmt::format("{} is ordered against earlier replies at {}, and not every row of them was tried",
                                  found->value, to_string(found->told.span));
}

}  // namespace

project::Scenario with_models(project::Scenario scenario) {
  scenario.virtual_time = true;
  scenario.factor = 1.0;
  // What its timeline does comes at its times, whatever loops are found, and in whatever order it lists them.
  project::write_out(scenario);
  std::stable_sort(scenario.timeline.begin(), scenario.timeline.end(),
                   [](const auto& a, const auto& b) { return a.at < b.at; });
  // Who answers is a model. What has none answers anything, whether anybody could serve it or not.
  for (project::ServiceEntry& service : scenario.project.services) {
    const bool is_simulated = service.at == "sim" && scenario.project.world;
    if (!is_simulated && service.at != "topics") service.at = project::kAnyReply;
  }
  for (const project::ModelEntry& model : scenario.project.models) {
    for (project::ServiceEntry& service : scenario.project.services) {
      const auto& serves = model.serves;
      if (std::find(serves.begin(), serves.end(), service.name) != serves.end()) service.at = "model";
    }
  }
  // A skill that runs execute in another process is executed here, where its chart is at hand.
  scenario.processes.clear();
  std::erase_if(scenario.source.entries, [](const auto& entry) { return entry.first.scalar == "processes"; });
  for (project::SkillEntry& skill : scenario.project.skills) {
    const project::FileRef file = project::skill_file(scenario.project, &skill, skill.leaf);
    std::error_code error;
    if (skill.at.empty() || !std::filesystem::exists(scenario.project.folder / file.path, error)) continue;
    skill.at.clear();
    text::YamlNode& skills = text::member(text::member(scenario.source, "override"), "skills");
    text::set_scalar(text::member(skills, skill.leaf), "at", "");
  }
  // A model publishes as it likes.
  for (project::ServiceEntry& service : scenario.project.services) {
    if (service.at != "sim") service.publish.clear();
  }
  return scenario;
}

Diagnostics unknown_requirements(const project::Plan& plan, const std::vector<std::string>& names) {
  std::vector<std::string> known;
  for (const monitor::Model& model : plan.monitors) known.push_back(model.name());
  Diagnostics out;
  for (const std::string& name : names) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    out.push_back(
        error("verify.unknown-requirement",
              fmt::format("the project has no requirement or monitor \"{}\"{}", name, did_you_mean(name, known)),
              SourceSpan{plan.scenario.project.file}));
  }
  return out;
}

Verification verify(const project::Plan& plan, const Asked& asked) {
  Verification out;
  out.errors = obstacles(plan);
  const Diagnostics unknown = unknown_requirements(plan, asked.only);
  out.errors.insert(out.errors.end(), unknown.begin(), unknown.end());
  if (has_errors(out.errors)) return out;
  const auto began = std::chrono::steady_clock::now();
  Options options = asked.explore;
  options.each = asked.each;
  auto graph = explore(plan, options);
  if (!graph) {
    out.errors.push_back(graph.error());
    return out;
  }
  out.graph = std::move(*graph);
  out.explored_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  std::vector<std::string> choices = choice_names(out.graph);
  // Those too that nothing has come to.
  bool any = false;
  for (const project::ModelPlan& model : plan.models) {
    const project::KnownChoices known = project::choices_of(model.chart);
    any = any || known.open;
    for (const std::string& name : known.names()) choices.push_back(fmt::format("{}.{}", model.name, name));
  }
  std::sort(choices.begin(), choices.end());
  choices.erase(std::unique(choices.begin(), choices.end()), choices.end());
  for (const std::string& fair : asked.judge.fair) {
    if ((any && !out.graph.complete) || std::find(choices.begin(), choices.end(), fair) != choices.end()) continue;
    out.errors.push_back(project::no_such_fair(fair, choices, plan.scenario.project.verify.fair_span));
  }
  if (has_errors(out.errors)) return out;
  std::vector<const monitor::Model*> judged;
  for (const monitor::Model& model : plan.monitors) {
    const auto& only = asked.only;
    if (only.empty() || std::find(only.begin(), only.end(), model.name()) != only.end()) judged.push_back(&model);
  }
  out.judgements.resize(judged.size());
  std::atomic<std::uint64_t> taken = 0;
  // What is known of a part is told too: who was interrupted before is not so again.
  const bool was_interrupted = options.interrupted && options.interrupted();
  for_each(asked.each, judged.size(), [&](std::size_t i) {
    JudgeOptions how = asked.judge;
    how.memory = options.memory;
    how.taken = &taken;
    how.interrupted = [&, begun = std::chrono::steady_clock::now()] {
      return (!was_interrupted && options.interrupted && options.interrupted()) ||
             (options.time && std::chrono::steady_clock::now() - begun > *options.time);
    };
    out.judgements[i] = judge(out.graph, *judged[i], how);
  });
  for (Judgement& judgement : out.judgements) leave_open(asked.untried, judgement);
  if (std::any_of(asked.untried.begin(), asked.untried.end(), [](const Untried& one) { return one.monitor.empty(); })) {
    out.graph.complete = false;
    out.graph.complete_to = 0;
  }
  if (out.graph.complete) out.not_reached = not_reached(plan, out.graph);
  return out;
}

std::string scenario_text(const project::Scenario& example, const Judgement& judgement, const std::string& project) {
  project::Scenario scenario = example;
  text::YamlNode source = scenario.source;
  const double at_s = seconds(judgement.at);
  std::string what = judgement.requirement;
  if (judgement.path->loop) {
    what +=
        fmt::format(" can be open for ever: what happens from {} s on comes again and again", shortest_decimal(at_s));
  } else if (judgement.finding != Finding::kRefuted) {
    what += fmt::format(" is open when the mission ends at {} s, which is no violation", shortest_decimal(at_s));
  } else if (judgement.state == "the mission ends") {
    what += fmt::format(" is still owed when the mission ends at {} s", shortest_decimal(at_s));
  } else {
    what += fmt::format(" is violated at {} s{}", shortest_decimal(at_s),
                        judgement.observation.empty() ? "" : " by " + judgement.observation);
  }
  text::set_scalar(source, "description", what);
  for (const project::ServiceEntry& service : scenario.project.services) {
    if (service.at != "model") continue;
    text::YamlNode& services = text::member(text::member(source, "override"), "services");
    text::set_scalar(text::member(services, service.name), "at", "model");
  }
  scenario.source = std::move(source);
  std::string verdicts;
  for (const auto& [monitor, verdict] : scenario.verdicts)
    verdicts += fmt::format("{}{}: {}", verdicts.empty() ? "" : ", ", monitor, verdict);
  return fmt::format("{} Choices that are not listed take their first alternative.\n{}expect:\n  monitors: {{{}}}\n",
                     project::kFoundByVerify, project::scenario_text(scenario, {}, std::nullopt, project), verdicts);
}

}  // namespace sentree::verify
