#include "sentree/design/tree_edit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <map>
#include <random>
#include <variant>

#include "sentree/bt/load.h"
#include "sentree/text/file.h"
#include "sentree/text/xml.h"

namespace sentree::design {
namespace {

using testing::HasSubstr;

const std::string kFile = R"(<root BTCPP_format="4" main_tree_to_execute="Main">
  <BehaviorTree ID="Main">
    <Sequence name="All">
      <!-- first -->
      <A x='1'   y="2"/> <!-- behind A -->
      <Inverter>
        <B/>
      </Inverter>
      <SubTree ID="Other"/>
    </Sequence>
  </BehaviorTree>
  <BehaviorTree ID="Other"><Fallback><B name="b1"/><B name="b2"/></Fallback></BehaviorTree>
  <TreeNodesModel>
    <Action ID="A"/>
    <Condition ID="B"/>
  </TreeNodesModel>
</root>
)";

const Kinds& builtin_kinds() {
  static const Kinds builtin_kinds({});
  return builtin_kinds;
}

std::uint32_t element(const std::string& xml, const std::string& what) {
  const auto outline = outline_of(xml, builtin_kinds()).value();
  for (const OutlineTree& tree : outline.trees) {
    if (tree.id == what) return tree.element;
    for (const OutlineNode& node : tree.nodes) {
      if (node.name == what || (node.name.empty() && node.id == what)) return node.element;
    }
  }
  ADD_FAILURE() << "no " << what;
  return 0;
}

std::string edited(const std::string& xml, const TreeGesture& gesture) {
  const auto result = edit_tree(xml, gesture, builtin_kinds());
  if (!result) return result.error().message;
  return with_edits(xml, result->edits).value();
}

std::string with(std::string xml, const std::string& old_text, const std::string& new_text) {
  const std::size_t at = xml.find(old_text);
  EXPECT_NE(at, std::string::npos) << old_text;
  return xml.replace(at, old_text.size(), new_text);
}

TEST(TreeEdit, PutsANodeOnALineOfItsOwn) {
  const std::uint32_t all = element(kFile, "All");
  EXPECT_EQ(edited(kFile, InsertNode{"C", false, "c", {{"p", "a<b"}}, {all, 0}}),
            with(kFile, "      <!-- first -->", "      <C name=\"c\" p=\"a&lt;b\"/>\n      <!-- first -->"));
  EXPECT_EQ(edited(kFile, InsertNode{"C", false, "", {}, {all, 1}}),
            with(kFile, "<!-- behind A -->\n", "<!-- behind A -->\n      <C/>\n"));
  EXPECT_EQ(edited(kFile, InsertNode{"Other2", true, "", {}, {all, 3}}),
            with(kFile, "<SubTree ID=\"Other\"/>\n", "<SubTree ID=\"Other\"/>\n      <SubTree ID=\"Other2\"/>\n"));
}

TEST(TreeEdit, PutsANodeIntoAnEmptyOne) {
  const std::string empty = with(kFile, "<A x='1'   y=\"2\"/>", "<Fallback />");
  EXPECT_EQ(edited(empty, InsertNode{"A", false, "", {}, {element(empty, "Fallback"), 0}}),
            with(empty, "<Fallback />", "<Fallback>\n        <A/>\n      </Fallback>"));
}

TEST(TreeEdit, KeepsWhatStandsOnOneLineThere) {
  const std::string result = edited(kFile, DeleteNode{element(kFile, "b1")});
  EXPECT_EQ(result, with(kFile, "<B name=\"b1\"/>", ""));
  EXPECT_EQ(edited(kFile, MoveNode{element(kFile, "b2"), {element(kFile, "Fallback"), 0}, false}),
            with(kFile, "<B name=\"b1\"/><B name=\"b2\"/>", "<B name=\"b2\"/><B name=\"b1\"/>"));
}

TEST(TreeEdit, MovesWithTheIndentationOfTheNewPlace) {
  const std::string target = with(kFile, "<SubTree ID=\"Other\"/>", "<Sequence name=\"In\"><A/></Sequence>");
  const std::uint32_t all = element(target, "All");
  const std::string moved = edited(target, MoveNode{element(target, "Inverter"), {all, 0}, false});
  EXPECT_EQ(moved, with(with(target, "      <Inverter>\n        <B/>\n      </Inverter>\n", ""), "      <!-- first -->",
                        "      <Inverter>\n        <B/>\n      </Inverter>\n      <!-- first -->"));
}

TEST(TreeEdit, WrapsAndUnwrapsToTheSameBytes) {
  const std::string wrapped = edited(kFile, WrapNode{element(kFile, "Inverter"), "Fallback"});
  EXPECT_EQ(wrapped,
            with(kFile, "      <Inverter>\n        <B/>\n      </Inverter>\n",
                 "      <Fallback>\n        <Inverter>\n          <B/>\n        </Inverter>\n      </Fallback>\n"));
  EXPECT_EQ(edited(wrapped, UnwrapNode{element(wrapped, "Fallback")}), kFile);
}

TEST(TreeEdit, SetsAnAttributeInItsQuotes) {
  EXPECT_EQ(edited(kFile, SetAttribute{element(kFile, "A"), "x", "it's"}), with(kFile, "'1'", "'it&apos;s'"));
  EXPECT_EQ(edited(kFile, SetAttribute{element(kFile, "A"), "y", std::nullopt}), with(kFile, "   y=\"2\"", ""));
}

// As `sentree fmt` writes it, so that a file that was in canonical form stays in it.
TEST(TreeEdit, ANodesFirstNameStandsBeforeItsPorts) {
  const std::string file =
      "<root BTCPP_format=\"4\"><BehaviorTree ID=\"T\"><Sequence><SubTree  ID='S&apos;' _autoremap=\"true\"/>"
      "<Delay delay_msec=\"1\"/></Sequence></BehaviorTree></root>";
  EXPECT_EQ(edited(file, SetAttribute{3, "name", "Again"}), with(file, "ID='S&apos;'", "ID='S&apos;' name=\"Again\""));
  EXPECT_EQ(edited(file, SetAttribute{4, "name", "<1>"}), with(file, "<Delay", "<Delay name=\"&lt;1&gt;\""));
}

TEST(TreeEdit, TakesEveryNameThatXmlDoes) {
  EXPECT_NE(edited(kFile, SetAttribute{element(kFile, "A"), "größe-1.x", "3"}).find(" größe-1.x="), std::string::npos);
  EXPECT_EQ(edited(kFile, SetAttribute{element(kFile, "A"), "1x", "3"}), "\"1x\" is no name of an attribute");
}

TEST(TreeEdit, SaysWhyADropIsImpossible) {
  const auto drop = [](const std::string& into, const InsertNode& node) {
    InsertNode at = node;
    at.at = {element(kFile, into), 0};
    return edited(kFile, at);
  };
  EXPECT_EQ(drop("Inverter", {"A", false, "", {}, {}}), "Inverter takes one child only, and has it");
  EXPECT_EQ(drop("A", {"A", false, "", {}, {}}), "A is an action: it has no children");
  EXPECT_EQ(drop("b1", {"A", false, "", {}, {}}), "b1 is a condition: it has no children");
  EXPECT_EQ(drop("Main", {"A", false, "", {}, {}}), "a tree has one root; wrap All in a control node first");
  EXPECT_EQ(edited(kFile, InsertNode{"Main", true, "", {}, {element(kFile, "Fallback"), 0}}),
            "the tree Other would contain itself");
  EXPECT_EQ(edited(kFile, MoveNode{element(kFile, "Inverter"), {element(kFile, "Inverter"), 0}, false}),
            "Inverter cannot go into itself");
  EXPECT_THAT(edited(kFile, UnwrapNode{element(kFile, "A")}), HasSubstr("delete it instead"));
}

TEST(TreeEdit, PastesWhatOtherFilesAndEditorsHave) {
  const std::uint32_t all = element(kFile, "All");
  const auto pasted = [&](const std::string& xml, std::size_t index = 0) {
    return edited(kFile, PasteNodes{xml, {all, index}});
  };
  // Several nodes, at the place's indentation; what is inside keeps its own.
  EXPECT_THAT(
      pasted("      <Fallback>\r\n        <!-- why -->\r\n        <A/>\r\n      </Fallback>\r\n      <B/>\r\n"),
      HasSubstr("<Sequence name=\"All\">\n      <Fallback>\n        <!-- why -->\n        <A/>\n      </Fallback>\n"
                "      <B/>\n"));
  EXPECT_THAT(pasted("<Fallback>\n          <A/>\n        </Fallback>"),
              HasSubstr("<Sequence name=\"All\">\n      <Fallback>\n        <A/>\n      </Fallback>\n"));
  // A tree, or a file with one, stands for what is in it.
  const std::string file = R"(<?xml version="1.0"?><root BTCPP_format="4"><BehaviorTree ID="X"><Fallback name="f"/>)"
                           R"(</BehaviorTree><TreeNodesModel><Action ID="A"/></TreeNodesModel></root>)";
  EXPECT_THAT(pasted(file, 3), HasSubstr("<SubTree ID=\"Other\"/>\n      <Fallback name=\"f\"/>\n    </Sequence>"));
  EXPECT_EQ(edit_tree(kFile, PasteNodes{file, {all, 0}}, builtin_kinds())->name, "paste f under All");
  EXPECT_EQ(edit_tree(kFile, PasteNodes{"<A/><B/>", {all, 0}}, builtin_kinds())->name, "paste 2 nodes under All");
  for (const char* nothing : {"", "plain text", "<A", "<!-- only that -->", "<?xml", "<root/>"})
    EXPECT_THAT(pasted(nothing), testing::AnyOf(HasSubstr("no XML of nodes"), HasSubstr("no node"))) << nothing;
  EXPECT_THAT(pasted("<root><BehaviorTree ID='x'/><BehaviorTree ID='y'/></root>"), HasSubstr("2 trees"));
  EXPECT_THAT(pasted("<TreeNodesModel/>"), HasSubstr("no node of a tree"));
  EXPECT_THAT(pasted("<scxml xmlns=\"http://www.w3.org/2005/07/scxml\"/>"), HasSubstr("<scxml> is no node of a tree"));
  EXPECT_THAT(pasted("<SubTree ID=\"Main\"/>"), HasSubstr("would contain itself"));
  EXPECT_THAT(edited(kFile, PasteNodes{"<A/>", {element(kFile, "Inverter"), 0}}), HasSubstr("one child only"));
}

const std::string kNamed = R"(<root BTCPP_format="4">
  <BehaviorTree ID="Main">
    <Sequence name="All">
      <Fallback name="Try">
        <GoTo name="Go To"   goal="desk"/>
        <GoTo name='GoToDesk_2'/>
        <AlwaysSuccess name="Fine"/>
        <SubTree ID="Other" name="Visit"/>
        <GoTo/>
      </Fallback>
      <GoTo name="Go_To_2"/>
    </Sequence>
  </BehaviorTree>
  <BehaviorTree ID="Other"><GoTo name="GoToDesk_2"/></BehaviorTree>
</root>
)";

TEST(TreeEdit, CopiesOfNamedLeavesGetFreeNames) {
  // Messages do not tell "Go To_2" from Go_To_2.
  const std::string copy = edited(kNamed, MoveNode{element(kNamed, "Try"), {element(kNamed, "All"), 1}, true});
  const std::string added = R"(
      <Fallback name="Try">
        <GoTo name="Go To_3"   goal="desk"/>
        <GoTo name='GoToDesk_3'/>
        <AlwaysSuccess name="Fine"/>
        <SubTree ID="Other" name="Visit_2"/>
        <GoTo/>
      </Fallback>)";
  std::string expected = kNamed;
  expected.insert(expected.find("\n      <GoTo name=\"Go_To_2\""), added);
  EXPECT_EQ(copy, expected);
  // A move, and a copy into another tree, keep the names that are free there.
  const auto moved = edited(kNamed, MoveNode{element(kNamed, "Go To"), {element(kNamed, "All"), 0}});
  EXPECT_THAT(moved, HasSubstr("<GoTo name=\"Go To\"   goal=\"desk\"/>\n      <Fallback"));
  std::string empty = kNamed;
  empty.replace(empty.find("<GoTo name=\"GoToDesk_2\"/></Beh"), 25, "<Sequence name=\"In\"/>");
  EXPECT_THAT(edited(empty, MoveNode{element(empty, "GoToDesk_2"), {element(empty, "In"), 0}, true}),
              testing::ContainsRegex("<Sequence name=\"In\">\n *<GoTo name='GoToDesk_2'/>"));
}

TEST(TreeEdit, NewLeavesGetFreeNames) {
  const Slot end{element(kNamed, "All"), 2};
  EXPECT_THAT(edited(kNamed, InsertNode{"GoTo", false, "Go To", {}, end}), HasSubstr("<GoTo name=\"Go To_3\"/>"));
  EXPECT_THAT(edited(kNamed, InsertNode{"Other", true, "Visit", {}, end}),
              HasSubstr("ID=\"Other\" name=\"Visit_2\"/>"));
  EXPECT_THAT(edited(kNamed, InsertNode{"GoTo", false, "Free", {}, end}), HasSubstr("<GoTo name=\"Free\"/>"));
  EXPECT_THAT(edited(kNamed, InsertNode{"AlwaysSuccess", false, "Fine", {}, end}),
              HasSubstr("<AlwaysSuccess name=\"Fine\"/>\n    </Sequence>"));
}

TEST(TreeEdit, PastedNamedLeavesGetFreeNames) {
  const PasteNodes paste{"<GoTo name=\"Go To\"/>\n<GoTo name=\"Go To\"/>\n<GoTo name=\"New\"/>",
                         {element(kNamed, "All"), 2}};
  EXPECT_THAT(
      edited(kNamed, paste),
      HasSubstr("\n      <GoTo name=\"Go To_3\"/>\n      <GoTo name=\"Go To_4\"/>\n      <GoTo name=\"New\"/>\n"));
}

TEST(TreeEdit, AddsATreeAndDeletesItAgain) {
  const std::string with = edited(kFile, AddTree{"Third"});
  EXPECT_THAT(with, HasSubstr("</BehaviorTree>\n  <BehaviorTree ID=\"Third\"/>\n  <TreeNodesModel>"));
  EXPECT_EQ(edited(with, DeleteTree{element(with, "Third")}), kFile);
  EXPECT_THAT(edited(kFile, AddTree{"Other"}), HasSubstr("there is a tree Other already"));
  EXPECT_THAT(edited(kFile, AddTree{"no name"}), HasSubstr("is no name of a tree"));
  EXPECT_THAT(edited(kFile, DeleteTree{outline_of(kFile, builtin_kinds())->trees[1].element}),
              HasSubstr("1 SubTree is of the tree Other"));
  EXPECT_THAT(edited(kFile, DeleteTree{element(kFile, "Main")}), HasSubstr("the main one"));
  EXPECT_THAT(edited(kFile, DeleteTree{element(kFile, "All")}), HasSubstr("is no tree"));
  const std::string one = R"(<root BTCPP_format="4"><BehaviorTree ID="A"><B/></BehaviorTree></root>)";
  EXPECT_THAT(edited(one, DeleteTree{outline_of(one, builtin_kinds())->trees[0].element}), HasSubstr("the only one"));
}

TEST(TreeEdit, KeepsLineEndsOfOtherSystems) {
  std::string crlf;
  for (const char c : kFile) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
  const std::string result = edited(crlf, InsertNode{"C", false, "", {}, {element(crlf, "All"), 1}});
  EXPECT_THAT(result, HasSubstr("<!-- behind A -->\r\n      <C/>\r\n"));
  EXPECT_EQ(edited(result, DeleteNode{element(result, "C")}), crlf);
}

std::vector<std::filesystem::path> mission_files() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(std::filesystem::path(SENTREE_SOURCE_DIR) / "examples")) {
    if (entry.path().filename() == "mission.xml") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

TEST(TreeEdit, MakesATreeOfANodeAndPutsItBack) {
  const std::string out = edited(kFile, ExtractTree{element(kFile, "Inverter"), "NotB"});
  EXPECT_EQ(out, with(with(kFile, "<Inverter>\n        <B/>\n      </Inverter>",
                           "<SubTree ID=\"NotB\" _autoremap=\"true\"/>"),
                      "  </BehaviorTree>\n  <BehaviorTree ID=\"Other\">",
                      "  </BehaviorTree>\n"
                      "  <BehaviorTree ID=\"NotB\">\n"
                      "    <Inverter>\n"
                      "      <B/>\n"
                      "    </Inverter>\n"
                      "  </BehaviorTree>\n"
                      "  <BehaviorTree ID=\"Other\">"));
  EXPECT_EQ(edited(out, InlineTree{element(out, "All") + 2}), kFile) << "the way back";
  EXPECT_THAT(edited(kFile, ExtractTree{element(kFile, "Inverter"), "Other"}), HasSubstr("there is a tree Other"));
  EXPECT_THAT(edited(kFile, ExtractTree{element(kFile, "Inverter"), "a b"}), HasSubstr("no name of a tree"));
  for (const char* node : {"Timeout", "Inverter", "B", "SubTree"}) {
    EXPECT_THAT(edited(kFile, ExtractTree{element(kFile, "Inverter"), node}), HasSubstr("is the name of a node"));
    EXPECT_THAT(edited(kFile, AddTree{node}), HasSubstr("is the name of a node"));
  }
  EXPECT_THAT(edited(kFile, InlineTree{element(kFile, "Inverter")}), HasSubstr("is no SubTree"));
  // It is called twice: the tree stays.
  const std::string twice = with(kFile, "<Inverter>", "<SubTree ID=\"Other\"/>\n      <Inverter>");
  EXPECT_THAT(edited(twice, InlineTree{element(twice, "All") + 2}), HasSubstr("<BehaviorTree ID=\"Other\">"));
  // Entries that are called otherwise inside are not mixed up.
  const std::string remapped = with(kFile, "<SubTree ID=\"Other\"/>", "<SubTree ID=\"Other\" place=\"{goal}\"/>");
  EXPECT_THAT(edited(remapped, InlineTree{element(remapped, "All") + 4}), HasSubstr("entries of its own"));
}

// A gesture at a node of the outline, whatever comes.
TreeGesture any_gesture(const Outline& outline, std::mt19937& random) {
  const OutlineTree& tree = outline.trees[random() % outline.trees.size()];
  const auto any = [&]() -> std::uint32_t {
    return tree.nodes.empty() ? tree.element : tree.nodes[random() % tree.nodes.size()].element;
  };
  const Slot slot{random() % 8 == 0 ? tree.element : any(), random() % 4};
  static const char* const kPasted[] = {
      "<AlwaysSuccess/>", "<!-- why -->\n<Fallback name=\"pasted\">\n    <AlwaysFailure/>\n</Fallback>",
      "<A/><B x='1'/>",
      R"(<root BTCPP_format="4"><BehaviorTree ID="Elsewhere"><Inverter><A/></Inverter></BehaviorTree></root>)"};
  const std::vector<std::uint32_t> several{any(), any(), any()};
  switch (random() % 17) {
    case 12: return EditNodes{several, DeleteNode{}};
    case 13: return EditNodes{several, MoveNode{0, slot, random() % 2 == 0}};
    case 14: return EditNodes{several, WrapNode{0, "Fallback"}};
    case 15: return EditNodes{several, UnwrapNode{}};
    case 16: return EditNodes{several, SetAttribute{0, "_skipIf", "true"}};
    case 0: return InsertNode{random() % 2 == 0 ? "Sequence" : "AlwaysSuccess", false, "made", {}, slot};
    case 1: return DeleteNode{any()};
    case 2: return MoveNode{any(), slot, false};
    case 3: return MoveNode{any(), slot, true};
    case 4: return WrapNode{any(), random() % 2 == 0 ? "Fallback" : "Inverter"};
    case 5: return UnwrapNode{any()};
    case 6: return ExtractTree{any(), "Part" + std::to_string(random() % 1000)};
    case 7: return InlineTree{any()};
    case 8: return PasteNodes{kPasted[random() % std::size(kPasted)], slot};
    case 9: return AddTree{"Tree" + std::to_string(random() % 1000)};
    case 10: return DeleteTree{tree.element};
    default: return SetAttribute{any(), "name", "called \"" + std::to_string(random() % 100) + "\""};
  }
}

std::string signs(std::string_view text) {
  std::string kept;
  for (const char c : text) {
    if (c != ' ' && c != '\t' && c != '\n' && c != '\r') kept += c;
  }
  return kept;
}

TEST(TreeEdit, SeveralNodesMoveTogetherInTheirOrder) {
  const std::uint32_t all = element(kFile, "All");
  const std::vector<std::uint32_t> nodes{element(kFile, "Inverter"), element(kFile, "A")};
  // Into another tree, one of them from a line of its own, where all stand in one line.
  const auto moved =
      edit_tree(kFile, EditNodes{nodes, MoveNode{0, {element(kFile, "Fallback"), 1}, false}}, builtin_kinds()).value();
  const std::string after = with_edits(kFile, moved.edits).value();
  EXPECT_EQ(moved.name, "move 2 nodes under Fallback");
  EXPECT_THAT(after, HasSubstr("<B name=\"b1\"/><A x='1'   y=\"2\"/><Inverter>"));
  EXPECT_THAT(after, HasSubstr("      <!-- first -->\n       <!-- behind A -->\n      <SubTree"));
  ASSERT_EQ(moved.nodes.size(), 2U);
  EXPECT_EQ(moved.nodes[0], element(after, "A"));
  EXPECT_EQ(moved.nodes[1], element(after, "Inverter"));
  // Behind what follows them; nothing else is touched.
  EXPECT_EQ(
      edited(kFile, EditNodes{{element(kFile, "Inverter"), element(kFile, "Other")}, MoveNode{0, {all, 1}, true}}),
      with(kFile, "<!-- behind A -->\n",
           "<!-- behind A -->\n      <Inverter>\n        <B/>\n      </Inverter>\n      <SubTree ID=\"Other\"/>\n"));
  // Where they are already, wherever between them.
  for (std::size_t index : {0U, 1U, 2U})
    EXPECT_EQ(edited(kFile, EditNodes{nodes, MoveNode{0, {all, index}, false}}), "they are there already") << index;
  EXPECT_THAT(edited(kFile, EditNodes{{all, element(kFile, "A")}, MoveNode{0, {element(kFile, "Inverter"), 0}, false}}),
              HasSubstr("cannot go into itself"));
  EXPECT_THAT(edited(kFile, EditNodes{nodes, MoveNode{0, {element(kFile, "Inverter"), 0}, true}}),
              HasSubstr("takes one child only"));
}

TEST(TreeEdit, SeveralNodesGoTogether) {
  const std::vector<std::uint32_t> nodes{element(kFile, "B"), element(kFile, "Inverter"), element(kFile, "Other")};
  EXPECT_EQ(edited(kFile, EditNodes{nodes, DeleteNode{}}),
            with(with(kFile, "      <Inverter>\n        <B/>\n      </Inverter>\n", ""),
                 "      <SubTree ID=\"Other\"/>\n", ""));
  // All that was in it.
  EXPECT_EQ(edited(kFile, EditNodes{{element(kFile, "b1"), element(kFile, "b2")}, DeleteNode{}}),
            with(kFile, "<Fallback><B name=\"b1\"/><B name=\"b2\"/></Fallback>", "<Fallback/>"));
  EXPECT_EQ(edited(kFile, EditNodes{{}, DeleteNode{}}), "no node is chosen");
  EXPECT_THAT(edited(kFile, EditNodes{{element(kFile, "A"), 1000}, DeleteNode{}}), HasSubstr("no such node"));
}

TEST(TreeEdit, NeighboursAreWrappedInOneNode) {
  const std::uint32_t a = element(kFile, "A");
  const std::uint32_t inverter = element(kFile, "Inverter");
  const std::string wrapped = edited(kFile, EditNodes{{inverter, a}, WrapNode{0, "Fallback"}});
  EXPECT_EQ(
      wrapped,
      with(kFile, "      <A x='1'   y=\"2\"/> <!-- behind A -->\n      <Inverter>\n        <B/>\n      </Inverter>\n",
           "      <Fallback>\n        <A x='1'   y=\"2\"/> <!-- behind A -->\n        <Inverter>\n"
           "          <B/>\n        </Inverter>\n      </Fallback>\n"));
  EXPECT_EQ(edited(wrapped, UnwrapNode{element(wrapped, "Fallback")}), kFile);
  EXPECT_EQ(edited(kFile, EditNodes{{a, element(kFile, "Other")}, WrapNode{0, "Fallback"}}),
            "Inverter stands between them; choose it too");
  EXPECT_THAT(edited(kFile, EditNodes{{a, element(kFile, "b1")}, WrapNode{0, "Fallback"}}),
              HasSubstr("different nodes"));
  EXPECT_EQ(edited(kFile, EditNodes{{a, inverter}, WrapNode{0, "Inverter"}}), "Inverter takes one child only");
}

TEST(TreeEdit, SeveralNodesGetAnAttribute) {
  const std::vector<std::uint32_t> nodes{element(kFile, "b1"), element(kFile, "b2")};
  const std::string skipped = edited(kFile, EditNodes{nodes, SetAttribute{0, "_skipIf", "true"}});
  EXPECT_EQ(skipped, with(kFile, "<B name=\"b1\"/><B name=\"b2\"/>",
                          "<B name=\"b1\" _skipIf=\"true\"/><B name=\"b2\" _skipIf=\"true\"/>"));
  EXPECT_EQ(edited(skipped, EditNodes{nodes, SetAttribute{0, "_skipIf", std::nullopt}}), kFile);
  EXPECT_EQ(edited(skipped, EditNodes{nodes, SetAttribute{0, "_skipIf", "true"}}), "it is so already");
  EXPECT_EQ(edited(kFile, EditNodes{nodes, SetAttribute{0, "name", "b"}}), "2 nodes cannot have one name");
}

TEST(TreeEdit, EditsLeastAndUndoesToIdenticalBytesWhateverTheGesture) {
  const auto seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  const auto files = mission_files();
  ASSERT_GE(files.size(), 5U);
  std::map<std::size_t, int> kinds;  // done, by kind of gesture
  for (const auto& file : files) {
    SCOPED_TRACE(file.string());
    std::mt19937 random(seed);
    const std::string original = text::read_file(file).value();
    std::string now = original;
    std::vector<TextEdits> back;
    int done = 0;
    int tried = 0;
    for (; done < 200 && tried < 5000; ++tried) {
      const Outline outline = outline_of(now, builtin_kinds()).value();
      ASSERT_FALSE(outline.trees.empty());
      const TreeGesture gesture = any_gesture(outline, random);
      const auto result = edit_tree(now, gesture, builtin_kinds());
      if (!result) {
        EXPECT_FALSE(result.error().message.empty());
        continue;
      }
      SCOPED_TRACE(result->name);
      const std::string after = with_edits(now, result->edits).value();
      // Still a document; its size stays bounded by the deletions.
      ASSERT_TRUE(text::XmlDocument::parse(after)) << after;
      // What is outside the trees is the same.
      ASSERT_EQ(after.substr(0, outline.trees.front().from), now.substr(0, outline.trees.front().from));
      ASSERT_TRUE(after.ends_with(std::string_view(now).substr(outline.trees.back().to)));
      // Wrapping and unwrapping add and take one node; all other signs stay in their order.
      if (const auto* wrap = std::get_if<WrapNode>(&gesture)) {
        std::string added = signs(after);
        const std::string tag = "<" + wrap->id + ">";
        const std::string end = "</" + wrap->id + ">";
        ASSERT_EQ(added.size(), signs(now).size() + tag.size() + end.size());
      }
      if (std::holds_alternative<MoveNode>(gesture) && !std::get<MoveNode>(gesture).copy) {
        // An empty element gets an end tag when something comes into it, and has none when all has gone.
        const auto elements = [](const std::string& xml) { return text::XmlDocument::parse(xml)->root().size(); };
        ASSERT_EQ(elements(after), elements(now));
      }
      ++kinds[gesture.index()];
      // Edits are no larger than the element that is touched.
      std::size_t removed = 0;
      for (const TextEdit& edit : result->edits) removed += edit.to - edit.from;
      // What comes takes nothing away but the end of an empty element; what goes brings nothing.
      if (std::holds_alternative<PasteNodes>(gesture)) {
        ASSERT_LE(removed, std::string_view("/>").size());
      } else if (std::holds_alternative<AddTree>(gesture)) {
        ASSERT_EQ(removed, 0U);
      }
      if (const auto* gone = std::get_if<DeleteTree>(&gesture)) {
        const auto tree = std::find_if(outline.trees.begin(), outline.trees.end(),
                                       [&](const OutlineTree& one) { return one.element == gone->tree; });
        for (const TextEdit& edit : result->edits) ASSERT_EQ(edit.text, "");
        ASSERT_EQ(signs(after).size(), signs(now).size() - signs(now.substr(tree->from, tree->to - tree->from)).size());
      }
      if (const auto* set = std::get_if<SetAttribute>(&gesture)) {
        for (const OutlineTree& tree : outline.trees) {
          for (const OutlineNode& node : tree.nodes) {
            if (node.element != set->node) continue;
            for (const TextEdit& edit : result->edits) {
              ASSERT_GE(edit.from, node.from);
              ASSERT_LE(edit.to, node.open_end);
            }
          }
        }
      }
      back.push_back(inverse(now, result->edits));
      ASSERT_EQ(with_edits(after, back.back()).value(), now);
      now = after;
      ++done;
      if (now.size() > original.size() + 20'000) {  // copies of copies
        now = with_edits(now, back.back()).value();
        back.pop_back();
      }
    }
    EXPECT_EQ(done, 200) << "after " << tried;
    while (!back.empty()) {
      now = with_edits(now, back.back()).value();
      back.pop_back();
    }
    EXPECT_EQ(now, original);
  }
  EXPECT_EQ(kinds.size(), std::variant_size_v<TreeGesture>) << "each kind has been done";
}

}  // namespace
}  // namespace sentree::design
