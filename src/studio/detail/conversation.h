#pragma once

#include <array>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sentree/studio/detail/steering_queue.h"
#include "sentree/studio/server.h"

namespace sentree::studio {

/// What all pages are shown alike. Of the thread that composes.
class Composer {
 public:
  struct Options {
    std::string hello;
    std::string token;
    bool steerable = false;
    bool coverage = false;  ///< Whoever looks may ask what has been reached.
  };
  /// `queue` is where what may take long is done; null: there is nothing of it.
  Composer(const Subject& subject, const History& history, const RunAccess& run, SteeringQueue* queue, Options options);

  /// Looks at the run again.
  void refresh();

  const Subject& subject;
  const History& history;
  const RunAccess& run;
  SteeringQueue* const queue;
  const Options options;
  const std::shared_ptr<const std::string> model;
  std::vector<History::Fragment> fragments;
  History::Present present;
  std::string facts;  ///< The members of `run` but for the mission's status.
};

/// Values of a signal by time, as many as a picture of some width can show: of each pixel the first, the last, and the
/// extremes.
struct SignalPoints {
  using Point = std::pair<Nanoseconds, double>;
  struct Pixel {
    std::int64_t pixel = 0;
    Point first, least, most, last;
  };
  /// Times do not run backwards.
  void add(Nanoseconds time, double value);
  /// [[time, value]]
  [[nodiscard]] List take() const;

  Nanoseconds from = 0;
  Nanoseconds to = 1;
  std::int64_t width = 1;
  std::vector<Pixel> pixels;
};

/// Where a page's messages go. Of the thread that composes.
class MessageSink {
 public:
  virtual ~MessageSink() = default;
  /// As `http::Socket` has them.
  virtual bool send(std::shared_ptr<const std::string> text) = 0;
  [[nodiscard]] virtual std::size_t queued() const = 0;
  virtual void close(std::uint16_t code, std::string reason) = 0;
};

/// One page: what it asked for, and what it has been sent. Of the thread that composes.
class Conversation {
 public:
  /// Sends hello, model, the violations so far and the present state.
  Conversation(Composer& composer, std::uint64_t client, std::unique_ptr<MessageSink> sink);
  ~Conversation();
  Conversation(const Conversation&) = delete;
  Conversation& operator=(const Conversation&) = delete;

  void received(const std::string& text);
  /// What became of a request to steer.
  void steered(std::int64_t id, Result<Value> result);
  /// A message for who may steer.
  void told(const std::shared_ptr<const std::string>& message);
  /// Another run, at the same moment. `stays`: also where that was the end.
  void show(Composer& composer, bool stays);
  /// Does a slice of what was asked for.
  void work();
  /// What the page calls itself; empty: it has not said, or may only look.
  [[nodiscard]] std::string page() const { return may_steer_ ? page_ : std::string(); }
  [[nodiscard]] bool has_work() const { return !requests_.empty() && !is_behind(); }
  /// What has changed, if the page keeps up: of a page that looks at the past, only what the present has added.
  void send_delta();

 private:
  struct Request {
    std::int64_t id = 0;
    std::string op;
    Value body;
    Filter filter;
    bool begun = false;
    bool forwards = false;
    std::size_t position = 0;
    std::size_t limit = 0;
    std::vector<std::size_t> found;
    std::vector<std::string> path;
    SignalPoints points;
    std::vector<std::string> names;  // still to be looked at
    List offered;
  };

  [[nodiscard]] bool is_behind() const { return sink_->queued() > kBehindMax; }
  /// True: it is answered.
  bool advance(Request& request);
  bool advance_search(Request& request);
  bool advance_signal(Request& request);
  bool advance_signals(Request& request);
  void begin_search(Request& request);
  void seek(const Request& request);
  /// The state of that moment, or of the nearest one that is known, which it returns.
  Nanoseconds send_past_state(Nanoseconds time);
  void send_model();
  void follow();
  void steer(const Request& request);
  void send(std::string text);
  void answer(std::int64_t id, const Value& value);
  void answer_json(std::int64_t id, const std::string& json);
  void refuse(std::int64_t id, const std::string& why);
  void send_present_state();
  void send_news();
  void send_growth();

  Composer* composer_;
  const std::uint64_t client_;
  std::unique_ptr<MessageSink> sink_;
  bool live_ = true;
  bool may_steer_ = false;
  std::string page_;
  std::deque<Request> requests_;
  std::size_t steering_ = 0;         // requests in the queue
  std::vector<std::uint64_t> sent_;  // versions of the parts
  std::string sent_facts_;
  Nanoseconds asked_time_ = 0;  // the moment in the past that the page looks at
  Nanoseconds sent_time_ = -1;  // the newest that the page knows of
  std::string past_mission_;    // its status at the moment in the past that the page shows
  std::size_t next_observation_ = 0;
  std::size_t sent_violations_ = 0;
  std::size_t sent_problems_ = 0;
};

}  // namespace sentree::studio
