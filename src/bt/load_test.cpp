#include "sentree/bt/load.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <ostream>
#include <string>

#include "sentree/base/temporary_folder.h"
#include "sentree/bt/detail/test_support.h"
#include "sentree/bt/runner.h"
#include "sentree/bt/script.h"

namespace sentree::bt {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

struct Broken {
  std::string xml;
  std::string message;

  // The name of the test case.
  friend void PrintTo(const Broken& broken, std::ostream* out) { *out << broken.message; }
};

class BrokenTree : public ::testing::TestWithParam<Broken> {};

TEST_P(BrokenTree, IsRefusedOrWarnedAboutWithPlaceAndWayOut) {
  EXPECT_THAT(messages(GetParam().xml), HasSubstr(GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    Load, BrokenTree,
    ::testing::Values(
        Broken{"<root><a></root>", "m.xml:1:"},
        Broken{"<tree/>", "m.xml:1:1: the root element is <tree>; a tree's is <root>"},
        Broken{in_tree("<Sequnce><AlwaysSuccess/></Sequnce>"),
               "m.xml:2:25: there is no node \"Sequnce\"; did you mean \"Sequence\"?"},
        Broken{in_tree("<Sequence/>"), "m.xml:2:25: Sequence has 0 children; a control node has at least one child"},
        Broken{in_tree("<Inverter><AlwaysSuccess/><AlwaysSuccess/></Inverter>"), "a decorator has exactly one child"},
        Broken{in_tree("<AlwaysSuccess><AlwaysSuccess/></AlwaysSuccess>"), "a leaf has no children"},
        Broken{in_tree("<AlwaysSuccess/><AlwaysSuccess/>"), "m.xml:2:41: BehaviorTree \"Main\" has a second root node"},
        Broken{in_tree("<Repeat num_cycle=\"2\"><AlwaysSuccess/></Repeat>"),
               "m.xml:2:33: Repeat has no port \"num_cycle\"; did you mean \"num_cycles\"?"},
        Broken{in_tree("<Repeat num_cycles=\"two\"><AlwaysSuccess/></Repeat>"),
               "port \"num_cycles\" of Repeat: \"two\" is no int"},
        Broken{in_tree("<AlwaysSuccess _skipif=\"1\"/>"),
               "m.xml:2:40: warning: attribute \"_skipif\" of AlwaysSuccess means nothing and is kept; did you mean "
               "\"_skipIf\"?"},
        Broken{in_tree("<AlwaysSuccess _skipIf=\"n >\"/>"),
               "_skipIf: script \"n >\", column 4: the script ends where a value is expected"},
        Broken{in_tree("<SubTree ID=\"Sup\"/>", "<BehaviorTree ID=\"Sub\"><AlwaysSuccess/></BehaviorTree>"),
               "there is no BehaviorTree \"Sup\"; did you mean \"Sub\"?"},
        Broken{in_tree("<SubTree ID=\"Main\"/>"), "BehaviorTree \"Main\" contains itself"},
        Broken{in_tree("<AlwaysSuccess/>", "<BehaviorTree ID=\"Main\"><AlwaysSuccess/></BehaviorTree>"),
               "there are two BehaviorTrees \"Main\"; the other is at m.xml:2:1"},
        Broken{
            in_tree("<Sequence><Action ID=\"Go\" name=\"g\"/><Action ID=\"Go\" name=\"g\"/></Sequence>"),
            "m.xml:2:61: warning: two leaves are called \"g\", this one and that at m.xml:2:35; in messages they are "
            "\"g__3\" and \"g__2\". Give one of them another name"},
        Broken{in_tree("<Sequence><SubTree ID=\"Sub\" name=\"s\"/><SubTree ID=\"Sub\" name=\"s\"/></Sequence>",
                       "<BehaviorTree ID=\"Sub\"><Action ID=\"Go\" name=\"g\"/></BehaviorTree>"),
               "m.xml:2:63: warning: two SubTrees have one name, this one and that at m.xml:2:35, which "
               "BehaviorTree.CPP 4.10 refuses; in messages their leaf \"s.g\" is \"s.g__5\" and \"s.g__3\""},
        Broken{in_tree("<Script code=\"n = 1\"/>"), "code uses entry \"n\", which nothing in the tree creates"},
        Broken{in_tree("<Sequence><AlwaysFailure/><AlwaysSuccess/></Sequence>"), "AlwaysSuccess is never reached"},
        Broken{in_tree("<Sequence><Repeat num_cycles=\"{n}\"><AlwaysSuccess/></Repeat><LoopDouble queue=\"1;2\" "
                       "value=\"{n}\"><AlwaysSuccess/></LoopDouble></Sequence>"),
               "entry \"n\" is an int for port \"num_cycles\" of Repeat and a double for port \"value\" of LoopDouble"},
        // An untyped use that comes first does not hide the clash.
        Broken{in_tree("<Sequence><SetBlackboard value=\"1\" output_key=\"{n}\"/><Repeat num_cycles=\"{n}\">"
                       "<AlwaysSuccess/></Repeat><LoopDouble queue=\"1;2\" value=\"{n}\"><AlwaysSuccess/></LoopDouble>"
                       "</Sequence>"),
               "warning: entry \"n\" is an int for port \"num_cycles\" of Repeat and a double for port \"value\""},
        Broken{in_tree("<ReactiveSequence><Action ID=\"A\"/></ReactiveSequence>"),
               "BehaviorTree.CPP 4.10 refuses <Action ID=…>"},
        Broken{in_tree("<include path=\"x.xml\"/>"), "there is no node \"include\""},
        Broken{"<root BTCPP_format=\"5\"><BehaviorTree ID=\"A\"><AlwaysSuccess/></BehaviorTree></root>",
               "BTCPP_format is \"5\"; 3 and 4 are known"},
        Broken{"<root BTCPP_format=\"4\"/>", "there is no <BehaviorTree>"}));

TEST(Load, ReportsEverythingAtOnce) {
  const std::string all =
      messages(in_tree("<Sequence><Foo/><Repeat/><AlwaysSuccess x=\"1\"/><SubTree ID=\"Nope\"/></Sequence>"));
  EXPECT_THAT(all, HasSubstr("\"Foo\""));
  EXPECT_THAT(all, HasSubstr("Repeat has 0 children"));
  EXPECT_THAT(all, HasSubstr("has no port \"x\""));
  EXPECT_THAT(all, HasSubstr("\"Nope\""));
}

TEST(Load, AsksWhoKnowsTheSkills) {
  LoadOptions options;
  options.skills = {"GoToLocation"};
  options.has_skill = [](std::string_view id, std::string_view) { return id == "GoToLocation"; };
  EXPECT_THAT(messages(in_tree("<Action ID=\"GoToLocatoin\"/>"), options),
              HasSubstr("there is no skill \"GoToLocatoin\"; did you mean \"GoToLocation\"?"));
  EXPECT_EQ(messages(in_tree("<Action ID=\"GoToLocation\"/>"), options), "");
  EXPECT_THAT(messages(in_tree("<GoToLocation/>"), options),
              HasSubstr("is \"GoToLocation\" an action or a condition?"));
}

TEST(Load, TellsATypoOfADeclaredPortFromAnAttributeThatNobodyDeclared) {
  const std::string model =
      "<TreeNodesModel><Action ID=\"Go\"><input_port name=\"destination\"/></Action></TreeNodesModel>";
  EXPECT_THAT(
      messages(in_tree("<Go destinaton=\"x\"/>", model)),
      HasSubstr("m.xml:2:29: Go has no port \"destinaton\" in the TreeNodesModel; did you mean \"destination\"?"));
  EXPECT_THAT(messages(in_tree("<Go carrier=\"x\"/>", model)),
              HasSubstr("warning: attribute \"carrier\" of Go is declared nowhere"));
}

TEST(Include, ReadsFilesRelativeToTheIncludingOneAndRefusesCycles) {
  std::map<std::string, std::string> files = {
      {"a/b.xml",
       "<root BTCPP_format=\"4\"><include path=\"c/d.xml\"/><BehaviorTree ID=\"B\"><SubTree "
       "ID=\"D\"/></BehaviorTree></root>"},
      {"a/c/d.xml", "<root BTCPP_format=\"4\"><BehaviorTree ID=\"D\"><AlwaysFailure/></BehaviorTree></root>"},
      {"loop.xml", "<root BTCPP_format=\"4\"><include path=\"loop.xml\"/></root>"}};
  LoadOptions options;
  options.read_file = [&](const std::filesystem::path& path) -> Result<std::string> {
    const auto found = files.find(path.string());
    if (found == files.end()) return fail("file.not-found", "no file " + path.string());
    return found->second;
  };
  const std::string start = "<root BTCPP_format=\"4\" main_tree_to_execute=\"Main\"><include path=\"";
  const std::string end = "\"/><BehaviorTree ID=\"Main\"><SubTree ID=\"B\"/></BehaviorTree></root>";
  auto loaded = load(start + "a/b.xml" + end, options, "m.xml");
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ(Runner(std::move(*loaded.value)).tick(), Status::kFailure);
  EXPECT_THAT(messages(start + "loop.xml" + end, options), HasSubstr("\"loop.xml\" includes itself"));
  EXPECT_THAT(messages(start + "none.xml" + end, options), HasSubstr("no file none.xml"));
}

TEST(Load, AMainTreeThatIsNotThereNamesThoseThatAre) {
  LoadOptions options;
  options.main_tree = "Main";
  const std::string trees =
      "<BehaviorTree ID=\"Visit\"><AlwaysSuccess/></BehaviorTree>"
      "<BehaviorTree ID=\"Rest\"><AlwaysSuccess/></BehaviorTree>";
  EXPECT_THAT(messages("<root BTCPP_format=\"4\">" + trees + "</root>", options),
              HasSubstr("there is no BehaviorTree \"Main\"; there is \"Visit\", \"Rest\""));
  options.main_tree = "Visti";
  EXPECT_THAT(messages("<root BTCPP_format=\"4\">" + trees + "</root>", options), HasSubstr("did you mean \"Visit\"?"));
}

TEST(Load, WithoutAMainTreeNothingIsSaidOfWhichAreUsed) {
  EXPECT_EQ(messages("<root BTCPP_format=\"4\"><BehaviorTree ID=\"A\"><AlwaysSuccess/></BehaviorTree>"
                     "<BehaviorTree ID=\"B\"><SubTree ID=\"A\"/></BehaviorTree></root>"),
            "m.xml:1:1: which of the 2 BehaviorTrees is the main one? Say so by main_tree_to_execute\n");
}

TEST(Bounds, SubTreesThatMultiplyAreRefused) {
  // Each tree holds the next one ten times: a billion nodes from twelve lines.
  std::string more;
  for (int i = 0; i < 10; ++i) {
    more += "<BehaviorTree ID=\"T" + std::to_string(i) + "\"><Sequence>";
    for (int k = 0; k < 10; ++k) {
      more += i == 9 ? "<AlwaysSuccess/>" : "<SubTree ID=\"T" + std::to_string(i + 1) + "\"/>";
    }
    more += "</Sequence></BehaviorTree>";
  }
  EXPECT_THAT(messages(in_tree("<SubTree ID=\"T0\"/>", more)), HasSubstr("the tree has more than 4000000 nodes"));
}

TEST(Bounds, SubTreesNestedTooDeeplyAreRefused) {
  std::string more;
  const int trees = static_cast<int>(kDepthMax) / 900 + 1;
  for (int i = 0; i < trees; ++i) {
    std::string body = i + 1 < trees ? "<SubTree ID=\"T" + std::to_string(i + 1) + "\"/>" : "<AlwaysSuccess/>";
    for (int k = 0; k < 900; ++k) body = "<Inverter>" + body + "</Inverter>";
    more += "<BehaviorTree ID=\"T" + std::to_string(i) + "\">" + body + "</BehaviorTree>";
  }
  EXPECT_THAT(messages(in_tree("<SubTree ID=\"T0\"/>", more)), HasSubstr("nested deeper than 4000 levels"));
}

TEST(Bounds, ScriptsNestedTooDeeplyAreRefused) {
  std::string script(1000, '(');
  EXPECT_THAT(messages(in_tree("<Script code=\"" + script + "\"/>")), HasSubstr("nested deeper than 200 levels"));
  EXPECT_THAT(messages(in_tree("<Script code=\"" + std::string(kScriptBytesMax + 1, '1') + "\"/>")),
              HasSubstr("are accepted"));
}

TEST(Tree, HoldsMoreThan65536Nodes) {
  std::string body = "<Sequence>";
  for (int i = 0; i < 70'000; ++i) body += "<AlwaysSuccess/>";
  auto loaded = load(in_tree(body + "</Sequence>"));
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ(loaded.value->size(), 70'001U);
  EXPECT_EQ(Runner(std::move(*loaded.value)).tick(), Status::kSuccess);
}

TEST(Substitution, ReplacesLeavesByTestNodes) {
  const auto rules =
      parse_substitutions(R"({"TestNodeConfigs": {"Slow": {"async_delay": 200, "return_status": "FAILURE",
      "post_script": "n := 5"}}, "SubstitutionRules": {"Do*": "Slow", "*/AlwaysFailure": "AlwaysSuccess"}})");
  ASSERT_TRUE(rules.has_value());
  LoadOptions options;
  options.substitutions = *rules;
  auto loaded = load(in_tree("<Action ID=\"DoIt\" x=\"1\"/>"), options);
  ASSERT_TRUE(loaded.ok());
  Runner runner(std::move(*loaded.value));
  using namespace std::chrono_literals;
  EXPECT_EQ(runner.tick(TimePoint(0ms)), Status::kRunning);
  EXPECT_EQ(runner.tick(TimePoint(199ms)), Status::kRunning);
  EXPECT_EQ(runner.tick(TimePoint(200ms)), Status::kFailure);
  EXPECT_EQ(*entry(runner.tree(), runner.state(), "n"), Value(5));
}

TEST(Substitution, TakesThePlaceOfAWholeBranch) {
  const auto rules = parse_substitutions(
      R"({"TestNodeConfigs": {"Skip": {"return_status": "SUCCESS", "post_script": "n := 5"}},
          "SubstitutionRules": {"counting": "Skip", "talk": "AlwaysSuccess", "no/such*": "Skip"}})");
  ASSERT_TRUE(rules.has_value());
  LoadOptions options;
  options.substitutions = *rules;
  const std::string xml = in_tree(
      "<Sequence><Sequence name=\"counting\"><AlwaysSuccess/><SubTree ID=\"Sub\"/></Sequence>"
      "<SubTree ID=\"Sub\" name=\"talk\" text=\"1\" other=\"{n}\"/><Script code=\"n += 1\"/></Sequence>",
      "<BehaviorTree ID=\"Sub\"><Script code=\"n := 100\"/></BehaviorTree>");
  EXPECT_EQ(messages(xml, options),
            "m.xml:1:1: warning: the substitution of \"no/such*\" means no node: there is none of that path or ID\n");
  auto loaded = load(xml, options, "m.xml");
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ(loaded.value->size(), 4U);
  Runner runner(std::move(*loaded.value));
  EXPECT_EQ(runner.tick(), Status::kSuccess) << (runner.error() ? to_string(*runner.error()) : "");
  EXPECT_EQ(*entry(runner.tree(), runner.state(), "n"), Value(6));
}

TEST(Substitution, RefusesWhatItDoesNotKnow) {
  EXPECT_THAT(parse_substitutions(R"({"TestNodeConfigs": {"A": {"async_dely": 1}}, "SubstitutionRules": {"x": "A"}})")
                  .error()
                  .message,
              HasSubstr("did you mean \"async_delay\"?"));
}

Loaded<Tree> look(const std::string& xml, LoadOptions options = {}) {
  options.partial = true;
  return load(xml, options, "m.xml");
}

std::string told(const Loaded<Tree>& loaded) {
  std::string all;
  for (const Diagnostic& d : loaded.diagnostics) all += to_string(d) + "\n";
  return all;
}

TEST(Partial, TakesWhatNobodyDeclaresForALeafADecoratorOrAControlNode) {
  const auto tree =
      look(in_tree("<RecoveryNode><Inverter><GoTo x=\"{y}\"/></Inverter><Rate hz=\"1\"><Spin/></Rate></RecoveryNode>"));
  ASSERT_TRUE(tree.ok()) << told(tree);
  const Tree& t = *tree.value;
  EXPECT_EQ(t.category(0), Category::kControl);
  EXPECT_TRUE(t.is_unknown(0));
  const NodeId rate = t.find("Rate");
  EXPECT_EQ(t.category(rate), Category::kDecorator);
  EXPECT_EQ(t.ports(rate).front().text, "1");
  EXPECT_TRUE(t.is_external(t.find("GoTo")));
  EXPECT_FALSE(t.is_unknown(t.find("GoTo")));
  EXPECT_THAT(told(tree), HasSubstr("m.xml:2:25: warning: there is no node \"RecoveryNode\"; it is taken for a control "
                                    "node of unknown kind"));
  EXPECT_THAT(told(tree), ::testing::Not(HasSubstr("children")));
}

TEST(Partial, CannotRunWhatIsKnownByNameOnly) {
  auto tree = look(in_tree("<Fallback><Twist><AlwaysSuccess/></Twist></Fallback>"));
  ASSERT_TRUE(tree.ok());
  Runner runner(std::move(*tree.value));
  EXPECT_EQ(runner.tick(), Status::kFailure);
  ASSERT_TRUE(runner.error());
  EXPECT_EQ(runner.error()->code, "bt.unknown-node");
}

TEST(Partial, MakesAClosedBoxOfASubTreeThatIsNotThere) {
  const auto tree = look(in_tree("<Sequence><SubTree ID=\"Dock\" where=\"{here}\"/><AlwaysSuccess/></Sequence>"));
  ASSERT_TRUE(tree.ok()) << told(tree);
  EXPECT_TRUE(tree.value->is_unknown(1));
  EXPECT_EQ(tree.value->category(1), Category::kSubTree);
  EXPECT_EQ(tree.value->subtree_id(1), "Dock");
  EXPECT_EQ(tree.value->ports(1).front().name, "where");
  EXPECT_TRUE(tree.value->children(1).empty());
  EXPECT_THAT(told(tree), HasSubstr("warning: there is no BehaviorTree \"Dock\""));
}

TEST(Partial, StillRefusesWhatIsWrong) {
  for (const std::string body :
       {"<Sequence/>", "<Inverter><Go/><Go/></Inverter>", "<Twist/><Twist/>", "<Repeat num=\"1\"><A/></Repeat>",
        "<Repeat num_cycles=\"two\"><A/></Repeat>", "<SubTree ID=\"Main\"/>", "<A _skipIf=\"n >\"/>", "<Action/>",
        "<AlwaysSuccess><A/></AlwaysSuccess>"}) {
    EXPECT_FALSE(look(in_tree(body)).ok()) << body;
  }
}

TEST(Partial, TellsAPaletteFromATree) {
  const auto loaded = look("<root><TreeNodesModel><Action ID=\"A\"/><Control ID=\"B\"/></TreeNodesModel></root>");
  EXPECT_FALSE(loaded.ok());
  EXPECT_FALSE(has_errors(loaded.diagnostics)) << told(loaded);
  EXPECT_THAT(told(loaded), HasSubstr("note: a palette of 2 nodes"));
}

TEST(Partial, ChoosesAMainTreeThatNoOtherOneUses) {
  const auto tree = look(
      "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Sub\"><AlwaysSuccess/></BehaviorTree>"
      "<BehaviorTree ID=\"Top\"><SubTree ID=\"Sub\"/></BehaviorTree></root>");
  ASSERT_TRUE(tree.ok()) << told(tree);
  EXPECT_EQ(tree.value->id(), "Top");
}

TEST(Partial, WarnsOfAnIncludeThatIsNotThereWithThePathThatWasTried) {
  LoadOptions options;
  options.read_file = [](const std::filesystem::path&) {
    return Result<std::string>(fail("file.not-found", "no such file"));
  };
  options.find_package = [](std::string_view) { return Result<std::filesystem::path>("/opt/nav"); };
  const auto tree = look(
      "<root BTCPP_format=\"4\" main_tree_to_execute=\"Main\">\n<include ros_pkg=\"nav\" path=\"t/a.xml\"/></root>",
      options);
  ASSERT_TRUE(tree.ok()) << told(tree);
  EXPECT_TRUE(tree.value->is_unknown(0));
  EXPECT_EQ(tree.value->subtree_id(0), "Main");
  EXPECT_THAT(told(tree), HasSubstr("m.xml:2:30: warning: \"/opt/nav/t/a.xml\": no such file"));
}

TEST(Partial, TakesNodesOfTheOtherFormatWithAWarning) {
  const auto old = look(
      "<root><BehaviorTree ID=\"M\"><Sequence><Script code=\"n := 1\"/><Parallel success_count=\"1\">"
      "<A/><B/></Parallel></Sequence></BehaviorTree></root>");
  ASSERT_TRUE(old.ok()) << told(old);
  EXPECT_THAT(told(old),
              HasSubstr("\"Script\" is a node of format 4, and the file is of format 3; write BTCPP_format=\"4\""));
  EXPECT_THAT(told(old), HasSubstr("Parallel has no port \"success_count\" in format 3"));
  EXPECT_TRUE(look(in_tree("<SequenceStar><A/></SequenceStar>")).ok());
}

TEST(Load, FindsTreesAndNodesInOtherFiles) {
  std::map<std::string, std::string> files = {
      {"b.xml",
       "<root BTCPP_format=\"4\"><BehaviorTree ID=\"B\"><Leaf/></BehaviorTree><BehaviorTree ID=\"Other\">"
       "<Nonsense/></BehaviorTree><TreeNodesModel><Action ID=\"Leaf\"/></TreeNodesModel></root>"}};
  Palette palette;
  palette.add({{"Go", Category::kAction, {input<std::string>("where")}, {}}});
  LoadOptions options;
  options.palette = &palette;
  options.find_tree = [](std::string_view id) {
    return id == "B" ? std::optional<std::filesystem::path>("b.xml") : std::nullopt;
  };
  options.read_file = [&](const std::filesystem::path& path) { return Result<std::string>(files.at(path.string())); };
  const auto tree =
      load(in_tree("<Sequence><SubTree ID=\"B\"/><Go where=\"x\"/><SubTree ID=\"B\" name=\"again\"/></Sequence>"),
           options, "a.xml");
  ASSERT_TRUE(tree.ok()) << told(tree);
  EXPECT_EQ(told(tree), "") << "the other tree of b.xml is not this tree's business";
  EXPECT_EQ(tree.value->span(2).file, "b.xml");
  EXPECT_TRUE(tree.value->ports(3).front().declared);
}

TEST(Load, NumbersLeavesWithoutNamesAsBehaviorTreeCppDoes) {
  const std::string sub =
      "<BehaviorTree ID=\"S\"><Sequence><Action ID=\"Go\"/><Action ID=\"Go\"/><Action "
      "ID=\"At\"/></Sequence></BehaviorTree>";
  const auto tree =
      load(in_tree("<Sequence><SubTree ID=\"S\"/><Action ID=\"Go\"/><SubTree ID=\"S\" name=\"s\"/></Sequence>", sub),
           {}, "m.xml");
  ASSERT_TRUE(tree.ok()) << told(tree);
  std::vector<std::string> paths;
  for (const NodeId leaf : tree.value->external_leaves()) paths.push_back(tree.value->path(leaf));
  EXPECT_THAT(paths,
              ::testing::ElementsAre("S::2.Go::4", "S::2.Go::5", "SubTree.At", "Go", "s.Go::10", "s.Go::11", "s.At"));
  EXPECT_EQ(tree.value->event_name(tree.value->find("s.Go::10")), "s.Go__10");
}

TEST(Load, NumbersLeavesOfOneName) {
  const auto names = [](const std::string& body, const std::string& more = "") {
    const auto tree = load(in_tree(body, more), {}, "m.xml");
    EXPECT_TRUE(tree.ok()) << told(tree);
    std::vector<std::string> all;
    for (const NodeId leaf : tree.value->external_leaves()) all.push_back(tree.value->event_name(leaf));
    return all;
  };
  const std::string go = "<Action ID=\"Go\" name=\"g\"/>";
  EXPECT_THAT(names("<Sequence>" + go + go + "<Action ID=\"At\" name=\"g\"/><Action ID=\"At\" name=\"h\"/></Sequence>"),
              ::testing::ElementsAre("g__2", "g__3", "g__4", "h"));
  // One that is called so already keeps its name.
  EXPECT_THAT(names("<Sequence>" + go + go + "<Action ID=\"Go\" name=\"g__2\"/></Sequence>"),
              ::testing::ElementsAre("g__2__2", "g__3", "g__2"));
  EXPECT_THAT(names("<Sequence><SubTree ID=\"S\" name=\"s\"/><SubTree ID=\"S\" name=\"s\"/></Sequence>",
                    "<BehaviorTree ID=\"S\">" + go + "</BehaviorTree>"),
              ::testing::ElementsAre("s.g__3", "s.g__5"));
}

TEST(Load, BeginsWithTheEntriesThatItIsGiven) {
  LoadOptions options;
  options.entries = {{"n", Value(std::int64_t{3}), {"p.yaml", 1, 1, 0}}, {"speed", Value("0.5"), {}}};
  const std::string body =
      "<Sequence><ScriptCondition code=\"n == 3\"/><SubTree ID=\"S\" name=\"s\" speed=\"{speed}\"/></Sequence>";
  const std::string more =
      "<BehaviorTree ID=\"S\"><Go speed=\"{speed}\"/></BehaviorTree><TreeNodesModel><Action ID=\"Go\"><input_port "
      "name=\"speed\" type=\"double\"/></Action></TreeNodesModel>";
  const auto tree = load(in_tree(body, more), options, "m.xml");
  ASSERT_TRUE(tree.ok()) << told(tree);
  EXPECT_EQ(told(tree), "");
  EXPECT_TRUE(tree.value->model().unwritten.empty());
  const State state(*tree.value);
  EXPECT_EQ(*entry(*tree.value, state, "n"), Value(std::int64_t{3}));
  EXPECT_EQ(*entry(*tree.value, state, "speed"), Value(0.5)) << "as the port has it";

  options.entries = {{"speed", Value("fast"), {"p.yaml", 1, 1, 0}}};
  EXPECT_THAT(
      told(load(in_tree(body, more), options, "m.xml")),
      HasSubstr(
          "p.yaml:1:1: entry \"speed\" begins with \"fast\", which is no double, as port \"speed\" of Go has it"));
  options.entries = {{"sped", Value(0.5), {"p.yaml", 1, 1, 0}}};
  EXPECT_THAT(told(load(in_tree(body, more), options, "m.xml")),
              HasSubstr("p.yaml:1:1: warning: nothing in tree \"Main\" names entry \"sped\"; did you mean \"speed\"?"));
  const std::string closed = "<SubTree ID=\"S\" name=\"s\"/>";
  options.entries = {{"speed", Value(0.5), {"p.yaml", 1, 1, 0}}};
  EXPECT_THAT(told(load(in_tree(closed, more), options, "m.xml")),
              HasSubstr("; SubTree \"s\" has one of its own: give it speed=\"{speed}\", or _autoremap=\"true\""));
}

TEST(Load, KnowsALeafByItsSkill) {
  LoadOptions options;
  options.skill_kind = [](std::string_view id, std::string_view) {
    return id == "IsAt" ? std::optional(Category::kCondition) : std::nullopt;
  };
  const auto tree = load(in_tree("<IsAt where=\"kitchen\"/>"), options, "m.xml");
  ASSERT_TRUE(tree.ok()) << told(tree);
  EXPECT_EQ(tree.value->category(0), Category::kCondition);
  EXPECT_TRUE(tree.value->is_external(0));
}

TEST(Load, TakesADefaultThatIsNoValueForDocumentation) {
  const std::string model =
      "<TreeNodesModel><Action ID=\"Go\"><input_port name=\"speed\" type=\"double\" default=\"1.0 m/s\"/>"
      "<input_port name=\"n\" type=\"int\" default=\"3\"/></Action></TreeNodesModel>";
  const auto tree = load(in_tree("<Go/>", model), {}, "m.xml");
  ASSERT_TRUE(tree.ok()) << told(tree);
  ASSERT_EQ(tree.value->ports(0).size(), 1U);
  EXPECT_EQ(tree.value->ports(0).front().text, "3");
}

TEST(Load, CountsAChildThatItDoesNotKnow) {
  EXPECT_THAT(messages(in_tree("<Inverter><Gone/></Inverter>")), ::testing::Not(HasSubstr("children")));
}

TEST(Load, TellsOfAMissingFormatWhereTheTreeWouldMeanSomethingElse) {
  const auto old = [](const std::string& root, const std::string& body) {
    return messages("<root" + root + " main_tree_to_execute=\"Main\"><BehaviorTree ID=\"Main\"><Sequence>" + body +
                    "</Sequence></BehaviorTree><BehaviorTree ID=\"Fetch\"><SetBlackboard value=\"{thing}\" "
                    "output_key=\"it\"/></BehaviorTree></root>");
  };
  const std::string cup = "<SubTree ID=\"Fetch\" thing=\"cup\"/>";
  EXPECT_THAT(old("", cup),
              HasSubstr("m.xml:1:1: warning: the file names no format, and so is of format 3, where thing=\"cup\" "
                        "(m.xml:1:96) is the name of an entry and no text; write BTCPP_format=\"4\" here"));
  EXPECT_THAT(old("", "<AlwaysSuccess _skipIf=\"true\"/>"), HasSubstr("_skipIf=\"true\""));
  for (const auto& same :
       {old(" BTCPP_format=\"3\"", cup), old(" BTCPP_format=\"4\"", cup),
        old("", "<SetBlackboard value=\"x\" output_key=\"cup\"/>" + cup),
        old("", "<SubTree ID=\"Fetch\" result=\"cup\"/>" + cup), old("", "<SubTree ID=\"Fetch\" thing=\"{cup}\"/>"),
        old("", "<SubTree ID=\"Fetch\" thing=\"thing\"/>"), old("", "<AlwaysSuccess/>")})
    EXPECT_THAT(same, ::testing::Not(HasSubstr("names no format")));
}

TEST(Load, TakesATreeThatABrokenOneNamesForPartOfIt) {
  const std::string trees =
      "<BehaviorTree ID=\"Fetch\"><SubTree ID=\"Deep\"/></BehaviorTree>"
      "<BehaviorTree ID=\"Deep\"><AlwaysSuccess/></BehaviorTree><BehaviorTree ID=\"Alone\"><AlwaysSuccess/>"
      "</BehaviorTree>";
  const std::string told = messages(in_tree("<Sequence><Gone/><SubTree ID=\"Fetch\"/></Sequence>", trees));
  EXPECT_THAT(told, HasSubstr("there is no node \"Gone\""));
  EXPECT_THAT(told, ::testing::Not(HasSubstr("\"Fetch\" is not part")));
  EXPECT_THAT(told, ::testing::Not(HasSubstr("\"Deep\" is not part")));
  EXPECT_THAT(told, HasSubstr("\"Alone\" is not part of the main tree"));
}

TEST(Load, LeavesMetadataAlone) {
  const auto tree =
      load(in_tree("<MetadataFields><Metadata runnable=\"true\"/></MetadataFields><AlwaysSuccess/>"), {}, "m.xml");
  EXPECT_TRUE(tree.ok()) << told(tree);
  EXPECT_EQ(told(tree), "");
}

TEST(RosPackages, AreLookedUpInFoldersWithOrWithoutShare) {
  const TemporaryFolder folder("packages");
  std::filesystem::create_directories(folder.path() / "share" / "nav");
  std::filesystem::create_directories(folder.path() / "arm");
  EXPECT_EQ(*find_ros_package("nav", {folder.path()}), folder.path() / "share" / "nav");
  EXPECT_EQ(*find_ros_package("arm", {folder.path()}), folder.path() / "arm");
  const auto none = find_ros_package("../arm", {folder.path()});
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, "bt.no-package");
  EXPECT_THAT(find_ros_package("gone", {folder.path()}).error().message,
              HasSubstr((folder.path() / "share" / "gone").string()));
}

}  // namespace
}  // namespace sentree::bt
