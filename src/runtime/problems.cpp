#include "sentree/runtime/problems.h"

#include <fmt/format.h>

#include <string_view>

#include "sentree/base/ascii.h"

namespace sentree::runtime {

namespace {

// Without the numbers that are words of their own; a leaf's "Leaf2" stays.
std::string without_numbers(const std::string& text) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const bool begins = is_digit(text[at]) && (at == 0 || text[at - 1] == ' ' || text[at - 1] == '(');
    std::size_t end = at;
    while (begins && end < text.size() && (is_digit(text[end]) || text[end] == '.')) ++end;
    const bool is_number = begins && (end == text.size() || !is_word(text[end]));
    out += is_number ? "#" : std::string(1, text[at]);
    at = is_number ? end : at + 1;
  }
  return out;
}

// Whether the peer has just been tried, or will be, is no other problem.
std::string kind_of(const std::string& text) {
  constexpr std::string_view kBetweenTries = "; tried again in # ms";
  std::string out = without_numbers(text);
  if (const auto at = out.find(kBetweenTries); at != std::string::npos) out.erase(at, kBetweenTries.size());
  return out;
}

}  // namespace

std::size_t Problems::add(const std::string& what) {
  const std::string kind = kind_of(what);
  auto found = index_.find(kind);
  if (found == index_.end()) {
    if (kinds_.size() == kKindsMax) return ++others_;
    found = index_.emplace(kind, kinds_.size()).first;
    kinds_.push_back({what, 0});
  }
  return ++kinds_[found->second].times;
}

std::vector<std::string> Problems::list() const {
  std::vector<std::string> out;
  for (const Kind& kind : kinds_)
    out.push_back(kind.times == 1 ? kind.first : fmt::format("{} ({} times)", kind.first, kind.times));
  return out;
}

bool is_power_of_ten(std::size_t number) {
  while (number >= 10 && number % 10 == 0) number /= 10;
  return number == 1;
}

}  // namespace sentree::runtime
