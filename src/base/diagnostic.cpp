#include "sentree/base/diagnostic.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <tuple>

#include "sentree/base/shown.h"

namespace sentree {

std::string_view to_string(Severity severity) {
  switch (severity) {
    case Severity::kError: return "error";
    case Severity::kWarning: return "warning";
    case Severity::kNote: return "note";
  }
  return "error";
}

std::string to_string(const Diagnostic& diagnostic) {
  std::string text = to_string(diagnostic.span);
  if (!text.empty()) text += ": ";
  if (diagnostic.severity != Severity::kError) {
    text += to_string(diagnostic.severity);
    text += ": ";
  }
  return shown_in_short(text + diagnostic.message);
}

bool has_errors(std::span<const Diagnostic> diagnostics) {
  return std::any_of(diagnostics.begin(), diagnostics.end(),
                     [](const Diagnostic& d) { return d.severity == Severity::kError; });
}

void add(Diagnostics& diagnostics, Severity severity, std::string code, std::string message, SourceSpan span) {
  diagnostics.push_back({severity, std::move(code), std::move(message), std::move(span)});
}

void sort_by_place(Diagnostics& diagnostics) {
  std::stable_sort(diagnostics.begin(), diagnostics.end(), [](const Diagnostic& a, const Diagnostic& b) {
    return std::tie(a.span.file, a.span.line, a.span.column) < std::tie(b.span.file, b.span.line, b.span.column);
  });
}

namespace {

char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

bool equal_but_for_case(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) { return lower(x) == lower(y); });
}

constexpr std::size_t kLengthMax = 64;  // Longer names are not slips of the finger; bounds the cost.

// Costs are doubled so that a difference in case only can cost half an edit.
int edit_distance2(std::string_view a, std::string_view b) {
  std::array<std::array<int, kLengthMax + 1>, kLengthMax + 1> cost;
  std::array<char, kLengthMax> low_a;
  std::array<char, kLengthMax> low_b;
  std::transform(a.begin(), a.end(), low_a.begin(), lower);
  std::transform(b.begin(), b.end(), low_b.begin(), lower);
  for (std::size_t i = 0; i <= a.size(); ++i) cost[i][0] = static_cast<int>(2 * i);
  for (std::size_t j = 0; j <= b.size(); ++j) cost[0][j] = static_cast<int>(2 * j);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const int change = a[i - 1] == b[j - 1] ? 0 : low_a[i - 1] == low_b[j - 1] ? 1 : 2;
      int best = std::min({cost[i - 1][j] + 2, cost[i][j - 1] + 2, cost[i - 1][j - 1] + change});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) best = std::min(best, cost[i - 2][j - 2] + 2);
      cost[i][j] = best;
    }
  }
  return cost[a.size()][b.size()];
}

}  // namespace

std::string_view closest(std::string_view name, std::span<const std::string> candidates) {
  // Each of thousands of unknown names is compared with thousands of known ones.
  constexpr std::size_t kCandidatesMax = 2'000;
  if (name.empty() || name.size() > kLengthMax) return {};
  std::string_view best;
  // One edit in three letters; of a single letter, only its case.
  int best_cost = name.size() == 1 ? 2 : 2 * std::max<int>(1, static_cast<int>(name.size()) / 3) + 1;
  for (const std::string& candidate : candidates.first(std::min(candidates.size(), kCandidatesMax))) {
    if (candidate.empty() || candidate.size() > kLengthMax) continue;
    const auto [shorter, longer] = std::minmax({name.size(), candidate.size()});
    if (2 * static_cast<int>(longer - shorter) >= best_cost) continue;
    const int cost = equal_but_for_case(name, candidate) ? 1 : edit_distance2(name, candidate);
    if (cost < best_cost) {
      best = candidate;
      best_cost = cost;
    }
  }
  return best;
}

namespace {

// Candidates that end with the name: "FetchCup.Grasp" of "Grasp". Nothing: there are too many to choose from, too.
std::vector<std::string_view> ending_with(std::string_view name, std::span<const std::string> candidates) {
  constexpr std::size_t kShownMax = 3;
  std::vector<std::string_view> found;
  for (const std::string& candidate : candidates) {
    const std::string_view whole(candidate);
    if (whole == name) return {};
    if (whole.size() <= name.size() || whole[whole.size() - name.size() - 1] != '.' || !whole.ends_with(name)) continue;
    if (std::find(found.begin(), found.end(), whole) == found.end()) found.push_back(whole);
    if (found.size() > kShownMax) return {};
  }
  return found;
}

}  // namespace

std::string did_you_mean(std::string_view name, std::span<const std::string> candidates) {
  if (!name.empty() && name.size() <= kLengthMax) {
    const std::vector<std::string_view> whole = ending_with(name, candidates);
    std::string named;
    for (std::size_t i = 0; i < whole.size(); ++i) {
      named += i == 0 ? "\"" : i + 1 < whole.size() ? "\", \"" : "\" or \"";
      named += whole[i];
    }
    if (!named.empty()) return "; did you mean " + named + "\"?";
  }
  const std::string_view near = closest(name, candidates);
  // What is right but for its place has no other spelling.
  return near.empty() || near == name ? std::string() : "; did you mean \"" + std::string(near) + "\"?";
}

}  // namespace sentree
