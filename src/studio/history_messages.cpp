#include <algorithm>
#include <set>

#include "sentree/project/project.h"
#include "sentree/studio/detail/history_impl.h"

// Observations: where they are, and which match.

namespace sentree::studio {

namespace {

// To read a part of a recording costs what looking at so many observations does.
constexpr std::size_t kPartCost = 10'000;

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; }

bool contains(std::string_view text, std::string_view wanted) {
  return std::search(text.begin(), text.end(), wanted.begin(), wanted.end(),
                     [](char a, char b) { return lower(a) == lower(b); }) != text.end();
}

}  // namespace

bool Filter::matches(const Shape& shape) const {
  if (!kind.empty() && shape.kind != kind) return false;
  if (!leaf.empty() && shape.source != leaf && shape.target != leaf) return false;
  if (!service.empty() &&
      !(shape.name.starts_with(service + ".") && (shape.target == service || shape.source == service)))
    return false;
  return name.empty() || project::matches_pattern(name, shape.name);
}

History::Moment History::Impl::moment(Nanoseconds time) const {
  const std::size_t position = observations.position(time);
  if (position == Observations::npos) return {.observations = forgotten};
  const Seen seen = observations[position].value;
  return {seen.sequence, seen.tick, forgotten + position + 1};
}

History::Moment History::moment(Nanoseconds time) const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->moment(time);
}

std::size_t History::first_observation() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->forgotten;
}

std::size_t History::end_observation() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->forgotten + impl_->observations.size();
}

std::size_t History::find_sequence(std::uint64_t sequence) const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->forgotten + impl_->observations.find_sequence(sequence);
}

std::size_t History::after_time(Nanoseconds time) const { return moment(time).observations; }

std::string History::observation(std::size_t position) const {
  const std::lock_guard lock(impl_->mutex);
  if (position < impl_->forgotten || position - impl_->forgotten >= impl_->observations.size()) return {};
  const Observations::Entry entry = impl_->observations[position - impl_->forgotten];
  return impl_->shown(Shown::kObservation, entry.value.place, entry.time);
}

std::vector<std::string> History::names() const {
  std::set<std::string> names;
  const std::lock_guard lock(impl_->mutex);
  for (const Shape& shape : impl_->shapes) names.insert(shape.name);
  return {names.begin(), names.end()};
}

History::Found History::find(const Filter& filter, std::size_t position, bool forwards, std::size_t budget) const {
  const std::lock_guard lock(impl_->mutex);
  const std::size_t first = impl_->forgotten;
  const std::size_t end = first + impl_->observations.size();
  std::vector<char> wanted;
  std::uint64_t bits = 0;  // as in stretches
  for (const Shape& shape : impl_->shapes) {
    wanted.push_back(filter.matches(shape) ? 1 : 0);
    if (wanted.back() != 0) bits |= std::uint64_t{1} << ((wanted.size() - 1) % 64U);
  }
  Found found;
  Observations::Stretch stretch;
  for (found.next = std::clamp(position, first, end); budget > 0; --budget) {
    if (forwards ? found.next >= end : found.next <= first) {
      found.at_end = true;
      return found;
    }
    const std::size_t candidate = forwards ? found.next++ : --found.next;
    const std::size_t index = candidate - first;
    if (index < stretch.from || index >= stretch.to) {
      stretch = impl_->observations.stretch(index);
      if ((stretch.shapes & bits) == 0) {
        found.next = first + (forwards ? stretch.to : stretch.from);
        stretch = {};
        continue;
      }
      if (!stretch.at_hand) budget -= std::min(budget - 1, kPartCost);
    }
    const Seen seen = impl_->observations[index].value;
    if (wanted[seen.shape] == 0) continue;
    if (!filter.text.empty() && !contains(impl_->texts->read(seen.place), filter.text)) continue;
    found.position = candidate;
    return found;
  }
  return found;
}

std::size_t History::violations() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->violations.size();
}

std::string History::violation(std::size_t index) const {
  const std::lock_guard lock(impl_->mutex);
  return index < impl_->violations.size() ? impl_->violations[index] : std::string();
}

std::size_t History::problems() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->problems.size();
}

History::Problem History::problem(std::size_t index) const {
  const std::lock_guard lock(impl_->mutex);
  return index < impl_->problems.size() ? impl_->problems[index] : Problem();
}

}  // namespace sentree::studio
