#include "sentree/text/xml.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/text/detail/xml_scan.h"

namespace sentree::text {
namespace {

XmlDocument parse(std::string source, const XmlOptions& options = {}) {
  auto document = XmlDocument::parse(std::move(source), "a.xml", options);
  EXPECT_TRUE(document) << (document ? "" : to_string(document.error()));
  return std::move(*document);
}

std::string refusal(std::string source) {
  const auto document = XmlDocument::parse(std::move(source), "a.xml");
  return document ? "accepted" : to_string(document.error());
}

TEST(XmlDocument, GivesElementsAttributesAndTheirPlaces) {
  const auto document =
      parse("\xEF\xBB\xBF<?xml version=\"1.0\"?>\n<!-- c -->\n<a>\n  <b x = '1' yy=\"&lt;2\"/>t</a>\n");
  const XmlElement b = document.root().first_child();
  EXPECT_EQ(b.name(), "b");
  EXPECT_EQ(b.attribute("yy"), "<2");
  EXPECT_EQ(b.attribute("z"), std::nullopt);
  EXPECT_EQ(to_string(b.span()), "a.xml:4:3");
  EXPECT_EQ(to_string(b.attribute_span("yy")), "a.xml:4:14");
  EXPECT_EQ(to_string(b.attribute_value_span("yy")), "a.xml:4:18");
  EXPECT_EQ(document.root().inner_source(), "\n  <b x = '1' yy=\"&lt;2\"/>t");
  EXPECT_EQ(b.parent(), document.root());
  EXPECT_FALSE(document.root().parent());
}

TEST(XmlDocument, ResolvesNamespacesThroughAncestors) {
  const auto document = parse(R"(<s xmlns="u1" xmlns:q="u2"><q:a/><b xmlns=""/></s>)");
  const auto children = document.root().children();
  EXPECT_EQ(document.root().namespace_uri(), "u1");
  EXPECT_EQ(children[0].namespace_uri(), "u2");
  EXPECT_EQ(children[0].local_name(), "a");
  EXPECT_EQ(children[1].namespace_uri(), "");
}

TEST(XmlDocument, JoinsTextAndCdata) {
  EXPECT_EQ(parse("<a>x &amp; <!-- no --><![CDATA[<y>]]><b/></a>").root().text(), "x & <y>");
}

TEST(XmlDocument, ResolvesReferencesAndNormalisesWhiteSpace) {
  // XML 1.0, 2.11 and 3.3.3: white space in a value becomes ' ', unless it is written as a reference; line ends of text
  // become '\n'.
  const auto document = parse(
      "<a v='1&#10;2\n3\t4\r\n5\r6 &quot;&apos;&lt;&gt;&amp;lt;'>&#65;&#xE9;&#x20AC;&#x1F916;\r\nb\rc"
      "<![CDATA[&amp;\r\n]]>&#32;<b/> \n </a>");
  EXPECT_EQ(document.root().attribute("v"), "1\n2 3 4 5 6 \"'<>&lt;");
  EXPECT_EQ(document.root().text(), "A\xC3\xA9\xE2\x82\xAC\xF0\x9F\xA4\x96\nb\nc&amp;\n ");
}

TEST(XmlDocument, KeepsWhatIsNoReferenceWhenLenient) {
  const auto document = parse("<a v='&nbsp; & &; &lt &amp;amp;'/>", {.lenient = true});
  EXPECT_EQ(document.root().attribute("v"), "&nbsp; & &; &lt &amp;");
  EXPECT_EQ(document.warnings().size(), 4U);
}

TEST(XmlDocument, LeavesCommentsAndInstructionsOutOfText) {
  EXPECT_EQ(parse("<a>x<!-->--><?p ?><!-- -- --><b>no</b>y<?q?></a>", {.lenient = true}).root().text(), "xy");
  EXPECT_EQ(refusal("<a><? p?></a>"), "a.xml:1:4: the processing instruction has no name");
}

TEST(XmlElement, OutlivesAMoveOfItsDocument) {
  auto document = parse("<a><b x='1'/></a>");
  const XmlElement b = document.root().first_child();
  const XmlDocument moved = std::move(document);
  EXPECT_EQ(b.attribute("x"), "1");
  EXPECT_EQ(b, moved.root().first_child());
  EXPECT_EQ(to_string(b.span()), "a.xml:1:4");
}

TEST(XmlElement, OfNothingIsEmpty) {
  const XmlElement none;
  EXPECT_FALSE(none);
  EXPECT_FALSE(none.first_child());
  EXPECT_FALSE(none.next_sibling());
  EXPECT_FALSE(none.parent());
  EXPECT_EQ(none.name(), "");
  EXPECT_EQ(none.attribute("x"), std::nullopt);
  EXPECT_EQ(none.text(), "");
  EXPECT_TRUE(none.attributes().empty());
}

TEST(XmlDocument, RefusesWhatIsNotWellFormed) {
  EXPECT_EQ(refusal(""), "a.xml:1:1: there is no root element");
  EXPECT_EQ(refusal("<a>\n<b></a>"), "a.xml:2:4: </a> closes <b>");
  EXPECT_EQ(refusal("<a>\n <b>"), "a.xml:2:2: <b> is never closed");
  EXPECT_EQ(refusal("<a/><b/>"), "a.xml:1:5: a second root element; a document has one");
  EXPECT_EQ(refusal("<a x='1' x='2'/>"), "a.xml:1:10: attribute \"x\" stands twice");
  EXPECT_EQ(refusal("<a x='1<2'/>"), "a.xml:1:8: \"<\" in the value of attribute \"x\"; write \"&lt;\"");
  EXPECT_EQ(refusal("<a>&nbsp;</a>"),
            "a.xml:1:4: entity \"&nbsp;\" is not defined; only lt, gt, amp, quot and apos are");
  EXPECT_EQ(refusal("<a>a & b</a>"), "a.xml:1:6: a bare \"&\"; write \"&amp;\"");
  EXPECT_EQ(refusal("<q:a/>"), "a.xml:1:2: prefix \"q\" is not declared; add xmlns:q=\"…\"");
  EXPECT_EQ(refusal("<a>\x01</a>"), "a.xml:1:4: control character 1 is not allowed in XML");
  EXPECT_EQ(refusal("<a>\xC0\x80</a>"),
            "a.xml:1:4: not UTF-8; convert the file, for example with iconv -f ISO-8859-1 -t UTF-8");
  EXPECT_EQ(refusal("<a b/>"), "a.xml:1:4: attribute \"b\" has no value");
  EXPECT_EQ(refusal("<a b=1/>"), "a.xml:1:6: the value of attribute \"b\" is not in quotes");
  EXPECT_EQ(refusal("<a>&#0;</a>"), "a.xml:1:4: character reference \"&#0;\" names no character of XML");
}

TEST(XmlDocument, DefinesNoEntities) {
  EXPECT_EQ(
      refusal("<!DOCTYPE a [<!ENTITY l 'lol'><!ENTITY m '&l;&l;&l;'>]><a>&m;</a>"),
      "a.xml:1:59: entity \"&m;\" is not defined; only lt, gt, amp, quot and apos are, for what a DOCTYPE defines is "
      "not read: write the text itself");
}

TEST(XmlDocument, BoundsNesting) {
  const auto nested = [](int depth) {
    std::string xml;
    for (int i = 0; i < depth; ++i) xml += "<a>";
    for (int i = 0; i < depth; ++i) xml += "</a>";
    return xml;
  };
  EXPECT_EQ(refusal(nested(kXmlNestingMax)), "accepted");
  EXPECT_EQ(refusal(nested(kXmlNestingMax + 1)), "a.xml:1:3001: elements nested deeper than 1000 levels");
}

TEST(XmlDocument, IsLenientOnRequest) {
  const auto document = parse("<a x='1 < 2 && y' b:c=''/>", {.lenient = true});
  EXPECT_EQ(document.root().attribute("x"), "1 < 2 && y");
  EXPECT_EQ(document.warnings().size(), 4U);
}

TEST(XmlEdit, ChangesOnePlace) {
  const auto document = parse("<a>\n  <!-- keep -->\n  <b  x='1'   y=\"2\"/>\n</a>\n");
  const XmlElement b = document.root().first_child();
  XmlEdit edit(document);
  edit.set_attribute(b, "x", "it's <");
  edit.set_attribute(b, "z", "3");
  edit.remove_attribute(b, "y");
  EXPECT_EQ(*edit.apply(), "<a>\n  <!-- keep -->\n  <b  x='it&apos;s &lt;' z=\"3\"/>\n</a>\n");
  edit.replace(b, "<c/>");
  const auto overlapping = edit.apply();
  ASSERT_FALSE(overlapping);
  EXPECT_EQ(overlapping.error().code, "xml.overlapping-edits");

  XmlEdit two(document);
  two.set_attribute(b, "x", "it's <");
  two.set_attribute(b, "z", "\"3\"");
  two.append_child(b, "<c/>");
  EXPECT_EQ(*two.apply(),
            "<a>\n  <!-- keep -->\n  <b  x='it&apos;s &lt;'   y=\"2\" z=\"&quot;3&quot;\">\n    <c/>\n  </b>\n</a>\n");
}

TEST(XmlEdit, AddsAndRemovesElements) {
  const auto document = parse("<a>\n  <b/>\n  <c/>\n</a>");
  const auto children = document.root().children();
  XmlEdit edit(document);
  edit.insert_before(children[0], "<first/>");
  edit.remove(children[1]);
  EXPECT_EQ(*edit.apply(), "<a>\n  <first/>\n  <b/>\n</a>");
  XmlEdit append(document);
  append.append_child(document.root(), "<d/>");
  EXPECT_EQ(*append.apply(), "<a>\n  <b/>\n  <c/>\n  <d/>\n</a>");
}

TEST(XmlEdit, OfNothingIsTheSource) {
  const std::string source = "<?xml version='1.0'?><a  b = '1'><!-- x --></a >\r\n";
  EXPECT_EQ(*XmlEdit(parse(source)).apply(), source);
}

TEST(Xml, CountsTheElementsInsideAnElement) {
  const auto document = XmlDocument::parse("<a><b><c/>text</b><!-- <x/> --><d/></a>");
  EXPECT_EQ(document->root().size(), 4U);
  EXPECT_EQ(document->root().first_child().size(), 2U);
  EXPECT_EQ(document->root().first_child().next_sibling().size(), 1U);
}

TEST(Xml, ReadsManyBareAmpersandsInLinearTime) {
  // Each is followed by megabytes without the ';' that would end a reference: quadratic time would be minutes.
  const std::string far(8U << 20U, ' ');
  const std::string source = "<a b=\"" + std::string(kXmlWarningsMax, '&') + far + "\"/>";
  const auto document = XmlDocument::parse(source, {}, {.lenient = true});
  ASSERT_TRUE(document.has_value());
  EXPECT_EQ(document->warnings().size(), kXmlWarningsMax);
  EXPECT_FALSE(XmlDocument::parse("<a b=\"" + std::string(kXmlWarningsMax + 1, '&') + "\"/>", {}, {.lenient = true}));
}

TEST(Xml, FindsControlCharactersAndBrokenUtf8AnywhereInAWord) {
  for (std::size_t at = 0; at < 20; ++at) {
    std::string source = "<a b=\"01234567890123456789\"/>";
    source[6 + at] = '\x01';
    EXPECT_FALSE(XmlDocument::parse(source).has_value()) << at;
    source[6 + at] = '\xFF';
    EXPECT_FALSE(XmlDocument::parse(source).has_value()) << at;
    source[6 + at] = '\t';
    EXPECT_TRUE(XmlDocument::parse(source).has_value()) << at;
  }
}

TEST(XmlDocument, BoundsTheAttributesOfAnElement) {
  const auto with = [](std::size_t count) {
    std::string source = "<a";
    for (std::size_t i = 0; i < count; ++i) source += " a" + std::to_string(i) + "=''";
    return source;
  };
  EXPECT_EQ(refusal(with(kXmlAttributesMax) + "/>"), "accepted");
  EXPECT_EQ(refusal(with(kXmlAttributesMax) + " b=''/>"), "a.xml:1:7894: more than 1000 attributes of one element");
  EXPECT_EQ(refusal(with(20) + " a7=''/>"), "a.xml:1:134: attribute \"a7\" stands twice");
}

TEST(XmlDocument, IsNoneWithoutARootElement) {
  EXPECT_EQ(refusal(""), "a.xml:1:1: there is no root element");
  EXPECT_EQ(refusal("<!-- c -->"), "a.xml:1:11: there is no root element");
  EXPECT_EQ(refusal("x<a/>"), "a.xml:1:1: expected an element, found text");
  EXPECT_EQ(refusal("\n<![CDATA[x]]>"), "a.xml:2:1: expected an element, found a CDATA section");
  EXPECT_EQ(refusal("<![CDATA[x]]><a/>"), "a.xml:1:1: expected an element, found a CDATA section");
}

TEST(XmlDocument, ChecksPrefixes) {
  EXPECT_EQ(refusal("<a xmlns:p='u' xmlns:q='u' p:x='' q:x=''/>"),
            "a.xml:1:35: attribute \"q:x\" stands twice, under another prefix");
  EXPECT_EQ(refusal("<a xmlns:p='u'><b xmlns:p='v'/><p:c/></a>"), "accepted");
  EXPECT_EQ(refusal("<a><b xmlns:p='v'/><p:c/></a>"), "a.xml:1:21: prefix \"p\" is not declared; add xmlns:p=\"…\"");
  EXPECT_EQ(refusal("<a xmlns:p=''/>"), "a.xml:1:4: prefix \"p\" cannot be declared as \"\"");
  EXPECT_EQ(refusal("<a xmlns='http://www.w3.org/XML/1998/namespace'/>"),
            "a.xml:1:4: \"http://www.w3.org/XML/1998/namespace\" cannot be the default namespace");
  EXPECT_EQ(refusal("<a xmlns:p='u' p:b:c=''/>"), "a.xml:1:16: \"p:b:c\" is no name with a prefix");
}

TEST(XmlDocument, ChecksDeclarationAndInstructions) {
  EXPECT_EQ(refusal("<?xml version='1.0' encoding='utf-8' standalone='yes' ?><a/>"), "accepted");
  EXPECT_EQ(refusal("<?xml version='1.0' encoding='Shift_JIS'?><a/>"),
            "a.xml:1:31: of encodings UTF-8, UTF-16, ISO-8859-1 and Windows-1252 are read; convert the file (iconv -f "
            "Shift_JIS -t UTF-8) and write encoding=\"UTF-8\" here");
  const std::string form =
      "a.xml:1:1: the XML declaration is not of the form <?xml version=\"1.0\" encoding=\"UTF-8\"?>";
  EXPECT_EQ(refusal("<?xml encoding='utf-8'?><a/>"), form);
  EXPECT_EQ(refusal("<?xml version='1.\xC3\xA9'?><a/>"), form);
  EXPECT_EQ(refusal("<?xml version='1.0' standalone='maybe'?><a/>"), form);
  EXPECT_EQ(parse("<?xml encoding='utf-8'?><a/>", {.lenient = true}).warnings().size(), 1U);
  EXPECT_EQ(refusal("<?go+?><a/>"), "a.xml:1:5: white space is missing behind the name of the processing instruction");
  EXPECT_EQ(refusal("<?XML x?><a/>"), "a.xml:1:1: the name \"XML\" is reserved");
  EXPECT_EQ(refusal("<a>\xEF\xBF\xBF</a>"), "a.xml:1:4: U+FFFE and U+FFFF are no characters of XML");
}

}  // namespace
}  // namespace sentree::text
