#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/rpc/stream.h"

/// What comes from a peer. Private to the library.
namespace sentree::yarp {

/// Thrown inside the library where reading cannot go on.
struct Broken {
  rpc::StreamStatus status = rpc::StreamStatus::kFailed;
  std::string why;
};

/// What has been received and not taken yet. Memory grows with what has come, never with what a length promises.
class Inbox {
 public:
  Inbox(rpc::Stream* stream, std::size_t message_bytes_max) : stream_(stream), bytes_max_(message_bytes_max) {}
  /// Of bytes that are there already.
  explicit Inbox(std::string_view bytes);

  /// Waits for at least one byte; a deadline that has passed looks only.
  [[nodiscard]] rpc::StreamStatus wait(rpc::Deadline deadline);
  /// A message begins: its bytes are counted from here, and must come by then.
  void begin(rpc::Deadline deadline);
  /// The next bytes, valid until the next call.
  [[nodiscard]] const std::uint8_t* take(std::size_t bytes);
  [[nodiscard]] const std::uint8_t* peek(std::size_t bytes);
  /// Up to the next '\n', without it and a '\r' before it.
  [[nodiscard]] std::string line(std::size_t bytes_max);
  [[nodiscard]] std::size_t buffered() const { return end_ - begin_; }

  [[nodiscard]] std::int32_t take_int();
  [[nodiscard]] std::uint32_t take_tag() { return static_cast<std::uint32_t>(take_int()); }

  /// Bytes taken so far, and back there: of what is wholly there only (`peek` of all of it).
  [[nodiscard]] std::size_t position() const { return begin_; }
  void seek(std::size_t position) { begin_ = position; }
  /// Nothing beyond that position is taken, until it is lifted.
  void fence(std::size_t position) { fence_ = position; }
  void lift_fence() { fence_ = SIZE_MAX; }

 private:
  void fill(std::size_t bytes);

  rpc::Stream* stream_ = nullptr;
  std::size_t bytes_max_ = SIZE_MAX;
  rpc::Deadline deadline_ = rpc::kNoDeadline;
  std::vector<std::uint8_t> buffer_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  std::size_t start_ = 0;  // of the message
  std::size_t fence_ = SIZE_MAX;
};

void put_int(std::vector<std::uint8_t>& out, std::int32_t value);
void put(std::vector<std::uint8_t>& out, std::string_view bytes);

}  // namespace sentree::yarp
