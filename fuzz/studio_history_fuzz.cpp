#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>

#include "sentree/base/assert.h"
#include "sentree/project/project.h"
#include "sentree/studio/detail/record_reader.h"
#include "sentree/studio/history.h"
#include "sentree/text/json.h"

// Messages of a recording may say anything; what the page is sent of them is JSON all the same.

namespace {

using sentree::studio::History;

const sentree::studio::Subject& subject() {
  static const sentree::project::Plan* plan = [] {
    auto scenario = sentree::project::load_scenario(sentree::project::shipped_folder("examples") /
                                                    "recharge/scenarios/experiment1.yaml");
    SENTREE_ASSERT(scenario.ok());
    auto loaded = sentree::project::prepare(std::move(*scenario.value));
    SENTREE_ASSERT(loaded.ok());
    return new sentree::project::Plan(std::move(*loaded.value));
  }();
  static const sentree::studio::Subject* shown = new sentree::studio::Subject(*plan);
  return *shown;
}

constexpr const char* kTopics[] = {"/observations",  "/charts",     "/monitors",     "/log",
                                   "/scene",         "/blackboard", "/robot/pose",   "/robot/scan",
                                   "/robot/battery", "/robot/path", "/robot/motion", "/robot/particles"};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  History history(subject());
  sentree::studio::RecordReader reader;
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  for (std::int64_t time = 0; !rest.empty(); ++time) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (line.empty()) continue;
    const auto topic = static_cast<std::size_t>(static_cast<unsigned char>(line.front())) % std::size(kTopics);
    const sentree::TimePoint at{sentree::Duration(time)};
    const auto record = reader.read(sentree::studio::topic_of(kTopics[topic]), at, line.substr(1),
                                    sentree::studio::RecordReader::Depth::kWhole);
    if (record) history.take(at, *record);
  }
  std::vector<History::Fragment> fragments;
  (void)history.refresh(fragments);
  for (std::size_t i = history.first_observation(); i < history.end_observation(); ++i) (void)history.observation(i);
  (void)history.find({.text = "x"}, 0, true, 100);
  (void)history.lanes(0, history.end(), 100);
  return 0;
}
