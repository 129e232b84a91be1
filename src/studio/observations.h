#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <vector>

#include "sentree/studio/texts.h"
#include "sentree/studio/track.h"

namespace sentree::studio {

/// An observation in the index.
struct Seen {
  std::uint64_t sequence = 0;
  Place place;
  std::uint32_t shape = 0;  ///< Which sort of observation.
  std::uint32_t tick = 0;
};

/// The observations of a run in the order in which they were made. Those of a run that goes on are kept; of a recording
/// only what its parts begin with is, and what a part holds is made anew when it is asked for. One thread at a time.
class Observations {
 public:
  using Entry = Track<Seen>::Entry;
  using Entries = std::vector<Entry>;
  /// What a part holds, in order.
  using Load = std::function<Entries(std::uint32_t part)>;
  static constexpr std::size_t npos = Track<Seen>::npos;
  /// Parts of a recording that are kept, those used last: some 100 KB each.
  static constexpr std::size_t kKeptParts = 16;

  /// From now on it is a recording's: `place.block` of what is pushed is its part, one after the other.
  void load_by(Load load) { load_ = std::move(load); }
  /// Time does not run backwards: an earlier one counts as that of the entry before.
  void push(Nanoseconds time, const Seen& seen);

  [[nodiscard]] std::size_t size() const { return load_ ? size_ : kept_.size(); }
  /// An empty one where the part cannot be read any more.
  [[nodiscard]] Entry operator[](std::size_t i) const;
  /// Position of the last at `time` or before it, or `npos`. O(log n), and reading a part.
  [[nodiscard]] std::size_t position(Nanoseconds time) const;
  /// Position of the first with that sequence number or a greater one. O(log n), and reading a part.
  [[nodiscard]] std::size_t find_sequence(std::uint64_t sequence) const;
  /// Of the newest; 0: there is none.
  [[nodiscard]] std::uint64_t last_sequence() const { return last_sequence_; }

  /// A stretch around a position, of which none is of another shape than `may_have` says. Without reading anything.
  struct Stretch {
    std::size_t from = 0;
    std::size_t to = 0;
    std::uint64_t shapes = ~std::uint64_t{0};  ///< A bit for each shape, modulo 64.
    bool at_hand = true;                       ///< To look at them reads no part.
  };
  [[nodiscard]] Stretch stretch(std::size_t i) const;

  /// Forgets from the front what `is_old`; how many that were. Of a run that goes on.
  template <class IsOld>
  std::size_t drop_first_while(IsOld&& is_old) {
    return kept_.drop_first_while(std::forward<IsOld>(is_old));
  }
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Page {
    std::uint32_t part = 0;
    std::size_t first = 0;
    Nanoseconds first_time = 0;
    std::uint64_t first_sequence = 0;
    std::uint64_t shapes = 0;
  };
  struct Loaded {
    std::size_t page = 0;
    Entries entries;
  };

  [[nodiscard]] std::size_t page_of(std::size_t i) const;
  [[nodiscard]] std::size_t end_of(std::size_t page) const;
  [[nodiscard]] const Entries& entries(std::size_t page) const;

  Track<Seen> kept_;
  std::uint64_t last_sequence_ = 0;
  // Of a recording.
  Load load_;
  std::vector<Page> pages_;
  std::size_t size_ = 0;
  Nanoseconds last_time_ = 0;
  mutable std::list<Loaded> loaded_;  // the one used last first
};

}  // namespace sentree::studio
