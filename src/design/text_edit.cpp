#include "sentree/design/text_edit.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "sentree/design/detail/soundness.h"
#include "sentree/text/encoding.h"

namespace sentree::design {

namespace {

// Lines [before_from, before_to) of one text stand where lines [after_from, after_to) of the other do.
struct Hunk {
  int before_from = 0, before_to = 0;
  int after_from = 0, after_to = 0;
};

class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text) {
    for (std::size_t i = 0; i < text.size(); ++i) {
      if (text[i] == '\n' && i + 1 < text.size()) starts_.push_back(i + 1);
    }
    if (text.empty()) starts_.clear();
  }
  [[nodiscard]] int size() const { return static_cast<int>(starts_.size()); }
  [[nodiscard]] std::size_t start(int line) const {
    return line < size() ? starts_[static_cast<std::size_t>(line)] : text_.size();
  }
  [[nodiscard]] std::string_view text(int from, int to) const {
    return text_.substr(start(from), start(to) - start(from));
  }
  [[nodiscard]] std::string_view operator[](int line) const { return text(line, line + 1); }

 private:
  std::string_view text_;
  std::vector<std::size_t> starts_{0};
};

// The pairs of equal lines of a shortest script, in order; nothing beyond the bound.
std::optional<std::vector<std::pair<int, int>>> pairs(const Lines& a, const Lines& b, int from_a, int to_a, int from_b,
                                                      int to_b) {
  const int n = to_a - from_a;
  const int m = to_b - from_b;
  std::vector<std::vector<int>> trace;
  std::vector<int> reach{0, 0};  // by diagonal k in [-d, d] at k + d
  for (int d = 0; d <= std::min(n + m, kDifferentLinesMax); ++d) {
    std::vector<int> next(static_cast<std::size_t>(2 * d + 1), 0);
    bool done = false;
    for (int k = -d; k <= d && !done; k += 2) {
      const auto before = [&](int diagonal) {  // of step d - 1
        const int at = diagonal + d - 1;
        return at < 0 || at > 2 * (d - 1) ? -1 : reach[static_cast<std::size_t>(at)];
      };
      int x = 0;
      if (d > 0) x = k == -d || (k != d && before(k - 1) < before(k + 1)) ? before(k + 1) : before(k - 1) + 1;
      while (x < n && x - k < m && x - k >= 0 && a[from_a + x] == b[from_b + x - k]) ++x;
      const int diagonal = k + d;
      next[static_cast<std::size_t>(diagonal)] = x;
      done = k == n - m && x >= n;
    }
    trace.push_back(next);
    reach = std::move(next);
    if (!done) continue;
    std::vector<std::pair<int, int>> equal;
    int x = n;
    int y = m;
    for (int step = d; step > 0; --step) {
      const auto& last = trace[static_cast<std::size_t>(step - 1)];
      const auto at = [&](int diagonal) {
        const int place = diagonal + step - 1;
        return place < 0 || place > 2 * (step - 1) ? -1 : last[static_cast<std::size_t>(place)];
      };
      const int k = x - y;
      const bool down = k == -step || (k != step && at(k - 1) < at(k + 1));
      const int from_x = down ? at(k + 1) : at(k - 1);
      for (const int edited_x = down ? from_x : from_x + 1; x > edited_x;) {
        --x;
        --y;
        equal.emplace_back(from_a + x, from_b + y);
      }
      x = from_x;
      y = from_x - (down ? k + 1 : k - 1);
    }
    while (x > 0 && y > 0) {
      --x;
      --y;
      equal.emplace_back(from_a + x, from_b + y);
    }
    std::reverse(equal.begin(), equal.end());
    return equal;
  }
  return std::nullopt;
}

std::vector<Hunk> hunks(const Lines& a, const Lines& b) {
  int head = 0;
  while (head < a.size() && head < b.size() && a[head] == b[head]) ++head;
  int tail = 0;
  while (tail < a.size() - head && tail < b.size() - head && a[a.size() - 1 - tail] == b[b.size() - 1 - tail]) ++tail;
  const int end_a = a.size() - tail;
  const int end_b = b.size() - tail;
  std::vector<Hunk> found;
  int at_a = head;
  int at_b = head;
  const auto add = [&](int to_a, int to_b) {
    if (at_a < to_a || at_b < to_b) found.push_back({at_a, to_a, at_b, to_b});
  };
  if (const auto equal = pairs(a, b, head, end_a, head, end_b)) {
    for (const auto& [x, y] : *equal) {
      add(x, y);
      at_a = x + 1;
      at_b = y + 1;
    }
  }
  add(end_a, end_b);
  return found;
}

// Of the same text. Where both come between the same two lines, which is first cannot be told.
bool overlap(const Hunk& a, const Hunk& b) {
  const bool same_gap = a.before_from == a.before_to && b.before_from == b.before_to && a.before_from == b.before_from;
  return same_gap || (a.before_from < b.before_to && b.before_from < a.before_to);
}

bool is_inside_character(std::string_view text, std::size_t at) {
  return at < text.size() && (static_cast<unsigned char>(text[at]) & 0xC0U) == 0x80U;
}

}  // namespace

Result<std::string> with_edits(std::string_view text, const TextEdits& edits) {
  std::string out;
  std::size_t at = 0;
  for (const TextEdit& edit : edits) {
    if (edit.from < at || edit.to < edit.from || edit.to > text.size())
      return fail("design.bad-edit", "an edit lies outside the text, or before the one before it");
    out.append(text, at, edit.from - at);
    out += edit.text;
    at = edit.to;
  }
  out.append(text, at);
  return out;
}

TextEdits inverse(std::string_view text, const TextEdits& edits) {
  TextEdits back;
  std::size_t out = 0;
  std::size_t at = 0;
  for (const TextEdit& edit : edits) {
    out += edit.from - at;
    back.push_back({out, out + edit.text.size(), std::string(text.substr(edit.from, edit.to - edit.from))});
    out += edit.text.size();
    at = edit.to;
  }
  return back;
}

TextEdits edits_between(std::string_view before, std::string_view after) {
  const Lines a(before);
  const Lines b(after);
  TextEdits edits;
  for (const Hunk& hunk : hunks(a, b)) {
    const std::string_view old_text = a.text(hunk.before_from, hunk.before_to);
    const std::string_view new_text = b.text(hunk.after_from, hunk.after_to);
    const std::size_t shorter = std::min(old_text.size(), new_text.size());
    std::size_t head = 0;
    while (head < shorter && old_text[head] == new_text[head]) ++head;
    while (head > 0 && (is_inside_character(old_text, head) || is_inside_character(new_text, head))) --head;
    std::size_t tail = 0;
    while (tail < shorter - head && old_text[old_text.size() - 1 - tail] == new_text[new_text.size() - 1 - tail])
      ++tail;
    while (tail > 0 && (is_inside_character(old_text, old_text.size() - tail) ||
                        is_inside_character(new_text, new_text.size() - tail)))
      --tail;
    const std::size_t start = a.start(hunk.before_from);
    edits.push_back({start + head, start + old_text.size() - tail,
                     std::string(new_text.substr(head, new_text.size() - tail - head))});
  }
  return edits;
}

void end_lines_alike(std::string_view text, TextEdits& edits) {
  for (TextEdit& edit : edits) edit.text = text::with_line_ends_of(text, std::move(edit.text));
}

std::optional<std::string> merge(std::string_view base, std::string_view mine, std::string_view theirs) {
  if (mine == theirs || base == theirs) return std::string(mine);
  if (base == mine) return std::string(theirs);
  const Lines lines(base);
  const Lines my_lines(mine);
  const Lines their_lines(theirs);
  const std::vector<Hunk> ours = hunks(lines, my_lines);
  const std::vector<Hunk> others = hunks(lines, their_lines);
  std::string out;
  int at = 0;
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < ours.size() || j < others.size()) {
    const bool touch = i < ours.size() && j < others.size() && overlap(ours[i], others[j]);
    if (touch) {
      const bool same = ours[i].before_from == others[j].before_from && ours[i].before_to == others[j].before_to &&
                        my_lines.text(ours[i].after_from, ours[i].after_to) ==
                            their_lines.text(others[j].after_from, others[j].after_to);
      if (!same) return std::nullopt;
      ++j;
    }
    // What comes before a line comes before what that has become.
    const auto place = [](const Hunk& hunk) { return std::pair(hunk.before_from, hunk.before_to); };
    const bool mine_next = touch || j >= others.size() || (i < ours.size() && place(ours[i]) < place(others[j]));
    const Hunk& next = mine_next ? ours[i] : others[j];
    out += lines.text(at, next.before_from);
    out += (mine_next ? my_lines : their_lines).text(next.after_from, next.after_to);
    at = next.before_to;
    ++(mine_next ? i : j);
  }
  out += lines.text(at, lines.size());
  return out;
}

Result<TextEdits> joined(const std::string& file, std::string_view earlier, std::string_view now,
                         const TextEdits& edits) {
  const auto edited = with_edits(earlier, edits);
  if (!edited) return tl::unexpected(edited.error());
  const auto merged = merge(earlier, now, *edited);
  if (!merged) return fail("design.conflict", fmt::format("the same lines of {} have been changed meanwhile", file));
  if (!is_sound(file, *merged) && is_sound(file, now) && is_sound(file, *edited))
    return fail("design.conflict", fmt::format("with what has been changed meanwhile, {} could not be read", file));
  return edits_between(now, *merged);
}

}  // namespace sentree::design
