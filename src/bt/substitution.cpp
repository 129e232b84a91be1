#include <fmt/format.h>

#include <cmath>

#include "sentree/bt/load.h"
#include "sentree/text/json.h"

namespace sentree::bt {

namespace {

/// Longer delays are mistakes of the file: a year.
constexpr double kDelayMsMax = 365.0 * 24 * 3600 * 1000;

Result<Substitution::TestNode> test_node(const Value& config, const std::string& name, const std::string& file) {
  Substitution::TestNode test;
  const auto bad = [&](const std::string& what) {
    return fail("bt.bad-substitution", fmt::format("test node \"{}\": {}", name, what), {file, 0, 0, 0});
  };
  const Map* members = config.as_map();
  if (members == nullptr) return bad("must be an object");
  for (const auto& [key, value] : *members) {
    if (key == "return_status") {
      const auto status = parse_status(value.text());
      if (!status || *status == Status::kIdle)
        return bad(fmt::format("return_status is {}; SUCCESS, FAILURE, SKIPPED or RUNNING", to_json(value)));
      test.return_status = *status;
    } else if (key == "return_status_script") {
      test.return_status_script = value.text();
    } else if (key == "async_delay") {
      const double ms = value.number(-1);
      if (!(ms >= 0 && ms <= kDelayMsMax))
        return bad(fmt::format("async_delay is {}; milliseconds, not negative", to_json(value)));
      test.async_delay = from_seconds(ms * 1e-3);
    } else if (key == "success_script") {
      test.success_script = value.text();
    } else if (key == "failure_script") {
      test.failure_script = value.text();
    } else if (key == "post_script") {
      test.post_script = value.text();
    } else {
      static const std::vector<std::string> kKnown = {"return_status",  "return_status_script", "async_delay",
                                                      "success_script", "failure_script",       "post_script"};
      return bad(fmt::format("unknown member \"{}\"{}", key, did_you_mean(key, kKnown)));
    }
  }
  return test;
}

}  // namespace

Result<std::vector<Substitution>> parse_substitutions(std::string_view json, const std::string& file) {
  const auto document = text::parse_json(json, file);
  if (!document) return tl::unexpected(document.error());
  const Value* rules = document->find("SubstitutionRules");
  if (rules == nullptr || rules->as_map() == nullptr) {
    return fail("bt.bad-substitution", "there is no object \"SubstitutionRules\"", {file, 0, 0, 0});
  }
  const Value* configs = document->find("TestNodeConfigs");
  std::vector<Substitution> all;
  for (const auto& [filter, target] : *rules->as_map()) {
    Substitution rule;
    rule.filter = filter;
    const std::string name(target.text());
    if (name.empty()) {
      return fail("bt.bad-substitution", fmt::format("rule \"{}\" must name a node or a test node", filter),
                  {file, 0, 0, 0});
    }
    if (const Value* config = configs != nullptr ? configs->find(name) : nullptr) {
      auto test = test_node(*config, name, file);
      if (!test) return tl::unexpected(test.error());
      rule.test = std::move(*test);
    } else {
      rule.id = name;
    }
    all.push_back(std::move(rule));
  }
  return all;
}

}  // namespace sentree::bt
