#include "sentree/design/detail/element_edits.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sentree/base/ascii.h"

namespace sentree::design {

namespace {

using text::XmlElement;

bool is_blank_sign(char c) { return c == ' ' || c == '\t'; }

}  // namespace

Result<text::XmlDocument> pasted(std::string xml, std::string_view what, std::string_view attributes) {
  std::erase(xml, '\r');
  // The declaration of a file stands at its beginning only.
  if (const std::size_t begin = xml.find_first_not_of(" \t\n");
      begin != std::string::npos && xml.compare(begin, 5, "<?xml") == 0)
    xml.erase(0, xml.find("?>") == std::string::npos ? begin : xml.find("?>") + 2);
  // Who selects from the first '<' on leaves the first line without the indentation that the last has.
  xml.erase(0, std::min(xml.find_first_not_of('\n'), xml.size()));
  xml.erase(xml.find_last_not_of(" \t\n") + 1);
  if (const std::size_t line = xml.rfind('\n'); xml.starts_with('<') && line != std::string::npos)
    xml.insert(0, xml.substr(line + 1, xml.find_first_not_of(" \t", line + 1) - line - 1));
  auto document =
      text::XmlDocument::parse(fmt::format("<pasted{}>\n{}\n</pasted>", attributes, xml), {}, {.lenient = true});
  if (!document || document->root().children().empty())
    return fail("design.no-nodes", fmt::format("what was copied is no XML of {}", what));
  return document;
}

std::string_view unnumbered(std::string_view name) {
  const std::size_t digits = name.find_last_not_of("0123456789") + 1;
  const bool is_numbered = digits > 1 && digits < name.size() && name[digits - 1] == '_';
  return name.substr(0, is_numbered ? digits - 1 : name.size());
}

std::string ElementEdits::eol() const {
  const std::size_t first = source().find('\n');
  return first != std::string_view::npos && first > 0 && source()[first - 1] == '\r' ? "\r\n" : "\n";
}

std::size_t ElementEdits::line_begin(std::size_t offset) const {
  while (offset > 0 && source()[offset - 1] != '\n') --offset;
  return offset;
}

// The blanks before the first sign of the line.
std::string ElementEdits::indentation(std::size_t offset) const {
  const std::size_t begin = line_begin(offset);
  std::size_t end = begin;
  while (end < source().size() && is_blank_sign(source()[end])) ++end;
  return std::string(source().substr(begin, end - begin));
}

bool ElementEdits::starts_line(std::size_t offset) const {
  const std::size_t begin = line_begin(offset);
  return std::all_of(source().begin() + static_cast<std::ptrdiff_t>(begin),
                     source().begin() + static_cast<std::ptrdiff_t>(offset), is_blank_sign);
}

std::string ElementEdits::indentation_step(const XmlElement& element) const {
  for (const XmlElement& child : element.children()) {
    const std::string inner = indentation(child.offset());
    const std::string outer = indentation(element.offset());
    if (starts_line(child.offset()) && inner.size() > outer.size() && inner.starts_with(outer))
      return inner.substr(outer.size());
  }
  for (XmlElement at = element; at && at.parent(); at = at.parent()) {
    const std::string inner = indentation(at.offset());
    const std::string outer = indentation(at.parent().offset());
    if (inner.size() > outer.size() && inner.starts_with(outer)) return inner.substr(outer.size());
  }
  return "  ";
}

// Where lines begin in [from, to) of the node, but those inside of attribute values and of texts.
std::vector<std::size_t> ElementEdits::line_starts(const XmlElement& node, std::size_t from, std::size_t to) const {
  std::vector<std::pair<std::size_t, std::size_t>> kept;
  text::for_each_element(node, [&](const XmlElement& element) {
    for (const auto& place : element.attribute_places()) kept.emplace_back(place.value_begin, place.value_end);
    if (!element.text().empty()) {
      const auto begin = static_cast<std::size_t>(element.inner_source().data() - source().data());
      kept.emplace_back(begin, begin + element.inner_source().size());
    }
  });
  std::vector<std::size_t> starts;
  for (std::size_t at = from; at < to; ++at) {
    if (source()[at] != '\n' || at + 1 >= to) continue;
    // An empty line stays empty.
    if (source()[at + 1] == '\n' || source()[at + 1] == '\r') continue;
    const bool is_kept =
        std::any_of(kept.begin(), kept.end(), [&](const auto& k) { return at >= k.first && at < k.second; });
    if (!is_kept) starts.push_back(at + 1);
  }
  return starts;
}

// The text of the node, its lines after the first indented by `to` instead of as they are. `changes` are of values.
std::string ElementEdits::indented(const XmlElement& node, const std::string& to, const TextEdits& changes) const {
  const std::string from = indentation(node.offset());
  std::string out;
  std::size_t at = node.offset();
  auto change = changes.begin();
  const auto copy_to = [&](std::size_t end) {
    for (; change != changes.end() && change->from < end; ++change) {
      out += source().substr(at, change->from - at);
      out += change->text;
      at = change->to;
    }
    out += source().substr(at, end - at);
    at = end;
  };
  for (const std::size_t line : line_starts(node, node.offset(), node.end_offset())) {
    copy_to(line);
    if (source().substr(line, from.size()) != from) continue;
    out += to;
    at += from.size();
  }
  copy_to(node.end_offset());
  return out;
}

std::string ElementEdits::indented(const std::string& xml, const std::string& indentation) const {
  std::string out;
  for (const char c : xml) out += c == '\n' ? eol() + indentation : std::string(c == '\r' ? 0 : 1, c);
  return out;
}

std::string ElementEdits::text_of(const XmlElement& node, const TextEdits& changes) const {
  return indented(node, "", changes);
}

// Behind the comments that stand behind a tag on its line.
std::size_t ElementEdits::end_with_comment(std::size_t tag_end) const {
  std::size_t at = tag_end;
  std::size_t end = at;
  for (;;) {
    while (at < source().size() && is_blank_sign(source()[at])) ++at;
    if (source().substr(at, 4) != "<!--") return end;
    const std::size_t close = source().find("-->", at);
    if (close == std::string_view::npos || source().substr(at, close - at).find('\n') != std::string_view::npos)
      return end;
    at = end = close + 3;
  }
}

// With the tags of its parent on a line of their own, and nothing else.
bool ElementEdits::is_alone_on_its_line(const XmlElement& node) const {
  const XmlElement parent = node.parent();
  const auto open_end = static_cast<std::size_t>(parent.inner_source().data() - source().data());
  const auto is_blank = [&](std::size_t from, std::size_t to) {
    const std::string_view between = source().substr(from, to - from);
    return std::all_of(between.begin(), between.end(), is_blank_sign);
  };
  return starts_line(parent.offset()) && is_blank(open_end, node.offset()) &&
         is_blank(node.end_offset(), open_end + parent.inner_source().size()) &&
         source().substr(parent.offset(), parent.end_offset() - parent.offset()).find('\n') == std::string_view::npos;
}

// `text_at` is told how its lines are indented, and what is written between elements that stand there together.
template <class Text>
void ElementEdits::put_text(const XmlElement& parent, std::size_t index, const Text& text_at) {
  const auto children = parent.children();
  index = std::min(index, children.size());
  const std::size_t open_end = static_cast<std::size_t>(parent.inner_source().data() - source().data());
  if (!children.empty()) {
    const XmlElement& beside = children[index == 0 ? 0 : index - 1];
    const std::size_t at = end_with_comment(index == 0 ? open_end : beside.end_offset());
    const std::string inner = indentation(beside.offset());
    if (starts_line(beside.offset())) {
      edits_.push_back({at, at, eol() + inner + text_at(inner, eol() + inner)});
    } else if (is_alone_on_its_line(beside)) {
      // Two in one line are no way to write it.
      const std::string outer = indentation(parent.offset());
      const std::string further = outer + indentation_step(parent);
      const std::string line = eol() + further + text_at(further, eol() + further);
      edits_.push_back({open_end, beside.offset(), (index == 0 ? line : "") + eol() + further});
      edits_.push_back(
          {beside.end_offset(), open_end + parent.inner_source().size(), (index == 0 ? "" : line) + eol() + outer});
    } else {
      edits_.push_back({at, at, text_at(inner, "")});
    }
    return;
  }
  const std::string outer = indentation(parent.offset());
  const std::string inner = outer + indentation_step(parent);
  const std::string line = eol() + inner + text_at(inner, eol() + inner);
  if (source()[parent.end_offset() - 2] == '/' && parent.inner_source().empty()) {
    std::size_t slash = parent.end_offset() - 2;
    while (is_space(source()[slash - 1])) --slash;
    edits_.push_back({slash, parent.end_offset(), fmt::format(">{}{}{}</{}>", line, eol(), outer, parent.name())});
    return;
  }
  const std::size_t close = open_end + parent.inner_source().size();
  std::size_t end = close;
  while (end > open_end && is_space(source()[end - 1])) --end;
  edits_.push_back({end, close, line + eol() + outer});
}

void ElementEdits::put(const XmlElement& parent, std::size_t index, const std::string& xml) {
  put_text(parent, index, [&](const std::string& indentation, const auto&) { return indented(xml, indentation); });
}

void ElementEdits::put_copies(const XmlElement& parent, std::size_t index, const std::vector<Copy>& nodes) {
  put_text(parent, index, [&](const std::string& indentation, const std::string& between) {
    std::string all;
    for (const auto& [node, changes] : nodes)
      all += (all.empty() ? "" : between) + indented(node, indentation, changes);
    return all;
  });
}

void ElementEdits::take_out(const XmlElement& node) {
  std::size_t begin = node.offset();
  std::size_t end = node.end_offset();
  std::size_t rest = end;
  while (rest < source().size() && is_blank_sign(source()[rest])) ++rest;
  const bool ends_line = rest >= source().size() || source()[rest] == '\n' || source()[rest] == '\r';
  if (starts_line(begin) && ends_line) {
    begin = line_begin(begin);
    // An empty line before it goes along where another one, or the end of its parent, follows.
    std::size_t next = rest;
    while (next < source().size() && source()[next] != '\n') ++next;
    std::size_t sign = std::min(next + 1, source().size());
    while (sign < source().size() && is_blank_sign(source()[sign])) ++sign;
    const bool ends = sign < source().size() &&
                      (source()[sign] == '\n' || source()[sign] == '\r' || source().substr(sign, 2) == "</");
    if (const std::size_t before = begin > 0 ? line_begin(begin - 1) : begin;
        ends && begin > 0 &&
        std::all_of(source().begin() + static_cast<std::ptrdiff_t>(before),
                    source().begin() + static_cast<std::ptrdiff_t>(begin), is_space))
      begin = before;
    if (begin > 0) --begin;
    if (begin > 0 && source()[begin - 1] == '\r') --begin;
    end = rest;
  }
  edits_.push_back({begin, end, ""});
  taken_.push_back(node);
}

// Who has lost all that was in it is written as who never had anything.
void ElementEdits::close_emptied() {
  std::stable_sort(taken_.begin(), taken_.end(),
                   [](const XmlElement& a, const XmlElement& b) { return a.offset() < b.offset(); });
  const auto is_blank = [&](std::size_t from, std::size_t to) {
    const std::string_view between = source().substr(from, to - from);
    return std::all_of(between.begin(), between.end(), is_space);
  };
  while (!taken_.empty()) {
    const XmlElement parent = taken_.back().parent();
    const auto of_parent = std::stable_partition(taken_.begin(), taken_.end(),
                                                 [&](const XmlElement& node) { return node.parent() != parent; });
    const auto count = taken_.end() - of_parent;
    const auto begin = static_cast<std::size_t>(parent.inner_source().data() - source().data());
    std::size_t at = begin;
    bool empty = static_cast<bool>(parent.parent());
    for (auto node = of_parent; node != taken_.end(); ++node) {
      empty = empty && is_blank(at, node->offset());
      at = node->end_offset();
    }
    empty = empty && is_blank(at, begin + parent.inner_source().size());
    taken_.erase(of_parent, taken_.end());
    const auto touches = [&](const TextEdit& edit) {
      return edit.from < parent.end_offset() && edit.to > parent.offset();
    };
    if (!empty || std::count_if(edits_.begin(), edits_.end(), touches) != count) continue;
    std::erase_if(edits_, touches);
    edits_.push_back({begin - 1, parent.end_offset(), "/>"});
  }
}

void ElementEdits::wrap(const std::vector<XmlElement>& nodes, const std::string& open, const std::string& close) {
  const XmlElement& first = nodes.front();
  const std::size_t end = nodes.back().end_offset();
  if (!starts_line(first.offset())) {
    edits_.push_back({first.offset(), first.offset(), open});
    edits_.push_back({end, end, close});
    return;
  }
  const std::string outer = indentation(first.offset());
  const std::string step = indentation_step(first.parent());
  edits_.push_back({first.offset(), first.offset(), open + eol() + outer + step});
  std::size_t from = first.offset();
  for (const XmlElement& node : nodes) {
    for (const std::size_t line : line_starts(node, from, node.end_offset())) edits_.push_back({line, line, step});
    from = node.end_offset();
  }
  edits_.push_back({end, end, eol() + outer + close});
}

void ElementEdits::unwrap(const XmlElement& node) {
  const std::string_view inner = node.inner_source();
  std::size_t begin = static_cast<std::size_t>(inner.data() - source().data());
  std::size_t end = begin + inner.size();
  while (begin < end && is_space(source()[begin])) ++begin;
  while (end > begin && is_space(source()[end - 1])) --end;
  edits_.push_back({node.offset(), begin, ""});
  const std::string outer = indentation(node.offset());
  const std::string first = indentation(begin);
  if (first.size() > outer.size() && first.starts_with(outer) && starts_line(node.offset())) {
    const std::string step = first.substr(outer.size());
    for (const std::size_t line : line_starts(node, begin, end)) {
      const std::size_t at = line + outer.size();
      if (source().substr(line, first.size()) == first) edits_.push_back({at, at + step.size(), ""});
    }
  }
  edits_.push_back({end, node.end_offset(), ""});
}

void ElementEdits::rename(const XmlElement& node, const std::string& name) {
  const std::string_view old = node.name();
  edits_.push_back({node.offset() + 1, node.offset() + 1 + old.size(), name});
  if (source()[node.end_offset() - 2] == '/') return;  // It has no end tag.
  const std::size_t close = source().rfind("</", node.end_offset());
  edits_.push_back({close + 2, close + 2 + old.size(), name});
}

void ElementEdits::replace(const XmlElement& node, const std::string& xml) {
  edits_.push_back({node.offset(), node.end_offset(), indented(xml, indentation(node.offset()))});
}

TextEdits ElementEdits::take() {
  close_emptied();
  // What is put in at the place where something is taken away comes first.
  std::stable_sort(edits_.begin(), edits_.end(), [](const TextEdit& a, const TextEdit& b) {
    return a.from != b.from ? a.from < b.from : (a.to == a.from) > (b.to == b.from);
  });
  return std::exchange(edits_, {});
}

}  // namespace sentree::design
