#include "sentree/lsp/rename.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <random>
#include <set>

#include "sentree/base/temporary_folder.h"
#include "sentree/project/part_cache.h"
#include "sentree/project/plan.h"
#include "sentree/text/file.h"

namespace sentree::lsp {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A project on disk, in which things are called otherwise.
class Renamed {
 public:
  /// Of an example, with the others beside it.
  explicit Renamed(const std::string& example) : copy_("renaming") {
    const fs::path examples = project::shipped_folder("examples");
    const fs::path folder = fs::canonical(copy_.path());
    for (const auto& entry : fs::directory_iterator(examples)) {
      if (entry.path().filename() != example) fs::create_symlink(entry.path(), folder / entry.path().filename());
    }
    folder_ = folder / example;
    fs::copy(examples / example, folder_, fs::copy_options::recursive);
    fs::remove_all(folder_ / "runs");
  }

  [[nodiscard]] const fs::path& folder() const { return folder_; }
  void write(const std::string& file, const std::string& text) const {
    fs::create_directories((folder_ / file).parent_path());
    std::ofstream(folder_ / file) << text;
  }
  [[nodiscard]] std::string text(const std::string& file) const { return text::read_file(folder_ / file).value_or(""); }
  Index& index() {
    if (!index_) index_.emplace(folder_);
    index_->refresh({});
    return *index_;
  }
  [[nodiscard]] Symbol of_file(SymbolKind kind, const std::string& file, const std::string& name) const {
    return {kind, fmt::format("{}#{}", (folder_ / file).string(), name)};
  }

  /// Carries it out; says why not.
  std::string rename(const Symbol& symbol, const std::string& name) {
    const auto renaming = lsp::rename(index(), symbol, name);
    if (!renaming) return renaming.error().message;
    for (const auto& [file, edits] : renaming->edits)
      std::ofstream(file) << design::with_edits(index_->find(file)->text, edits).value();
    for (const auto& [from, to] : renaming->files) fs::rename(from, to);
    return {};
  }

  [[nodiscard]] std::vector<Diagnostic> findings() { return project::check_project(folder_, cache_); }

 private:
  TemporaryFolder copy_;
  fs::path folder_;
  std::optional<Index> index_;
  project::PartCache cache_;
};

std::vector<std::string> messages(const std::vector<Diagnostic>& findings) {
  std::vector<std::string> found;
  for (const Diagnostic& finding : findings) found.push_back(finding.code + " " + finding.message);
  return found;
}

// None is like another: names that are nearly alike are taken for slips.
std::string fresh_name(std::mt19937& random) {
  std::string name = "z";
  while (name.size() < 12) name += static_cast<char>('a' + random() % 26);
  return name;
}

// What the projects that come with Sentree call things, one after the other.
class EachExample : public ::testing::TestWithParam<std::string> {};

TEST_P(EachExample, HasTheSameFindingsWhateverItCallsThings) {
  Renamed project(GetParam());
  const auto before = messages(project.findings());
  std::set<Symbol> symbols;
  for (const auto& [file, content] : project.index().files()) {
    for (const Occurrence& occurrence : content.occurrences) symbols.insert(occurrence.symbol);
  }
  constexpr unsigned kSeed = 7;
  std::mt19937 random(kSeed);
  int renamed = 0;
  std::map<std::string, std::string> called;
  const auto now = [&](Symbol symbol) {
    const auto chart = called.find(symbol.name.substr(0, symbol.name.rfind('#')));
    if (chart != called.end()) symbol.name.replace(0, chart->first.size(), chart->second);
    return symbol;
  };
  for (const Symbol& earlier : symbols) {
    const Symbol symbol = now(earlier);
    if (!may_rename(project.index(), symbol)) continue;
    const std::size_t places = project.index().places_of(symbol).size();
    const std::string name = fresh_name(random);
    ++renamed;
    const std::string chart = symbol.kind == SymbolKind::kSkill ? project.index().chart_of(symbol.name) : "";
    const std::string what = fmt::format("{} ({}) -> {}", symbol.name, static_cast<int>(symbol.kind), name);
    const std::string refused = project.rename(symbol, name);
    if (!refused.empty()) {
      EXPECT_THAT(refused, HasSubstr("texts do not tell")) << what;
      continue;
    }
    if (!chart.empty() && !fs::exists(chart)) called[chart] = fs::path(chart).parent_path() / (name + ".scxml");
    const Symbol after{symbol.kind, symbol.name.find('#') == std::string::npos
                                        ? name
                                        : symbol.name.substr(0, symbol.name.rfind('#') + 1) + name};
    EXPECT_EQ(project.index().places_of(after).size(), places) << what;
    EXPECT_TRUE(project.index().places_of(symbol).empty()) << what;
    const auto findings = messages(project.findings());
    ASSERT_EQ(findings.size(), before.size()) << what << ": " << ::testing::PrintToString(findings);
  }
  EXPECT_GT(renamed, 3);
}

std::vector<std::string> examples() {
  std::vector<std::string> found;
  for (const auto& entry : fs::directory_iterator(project::shipped_folder("examples"))) {
    if (fs::exists(entry.path() / "sentree.yaml")) found.push_back(entry.path().filename().string());
  }
  std::sort(found.begin(), found.end());
  return found;
}

INSTANTIATE_TEST_SUITE_P(Renaming, EachExample, ::testing::ValuesIn(examples()), [](const auto& example) {
  std::string name = example.param;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

// ---- Requirements ----

constexpr const char* kTwelve = "requirements/twelve.req";

TEST(RenamingInRequirements, OfADefinitionLeavesMembersAlone) {
  Renamed project("guard");
  const auto before = messages(project.findings());
  const std::string file = "requirements/guard.req";
  EXPECT_EQ(project.rename(project.of_file(SymbolKind::kDefinition, file, "floor"), "level"), "");
  EXPECT_THAT(project.text(file), AllOf(HasSubstr("let level"), HasSubstr(".floor")));
  EXPECT_EQ(messages(project.findings()), before);
}

TEST(RenamingInRequirements, OfAServiceLeavesDefinitionsAlone) {
  Renamed project("requirements");
  EXPECT_EQ(project.rename({SymbolKind::kService, "battery"}, "power"), "");
  EXPECT_THAT(project.text(kTwelve), AllOf(HasSubstr("let battery.level [%] = reply(power.getBatteryState)"),
                                           HasSubstr("always battery.level >= 20 %")));
  EXPECT_TRUE(project.findings().empty());
}

TEST(RenamingInRequirements, OfADottedDefinitionChangesAllOfItsName) {
  Renamed project("requirements");
  EXPECT_EQ(project.rename(project.of_file(SymbolKind::kDefinition, kTwelve, "battery.level"), "charge.now"), "");
  EXPECT_THAT(project.text(kTwelve), AllOf(HasSubstr("let charge.now [%] = reply(battery."),
                                           HasSubstr("always charge.now >= 20 %"), HasSubstr("rises(charge.now < ")));
  EXPECT_TRUE(project.findings().empty());
}

TEST(RenamingInRequirements, OfADefinitionLeavesWordsOfTheLanguageAlone) {
  Renamed project("requirements");
  EXPECT_EQ(project.rename(project.of_file(SymbolKind::kDefinition, kTwelve, "at"), "near"), "");
  EXPECT_THAT(project.text(kTwelve), AllOf(HasSubstr("let near(place)"), HasSubstr("or near(station)"),
                                           HasSubstr("at least every 2 s"), HasSubstr("at most 3 times")));
  EXPECT_TRUE(project.findings().empty());
}

TEST(RenamingInRequirements, TellsValuesEventsAndParametersApart) {
  Renamed project("requirements");
  project.write(kTwelve, project.text(kTwelve) + "let place = speed * 2\nR13: always place > 3 and at(goal).\n");
  EXPECT_EQ(project.rename(project.of_file(SymbolKind::kDefinition, kTwelve, "place"), "three"), "");
  EXPECT_THAT(project.text(kTwelve), AllOf(HasSubstr("let at(place)"), HasSubstr("where args.name = place)"),
                                           HasSubstr("event place"), HasSubstr("event(pick) and event(place)"),
                                           HasSubstr("let three = speed * 2\nR13: always three > 3")));
  EXPECT_TRUE(project.findings().empty());
  EXPECT_EQ(project.rename(project.of_file(SymbolKind::kEvent, kTwelve, "place"), "put"), "");
  EXPECT_THAT(project.text(kTwelve), AllOf(HasSubstr("let at(place)"), HasSubstr("event put "), HasSubstr("event(put)"),
                                           HasSubstr("request(arm.place)")));
}

TEST(RenamingInRequirements, IsRefusedWhereTheNameWouldMeanSomethingElse) {
  Renamed project("requirements");
  const Symbol speed = project.of_file(SymbolKind::kDefinition, kTwelve, "speed");
  for (const char* word : {"never", "always", "request"}) {
    EXPECT_THAT(project.rename(speed, word), HasSubstr("a word of the language")) << word;
    EXPECT_THAT(project.rename({SymbolKind::kRequirement, "R1"}, word), HasSubstr("a word of the language")) << word;
  }
  EXPECT_THAT(project.rename(speed, "goal"), HasSubstr("stands for something else")) << "nav.dest = goal";
  EXPECT_THAT(project.rename(speed, "goals"), HasSubstr("could not be read")) << "goal reads like a slip of it";
  EXPECT_THAT(project.rename(speed, "charging"), HasSubstr("is there already"));
  EXPECT_EQ(project.rename(speed, "at_what_speed"), "");
}

// ---- Paths, scenarios, outcomes ----

TEST(RenamingOfNodes, FollowsPathsAndBreakpoints) {
  Renamed project("handover");
  project.write("mission.xml",
                "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\"><Sequence>"
                "<SubTree ID=\"Visit\" name=\"North\"/><SubTree ID=\"Visit\"/></Sequence></BehaviorTree>"
                "<BehaviorTree ID=\"Visit\"><Inspect name=\"Look Up\"/></BehaviorTree></root>");
  project.write("skills/Inspect.scxml",
                "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" name=\"Inspect\">"
                "<state id=\"looking\"/><final id=\"success\"/></scxml>");
  project.write("requirements/paths.req",
                "a: never reply(camera.look from North.Look_Up) = 1.\n"
                "b: always observation(Visit.Look_Up.tick.reply).status = OK.\n");
  project.write("scenarios/paths.yaml",
                "timeline:\n  - {at: 1 s, breakpoint: {chart: \"skill:North.Look_Up\", state: looking}}\n"
                "  - {at: 1 s, breakpoint: {node: North.Look Up, status: RUNNING}}\n"
                "delays:\n  - {message: North.Look_Up.halt, by: 30 ms}\n");
  const std::string requirements = (project.folder() / "requirements/paths.req").string();
  const auto symbol_of = [&](const std::string& word) {
    const Occurrence* const found =
        project.index().at(requirements, project.text("requirements/paths.req").find(word) + 1);
    return found != nullptr ? found->symbol : Symbol();
  };
  EXPECT_EQ(symbol_of("North.Look_Up"), (Symbol{SymbolKind::kNode, "North"}));
  EXPECT_EQ(symbol_of("Look_Up)"), (Symbol{SymbolKind::kNode, "Look Up"}));
  EXPECT_EQ(project.rename({SymbolKind::kNode, "North"}, "South"), "");
  EXPECT_EQ(project.rename({SymbolKind::kNode, "Look Up"}, "See It"), "");
  EXPECT_EQ(project.rename({SymbolKind::kTree, "Visit"}, "Call"), "");
  EXPECT_EQ(project.rename(project.of_file(SymbolKind::kState, "skills/Inspect.scxml", "looking"), "seeing"), "");
  EXPECT_THAT(project.text("requirements/paths.req"),
              AllOf(HasSubstr("from South.See_It)"), HasSubstr("observation(Call.See_It.tick.reply)")));
  EXPECT_THAT(project.text("scenarios/paths.yaml"),
              AllOf(HasSubstr("{chart: \"skill:South.See_It\", state: seeing}"), HasSubstr("node: South.See It,"),
                    HasSubstr("message: South.See_It.halt")));
}

TEST(RenamingOfStates, FollowsScriptsBlanksAndNamesWithDots) {
  Renamed project("handover");
  project.write("skills/Inspect.scxml",
                "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" name=\"Inspect\" "
                "datamodel=\"ecmascript\" initialstate=\"looking\"><script><![CDATA[var a = 1 && In( \"looking\" ); // "
                "In('looking')\n]]></script>"
                "<state id=\"looking\"><transition cond=\"!In( 'looking' )\" target=\"l&#246;ok\"/></state>"
                "<state id=\"l&#246;ok\"/><final id=\"success\"/></scxml>");
  const std::string file = "skills/Inspect.scxml";
  EXPECT_EQ(project.rename(project.of_file(SymbolKind::kState, file, "looking"), "look.up"), "");
  EXPECT_THAT(project.text(file), AllOf(HasSubstr("In( \"look.up\" ); // In('looking')"), HasSubstr(" id=\"look.up\""),
                                        HasSubstr("initialstate=\"look.up\""), HasSubstr("cond=\"!In( 'look.up' )\"")));
  EXPECT_EQ(project.rename(project.of_file(SymbolKind::kState, file, "look.up"), "seeing"), "");
  EXPECT_EQ(project.rename(project.of_file(SymbolKind::kState, file, "l\u00F6ok"), "plain"), "");
  EXPECT_THAT(project.text(file),
              AllOf(HasSubstr("id=\"seeing\""), HasSubstr("target=\"plain\""), HasSubstr("<state id=\"plain\"/>")));
}

TEST(RenamingOfStates, TellsOfWhatMayMeanThemAndIsNotFollowed) {
  Renamed project("handover");
  project.write(
      "skills/Inspect.scxml",
      "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" name=\"Inspect\" "
      "datamodel=\"ecmascript\"><datamodel><data id=\"next\" expr=\"'looking'\"/></datamodel>\n"
      "<script><![CDATA[var a = In('looking'); // 'looking' in a comment\nvar b = 'it is looking';]]></script>"
      "<state id=\"looking\"><transition cond=\"In(next) || In('look' + 'ing')\" target=\"other\"/>"
      "<transition cond=\"_event.name == &quot;done.state.looking&quot;\" target=\"other\"/></state>"
      "<state id=\"other\"/><final id=\"success\"/></scxml>");
  const auto told = [&](const Symbol& symbol) {
    std::vector<std::string> all;
    for (const Unfollowed& one : unfollowed(project.index(), symbol)) all.push_back(one.what);
    return all;
  };
  const std::string file = "skills/Inspect.scxml";
  const std::string computed = "In(…) of an expression";
  EXPECT_THAT(told(project.of_file(SymbolKind::kState, file, "looking")),
              ElementsAre("'looking'", computed, computed, "'done.state.looking'"));
  EXPECT_THAT(told(project.of_file(SymbolKind::kState, file, "other")), ElementsAre(computed, computed));
  EXPECT_THAT(told({SymbolKind::kLocation, "looking"}), IsEmpty());
}

TEST(RenamingOfTrees, FindsThemByWhatReferencesMean) {
  Renamed project("handover");
  project.write("mission.xml",
                "<root BTCPP_format=\"4\" main_tree_to_execute=\"M\u00E4in\"><BehaviorTree ID=\"M&#228;in\"><SubTree "
                "ID=\"V&#xE4;\" name=\"A &amp; B\"/></BehaviorTree><BehaviorTree ID=\"V\u00E4\"><AlwaysSuccess/>"
                "</BehaviorTree></root>");
  EXPECT_EQ(project.rename({SymbolKind::kTree, "M\u00E4in"}, "Main"), "");
  EXPECT_EQ(project.rename({SymbolKind::kTree, "V\u00E4"}, "Visit"), "");
  EXPECT_EQ(project.rename({SymbolKind::kNode, "A & B"}, "Both"), "");
  EXPECT_EQ(project.text("mission.xml"),
            "<root BTCPP_format=\"4\" main_tree_to_execute=\"Main\"><BehaviorTree ID=\"Main\"><SubTree ID=\"Visit\" "
            "name=\"Both\"/></BehaviorTree><BehaviorTree ID=\"Visit\"><AlwaysSuccess/></BehaviorTree></root>");
}

TEST(RenamingOfNodes, TakesNamesOfAllKindsWhereTheyCanStand) {
  Renamed project("recharge");
  const std::string file = "requirements/named.req";
  project.write(file, "a: never request(battery.getBatteryState from BatteryLevelAbove30).\n");
  const Symbol node{SymbolKind::kNode, "BatteryLevelAbove30"};
  for (const char* name : {"a.b", "a/b", "{x}", "*"})
    EXPECT_THAT(project.rename(node, name), HasSubstr("has a meaning in paths")) << name;
  EXPECT_THAT(project.rename(node, "a\nb"), HasSubstr("is no name for it"));
  EXPECT_EQ(project.rename(node, "a \"b\" <c> & 'd'"), "");
  EXPECT_THAT(project.text("mission.xml"), HasSubstr("name=\"a &quot;b&quot; &lt;c&gt; &amp; 'd'\""));
  EXPECT_THAT(project.text(file), HasSubstr("from a__b___c_____d_)"));
  EXPECT_EQ(project.rename({SymbolKind::kNode, "a \"b\" <c> & 'd'"}, "BatteryLevelAbove30"), "");
  EXPECT_THAT(project.text(file), HasSubstr("from BatteryLevelAbove30)"));
}

TEST(RenamingOfServices, ChangesWhatIsKilledUnlessAProcessIsCalledSo) {
  Renamed project("modelled");
  project.write("scenarios/process.yaml",
                "processes:\n  door: {component: sim, listen: \"unix:{run}/a.sock\"}\n"
                "timeline:\n  - {at: 0 s, kill: door}\n");
  EXPECT_EQ(project.rename({SymbolKind::kService, "door"}, "gate"), "");
  EXPECT_THAT(project.text("scenarios/no-door.yaml"), HasSubstr("kill: gate}"));
  EXPECT_THAT(project.text("scenarios/process.yaml"), HasSubstr("kill: door}"));
}

TEST(RenamingInScenarios, ReachesThoseInOtherFolders) {
  Renamed project("recharge");
  EXPECT_EQ(project.rename({SymbolKind::kService, "battery"}, "accumulator"), "");
  EXPECT_THAT(project.text("hosts/experiment1.yaml"), HasSubstr("    accumulator: {at: \"tcp://robot:9090\"}"));
  EXPECT_EQ(project.rename({SymbolKind::kRequirement, "turns_to_station_as_published"}, "turns"), "");
  EXPECT_THAT(project.text("requirements/published.yaml"), HasSubstr("monitors: {turns: undecided}"));
}

TEST(RenamingOfSkills, ChangesPathsOfTheChart) {
  Renamed project("recharge");
  EXPECT_EQ(project.rename({SymbolKind::kSkill, "BatteryLevelAbove-buggy"}, "Hasty"), "");
  EXPECT_THAT(project.text("scenarios/experiment2.yaml"), HasSubstr("file: skills/Hasty.scxml"));
  EXPECT_TRUE(project.findings().empty());
}

TEST(RenamingOfStates, IsRefusedWhereTheNameSaysSomething) {
  Renamed recharge("recharge");
  Renamed living("living-skills");
  const auto refusal = [](Renamed& project, const std::string& file, const std::string& state) {
    const auto may = may_rename(project.index(), project.of_file(SymbolKind::kState, file, state));
    return may ? "" : may.error().message;
  };
  for (const char* outcome : {"success", "failure", "halted"})
    EXPECT_THAT(refusal(recharge, "skills/GoToLocation.scxml", outcome), HasSubstr("an outcome of a skill"));
  EXPECT_EQ(refusal(recharge, "skills/GoToLocation.scxml", "moving"), "");
  EXPECT_EQ(refusal(recharge, "monitors/battery.scxml", "failure"), "") << "sentree.yaml names it, and follows";
  EXPECT_THAT(refusal(living, "skills/Visit.scxml", "failure"), HasSubstr("a protocol"));
}

TEST(RenamingOfSkills, IsRefusedWhereTheProjectDoesNotHaveThem) {
  Renamed project("nav2");
  const auto may = may_rename(project.index(), {SymbolKind::kSkill, "BackUp"});
  ASSERT_FALSE(may);
  EXPECT_THAT(may.error().message, HasSubstr("no chart of this project"));
  const auto service = may_rename(project.index(), {SymbolKind::kService, "navigation"});
  ASSERT_FALSE(service);
  EXPECT_THAT(service.error().message, HasSubstr("comes with Sentree"));
}

}  // namespace
}  // namespace sentree::lsp
