#include "sentree/project/detail/check_verify.h"

#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sentree/project/any_reply.h"
#include "sentree/project/model_choices.h"

namespace sentree::project {

namespace {

bool is_same(const Value& a, const Value& b) {
  if (a.is_number() && b.is_number()) return a.number() == b.number();
  return to_json(a) == to_json(b);
}

// Whether that may be a choice of a model that `sentree verify` is still to make, of a service without one. Once it is
// at work, and has not made them yet, any name may be.
bool may_be_of_any_reply(const std::string& choice, const Project& project) {
  return std::any_of(project.services.begin(), project.services.end(), [&](const ServiceEntry& service) {
    if (service.at != kAnyReply && !choice.starts_with(kAnyReplyPrefix)) return false;
    return std::none_of(project.models.begin(), project.models.end(), [&](const ModelEntry& model) {
      return std::find(model.serves.begin(), model.serves.end(), service.name) != model.serves.end();
    });
  });
}

void check_fair(const Project& project, const std::map<std::string, KnownChoices>& known, Diagnostics& diagnostics) {
  const VerifySection& verify = project.verify;
  std::vector<std::string> all;
  bool open = false;
  for (const auto& [model, choices] : known) {
    open = open || choices.open;
    for (const std::string& name : choices.names()) all.push_back(fmt::format("{}.{}", model, name));
  }
  for (const std::string& fair : verify.fair) {
    if (open || std::find(all.begin(), all.end(), fair) != all.end() || may_be_of_any_reply(fair, project)) continue;
    diagnostics.push_back(no_such_fair(fair, all, verify.fair_span));
  }
}

void check_choice(const ScenarioChoice& choice, const KnownChoices& known, Diagnostics& diagnostics) {
  const auto error = [&](std::string message) {
    diagnostics.push_back({Severity::kError, "scenario.choice", std::move(message), choice.span});
  };
  const auto named = known.by_name.find(choice.name);
  if (named == known.by_name.end() && !choice.name.empty()) {
    if (known.open) return;
    error(fmt::format("model \"{}\" makes no choice called \"{}\"{}", choice.model, choice.name,
                      did_you_mean(choice.name, known.names())));
    return;
  }
  const Alternatives& alternatives = choice.name.empty() ? known.all : named->second;
  if (alternatives.open || (alternatives.numbers && choice.value.is_number()) ||
      std::any_of(alternatives.values.begin(), alternatives.values.end(),
                  [&](const Value& value) { return is_same(value, choice.value); }))
    return;
  std::vector<std::string> there;
  std::vector<std::string> texts;
  for (const Value& value : alternatives.values) {
    if (std::string shown = to_json(value); std::find(there.begin(), there.end(), shown) == there.end())
      there.push_back(std::move(shown));
    if (const std::string* text = value.as_string()) texts.push_back(*text);
  }
  if (alternatives.numbers) there.emplace_back("numbers");
  const std::string* const text = choice.value.as_string();
  const std::string what =
      choice.name.empty() ? fmt::format("no choice of model \"{}\" has the alternative", choice.model)
                          : fmt::format("choice \"{}\" of model \"{}\" has no alternative", choice.name, choice.model);
  error(fmt::format("{} {}; there are {}{}", what, to_json(choice.value), fmt::join(there, ", "),
                    text != nullptr ? did_you_mean(*text, texts) : ""));
}

// Who serves nothing in a run is not there.
void doubt_choice(const Scenario& scenario, const ScenarioChoice& choice, Diagnostics& diagnostics) {
  const auto& models = scenario.project.models;
  const auto model =
      std::find_if(models.begin(), models.end(), [&](const ModelEntry& one) { return one.name == choice.model; });
  if (model == models.end() || model->serves.empty()) return;
  const bool serves = std::any_of(model->serves.begin(), model->serves.end(), [&](const std::string& name) {
    return std::any_of(scenario.project.services.begin(), scenario.project.services.end(),
                       [&](const ServiceEntry& service) { return service.name == name && service.at == "model"; });
  });
  if (serves) return;
  std::string names;
  for (const std::string& name : model->serves) names += (names.empty() ? "" : ", ") + name;
  diagnostics.push_back({Severity::kWarning, "scenario.unused-choice",
                         fmt::format("model \"{}\" serves nothing in this run, so that it never comes to that choice; "
                                     "`override:` puts services `at: model` ({})",
                                     choice.model, names),
                         choice.span});
}

// Who comes first is a part of the run.
void check_orders(const Scenario& scenario, const InterventionScope& scope, Diagnostics& diagnostics) {
  const bool are_known = scope.tree != nullptr && scope.leaves->size() == scope.tree->external_leaves().size();
  if (!are_known) return;
  std::vector<std::string> parts{"mission"};
  for (const LeafPlan& leaf : *scope.leaves) parts.push_back(leaf.name);
  for (const ModelEntry& model : scenario.project.models) parts.push_back(model.name);
  for (const ScenarioOrder& order : scenario.orders) {
    const bool is_made = order.first.starts_with(kAnyReplyPrefix);
    if (order.first.empty() || is_made || std::find(parts.begin(), parts.end(), order.first) != parts.end()) continue;
    diagnostics.push_back(
        {Severity::kError, "scenario.order",
         fmt::format("order {}: the run has no part \"{}\"; its parts are the mission, its leaves and "
                     "its models{}",
                     order.number, order.first, did_you_mean(order.first, parts)),
         order.span});
  }
}

}  // namespace

void check_verify(const Scenario& scenario, const InterventionScope& scope, const ModelCharts& models,
                  Diagnostics& diagnostics) {
  const VerifySection& verify = scenario.project.verify;
  // What a scenario puts elsewhere is not there to be tried; nor are leaves known without a tree.
  const bool is_known = scenario.file == scenario.project.file && scope.tree != nullptr;
  for (std::size_t i = 0; i < (is_known ? verify.faults.size() : 0); ++i) {
    if (auto checked = check_intervention(verify.faults[i], scope, verify.fault_spans[i]); !checked)
      diagnostics.push_back(checked.error());
    else if (auto doubt = doubt_about(verify.faults[i], scope, verify.fault_spans[i]))
      diagnostics.push_back(std::move(*doubt));
  }
  check_orders(scenario, scope, diagnostics);
  if (verify.fair.empty() && !scenario.choices) return;
  std::map<std::string, KnownChoices> known;
  for (const auto& [name, chart] : models) known[name] = choices_of(chart);
  // Charts that could not be read have been told, and may make any choice.
  if (models.size() == scenario.project.models.size()) check_fair(scenario.project, known, diagnostics);
  if (!scenario.choices) return;
  for (const ScenarioChoice& choice : *scenario.choices) {
    if (const auto model = known.find(choice.model); model != known.end())
      check_choice(choice, model->second, diagnostics);
    doubt_choice(scenario, choice, diagnostics);
  }
}

}  // namespace sentree::project
