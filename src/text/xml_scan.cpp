#include "sentree/text/xml_scan.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "sentree/text/xml.h"

namespace sentree::text {

namespace {

// What a byte may be. Name characters are those of ASCII; all of UTF-8 above is taken for a letter, as every reader in
// practice does.
enum ByteClass : std::uint8_t { kSpace = 1, kNameStart = 2, kNameChar = 4, kColon = 8, kInValue = 16 };

constexpr std::array<std::uint8_t, 256> kClasses = [] {
  std::array<std::uint8_t, 256> classes{};
  for (const char c : {' ', '\t', '\n', '\r'}) classes[static_cast<unsigned char>(c)] = kSpace;
  for (unsigned c = 0; c < 256; ++c) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == ':' || c >= 0x80;
    if (letter) classes[c] = kNameStart | kNameChar;
    if ((c >= '0' && c <= '9') || c == '-' || c == '.') classes[c] = kNameChar;
    if (c == ':') classes[c] |= kColon;
    // What neither ends a value nor needs a look inside one.
    if (c != '"' && c != '\'' && c != '<' && c != '&') classes[c] |= kInValue;
  }
  return classes;
}();

bool is(char c, ByteClass wanted) { return (kClasses[static_cast<unsigned char>(c)] & wanted) != 0; }
bool is_space(char c) { return is(c, kSpace); }
bool is_name_start(char c) { return is(c, kNameStart); }
bool is_name_char(char c) { return is(c, kNameChar); }

/// True if the eight bytes are ASCII and none of them is a control character, white space other than ' ' included.
bool eight_plain(const char* text) {
  constexpr std::uint64_t kOnes = 0x0101010101010101U;
  std::uint64_t eight = 0;
  std::memcpy(&eight, text, 8);
  // Below 0x20, the subtraction borrows into a byte's highest bit; from 0x80 on, that bit is set already.
  return (((eight - kOnes * 0x20U) | eight) & (kOnes * 0x80U)) == 0;
}

class Scanner {
 public:
  Scanner(std::string_view source, const XmlOptions& options) : source_(source), options_(options) {}

  XmlScan run() {
    if (source_.size() > 0xFFFFFFFFU) {
      error(0, "larger than 4 GiB");
      return std::move(scan_);
    }
    if (!check_characters()) return std::move(scan_);
    constexpr std::size_t kTagBytes = 32;  // A usual one's; fewer reallocations of a long list.
    scan_.extents.reserve(source_.size() / kTagBytes);
    if (source_.starts_with("\xEF\xBB\xBF")) at_ = 3;
    if (starts("<?xml") && at_ + 5 < source_.size() && is_space(source_[at_ + 5])) xml_declaration();
    while (!scan_.error && misc()) {
    }
    if (!scan_.error) {
      if (at_ >= source_.size())
        error(at_, "there is no root element");
      else
        element_tree();
    }
    while (!scan_.error && misc()) {
    }
    if (!scan_.error && at_ < source_.size()) {
      if (source_[at_] == '<' && at_ + 1 < source_.size() && is_name_start(source_[at_ + 1])) {
        error(at_, "a second root element; a document has one");
      } else {
        error(at_, "text behind the root element");
      }
    }
    return std::move(scan_);
  }

 private:
  struct Open {
    std::string_view name;
    std::size_t extent;
    std::size_t prefixes_before;
  };

  bool starts(std::string_view text) const { return source_.substr(at_).starts_with(text); }
  void error(std::size_t offset, std::string message, const char* code = "xml.syntax") {
    if (!scan_.error) scan_.error = XmlScan::Finding{offset, code, std::move(message)};
  }
  // Refused, or accepted with a warning where the caller asked for leniency.
  void lenient(std::size_t offset, std::string message, const char* code = "xml.syntax") {
    if (options_.lenient && scan_.warnings.size() < kXmlWarningsMax)
      scan_.warnings.push_back({offset, code, std::move(message)});
    else
      error(offset, std::move(message), code);
  }

  bool check_characters() {
    const auto unreadable = first_unreadable(source_);
    if (unreadable) error(unreadable->first, unreadable->second);
    return !unreadable;
  }

  void xml_declaration() {
    const std::size_t end = source_.find("?>", at_);
    if (end == std::string_view::npos) return error(at_, "the XML declaration does not end with \"?>\"");
    std::string declaration(source_.substr(at_, end - at_));
    std::transform(declaration.begin(), declaration.end(), declaration.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
    if (const auto encoding = declaration.find("encoding"); encoding != std::string::npos) {
      const auto rest = std::string_view(declaration).substr(encoding);
      if (rest.find("utf-8") == std::string_view::npos && rest.find("us-ascii") == std::string_view::npos) {
        return error(at_ + encoding, "only the encoding UTF-8 is read; save the file as UTF-8");
      }
    }
    at_ = end + 2;
  }

  // Skips one thing that may stand outside the root: white space, comment, instruction, DOCTYPE.
  bool misc() {
    if (at_ >= source_.size()) return false;
    if (is_space(source_[at_])) {
      ++at_;
      return true;
    }
    if (starts("<!--")) return comment();
    if (starts("<?")) return instruction();
    if (starts("<!DOCTYPE")) return doctype();
    return false;
  }

  bool comment() {
    const std::size_t dashes = source_.find("--", at_ + 4);
    if (dashes == std::string_view::npos) return error(at_, "the comment does not end with \"-->\""), false;
    if (dashes + 2 >= source_.size() || source_[dashes + 2] != '>') {
      lenient(dashes, "\"--\" is not allowed inside a comment");
      const std::size_t end = source_.find("-->", dashes);
      if (end == std::string_view::npos) return error(at_, "the comment does not end with \"-->\""), false;
      at_ = end + 3;
      return !scan_.error;
    }
    at_ = dashes + 3;
    return true;
  }

  bool instruction() {
    const std::size_t end = source_.find("?>", at_ + 2);
    if (end == std::string_view::npos) return error(at_, "the processing instruction does not end with \"?>\""), false;
    if (starts("<?xml") && (is_space(source_[at_ + 5]) || at_ + 5 == end)) {
      return error(at_, "the XML declaration must stand at the very start"), false;
    }
    at_ = end + 2;
    return true;
  }

  // The document type is skipped; what it defines is not defined for us.
  bool doctype() {
    if (!scan_.extents.empty()) return error(at_, "DOCTYPE behind the root element"), false;
    int brackets = 0;
    char quote = 0;
    for (std::size_t i = at_ + 9; i < source_.size(); ++i) {
      const char c = source_[i];
      if (quote != 0) {
        if (c == quote) quote = 0;
      } else if (c == '"' || c == '\'') {
        quote = c;
      } else if (c == '[') {
        ++brackets;
      } else if (c == ']') {
        --brackets;
      } else if (c == '>' && brackets <= 0) {
        at_ = i + 1;
        return true;
      }
    }
    return error(at_, "the DOCTYPE does not end"), false;
  }

  void element_tree() {
    if (source_[at_] != '<') return error(at_, "expected an element, found text");
    do {
      if (source_[at_] == '<')
        markup();
      else
        character_data();
      if (scan_.error) return;
      if (at_ >= source_.size() && !open_.empty()) {
        const Open& open = open_.back();
        return error(scan_.extents[open.extent].begin, "<" + std::string(open.name) + "> is never closed");
      }
    } while (!open_.empty());
  }

  void markup() {
    if (starts("<!--")) {
      comment();
    } else if (starts("<![CDATA[")) {
      const std::size_t end = source_.find("]]>", at_ + 9);
      if (end == std::string_view::npos) return error(at_, "the CDATA section does not end with \"]]>\"");
      at_ = end + 3;
    } else if (starts("<?")) {
      instruction();
    } else if (starts("</")) {
      end_tag();
    } else {
      start_tag();
    }
  }

  void character_data() {
    skip_space();
    if (at_ < source_.size() && source_[at_] == '<') return;
    const std::size_t begin = at_;
    const std::size_t end = std::min(source_.find('<', at_), source_.size());
    // Searched up to the next tag only, else reading a long file would take quadratic time.
    const std::string_view text = source_.substr(begin, end - begin);
    for (std::size_t i = text.find('&'); i != std::string_view::npos; i = text.find('&', i + 1)) {
      if (!reference(begin + i)) return;
    }
    if (const std::size_t marker = text.find("]]>"); marker != std::string_view::npos) {
      return error(begin + marker, "\"]]>\" is not allowed in text; write \"]]&gt;\"");
    }
    at_ = end;
  }

  // XML 4.1. False if that is an error.
  bool reference(std::size_t at) {
    constexpr std::size_t kReferenceMax = 64;  // Looked through, else many a bare '&' would take quadratic time.
    const std::size_t length = source_.substr(at, kReferenceMax + 2).find(';');
    const std::string_view name = length == std::string_view::npos ? "" : source_.substr(at + 1, length - 1);
    if (name.empty() || !std::all_of(name.begin(), name.end(), [](char c) { return is_name_char(c) || c == '#'; })) {
      lenient(at, "a bare \"&\"; write \"&amp;\"");
      return !scan_.error;
    }
    if (name[0] == '#') {
      std::uint32_t code = 0;
      const bool hex = name.size() > 1 && name[1] == 'x';
      for (const char c : name.substr(hex ? 2 : 1)) {
        const int digit = c >= '0' && c <= '9'          ? c - '0'
                          : hex && c >= 'a' && c <= 'f' ? c - 'a' + 10
                          : hex && c >= 'A' && c <= 'F' ? c - 'A' + 10
                                                        : -1;
        if (digit < 0 || code > 0x10FFFF) {
          code = 0;
          break;
        }
        code = code * (hex ? 16U : 10U) + static_cast<std::uint32_t>(digit);
      }
      const bool allowed = code == 9 || code == 10 || code == 13 || (code >= 0x20 && code < 0xD800) ||
                           (code >= 0xE000 && code < 0xFFFE) || (code > 0xFFFF && code <= 0x10FFFF);
      if (!allowed) error(at, "character reference \"&" + std::string(name) + ";\" names no character of XML");
      return !scan_.error;
    }
    constexpr std::array<std::string_view, 5> kPredefined{"lt", "gt", "amp", "quot", "apos"};
    if (std::find(kPredefined.begin(), kPredefined.end(), name) == kPredefined.end()) {
      lenient(at, "entity \"&" + std::string(name) + ";\" is not defined; only lt, gt, amp, quot and apos are");
    }
    return !scan_.error;
  }

  std::string_view read_name() {
    const std::size_t begin = at_;
    if (at_ >= source_.size() || !is_name_start(source_[at_])) return {};
    std::size_t end = at_;
    std::uint8_t seen = 0;
    for (; end < source_.size() && is_name_char(source_[end]); ++end) {
      seen |= kClasses[static_cast<unsigned char>(source_[end])];
    }
    prefixed_ = prefixed_ || (seen & kColon) != 0;
    at_ = end;
    return source_.substr(begin, end - begin);
  }
  bool skip_space() {
    const std::size_t begin = at_;
    while (at_ < source_.size() && is_space(source_[at_])) ++at_;
    return at_ > begin;
  }

  void start_tag() {
    const std::size_t begin = at_++;
    prefixed_ = false;
    const std::string_view name = read_name();
    if (name.empty()) return error(begin, "\"<\" begins no tag; write \"&lt;\" for the character");
    if (open_.size() >= static_cast<std::size_t>(kXmlNestingMax)) {
      return error(begin, "elements nested deeper than " + std::to_string(kXmlNestingMax) + " levels", "xml.too-deep");
    }
    open_.push_back({name, scan_.extents.size(), prefixes_.size()});
    scan_.extents.push_back({static_cast<std::uint32_t>(begin), 0, 0, 0});

    attributes_.clear();
    for (;;) {
      const bool spaced = skip_space();
      if (at_ >= source_.size()) return error(begin, "the tag <" + std::string(name) + " does not end");
      if (source_[at_] == '>' || source_[at_] == '/') break;
      if (!spaced) return error(at_, "white space is missing before the attribute");
      if (!attribute(name)) return;
    }
    if (prefixed_) check_prefixes(begin, name);
    if (scan_.error) return;
    XmlExtent& extent = scan_.extents.back();
    if (source_[at_] == '/') {
      if (++at_ >= source_.size() || source_[at_] != '>') return error(at_ - 1, "\"/\" must be followed by \">\"");
      extent.open_end = extent.close_begin = extent.end = static_cast<std::uint32_t>(++at_);
      close();
    } else {
      extent.open_end = static_cast<std::uint32_t>(++at_);
    }
  }

  bool attribute(std::string_view element) {
    const std::size_t begin = at_;
    const std::string_view name = read_name();
    if (name.empty()) return error(at_, "<" + std::string(element) + ">: expected an attribute or \">\""), false;
    skip_space();
    if (at_ >= source_.size() || source_[at_] != '=')
      return error(begin, "attribute \"" + std::string(name) + "\" has no value"), false;
    ++at_;
    skip_space();
    const char quote = at_ < source_.size() ? source_[at_] : ' ';
    if (quote != '"' && quote != '\'')
      return error(at_, "the value of attribute \"" + std::string(name) + "\" is not in quotes"), false;
    const std::size_t value_begin = ++at_;
    std::size_t value_end = value_begin;
    while (value_end < source_.size() && is(source_[value_end], kInValue)) ++value_end;
    const std::size_t first_special = value_end;
    if (value_end == source_.size() || source_[value_end] != quote) value_end = source_.find(quote, value_end);
    if (value_end == std::string_view::npos)
      return error(begin, "the value of attribute \"" + std::string(name) + "\" does not end"), false;
    for (std::size_t i = first_special; i < value_end; ++i) {
      if (source_[i] != '<' && source_[i] != '&') continue;
      if (source_[i] == '<')
        lenient(i, "\"<\" in the value of attribute \"" + std::string(name) + "\"; write \"&lt;\"");
      else
        reference(i);
      if (scan_.error) return false;
    }
    for (const auto& [other, offset] : attributes_) {
      if (other == name) return error(begin, "attribute \"" + std::string(name) + "\" stands twice"), false;
    }
    attributes_.emplace_back(name, begin);
    if (name.starts_with("xmlns:")) prefixes_.push_back(name.substr(6));
    at_ = value_end + 1;
    return true;
  }

  void check_prefixes(std::size_t begin, std::string_view element) {
    const auto check = [&](std::string_view name, std::size_t offset) {
      const auto colon = name.find(':');
      if (colon == std::string_view::npos) return;
      const std::string_view prefix = name.substr(0, colon);
      if (prefix == "xml" || prefix == "xmlns" ||
          std::find(prefixes_.begin(), prefixes_.end(), prefix) != prefixes_.end())
        return;
      lenient(offset,
              "prefix \"" + std::string(prefix) + "\" is not declared; add xmlns:" + std::string(prefix) + "=\"…\"",
              "xml.namespace");
    };
    check(element, begin + 1);
    for (const auto& [name, offset] : attributes_) check(name, offset);
  }

  void end_tag() {
    const std::size_t begin = at_;
    at_ += 2;
    const std::string_view name = read_name();
    skip_space();
    if (at_ >= source_.size() || source_[at_] != '>')
      return error(begin, "the end tag </" + std::string(name) + " does not end with \">\"");
    ++at_;
    if (open_.empty()) return error(begin, "</" + std::string(name) + "> closes nothing");
    if (open_.back().name != name) {
      return error(begin, "</" + std::string(name) + "> closes <" + std::string(open_.back().name) + ">");
    }
    XmlExtent& extent = scan_.extents[open_.back().extent];
    extent.close_begin = static_cast<std::uint32_t>(begin);
    extent.end = static_cast<std::uint32_t>(at_);
    close();
  }

  void close() {
    prefixes_.resize(open_.back().prefixes_before);
    open_.pop_back();
  }

  std::string_view source_;
  XmlOptions options_;
  std::size_t at_ = 0;
  XmlScan scan_;
  std::vector<Open> open_;
  std::vector<std::string_view> prefixes_;
  bool prefixed_ = false;  ///< A name of the present tag has a colon.
  std::vector<std::pair<std::string_view, std::size_t>> attributes_;
};

}  // namespace

XmlScan scan_xml(std::string_view source, const XmlOptions& options) { return Scanner(source, options).run(); }

std::vector<XmlAttributeExtent> scan_attributes(std::string_view source, std::size_t tag_begin) {
  std::vector<XmlAttributeExtent> extents;
  std::size_t at = tag_begin + 1;
  while (is_name_char(source[at])) ++at;
  for (;;) {
    while (is_space(source[at])) ++at;
    if (source[at] == '>' || source[at] == '/') return extents;
    XmlAttributeExtent extent{};
    extent.name_begin = at;
    while (is_name_char(source[at])) ++at;
    extent.name_end = at;
    while (source[at] != '"' && source[at] != '\'') ++at;
    extent.value_begin = at + 1;
    extent.value_end = source.find(source[at], at + 1);
    at = extent.value_end + 1;
    extents.push_back(extent);
  }
}

std::optional<std::pair<std::size_t, std::string>> first_unreadable(std::string_view source) {
  for (std::size_t i = 0; i < source.size();) {
    if (i + 8 <= source.size() && eight_plain(source.data() + i)) {
      i += 8;
      continue;
    }
    const auto c = static_cast<unsigned char>(source[i]);
    if (c < 0x80) {
      if (c < 0x20 && !is_space(source[i])) {
        return std::pair{i, "control character " + std::to_string(int{c}) + " is not allowed in XML"};
      }
      ++i;
      continue;
    }
    const int length = c >= 0xC2 && c <= 0xDF ? 2 : (c & 0xF0) == 0xE0 ? 3 : c >= 0xF0 && c <= 0xF4 ? 4 : 0;
    bool valid = length != 0 && i + static_cast<std::size_t>(length) <= source.size();
    for (int k = 1; valid && k < length; ++k) valid = (static_cast<unsigned char>(source[i + k]) & 0xC0) == 0x80;
    if (valid && length == 3) {
      const auto second = static_cast<unsigned char>(source[i + 1]);
      valid = !(c == 0xE0 && second < 0xA0) && !(c == 0xED && second > 0x9F);
    }
    if (valid && length == 4) {
      const auto second = static_cast<unsigned char>(source[i + 1]);
      valid = !(c == 0xF0 && second < 0x90) && !(c == 0xF4 && second > 0x8F);
    }
    if (!valid) {
      return std::pair{i, std::string("not UTF-8; save the file in that encoding")};
    }
    i += static_cast<std::size_t>(length);
  }
  return std::nullopt;
}

}  // namespace sentree::text
