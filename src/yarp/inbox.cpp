#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "sentree/yarp/detail/inbox.h"

namespace sentree::yarp {
namespace {

constexpr std::size_t kChunk = 16384;

}  // namespace

using rpc::StreamStatus;

Inbox::Inbox(std::string_view bytes) : buffer_(bytes.begin(), bytes.end()), end_(bytes.size()) {}

StreamStatus Inbox::wait(rpc::Deadline deadline) {
  if (begin_ < end_) return StreamStatus::kOk;
  begin_ = end_ = start_ = 0;
  if (buffer_.size() < kChunk) buffer_.resize(kChunk);
  const rpc::Received got = stream_->receive(buffer_.data(), buffer_.size(), deadline);
  end_ += got.bytes;
  return got.status;
}

void Inbox::begin(rpc::Deadline deadline) {
  if (begin_ == end_) begin_ = end_ = 0;
  start_ = begin_;
  deadline_ = deadline;
}

const std::uint8_t* Inbox::peek(std::size_t bytes) {
  if (bytes > fence_ || begin_ > fence_ - bytes)
    throw Broken{StreamStatus::kFailed, "a message ends before its content"};
  if (end_ - begin_ < bytes) fill(bytes);
  return buffer_.data() + begin_;
}

const std::uint8_t* Inbox::take(std::size_t bytes) {
  const std::uint8_t* out = peek(bytes);
  begin_ += bytes;
  return out;
}

std::int32_t Inbox::take_int() {
  std::int32_t out = 0;
  std::memcpy(&out, take(sizeof out), sizeof out);
  return out;
}

void Inbox::fill(std::size_t bytes) {
  if (stream_ == nullptr) throw Broken{StreamStatus::kFailed, "a message ends before its content"};
  if (bytes > bytes_max_ || begin_ - start_ > bytes_max_ - bytes)
    throw Broken{StreamStatus::kFailed, fmt::format("a message has more than {} bytes", bytes_max_)};
  while (end_ - begin_ < bytes) {
    if (end_ == buffer_.size() || buffer_.size() < kChunk) {
      if (begin_ > 0) {
        std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
        // Before what is kept of the message lie its bytes that have been taken.
        start_ -= begin_;
        end_ -= begin_;
        begin_ = 0;
      }
      if (end_ + kChunk > buffer_.size()) buffer_.resize(std::max(buffer_.size() * 2, kChunk));
    }
    const rpc::Received got = stream_->receive(buffer_.data() + end_, buffer_.size() - end_, deadline_);
    if (got.status == StreamStatus::kLate) throw Broken{got.status, "the rest of a message did not come in time"};
    if (got.status == StreamStatus::kClosed) throw Broken{got.status, "the peer closed the connection"};
    if (got.status != StreamStatus::kOk) throw Broken{got.status, stream_->why()};
    end_ += got.bytes;
  }
}

std::string Inbox::line(std::size_t bytes_max) {
  std::size_t length = 0;
  while (true) {
    if (length == bytes_max)
      throw Broken{StreamStatus::kFailed, fmt::format("a line has more than {} bytes", bytes_max)};
    const std::uint8_t* bytes = peek(length + 1);
    // All that has come already is looked at in one go.
    const std::size_t there = std::min(end_ - begin_, bytes_max);
    const auto* const found = static_cast<const std::uint8_t*>(std::memchr(bytes + length, '\n', there - length));
    if (found == nullptr) {
      length = there;
      continue;
    }
    std::string out(reinterpret_cast<const char*>(bytes), static_cast<std::size_t>(found - bytes));
    begin_ += out.size() + 1;
    if (out.ends_with('\r')) out.pop_back();
    return out;
  }
}

void put_int(std::vector<std::uint8_t>& out, std::int32_t value) {
  std::uint8_t octets[sizeof value];
  std::memcpy(octets, &value, sizeof value);
  out.insert(out.end(), octets, octets + sizeof value);
}

void put(std::vector<std::uint8_t>& out, std::string_view bytes) { out.insert(out.end(), bytes.begin(), bytes.end()); }

}  // namespace sentree::yarp
