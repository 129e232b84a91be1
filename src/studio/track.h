#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>

namespace sentree::studio {

/// Run time in nanoseconds, as the page knows it.
using Nanoseconds = std::int64_t;

/// What one thing was when: values by the time from which on they held. Only ever longer, until the oldest are dropped.
template <class T>
class Track {
 public:
  struct Entry {
    Nanoseconds time = 0;
    T value{};
  };

  /// Time does not run backwards: an earlier one counts as that of the entry before.
  void push(Nanoseconds time, T value) {
    if (!entries_.empty()) time = std::max(time, entries_.back().time);
    entries_.push_back({time, std::move(value)});
    ++version_;
  }

  /// Position of the last entry at `time` or before it, or `npos`. O(log n).
  static constexpr std::size_t npos = static_cast<std::size_t>(-1);
  [[nodiscard]] std::size_t position(Nanoseconds time) const {
    if (!entries_.empty() && entries_.back().time <= time) return entries_.size() - 1;
    const auto after = std::upper_bound(entries_.begin(), entries_.end(), time,
                                        [](Nanoseconds t, const Entry& entry) { return t < entry.time; });
    return after == entries_.begin() ? npos : static_cast<std::size_t>(after - entries_.begin()) - 1;
  }
  /// The entry that holds at `time`; null before the first.
  [[nodiscard]] const Entry* at(Nanoseconds time) const {
    const std::size_t found = position(time);
    return found == npos ? nullptr : &entries_[found];
  }
  [[nodiscard]] const T* back() const { return entries_.empty() ? nullptr : &entries_.back().value; }

  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  [[nodiscard]] const Entry& operator[](std::size_t i) const { return entries_[i]; }
  [[nodiscard]] Entry& operator[](std::size_t i) { return entries_[i]; }
  /// Counts what was pushed.
  [[nodiscard]] std::uint64_t version() const { return version_; }

  /// Forgets what no longer held at `time`, but for the last `kept` of it.
  void drop_before(Nanoseconds time, std::size_t kept = 0) {
    const std::size_t now = position(time);
    if (now == npos || now <= kept) return;
    entries_.erase(entries_.begin(), entries_.begin() + static_cast<std::ptrdiff_t>(now - kept));
  }
  /// Forgets from the front what `is_old`; how many that were.
  template <class IsOld>
  std::size_t drop_first_while(IsOld&& is_old) {
    std::size_t dropped = 0;
    for (; !entries_.empty() && is_old(entries_.front().value); ++dropped) entries_.pop_front();
    return dropped;
  }

 private:
  std::deque<Entry> entries_;
  std::uint64_t version_ = 0;
};

}  // namespace sentree::studio
