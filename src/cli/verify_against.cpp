#include "sentree/cli/verify_against.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <vector>

#include "sentree/cli/output.h"
#include "sentree/cli/report.h"
#include "sentree/cli/verify_result.h"
#include "sentree/replay/recorded_run.h"
#include "sentree/verify/against.h"

namespace sentree::cli {

namespace {

std::string any_of(const std::vector<std::string>& answers) {
  std::string text;
  for (const std::string& one : answers) text += (text.empty() ? "" : "; or ") + one;
  return text;
}

// The first that is not allowed of each method, and how many there are.
std::string agreement_text(const verify::Agreement& of) {
  std::string out = of.not_allowed == 0
                        ? fmt::format("{}: allows all {} answers", of.model, of.answers)
                        : fmt::format("{}: allows {} of {} answers", of.model, of.answers - of.not_allowed, of.answers);
  out += of.possible_most > 1 ? fmt::format("; could be in {} states at most\n", of.possible_most) : "\n";
  if (of.answers == 0) out = of.model + ": was not asked anything that was answered\n";
  std::map<std::string, std::size_t> known;
  std::vector<const verify::Disallowed*> first;
  for (const verify::Disallowed& one : of.disallowed) {
    if (++known[one.call] == 1) first.push_back(&one);
  }
  for (const verify::Disallowed* one : first) {
    const Map* const args = one->args.as_map();
    out += fmt::format("  {} s, tick {}: {}{} answered {}\n    the model: {}\n", shortest_decimal(seconds(one->at)),
                       one->tick, one->call, args == nullptr || args->empty() ? "" : to_json(one->args), one->answered,
                       any_of(one->allowed));
    if (known[one->call] > 1) out += fmt::format("    and {} more of {}\n", known[one->call] - 1, one->call);
  }
  if (of.disallowed.size() < of.not_allowed)
    out += fmt::format("  and {} more, of whatever method\n", of.not_allowed - of.disallowed.size());
  if (!of.given_up.empty())
    out += fmt::format("  given up at {} s: {}\n", shortest_decimal(seconds(of.followed_to)), of.given_up);
  return out;
}

Value value_of(const verify::Agreement& of) {
  List disallowed;
  for (const verify::Disallowed& one : of.disallowed) {
    List allowed;
    for (const std::string& answer : one.allowed) allowed.emplace_back(answer);
    disallowed.emplace_back(Map{{"time", seconds(one.at)},
                                {"tick", static_cast<std::int64_t>(one.tick)},
                                {"call", one.call},
                                {"args", one.args},
                                {"answered", one.answered},
                                {"allowed", std::move(allowed)}});
  }
  return Map{{"model", of.model},
             {"requests", static_cast<std::int64_t>(of.requests)},
             {"answers", static_cast<std::int64_t>(of.answers)},
             {"not_allowed", static_cast<std::int64_t>(of.not_allowed)},
             {"states", static_cast<std::int64_t>(of.possible)},
             {"states_most", static_cast<std::int64_t>(of.possible_most)},
             {"followed_to", seconds(of.followed_to)},
             {"given_up", of.given_up.empty() ? Value() : Value(of.given_up)},
             {"disallowed", std::move(disallowed)}};
}

}  // namespace

int verify_against(const VerifyCommand& command, const project::Plan& plan) {
  verify::AgainstOptions options{.tolerance = plan.scenario.project.period, .exact = command.exact};
  if (!command.tolerance.empty()) {
    const auto tolerance = project::parse_duration(command.tolerance);
    if (!tolerance || tolerance->count() < 0) {
      say(fmt::format("--tolerance {}: not a duration such as 100 ms", command.tolerance));
      return kUsage;
    }
    options.tolerance = *tolerance;
  }
  if (plan.models.empty()) {
    say("the project has no models to compare with; sentree verify --model writes some to begin with");
    return kInvalidInput;
  }
  auto recorded = replay::RecordedRun::open(command.against);
  if (!recorded) return refuse(command, {recorded.error()});
  std::vector<Message> observations;
  const auto read = recorded->each([&](Message message) {
    if (message.kind != MessageKind::kEvent) {
      replay::restore_numbers(plan, message);
      observations.push_back(std::move(message));
    }
    return true;
  });
  say_each(recorded->reader().problems());
  const auto agreements = read ? verify::against(plan, observations, options)
                               : Result<std::vector<verify::Agreement>>(tl::unexpected(read.error()));
  if (!agreements) return refuse(command, {agreements.error()});
  std::string out = fmt::format("recording   {}   {} s, {}, within {} s\n", command.against,
                                shortest_decimal(seconds(recorded->ended())),
                                options.exact ? "replies as they are" : "replies as the mission tells them apart",
                                shortest_decimal(seconds(options.tolerance)));
  List models;
  bool differs = false;
  bool given_up = false;
  std::size_t compared = 0;
  for (const verify::Agreement& one : *agreements) {
    out += agreement_text(one);
    models.push_back(value_of(one));
    differs = differs || one.not_allowed > 0;
    compared += one.answers;
    given_up = given_up || !one.given_up.empty();
  }
  if (command.json) {
    out = to_json(Value(Map{{"tool", "sentree verify"},
                            {"version", SENTREE_VERSION},
                            {"recording", command.against},
                            {"tolerance", seconds(options.tolerance)},
                            {"exact", options.exact},
                            {"models", std::move(models)}})) +
          "\n";
  }
  print(out);
  if (differs) return kFindings;
  if (given_up) return kTimeLimit;
  if (compared > 0) return kOk;
  say(fmt::format("{} has no answer of a service that a model serves: nothing was compared", command.against));
  return kFindings;
}

}  // namespace sentree::cli
