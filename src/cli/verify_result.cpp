#include "sentree/cli/verify_result.h"

#include <openssl/sha.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sentree/cli/output.h"
#include "sentree/cli/share.h"
#include "sentree/cli/verify_options.h"
#include "sentree/project/any_reply.h"
#include "sentree/project/cpp_nodes.h"
#include "sentree/project/intervention.h"

namespace sentree::cli {

namespace {

std::string sha256_of(std::string_view bytes) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest{};
  SHA256(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), digest.data());
  return fmt::format("{:02x}", fmt::join(digest, ""));
}

Value or_null(const std::optional<std::uint64_t>& number) {
  return number ? Value(static_cast<std::int64_t>(*number)) : Value();
}
Value or_null(const std::string& text) { return text.empty() ? Value() : Value(text); }

// How many threads there are is left out: the result is the same.
Map given_options(const VerifyCommand& command, const project::Plan& plan,
                  const std::vector<project::Intervention>& faults) {
  const project::VerifySection& section = plan.scenario.project.verify;
  const bool is_sampled = command.runs || !command.at_least.empty() || !command.split.empty();
  List entries;
  for (const project::Intervention& fault : faults) entries.emplace_back(project::to_entry(fault));
  const auto bytes = command.memory ? bytes_of(*command.memory) : std::nullopt;
  const auto time = command.time ? project::parse_duration(*command.time) : std::nullopt;
  const auto rate = [](const std::string& name, const std::string& text) {
    const auto given = text.empty() ? std::nullopt : share(name, text);
    return given ? Value(*given) : Value();
  };
  return Map{{"scenario", or_null(command.scenario)},
             {"only", to_list(command.only)},
             {"order", command.order},
             {"all_orders", command.all_orders},
             {"faults", std::move(entries)},
             {"faults_at_most", static_cast<std::int64_t>(section.faults_at_most)},
             {"fair", to_list(section.fair)},
             {"all_fair", command.fair},
             {"ticks", or_null(command.ticks)},
             {"states", or_null(command.states)},
             {"memory", or_null(bytes)},
             {"time", time ? Value(seconds(*time)) : Value()},
             {"memo", !command.no_memory && !command.exact},
             {"exact", command.exact},
             {"runs", or_null(command.runs)},
             {"confidence", is_sampled ? rate("--confidence", command.confidence) : Value()},
             {"at_least", rate("--at-least", command.at_least)},
             {"split", or_null(command.split)},
             {"seed", is_sampled ? Value(static_cast<std::int64_t>(command.seed)) : Value()}};
}

}  // namespace

int refuse(const VerifyCommand& command, const Diagnostics& what) {
  say(what);
  const bool is_unwritten =
      std::any_of(what.begin(), what.end(), [](const Diagnostic& one) { return one.code == "file.unwritable"; });
  const int code = is_unwritten ? kEnvironment : kInvalidInput;
  if (!command.json) return code;
  Diagnostics errors;
  std::copy_if(what.begin(), what.end(), std::back_inserter(errors),
               [](const Diagnostic& one) { return one.severity == Severity::kError; });
  print(to_json(Value(Map{{"errors", to_value(errors)}})) + "\n");
  return code;
}

List to_list(const std::vector<std::string>& texts) {
  List out;
  for (const std::string& text : texts) out.emplace_back(text);
  return out;
}

Map verify_result(const VerifyCommand& command, const project::Plan& plan, const std::vector<verify::MadeModel>& any,
                  const std::vector<project::Intervention>& faults) {
  List models;
  for (const project::ModelPlan& model : plan.models) {
    const bool is_any = std::any_of(any.begin(), any.end(), [&](const verify::MadeModel& made) {
      return project::kAnyReplyPrefix + made.service == model.name;
    });
    models.emplace_back(Map{{"name", model.name},
                            {"file", model.file},
                            {"sha256", sha256_of(model.chart.source())},
                            {"serves", to_list(model.serves)},
                            {"any_reply", is_any}});
  }
  Map replies;
  for (const verify::MadeModel& made : any)
    replies[made.service] = Map{{"file", made.file}, {"tried", to_list(made.tried)}};
  return Map{{"tool", "sentree verify"},
             {"version", SENTREE_VERSION},
             {"models", std::move(models)},
             {"any_reply", std::move(replies)},
             {"nodes_in_cpp", to_list(project::cpp_nodes(plan))},
             {"options", given_options(command, plan, faults)},
             {"requirements", List()},
             {"states", Value()},
             {"transitions", Value()},
             {"complete", false},
             {"orders_left_out", Value()},
             {"coverage", Value()},
             {"runs", Value()},
             {"faults_left_out", 0},
             {"problems", List()},
             {"limits", Map{{"complete_to_tick", Value()},
                            {"ended_by", Value()},
                            {"most_values", Value()},
                            {"same_hash", Value()},
                            {"not_tried", List()},
                            {"run_s", Value()}}},
             {"wall_s", Value()}};
}

Map requirement_result(const std::string& name, std::string_view verdict) {
  return Map{{"name", name},
             {"verdict", verdict},
             {"vacuous", Value()},
             {"vacuous_because", Value()},
             {"complete", false},
             {"states", Value()},
             {"fair", List()},
             {"holds_if_fair", List()},
             {"can_stay_open", Value()},
             {"never_seen", List()},
             {"first_violation", Value()},
             {"counterexample", Value()},
             {"probability", Value()},
             {"violated", Value()},
             {"still_owed", Value()},
             {"at_least", Value()},
             {"indifference", Value()},
             {"undecided_because", Value()},
             {"error", Value()}};
}

Map probability_result(double low, double high, std::string_view method, double confidence) {
  return Map{{"low", low},          {"high", high},           {"least", Value()},         {"greatest", Value()},
             {"mean", Value()},     {"method", method},       {"confidence", confidence}, {"runs", Value()},
             {"branches", Value()}, {"repetitions", Value()}, {"seen", Value()}};
}

}  // namespace sentree::cli
