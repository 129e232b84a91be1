// Lines that a page sends: whatever they say, all that it gets back is JSON, it gets no more than the bounds allow, and
// what it asks of the run is carried out or refused with a message. No sockets, no threads of a server.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "sentree/base/assert.h"
#include "sentree/base/json.h"
#include "sentree/project/check_intervention.h"
#include "sentree/record/sink.h"
#include "sentree/replay/recording.h"
#include "sentree/runtime/run.h"
#include "sentree/studio/detail/conversation.h"
#include "sentree/studio/detail/record_queue.h"
#include "sentree/studio/detail/steer.h"
#include "sentree/text/json.h"

namespace {

using sentree::Result;
using sentree::Value;
namespace mission = sentree::mission;
namespace project = sentree::project;
namespace replay = sentree::replay;
namespace runtime = sentree::runtime;
namespace studio = sentree::studio;

// Lines of one input, and slices that one of them may take.
constexpr int kLinesMax = 20;
constexpr int kSlicesMax = 10'000;

// Some seconds of a run, and what there is to see of it.
struct Shown {
  Shown() : plan(prepared()), subject(plan), history(subject) {
    runtime::RunOptions options;
    studio::RecordQueue queue(history);
    replay::RunRecorder recorder(plan, {}, std::make_unique<sentree::record::NullSink>(),
                                 {.compression = sentree::record::Compression::kNone,
                                  .on_failure = {},
                                  .story = {},
                                  .tap = [&](auto time, auto record) { queue.put(time, std::move(record)); }});
    recorder.install(options);
    recorder.finish(runtime::Run(plan, std::move(options)).execute());
    queue.drain();
  }

  static project::Plan prepared() {
    auto scenario = project::load_scenario(project::shipped_folder("examples") / "recharge/scenarios/experiment1.yaml");
    SENTREE_ASSERT(scenario.ok());
    scenario.value->virtual_time = true;
    scenario.value->duration = std::chrono::seconds(5);
    auto plan = project::prepare(std::move(*scenario.value));
    SENTREE_ASSERT(plan.ok());
    return std::move(*plan.value);
  }

  project::Plan plan;
  studio::Subject subject;
  studio::History history;
};

// Takes what a run of that plan would take, and does nothing.
class IdleSteering final : public runtime::Steering {
 public:
  explicit IdleSteering(const project::Plan& plan) : scope_(project::scope_of(plan)) {}

  Status status() const override { return {}; }
  Status wait_paused() override { return {}; }
  sentree::TimePoint time() const override { return {}; }
  Result<void> pause() override { return {}; }
  Result<void> resume() override { return {}; }
  Result<void> step(std::uint64_t) override { return {}; }
  Result<void> run_until(sentree::TimePoint) override { return {}; }
  Result<void> set_factor(double) override { return {}; }
  Result<Applied> apply_for(const project::Intervention& what, const std::string&) override {
    if (auto checked = project::check_intervention(what, scope_); !checked) return tl::unexpected(checked.error());
    Applied applied;
    applied.id = standing_.size() + 1;
    if (project::stands(what)) standing_.push_back({applied.id, what, 0});
    return applied;
  }
  std::vector<mission::StandingIntervention> standing() const override { return standing_; }
  std::vector<project::SteeredPart> parts() const override { return {}; }
  Result<std::string> scenario() const override { return sentree::fail("steering.ended", "nothing is written here"); }

 private:
  const project::InterventionScope scope_;
  std::vector<mission::StandingIntervention> standing_;
};

// A page that reads at once.
class Page final : public studio::MessageSink {
 public:
  explicit Page(bool& closed) : closed_(closed) {}
  bool send(std::shared_ptr<const std::string> text) override {
    SENTREE_ASSERT(sentree::text::parse_json(*text).has_value());
    return !closed_;
  }
  std::size_t queued() const override { return 0; }
  void close(std::uint16_t, std::string) override { closed_ = true; }

 private:
  bool& closed_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Shown* shown = new Shown();
  static const studio::RunAccess* nothing = new studio::RunAccess();
  static auto* composer = new studio::Composer(shown->subject, shown->history, *nothing, nullptr,
                                               {.hello = R"({"type":"hello"})", .token = "secret"});
  bool closed = false;
  studio::Conversation conversation(*composer, 1, std::make_unique<Page>(closed));
  IdleSteering steering(shown->plan);
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  for (int line = 0; line < kLinesMax && !rest.empty() && !closed; ++line) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string text(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
    conversation.received(text);
    for (int slice = 0; conversation.has_work(); ++slice) {
      SENTREE_ASSERT(slice < kSlicesMax);
      conversation.work();
    }
    conversation.send_delta();
    const auto request = sentree::text::parse_json(text);
    const Value* op = request ? request->find("op") : nullptr;
    if (op == nullptr || op->as_string() == nullptr) continue;
    const auto answer = studio::steer(steering, shown->subject, *op->as_string(), *request);
    if (answer)
      SENTREE_ASSERT(sentree::text::parse_json(to_json(*answer)).has_value());
    else
      SENTREE_ASSERT(!answer.error().message.empty());
  }
  return 0;
}
