#include "sentree/import/detail/snippet.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/text/xml.h"

namespace sentree::import {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class SnippetTest : public ::testing::Test {
 protected:
  SnippetTest() {
    schema_ = idl::Schema::load(
                  "enum Mode { SLOW, FAST } service Arm { bool lift(1: double height, 2: Mode mode); void drop(); }",
                  "arm.thrift")
                  .value;
    names_.remotes["arm"] = {"ArmComponent", schema_->service("Arm")};
    names_.enumerators = {"SLOW", "FAST"};
    names_.data = {"height", "count", "name"};
    names_.integers = {"count"};
  }

  std::string translated(const std::string& source) {
    snippet_ = translate_snippet(source, {"chart.scxml", 10, 5, 0}, names_);
    std::string text;
    for (const Piece& piece : snippet_.pieces) {
      text += piece.xml;
      if (piece.call) text += "[" + piece.result + "=" + piece.call->service + "." + piece.call->method + "]\n";
    }
    return text;
  }

  std::optional<idl::Schema> schema_;
  Names names_;
  Snippet snippet_;
};

TEST_F(SnippetTest, CallsTakeTheNamesOfTheirArgumentsFromTheInterface) {
  EXPECT_EQ(translated("arm.drop();"), "<send type=\"thrift\" target=\"ArmComponent\" event=\"drop\"/>\n");
  EXPECT_EQ(translated("bool up = arm->lift(height + 0.5f, Mode::FAST); name = up ? \"up\" : \"down\";"),
            "[up=ArmComponent.lift]\n<assign location=\"name\" expr=\"up ? 'up' : 'down'\"/>\n");
  EXPECT_EQ(snippet_.pieces[0].call->arguments[0], std::pair(std::string("height"), std::string("height + 0.5")));
  EXPECT_EQ(snippet_.pieces[0].call->arguments[1], std::pair(std::string("mode"), std::string("'FAST'")));
  EXPECT_THAT(snippet_.new_data, ::testing::ElementsAre("up"));
  EXPECT_THAT(snippet_.findings, IsEmpty());
}

TEST_F(SnippetTest, ACallInAConditionIsMadeBeforeIt) {
  EXPECT_EQ(
      translated("if (!arm.lift(1.0, SLOW)) { count++; }"),
      "[lift_result=ArmComponent.lift]\n<if cond=\"!lift_result\">\n<assign location=\"count\" expr=\"count + 1\"/>\n"
      "</if>\n");
}

TEST_F(SnippetTest, EventsAreRaisedTimersSendThem) {
  EXPECT_EQ(translated("stateMachine()->submitEvent(\"GO\");"), "<raise event=\"GO\"/>\n");
  EXPECT_EQ(translated("QTimer::singleShot(0, stateMachine(), [&](){ stateMachine()->submitEvent(\"GO\"); });"),
            "<send event=\"GO\"/>\n");
  EXPECT_EQ(translated("QTimer::singleShot(std::chrono::seconds(2), [this] { submitEvent(\"GO\"); });"),
            "<send event=\"GO\" delay=\"2s\"/>\n");
}

TEST_F(SnippetTest, WhatItCannotSayStaysAndNamesItsLine) {
  const std::string text = translated("count = 1;\n\nwhile (count < 3) {\n  count++;\n}\nmyHelper(count--);");
  EXPECT_THAT(text, HasSubstr("<!-- not translated, see IMPORT.md: while (count < 3) {\n  count++;\n} -->"));
  // No two hyphens in a comment.
  EXPECT_THAT(text, HasSubstr("myHelper(count- -);"));
  ASSERT_THAT(snippet_.findings, SizeIs(2));
  EXPECT_EQ(snippet_.findings[0].span.line, 12);
  EXPECT_EQ(snippet_.findings[1].span.line, 15);
}

TEST_F(SnippetTest, RefusesWhatWouldMeanSomethingElse) {
  for (const char* source : {
           "if (count > 0) { bool up = arm.lift(1.0, SLOW); }",         // the rest would not wait
           "bool up = count > 0 && arm.lift(1.0, SLOW);",               // called only sometimes
           "arm.lift(1.0);",                                            // an argument is missing
           "arm.fly();",                                                // no such method
           "switch (count) { case 1: count = 2; case 2: count = 3; }",  // falls through
           "QTimer::singleShot(10, ctx, [=]() { count = 2; });",        // later, and no event
           "count = undeclared;",
       }) {
    translated(source);
    ASSERT_THAT(snippet_.findings, SizeIs(1)) << source;
    EXPECT_EQ(snippet_.findings[0].fate, Fate::kByHand) << source;
    EXPECT_EQ(snippet_.findings[0].original, source);
    EXPECT_THAT(snippet_.pieces, SizeIs(1)) << source;
  }
}

TEST_F(SnippetTest, SaysWhereIntegersAreDivided) {
  EXPECT_THAT(translated("count = count / 2;"), HasSubstr("expr=\"count / 2\""));
  ASSERT_THAT(snippet_.findings, SizeIs(1));
  EXPECT_EQ(snippet_.findings[0].fate, Fate::kReview);
  EXPECT_THAT(translated("height = height / 2.0;"), HasSubstr("height / 2.0"));
  EXPECT_THAT(snippet_.findings, IsEmpty());
}

TEST_F(SnippetTest, BoundsTheNestingOfStatements) {
  std::string deep;
  for (int i = 0; i < 10'000; ++i) deep += "if (count) {";
  EXPECT_THAT(translated(deep + std::string(10'000, '}')), HasSubstr("not translated"));
}

// Whatever the bytes are: it ends, and what it writes can stand in a chart.
TEST_F(SnippetTest, WritesWellFormedXmlForAnyInput) {
  const std::string seed_text =
      "x = arm.lift(height, FAST); if (x) { submitEvent(\"A\"); } else switch (count) { case 1: break; default: "
      "arm.drop(); } "
      "QTimer::singleShot(5, a, [=](){ submitEvent(\"B\"); }); qDebug() << \"t\" << name; /* c */ e->setName(\"--\");";
  std::uint64_t state = 20'260'101;
  SCOPED_TRACE("seed 20260101");
  for (int round = 0; round < 3'000; ++round) {
    std::string source = seed_text;
    for (int change = 0; change < 6; ++change) {
      state = state * 6'364'136'223'846'793'005ULL + 1'442'695'040'888'963'407ULL;
      const std::size_t at = (state >> 33U) % source.size();
      if ((state >> 20U) % 2 == 0) {
        source.erase(at, 1 + (state >> 50U) % 7);
      } else {
        source.insert(at, std::string(1, "(){}[];,?:<>=&\"'-/.*"[(state >> 40U) % 20]));
      }
      if (source.empty()) source = "x";
    }
    const std::string text = "<a>" + translated(source) + "</a>";
    const auto document = text::XmlDocument::parse(text, "snippet");
    ASSERT_TRUE(document) << source << "\n" << text << "\n" << to_string(document.error());
  }
}

}  // namespace
}  // namespace sentree::import
