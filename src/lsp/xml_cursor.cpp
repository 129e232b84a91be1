#include "sentree/lsp/detail/xml_cursor.h"

#include <algorithm>

#include "sentree/base/ascii.h"

namespace sentree::lsp {

namespace {

using Where = XmlCursor::Where;

bool ends_name(char c) { return is_space(c) || c == '=' || c == '>' || c == '/' || c == '<' || c == '"' || c == '\''; }

class Scan {
 public:
  Scan(std::string_view text, std::size_t offset) : text_(text), offset_(std::min(offset, text.size())) {}

  XmlCursor run() {
    while (at_ < text_.size()) {
      const std::size_t open = text_.find('<', at_);
      if (open == std::string_view::npos || open >= offset_) break;
      at_ = open;
      if (take("<!--", "-->") || take("<![CDATA[", "]]>") || take("<?", "?>") || take("<!", ">") || end_tag() ||
          start_tag())
        return std::move(cursor_);
    }
    cursor_.where = Where::kText;
    cursor_.from = cursor_.to = offset_;
    return std::move(cursor_);
  }

 private:
  // Each is true if the place is inside of it, and stands behind it otherwise.
  bool take(std::string_view begin, std::string_view end) {
    if (at_ >= offset_ || !text_.substr(at_).starts_with(begin)) return false;
    const std::size_t close = text_.find(end, at_ + begin.size());
    at_ = close == std::string_view::npos ? text_.size() : close + end.size();
    if (at_ > offset_ || (close == std::string_view::npos && at_ == offset_)) return elsewhere();
    return false;
  }

  bool elsewhere() {
    cursor_.where = Where::kElsewhere;
    cursor_.from = cursor_.to = offset_;
    return true;
  }

  bool end_tag() {
    if (at_ >= offset_ || !text_.substr(at_).starts_with("</")) return false;
    std::size_t end = at_ + 2;
    while (end < text_.size() && !ends_name(text_[end])) ++end;
    const std::string_view name = text_.substr(at_ + 2, end - at_ - 2);
    while (end < text_.size() && is_space(text_[end])) ++end;
    if (end < text_.size() && text_[end] == '>') ++end;
    if (end > offset_) return elsewhere();
    at_ = end;
    auto& open = cursor_.open;
    const auto own =
        std::find_if(open.rbegin(), open.rend(), [&](const auto& element) { return element.name == name; });
    if (own != open.rend()) open.erase(own.base() - 1, open.end());
    return false;
  }

  bool start_tag() {
    if (at_ >= offset_ || text_[at_] != '<') return false;
    const std::size_t begin = at_++;
    bool is_inside = name(Where::kTagName);
    XmlCursor::Element element{std::string(word_), {}};
    bool is_empty = false;
    bool is_closed = false;
    while (at_ < text_.size() && text_[at_] != '<') {
      if (is_space(text_[at_])) {
        if (at_ + 1 == offset_ && !is_inside && (offset_ == text_.size() || ends_name(text_[offset_]))) {
          is_inside = true;
          cursor_.where = Where::kAttributeName;
          cursor_.from = cursor_.to = offset_;
        }
        ++at_;
        continue;
      }
      if (text_[at_] == '>') {
        is_closed = true;
        ++at_;
        break;
      }
      if (text_[at_] == '/' || text_[at_] == '"' || text_[at_] == '\'' || text_[at_] == '=') {
        is_empty = text_[at_] == '/';
        ++at_;
        continue;
      }
      is_empty = false;
      is_inside = attribute(element, is_inside) || is_inside;
    }
    // A place behind an unfinished tag belongs to it.
    if (!is_inside && begin < offset_ && (at_ > offset_ || (!is_closed && at_ >= offset_))) {
      is_inside = true;
      cursor_.where = Where::kAttributeName;
      cursor_.from = cursor_.to = offset_;
    }
    if (is_inside) {
      cursor_.tag = std::move(element);
      return true;
    }
    if (!is_empty && is_closed && cursor_.open.size() < kOpenElementsMax) cursor_.open.push_back(std::move(element));
    return false;
  }

  // The name that begins here, in `word_`; true: the place is in it or at its end.
  bool name(Where where) {
    const std::size_t from = at_;
    while (at_ < text_.size() && !ends_name(text_[at_])) ++at_;
    word_ = text_.substr(from, at_ - from);
    if (offset_ < from || offset_ > at_) return false;
    cursor_.where = where;
    cursor_.from = from;
    cursor_.to = at_;
    return true;
  }

  bool attribute(XmlCursor::Element& element, bool is_found) {
    const XmlCursor before = is_found ? cursor_ : XmlCursor();
    bool is_inside = name(Where::kAttributeName);
    std::string key(word_);
    while (at_ < text_.size() && is_space(text_[at_]) && at_ + 1 < text_.size() && text_[at_ + 1] == '=') ++at_;
    if (at_ < text_.size() && text_[at_] == '=') {
      ++at_;
      while (at_ < text_.size() && is_space(text_[at_])) ++at_;
      if (at_ < text_.size() && (text_[at_] == '"' || text_[at_] == '\'')) {
        const char quote = text_[at_++];
        const std::size_t from = at_;
        // A quote that is not closed ends with the line or before the next tag.
        std::size_t close = text_.find(quote, from);
        const std::size_t tag = text_.find('<', from);
        if (close == std::string_view::npos || tag < close)
          close = std::min({text_.find('\n', from), tag, text_.size()});
        if (offset_ >= from && offset_ <= close) {
          is_inside = true;
          cursor_.where = Where::kAttributeValue;
          cursor_.attribute = key;
          cursor_.from = from;
          cursor_.to = close;
        }
        element.attributes.emplace_back(std::move(key), text_.substr(from, close - from));
        at_ = close < text_.size() && text_[close] == quote ? close + 1 : close;
      }
    } else {
      element.attributes.emplace_back(std::move(key), std::string());
    }
    if (is_found) cursor_ = before;
    return is_inside;
  }

  std::string_view text_;
  std::size_t offset_;
  std::size_t at_ = 0;
  std::string_view word_;
  XmlCursor cursor_;
};

}  // namespace

std::string_view XmlCursor::Element::attribute(std::string_view wanted) const {
  for (const auto& [key, value] : attributes) {
    if (key == wanted) return value;
  }
  return {};
}

XmlCursor xml_cursor(std::string_view text, std::size_t offset) { return Scan(text, offset).run(); }

}  // namespace sentree::lsp
