#include "sentree/lsp/describe.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "sentree/base/ascii.h"
#include "sentree/bt/tree.h"
#include "sentree/design/findings.h"
#include "sentree/lsp/detail/xml_cursor.h"
#include "sentree/monitor/requirement.h"
#include "sentree/text/xml.h"
#include "sentree/text/yaml.h"

namespace sentree::lsp {

namespace {

std::string_view trimmed(std::string_view text) {
  const std::size_t from = text.find_first_not_of(" \t\r");
  if (from == std::string_view::npos) return {};
  return text.substr(from, text.find_last_not_of(" \t\r") - from + 1);
}

std::string_view line_at(std::string_view text, std::size_t offset) {
  const std::size_t before = offset == 0 ? std::string_view::npos : text.rfind('\n', offset - 1);
  const std::size_t from = before == std::string_view::npos ? 0 : before + 1;
  return text.substr(from, std::min(text.find('\n', offset), text.size()) - from);
}

// Without "//", "/**", "*", "#", "*/" around it.
std::string_view uncommented(std::string_view line) {
  line = trimmed(line);
  while (!line.empty() && (line.front() == '/' || line.front() == '*' || line.front() == '#' || line.front() == '<' ||
                           line.front() == '!'))
    line.remove_prefix(1);
  if (line.ends_with("*/")) line.remove_suffix(2);
  return trimmed(line);
}

std::string fenced(std::string_view language, std::string_view code) {
  return fmt::format("```{}\n{}\n```\n", language, code);
}

std::string_view kind_name(bt::Category category) {
  switch (category) {
    case bt::Category::kAction: return "action";
    case bt::Category::kCondition: return "condition";
    case bt::Category::kControl: return "control node";
    case bt::Category::kDecorator: return "decorator";
    default: return "node";
  }
}

std::string type_name(const bt::PortInfo& port) {
  if (port.type != nullptr) return port.type->name;
  return port.declared_type.empty() ? "any" : port.declared_type;
}

std::string port_line(const bt::PortInfo& port) {
  std::string line = port.direction == bt::PortDirection::kOutput  ? "output "
                     : port.direction == bt::PortDirection::kInOut ? "in/out "
                                                                   : "input ";
  line += fmt::format("`{}`: {}", port.name, type_name(port));
  if (port.default_text) line += fmt::format(" = `{}`", *port.default_text);
  if (!port.description.empty()) line += " — " + port.description;
  return line;
}

std::string node_text(const Index& index, std::string_view id) {
  const bt::NodeModel* const model = index.palette().find(id);
  if (model == nullptr) return {};
  std::string out = fmt::format("**{}** — {}", id, kind_name(model->category));
  if (const std::string chart = index.chart_of(id); !chart.empty())
    out += fmt::format(", runs `{}`", std::filesystem::path(chart).lexically_relative(index.folder()).generic_string());
  out += "\n";
  if (!model->description.empty()) out += fmt::format("\n{}\n", model->description);
  for (const bt::PortInfo& port : model->ports) out += "\n- " + port_line(port);
  return out;
}

std::string file_of(const Symbol& symbol) { return symbol.name.substr(0, symbol.name.rfind('#')); }
std::string name_of(const Symbol& symbol) { return symbol.name.substr(symbol.name.rfind('#') + 1); }

std::string method_text(const Index& index, const Symbol& symbol) {
  const std::string file = file_of(symbol);
  const std::string name = name_of(symbol);
  const idl::Schema* const schema = index.schema(file);
  const idl::ServicePtr service = schema != nullptr ? schema->service(name.substr(0, name.find('.'))) : nullptr;
  const idl::Method* const method = service ? service->find(name.substr(name.find('.') + 1)) : nullptr;
  if (method == nullptr) return {};
  std::string out = fenced("thrift", signature_of(*method));
  if (const IndexedFile* text = index.find(file))
    out += comment_at(text->text, design::offset_of(text->text, method->span));
  if (method->result != nullptr && method->result->structure != nullptr) {
    out += fmt::format("\n\n{}:", method->result->name);
    for (const idl::Field& field : method->result->structure->fields)
      out += fmt::format("\n- `{}`", declaration_of(field));
  } else if (method->result != nullptr && method->result->enumeration != nullptr) {
    out += fmt::format("\n\n{}:", method->result->name);
    for (const idl::Enumerator& word : method->result->enumeration->enumerators) out += fmt::format(" `{}`", word.name);
  }
  return out;
}

std::string type_text(const Index& index, const Symbol& symbol) {
  const std::string file = file_of(symbol);
  const idl::Schema* const schema = index.schema(file);
  if (schema == nullptr) return {};
  const std::string name = name_of(symbol);
  std::string out;
  SourceSpan span;
  if (const idl::Struct* structure = schema->structure(name)) {
    out = fmt::format("struct {} {{", name);
    for (const idl::Field& field : structure->fields) out += "\n  " + declaration_of(field);
    span = structure->span;
    out += "\n}";
  } else if (const idl::Enum* enumeration = schema->enumeration(name)) {
    out = fmt::format("enum {} {{", name);
    for (const idl::Enumerator& word : enumeration->enumerators)
      out += fmt::format("\n  {} = {}", word.name, word.number);
    span = enumeration->span;
    out += "\n}";
  } else {
    return {};
  }
  out = fenced("thrift", out);
  if (const IndexedFile* text = index.find(file)) out += comment_at(text->text, design::offset_of(text->text, span));
  return out;
}

std::string requirement_text(const Index& index, const std::string& name) {
  for (const auto& [path, file] : index.files()) {
    if (file.kind != FileKind::kRequirements) continue;
    const auto parsed = monitor::parse_requirements(file.text, path);
    if (!parsed.value) continue;
    for (const monitor::Requirement& requirement : parsed.value->requirements) {
      if (requirement.name != name) continue;
      return fmt::format("**{}** ({}) {}\n\n{}", name, monitor::to_string(requirement.importance), requirement.prose,
                         fenced("", requirement.text()));
    }
  }
  const auto monitor = index.names().monitors.find(name);
  return monitor != index.names().monitors.end() ? fmt::format("**{}** — a monitor", name) : "";
}

std::string definition_text(const Index& index, const Symbol& symbol) {
  const IndexedFile* const file = index.find(file_of(symbol));
  if (file == nullptr) return {};
  for (const Occurrence& occurrence : file->occurrences) {
    if (!occurrence.defines || occurrence.symbol != symbol) continue;
    std::string out = fenced("", trimmed(line_at(file->text, occurrence.from)));
    return out + comment_at(file->text, occurrence.from);
  }
  return {};
}

std::string symbol_text(const Index& index, const Symbol& symbol) {
  switch (symbol.kind) {
    case SymbolKind::kSkill: return node_text(index, symbol.name);
    case SymbolKind::kMethod: return method_text(index, symbol);
    case SymbolKind::kType: return type_text(index, symbol);
    case SymbolKind::kInterface: return fmt::format("interface **{}** of `{}`", name_of(symbol), file_of(symbol));
    case SymbolKind::kRequirement: return requirement_text(index, symbol.name);
    case SymbolKind::kDefinition:
    case SymbolKind::kEvent:
    case SymbolKind::kLocation:
    case SymbolKind::kData: break;
    case SymbolKind::kService: {
      const auto service = index.names().services.find(symbol.name);
      if (service == index.names().services.end()) return {};
      std::string out =
          fmt::format("service **{}**: `{}/{}`", symbol.name,
                      std::filesystem::path(service->second.file).filename().string(), service->second.interface);
      if (const auto* project = index.project()) {
        if (const auto* entry = project->service(symbol.name)) out += fmt::format(", at `{}`", entry->at);
      }
      if (!service->second.service) return out;
      for (const idl::Method* method : service->second.service->methods)
        out += fmt::format("\n- `{}`", signature_of(*method));
      return out;
    }
    case SymbolKind::kTree: return fmt::format("tree **{}**", symbol.name);
    case SymbolKind::kNode: return fmt::format("node **{}**", symbol.name);
    case SymbolKind::kState: return fmt::format("state **{}**", name_of(symbol));
  }
  for (const Index::Place& place : index.places_of(symbol)) {
    if (!place.occurrence->defines) continue;
    const IndexedFile& file = *index.find(*place.file);
    if (symbol.kind == SymbolKind::kDefinition || symbol.kind == SymbolKind::kEvent)
      return definition_text(index, symbol);
    return fenced(symbol.kind == SymbolKind::kData ? "xml" : "yaml",
                  trimmed(line_at(file.text, place.occurrence->from)));
  }
  return {};
}

// What a path of members at a byte is: "_event.data.result.percentage" up to the name under it.
std::string member_text(const Index& index, const IndexedFile& file, std::size_t offset, std::size_t& from,
                        std::size_t& to) {
  const std::string_view text = file.text;
  from = to = std::min(offset, text.size());
  while (from > 0 && is_word(text[from - 1])) --from;
  while (to < text.size() && is_word(text[to])) ++to;
  std::size_t begin = from;
  while (begin > 0 && (is_word(text[begin - 1]) || text[begin - 1] == '.')) --begin;
  const std::string_view path = text.substr(begin, to - begin);
  constexpr std::string_view kData = "_event.data.";
  if (!path.starts_with(kData)) return {};
  const std::string event = event_around(file, offset);
  const Observed observation = observed(event, index.names());
  const idl::Field* field = nullptr;
  const idl::Type* const type = type_at(observation, path.substr(kData.size()), &field);
  if (type == nullptr) return {};
  std::string out = fenced("thrift", field != nullptr ? declaration_of(*field) : type->name + " result");
  if (type->enumeration != nullptr) {
    for (const idl::Enumerator& word : type->enumeration->enumerators) out += fmt::format(" `{}`", word.name);
  }
  return fmt::format("{}\n\nof `{}`", out, event);
}

}  // namespace

std::string declaration_of(const idl::Field& field) {
  std::string out = fmt::format("{} {}", field.type->name, field.name);
  if (!field.unit.empty()) out += fmt::format(" [{}]", field.unit);
  return out;
}

std::string signature_of(const idl::Method& method) {
  std::string out = method.oneway ? "oneway " : "";
  out += fmt::format("{} {}(", method.result != nullptr ? method.result->name : "void", method.name);
  for (const idl::Field& field : method.arguments.fields) {
    if (&field != &method.arguments.fields.front()) out += ", ";
    out += declaration_of(field);
  }
  out += ")";
  if (!method.unit.empty()) out += fmt::format(" [{}]", method.unit);
  return out;
}

std::string comment_at(std::string_view text, std::size_t offset) {
  const std::size_t end = std::min(text.find('\n', offset), text.size());
  const std::string_view rest = text.substr(std::min(offset, end), end - std::min(offset, end));
  for (const char* mark : {"//", "/*", " #"}) {
    if (const std::size_t at = rest.find(mark); at != std::string_view::npos)
      return std::string(uncommented(rest.substr(at)));
  }
  std::vector<std::string> lines;
  std::size_t line = offset == 0 ? std::string_view::npos : text.rfind('\n', offset - 1);
  while (line != std::string_view::npos && line > 0) {
    const std::string_view above = trimmed(line_at(text, line - 1 + (text[line - 1] == '\n' ? 1 : 0)));
    const bool is_comment = above.starts_with("//") || above.starts_with("/*") || above.starts_with("*") ||
                            above.starts_with("#") || above.ends_with("*/");
    if (!is_comment) break;
    lines.emplace_back(uncommented(above));
    line = text.rfind('\n', line - 1);
  }
  std::string out;
  for (auto it = lines.rbegin(); it != lines.rend(); ++it) out += (out.empty() || it->empty() ? "" : "\n") + *it;
  return out;
}

const idl::Type* type_at(const Observed& observation, std::string_view path, const idl::Field** field) {
  if (observation.method == nullptr) return nullptr;
  const idl::Struct* in = nullptr;
  const idl::Type* type = nullptr;
  bool is_first = true;
  while (!path.empty()) {
    const std::size_t dot = std::min(path.find('.'), path.size());
    const std::string_view name = path.substr(0, dot);
    path.remove_prefix(std::min(dot + 1, path.size()));
    if (is_first) {
      is_first = false;
      if (name == "args") {
        in = &observation.method->arguments;
        type = nullptr;
        continue;
      }
      if (name != "result" || observation.kind != "reply") return nullptr;
      type = observation.method->result;
    } else {
      const idl::Field* const found = in != nullptr ? in->find(name) : nullptr;
      if (found == nullptr) return nullptr;
      if (field != nullptr) *field = found;
      type = found->type;
    }
    in = type != nullptr ? type->structure : nullptr;
  }
  return type;
}

Fields fields_at(const Observed& observation, std::string_view path) {
  Fields fields;
  if (observation.method == nullptr) return fields;
  if (path.empty()) {
    fields.arguments = true;
    if (observation.kind == "reply") fields.result = observation.method->result;
    return fields;
  }
  if (path.ends_with('.')) path.remove_suffix(1);
  const idl::Struct* in = nullptr;
  if (path == "args") {
    in = &observation.method->arguments;
  } else if (const idl::Type* type = type_at(observation, path, nullptr)) {
    in = type->structure;
  }
  if (in == nullptr) return fields;
  for (const idl::Field& field : in->fields) fields.fields.push_back(&field);
  return fields;
}

std::string event_around(const IndexedFile& file, std::size_t offset) {
  const XmlCursor cursor = xml_cursor(file.text, offset);
  if (cursor.tag.name == "transition") return std::string(cursor.tag.attribute("event"));
  for (auto open = cursor.open.rbegin(); open != cursor.open.rend(); ++open) {
    if (open->name == "transition") return std::string(open->attribute("event"));
  }
  return {};
}

std::string hover_at(const Index& index, const std::string& name, std::size_t offset, std::size_t& from,
                     std::size_t& to) {
  const IndexedFile* const file = index.find(name);
  if (file == nullptr) return {};
  if (file->kind == FileKind::kChart) {
    if (std::string text = member_text(index, *file, offset, from, to); !text.empty()) return text;
  }
  // Of a node its kind is more than its name.
  if (file->kind == FileKind::kTree) {
    const XmlCursor cursor = xml_cursor(file->text, offset);
    std::string id = cursor.tag.name;
    if (bt::is_explicit_tag(id)) id = std::string(cursor.tag.attribute("ID"));
    from = cursor.from;
    to = cursor.to;
    if (cursor.where == XmlCursor::Where::kTagName) return node_text(index, id);
    const bt::NodeModel* const model = index.palette().find(id);
    if (model != nullptr &&
        (cursor.where == XmlCursor::Where::kAttributeName || cursor.where == XmlCursor::Where::kAttributeValue)) {
      const std::string port =
          cursor.where == XmlCursor::Where::kAttributeName ? file->text.substr(from, to - from) : cursor.attribute;
      for (const bt::PortInfo& info : model->ports) {
        if (info.name != port) continue;
        std::string text = port_line(info);
        if (const Occurrence* at = index.at(name, offset); at != nullptr && at->symbol.kind == SymbolKind::kLocation)
          text += "\n\n" + symbol_text(index, at->symbol);
        return text;
      }
      if (port == "name") return node_text(index, id);
    }
  }
  const Occurrence* const occurrence = index.at(name, offset);
  if (occurrence == nullptr) return {};
  from = occurrence->from;
  to = std::min(occurrence->to, file->text.size());
  return symbol_text(index, occurrence->symbol);
}

}  // namespace sentree::lsp
