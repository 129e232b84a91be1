#include "sentree/rpc/detail/thrift_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "sentree/rpc/caller.h"

namespace sentree::rpc {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

// A connection idle for longer than this is looked at before it is used: the peer may have gone meanwhile.
constexpr milliseconds kTrustedIdle{20};

const idl::Method& nobodys() { return *nobodys_service()->methods.front(); }

}  // namespace

ThriftLine::ThriftLine(const Address& address, const ClientOptions& options, std::shared_ptr<const TlsContext> tls)
    : address_(address),
      options_(options),
      tls_(std::move(tls)),
      service_(address.service.empty() ? options.service : address.service),
      is_settled_(!address.service.empty() || options.service.empty()) {}

std::string ThriftLine::where() const { return fmt::format("\"{}\" at {}", options_.target, to_string(address_)); }

CallError ThriftLine::unreachable(const std::string& why) const {
  return {CallErrorKind::kUnreachable, fmt::format("{} is unreachable: {}", where(), why), {}, {}};
}

CallError ThriftLine::late(const std::string& what) const {
  return {CallErrorKind::kLate, fmt::format("{} did not answer in time: {}", where(), what), {}, {}};
}

CallError ThriftLine::broken(const WireError& error) {
  drop();
  if (error.status == StreamStatus::kClosed) return unreachable(error.why);
  return {CallErrorKind::kProtocol, fmt::format("{} broke the protocol: {}", where(), error.why), {}, {}};
}

ThriftLine::Counts ThriftLine::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

std::shared_ptr<Link> ThriftLine::connection() const {
  const std::lock_guard lock(mutex_);
  return connection_;
}

void ThriftLine::begin() {
  const std::lock_guard lock(mutex_);
  interrupted_ = false;
}

void ThriftLine::interrupt(bool for_good) {
  std::shared_ptr<Connection> connection;
  {
    const std::lock_guard lock(mutex_);
    closed_ = closed_ || for_good;
    interrupted_ = true;
    connection = connection_;
  }
  if (connection != nullptr) connection->stream->shut_down();
}

void ThriftLine::drop() {
  const std::lock_guard lock(mutex_);
  // Somebody may be waiting for it.
  if (connection_ != nullptr) connection_->stream->shut_down();
  connection_.reset();
  owed_.clear();
}

tl::expected<void, CallError> ThriftLine::connected(Deadline deadline) {
  const auto now = steady_clock::now();
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return tl::unexpected(unreachable("the client has been closed"));
  }
  if (connection_ != nullptr) {
    if (owed_.size() >= kLateRepliesMax || now >= gives_up()) {
      // It has not answered for too long; perhaps a new connection gets a thread that does.
      drop();
    } else if (now - idle_since_ > kTrustedIdle) {
      take_late_replies();
    }
  }
  if (connection_ != nullptr) return {};
  if (auto made = connect_anew(deadline); !made) return made;
  return is_settled_ ? tl::expected<void, CallError>() : settle(deadline);
}

tl::expected<void, CallError> ThriftLine::connect_anew(Deadline deadline) {
  const auto now = steady_clock::now();
  if (now < next_attempt_) {
    const auto wait = std::chrono::ceil<milliseconds>(next_attempt_ - now).count();
    return tl::unexpected(unreachable(fmt::format("{}; tried again in {} ms", last_failure_, wait)));
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

// A server of one service takes the name for a part of the method's and says so in its answer, whose name is what was
// asked; one of several takes it away. Either has done nothing.
tl::expected<void, CallError> ThriftLine::settle(Deadline deadline) {
  try {
    write(nobodys(), Map());
    if (auto over = transmit(0, deadline)) return tl::unexpected(std::move(over->error()));
    Connection& c = *connection_;
    c.in.begin_message(deadline);
    const MessageHead head = c.wire->read_head();
    const ReplyBody body = c.wire->read_reply(head.type, nobodys());
    c.wire->end_message();
    const bool is_unknown = body.form == ReplyBody::Form::kFailure && body.failure_type == kUnknownMethod;
    if (is_unknown && head.name == fmt::format("{}:{}", service_, nobodys().name)) service_.clear();
    is_settled_ = true;
    return {};
  } catch (const WireError& e) {
    drop();
    if (e.status == StreamStatus::kLate) return tl::unexpected(late("no reply to " + nobodys().name));
    // Some servers of several services end the connection where they know no method; others may have died just now, so
    // the next connection asks again.
    return connect_anew(deadline);
  }
}

void ThriftLine::write(const idl::Method& method, const Value& arguments) {
  sequence_ = sequence_ == std::numeric_limits<std::int32_t>::max() ? 1 : sequence_ + 1;
  oneway_ = method.oneway;
  connection_->wire->write_call(service_.empty() ? method.name : fmt::format("{}:{}", service_, method.name),
                                method.oneway ? MessageType::kOneway : MessageType::kCall, sequence_, method.arguments,
                                arguments);
}

std::optional<Outcome> ThriftLine::transmit(std::size_t from, Deadline deadline) {
  Connection& c = *connection_;
  const auto [data, size] = c.out.finish();
  const StreamStatus sent = c.stream->send(data + from, size - from, deadline);
  if (sent != StreamStatus::kOk) {
    const std::string why = c.stream->why();
    drop();
    return tl::unexpected(sent == StreamStatus::kLate ? late("it does not take the request") : unreachable(why));
  }
  idle_since_ = steady_clock::now();
  if (oneway_) return Value();
  return std::nullopt;
}

std::optional<Outcome> ThriftLine::send(const idl::Method& method, const Value& arguments, Deadline deadline) {
  if (auto ready = connected(deadline); !ready) return tl::unexpected(std::move(ready.error()));
  try {
    write(method, arguments);
  } catch (const WireError& e) {
    return tl::unexpected(broken(e));
  }
  return transmit(0, deadline);
}

std::shared_ptr<Link> ThriftLine::prepare(const idl::Method& method, const Value& arguments) {
  if (connection_ == nullptr || owed_.size() >= kLateRepliesMax || steady_clock::now() >= gives_up()) return nullptr;
  try {
    write(method, arguments);
  } catch (const WireError&) {
    // Whoever sends it in his own time meets the same and tells.
    drop();
    return nullptr;
  }
  return connection_;
}

std::optional<Outcome> ThriftLine::send_rest(std::size_t sent, Deadline deadline) {
  if (connection_ == nullptr) return tl::unexpected(unreachable("the connection broke while the request was sent"));
  return transmit(sent, deadline);
}

Outcome ThriftLine::exchange(const idl::Method& method, const Value& arguments, Deadline deadline) {
  if (auto over = send(method, arguments, deadline)) return std::move(*over);
  return receive(method, deadline);
}

Outcome ThriftLine::receive(const idl::Method& method, Deadline deadline) {
  if (connection_ == nullptr) return tl::unexpected(unreachable("the connection broke before the reply"));
  Connection& c = *connection_;
  try {
    while (true) {
      c.in.begin_message(deadline);
      try {
        MessageHead head = c.wire->read_head();
        const bool owed =
            std::any_of(owed_.begin(), owed_.end(), [&](const Owed& o) { return o.sequence == head.sequence; });
        if (owed) {
          take_late(head);
          continue;
        }
        // A peer that numbers its replies itself is forgiven as long as there is nothing to confuse.
        if (head.sequence != sequence_ && !owed_.empty()) {
          throw WireError{StreamStatus::kFailed, fmt::format("a reply with the unknown number {}", head.sequence)};
        }
        ReplyBody body = c.wire->read_reply(head.type, method);
        c.wire->end_message();
        idle_since_ = steady_clock::now();
        return outcome_of(method, std::move(body));
      } catch (const WireError& e) {
        if (e.status != StreamStatus::kLate) throw;
        c.in.rewind();
        c.wire->reset();
        owed_.push_back({sequence_, &method, steady_clock::now() + options_.late_wait});
        idle_since_ = {};
        return tl::unexpected(late("no reply to " + method.name));
      }
    }
  } catch (const WireError& e) {
    return tl::unexpected(broken(e));
  }
}

Outcome ThriftLine::outcome_of(const idl::Method& method, ReplyBody body) {
  if (body.form == ReplyBody::Form::kResult) return std::move(body.value);
  if (body.form == ReplyBody::Form::kException) {
    const std::string& name = body.exception->type->structure->name;
    return tl::unexpected(CallError{CallErrorKind::kException,
                                    fmt::format("\"{}\" answered {} with {}", options_.target, method.name, name), name,
                                    std::move(body.value)});
  }
  const std::string why = body.failure_type == kUnknownMethod ? fmt::format(" knows no {}: ", method.name)
                                                              : fmt::format(" failed in {}: ", method.name);
  return tl::unexpected(CallError{CallErrorKind::kProtocol, where() + why + body.failure, {}, {}});
}

void ThriftLine::take_late(const MessageHead& head) {
  const auto found =
      std::find_if(owed_.begin(), owed_.end(), [&](const Owed& o) { return o.sequence == head.sequence; });
  if (found == owed_.end()) throw WireError{StreamStatus::kFailed, "a reply that nobody waits for"};
  Connection& c = *connection_;
  (void)c.wire->read_reply(head.type, *found->method);
  c.wire->end_message();
  owed_.erase(found);
  const std::lock_guard lock(mutex_);
  ++counts_.late_replies;
}

void ThriftLine::take_late_replies() {
  Connection& c = *connection_;
  const Deadline passed{};
  try {
    while (true) {
      if (const auto status = c.in.wait(passed); status != StreamStatus::kOk) {
        if (status != StreamStatus::kLate) drop();
        return;
      }
      c.in.begin_message(passed);
      take_late(c.wire->read_head());
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

}  // namespace sentree::rpc
