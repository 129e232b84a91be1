#include "sentree/lsp/detail/xml_cursor.h"

#include <gtest/gtest.h>

#include <random>

namespace sentree::lsp {
namespace {

using Where = XmlCursor::Where;

// `|` is the place.
XmlCursor at(std::string text) {
  const std::size_t place = text.find('|');
  text.erase(place, 1);
  return xml_cursor(text, place);
}

TEST(XmlCursor, KnowsWhatSomebodyTypes) {
  EXPECT_EQ(at("<a><|").where, Where::kTagName);
  EXPECT_EQ(at("<a><b|\n  <c/></a>").where, Where::kTagName);
  EXPECT_EQ(at("<a><b |/></a>").where, Where::kAttributeName);
  EXPECT_EQ(at("<a><b na|me=\"x\"/></a>").where, Where::kAttributeName);
  EXPECT_EQ(at("<a><b name=\"|").where, Where::kAttributeValue);
  EXPECT_EQ(at("<a><b name=\"x|y\" z=\"1\"/></a>").where, Where::kAttributeValue);
  EXPECT_EQ(at("<a>|</a>").where, Where::kText);
  EXPECT_EQ(at("<a><!-- <b |--></a>").where, Where::kElsewhere);
  EXPECT_EQ(at("<a></|a>").where, Where::kElsewhere);
}

TEST(XmlCursor, KnowsTheTagAndWhatIsAroundIt) {
  const XmlCursor cursor = at("<root><Tree ID=\"Main\"><x/><y></y><Go to=\"kit|chen\" name='N' ></Tree></root>");
  ASSERT_EQ(cursor.open.size(), 2U);
  EXPECT_EQ(cursor.open[1].name, "Tree");
  EXPECT_EQ(cursor.open[1].attribute("ID"), "Main");
  EXPECT_EQ(cursor.tag.name, "Go");
  EXPECT_EQ(cursor.attribute, "to");
  EXPECT_EQ(cursor.tag.attribute("to"), "kitchen");
  EXPECT_EQ(cursor.tag.attribute("name"), "N") << "also what follows";
}

TEST(XmlCursor, EndsAValueWithoutQuoteBeforeTheNextTag) {
  const XmlCursor cursor = at("<a>\n <b x=\"ki|\n <c y=\"1\"/>\n</a>");
  EXPECT_EQ(cursor.where, Where::kAttributeValue);
  EXPECT_EQ(cursor.to - cursor.from, 2U);
}

TEST(XmlCursor, StandsAnyText) {
  constexpr unsigned kSeed = 11;
  std::mt19937 random(kSeed);
  const std::string pieces[] = {"<",  ">",    "/",   "a",         "=",   "\"", "'",  " ",
                                "\n", "<!--", "-->", "<![CDATA[", "]]>", "<?", "?>", "</"};
  for (int round = 0; round < 3000; ++round) {
    std::string text;
    for (std::size_t i = 0, n = random() % 30; i < n; ++i) text += pieces[random() % std::size(pieces)];
    for (std::size_t place = 0; place <= text.size(); ++place) {
      const XmlCursor cursor = xml_cursor(text, place);
      ASSERT_LE(cursor.from, cursor.to) << "seed " << kSeed << ": " << text;
      ASSERT_LE(cursor.to, text.size()) << "seed " << kSeed << ": " << text;
    }
  }
}

}  // namespace
}  // namespace sentree::lsp
