#include "sentree/studio/live.h"

#include <mutex>
#include <shared_mutex>

#include "sentree/runtime/inside.h"
#include "sentree/runtime/steering.h"
#include "sentree/studio/intake.h"
#include "sentree/studio/steer.h"

namespace sentree::studio {

struct Live::Impl {
  explicit Impl(const runtime::Plan& run) : plan(run), subject(run), history(subject) {}

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
      facts.missed_ticks = report->timing.missed;
    }
    if (view != nullptr) {
      for (const runtime::ProcessReport& process : view->processes())
        facts.processes.push_back(Map{{"name", process.name}, {"pid", process.pid}, {"alive", true}});
    }
    return facts;
  }

  void leave() {
    const std::scoped_lock lock(steering_mutex, mutex);
    steering = nullptr;
  }

  Result<Value> steer(const std::string& op, const Value& request) {
    // The run waits for this before it takes its steering away. Shared: to pause does not wait for a call.
    const std::shared_lock lock(steering_mutex);
    if (steering == nullptr) return fail("steering.ended", report ? "the run has ended" : "the run has not begun yet");
    return studio::steer(*steering, subject, op, request);
  }

  const runtime::Plan& plan;
  Subject subject;
  History history;
  Intake intake{history};
  std::shared_mutex steering_mutex;  // held while a request is carried out
  std::mutex mutex;
  runtime::RunView* view = nullptr;
  runtime::Steering* steering = nullptr;  // while the run goes on
  std::optional<runtime::RunReport> report;
  std::unique_ptr<Server> server;
};

Live::Live(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Live::~Live() = default;

Result<std::unique_ptr<Live>> Live::start(const runtime::Plan& plan, ServerOptions options) {
  auto impl = std::make_unique<Impl>(plan);
  options.live = true;
  auto server = Server::start(
      impl->subject, impl->history,
      {.update = [raw = impl.get()] { raw->intake.drain(); },
       .facts = [raw = impl.get()] { return raw->facts(); },
       .steer = [raw = impl.get()](const std::string& op, const Value& request) { return raw->steer(op, request); }},
      std::move(options));
  if (!server) return tl::unexpected(server.error());
  impl->server = std::move(*server);
  return std::unique_ptr<Live>(new Live(std::move(impl)));
}

std::function<void(const record::Channel&, TimePoint, std::string_view)> Live::tap() {
  return [&intake = impl_->intake](const record::Channel& channel, TimePoint time, std::string_view packed) {
    intake.take(channel, time, packed);
  };
}

void Live::install(runtime::RunOptions& options) {
  options.on_view = [impl = impl_.get(), next = std::move(options.on_view)](runtime::RunView* view) {
    if (next) next(view);
    if (view == nullptr) impl->leave();
    const std::lock_guard lock(impl->mutex);
    impl->view = view;
  };
  options.on_begin = [impl = impl_.get(), next = std::move(options.on_begin)](runtime::RunInside& inside) {
    if (next) next(inside);
    const std::scoped_lock lock(impl->steering_mutex, impl->mutex);
    impl->steering = &inside.steering();
  };
}

void Live::ended(const runtime::RunReport& report) {
  const std::lock_guard lock(impl_->mutex);
  impl_->report = report;
}

const Server& Live::server() const { return *impl_->server; }
const History& Live::history() const { return impl_->history; }

}  // namespace sentree::studio
