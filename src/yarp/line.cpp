#include <fmt/format.h>

#include <unistd.h>

#include <algorithm>
#include <utility>

#include "sentree/base/diagnostic.h"
#include "sentree/yarp/detail/bottle.h"
#include "sentree/yarp/detail/frame.h"
#include "sentree/yarp/detail/line.h"

namespace sentree::yarp {
namespace {

using rpc::CallError;
using rpc::CallErrorKind;
using rpc::Outcome;
using rpc::StreamStatus;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

// Asks whether somebody is there. What a port is asked as its tools ask it reaches no owner, whom it could move.
constexpr std::string_view kProbe = "sentree_ping";

}  // namespace

struct PortLine::Connection final : rpc::Link {
  Connection(std::unique_ptr<rpc::Stream> s, std::size_t bytes_max) : Link(std::move(s)), in(stream.get(), bytes_max) {}

  [[nodiscard]] std::pair<const std::uint8_t*, std::size_t> message() override { return {out.data(), out.size()}; }

  Inbox in;
  std::vector<std::uint8_t> out;
};

PortLine::PortLine(PortAddress address, const idl::Service& interface, rpc::ClientOptions options,
                   const idl::Method* data)
    : address_(std::move(address)),
      options_(std::move(options)),
      data_(data),
      encoding_(address_.version, options_.limits),
      names_(address_.server.host.empty() ? configured_name_server() : address_.server) {
  for (const idl::Method* method : interface.methods) {
    if (auto why = cannot_carry(*method)) refused_.emplace(method, std::move(*why));
  }
}

std::string PortLine::where() const {
  std::string address = "yarp:" + address_.name;
  if (options_.target == address) return address;
  return fmt::format("\"{}\" at yarp:{}", options_.target, address_.name);
}

CallError PortLine::unreachable(const std::string& why) const {
  return {CallErrorKind::kUnreachable, fmt::format("{} is unreachable: {}", where(), why), {}, {}};
}

CallError PortLine::late(const std::string& what) const {
  return {CallErrorKind::kLate, fmt::format("{} did not answer in time: {}", where(), what), {}, {}};
}

rpc::Line::Counts PortLine::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

std::shared_ptr<rpc::Link> PortLine::connection() const {
  const std::lock_guard lock(mutex_);
  return connection_;
}

void PortLine::begin() {
  const std::lock_guard lock(mutex_);
  interrupted_ = false;
}

void PortLine::interrupt(bool for_good) {
  const std::lock_guard lock(mutex_);
  closed_ = closed_ || for_good;
  interrupted_ = true;
  if (connection_ != nullptr) connection_->stream->shut_down();
}

void PortLine::drop() {
  const std::lock_guard lock(mutex_);
  // Somebody may be waiting for it.
  if (connection_ != nullptr) connection_->stream->shut_down();
  connection_.reset();
  acknowledgements_owed_ = 0;
}

tl::expected<void, CallError> PortLine::connected(rpc::Deadline deadline) {
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return tl::unexpected(unreachable("the client has been closed"));
  }
  if (connection_ != nullptr) take_late_replies();  // or notices that it is gone
  if (connection_ != nullptr) return {};
  const auto now = steady_clock::now();
  if (now < next_attempt_) {
    const auto wait = std::chrono::ceil<milliseconds>(next_attempt_ - now).count();
    return tl::unexpected(unreachable(fmt::format("{}; tried again in {} ms", last_failure_, wait)));
  }
  if (auto made = connect(deadline); !made) {
    last_failure_ = made.error().message;
    next_attempt_ =
        steady_clock::now() + std::min(options_.backoff_last, rpc::kBackoffFirst * (1 << std::min(failures_, 10)));
    ++failures_;
    made.error().message =
        made.error().kind == CallErrorKind::kLate ? late(last_failure_).message : unreachable(last_failure_).message;
    return made;
  }
  failures_ = 0;
  return {};
}

std::string PortLine::near_port(rpc::Deadline deadline) {
  const auto all = names_.list(deadline);
  std::vector<std::string> known;
  for (const Registration& each : all ? *all : std::vector<Registration>()) known.push_back(each.name);
  return did_you_mean(address_.name, known);
}

// The message of an error says only why.
tl::expected<void, CallError> PortLine::connect(rpc::Deadline deadline) {
  const auto failed = [](StreamStatus status, std::string why) {
    return tl::unexpected(CallError{
        status == StreamStatus::kLate ? CallErrorKind::kLate : CallErrorKind::kUnreachable, std::move(why), {}, {}});
  };
  HostPort at = address_.direct;
  if (at.host.empty()) {
    auto found = names_.query(address_.name, deadline);
    if (!found) return failed(StreamStatus::kFailed, found.error().message);
    if (!*found) {
      if (failures_ == 0) near_ = near_port(deadline);
      return failed(StreamStatus::kFailed, fmt::format("the name server at {} knows no such port{}; yarp name list, or "
                                                       "sentree services --on yarp:, lists those that it knows",
                                                       to_string(names_.server()), near_));
    }
    at = (*found)->at;
  }
  rpc::Address socket;
  socket.kind = rpc::Address::Kind::kTcp;
  socket.host = at.host;
  socket.port = at.port;
  rpc::Connected made = rpc::connect_to(socket, resolver_, nullptr, deadline);
  if (made.stream == nullptr) return failed(made.status, fmt::format("{}: {}", to_string(at), made.why));
  auto connection = std::make_shared<Connection>(std::move(made.stream), options_.limits.message_bytes);
  // Without a slash before it, the name is one of a tool: many connections may have it.
  put_greeting(connection->out, address_.carrier, fmt::format("sentree_{}_{}", options_.target, ::getpid()));
  if (const StreamStatus sent = connection->stream->send(connection->out.data(), connection->out.size(), deadline);
      sent != StreamStatus::kOk)
    return failed(sent, connection->stream->why());
  try {
    connection->in.begin(deadline);
    (void)take_mark(connection->in, "the answer of a port of YARP");
  } catch (const Broken& e) {
    return failed(e.status, fmt::format("no port of YARP that takes {} is at {}: {}", to_string(address_.carrier),
                                        to_string(at), e.why));
  }
  if (connection->in.buffered() > 0)
    return failed(StreamStatus::kFailed, fmt::format("{} answers before it is asked", to_string(at)));
  const std::lock_guard lock(mutex_);
  if (closed_ || interrupted_) return failed(StreamStatus::kFailed, "interrupted while connecting");
  connection_ = std::move(connection);
  acknowledgements_owed_ = 0;
  ++counts_.connections;
  return {};
}

void PortLine::write(const idl::Method& method, const Value& arguments) {
  oneway_ = method.oneway;
  std::vector<std::uint8_t>& out = connection_->out;
  out.clear();
  const bool is_probe = method.name == kProbe;
  const std::size_t begun = begin_frame(out, is_probe ? 'a' : oneway_ ? 'D' : 'd');
  if (is_probe)
    write_bottle(out, {Item::word("ver")}, address_.version);
  else
    encoding_.write_call(out, method, arguments, data_ != &method);
  finish_frame(out, begun);
  // Every message is confirmed on tcp, whatever else it is answered with.
  if (oneway_ && address_.carrier == Carrier::kTcp) ++acknowledgements_owed_;
}

std::optional<Outcome> PortLine::transmit(std::size_t from, rpc::Deadline deadline) {
  rpc::Link& c = *connection_;
  const auto [data, size] = c.message();
  const StreamStatus sent = c.stream->send(data + from, size - from, deadline);
  if (sent != StreamStatus::kOk) {
    const std::string why = c.stream->why();
    drop();
    return tl::unexpected(sent == StreamStatus::kLate ? late("it does not take the request") : unreachable(why));
  }
  if (oneway_) return Value();
  return std::nullopt;
}

std::optional<Outcome> PortLine::send(const idl::Method& method, const Value& arguments, rpc::Deadline deadline) {
  if (const auto refused = refused_.find(&method); refused != refused_.end()) {
    return tl::unexpected(
        CallError{CallErrorKind::kProtocol,
                  fmt::format("{}.{} cannot be called over YARP: {}", method.service, method.name, refused->second),
                  {},
                  {}});
  }
  if (auto ready = connected(deadline); !ready) return tl::unexpected(std::move(ready.error()));
  write(method, arguments);
  return transmit(0, deadline);
}

std::shared_ptr<rpc::Link> PortLine::prepare(const idl::Method& method, const Value& arguments) {
  if (connection_ == nullptr || refused_.contains(&method)) return nullptr;
  write(method, arguments);
  return connection_;
}

std::optional<Outcome> PortLine::send_rest(std::size_t sent, rpc::Deadline deadline) {
  if (connection_ == nullptr) return tl::unexpected(unreachable("the connection broke while the request was sent"));
  return transmit(sent, deadline);
}

Outcome PortLine::receive(const idl::Method& method, rpc::Deadline deadline) {
  if (connection_ == nullptr) return tl::unexpected(unreachable("the connection broke before the reply"));
  Inbox& in = connection_->in;
  const bool confirms = address_.carrier == Carrier::kTcp;
  try {
    in.begin(deadline);
    take_acknowledgements(deadline);
    if (const std::uint8_t* first = in.peek(2); confirms && first[0] == 'Y' && first[1] == 'A') {
      (void)take_mark(in, "an acknowledgement");
      return tl::unexpected(
          CallError{CallErrorKind::kProtocol,
                    fmt::format("{} took {} and gave no reply: it could not read the arguments", where(), method.name),
                    {},
                    {}});
    }
    Outcome out = encoding_.read_reply(in, method);
    if (!out) out.error().message = fmt::format("{}, asked for {}: {}", where(), method.name, out.error().message);
    if (confirms) {
      ++acknowledgements_owed_;
      if (in.buffered() >= kMarkSize) take_acknowledgements(deadline);
    }
    return out;
  } catch (const Broken& e) {
    drop();
    if (e.status == StreamStatus::kLate) return tl::unexpected(late("no reply to " + method.name));
    if (e.status == StreamStatus::kClosed) return tl::unexpected(unreachable(e.why));
    return tl::unexpected(
        CallError{CallErrorKind::kProtocol, fmt::format("{} broke the protocol: {}", where(), e.why), {}, {}});
  }
}

void PortLine::take_acknowledgements(rpc::Deadline deadline) {
  Inbox& in = connection_->in;
  while (acknowledgements_owed_ > 0) {
    in.begin(deadline);
    if (take_mark(in, "an acknowledgement") != kAckMark)
      throw Broken{StreamStatus::kFailed, "what came is no acknowledgement"};
    --acknowledgements_owed_;
  }
}

void PortLine::take_late_replies() {
  Inbox& in = connection_->in;
  const rpc::Deadline passed{};
  try {
    while (true) {
      const StreamStatus status = in.wait(passed);
      if (status == StreamStatus::kLate) return;
      if (status != StreamStatus::kOk) return drop();
      if (acknowledgements_owed_ == 0) return drop();  // it says what nobody asked
      in.begin(passed);
      if (in.buffered() < kMarkSize) {
        // A part of one: the rest is a matter of moments, or of nobody.
        in.begin(steady_clock::now() + milliseconds(100));
      }
      if (take_mark(in, "an acknowledgement") != kAckMark) return drop();
      --acknowledgements_owed_;
    }
  } catch (const Broken&) {
    drop();
  }
}

}  // namespace sentree::yarp
