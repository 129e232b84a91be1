#include "sentree/studio/live.h"

#include <atomic>
#include <mutex>
#include <shared_mutex>
#include <string>
#include <vector>

#include "sentree/campaign/coverage.h"
#include "sentree/runtime/inside.h"
#include "sentree/runtime/steering.h"
#include "sentree/studio/detail/alternatives.h"
#include "sentree/studio/detail/record_queue.h"
#include "sentree/studio/detail/steer.h"
#include "sentree/studio/detail/take_recording.h"
#include "sentree/studio/reached.h"
#include "sentree/studio/verified.h"

namespace sentree::studio {

namespace {

// The messages of a recording that grows, up to sequence number `last`.
Result<void> bring_in(History& history, const std::string& recording, std::uint32_t last) {
  if (last == 0) return {};  // nothing was before, and the file may not have begun
  return take_recording(history, recording, [last](const record::RawMessage& message, const record::RunRecord&) {
    return static_cast<std::int32_t>(message.sequence - last) <= 0;
  });
}

}  // namespace

struct Live::Impl {
  // What there is only with a page.
  struct Shown {
    explicit Shown(const project::Plan& plan) : subject(plan), history(subject) {}
    Subject subject;
    History history;
    RecordQueue queue{history};
    std::unique_ptr<Server> server;
  };

  explicit Impl(const project::Plan& run) : plan(run) {}

  RunAccess access() {
    return {.update = [this] { shown->queue.drain(); },
            .facts = [this] { return facts(); },
            .steer = [this](const std::string& op, const Value& request) { return steer(op, request); },
            .coverage = [this] { return reached(); },
            .verified =
                [this] {
                  return read_verified(std::filesystem::path(plan.scenario.project.folder) / "verify" / kVerifiedFile);
                }};
  }

  Result<void> serve(ServerOptions options) {
    options.live = true;
    again = options.again;
    auto server = Server::start(shown->subject, shown->history, access(), std::move(options));
    if (!server) return tl::unexpected(server.error());
    shown->server = std::move(*server);
    open = true;
    return {};
  }

  RunFacts facts() {
    const std::lock_guard lock(mutex);
    RunFacts facts;
    facts.factor = plan.scenario.factor;
    if (steering != nullptr) {
      const runtime::Steering::Status status = steering->status();
      facts.state = status.state == runtime::Steering::State::kPaused ? "paused" : "running";
      facts.factor = status.factor;
      if (status.breakpoint != 0) {
        facts.stopped_at =
            Map{{"breakpoint", static_cast<std::int64_t>(status.breakpoint)}, {"what", status.stopped_at}};
      }
    }
    if (report) {
      facts.state = "ended";
      facts.reason = report->reason;
      facts.vacuous = replay::vacuities(*report);
      facts.missed_ticks = report->timing.missed;
    }
    if (view != nullptr) {
      for (const runtime::ProcessReport& process : view->processes())
        facts.processes.push_back(Map{{"name", process.name}, {"pid", process.pid}});
    }
    return facts;
  }

  void steer_by(runtime::Steering* by) {
    const std::scoped_lock lock(steering_mutex, mutex);
    steering = by;
  }

  Result<Value> steer(const std::string& op, const Value& request) {
    if (op == "run_again") {
      if (!again) return fail("studio.not-repeatable", "this run cannot begin again from its page");
      if (const Value* const chosen = request.find("choose")) {
        if (auto can_be = alternatives.check(*chosen); !can_be) return tl::unexpected(can_be.error());
      }
      if (auto begun = again(request); !begun) return tl::unexpected(begun.error());
      return Value();
    }
    if (op == "alternatives") {
      const Value* const choices = request.find("choices");
      return alternatives.answer(choices != nullptr ? *choices : Value());
    }
    // The run waits for this before it takes its steering away. Shared: to pause does not wait for a call.
    const std::shared_lock lock(steering_mutex);
    if (steering == nullptr) {
      const std::lock_guard reading(mutex);
      return fail("steering.ended", report ? "the run has ended" : "the run has not begun yet");
    }
    return studio::steer(*steering, shown->subject, op, request);
  }

  Result<Value> reached() {
    const std::lock_guard lock(coverage_mutex);
    if (!watch) return fail("studio.coverage", "the page was opened after the run had begun: see sentree report");
    watch->look();
    return coverage_value(coverage, plan.scenario.project.folder);
  }

  const project::Plan& plan;
  std::mutex coverage_mutex;
  campaign::Coverage coverage;
  std::optional<campaign::CoverageWatch> watch;  // of a run that has its page from the beginning
  Alternatives alternatives;                     // likewise
  std::shared_mutex steering_mutex;              // held while a request is carried out
  std::mutex mutex;
  runtime::RunView* view = nullptr;
  runtime::Steering* steering = nullptr;  // while the run goes on
  std::optional<runtime::RunReport> report;
  std::function<Result<void>(const Value&)> again;  // does not change while there is a server
  std::mutex opening;
  std::atomic<bool> open = false;
  std::unique_ptr<Shown> shown;  // does not change while there is a server
};

Live::Live(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Live::Live(const project::Plan& plan) : impl_(std::make_unique<Impl>(plan)) {}
Live::~Live() = default;

Result<std::unique_ptr<Live>> Live::start(const project::Plan& plan, ServerOptions options) {
  auto impl = std::make_unique<Impl>(plan);
  impl->shown = std::make_unique<Impl::Shown>(plan);
  if (auto served = impl->serve(std::move(options)); !served) return tl::unexpected(served.error());
  return std::unique_ptr<Live>(new Live(std::move(impl)));
}

std::unique_ptr<Live> Live::beside(const project::Plan& plan) {
  auto impl = std::make_unique<Impl>(plan);
  impl->shown = std::make_unique<Impl::Shown>(plan);
  return std::unique_ptr<Live>(new Live(std::move(impl)));
}

Result<void> Live::open(ServerOptions options, replay::RunRecorder& recorder, const std::string& recording) {
  const std::lock_guard one_at_a_time(impl_->opening);
  if (impl_->open) return {};
  if (!impl_->shown) {
    impl_->shown = std::make_unique<Impl::Shown>(impl_->plan);
    Result<void> read;
    {
      const RecordQueue::Hold hold(impl_->shown->queue);
      const auto last = recorder.follow(tap());
      read = last ? bring_in(impl_->shown->history, recording, *last) : tl::unexpected(last.error());
    }
    if (!read) {
      (void)recorder.follow({});
      impl_->shown.reset();
      return read;
    }
  }
  return impl_->serve(std::move(options));
}

bool Live::is_open() const { return impl_->open; }

std::function<void(TimePoint, record::RunRecord)> Live::tap() {
  return
      [&queue = impl_->shown->queue](TimePoint time, record::RunRecord record) { queue.put(time, std::move(record)); };
}

void Live::install(runtime::RunOptions& options) {
  if (impl_->shown) {
    const std::lock_guard lock(impl_->coverage_mutex);
    impl_->watch.emplace(impl_->plan, impl_->coverage, options);
    std::vector<std::string> models;
    for (const auto& model : impl_->plan.models) models.push_back(model.name);
    impl_->alternatives.install(models, options);
  }
  options.on_view = [impl = impl_.get(), next = std::move(options.on_view)](runtime::RunView* view) {
    if (next) next(view);
    if (view == nullptr) impl->steer_by(nullptr);
    const std::lock_guard lock(impl->mutex);
    impl->view = view;
  };
  options.on_begin = [impl = impl_.get(), next = std::move(options.on_begin)](runtime::RunInside& inside) {
    if (next) next(inside);
    impl->steer_by(&inside.steering());
  };
}

void Live::steer_by(runtime::Steering* steering) { impl_->steer_by(steering); }

void Live::ended(const runtime::RunReport& report) {
  {
    const std::lock_guard lock(impl_->coverage_mutex);
    if (impl_->watch) impl_->watch->finish(report);
  }
  const std::lock_guard lock(impl_->mutex);
  impl_->report = report;
}

const Server& Live::server() const { return *impl_->shown->server; }
const History& Live::history() const { return impl_->shown->history; }
const Subject& Live::subject() const { return impl_->shown->subject; }
RunAccess Live::access() { return impl_->access(); }

}  // namespace sentree::studio
