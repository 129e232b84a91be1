// The XML scanner beside expat, a reader that has been in use everywhere for decades: the same documents are
// well-formed, with the same elements, attributes, texts and places. Where we differ, a rule says why.

#include <expat.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/text/detail/xml_scan.h"
#include "sentree/text/file.h"
#include "sentree/text/xml.h"

namespace sentree::text {
namespace {

struct Element {
  std::string name;
  std::string uri;
  std::vector<std::pair<std::string, std::string>> attributes;  // without xmlns
  std::string text;
  std::size_t begin = 0;
  std::size_t end = 0;

  friend bool operator==(const Element&, const Element&) = default;
};

std::ostream& operator<<(std::ostream& out, const Element& e) {
  out << e.begin << ".." << e.end << " <{" << e.uri << "}" << e.name;
  for (const auto& [name, value] : e.attributes) out << " " << name << "=\"" << value << "\"";
  return out << "> \"" << e.text << "\"";
}

struct Reading {
  std::string error;  // empty: well-formed
  std::vector<Element> elements;
};

// Expat's, in the form of ours.
class Expat {
 public:
  explicit Expat(const std::string& source) : source_(source), parser_(XML_ParserCreateNS(nullptr, kSeparator)) {
    XML_SetUserData(parser_, this);
    XML_SetReturnNSTriplet(parser_, 1);
    XML_SetElementHandler(
        parser_, [](void* self, const char* name, const char** attributes) { me(self).start(name, attributes); },
        [](void* self, const char*) { me(self).end(); });
    XML_SetCharacterDataHandler(parser_, [](void* self, const char* text, int size) {
      me(self).characters({text, static_cast<std::size_t>(size)});
    });
    XML_SetCdataSectionHandler(
        parser_, [](void* self) { me(self).cdata(true); }, [](void* self) { me(self).cdata(false); });
    XML_SetCommentHandler(parser_, [](void* self, const char*) { me(self).end_run(); });
    XML_SetProcessingInstructionHandler(parser_, [](void* self, const char*, const char*) { me(self).end_run(); });
  }
  ~Expat() { XML_ParserFree(parser_); }
  Expat(const Expat&) = delete;
  Expat& operator=(const Expat&) = delete;

  Reading read() {
    if (XML_Parse(parser_, source_.data(), static_cast<int>(source_.size()), XML_TRUE) != XML_STATUS_OK)
      reading_.error = XML_ErrorString(XML_GetErrorCode(parser_));
    return std::move(reading_);
  }

 private:
  static Expat& me(void* self) { return *static_cast<Expat*>(self); }

  static constexpr char kSeparator = '\x01';  // no character of XML

  // URI, local name and prefix, the first two, or a local name.
  static std::pair<std::string, std::string> name_of(const std::string& triplet) {
    const auto first = triplet.find(kSeparator);
    if (first == std::string::npos) return {triplet, ""};
    const auto second = triplet.find(kSeparator, first + 1);
    const std::string local = triplet.substr(first + 1, second == std::string::npos ? second : second - first - 1);
    return {second == std::string::npos ? local : triplet.substr(second + 1) + ":" + local, triplet.substr(0, first)};
  }

  void start(const char* name, const char** attributes) {
    end_run();
    Element element;
    std::tie(element.name, element.uri) = name_of(name);
    for (; *attributes != nullptr; attributes += 2)
      element.attributes.emplace_back(name_of(attributes[0]).first, attributes[1]);
    element.begin = static_cast<std::size_t>(XML_GetCurrentByteIndex(parser_));
    open_.push_back(reading_.elements.size());
    reading_.elements.push_back(std::move(element));
  }
  void end() {
    end_run();
    reading_.elements[open_.back()].end =
        static_cast<std::size_t>(XML_GetCurrentByteIndex(parser_) + XML_GetCurrentByteCount(parser_));
    open_.pop_back();
  }
  void characters(std::string_view text) {
    run_ += text;
    const auto begin = static_cast<std::size_t>(XML_GetCurrentByteIndex(parser_));
    written_ += source_.substr(begin, static_cast<std::size_t>(XML_GetCurrentByteCount(parser_)));
  }
  void cdata(bool begins) {
    end_run();
    in_cdata_ = begins;
  }
  // White space alone between two tags does not count for us.
  void end_run() {
    if (!open_.empty() && (in_cdata_ || written_.find_first_not_of(" \t\r\n") != std::string::npos))
      reading_.elements[open_.back()].text += run_;
    run_.clear();
    written_.clear();
  }

  const std::string& source_;
  XML_Parser parser_;
  Reading reading_;
  std::vector<std::size_t> open_;
  std::string run_;      // of character data
  std::string written_;  // its source
  bool in_cdata_ = false;
};

Reading ours(const std::string& source) {
  const auto document = XmlDocument::parse(source);
  if (!document) return {to_string(document.error()), {}};
  Reading reading;
  std::vector<XmlElement> waiting{document->root()};
  while (!waiting.empty()) {
    const XmlElement e = waiting.back();
    waiting.pop_back();
    Element& element = reading.elements.emplace_back();
    element.name = e.name();
    element.uri = e.namespace_uri();
    e.for_each_attribute([&](std::string_view name, std::string_view value) {
      if (name != "xmlns" && !name.starts_with("xmlns:")) element.attributes.emplace_back(name, value);
    });
    element.text = e.text();
    element.begin = e.offset();
    element.end = e.end_offset();
    const std::vector<XmlElement> children = e.children();
    waiting.insert(waiting.end(), children.rbegin(), children.rend());
  }
  return reading;
}

bool contains(const std::string& text, std::string_view what) { return text.find(what) != std::string::npos; }

// Where we mean to differ, and how to know it. `example` must differ, else the rule is no longer needed.
struct Deviation {
  const char* reason;
  bool (*applies)(const std::string& source, const Reading& ours, const Reading& theirs);
  std::string example;
};

std::string nested(int levels) {
  std::string source;
  for (int i = 0; i < levels; ++i) source += "<a>";
  for (int i = 0; i < levels; ++i) source += "</a>";
  return source;
}

std::string many_attributes() {
  std::string source = "<a";
  for (std::size_t i = 0; i <= kXmlAttributesMax; ++i) source += " a" + std::to_string(i) + "=''";
  return source + "/>";
}

const std::vector<Deviation>& deviations() {
  static const std::vector<Deviation> all{
      {"a DOCTYPE is skipped unread: what it defines is not defined, what is wrong in it is not seen",
       [](const std::string& source, const Reading&, const Reading&) { return contains(source, "<!DOCTYPE"); },
       "<!DOCTYPE a [<!ENTITY e 'x'>]><a>&e;</a>"},
      {"only UTF-8 is read",
       [](const std::string&, const Reading& ours, const Reading&) {
         return contains(ours.error, "of encodings UTF-8") || contains(ours.error, "not UTF-8");
       },
       "<?xml version='1.0' encoding='ISO-8859-1'?><a/>"},
      {"names may have any character above ASCII",
       [](const std::string& source, const Reading& ours, const Reading& theirs) {
         return ours.error.empty() && theirs.error == "not well-formed (invalid token)" &&
                std::any_of(source.begin(), source.end(), [](char c) { return static_cast<unsigned char>(c) >= 0x80; });
       },
       "<a\xC3\x97/>"},
      {"elements are nested up to a bound",
       [](const std::string&, const Reading& ours, const Reading&) { return contains(ours.error, "nested deeper"); },
       nested(kXmlNestingMax + 1)},
      {"an element has a bounded number of attributes",
       [](const std::string&, const Reading& ours, const Reading&) {
         return contains(ours.error, "attributes of one");
       },
       many_attributes()},
  };
  return all;
}

// Empty: alike, or as a deviation says. `met` counts those.
std::string difference(const std::string& source, std::map<std::string, int>& met) {
  const Reading we = ours(source);
  const Reading they = Expat(source).read();
  std::ostringstream out;
  if (we.error.empty() != they.error.empty()) {
    out << "ours: " << (we.error.empty() ? "well-formed" : we.error)
        << "\nexpat: " << (they.error.empty() ? "well-formed" : they.error);
  } else if (we.error.empty()) {
    if (we.elements.size() != they.elements.size())
      out << we.elements.size() << " elements, expat has " << they.elements.size();
    for (std::size_t i = 0; i < std::min(we.elements.size(), they.elements.size()); ++i) {
      if (we.elements[i] == they.elements[i]) continue;
      out << "ours: " << we.elements[i] << "\nexpat: " << they.elements[i];
      break;
    }
  }
  if (out.str().empty()) return {};
  for (const Deviation& deviation : deviations()) {
    if (!deviation.applies(source, we, they)) continue;
    ++met[deviation.reason];
    return {};
  }
  return out.str() + "\n--- source\n" + source + "\n---";
}

TEST(XmlBesideExpat, EveryDeviationIsOne) {
  for (const Deviation& deviation : deviations()) {
    std::map<std::string, int> met;
    EXPECT_EQ(difference(deviation.example, met), "");
    EXPECT_EQ(met, (std::map<std::string, int>{{deviation.reason, 1}})) << deviation.example;
  }
}

TEST(XmlBesideExpat, ReadsTheCorpusAlike) {
  std::map<std::string, int> met;
  int files = 0;
  for (const char* folder : {"fuzz/corpus/text_xml_fuzz", "fuzz/corpus/bt_xml_fuzz", "fuzz/corpus/scxml_load_fuzz",
                             "examples", "tests/projects", "tests/charts"}) {
    for (const auto& entry :
         std::filesystem::recursive_directory_iterator(SENTREE_SOURCE_DIR "/" + std::string(folder))) {
      const auto extension = entry.path().extension();
      if (extension != ".xml" && extension != ".scxml") continue;
      const auto source = read_file(entry.path());
      ASSERT_TRUE(source) << entry.path();
      ++files;
      EXPECT_EQ(difference(*source, met), "") << entry.path();
    }
  }
  EXPECT_GT(files, 40);
}

// Documents that are nearly well-formed: pieces of the grammar, some of them wrong.
class Generator {
 public:
  explicit Generator(std::uint64_t seed) : rng_(seed) {}

  std::string document() {
    std::string source;
    if (one_in(8)) source += "\xEF\xBB\xBF";
    if (one_in(2)) source += declaration();
    misc(source);
    if (one_in(12)) source += "<!DOCTYPE a>";
    misc(source);
    element(source, 0);
    misc(source);
    // Most mistakes of people and programs are small.
    for (std::uint64_t i = one_in(2) ? 0 : rng_.below(4); i > 0 && !source.empty(); --i) spoil(source);
    return source;
  }

 private:
  bool one_in(std::uint64_t count) { return rng_.below(count) == 0; }
  std::string pick(const std::vector<std::string>& from) { return from[rng_.below(from.size())]; }

  std::string declaration() {
    std::string source = "<?xml";
    if (!one_in(12)) source += pick({" version='1.0'", " version=\"1.0\"", "\nversion = '1.1'", " Version='1.0'"});
    if (one_in(2))
      source += pick(
          {" encoding='UTF-8'", " encoding=\"utf-8\"", " encoding='us-ascii'", " encoding=''", "encoding='utf-8'"});
    if (one_in(3)) source += pick({" standalone='yes'", " standalone=\"no\"", " standalone='maybe'"});
    return source + pick({"?>", " ?>", "\n?>"});
  }
  void misc(std::string& source) {
    for (std::uint64_t i = rng_.below(3); i > 0; --i)
      source += pick({" ", "\n", "\r\n", "<!-- c -->", "<!---->", "<?go on?>", "<?go?>", "<!-- - -->", "<?x:y z?>",
                      "<![CDATA[x]]>"});
  }
  std::string name() { return pick({"a", "b", "c1", "_", "d-e.f", "p:a", "q:b", "xml:c", "\xC3\xA9", "xmlx"}); }
  void attributes(std::string& source) {
    if (one_in(3))
      source += pick({" xmlns:p='u'", " xmlns:p='v'", " xmlns:q='u'", " xmlns='w'", " xmlns=''", " xmlns:q=''"});
    if (one_in(3))
      source += pick({" xmlns:q='v'", " xmlns:p=\"u&amp;\"", " xmlns:xml='http://www.w3.org/XML/1998/namespace'"});
    for (std::uint64_t i = rng_.below(4); i > 0; --i) {
      source += pick({" ", " ", "\n  ", "\t"}) + name() + pick({"=", "=", " = ", "=\n"});
      const std::string quote = pick({"'", "\""});
      source += quote;
      for (std::uint64_t k = rng_.below(4); k > 0; --k)
        source += pick({"x", " ", "\n", "\r\n", "\r", "\t", "&lt;", "&amp;", "&#10;", "&#x20AC;", "&quot;", "&apos;",
                        ">", "]]>", "\xE2\x82\xAC", quote == "'" ? "\"" : "'"});
      source += quote;
    }
  }
  void content(std::string& source, int depth) {
    for (std::uint64_t i = rng_.below(5); i > 0; --i) {
      switch (rng_.below(8)) {
        case 0:
        case 1:
        case 2: element(source, depth + 1); break;
        case 3: source += pick({"<![CDATA[x<y&]]>", "<![CDATA[]]>", "<![CDATA[ ]]]]>", "<![CDATA[\r\n]]>"}); break;
        case 4: source += pick({"<!-- c -->", "<?go on?>"}); break;
        default:
          source +=
              pick({"text", " ", "\n", "\r", "\r\n", "&amp;", "&#32;", "&#xD;", ">", "]]", "\xF0\x9F\xA4\x96", " x "});
      }
    }
  }
  void element(std::string& source, int depth) {
    const std::string tag = name();
    source += "<" + tag;
    attributes(source);
    source += pick({"", "", " ", "\n"});
    if (depth > 6 || one_in(3)) {
      source += "/>";
      return;
    }
    source += ">";
    content(source, depth);
    source += "</" + tag + pick({"", "", " ", "\n"}) + ">";
  }
  void spoil(std::string& source) {
    const std::size_t at = rng_.below(source.size());
    switch (rng_.below(4)) {
      case 0: source.erase(at, 1 + rng_.below(3)); break;
      case 1:
        source.insert(at, pick({"<",
                                ">",
                                "&",
                                "\"",
                                "'",
                                "/",
                                "=",
                                " ",
                                "]]>",
                                "--",
                                "<?",
                                "?>",
                                "<!",
                                ":",
                                "\x01",
                                "\xFF",
                                "\xEF\xBF\xBF",
                                "&#0;",
                                "&#xFFFE;",
                                "&nbsp;",
                                "&#65",
                                "<![CDATA[",
                                "xmlns:p='",
                                "<?xml ",
                                "\x7F",
                                std::string(1, '\0')}));
        break;
      case 2: source.insert(at, source.substr(rng_.below(source.size()), 1 + rng_.below(12))); break;
      default: source[at] = static_cast<char>(rng_.below(256));
    }
  }

  Rng rng_;
};

TEST(XmlBesideExpat, ReadsGeneratedDocumentsAlike) {
  const char* given = std::getenv("SENTREE_SEED");
  const std::uint64_t seed = given != nullptr ? std::strtoull(given, nullptr, 10) : std::random_device()();
  std::cout << "seed " << seed << " (SENTREE_SEED repeats it)\n";
  Generator generator(seed);
  std::map<std::string, int> met;
  int well_formed = 0;
  constexpr int kDocuments = 20'000;
  for (int i = 0; i < kDocuments; ++i) {
    const std::string source = generator.document();
    const std::string wrong = difference(source, met);
    ASSERT_TRUE(wrong.empty()) << "document " << i << " of seed " << seed << "\n" << wrong;
    if (XmlDocument::parse(source)) ++well_formed;
  }
  // Neither kind is rare, so both are tested.
  EXPECT_GT(well_formed, kDocuments / 10);
  EXPECT_LT(well_formed, kDocuments * 9 / 10);
  for (const auto& [reason, count] : met) std::cout << count << " documents: " << reason << "\n";
}

}  // namespace
}  // namespace sentree::text
