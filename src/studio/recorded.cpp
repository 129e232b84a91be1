#include "sentree/studio/recorded.h"

#include "sentree/studio/reached.h"
#include "sentree/text/json.h"

namespace sentree::studio {

struct Recorded::Impl {
  Impl(replay::RecordedRun recording, project::Plan recorded_plan)
      : run(std::move(recording)), plan(std::move(recorded_plan)), subject(plan), history(subject, run.reader()) {
    // Recordings from before it was kept have none.
    if (auto kept = text::parse_json(run.fact("vacuous")); kept && kept->as_map() != nullptr)
      vacuous = std::move(*kept->as_map());
  }

  RunFacts facts() const {
    RunFacts facts;
    facts.state = "ended";
    facts.reason = run.fact("reason");
    facts.vacuous = vacuous;
    return facts;
  }

  // Reached by running it again, once.
  Result<Value> reached() {
    if (!coverage) {
      const auto found = reached_by(path, allow_plugins);
      if (!found) return tl::unexpected(found.error());
      coverage = coverage_value(found->coverage, found->folder);
    }
    return *coverage;
  }

  replay::RecordedRun run;
  std::string path;
  bool allow_plugins = false;
  std::optional<Value> coverage;  // of the thread that steers
  project::Plan plan;
  Subject subject;
  History history;
  Map vacuous;
  std::unique_ptr<Server> server;
};

Recorded::Recorded(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Recorded::~Recorded() = default;

Result<std::unique_ptr<Recorded>> Recorded::open(const std::string& path, bool allow_plugins, ServerOptions options,
                                                 Diagnostics& diagnostics) {
  auto run = replay::RecordedRun::open(path);
  if (!run) return tl::unexpected(run.error());
  auto scenario = run->scenario(allow_plugins);
  diagnostics = scenario.diagnostics;
  if (!scenario.ok()) return fail("record.no-project", "the recorded project cannot be loaded", SourceSpan{path});
  auto plan = project::prepare(std::move(*scenario.value));
  diagnostics.insert(diagnostics.end(), plan.diagnostics.begin(), plan.diagnostics.end());
  if (!plan.ok()) return fail("record.no-project", "the recorded project cannot be loaded", SourceSpan{path});
  auto impl = std::make_unique<Impl>(std::move(*run), std::move(*plan.value));
  impl->path = path;
  impl->allow_plugins = allow_plugins;
  impl->history.read_index();
  options.live = false;
  auto server = Server::start(impl->subject, impl->history,
                              {.update = {},
                               .facts = [raw = impl.get()] { return raw->facts(); },
                               .steer = {},
                               .coverage = [raw = impl.get()] { return raw->reached(); }},
                              std::move(options));
  if (!server) return tl::unexpected(server.error());
  impl->server = std::move(*server);
  return std::unique_ptr<Recorded>(new Recorded(std::move(impl)));
}

const Server& Recorded::server() const { return *impl_->server; }
const History& Recorded::history() const { return impl_->history; }

}  // namespace sentree::studio
