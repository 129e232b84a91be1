#include <fmt/format.h>

#include <cstring>

#include "sentree/yarp/detail/frame.h"

namespace sentree::yarp {
namespace {

// Behind the mark: one block, one block of reply, eight octets of ones, the block's length, the reply's.
constexpr std::size_t kLengthAt = kMarkSize + 10;
constexpr std::size_t kIndexSize = kLengthAt + 8;
constexpr std::size_t kCommandMax = 4096;

}  // namespace

using rpc::StreamStatus;

void put_mark(std::vector<std::uint8_t>& out, std::int32_t number) {
  put(out, "YA");
  put_int(out, number);
  put(out, "RP");
}

std::int32_t take_mark(Inbox& in, std::string_view what) {
  const std::uint8_t* bytes = in.take(kMarkSize);
  if (std::memcmp(bytes, "YA", 2) != 0 || std::memcmp(bytes + 6, "RP", 2) != 0)
    throw Broken{StreamStatus::kFailed, fmt::format("what came is not {}", what)};
  std::int32_t out = 0;
  std::memcpy(&out, bytes + 2, sizeof out);
  return out;
}

std::size_t begin_frame(std::vector<std::uint8_t>& out, char key) {
  // Mark, numbers of blocks, octets of ones, two lengths, the command's length and the command.
  std::uint8_t head[kIndexSize + 8] = {'Y', 'A', kIndexMark, 0, 0, 0, 'R', 'P', 1, 1};
  std::memset(head + kMarkSize + 2, 0xff, 8);
  // What is no data is written as a text behind the command, with its length.
  const bool is_data = key == 'd' || key == 'D';
  const std::uint8_t command[] = {'~', static_cast<std::uint8_t>(is_data ? key : '\0'), 0, 1};
  std::memcpy(head + kIndexSize + 4, command, sizeof command);
  if (!is_data) head[kIndexSize] = 2;
  const std::size_t begun = out.size();
  out.insert(out.end(), std::begin(head), std::end(head));
  if (!is_data) out.insert(out.end(), {static_cast<std::uint8_t>(key), 0});
  return begun;
}

void finish_frame(std::vector<std::uint8_t>& out, std::size_t begun) {
  const auto length = static_cast<std::int32_t>(out.size() - begun - kIndexSize);
  std::memcpy(out.data() + begun + kLengthAt, &length, sizeof length);
}

void put_greeting(std::vector<std::uint8_t>& out, Carrier carrier, std::string_view name) {
  put_mark(out, carrier == Carrier::kTcp ? kTcpMark : kFastTcpMark);
  put_int(out, static_cast<std::int32_t>(name.size() + 1));
  put(out, name);
  out.push_back(0);
}

Frame take_frame(Inbox& in, std::size_t bytes_max) {
  if (take_mark(in, "the head of a message") != kIndexMark)
    throw Broken{StreamStatus::kFailed, "what came is not the head of a message"};
  const std::uint8_t* counts = in.take(10);
  const int blocks = counts[0];
  const int reply_blocks = counts[1];
  std::size_t bytes = 0;
  for (int i = 0; i < blocks; ++i) {
    const std::int32_t length = in.take_int();
    if (length < 0 || static_cast<std::size_t>(length) > bytes_max - bytes)
      throw Broken{StreamStatus::kFailed, fmt::format("a message says that it has more than {} bytes", bytes_max)};
    bytes += static_cast<std::size_t>(length);
  }
  (void)in.take(4 * static_cast<std::size_t>(reply_blocks));
  if (bytes < 8) throw Broken{StreamStatus::kFailed, "a message has no command"};
  const std::int32_t size = in.take_int();
  const std::uint8_t* head = in.take(4);
  if (head[0] != '~') throw Broken{StreamStatus::kFailed, "a message has no command"};
  Frame out;
  out.key = static_cast<char>(head[1]);
  bytes -= 8;
  if (out.key == '\0') {
    if (size < 0 || static_cast<std::size_t>(size) > bytes || static_cast<std::size_t>(size) > kCommandMax)
      throw Broken{StreamStatus::kFailed, "a command says that it is longer than its message"};
    const auto length = static_cast<std::size_t>(size);
    out.command.assign(reinterpret_cast<const char*>(in.take(length)), length);
    out.command.resize(std::min(out.command.find('\0'), out.command.size()));
    bytes -= length;
  }
  out.payload = bytes;
  return out;
}

}  // namespace sentree::yarp
