#include "sentree/rpc/address.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sentree::rpc {
namespace {

using ::testing::HasSubstr;

TEST(Address, ReadsItsForms) {
  const auto unix_socket = Address::parse("unix:/run/robot/battery.sock");
  ASSERT_TRUE(unix_socket);
  EXPECT_EQ(unix_socket->path, "/run/robot/battery.sock");
  const auto tcp = Address::parse("tcp://10.0.0.5:9090/navigation");
  ASSERT_TRUE(tcp);
  EXPECT_EQ(tcp->host, "10.0.0.5");
  EXPECT_EQ(tcp->port, 9090);
  EXPECT_EQ(tcp->service, "navigation");
  const auto tls = Address::parse("tls://[::1]:0?protocol=compact&transport=framed");
  ASSERT_TRUE(tls);
  EXPECT_EQ(tls->host, "::1");
  EXPECT_EQ(tls->protocol, Address::Protocol::kCompact);
  EXPECT_TRUE(tls->framed);
}

TEST(Address, IsWrittenAsItIsRead) {
  for (const char* text : {"local:sim", "unix:/a/b.sock", "unix:b.sock#battery", "tcp://host:1", "tcp://[::1]:1/x",
                           "tls://host:65535?protocol=compact", "tcp://h:1/s?transport=framed",
                           "unix:a?protocol=compact&transport=framed"}) {
    const auto address = Address::parse(text);
    ASSERT_TRUE(address) << text;
    EXPECT_EQ(to_string(*address), text);
  }
}

TEST(Address, SaysWhatIsWrong) {
  const auto why = [](std::string_view text) {
    const auto address = Address::parse(text);
    return address ? std::string("accepted") : address.error().message;
  };
  EXPECT_EQ(why("http://x:1"),
            "address \"http://x:1\" begins with none of the known schemes; an address is unix:/path, tcp://host:port "
            "or tls://host:port");
  EXPECT_THAT(why("tcp://host"), HasSubstr("has no port"));
  EXPECT_THAT(why("tcp://host:"), HasSubstr("port \"\""));
  EXPECT_THAT(why("tcp://host:65536"), HasSubstr("port \"65536\""));
  EXPECT_THAT(why("tcp://host:-1"), HasSubstr("port \"-1\""));
  EXPECT_THAT(why("tcp://:1"), HasSubstr("has no host"));
  EXPECT_THAT(why("tcp://::1:80"), HasSubstr("brackets"));
  EXPECT_THAT(why("tcp://[::1:80"), HasSubstr("[host]:port"));
  EXPECT_THAT(why("unix:"), HasSubstr("has no path"));
  EXPECT_THAT(why("unix:a#"), HasSubstr("no service after"));
  EXPECT_THAT(why("unix:" + std::string(108, 'a')), HasSubstr("more than 107 bytes"));
  EXPECT_THAT(why("tcp://h:1?x=y"), HasSubstr("unknown option \"x=y\""));
  EXPECT_THAT(why("tcp://h:1?protocol=compact&protocol=binary"), HasSubstr("gives protocol twice"));
  EXPECT_THAT(why(""), HasSubstr("begins with none"));
}

}  // namespace
}  // namespace sentree::rpc
