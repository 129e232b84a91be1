#include "sentree/import/detail/project_writer.h"

#include <fmt/format.h>

#include <cctype>

namespace sentree::import {

std::string safe_name(std::string_view text) {
  std::string name;
  for (const char c : text) {
    const bool kept = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-';
    name += kept ? c : '_';
  }
  while (name.starts_with('_')) name.erase(0, 1);
  return name.empty() ? "unnamed" : name;
}

std::string unused_name(std::string name, std::set<std::string>& taken) {
  const std::string base = name;
  for (int i = 2; !taken.insert(name).second; ++i) name = fmt::format("{}_{}", base, i);
  return name;
}

std::string yaml_text(std::string_view text) {
  bool plain = !text.empty() && std::isalpha(static_cast<unsigned char>(text.front())) != 0;
  for (const char c : text)
    plain = plain && (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' || c == '.' || c == '/');
  for (const std::string_view word : {"true", "false", "yes", "no", "on", "off", "null"}) plain = plain && text != word;
  if (plain) return std::string(text);
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
  }
  return quoted + "\"";
}

}  // namespace sentree::import
