#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "sentree/base/json.h"
#include "sentree/bt/load.h"
#include "sentree/bt/state.h"
#include "sentree/groot/message_pack.h"
#include "sentree/groot/responder.h"
#include "sentree/text/json.h"

namespace sentree::groot {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// "01 02 …" as octets.
std::string octets(std::string_view hex) {
  std::string out;
  int high = -1;
  for (const char c : hex) {
    const int digit = c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
    if (digit < 0) continue;
    if (high < 0) {
      high = digit;
    } else {
      out += static_cast<char>(16 * high + digit);
      high = -1;
    }
  }
  return out;
}

bt::Tree load_tree(std::string xml) {
  auto loaded = bt::load(std::move(xml));
  EXPECT_TRUE(loaded.ok()) << (loaded.diagnostics.empty() ? "" : to_string(loaded.diagnostics[0]));
  return std::move(*loaded.value);
}

bt::Tree small_tree() {
  return load_tree(R"(<root BTCPP_format="4" main_tree_to_execute="Main"><BehaviorTree ID="Main"><Sequence name="root">
      <Action ID="GoTo" name="go" where="{goal}"/><SubTree ID="Dock" name="dock"/></Sequence></BehaviorTree>
    <BehaviorTree ID="Dock"><AlwaysSuccess/></BehaviorTree>
    <TreeNodesModel><Action ID="GoTo"><input_port name="where"/></Action></TreeNodesModel></root>)");
}

// A message of BehaviorTree.CPP 3.8.8 with seven nodes, as it was captured: the first one of a run.
TEST(Groot1Update, IsAsBehaviorTreeCppSendsIt) {
  using bt::Status;
  const std::string captured = octets(
      "15000000 010000 020000 030000 040000 050000 060000 070000 05000000"
      "78c8026b 5a2a0d00 0100 00 01   78c8026b e72a0d00 0200 00 01   78c8026b ea2a0d00 0300 00 03"
      "78c8026b f32a0d00 0400 00 01   78c8026b f62a0d00 0500 00 01");
  TreeImage image;
  image.nodes = 7;
  const std::vector<Status> before(7, Status::kIdle);
  const std::int64_t second = std::int64_t{0x6b02c878} * 1'000'000;
  const std::vector<Change> changes{{second + 0xd2a5a, 0, Status::kIdle, Status::kRunning},
                                    {second + 0xd2ae7, 1, Status::kIdle, Status::kRunning},
                                    {second + 0xd2aea, 2, Status::kIdle, Status::kFailure},
                                    {second + 0xd2af3, 3, Status::kIdle, Status::kRunning},
                                    {second + 0xd2af6, 4, Status::kIdle, Status::kRunning}};
  EXPECT_EQ(groot1_update(image, before, changes), captured);
}

TEST(Groot1Update, HasNumbersOfTheRun) {
  const auto image = describe(small_tree(), 1000);
  ASSERT_TRUE(image.has_value());
  EXPECT_EQ(image->base, 1000);
  const std::vector<Change> one{{1, 2, bt::Status::kIdle, bt::Status::kSkipped}};
  const std::vector<bt::Status> before(image->nodes, bt::Status::kIdle);
  const std::string update = groot1_update(*image, before, one);
  EXPECT_EQ(update.substr(0, 7), octets("0c000000 e903 00"));
  EXPECT_EQ(update.substr(update.size() - 4), octets("eb03 00 00"));
}

TEST(Groot1Tree, MakesRoomForItsNumbers) {
  const auto image = describe(small_tree(), 65'535);
  ASSERT_TRUE(image.has_value());
  EXPECT_EQ(image->base, kNodesMax - image->nodes);
}

TEST(Groot1Tree, HasThePresentStatuses) {
  const auto image = describe(small_tree());
  ASSERT_TRUE(image.has_value());
  ASSERT_EQ(image->nodes, 4u);
  const std::vector<bt::Status> statuses{bt::Status::kRunning, bt::Status::kSuccess, bt::Status::kSkipped,
                                         bt::Status::kFailure};
  const std::string flat = groot1_tree(*image, statuses);
  ASSERT_EQ(flat.size(), image->flat.size());
  std::vector<int> found;
  for (const std::size_t at : image->status_at) found.push_back(flat[at]);
  EXPECT_THAT(found, ElementsAre(1, 2, 0, 3));
}

// Captured between BehaviorTree.CPP 4.10 and a client.
TEST(Groot2Messages, AreAsBehaviorTreeCppSendsThem) {
  const Request tree{.type = Ask::kTree, .id = 0x31e99e04, .body = {}, .has_body = false};
  EXPECT_THAT(write_request(tree), ElementsAre(octets("02 54 04 9e e9 31")));
  const auto read = parse_request({octets("02 54 04 9e e9 31")});
  ASSERT_TRUE(read.has_value());
  EXPECT_EQ(read->type, Ask::kTree);
  EXPECT_EQ(read->id, 0x31e99e04u);
  const std::string header = octets("02 54 04 9e e9 31 6e d1 a0 22 26 c1 45 5f a2 fc d1 18 da db 4f 8d");
  const auto reply = parse_reply(tree, {header, "<root/>"});
  ASSERT_TRUE(reply.has_value());
  EXPECT_EQ(reply->body, "<root/>");
  EXPECT_THAT(write_reply(tree, reply->tree, "<root/>"), ElementsAre(header, "<root/>"));

  const std::string statuses =
      octets("01 00 01 02 00 02 03 00 02 04 00 0d 05 00 0c 06 00 0c 07 00 02 09 00 01 08 00 0c 0a 00 01");
  const auto parsed = parse_statuses(statuses);
  ASSERT_TRUE(parsed.has_value());
  EXPECT_EQ(parsed->size(), 10u);
  EXPECT_EQ((*parsed)[3], (NodeStatus{4, 13}));
  EXPECT_EQ(write_statuses(*parsed), statuses);

  const auto records = parse_records(octets("34 e9 06 00 00 00 01 00 01"));
  ASSERT_TRUE(records.has_value());
  EXPECT_THAT(*records, ElementsAre(Record{452'916, 1, 1}));
  EXPECT_EQ(parse_reached({octets("02 4e e0 bf bb 09"), "8"}), 8);
  EXPECT_THAT(write_reached(0x09bbbfe0, 8), ElementsAre(octets("02 4e e0 bf bb 09"), "8"));
}

TEST(Groot2Messages, ThatAreNoneAreRefusedWithTheWordsOfBehaviorTreeCpp) {
  EXPECT_EQ(parse_request({}).error().message, "wrong request header");
  EXPECT_EQ(parse_request({"short"}).error().message, "wrong request header");
  EXPECT_EQ(parse_request({octets("02 51 00 00 00 00")}).error().message, "Request not recognized");
  EXPECT_EQ(parse_request({octets("02 4e 00 00 00 00")}).error().message, "Request not recognized");
  EXPECT_EQ(parse_request({octets("02 42 00 00 00 00")}).error().message, "must be 2 parts message");
  EXPECT_TRUE(parse_request({octets("09 54 00 00 00 00"), "surplus"}).has_value());
  const Request request{.type = Ask::kStatus, .id = 1, .body = {}, .has_body = false};
  EXPECT_EQ(parse_reply(request, {}).error().code, "groot.reply");
  EXPECT_EQ(parse_reply(request, {"error", "Node ID not found"}).error().code, "groot.refused");
  const Request other{.type = Ask::kStatus, .id = 2, .body = {}, .has_body = false};
  EXPECT_EQ(parse_reply(request, write_reply(other, {}, "")).error().code, "groot.reply");
  Parts older = write_reply(request, {}, "");
  older[0][0] = 1;
  EXPECT_TRUE(parse_reply(request, older)) << "the protocol before";
  EXPECT_EQ(parse_statuses("1234").error().code, "groot.reply");
  EXPECT_EQ(parse_records("1234567890").error().code, "groot.reply");
}

TEST(MessagePack, IsAsBehaviorTreeCppSendsIt) {
  const std::string captured = octets(
      "81 a1 4d 88 a1 62 ca 3f 80 00 00 a3 62 69 67 cf 00 00 01 00 00 00 00 00 a4 64 6f 63 6b a1 41 a1 66 ca 3f 00 00 "
      "00"
      "a1 6e 07 a1 73 a2 68 69 ac 75 6e 73 65 74 5f 63 75 73 74 6f 6d c0 a1 76 92 ca 3f 80 00 00 ca 40 00 00 00");
  const auto read = parse_message_pack(captured);
  ASSERT_TRUE(read.has_value()) << to_string(read.error());
  EXPECT_EQ(
      to_json(*read),
      R"({"M":{"b":1.0,"big":1099511627776,"dock":"A","f":0.5,"n":7,"s":"hi","unset_custom":null,"v":[1.0,2.0]}})");
  EXPECT_EQ(message_pack(*read), captured);
}

TEST(MessagePack, BringsBackEveryValue) {
  List numbers;
  for (int bits = 0; bits < 63; ++bits) {
    for (const std::int64_t near : {-1, 0, 1}) {
      numbers.emplace_back((std::int64_t{1} << bits) + near);
      numbers.emplace_back(-(std::int64_t{1} << bits) + near);
    }
  }
  for (const double real : {0.1, 1e300, -2.5, 0.0}) numbers.emplace_back(real);
  Map texts;
  for (const std::size_t size : {0U, 31U, 32U, 255U, 256U, 65'535U, 65'536U})
    texts.append("of " + std::to_string(size), std::string(size, 'x'));
  for (int i = 0; i < 70'000; ++i) texts.append("key " + std::to_string(i), i % 2 == 0);
  Bytes bytes;
  bytes.octets.resize(300);
  const Value all(
      Map{{"numbers", std::move(numbers)}, {"texts", std::move(texts)}, {"bytes", bytes}, {"none", nullptr}});
  const auto read = parse_message_pack(message_pack(all));
  ASSERT_TRUE(read.has_value()) << to_string(read.error());
  EXPECT_TRUE(*read == all);
}

TEST(MessagePack, ThatIsNoneIsRefused) {
  for (const char* hex : {"", "c1", "a5 61", "dd ff ff ff ff", "df ff ff ff ff 00", "cf 00", "c6 ff ff ff ff", "00 00"})
    EXPECT_EQ(parse_message_pack(octets(hex)).error().code, "groot.pack") << hex;
  EXPECT_EQ(parse_message_pack(std::string(100'000, '\x91')).error().code, "groot.pack");
}

TEST(MessagePack, SurvivesWhatIsRandom) {
  const unsigned seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::minstd_rand random(seed);
  for (int round = 0; round < 20'000; ++round) {
    std::string bytes(random() % 40, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    const auto read = parse_message_pack(bytes);
    if (!read) continue;
    EXPECT_TRUE(parse_message_pack(message_pack(*read)).has_value());
  }
}

TEST(Hooks, AreReadAndWritten) {
  const auto hooks = parse_hooks(
      R"({"enabled": true, "uid": 8, "mode": 0, "once": false, "desired_status": "SKIPPED", "position": 0})");
  ASSERT_TRUE(hooks.has_value()) << to_string(hooks.error());
  EXPECT_THAT(*hooks, ElementsAre(Hook{.uid = 8}));
  EXPECT_EQ(write_hooks(*hooks),
            R"([{"desired_status":"SKIPPED","enabled":true,"mode":0,"once":false,"position":0,"uid":8}])");
  for (const char* wrong :
       {"{", "7", R"({"uid": 8})",
        R"({"enabled": true, "uid": 70000, "mode": 0, "once": false, "desired_status": "SKIPPED", "position": 0})",
        R"({"enabled": true, "uid": 8, "mode": 0, "once": false, "desired_status": "IDLE", "position": 0})"})
    EXPECT_FALSE(parse_hooks(wrong).has_value()) << wrong;
}

// --- The responder --------------------------------------------------------------------------------------------------

class Taken final : public Hooks {
 public:
  Result<void> set(const Hook& hook) override {
    if (hook.uid == refused) return fail("groot.hook", "not this one");
    said.push_back("set " + std::to_string(hook.uid));
    return {};
  }
  void unset(const Hook& hook) override { said.push_back("unset " + std::to_string(hook.uid)); }
  Result<void> unlock(const Hook& hook, bt::Status desired) override {
    said.push_back("unlock " + std::to_string(hook.uid) + " " + std::string(bt::to_string(desired)));
    return {};
  }
  int refused = -1;
  std::vector<std::string> said;
};

class ResponderTest : public ::testing::Test {
 protected:
  ResponderTest() {
    scene.begin(*describe(small_tree()), TreeId{1, 2, 3});
    scene.blackboard(*text::parse_json(R"({"": {"goal": "kitchen", "n": 7}, "dock": {"tries": 2}})"));
  }
  // The answer's second part, or the error.
  std::string ask(Ask type, std::optional<std::string> body = {}) {
    Request request{.type = type, .id = 5, .body = body.value_or(""), .has_body = body.has_value()};
    const Parts parts = responder.answer(write_request(request), now, 1'000'000);
    const auto reply = parse_reply(request, parts);
    return reply ? reply->body : reply.error().message;
  }
  static std::string hook(int uid, bool enabled = true, bool once = false) {
    return R"({"enabled": )" + std::string(enabled ? "true" : "false") + R"(, "uid": )" + std::to_string(uid) +
           R"(, "mode": 0, "once": )" + (once ? "true" : "false") + R"(, "desired_status": "SKIPPED", "position": 0})";
  }
  Scene scene;
  Taken taken;
  Responder responder{scene, &taken};
  Responder::Now now{};
};

TEST_F(ResponderTest, TellsTreeStatusesAndBlackboards) {
  EXPECT_THAT(ask(Ask::kTree), HasSubstr(R"(<BehaviorTree ID="Dock" _fullpath="dock">)"));
  scene.changed({10, 0, bt::Status::kIdle, bt::Status::kRunning});
  scene.changed({11, 1, bt::Status::kIdle, bt::Status::kFailure});
  scene.changed({12, 1, bt::Status::kFailure, bt::Status::kIdle});
  scene.skipped(2, 13);
  EXPECT_EQ(ask(Ask::kStatus), octets("0100 01 0200 0d 0300 04 0400 00"));
  EXPECT_EQ(to_json(*parse_message_pack(ask(Ask::kBlackboard, "Main;dock;nosuch"))),
            R"({"Main":{"goal":"kitchen","n":7},"dock":{"tries":2}})");
  EXPECT_EQ(ask(Ask::kBlackboard, "nosuch"), "\xC0");
  EXPECT_EQ(ask(Ask::kBlackboard, ""), "\xC0");
}

TEST_F(ResponderTest, TellsTheBlackboardsOfSubTreesApartThatNobodyHasNamed) {
  const bt::Tree tree =
      load_tree(R"(<root BTCPP_format="4" main_tree_to_execute="Main"><BehaviorTree ID="Main"><Sequence>
      <SubTree ID="A"/><SubTree ID="B"/></Sequence></BehaviorTree>
    <BehaviorTree ID="A"><Sequence><Script code="a := 1"/><SetBlackboard value="{unset}" output_key="a"/></Sequence></BehaviorTree>
    <BehaviorTree ID="B"><Script code="b := 2"/></BehaviorTree></root>)");
  bt::State state(tree);
  ASSERT_TRUE(bt::set_entry(tree, state, "a", Value(1), TimePoint{}, 1));
  ASSERT_TRUE(bt::set_entry(tree, state, "b", Value(2), TimePoint{}, 5));
  scene.begin(*describe(tree), TreeId{1});
  scene.blackboard(boards(tree, state));
  EXPECT_EQ(to_json(*parse_message_pack(ask(Ask::kBlackboard, "A::2;B::6"))),
            R"({"A::2":{"a":1,"unset":null},"B::6":{"b":2}})");
  EXPECT_THAT(ask(Ask::kTree), HasSubstr(R"(<SubTree ID="SubTree")")) << "real publishers describe it";
}

TEST_F(ResponderTest, RecordsWhatChangesUntilItIsTakenAndNoMoreThanFits) {
  scene.changed({10, 0, bt::Status::kIdle, bt::Status::kRunning});
  EXPECT_EQ(ask(Ask::kTransitions), "");
  EXPECT_EQ(ask(Ask::kRecording, "start"), "1000000");
  scene.changed({1'452'916, 0, bt::Status::kRunning, bt::Status::kSuccess});
  EXPECT_EQ(ask(Ask::kTransitions), octets("34 e9 06 00 00 00 01 00 02"));
  EXPECT_EQ(ask(Ask::kTransitions), "");
  for (int i = 0; i < 3'000; ++i) {
    scene.changed({2'000'000, 1, bt::Status::kIdle, bt::Status::kRunning});
    scene.changed({2'000'000, 1, bt::Status::kRunning, bt::Status::kIdle});
  }
  EXPECT_EQ(ask(Ask::kTransitions).size(), 9 * kRecordedMax);
  EXPECT_EQ(ask(Ask::kRecording, "stop"), "");
  scene.changed({3'000'000, 1, bt::Status::kIdle, bt::Status::kRunning});
  EXPECT_EQ(ask(Ask::kTransitions), "");
}

TEST_F(ResponderTest, TellsGroot1OfEachNodeWhereItCannotTellEachChange) {
  const std::size_t statuses = 4 + 3 * scene.nodes() + 4;
  scene.changed({1, 0, bt::Status::kIdle, bt::Status::kRunning});
  EXPECT_EQ(scene.take_update().size(), statuses + 12);
  EXPECT_EQ(scene.take_update(), "");
  for (std::size_t i = 0; i < Scene::kUpdateMax; ++i) {
    const bool on = i % 2 == 0;
    scene.changed({2, 1, on ? bt::Status::kIdle : bt::Status::kRunning, on ? bt::Status::kRunning : bt::Status::kIdle});
  }
  scene.changed({3, 2, bt::Status::kIdle, bt::Status::kFailure});
  EXPECT_EQ(scene.take_update().size(), statuses + 12);
}

TEST_F(ResponderTest, CarriesOutHooks) {
  EXPECT_EQ(ask(Ask::kInsertHook, "[" + hook(2) + "," + hook(3) + "]"), "");
  EXPECT_EQ(ask(Ask::kInsertHook, hook(2)), "");    // it is so already
  EXPECT_EQ(ask(Ask::kInsertHook, hook(500)), "");  // as BehaviorTree.CPP: nobody there, no error
  EXPECT_THAT(taken.said, ElementsAre("set 2", "set 3"));
  EXPECT_THAT(ask(Ask::kDumpHooks), HasSubstr(R"("uid":3)"));
  EXPECT_EQ(ask(Ask::kUnlock, R"({"uid": 2, "desired_status": "SUCCESS", "position": 0, "remove_when_done": true})"),
            "");
  EXPECT_EQ(ask(Ask::kUnlock, R"({"uid": 2, "desired_status": "SUCCESS", "position": 0, "remove_when_done": true})"),
            "the publisher refuses: Node ID not found");
  EXPECT_EQ(ask(Ask::kRemoveHook, R"({"uid": 3, "position": 0})"), "");
  EXPECT_EQ(ask(Ask::kRemoveHook, R"({"uid": 3, "position": 0})"), "the publisher refuses: Node ID not found");
  EXPECT_EQ(ask(Ask::kDumpHooks), "[]");
  EXPECT_THAT(taken.said, ElementsAre("set 2", "set 3", "unlock 2 SUCCESS", "unset 2", "unset 3"));
}

TEST_F(ResponderTest, DisablesTheHooksOfWhoIsSilent) {
  EXPECT_EQ(ask(Ask::kInsertHook, hook(2)), "");
  now += std::chrono::milliseconds(4'999);
  responder.look_after(now);
  EXPECT_THAT(taken.said, ElementsAre("set 2"));
  now += std::chrono::milliseconds(1);
  responder.look_after(now);
  responder.look_after(now);
  EXPECT_THAT(taken.said, ElementsAre("set 2", "unset 2"));
  EXPECT_EQ(ask(Ask::kDisableHooks), "");
  EXPECT_THAT(taken.said, ElementsAre("set 2", "unset 2", "set 2", "unset 2"));
  EXPECT_EQ(ask(Ask::kRemoveHooks), "");
  EXPECT_THAT(taken.said.size(), 4u);
}

TEST_F(ResponderTest, RefusesHooksThatCannotBeAndOneTooMany) {
  taken.refused = 2;
  EXPECT_EQ(ask(Ask::kInsertHook, hook(2)), "the publisher refuses: not this one");
  EXPECT_EQ(ask(Ask::kDumpHooks), "[]");
  EXPECT_THAT(ask(Ask::kInsertHook, "{"), HasSubstr("refuses"));
  Responder looking(scene, nullptr);
  const Request request{.type = Ask::kInsertHook, .id = 5, .body = hook(3), .has_body = true};
  EXPECT_THAT(parse_reply(request, looking.answer(write_request(request), now, 0)).error().message,
              HasSubstr("looked at"));
}

TEST_F(ResponderTest, HasABoundOfHooks) {
  std::string xml = "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\"><Sequence>";
  for (std::size_t i = 0; i < 300; ++i) xml += "<AlwaysSuccess/>";
  scene.begin(*describe(load_tree(xml + "</Sequence></BehaviorTree></root>")), TreeId{});
  for (std::size_t i = 1; i <= Responder::kHooksMax; ++i)
    ASSERT_EQ(ask(Ask::kInsertHook, hook(static_cast<int>(i))), "");
  EXPECT_THAT(ask(Ask::kInsertHook, hook(Responder::kHooksMax + 1)), HasSubstr("256 hooks already"));
}

TEST_F(ResponderTest, SurvivesWhatIsRandom) {
  const unsigned seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::minstd_rand random(seed);
  constexpr std::string_view kLetters = "TSBIRUDAXrtNQ";
  for (int round = 0; round < 20'000; ++round) {
    Parts parts(random() % 4);
    for (std::string& part : parts) {
      part.resize(random() % 30);
      for (char& byte : part) byte = static_cast<char>(random());
    }
    if (!parts.empty() && random() % 2 == 0)
      parts[0] = std::string("\x02") + kLetters[random() % kLetters.size()] + "abcd";
    EXPECT_FALSE(responder.answer(parts, now, 0).empty());
  }
}

}  // namespace
}  // namespace sentree::groot
