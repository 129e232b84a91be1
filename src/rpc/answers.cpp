#include "sentree/rpc/detail/answers.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <utility>

#include "sentree/rpc/service.h"

namespace sentree::rpc {

using std::chrono::steady_clock;

// The descriptor is made here, not when it is first needed: what a server holds depends on its connections alone.
Answers::Answers(Connection& connection, std::chrono::milliseconds send_time_max)
    : connection_(&connection), send_time_max_(send_time_max), wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

Answers::~Answers() {
  if (wake_ >= 0) ::close(wake_);
}

StreamStatus Answers::wait() {
  Connection& c = *connection_;
  std::vector<std::uint8_t> rest;
  while (true) {
    bool is_full = false;
    {
      const std::lock_guard lock(mutex_);
      polling_ = false;
      sends_rest_ = false;
      if (!broken_.empty()) throw WireError{StreamStatus::kFailed, broken_};
      rest = std::exchange(rest_, {});
      sends_rest_ = !rest.empty();
      if (rest.empty() && owed_ == 0) break;
      is_full = owed_ >= kAnswersOwedMax;
    }
    if (!rest.empty()) {
      const StreamStatus sent = c.stream->send(rest.data(), rest.size(), steady_clock::now() + send_time_max_);
      if (sent == StreamStatus::kLate) throw WireError{sent, "it does not take its reply"};
      if (sent != StreamStatus::kOk) throw WireError{sent, "it went before its reply"};
      continue;
    }
    if (!is_full) {
      if (const StreamStatus status = c.in.wait({}); status != StreamStatus::kLate) return status;
    }
    if (wake_ < 0) throw WireError{StreamStatus::kFailed, "no descriptor is left for answers that come later"};
    {
      const std::lock_guard lock(mutex_);
      if (!rest_.empty() || !broken_.empty() || owed_ == 0) continue;
      polling_ = true;
    }
    // Without events only the connection's end is told.
    pollfd watched[2] = {{c.stream->descriptor(), static_cast<short>(is_full ? 0 : POLLIN), 0}, {wake_, POLLIN, 0}};
    ::poll(watched, 2, -1);
    std::uint64_t count = 0;
    [[maybe_unused]] const auto got = ::read(wake_, &count, sizeof count);
    if ((watched[0].revents & (POLLHUP | POLLERR)) != 0) return StreamStatus::kClosed;
  }
  return c.in.wait(kNoDeadline);
}

void Answers::owe() {
  const std::lock_guard lock(mutex_);
  ++owed_;
}

void Answers::close() {
  const std::lock_guard lock(mutex_);
  connection_ = nullptr;
}

void Answers::fail(const std::string& method, std::int32_t sequence, const std::string& why, std::int32_t type) {
  const std::lock_guard lock(mutex_);
  connection_->wire->write_failure(method, sequence, why, type);
  dispatch();
}

void Answers::give(const Question& question, Outcome outcome, bool is_last) {
  const std::lock_guard lock(mutex_);
  if (connection_ == nullptr) return;
  const idl::Method& method = *question.method;
  outcome = checked(method, std::move(outcome));
  ReplyBody body;
  if (outcome) {
    body.value = std::move(*outcome);
  } else if (outcome.error().kind == CallErrorKind::kException) {
    body.form = ReplyBody::Form::kException;
    body.exception = declared_exception(method, outcome.error().exception);
    body.value = std::move(outcome.error().data);
  } else {
    body.form = ReplyBody::Form::kFailure;
    body.failure = std::move(outcome.error().message);
    body.failure_type = kInternalError;
  }
  --owed_;
  try {
    connection_->wire->write_reply(method.name, question.sequence, method, body);
    dispatch();
  } catch (const WireError& e) {
    broken_ = e.why;
  }
  wake();
  if (is_last) connection_->stream->shut_down();
}

void Answers::dispatch() {
  const auto [data, size] = connection_->out.finish();
  // In order behind what is left over.
  const std::size_t sent = rest_.empty() && !sends_rest_ ? connection_->stream->send_now(data, size) : 0;
  rest_.insert(rest_.end(), data + sent, data + size);
}

// The reader need not know of an answer that has gone, unless it would read on.
void Answers::wake() {
  const bool matters = !rest_.empty() || !broken_.empty() || owed_ + 1 == kAnswersOwedMax;
  if (!polling_ || !matters || std::this_thread::get_id() == reader_) return;
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(wake_, &one, sizeof one);
}

}  // namespace sentree::rpc
