#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "sentree/base/value.h"
#include "sentree/idl/schema.h"
#include "sentree/rpc/address.h"
#include "sentree/rpc/caller.h"
#include "sentree/runtime/elsewhere.h"

namespace sentree::processes {

/// What a part may take to say what it remembers [wall time].
inline constexpr std::chrono::milliseconds kMemoryPatience{500};

/// Asks one part of a run in another process what it remembers, over a connection of its own. Thread-safe.
///
/// A part that does not know the question, or has not answered the first one in time, is not asked again, and the
/// connection is closed: one that serves a single connection at a time has to have it for its ticks.
class MemoryClient {
 public:
  using Told = std::function<void(runtime::ToldMemory)>;
  /// @param interface  With a method `remember`.
  /// @param service    By which it is asked for where several share the address.
  MemoryClient(rpc::Address address, idl::ServicePtr interface, std::string service = {})
      : address_(std::move(address)), interface_(std::move(interface)), service_(std::move(service)) {}

  /// `told` is called once, within `kMemoryPatience`, from any thread.
  void ask(Value arguments, Told told);
  /// Once this returns, nobody is told anything any more. Nothing is asked then.
  void close();

 private:
  [[nodiscard]] rpc::Caller* client();
  void give_up();

  const rpc::Address address_;
  const idl::ServicePtr interface_;
  const std::string service_;
  std::mutex mutex_;
  bool is_over_ = false;
  bool has_told_ = false;
  std::unique_ptr<rpc::Caller> client_;  // last: its thread uses the others
};

}  // namespace sentree::processes
