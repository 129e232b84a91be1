#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "sentree/rpc/detail/line.h"

/// A line that the threads of several callers share, one call after the other. Private to the library.
namespace sentree::rpc {

class Remote {
 public:
  Remote(const Address& address, std::string target, const ClientOptions& options,
         std::shared_ptr<const TlsContext> tls);
  ~Remote();
  Remote(const Remote&) = delete;
  Remote& operator=(const Remote&) = delete;

  /// Sends and waits for the reply; `arguments` conform.
  [[nodiscard]] Outcome exchange(const idl::Method& method, const Value& arguments, const CallContext& context);
  void interrupt(bool for_good);
  [[nodiscard]] Line::Counts counts() const { return line_.counts(); }

 private:
  // Being the one who may use the line; others wait, but not beyond their deadline.
  [[nodiscard]] bool acquire(Deadline deadline);
  void release();

  void start_collector();
  void collect();

  Line line_;
  const std::chrono::milliseconds late_wait_;

  std::mutex mutex_;
  std::condition_variable freed_;      // waited for by callers
  std::condition_variable collector_;  // waited for by the collector
  bool busy_ = false;
  int waiting_ = 0;
  bool closed_ = false;
  bool owes_ = false;  // as the line was left
  bool collecting_ = false;

  std::thread collector_thread_;
};

}  // namespace sentree::rpc
