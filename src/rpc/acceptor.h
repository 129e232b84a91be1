#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <thread>

#include "sentree/base/result.h"
#include "sentree/rpc/listener.h"
#include "sentree/rpc/stream.h"

namespace sentree::rpc {

/// A connection that was accepted, for the thread that attends to it.
class Visitor {
 public:
  /// Shut down when the acceptor stops.
  [[nodiscard]] Stream& stream() const { return *stream_; }
  /// Within a message it is not closed in another's favour.
  void busy() { idle_since_ns_.store(0); }
  void idle();
  /// Of one that was a newcomer: the peer has shown who it is. False: its place has been given to another.
  [[nodiscard]] bool arrive();
  /// Its place has been given to another before it arrived.
  [[nodiscard]] bool is_gone() const { return stage_.load() == Stage::kGone; }

 private:
  friend class Acceptor;
  std::unique_ptr<Stream> stream_;
  std::thread thread_;
  enum class Stage : std::uint8_t { kNew, kArrived, kGone };
  std::atomic<Stage> stage_{Stage::kNew};
  std::atomic<std::int64_t> idle_since_ns_{0};  // 0: busy
  std::atomic<bool> done_{false};
};

/// Accepts connections in a thread of its own and attends to each in another.
class Acceptor {
 public:
  struct Options {
    std::size_t connections_max = 64;  ///< One more is closed at once.
    /// A connection that is idle for this long is closed when its place is needed for another.
    std::chrono::milliseconds idle_before_eviction{10000};
    /// Of all connections, those whose peers have yet to show who they are: one more, or one beyond `connections_max`,
    /// takes the place of the oldest of them, so that peers that say nothing keep out nobody who does. 0: there are no
    /// newcomers.
    std::size_t newcomers_max = 0;
    /// Told of each connection that was closed at once, in the thread that accepts.
    std::function<void()> on_refused = {};
  };
  struct Counters {
    std::uint64_t connections = 0;
    std::uint64_t refused = 0;
  };
  /// In the connection's thread; the connection ends when it returns. It must return soon after the stream is shut
  /// down.
  using Attend = std::function<void(Visitor&)>;

  /// Errors: rpc.address (no descriptor or thread left).
  [[nodiscard]] static Result<std::unique_ptr<Acceptor>> start(Listener listener, Attend attend, Options options);
  /// Stops.
  ~Acceptor();
  Acceptor(const Acceptor&) = delete;
  Acceptor& operator=(const Acceptor&) = delete;

  /// Stops listening, shuts all connections down and waits for their threads. Idempotent.
  void stop();
  [[nodiscard]] bool is_stopping() const { return stopping_.load(); }
  [[nodiscard]] Counters counters() const { return {connections_.load(), refused_.load()}; }

 private:
  Acceptor(Listener listener, Attend attend, Options options);
  void wake() const;
  void accept_all();
  void reap();
  bool make_room();
  Visitor* oldest_newcomer();
  Visitor* longest_idle();
  void welcome(Descriptor socket);

  std::unique_ptr<Listener> listener_;
  const Attend attend_;
  const Options options_;
  int wake_[2] = {-1, -1};
  std::atomic<bool> stopping_{false};
  std::thread thread_;
  std::mutex mutex_;  // visitors_: the thread changes it, stop reads it
  std::list<Visitor> visitors_;
  std::atomic<std::uint64_t> connections_{0};
  std::atomic<std::uint64_t> refused_{0};
};

}  // namespace sentree::rpc
