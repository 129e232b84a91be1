#pragma once

#include <functional>
#include <string>
#include <utility>

#include "sentree/rpc/call.h"

namespace sentree::rpc {

/// The callee's side: what a component implements, once, for every transport.
class Service {
 public:
  virtual ~Service() = default;

  [[nodiscard]] virtual const idl::Service& interface() const = 0;

  /// `arguments` has the form of `idl::conform_arguments`. The result is checked against the IDL by whoever calls this,
  /// so that a component's slip is an error of the call that names the field. To throw a declared exception, return
  /// `CallError{kException, message, "TypeName", fields}`. An error of another kind reaches the caller as kProtocol.
  /// Called from the threads of callers and of servers, several at once: it must be thread-safe.
  [[nodiscard]] virtual Outcome call(const idl::Method& method, const Value& arguments, const CallContext& context) = 0;
};

/// A service that is one function; for tests and small components.
class FunctionService final : public Service {
 public:
  using Function = std::function<Outcome(const idl::Method&, const Value& arguments, const CallContext&)>;

  FunctionService(idl::ServicePtr interface, Function function)
      : interface_(std::move(interface)), function_(std::move(function)) {}

  [[nodiscard]] const idl::Service& interface() const override { return *interface_; }
  [[nodiscard]] Outcome call(const idl::Method& method, const Value& arguments, const CallContext& context) override {
    return function_(method, arguments, context);
  }

 private:
  idl::ServicePtr interface_;
  Function function_;
};

}  // namespace sentree::rpc
