#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "sentree/ros/detail/action_type.h"
#include "sentree/ros/detail/service.h"
#include "sentree/rpc/middleware.h"

/// Actions of ROS, as whoever sends goals sees them. Private to the library.
namespace sentree::ros {

/// An action's three services and two topics; shared by all in this process who use it. Results, feedback and statuses
/// go to who subscribed. Thread-safe.
class ActionClient {
 public:
  using Take = rpc::Middleware::Take;
  using Problem = std::function<void(const std::string&)>;

  /// Goals whose end is waited for.
  static constexpr std::size_t kGoalsMax = 64;

  [[nodiscard]] static Result<std::shared_ptr<ActionClient>> of(const std::shared_ptr<Node>& node,
                                                                const idl::ServicePtr& interface,
                                                                const std::string& name);
  ~ActionClient();
  ActionClient(const ActionClient&) = delete;
  ActionClient& operator=(const ActionClient&) = delete;

  /// Hears until the number is given back.
  [[nodiscard]] int hear(Take take, Problem problem);
  void forget(int number);

  [[nodiscard]] bool is_available() const;
  [[nodiscard]] bool wait_available(rpc::Deadline deadline, const std::function<bool()>& interrupted);

  /// `send_goal` and `cancel_goal`.
  [[nodiscard]] rpc::Outcome call(const idl::Method& method, const Value& arguments, rpc::Deadline deadline,
                                  const std::function<bool()>& interrupted);
  /// Asks for goals to be cancelled and waits for nothing.
  void cancel_now(const std::vector<std::string>& goal_ids);
  /// Whether its end has not come.
  [[nodiscard]] bool is_open(const std::string& goal_id) const;
  void wake();

 private:
  using Octets = std::vector<std::uint8_t>;
  struct Goal {
    std::optional<ServiceClient::Key> asked;  // for its result
  };
  struct Listener {
    Take take;
    Problem problem;
  };

  ActionClient(idl::ServicePtr interface, std::string name, ActionType type)
      : interface_(std::move(interface)), name_(std::move(name)), type_(std::move(type)) {}
  [[nodiscard]] Result<void> open(const std::shared_ptr<Node>& node);
  void follow();
  void publish(const char* method, const Map& arguments);
  void trouble(const std::string& what);
  void take_feedback(const Octets& message);
  void take_statuses(const Octets& message);
  [[nodiscard]] Octets cancel_request(const std::string& goal_id) const;

  const idl::ServicePtr interface_;
  const std::string name_;
  const ActionType type_;
  std::function<std::string()> other_type_;  // what somebody else serves by that name
  std::shared_ptr<ServiceClient> send_goal_;
  std::shared_ptr<ServiceClient> get_result_;
  std::shared_ptr<ServiceClient> cancel_goal_;
  std::shared_ptr<std::function<void()>> on_change_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool stopped_ = false;
  bool looked_ = false;
  std::map<std::string, Goal> goals_;
  std::map<std::string, std::string> statuses_;
  std::mutex listeners_mutex_;  // held while they are told
  std::map<int, Listener> listeners_;
  int last_ = 0;
  Worker worker_;
  std::thread follower_;
  ToldPtr feedback_reader_;
  ToldPtr status_reader_;
};

}  // namespace sentree::ros
