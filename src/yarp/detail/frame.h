#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/yarp/address.h"
#include "sentree/yarp/detail/inbox.h"

/// What surrounds a payload on tcp and fast_tcp. Private to the library.
namespace sentree::yarp {

/// Octets of "YA", a number, "RP".
inline constexpr std::size_t kMarkSize = 8;
inline constexpr std::int32_t kTcpMark = 7777 + 3 + 128;
inline constexpr std::int32_t kFastTcpMark = 7777 + 3;
inline constexpr std::int32_t kIndexMark = 10;
inline constexpr std::int32_t kAckMark = 0;

/// What is told to who speaks another carrier.
inline constexpr std::string_view kNotFound =
    "* Error. Protocol not found.\r\n* Hello. You appear to be trying to communicate with a YARP Port.\r\n";

void put_mark(std::vector<std::uint8_t>& out, std::int32_t number);
/// Throws Broken where there is none; `what` was to come.
[[nodiscard]] std::int32_t take_mark(Inbox& in, std::string_view what);

/// The head of a message of one block: 'd' data that are answered, 'D' others, 'a' administration, 'q' the end.
/// `finish_frame` fills in its length once the payload stands behind it.
[[nodiscard]] std::size_t begin_frame(std::vector<std::uint8_t>& out, char key);
void finish_frame(std::vector<std::uint8_t>& out, std::size_t begun);

/// The greeting of a sender.
void put_greeting(std::vector<std::uint8_t>& out, Carrier carrier, std::string_view name);

/// A message up to its payload.
struct Frame {
  char key = 0;  ///< 'd', 'D'; 0: `command` has more.
  std::string command;
  std::size_t payload = 0;  ///< Bytes.
};
[[nodiscard]] Frame take_frame(Inbox& in, std::size_t bytes_max);

}  // namespace sentree::yarp
