#include "sentree/text/rewrite.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

#include "sentree/base/temporary_folder.h"
#include "sentree/text/file.h"

namespace sentree::text {
namespace {

TEST(RewriteFile, KeepsEncodingAndPermissions) {
  const TemporaryFolder folder("rewrite");
  const auto file = folder.path() / "a.xml";
  const std::string head = "<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?>\n";
  ASSERT_TRUE(write_file(file, head + "<a n=\"\xE4\"/>"));
  std::filesystem::permissions(file, std::filesystem::perms(0640));
  std::string text = *read_file(file);
  ASSERT_TRUE(rewrite_file(file, text.replace(text.find("<a "), 2, "<b")));
  std::ifstream in(file, std::ios::binary);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), head + "<b n=\"\xE4\"/>");
  EXPECT_EQ(std::filesystem::status(file).permissions(), std::filesystem::perms(0640));
  EXPECT_EQ(rewrite_file(file, text + "<!-- \xE2\x86\x92 -->").error().code, "file.encoding");
  EXPECT_EQ(*read_file(file), text);
}

TEST(RewriteFile, LeavesWhatIsReadOnly) {
  const TemporaryFolder folder("rewrite");
  const auto file = folder.path() / "a.xml";
  ASSERT_TRUE(write_file(file, "<a/>"));
  std::filesystem::permissions(file, std::filesystem::perms(0444));
  EXPECT_EQ(rewrite_file(file, "<b/>").error().code, "file.read-only");
  EXPECT_EQ(*read_file(file), "<a/>");
}

}  // namespace
}  // namespace sentree::text
