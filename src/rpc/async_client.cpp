#include "sentree/rpc/async_client.h"

#include <fmt/format.h>

#include <poll.h>

#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include "sentree/base/alarm.h"
#include "sentree/rpc/detail/calls.h"
#include "sentree/rpc/detail/thrift_line.h"

namespace sentree::rpc {

using std::chrono::steady_clock;

class AsyncClient::Impl {
 public:
  Impl(std::unique_ptr<Line> line, idl::ServicePtr interface)
      : interface_(std::move(interface)), line_(std::move(line)) {}
  ~Impl() { end(); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  Result<void> start() {
    if (!alarm_.works()) return fail("rpc.exhausted", "no file descriptor is left for a client");
    try {
      thread_ = std::thread([this] { run(); });
    } catch (const std::system_error& e) {
      return fail("rpc.exhausted", std::string("no thread is left for a client: ") + e.what());
    }
    return {};
  }

  const idl::Service& interface() const { return *interface_; }

  void call(const idl::Method& method, Value arguments, Deadline deadline, Done done) {
    if (auto over = calls_.admit(method, arguments)) return done(std::move(*over));
    Job job{&method, std::move(arguments), deadline, std::move(done)};
    std::unique_lock lock(mutex_);
    if (closed_ || waiting_.size() >= kAsyncCallsMax) {
      CallError error = line_->unreachable(closed_ ? "the client has been closed"
                                                   : fmt::format("{} calls are waiting already", kAsyncCallsMax));
      lock.unlock();
      return finish(job, tl::unexpected(std::move(error)));
    }
    const bool free = !busy_ && !sending_ && !flight_ && waiting_.empty();
    const std::shared_ptr<Link> connection = free ? line_->prepare(method, job.arguments) : nullptr;
    if (connection == nullptr) {
      waiting_.push_back(std::move(job));
      if (free) wake();
      return;
    }
    if (!method.oneway) ring_at(job.deadline);
    flight_ = std::move(job);
    sending_ = true;
    // Without the lock: the reply may be there before the sender is back.
    lock.unlock();
    const auto [data, size] = connection->message();
    const std::size_t sent = connection->stream->send_now(data, size);
    lock.lock();
    sending_ = false;
    has_rest_ = sent < size;
    if (!flight_) {
      // It has failed meanwhile.
      if (std::exchange(has_rest_, false)) line_->drop();
    } else if (has_rest_) {
      sent_ = sent;
      wake();
    } else if (method.oneway) {
      land(lock, Value());
    }
    if (!waiting_.empty()) wake();
  }

  void open(Deadline deadline, const Done& done) {
    {
      const std::lock_guard lock(mutex_);
      if (!closed_ && waiting_.size() < kAsyncCallsMax) {
        waiting_.push_back({nullptr, {}, deadline, done});
        return wake();
      }
    }
    done(tl::unexpected(line_->unreachable("the client is closed or busy")));
  }

  void close() {
    const std::lock_guard lock(mutex_);
    if (std::exchange(closed_, true)) return;
    line_->interrupt(true);
    wake();
  }

  void end() {
    close();
    const std::lock_guard lock(join_mutex_);
    if (thread_.joinable()) thread_.join();
  }

  ClientCounters counters() const {
    ClientCounters out = calls_.counters();
    out.late_replies = line_->counts().late_replies;
    out.connections = line_->counts().connections;
    return out;
  }

 private:
  struct Job {
    const idl::Method* method = nullptr;  // null: it only connects
    Value arguments;
    Deadline deadline;
    Done done;
  };

  void finish(const Job& job, Outcome out) {
    if (job.method != nullptr) calls_.ended(out);
    job.done(std::move(out));
  }

  // With the lock held.
  void ring_at(Deadline when) {
    if (when >= rings_at_) return;
    rings_at_ = when;
    alarm_.set(when);
  }
  void wake() { ring_at({}); }

  void run() {
    std::unique_lock lock(mutex_);
    while (!closed_) {
      if (has_rest_) {
        has_rest_ = false;
        settle(lock, [this] { return line_->send_rest(sent_, flight_->deadline); });
      } else if (!sending_ && !flight_ && take_next()) {
        settle(lock, [this] { return send(*flight_); });
      } else {
        await(lock);
      }
    }
    while (take_next()) {
      settle(lock, [this]() -> std::optional<Outcome> {
        return tl::unexpected(line_->unreachable("the client has been closed"));
      });
    }
  }

  // True: a call is in flight, or is to be sent.
  bool take_next() {
    if (flight_) return true;
    if (waiting_.empty()) return false;
    flight_ = std::move(waiting_.front());
    waiting_.pop_front();
    return true;
  }

  std::optional<Outcome> send(const Job& job) {
    if (steady_clock::now() >= job.deadline) return tl::unexpected(line_->late("other calls kept the connection busy"));
    line_->begin();
    if (job.method == nullptr) return line_->open(job.deadline).map([] { return Value(); });
    return line_->send(*job.method, job.arguments, job.deadline);
  }

  // Does something with the line that may end the call in flight. Meanwhile new calls wait.
  template <class F>
  void settle(std::unique_lock<std::mutex>& lock, F&& work) {
    busy_ = true;
    lock.unlock();
    std::optional<Outcome> out = work();
    lock.lock();
    busy_ = false;
    if (out) land(lock, std::move(*out));
  }

  // Ends the call in flight.
  void land(std::unique_lock<std::mutex>& lock, Outcome out) {
    Job job = std::move(*flight_);
    flight_.reset();
    // What follows half a request would be taken for its other half.
    if (std::exchange(has_rest_, false)) line_->drop();
    lock.unlock();
    finish(job, std::move(out));
    lock.lock();
  }

  // Until the line or a caller has something to do, or a time has come.
  void await(std::unique_lock<std::mutex>& lock) {
    ring_at(flight_ ? flight_->deadline : line_->gives_up());
    const std::shared_ptr<Link> connection = line_->connection();
    lock.unlock();
    pollfd watched[2] = {{alarm_.descriptor(), POLLIN, 0},
                         {connection != nullptr ? connection->stream->descriptor() : -1, POLLIN, 0}};
    ::poll(watched, 2, -1);
    lock.lock();
    if (watched[0].revents != 0) {
      alarm_.wait();
      rings_at_ = kNoDeadline;
    }
    if (closed_) return;
    if (has_rest_) return;
    const bool came = watched[1].revents != 0 && line_->connection() == connection;
    const auto now = steady_clock::now();
    if (came) connection->stream->came();
    if (flight_ && !flight_->method->oneway && (is_reply(came) || (!sending_ && now >= flight_->deadline))) {
      settle(lock, [this] { return line_->receive(*flight_->method, flight_->deadline); });
    } else if (!flight_ && came) {
      settle(lock, [this] {
        line_->take_late_replies();
        return std::optional<Outcome>();
      });
    } else if (!flight_ && now >= line_->gives_up()) {
      line_->drop();
    }
  }

  // While the request is being sent, only its reply may be waited for: it has gone whole if that is what came.
  [[nodiscard]] bool is_reply(bool came) const { return came && !(sending_ && line_->owes()); }

  const idl::ServicePtr interface_;
  Calls calls_;
  const std::unique_ptr<Line> line_;  // of whoever holds the lock while nobody is busy, else of the thread

  std::mutex mutex_;
  bool closed_ = false;
  bool busy_ = false;          // the thread uses the line
  bool sending_ = false;       // a caller does, and only sends
  bool has_rest_ = false;      // the call in flight has not gone whole
  std::size_t sent_ = 0;       // bytes of it that have
  std::optional<Job> flight_;  // sent, at least in part; its reply has not come
  std::deque<Job> waiting_;
  Alarm alarm_;  // wakes the thread
  Deadline rings_at_ = kNoDeadline;
  std::mutex join_mutex_;
  std::thread thread_;
};

AsyncClient::AsyncClient(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
AsyncClient::~AsyncClient() = default;

Result<std::unique_ptr<AsyncClient>> AsyncClient::remote(const Address& address, idl::ServicePtr interface,
                                                         ClientOptions options) {
  auto tls = prepare_remote(address, options.tls);
  if (!tls) return tl::unexpected(tls.error());
  auto line = std::make_unique<ThriftLine>(address, named(std::move(options), *interface), std::move(*tls));
  return over(std::move(line), std::move(interface));
}

Result<std::unique_ptr<AsyncClient>> AsyncClient::over(std::unique_ptr<Line> line, idl::ServicePtr interface) {
  auto impl = std::make_unique<Impl>(std::move(line), std::move(interface));
  if (auto started = impl->start(); !started) return tl::unexpected(started.error());
  return std::unique_ptr<AsyncClient>(new AsyncClient(std::move(impl)));
}

const idl::Service& AsyncClient::interface() const { return impl_->interface(); }

void AsyncClient::call(const idl::Method& method, Value arguments, Deadline deadline, Done done) {
  impl_->call(method, std::move(arguments), deadline, std::move(done));
}

void AsyncClient::open(Deadline deadline, const Done& done) { impl_->open(deadline, done); }
void AsyncClient::close() { impl_->close(); }
void AsyncClient::end() { impl_->end(); }
ClientCounters AsyncClient::counters() const { return impl_->counters(); }

}  // namespace sentree::rpc
