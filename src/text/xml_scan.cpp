#include "sentree/text/detail/xml_scan.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <set>
#include <span>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "sentree/base/ascii.h"
#include "sentree/text/encoding.h"
#include "sentree/text/xml.h"

namespace sentree::text {

namespace {

// What a byte may be. Name characters are those of ASCII; all of UTF-8 above is taken for a letter, as every reader in
// practice does.
enum ByteClass : std::uint8_t { kSpace = 1, kNameStart = 2, kNameChar = 4, kLocalChar = 8, kInValue = 16 };

constexpr std::array<std::uint8_t, 256> kClasses = [] {
  std::array<std::uint8_t, 256> classes{};
  for (const char c : {' ', '\t', '\n', '\r'}) classes[static_cast<unsigned char>(c)] = kSpace;
  for (unsigned c = 0; c < 256; ++c) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == ':' || c >= 0x80;
    if (letter) classes[c] = kNameStart | kNameChar;
    if ((c >= '0' && c <= '9') || c == '-' || c == '.') classes[c] = kNameChar;
    if ((classes[c] & kNameChar) != 0 && c != ':') classes[c] |= kLocalChar;
    // What neither ends a value nor needs a look inside one; the byte behind the source, 0, is none.
    if (c >= ' ' && c != '"' && c != '\'' && c != '<' && c != '&') classes[c] |= kInValue;
  }
  return classes;
}();

bool is(char c, ByteClass wanted) { return (kClasses[static_cast<unsigned char>(c)] & wanted) != 0; }
bool is_space(char c) { return is(c, kSpace); }
bool is_name_start(char c) { return is(c, kNameStart); }
bool is_name_char(char c) { return is(c, kNameChar); }

/// How many of the eight bytes, from the first on, are ASCII and no control characters, white space other than ' '
/// included. May be too few, never too many.
std::size_t plain_bytes(const char* text) {
  constexpr std::uint64_t kOnes = 0x0101010101010101U;
  std::uint64_t eight = 0;
  std::memcpy(&eight, text, 8);
  // Below 0x20, the subtraction borrows into a byte's highest bit; from 0x80 on, that bit is set already.
  const std::uint64_t others = ((eight - kOnes * 0x20U) | eight) & (kOnes * 0x80U);
  if (others == 0) return 8;
  // A borrow reaches bytes of higher value only, so the lowest mark is right.
  return std::endian::native == std::endian::little ? static_cast<std::size_t>(std::countr_zero(others)) / 8 : 0;
}

constexpr std::size_t kReferenceMax = 64;  ///< Bytes looked through for its ';', else many a bare '&' would take long.

/// What stands between the '&' that `text` begins with and its ';'; empty if that is no reference.
std::string_view reference_name(std::string_view text) {
  const std::size_t length = text.substr(0, kReferenceMax + 2).find(';');
  const std::string_view name = length == std::string_view::npos ? "" : text.substr(1, length - 1);
  const auto allowed = [](char c) { return is_name_char(c) || c == '#'; };
  return std::all_of(name.begin(), name.end(), allowed) ? name : std::string_view();
}

constexpr std::array<std::pair<std::string_view, char>, 5> kPredefined{
    {{"lt", '<'}, {"gt", '>'}, {"amp", '&'}, {"quot", '"'}, {"apos", '\''}}};

/// The character of "#10" or "#xA" (XML 2.2, 4.1); 0 if it names none.
std::uint32_t character(std::string_view name) {
  std::uint32_t code = 0;
  const bool hex = name.size() > 1 && name[1] == 'x';
  for (const char c : name.substr(hex ? 2 : 1)) {
    const int digit = c >= '0' && c <= '9'          ? c - '0'
                      : hex && c >= 'a' && c <= 'f' ? c - 'a' + 10
                      : hex && c >= 'A' && c <= 'F' ? c - 'A' + 10
                                                    : -1;
    if (digit < 0 || code > 0x10FFFF) return 0;
    code = code * (hex ? 16U : 10U) + static_cast<std::uint32_t>(digit);
  }
  const bool allowed = code == 9 || code == 10 || code == 13 || (code >= 0x20 && code < 0xD800) ||
                       (code >= 0xE000 && code < 0xFFFE) || (code > 0xFFFF && code <= 0x10FFFF);
  return allowed ? code : 0;
}

void append_utf8(std::uint32_t code, std::string& out) {
  const auto byte = [&out](std::uint32_t bits) { out += static_cast<char>(bits); };
  if (code < 0x80) return byte(code);
  if (code < 0x800) {
    byte(0xC0U | code >> 6U);
  } else {
    if (code < 0x10000) {
      byte(0xE0U | code >> 12U);
    } else {
      byte(0xF0U | code >> 18U);
      byte(0x80U | (code >> 12U & 0x3FU));
    }
    byte(0x80U | (code >> 6U & 0x3FU));
  }
  byte(0x80U | (code & 0x3FU));
}

/// With references resolved, those that are none left as they are, and each line end as '\n'; in a value, white space
/// as ' ' (XML 1.0, 2.11 and 3.3.3).
std::string resolve(std::string_view written, bool references, bool value) {
  std::string out;
  out.reserve(written.size());
  for (std::size_t i = 0; i < written.size(); ++i) {
    const char c = written[i];
    if (c == '\r') {
      out += value ? ' ' : '\n';
      if (i + 1 < written.size() && written[i + 1] == '\n') ++i;
    } else if (value && is_space(c)) {
      out += ' ';
    } else if (references && c == '&') {
      const std::string_view name = reference_name(written.substr(i));
      const auto known = std::find_if(kPredefined.begin(), kPredefined.end(),
                                      [name](const auto& entity) { return entity.first == name; });
      const std::uint32_t code = name.starts_with('#') ? character(name) : 0;
      if (known != kPredefined.end()) {
        out += known->second;
      } else if (code != 0) {
        append_utf8(code, out);
      } else {
        out += c;
        continue;
      }
      i += name.size() + 1;
    } else {
      out += c;
    }
  }
  return out;
}

class Scanner {
 public:
  Scanner(const std::string& source, const XmlOptions& options) : source_(source), options_(options) {}

  XmlScan run() {
    if (source_.size() > 0xFFFFFFFFU) {
      error(0, "larger than 4 GiB");
      return std::move(scan_);
    }
    if (!check_characters()) return std::move(scan_);
    constexpr std::size_t kTagBytes = 32;  // A usual one's; fewer reallocations of a long list.
    scan_.elements.reserve(source_.size() / kTagBytes);
    scan_.attributes.reserve(source_.size() / kTagBytes);
    if (source_.starts_with(kByteOrderMark)) at_ = kByteOrderMark.size();
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
    std::uint32_t element;
    std::size_t prefixes_before;
  };
  struct Prefix {
    std::string_view name;
    std::size_t attribute;              ///< That declares it.
    std::optional<std::size_t> hidden;  ///< The declaration that it hides.
  };
  static constexpr std::string_view kXmlUri = "http://www.w3.org/XML/1998/namespace";
  static constexpr std::string_view kXmlnsUri = "http://www.w3.org/2000/xmlns/";

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

  // XML 2.8. Which version it is does not matter.
  void xml_declaration() {
    const std::size_t begin = at_;
    const std::size_t end = source_.find("?>", at_);
    if (end == std::string_view::npos) return error(at_, "the XML declaration does not end with \"?>\"");
    std::string_view rest = source_.substr(at_ + 5, end - at_ - 5);
    at_ = end + 2;
    const auto version = pseudo_attribute(rest, "version");
    const auto encoding = pseudo_attribute(rest, "encoding");
    const auto standalone = pseudo_attribute(rest, "standalone");
    if (encoding && !is_readable(*encoding)) {
      return error(static_cast<std::size_t>(encoding->data() - source_.data()),
                   "of encodings UTF-8, UTF-16, ISO-8859-1 and Windows-1252 are read; convert the file (iconv -f " +
                       std::string(*encoding) + " -t UTF-8) and write encoding=\"UTF-8\" here");
    }
    const auto is_odd = [](char c) { return !is_word(c) && c != '.' && c != '-'; };
    const bool other = (standalone && *standalone != "yes" && *standalone != "no") ||
                       (version && std::any_of(version->begin(), version->end(), is_odd));
    if (!version || other || std::any_of(rest.begin(), rest.end(), [](char c) { return !is_space(c); }))
      lenient(begin, "the XML declaration is not of the form <?xml version=\"1.0\" encoding=\"UTF-8\"?>");
  }

  // Takes ' name="value"' from the front of `rest`, if that is there.
  static std::optional<std::string_view> pseudo_attribute(std::string_view& rest, std::string_view name) {
    std::string_view left = rest;
    const auto skip = [&left] {
      const std::size_t before = left.size();
      while (!left.empty() && is_space(left.front())) left.remove_prefix(1);
      return left.size() < before;
    };
    if (!skip() || !left.starts_with(name)) return std::nullopt;
    left.remove_prefix(name.size());
    skip();
    if (!left.starts_with('=')) return std::nullopt;
    left.remove_prefix(1);
    skip();
    if (!left.starts_with('"') && !left.starts_with('\'')) return std::nullopt;
    const std::size_t length = left.substr(1).find(left.front());
    if (length == std::string_view::npos) return std::nullopt;
    const std::string_view value = left.substr(1, length);
    if (!std::all_of(value.begin(), value.end(), [](char c) { return is(c, kLocalChar); })) return std::nullopt;
    rest = left.substr(length + 2);
    return value;
  }

  static bool is_readable(std::string_view encoding) {
    std::string lower(encoding);
    for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;
    return lower == "utf-8" || lower == "us-ascii";
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
      const bool before_root = scan_.elements.empty();
      if (!before_root) return error(at_, "the XML declaration must stand at the very start"), false;
      lenient(at_, "the XML declaration must stand at the very start, before any blank line or comment");
      if (!scan_.error) xml_declaration();
      return !scan_.error;
    }
    if (!is_name_start(source_[at_ + 2])) return error(at_, "the processing instruction has no name"), false;
    std::size_t name_end = at_ + 2;
    while (is_name_char(source_[name_end])) ++name_end;
    const std::string_view name = source_.substr(at_ + 2, name_end - at_ - 2);
    if (name_end != end && !is_space(source_[name_end]))
      lenient(name_end, "white space is missing behind the name of the processing instruction");
    if (name.find(':') != std::string_view::npos)
      lenient(at_, "the name of a processing instruction has no prefix", "xml.namespace");
    if (name.size() == 3 && (name[0] | 0x20) == 'x' && (name[1] | 0x20) == 'm' && (name[2] | 0x20) == 'l')
      lenient(at_, "the name \"" + std::string(name) + "\" is reserved");
    at_ = end + 2;
    return !scan_.error;
  }

  // The document type is skipped; what it defines is not defined for us.
  bool doctype() {
    has_doctype_ = true;
    if (!scan_.elements.empty()) return error(at_, "DOCTYPE behind the root element"), false;
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
    if (starts("<![CDATA[")) return error(at_, "expected an element, found a CDATA section");
    do {
      if (source_[at_] == '<')
        markup();
      else
        character_data();
      if (scan_.error) return;
      if (at_ >= source_.size() && !open_.empty()) {
        const Open& open = open_.back();
        return error(scan_.elements[open.element].begin, "<" + std::string(open.name) + "> is never closed");
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
    const std::string_view name = reference_name(source_.substr(at));
    if (name.empty()) {
      lenient(at, "a bare \"&\"; write \"&amp;\"");
    } else if (name[0] == '#') {
      if (character(name) == 0)
        error(at, "character reference \"&" + std::string(name) + ";\" names no character of XML");
    } else if (std::none_of(kPredefined.begin(), kPredefined.end(),
                            [name](const auto& entity) { return entity.first == name; })) {
      lenient(at, "entity \"&" + std::string(name) + ";\" is not defined; only lt, gt, amp, quot and apos are" +
                      (has_doctype_ ? ", for what a DOCTYPE defines is not read: write the text itself" : ""));
    }
    return !scan_.error;
  }

  // The source is followed by a 0, which belongs to no class, so these need not look for its end.

  std::string_view read_name() {
    const char* const begin = source_.data() + at_;
    if (!is_name_start(*begin)) return {};
    const char* end = begin;
    while (is(*end, kLocalChar)) ++end;
    if (*end == ':') {
      prefixed_ = true;
      while (is_name_char(*end)) ++end;
    }
    at_ = static_cast<std::size_t>(end - source_.data());
    return {begin, static_cast<std::size_t>(end - begin)};
  }
  bool skip_space() {
    const std::size_t begin = at_;
    while (is_space(source_.data()[at_])) ++at_;
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
    const auto element = static_cast<std::uint32_t>(scan_.elements.size());
    const auto first_attribute = static_cast<std::uint32_t>(scan_.attributes.size());
    scan_.elements.push_back({static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(name.size()), 0, 0, 0,
                              open_.empty() ? 0 : open_.back().element, element + 1, first_attribute});

    for (;;) {
      const bool spaced = skip_space();
      if (at_ >= source_.size()) return error(begin, "the tag <" + std::string(name) + " does not end");
      if (source_[at_] == '>' || source_[at_] == '/') break;
      if (!spaced) return error(at_, "white space is missing before the attribute");
      if (!attribute(name, first_attribute)) return;
    }
    const std::size_t prefixes_before = prefixes_.size();
    if (prefixed_) check_prefixes(begin, name, first_attribute);
    if (scan_.error) return;
    XmlElementPlace& place = scan_.elements.back();
    if (source_[at_] == '/') {
      if (++at_ >= source_.size() || source_[at_] != '>') return error(at_ - 1, "\"/\" must be followed by \">\"");
      place.open_end = place.close_begin = place.end = static_cast<std::uint32_t>(++at_);
      forget_prefixes(prefixes_before);
    } else {
      place.open_end = static_cast<std::uint32_t>(++at_);
      open_.push_back({name, element, prefixes_before});
    }
  }

  [[nodiscard]] std::string_view value_of(const XmlAttributePlace& place) const {
    if (place.resolved != XmlAttributePlace::kAsWritten) return scan_.resolved[place.resolved];
    return source_.substr(place.value_begin, place.value_end - place.value_begin);
  }
  [[nodiscard]] std::string_view name_of(const XmlAttributePlace& place) const {
    return {source_.data() + place.name_begin, place.name_end - place.name_begin};
  }

  bool attribute(std::string_view element, std::size_t first_attribute) {
    const std::size_t begin = at_;
    const std::string_view name = read_name();
    if (name.empty()) return error(at_, "<" + std::string(element) + ">: expected an attribute or \">\""), false;
    prefixed_ = prefixed_ || name == "xmlns";
    skip_space();
    if (at_ >= source_.size() || source_[at_] != '=')
      return error(begin, "attribute \"" + std::string(name) + "\" has no value"), false;
    ++at_;
    skip_space();
    const char quote = at_ < source_.size() ? source_[at_] : ' ';
    if (quote != '"' && quote != '\'')
      return error(at_, "the value of attribute \"" + std::string(name) + "\" is not in quotes"), false;
    const std::size_t value_begin = ++at_;
    while (is(source_.data()[at_], kInValue)) ++at_;
    const std::size_t first_special = at_;
    if (at_ >= source_.size() || source_[at_] != quote) at_ = source_.find(quote, at_);
    if (at_ == std::string_view::npos)
      return error(begin, "the value of attribute \"" + std::string(name) + "\" does not end"), false;
    XmlAttributePlace place{static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(begin + name.size()),
                            static_cast<std::uint32_t>(value_begin), static_cast<std::uint32_t>(at_)};
    if (first_special != at_ && !look_inside(place, name, first_special)) return false;
    if (stands_already(name, first_attribute))
      return error(begin, "attribute \"" + std::string(name) + "\" stands twice"), false;
    if (scan_.attributes.size() - first_attribute >= kXmlAttributesMax) {
      return error(begin, "more than " + std::to_string(kXmlAttributesMax) + " attributes of one element",
                   "xml.too-many"),
             false;
    }
    scan_.attributes.push_back(place);
    ++at_;
    return true;
  }

  // Few are compared, many are looked up.
  bool stands_already(std::string_view name, std::size_t first_attribute) {
    constexpr std::size_t kFew = 16;
    const auto before = std::span<const XmlAttributePlace>(scan_.attributes).subspan(first_attribute);
    if (before.size() < kFew) {
      return std::any_of(before.begin(), before.end(),
                         [&](const XmlAttributePlace& place) { return name_of(place) == name; });
    }
    if (before.size() == kFew) {
      names_.clear();
      for (const XmlAttributePlace& place : before) names_.insert(name_of(place));
    }
    return !names_.insert(name).second;
  }

  // A value with something that is not as written, or not allowed, from `at` on.
  bool look_inside(XmlAttributePlace& place, std::string_view name, std::size_t at) {
    bool changes = false;
    for (; at < place.value_end; ++at) {
      if (source_[at] == '<') {
        lenient(at, "\"<\" in the value of attribute \"" + std::string(name) + "\"; write \"&lt;\"");
      } else if (source_[at] == '&') {
        changes = true;
        reference(at);
      } else {
        changes = changes || (source_[at] != ' ' && is_space(source_[at]));
      }
      if (scan_.error) return false;
    }
    if (!changes) return true;
    place.resolved = static_cast<std::uint32_t>(scan_.resolved.size());
    scan_.resolved.push_back(
        resolve(source_.substr(place.value_begin, place.value_end - place.value_begin), true, true));
    return true;
  }

  // Namespaces in XML 1.0, 3 to 6.
  void check_prefixes(std::size_t begin, std::string_view element, std::size_t first_attribute) {
    const std::size_t end = scan_.attributes.size();
    for (std::size_t i = first_attribute; i < end; ++i) {
      const std::string_view name = name_of(scan_.attributes[i]);
      if (name.starts_with("xmlns:")) declare_prefix(i);
      if (const std::string_view uri = value_of(scan_.attributes[i]);
          name == "xmlns" && (uri == kXmlUri || uri == kXmlnsUri))
        lenient(scan_.attributes[i].name_begin, "\"" + std::string(uri) + "\" cannot be the default namespace",
                "xml.namespace");
    }
    const auto check = [&](std::string_view name, std::size_t offset) {
      const auto colon = name.find(':');
      if (colon == std::string_view::npos) return false;
      const std::string_view prefix = name.substr(0, colon);
      const std::string_view local = name.substr(colon + 1);
      if (prefix.empty() || local.empty() || local.find(':') != std::string_view::npos || !is_name_start(local[0])) {
        lenient(offset, "\"" + std::string(name) + "\" is no name with a prefix", "xml.namespace");
        return false;
      }
      if (prefix == "xmlns" || prefix == "xml" || bound_.contains(prefix)) return prefix != "xmlns";
      lenient(offset,
              "prefix \"" + std::string(prefix) + "\" is not declared; add xmlns:" + std::string(prefix) + "=\"…\"",
              "xml.namespace");
      return false;
    };
    check(element, begin + 1);
    if (element.starts_with("xmlns:"))
      lenient(begin + 1, "the prefix \"xmlns\" is for declarations only", "xml.namespace");
    std::set<std::pair<std::string_view, std::string_view>> expanded;
    for (std::size_t i = first_attribute; i < end; ++i) {
      const std::string_view name = name_of(scan_.attributes[i]);
      if (!check(name, scan_.attributes[i].name_begin)) continue;
      const auto colon = name.find(':');
      const std::string_view prefix = name.substr(0, colon);
      const std::string_view uri =
          prefix == "xml" ? kXmlUri : value_of(scan_.attributes[prefixes_[bound_[prefix]].attribute]);
      if (!expanded.emplace(uri, name.substr(colon + 1)).second)
        lenient(scan_.attributes[i].name_begin,
                "attribute \"" + std::string(name) + "\" stands twice, under another prefix", "xml.namespace");
    }
  }

  void declare_prefix(std::size_t attribute) {
    const XmlAttributePlace& place = scan_.attributes[attribute];
    const std::string_view prefix = name_of(place).substr(6);
    const std::string_view uri = value_of(place);
    const bool reserved = prefix == "xmlns" || uri == kXmlnsUri || (prefix == "xml") != (uri == kXmlUri);
    if (reserved || uri.empty())
      lenient(place.name_begin,
              "prefix \"" + std::string(prefix) + "\" cannot be declared as \"" + std::string(uri) + "\"",
              "xml.namespace");
    const auto [known, added] = bound_.try_emplace(prefix, prefixes_.size());
    prefixes_.push_back({prefix, attribute, added ? std::nullopt : std::optional(known->second)});
    known->second = prefixes_.size() - 1;
  }

  void forget_prefixes(std::size_t size) {
    for (; prefixes_.size() > size; prefixes_.pop_back()) {
      const Prefix& last = prefixes_.back();
      if (last.hidden)
        bound_[last.name] = *last.hidden;
      else
        bound_.erase(last.name);
    }
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
    XmlElementPlace& place = scan_.elements[open_.back().element];
    place.close_begin = static_cast<std::uint32_t>(begin);
    place.end = static_cast<std::uint32_t>(at_);
    place.subtree_end = static_cast<std::uint32_t>(scan_.elements.size());
    forget_prefixes(open_.back().prefixes_before);
    open_.pop_back();
  }

  std::string_view source_;
  XmlOptions options_;
  std::size_t at_ = 0;
  XmlScan scan_;
  std::vector<Open> open_;
  std::vector<Prefix> prefixes_;                             ///< Declared where we are, the innermost last.
  std::unordered_map<std::string_view, std::size_t> bound_;  ///< Of each name, the innermost.
  std::unordered_set<std::string_view> names_;               ///< Attributes of the present tag, where they are many.
  bool has_doctype_ = false;
  bool prefixed_ = false;  ///< A name of the present tag has a colon, or is xmlns.
};

}  // namespace

XmlScan scan_xml(const std::string& source, const XmlOptions& options) { return Scanner(source, options).run(); }

std::string resolve_text(std::string_view written) { return resolve(written, true, false); }
std::string resolve_line_ends(std::string_view written) { return resolve(written, false, false); }

std::optional<std::pair<std::size_t, std::string>> first_unreadable(std::string_view source) {
  for (std::size_t i = 0; i < source.size();) {
    if (i + 8 <= source.size()) {
      const std::size_t plain = plain_bytes(source.data() + i);
      i += plain;
      if (plain == 8) continue;
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
    if (valid && c == 0xEF && source[i + 1] == '\xBF' && static_cast<unsigned char>(source[i + 2]) >= 0xBE)
      return std::pair{i, std::string("U+FFFE and U+FFFF are no characters of XML")};
    if (!valid) {
      return std::pair{i, std::string("not UTF-8; convert the file, for example with iconv -f ISO-8859-1 -t UTF-8")};
    }
    i += static_cast<std::size_t>(length);
  }
  return std::nullopt;
}

}  // namespace sentree::text
