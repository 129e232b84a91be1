#include "sentree/groot/remote_tree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/bt/load.h"
#include "sentree/groot/image.h"

namespace sentree::groot {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

bt::Tree remote_tree_of(const std::string& xml) {
  auto loaded = bt::load(xml, {.partial = true});
  EXPECT_TRUE(loaded.ok()) << to_string(loaded.diagnostics[0]) << xml;
  return std::move(*loaded.value);
}

std::vector<std::string> paths(const bt::Tree& tree) {
  std::vector<std::string> all;
  for (bt::NodeId node = 0; node < tree.size(); ++node) all.push_back(tree.path(node));
  return all;
}

// As BehaviorTree.CPP 4.10 writes it: an instance of a SubTree each, and numbers that jump between them.
constexpr const char* kTree = R"(<root BTCPP_format="4">
    <BehaviorTree ID="M" _fullpath="">
        <Sequence name="root" _uid="1">
            <BatteryOk name="BatteryOk" _uid="4" min="0.3" _skipIf="n==8"/>
            <SubTree ID="Mission" _fullpath="go1" _uid="7" goal="{dock}"/>
            <SubTree ID="Mission" _fullpath="Mission::9" _uid="9" goal="kitchen"/>
            <Patiently name="wait" _uid="11"><GoTo name="GoTo" _uid="12" where="home"/></Patiently>
        </Sequence>
    </BehaviorTree>
    <BehaviorTree ID="Mission" _fullpath="go1"><GoTo name="GoTo" _uid="8" where="{goal}"/></BehaviorTree>
    <BehaviorTree ID="Mission" _fullpath="Mission::9"><GoTo name="GoTo" _uid="10" where="{goal}"/></BehaviorTree>
    <TreeNodesModel>
        <Condition ID="BatteryOk"><input_port name="min" type="double" default="0.200000">least level</input_port></Condition>
        <Action ID="GoTo"><input_port name="where" type="Pose2D"/></Action>
        <Decorator ID="Patiently"/>
        <Control ID="Sequence"/>
        <SubTree ID="SubTree"><input_port name="_autoremap" type="bool" default="false"/></SubTree>
    </TreeNodesModel>
</root>)";

TEST(RemoteTree, IsATreeOfOursWithThePublishersNumbers) {
  const auto remote = read_remote_tree(kTree);
  ASSERT_TRUE(remote.has_value()) << to_string(remote.error());
  const bt::Tree tree = remote_tree_of(remote->mission);
  EXPECT_THAT(paths(tree),
              ElementsAre("root", "BatteryOk", "go1", "go1.GoTo", "Mission::9", "Mission::9.GoTo", "wait", "GoTo"));
  EXPECT_THAT(remote->uids, ElementsAre(1, 4, 7, 8, 9, 10, 11, 12));
  EXPECT_EQ(tree.category(1), bt::Category::kCondition);
  EXPECT_EQ(tree.category(6), bt::Category::kDecorator);
  EXPECT_EQ(tree.ports(3)[0].text, "{goal}");
  std::vector<std::string> boards;
  for (const RemoteTree::Board& board : remote->boards) boards.push_back(board.name + " " + std::to_string(board.uid));
  EXPECT_THAT(boards, ElementsAre("M 0", "go1 7", "Mission::9 9"));
}

TEST(RemoteTree, MayBeReadWithoutWhatItsNodesAreGiven) {
  const auto remote = read_remote_tree(kTree, {.bare = true});
  ASSERT_TRUE(remote.has_value());
  EXPECT_THAT(remote->mission, ::testing::Not(HasSubstr("skipIf")));
  EXPECT_EQ(remote_tree_of(remote->mission).size(), remote->uids.size());
}

TEST(RemoteTree, GivesEachLeafANameOfItsOwn) {
  const std::string_view reserved[] = {"mission"};
  const auto remote = read_remote_tree(R"(<root BTCPP_format="4"><BehaviorTree ID="M" _fullpath="">
      <Sequence name="Sequence" _uid="1"><Say name="hello" _uid="2"/><Say name="hello" _uid="3"/>
      <Say name="Say" _uid="4"/><Say name="Say" _uid="5"/><Say name="mission" _uid="6"/></Sequence></BehaviorTree></root>)",
                                       {.reserved = reserved});
  ASSERT_TRUE(remote.has_value());
  const bt::Tree tree = remote_tree_of(remote->mission);
  EXPECT_THAT(paths(tree), ElementsAre("Sequence", "hello", "hello #3", "Say::4", "Say::5", "mission #6"));
}

TEST(RemoteTree, IsTheTreeThatWeDescribe) {
  const bt::Tree tree =
      remote_tree_of(R"(<root BTCPP_format="4" main_tree_to_execute="Main"><BehaviorTree ID="Main"><Sequence>
      <SubTree ID="A" name="x"/><SubTree ID="A"/><Action ID="with blank" name="w"/><Inverter><SubTree ID="B"/></Inverter>
    </Sequence></BehaviorTree>
    <BehaviorTree ID="A"><SubTree ID="B"/></BehaviorTree>
    <BehaviorTree ID="B"><Fallback><AlwaysFailure/><Action ID="Do" p="{q}"/></Fallback></BehaviorTree>
    <TreeNodesModel><Action ID="with blank"/><Action ID="Do"/></TreeNodesModel></root>)");
  const auto remote = read_remote_tree(write_xml(tree));
  ASSERT_TRUE(remote.has_value()) << to_string(remote.error());
  const bt::Tree again = remote_tree_of(remote->mission);
  ASSERT_EQ(again.size(), tree.size());
  for (bt::NodeId node = 0; node < tree.size(); ++node) {
    EXPECT_EQ(remote->uids[node], uid_of(node));
    EXPECT_EQ(again.category(node), tree.category(node));
    EXPECT_EQ(again.parent(node), tree.parent(node));
    if (tree.category(node) == bt::Category::kSubTree) continue;
    EXPECT_EQ(again.registration(node), tree.registration(node));
  }
}

TEST(RemoteTree, ThatCannotBeIsRefused) {
  for (const char* wrong :
       {"", "<a/>", "<root BTCPP_format=\"4\"/>", R"(<root BTCPP_format="4"><BehaviorTree ID="M"/></root>)",
        R"(<root BTCPP_format="4"><BehaviorTree ID="M"><AlwaysSuccess/></BehaviorTree></root>)",
        R"(<root BTCPP_format="4"><BehaviorTree ID="M"><AlwaysSuccess _uid="0"/></BehaviorTree></root>)",
        R"(<root BTCPP_format="4"><BehaviorTree ID="M"><AlwaysSuccess _uid="70000"/></BehaviorTree></root>)"})
    EXPECT_FALSE(read_remote_tree(wrong).has_value()) << wrong;
  const auto twice = read_remote_tree(R"(<root BTCPP_format="4"><BehaviorTree ID="M" _fullpath="">
      <Sequence _uid="1" name="s"><AlwaysSuccess _uid="2"/><AlwaysFailure _uid="2"/></Sequence></BehaviorTree></root>)");
  ASSERT_FALSE(twice.has_value());
  EXPECT_EQ(twice.error().message, "the publisher's tree cannot be read: several nodes have the number 2");
}

// Instances that hold each other, or one that is used many times, would make a tree without end.
TEST(RemoteTree, IsNoLargerThanWhatIsSent) {
  std::string xml = R"(<root BTCPP_format="4"><BehaviorTree ID="M" _fullpath=""><Sequence _uid="1" name="s">
      <SubTree ID="A" _fullpath="a" _uid="2"/><SubTree ID="A" _fullpath="a" _uid="3"/></Sequence></BehaviorTree>
      <BehaviorTree ID="A" _fullpath="a"><SubTree ID="A" _fullpath="a" _uid="4"/></BehaviorTree></root>)";
  const auto remote = read_remote_tree(xml);
  ASSERT_TRUE(remote.has_value());
  EXPECT_LE(remote->uids.size(), 4u);
  EXPECT_EQ(remote_tree_of(remote->mission).size(), remote->uids.size());
  std::string chain =
      R"(<root BTCPP_format="4"><BehaviorTree ID="M" _fullpath=""><SubTree ID="T" _fullpath="1" _uid="1"/></BehaviorTree>)";
  for (int i = 1; i < 3'000; ++i) {
    chain += "<BehaviorTree ID=\"T\" _fullpath=\"" + std::to_string(i) + "\"><SubTree ID=\"T\" _fullpath=\"" +
             std::to_string(i + 1) + "\" _uid=\"" + std::to_string(i + 1) + "\"/></BehaviorTree>";
  }
  EXPECT_EQ(read_remote_tree(chain + "</root>").error().code, "groot.tree");
}

}  // namespace
}  // namespace sentree::groot
