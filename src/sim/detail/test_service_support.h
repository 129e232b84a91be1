#pragma once

#include <regex>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/sim/detail/test_support.h"
#include "sentree/sim/services.h"

namespace sentree::sim::test {

inline std::string idl() {
  const auto source = text::read_file(SENTREE_SOURCE_DIR "/interfaces/robot.thrift");
  return source ? std::regex_replace(*source, std::regex("//[^\n]*"), "") : "";
}

// Names of the fields of a struct of the IDL, in its order.
inline std::vector<std::string> fields(const std::string& name) {
  static const std::string kSource = idl();
  std::smatch found;
  if (!std::regex_search(kSource, found, std::regex("struct\\s+" + name + "\\s*\\{([^}]*)\\}"))) return {};
  const std::string body = found[1];
  const std::regex field(R"(\d+:\s*[\w<>]+\s+(\w+))");
  std::vector<std::string> names;
  for (std::sregex_iterator i(body.begin(), body.end(), field), end; i != end; ++i) names.push_back((*i)[1]);
  return names;
}

inline std::vector<std::string> keys(const Value* value) {
  std::vector<std::string> names;
  if (value == nullptr || value->as_map() == nullptr) return names;
  for (const auto& [key, member] : *value->as_map()) names.push_back(key);
  return names;
}

/// The services of the example's house, called one after the other at time `now_` of the run.
class HouseServices {
 protected:
  HouseServices() {
    Loaded<World> house = test::load_house();
    world_ = *std::move(house.value);
    state_ = initial_state(world_, 1);
  }
  Result<Value> attempt(std::string_view service, std::string_view method, const Map& args = {}) {
    return call(world_, state_, {.service = service, .method = method, .args = args}, now_);
  }
  /// The result; the message of an error, which no expectation will equal.
  Value ask(std::string_view service, std::string_view method, const Map& args = {}) {
    const auto result = attempt(service, method, args);
    return result ? *result : Value(result.error().message);
  }
  std::string error(std::string_view service, std::string_view method, const Map& args = {}) {
    const auto result = attempt(service, method, args);
    return result ? "no error" : result.error().code + ": " + result.error().message;
  }
  static Value pose(double x, double y, double theta) { return Map{{"x", x}, {"y", y}, {"theta", theta}}; }

  World world_;
  State state_;
  TimePoint now_{};
};

}  // namespace sentree::sim::test
