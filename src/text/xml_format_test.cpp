#include "sentree/text/xml_format.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/base/rng.h"

namespace sentree::text {
namespace {

using ::testing::HasSubstr;

std::string formatted(std::string_view source, const XmlStyle& style = {}) {
  const auto once = format_xml(source, "a.xml", style, {.lenient = true});
  EXPECT_TRUE(once) << (once ? "" : to_string(once.error()));
  const auto twice = format_xml(*once, "a.xml", style, {.lenient = true});
  EXPECT_TRUE(twice) << (twice ? "" : to_string(twice.error()));
  EXPECT_EQ(*twice, *once) << "formatting again changes it";
  return *once;
}

TEST(FormatXml, IndentsAndQuotesAlike) {
  EXPECT_EQ(formatted("<?xml version='1.0'?><a  x = '1'><b></b>\n\t<c y=\"2\" ></c ></a>"),
            "<?xml version='1.0'?>\n<a x=\"1\">\n  <b/>\n  <c y=\"2\"/>\n</a>\n");
}

TEST(FormatXml, KeepsLineEndsAndTheMarkOfAFile) {
  EXPECT_EQ(formatted("\xEF\xBB\xBF<a>\r\n<b/>\n<!-- 1\r\n 2 --></a>"),
            "\xEF\xBB\xBF<a>\r\n  <b/>\r\n  <!-- 1\r\n   2 -->\r\n</a>\r\n");
  EXPECT_EQ(formatted("<a>\n<b/>\r\n</a>"), "<a>\n  <b/>\n</a>\n");
}

TEST(FormatXml, KeepsCommentsWhereTheyBelong) {
  EXPECT_EQ(formatted("<!-- top -->\n<a> <!-- of a -->\n<!-- of b --><b/>   <!-- of b too -->\n<c/></a><!-- end -->"),
            "<!-- top -->\n<a> <!-- of a -->\n  <!-- of b -->\n  <b/> <!-- of b too -->\n  <c/>\n</a> <!-- end -->\n");
}

TEST(FormatXml, MovesTheLinesOfACommentTogether) {
  EXPECT_EQ(formatted("<a>\n      <!-- 1\n           * x  \n        -->\n<b/></a>"),
            "<a>\n  <!-- 1\n       * x\n    -->\n  <b/>\n</a>\n");
}

TEST(FormatXml, KeepsOneBlankLineBetweenElements) {
  EXPECT_EQ(formatted("<a>\n\n\n<b/>\n\n\n<!-- c -->\n<c/>\n\n</a>\n\n"),
            "<a>\n  <b/>\n\n  <!-- c -->\n  <c/>\n</a>\n");
}

TEST(FormatXml, KeepsValuesAsWritten) {
  EXPECT_EQ(formatted("<a x='say \"hi\"' y='a > b &amp;&amp; c' z=\"one;\n   two\"/>"),
            "<a x='say \"hi\"' y=\"a > b &amp;&amp; c\" z=\"one;\n   two\"/>\n");
}

TEST(FormatXml, RepairsWhatOnlyLenientReadersAccept) {
  EXPECT_EQ(formatted("<a x=\"n<3 & m\"/>"), "<a x=\"n&lt;3 &amp; m\"/>\n");
}

TEST(FormatXml, KeepsTextAndCdataByteForByte) {
  const std::string source = "<a>\n  <t>\n two  <b/> </t>\n  <u><![CDATA[ < ]]></u>\n  <v><![CDATA[  ]]></v>\n</a>\n";
  EXPECT_EQ(formatted(source), source);
}

TEST(FormatXml, KeepsTheInsideOfWhatTheStyleCallsVerbatim) {
  const XmlStyle style{.attribute_rank = {}, .verbatim = [](const XmlElement& e) { return e.name() == "data"; }};
  EXPECT_EQ(formatted("<a><data>\n <x  /> </data><b> </b></a>", style),
            "<a>\n  <data>\n <x  /> </data>\n  <b/>\n</a>\n");
}

TEST(FormatXml, OrdersAttributesByRankAndKeepsTheRest) {
  const XmlStyle style{.attribute_rank = [](std::string_view name) { return name == "id" ? 0 : 1; }, .verbatim = {}};
  EXPECT_EQ(formatted("<a z=\"1\" y=\"2\" id=\"3\"/>", style), "<a id=\"3\" z=\"1\" y=\"2\"/>\n");
}

TEST(FormatXml, WrapsLongTags) {
  const std::string value(50, 'v');
  EXPECT_EQ(formatted("<root><abc x=\"" + value + "\" y=\"" + value + "\" z=\"" + value + "\"/></root>"),
            "<root>\n  <abc x=\"" + value + "\" y=\"" + value + "\"\n       z=\"" + value + "\"/>\n</root>\n");
}

TEST(FormatXml, KeepsLineBreaksBetweenAttributes) {
  EXPECT_EQ(formatted("<a x='1'\n y='2' z='3'><b\n  x='1'/></a>"),
            "<a x=\"1\"\n   y=\"2\" z=\"3\">\n  <b x=\"1\"/>\n</a>\n");
}

TEST(FormatXml, LetsAnOnlyChildShareTheLine) {
  EXPECT_EQ(formatted("<a><b><c  x='1'/></b><b><t>text</t></b><b> <c/></b><b><c/><c/></b></a>"),
            "<a>\n  <b><c x=\"1\"/></b>\n  <b><t>text</t></b>\n  <b>\n    <c/>\n  </b>\n"
            "  <b>\n    <c/>\n    <c/>\n  </b>\n</a>\n");
  const std::string value(kXmlColumnsMax, 'v');
  EXPECT_EQ(formatted("<a><b><c x='" + value + "'/></b></a>"),
            "<a>\n  <b>\n    <c x=\"" + value + "\"/>\n  </b>\n</a>\n");
}

TEST(FormatXml, KeepsTheDocumentType) {
  EXPECT_THAT(formatted("<!DOCTYPE a [ <!ELEMENT a ANY>]><a/>"), HasSubstr("<!DOCTYPE a [ <!ELEMENT a ANY>]>\n<a/>\n"));
}

TEST(FormatXml, SaysWhereADocumentIsBroken) {
  const auto result = format_xml("<a>\n<b></a>", "a.xml");
  ASSERT_FALSE(result);
  EXPECT_EQ(to_string(result.error()), "a.xml:2:4: </a> closes <b>");
}

/// Elements, attributes and texts in order, without comments and white space.
std::string meaning(const XmlElement& e) {
  std::string all = "<" + std::string(e.name());
  for (const XmlAttribute& a : e.attributes()) all += " " + std::string(a.name) + "=" + std::string(a.value);
  const std::string text = e.text();
  if (text.find_first_not_of(" \t\n") != std::string::npos) all += ">" + text;
  for (const XmlElement& child : e.children()) all += meaning(child);
  return all + ">";
}

std::string random_xml(Rng& rng, int depth) {
  const auto space = [&] { return std::string(rng.below(4), " \n\t"[rng.below(3)]); };
  const auto comment = [&] { return rng.below(4) == 0 ? "<!-- a\n   b -->" + space() : std::string(); };
  const std::string tag(1, static_cast<char>('a' + rng.below(5)));
  std::string xml = "<" + tag;
  for (std::uint64_t i = rng.below(5); i > 0; --i) {
    xml += " " + space() + std::string(1, static_cast<char>('p' + i)) + "=" +
           (rng.below(2) == 0 ? "'q\"\n" : "\"it's") + std::string(rng.below(70), 'x');
    xml += xml.substr(xml.rfind('=') + 1, 1);
  }
  if (depth == 0 || rng.below(4) == 0) return xml + space() + "/>";
  xml += ">" + space() + comment();
  if (rng.below(5) == 0) xml += "text " + space();
  for (std::uint64_t i = rng.below(4); i > 0; --i) xml += random_xml(rng, depth - 1) + space() + comment();
  return xml + "</" + tag + space() + ">";
}

TEST(FormatXml, ChangesNoMeaningOfRandomDocumentsAndNothingTheSecondTime) {
  for (std::uint64_t seed = 1; seed <= 500; ++seed) {
    Rng rng(seed);
    const std::string source = random_xml(rng, 5);
    SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + source);
    const auto before = XmlDocument::parse(source);
    ASSERT_TRUE(before);
    const auto after = XmlDocument::parse(formatted(source));
    ASSERT_TRUE(after);
    ASSERT_EQ(meaning(after->root()), meaning(before->root()));
    if (HasFailure()) return;
  }
}

}  // namespace
}  // namespace sentree::text
