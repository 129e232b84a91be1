#include "sentree/studio/verified.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "sentree/base/temporary_folder.h"

namespace sentree::studio {
namespace {

using testing::HasSubstr;

class VerifiedFile : public ::testing::Test {
 protected:
  VerifiedFile() { write("mission.xml", "<root/>"); }

  void write(const std::string& name, const std::string& text) {
    std::filesystem::create_directories((folder_.path() / name).parent_path());
    ASSERT_TRUE(text::write_file(folder_.path() / name, text));
  }
  std::filesystem::path file() const { return folder_.path() / "verify" / kVerifiedFile; }
  void verify() {
    const text::ReadLog read;
    ASSERT_TRUE(text::read_file(folder_.path() / "mission.xml"));
    const Verified verified{.coverage = {}, .complete = true, .complete_to_tick = 7, .states = 12};
    write("verify/reached.json", verified_text(verified, folder_.path(), file().parent_path(), read.files()));
  }

  TemporaryFolder folder_{"verified"};
};

TEST_F(VerifiedFile, IsReadAsItWasWritten) {
  verify();
  const auto told = read_verified(file());
  ASSERT_TRUE(told) << to_string(told.error());
  EXPECT_EQ(to_json(*told->find("verification")), R"({"complete":true,"tick":7,"states":12,"changed":[]})");
  EXPECT_EQ(told->find("kinds")->as_list()->size(), 6U);
}

TEST_F(VerifiedFile, SaysWhichTextsAreOthersNow) {
  verify();
  const auto changed = [&](const auto& text_of) {
    return to_json(*read_verified(file(), text_of)->find("verification")->find("changed"));
  };
  // One is edited and not saved.
  EXPECT_EQ(changed([](const std::string&) { return std::optional<std::string>("<root />"); }), R"(["mission.xml"])");
  const auto none = [](const std::string&) { return std::optional<std::string>(); };
  EXPECT_EQ(changed(none), "[]");
  write("mission.xml", "<root></root>");
  EXPECT_EQ(changed(none), R"(["mission.xml"])");
  std::filesystem::remove(folder_.path() / "mission.xml");
  EXPECT_EQ(changed(none), R"(["mission.xml"])");
}

TEST_F(VerifiedFile, IsNothingWhereNobodyHasVerified) { EXPECT_TRUE(read_verified(file())->is_null()); }

TEST_F(VerifiedFile, OfAnotherFormIsRefused) {
  verify();
  const std::string right = *text::read_file(file());
  for (const auto& [from, to] :
       std::vector<std::pair<std::string, std::string>>{{"\"kinds\":[", "\"kinds\":[7,"},
                                                        {"\"complete\":true", "\"complete\":1"},
                                                        {"\"states\":12", "\"states\":-1"},
                                                        {"\"not_reached\"", "\"reached\""}}) {
    std::string wrong = right;
    ASSERT_NE(wrong.find(from), std::string::npos) << from;
    wrong.replace(wrong.find(from), from.size(), to);
    write("verify/reached.json", wrong);
    const auto told = read_verified(file());
    ASSERT_FALSE(told) << to;
    EXPECT_EQ(told.error().code, "studio.verified");
    EXPECT_THAT(to_string(told.error()), HasSubstr("reached.json"));
  }
  write("verify/reached.json", "{");
  EXPECT_EQ(read_verified(file()).error().code, "json.syntax");
}

}  // namespace
}  // namespace sentree::studio
