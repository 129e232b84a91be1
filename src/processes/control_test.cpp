#include "sentree/processes/control.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>

namespace sentree::processes {
namespace {

TEST(Control, SaysThatNothingIsObservedWhereNothingIs) {
  const auto server = start_control({.scenario = [] { return std::string("nothing"); },
                                     .now = [] { return TimePoint(); },
                                     .services = [] { return std::vector<runtime::ControlHandler::ServiceEntry>(); },
                                     .call = {}});
  ASSERT_TRUE(server) << to_string(server.error());
  const auto client = connect_control(::getpid());
  ASSERT_TRUE(client) << client.error().message;
  const auto reply = (*client)->call("observe", Map(), std::chrono::steady_clock::now() + std::chrono::seconds(20));
  ASSERT_FALSE(reply);
  EXPECT_EQ(reply.error().kind, rpc::CallErrorKind::kProtocol);
  EXPECT_TRUE((*client)->call("info", Map(), std::chrono::steady_clock::now() + std::chrono::seconds(20)));
}

}  // namespace
}  // namespace sentree::processes
