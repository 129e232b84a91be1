#include "sentree/studio/detail/record_reader.h"

#include <gtest/gtest.h>

#include "sentree/base/json.h"

namespace sentree::studio {
namespace {

using Depth = RecordReader::Depth;

template <class Record>
std::optional<Record> read(std::string_view topic, std::string_view json, Depth depth = Depth::kWhole) {
  RecordReader reader;
  auto record = reader.read(topic_of(topic), TimePoint(Duration(7)), json, depth);
  if (!record || !std::holds_alternative<Record>(*record)) return std::nullopt;
  return std::get<Record>(std::move(*record));
}

TEST(RecordReader, ReadsAnObservationWithItsData) {
  const auto message = read<Message>(
      "/observations",
      R"({"sequence":12,"time":0.5,"stamp":3,"kind":"reply","source":"a\"b","target":"c","name":"s.m.reply","call":4,)"
      R"("tick":5,"data":{"n":1,"x":1.0,"big":18446744073709551615,"list":[null,true,"ü"],"map":{}}})");
  ASSERT_TRUE(message);
  EXPECT_EQ(message->sequence, 12U);
  EXPECT_EQ(message->time, TimePoint(Duration(7))) << "the recording's, not the text's";
  EXPECT_EQ(message->kind, MessageKind::kReply);
  EXPECT_EQ(message->source, "a\"b");
  EXPECT_EQ(message->call, 4U);
  EXPECT_EQ(to_json(message->data), R"({"n":1,"x":1.0,"big":18446744073709551616.0,"list":[null,true,"ü"],"map":{}})");
}

TEST(RecordReader, LeavesOutTheDataThatAnIndexDoesNotNeed) {
  const std::string begin = R"({"sequence":1,"kind":"event","source":"s","name":")";
  const std::string data = R"(","data":{"node":1}})";
  EXPECT_TRUE(read<Message>("/observations", begin + "s.changed" + data, Depth::kIndex)->data.is_null());
  EXPECT_FALSE(read<Message>("/observations", begin + "node.status" + data, Depth::kIndex)->data.is_null());
}

TEST(RecordReader, TurnsQuaternionsIntoHeadings) {
  const auto pose = read<record::PoseRecord>(
      "/r1/pose_estimate", R"({"pose":{"orientation":{"x":0,"y":0,"z":1,"w":0},"position":{"x":1.5,"y":-2,"z":0}}})");
  ASSERT_TRUE(pose);
  EXPECT_EQ(pose->robot, "r1");
  EXPECT_TRUE(pose->is_estimate);
  EXPECT_EQ(pose->pose_map.x, 1.5);
  EXPECT_EQ(pose->pose_map.y, -2.0);
  EXPECT_NEAR(pose->pose_map.theta, 3.14159265, 1e-6);
}

TEST(RecordReader, TakesOtherTypesForNothing) {
  const auto chart = read<record::ChartRecord>("/charts", R"({"leaf":1,"running":"yes","states":{"a":1},"last":1.5})");
  ASSERT_TRUE(chart);
  EXPECT_EQ(chart->leaf, "");
  EXPECT_FALSE(chart->running);
  EXPECT_TRUE(chart->states.empty());
  EXPECT_FALSE(chart->last);
}

TEST(RecordReader, RefusesWhatIsNoJsonObject) {
  for (const std::string_view text : {"", "12", "[1]", "{", R"({"leaf":)", R"({"leaf":"x)", R"({"data":[1,}})", "{} {}",
                                      "{\"leaf\":\"\xff\"}", R"({"leaf":"\q"})"})
    EXPECT_FALSE(read<record::ChartRecord>("/charts", text)) << text;
  const std::string deep = R"({"data":)" + std::string(5000, '[') + std::string(5000, ']') + "}";
  EXPECT_FALSE(read<record::ChartRecord>("/charts", deep));
}

TEST(RecordReader, KnowsTheTopicsThatAPageShows) {
  EXPECT_EQ(topic_of("/r1/scan").kind, Topic::Kind::kScan);
  EXPECT_EQ(topic_of("/r1/scan").robot, "r1");
  EXPECT_EQ(topic_of("/snapshots").kind, Topic::Kind::kNone);
  EXPECT_EQ(topic_of("").kind, Topic::Kind::kNone);
}

}  // namespace
}  // namespace sentree::studio
