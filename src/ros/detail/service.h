#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sentree/ros/detail/node.h"
#include "sentree/rpc/call.h"

/// Services of ROS in octets, as both of its implementations of DDS carry them. Private to the library.
namespace sentree::ros {

/// Where requests and replies of a service are.
struct ServiceName {
  std::string name;  ///< "/set_lamp"
  std::string request_type;
  std::string reply_type;
};

/// Asks one service; shared by all in this process who do. Thread-safe.
class ServiceClient {
 public:
  using Octets = std::vector<std::uint8_t>;
  /// Of a request that was sent: how it was marked, and its number.
  using Key = std::pair<bool, std::int64_t>;

  [[nodiscard]] static Result<std::shared_ptr<ServiceClient>> of(const std::shared_ptr<Node>& node,
                                                                 const ServiceName& service);

  /// The same, of its own.
  [[nodiscard]] static Result<std::shared_ptr<ServiceClient>> make(const std::shared_ptr<Node>& node,
                                                                   const ServiceName& service);

  /// Whether a server is there whose replies we get.
  [[nodiscard]] bool is_available() const;
  /// Waits for that; `interrupted` is looked at after each `wake`.
  [[nodiscard]] bool wait_available(rpc::Deadline deadline, const std::function<bool()>& interrupted);

  /// Nothing: nobody is there, or the queues are full.
  [[nodiscard]] std::optional<Key> send(const Octets& request);
  /// The reply, once.
  [[nodiscard]] std::optional<Octets> take(const Key& key);
  /// The reply, or nothing when the deadline has passed, the server has gone or it was interrupted.
  [[nodiscard]] std::optional<Octets> wait(const Key& key, rpc::Deadline deadline,
                                           const std::function<bool()>& interrupted);
  /// Lets everybody who waits look again.
  void wake();
  /// Called after each reply and each server that comes or goes, from a thread of DDS.
  void also_tell(std::weak_ptr<std::function<void()>> listener);

 private:
  // Replies that nobody takes any more.
  static constexpr std::size_t kRepliesMax = 64;

  void take_reply(dds::Sample sample);
  [[nodiscard]] bool is_available_now() const;

  std::uint64_t id_ = 0;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::pair<Key, Octets>> replies_;
  std::int64_t last_ = 0;
  std::vector<std::weak_ptr<std::function<void()>>> listeners_;
  ToldPtr reader_;
  ToldPtr writer_;
};

/// Answers one service.
class ServiceServer {
 public:
  using Octets = std::vector<std::uint8_t>;
  /// Gives the reply, from any thread, at most once.
  using Answer = std::function<void(const Octets& reply)>;
  /// In the server's thread: a request, with its encapsulation.
  using Handle = std::function<void(Octets request, Answer answer)>;
  using Problem = std::function<void(const std::string&)>;

  [[nodiscard]] static Result<std::unique_ptr<ServiceServer>> open(const std::shared_ptr<Node>& node,
                                                                   const ServiceName& service, Worker& worker,
                                                                   Handle handle, Problem problem);
  ~ServiceServer();
  ServiceServer(const ServiceServer&) = delete;
  ServiceServer& operator=(const ServiceServer&) = delete;

 private:
  struct Shared;
  explicit ServiceServer(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {}
  std::shared_ptr<Shared> shared_;
  ToldPtr reader_;
};

}  // namespace sentree::ros
