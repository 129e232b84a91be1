#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/value.h"
#include "sentree/mission/choice.h"
#include "sentree/runtime/run.h"

namespace sentree::studio {

/// What else the models of a run could have chosen, which its recording does not hold. From any thread.
class Alternatives {
 public:
  /// Of one choice, those at most; of more of them the first ones.
  static constexpr std::uint64_t kKeptMax = 100;
  /// Choices of one model that are remembered; of a run that makes more, the last ones.
  static constexpr std::size_t kMadeMax = 100'000;

  /// Hears of the choices that the models of the run make from now on, and must outlive it.
  void install(const std::vector<std::string>& models, runtime::RunOptions& options);
  /// Of `choices`, a list of "MODEL#NUMBER", each one's {values, count, last}; null: nothing is known of it.
  [[nodiscard]] Result<Value> answer(const Value& choices) const;
  /// Whether a request to run again chooses what there is, as far as the two runs are the same. Error: studio.choice.
  [[nodiscard]] Result<void> check(const Value& choose) const;

 private:
  struct Of {
    std::string function;
    std::string name;
    std::string place;
    std::vector<Value> values;
    Value last;
    std::uint64_t count = 0;
    bool operator==(const Of&) const = default;
  };
  struct Made {
    std::shared_ptr<const Of> of;
    Value value;  ///< Null: not yet.
  };
  struct Model {
    std::map<std::uint64_t, Made> made;            ///< By number.
    std::deque<std::uint64_t> untold;              ///< Numbers of those whose value has not been heard.
    std::vector<std::shared_ptr<const Of>> known;  ///< The last different ones.
  };

  void take(const mission::Choice& choice);
  void hear(const std::string& model, const Message& message);
  [[nodiscard]] const Made* find(std::string_view named) const;

  mutable std::mutex mutex_;
  std::map<std::string, Model, std::less<>> models_;
};

}  // namespace sentree::studio
