#include "sentree/scxml/diff.h"

#include <fmt/format.h>

#include <utility>

#include "sentree/text/xml.h"

namespace sentree::scxml {

using text::XmlElement;

namespace {

std::string value(const XmlElement& element, const char* attribute) {
  return std::string(element.attribute(attribute).value_or(""));
}

// A prefix is any word for its namespace; those of the chart's own go by their names alone.
std::string kind(const XmlElement& element) {
  if (is_chart(element)) return "chart";
  const std::string_view uri = element.namespace_uri();
  if (uri.empty()) return std::string(element.name());
  XmlElement root = element;
  while (root.parent()) root = root.parent();
  return uri == root.namespace_uri() ? std::string(element.local_name())
                                     : fmt::format("{} ({})", element.local_name(), uri);
}

bool is_state(std::string_view name) {
  return name == "state" || name == "parallel" || name == "final" || name == "history";
}

// The attribute by which people tell elements of this name apart.
const char* telling(std::string_view name) {
  if (name == "transition" || name == "send" || name == "raise") return "event";
  if (name == "assign") return "location";
  if (name == "log") return "label";
  if (name == "if" || name == "elseif") return "cond";
  if (name == "data" || name == "invoke" || is_state(name)) return "id";
  return "name";
}

std::string shown(const XmlElement& element) {
  const std::string_view name = element.local_name();
  std::string told = value(element, telling(name));
  if (is_state(name) && !told.empty()) return told;
  return kind(element) + (told.empty() ? "" : " " + told);
}

std::string identity(const XmlElement& element) {
  const std::string id = is_state(element.local_name()) ? value(element, "id") : std::string();
  return id.empty() ? id : "state " + id;
}

std::string key(const XmlElement& element) {
  const std::string own = identity(element);
  return own.empty() ? fmt::format("{}\n{}", kind(element), value(element, telling(element.local_name()))) : own;
}

// Nobody takes one state, one variable for another.
std::string like(const XmlElement& element) {
  std::string own = identity(element);
  if (!own.empty()) return own;
  return element.local_name() == "data" ? key(element) : kind(element);
}

// Without the white space around it.
std::string written(const XmlElement& element) {
  const std::string all = element.text();
  const std::size_t begin = all.find_first_not_of(" \t\r\n");
  return begin == std::string::npos ? "" : all.substr(begin, all.find_last_not_of(" \t\r\n") + 1 - begin);
}

// Where editors keep positions: Qt Creator, Phrogz' viewer.
bool is_layout(std::string_view name) { return name.starts_with("qt:") || name.starts_with("viz:"); }

text::XmlMeaning meaning() {
  return {.kind = kind,
          .shown = shown,
          .key = key,
          .like = like,
          .identity = identity,
          .text = written,
          .passes_over_attribute =
              [](const XmlElement& element, std::string_view name) {
                return name.starts_with("xmlns") || is_layout(name) ||
                       value(element, std::string(name).c_str()).empty();
              },
          .passes_over = [](const XmlElement& element) { return is_layout(element.name()); }};
}

}  // namespace

bool is_chart(const XmlElement& root) { return root.local_name() == "scxml" || root.local_name() == "ascxml"; }

Result<std::vector<text::Difference>> diff(std::string_view before, std::string_view after, std::string before_file,
                                           std::string after_file, text::ElementPairs* pairs) {
  auto a = text::XmlDocument::parse(std::string(before), std::move(before_file), {.lenient = true});
  if (!a) return tl::unexpected(std::move(a.error()));
  auto b = text::XmlDocument::parse(std::string(after), std::move(after_file), {.lenient = true});
  if (!b) return tl::unexpected(std::move(b.error()));
  for (const XmlElement& root : {a->root(), b->root()}) {
    if (!is_chart(root)) {
      return fail("scxml.no-scxml", fmt::format("the root element is <{}>, not <scxml>", root.name()), root.span());
    }
  }
  text::XmlComparison comparison(meaning());
  const std::string name = value(a->root(), "name");
  comparison.nodes(a->root(), b->root(), name.empty() ? "chart" : name);
  comparison.join_moved();
  if (pairs != nullptr) *pairs = std::move(comparison.pairs);
  return std::move(comparison.found);
}

}  // namespace sentree::scxml
