#include "sentree/record/recorder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <condition_variable>
#include <fstream>
#include <mutex>

#include "sentree/base/rng.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/record/folder.h"
#include "sentree/record/foxglove.h"
#include "sentree/record/observation.h"
#include "sentree/record/reader.h"
#include "sentree/record/schemas.h"
#include "sentree/text/file.h"
#include "sentree/text/json.h"

namespace sentree::record {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

// A disk that hangs until it is let go.
class HangingSink final : public Sink {
 public:
  struct Gate {
    std::mutex mutex;
    std::condition_variable changed;
    bool open = false;
    void let_go() {
      const std::lock_guard lock(mutex);
      open = true;
      changed.notify_all();
    }
  };
  HangingSink(Gate& gate, std::string& text) : gate_(gate), text_(text) {}
  Result<void> write(std::string_view bytes) override {
    std::unique_lock lock(gate_.mutex);
    gate_.changed.wait(lock, [&] { return gate_.open; });
    text_ += bytes;
    return {};
  }

 private:
  Gate& gate_;
  std::string& text_;
};

class FullSink final : public Sink {
 public:
  FullSink(std::string& text, std::size_t room) : text_(text), room_(room) {}
  Result<void> write(std::string_view bytes) override {
    if (text_.size() + bytes.size() > room_) return fail("record.unwritable", "cannot be written: disk full");
    text_ += bytes;
    return {};
  }

 private:
  std::string& text_;
  std::size_t room_;
};

TimePoint at_ms(std::int64_t ms) { return TimePoint(std::chrono::milliseconds(ms)); }

std::unique_ptr<Reader> open(const std::string& file) {
  auto reader = Reader::open(std::make_unique<StringSource>(file), "test.mcap");
  EXPECT_TRUE(reader.has_value());
  return reader ? std::move(*reader) : nullptr;
}

std::vector<std::string> texts(Reader& reader, std::string_view topic) {
  std::vector<std::string> found;
  EXPECT_TRUE(reader.read({.channels = reader.channels_of(topic)}, [&](const RawMessage& message) {
    found.emplace_back(message.data);
    return true;
  }));
  return found;
}

TEST(Recorder, WritesWhatItIsGivenAndTheSameBytesEachTime) {
  const auto record = [] {
    std::string file;
    Recorder recorder(std::make_unique<StringSink>(file),
                      {.chunk_size = 1000, .flush_every = Duration(0), .wait_when_full = true});
    const ChannelId a = recorder.add_channel("/a", "test.A", "{}");
    recorder.attach({0, 0, "file.txt", "text/plain", "content"});
    for (int i = 0; i < 500; ++i)
      recorder.message(a, at_ms(i), [&](std::string& out) { out += "{\"i\":" + std::to_string(i) + "}"; });
    recorder.add({"facts", {{"seed", "1"}}});
    recorder.close();
    EXPECT_EQ(recorder.report().messages, 500u);
    EXPECT_EQ(recorder.report().bytes, file.size());
    return file;
  };
  const std::string file = record();
  EXPECT_EQ(file, record());
  const auto reader = open(file);
  EXPECT_TRUE(reader->complete());
  const auto messages = texts(*reader, "/a");
  ASSERT_THAT(messages, SizeIs(500));
  EXPECT_EQ(messages[499], R"({"i":499})");
  EXPECT_THAT(texts(*reader, "/gaps"), SizeIs(0));
  EXPECT_THAT(reader->attachments(), SizeIs(1));
}

// Counts what it is given, for who waits for it.
class CountingAudience final : public Audience {
 public:
  void channel(const Channel& channel, const Schema& schema) override {
    const std::lock_guard lock(mutex_);
    channels.push_back(channel.topic + " " + schema.name);
  }
  void message(const RawMessage& message) override {
    const std::lock_guard lock(mutex_);
    messages.emplace_back(message.data);
    changed_.notify_all();
  }
  void wait_for(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return messages.size() >= count; });
  }
  std::vector<std::string> channels;
  std::vector<std::string> messages;

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
};

TEST(Recorder, GivesItsAudienceWhatItWritesBeforeAPartIsFullAndWritesTheSameBytes) {
  const auto record = [](CountingAudience* audience) {
    std::string file;
    Recorder recorder(std::make_unique<StringSink>(file),
                      {.chunk_size = 4000, .flush_every = Duration(0), .wait_when_full = true, .audience = audience});
    const ChannelId a = recorder.add_channel("/a", "test.A", "{}");
    for (std::size_t i = 0; i < 500; ++i) {
      recorder.message(a, at_ms(static_cast<std::int64_t>(i)),
                       [&](std::string& out) { out += "{\"i\":" + std::to_string(i) + "}"; });
      // Cuts parts of chunks where no other recorder does.
      if (audience != nullptr && i % 97 == 0) audience->wait_for(i + 1);
    }
    recorder.close();
    return file;
  };
  CountingAudience audience;
  EXPECT_EQ(record(&audience), record(nullptr));
  EXPECT_THAT(audience.channels, ElementsAre("/gaps sentree.Gap", "/a test.A"));
  ASSERT_THAT(audience.messages, SizeIs(500));
  EXPECT_EQ(audience.messages[499], R"({"i":499})");
}

TEST(Recorder, IsFollowedFromAnyMessageOnWhenAllBeforeAreWritten) {
  std::string file;
  Recorder recorder(std::make_unique<StringSink>(file), {.flush_every = Duration(0), .wait_when_full = true});
  const ChannelId a = recorder.add_channel("/a", "test.A", "{}");
  const auto put = [&](int i) {
    recorder.message(
        a, at_ms(i), [&](std::string& out) { out += std::to_string(i); },
        [&] {
          return LogRecord{LogLevel::kInfo, "test", std::to_string(i)};
        });
  };
  constexpr int kBefore = 100;
  for (int i = 0; i < kBefore; ++i) put(i);
  std::vector<std::string> tapped;
  const auto last = recorder.follow([&](TimePoint time, const RunRecord& record) {
    const auto& line = std::get<LogRecord>(record);
    EXPECT_EQ(time, at_ms(std::stoi(line.text)));
    tapped.push_back(line.text);
  });
  ASSERT_TRUE(last.has_value());
  EXPECT_THAT(texts(*open(file), "/a"), SizeIs(kBefore));
  put(kBefore);
  recorder.message(a, at_ms(kBefore), [](std::string& out) { out += "no record"; });
  put(kBefore + 1);
  EXPECT_THAT(tapped, ElementsAre("100", "101"));
  EXPECT_EQ(*recorder.follow({}), *last + 3);
  put(kBefore + 2);
  EXPECT_THAT(tapped, SizeIs(2));
  recorder.close();
  const auto late = recorder.follow({});
  ASSERT_FALSE(late.has_value());
  EXPECT_EQ(late.error().code, "record.ended");
}

TEST(Recorder, HasHandedOnFilesAndFactsWhenItIsFlushed) {
  std::string file;
  Recorder recorder(std::make_unique<StringSink>(file), {.flush_every = Duration(0), .wait_when_full = true});
  recorder.attach({.name = "project/mission.xml", .media_type = "text/xml", .data = std::string(100'000, 'x')});
  recorder.add({"sentree.run", {{"continues", "the-one-before.mcap"}}});
  recorder.flush();
  EXPECT_THAT(file, HasSubstr("the-one-before.mcap"));
}

TEST(Recorder, LosesMessagesRatherThanToWaitAndSaysSo) {
  HangingSink::Gate gate;
  std::string file;
  Recorder recorder(std::make_unique<HangingSink>(gate, file), {.chunk_size = 100, .flush_every = Duration(0)});
  const ChannelId a = recorder.add_channel("/a", "test.A", "{}");
  const auto put = [&](int i) { recorder.message(a, at_ms(i), [](std::string& out) { out.append(200, '1'); }); };
  int count = 0;
  while (recorder.report().lost < 10) put(count++);
  // A chunk holds one message; one more is with the writer or being filled.
  EXPECT_GE(recorder.report().messages, kWaitingBatchesMax);
  EXPECT_LE(recorder.report().messages, kWaitingBatchesMax + 2);
  EXPECT_EQ(recorder.report().gaps, 1u);
  gate.let_go();
  const std::uint64_t lost = recorder.report().lost;
  const std::uint64_t before = recorder.report().messages;
  while (recorder.report().messages == before) put(count++);
  recorder.close();
  const auto reader = open(file);
  EXPECT_EQ(texts(*reader, "/a").size(), recorder.report().messages);
  const auto gaps = texts(*reader, "/gaps");
  ASSERT_THAT(gaps, SizeIs(1));
  EXPECT_EQ(text::parse_json(gaps[0])->find("lost")->number(), static_cast<double>(recorder.report().lost));
  EXPECT_GE(recorder.report().lost, lost);
}

TEST(Recorder, WaitsWhereBytesMustNotDependOnTheDisk) {
  HangingSink::Gate gate;
  std::string file;
  Recorder recorder(std::make_unique<HangingSink>(gate, file),
                    {.chunk_size = 100, .flush_every = Duration(0), .wait_when_full = true});
  const ChannelId a = recorder.add_channel("/a", "test.A", "{}");
  std::thread run([&] {
    for (int i = 0; i < 300; ++i) recorder.message(a, at_ms(i), [](std::string& out) { out.append(200, '1'); });
  });
  while (recorder.report().messages < kWaitingBatchesMax) std::this_thread::yield();
  gate.let_go();
  run.join();
  recorder.close();
  EXPECT_EQ(recorder.report().lost, 0u);
  EXPECT_EQ(texts(*open(file), "/a").size(), 300u);
}

TEST(Recorder, AFullDiskIsToldOnceAndWhatWasWrittenOpens) {
  std::string file;
  std::vector<std::string> told;
  std::mutex mutex;
  Recorder recorder(std::make_unique<FullSink>(file, 6000), {.compression = Compression::kNone,
                                                             .chunk_size = 1000,
                                                             .flush_every = Duration(0),
                                                             .wait_when_full = true,
                                                             .on_failure = [&](const Diagnostic& why) {
                                                               const std::lock_guard lock(mutex);
                                                               told.push_back(why.message);
                                                             }});
  const ChannelId a = recorder.add_channel("/a", "test.A", "{}");
  for (int i = 0; i < 1000; ++i) recorder.message(a, at_ms(i), [](std::string& out) { out.append(100, '1'); });
  recorder.close();
  EXPECT_THAT(told, ElementsAre(HasSubstr("disk full")));
  EXPECT_TRUE(recorder.report().failed);
  const auto reader = open(file);
  EXPECT_FALSE(reader->complete());
  EXPECT_GT(texts(*reader, "/a").size(), 10u);
}

TEST(Recorder, WritesAnUnfinishedChunkAfterAWhile) {
  HangingSink::Gate gate;
  gate.let_go();
  std::string file;
  Recorder recorder(std::make_unique<HangingSink>(gate, file), {.flush_every = std::chrono::milliseconds(20)});
  const ChannelId a = recorder.add_channel("/a", "test.A", "{}");
  recorder.message(a, at_ms(1), [](std::string& out) { out += "{}"; });
  std::size_t found = 0;
  while (found == 0) {
    const std::lock_guard lock(gate.mutex);
    if (file.size() > kMagic.size()) found = texts(*open(file), "/a").size();
  }
  EXPECT_EQ(found, 1u);
}

Value random_value(Rng& rng, int depth) {
  switch (rng.below(depth > 0 ? 8 : 6)) {
    case 0: return nullptr;
    case 1: return rng.below(2) == 0;
    case 2: return static_cast<std::int64_t>(rng.next());
    case 3: return rng.normal() * 1e3;
    case 4: return "text \"\\\n\x7f ü " + std::to_string(rng.below(100));
    case 5: return Bytes{{std::byte{0}, static_cast<std::byte>(rng.below(256))}};
    case 6: {
      List list;
      for (std::uint64_t i = rng.below(4); i > 0; --i) list.push_back(random_value(rng, depth - 1));
      return list;
    }
    default: {
      Map map;
      for (std::uint64_t i = rng.below(4); i > 0; --i) map["k" + std::to_string(i)] = random_value(rng, depth - 1);
      return map;
    }
  }
}

TEST(Observation, ReadsBackAsItWas) {
  Rng rng(5);
  for (int i = 0; i < 2000; ++i) {
    SCOPED_TRACE(i);
    Message message{.sequence = rng.below(1U << 31U),
                    .time = TimePoint(Duration(static_cast<std::int64_t>(rng.next() >> 2U))),
                    .stamp = rng.below(1000),
                    .kind = static_cast<MessageKind>(rng.below(4)),
                    .source = rng.below(2) == 0 ? "a\"b" : "GoTo",
                    .target = rng.below(2) == 0 ? "" : "navigation",
                    .name = "navigation.goto.request",
                    .call = rng.below(3),
                    .tick = rng.below(100),
                    .data = random_value(rng, 3)};
    std::string out;
    append_observation(out, message);
    const auto at = static_cast<std::uint64_t>(message.time.time_since_epoch().count());
    const auto read = read_observation({1, 1, at, at, out});
    ASSERT_TRUE(read.has_value()) << out;
    EXPECT_EQ(*read, message) << out;
    const auto head = observation_head(out);
    ASSERT_EQ(head.has_value(), message.source == "GoTo") << out;
    if (!head) continue;
    EXPECT_EQ(std::tie(head->sequence, head->stamp, head->call, head->tick, head->kind),
              std::tie(message.sequence, message.stamp, message.call, message.tick, message.kind));
    EXPECT_EQ(head->source, message.source);
    EXPECT_EQ(head->target, message.target);
    EXPECT_EQ(head->name, message.name);
    EXPECT_EQ(head->data.empty(), message.data.is_null());
    for (std::size_t size = 0; size < out.size(); ++size) {
      if (const auto cut = observation_head(out.substr(0, size))) {
        EXPECT_NE(cut->data, head->data);
      }
    }
  }
}

TEST(Observation, RefusesWhatIsNone) {
  EXPECT_EQ(read_observation({1, 1, 0, 0, "{}"}).error().code, "record.not-an-observation");
  EXPECT_EQ(read_observation({1, 1, 0, 0, "[1"}).error().code, "json.syntax");
  EXPECT_EQ(read_observation({1, 1, 0, 0, R"({"kind":"event"})"}).error().code, "record.not-an-observation");
}

TEST(Foxglove, WritesJsonWithTheMembersOfItsSchema) {
  const std::vector<double> ranges{1.0, 2.5, 1.0 / 0.0, 0.1234567};
  const std::vector<std::int8_t> cells{0, 100, -1, 0};
  const std::vector<Pose> path{{1, 2, 0}, {-1.5, 0.25, 3.0}};
  const std::vector<SceneThing> things{{.id = "station",
                                        .text = "S",
                                        .pose_map = {1, 2, 0.5},
                                        .length_m = 0.4,
                                        .width_m = 0.2,
                                        .height_m = 0.1,
                                        .rgba = 0x11223344},
                                       {.id = "bin", .disc = true, .length_m = 0.4}};
  const TimePoint time = at_ms(1500);
  const auto expect_members = [](const std::string& json, std::string_view schema) {
    const auto value = text::parse_json(json);
    ASSERT_TRUE(value.has_value()) << json;
    const auto properties = text::parse_json(schema);
    for (const auto& [name, type] : *properties->find("properties")->as_map())
      EXPECT_NE(value->find(name), nullptr) << name << " in " << json;
  };
  std::string pose, poses, scan, grid, log, scene;
  PackedJson packed;
  pack_pose(packed, time, {1.25, -2, 0});
  PackedJson::unpack(pose, packed.bytes());
  packed.clear();
  append_path(poses, time, path);
  pack_scan(packed, time, {0, 0, 0}, -1.0, 0.5, ranges);
  PackedJson::unpack(scan, packed.bytes());
  append_grid(grid, time, {.origin_map = {}, .cell_m = 0.05, .columns = 2, .cells = cells});
  append_log(log, time, LogLevel::kWarning, "GoTo", "slow \"motor\"");
  append_scene(scene, time, things);
  expect_members(pose, schemas::kPose);
  expect_members(poses, schemas::kPath);
  expect_members(scan, schemas::kScan);
  expect_members(grid, schemas::kGrid);
  expect_members(log, schemas::kLog);
  expect_members(scene, schemas::kScene);
  EXPECT_EQ(pose,
            R"({"timestamp":{"sec":1,"nsec":500000000},"frame_id":"map","pose":{"position":{"x":1.25,"y":-2,"z":0},)"
            R"("orientation":{"x":0,"y":0,"z":0,"w":1}}})");
  EXPECT_THAT(scan, HasSubstr(R"("end_angle":0.5,"ranges":[1,2.5,0,0.123])"));
  EXPECT_THAT(grid, HasSubstr(R"("data":"AGT/AA==")"));
}

class Folder : public ::testing::Test {
 protected:
  fs::path add(const std::string& name, int age_s, std::size_t size = 10) {
    const fs::path path = folder_ / name;
    EXPECT_TRUE(text::write_file(path, std::string(size, 'x')));
    fs::last_write_time(path, fs::file_time_type::clock::now() - std::chrono::seconds(age_s));
    return path;
  }

  const TemporaryFolder files_{"test"};
  const fs::path folder_ = files_.path();
};

TEST_F(Folder, NamesRecordingsAfterScenarioAndTime) {
  const fs::path first = new_recording(folder_, "my run/1");
  EXPECT_THAT(first.filename().string(), ::testing::MatchesRegex("my_run_1-[0-9]+-[0-9]+.mcap"));
  ASSERT_TRUE(text::write_file(first, ""));
  EXPECT_NE(new_recording(folder_, "my run/1"), first);
}

TEST_F(Folder, RemovesTheOldestOfItsOwn) {
  const fs::path oldest = add("a-20260101-000000.mcap", 50);
  const fs::path old = add("b-c-20260101-000000-2.mcap", 40);
  add("c-20260101-000000.mcap", 30);
  add("mine.mcap", 99);
  add("notes-20260101-000000.txt", 99);
  EXPECT_THAT(remove_old(folder_, {.recordings = 2}), ElementsAre(oldest, old));
  EXPECT_THAT(remove_old(folder_, {.recordings = 2}), SizeIs(0));
  EXPECT_TRUE(fs::exists(folder_ / "mine.mcap"));
}

TEST_F(Folder, KeepsToItsSize) {
  const fs::path oldest = add("a-20260101-000000.mcap", 50, 1000);
  add("b-20260101-000000.mcap", 40, 1000);
  EXPECT_THAT(remove_old(folder_, {.recordings = 10, .bytes = 1500}), ElementsAre(oldest));
}

TEST_F(Folder, LeavesWhatWaitsToBeResumed) {
  const fs::path waits = add("a-20260101-000000.mcap", 50);
  const fs::path over = add("b-20260101-000000.mcap", 40);
  for (const fs::path& path : {waits, over})
    ASSERT_TRUE(text::write_file(fs::path(path).replace_extension(".journal"), "journal"));
  const auto removed = remove_old(folder_, {.recordings = 0},
                                  [](const fs::path& journal) { return journal.stem() == "a-20260101-000000"; });
  EXPECT_THAT(removed, ElementsAre(over));
  EXPECT_TRUE(fs::exists(fs::path(waits).replace_extension(".journal")));
  EXPECT_FALSE(fs::exists(fs::path(over).replace_extension(".journal")));
}

TEST_F(Folder, LeavesARecordingThatIsBeingWritten) {
  const fs::path path = folder_ / "a-20260101-000000.mcap";
  auto sink = FileSink::create(path);
  ASSERT_TRUE(sink.has_value());
  EXPECT_THAT(remove_old(folder_, {.recordings = 0}), SizeIs(0));
  sink->reset();
  EXPECT_THAT(remove_old(folder_, {.recordings = 0}), ElementsAre(path));
}

TEST_F(Folder, TellsWhyAFileCannotBeMade) {
  ASSERT_TRUE(text::write_file(folder_ / "file", ""));
  const auto sink = FileSink::create(folder_ / "file" / "x.mcap");
  ASSERT_FALSE(sink.has_value());
  EXPECT_EQ(sink.error().code, "record.unwritable");
}

}  // namespace
}  // namespace sentree::record
