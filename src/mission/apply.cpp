#include "sentree/mission/apply.h"

#include <utility>
#include <variant>

#include <fmt/format.h>

namespace sentree::mission {

namespace {

using namespace project::intervention;

class Application {
 public:
  Application(const project::Intervention& what, const std::string& source, Intervened& run)
      : what_(what), source_(source), run_(run) {}

  Result<Applied> apply() {
    return std::visit([this](const auto& what) { return apply(what); }, what_);
  }

 private:
  void tell(std::uint64_t id = 0) { run_.publish(project::injection_message(what_, source_, id)); }

  template <class Standing>
  requires(Standing::kKind.stands) Result<Applied> apply(const Standing& /*what*/) {
    const auto id = run_.next_id();
    if (!id) return tl::unexpected(id.error());
    // Observed before it has an effect, and not itself what a breakpoint waits for.
    tell(*id);
    run_.stand(*id, what_);
    return Applied{.id = *id, .outcome = {}};
  }
  Result<Applied> apply(const Clear& clear) {
    if (auto cleared = run_.end_standing(clear.id); !cleared) return tl::unexpected(cleared.error());
    tell();
    return Applied{};
  }
  Result<Applied> apply(const project::intervention::Stop& /*what*/) {
    tell();
    run_.stop_mission();
    return Applied{};
  }
  Result<Applied> apply(const project::intervention::Call& call) {
    tell();
    auto outcome = run_.call_service(call);
    if (!outcome) return tl::unexpected(outcome.error());
    return Applied{.id = 0, .outcome = std::move(*outcome)};
  }
  Result<Applied> apply(const Kill& kill) {
    const auto killed = run_.is_killed(kill.part);
    if (!killed) return nobody(kill.part);
    if (*killed) return fail("steering.part-state", fmt::format("\"{}\" is killed already", kill.part));
    const TimePoint asked = run_.now();
    tell();
    run_.kill_part(kill.part, asked);
    return Applied{};
  }
  Result<Applied> apply(const Restart& restart) {
    const bool is_process = run_.is_process(restart.part);
    const auto killed = is_process ? run_.restart_process(restart.part) : run_.is_killed(restart.part);
    if (!killed) return nobody(restart.part);
    if (!*killed) return fail("steering.part-state", fmt::format("\"{}\" has not been killed", restart.part));
    const TimePoint asked = run_.now();
    tell();
    if (!is_process) run_.restart_part(restart.part, asked);
    return Applied{};
  }

  static tl::unexpected<Diagnostic> nobody(const std::string& part) {
    return fail("verify.fault", fmt::format("nothing in the mission is called \"{}\"", part));
  }

  const project::Intervention& what_;
  const std::string& source_;
  Intervened& run_;
};

}  // namespace

Result<Applied> apply(const project::Intervention& what, const std::string& source, Intervened& run) {
  return Application(what, source, run).apply();
}

}  // namespace sentree::mission
