#include "sentree/verify/detail/scout.h"

namespace sentree::verify {

namespace {

// More ways on from one state are left to `Periods`, which looks at its limits between them.
constexpr std::size_t kScoutedWaysMax = 2'000;

}  // namespace

void Scout::explore(std::uint32_t begin, std::uint32_t end) {
  found_.clear();
  all_.clear();
  forms_.clear();
  for (std::uint32_t from = begin; from < end; ++from) found_.push_back(explore(from));
}

Scout::From Scout::explore(std::uint32_t from) {
  From out{.first = all_.size(), .count = 0, .leaves_out = false, .known = true};
  if (of_.graph_.nodes[from].ended) return out;
  const std::size_t forms = forms_.size();
  ways_.begin();
  bool another = true;
  while (another && out.known) {
    out.known = all_.size() - out.first < kScoutedWaysMax && go_on(from, ways_.script());
    if (out.known) another = ways_.next(*this);
  }
  if (!out.known) {
    all_.resize(out.first);
    forms_.resize(forms);
  }
  out.count = all_.size() - out.first;
  out.leaves_out = ways_.leaves_out();
  return out;
}

Periods::Scouted Scout::way(std::size_t index) const {
  Periods::Scouted way = all_[index].way;
  way.form = std::span(forms_).subspan(all_[index].form, all_[index].size);
  return way;
}

// One period; false: something in it is not known.
bool Scout::go_on(std::uint32_t from, std::span<const std::uint32_t> script) {
  begin_ = of_.graph_.nodes[from].at;
  script_ = script;
  missed_ = false;
  made_.clear();
  seen_.clear();
  trace_.clear();
  ordered_.clear();
  due_.clear();
  frontier_->again(of_.places_[from], begin_);
  const auto done = frontier_->go_on([this] { return fault(); }, [] { return Result<void>(); });
  if (frontier_->missed() || missed_ || !done) return false;
  const auto seen = of_.sequence_of_.find(Periods::hash_of(seen_, words_));
  if (seen == of_.sequence_of_.end()) return false;
  const auto made = of_.decisions_of_.find(Periods::hash_of(made_, words_));
  if (made == of_.decisions_of_.end()) return false;
  const auto form = frontier_->kept_form();
  all_.push_back({.way = {.key = frontier_->key(),
                          .seen = seen->second,
                          .made = made->second,
                          .now = frontier_->now(),
                          .ended = frontier_->ended(),
                          .cut_off = Periods::is_cut_off(*frontier_),
                          .form = {}},
                  .form = forms_.size(),
                  .size = form.size()});
  forms_.insert(forms_.end(), form.begin(), form.end());
  return true;
}

std::uint32_t Scout::decide(Made::Kind kind, std::uint64_t count) {
  const std::uint32_t alternative = made_.size() < script_.size() ? script_[made_.size()] : 0;
  made_.push_back({kind, alternative, static_cast<std::uint32_t>(count), 0, -1, 0});
  return alternative;
}

Result<void> Scout::fault() {
  using Possible = Periods::Possible;
  return Periods::put_faults(
      of_.options_, *frontier_, [this](const std::vector<Possible>& possible) -> const Possible* {
        const std::uint32_t taken = decide(Made::Kind::kFault, possible.size() + 1);
        if (taken == 0) return nullptr;
        const auto known = of_.choice_of_.find(Periods::key_of(of_.point_of(possible[taken - 1])));
        missed_ = missed_ || known == of_.choice_of_.end();
        if (known == of_.choice_of_.end()) return nullptr;
        made_.back().what = known->second;
        return &possible[taken - 1];
      });
}

void Scout::observed(std::uint32_t number, TimePoint now, const Message&) {
  if (number >= of_.heard_.size() || of_.heard_[number] == Periods::kUnheard) {
    missed_ = true;
    return;
  }
  if (of_.heard_[number] != Periods::kNobody) seen_.push_back({now - begin_, of_.heard_[number]});
}

std::uint64_t Scout::choose(std::uint32_t number, const mission::Choice& choice) {
  const bool is_drawn = static_cast<bool>(choice.probability);
  if (number >= of_.noted_.size() || of_.noted_[number].alternatives.empty() ||
      (is_drawn && choice.count > 1 && tells_orders())) {
    missed_ = true;
    return 0;
  }
  const std::uint32_t alternative = decide(Made::Kind::kChoice, choice.count);
  made_.back().what = of_.noted_[number].alternatives[alternative];
  made_.back().place = of_.noted_[number].place;
  if (made_.back().what == Periods::kUnheard) missed_ = true;
  if (is_drawn) made_.back().probability = choice.probability(alternative);
  return alternative;
}

std::size_t Scout::order(std::span<const std::uint32_t> parts) {
  if (of_.options_.order == Order::kVirtual) return 0;
  const std::uint32_t which = decide(Made::Kind::kOrder, parts.size());
  made_.back().what = parts[which];
  if (!tells_orders()) return which;
  ordered_.push_back({.step = static_cast<std::uint32_t>(trace_.steps.size()),
                      .decision = static_cast<std::uint32_t>(made_.size() - 1),
                      .due = static_cast<std::uint32_t>(due_.size())});
  due_.insert(due_.end(), parts.begin(), parts.end());
  return which;
}

std::optional<mission::Veto> Scout::judge(const Message&) {
  missed_ = true;
  return std::nullopt;
}

void Scout::taken(std::size_t leaf, scxml::TransitionIndex transition) {
  if (!of_.graph_.taken[leaf][transition]) missed_ = true;
}

void Scout::problem(const std::string& what) {
  if (!of_.told_.contains(what)) missed_ = true;
}

}  // namespace sentree::verify
