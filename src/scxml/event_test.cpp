#include "sentree/scxml/event.h"

#include <gtest/gtest.h>

namespace sentree::scxml {
namespace {

TEST(EventDescriptor, MatchesWholeTokensOnly) {
  EXPECT_TRUE(event_matches("foo", "foo"));
  EXPECT_TRUE(event_matches("foo", "foo.bar"));
  EXPECT_FALSE(event_matches("foo", "foobar"));
  EXPECT_FALSE(event_matches("foo.bar", "foo"));
  EXPECT_FALSE(event_matches("foo", "Foo"));
}

TEST(EventDescriptor, ToleratesATrailingWildcard) {
  EXPECT_TRUE(event_matches("foo.*", "foo"));
  EXPECT_TRUE(event_matches("foo.*", "foo.bar.baz"));
  EXPECT_TRUE(event_matches("foo.", "foo.bar"));
  EXPECT_FALSE(event_matches("foo.*", "food.bar"));
  EXPECT_TRUE(event_matches("*", "anything.at.all"));
}

}  // namespace
}  // namespace sentree::scxml
