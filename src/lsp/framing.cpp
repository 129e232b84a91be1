#include "sentree/lsp/framing.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace sentree::lsp {

namespace {

constexpr std::string_view kEnd = "\r\n\r\n";

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return out;
}

// Content-Length of a header; nothing: it has none that can be read.
std::optional<std::size_t> length_in(std::string_view header) {
  while (!header.empty()) {
    const std::size_t end = std::min(header.find("\r\n"), header.size());
    const std::string_view line = header.substr(0, end);
    header.remove_prefix(std::min(end + 2, header.size()));
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos || lower(line.substr(0, colon)) != "content-length") continue;
    std::string_view number = line.substr(colon + 1);
    while (!number.empty() && number.front() == ' ') number.remove_prefix(1);
    while (!number.empty() && number.back() == ' ') number.remove_suffix(1);
    std::size_t length = 0;
    const auto [last, error] = std::from_chars(number.data(), number.data() + number.size(), length);
    if (error != std::errc() || last != number.data() + number.size()) return std::nullopt;
    return length;
  }
  return std::nullopt;
}

}  // namespace

std::optional<Framing::Frame> Framing::next() {
  const std::size_t skipped = std::min(passed_over_, waiting_.size() - at_);
  passed_over_ -= skipped;
  at_ += skipped;
  if (!length_) {
    const std::string_view rest = std::string_view(waiting_).substr(at_);
    const std::size_t end = rest.substr(0, kHeaderBytesMax).find(kEnd);
    if (end == std::string_view::npos) {
      if (rest.size() < kHeaderBytesMax) {
        waiting_.erase(0, at_);
        at_ = 0;
        return std::nullopt;
      }
      at_ = waiting_.size();
      return Frame{{}, fmt::format("a header has at most {} bytes and ends with an empty line", kHeaderBytesMax)};
    }
    const auto length = length_in(rest.substr(0, end));
    at_ += end + kEnd.size();
    if (!length) return Frame{{}, "a message begins with Content-Length: NUMBER"};
    if (*length > kMessageBytesMax) {
      passed_over_ = *length;
      return Frame{{}, fmt::format("a message has at most {} bytes", kMessageBytesMax)};
    }
    length_ = length;
  }
  if (waiting_.size() - at_ < *length_) return std::nullopt;
  Frame frame{waiting_.substr(at_, *length_), {}};
  at_ += *length_;
  length_.reset();
  return frame;
}

std::string framed(std::string_view content) {
  return fmt::format("Content-Length: {}\r\n\r\n{}", content.size(), content);
}

}  // namespace sentree::lsp
