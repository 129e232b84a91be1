#include "sentree/design/workspace.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <random>
#include <set>

#include "sentree/base/temporary_folder.h"
#include "sentree/text/file.h"

namespace sentree::design {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::Pair;

class WorkspaceTest : public testing::Test {
 protected:
  WorkspaceTest() {
    write("sentree.yaml", "mission: {file: mission.xml}\n");
    write("mission.xml", "<root>\n  <a/>\n  <b/>\n  <c/>\n  <d/>\n</root>\n");
  }
  void write(const std::string& file, const std::string& text) {
    fs::create_directories((folder_.path() / file).parent_path());
    std::ofstream(folder_.path() / file, std::ios::binary) << text;
  }
  std::string read(const std::string& file) { return text::read_file(folder_.path() / file).value_or("(none)"); }
  std::string bytes(const std::string& file) {
    std::ifstream stream(folder_.path() / file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  Workspace open() { return Workspace::open(folder_.path()).value(); }
  static void replace(Workspace& workspace, const std::string& file, const std::string& old_text,
                      const std::string& new_text, bool join = false) {
    const Document* document = workspace.find(file);
    const std::size_t at = document->text.find(old_text);
    ASSERT_NE(at, std::string::npos);
    const auto edited = workspace.edit(file, document->version, {{at, at + old_text.size(), new_text}}, "type", join);
    ASSERT_TRUE(edited) << edited.error().message;
  }
  TemporaryFolder folder_{"workspace"};
};

TEST_F(WorkspaceTest, HasTheTextsAndNothingElse) {
  write("runs/old.xml", "");
  write(".hidden/x.xml", "");
  write("skills/A.scxml", "<scxml/>");
  write("picture.png", "");
  write("latin.xml", "\xE4");
  fs::create_symlink("/etc/hostname", folder_.path() / "link.xml");
  std::vector<std::string> files;
  const Workspace workspace = open();
  for (const auto& [file, document] : workspace.documents()) files.push_back(file);
  EXPECT_THAT(files, ElementsAre("mission.xml", "sentree.yaml", "skills/A.scxml"));
}

TEST_F(WorkspaceTest, UndoesOverFilesToIdenticalBytes) {
  const std::string bom = "\xEF\xBB\xBF<root>\r\n  <a/>\r\n</root>";
  write("mission.xml", bom);
  Workspace workspace = open();
  replace(workspace, "mission.xml", "<a/>", "<ä/>");
  replace(workspace, "sentree.yaml", "mission", "MISSION");
  ASSERT_TRUE(workspace.put({{"skills/A.scxml", "<scxml/>\n"}, {"sentree.yaml", "other\n"}}, "add"));
  EXPECT_EQ(read("skills/A.scxml"), "<scxml/>\n");
  EXPECT_TRUE(workspace.find("mission.xml")->is_dirty());
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(workspace.undo());
  EXPECT_EQ(workspace.find("mission.xml")->text, bom);
  EXPECT_FALSE(workspace.find("mission.xml")->is_dirty());
  EXPECT_EQ(workspace.find("skills/A.scxml"), nullptr);
  EXPECT_FALSE(fs::exists(folder_.path() / "skills/A.scxml"));
  EXPECT_FALSE(workspace.undo());
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(workspace.redo());
  EXPECT_EQ(workspace.find("sentree.yaml")->text, "other\n");
  EXPECT_EQ(read("skills/A.scxml"), "<scxml/>\n");
}

TEST_F(WorkspaceTest, EachUndoesWhatIsTheirs) {
  std::optional<Workspace> opened(open());
  Workspace& workspace = *opened;
  const std::string mission = workspace.find("mission.xml")->text;
  const auto text = [&] { return workspace.find("mission.xml")->text; };
  const auto as = [&](const std::string& who) { workspace.acts(who, {"one", "two"}); };
  as("one");
  replace(workspace, "mission.xml", "<a/>", "<a one='1'/>");
  as("two");
  replace(workspace, "sentree.yaml", "mission:", "mission :");
  replace(workspace, "mission.xml", "  <c/>\n", "  <c/>\n  <two/>\n");
  EXPECT_EQ(workspace.own_steps("one").undo_count, 1U);
  EXPECT_EQ(workspace.own_steps("two").undo_count, 2U);
  // What the other did since stays, and is undone to what would be there without the one.
  as("one");
  ASSERT_TRUE(workspace.undo());
  EXPECT_EQ(text(), "<root>\n  <a/>\n  <b/>\n  <c/>\n  <two/>\n  <d/>\n</root>\n");
  EXPECT_EQ(workspace.undo().error().code, "design.nothing-to-undo");
  // An edit of the other takes nothing from what one can do again.
  as("two");
  replace(workspace, "mission.xml", "<d/>", "<d two=''/>");
  as("one");
  ASSERT_TRUE(workspace.redo());
  EXPECT_EQ(text(), "<root>\n  <a one='1'/>\n  <b/>\n  <c/>\n  <two/>\n  <d two=''/>\n</root>\n");
  as("two");
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(workspace.undo()) << i;
  EXPECT_EQ(text(), "<root>\n  <a one='1'/>\n  <b/>\n  <c/>\n  <d/>\n</root>\n");
  EXPECT_EQ(workspace.find("sentree.yaml")->text, "mission: {file: mission.xml}\n");
  EXPECT_FALSE(workspace.undo());
  // The one is gone: what it did is anybody's, also after the program has ended.
  workspace.keep_journal();
  opened.reset();
  opened.emplace(open());
  as("two");
  EXPECT_FALSE(workspace.undo());
  workspace.acts("two", {"two"});
  ASSERT_TRUE(workspace.undo());
  EXPECT_EQ(text(), mission);
}

TEST_F(WorkspaceTest, NobodyUndoesUnderWhatAnotherHasDoneSince) {
  Workspace workspace = open();
  const auto as = [&](const std::string& who) { workspace.acts(who, {"one", "two"}); };
  as("one");
  replace(workspace, "mission.xml", "<a/>", "<a n='3'/>");
  as("two");
  replace(workspace, "mission.xml", "n='3", "n='30");
  as("one");
  const std::string before = workspace.find("mission.xml")->text;
  auto undone = workspace.undo();
  ASSERT_FALSE(undone);
  EXPECT_EQ(undone.error().code, "design.covered");
  EXPECT_THAT(undone.error().message, testing::HasSubstr("another page has done since"));
  EXPECT_EQ(workspace.find("mission.xml")->text, before);
  as("two");
  ASSERT_TRUE(workspace.undo());
  as("one");
  ASSERT_TRUE(workspace.undo());
  EXPECT_FALSE(workspace.find("mission.xml")->is_dirty());
  // What was undone is not done again where another writes.
  as("two");
  replace(workspace, "mission.xml", "<a/>", "<a/><e/>");
  EXPECT_EQ(workspace.own_steps("one").redo_count, 0U);
  // A file that came is not taken away under what another wrote there.
  as("one");
  ASSERT_TRUE(workspace.put({{"skills/A.scxml", "<scxml/>\n"}}, "add"));
  as("two");
  replace(workspace, "skills/A.scxml", "<scxml/>", "<scxml />");
  as("one");
  undone = workspace.undo();
  ASSERT_FALSE(undone);
  EXPECT_EQ(undone.error().code, "design.covered");
}

TEST_F(WorkspaceTest, WhateverSeveralDoIsUndoneToIdenticalBytes) {
  const char* const given = std::getenv("SENTREE_SEED");
  const auto seed = given != nullptr ? static_cast<unsigned>(std::stoul(given)) : std::random_device()();
  SCOPED_TRACE("SENTREE_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  const auto draw = [&](std::size_t bound) { return static_cast<std::size_t>(random() % bound); };
  std::string lines;
  for (int i = 0; i < 40; ++i) lines += "line " + std::to_string(i) + "\n";
  write("mission.xml", lines);
  const std::set<std::string> pages{"one", "two", "three"};
  const auto texts_of = [](const Workspace& workspace) {
    std::map<std::string, std::string> texts;
    for (const auto& [name, document] : workspace.documents()) texts[name] = document.text;
    return texts;
  };
  Workspace workspace = open();
  const auto original = texts_of(workspace);
  std::map<std::string, int> refused;
  int lifted = 0;
  for (int i = 0; i < 600; ++i) {
    const std::string who = *std::next(pages.begin(), static_cast<std::ptrdiff_t>(draw(3)));
    workspace.acts(who, pages);
    std::vector<std::string> files;
    for (const auto& [name, document] : workspace.documents()) files.push_back(name);
    const std::string& file = files[draw(files.size())];
    const Document& document = *workspace.find(file);
    const std::size_t what = draw(8);
    if (what < 4) {
      const bool undo = what < 3;
      const bool is_below = undo && !workspace.undo_steps().empty() && workspace.undo_steps().back().by != who;
      const auto done = undo ? workspace.undo() : workspace.redo();
      if (!done) ++refused[done.error().code];
      lifted += done && is_below ? 1 : 0;
    } else if (what == 4 && files.size() < 5) {
      (void)workspace.put({{"s" + std::to_string(draw(3)) + ".scxml", "a\nb\nc\n"}}, "add");
    } else {
      const std::size_t from = draw(document.text.size() + 1);
      const std::size_t to = std::min(document.text.size(), from + draw(12));
      const std::string text = draw(2) == 0 ? std::to_string(i) : "new " + std::to_string(i) + "\n";
      ASSERT_TRUE(workspace.edit(file, document.version, {{from, to, text}}, "type", draw(4) == 0));
    }
    if (draw(40) != 0) continue;
    // Nobody is there: all of it is anybody's.
    workspace.acts("", {});
    const auto now = texts_of(workspace);
    const std::size_t count = workspace.undo_steps().size();
    while (!workspace.undo_steps().empty()) {
      const auto undone = workspace.undo();
      ASSERT_TRUE(undone) << undone.error().message;
      ASSERT_TRUE(undone->left.empty()) << i;
    }
    ASSERT_EQ(texts_of(workspace), original) << i;
    for (std::size_t k = 0; k < count; ++k) ASSERT_TRUE(workspace.redo()) << i;
    ASSERT_EQ(texts_of(workspace), now) << i;
  }
  EXPECT_GT(lifted, 20);
  EXPECT_EQ(refused["design.not-as-known"], 0);
  EXPECT_GT(refused["design.covered"], 0);
}

TEST_F(WorkspaceTest, AFileThatIsDeletedOrRenamedComesBackByteForByte) {
  const std::string before = "<root>\r\n  <a/>\r\n</root>";
  write("mission.xml", before);
  const std::string project = read("sentree.yaml");
  Workspace workspace = open();
  ASSERT_TRUE(workspace.rename("mission.xml", "trees/main.xml", {{"sentree.yaml", "file: trees/main.xml\n"}}));
  EXPECT_EQ(read("mission.xml") + read("trees/main.xml"), "(none)" + before);
  EXPECT_EQ(workspace.undo_steps().size(), 1U);
  EXPECT_TRUE(workspace.refresh({""}).empty());
  ASSERT_TRUE(workspace.remove("trees/main.xml"));
  EXPECT_EQ(read("trees/main.xml"), "(none)");
  ASSERT_TRUE(workspace.undo());
  EXPECT_EQ(read("trees/main.xml"), before);
  ASSERT_TRUE(workspace.undo());
  EXPECT_EQ(read("mission.xml") + read("trees/main.xml"), before + "(none)");
  EXPECT_EQ(workspace.find("sentree.yaml")->text, project);
  ASSERT_TRUE(workspace.redo());
  EXPECT_EQ(read("mission.xml") + read("trees/main.xml"), "(none)" + before);
  EXPECT_EQ(workspace.find("sentree.yaml")->text, "file: trees/main.xml\n");
}

TEST_F(WorkspaceTest, WhatNamesAFileIsSavedWhenItGoes) {
  write("notes.yaml", "a: 1\n");
  const std::string project = read("sentree.yaml");
  const std::string mission = read("mission.xml");
  Workspace workspace = open();
  const auto project_on_disk = [&] { return read("sentree.yaml") + read("mission.xml") + read("main.xml"); };
  replace(workspace, "notes.yaml", "1", "2");
  // What somebody has taken out, and not saved, is on disk still.
  write("more.yaml", "# mission, main_loop\n");
  workspace.refresh({""});
  replace(workspace, "more.yaml", "mission, ", "");
  const auto renamed = workspace.rename("mission.xml", "main.xml", {{"sentree.yaml", "mission: {file: main.xml}\n"}});
  ASSERT_TRUE(renamed) << renamed.error().message;
  EXPECT_THAT(*renamed, ElementsAre("more.yaml", "sentree.yaml"));
  EXPECT_EQ(project_on_disk(), "mission: {file: main.xml}\n(none)" + mission);
  EXPECT_EQ(read("notes.yaml") + read("more.yaml"), "a: 1\n# main_loop\n");
  // What another program finds there is whole, and so it is when everything is undone.
  const auto undone = workspace.undo();
  ASSERT_TRUE(undone) << undone.error().message;
  EXPECT_THAT(undone->saved, ElementsAre("sentree.yaml"));
  EXPECT_EQ(project_on_disk(), project + mission + "(none)");
  EXPECT_FALSE(workspace.find("sentree.yaml")->is_dirty());
  ASSERT_TRUE(workspace.redo());
  EXPECT_EQ(project_on_disk(), "mission: {file: main.xml}\n(none)" + mission);
  // A file that came with its entry goes with it.
  ASSERT_TRUE(workspace.put({{"a.scxml", "<a/>"}, {"sentree.yaml", "skills: {a: {}}\n"}}, "add"));
  EXPECT_EQ(read("sentree.yaml"), "mission: {file: main.xml}\n");
  ASSERT_TRUE(workspace.save("sentree.yaml"));
  ASSERT_TRUE(workspace.undo());
  EXPECT_EQ(read("a.scxml") + read("sentree.yaml"), "(none)mission: {file: main.xml}\n");
  replace(workspace, "sentree.yaml", "main", "other");
  ASSERT_TRUE(workspace.remove("main.xml"));
  EXPECT_EQ(project_on_disk(), "mission: {file: other.xml}\n(none)(none)");
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(workspace.undo()) << i;
  EXPECT_EQ(workspace.find("notes.yaml")->text, "a: 1\n");
  ASSERT_TRUE(workspace.save("sentree.yaml"));
  EXPECT_EQ(project_on_disk(), project + mission + "(none)");
  EXPECT_TRUE(workspace.refresh({""}).empty());
}

TEST_F(WorkspaceTest, NoFileGoesWhereWhatNamesItCannotBeSaved) {
  Workspace workspace = open();
  const std::string mission = read("mission.xml");
  const auto whole = [&] { return read("sentree.yaml") + read("mission.xml") + read("main.xml"); };
  const std::string before = whole();
  const auto rename = [&] {
    return workspace.rename("mission.xml", "main.xml", {{"sentree.yaml", "mission: {file: main.xml}\n"}});
  };
  chmod((folder_.path() / "sentree.yaml").c_str(), 0444);
  EXPECT_EQ(rename().error().code, "file.read-only");
  EXPECT_EQ(whole(), before);
  EXPECT_FALSE(workspace.find("sentree.yaml")->is_dirty());
  EXPECT_EQ(workspace.find("main.xml"), nullptr);
  chmod((folder_.path() / "sentree.yaml").c_str(), 0644);
  write("sentree.yaml", "# another's\n");
  EXPECT_EQ(rename().error().code, "design.conflict");
  EXPECT_EQ(whole(), "# another's\n" + mission + "(none)");
  write("sentree.yaml", "caf\xE9");
  EXPECT_EQ(rename().error().code, "design.unreadable");
  EXPECT_EQ(whole(), "caf\xE9" + mission + "(none)");
  // Of others that wait to be resolved nothing is written.
  workspace.refresh({""});
  const auto renamed = workspace.rename("mission.xml", "main.xml", {});
  ASSERT_TRUE(renamed) << renamed.error().message;
  EXPECT_EQ(bytes("sentree.yaml"), "caf\xE9");
}

TEST_F(WorkspaceTest, RefusesNamesThatAreTakenOrLeadOut) {
  Workspace workspace = open();
  write("notes.yaml", "");
  const auto code = [&](const std::string& to) { return workspace.rename("mission.xml", to, {}).error().code; };
  EXPECT_EQ(code("sentree.yaml"), "design.there-already");
  EXPECT_EQ(code("notes.yaml"), "design.there-already");
  for (const char* to :
       {"../mission.xml", "/tmp/mission.xml", "a/../../mission.xml", ".hidden.xml", "runs/a.xml", "a.txt"})
    EXPECT_EQ(code(to), "design.outside") << to;
  for (const std::string& to : {std::string("a\0b.xml", 7), std::string("a\nb.xml"), std::string("in\x7f/b.xml")}) {
    EXPECT_EQ(code(to), "design.bad-name");
    EXPECT_EQ(workspace.put({{to, "<a/>"}}, "add").error().code, "design.bad-name");
  }
  write("mission.xml", "<other/>");
  EXPECT_EQ(code("other.xml"), "design.conflict");
  EXPECT_EQ(workspace.remove("gone.xml").error().code, "design.no-such-file");
  EXPECT_EQ(read("mission.xml"), "<other/>");
}

TEST_F(WorkspaceTest, DoesAllOfAStepOrNothing) {
  Workspace workspace = open();
  const std::vector<Workspace::NewText> parts{{"mission.xml", "<root/>"}, {"a.scxml", "<a/>"}, {"in/b.scxml", "<b/>"}};
  // Nobody can make a file in what is no folder.
  write("in", "");
  const auto refused = workspace.put(parts, "add");
  EXPECT_EQ(refused.error().code, "file.unwritable");
  EXPECT_THAT(refused.error().message, testing::StartsWith("in/b.scxml cannot be written: "));
  EXPECT_EQ(read("a.scxml"), "(none)");
  EXPECT_EQ(workspace.find("a.scxml"), nullptr);
  EXPECT_FALSE(workspace.find("mission.xml")->is_dirty());
  EXPECT_TRUE(workspace.undo_steps().empty());

  fs::remove(folder_.path() / "in");
  ASSERT_TRUE(workspace.put(parts, "add"));
  ASSERT_TRUE(workspace.undo());
  EXPECT_EQ(read("a.scxml") + read("in/b.scxml"), "(none)(none)");
  fs::remove(folder_.path() / "in");
  write("in", "");
  EXPECT_EQ(workspace.redo().error().code, "file.unwritable");
  EXPECT_EQ(read("a.scxml"), "(none)");
  EXPECT_FALSE(workspace.find("mission.xml")->is_dirty());

  fs::remove(folder_.path() / "in");
  ASSERT_TRUE(workspace.redo());
  EXPECT_EQ(read("a.scxml") + read("in/b.scxml"), "<a/><b/>");
}

TEST_F(WorkspaceTest, UndoLeavesWhatItsStepDoesNotKnow) {
  Workspace workspace = open();
  // What is no text stands in a new file's way, and in the way of one that is undone.
  write("b.scxml", "caf\xE9");
  EXPECT_EQ(workspace.put({{"b.scxml", "<b/>"}}, "add").error().code, "design.there-already");
  fs::remove(folder_.path() / "b.scxml");
  ASSERT_TRUE(workspace.put({{"mission.xml", "<root/>"}, {"a.scxml", "<a/>"}, {"b.scxml", "<b/>"}}, "add"));
  fs::remove(folder_.path() / "b.scxml");
  fs::create_directory(folder_.path() / "b.scxml");
  const auto undone = workspace.undo();
  ASSERT_TRUE(undone) << undone.error().message;
  EXPECT_THAT(undone->files, ElementsAre("mission.xml", "a.scxml"));
  EXPECT_THAT(undone->left, ElementsAre("b.scxml"));
  EXPECT_EQ(read("a.scxml"), "(none)");
  EXPECT_TRUE(fs::is_directory(folder_.path() / "b.scxml"));
  EXPECT_FALSE(workspace.find("mission.xml")->is_dirty());

  // What we have written ourselves may go: the steps have it.
  ASSERT_TRUE(workspace.put({{"c.scxml", "<c/>"}}, "add"));
  replace(workspace, "c.scxml", "<c/>", "<cc/>");
  ASSERT_TRUE(workspace.save("c.scxml"));
  ASSERT_TRUE(workspace.undo());
  ASSERT_TRUE(workspace.undo());
  EXPECT_EQ(read("c.scxml"), "(none)");
  ASSERT_TRUE(workspace.redo());
  ASSERT_TRUE(workspace.redo());
  EXPECT_EQ(workspace.find("c.scxml")->text, "<cc/>");
}

// Another branch is checked out, and the one before again; then another editor goes on with a file that came back.
TEST_F(WorkspaceTest, DoingAgainNeverTakesAwayWhatCameBackAsAnother) {
  write("skills/A.scxml", "<scxml/>\n");
  write("more.yaml", "a: 1\n");
  Workspace workspace = open();
  replace(workspace, "mission.xml", "<c/>", "<first/>");
  fs::remove(folder_.path() / "skills/A.scxml");
  write("more.yaml", "a: 2\n");
  workspace.refresh({"skills/A.scxml", "more.yaml"});
  write("skills/A.scxml", "<scxml/>\n");
  write("more.yaml", "a: 1\n");
  workspace.refresh({"skills/A.scxml", "more.yaml"});
  const std::string theirs = "<scxml/>\n<!-- another's work -->\n";
  write("skills/A.scxml", theirs);
  workspace.refresh({"skills/A.scxml"});
  ASSERT_EQ(workspace.undo_steps().size(), 4U);
  while (!workspace.undo_steps().empty()) ASSERT_TRUE(workspace.undo());
  EXPECT_EQ(read("skills/A.scxml"), theirs);
  // The step is done as far as it is known.
  ASSERT_TRUE(workspace.redo());
  const auto again = workspace.redo();
  ASSERT_TRUE(again);
  EXPECT_THAT(again->left, ElementsAre("skills/A.scxml"));
  EXPECT_EQ(workspace.find("more.yaml")->text, "a: 2\n");
  EXPECT_EQ(read("skills/A.scxml"), theirs);
  while (!workspace.redo_steps().empty()) ASSERT_TRUE(workspace.redo());
  EXPECT_EQ(workspace.find("skills/A.scxml")->text, theirs);

  // A step of which nothing is as it was does not stand before those behind it.
  fs::remove(folder_.path() / "more.yaml");
  workspace.refresh({"more.yaml"});
  write("more.yaml", "another: 1\n");
  workspace.refresh({"more.yaml"});
  const auto refused = workspace.undo();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "design.not-as-known");
  EXPECT_THAT(refused.error().message, testing::HasSubstr("\"more.yaml deleted on disk\" cannot be undone"));
  EXPECT_EQ(workspace.find("more.yaml")->text, "another: 1\n");
  ASSERT_TRUE(workspace.undo());
}

TEST_F(WorkspaceTest, AFileStaysInItsEncoding) {
  const std::string latin = "<?xml version='1.0' encoding='ISO-8859-1'?>\r\n<root>\r\n  <a b='caf\xE9'/>\r\n</root>";
  write("mission.xml", latin);
  Workspace workspace = open();
  replace(workspace, "mission.xml", "<a ", "<A ");
  ASSERT_TRUE(workspace.save("mission.xml"));
  std::string wanted = latin;
  wanted.replace(wanted.find("<a "), 3, "<A ");
  EXPECT_EQ(bytes("mission.xml"), wanted);
  // What that encoding does not have is saved in UTF-8; undone, the bytes are those that were.
  replace(workspace, "mission.xml", "<A ", "<\xE2\x82\xAC ");
  ASSERT_TRUE(workspace.save("mission.xml"));
  EXPECT_THAT(bytes("mission.xml"), testing::HasSubstr("encoding='UTF-8'"));
  EXPECT_THAT(workspace.refresh({"mission.xml"}), ElementsAre());
  ASSERT_TRUE(workspace.undo());
  ASSERT_TRUE(workspace.undo());
  ASSERT_TRUE(workspace.save("mission.xml"));
  EXPECT_EQ(bytes("mission.xml"), latin);
}

TEST_F(WorkspaceTest, AFileComesBackInItsEncoding) {
  const std::string latin = "<?xml version='1.0' encoding='ISO-8859-1'?>\n<root b='caf\xE9'/>\n";
  write("mission.xml", latin);
  {
    Workspace workspace = open();
    ASSERT_TRUE(workspace.remove("mission.xml"));
    ASSERT_TRUE(workspace.undo());
    EXPECT_EQ(bytes("mission.xml"), latin);
    ASSERT_TRUE(workspace.redo());
    workspace.keep_journal();
  }
  {
    Workspace workspace = open();
    ASSERT_TRUE(workspace.undo());
    EXPECT_EQ(bytes("mission.xml"), latin);
    replace(workspace, "mission.xml", "root", "ROOT");
    fs::remove(folder_.path() / "mission.xml");
    workspace.refresh({"mission.xml"});
    workspace.keep_journal();
  }
  Workspace workspace = open();
  ASSERT_TRUE(workspace.save("mission.xml"));
  EXPECT_EQ(bytes("mission.xml"), "<?xml version='1.0' encoding='ISO-8859-1'?>\n<ROOT b='caf\xE9'/>\n");
}

TEST_F(WorkspaceTest, IsWrittenInTheEncodingThatItDeclares) {
  write("mission.xml", "<?xml version='1.0' encoding='UTF-8'?>\n<root b='\xC3\xA9'/>\n");
  Workspace workspace = open();
  const auto declare = [&](const std::string& now, const std::string& then) {
    replace(workspace, "mission.xml", "encoding='" + now, "encoding='" + then);
  };
  declare("UTF-8", "ISO-8859-1");
  ASSERT_TRUE(workspace.save("mission.xml"));
  const std::string latin = "<?xml version='1.0' encoding='ISO-8859-1'?>\n<root b='\xE9'/>\n";
  EXPECT_EQ(bytes("mission.xml"), latin);
  EXPECT_THAT(workspace.find("mission.xml")->text, testing::HasSubstr("encoding='UTF-8'"));
  EXPECT_FALSE(workspace.find("mission.xml")->is_dirty());
  EXPECT_THAT(workspace.refresh({"mission.xml"}), ElementsAre());
  // One that is not known, and one that does not have the character.
  for (const std::string encoding : {"Shift_JIS", "ISO-8859-1"}) {
    if (encoding == "ISO-8859-1") replace(workspace, "mission.xml", "\xC3\xA9", "\xE2\x82\xAC");
    declare("UTF-8", encoding);
    const auto saved = workspace.save("mission.xml");
    ASSERT_FALSE(saved);
    EXPECT_EQ(saved.error().code, "design.encoding");
    EXPECT_THAT(saved.error().message, testing::HasSubstr("write encoding=\"UTF-8\""));
    EXPECT_EQ(bytes("mission.xml"), latin);
    declare(encoding, "UTF-8");
  }
  ASSERT_TRUE(workspace.save("mission.xml"));
  EXPECT_THAT(bytes("mission.xml"), testing::HasSubstr("\xE2\x82\xAC"));
}

TEST_F(WorkspaceTest, WhatOneTypesIsOneStep) {
  Workspace workspace = open();
  replace(workspace, "mission.xml", "<a/>", "<a x/>");
  replace(workspace, "mission.xml", "<a x/>", "<a xy/>", true);
  replace(workspace, "sentree.yaml", "mission:", "mission :", true);
  EXPECT_EQ(workspace.undo_steps().size(), 2U);
  ASSERT_TRUE(workspace.undo());
  ASSERT_TRUE(workspace.undo());
  EXPECT_EQ(workspace.find("mission.xml")->text, read("mission.xml"));
}

TEST_F(WorkspaceTest, WhatIsTypedOfAnEarlierTextIsAnotherStep) {
  Workspace workspace = open();
  replace(workspace, "mission.xml", "<a/>", "<a x/>");
  const std::uint64_t base = workspace.find("mission.xml")->version;
  const std::size_t d = workspace.find("mission.xml")->text.find("<d/>");
  replace(workspace, "mission.xml", "<a x/>", "<a xy/>", true);
  ASSERT_TRUE(workspace.edit("mission.xml", base, {{d, d + 4, "<D/>"}}, workspace.undo_steps().back().name, true));
  ASSERT_TRUE(workspace.undo());
  EXPECT_THAT(workspace.find("mission.xml")->text, testing::HasSubstr("<a xy/>"));
}

TEST_F(WorkspaceTest, WhatIsTypedAfterAnUndoIsAnotherStep) {
  Workspace workspace = open();
  replace(workspace, "mission.xml", "<a/>", "<a first/>");
  replace(workspace, "mission.xml", "<b/>", "<b second/>");
  ASSERT_TRUE(workspace.undo());
  replace(workspace, "mission.xml", "<c/>", "<c third/>", true);
  ASSERT_TRUE(workspace.undo());
  EXPECT_THAT(workspace.find("mission.xml")->text, testing::HasSubstr("<a first/>"));
  EXPECT_THAT(workspace.find("mission.xml")->text, testing::Not(testing::HasSubstr("third")));
}

TEST_F(WorkspaceTest, JoinsALateEditOrRefusesIt) {
  Workspace workspace = open();
  const std::uint64_t base = workspace.find("mission.xml")->version;
  const std::string old_text = workspace.find("mission.xml")->text;
  replace(workspace, "mission.xml", "<a/>", "<A/>");
  const std::size_t d = old_text.find("<d/>");
  ASSERT_TRUE(workspace.edit("mission.xml", base, {{d, d + 4, "<D/>"}}, "late"));
  EXPECT_EQ(workspace.find("mission.xml")->text, "<root>\n  <A/>\n  <b/>\n  <c/>\n  <D/>\n</root>\n");
  const std::size_t a = old_text.find("<a/>");
  const auto refused = workspace.edit("mission.xml", base, {{a, a + 4, "<x/>"}}, "late");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "design.conflict");
}

TEST_F(WorkspaceTest, KnowsTheTextsThatALateGestureMayBeOf) {
  Workspace workspace = open();
  const std::uint64_t base = workspace.find("mission.xml")->version;
  const std::string first = workspace.find("mission.xml")->text;
  replace(workspace, "mission.xml", "<a/>", "<A/>");
  const Document& document = *workspace.find("mission.xml");
  ASSERT_NE(document.at(base), nullptr);
  EXPECT_EQ(*document.at(base), first);
  EXPECT_EQ(document.at(document.version), &document.text);
  EXPECT_EQ(document.at(document.version + 1), nullptr);
}

TEST_F(WorkspaceTest, TakesWhatAnotherEditorWrites) {
  Workspace workspace = open();
  replace(workspace, "mission.xml", "<d/>", "<D/>");
  write("mission.xml", "<root>\n  <A/>\n  <b/>\n  <c/>\n  <d/>\n</root>\n");
  EXPECT_THAT(workspace.refresh({""}), ElementsAre("mission.xml"));
  EXPECT_EQ(workspace.find("mission.xml")->text, "<root>\n  <A/>\n  <b/>\n  <c/>\n  <D/>\n</root>\n");
  EXPECT_EQ(workspace.undo_steps().back().name, "mission.xml changed on disk");
  ASSERT_TRUE(workspace.save("mission.xml"));
  EXPECT_THAT(workspace.refresh({"mission.xml"}), ElementsAre());
}

TEST_F(WorkspaceTest, JoinsNeighbouringLinesButMakesNoBrokenFileOfTwoSoundOnes) {
  Workspace workspace = open();
  replace(workspace, "mission.xml", "<b/>", "<B/>");
  write("mission.xml", "<root>\n  <A/>\n  <b/>\n  <C/>\n  <d/>\n</root>\n");
  EXPECT_THAT(workspace.refresh({""}), ElementsAre("mission.xml"));
  EXPECT_EQ(workspace.find("mission.xml")->text, "<root>\n  <A/>\n  <B/>\n  <C/>\n  <d/>\n</root>\n");
  ASSERT_TRUE(workspace.save("mission.xml"));
  // One opens an element around a line, the other another around the next.
  replace(workspace, "mission.xml", "  <A/>\n", "  <x>\n  <A/>\n");
  replace(workspace, "mission.xml", "  <C/>\n", "  <C/>\n  </x>\n");
  write("mission.xml", "<root>\n  <A/>\n  <y>\n  <B/>\n  <C/>\n  <d/>\n  </y>\n</root>\n");
  workspace.refresh({""});
  EXPECT_TRUE(workspace.find("mission.xml")->theirs.has_value());
  EXPECT_THAT(workspace.find("mission.xml")->text, testing::Not(testing::HasSubstr("<y>")));
}

TEST_F(WorkspaceTest, TakesWhatChangedAtOnceAsOneStep) {
  write("notes.req", "a: always level > 1.\n");
  write("more.yaml", "a: 1\n");
  Workspace workspace = open();
  const std::string mission = read("mission.xml");
  write("mission.xml", "<root/>\n");
  write("notes.req", "a: always level > 2.\n");
  fs::remove(folder_.path() / "more.yaml");
  EXPECT_THAT(workspace.refresh({"mission.xml", "more.yaml", "notes.req"}),
              ElementsAre("mission.xml", "more.yaml", "notes.req"));
  ASSERT_EQ(workspace.undo_steps().size(), 1U);
  EXPECT_EQ(workspace.undo_steps().back().name, "3 files changed on disk");
  ASSERT_TRUE(workspace.undo());
  EXPECT_EQ(workspace.find("mission.xml")->text, mission);
  EXPECT_EQ(workspace.find("notes.req")->text, "a: always level > 1.\n");
  EXPECT_EQ(read("more.yaml"), "a: 1\n");

  fs::remove(folder_.path() / "more.yaml");
  EXPECT_THAT(workspace.refresh({"more.yaml"}), ElementsAre("more.yaml"));
  EXPECT_EQ(workspace.undo_steps().back().name, "more.yaml deleted on disk");
}

TEST_F(WorkspaceTest, KeepsBothWhereBothChangedTheSame) {
  Workspace workspace = open();
  replace(workspace, "mission.xml", "<a/>", "<mine/>");
  write("mission.xml", "<root>\n  <theirs/>\n  <b/>\n  <c/>\n  <d/>\n</root>\n");
  // Saving does not write over what is there.
  const auto saved = workspace.save("mission.xml");
  ASSERT_FALSE(saved);
  EXPECT_EQ(saved.error().code, "design.conflict");
  EXPECT_EQ(workspace.find("mission.xml")->theirs, read("mission.xml"));
  EXPECT_EQ(workspace.edit("mission.xml", 1, {}, "type").error().code, "design.unresolved");
  const std::string mine = workspace.find("mission.xml")->text;
  ASSERT_TRUE(workspace.resolve("mission.xml", mine));
  ASSERT_TRUE(workspace.save("mission.xml"));
  EXPECT_EQ(read("mission.xml"), mine);
}

// Another branch is checked out and the one before again; or the other editor undoes.
TEST_F(WorkspaceTest, AConflictIsOverWhenTheDiskIsAsItWas) {
  Workspace workspace = open();
  const std::string before = read("mission.xml");
  replace(workspace, "mission.xml", "<a/>", "<mine/>");
  const std::string mine = workspace.find("mission.xml")->text;
  write("mission.xml", "<root>\n  <theirs/>\n  <b/>\n  <c/>\n  <d/>\n</root>\n");
  EXPECT_THAT(workspace.refresh({"mission.xml"}), ElementsAre("mission.xml"));
  ASSERT_TRUE(workspace.find("mission.xml")->theirs);
  write("mission.xml", before);
  EXPECT_THAT(workspace.refresh({"mission.xml"}), ElementsAre("mission.xml"));
  EXPECT_FALSE(workspace.find("mission.xml")->theirs);
  EXPECT_EQ(workspace.find("mission.xml")->text, mine);
  // Nor is there anything to choose where the other text is gone.
  write("mission.xml", "<root>\n  <theirs/>\n  <b/>\n  <c/>\n  <d/>\n</root>\n");
  workspace.refresh({"mission.xml"});
  ASSERT_TRUE(workspace.find("mission.xml")->theirs);
  fs::remove(folder_.path() / "mission.xml");
  EXPECT_THAT(workspace.refresh({"mission.xml"}), ElementsAre("mission.xml"));
  EXPECT_FALSE(workspace.find("mission.xml")->theirs);
  ASSERT_TRUE(workspace.save("mission.xml"));
  EXPECT_EQ(read("mission.xml"), mine);
}

TEST_F(WorkspaceTest, WhatBecomesNoTextIsNeitherGoneNorWrittenOver) {
  const std::string before = read("mission.xml");
  const fs::path path = folder_.path() / "mission.xml";
  const auto make = [&](const std::string& what) {
    fs::remove_all(path);
    if (what == "no UTF-8") write("mission.xml", "<root>caf\xE9</root>\n");
    if (what == "larger") write("mission.xml", std::string(kDocumentBytesMax + 1, 'x'));
    if (what == "no regular file") {
      EXPECT_EQ(::mkfifo(path.c_str(), 0600), 0);
    }
    if (what == "folder") fs::create_directory(path);
    if (what == "link") fs::create_symlink(folder_.path() / "sentree.yaml", path);
  };
  for (const std::string what : {"no UTF-8", "larger", "no regular file", "folder", "link"}) {
    SCOPED_TRACE(what);
    make("");
    write("mission.xml", before);
    fs::remove_all(folder_.path() / ".sentree");
    Workspace workspace = open();
    make(what);
    const auto type = fs::symlink_status(path).type();
    EXPECT_THAT(workspace.refresh({"mission.xml"}), ElementsAre("mission.xml"));
    EXPECT_THAT(workspace.refresh({"mission.xml"}), ElementsAre());
    ASSERT_NE(workspace.find("mission.xml"), nullptr);
    EXPECT_THAT(workspace.find("mission.xml")->unreadable, testing::HasSubstr(what));
    EXPECT_TRUE(workspace.undo_steps().empty());
    // Edited on, undone, saved, deleted: what is there stays.
    replace(workspace, "mission.xml", "<a/>", "<mine/>");
    ASSERT_TRUE(workspace.undo());
    ASSERT_TRUE(workspace.redo());
    EXPECT_EQ(workspace.save("mission.xml").error().code, "design.unreadable");
    EXPECT_EQ(workspace.remove("mission.xml").error().code, "design.unreadable");
    EXPECT_EQ(fs::symlink_status(path).type(), type);
    // Mended there, what was edited is still to be saved.
    make("");
    write("mission.xml", before);
    EXPECT_THAT(workspace.refresh({"mission.xml"}), ElementsAre("mission.xml"));
    EXPECT_EQ(workspace.find("mission.xml")->unreadable, "");
    ASSERT_TRUE(workspace.save("mission.xml"));
    EXPECT_THAT(read("mission.xml"), testing::HasSubstr("<mine/>"));
  }
  Workspace workspace = open();
  make("no UTF-8");
  workspace.refresh({"mission.xml"});
  const std::string mine = workspace.find("mission.xml")->text;
  ASSERT_TRUE(workspace.resolve("mission.xml", mine));
  EXPECT_EQ(read("mission.xml"), mine);
  EXPECT_FALSE(workspace.find("mission.xml")->has_conflict());
  // Mended there before one has said so.
  make("no UTF-8");
  workspace.refresh({"mission.xml"});
  make("");
  write("mission.xml", "<root>mended</root>\n");
  EXPECT_EQ(workspace.resolve("mission.xml", mine).error().code, "design.conflict");
  EXPECT_EQ(read("mission.xml"), "<root>mended</root>\n");
  EXPECT_EQ(workspace.find("mission.xml")->unreadable, "");
}

TEST_F(WorkspaceTest, WhatCannotBeLookedAtIsNotGone) {
  write("in/a.xml", "<a/>\n");
  Workspace workspace = open();
  fs::rename(folder_.path() / "in", folder_.path() / "away");
  // A link to itself: the system says neither that something is there nor that nothing is.
  fs::create_symlink("in", folder_.path() / "in");
  EXPECT_THAT(workspace.refresh({"in/a.xml"}), ElementsAre("in/a.xml"));
  ASSERT_NE(workspace.find("in/a.xml"), nullptr);
  EXPECT_THAT(workspace.find("in/a.xml")->unreadable, testing::StartsWith("it cannot be looked at: "));
  EXPECT_TRUE(workspace.undo_steps().empty());
  fs::remove(folder_.path() / "in");
  fs::rename(folder_.path() / "away", folder_.path() / "in");
  EXPECT_THAT(workspace.refresh({"in/a.xml"}), ElementsAre("in/a.xml"));
  EXPECT_EQ(workspace.find("in/a.xml")->unreadable, "");
}

TEST_F(WorkspaceTest, AFileThatIsProtectedStaysAsItIs) {
  const std::string before = read("mission.xml");
  ::chmod((folder_.path() / "mission.xml").c_str(), 0444);
  Workspace workspace = open();
  replace(workspace, "mission.xml", "<a/>", "<A/>");
  const auto saved = workspace.save("mission.xml");
  ASSERT_FALSE(saved);
  EXPECT_EQ(saved.error().code, "file.read-only");
  EXPECT_EQ(read("mission.xml"), before);
  EXPECT_TRUE(workspace.find("mission.xml")->is_dirty());
  ::chmod((folder_.path() / "mission.xml").c_str(), 0644);
  EXPECT_TRUE(workspace.save("mission.xml"));
  EXPECT_THAT(read("mission.xml"), testing::HasSubstr("<A/>"));
}

TEST_F(WorkspaceTest, FindsAgainWhatWasNotSaved) {
  std::string edited;
  {
    Workspace workspace = open();
    replace(workspace, "mission.xml", "<a/>", "<A/>");
    replace(workspace, "mission.xml", "<b/>", "<B/>");
    ASSERT_TRUE(workspace.undo());
    edited = workspace.find("mission.xml")->text;
    workspace.keep_journal();
  }
  write("sentree.yaml", "changed: true\n");
  Workspace workspace = open();
  EXPECT_EQ(workspace.find("mission.xml")->text, edited);
  EXPECT_TRUE(workspace.find("mission.xml")->is_dirty());
  EXPECT_EQ(workspace.find("sentree.yaml")->text, "changed: true\n");
  ASSERT_TRUE(workspace.redo());
  ASSERT_TRUE(workspace.undo());
  ASSERT_TRUE(workspace.undo());
  EXPECT_EQ(workspace.find("mission.xml")->text, read("mission.xml"));
}

TEST_F(WorkspaceTest, OneAtATimeEditsAFolder) {
  std::string edited;
  Workspace second = [&] {
    Workspace first = open();
    first.tell_address("http://127.0.0.1:1234");
    replace(first, "mission.xml", "<a/>", "<A/>");
    edited = first.find("mission.xml")->text;
    first.keep_journal();
    Workspace other = open();
    EXPECT_THAT(other.held_by(), testing::HasSubstr("http://127.0.0.1:1234"));
    const auto refused = other.edit("sentree.yaml", 1, {{0, 0, "# "}}, "type");
    EXPECT_EQ(refused.error().code, "design.held");
    EXPECT_THAT(refused.error().message, testing::HasSubstr("http://127.0.0.1:1234"));
    EXPECT_EQ(other.put({{"a.scxml", ""}}, "add").error().code, "design.held");
    EXPECT_EQ(other.remove("mission.xml").error().code, "design.held");
    EXPECT_EQ(other.undo().error().code, "design.held");
    // It shows what is saved, and keeps nothing.
    write("sentree.yaml", "changed: true\n");
    EXPECT_THAT(other.refresh({"sentree.yaml"}), ElementsAre("sentree.yaml"));
    other.keep_journal();
    EXPECT_FALSE(other.take_over());
    return other;
  }();
  ASSERT_TRUE(second.take_over());
  EXPECT_EQ(second.held_by(), "");
  EXPECT_EQ(second.find("mission.xml")->text, edited);
  EXPECT_EQ(second.find("sentree.yaml")->text, "changed: true\n");
  ASSERT_TRUE(second.undo());
  EXPECT_FALSE(second.find("mission.xml")->is_dirty());
}

TEST_F(WorkspaceTest, ALockThatCannotBeOpenedIsAnothers) {
  fs::create_directories(folder_.path() / ".sentree");
  fs::create_symlink("elsewhere", folder_.path() / ".sentree/lock");
  Workspace workspace = open();
  EXPECT_THAT(workspace.held_by(), testing::HasSubstr(".sentree/lock cannot be opened"));
  EXPECT_EQ(workspace.remove("mission.xml").error().code, "design.held");
  EXPECT_FALSE(workspace.take_over());
  fs::remove(folder_.path() / ".sentree/lock");
  EXPECT_TRUE(workspace.take_over());
}

// `git clean -fdx` while one edits.
TEST_F(WorkspaceTest, LockAndJournalComeBackWhenTheyAreRemoved) {
  Workspace workspace = open();
  workspace.tell_address("http://127.0.0.1:1234");
  replace(workspace, "mission.xml", "<a/>", "<A/>");
  workspace.keep_journal();
  fs::remove_all(folder_.path() / ".sentree");
  replace(workspace, "mission.xml", "<b/>", "<B/>");
  workspace.keep_journal();
  EXPECT_EQ(workspace.journal_problem(), "");
  EXPECT_THAT(read(".sentree/journal"), testing::HasSubstr("<A/>"));
  EXPECT_THAT(open().held_by(), testing::HasSubstr("http://127.0.0.1:1234"));

  // Another was faster: its journal stays, and what is edited here can be saved.
  fs::remove_all(folder_.path() / ".sentree");
  std::optional<Workspace> other(open());
  EXPECT_EQ(other->held_by(), "");
  replace(workspace, "mission.xml", "<c/>", "<C/>");
  workspace.keep_journal();
  EXPECT_THAT(workspace.journal_problem(), testing::HasSubstr("by now"));
  EXPECT_EQ(read(".sentree/journal"), "(none)");
  EXPECT_TRUE(workspace.save("mission.xml"));
  other.reset();
  workspace.keep_journal();
  EXPECT_EQ(workspace.journal_problem(), "");
}

TEST_F(WorkspaceTest, TheJournalSaysWhatWasWhateverIsDone) {
  const char* const given = std::getenv("SENTREE_SEED");
  const auto seed = given != nullptr ? static_cast<unsigned>(std::stoul(given)) : 1U;
  SCOPED_TRACE("SENTREE_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  const auto draw = [&](unsigned bound) { return random() % bound; };
  std::optional<Workspace> workspace(open());
  for (int i = 0; i < 400; ++i) {
    std::vector<std::string> files;
    for (const auto& [name, document] : workspace->documents()) files.push_back(name);
    const std::string& file = files[draw(static_cast<unsigned>(files.size()))];
    const Document& document = *workspace->find(file);
    switch (draw(8)) {
      case 0: (void)workspace->undo(); break;
      case 1: (void)workspace->redo(); break;
      case 2: (void)workspace->save(file); break;
      case 3: (void)workspace->put({{"s" + std::to_string(draw(5)) + ".scxml", std::to_string(i)}}, "add"); break;
      case 4:
        if (file != "sentree.yaml") (void)workspace->remove(file);
        break;
      default: {
        const std::size_t at = draw(static_cast<unsigned>(document.text.size() + 1));
        (void)workspace->edit(file, document.version, {{at, at, std::to_string(i)}}, "type", draw(2) == 0);
      }
    }
    workspace->keep_journal();
    ASSERT_EQ(workspace->journal_problem(), "");
    if (draw(20) != 0) continue;
    std::map<std::string, std::pair<std::string, std::string>> texts;
    for (const auto& [name, known] : workspace->documents()) texts[name] = {known.text, known.saved};
    const auto names = [&] {
      std::vector<std::string> all;
      for (const Step& step : workspace->undo_steps()) all.push_back(step.name);
      all.emplace_back("|");
      for (const Step& step : workspace->redo_steps()) all.push_back(step.name);
      return all;
    };
    const auto before = names();
    workspace.reset();
    // A program that was killed while it wrote.
    if (draw(2) == 0) std::ofstream(folder_.path() / ".sentree/journal", std::ios::app) << "{\"files\":{\"mis";
    workspace.emplace(open());
    EXPECT_EQ(names(), before) << i;
    for (const auto& [name, known] : workspace->documents())
      EXPECT_EQ(texts[name], std::make_pair(known.text, known.saved)) << name << " " << i;
    EXPECT_EQ(texts.size(), workspace->documents().size());
  }
}

TEST_F(WorkspaceTest, TheJournalIsBoundedAndOnlyAppendedTo) {
  constexpr std::size_t kLarge = std::size_t{3} << 20U;
  const fs::path journal = folder_.path() / ".sentree/journal";
  Workspace workspace = open();
  replace(workspace, "sentree.yaml", "mission", "precious");
  for (int i = 0; i < 8; ++i) {
    const Document& document = *workspace.find("mission.xml");
    const std::string text(kLarge, static_cast<char>('a' + i));
    ASSERT_TRUE(workspace.edit("mission.xml", document.version, {{0, document.text.size(), text}}, "paste"));
    workspace.keep_journal();
  }
  EXPECT_LT(workspace.undo_steps().size(), 5U);
  EXPECT_LT(fs::file_size(journal), 4 * kStepsBytesMax);
  const auto before = fs::file_size(journal);
  replace(workspace, "sentree.yaml", "precious", "more precious");
  workspace.keep_journal();
  EXPECT_LT(fs::file_size(journal), before + 1000);
  EXPECT_GT(fs::file_size(journal), before);
  const std::string text = workspace.find("mission.xml")->text;
  { const Workspace ended = std::move(workspace); }
  workspace = open();
  EXPECT_EQ(workspace.find("mission.xml")->text, text);
  EXPECT_THAT(workspace.find("sentree.yaml")->text, testing::StartsWith("more precious"));
  ASSERT_TRUE(workspace.undo());
  EXPECT_THAT(workspace.find("sentree.yaml")->text, testing::StartsWith("precious"));
}

TEST_F(WorkspaceTest, AJournalThatCannotBeWrittenIsTold) {
  Workspace workspace = open();
  fs::create_directory(folder_.path() / ".sentree/journal");
  replace(workspace, "mission.xml", "<a/>", "<A/>");
  workspace.keep_journal();
  EXPECT_THAT(workspace.journal_problem(), testing::HasSubstr("cannot be written"));
  fs::remove(folder_.path() / ".sentree/journal");
  workspace.keep_journal();
  EXPECT_EQ(workspace.journal_problem(), "");
  EXPECT_THAT(read(".sentree/journal"), testing::HasSubstr("<A/>"));
}

TEST_F(WorkspaceTest, ADamagedJournalCostsNothing) {
  write(".sentree/journal",
        "{\"form\":1,\"files\":{\"../"
        "x.xml\":{\"text\":\"\"}},\"undo\":[{\"name\":\"n\",\"changes\":[{\"file\":\"mission.xml\",\"edits\":[[0,99999,"
        "\"\"]],\"back\":[[5,1,\"\"]]}]}]}");
  Workspace workspace = open();
  EXPECT_EQ(workspace.documents().size(), 2U);
  EXPECT_FALSE(workspace.undo());
  EXPECT_EQ(workspace.find("mission.xml")->text, read("mission.xml"));
}

TEST_F(WorkspaceTest, StaysInsideTheFolder) {
  Workspace workspace = open();
  fs::create_directory_symlink("/tmp", folder_.path() / "out");
  for (const char* file : {"../x.yaml", "/tmp/x.yaml", "a/../../x.yaml", "out/x.yaml", "x.sh", ".sentree/x.yaml", ""}) {
    const auto put = workspace.put({{file, "x"}}, "add");
    ASSERT_FALSE(put) << file;
    EXPECT_EQ(put.error().code, "design.outside") << file;
  }
  EXPECT_EQ(workspace.edit("../x.yaml", 1, {}, "type").error().code, "design.no-such-file");
}

TEST_F(WorkspaceTest, SavingKeepsTheMode) {
  ::chmod((folder_.path() / "mission.xml").c_str(), 0600);
  Workspace workspace = open();
  replace(workspace, "mission.xml", "<a/>", "<A/>");
  ASSERT_TRUE(workspace.save("mission.xml"));
  EXPECT_EQ(fs::status(folder_.path() / "mission.xml").permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_THAT(read("mission.xml"), testing::HasSubstr("<A/>"));
}

TEST_F(WorkspaceTest, WhatIsEditedStandsForTheFile) {
  Workspace workspace = open();
  replace(workspace, "mission.xml", "<a/>", "<A/>");
  const text::Overlay overlay = workspace.overlay();
  ASSERT_EQ(overlay.size(), 1U);
  const text::ReadThrough through(overlay);
  EXPECT_EQ(read("mission.xml"), workspace.find("mission.xml")->text);
}

}  // namespace
}  // namespace sentree::design
