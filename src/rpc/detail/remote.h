#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>

#include "sentree/rpc/detail/thrift_line.h"

/// A line that the threads of several callers share, one call after the other. Private to the library.
namespace sentree::rpc {

class Remote {
 public:
  Remote(const Address& address, const ClientOptions& options, std::shared_ptr<const TlsContext> tls);
  ~Remote();
  Remote(const Remote&) = delete;
  Remote& operator=(const Remote&) = delete;

  /// Sends and waits for the reply; `arguments` conform.
  [[nodiscard]] Outcome exchange(const idl::Method& method, const Value& arguments, Deadline deadline);
  void interrupt(bool for_good) { line_.interrupt(for_good); }
  [[nodiscard]] ThriftLine::Counts counts() const { return line_.counts(); }

 private:
  // Being the one who may use the line; others wait, but not beyond their deadline.
  [[nodiscard]] bool acquire(Deadline deadline);
  void release();

  ThriftLine line_;
  std::mutex mutex_;
  std::condition_variable freed_;
  bool busy_ = false;
};

}  // namespace sentree::rpc
