#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/ros/address.h"
#include "sentree/ros/dds.h"

/// Our place in a graph of ROS 2. Private to the library.
namespace sentree::ros {

/// Does what it is given in a thread of its own, in that order. What is beyond the bound drops the oldest.
class Worker {
 public:
  static constexpr std::size_t kWaitingMax = 256;

  Worker() : thread_([this] { run(); }) {}
  ~Worker() { stop(); }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// False: something older was dropped for it.
  bool post(std::function<void()> work);
  /// Waits for what is in progress; the rest is forgotten. Not from its own thread.
  void stop();

 private:
  void run();
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> waiting_;
  bool stopped_ = false;
  std::mutex join_mutex_;
  std::thread thread_;
};

/// When everybody has been discovered, as far as one can know: DDS does not say. A value, looked at now and then.
class Settling {
 public:
  using SteadyClock = std::chrono::steady_clock;
  /// Discovery on one machine took up to 1.1 s when it was measured, and longer than 2.5 s where others have the
  /// processors: it goes on as long as somebody new keeps coming.
  static constexpr std::chrono::milliseconds kAtLeast{2500};
  static constexpr std::chrono::milliseconds kQuiet{1000};
  static constexpr std::chrono::milliseconds kNobody{5000};  ///< Where nobody at all is there.
  static constexpr std::chrono::milliseconds kAtMost{10000};

  explicit Settling(SteadyClock::time_point begun) : begun_(begun), last_(begun) {}
  /// @param endpoints  How many have been discovered by now.
  [[nodiscard]] bool look(SteadyClock::time_point now, std::size_t endpoints);

 private:
  SteadyClock::time_point begun_;
  SteadyClock::time_point last_;  // when their number was another
  std::size_t endpoints_ = 0;
};

class Node;

/// "/battery" of "rq/batteryRequest", and what that is: "service pkg/srv/T". Both empty: nothing that a person would
/// look for.
[[nodiscard]] std::pair<std::string, std::string> shown(const dds::Endpoint& endpoint);
/// Of what there is of a kind ("topic", "service", "action"): "; did you mean …?", else what is of that type, by its
/// name in DDS. Empty: neither.
[[nodiscard]] std::string near_names(const Node& node, const std::string& name, const std::string& kind,
                                     const std::string& type);

/// A reader or a writer that the node tells of as long as it is there.
class Told {
 public:
  ~Told();
  Told(const Told&) = delete;
  Told& operator=(const Told&) = delete;
  dds::Reader* reader() { return reader_.get(); }
  dds::Writer* writer() { return writer_.get(); }
  [[nodiscard]] const dds::Guid& guid() const { return guid_; }

 private:
  friend class Node;
  Told(std::shared_ptr<Node> node, std::unique_ptr<dds::Reader> reader, std::unique_ptr<dds::Writer> writer)
      : node_(std::move(node)),
        reader_(std::move(reader)),
        writer_(std::move(writer)),
        guid_(reader_ != nullptr ? reader_->guid() : writer_->guid()) {}
  std::shared_ptr<Node> node_;
  std::unique_ptr<dds::Reader> reader_;
  std::unique_ptr<dds::Writer> writer_;
  const dds::Guid guid_;
};
using ToldPtr = std::unique_ptr<Told>;

/// One participant for each domain and range, shared by everything in this process. Thread-safe.
class Node : public std::enable_shared_from_this<Node> {
 public:
  using SteadyClock = std::chrono::steady_clock;
  /// Errors: rpc.address (this build has no DDS, or its library is missing), rpc.exhausted.
  [[nodiscard]] static Result<std::shared_ptr<Node>> of(const GraphAddress& address);
  Node(std::unique_ptr<dds::Participant> participant, Release release, std::uint32_t domain);

  [[nodiscard]] Result<ToldPtr> read(const dds::Channel& channel, dds::Participant::OnSample on_sample,
                                     dds::Participant::OnChange on_change);
  /// The participant itself, for readers and writers that are no part of what the node tells of. They go before it.
  [[nodiscard]] dds::Participant& participant() const { return *participant_; }
  [[nodiscard]] Result<ToldPtr> write(const dds::Channel& channel, dds::Participant::OnChange on_change);
  [[nodiscard]] std::vector<dds::Endpoint> endpoints() const { return participant_->endpoints(); }
  /// What somebody serves or reads at a topic of DDS in place of `type`, as ", but somebody has pkg/srv/T there";
  /// empty.
  [[nodiscard]] std::string other_type(const std::string& topic, const std::string& type) const;
  [[nodiscard]] std::uint32_t domain() const { return domain_; }
  /// Before, others may not have been discovered.
  [[nodiscard]] bool is_settled();

  /// The one object of that key, made if there is none.
  template <class T, class Make>
  [[nodiscard]] Result<std::shared_ptr<T>> shared(const std::string& key, Make&& make) {
    const std::lock_guard lock(shared_mutex_);
    std::weak_ptr<void>& slot = shared_[key];
    if (auto known = std::static_pointer_cast<T>(slot.lock())) return known;
    Result<std::shared_ptr<T>> made = make();
    if (made) slot = *made;
    return made;
  }

 private:
  friend class Told;
  void tell_of(const dds::Guid& guid, bool is_writer, bool is_there);

  const std::unique_ptr<dds::Participant> participant_;
  const Release release_;
  const std::uint32_t domain_;
  std::mutex settling_mutex_;
  Settling settling_;
  std::mutex mutex_;
  std::set<dds::Guid> readers_;
  std::set<dds::Guid> writers_;
  std::unique_ptr<dds::Writer> graph_;  // of what the node is made of
  std::mutex shared_mutex_;
  std::map<std::string, std::weak_ptr<void>> shared_;
};

/// Loads the shared object with DDS, once. Error: rpc.address, saying what is missing.
[[nodiscard]] Result<dds::Open> load_dds();

}  // namespace sentree::ros
