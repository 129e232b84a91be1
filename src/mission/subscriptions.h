#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/base/time.h"
#include "sentree/mission/delivery.h"
#include "sentree/project/plan.h"

namespace sentree::mission {

/// Who subscribes to which topic of a plan: a call of a one-way method reaches them, in the order in which it was
/// observed.
class Subscriptions {
 public:
  struct Taker {
    bool is_model = false;
    std::size_t index = 0;  ///< Of the leaf whose skill it is, or of the model.
  };
  /// Who hears of a request, and what.
  struct Told {
    std::string topic;
    const std::vector<Taker>* takers = nullptr;  ///< Skills, then models, as in the plan. Null: nobody.
    Shared<Publication> what;
    std::string problem;  ///< Why nobody does who should; else empty.
  };

  /// @param plan  Borrowed.
  /// @param here  Whether the skill of a leaf is told here; null: each is.
  explicit Subscriptions(const project::Plan& plan, const std::function<bool(std::size_t leaf)>& here = nullptr);

  [[nodiscard]] bool empty() const { return takers_.empty(); }
  [[nodiscard]] Told told_of(const Message& request) const;

  /// When a subscriber hears of something that is published `now`: what is delayed holds back what comes later.
  static TimePoint time_of(TimePoint& not_before, TimePoint now, Duration delay) {
    return not_before = std::max(not_before, add_saturating(now, delay));
  }

 private:
  const project::Plan* plan_;
  std::map<std::string, std::vector<Taker>, std::less<>> takers_;
};

}  // namespace sentree::mission
