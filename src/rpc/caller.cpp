#include "sentree/rpc/caller.h"

#include <future>
#include <utility>

#include "sentree/idl/conform.h"

namespace sentree::rpc {

void Caller::call(std::string_view method, Value arguments, Deadline deadline, Done done) {
  const auto found = idl::find_method(interface(), method, interface().name);
  if (!found) return done(tl::unexpected(CallError{CallErrorKind::kArguments, found.error().message, {}, {}}));
  call(**found, std::move(arguments), deadline, std::move(done));
}

const idl::ServicePtr& nobodys_service() {
  static const idl::ServicePtr kNobody =
      idl::Schema::load("service Nobody { void sentree_ping() }", "nobody.thrift").value->service("Nobody");
  return kNobody;
}

Outcome call_and_wait(Caller& caller, std::string_view method, Value arguments, Deadline deadline) {
  std::promise<Outcome> made;
  caller.call(method, std::move(arguments), deadline, [&made](Outcome outcome) { made.set_value(std::move(outcome)); });
  return made.get_future().get();
}

}  // namespace sentree::rpc
