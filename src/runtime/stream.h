#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/mission/observation_name.h"
#include "sentree/runtime/scheduler.h"

namespace sentree::runtime {

/// The one ordered stream of everything observed in a run.
///
/// `publish` fixes the message's place in the total order before it returns; since a request is published before
/// it is sent and a reply before it is delivered, the order extends causality. Listeners see all messages in that
/// order, one at a time: in virtual time before `publish` returns, in real time on a thread of their own.
class Stream {
 public:
  using Listener = std::function<void(const Message&)>;

  /// Messages waiting for the listeners. A publisher waits for room, at most `kRoomPatience`; then its message is lost:
  /// its number stays free, it is counted, and the listeners are told by "observer.lost" when there is room again.
  static constexpr std::size_t kPendingMax = 1U << 16U;
  static constexpr std::chrono::seconds kRoomPatience{1};

  explicit Stream(Scheduler& scheduler);

  /// Whether a listener listens to observations of a name: always, or never.
  using Wants = std::function<bool(const std::string& name)>;

  /// Before the run starts.
  void subscribe(Listener listener) {
    listeners_.push_back(std::move(listener));
    hears_all_ = true;
  }
  /// Others may be passed by when nobody wants them; it must not mind those that it gets.
  void subscribe(Listener listener, Wants wants) {
    listeners_.push_back(std::move(listener));
    wants_.push_back(std::move(wants));
  }
  /// While that holds, everything is wanted.
  void hear_all_while(std::function<bool()> holds) { hears_all_while_ = std::move(holds); }
  /// Told of the time of what is passed, when a listener could be told of it.
  void on_passed(std::function<void(TimePoint)> told) { passed_ = std::move(told); }

  /// In virtual time, in the thread of the run: whether somebody wants it.
  [[nodiscard]] bool is_heard(mission::ObservationName& name) const;
  /// Likewise: something that nobody wants has its place in the order, and goes no further. Cost: a lock.
  void pass();

  /// Gives the message its sequence, stamp, time and tick and hands it on. From any thread.
  void publish(Message message);

  /// Why a message must not be published, or nothing. Called like a listener.
  using Judge = std::function<std::optional<mission::Veto>(const Message&)>;
  /// Told once, in any thread, that the message was published, or why not.
  using Decided = std::function<void(mission::Admission)>;
  /// What is published while a request is judged makes it be judged again; after so many times it is refused.
  static constexpr int kJudgementsMax = 16;

  /// Publishes `message` unless `judge` objects. It is judged when the listeners have seen everything published before
  /// it, and nothing comes between the judgement and its place in the order.
  /// In virtual time the decision is returned. In real time nothing is, `decided` gets the decision, and gets one even
  /// if the listeners are stuck: at `deadline`, which is then a veto.
  std::optional<mission::Admission> publish_if(Message message, const Judge& judge, TimePoint deadline,
                                               Decided decided);

  // Between two tasks, in real time while the scheduler is held: its part of the state of a run.
  void save(mission::State& state) const;
  void load(const mission::State& state);

  /// A number for a call that nobody else has.
  [[nodiscard]] std::uint64_t next_call() { return ++calls_; }
  void set_tick(std::uint64_t tick) { tick_ = tick; }
  [[nodiscard]] std::uint64_t tick() const { return tick_; }

  /// Hands on what is still pending: at the end of a run, when no actor works any more, or in `actor()`.
  void flush();
  /// In real time, after the actor's thread was left behind in a listener or in a judge: that listener gets the same
  /// message again, and must know how far it came.
  void resume();
  /// In which listeners are called in real time.
  [[nodiscard]] ActorId actor() const { return actor_; }
  /// The number of the last message, of lost ones too. From any thread.
  [[nodiscard]] std::uint64_t published() const { return sequence_; }
  [[nodiscard]] std::uint64_t lost() const { return lost_; }

 private:
  void drain();
  // With the lock held.
  void stamp(Message& message);

  Scheduler& scheduler_;
  ActorId actor_;
  std::vector<Listener> listeners_;
  std::vector<Wants> wants_;
  bool hears_all_ = false;
  std::function<bool()> hears_all_while_;
  std::function<void(TimePoint)> passed_;
  std::mutex mutex_;
  std::condition_variable room_;
  std::size_t waiting_for_room_ = 0;  // publishers
  std::deque<Message> pending_;
  // What is being handed on; members, so that a new thread can go on where another was left behind.
  // Taken out of those by the drain that goes on: a few at a time, so that whoever publishes seldom waits for the lock.
  static constexpr std::size_t kBatchMax = 64;
  std::deque<Message> batch_;
  std::optional<Message> delivering_;
  std::size_t listener_ = 0;
  std::function<void()> undecided_;  // refuses the request that is being judged
  std::thread::id listener_thread_;  // of the drain that goes on
  bool draining_ = false;
  std::atomic<std::uint64_t> lost_ = 0;
  std::uint64_t untold_ = 0;  // of the lost ones, those that no listener was told of
  std::once_flag has_deadlines_;
  ActorId deadlines_ = 0;
  std::atomic<std::uint64_t> sequence_ = 0;  // written with the lock held
  CausalStamp stamp_ = 0;
  std::atomic<std::uint64_t> calls_ = 0;
  std::atomic<std::uint64_t> tick_ = 0;
};

}  // namespace sentree::runtime
