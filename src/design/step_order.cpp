#include "sentree/design/detail/step_order.h"

#include <algorithm>
#include <utility>

#include "sentree/base/value.h"

namespace sentree::design {

namespace {

using Growth = std::ptrdiff_t;

Growth growth(const TextEdit& edit) {
  return static_cast<Growth>(edit.text.size()) - (static_cast<Growth>(edit.to) - static_cast<Growth>(edit.from));
}

TextEdit shifted(TextEdit edit, Growth by) {
  edit.from = static_cast<std::size_t>(static_cast<Growth>(edit.from) + by);
  edit.to = static_cast<std::size_t>(static_cast<Growth>(edit.to) + by);
  return edit;
}

// A stretch of a text, and what was there.
struct LineStretch {
  std::size_t from = 0;
  std::size_t to = 0;
  std::string_view instead;

  [[nodiscard]] bool begins_line(std::string_view text) const {
    return from < to ? text[from] == '\n' : instead.starts_with('\n');
  }
  [[nodiscard]] bool ends_line(std::string_view text) const {
    return from < to ? text[to - 1] == '\n' : instead.ends_with('\n');
  }
};

// `a` stands before `b`, and an end of a line is between what the one and the other are about.
bool on_other_lines(const LineStretch& a, const LineStretch& b, std::string_view text) {
  return a.to <= b.from && (a.ends_line(text) || b.begins_line(text) ||
                            text.substr(a.to, b.from - a.to).find('\n') != std::string_view::npos);
}

// In the other order, if that is possible; else as it was.
bool swap_steps(Step& first, Step& second, const FileTexts& texts) {
  Step later = first;
  Step sooner = second;
  for (FileChange& a : later.changes) {
    for (FileChange& b : sooner.changes) {
      if (a.file != b.file) continue;
      const auto text = texts.find(a.file);
      if (a.created || a.removed || b.created || b.removed || text == texts.end()) return false;
      const auto middle = with_edits(text->second, a.edits);
      const auto after = middle ? with_edits(*middle, b.edits) : middle;
      const auto order = middle ? swapped(a.edits, *middle, b.edits) : std::nullopt;
      if (!order || !after) return false;
      const auto between = with_edits(text->second, order->second);
      const auto again = between ? with_edits(*between, order->first) : between;
      if (!again || *again != *after) return false;
      b.back = inverse(text->second, b.edits = order->second);
      a.back = inverse(*between, a.edits = order->first);
      b.before = hash_of(text->second);
      b.after = a.before = hash_of(*between);
      a.after = hash_of(*after);
    }
  }
  first = std::move(sooner);
  second = std::move(later);
  return true;
}

}  // namespace

std::int64_t hash_of(const std::string& text) { return static_cast<std::int64_t>(hash_bytes(text) >> 1U) | 1; }

std::optional<Swapped> swapped(const TextEdits& first, std::string_view text, const TextEdits& second) {
  Swapped found{second, first};
  Growth made = 0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    const std::size_t from = shifted(first[i], made).from;
    const LineStretch one{from, from + first[i].text.size(), {}};
    made += growth(first[i]);
    for (std::size_t j = 0; j < second.size(); ++j) {
      const LineStretch other{second[j].from, second[j].to, second[j].text};
      const bool before = on_other_lines(other, one, text);
      if (before == on_other_lines(one, other, text)) return std::nullopt;
      if (before)
        found.first[i] = shifted(found.first[i], growth(second[j]));
      else
        found.second[j] = shifted(found.second[j], -growth(first[i]));
    }
  }
  return found;
}

bool step_over(const Step& step, bool back, FileTexts& texts) {
  for (const FileChange& change : step.changes) {
    const auto text = texts.find(change.file);
    if (text == texts.end()) continue;
    const std::int64_t known = back ? change.after : change.before;
    auto edited = with_edits(text->second, back ? change.back : change.edits);
    if (change.created || change.removed || !edited || (known != 0 && known != hash_of(text->second))) return false;
    text->second = std::move(*edited);
  }
  return true;
}

Step undoing(const Step& step) {
  Step other = step;
  for (FileChange& change : other.changes) {
    std::swap(change.edits, change.back);
    std::swap(change.before, change.after);
    std::swap(change.created, change.removed);
  }
  return other;
}

std::size_t carry(std::vector<Step>& row, std::size_t from, std::size_t to, FileTexts texts) {
  std::size_t at = from;
  for (; at < to; ++at) {
    if (!swap_steps(row[at], row[at + 1], texts) || !step_over(row[at], false, texts)) break;
  }
  for (; at > to; --at) {
    if (!step_over(row[at - 1], true, texts) || !swap_steps(row[at - 1], row[at], texts)) break;
  }
  return at;
}

}  // namespace sentree::design
