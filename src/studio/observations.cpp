#include "sentree/studio/observations.h"

#include <algorithm>
#include <utility>

namespace sentree::studio {

void Observations::push(Nanoseconds time, const Seen& seen) {
  last_sequence_ = seen.sequence;
  if (!load_) return kept_.push(time, seen);
  if (size_ > 0) time = std::max(time, last_time_);
  last_time_ = time;
  // What was made of the last part while not all of it was here.
  if (!loaded_.empty()) loaded_.remove_if([&](const Loaded& loaded) { return loaded.page + 1 == pages_.size(); });
  if (pages_.empty() || pages_.back().part != seen.place.block) {
    pages_.push_back({seen.place.block, size_, time, seen.sequence, 0});
  }
  pages_.back().shapes |= std::uint64_t{1} << (seen.shape % 64U);
  ++size_;
}

std::size_t Observations::page_of(std::size_t i) const {
  const auto after = std::upper_bound(pages_.begin(), pages_.end(), i,
                                      [](std::size_t position, const Page& page) { return position < page.first; });
  return static_cast<std::size_t>(after - pages_.begin()) - 1;
}

std::size_t Observations::end_of(std::size_t page) const {
  return page + 1 < pages_.size() ? pages_[page + 1].first : size_;
}

const Observations::Entries& Observations::entries(std::size_t page) const {
  const auto known =
      std::find_if(loaded_.begin(), loaded_.end(), [&](const Loaded& loaded) { return loaded.page == page; });
  if (known != loaded_.end()) {
    loaded_.splice(loaded_.begin(), loaded_, known);
  } else {
    Entries made = load_(pages_[page].part);
    // As many as there were when it was indexed, whatever became of the file.
    made.resize(end_of(page) - pages_[page].first);
    Nanoseconds time = pages_[page].first_time;
    for (Entry& entry : made) entry.time = time = std::max(time, entry.time);
    loaded_.push_front({page, std::move(made)});
    if (loaded_.size() > kKeptParts) loaded_.pop_back();
  }
  return loaded_.front().entries;
}

Observations::Entry Observations::operator[](std::size_t i) const {
  if (!load_) return kept_[i];
  const std::size_t page = page_of(i);
  return entries(page)[i - pages_[page].first];
}

std::size_t Observations::position(Nanoseconds time) const {
  if (!load_) return kept_.position(time);
  if (size_ > 0 && last_time_ <= time) return size_ - 1;
  const auto after = std::upper_bound(pages_.begin(), pages_.end(), time,
                                      [](Nanoseconds t, const Page& page) { return t < page.first_time; });
  if (after == pages_.begin()) return npos;
  const auto page = static_cast<std::size_t>(after - pages_.begin()) - 1;
  const Entries& in = entries(page);
  const auto later =
      std::upper_bound(in.begin(), in.end(), time, [](Nanoseconds t, const Entry& entry) { return t < entry.time; });
  // The page begins no later.
  return pages_[page].first + static_cast<std::size_t>(later - in.begin()) - 1;
}

std::size_t Observations::find_sequence(std::uint64_t sequence) const {
  std::size_t from = 0;
  std::size_t to = size();
  if (load_) {
    const auto after = std::lower_bound(pages_.begin(), pages_.end(), sequence,
                                        [](const Page& page, std::uint64_t s) { return page.first_sequence < s; });
    to = after == pages_.end() ? size_ : after->first;
    from = after == pages_.begin() ? 0 : std::prev(after)->first;
  }
  while (from < to) {
    const std::size_t middle = from + (to - from) / 2;
    if ((*this)[middle].value.sequence < sequence)
      from = middle + 1;
    else
      to = middle;
  }
  return from;
}

Observations::Stretch Observations::stretch(std::size_t i) const {
  if (!load_) return {.from = 0, .to = size()};
  const std::size_t page = page_of(i);
  const bool at_hand =
      std::any_of(loaded_.begin(), loaded_.end(), [&](const Loaded& loaded) { return loaded.page == page; });
  return {.from = pages_[page].first, .to = end_of(page), .shapes = pages_[page].shapes, .at_hand = at_hand};
}

std::size_t Observations::bytes() const {
  std::size_t bytes = kept_.size() * sizeof(Entry) + pages_.size() * sizeof(Page);
  for (const Loaded& loaded : loaded_) bytes += loaded.entries.size() * sizeof(Entry);
  return bytes;
}

}  // namespace sentree::studio
