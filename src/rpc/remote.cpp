#include "sentree/rpc/detail/remote.h"

#include <poll.h>

#include <algorithm>
#include <limits>

namespace sentree::rpc {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

// A connection idle for longer than this is looked at before it is used: the peer may have gone meanwhile.
constexpr milliseconds kTrustedIdle{20};

// An address of its own kind for a service that several share.
std::string wire_name(const Address& address, const std::string& method) {
  return address.service.empty() ? method : address.service + ":" + method;
}

}  // namespace

Remote::Remote(const Address& address, std::string target, const ClientOptions& options,
               std::shared_ptr<const TlsContext> tls)
    : address_(address), target_(std::move(target)), options_(options), tls_(std::move(tls)) {}

Remote::~Remote() {
  interrupt(true);
  if (collector_thread_.joinable()) collector_thread_.join();
}

std::string Remote::where() const { return "\"" + target_ + "\" at " + to_string(address_); }

CallError Remote::unreachable(const std::string& why) const {
  return {CallErrorKind::kUnreachable, where() + " is unreachable: " + why, {}, {}};
}

CallError Remote::late(const std::string& what) const {
  return {CallErrorKind::kLate, where() + " did not answer in time: " + what, {}, {}};
}

Remote::Counts Remote::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

bool Remote::acquire(Deadline deadline) {
  std::unique_lock lock(mutex_);
  if (busy_) {
    ++waiting_;
    const auto free = [&] { return !busy_; };
    const bool got =
        deadline == kNoDeadline ? (freed_.wait(lock, free), true) : freed_.wait_until(lock, deadline, free);
    --waiting_;
    if (!got) return false;
  }
  busy_ = true;
  interrupted_ = false;
  return true;
}

void Remote::release() {
  bool wake_caller = false;
  bool wake_collector = false;
  {
    const std::lock_guard lock(mutex_);
    busy_ = false;
    owed_count_ = owed_.size();
    wake_caller = waiting_ > 0;
    wake_collector = owed_count_ > 0;
  }
  if (wake_caller) freed_.notify_one();
  if (wake_collector) collector_.notify_one();
}

void Remote::interrupt(bool for_good) {
  std::shared_ptr<Connection> connection;
  {
    const std::lock_guard lock(mutex_);
    closed_ = closed_ || for_good;
    interrupted_ = true;
    connection = connection_;
  }
  if (connection != nullptr) connection->stream->shut_down();
  collector_.notify_all();
}

Outcome Remote::exchange(const idl::Method& method, const Value& arguments, const CallContext& context) {
  if (!acquire(context.deadline)) return tl::unexpected(late("other calls kept the connection busy"));
  Outcome out = talk(method, arguments, context);
  const bool owes = !owed_.empty();
  release();
  if (owes) start_collector();
  return out;
}

void Remote::drop() {
  const std::lock_guard lock(mutex_);
  // The collector may be waiting for it.
  if (connection_ != nullptr) connection_->stream->shut_down();
  connection_.reset();
  owed_.clear();
}

tl::expected<void, CallError> Remote::connected(Deadline deadline) {
  const auto now = steady_clock::now();
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return tl::unexpected(unreachable("the client has been closed"));
  }
  if (connection_ != nullptr) {
    if (!owed_.empty() && (owed_.size() >= kLateRepliesMax || now >= owed_.front().given_up)) {
      // It has not answered for too long; perhaps a new connection gets a thread that does.
      drop();
    } else if (now - idle_since_ > kTrustedIdle) {
      take_late_replies();
    }
  }
  if (connection_ != nullptr) return {};
  if (now < next_attempt_) {
    const auto wait = std::chrono::ceil<milliseconds>(next_attempt_ - now).count();
    return tl::unexpected(unreachable(last_failure_ + "; tried again in " + std::to_string(wait) + " ms"));
  }
  Connected made = connect_to(address_, resolver_, tls_, deadline);
  if (made.stream == nullptr) {
    last_failure_ = made.why;
    const auto backoff = std::min(options_.backoff_last, kBackoffFirst * (1 << std::min(failures_, 10)));
    ++failures_;
    next_attempt_ = steady_clock::now() + backoff;
    return tl::unexpected(made.status == StreamStatus::kLate ? late("connecting: " + made.why) : unreachable(made.why));
  }
  failures_ = 0;
  auto connection = std::make_shared<Connection>(std::move(made.stream), options_.limits);
  connection->wire = Wire::make(address_.protocol, address_.framed, connection->in, connection->out, options_.limits);
  const std::lock_guard lock(mutex_);
  if (closed_ || interrupted_) return tl::unexpected(unreachable("interrupted while connecting"));
  connection_ = std::move(connection);
  ++counts_.connections;
  return {};
}

Outcome Remote::talk(const idl::Method& method, const Value& arguments, const CallContext& context) {
  if (auto ready = connected(context.deadline); !ready) return tl::unexpected(std::move(ready.error()));
  Connection& c = *connection_;
  sequence_ = sequence_ == std::numeric_limits<std::int32_t>::max() ? 1 : sequence_ + 1;
  try {
    const CausalStamp stamp = options_.clock != nullptr ? options_.clock->advance() : 0;
    c.wire->write_call(address_.service.empty() ? method.name : wire_name(address_, method.name),
                       method.oneway ? MessageType::kOneway : MessageType::kCall, sequence_, method.arguments,
                       arguments, stamp);
    const auto [data, size] = c.out.finish();
    const StreamStatus sent = c.stream->send(data, size, context.deadline);
    if (sent != StreamStatus::kOk) {
      std::string why = c.stream->why();
      drop();
      return tl::unexpected(sent == StreamStatus::kLate ? late("it does not take the request") : unreachable(why));
    }
    if (method.oneway) {
      idle_since_ = steady_clock::now();
      return Value();
    }
    return await_reply(method, arguments, context, sequence_);
  } catch (const WireError& e) {
    drop();
    if (e.status == StreamStatus::kClosed) return tl::unexpected(unreachable(e.why));
    return tl::unexpected(CallError{CallErrorKind::kProtocol, where() + " broke the protocol: " + e.why, {}, {}});
  }
}

Outcome Remote::await_reply(const idl::Method& method, const Value& arguments, const CallContext& context,
                            std::int32_t sequence) {
  Connection& c = *connection_;
  while (true) {
    c.in.begin_message(context.deadline);
    try {
      MessageHead head = c.wire->read_head();
      const bool owed =
          std::any_of(owed_.begin(), owed_.end(), [&](const Owed& o) { return o.sequence == head.sequence; });
      if (owed) {
        report_late(head);
        continue;
      }
      // A peer that numbers its replies itself is forgiven as long as there is nothing to confuse.
      if (head.sequence != sequence && !owed_.empty()) {
        throw WireError{StreamStatus::kFailed, "a reply with the unknown number " + std::to_string(head.sequence)};
      }
      ReplyBody body = c.wire->read_reply(head.type, method);
      c.wire->end_message();
      if (options_.clock != nullptr) options_.clock->receive(body.stamp);
      idle_since_ = steady_clock::now();
      return outcome_of(method, std::move(body));
    } catch (const WireError& e) {
      if (e.status != StreamStatus::kLate) throw;
      c.in.rewind();
      c.wire->reset();
      owed_.push_back({sequence, &method, arguments, std::string(context.source), context.call,
                       steady_clock::now() + options_.late_wait});
      idle_since_ = {};
      return tl::unexpected(late("no reply to " + method.name));
    }
  }
}

Outcome Remote::outcome_of(const idl::Method& method, ReplyBody body) {
  if (body.form == ReplyBody::Form::kResult) return std::move(body.value);
  if (body.form == ReplyBody::Form::kException) {
    const std::string& name = body.exception->type->structure->name;
    return tl::unexpected(CallError{CallErrorKind::kException,
                                    "\"" + target_ + "\" answered " + method.name + " with " + name, name,
                                    std::move(body.value)});
  }
  const std::string why =
      body.failure_type == kUnknownMethod ? " knows no " + method.name + ": " : " failed in " + method.name + ": ";
  return tl::unexpected(CallError{CallErrorKind::kProtocol, where() + why + body.failure, {}, {}});
}

void Remote::report_late(MessageHead& head) {
  const auto found =
      std::find_if(owed_.begin(), owed_.end(), [&](const Owed& o) { return o.sequence == head.sequence; });
  if (found == owed_.end()) throw WireError{StreamStatus::kFailed, "a reply that nobody waits for"};
  Connection& c = *connection_;
  ReplyBody body = c.wire->read_reply(head.type, *found->method);
  c.wire->end_message();
  if (options_.clock != nullptr) options_.clock->receive(body.stamp);
  const Owed late = std::move(*found);
  owed_.erase(found);
  {
    const std::lock_guard lock(mutex_);
    ++counts_.late_replies;
  }
  if (options_.hook == nullptr) return;
  const Outcome outcome = outcome_of(*late.method, std::move(body));
  options_.hook->late({late.source, target_, *late.method, late.arguments, late.call}, outcome);
}

// Everything that has come already; notices a peer that has gone.
void Remote::take_late_replies() {
  Connection& c = *connection_;
  const Deadline passed{};
  try {
    while (true) {
      if (const auto status = c.in.wait(passed); status != StreamStatus::kOk) {
        if (status != StreamStatus::kLate) drop();
        return;
      }
      c.in.begin_message(passed);
      MessageHead head = c.wire->read_head();
      report_late(head);
    }
  } catch (const WireError& e) {
    if (e.status == StreamStatus::kLate) {
      c.in.rewind();
      c.wire->reset();
    } else {
      drop();
    }
  }
}

// The collector waits for late replies between calls, so that they are reported when they come and not with the next
// call. It is started by the first late call: most clients never need it.
void Remote::start_collector() {
  const std::lock_guard lock(mutex_);
  if (collecting_ || closed_) return;
  try {
    collector_thread_ = std::thread([this] { collect(); });
    collecting_ = true;
  } catch (const std::system_error&) {
    // Without it late replies are reported with the next call.
  }
}

void Remote::collect() {
  while (true) {
    std::shared_ptr<Connection> connection;
    {
      std::unique_lock lock(mutex_);
      collector_.wait(lock, [&] { return closed_ || (!busy_ && owed_count_ > 0 && connection_ != nullptr); });
      if (closed_) return;
      connection = connection_;
    }
    // Whoever is done with the connection shuts it down, which ends the wait.
    pollfd watched{connection->stream->descriptor(), POLLIN, 0};
    ::poll(&watched, 1, static_cast<int>(options_.late_wait.count()));
    {
      const std::lock_guard lock(mutex_);
      if (closed_) return;
      if (busy_ || connection_ != connection) continue;
      busy_ = true;
    }
    if (watched.revents != 0) take_late_replies();
    if (!owed_.empty() && steady_clock::now() >= owed_.front().given_up) drop();
    release();
  }
}

}  // namespace sentree::rpc
