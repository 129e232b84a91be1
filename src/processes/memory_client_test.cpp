#include "sentree/processes/detail/memory_client.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <string>

#include "sentree/base/temporary_folder.h"
#include "sentree/processes/remote_skill.h"
#include "sentree/processes/wire_message.h"
#include "sentree/rpc/server.h"

namespace sentree::processes {
namespace {

using runtime::ToldMemory;
using Kind = ToldMemory::Kind;

class Memory : public testing::Test {
 protected:
  // A part that answers so, or not at all.
  std::unique_ptr<rpc::Server> serve(idl::ServicePtr interface, std::function<rpc::Outcome()> answer) {
    auto server = rpc::Server::start(
        address_,
        {{"skill", std::make_shared<rpc::FunctionService>(
                       std::move(interface), [this, answer = std::move(answer)](const idl::Method&, const Value&) {
                         ++asked_;
                         return answer();
                       })}});
    EXPECT_TRUE(server) << server.error().message;
    return std::move(*server);
  }
  ToldMemory ask() { return ask(client_); }
  static ToldMemory ask(MemoryClient& client) {
    std::promise<ToldMemory> told;
    client.ask(Map{{"leaf", "L"}}, [&](ToldMemory memory) { told.set_value(std::move(memory)); });
    return told.get_future().get();
  }

  const TemporaryFolder folder_{"memory"};
  const rpc::Address address_ = *rpc::Address::parse("unix:" + (folder_.path() / "part.sock").string());
  std::atomic<int> asked_ = 0;
  MemoryClient client_{address_, *served_skill_interface()};
};

TEST_F(Memory, IsAskedForAgainWhereItCouldNotBeToldNow) {
  EXPECT_EQ(ask().kind, Kind::kNotNow) << "nobody is there";
  MemoryClient client(address_, *served_skill_interface());
  const auto server = serve(*served_skill_interface(), [n = 0]() mutable { return octets_of(n++ == 0 ? "" : "it"); });
  EXPECT_EQ(ask(client).kind, Kind::kNotNow);
  const ToldMemory told = ask(client);
  EXPECT_EQ(told.kind, Kind::kTold);
  EXPECT_EQ(told.octets, "it");
}

TEST_F(Memory, IsNotAskedForAgainOfAPartThatDoesNotKnowTheQuestion) {
  auto server = serve(*skill_interface(), [] { return octets_of("no"); });
  EXPECT_EQ(ask().kind, Kind::kNever);
  EXPECT_EQ(asked_, 0);
  server.reset();
  server = serve(*served_skill_interface(), [] { return octets_of("it"); });
  EXPECT_EQ(ask().kind, Kind::kNever);
  EXPECT_EQ(asked_, 0);
}

TEST_F(Memory, IsNotAskedForAgainOfAPartThatDoesNotAnswer) {
  std::promise<void> over;
  const auto server = serve(*served_skill_interface(), [future = over.get_future().share()] {
    future.wait();
    return octets_of("late");
  });
  EXPECT_EQ(ask().kind, Kind::kNever);
  EXPECT_EQ(ask().kind, Kind::kNever);
  EXPECT_EQ(asked_, 1);
  over.set_value();
}

// An address of a middleware whose services say beforehand what can be asked.
TEST_F(Memory, IsNotAskedForOverOtherMiddlewares) {
  rpc::Address other;
  other.kind = rpc::Address::Kind::kOther;
  MemoryClient client(other, *served_skill_interface());
  EXPECT_EQ(ask(client).kind, Kind::kNever);
}

}  // namespace
}  // namespace sentree::processes
