#include "sentree/studio/groot_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <map>
#include <mutex>
#include <utility>

#include "sentree/runtime/inside.h"
#include "sentree/runtime/mission.h"
#include "sentree/runtime/steering.h"

namespace sentree::studio {

namespace {

using groot::Hook;
using project::Intervention;
using project::intervention::Breakpoint;
using project::intervention::Clear;
using project::intervention::Force;
using SteadyClock = std::chrono::steady_clock;

constexpr const char* kSource = "groot";
// Between two copies of the blackboard [wall time].
constexpr std::chrono::milliseconds kBoardPeriod{100};
// Breakpoints that were reached before whoever set them knew their numbers.
constexpr std::size_t kEarlyMax = 64;

std::int64_t wall_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace

struct GrootRun::Impl final : groot::Hooks {
  // --- In the run's threads -----------------------------------------------------------------------------------------

  void observe(const Message& message) {
    if (message.kind == MessageKind::kReply) {
      const Value* forced = any_replaced ? message.data.find("forced") : nullptr;
      if (forced != nullptr) tell_replaced(message.source);
      return;
    }
    if (message.kind != MessageKind::kEvent) return;
    if (message.name == "node.status") {
      take_status(message);
    } else if (message.name == "mission.tick" || message.name == "mission.status") {
      copy_board(message.name == "mission.status");
    } else if (message.name == "scenario.breakpoint") {
      const Value* id = message.data.find("breakpoint");
      if (id != nullptr && id->as_int() != nullptr) tell_reached(static_cast<std::uint64_t>(*id->as_int()));
    }
  }

  void take_status(const Message& message) {
    const Value* node = message.data.find("node");
    const Value* from = message.data.find("from");
    const Value* to = message.data.find("to");
    if (node == nullptr || node->as_int() == nullptr || from == nullptr || to == nullptr) return;
    const auto before = bt::parse_status(from->text());
    const auto after = bt::parse_status(to->text());
    if (!before || !after || *node->as_int() < 0) return;
    scene.changed({wall_us(), static_cast<bt::NodeId>(*node->as_int()), *before, *after});
  }

  // Whoever listens in virtual time is where the mission is stepped; in real time its actor makes the copy.
  void copy_board(bool at_once) {
    runtime::RunInside* const run = inside;
    if (run == nullptr) return;
    const auto now = SteadyClock::now();
    if (!at_once && now - board_copied < kBoardPeriod) return;
    board_copied = now;
    const auto copy = [this, run] { scene.blackboard(groot::boards(*tree, run->mission().state().tree)); };
    if (run->scheduler().is_virtual())
      copy();
    else
      run->scheduler().post(run->mission().actor(), copy);
  }

  void tell_reached(std::uint64_t id) {
    const std::lock_guard lock(ids_mutex);
    const auto found = places.find(id);
    if (found != places.end()) {
      server->reached(found->second.first, found->second.second, false);
    } else {
      if (early.size() == kEarlyMax) early.pop_front();
      early.push_back(id);
    }
  }

  void tell_replaced(const std::string& leaf) {
    const std::lock_guard lock(ids_mutex);
    for (auto one = replaced.begin(); one != replaced.end();) {
      if (one->leaf != leaf) {
        ++one;
        continue;
      }
      server->reached(one->place.first, one->place.second, one->once);
      one = one->once ? replaced.erase(one) : std::next(one);
    }
    any_replaced = !replaced.empty();
  }

  void begin(runtime::RunInside& run) {
    const std::scoped_lock lock(steering_mutex);
    inside = &run;
    steering = &run.steering();
  }
  void leave() {
    const std::scoped_lock lock(steering_mutex);
    inside = nullptr;
    steering = nullptr;
  }

  // --- In the server's thread ---------------------------------------------------------------------------------------

  // The run waits for this lock before it takes its steering away; what waits for the run is told when it ends.
  Result<void> set(const Hook& hook) override {
    const std::lock_guard lock(steering_mutex);
    if (steering == nullptr) return ended();
    const bt::NodeId node = node_of(hook);
    const bool replaces = hook.mode == Hook::Mode::kReplace;
    if (replaces && bt::is_completed(hook.desired) && !tree->is_external(node)) return not_a_leaf(node);
    const std::uint64_t before = id_of(hook);
    std::uint64_t id = 0;
    if (!replaces) {
      auto applied = steering->apply_for(breakpoint_at(hook, node), kSource);
      if (!applied) return tl::unexpected(applied.error());
      id = applied->id;
    } else if (bt::is_completed(hook.desired)) {
      auto applied = force(node, hook.desired, hook.once);
      if (!applied) return tl::unexpected(applied.error());
      id = applied->id;
    }
    forget(hook);
    note(hook, node, id);
    if (before != 0) clear(before);
    return {};
  }

  void unset(const Hook& hook) override {
    const std::lock_guard lock(steering_mutex);
    const std::uint64_t id = id_of(hook);
    forget(hook);
    if (id != 0 && steering != nullptr) clear(id);
  }

  Result<void> unlock(const Hook& hook, bt::Status desired) override {
    const std::lock_guard lock(steering_mutex);
    if (steering == nullptr) return ended();
    const bt::NodeId node = node_of(hook);
    if (bt::is_completed(desired)) {
      if (!tree->is_external(node)) return not_a_leaf(node);
      if (auto applied = force(node, desired, true); !applied) return tl::unexpected(applied.error());
    }
    const std::uint64_t id = id_of(hook);
    if (id == 0 || steering->status().breakpoint != id) return {};
    return steering->resume();
  }

  // --- With the steering's lock held --------------------------------------------------------------------------------

  static tl::unexpected<Diagnostic> ended() { return fail("groot.hook", "no run goes on"); }
  tl::unexpected<Diagnostic> not_a_leaf(bt::NodeId node) const {
    return fail("groot.hook",
                fmt::format("\"{}\" is no leaf with a skill, so nothing else can answer for it", tree->path(node)));
  }
  static bt::NodeId node_of(const Hook& hook) { return hook.uid - 1U; }

  // A leaf with a skill is asked and answers in messages; any other node is known by its status.
  Breakpoint breakpoint_at(const Hook& hook, bt::NodeId node) const {
    Breakpoint what;
    const bool is_before = hook.position == Hook::Position::kBefore;
    if (tree->is_external(node)) {
      what.target = tree->event_name(node) + (is_before ? ".tick.request" : ".tick.reply");
      return what;
    }
    what.point = Breakpoint::Point::kNode;
    what.target = tree->path(node);
    if (is_before && !tree->children(node).empty()) what.status = "RUNNING";
    return what;
  }

  Result<runtime::Steering::Applied> force(bt::NodeId node, bt::Status status, bool once) {
    return steering->apply_for(
        Force{.leaf = tree->event_name(node), .status = std::string(bt::to_string(status)), .count = once ? 1U : 0U},
        kSource);
  }

  void clear(std::uint64_t id) {
    const bool stands_there = steering->status().breakpoint == id;
    const Clear what{id};
    // One that is used up is gone already.
    (void)steering->apply_for(what, kSource);
    if (stands_there) (void)steering->resume();
  }

  using Place = std::pair<std::uint16_t, Hook::Position>;
  static Place place_of(const Hook& hook) { return {hook.uid, hook.position}; }

  std::uint64_t id_of(const Hook& hook) {
    const std::lock_guard lock(ids_mutex);
    const auto found = ids.find(place_of(hook));
    return found != ids.end() ? found->second : 0;
  }
  void forget(const Hook& hook) {
    const std::lock_guard lock(ids_mutex);
    if (const auto found = ids.find(place_of(hook)); found != ids.end()) {
      places.erase(found->second);
      ids.erase(found);
    }
    std::erase_if(replaced, [&](const Replaced& one) { return one.place == place_of(hook); });
    any_replaced = !replaced.empty();
  }
  void note(const Hook& hook, bt::NodeId node, std::uint64_t id) {
    const std::lock_guard lock(ids_mutex);
    if (id == 0) return;
    ids[place_of(hook)] = id;
    if (hook.mode == Hook::Mode::kReplace) {
      replaced.push_back({tree->event_name(node), place_of(hook), hook.once});
      any_replaced = true;
      return;
    }
    places[id] = place_of(hook);
    if (std::erase(early, id) > 0) server->reached(hook.uid, hook.position, false);
  }

  Result<void> show(const project::Plan& plan) {
    auto image = groot::describe(plan.tree, groot::new_base());
    if (!image) return tl::unexpected(image.error());
    tree = &plan.tree;
    scene.begin(std::move(*image), groot::new_tree_id());
    scene.blackboard(groot::boards(plan.tree, bt::State(plan.tree)));
    return {};
  }

  struct Replaced {
    std::string leaf;
    Place place;
    bool once;
  };
  groot::Scene scene;
  const bt::Tree* tree = nullptr;                     // of the run that goes on
  bool is_new = true;                                 // no run has been shown yet
  std::mutex steering_mutex;                          // held while a hook is set or taken away
  std::atomic<runtime::RunInside*> inside = nullptr;  // who listens asks without the lock
  runtime::Steering* steering = nullptr;
  SteadyClock::time_point board_copied{};  // of who hands on the observations
  std::mutex ids_mutex;
  std::map<Place, std::uint64_t> ids;     // of what stands
  std::map<std::uint64_t, Place> places;  // of breakpoints
  std::deque<std::uint64_t> early;
  std::vector<Replaced> replaced;
  std::atomic<bool> any_replaced = false;
  std::unique_ptr<groot::Server> server;  // last: it ends before what it uses
};

Result<std::unique_ptr<GrootRun>> GrootRun::start(const project::Plan& plan, groot::ServerOptions options) {
  auto impl = std::make_unique<Impl>();
  if (auto shown = impl->show(plan); !shown) return tl::unexpected(shown.error());
  auto server = groot::Server::start(impl->scene, impl.get(), std::move(options));
  if (!server) return tl::unexpected(server.error());
  impl->server = std::move(*server);
  return std::unique_ptr<GrootRun>(new GrootRun(std::move(impl)));
}

Result<void> GrootRun::install(const project::Plan& plan, runtime::RunOptions& options) {
  Impl* impl = impl_.get();
  {
    const std::scoped_lock lock(impl->steering_mutex, impl->ids_mutex);
    impl->ids.clear();
    impl->places.clear();
    impl->early.clear();
    impl->replaced.clear();
    impl->any_replaced = false;
    // That of the first run has been shown since the server is there.
    if (!std::exchange(impl->is_new, false)) {
      if (auto shown = impl->show(plan); !shown) return shown;
    }
  }
  impl->server->forget_hooks();
  options.listeners.push_back([impl](const Message& message) { impl->observe(message); });
  options.on_begin = [impl, next = std::move(options.on_begin)](runtime::RunInside& inside) {
    if (next) next(inside);
    impl->begin(inside);
  };
  options.on_view = [impl, next = std::move(options.on_view)](runtime::RunView* view) {
    if (next) next(view);
    if (view == nullptr) impl->leave();
  };
  return {};
}

GrootRun::GrootRun(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
GrootRun::~GrootRun() = default;
const groot::Server& GrootRun::server() const { return *impl_->server; }

}  // namespace sentree::studio
