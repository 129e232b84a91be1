#include <algorithm>
#include <utility>

#include "sentree/bt/model.h"
#include "sentree/bt/write.h"
#include "sentree/text/xml.h"

// The canonical form of a file.

namespace sentree::bt {

using text::XmlAttribute;
using text::XmlElement;

namespace {

/// What may stand between elements, with the white space around it left out.
std::vector<std::string_view> comments(std::string_view gap) {
  std::vector<std::string_view> found;
  for (std::size_t at = 0; at < gap.size();) {
    const std::size_t start = gap.find('<', at);
    if (start == std::string_view::npos) break;
    const bool comment = gap.substr(start).starts_with("<!--");
    const std::string_view close = comment ? "-->" : gap.substr(start).starts_with("<?") ? "?>" : ">";
    const std::size_t end = gap.find(close, start);
    if (end == std::string_view::npos) break;
    at = end + close.size();
    found.push_back(gap.substr(start, at - start));
  }
  return found;
}

/// Place of an attribute: the names first, conditions last, everything else as it was.
int rank(std::string_view name) {
  if (name == "BTCPP_format") return 0;
  if (name == "main_tree_to_execute") return 1;
  if (name == "ID") return 2;
  if (name == "name") return 3;
  const auto condition = std::find(std::begin(kConditionNames), std::end(kConditionNames), name);
  if (condition != std::end(kConditionNames)) return 5 + static_cast<int>(condition - std::begin(kConditionNames));
  return 4;
}

class Formatter {
 public:
  explicit Formatter(const text::XmlDocument& document) : source_(document.source()) {}

  std::string run(const XmlElement& root) {
    std::string_view before = source_.substr(0, root.offset());
    if (before.starts_with("\xEF\xBB\xBF")) before.remove_prefix(3);
    lines(before, 0);
    element(root, 0);
    lines(source_.substr(root.end_offset()), 0);
    return std::move(out_);
  }

 private:
  void indent(std::size_t depth) { out_.append(2 * depth, ' '); }
  void lines(std::string_view gap, std::size_t depth) {
    for (const std::string_view comment : comments(gap)) {
      indent(depth);
      out_ += comment;
      out_ += '\n';
    }
  }

  // The parser bounds the nesting.
  void element(const XmlElement& e, std::size_t depth) {
    indent(depth);
    const std::string name(e.name());
    out_ += "<" + name;
    std::vector<XmlAttribute> attributes = e.attributes();
    std::stable_sort(attributes.begin(), attributes.end(),
                     [](const XmlAttribute& a, const XmlAttribute& b) { return rank(a.name) < rank(b.name); });
    for (const XmlAttribute& a : attributes) {
      out_ += " " + std::string(a.name) + "=\"" + text::xml_escape(a.value) + "\"";
    }
    const std::string_view inner = e.inner_source();
    const bool has_text = e.text().find_first_not_of(" \t\r\n") != std::string::npos;
    if (has_text) {
      // Text is content: its white space is left alone, and so is what is mixed with it.
      out_ += ">" + std::string(inner) + "</" + name + ">\n";
      return;
    }
    const bool empty = !e.first_child() && comments(inner).empty();
    if (empty) {
      out_ += "/>\n";
      return;
    }
    out_ += ">\n";
    std::size_t at = static_cast<std::size_t>(inner.data() - source_.data());
    const std::size_t end = at + inner.size();
    for (XmlElement child = e.first_child(); child; child = child.next_sibling()) {
      lines(source_.substr(at, child.offset() - at), depth + 1);
      element(child, depth + 1);
      at = child.end_offset();
    }
    lines(source_.substr(at, end - at), depth + 1);
    indent(depth);
    out_ += "</" + name + ">\n";
  }

  std::string_view source_;
  std::string out_;
};

}  // namespace

Result<std::string> format(std::string_view xml, std::string file) {
  auto document = text::XmlDocument::parse(std::string(xml), std::move(file), {.lenient = true});
  if (!document) return tl::unexpected(std::move(document.error()));
  return Formatter(*document).run(document->root());
}

}  // namespace sentree::bt
