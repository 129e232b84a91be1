#include "sentree/text/encoding.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "sentree/base/temporary_folder.h"
#include "sentree/text/file.h"
#include "sentree/text/xml.h"

namespace sentree::text {
namespace {

using namespace std::string_literals;

std::string utf16(const std::u16string& text, bool is_big) {
  std::string out;
  for (const char16_t c : text) {
    const char low = static_cast<char>(c & 0xFF), high = static_cast<char>(c >> 8);
    out += is_big ? high : low;
    out += is_big ? low : high;
  }
  return out;
}

const std::u16string kDocument = u"<?xml version=\"1.0\" encoding=\"utf-16\"?>\n<a n=\"K\u00FCche \U0001F916\"/>\n";
const std::string kAsUtf8 =
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<a n=\"K\xC3\xBC"
    "che \xF0\x9F\xA4\x96\"/>\n";

TEST(Encoding, Utf16IsReadWithAndWithoutAMark) {
  for (const bool is_big : {false, true}) {
    EXPECT_EQ(xml_as_utf8(utf16(u"\uFEFF" + kDocument, is_big)), kAsUtf8);
    EXPECT_EQ(xml_as_utf8(utf16(kDocument, is_big)), kAsUtf8);
  }
}

TEST(Encoding, SingleBytesAreReadAsTheDeclarationSays) {
  EXPECT_EQ(xml_as_utf8("<?xml version='1.0' encoding='ISO-8859-1'?><a n='\xFC'/>"),
            "<?xml version='1.0' encoding='UTF-8'?><a n='\xC3\xBC'/>");
  EXPECT_EQ(xml_as_utf8("<?xml version='1.0' encoding='windows-1252'?><a n='\x80\x93'/>"),
            "<?xml version='1.0' encoding='UTF-8'?><a n='\xE2\x82\xAC\xE2\x80\x9C'/>");
}

TEST(Encoding, ADeclarationOfUtf16InBytesIsMended) {
  EXPECT_EQ(xml_as_utf8("<?xml version='1.0' encoding='utf-16'?><a n='\xC3\xBC'/>"),
            "<?xml version='1.0' encoding='UTF-8'?><a n='\xC3\xBC'/>");
}

TEST(Encoding, OfWhatIsUtf8OrNoXmlNothingIsChanged) {
  for (const std::string& source :
       {"<?xml version='1.0' encoding='UTF-8'?><a/>"s, "<a/>"s, ""s, "P5 \xFF\xFE"s, "<?xml"s, "<?xml encoding='"s,
        "<?xml version='1.0' encoding='Shift_JIS'?><a/>"s, "\xFF\xFE\0\0<\0\0\0"s, "mission: {file: a.xml}"s})
    EXPECT_EQ(xml_as_utf8(source), std::nullopt) << source;
}

TEST(Encoding, HalfAPairIsRefusedByTheReaderOfXml) {
  const auto text = xml_as_utf8(utf16(u"\uFEFF<a n='\xD83E'/>", false));
  ASSERT_TRUE(text);
  EXPECT_FALSE(XmlDocument::parse(*text, "a.xml").has_value());
}

TEST(Encoding, WhatWasReadIsWrittenAsItWas) {
  for (const std::string& source :
       {std::string("<?xml version='1.0' encoding='ISO-8859-1'?>\r\n<a b='caf\xE9'/>"),
        std::string("<?xml version=\"1.0\" encoding=\"Windows-1252\"?><a b='\x80\xE9\x81'/>"),
        utf16(u"\uFEFF" + kDocument, false), utf16(u"\uFEFF" + kDocument, true), utf16(kDocument, false),
        std::string("<?xml version='1.0' encoding='UTF-16'?><a/>")}) {
    const auto text = xml_as_utf8(source);
    ASSERT_TRUE(text);
    EXPECT_EQ(xml_encoded_as(source, *text), source);
    std::string edited = *text;
    edited.insert(edited.find("/>"), " c=''");
    const auto written = xml_encoded_as(source.substr(0, 1024), edited);
    ASSERT_TRUE(written) << edited;
    EXPECT_EQ(xml_as_utf8(*written), edited);
    EXPECT_LE(written->size(), source.size() + 10);
  }
  const std::string latin = "<?xml version='1.0' encoding='latin1'?><a/>";
  EXPECT_EQ(xml_encoded_as(latin, "<?xml version='1.0' encoding='UTF-8'?><a b='\xE2\x82\xAC'/>"), std::nullopt);
  EXPECT_EQ(xml_encoded_as(latin, "<?xml version='1.0' encoding='ascii'?><a/>"), std::nullopt);
  EXPECT_EQ(xml_encoded_as("<a/>", "<a b=''/>"), std::nullopt);
}

TEST(Encoding, FilesAreReadSo) {
  const TemporaryFolder folder("encoding");
  const auto path = folder.path() / "a.xml";
  ASSERT_TRUE(write_file(path, utf16(u"\uFEFF" + kDocument, false)));
  const ReadLog log;
  EXPECT_EQ(read_file(path), kAsUtf8);
  ASSERT_EQ(log.files().size(), 1U);
  EXPECT_TRUE(log.files()[0].content.starts_with("\xFF\xFE")) << "what is kept of a project are its own octets";
}

}  // namespace
}  // namespace sentree::text
