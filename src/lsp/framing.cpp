#include "sentree/lsp/framing.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "sentree/base/ascii.h"

namespace sentree::lsp {

namespace {

constexpr std::string_view kLength = "content-length";

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool equals_length(std::string_view name) {
  return std::equal(name.begin(), name.end(), kLength.begin(), kLength.end(),
                    [](char a, char b) { return lower(a) == b; });
}

// Names of fields, as HTTP has them.
bool is_of_name(char c) { return is_word(c) || c == '-'; }

std::optional<std::size_t> number_in(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  std::size_t number = 0;
  const auto [last, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || last != text.data() + text.size()) return std::nullopt;
  return number;
}

struct Header {
  enum class State { kWhole, kGoesOn, kIsNone };
  State state = State::kGoesOn;
  std::size_t size = 0;               // with the empty line that ends it
  std::optional<std::size_t> length;  // it has a Content-Length that can be read
};

// What begins like a header: NAME: VALUE, line by line.
Header header_at(std::string_view text) {
  Header header;
  for (;;) {
    std::string_view line = text.substr(header.size, text.find('\n', header.size) - header.size);
    const bool is_whole = header.size + line.size() < text.size();
    if (is_whole && (line.empty() || line == "\r")) {
      header.size += line.size() + 1;
      header.state = header.size > line.size() + 1 ? Header::State::kWhole : Header::State::kIsNone;
      return header;
    }
    const std::string_view name = line.substr(0, line.find(':'));
    const bool is_name = std::all_of(name.begin(), name.end(), is_of_name) && (name.size() < line.size() || !is_whole);
    if (!is_name && !(line == "\r" && !is_whole)) header.state = Header::State::kIsNone;
    if (!is_name || !is_whole) return header;
    header.size += line.size() + 1;
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (equals_length(name)) header.length = number_in(line.substr(name.size() + 1));
  }
}

}  // namespace

std::optional<Framing::Frame> Framing::refuse(std::string problem) {
  is_lost_ = true;
  ++at_;  // it begins no header
  return Frame{{}, std::move(problem)};
}

// Passes over everything up to the next header that is well formed, or may become so; whether it is.
bool Framing::find_header() {
  for (;; ++at_) {
    const auto from = waiting_.begin() + static_cast<std::ptrdiff_t>(at_);
    const auto begin =
        std::search(from, waiting_.end(), kLength.begin(), kLength.end(), [](char a, char b) { return lower(a) == b; });
    if (begin == waiting_.end()) {
      // Its first bytes may be the last ones.
      at_ = std::max(at_, waiting_.size() - std::min(waiting_.size(), kLength.size() - 1));
      return false;
    }
    at_ = static_cast<std::size_t>(begin - waiting_.begin());
    const Header header = header_at(std::string_view(waiting_).substr(at_, kHeaderBytesMax));
    if (header.state == Header::State::kWhole && header.length) return true;
    if (header.state == Header::State::kGoesOn && waiting_.size() - at_ < kHeaderBytesMax) return false;
  }
}

std::optional<Framing::Frame> Framing::next() {
  const std::size_t skipped = std::min(passed_over_, waiting_.size() - at_);
  passed_over_ -= skipped;
  at_ += skipped;
  if (!length_) {
    const bool is_found = !is_lost_ || find_header();
    if (!is_found || at_ == waiting_.size()) {
      waiting_.erase(0, at_);
      at_ = 0;
      return std::nullopt;
    }
    const std::string_view rest = std::string_view(waiting_).substr(at_, kHeaderBytesMax);
    const Header header = header_at(rest);
    if (header.state == Header::State::kGoesOn) {
      if (rest.size() == kHeaderBytesMax)
        return refuse(fmt::format("a header has at most {} bytes and ends with an empty line", kHeaderBytesMax));
      waiting_.erase(0, at_);
      at_ = 0;
      return std::nullopt;
    }
    if (header.state == Header::State::kIsNone || !header.length)
      return refuse("a message begins with Content-Length: NUMBER and an empty line");
    is_lost_ = false;
    at_ += header.size;
    if (*header.length > kMessageBytesMax) {
      passed_over_ = *header.length;
      return Frame{{}, fmt::format("a message has at most {} bytes", kMessageBytesMax)};
    }
    length_ = header.length;
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
