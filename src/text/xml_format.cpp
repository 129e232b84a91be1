#include "sentree/text/xml_format.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "sentree/text/encoding.h"

namespace sentree::text {

namespace {

/// A comment, processing instruction or document type between elements.
struct Aside {
  std::size_t begin;
  std::size_t end;
  std::size_t breaks;  ///< Line breaks in the white space before it.
};

/// One past the '>' of the document type that begins at `at`; its internal subset holds others.
std::size_t doctype_end(std::string_view source, std::size_t at) {
  char quote = 0;
  bool subset = false;
  for (; at < source.size(); ++at) {
    const char c = source[at];
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '[') {
      subset = true;
    } else if (c == ']') {
      subset = false;
    } else if (c == '>' && !subset) {
      return at + 1;
    }
  }
  return source.size();
}

std::size_t aside_end(std::string_view source, std::size_t begin) {
  const std::string_view rest = source.substr(begin);
  if (rest.starts_with("<!DOCTYPE")) return doctype_end(source, begin);
  const std::string_view close = rest.starts_with("<!--") ? "-->" : "?>";
  return std::min(source.find(close, begin + (close.size() == 3 ? 4 : 2)) + close.size(), source.size());
}

class Formatter {
 public:
  Formatter(const XmlDocument& document, const XmlStyle& style) : source_(document.source()), style_(style) {}

  std::string run(const XmlElement& root) {
    const std::size_t begin = source_.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0;
    const std::size_t breaks = asides(begin, root.offset(), 0);
    element(root, 0, breaks);
    asides(root.end_offset(), source_.size(), 0);
    out_ += '\n';
    return std::move(out_);
  }

 private:
  /// Begins a line, after an empty one where the source has one.
  void begin_line(std::size_t depth, std::size_t breaks) {
    if (!out_.empty()) out_ += breaks > 1 && !opened_ ? "\n\n" : "\n";
    out_.append(2 * depth, ' ');
    opened_ = false;
  }

  [[nodiscard]] std::size_t column() const {
    const std::size_t line = out_.rfind('\n');
    return line == std::string::npos ? out_.size() : out_.size() - line - 1;
  }

  /// Writes what stands between `from` and `to` beside white space. Returns the line breaks behind the last of it.
  std::size_t asides(std::size_t from, std::size_t to, std::size_t depth) {
    std::size_t breaks = 0;
    for (std::size_t at = from; at < to;) {
      if (source_[at] != '<') {
        breaks += source_[at++] == '\n' ? 1U : 0U;
        continue;
      }
      const Aside aside{at, aside_end(source_, at), breaks};
      write(aside, depth, !out_.empty() && aside.breaks == 0);
      at = aside.end;
      breaks = 0;
    }
    return breaks;
  }

  void write(const Aside& aside, std::size_t depth, bool beside) {
    if (beside) {
      out_ += ' ';
      opened_ = false;
    } else {
      begin_line(depth, aside.breaks);
    }
    // Lines of one comment move together, so that drawings and lists in it keep their shape.
    const std::size_t line_begin = source_.rfind('\n', aside.begin) + 1;
    const std::string_view before = source_.substr(line_begin, aside.begin - line_begin);
    const std::size_t now = column();
    const bool moves = before.find('\t') == std::string_view::npos;
    std::string_view rest = source_.substr(aside.begin, aside.end - aside.begin);
    for (bool first = true;; first = false) {
      const std::size_t end = rest.find('\n');
      std::string_view line = rest.substr(0, end);
      if (end != std::string_view::npos) line = line.substr(0, line.find_last_not_of(" \t") + 1);
      if (!first && moves && !line.empty()) {
        const std::size_t blanks = std::min(line.find_first_not_of(' '), line.size());
        if (now > before.size()) out_.append(now - before.size(), ' ');
        if (now < before.size()) line.remove_prefix(std::min(blanks, before.size() - now));
      }
      out_ += line;
      if (end == std::string_view::npos) break;
      out_ += '\n';
      rest.remove_prefix(end + 1);
    }
  }

  void attributes(const XmlElement& e) {
    const auto places = e.attribute_places();
    std::vector<XmlAttributePlace> all(places.begin(), places.end());
    if (style_.attribute_rank) {
      std::stable_sort(all.begin(), all.end(), [this](const XmlAttributePlace& a, const XmlAttributePlace& b) {
        return style_.attribute_rank(name(a)) < style_.attribute_rank(name(b));
      });
    }
    const std::size_t indent = column() + 1;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const std::string text = written(all[i]);
      const std::size_t first_line = std::min(text.find('\n'), text.size());
      if (i > 0 && (begins_line(all[i]) || column() + 1 + first_line + 2 > kXmlColumnsMax)) {
        out_ += '\n';
        out_.append(indent, ' ');
      } else {
        out_ += ' ';
      }
      out_ += text;
    }
  }

  [[nodiscard]] std::string_view name(const XmlAttributePlace& a) const {
    return source_.substr(a.name_begin, a.name_end - a.name_begin);
  }

  /// Whoever broke the line there had a reason.
  [[nodiscard]] bool begins_line(const XmlAttributePlace& a) const {
    return source_[source_.find_last_not_of(" \t", a.name_begin - 1)] == '\n';
  }

  /// name="value", the value as written but for what XML does not allow in it.
  [[nodiscard]] std::string written(const XmlAttributePlace& a) const {
    const std::string_view value = source_.substr(a.value_begin, a.value_end - a.value_begin);
    const char quote = value.find('"') == std::string_view::npos ? '"' : '\'';
    std::string out(name(a));
    out += '=';
    out += quote;
    for (std::size_t i = 0; i < value.size(); ++i) {
      if (value[i] == '<') {
        out += "&lt;";
      } else if (value[i] == '&' && !is_reference(value.substr(i))) {
        out += "&amp;";
      } else {
        out += value[i];
      }
    }
    return out + quote;
  }

  /// "&amp;", "&#10;" …
  static bool is_reference(std::string_view text) {
    const std::size_t end = text.find(';');
    if (end == std::string_view::npos) return false;
    const std::string_view inner = text.substr(1, end - 1);
    if (inner.starts_with('#')) return true;
    for (const std::string_view known : {"amp", "lt", "gt", "quot", "apos"}) {
      if (inner == known) return true;
    }
    return false;
  }

  /// Characters or CDATA between its children.
  [[nodiscard]] bool has_text(const XmlElement& e) const {
    if (e.text().find_first_not_of(" \t\r\n") != std::string::npos) return true;
    const std::string_view inner = e.inner_source();
    std::size_t at = static_cast<std::size_t>(inner.data() - source_.data());
    const std::size_t end = at + inner.size();
    for (XmlElement child = e.first_child();; child = child.next_sibling()) {
      const std::size_t to = child ? child.offset() : end;
      if (source_.substr(at, to - at).find("<![CDATA[") != std::string_view::npos) return true;
      if (!child) return false;
      at = child.end_offset();
    }
  }

  /// Its only child has none itself, and both were written on one line.
  [[nodiscard]] bool stays_on_one_line(const XmlElement& e) const {
    const XmlElement child = e.first_child();
    if (!child || child.next_sibling() || child.first_child()) return false;
    const std::string_view inner = e.inner_source();
    const std::size_t begin = static_cast<std::size_t>(inner.data() - source_.data());
    const std::string_view inside = child.inner_source();
    return inner.find('\n') == std::string_view::npos && child.offset() == begin &&
           child.end_offset() == begin + inner.size() && (inside.empty() || has_text(child));
  }

  // The parser bounds the nesting.
  void element(const XmlElement& e, std::size_t depth, std::size_t breaks) {
    begin_line(depth, breaks);
    const std::string tag(e.name());
    out_ += "<" + tag;
    attributes(e);
    const std::string_view inner = e.inner_source();
    const bool blank = inner.find_first_not_of(" \t\r\n") == std::string_view::npos;
    const bool kept = !inner.empty() && style_.verbatim && style_.verbatim(e);
    if (kept || (!blank && has_text(e))) {
      out_ += ">" + std::string(inner) + "</" + tag + ">";
      return;
    }
    if (blank) {
      out_ += "/>";
      return;
    }
    out_ += '>';
    if (stays_on_one_line(e)) {
      const std::size_t before = out_.size();
      const XmlElement child = e.first_child();
      out_ += "<" + std::string(child.name());
      attributes(child);
      out_ += has_text(child) ? ">" + std::string(child.inner_source()) + "</" + std::string(child.name()) + ">" : "/>";
      out_ += "</" + tag + ">";
      if (column() <= kXmlColumnsMax && out_.find('\n', before) == std::string::npos) return;
      out_.resize(before);
    }
    opened_ = true;
    std::size_t at = static_cast<std::size_t>(inner.data() - source_.data());
    const std::size_t end = at + inner.size();
    for (XmlElement child = e.first_child(); child; child = child.next_sibling()) {
      const std::size_t gap = asides(at, child.offset(), depth + 1);
      element(child, depth + 1, gap);
      at = child.end_offset();
    }
    asides(at, end, depth + 1);
    begin_line(depth, 0);
    out_ += "</" + tag + ">";
  }

  std::string_view source_;
  const XmlStyle& style_;
  std::string out_;
  bool opened_ = false;  ///< A start tag was written last: no empty line behind it.
};

}  // namespace

Result<std::string> format_xml(std::string_view source, std::string file, const XmlStyle& style,
                               const XmlOptions& options) {
  // As every reader of XML sees it (XML 1.0, 2.11).
  std::string lines(source);
  std::erase(lines, '\r');
  auto document = XmlDocument::parse(std::move(lines), std::move(file), options);
  if (!document) return tl::unexpected(std::move(document.error()));
  std::string formatted = with_line_ends_of(source, Formatter(*document, style).run(document->root()));
  return source.starts_with(kByteOrderMark) ? std::string(kByteOrderMark) + formatted : formatted;
}

}  // namespace sentree::text
