#include "sentree/processes/detail/memory_client.h"

#include <utility>

#include "sentree/processes/environment.h"
#include "sentree/processes/wire_message.h"
#include "sentree/rpc/client.h"
#include "sentree/rpc/middleware.h"

namespace sentree::processes {

using runtime::ToldMemory;

void MemoryClient::ask(Value arguments, Told told) {
  rpc::Caller* const asked = client();
  if (asked == nullptr) return told({ToldMemory::Kind::kNever, {}});
  asked->call("remember", std::move(arguments), std::chrono::steady_clock::now() + kMemoryPatience,
              [this, told = std::move(told)](const rpc::Outcome& reply) {
                bool knows = false;
                {
                  const std::lock_guard lock(mutex_);
                  has_told_ = has_told_ || reply;
                  knows = has_told_;
                }
                if (reply) {
                  const std::string_view octets = text_in(&*reply);
                  const auto kind = octets.empty() ? ToldMemory::Kind::kNotNow : ToldMemory::Kind::kTold;
                  return told({kind, std::string(octets)});
                }
                const bool is_absent = reply.error().kind == rpc::CallErrorKind::kUnreachable ||
                                       (knows && reply.error().kind == rpc::CallErrorKind::kLate);
                if (!is_absent) give_up();
                told({is_absent ? ToldMemory::Kind::kNotNow : ToldMemory::Kind::kNever, {}});
              });
}

void MemoryClient::close() {
  std::unique_lock lock(mutex_);
  is_over_ = true;
  lock.unlock();
  if (client_) client_->end();
}

// What other middlewares than Thrift serve is fixed beforehand.
rpc::Caller* MemoryClient::client() {
  const std::lock_guard lock(mutex_);
  if (is_over_ || address_.kind == rpc::Address::Kind::kOther) return nullptr;
  if (!client_) {
    rpc::ClientOptions options;
    options.service = service_;
    options.tls = environment_tls();
    if (auto connected = rpc::connect(address_, interface_, std::move(options))) client_ = std::move(*connected);
    is_over_ = client_ == nullptr;
  }
  return client_.get();
}

void MemoryClient::give_up() {
  {
    const std::lock_guard lock(mutex_);
    is_over_ = true;
  }
  client_->close();
}

}  // namespace sentree::processes
