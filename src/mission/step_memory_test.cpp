#include "sentree/mission/step_memory.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <string>

#include "sentree/scxml/loader.h"
#include "sentree/scxml/step.h"

namespace sentree::mission {
namespace {

// A session of a chart, whose steps are remembered.
class Remembered {
 public:
  explicit Remembered(const std::string& counts)
      : chart_(load("<scxml xmlns='http://www.w3.org/2005/07/scxml' version='1.0' datamodel='ecmascript'><datamodel>"
                    "<data id='n' expr='0'/></datamodel><state id='s'><transition event='e'><assign location='n' "
                    "expr='" +
                    counts + "'/></transition></state></scxml>")),
        memory_(chart_) {
    begin();
  }

  void begin() {
    step("begin", true, [&] { scxml::start(chart_, session_, {}, TimePoint{}, effects_); });
  }
  void send() {
    const scxml::Event event{.name = "e"};
    step(StepMemory::name_of(event), false, [&] { scxml::step(chart_, session_, event, TimePoint{}, effects_); });
  }
  [[nodiscard]] const StepMemory& memory() const { return memory_; }
  [[nodiscard]] std::int64_t n() const { return *session_.data(chart_).find("n")->as_int(); }

 private:
  static scxml::Chart load(const std::string& source) {
    auto chart = scxml::load(source, "counter.scxml");
    EXPECT_TRUE(chart.ok()) << (chart.ok() ? "" : to_string(chart.diagnostics.front()));
    return *chart.value;
  }
  void step(const std::string& what, bool begins, const std::function<void()>& execute) {
    effects_.clear();
    memory_.step(
        what, begins, session_, TimePoint{}, effects_, [](const Choice&) { return 0; }, [](const StepMemory::Seen&) {},
        [&] {
          execute();
          return true;
        });
  }

  scxml::Chart chart_;
  scxml::Session session_;
  scxml::Effects effects_;
  StepMemory memory_;
};

TEST(StepMemory, LooksUpStepsThatComeAgain) {
  Remembered chart("(n + 1) % 3");
  for (int i = 0; i < 10'000; ++i) chart.send();
  EXPECT_EQ(chart.n(), 10'000 % 3);
  EXPECT_EQ(chart.memory().executed(), 1U + 3U) << "its beginning, and each value once";
}

TEST(StepMemory, GivesUpAChartWhoseStepsDoNotComeAgain) {
  Remembered chart("n + 1");
  for (std::uint64_t i = 0; i < StepMemory::kTried; ++i) chart.send();
  EXPECT_EQ(chart.n(), static_cast<std::int64_t>(StepMemory::kTried));
  chart.begin();
  chart.send();
  EXPECT_EQ(chart.n(), 1);
  EXPECT_EQ(chart.memory().looked_up(), 0U) << "what is not worth it is kept no longer";
}

}  // namespace
}  // namespace sentree::mission
