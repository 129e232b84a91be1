#include "sentree/studio/recorded.h"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <future>
#include <optional>
#include <variant>
#include <vector>

#include "sentree/studio/detail/take_recording.h"
#include "sentree/studio/reached.h"
#include "sentree/studio/verified.h"
#include "sentree/text/json.h"

namespace sentree::studio {

namespace {

// How long a page waits until all of a recording has been read; it sees the rest come.
constexpr std::chrono::seconds kOpenedWhole{1};

// Recordings of one run that was resumed again and again.
constexpr std::size_t kPartsMax = 100;

// A recording that a resumed run continues, and where the next one takes over.
struct EarlierPart {
  std::string path;
  TimePoint until{};
  std::uint64_t next_sequence = 0;
};

std::uint64_t first_sequence(replay::RecordedRun& run) {
  std::uint64_t first = 0;
  (void)run.each([&](const Message& message) {
    first = message.sequence;
    return false;
  });
  return first;
}

// The recordings before this one that stand beside it, the first one first, as far back as they are of the same plan.
std::vector<EarlierPart> parts_before(const std::string& path, replay::RecordedRun& run) {
  std::vector<EarlierPart> parts;
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  const std::string plan = run.fact("plan");
  std::string before = run.fact("continues");
  TimePoint until{Duration(std::atoll(run.fact("continues_at_ns").c_str()))};
  std::uint64_t next = first_sequence(run);
  while (!before.empty() && parts.size() < kPartsMax) {
    // A name, and no way to another folder.
    const std::string file = (folder / std::filesystem::path(before).filename()).string();
    auto earlier = replay::RecordedRun::open(file);
    if (!earlier || plan.empty() || earlier->fact("plan") != plan) break;
    parts.insert(parts.begin(), {file, until, next});
    before = earlier->fact("continues");
    until = TimePoint(Duration(std::atoll(earlier->fact("continues_at_ns").c_str())));
    next = first_sequence(*earlier);
  }
  return parts;
}

}  // namespace

struct Recorded::Impl {
  Impl(replay::RecordedRun recording, project::Plan recorded_plan, bool alone)
      : run(std::move(recording)), plan(std::move(recorded_plan)), subject(plan) {
    // Of several recordings everything is kept in memory, as of a run that goes on.
    if (alone)
      history.emplace(subject, run.reader());
    else
      history.emplace(subject);
    // Recordings from before it was kept have none.
    if (auto kept = text::parse_json(run.fact("vacuous")); kept && kept->as_map() != nullptr)
      vacuous = std::move(*kept->as_map());
  }

  ~Impl() { left = true; }  // what is being read is left before it goes, as the member that reads is the last

  // Of one recording.
  void read_index() {
    reading = std::async(std::launch::async, [this] { history->read_index([this] { return !left; }); });
    (void)reading.wait_for(kOpenedWhole);
  }

  RunFacts facts() const {
    RunFacts facts;
    facts.state = "ended";
    facts.reason = run.fact("reason");
    if (const double part = history->read_so_far(); part < 1)
      facts.reason = fmt::format("{} % of the recording has been read", std::lround(std::floor(part * 100)));
    facts.vacuous = vacuous;
    return facts;
  }

  // Reached by running it again, once.
  Result<Value> reached() {
    if (!coverage) {
      const auto found = reached_by(path, code);
      if (!found) return tl::unexpected(found.error());
      coverage = coverage_value(found->coverage, found->folder);
    }
    return *coverage;
  }

  replay::RecordedRun run;
  std::string path;
  replay::RecordedCode code = replay::RecordedCode::kRefused;
  std::optional<Value> coverage;  // of the thread that steers
  project::Plan plan;
  Subject subject;
  std::optional<History> history;
  Map vacuous;
  std::atomic<bool> left = false;
  std::future<void> reading;  // its end waits
  std::unique_ptr<Server> server;
};

Recorded::Recorded(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Recorded::~Recorded() = default;

Result<std::unique_ptr<Recorded>> Recorded::read(const std::string& path, replay::RecordedCode code,
                                                 Diagnostics& diagnostics) {
  auto run = replay::RecordedRun::open(path);
  if (!run) return tl::unexpected(run.error());
  auto scenario = run->scenario(code);
  diagnostics = scenario.diagnostics;
  if (!scenario.ok()) return fail("record.no-project", "the recorded project cannot be loaded", SourceSpan{path});
  auto plan = project::prepare(std::move(*scenario.value));
  diagnostics.insert(diagnostics.end(), plan.diagnostics.begin(), plan.diagnostics.end());
  if (!plan.ok()) return fail("record.no-project", "the recorded project cannot be loaded", SourceSpan{path});
  const auto before = parts_before(path, *run);
  auto impl = std::make_unique<Impl>(std::move(*run), std::move(*plan.value), before.empty());
  impl->path = path;
  impl->code = code;
  if (before.empty()) impl->read_index();
  for (const EarlierPart& part : before) {
    // What it says of the time after is said again by the next one.
    const auto taken = take_recording(*impl->history, part.path,
                                      [&part](const record::RawMessage& raw, const record::RunRecord& record) {
                                        if (const auto* message = std::get_if<Message>(&record))
                                          return message->sequence < part.next_sequence;
                                        return TimePoint(Duration(raw.log_time)) <= part.until;
                                      });
    if (!taken) return tl::unexpected(taken.error());
  }
  if (!before.empty()) {
    const auto taken = take_recording(*impl->history, path, [](const auto&, const auto&) { return true; });
    if (!taken) return tl::unexpected(taken.error());
  }
  return std::unique_ptr<Recorded>(new Recorded(std::move(impl)));
}

Result<std::unique_ptr<Recorded>> Recorded::open(const std::string& path, replay::RecordedCode code,
                                                 ServerOptions options, Diagnostics& diagnostics) {
  auto recorded = read(path, code, diagnostics);
  if (!recorded) return tl::unexpected(recorded.error());
  options.live = false;
  auto server =
      Server::start((*recorded)->subject(), (*recorded)->history(), (*recorded)->access(), std::move(options));
  if (!server) return tl::unexpected(server.error());
  (*recorded)->impl_->server = std::move(*server);
  return recorded;
}

const Server& Recorded::server() const { return *impl_->server; }
const History& Recorded::history() const { return *impl_->history; }
const Subject& Recorded::subject() const { return impl_->subject; }
RunAccess Recorded::access() {
  return {.update = {},
          .facts = [raw = impl_.get()] { return raw->facts(); },
          .steer = {},
          .coverage = [raw = impl_.get()] { return raw->reached(); },
          .verified =
              [raw = impl_.get()] {
                return read_verified(std::filesystem::path(raw->path).parent_path() / kVerifiedFile);
              }};
}

}  // namespace sentree::studio
