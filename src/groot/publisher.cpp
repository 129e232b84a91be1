#include "sentree/groot/publisher.h"

#include <condition_variable>
#include <map>
#include <mutex>

#include "sentree/bt/hooks.h"
#include "sentree/groot/detail/wall.h"

namespace sentree::groot {

namespace {

using SteadyClock = std::chrono::steady_clock;
// Between two copies of the blackboard.
constexpr std::chrono::milliseconds kBoardPeriod{100};

}  // namespace

struct Publisher::Impl final : bt::Observer, Hooks {
  explicit Impl(exec::Executor& shown) : executor(shown), next(shown.runner().effects().observer) {}
  ~Impl() override {
    bt::Effects& effects = executor.runner().effects();
    if (server) {
      effects.observer = next;
      if (effects.hooks == &around) effects.hooks = nullptr;
    }
    let_go();
    server.reset();
  }

  // --- In the thread that ticks -------------------------------------------------------------------------------------

  void status_changed(bt::NodeId node, bt::Status from, bt::Status to, TimePoint time) override {
    scene.changed({wall_us(), node, from, to});
    if (next != nullptr) next->status_changed(node, from, to, time);
    if (node == 0 && bt::is_completed(to)) copy_board();
  }
  void skipped(bt::NodeId node, TimePoint time) override {
    scene.skipped(node, wall_us());
    if (next != nullptr) next->skipped(node, time);
  }
  // Between two nodes nothing of the state is in the middle of a change.
  void copy_board() {
    const bt::Runner& runner = executor.runner();
    scene.blackboard(boards(runner.tree(), runner.state()));
  }

  bt::Status at(bt::NodeId node, Hook::Position position) {
    if (node == 0 && position == Hook::Position::kBefore && SteadyClock::now() - board_copied >= kBoardPeriod) {
      board_copied = SteadyClock::now();
      copy_board();
    }
    if (!any) return bt::Status::kIdle;
    std::unique_lock lock(mutex);
    const auto found = hooks.find({uid_of(node), position});
    if (found == hooks.end()) return bt::Status::kIdle;
    const Hook hook = found->second;
    const bool is_replacement = hook.mode == Hook::Mode::kReplace;
    server->reached(hook.uid, position, is_replacement && hook.once);
    if (is_replacement) {
      if (hook.once) hooks.erase(found);
      return hook.desired;
    }
    waiting = {hook.uid, position};
    instead = bt::Status::kSkipped;
    changed.wait(lock, [this] { return !waiting; });
    return instead;
  }

  // --- In the server's thread ---------------------------------------------------------------------------------------

  Result<void> set(const Hook& hook) override {
    const std::lock_guard lock(mutex);
    if (over) return fail("groot.hook", "the run is about to end");
    hooks[{hook.uid, hook.position}] = hook;
    any = true;
    if (hook.mode == Hook::Mode::kReplace) wake({hook.uid, hook.position}, hook.desired);
    return {};
  }
  void unset(const Hook& hook) override {
    const std::lock_guard lock(mutex);
    hooks.erase({hook.uid, hook.position});
    wake({hook.uid, hook.position}, bt::Status::kSkipped);
  }
  Result<void> unlock(const Hook& hook, bt::Status desired) override {
    const std::lock_guard lock(mutex);
    wake({hook.uid, hook.position}, desired);
    return {};
  }

  void let_go() {
    const std::lock_guard lock(mutex);
    over = true;
    hooks.clear();
    if (waiting) wake(*waiting, bt::Status::kSkipped);
  }

  using Place = std::pair<std::uint16_t, Hook::Position>;
  // With the lock held.
  void wake(const Place& place, bt::Status desired) {
    if (waiting != place) return;
    waiting.reset();
    instead = desired;
    changed.notify_all();
  }

  exec::Executor& executor;
  bt::Observer* next;
  bt::TickHooks around;
  Scene scene;
  SteadyClock::time_point board_copied{};
  std::mutex mutex;
  std::condition_variable changed;
  std::map<Place, Hook> hooks;
  std::atomic<bool> any = false;
  std::optional<Place> waiting;               // where the thread that ticks waits
  bt::Status instead = bt::Status::kSkipped;  // what it goes on with
  bool over = false;
  std::unique_ptr<Server> server;
};

Result<std::unique_ptr<Publisher>> Publisher::start(exec::Executor& executor, ServerOptions options) {
  auto impl = std::make_unique<Impl>(executor);
  bt::Effects& effects = executor.runner().effects();
  const bt::Tree& tree = executor.runner().tree();
  auto image = describe(tree, new_base());
  if (!image) return tl::unexpected(image.error());
  impl->scene.begin(std::move(*image), new_tree_id());
  const bool is_free = effects.hooks == nullptr;
  auto server = Server::start(impl->scene, is_free ? impl.get() : nullptr, std::move(options));
  if (!server) return tl::unexpected(server.error());
  impl->server = std::move(*server);
  effects.observer = impl.get();
  if (is_free) {
    for (bt::NodeId node = 0; node < tree.size(); ++node) {
      bt::NodeHooks& hooks = impl->around.at(node);
      hooks.before = [raw = impl.get()](bt::NodeId id) { return raw->at(id, Hook::Position::kBefore); };
      hooks.after = [raw = impl.get()](bt::NodeId id, bt::Status) { return raw->at(id, Hook::Position::kAfter); };
    }
    effects.hooks = &impl->around;
  }
  return std::unique_ptr<Publisher>(new Publisher(std::move(impl)));
}

Publisher::Publisher(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Publisher::~Publisher() = default;

const Server& Publisher::server() const { return *impl_->server; }
void Publisher::let_go() { impl_->let_go(); }

}  // namespace sentree::groot
