// Our client and server against code that the Thrift compiler generated, for random types and values: each value goes
// from our client to a generated server, from there through a generated client to our server, and all the way back.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thrift/protocol/TBinaryProtocol.h>
#include <thrift/protocol/TCompactProtocol.h>
#include <thrift/protocol/TMultiplexedProtocol.h>
#include <thrift/server/TThreadedServer.h>
#include <thrift/transport/TBufferTransports.h>
#include <thrift/transport/TServerSocket.h>
#include <thrift/transport/TSocket.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <future>
#include <iterator>
#include <thread>

#include "relay.h"
#include "sentree/base/rng.h"
#include "sentree/idl/conform.h"
#include "sentree/rpc/detail/test_peers.h"

namespace sentree::rpc {
namespace {

namespace protocol = apache::thrift::protocol;
namespace transport = apache::thrift::transport;
using idl::Kind;
using idl::Type;
using ::testing::HasSubstr;

std::string read(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

class Values {
 public:
  explicit Values(std::uint64_t seed) : rng_(seed) {}

  Value of(const Type& type, int depth = 0) {
    switch (type.kind) {
      case Kind::kVoid: return {};
      case Kind::kBool: return Value(rng_.below(2) == 1);
      case Kind::kI8: return Value(bits(8));
      case Kind::kI16: return Value(bits(16));
      case Kind::kI32: return Value(bits(32));
      case Kind::kI64: return Value(bits(64));
      case Kind::kDouble: return rng_.below(10) == 0 ? Value(-0.0) : Value(rng_.normal() * 1e6);
      case Kind::kString: return Value(text());
      case Kind::kBinary: {
        Bytes out;
        for (const char c : text()) out.octets.push_back(static_cast<std::byte>(c));
        return Value(std::move(out));
      }
      case Kind::kEnum:
        return Value(type.enumeration->enumerators[rng_.below(type.enumeration->enumerators.size())].name);
      case Kind::kStruct: return structure(*type.structure, depth);
      case Kind::kList:
      case Kind::kSet: {
        List out;
        for (auto n = count(depth); n > 0; --n) out.push_back(of(*type.element, depth + 1));
        return Value(std::move(out));
      }
      case Kind::kMap: {
        Map named;
        List pairs;
        for (auto n = count(depth); n > 0; --n) {
          if (type.key->kind == Kind::kString)
            named[text()] = of(*type.element, depth + 1);
          else
            pairs.emplace_back(List{of(*type.key, depth + 1), of(*type.element, depth + 1)});
        }
        return type.key->kind == Kind::kString ? Value(std::move(named)) : Value(std::move(pairs));
      }
    }
    return {};
  }

 private:
  std::uint64_t count(int depth) { return depth > 4 ? 0 : rng_.below(5) == 0 ? 20 : rng_.below(4); }
  std::int64_t bits(int width) {
    const auto used = static_cast<unsigned>(1 + rng_.below(static_cast<std::uint64_t>(width)));
    return static_cast<std::int64_t>(rng_.next()) >> (64U - used);
  }
  std::string text() {
    std::string out(rng_.below(20) == 0 ? 3000 : rng_.below(12), ' ');
    for (char& c : out) c = static_cast<char>(rng_.below(256));
    return out;
  }
  Value structure(const idl::Struct& s, int depth) {
    Map out;
    if (s.kind == idl::StructKind::kUnion) {
      const idl::Field& f = s.fields[rng_.below(s.fields.size())];
      out[f.name] = of(*f.type, depth + 1);
      return Value(std::move(out));
    }
    for (const idl::Field& f : s.fields) {
      if (f.requiredness == idl::Requiredness::kOptional && rng_.below(2) == 0) continue;
      out[f.name] = of(*f.type, depth + 1);
    }
    return Value(std::move(out));
  }

  Rng rng_;
};

// Generated code keeps sets and maps sorted; theirs is another order than ours, so both are sorted in one way.
Value sorted(const Type& type, Value value) {
  const auto by_text = [](const Value& a, const Value& b) { return to_json(a) < to_json(b); };
  if (type.kind == Kind::kStruct) {
    for (auto& [name, member] : *value.as_map()) member = sorted(*type.structure->find(name)->type, std::move(member));
  } else if (type.kind == Kind::kMap && type.key->kind == Kind::kString) {
    std::vector<Map::Entry> entries(value.as_map()->begin(), value.as_map()->end());
    std::sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    Map out;
    for (auto& [name, member] : entries) out.append(name, sorted(*type.element, std::move(member)));
    return Value(std::move(out));
  } else if (type.kind == Kind::kMap) {
    for (Value& pair : *value.as_list()) (*pair.as_list())[1] = sorted(*type.element, std::move((*pair.as_list())[1]));
    std::sort(value.as_list()->begin(), value.as_list()->end(), by_text);
  } else if (type.kind == Kind::kList || type.kind == Kind::kSet) {
    for (Value& item : *value.as_list()) item = sorted(*type.element, std::move(item));
    if (type.kind == Kind::kSet) std::sort(value.as_list()->begin(), value.as_list()->end(), by_text);
  }
  return value;
}

class GeneratedPeer : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const std::string options = GetParam();
    const bool compact = options.find("compact") != std::string::npos;
    const bool framed = options.find("framed") != std::string::npos;

    auto loaded = idl::Schema::load(read(SENTREE_PEERS_DIR "/peers.thrift"), "peers.thrift");
    for (const Diagnostic& d : loaded.diagnostics) ADD_FAILURE() << to_string(d);
    ASSERT_TRUE(loaded.ok());
    echo_ = loaded.value->service("Echo");

    const auto ours =
        std::make_shared<FunctionService>(echo_, [this](const idl::Method& method, const Value& arguments) -> Outcome {
          if (method.name == "tell") told_.set_value(std::string(arguments.find("text")->text()));
          if (method.name == "ping" || method.name == "tell") return Value();
          if (method.name == "add") return Value(*arguments.find("a")->as_int() + *arguments.find("b")->as_int());
          if (method.name == "fail") {
            return tl::unexpected(CallError{CallErrorKind::kException, "", "Failure",
                                            Map{{"why", "asked to"}, {"detail", *arguments.find("detail")}}});
          }
          return *arguments.find("value");
        });
    our_server_ = test::serve(*Address::parse("unix:" + folder_.file("ours")), ours);

    // Theirs speaks to ours by the multiplexed name, so that both kinds of names are under test.
    std::shared_ptr<transport::TTransport> wire = std::make_shared<transport::TSocket>(folder_.file("ours"));
    if (framed)
      wire = std::make_shared<transport::TFramedTransport>(wire);
    else
      wire = std::make_shared<transport::TBufferedTransport>(wire);
    wire->open();
    std::shared_ptr<protocol::TProtocol> spoken;
    if (compact)
      spoken = std::make_shared<protocol::TCompactProtocol>(wire);
    else
      spoken = std::make_shared<protocol::TBinaryProtocol>(wire);
    their_client_ =
        std::make_unique<peers::EchoClient>(std::make_shared<protocol::TMultiplexedProtocol>(spoken, "robot"));

    std::shared_ptr<transport::TTransportFactory> transports;
    if (framed)
      transports = std::make_shared<transport::TFramedTransportFactory>();
    else
      transports = std::make_shared<transport::TBufferedTransportFactory>();
    std::shared_ptr<protocol::TProtocolFactory> protocols;
    if (compact)
      protocols = std::make_shared<protocol::TCompactProtocolFactory>();
    else
      protocols = std::make_shared<protocol::TBinaryProtocolFactory>();
    const auto processor = std::make_shared<peers::EchoProcessor>(std::make_shared<Relay>(*their_client_));
    const auto listening = std::make_shared<Listening>();
    their_server_ = std::make_unique<apache::thrift::server::TThreadedServer>(
        processor, std::make_shared<transport::TServerSocket>(folder_.file("theirs")), transports, protocols);
    their_server_->setServerEventHandler(listening);
    their_thread_ = std::thread([this] { their_server_->serve(); });
    listening->ready.get_future().wait();

    our_client_ = *Client::remote(*Address::parse("unix:" + folder_.file("theirs") + options), echo_);
  }

  void TearDown() override {
    our_client_.reset();
    if (their_server_) their_server_->stop();
    if (their_thread_.joinable()) their_thread_.join();
  }

  struct Listening : apache::thrift::server::TServerEventHandler {
    void preServe() override { ready.set_value(); }
    std::promise<void> ready;
  };

  test::Folder folder_;
  idl::ServicePtr echo_;
  std::promise<std::string> told_;
  std::unique_ptr<Server> our_server_;
  std::unique_ptr<peers::EchoClient> their_client_;
  std::unique_ptr<apache::thrift::server::TThreadedServer> their_server_;
  std::thread their_thread_;
  std::unique_ptr<Client> our_client_;
};

TEST_P(GeneratedPeer, AgreesOnRandomValuesOfRandomTypes) {
  const std::uint64_t seed = 20;
  SCOPED_TRACE("seed " + std::to_string(seed));
  Values values(seed);
  for (int round = 0; round < 20; ++round) {
    for (const idl::Method* method : echo_->methods) {
      if (!method->name.starts_with("echo")) continue;
      const Type& type = *method->result;
      const auto value = idl::conform(type, values.of(type), "value");
      ASSERT_TRUE(value) << value.error().message;
      const Outcome out = our_client_->call(*method, Map{{"value", *value}});
      ASSERT_TRUE(out) << type.name << ": " << out.error().message;
      ASSERT_EQ(to_json(sorted(type, *out)), to_json(sorted(type, *value))) << type.name;
    }
  }
}

TEST_P(GeneratedPeer, AgreesOnExceptionsOnewayDefaultsAndInheritance) {
  EXPECT_TRUE(our_client_->call("ping", {}));
  EXPECT_EQ(our_client_->call("add", Map{{"a", std::int64_t{1} << 60}}), Outcome(Value((std::int64_t{1} << 60) + 5)));
  Values values(3);
  const Value detail = *idl::conform(*echo_->find("fail")->arguments.fields[0].type,
                                     values.of(*echo_->find("fail")->arguments.fields[0].type), "detail");
  const Outcome failed = our_client_->call("fail", Map{{"detail", detail}});
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().exception, "Failure") << failed.error().message;
  EXPECT_EQ(failed.error().data.find("why")->text(), "asked to");
  EXPECT_TRUE(our_client_->call("tell", Map{{"text", "news"}}));
  EXPECT_EQ(told_.get_future().get(), "news");
}

// A call without a reply comes first: there is nothing that tells whether it arrived.
TEST_P(GeneratedPeer, IsFoundByWhoTakesItForOneOfSeveral) {
  const auto client =
      *Client::remote(*Address::parse("unix:" + folder_.file("theirs") + GetParam()), echo_, {.service = "robot"});
  EXPECT_TRUE(client->call("tell", Map{{"text", "news"}}));
  EXPECT_EQ(told_.get_future().get(), "news");
  EXPECT_EQ(client->call("add", Map{{"a", 3}}), Outcome(Value(8)));
}

INSTANTIATE_TEST_SUITE_P(Rpc, GeneratedPeer,
                         ::testing::Values("", "?protocol=compact", "?transport=framed",
                                           "?protocol=compact&transport=framed"));

}  // namespace
}  // namespace sentree::rpc
