#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "sentree/rpc/detail/wire.h"

namespace sentree::rpc {
namespace {

constexpr std::size_t kBufferFirst = 4096;

std::shared_ptr<apache::thrift::TConfiguration> configuration(const Limits& limits) {
  const int bytes = static_cast<int>(std::min<std::size_t>(limits.message_bytes, 0x7fffffff));
  return std::make_shared<apache::thrift::TConfiguration>(bytes, bytes, limits.nesting);
}

}  // namespace

Inbox::Inbox(Stream* stream, const Limits& limits)
    : TBufferBase(configuration(limits)),
      stream_(stream),
      message_bytes_max_(limits.message_bytes),
      buffer_(kBufferFirst) {
  set_bounds(0);
}

void Inbox::set_bounds(std::size_t position) {
  rBase_ = buffer_.data() + position;
  rBound_ = buffer_.data() + (frame_end_ != 0 ? frame_end_ : end_);
}

StreamStatus Inbox::wait(Deadline deadline) {
  if (end_ > begin_) return StreamStatus::kOk;
  deadline_ = deadline;
  make_room();
  return receive();
}

void Inbox::begin_message(Deadline deadline) {
  resetConsumedMessageSize();
  deadline_ = deadline;
  set_bounds(begin_);
}

void Inbox::end_message() {
  begin_ = frame_end_ != 0 ? frame_end_ : position();
  frame_end_ = 0;
  if (begin_ == end_) {
    begin_ = end_ = 0;
    // One large message must not hold its memory for the life of the connection.
    if (buffer_.size() > kBufferFirst * 64) {
      buffer_.resize(kBufferFirst);
      buffer_.shrink_to_fit();
    }
  }
  set_bounds(begin_);
}

void Inbox::rewind() {
  frame_end_ = 0;
  set_bounds(begin_);
}

bool Inbox::frame_used_up() const { return frame_end_ == 0 || rBase_ == rBound_; }

// For at least one more byte behind those that are there.
void Inbox::make_room() {
  const std::size_t at = position();
  if (begin_ > 0 && end_ == buffer_.size()) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    set_bounds(at - begin_);
    begin_ = 0;
  }
  if (end_ == buffer_.size()) {
    const std::size_t position_now = position();
    buffer_.resize(buffer_.size() * 2);
    set_bounds(position_now);
  }
}

StreamStatus Inbox::receive() {
  const Received got = stream_->receive(buffer_.data() + end_, buffer_.size() - end_, deadline_);
  if (got.status != StreamStatus::kOk) return got.status;
  end_ += got.bytes;
  rBound_ = buffer_.data() + end_;
  return StreamStatus::kOk;
}

void Inbox::fetch() {
  if (frame_end_ != 0) throw WireError{StreamStatus::kFailed, "the message goes beyond its frame"};
  if (end_ - begin_ >= message_bytes_max_) {
    throw WireError{StreamStatus::kFailed, fmt::format("the message has more than {} bytes", message_bytes_max_)};
  }
  make_room();
  if (const StreamStatus status = receive(); status != StreamStatus::kOk) {
    const bool half = end_ > begin_;
    throw WireError{status, status == StreamStatus::kLate ? "the time is up"
                            : half                        ? "the connection ended within a message"
                                                          : stream_->why()};
  }
}

std::uint32_t Inbox::readSlow(std::uint8_t* out, std::uint32_t size) {
  // A declared length is believed only as far as bytes arrive; the caller's buffer is bounded by the string limit.
  while (static_cast<std::size_t>(rBound_ - rBase_) < size) fetch();
  std::memcpy(out, rBase_, size);
  rBase_ += size;
  return size;
}

const std::uint8_t* Inbox::borrowSlow(std::uint8_t* out, std::uint32_t* size) {
  // With a buffer of its own the compact protocol only looks ahead, perhaps beyond the last byte there will be.
  if (out != nullptr) return nullptr;
  // Strings are copied out of the buffer instead of twice: once they are here, Thrift takes them in place.
  while (static_cast<std::size_t>(rBound_ - rBase_) < *size) fetch();
  *size = static_cast<std::uint32_t>(rBound_ - rBase_);
  return rBase_;
}

void Inbox::writeSlow(const std::uint8_t*, std::uint32_t) {
  throw WireError{StreamStatus::kFailed, "an inbox is only read"};
}

const std::uint8_t* Inbox::peek(std::size_t bytes) {
  while (static_cast<std::size_t>(rBound_ - rBase_) < bytes) fetch();
  return rBase_;
}

void Inbox::open_frame() {
  const std::uint8_t* head = peek(4);
  const std::size_t length =
      (std::size_t{head[0]} << 24U) | (std::size_t{head[1]} << 16U) | (std::size_t{head[2]} << 8U) | head[3];
  if (length == 0 || length > message_bytes_max_ - std::min<std::size_t>(message_bytes_max_, 4)) {
    throw WireError{StreamStatus::kFailed,
                    fmt::format("a frame of {} bytes; the bound is {}", length, message_bytes_max_)};
  }
  (void)peek(4 + length);
  rBase_ += 4;
  frame_end_ = position() + length;
  rBound_ = buffer_.data() + frame_end_;
}

Outbox::Outbox() : buffer_(kBufferFirst) {}

void Outbox::begin_message(bool framed) {
  framed_ = framed;
  if (buffer_.size() > kBufferFirst * 64) {
    buffer_.resize(kBufferFirst);
    buffer_.shrink_to_fit();
  }
  setWriteBuffer(buffer_.data(), static_cast<std::uint32_t>(buffer_.size()));
  if (framed) wBase_ += 4;
}

std::pair<const std::uint8_t*, std::size_t> Outbox::finish() {
  const auto size = static_cast<std::size_t>(wBase_ - buffer_.data());
  if (framed_) {
    const std::size_t body = size - 4;
    for (std::size_t i = 0; i < 4; ++i) buffer_[i] = static_cast<std::uint8_t>(body >> (24 - 8 * i));
  }
  return {buffer_.data(), size};
}

void Outbox::writeSlow(const std::uint8_t* data, std::uint32_t size) {
  const auto used = static_cast<std::size_t>(wBase_ - buffer_.data());
  buffer_.resize(std::max(buffer_.size() * 2, used + size));
  wBase_ = buffer_.data() + used;
  wBound_ = buffer_.data() + buffer_.size();
  std::memcpy(wBase_, data, size);
  wBase_ += size;
}

std::uint32_t Outbox::readSlow(std::uint8_t*, std::uint32_t) {
  throw WireError{StreamStatus::kFailed, "an outbox is only written"};
}
const std::uint8_t* Outbox::borrowSlow(std::uint8_t*, std::uint32_t*) { return nullptr; }

}  // namespace sentree::rpc
