#include "sentree/studio/watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <condition_variable>
#include <map>
#include <mutex>
#include <set>
#include <unordered_map>

#include "sentree/base/temporary_folder.h"
#include "sentree/groot/client.h"
#include "sentree/groot/message_pack.h"
#include "sentree/groot/remote_tree.h"

namespace sentree::studio {

namespace {

using groot::Ask;
using groot::Hook;
using project::Intervention;
using namespace project::intervention;
using SteadyClock = std::chrono::steady_clock;

// Between two comparisons of what was told with what is.
constexpr std::chrono::seconds kComparePeriod{1};

bt::Status status_of(groot::StatusCode code) {
  return code <= static_cast<int>(bt::Status::kFailure) ? static_cast<bt::Status>(code) : bt::Status::kIdle;
}

// What a node that is idle was before.
bt::Status status_before(groot::StatusCode code) {
  return code > groot::kIdleAfter ? status_of(static_cast<groot::StatusCode>(code - groot::kIdleAfter))
                                  : bt::Status::kIdle;
}

}  // namespace

struct Watch::Impl final : runtime::Steering {
  Impl(std::string where, std::unique_ptr<groot::Client> asked) : address(std::move(where)), client(std::move(asked)) {}

  // --- Before it is followed ----------------------------------------------------------------------------------------

  Result<void> learn() {
    const auto reply = client->ask(Ask::kTree);
    if (!reply) return tl::unexpected(reply.error());
    id = reply->tree;
    auto made = make_plan(reply->body, false);
    // Ports and scripts of types that only that program knows are no reason to see nothing.
    if (!made) made = make_plan(reply->body, true);
    return made;
  }

  Result<void> make_plan(const std::string& xml, bool bare) {
    auto read = groot::read_remote_tree(xml, {.reserved = project::kReservedNames, .bare = bare});
    if (!read) return tl::unexpected(read.error());
    const std::string yaml = fmt::format("mission: {{file: mission.xml, executed_by: {}}}\n", to_json(Value(address)));
    const auto file = folder.path() / "sentree.yaml";
    if (auto written = text::write_file(folder.path() / "mission.xml", read->mission); !written) return written;
    if (auto written = text::write_file(file, yaml); !written) return written;
    const text::ReadLog log;
    auto project = project::load_project(file);
    if (!project.ok()) return tl::unexpected(project.diagnostics.front());
    project::Scenario scenario = project::plain_scenario(std::move(*project.value));
    scenario.virtual_time = false;
    auto prepared = project::prepare(std::move(scenario));
    if (!prepared.ok()) {
      const auto error = std::find_if(prepared.diagnostics.begin(), prepared.diagnostics.end(),
                                      [](const Diagnostic& d) { return d.severity == Severity::kError; });
      return tl::unexpected(*error);
    }
    plan = std::make_unique<project::Plan>(std::move(*prepared.value));
    plan->scenario.name = bt::event_name(plan->tree.id());
    if (plan->tree.size() != read->uids.size())
      return fail("groot.tree", "the publisher's tree cannot be read: its nodes are not those of its SubTrees");
    remote = std::move(*read);
    files = log.files();
    nodes.clear();
    for (bt::NodeId node = 0; node < remote.uids.size(); ++node) nodes[remote.uids[node]] = node;
    statuses.assign(remote.uids.size(), bt::Status::kIdle);
    codes.assign(remote.uids.size(), 0);
    board_names.clear();
    for (const groot::RemoteTree::Board& board : remote.boards) {
      board_names += (board_names.empty() ? "" : ";") + board.name;
      scopes[board.name] = board.uid == 0 ? std::string() : bt::scope_path(plan->tree, nodes[board.uid]);
    }
    return {};
  }

  // --- In the thread that follows -----------------------------------------------------------------------------------

  runtime::RunReport follow(const WatchListeners& to) {
    listeners = &to;
    arm();
    compare();
    auto boards_at = SteadyClock::now();
    while (!ended) {
      look();
      if (SteadyClock::now() >= boards_at) {
        look_at_boards();
        boards_at = SteadyClock::now() + kBoardPeriod;
      }
      std::unique_lock lock(mutex);
      changed.wait_for(lock, kLookPeriod, [this] { return ended || !outbox.empty(); });
    }
    take_hooks_away();
    {
      const std::lock_guard lock(mutex);
      is_over = true;
    }
    changed.notify_all();
    runtime::RunReport report;
    report.scenario = plan->scenario.name;
    report.virtual_time = false;
    report.mission = root;
    report.ended = now();
    report.interrupted = true;
    report.observations = sequence;
    report.timing.ticks = ticks;
    return report;
  }

  Result<groot::Reply> ask(Ask type, std::optional<std::string> body = {}) {
    Result<groot::Reply> reply = [&] {
      const std::lock_guard lock(client_mutex);
      return client->ask(type, std::move(body));
    }();
    const bool silent = !reply && reply.error().code == "groot.silent";
    if (silent != is_silent) {
      is_silent = silent;
      if (listeners->problem)
        listeners->problem(silent ? reply.error().message + "; waiting for it" : address + " answers again");
      if (!silent) needs_arming = true;
    }
    if (reply && reply->tree != id) {
      other = true;
      ended = true;
    }
    return reply;
  }

  // Lets the publisher record what changes.
  void arm() {
    needs_arming = false;
    records = ask(Ask::kRecording, "start").has_value();
    armed_at = now();
  }

  void look() {
    publish_commands();
    if (needs_arming) {
      arm();
      compare();
    }
    // Somebody else may have drained the recording too. What a node is now, and nobody tells afterwards, was lost.
    const bool compares = records && SteadyClock::now() >= compare_at;
    std::optional<groot::Reply> before;
    if (compares) {
      compare_at = SteadyClock::now() + kComparePeriod;
      if (auto asked = ask(Ask::kStatus)) before = std::move(*asked);
    }
    const auto reply = ask(records ? Ask::kTransitions : Ask::kStatus);
    if (!reply || ended) return;
    if (records) {
      const auto all = groot::parse_records(reply->body);
      if (!all) return tell_unreadable(all.error());
      bool is_new = true;
      std::set<bt::NodeId> told;
      for (const groot::Record& record : *all) {
        const auto node = nodes.find(record.uid);
        if (node == nodes.end()) continue;
        if (record.status >= static_cast<int>(bt::Status::kSkipped)) {
          if (record.status == static_cast<int>(bt::Status::kSkipped)) codes[node->second] = record.status;
          continue;
        }
        told.insert(node->second);
        change(node->second, static_cast<bt::Status>(record.status), armed_at + std::chrono::microseconds(record.at_us),
               is_new);
      }
      // So many is as many as are kept, and some may be missing.
      if (all->size() >= groot::kRecordedMax)
        compare();
      else if (before)
        take_statuses(before->body, told);
    } else {
      take_statuses(reply->body);
    }
    hear();
  }

  void compare() {
    if (const auto reply = ask(Ask::kStatus)) take_statuses(reply->body);
  }

  void take_statuses(const std::string& body, const std::set<bt::NodeId>& except = {}) {
    const auto all = groot::parse_statuses(body);
    if (!all) return tell_unreadable(all.error());
    bool is_new = true;
    for (const groot::NodeStatus& status : *all) {
      const auto node = nodes.find(status.uid);
      if (node == nodes.end() || except.contains(node->second)) continue;
      // One that came to its end between two looks is idle already, and says what it was. What was before the first
      // look is no part of what is seen.
      const bool is_other = codes[node->second] != status.code;
      const bt::Status before = status_before(status.code);
      if (is_other && is_compared && before != bt::Status::kIdle) change(node->second, before, now(), is_new);
      change(node->second, status_of(status.code), now(), is_new);
      codes[node->second] = status.code;
    }
    is_compared = true;
  }

  // Once: whoever answers so does so each time.
  void tell_unreadable(const Diagnostic& why) {
    if (!std::exchange(is_unreadable, true) && listeners->problem) listeners->problem(address + ": " + why.message);
  }

  // `is_new`: nothing has been found in this look so far.
  void change(bt::NodeId node, bt::Status to, TimePoint time, bool& is_new) {
    const bt::Status from = statuses[node];
    codes[node] = groot::next_code(codes[node], to);
    if (from == to) return;
    statuses[node] = to;
    time = std::max(time, last_time);
    if (std::exchange(is_new, false)) {
      ++ticks;
      publish(event("mission", "mission.tick", Map{{"tick", static_cast<std::int64_t>(ticks)}}), time);
    }
    publish(
        event(plan->tree.path(node), "node.status",
              Map{{"node", static_cast<std::int64_t>(node)}, {"from", bt::to_string(from)}, {"to", bt::to_string(to)}}),
        time);
    if (node != 0 || to == bt::Status::kIdle || to == root) return;
    root = to;
    publish(event("mission", "mission.status", Map{{"status", bt::to_string(to)}}), time);
  }

  void look_at_boards() {
    const auto reply = ask(Ask::kBlackboard, board_names);
    const auto boards = reply ? groot::parse_message_pack(reply->body) : fail("groot.reply", "");
    if (!boards || boards->as_map() == nullptr || !listeners->blackboard) return;
    Map entries;
    for (const auto& [name, board] : *boards->as_map()) {
      const auto scope = scopes.find(name);
      if (scope != scopes.end() && board.as_map() != nullptr && !board.as_map()->empty())
        entries[scope->second] = board;
    }
    listeners->blackboard(std::max(now(), last_time), Value(std::move(entries)));
  }

  void hear() {
    for (;;) {
      const auto uid = [this] {
        const std::lock_guard lock(client_mutex);
        return client->next_reached();
      }();
      if (!uid) return;
      const std::lock_guard lock(mutex);
      for (const auto& [number, one] : standing_hooks) {
        if (one.hook.uid != *uid || one.hook.mode != Hook::Mode::kBreakpoint || stopped_at != 0) continue;
        stopped_at = number;
        stopped_what = "before " + plan->tree.path(nodes.at(*uid));
        outbox.push_back(event("scenario", "scenario.breakpoint",
                               Map{{"breakpoint", static_cast<std::int64_t>(number)}, {"what", stopped_what}}));
      }
      changed.notify_all();
    }
  }

  void publish_commands() {
    std::vector<Message> all;
    {
      const std::lock_guard lock(mutex);
      all.swap(outbox);
    }
    for (Message& message : all) publish(std::move(message), std::max(now(), last_time));
  }

  void publish(Message message, TimePoint time) {
    message.sequence = ++sequence;
    message.stamp = sequence;
    message.time = last_time = time;
    message.tick = ticks;
    for (const auto& listener : listeners->observations) listener(message);
  }

  static Message event(std::string source, std::string name, Map data) {
    Message message;
    message.source = std::move(source);
    message.name = std::move(name);
    message.data = std::move(data);
    return message;
  }

  void take_hooks_away() {
    std::map<std::uint64_t, Standing> all;
    {
      const std::lock_guard lock(mutex);
      all.swap(standing_hooks);
    }
    if (is_silent || other) return;
    for (const auto& [number, one] : all)
      (void)ask(Ask::kRemoveHook, groot::write_hook_place({.uid = one.hook.uid, .position = one.hook.position}));
  }

  [[nodiscard]] TimePoint now() const { return TimePoint(SteadyClock::now() - began); }

  // --- Steering, in other threads -----------------------------------------------------------------------------------

  struct Standing {
    Hook hook;
    Intervention what;
  };

  tl::unexpected<Diagnostic> elsewhere() const {
    return fail("steering.elsewhere",
                fmt::format("the mission is executed by {}; it takes breakpoints at nodes, forced results and to go on",
                            address));
  }

  Status status() const override {
    const std::lock_guard lock(mutex);
    return {.state = is_over           ? State::kEnded
                     : stopped_at != 0 ? State::kPaused
                                       : State::kRunning,
            .factor = 1.0,
            .breakpoint = stopped_at,
            .stopped_at = stopped_what};
  }
  Status wait_paused() override {
    {
      std::unique_lock lock(mutex);
      changed.wait(lock, [this] { return is_over || stopped_at != 0; });
    }
    return status();
  }
  TimePoint time() const override { return now(); }
  Result<void> pause() override { return elsewhere(); }
  Result<void> step(std::uint64_t) override { return elsewhere(); }
  Result<void> run_until(TimePoint) override { return elsewhere(); }
  Result<void> set_factor(double) override { return elsewhere(); }
  std::vector<project::SteeredPart> parts() const override { return {}; }
  Result<std::string> scenario() const override { return elsewhere(); }

  Result<void> resume() override {
    Hook hook;
    {
      const std::lock_guard lock(mutex);
      const auto at = standing_hooks.find(stopped_at);
      if (at == standing_hooks.end()) return {};
      hook = at->second.hook;
    }
    if (auto told = tell(Ask::kUnlock, groot::write_hook_place({.uid = hook.uid, .position = hook.position})); !told)
      return told;
    go_on();
    return {};
  }

  Result<Applied> apply_for(const Intervention& what, const std::string& source) override {
    if (const auto* cleared = std::get_if<Clear>(&what)) return clear(*cleared, source);
    const auto hook = hook_of(what);
    if (!hook) return tl::unexpected(hook.error());
    {
      const std::lock_guard lock(mutex);
      for (const auto& [number, one] : standing_hooks) {
        if (one.hook.uid == hook->uid)
          return fail("steering.taken",
                      "there is a breakpoint or a forced result at that node already; clear it first");
      }
    }
    const std::vector<Hook> hooks{*hook};
    if (auto told = tell(Ask::kInsertHook, groot::write_hooks(hooks)); !told) return tl::unexpected(told.error());
    const std::lock_guard lock(mutex);
    Applied applied;
    applied.id = ++last_number;
    standing_hooks[applied.id] = {*hook, what};
    outbox.push_back(project::injection_message(what, source, applied.id));
    changed.notify_all();
    return applied;
  }

  Result<Hook> hook_of(const Intervention& what) const {
    Hook hook;
    bt::NodeId node = bt::kNoNode;
    std::string target;
    if (const auto* at = std::get_if<Breakpoint>(&what); at != nullptr && at->point == Breakpoint::Point::kNode) {
      target = at->target;
      node = plan->tree.find(target);
    } else if (const auto* force = std::get_if<Force>(&what)) {
      target = force->leaf;
      for (const project::LeafPlan& leaf : plan->leaves) {
        if (leaf.name == target) node = leaf.node;
      }
      const auto status = bt::parse_status(force->status);
      if (!status || !bt::is_completed(*status))
        return fail("steering.elsewhere", "a node that another program executes can be forced to SUCCESS or FAILURE");
      hook.mode = Hook::Mode::kReplace;
      hook.desired = *status;
      hook.once = force->count == 1;
    } else {
      return elsewhere();
    }
    if (node == bt::kNoNode) return fail("steering.unknown-node", fmt::format("there is no node \"{}\"", target));
    hook.uid = remote.uids[node];
    return hook;
  }

  Result<Applied> clear(const Clear& what, const std::string& source) {
    Hook hook;
    {
      const std::lock_guard lock(mutex);
      const auto found = standing_hooks.find(what.id);
      if (found == standing_hooks.end())
        return fail("steering.unknown-id", fmt::format("nothing stands with the number {}", what.id));
      hook = found->second.hook;
    }
    auto told = tell(Ask::kRemoveHook, groot::write_hook_place({.uid = hook.uid, .position = hook.position}));
    // One that was used up is gone there already.
    if (!told && told.error().code != "groot.refused") return tl::unexpected(told.error());
    const std::lock_guard lock(mutex);
    standing_hooks.erase(what.id);
    outbox.push_back(project::injection_message(what, source, 0));
    if (stopped_at == what.id) {
      stopped_at = 0;
      stopped_what.clear();
    }
    changed.notify_all();
    return Applied{};
  }

  std::vector<mission::StandingIntervention> standing() const override {
    const std::lock_guard lock(mutex);
    std::vector<mission::StandingIntervention> all;
    for (const auto& [number, one] : standing_hooks) all.push_back({.id = number, .what = one.what, .used = 0});
    return all;
  }

  Result<void> tell(Ask type, std::string body) {
    const std::lock_guard lock(client_mutex);
    const auto reply = client->ask(type, std::move(body));
    if (!reply) return tl::unexpected(reply.error());
    return {};
  }
  void go_on() {
    const std::lock_guard lock(mutex);
    stopped_at = 0;
    stopped_what.clear();
  }

  const std::string address;
  TemporaryFolder folder{"watch"};
  std::mutex client_mutex;
  std::unique_ptr<groot::Client> client;
  groot::TreeId id{};
  groot::RemoteTree remote;
  std::unique_ptr<project::Plan> plan;
  std::vector<text::ReadFile> files;
  std::unordered_map<std::uint16_t, bt::NodeId> nodes;
  std::string board_names;
  std::map<std::string, std::string, std::less<>> scopes;  // of blackboards, by the publisher's name

  // Of the thread that follows.
  const WatchListeners* listeners = nullptr;
  const SteadyClock::time_point began = SteadyClock::now();
  TimePoint armed_at{};
  TimePoint last_time{};
  bool records = false;  // the publisher tells what changes; else statuses are compared
  bool needs_arming = false;
  SteadyClock::time_point compare_at{};
  bool is_silent = false;
  bool is_unreadable = false;  // what it answers, which has been told
  std::vector<bt::Status> statuses;
  std::vector<groot::StatusCode> codes;  // as the publisher has them
  bool is_compared = false;
  bt::Status root = bt::Status::kIdle;
  std::uint64_t sequence = 0;
  std::uint64_t ticks = 0;

  std::atomic<bool> ended = false;
  std::atomic<bool> other = false;
  mutable std::mutex mutex;
  std::condition_variable changed;
  bool is_over = false;
  std::vector<Message> outbox;  // what steering did, to be observed
  std::map<std::uint64_t, Standing> standing_hooks;
  std::uint64_t last_number = 0;
  std::uint64_t stopped_at = 0;
  std::string stopped_what;
};

Result<std::unique_ptr<Watch>> Watch::start(const std::string& address) {
  auto client = groot::Client::connect(address);
  if (!client) return tl::unexpected(client.error());
  auto impl = std::make_unique<Impl>(address, std::move(*client));
  if (impl->folder.path().empty()) return fail("file.unwritable", "no temporary folder can be made");
  if (auto learned = impl->learn(); !learned) return tl::unexpected(learned.error());
  return std::unique_ptr<Watch>(new Watch(std::move(impl)));
}

Watch::Watch(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Watch::~Watch() = default;

const project::Plan& Watch::plan() const { return *impl_->plan; }
const std::vector<text::ReadFile>& Watch::files() const { return impl_->files; }
runtime::Steering& Watch::steering() { return *impl_; }
runtime::RunReport Watch::follow(const WatchListeners& listeners) { return impl_->follow(listeners); }
void Watch::stop() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->ended = true;
  }
  impl_->changed.notify_all();
}
bool Watch::other_tree() const { return impl_->other; }

}  // namespace sentree::studio
