#include "sentree/lsp/detail/uri.h"

#include <cctype>

namespace sentree::lsp {

namespace {

int digit_of(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

}  // namespace

std::optional<std::filesystem::path> path_of(std::string_view uri) {
  constexpr std::string_view kScheme = "file://";
  if (!uri.starts_with(kScheme)) return std::nullopt;
  uri.remove_prefix(kScheme.size());
  if (uri.starts_with("localhost/")) uri.remove_prefix(9);
  if (!uri.starts_with('/')) return std::nullopt;
  std::string path;
  for (std::size_t at = 0; at < uri.size(); ++at) {
    if (uri[at] != '%') {
      path += uri[at];
      continue;
    }
    if (at + 2 >= uri.size() || digit_of(uri[at + 1]) < 0 || digit_of(uri[at + 2]) < 0) return std::nullopt;
    path += static_cast<char>(digit_of(uri[at + 1]) * 16 + digit_of(uri[at + 2]));
    at += 2;
  }
  if (path.find('\0') != std::string::npos) return std::nullopt;
  return std::filesystem::path(path).lexically_normal();
}

std::string uri_of(const std::filesystem::path& path) {
  constexpr char kDigits[] = "0123456789ABCDEF";
  std::string uri = "file://";
  for (const char c : path.generic_string()) {
    const auto u = static_cast<unsigned char>(c);
    if (u < 0x80 && (std::isalnum(u) != 0 || c == '/' || c == '-' || c == '_' || c == '.' || c == '~')) {
      uri += c;
    } else {
      uri += '%';
      uri += kDigits[u / 16];
      uri += kDigits[u % 16];
    }
  }
  return uri;
}

}  // namespace sentree::lsp
