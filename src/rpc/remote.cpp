#include "sentree/rpc/detail/remote.h"

namespace sentree::rpc {

Remote::Remote(const Address& address, const ClientOptions& options, std::shared_ptr<const TlsContext> tls)
    : line_(address, options, std::move(tls)) {}

Remote::~Remote() { interrupt(true); }

bool Remote::acquire(Deadline deadline) {
  std::unique_lock lock(mutex_);
  const auto free = [&] { return !busy_; };
  if (deadline == kNoDeadline)
    freed_.wait(lock, free);
  else if (!freed_.wait_until(lock, deadline, free))
    return false;
  busy_ = true;
  line_.begin();
  return true;
}

void Remote::release() {
  {
    const std::lock_guard lock(mutex_);
    busy_ = false;
  }
  freed_.notify_one();
}

Outcome Remote::exchange(const idl::Method& method, const Value& arguments, Deadline deadline) {
  if (!acquire(deadline)) return tl::unexpected(line_.late("other calls kept the connection busy"));
  Outcome out = line_.exchange(method, arguments, deadline);
  release();
  return out;
}

}  // namespace sentree::rpc
