#include "sentree/lsp/server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "sentree/design/text_edit.h"
#include "sentree/lsp/detail/test_project.h"
#include "sentree/lsp/file_names.h"
#include "sentree/lsp/framing.h"
#include "sentree/lsp/lines.h"
#include "sentree/lsp/rename.h"
#include "sentree/project/intervention.h"
#include "sentree/record/observation.h"
#include "sentree/record/recorder.h"
#include "sentree/record/sink.h"
#include "sentree/text/file.h"
#include "sentree/text/overlay.h"

namespace sentree::lsp {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::Not;

std::vector<std::string> labels(const Value& completion) {
  std::vector<std::string> found;
  for (const Value& item : *completion.find("items")->as_list()) found.emplace_back(item.find("label")->text());
  return found;
}

std::string text_of(const Value& hover) {
  const Value* const text = hover.at({"contents", "value"});
  return text != nullptr ? std::string(text->text()) : "";
}

// "file:line" of each location, lines from 1.
std::vector<std::string> places(const Value& locations, const Editor& editor) {
  std::vector<std::string> found;
  for (const Value& location : *locations.as_list()) {
    const auto path = path_of(location.find("uri")->text());
    const auto inside = path->lexically_relative(editor.folder());
    found.push_back((inside.begin()->string() == ".." ? path->filename() : inside).generic_string() + ":" +
                    std::to_string(*location.at({"range", "start", "line"})->as_int() + 1));
  }
  return found;
}

// The line in which a text stands first, from 1.
std::string line_of(const std::filesystem::path& file, std::string_view wanted) {
  const std::string text = text::read_file(file).value_or("");
  const std::size_t at = text.find(wanted);
  EXPECT_NE(at, std::string::npos);
  return std::to_string(1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
}

std::vector<std::string> messages(const Value& diagnostics) {
  std::vector<std::string> found;
  for (const Value& diagnostic : *diagnostics.as_list()) found.emplace_back(diagnostic.find("message")->text());
  return found;
}

design::TextEdits edits_of(const Value& list, const std::string& text) {
  const Lines lines(text);
  design::TextEdits edits;
  const auto offset = [&](const Value& position) {
    return lines.offset(text,
                        {static_cast<std::uint64_t>(*position.find("line")->as_int()),
                         static_cast<std::uint64_t>(*position.find("character")->as_int())},
                        Units::kUtf16);
  };
  for (const Value& edit : *list.as_list())
    edits.push_back({offset(*edit.at({"range", "start"})), offset(*edit.at({"range", "end"})),
                     std::string(edit.find("newText")->text())});
  return edits;
}

// 0: it was no error.
std::int64_t code_of(const Value& answer) {
  const Value* const code = answer.at({"error", "code"});
  return code != nullptr ? *code->as_int() : 0;
}

// ---- Lifecycle ----

TEST(Server, RefusesRequestsBeforeItIsInitialized) {
  Server server("test");
  server.receive(R"({"jsonrpc":"2.0","id":1,"method":"textDocument/hover","params":{}})");
  server.receive(R"({"jsonrpc":"2.0","method":"textDocument/didOpen","params":{}})");
  while (server.has_work()) server.work();
  const auto answers = server.take_answers();
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_THAT(answers[0], HasSubstr("-32002"));
}

TEST(Server, EndsWithZeroOnlyAfterShutdown) {
  for (const bool shuts_down : {false, true}) {
    Editor editor;
    if (shuts_down) {
      EXPECT_TRUE(editor.request("shutdown", Map()).find("result")->is_null());
      EXPECT_EQ(code_of(editor.request("textDocument/hover", Map())), -32600);
    }
    editor.notify("exit", Map());
    EXPECT_TRUE(editor.server.is_over());
    EXPECT_EQ(editor.server.exit_code(), shuts_down ? 0 : 1);
  }
}

TEST(Server, AnswersWhatItDoesNotKnow) {
  Editor editor;
  EXPECT_EQ(code_of(editor.request("textDocument/foldEverything", Map())), -32601);
  EXPECT_EQ(code_of(editor.request("textDocument/hover", Map())), -32602);
  editor.notify("$/whatever", Map());
  EXPECT_TRUE(editor.unasked.empty());
}

TEST(Server, AnswersWhatIsNoRequest) {
  Server server("test");
  for (const char* text :
       {"", "{", "[]", "1", R"({"id":1})", R"({"method":1,"id":1})", R"({"method":"x","id":{}})", "\xff"})
    server.receive(text);
  while (server.has_work()) server.work();
  EXPECT_EQ(server.take_answers().size(), 8U);
}

TEST(Server, CancelsARequestThatWaits) {
  Editor editor;
  editor.open("mission.xml");
  const std::string hover =
      R"({"jsonrpc":"2.0","id":70,"method":"textDocument/hover","params":{"textDocument":{"uri":")" +
      editor.uri("mission.xml") + R"("},"position":{"line":14,"character":12}}})";
  editor.server.receive(hover);
  editor.server.receive(R"({"jsonrpc":"2.0","method":"$/cancelRequest","params":{"id":70}})");
  editor.work();
  EXPECT_EQ(code_of(editor.answers[70]), -32800);
}

TEST(Server, BoundsWhatWaits) {
  Editor editor;
  std::size_t sent = 0;
  for (; editor.server.has_room(); ++sent) {
    ASSERT_LT(sent, kWaitingMax + 1);
    editor.server.receive(R"({"jsonrpc":"2.0","id":1000,"method":"shutdown"})");
  }
  editor.server.receive(R"({"jsonrpc":"2.0","id":2000,"method":"shutdown"})");
  EXPECT_THAT(editor.server.take_answers(), Contains(HasSubstr("-32802")));
}

TEST(Server, StandsEveryRequestWithAnything) {
  constexpr unsigned kSeed = 3;
  std::mt19937 random(kSeed);
  Editor editor;
  editor.open("mission.xml");
  editor.open("skills/GoToLocation.scxml");
  const auto anything = [&](auto& self, int depth) -> Value {
    switch (random() % 8) {
      case 0: return nullptr;
      case 1: return true;
      case 2: return static_cast<std::int64_t>(random()) - 5;
      case 3: return "x";
      case 4: return editor.uri("mission.xml");
      case 5: return List{depth > 2 ? Value() : self(self, depth + 1)};
      default: {
        Map map;
        for (const char* key : {"textDocument", "uri", "position", "line", "character", "range", "start", "end",
                                "newName", "query", "command", "arguments", "contentChanges", "text", "context"}) {
          if (random() % 3 == 0 && depth < 4) map.append(key, self(self, depth + 1));
        }
        return map;
      }
    }
  };
  for (int round = 0; round < 300; ++round) {
    for (const char* method : {"textDocument/hover", "textDocument/completion", "textDocument/rename",
                               "textDocument/codeAction", "workspace/executeCommand", "textDocument/formatting"}) {
      editor.send(Map{{"jsonrpc", "2.0"}, {"id", 99}, {"method", method}, {"params", anything(anything, 0)}});
      ASSERT_TRUE(editor.answers.contains(99)) << "seed " << kSeed;
      editor.answers.clear();
    }
    editor.send(Map{{"jsonrpc", "2.0"}, {"method", "textDocument/didChange"}, {"params", anything(anything, 0)}});
  }
  EXPECT_THAT(text_of(editor.ask("hover", "skills/GoToLocation.scxml", "gotoTargetByLocationName")),
              HasSubstr("GoalReply"));
}

// ---- Diagnostics ----

TEST(Diagnostics, FollowUnsavedTextsOfSeveralFiles) {
  Editor editor;
  editor.open("mission.xml");
  EXPECT_TRUE(editor.diagnostics.empty());
  editor.open("skills/GoToLocation.scxml");
  editor.replace("skills/GoToLocation.scxml", "event=\"stopNavigation\"", "event=\"stopNavigatio\"");
  EXPECT_THAT(messages(editor.diagnostics[editor.uri("skills/GoToLocation.scxml")]),
              Contains(HasSubstr("did you mean \"stopNavigation\"")));
  editor.replace("skills/GoToLocation.scxml", "event=\"stopNavigatio\"", "event=\"stopNavigation\"");
  EXPECT_TRUE(editor.diagnostics[editor.uri("skills/GoToLocation.scxml")].as_list()->empty());
  // What one file says of another: the tree has a place that the world does not have.
  editor.replace("mission.xml", "destination=\"kitchen\"", "destination=\"kitchn\"");
  EXPECT_THAT(messages(editor.diagnostics[editor.uri("mission.xml")]), Contains(HasSubstr("kitchn")));
  editor.close("mission.xml");
  EXPECT_TRUE(editor.diagnostics[editor.uri("mission.xml")].as_list()->empty()) << "the file on disk has it right";
}

TEST(Diagnostics, AreThoseOfCheck) {
  Editor editor;
  std::string mission = editor.text("mission.xml");
  mission.replace(mission.find("threshold=\"30\""), 9, "thresold");
  editor.open("mission.xml", mission);
  editor.open("sentree.yaml");
  editor.replace("sentree.yaml", "violated: [failure]", "violated: [failur]");
  std::vector<std::string> told;
  for (const auto& [uri, found] : editor.diagnostics) {
    for (const std::string& message : messages(found)) told.push_back(message);
  }
  const text::Overlay edited{{editor.folder() / "mission.xml", mission},
                             {editor.folder() / "sentree.yaml", editor.texts["sentree.yaml"]}};
  const text::ReadThrough through(edited);
  std::vector<std::string> checked;
  for (const Diagnostic& diagnostic : project::check_project(editor.folder())) checked.push_back(diagnostic.message);
  EXPECT_FALSE(checked.empty());
  EXPECT_THAT(told, ::testing::UnorderedElementsAreArray(checked));
}

TEST(Diagnostics, AreThereForFilesWithoutAProject) {
  Editor editor;
  const TemporaryFolder elsewhere("lsp");
  const std::string uri = uri_of(elsewhere.path() / "a.scxml");
  editor.notify("textDocument/didOpen",
                Map{{"textDocument", Map{{"uri", uri},
                                         {"text",
                                          "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\">"
                                          "<state id=\"open\"><transition target=\"opne\"/></state></scxml>"}}}});
  EXPECT_THAT(messages(editor.diagnostics[uri]), Contains(HasSubstr("did you mean \"open\"")));
}

TEST(Diagnostics, AreNotMadeOfOtherXml) {
  Editor editor;
  const TemporaryFolder elsewhere("lsp");
  editor.notify("textDocument/didOpen", Map{{"textDocument", Map{{"uri", uri_of(elsewhere.path() / "pom.xml")},
                                                                 {"text", "<project><name/></project>"}}}});
  EXPECT_TRUE(editor.diagnostics.empty());
}

TEST(Diagnostics, ComeWithTheirFix) {
  Editor editor;
  editor.open("mission.xml");
  editor.replace("mission.xml", "destination=\"kitchen\"", "destinatoin=\"kitchen\"");
  const Map place = editor.position("mission.xml", "destinatoin", 3);
  const Value answer =
      editor.request("textDocument/codeAction", Map{{"textDocument", Map{{"uri", editor.uri("mission.xml")}}},
                                                    {"range", Map{{"start", place}, {"end", place}}},
                                                    {"context", Map{{"diagnostics", List()}}}});
  const List& actions = *answer.find("result")->as_list();
  ASSERT_FALSE(actions.empty());
  const Value& edits = *actions[0].at({"edit", "changes"})->find(editor.uri("mission.xml"));
  EXPECT_EQ(design::with_edits(editor.texts["mission.xml"], edits_of(edits, editor.texts["mission.xml"])).value(),
            editor.text("mission.xml"));
}

// ---- Completion ----

TEST(Completion, OffersNodesPortsAndPlacesInATree) {
  Editor editor;
  editor.open("mission.xml");
  editor.replace("mission.xml", "<WaitForUser name", "<\n          <WaitForUser name");
  const auto nodes = labels(editor.ask("completion", "mission.xml", "<\n          <WaitForUser"));
  EXPECT_THAT(nodes, IsSupersetOf({"GoToLocation", "WaitForUser", "ReactiveFallback", "SubTree"}));
  editor.replace("mission.xml", "<\n          <WaitForUser name",
                 "<AtLocation  location=\"\"/>\n          <WaitForUser name");
  const auto ports = labels(editor.ask("completion", "mission.xml", "<AtLocation  ", 12));
  EXPECT_THAT(ports, Contains("name"));
  EXPECT_THAT(ports, Not(Contains("location"))) << "it is there already";
  const auto values = labels(editor.ask("completion", "mission.xml", "location=\"\"", 10));
  EXPECT_THAT(values, IsSupersetOf({"kitchen", "station", "kitchen_area", "{reason}"}));
}

TEST(Completion, OffersServicesMethodsArgumentsAndMembersInAChart) {
  Editor editor;
  const std::string file = "skills/GoToLocation.scxml";
  editor.open(file);
  EXPECT_THAT(labels(editor.ask("completion", file, "target=\"navigation\"", 8)),
              IsSupersetOf({"battery", "navigation"}));
  EXPECT_THAT(labels(editor.ask("completion", file, "event=\"gotoTargetByLocationName\"", 7)),
              IsSupersetOf({"gotoTargetByLocationName", "stopNavigation"}));
  EXPECT_THAT(labels(editor.ask("completion", file, "<param name=\"name\"", 13)), ::testing::ElementsAre("name"));
  EXPECT_THAT(labels(editor.ask("completion", file, "target=\"moving\"", 9)),
              IsSupersetOf({"going", "moving", "success"}));
  EXPECT_THAT(labels(editor.ask("completion", file, "event=\"navigation.gotoTargetByLocationName.reply\"", 8)),
              IsSupersetOf({"tick", "halt", "navigation.stopNavigation.reply", "done.state.going"}));
  EXPECT_THAT(labels(editor.ask("completion", file, "_event.data.result.code === 'OK'", 19)),
              IsSupersetOf({"code", "goal_id", "error_code"}));
  EXPECT_THAT(labels(editor.ask("completion", file, "_event.data.result.code === 'OK'", 29)),
              IsSupersetOf({"OK", "NOT_READY"}));
  EXPECT_THAT(labels(editor.ask("completion", file, "expr=\"destination\"", 6)), IsSupersetOf({"destination", "goal"}));
}

TEST(Completion, OffersTheWordsOfRequirements) {
  Editor editor;
  const std::string file = "requirements/recharge.req";
  editor.open(file);
  EXPECT_THAT(labels(editor.ask("completion", file, "battery.getBatteryState", 8)), Contains("getBatteryState"));
  EXPECT_THAT(labels(editor.ask("completion", file, "BatteryLevelAbove30).perc", 21)), IsSupersetOf({"percentage"}));
  EXPECT_THAT(labels(editor.ask("completion", file, "from BatteryLevelAbove30", 5)), Contains("BatteryLevelAbove30"));
  EXPECT_THAT(labels(editor.ask("completion", file, "always level", 7)), IsSupersetOf({"level", "destination"}));
  EXPECT_THAT(labels(editor.ask("completion", file, "level >= 20 %", 12)), IsSupersetOf({"%", "ratio", "m/s"}));
}

TEST(Completion, OffersWhatSentreeYamlAndScenariosName) {
  Editor editor;
  editor.open("sentree.yaml");
  EXPECT_THAT(labels(editor.ask("completion", "sentree.yaml", "robot.thrift/Battery")),
              IsSupersetOf({"robot.thrift/Battery"}));
  EXPECT_THAT(labels(editor.ask("completion", "sentree.yaml", "violated: [failure]", 12)), IsSupersetOf({"failure"}));
  EXPECT_THAT(labels(editor.ask("completion", "sentree.yaml", "kill: GoToKitchen", 7)), Contains("GoToKitchen"));
  const std::string scenario = "scenarios/experiment1.yaml";
  editor.open(scenario);
  EXPECT_THAT(labels(editor.ask("completion", scenario, "call: simulation", 8)),
              IsSupersetOf({"simulation.setBatteryCharge", "battery.getBatteryState"}));
  EXPECT_THAT(labels(editor.ask("completion", scenario, "battery: violated", 9)),
              IsSupersetOf({"violated", "undecided"}));
  editor.replace(scenario, "call: simulation.setBatteryCharge, args: {percent: 10}", "late: b");
  EXPECT_THAT(labels(editor.ask("completion", scenario, "late: b", 7)), Contains("battery.getBatteryState"));
  editor.replace(scenario, "late: b", "la");
  const std::vector<std::string> words = labels(editor.ask("completion", scenario, "20 s, la", 8));
  for (const project::Intervention& kind : project::every_kind())
    EXPECT_THAT(words, Contains(std::string(project::word_of(kind))));
  editor.replace(scenario, "{at: 20 s, la}", "{at: 20 s, falsify: {pa}}");
  EXPECT_THAT(labels(editor.ask("completion", scenario, "falsify: {pa", 12)),
              IsSupersetOf({"call", "path", "value", "count"}));
}

TEST(Completion, GoesOnWhileTheFileCannotBeRead) {
  Editor editor;
  editor.open("mission.xml");
  editor.replace("mission.xml", "destination=\"kitchen\"", "destination=\"k");
  EXPECT_THAT(labels(editor.ask("completion", "mission.xml", "destination=\"k", 14)), Contains("kitchen"));
}

// ---- Hover, definition, references ----

TEST(Hover, TellsPortsUnitsAndComments) {
  Editor editor;
  editor.open("mission.xml");
  EXPECT_THAT(text_of(editor.ask("hover", "mission.xml", "<GoToLocation", 3)), HasSubstr("`destination`: std::string"));
  EXPECT_THAT(text_of(editor.ask("hover", "mission.xml", "threshold=\"30\"")), HasSubstr("percent"));
  const std::string chart = "skills/GoToLocation.scxml";
  editor.open(chart);
  EXPECT_THAT(text_of(editor.ask("hover", chart, "event=\"stopNavigation\"", 8)),
              AllOf(HasSubstr("ReturnCode stopNavigation(i64 goal_id)"), HasSubstr("that goal only")));
  EXPECT_THAT(text_of(editor.ask("hover", chart, "_event.data.result.status", 20)), HasSubstr("GOAL_REACHED"));
  editor.open("requirements/recharge.req");
  EXPECT_THAT(text_of(editor.ask("hover", "requirements/recharge.req", "never_empty (")),
              HasSubstr("globally, always level"));
}

TEST(Hover, TellsTheLastValueOfTheNewestRecording) {
  Editor editor;
  std::filesystem::create_directories(editor.folder() / "runs");
  const auto record_run = [&](const std::string& name, double percentage) {
    auto file = record::FileSink::create((editor.folder() / "runs" / name).string());
    ASSERT_TRUE(file);
    record::Recorder recorder(std::move(*file), {});
    Message message;
    const record::ChannelId channel =
        recorder.add_channel(std::string(record::kObservationsTopic), "sentree.Observation", "{}");
    const auto observe = [&] {
      recorder.pack(channel, message.time, [&](record::PackedJson& out) { record::pack_observation(out, message); });
    };
    message.kind = MessageKind::kReply;
    message.name = "battery.getBatteryState.reply";
    message.data = Map{{"args", Map()}, {"result", Map{{"percentage", 0.9}}}};
    observe();
    message.data = Map{{"args", Map()}, {"result", Map{{"percentage", percentage}}}};
    observe();
    message.name = "GoToKitchen.tick.request";
    message.data = Map{{"inputs", Map{{"destination", "study"}}}};
    observe();
    recorder.close();
  };
  record_run("a.mcap", 0.25);
  editor.open("skills/BatteryLevelAbove.scxml");
  const auto told = [&] {
    return text_of(editor.ask("hover", "skills/BatteryLevelAbove.scxml", "event=\"getBatteryState\"", 8));
  };
  EXPECT_THAT(told(), AllOf(HasSubstr("a.mcap"), HasSubstr("{\"percentage\":0.25}")));
  editor.open("mission.xml");
  EXPECT_THAT(text_of(editor.ask("hover", "mission.xml", "destination=\"kitchen\"", 3)), HasSubstr("\"study\""));
  record_run("b.mcap", 0.5);
  std::filesystem::last_write_time(
      editor.folder() / "runs/b.mcap",
      std::filesystem::last_write_time(editor.folder() / "runs/a.mcap") + std::chrono::seconds(1));
  EXPECT_THAT(told(), AllOf(HasSubstr("b.mcap"), HasSubstr("{\"percentage\":0.5}")));
}

TEST(Definition, LeadsFromLeafToChartAndFromCallToInterface) {
  Editor editor;
  editor.open("mission.xml");
  EXPECT_THAT(places(editor.ask("definition", "mission.xml", "<GoToLocation", 3), editor),
              ::testing::ElementsAre("skills/GoToLocation.scxml:9"));
  EXPECT_THAT(places(editor.ask("definition", "mission.xml", "name=\"GoToStation\"", 8), editor),
              Contains("skills/GoToLocation.scxml:9"));
  EXPECT_THAT(places(editor.ask("definition", "mission.xml", "location=\"station\"", 12), editor),
              ::testing::ElementsAre("world/world.yaml:8"));
  const std::string chart = "skills/GoToLocation.scxml";
  editor.open(chart);
  const auto method = places(editor.ask("definition", chart, "event=\"stopNavigation\"", 8), editor);
  ASSERT_EQ(method.size(), 1U);
  EXPECT_THAT(method[0], HasSubstr("robot.thrift:"));
  EXPECT_THAT(places(editor.ask("definition", chart, "target=\"stopping\"", 9), editor),
              Contains(chart + ":" + line_of(editor.folder() / chart, "<state id=\"stopping\"")));
  editor.open("requirements/recharge.req");
  EXPECT_THAT(places(editor.ask("definition", "requirements/recharge.req", "from BatteryLevelAbove30", 8), editor),
              ::testing::ElementsAre("mission.xml:14"));
}

TEST(References, AreFoundInAllKindsOfFiles) {
  Editor editor;
  editor.open("mission.xml");
  const auto leaf = places(editor.ask("references", "mission.xml", "name=\"BatteryLevelAbove30\"", 8,
                                      Map{{"context", Map{{"includeDeclaration", true}}}}),
                           editor);
  EXPECT_THAT(leaf, IsSupersetOf({"mission.xml:14", "monitors/battery.scxml:7", "requirements/recharge.req:5"}));
  editor.open("sentree.yaml");
  const auto service = places(editor.ask("references", "sentree.yaml", "battery:", 2), editor);
  EXPECT_THAT(service, IsSupersetOf({"monitors/battery.scxml:6", "requirements/recharge.req:5", "sentree.yaml:16"}));
}

// ---- Renaming ----

class Renaming : public ::testing::Test {
 protected:
  Renaming()
      : editor(Map{{"workspace",
                    Map{{"workspaceEdit", Map{{"documentChanges", true}, {"resourceOperations", List{"rename"}}}}}}}) {}

  // Carries it out on disk, and gives the files that changed.
  std::vector<std::string> rename(const std::string& file, const std::string& word, std::size_t ahead,
                                  const std::string& name) {
    if (!editor.texts.contains(file)) editor.open(file);
    const Value changes = *editor.ask("rename", file, word, ahead, Map{{"newName", name}}).find("documentChanges");
    std::vector<std::string> changed;
    for (const Value& change : *changes.as_list()) {
      if (change.find("kind") != nullptr) {
        std::filesystem::rename(*path_of(change.find("oldUri")->text()), *path_of(change.find("newUri")->text()));
        continue;
      }
      const auto path = *path_of(change.at({"textDocument", "uri"})->text());
      const std::string inside = path.lexically_relative(editor.folder()).generic_string();
      const std::string before = editor.text(inside);
      std::ofstream(path) << design::with_edits(before, edits_of(*change.find("edits"), before)).value();
      changed.push_back(inside);
    }
    return changed;
  }

  [[nodiscard]] std::vector<std::string> problems() const {
    std::vector<std::string> found;
    for (const Diagnostic& diagnostic : project::check_project(editor.folder())) found.push_back(to_string(diagnostic));
    return found;
  }

  Editor editor;
};

TEST_F(Renaming, OfALeafChangesAllThatNamesItAndNothingElse) {
  const std::string before = editor.text("mission.xml");
  const auto changed = rename("mission.xml", "name=\"BatteryLevelAbove30\"", 8, "EnoughCharge");
  EXPECT_THAT(changed, IsSupersetOf({"mission.xml", "monitors/battery.scxml", "requirements/recharge.req"}));
  EXPECT_THAT(problems(), ::testing::IsEmpty());
  std::string expected = before;
  expected.replace(expected.find("BatteryLevelAbove30"), 19, "EnoughCharge");
  EXPECT_EQ(editor.text("mission.xml"), expected);
}

TEST_F(Renaming, OfAServiceChangesChartsRequirementsAndScenarios) {
  const auto changed = rename("sentree.yaml", "battery:", 2, "accumulator");
  EXPECT_THAT(changed, IsSupersetOf({"sentree.yaml", "skills/BatteryLevelAbove.scxml", "monitors/battery.scxml",
                                     "requirements/recharge.req"}));
  EXPECT_THAT(problems(), ::testing::IsEmpty());
  EXPECT_THAT(editor.text("sentree.yaml"), HasSubstr("file: monitors/battery.scxml"));
}

TEST_F(Renaming, OfAStateChangesTransitionsAndWhatTheProjectSaysOfIt) {
  const auto changed = rename("monitors/battery.scxml", "id=\"failure\"", 5, "too_low");
  EXPECT_THAT(changed, ::testing::UnorderedElementsAre("monitors/battery.scxml", "sentree.yaml"));
  EXPECT_THAT(editor.text("sentree.yaml"), HasSubstr("{file: monitors/battery.scxml,  violated: [too_low]}"));
  EXPECT_THAT(editor.text("sentree.yaml"), HasSubstr("{file: monitors/recharge.scxml, violated: [failure]}"));
  EXPECT_THAT(problems(), ::testing::IsEmpty());
}

TEST_F(Renaming, OfAStateTellsOfWhatItCannotFollow) {
  rename("skills/GoToLocation.scxml", "id=\"moving\"", 6, "driving");
  EXPECT_THAT(editor.shown, ::testing::IsEmpty());
  editor.replace("skills/GoToLocation.scxml", "<transition ", "<transition cond=\"In(_event.data)\" ");
  editor.ask("rename", "skills/GoToLocation.scxml", "id=\"moving\"", 6, Map{{"newName", "driving"}});
  EXPECT_THAT(editor.shown, ::testing::ElementsAre(HasSubstr("moving may be meant here too")));
  EXPECT_THAT(editor.shown.back(), HasSubstr("skills/GoToLocation.scxml:"));
}

TEST_F(Renaming, OfASkillRenamesItsChart) {
  rename("mission.xml", "<WaitForUser", 3, "AwaitPerson");
  EXPECT_TRUE(std::filesystem::exists(editor.folder() / "skills/AwaitPerson.scxml"));
  EXPECT_THAT(editor.text("mission.xml"),
              AllOf(HasSubstr("<AwaitPerson name=\"WaitForUser\"/>"), HasSubstr("<Action ID=\"AwaitPerson\"/>")));
  EXPECT_THAT(problems(), ::testing::IsEmpty());
}

// Of a file, carried out on disk.
class FileRenaming : public Renaming {
 protected:
  [[nodiscard]] Index index() const {
    Index index(editor.folder());
    index.refresh({});
    return index;
  }
  std::vector<std::string> move(const std::string& from, const std::string& to) {
    const auto renaming = rename_file(index(), (editor.folder() / from).string(), (editor.folder() / to).string());
    if (!renaming) return {renaming.error().message};
    std::vector<std::string> changed;
    for (const auto& [path, edits] : renaming->edits) {
      changed.push_back(std::filesystem::path(path).lexically_relative(editor.folder()).generic_string());
      const std::string before = editor.text(changed.back());
      std::ofstream(path) << design::with_edits(before, edits).value();
    }
    std::filesystem::create_directories((editor.folder() / to).parent_path());
    std::filesystem::rename(editor.folder() / from, editor.folder() / to);
    return changed;
  }
  void write(const std::string& file, const std::string& text) const {
    std::filesystem::create_directories((editor.folder() / file).parent_path());
    std::ofstream(editor.folder() / file) << text;
  }
  std::vector<std::string> uses(const std::string& file) const {
    std::vector<std::string> found;
    for (const FileUse& use : uses_of_file(index(), (editor.folder() / file).string()))
      found.push_back(std::filesystem::path(use.file).lexically_relative(editor.folder()).generic_string());
    return found;
  }
};

TEST_F(FileRenaming, OfWhatTheProjectNamesChangesItsPath) {
  EXPECT_THAT(uses("requirements/recharge.req"), IsSupersetOf({"sentree.yaml", "scenarios/experiment1.yaml"}));
  EXPECT_THAT(move("requirements/recharge.req", "requirements/all/charge.req"), ::testing::ElementsAre("sentree.yaml"));
  EXPECT_THAT(move("mission.xml", "trees/main.xml"), ::testing::ElementsAre("sentree.yaml"));
  EXPECT_THAT(move("world/world.yaml", "world/flat.yaml"), ::testing::ElementsAre("sentree.yaml"));
  EXPECT_THAT(editor.text("sentree.yaml"), AllOf(HasSubstr("mission: {file: trees/main.xml, tree: Main, rate: 10 Hz}"),
                                                 HasSubstr("world: world/flat.yaml\n"),
                                                 HasSubstr("- {file: requirements/all/charge.req}   # never_empty")));
  EXPECT_THAT(problems(), ::testing::IsEmpty());
}

TEST_F(FileRenaming, OfASkillsChartRenamesTheSkill) {
  EXPECT_THAT(uses("skills/WaitForUser.scxml"), ::testing::Contains("mission.xml"));
  EXPECT_THAT(move("skills/WaitForUser.scxml", "skills/AwaitPerson.scxml"), ::testing::Contains("mission.xml"));
  EXPECT_THAT(editor.text("mission.xml"), HasSubstr("<AwaitPerson name=\"WaitForUser\"/>"));
  EXPECT_THAT(problems(), ::testing::IsEmpty());
  EXPECT_THAT(move("skills/AwaitPerson.scxml", "charts/AwaitPerson.scxml"),
              ::testing::ElementsAre(HasSubstr("leaves find skills/AwaitPerson.scxml by its name")));
}

TEST_F(FileRenaming, OfAMonitorRenamesIt) {
  write("scenarios/quiet.yaml", "expect:\n  monitors: {battery: satisfied}\n");
  EXPECT_THAT(move("monitors/battery.scxml", "monitors/charge.scxml"), ::testing::Contains("scenarios/quiet.yaml"));
  EXPECT_THAT(editor.text("sentree.yaml"), HasSubstr("{file: monitors/charge.scxml,  violated: [failure]}"));
  EXPECT_EQ(editor.text("scenarios/quiet.yaml"), "expect:\n  monitors: {charge: satisfied}\n");
  EXPECT_THAT(problems(), ::testing::IsEmpty());
  EXPECT_THAT(move("monitors/charge.scxml", "monitors/recharge.scxml"),
              ::testing::ElementsAre(HasSubstr("is there already")));
}

TEST_F(FileRenaming, OfAModelWritesTheNameThatItHad) {
  EXPECT_THAT(move("models/robot.scxml", "models/base.scxml"), ::testing::ElementsAre("sentree.yaml"));
  EXPECT_THAT(editor.text("sentree.yaml"),
              AllOf(HasSubstr("{file: models/base.scxml, name: robot, serves: [battery, navigation]}"),
                    HasSubstr("fair: [robot.plugs_in]")));
  EXPECT_THAT(problems(), ::testing::IsEmpty());
  write("sentree.yaml", "models:\n  - file: models/base.scxml   # that\n    serves: [battery]\n");
  EXPECT_THAT(move("models/base.scxml", "models/robot.scxml"), ::testing::ElementsAre("sentree.yaml"));
  EXPECT_EQ(editor.text("sentree.yaml"),
            "models:\n  - file: models/robot.scxml\n    name: base   # that\n    serves: [battery]\n");
}

TEST_F(FileRenaming, FollowsTreesPatternsAndInterfaces) {
  write("sentree.yaml",
        "mission: {files: [\"trees/*.xml\"], tree: A}\nservices: {x: {interface: one.thrift/S, at: sim}}\n");
  write("trees/a.xml", "<root><include path=\"./b.xml\"/><BehaviorTree ID=\"A\"/></root>\n");
  write("trees/b.xml", "<root><BehaviorTree ID=\"B\"/></root>\n");
  write("interfaces/one.thrift", "include \"two.thrift\"\nservice S {}\n");
  write("interfaces/two.thrift", "struct T {}\n");
  EXPECT_THAT(uses("trees/b.xml"), ::testing::ElementsAre("sentree.yaml", "trees/a.xml"));
  EXPECT_THAT(move("trees/b.xml", "elsewhere/b.xml"), ::testing::ElementsAre(HasSubstr("finds it as \"trees/*.xml\"")));
  EXPECT_THAT(move("trees/b.xml", "trees/c.xml"), ::testing::ElementsAre("trees/a.xml"));
  EXPECT_THAT(editor.text("trees/a.xml"), HasSubstr("path=\"./c.xml\""));
  write("sentree.yaml",
        "mission: {files: [\"*/*.xml\"], tree: A}\nservices: {x: {interface: one.thrift/S, at: sim}}\n");
  EXPECT_THAT(move("trees/a.xml", "other/a.xml"), ::testing::ElementsAre("trees/a.xml"));
  EXPECT_THAT(editor.text("other/a.xml"), HasSubstr("path=\"./../trees/c.xml\""));
  EXPECT_THAT(move("interfaces/two.thrift", "interfaces/three.thrift"),
              ::testing::ElementsAre("interfaces/one.thrift"));
  EXPECT_THAT(move("interfaces/one.thrift", "interfaces/first.thrift"), ::testing::ElementsAre("sentree.yaml"));
  EXPECT_THAT(editor.text("interfaces/first.thrift"), HasSubstr("include \"three.thrift\""));
  EXPECT_THAT(editor.text("sentree.yaml"), HasSubstr("interface: first.thrift/S"));
}

TEST_F(FileRenaming, IsRefusedWhereNotAllCanFollow) {
  EXPECT_THAT(move("sentree.yaml", "project.yaml"), ::testing::ElementsAre(HasSubstr("its name is fixed")));
  EXPECT_THAT(move("mission.xml", "mission.scxml"), ::testing::ElementsAre(HasSubstr("ends in \".xml\"")));
  EXPECT_THAT(move("mission.xml", "skills/none/../../mission2.yaml"), ::testing::ElementsAre(HasSubstr("ends in")));
  write("trees/broken.xml", "<root><include path=\"../mission.xml\"></root");
  EXPECT_THAT(move("mission.xml", "main.xml"), ::testing::ElementsAre(HasSubstr("trees/broken.xml may name it")));
}

TEST_F(Renaming, OfAPlaceChangesWorldTreeChartsModelsAndRequirements) {
  const std::string model = editor.text("models/robot.scxml");
  const auto changed = rename("world/world.yaml", "station:", 2, "charger");
  EXPECT_THAT(changed, ::testing::UnorderedElementsAre("mission.xml", "models/robot.scxml", "monitors/recharge.scxml",
                                                       "monitors/shield.scxml", "requirements/published.req",
                                                       "requirements/recharge.req", "world/world.yaml"));
  EXPECT_THAT(problems(), ::testing::IsEmpty());
  EXPECT_THAT(editor.text("world/world.yaml"),
              AllOf(HasSubstr("  charger: [8.2, 5.2"), HasSubstr("stations:"), HasSubstr("{pose: charger,")));
  EXPECT_THAT(editor.text("models/robot.scxml"), AllOf(HasSubstr("({charger: 2, kitchen: 10})"),
                                                       HasSubstr("cells.charger"), HasSubstr("the station is cell 2")));
  EXPECT_THAT(editor.text("requirements/recharge.req"),
              AllOf(HasSubstr("turns_to_station"), HasSubstr("destination = charger or at(charger)")));
  EXPECT_THAT(editor.text("monitors/shield.scxml"), HasSubstr("args.name !== 'charger'"));
}

TEST_F(Renaming, OfAPlaceChangesWhereRobotsBeginInCampaignsToo) {
  EXPECT_THAT(rename("world/world.yaml", "  start:", 4, "entrance"),
              ::testing::UnorderedElementsAre("campaign.yaml", "world/world.yaml"));
  EXPECT_THAT(editor.text("campaign.yaml"), HasSubstr("{choice: [entrance, study, bedroom]}"));
  EXPECT_THAT(problems(), ::testing::IsEmpty());
}

TEST_F(Renaming, OfAPlaceIsRefusedWhereATextCouldMeanSomethingElse) {
  editor.open("world/world.yaml");
  const auto refusal = [&](const std::string& name) {
    Map params{{"textDocument", Map{{"uri", editor.uri("world/world.yaml")}}},
               {"position", editor.position("world/world.yaml", "  kitchen:", 4)},
               {"newName", name}};
    const Value answer = editor.request("textDocument/rename", std::move(params));
    return answer.find("error") == nullptr ? "" : std::string(answer.at({"error", "message"})->text());
  };
  EXPECT_THAT(refusal("battery"), HasSubstr("a service"));
  EXPECT_THAT(refusal("dock"), HasSubstr("stations"));
  EXPECT_THAT(refusal("CHARGING"), HasSubstr("interface"));
  EXPECT_THAT(refusal("study"), HasSubstr("is there already"));
  EXPECT_EQ(refusal("galley"), "");
}

// Whatever a project calls its places, check says the same of it.
TEST(RenamingOfPlaces, OfEachExampleChangesNoFinding) {
  const std::filesystem::path examples = project::shipped_folder("examples");
  int renamed = 0;
  for (const char* name : {"inspection", "minimal", "nav2", "recharge", "telemetry", "two-robots"}) {
    SCOPED_TRACE(name);
    const TemporaryFolder copy("renaming");
    const std::filesystem::path folder = std::filesystem::canonical(copy.path()) / "project";
    std::filesystem::copy(examples / name, folder, std::filesystem::copy_options::recursive);
    std::filesystem::remove_all(folder / "runs");
    const auto findings = [&] {
      std::string all;
      for (const Diagnostic& diagnostic : project::check_project(folder)) all += to_string(diagnostic) + "\n";
      return all;
    };
    const std::string before = findings();
    Index index(folder);
    index.refresh({});
    const std::set<std::string, std::less<>> places = index.names().locations;
    EXPECT_FALSE(places.empty());
    for (const std::string& place : places) {
      const auto renaming = rename(index, {SymbolKind::kLocation, place}, "x_" + place);
      ASSERT_TRUE(renaming.has_value()) << to_string(renaming.error());
      for (const auto& [file, edits] : renaming->edits)
        std::ofstream(file) << design::with_edits(index.find(file)->text, edits).value();
      index.refresh({});
      EXPECT_TRUE(index.places_of({SymbolKind::kLocation, place}).empty()) << place;
      ++renamed;
    }
    EXPECT_EQ(findings(), before);
  }
  EXPECT_GT(renamed, 20);
}

TEST_F(Renaming, IsRefusedWhereItWouldBreakSomething) {
  editor.open("mission.xml");
  editor.open("skills/GoToLocation.scxml");
  const auto refused = [&](const std::string& file, const std::string& word, const std::string& name) {
    Map params{{"textDocument", Map{{"uri", editor.uri(file)}}},
               {"position", editor.position(file, word, word.size())},
               {"newName", name}};
    return code_of(editor.request("textDocument/rename", std::move(params))) == -32803;
  };
  EXPECT_TRUE(refused("mission.xml", "name=\"AtStatio", "battery")) << "a service";
  EXPECT_TRUE(refused("mission.xml", "name=\"AtStatio", "AtKitchen")) << "there is one";
  EXPECT_FALSE(refused("mission.xml", "name=\"AtStatio", "AtDock"));
  EXPECT_TRUE(refused("mission.xml", "name=\"AtStatio", "a\nb")) << "no name";
  EXPECT_TRUE(refused("skills/GoToLocation.scxml", "event=\"stopNavig", "halt")) << "of an interface";
  editor.open("requirements/recharge.req");
  editor.replace("mission.xml", "</root>", "</rot>");
  EXPECT_TRUE(refused("requirements/recharge.req", "from BatteryLevel", "Enough")) << "mission.xml cannot be read";
}

TEST_F(Renaming, IsOfTheVersionThatItWasMadeFor) {
  editor.open("mission.xml");
  editor.replace("mission.xml", "</root>", " </root>");
  const Value changes =
      *editor.ask("rename", "mission.xml", "name=\"BatteryLevelAbove30\"", 8, Map{{"newName", "EnoughCharge"}})
           .find("documentChanges");
  std::map<std::string, Value> versions;
  for (const Value& change : *changes.as_list())
    versions[std::string(change.at({"textDocument", "uri"})->text())] = *change.at({"textDocument", "version"});
  EXPECT_EQ(versions.at(editor.uri("mission.xml")), Value(2));
  EXPECT_TRUE(versions.at(editor.uri("requirements/recharge.req")).is_null());
}

// ---- The rest ----

TEST(WorkspaceSymbols, AreThereBeforeAnythingIsOpen) {
  Editor editor;
  const Value answer = editor.request("workspace/symbol", Map{{"query", "GoToKitchen"}});
  ASSERT_FALSE(answer.find("result")->as_list()->empty());
  EXPECT_EQ(answer.find("result")->as_list()->front().at({"location", "uri"})->text(), editor.uri("mission.xml"));
  EXPECT_TRUE(editor.diagnostics.empty());
}

TEST(Outline, HasNodesStatesAndRequirements) {
  Editor editor;
  const auto names = [&](const std::string& file) {
    editor.open(file);
    std::vector<std::string> found;
    const auto collect = [&](const auto& self, const Value& list) -> void {
      for (const Value& part : *list.as_list()) {
        found.emplace_back(part.find("name")->text());
        self(self, *part.find("children"));
      }
    };
    collect(collect,
            *editor.request("textDocument/documentSymbol", Map{{"textDocument", Map{{"uri", editor.uri(file)}}}})
                 .find("result"));
    return found;
  };
  EXPECT_THAT(names("mission.xml"), IsSupersetOf({"Main", "Root", "BatteryLevelAbove30", "GoToKitchen"}));
  EXPECT_THAT(names("skills/GoToLocation.scxml"), IsSupersetOf({"going", "starting", "success"}));
  EXPECT_THAT(names("requirements/recharge.req"), IsSupersetOf({"level", "never_empty", "turns_to_station"}));
}

TEST(Formatting, IsThatOfFmt) {
  Editor editor;
  editor.open("mission.xml");
  editor.replace("mission.xml", "          <WaitForUser", "  <WaitForUser");
  const Value edits =
      *editor
           .request("textDocument/formatting",
                    Map{{"textDocument", Map{{"uri", editor.uri("mission.xml")}}}, {"options", Map{{"tabSize", 8}}}})
           .find("result");
  EXPECT_EQ(design::with_edits(editor.texts["mission.xml"], edits_of(edits, editor.texts["mission.xml"])).value(),
            editor.text("mission.xml"));
}

TEST(Lenses, RunScenariosAndShowTrees) {
  Editor editor;
  const auto commands = [&](const std::string& file) {
    editor.open(file);
    std::vector<std::string> found;
    const Value answer = editor.request("textDocument/codeLens", Map{{"textDocument", Map{{"uri", editor.uri(file)}}}});
    for (const Value& lens : *answer.find("result")->as_list())
      found.emplace_back(lens.at({"command", "command"})->text());
    return found;
  };
  EXPECT_THAT(commands("scenarios/experiment1.yaml"), ::testing::ElementsAre("sentree.run", "sentree.test"));
  EXPECT_THAT(commands("mission.xml"), ::testing::ElementsAre("sentree.show"));
  const Value picture =
      editor.request("workspace/executeCommand",
                     Map{{"command", "sentree.draw"}, {"arguments", List{editor.uri("mission.xml"), "Main"}}});
  EXPECT_THAT(std::string(picture.find("result")->text()), HasSubstr("<svg"));
}

TEST(Server, CountsInBytesWhereTheEditorCan) {
  Editor editor(Map{{"general", Map{{"positionEncodings", List{"utf-8", "utf-16"}}}}});
  EXPECT_EQ(editor.initialized.at({"result", "capabilities", "positionEncoding"})->text(), "utf-8");
}

}  // namespace
}  // namespace sentree::lsp
