#include "sentree/lsp/symbols.h"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include "sentree/base/ascii.h"
#include "sentree/lsp/lines.h"

namespace sentree::lsp {

std::string written_name(const Symbol& symbol) {
  const bool has_file = symbol.kind == SymbolKind::kInterface || symbol.kind == SymbolKind::kMethod ||
                        symbol.kind == SymbolKind::kType || symbol.kind == SymbolKind::kState ||
                        symbol.kind == SymbolKind::kData || symbol.kind == SymbolKind::kDefinition ||
                        symbol.kind == SymbolKind::kEvent;
  std::string name = has_file ? symbol.name.substr(symbol.name.rfind('#') + 1) : symbol.name;
  if (symbol.kind == SymbolKind::kMethod) name = name.substr(name.find('.') + 1);
  return name;
}

Symbol method_symbol(const idl::Method& method, const std::string& file) {
  const bool is_absolute = std::filesystem::path(method.span.file).is_absolute();
  return {SymbolKind::kMethod,
          fmt::format("{}#{}.{}", is_absolute ? method.span.file : file, method.service, method.name)};
}

Observed observed(std::string_view name, const Names& names) {
  Observed parts;
  const std::size_t dot = std::min(name.find('.'), name.size());
  const auto service = names.services.find(name.substr(0, dot));
  if (service == names.services.end()) return parts;
  parts.service = &service->second;
  parts.service_name = name.substr(0, dot);
  if (dot == name.size()) return parts;
  const std::string_view rest = name.substr(dot + 1);
  const std::size_t second = std::min(rest.find('.'), rest.size());
  parts.method_name = rest.substr(0, second);
  if (parts.service->service) parts.method = parts.service->service->find(parts.method_name);
  if (second < rest.size()) parts.kind = rest.substr(second + 1);
  return parts;
}

Occurrences occurrences_in_interface(std::string_view text, const idl::Schema& schema, const std::string& file) {
  Occurrences found;
  const Offsets offsets(text);
  const auto define = [&](SymbolKind kind, const std::string& name, const std::string& symbol, const SourceSpan& span) {
    const std::size_t from = offsets.of(span);
    if (text.substr(from, name.size()) == name)
      found.push_back({{kind, fmt::format("{}#{}", file, symbol)}, from, from + name.size(), true});
  };
  std::set<std::string, std::less<>> types;
  for (const idl::Service& service : schema.services()) {
    define(SymbolKind::kInterface, service.name, service.name, service.span);
    for (const idl::Method& method : service.own_methods)
      define(SymbolKind::kMethod, method.name, fmt::format("{}.{}", service.name, method.name), method.span);
  }
  const auto define_types = [&](const auto& all) {
    for (const auto& type : all) {
      types.insert(type.name);
      define(SymbolKind::kType, type.name, type.name, type.span);
    }
  };
  define_types(schema.structures());
  define_types(schema.enumerations());
  define_types(schema.typedefs());
  // Every other word of that name outside of comments and texts is a use.
  std::set<std::size_t> defined;
  for (const Occurrence& occurrence : found) defined.insert(occurrence.from);
  for (std::size_t at = 0; at < text.size();) {
    const char c = text[at];
    const bool is_line = c == '#' || text.substr(at, 2) == "//";
    if (is_line || text.substr(at, 2) == "/*" || c == '"' || c == '\'') {
      const std::string_view end = is_line ? "\n" : c == '/' ? "*/" : text.substr(at, 1);
      const std::size_t close = text.find(end, at + (c == '/' ? 2 : 1));
      at = close == std::string_view::npos ? text.size() : close + end.size();
    } else if (is_word(c)) {
      const std::size_t from = at;
      while (at < text.size() && is_word(text[at])) ++at;
      const std::string_view word = text.substr(from, at - from);
      if (types.contains(word) && !defined.contains(from) && (from == 0 || text[from - 1] != '.'))
        found.push_back({{SymbolKind::kType, fmt::format("{}#{}", file, word)}, from, at, false});
    } else {
      ++at;
    }
  }
  return found;
}

}  // namespace sentree::lsp
