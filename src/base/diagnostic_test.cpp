#include "sentree/base/diagnostic.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/base/result.h"

namespace sentree {
namespace {

Diagnostic at(std::string file, int line, int column, std::string message = "m") {
  return {Severity::kError, "test.code", std::move(message), {std::move(file), line, column, 0}};
}

TEST(Diagnostic, SaysThePlaceAsFarAsItIsKnown) {
  EXPECT_EQ(to_string(at("a.xml", 14, 7)), "a.xml:14:7: m");
  EXPECT_EQ(to_string(at("a.xml", 14, 0)), "a.xml:14: m");
  EXPECT_EQ(to_string(at("a.xml", 0, 0)), "a.xml: m");
  EXPECT_EQ(to_string(at("", 3, 4)), "line 3:4: m");
  EXPECT_EQ(to_string(at("", 0, 0)), "m");
}

TEST(Diagnostic, MarksWhatIsNoError) {
  Diagnostic finding = at("a.xml", 1, 2);
  finding.severity = Severity::kWarning;
  EXPECT_EQ(to_string(finding), "a.xml:1:2: warning: m");
  finding.severity = Severity::kNote;
  EXPECT_EQ(to_string(finding), "a.xml:1:2: note: m");
}

TEST(Diagnostics, HaveErrorsOnlyIfOneIs) {
  Diagnostics findings;
  EXPECT_FALSE(has_errors(findings));
  findings.push_back(at("a", 1, 1));
  findings.back().severity = Severity::kWarning;
  EXPECT_FALSE(has_errors(findings));
  findings.push_back(at("a", 1, 1));
  EXPECT_TRUE(has_errors(findings));
}

TEST(Diagnostics, SortByPlaceAndKeepTheOrderWithinOne) {
  Diagnostics findings = {at("b", 1, 1), at("a", 2, 1, "first"), at("a", 10, 1), at("a", 2, 1, "second"),
                          at("a", 2, 0)};
  sort_by_place(findings);
  std::vector<std::string> texts;
  for (const Diagnostic& finding : findings) texts.push_back(to_string(finding));
  EXPECT_THAT(texts, ::testing::ElementsAre("a:2: m", "a:2:1: first", "a:2:1: second", "a:10:1: m", "b:1:1: m"));
}

TEST(DidYouMean, FindsSlipsOfTheFinger) {
  const std::vector<std::string> names = {"open", "closed", "GoToLocation", "WaitForUser"};
  EXPECT_EQ(did_you_mean("opne", names), "; did you mean \"open\"?");
  EXPECT_EQ(did_you_mean("OPEN", names), "; did you mean \"open\"?");
  EXPECT_EQ(did_you_mean("gotolocation", names), "; did you mean \"GoToLocation\"?");
  EXPECT_EQ(did_you_mean("WaitForUsr", names), "; did you mean \"WaitForUser\"?");
}

TEST(DidYouMean, FindsTheWholeNameOfALastPart) {
  const std::vector<std::string> names{"FetchCup.Grasp", "FetchPot.Grasp", "FetchPot.Regrasp", "Fetch.Go.To"};
  EXPECT_EQ(did_you_mean("Grasp", names), "; did you mean \"FetchCup.Grasp\" or \"FetchPot.Grasp\"?");
  EXPECT_EQ(did_you_mean("Go.To", names), "; did you mean \"Fetch.Go.To\"?");
  EXPECT_EQ(did_you_mean("Fetch.Go.To", names), "");
  const std::vector<std::string> many{"a.go", "b.go", "c.go", "d.go"};
  EXPECT_EQ(did_you_mean("go", many), "");
}

TEST(DidYouMean, KeepsSilentWhenNothingIsNear) {
  const std::vector<std::string> names = {"open", "", std::string(100, 'x'), "b"};
  EXPECT_EQ(did_you_mean("kitchen", names), "");
  EXPECT_EQ(did_you_mean("", names), "");
  EXPECT_EQ(did_you_mean("a", names), "");  // every other letter is one edit away
  EXPECT_EQ(did_you_mean("B", names), "; did you mean \"b\"?");
  EXPECT_EQ(did_you_mean(std::string(99, 'x'), names), "");  // the bound on length
}

TEST(DidYouMean, TakesTheFirstOfTheNearest) {
  const std::vector<std::string> names = {"left", "lift", "lefty"};
  EXPECT_EQ(closest("leff", names), "left");
  EXPECT_EQ(closest("lifty", names), "lift");
}

TEST(Result, HoldsAValueOrAFailure) {
  const Result<int> good = 3;
  EXPECT_EQ(good.value(), 3);
  const Result<int> bad = fail("test.code", "no \"x\"", {"f", 1, 2, 0});
  ASSERT_FALSE(bad.has_value());
  EXPECT_EQ(to_string(bad.error()), "f:1:2: no \"x\"");
  EXPECT_EQ(bad.error().code, "test.code");
}

}  // namespace
}  // namespace sentree
