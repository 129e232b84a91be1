#include "sentree/runtime/detail/run_impl.h"

#include <algorithm>

#include <fmt/format.h>

#include "sentree/runtime/detail/decision_record.h"

namespace sentree::runtime {

namespace {

// How long a durable run waits for observers elsewhere to say how far they are: at a state that can be left out, and
// where there is no other one.
constexpr std::chrono::milliseconds kBetweenTicks{500};
constexpr std::chrono::seconds kAfterResumption{30};

}  // namespace

std::optional<std::string> Run::Impl::prepare_durability() {
  if (!durability_) return std::nullopt;
  if (const std::string obstacle = Durability::obstacle(plan_); !obstacle.empty())
    return "the run cannot be durable: " + obstacle;
  if (options_.resume == nullptr) {
    if (const std::string again = Durability::done_again(plan_); !again.empty()) problem(again);
    return std::nullopt;
  }
  auto state = mission::restore(plan_, options_.resume->state);
  if (!state) return fmt::format("{}: {}", options_.resume->file.string(), state.error().message);
  resumed_from_ = std::move(*state);
  options_.from = &*resumed_from_;
  return std::nullopt;
}

Result<void> Run::Impl::execute_again(const Journaled& journaled) {
  Durability::Again again;
  if (auto begun = durability_->begin_again(journaled, again); !begun) return begun;
  const auto at = [&](const Place& where, Scheduler::Task task) {
    again.emplace_back(where, [this, when = where.when, task = std::move(task)] {
      scheduler_->at(director_, when, mission::Rank::kInjection, task);
    });
  };
  for (const auto& [where, saved] : journaled.interventions) {
    const Value* what = saved.find("what");
    const Value* source = saved.find("source");
    if (what == nullptr || source == nullptr)
      return fail("journal.damaged", journaled.file.string() + ": an intervention is none");
    auto intervention = mission::restore_intervention(*what);
    if (!intervention) return tl::unexpected(intervention.error());
    at(where, [this, intervention = std::move(*intervention), by = std::string(source->text())] {
      steering_.again(intervention, by);
    });
  }
  for (const auto& [where, saved] : journaled.inputs) {
    if (auto message = Durability::observed(saved)) at(where, [this, message] { stream_.publish(*message); });
    if (auto decided = Durability::decided(saved))
      at(where, [this, decided] { take_decision(decided->first, decided->second); });
  }
  std::stable_sort(again.begin(), again.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (auto& [where, schedule] : again) schedule();
  scheduler_->catch_up(journaled.reached, [this, &journaled] { resumed(journaled); });
  return {};
}

void Run::Impl::pass_lost_time(const Gap& gap, Duration lost) {
  mission::TreeState& tree = mission_->state();
  for (auto& [index, leaf] : tree.leaves) leaf.asked = add_saturating(leaf.asked, lost);
  tree.deadline.when = add_saturating(tree.deadline.when, lost);
  scheduler_->leap(gap.to, [lost](TimePoint& when, mission::Delivery& what) {
    const auto* to_tree = std::get_if<mission::TreeDelivery>(&what.what);
    if (to_tree != nullptr &&
        (std::holds_alternative<mission::AnswerDue>(*to_tree) || std::holds_alternative<mission::HaltLimit>(*to_tree)))
      when = add_saturating(when, lost);
  });
  durability_->resumed(gap, lost);
  monitors_.note_gaps(durability_->gaps());
}

void Run::Impl::resumed(const Journaled& journaled) {
  if (options_.on_reached) {
    options_.on_reached({capture(), durability_->reached(), durability_->gaps()});
    scheduler_->stop();
    return;
  }
  const auto wall = between(journaled.at, options_.durable->clock());
  const Duration lost = scenario_.virtual_time ? Duration(0) : stretched(wall.value_or(Duration(0)));
  const Gap gap{scheduler_->now(), add_saturating(scheduler_->now(), lost), wall.value_or(Duration(0))};
  pass_lost_time(gap, lost);
  if (options_.on_begin) options_.on_begin(*this);
  Message message;
  message.source = "run";
  message.name = "mission.resumed";
  message.data =
      Map{{"from_ns", gap.from.time_since_epoch().count()}, {"lost_ns", lost.count()}, {"wall_ns", gap.wall.count()}};
  stream_.publish(std::move(message));
  if (!wall) problem("the machine's clock was set back: how long nobody was there is not known, and counts as no time");
  auto beside = remember_observers(kAfterResumption, Untaken::kAreTaken);
  durability_->snapshot(capture(), beside.value_or(List()), timeline_to_);
  if (!beside) durability_->journal().give_up("a monitor in another process does not say how far it is");
  end_journal(journaled, recording_name());
  durability_->ask_again();
  keep_journal(add_saturating(gap.to, journal_period()));
  tell_died_with_run();
}

std::string Run::Impl::recording_name() const {
  const Value* recording = options_.durable->note.find("recording");
  return recording != nullptr ? std::string(recording->text()) : options_.durable->journal.filename().string();
}

Duration Run::Impl::journal_period() const {
  return scenario_.virtual_time ? options_.durable->snapshot_period : stretched(options_.durable->snapshot_period);
}

void Run::Impl::keep_journal(TimePoint when) {
  scheduler_->at(director_, when, mission::Rank::kInjection, [this, when] {
    // Behind what came in at this instant, of which a part may be in the state and another not yet in the journal.
    scheduler_->at(director_, scheduler_->now(), mission::Rank::kInjection, [this, when] {
      // Without it, the records behind the last state say everything still.
      const Duration patience = when == TimePoint{} ? Duration(kAfterResumption) : Duration(kBetweenTicks);
      if (auto beside = remember_observers(patience, Untaken::kGiveUp))
        durability_->snapshot(capture(), std::move(*beside), timeline_to_);
      keep_journal(std::max(when + journal_period(), scheduler_->now()));
    });
  });
}

void Run::Impl::fell_behind(Duration behind) {
  if (behind < tell_behind_) return;
  tell_behind_ = 2 * behind;
  problem(behind_the_clock(behind, durability_->waited_for_charts(), durability_->journal().cost().waited));
}

std::optional<std::string> Run::Impl::recall_observers() {
  static const std::vector<Value> kNothing;
  const auto& known = options_.resume != nullptr ? options_.resume->open : kNothing;
  for (const Value& entry : known) {
    if (auto decided = Durability::decided(entry)) note_decision(decided->first, decided->second);
  }
  for (std::size_t i = 0; i < observers().size(); ++i) {
    Value memory;
    for (const Value& entry : known) {
      const Value* name = entry.find("observer");
      const Value* what = entry.find("memory");
      if (name != nullptr && what != nullptr && name->text() == plan_.observers[i].name) memory = *what;
    }
    if (auto recalled = observers()[i]->recall(memory); !recalled) return recalled.error().message;
  }
  return std::nullopt;
}

std::optional<List> Run::Impl::remember_observers(Duration patience, Untaken untaken) {
  // What is taken is observed, and may make another one decide: each once.
  for (std::size_t rounds = 0; rounds <= observers().size(); ++rounds) {
    List all;
    for (std::size_t i = 0; i < observers().size(); ++i) {
      auto memory = observers()[i]->remember(patience);
      if (!memory) return std::nullopt;
      all.push_back(Map{{"observer", plan_.observers[i].name}, {"memory", std::move(*memory)}});
    }
    if (is_decided_elsewhere()) {
      if (untaken == Untaken::kGiveUp) break;
      take_decisions();
      continue;
    }
    const std::lock_guard lock(problems_mutex_);
    for (const MonitorReport& report : remote_reports_) {
      if (report.decision) all.push_back(Map{{"decided", report.name}, {"decision", save(*report.decision)}});
    }
    return all;
  }
  return std::nullopt;
}

}  // namespace sentree::runtime
