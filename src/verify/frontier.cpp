#include "sentree/verify/frontier.h"

#include <fmt/format.h>

#include <deque>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/mission/encode.h"
#include "sentree/verify/detail/period.h"

namespace sentree::verify {

namespace {

// What is due then is judged up to the end, which may be between two ticks.
Duration since_tick(const project::Plan& plan, TimePoint now) {
  return (now - TimePoint{}) % plan.scenario.project.period;
}

class Executing final : public Frontier {
 public:
  Executing(const project::Plan& plan, mission::Surroundings& surroundings, bt::Times times)
      : plan_(plan), surroundings_(surroundings), times_(times), host_(plan) {
    host_.reuse_numbers();
  }

  Result<void> begin() override {
    run_ = host_.begin();
    return encode();
  }
  void again(std::uint64_t place, TimePoint) override { run_ = states_[place - dropped_]; }
  Result<void> go_on(const std::function<Result<void>()>& before_tick,
                     const std::function<Result<void>()>& on_the_way) override {
    if (const auto delivered = period(host_, run_, surroundings_, before_tick, on_the_way); !delivered)
      return tl::unexpected(delivered.error());
    mission::prune(run_);
    return encode();
  }
  bool trace(mission::PartMemory::Trace&) override { return false; }
  Hash128 key() override { return hash128(form_); }
  std::string_view form() override { return form_; }
  std::uint64_t keep() override {
    states_.push_back(std::move(run_));
    if (!spare_.empty()) {
      run_ = std::move(spare_.back());
      spare_.pop_back();
    }
    return dropped_ + states_.size() - 1;
  }
  std::uint64_t keep(std::span<const std::uint32_t>) override { return 0; }
  std::unique_ptr<Frontier> scout(mission::PartMemory::Outside&) const override { return nullptr; }
  bool missed() override { return false; }
  std::span<const std::uint32_t> kept_form() const override { return {}; }
  void drop() override {
    if (spare_.size() < kSpareMax) spare_.push_back(std::move(states_.front()));
    states_.pop_front();
    ++dropped_;
  }

  TimePoint now() const override { return run_.now; }
  bool ended() const override { return mission::VirtualHost::ended(run_); }
  bt::Status root() const override { return run_.tree.root; }
  bool over() const override { return mission::VirtualHost::over(run_); }
  TimePoint planned() const override { return mission::VirtualHost::planned(run_); }
  const mission::Faults& faults() const override { return run_.faults; }
  bool is_down(const std::string& part) const override {
    if (run_.down.contains(part)) return true;
    for (std::size_t leaf = 0; leaf < plan_.leaves.size(); ++leaf) {
      if (plan_.leaves[leaf].name == part) return mission::VirtualHost::is_killed(run_, leaf);
    }
    return false;
  }
  const mission::ModelState& model(std::size_t index) const override { return run_.models[index]; }
  Result<void> inject(const project::Intervention& what, std::uint64_t number) override {
    return host_.inject(run_, what, surroundings_, number);
  }
  void each_state(const Visit& visit) const override {
    for (const mission::State& state : states_) {
      const auto wake = [&](const scxml::Session& session) -> std::optional<Duration> {
        if (session.status() == scxml::SessionStatus::kNew || session.next_timer() == kNever) return std::nullopt;
        return session.next_timer() - state.now;
      };
      const std::size_t skills = state.skills.size();
      for (std::size_t i = 0; i < skills; ++i) visit(i, &state.skills[i], wake(state.skills[i].session));
      for (std::size_t i = 0; i < state.models.size(); ++i)
        visit(skills + i, &state.models[i], wake(state.models[i].session));
      visit(skills + state.models.size(), &state.tree, std::nullopt);
    }
  }
  std::uint64_t bytes() const override {
    constexpr std::uint64_t kOfAState = 4'000;
    return states_.size() * kOfAState;
  }

 private:
  Result<void> encode() {
    form_.clear();
    if (auto encoded = mission::encode(host_.parts(), run_, form_, times_); !encoded) return encoded;
    for (const project::Injection& injection : plan_.scenario.timeline) {
      if (injection.at > run_.now) form_ += fmt::format("{};", (injection.at - run_.now).count());
    }
    if (ended()) form_ += fmt::format("ended {}", since_tick(plan_, run_.now).count());
    return {};
  }

  const project::Plan& plan_;
  mission::Surroundings& surroundings_;
  bt::Times times_;
  mission::VirtualHost host_;
  static constexpr std::size_t kSpareMax = 16;
  std::deque<mission::State> states_;
  std::vector<mission::State> spare_;  // for the room that they have
  std::uint64_t dropped_ = 0;
  mission::State run_;
  std::string form_;
};

class Remembering final : public Frontier {
 public:
  Remembering(const project::Plan& plan, mission::PartMemory::FaultsFrom faults, mission::PartMemory::Outside& outside,
              bt::Times times)
      : plan_(plan), outside_(outside), memory_(std::make_unique<mission::PartMemory>(plan, faults, times)) {}
  Remembering(const Remembering& of, mission::PartMemory::Outside& outside)
      : plan_(of.plan_), outside_(outside), memory_(of.memory_->reader()), of_(&of) {}
  ~Remembering() override = default;
  Remembering& operator=(const Remembering&) = delete;

  Result<void> begin() override {
    run_ = memory_->begin();
    return pack();
  }
  void again(std::uint64_t place, TimePoint at) override {
    const Remembering& keeps = of_ != nullptr ? *of_ : *this;
    const std::size_t first = place - keeps.thrown_away_;
    memory_->unpack(std::span(keeps.waiting_).subspan(first + 1, keeps.waiting_[first]), at, run_);
    run_.begun = place != 0;
  }
  Result<void> go_on(const std::function<Result<void>()>& before_tick,
                     const std::function<Result<void>()>& on_the_way) override {
    if (const auto delivered = period(*memory_, run_, outside_, before_tick, on_the_way); !delivered)
      return tl::unexpected(delivered.error());
    return pack();
  }
  bool trace(mission::PartMemory::Trace& trace) override {
    memory_->trace(&trace);
    return true;
  }
  Hash128 key() override { return hash128(form()); }
  std::string_view form() override {
    return {reinterpret_cast<const char*>(packed_.data()), packed_.size() * sizeof(std::uint32_t)};
  }
  std::uint64_t keep() override { return keep(kept_form()); }
  std::uint64_t keep(std::span<const std::uint32_t> form) override {
    const std::uint64_t place = thrown_away_ + waiting_.size();
    waiting_.push_back(static_cast<std::uint32_t>(form.size()));
    waiting_.insert(waiting_.end(), form.begin(), form.end());
    return place;
  }
  std::unique_ptr<Frontier> scout(mission::PartMemory::Outside& outside) const override {
    return std::make_unique<Remembering>(*this, outside);
  }
  bool missed() override {
    const bool missed = memory_->missed();
    memory_->forget_missed();
    return missed;
  }
  std::span<const std::uint32_t> kept_form() const override { return std::span(packed_).first(waited_); }
  void drop() override {
    first_ += waiting_[first_] + 1;
    // What has been gone on from is thrown away, now and then.
    if (first_ < kKept || first_ * 2 < waiting_.size()) return;
    waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(first_));
    thrown_away_ += first_;
    first_ = 0;
  }

  TimePoint now() const override { return run_.now; }
  bool ended() const override { return memory_->ended(run_); }
  bt::Status root() const override { return memory_->root(run_); }
  bool over() const override { return memory_->over(run_); }
  TimePoint planned() const override { return memory_->planned(run_); }
  const mission::Faults& faults() const override { return memory_->faults(run_); }
  bool is_down(const std::string& part) const override {
    if (memory_->is_down(run_, part)) return true;
    for (std::size_t leaf = 0; leaf < plan_.leaves.size(); ++leaf) {
      if (plan_.leaves[leaf].name == part) return memory_->is_killed(run_, leaf);
    }
    return false;
  }
  const mission::ModelState& model(std::size_t index) const override { return memory_->model(run_, index); }
  Result<void> inject(const project::Intervention& what, std::uint64_t number) override {
    return memory_->inject(run_, what, outside_, number);
  }
  void each_state(const Visit& visit) const override { memory_->each_state(visit); }
  std::uint64_t bytes() const override { return memory_->bytes() + waiting_.capacity() * sizeof(std::uint32_t); }

 private:
  static constexpr std::size_t kKept = 1U << 20U;

  Result<void> pack() {
    if (memory_->error()) return tl::unexpected(*memory_->error());
    memory_->settle(run_);
    if (memory_->error()) return tl::unexpected(*memory_->error());
    packed_.clear();
    memory_->pack(run_, packed_);
    waited_ = static_cast<std::uint32_t>(packed_.size());
    for (const project::Injection& injection : plan_.scenario.timeline) {
      if (injection.at > run_.now) packed_.push_back(memory_->number_of(injection.at - run_.now));
    }
    if (ended()) packed_.push_back(memory_->number_of(since_tick(plan_, run_.now)));
    return {};
  }

  const project::Plan& plan_;
  mission::PartMemory::Outside& outside_;
  std::unique_ptr<mission::PartMemory> memory_;
  const Remembering* of_ = nullptr;     // whose states a scout goes on from
  std::vector<std::uint32_t> waiting_;  // each with its size before it
  std::size_t first_ = 0;
  std::uint64_t thrown_away_ = 0;
  mission::PartMemory::Run run_;
  std::vector<std::uint32_t> packed_;
  std::uint32_t waited_ = 0;  // of which this says what the run is; the rest is the timeline
};

}  // namespace

std::unique_ptr<Frontier> executing(const project::Plan& plan, mission::Surroundings& surroundings, bt::Times times) {
  return std::make_unique<Executing>(plan, surroundings, times);
}

std::unique_ptr<Frontier> remembering(const project::Plan& plan, mission::PartMemory::FaultsFrom faults,
                                      mission::PartMemory::Outside& outside, bt::Times times) {
  return std::make_unique<Remembering>(plan, faults, outside, times);
}

}  // namespace sentree::verify
