#include "sentree/base/message.h"

#include <gtest/gtest.h>

namespace sentree {
namespace {

Message reply() {
  Message message;
  message.sequence = 12;
  message.time = TimePoint(std::chrono::milliseconds(1500));
  message.stamp = 4;
  message.kind = MessageKind::kReply;
  message.source = "AtKitchen";
  message.target = "navigation";
  message.name = "navigation.checkNearToLocation.reply";
  message.call = 3;
  message.tick = 2;
  message.data = Map{{"args", Map{{"name", "kitchen"}}}, {"result", false}};
  return message;
}

TEST(Message, IsOneLineOfJson) {
  EXPECT_EQ(
      to_json(reply()),
      R"({"sequence":12,"time":1.5,"stamp":4,"kind":"reply","source":"AtKitchen","target":"navigation",)"
      R"("name":"navigation.checkNearToLocation.reply","call":3,"tick":2,"data":{"args":{"name":"kitchen"},"result":false}})");
}

TEST(Message, LeavesOutWhatAnEventDoesNotHave) {
  Message message;
  message.source = "mission";
  message.name = "mission.tick";
  EXPECT_EQ(to_json(message),
            R"({"sequence":0,"time":0.0,"stamp":0,"kind":"event","source":"mission","name":"mission.tick","tick":0})");
}

TEST(Message, GivesChartsItsFactsAndItsData) {
  EXPECT_EQ(
      to_json(event_data(reply())),
      R"({"source":"AtKitchen","target":"navigation","call":3,"tick":2,"time":1.5,"args":{"name":"kitchen"},"result":false})");
}

TEST(Message, DoesNotLetDataForgeItsFacts) {
  Message message = reply();
  message.data = Map{{"source", "somebody else"}, {"time", -1}, {"more", true}};
  const Value data = event_data(message);
  EXPECT_EQ(data.find("source")->text(), "AtKitchen");
  EXPECT_EQ(data.find("time")->number(), 1.5);
  EXPECT_EQ(*data.find("more"), Value(true));
}

TEST(Message, WithDataThatIsNoMapGivesChartsTheFactsAlone) {
  Message message = reply();
  message.data = 5;
  EXPECT_EQ(event_data(message).as_map()->size(), 5u);
}

TEST(MessageKind, HasNames) {
  EXPECT_EQ(to_string(MessageKind::kRequest), "request");
  EXPECT_EQ(to_string(MessageKind::kError), "error");
}

}  // namespace
}  // namespace sentree
