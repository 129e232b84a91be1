#include "sentree/processes/remote_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>

#include "sentree/base/json.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/idl/conform.h"
#include "sentree/rpc/server.h"

namespace sentree::processes {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr const char* kInterface = R"(
enum Colour { RED, BLUE }
exception Worn { 1: string why, 2: Colour colour }
service Tool { i32 turn(1: i32 by) throws (1: Worn worn)  i32 turns() }
)";

idl::ServicePtr interface() { return *idl::find_service(*idl::Schema::load(kInterface, "tool.thrift").value, "Tool"); }

// Answers `turn`; knows nothing else.
class Tool final : public rpc::Service {
 public:
  [[nodiscard]] const idl::Service& interface() const override { return *interface_; }
  [[nodiscard]] rpc::Outcome call(const idl::Method&, const Value& arguments) override {
    const std::int64_t by = *arguments.find("by")->as_int();
    if (by <= 9) return Value(by * 2);
    return tl::unexpected(
        rpc::CallError{rpc::CallErrorKind::kException, "", "Worn", Map{{"why", "too far"}, {"colour", "BLUE"}}});
  }

 private:
  static idl::ServicePtr known() {
    const auto schema = idl::Schema::load(
        "enum Colour { RED, BLUE } exception Worn { 1: string why, 2: Colour colour }"
        "service Tool { i32 turn(1: i32 by) throws (1: Worn worn) }",
        "tool.thrift");
    return *idl::find_service(*schema.value, "Tool");
  }
  const idl::ServicePtr interface_ = known();
};

class RemoteService : public testing::Test {
 protected:
  explicit RemoteService(const char* name = "tool")
      : address_(*rpc::Address::parse("unix:" + (folder_.path() / "socket").string())),
        server_(*rpc::Server::start(address_, {{name, std::make_shared<Tool>()}})),
        port_(*make_remote_port(address_, interface(), "tool", 10s)) {}

  mission::CallOutcome call(const std::string& method, Value args) {
    const idl::ServicePtr of = interface();
    std::promise<mission::CallOutcome> told;
    port_->call(*of->find(method), std::move(args), [&](mission::CallOutcome outcome) { told.set_value(outcome); });
    return told.get_future().get();
  }

  TemporaryFolder folder_{"sentree-remote"};
  const rpc::Address address_;
  const std::unique_ptr<rpc::Server> server_;
  const std::unique_ptr<runtime::ServicePort> port_;
};

TEST_F(RemoteService, IsAskedByItsName) {
  for (int i = 1; i < 4; ++i) EXPECT_EQ(to_json(call("turn", Map{{"by", i}}).result), std::to_string(2 * i));
  EXPECT_EQ(to_json(call_once(address_, interface(), "tool", "turn", Map{{"by", 4}}, 10s).result), "8");
}

TEST_F(RemoteService, ThatKnowsNoSuchMethodIsAskedForOthers) {
  for (int i = 0; i < 2; ++i) {
    const auto outcome = call("turns", Map());
    EXPECT_EQ(outcome.kind_word(), "protocol");
    EXPECT_THAT(outcome.message, HasSubstr("knows no turns"));
  }
  EXPECT_EQ(to_json(call("turn", Map{{"by", 1}}).result), "2");
}

TEST_F(RemoteService, SaysWhatAnExceptionHolds) {
  const auto outcome = call("turn", Map{{"by", 10}});
  EXPECT_EQ(outcome.kind_word(), "exception");
  EXPECT_EQ(to_json(outcome.result), R"({"Worn":{"why":"too far","colour":"BLUE"}})");
}

// Another service of the same interface is not the one that was meant.
class OtherService : public RemoteService {
 protected:
  OtherService() : RemoteService("trolley") {}
};
TEST_F(OtherService, IsNotTakenForTheOneThatIsAskedFor) {
  for (int i = 0; i < 2; ++i) {
    const auto outcome = call("turn", Map{{"by", 1}});
    EXPECT_FALSE(outcome.ok);
    EXPECT_THAT(outcome.message, HasSubstr("there is no service for \"tool:turn\" here; there is \"trolley\""));
  }
}

}  // namespace
}  // namespace sentree::processes
