#include "sentree/rpc/detail/remote.h"

#include <poll.h>

#include <system_error>

namespace sentree::rpc {

using std::chrono::steady_clock;

Remote::Remote(const Address& address, std::string target, const ClientOptions& options,
               std::shared_ptr<const TlsContext> tls)
    : line_(address, std::move(target), options, std::move(tls)), late_wait_(options.late_wait) {}

Remote::~Remote() {
  interrupt(true);
  if (collector_thread_.joinable()) collector_thread_.join();
}

bool Remote::acquire(Deadline deadline) {
  std::unique_lock lock(mutex_);
  if (busy_) {
    ++waiting_;
    const auto free = [&] { return !busy_; };
    const bool got =
        deadline == kNoDeadline ? (freed_.wait(lock, free), true) : freed_.wait_until(lock, deadline, free);
    --waiting_;
    if (!got) return false;
  }
  busy_ = true;
  line_.begin();
  return true;
}

void Remote::release() {
  bool wake_caller = false;
  bool wake_collector = false;
  {
    const std::lock_guard lock(mutex_);
    busy_ = false;
    owes_ = line_.owes();
    wake_caller = waiting_ > 0;
    wake_collector = owes_;
  }
  if (wake_caller) freed_.notify_one();
  if (wake_collector) collector_.notify_one();
}

void Remote::interrupt(bool for_good) {
  {
    const std::lock_guard lock(mutex_);
    closed_ = closed_ || for_good;
    line_.interrupt(for_good);
  }
  collector_.notify_all();
}

Outcome Remote::exchange(const idl::Method& method, const Value& arguments, const CallContext& context) {
  if (!acquire(context.deadline)) return tl::unexpected(line_.late("other calls kept the connection busy"));
  Outcome out = line_.exchange(method, arguments, context);
  const bool owes = line_.owes();
  release();
  if (owes) start_collector();
  return out;
}

// The collector waits for late replies between calls, so that they are reported when they come and not with the next
// call. It is started by the first late call: most clients never need it.
void Remote::start_collector() {
  const std::lock_guard lock(mutex_);
  if (collecting_ || closed_) return;
  try {
    collector_thread_ = std::thread([this] { collect(); });
    collecting_ = true;
  } catch (const std::system_error&) {
    // Without it late replies are reported with the next call.
  }
}

void Remote::collect() {
  while (true) {
    std::shared_ptr<Connection> connection;
    {
      std::unique_lock lock(mutex_);
      collector_.wait(lock, [&] { return closed_ || (!busy_ && owes_); });
      if (closed_) return;
      connection = line_.connection();
      if (connection == nullptr) {
        owes_ = false;
        continue;
      }
    }
    // Whoever is done with the connection shuts it down, which ends the wait.
    pollfd watched{connection->stream->descriptor(), POLLIN, 0};
    ::poll(&watched, 1, static_cast<int>(late_wait_.count()));
    {
      const std::lock_guard lock(mutex_);
      if (closed_) return;
      if (busy_ || line_.connection() != connection) continue;
      busy_ = true;
    }
    if (watched.revents != 0) line_.take_late_replies();
    if (steady_clock::now() >= line_.gives_up()) line_.drop();
    release();
  }
}

}  // namespace sentree::rpc
