#pragma once

#include <cstddef>
#include <optional>
#include <zmq.hpp>

#include "sentree/groot/groot2.h"

namespace sentree::groot {

/// A message that waits, its first `max` parts; nothing: none waits.
inline std::optional<Parts> receive_now(zmq::socket_t& socket, std::size_t max) {
  Parts parts;
  zmq::message_t part;
  bool more = true;
  // ZeroMQ hands out messages whole: behind a part with more to come, the next one is there.
  while (more) {
    if (!socket.recv(part, zmq::recv_flags::dontwait)) return std::nullopt;
    if (parts.size() < max) parts.push_back(part.to_string());
    more = part.more();
  }
  return parts;
}

inline void send_now(zmq::socket_t& socket, const Parts& parts) {
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const auto more = i + 1 < parts.size() ? zmq::send_flags::sndmore : zmq::send_flags::none;
    (void)socket.send(zmq::buffer(parts[i]), more | zmq::send_flags::dontwait);
  }
}

}  // namespace sentree::groot
