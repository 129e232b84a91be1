#include "sentree/cli/verify_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <map>
#include <mutex>
#include <stdexcept>
#include <system_error>
#include <thread>

#include "sentree/cli/available_memory.h"
#include "sentree/cli/output.h"
#include "sentree/cli/share.h"
#include "sentree/cli/verify_result.h"
#include "sentree/cli/watched_work.h"
#include "sentree/project/faults_file.h"
#include "sentree/verify/monitor_memory.h"

namespace sentree::cli {

namespace {

// Of statistics: ten years.
constexpr std::chrono::hours kRunMax{24 * 3652};

// As much for the states of the mission, and again for requirements beside them: together three quarters of what there
// is.
// @param shares  Who takes so much.
std::uint64_t memory_by_default(std::uint64_t most, std::size_t shares = 1) {
  const std::uint64_t available = available_memory();
  return available == 0 ? most : std::min(most, available / 8 * 3 / std::max<std::size_t>(1, shares));
}

}  // namespace

std::optional<std::uint64_t> bytes_of(const std::string& text) {
  const std::map<std::string, double> units{{"", 1}, {"B", 1}, {"kB", 1e3}, {"MB", 1e6}, {"GB", 1e9}};
  std::size_t end = 0;
  double number = 0;
  try {
    number = std::stod(text, &end);
  } catch (const std::exception&) {
    return std::nullopt;
  }
  while (end < text.size() && text[end] == ' ') ++end;
  const auto unit = units.find(text.substr(end));
  if (unit == units.end() || !(number > 0) || number * unit->second > 1e18) return std::nullopt;
  return static_cast<std::uint64_t>(number * unit->second);
}

verify::Each in_threads(std::size_t threads) {
  if (threads <= 1) return {};
  return [threads](std::size_t count, const std::function<void(std::size_t)>& work) {
    std::atomic<std::size_t> next = 0;
    WorkWatch* const watch = Watching::of_this_thread();
    const auto worker = [&] {
      for (std::size_t i = next++; i < count; i = next++) work(i);
    };
    std::vector<std::thread> others;
    std::mutex mutex;
    std::exception_ptr thrown;  // the first
    const auto guarded = [&] {
      try {
        worker();
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!thrown) thrown = std::current_exception();
        next = count;
      }
    };
    try {
      while (others.size() + 1 < std::min(threads, count)) {
        others.emplace_back([&] {
          const Watching watching(watch);
          guarded();
        });
      }
    } catch (const std::system_error&) {
      // Those that there are do it all.
    }
    guarded();
    for (std::thread& other : others) other.join();
    if (thrown) std::rethrow_exception(thrown);
  };
}

std::string Sampled::left_out() const {
  if (faults_left_out == 0) return {};
  return fmt::format("left out: the {} of verify:, since nobody says how likely {}; exploring tries {}\n",
                     faults_left_out == 1 ? "fault" : fmt::format("{} faults", faults_left_out),
                     faults_left_out == 1 ? "it is" : "they are", faults_left_out == 1 ? "it" : "them");
}

std::variant<Sampled, int> read_statistics(const VerifyCommand& command, const project::Plan& plan) {
  Sampled out;
  if (!command.faults.empty() && command.faults != "none") {
    say(
        fmt::format("--faults {}: nobody says how likely faults are, so none comes in statistics; what each of them "
                    "does is tried without --runs, --at-least and --split",
                    command.faults));
    return kUsage;
  }
  if (command.faults != "none") out.faults_left_out = plan.scenario.project.verify.faults.size();
  const auto confidence = share("--confidence", command.confidence);
  if (!confidence) return kUsage;
  out.confidence = *confidence;
  const auto& only = command.only;
  for (std::size_t i = 0; i < plan.monitors.size(); ++i) {
    if (only.empty() || std::find(only.begin(), only.end(), plan.monitors[i].name()) != only.end())
      out.monitors.push_back(i);
  }
  if (const Diagnostics unknown = verify::unknown_requirements(plan, only); has_errors(unknown))
    return refuse(command, unknown);
  if (out.monitors.empty()) {
    return refuse(command, {{Severity::kError, "verify.no-requirement",
                             "the project has no requirements and no monitors, so there is nothing to count; sentree "
                             "add monitor NAME writes one",
                             SourceSpan{plan.scenario.project.file}}});
  }
  const std::uint64_t ticks_max = static_cast<std::uint64_t>(kRunMax / plan.scenario.project.period);
  if (command.ticks && *command.ticks > ticks_max) {
    say(fmt::format("--ticks {}: a run has {} ticks at most, which is ten years", *command.ticks, ticks_max));
    return kUsage;
  }
  out.length =
      command.ticks ? plan.scenario.project.period * static_cast<std::int64_t>(*command.ticks) : plan.scenario.duration;
  for (const std::size_t i : out.monitors) {
    const monitor::Model& model = plan.monitors[i];
    if (!verify::outlasts(model, out.length, plan.scenario.project.period)) continue;
    out.warnings.push_back(
        fmt::format("{}: its bound of {} is no shorter than a run ({} s), so no run comes to its end; "
                    "make them longer (--ticks)",
                    model.name(), model.origin()->requirement.bound->text(), shortest_decimal(seconds(out.length))));
    say("! " + out.warnings.back());
  }
  if (!command.memory) {
    out.memory = memory_by_default(1'000'000'000, command.threads);
    return out;
  }
  out.memory = bytes_of(*command.memory);
  if (out.memory) return out;
  say(fmt::format("--memory {}: not a size such as 500 MB or 2 GB", *command.memory));
  return kUsage;
}

Loaded<project::Scenario> load_verified(const VerifyCommand& command) {
  Loaded<project::Scenario> loaded;
  if (!command.scenario.empty()) {
    loaded = load(command.project, command.scenario);
  } else {
    auto project = project::load_project(command.project);
    loaded.diagnostics = std::move(project.diagnostics);
    if (project.ok()) loaded.value = project::plain_scenario(std::move(*project.value));
  }
  if (!command.faults.empty() && command.faults != "none" && loaded.value) {
    project::read_faults(command.faults, loaded.value->project.verify, loaded.diagnostics);
    if (has_errors(loaded.diagnostics)) loaded.value.reset();
  }
  return loaded;
}

bool read_options(const VerifyCommand& command, const project::Plan& plan, verify::Asked& asked) {
  const project::VerifySection& section = plan.scenario.project.verify;
  asked.only = command.only;
  asked.each = in_threads(command.threads);
  asked.explore.memory_of_steps = !command.no_memory;
  asked.explore.exact = command.exact;
  asked.explore.order = command.order == "any" ? verify::Order::kAny : verify::Order::kVirtual;
  asked.explore.reduce_orders = !command.all_orders;
  if (command.faults != "none") asked.explore.faults = section.faults;
  asked.explore.faults_at_most = section.faults_at_most;
  asked.judge.fair = section.fair;
  asked.judge.all_fair = command.fair;
  if (command.ticks) asked.explore.ticks = *command.ticks;
  if (command.states) asked.explore.states = *command.states;
  asked.explore.memory = memory_by_default(asked.explore.memory);
  if (command.memory) {
    const auto bytes = bytes_of(*command.memory);
    if (!bytes) {
      say(fmt::format("--memory {}: not a size such as 500 MB or 2 GB", *command.memory));
      return false;
    }
    asked.explore.memory = *bytes;
  }
  if (command.time) {
    const auto time = project::parse_duration(*command.time);
    if (!time) {
      say(fmt::format("--time {}: not a duration such as 30 s", *command.time));
      return false;
    }
    asked.explore.time = *time;
  }
  return true;
}

}  // namespace sentree::cli
