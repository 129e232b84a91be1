#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "sentree/rpc/stream.h"
#include "sentree/yarp/address.h"
#include "sentree/yarp/detail/inbox.h"

/// A connection from one of our ports. Private to the library.
namespace sentree::yarp {

using Octets = std::shared_ptr<const std::vector<std::uint8_t>>;

class Output {
 public:
  /// Connects and greets. Error: yarp.connect.
  [[nodiscard]] static Result<std::unique_ptr<Output>> open(const std::string& from, const std::string& to,
                                                            const HostPort& at, Carrier carrier);
  ~Output();
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  [[nodiscard]] const std::string& to() const { return to_; }
  [[nodiscard]] Carrier carrier() const { return carrier_; }
  /// True: the peer has gone.
  [[nodiscard]] bool is_over() const { return over_.load(); }
  /// Returns the number of messages that had to go for it.
  [[nodiscard]] std::size_t put(Octets message);

 private:
  Output(std::string to, Carrier carrier, std::unique_ptr<rpc::Stream> stream);
  void run();

  const std::string to_;
  const Carrier carrier_;
  const std::unique_ptr<rpc::Stream> stream_;
  Inbox in_;
  std::atomic<bool> over_{false};
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Octets> waiting_;
  bool closing_ = false;
  std::thread thread_;
};

/// A socket to there. Error: yarp.connect.
[[nodiscard]] Result<std::unique_ptr<rpc::Stream>> connect_socket(const HostPort& at, rpc::Deadline deadline);

}  // namespace sentree::yarp
