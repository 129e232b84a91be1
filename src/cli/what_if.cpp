#include "sentree/cli/what_if.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <utility>

#include "sentree/base/diagnostic.h"
#include "sentree/text/json.h"

namespace sentree::cli {

namespace {

Result<project::ScenarioChoice> read(const std::string& text, const project::Scenario& scenario) {
  const auto hash = text.find('#');
  const auto equals = text.find('=', hash == std::string::npos ? 0 : hash);
  project::ScenarioChoice choice;
  if (hash != std::string::npos && equals != std::string::npos) {
    choice.model = text.substr(0, hash);
    const char* const end = text.data() + equals;
    const auto [rest, error] = std::from_chars(text.data() + hash + 1, end, choice.number);
    if (error != std::errc() || rest != end) choice.number = 0;
  }
  if (choice.model.empty() || choice.number == 0)
    return fail("run.choose", fmt::format("\"{}\" is not MODEL#NUMBER=VALUE, as in robot#3=true", text));
  std::vector<std::string> models;
  for (const project::ModelEntry& model : scenario.project.models) models.push_back(model.name);
  if (std::find(models.begin(), models.end(), choice.model) == models.end()) {
    return fail("run.choose",
                fmt::format("the project has no model \"{}\"{}", choice.model, did_you_mean(choice.model, models)));
  }
  const std::string value = text.substr(equals + 1);
  // Texts need no quotes.
  auto json = text::parse_json(value);
  choice.value = json ? std::move(*json) : Value(value);
  return choice;
}

}  // namespace

Result<void> choose(const std::vector<std::string>& choices, project::Scenario& scenario) {
  if (choices.empty()) return {};
  if (!scenario.choices) scenario.choices.emplace();
  // What was chosen before comes once more, in whatever round of a loop that was; the loop does not.
  project::write_out(scenario);
  auto& listed = *scenario.choices;
  const std::vector<project::ScenarioChoice> before = listed;
  for (const std::string& text : choices) {
    const auto choice = read(text, scenario);
    if (!choice) return tl::unexpected(choice.error());
    // Its tick, if it was listed; else what its model chose later is what comes later.
    const auto is_same = [&](const project::ScenarioChoice& one) {
      return one.model == choice->model && one.number == choice->number;
    };
    const auto same = std::find_if(before.begin(), before.end(), is_same);
    const std::uint64_t tick = same != before.end() ? same->tick : 0;
    std::erase_if(listed, [&](const project::ScenarioChoice& one) {
      const bool is_given = std::find(before.begin(), before.end(), one) == before.end();
      return !is_given &&
             ((one.model == choice->model && one.number >= choice->number) || (tick > 0 && one.tick > tick));
    });
    if (tick > 0) std::erase_if(scenario.orders, [&](const project::ScenarioOrder& one) { return one.tick > tick; });
    std::erase_if(listed, is_same);
    listed.push_back(*choice);
    listed.back().tick = tick;
  }
  scenario.expect_nothing();
  return {};
}

ChoicesMade::ChoicesMade(const std::vector<std::string>& choices) {
  for (const std::string& text : choices) {
    const auto hash = text.find('#');
    wanted_.push_back({text.substr(0, hash), std::strtoull(text.c_str() + hash + 1, nullptr, 10)});
  }
}

void ChoicesMade::install(runtime::RunOptions& options) {
  for (const Wanted& wanted : wanted_) {
    const auto [made, is_new] = made_.try_emplace(wanted.model);
    if (!is_new) continue;
    options.listeners_of.emplace_back(wanted.model + ".choice", [&all = made->second](const Message& message) {
      const auto text = [&](const char* member) {
        const Value* const value = message.data.find(member);
        return value != nullptr ? std::string(value->text()) : std::string();
      };
      const std::string name = text("name");
      all.push_back(fmt::format("{} at {}", name.empty() ? text("function") : name, text("place")));
    });
  }
}

std::vector<std::string> ChoicesMade::never_made() const {
  constexpr std::size_t kShown = 5;
  std::vector<std::string> all;
  for (const Wanted& wanted : wanted_) {
    const auto found = made_.find(wanted.model);
    if (found == made_.end() || found->second.size() >= wanted.number) continue;
    const auto& made = found->second;
    const std::string which =
        fmt::format("--choose {}#{}: the run never came to that choice", wanted.model, wanted.number);
    if (made.empty()) {
      all.push_back(fmt::format("{}, nor to any other of {}; --duration lets it go on", which, wanted.model));
      continue;
    }
    std::string there;
    for (std::size_t i = made.size() - std::min(made.size(), kShown); i < made.size(); ++i)
      there += fmt::format("{}{}#{} ({})", there.empty() ? "" : ", ", wanted.model, i + 1, made[i]);
    all.push_back(
        fmt::format("{}; there were {}{}. --duration lets it go on", which, made.size() > kShown ? "…, " : "", there));
  }
  return all;
}

}  // namespace sentree::cli
