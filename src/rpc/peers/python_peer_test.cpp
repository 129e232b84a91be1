// The examples in Python as peers: a component, a client, a skill and an observer.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <iterator>

#include "sentree/rpc/detail/test_peers.h"

namespace sentree::rpc {
namespace {

using namespace std::chrono_literals;
using test::in;
using ::testing::HasSubstr;

const std::string kExamples = SENTREE_SOURCE_DIR "/examples/";

idl::Schema interface_file(const std::string& name) {
  std::ifstream file(SENTREE_SOURCE_DIR "/interfaces/" + name);
  const std::string source{std::istreambuf_iterator<char>(file), {}};
  return *idl::Schema::load(source, name).value;
}

// A Python program with its output; ended with the test.
class Python {
 public:
  explicit Python(const std::vector<std::string>& words) {
    std::array<int, 2> ends{};
    EXPECT_EQ(::pipe(ends.data()), 0);
    std::vector<std::string> all = {SENTREE_PYTHON, "-B"};
    all.insert(all.end(), words.begin(), words.end());
    std::vector<char*> arguments;
    for (std::string& w : all) arguments.push_back(w.data());
    arguments.push_back(nullptr);
    child_ = ::fork();
    if (child_ == 0) {
      ::dup2(ends[1], STDOUT_FILENO);
      ::close(ends[0]);
      ::execv(arguments[0], arguments.data());
      ::_exit(127);
    }
    ::close(ends[1]);
    output_ = ::fdopen(ends[0], "r");
  }
  Python(const Python&) = delete;
  Python& operator=(const Python&) = delete;
  ~Python() {
    ::kill(child_, SIGTERM);
    ::waitpid(child_, nullptr, 0);
    std::fclose(output_);
  }

  std::string line() {
    std::array<char, 512> buffer;
    if (std::fgets(buffer.data(), buffer.size(), output_) == nullptr) return "";
    std::string out = buffer.data();
    return out.substr(0, out.find('\n'));
  }
  Address address() {
    const std::string said = line();
    const std::string head = "listening at ";
    EXPECT_TRUE(said.starts_with(head)) << said;
    const auto parsed = Address::parse(said.substr(std::min(head.size(), said.size())));
    return parsed ? *parsed : Address{};
  }

 private:
  pid_t child_;
  std::FILE* output_;
};

TEST(PythonPeer, ServesAComponentInEveryEncoding) {
  for (const std::vector<std::string>& flags :
       {std::vector<std::string>{}, {"--compact"}, {"--framed"}, {"--compact", "--framed"}}) {
    std::vector<std::string> words = {kExamples + "python-component/battery.py"};
    words.insert(words.end(), flags.begin(), flags.end());
    Python component(words);
    Address address = component.address();
    for (const std::string& f : flags) {
      if (f == "--compact") address.protocol = Address::Protocol::kCompact;
      if (f == "--framed") address.framed = true;
    }
    const auto client = *Client::remote(address, interface_file("robot.thrift").service("Battery"));
    const Outcome state = client->call("getBatteryState", {}, in(20s));
    ASSERT_TRUE(state) << state.error().message;
    EXPECT_EQ(state->find("power_supply_status")->text(), "DISCHARGING");
    EXPECT_GT(state->find("percentage")->number(), 0.5);
    EXPECT_EQ(client->call("isCharging", {}, in(20s)), Outcome(Value(false)));
  }
}

TEST(PythonPeer, AClientInPythonCallsOurServer) {
  test::Folder folder;
  const idl::Schema schema = interface_file("robot.thrift");
  const auto battery =
      std::make_shared<FunctionService>(schema.service("Battery"), [](const idl::Method&, const Value&) -> Outcome {
        return Value(Map{{"header", Map{{"stamp", 1}, {"frame_id", "dock"}}},
                         {"voltage", 24},
                         {"current", 0},
                         {"percentage", 0.75},
                         {"temperature", 20},
                         {"power_supply_status", "FULL"},
                         {"warning", "NONE"}});
      });
  const auto server = test::serve(folder.socket(), battery);
  Python client({kExamples + "python-component/ask_battery.py", folder.file("socket")});
  EXPECT_EQ(client.line(), "0.75 dock");
}

TEST(PythonPeer, RunsASkill) {
  test::Folder folder;
  Python skill({kExamples + "python-skill/countdown.py", "--socket", folder.file("skill")});
  const auto client = *Client::remote(skill.address(), interface_file("skill.thrift").service("Skill"));
  const auto tick = [&](int run) {
    return client->call(
        "tick", Map{{"tick", Map{{"leaf", "Main.Countdown"}, {"run", run}, {"tick", 1}, {"inputs", R"({"ticks":2})"}}}},
        in(20s));
  };
  EXPECT_EQ(client->call("info", {}, in(20s))->find("name")->text(), "Countdown");
  EXPECT_EQ(tick(1)->find("status")->text(), "RUNNING");
  const Outcome done = tick(1);
  EXPECT_EQ(done->find("status")->text(), "SUCCESS");
  EXPECT_EQ(done->find("outputs")->text(), R"({"left": 0})");
  EXPECT_EQ(tick(2)->find("status")->text(), "RUNNING") << "a new run starts anew";
  EXPECT_EQ(*client->call("halt", Map{{"leaf", "Main.Countdown"}, {"run", 2}})->find("halted"), Value(true));
}

TEST(PythonPeer, ObservesAndVetoes) {
  test::Folder folder;
  Python observer({kExamples + "python-observer/low_battery.py", "--socket", folder.file("observer")});
  const auto client = *Client::remote(observer.address(), interface_file("observer.thrift").service("Observer"));
  const auto observe = [&](const char* kind, const char* name, const char* data) {
    return *client->call("observe",
                         Map{{"message", Map{{"sequence", 1},
                                             {"time_ns", 5},
                                             {"kind", kind},
                                             {"source", "leaf"},
                                             {"target", "x"},
                                             {"name", name},
                                             {"data", data}}}},
                         in(20s));
  };
  EXPECT_EQ(*observe("REQUEST", "navigation.gotoTargetByLocationName.request", "{}").find("accept"), Value(true));
  (void)observe("REPLY", "battery.getBatteryState.reply", R"({"result":{"percentage":0.2}})");
  const Value vetoed = observe("REQUEST", "navigation.gotoTargetByLocationName.request", "{}");
  EXPECT_EQ(*vetoed.find("accept"), Value(false));
  EXPECT_EQ(vetoed.find("reason")->text(), "the battery is below 30 %");
}

}  // namespace
}  // namespace sentree::rpc
