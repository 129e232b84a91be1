#include "sentree/studio/groot_play.h"

#include <condition_variable>
#include <mutex>
#include <set>
#include <thread>

#include "sentree/record/observation.h"
#include "sentree/replay/recorded_run.h"
#include "sentree/text/json.h"

namespace sentree::studio {

namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::string_view kBlackboardTopic = "/blackboard";
// How often it is looked whether Groot has asked.
constexpr std::chrono::milliseconds kLookPeriod{50};

}  // namespace

struct GrootPlay::Impl {
  Impl(replay::RecordedRun recording, project::Plan recorded, double speed)
      : run(std::move(recording)), plan(std::move(recorded)), factor(speed) {}
  ~Impl() {
    {
      const std::lock_guard lock(mutex);
      stop = true;
    }
    changed.notify_all();
    if (thread.joinable()) thread.join();
    server.reset();
  }

  Result<void> begin() {
    auto image = groot::describe(plan.tree, groot::new_base());
    if (!image) return tl::unexpected(image.error());
    scene.begin(std::move(*image), groot::new_tree_id());
    return {};
  }

  void work() {
    std::uint64_t seen = 0;
    for (bool is_first = true;; is_first = false) {
      {
        std::unique_lock lock(mutex);
        while (!stop && server->trees_asked() == seen) changed.wait_for(lock, kLookPeriod);
        if (stop) return;
      }
      // Groot asks again when the numbers of the next time are new to it; that is no wish to begin once more.
      if (!is_first) (void)begin();
      play();
      seen = server->trees_asked();
    }
  }

  void play() {
    const auto began = SteadyClock::now();
    const auto board_channels = run.reader().channels_of(kBlackboardTopic);
    const std::set<record::ChannelId> boards(board_channels.begin(), board_channels.end());
    record::Query query{.channels = run.reader().channels_of(record::kObservationsTopic)};
    query.channels.insert(query.channels.end(), board_channels.begin(), board_channels.end());
    // What cannot be read is the end of it, as for the page.
    (void)run.reader().read(query, [&](const record::RawMessage& raw) {
      const bool is_board = boards.contains(raw.channel);
      if (!is_board && raw.data.find("\"node.status\"") == std::string::npos) return true;
      const double after_ns = static_cast<double>(raw.log_time) / factor;
      const auto due = began + Duration(static_cast<std::int64_t>(std::min(after_ns, 9e18 / 2)));
      {
        std::unique_lock lock(mutex);
        if (changed.wait_until(lock, due, [this] { return stop; })) return false;
      }
      if (is_board) {
        if (auto entries = text::parse_json(raw.data)) scene.blackboard(std::move(*entries));
      } else if (const auto message = record::read_observation(raw)) {
        show(*message);
      }
      return true;
    });
  }

  void show(const Message& message) {
    const Value* node = message.name == "node.status" ? message.data.find("node") : nullptr;
    const Value* from = message.data.find("from");
    const Value* to = message.data.find("to");
    if (node == nullptr || node->as_int() == nullptr || *node->as_int() < 0 || from == nullptr || to == nullptr) return;
    const auto before = bt::parse_status(from->text());
    const auto after = bt::parse_status(to->text());
    if (!before || !after) return;
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    scene.changed({std::chrono::duration_cast<std::chrono::microseconds>(now).count(),
                   static_cast<bt::NodeId>(*node->as_int()), *before, *after});
  }

  replay::RecordedRun run;
  project::Plan plan;
  const double factor;
  groot::Scene scene;
  std::unique_ptr<groot::Server> server;
  std::mutex mutex;
  std::condition_variable changed;
  bool stop = false;
  std::thread thread;
};

Result<std::unique_ptr<GrootPlay>> GrootPlay::start(const std::string& path, replay::RecordedCode code, double factor,
                                                    groot::ServerOptions options, Diagnostics& diagnostics) {
  auto run = replay::RecordedRun::open(path);
  if (!run) return tl::unexpected(run.error());
  auto scenario = run->scenario(code);
  diagnostics = scenario.diagnostics;
  auto plan = scenario.ok() ? project::prepare(std::move(*scenario.value)) : Loaded<project::Plan>();
  diagnostics.insert(diagnostics.end(), plan.diagnostics.begin(), plan.diagnostics.end());
  if (!plan.ok()) return fail("record.no-project", "the recorded project cannot be loaded", SourceSpan{path});
  auto impl = std::make_unique<Impl>(std::move(*run), std::move(*plan.value), factor);
  if (auto begun = impl->begin(); !begun) return tl::unexpected(begun.error());
  auto server = groot::Server::start(impl->scene, nullptr, std::move(options));
  if (!server) return tl::unexpected(server.error());
  impl->server = std::move(*server);
  impl->thread = std::thread([raw = impl.get()] { raw->work(); });
  return std::unique_ptr<GrootPlay>(new GrootPlay(std::move(impl)));
}

GrootPlay::GrootPlay(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
GrootPlay::~GrootPlay() = default;
const groot::Server& GrootPlay::server() const { return *impl_->server; }

}  // namespace sentree::studio
