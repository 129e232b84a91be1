#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "sentree/rpc/call.h"

namespace sentree::rpc {

/// The answer that a service owes its caller. Copies are the same one: it is given once, from any thread, and what
/// comes after is ignored. If all copies go without an answer, the caller gets kProtocol.
class Reply {
 public:
  using Send = std::function<void(Outcome, bool is_last)>;
  explicit Reply(Send send) : owed_(std::make_shared<Owed>(std::move(send))) {}

  void give(Outcome outcome) const { owed_->give(std::move(outcome), false); }
  /// And closes the connection behind it: for a service whose thread, and with it the connection's, may not come back.
  void give_last(Outcome outcome) const { owed_->give(std::move(outcome), true); }

 private:
  class Owed {
   public:
    explicit Owed(Send send) : send_(std::move(send)) {}
    ~Owed();
    Owed(const Owed&) = delete;
    Owed& operator=(const Owed&) = delete;
    void give(Outcome outcome, bool is_last);

   private:
    std::atomic<bool> given_ = false;
    Send send_;
  };
  std::shared_ptr<Owed> owed_;
};

/// The callee's side: what a component implements, once, for every transport.
class Service {
 public:
  virtual ~Service() = default;

  [[nodiscard]] virtual const idl::Service& interface() const = 0;

  /// `arguments` has the form of `idl::conform_arguments`. The result is checked against the IDL by whoever calls this,
  /// so that a component's slip is an error of the call that names the field. To throw a declared exception, return
  /// `CallError{kException, message, "TypeName", fields}`. An error of another kind reaches the caller as kProtocol.
  /// Called from the threads of callers and of servers, several at once: it must be thread-safe.
  [[nodiscard]] virtual Outcome call(const idl::Method& method, const Value& arguments) = 0;

  /// The same for a service that may answer after it has returned, so that no thread has to wait for the answer
  /// meanwhile: servers ask this, local clients ask `call`. Of the references only `reply` may be kept, as a copy.
  virtual void serve(const idl::Method& method, const Value& arguments, const Reply& reply) {
    reply.give(call(method, arguments));
  }
};

/// What a service's answer means for its caller, checked against the IDL: a result brought into form, a declared
/// exception with its fields; everything else becomes kProtocol with a message that names the method.
[[nodiscard]] Outcome checked(const idl::Method& method, Outcome outcome);

/// A service that is one function; for tests and small components.
class FunctionService final : public Service {
 public:
  using Function = std::function<Outcome(const idl::Method&, const Value& arguments)>;

  FunctionService(idl::ServicePtr interface, Function function)
      : interface_(std::move(interface)), function_(std::move(function)) {}

  [[nodiscard]] const idl::Service& interface() const override { return *interface_; }
  [[nodiscard]] Outcome call(const idl::Method& method, const Value& arguments) override {
    return function_(method, arguments);
  }

 private:
  idl::ServicePtr interface_;
  Function function_;
};

}  // namespace sentree::rpc
