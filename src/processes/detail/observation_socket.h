#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/base/result.h"

namespace sentree::processes {

/// Bytes of one observation that goes through such a socket; a larger one has to be handed over by a call.
inline constexpr std::size_t kObservationBytesMax = std::size_t{64} << 10U;

/// Where the processes of one machine leave what they observe: a Unix datagram socket.
///
/// It is one queue for all who send, so the kernel keeps the order in which they did, and with it causality: what a
/// process observed before it called another is in the queue before anything that follows from that call. So nobody
/// needs to wait for an answer. The messages are lines of JSON, as `to_json` writes them.
class ObservationInbox {
 public:
  /// @param take  Given each message in order, in any thread, never two at a time.
  /// @param problem  Told of what cannot be read.
  /// Errors: observer.socket.
  [[nodiscard]] static Result<std::unique_ptr<ObservationInbox>> open(const std::string& path,
                                                                      std::function<void(Message)> take,
                                                                      std::function<void(const std::string&)> problem);
  ~ObservationInbox();
  ObservationInbox(const ObservationInbox&) = delete;
  ObservationInbox& operator=(const ObservationInbox&) = delete;

  /// Hands on everything that has been sent so far. From any thread; whoever is about to publish what may follow from
  /// it calls this first.
  void drain();
  /// Hands on the rest and takes nothing more. Idempotent.
  void close();

 private:
  ObservationInbox(int socket, std::string path, std::function<void(Message)> take,
                   std::function<void(const std::string&)> problem);
  void read();

  const int socket_;
  const std::string path_;
  const std::function<void(Message)> take_;
  const std::function<void(const std::string&)> problem_;
  std::mutex mutex_;  // of whoever reads
  std::vector<char> buffer_;
  bool closed_ = false;
  std::thread reader_;
};

/// The sender's end.
class ObservationOutbox {
 public:
  /// Null if nobody listens there.
  [[nodiscard]] static std::unique_ptr<ObservationOutbox> connect(const std::string& path);
  ~ObservationOutbox();
  ObservationOutbox(const ObservationOutbox&) = delete;
  ObservationOutbox& operator=(const ObservationOutbox&) = delete;

  /// True: it is in the queue. Waits for room, at most a second. From any thread.
  [[nodiscard]] bool send(const Message& message);

 private:
  explicit ObservationOutbox(int socket) : socket_(socket) {}
  const int socket_;
};

/// Beside the Unix socket of an observer.
[[nodiscard]] std::string observation_path(const std::string& observer_path);

}  // namespace sentree::processes
