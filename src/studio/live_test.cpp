#include "sentree/studio/live.h"

#include <gtest/gtest.h>

#include <string>

#include "sentree/base/json.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/record/reader.h"
#include "sentree/record/sink.h"
#include "sentree/runtime/run.h"
#include "sentree/studio/detail/test_support.h"
#include "sentree/text/file.h"

namespace sentree::studio {
namespace {

// A run that is recorded to a file and has no page at first.
class Attached : public ::testing::Test {
 protected:
  // Runs to the end; does `then` at the observation of that number.
  void run(std::uint64_t at, const std::function<void()>& then) {
    runtime::RunOptions options;
    live_.install(options);
    auto sink = record::FileSink::create(file_);
    ASSERT_TRUE(sink.has_value());
    recorder_ = std::make_unique<replay::RunRecorder>(plan_, std::vector<text::ReadFile>(), std::move(*sink),
                                                      replay::RecordingOptions{});
    std::uint64_t seen = 0;
    options.listeners.push_back([&](const Message&) {
      if (++seen == at) then();
    });
    recorder_->install(options);
    runtime::Run run(plan_, std::move(options));
    const runtime::RunReport report = run.execute();
    EXPECT_GT(seen, at);
    recorder_->finish(report);
    live_.ended(report);
  }

  const TemporaryFolder folder_{"test"};
  const std::string file_ = (folder_.path() / "run.mcap").string();
  project::Plan plan_ = recharge_plan("experiment1", std::chrono::seconds(30));
  Live live_{plan_};
  std::unique_ptr<replay::RunRecorder> recorder_;
};

TEST_F(Attached, ShowsWhatWasBeforeAndWhatComes) {
  run(1000, [&] {
    EXPECT_FALSE(live_.is_open());
    const auto opened = live_.open({}, *recorder_, file_);
    ASSERT_TRUE(opened.has_value()) << to_string(opened.error());
    EXPECT_TRUE(live_.is_open());
  });
  // A page that was there from the beginning would show what the recording has.
  TestClient client(live_.server().port());
  const Value state = client.next("state");
  ASSERT_FALSE(state.is_null());
  EXPECT_EQ(state.at({"run", "state"})->text(), "ended");

  const auto reader = record::Reader::open(file_);
  ASSERT_TRUE(reader.has_value());
  const Subject subject(plan_);
  History whole(subject, **reader);
  whole.read_index();
  const History& shown = live_.history();
  EXPECT_EQ(shown.end(), whole.end());
  EXPECT_EQ(shown.end_observation(), whole.end_observation());
  EXPECT_EQ(shown.violations(), whole.violations());
  EXPECT_GT(whole.violations(), 0U);
  constexpr int kMoments = 40;
  for (int i = 0; i <= kMoments; ++i) {
    const Nanoseconds time = whole.end() / kMoments * i;
    EXPECT_EQ(shown.moment(time).sequence, whole.moment(time).sequence);
    for (const History::PartId& part : whole.parts()) {
      std::string expected, got;
      whole.append(expected, part, time);
      shown.append(got, part, time);
      EXPECT_EQ(got, expected) << "part " << static_cast<int>(part.part) << " " << part.index << " at " << time;
    }
  }
  for (std::size_t i = 0; i < whole.end_observation(); i += 97) EXPECT_EQ(shown.observation(i), whole.observation(i));
}

TEST_F(Attached, OpensOnceAndAgainWhereThePortIsTaken) {
  run(100, [&] {
    ASSERT_TRUE(live_.open({}, *recorder_, file_).has_value());
    const std::uint16_t port = live_.server().port();
    ASSERT_TRUE(live_.open({}, *recorder_, file_).has_value());
    EXPECT_EQ(live_.server().port(), port);
  });
  const std::uint16_t taken = live_.server().port();

  Live other(plan_);
  const auto sink = [&] { return std::move(*record::FileSink::create(folder_.path() / "other.mcap")); };
  replay::RunRecorder recorder(plan_, {}, sink(), {});
  const auto refused = other.open({.port = taken}, recorder, (folder_.path() / "other.mcap").string());
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, "http.port-taken");
  EXPECT_THAT(refused.error().message,
              testing::StartsWith("the page: 127.0.0.1:" + std::to_string(taken) + " is taken: another process"));
  EXPECT_FALSE(other.is_open());
  EXPECT_TRUE(other.open({}, recorder, (folder_.path() / "other.mcap").string()).has_value());
}

TEST_F(Attached, SaysThatTheRecordingCannotBeReadAndTheRunGoesOn) {
  run(100, [&] {
    const auto opened = live_.open({}, *recorder_, (folder_.path() / "nothing.mcap").string());
    EXPECT_FALSE(opened.has_value());
    EXPECT_FALSE(live_.is_open());
  });
  // The recording is whole, and nothing is opened of a run that is not recorded any more.
  const auto opened = live_.open({}, *recorder_, file_);
  ASSERT_FALSE(opened.has_value());
  EXPECT_EQ(opened.error().code, "record.ended");
}

}  // namespace
}  // namespace sentree::studio
