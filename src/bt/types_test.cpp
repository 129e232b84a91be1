#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/bt/detail/test_support.h"
#include "sentree/bt/load.h"
#include "sentree/bt/queue_nodes.h"
#include "sentree/bt/runner.h"
#include "sentree/bt/schema.h"
#include "sentree/text/json.h"
#include "sentree/text/xml.h"

// Types in ports and entries: JSON, enums, pointers to base classes, queues; blackboards as JSON; the XML schema.

namespace sentree::bt {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::Not;

Runner runner(const std::string& body, const Registry& registry, const std::string& more = {}) {
  LoadOptions options;
  options.registry = &registry;
  auto loaded = load(in_tree(body, more), options);
  for (const Diagnostic& d : loaded.diagnostics) {
    if (d.severity == Severity::kError) ADD_FAILURE() << to_string(d);
  }
  return Runner(std::move(*loaded.value));
}

struct Pose {
  double x = 0;
  double y = 0;
};

}  // namespace

template <>
struct Convert<Pose> {
  static std::string name() { return "Pose"; }
  static Value to_value(const Pose& p) { return Map{{"x", p.x}, {"y", p.y}}; }
  static std::optional<Pose> from_value(const Value& v) {
    if (v.find("x") == nullptr || v.find("y") == nullptr) return std::nullopt;
    return Pose{v.find("x")->number(), v.find("y")->number()};
  }
};

namespace {

/// Adds up what its port gave.
struct Sum {
  double total = 0;
  int failures = 0;
};

void add_show_pose(Registry& registry, Sum& sum) {
  registry.action("ShowPose", {input_default<Pose>("at", "json:{\"x\": 100, \"y\": 0}")}, [&sum](Context& self) {
    const auto pose = self.input<Pose>("at");
    if (!pose) ++sum.failures;
    if (pose) sum.total += pose->x + pose->y;
    return pose ? Status::kSuccess : Status::kFailure;
  });
}

TEST(Json, IsALiteralOfAUserTypeADefaultAndTextOfAnEntry) {
  Registry registry;
  Sum sum;
  add_show_pose(registry, sum);
  Runner r = runner(
      "<Sequence><ShowPose at='json:{\"x\": 1, \"y\": 2.5}'/><ShowPose/>"
      "<SetBlackboard value='json:{\"x\": 10, \"y\": 20}' output_key=\"p\"/><ShowPose at=\"{p}\"/></Sequence>",
      registry);
  EXPECT_EQ(r.tick(), Status::kSuccess);
  EXPECT_EQ(sum.total, 133.5);
}

TEST(Json, IsCheckedWhenTheTreeIsLoaded) {
  Registry registry;
  Sum sum;
  add_show_pose(registry, sum);
  const auto messages = [&](const std::string& body) {
    std::string all;
    for (const Diagnostic& d : load(in_tree(body), {.registry = &registry}).diagnostics) all += to_string(d);
    return all;
  };
  EXPECT_THAT(messages("<ShowPose at='json:{\"x\": 1}'/>"), HasSubstr("is no Pose; write json:… or an entry {…}"));
  EXPECT_THAT(messages("<ShowPose at='json:{'/>"), HasSubstr("is no Pose"));
  EXPECT_THAT(messages("<ShowPose at='1;2'/>"), HasSubstr("is no Pose"));
  EXPECT_EQ(messages("<Repeat num_cycles='json:3'><AlwaysSuccess/></Repeat>"), "");
  EXPECT_THAT(messages("<Repeat num_cycles='json:3.5'><AlwaysSuccess/></Repeat>"), HasSubstr("is no int"));
  EXPECT_THAT(messages("<Repeat num_cycles='json:[3]'><AlwaysSuccess/></Repeat>"), HasSubstr("is no int"));
}

enum class Color : std::uint8_t { kRed = 0, kGreen = 1, kBlue = 2 };

TEST(Enums, ArePortsByNameByNumberAndFromScripts) {
  Registry registry;
  registry.enum_value("RED", Color::kRed);
  registry.enum_value("BLUE", Color::kBlue);
  registry.enum_value("HUGE", 1000);
  std::vector<Color> seen;
  registry.action("Paint", {input<Color>("with"), output<Color>("last")}, [&](Context& self) {
    const auto color = self.input<Color>("with");
    if (!color) return Status::kFailure;
    seen.push_back(*color);
    static_cast<void>(self.output("last", *color));  // Most of the nodes below leave it out.
    return Status::kSuccess;
  });
  Runner r = runner(
      "<Sequence><Paint with=\"BLUE\" last=\"{l}\"/><Paint with=\"1\"/><Script code=\"c := BLUE; s := 'BLUE'\"/>"
      "<Paint with=\"{c}\"/><Paint with=\"{s}\"/><ScriptCondition code=\"l == BLUE\"/></Sequence>",
      registry);
  EXPECT_EQ(r.tick(), Status::kSuccess);
  EXPECT_THAT(seen, ::testing::ElementsAre(Color::kBlue, Color::kGreen, Color::kBlue, Color::kBlue));
  // 1000 does not fit into the enum's eight bits.
  EXPECT_FALSE(load(in_tree("<Paint with=\"HUGE\"/>"), {.registry = &registry}).ok());
  EXPECT_FALSE(load(in_tree("<Paint with=\"PINK\"/>"), {.registry = &registry}).ok());
}

struct Animal {
  virtual ~Animal() = default;
};
struct Dog : Animal {};
struct Puppy : Dog {};
struct Cat : Animal {};

template <class T>
void add_make(Registry& registry, const std::string& id) {
  registry.action(id, {output<std::shared_ptr<T>>("out")}, [](Context& self) {
    return self.output("out", std::make_shared<T>()) ? Status::kSuccess : Status::kFailure;
  });
}
template <class T>
void add_take(Registry& registry, const std::string& id) {
  registry.action(id, {input<std::shared_ptr<T>>("in")}, [](Context& self) {
    const auto animal = self.input<std::shared_ptr<T>>("in");
    return animal && *animal != nullptr ? Status::kSuccess : Status::kFailure;
  });
}

Registry animals(bool casts) {
  Registry registry;
  add_make<Puppy>(registry, "MakePuppy");
  add_make<Cat>(registry, "MakeCat");
  add_take<Animal>(registry, "TakeAnimal");
  add_take<Dog>(registry, "TakeDog");
  add_take<Puppy>(registry, "TakePuppy");
  registry.action("AsAnimal", {input<std::shared_ptr<Animal>>("in"), output<std::shared_ptr<Animal>>("out")},
                  [](Context& self) {
                    const auto in = self.input<std::shared_ptr<Animal>>("in");
                    return in && self.output("out", *in) ? Status::kSuccess : Status::kFailure;
                  });
  if (casts) {
    registry.polymorphic_cast<Dog, Animal>();
    registry.polymorphic_cast<Puppy, Dog>();
    registry.polymorphic_cast<Cat, Animal>();
  }
  return registry;
}

TEST(PolymorphicPorts, ReadPointersUpAndDownThroughSeveralCasts) {
  const Registry registry = animals(true);
  Runner r = runner(
      "<Sequence><MakePuppy out=\"{p}\"/><TakeAnimal in=\"{p}\"/><TakeDog in=\"{p}\"/><TakePuppy in=\"{p}\"/>"
      "<AsAnimal in=\"{p}\" out=\"{a}\"/><TakePuppy in=\"{a}\"/><TakeDog in=\"{a}\"/></Sequence>",
      registry);
  EXPECT_EQ(r.tick(), Status::kSuccess);
}

TEST(PolymorphicPorts, RefuseAnObjectOfAnotherKind) {
  const Registry registry = animals(true);
  Runner r = runner(
      "<Sequence><MakeCat out=\"{c}\"/><AsAnimal in=\"{c}\" out=\"{a}\"/><TakeDog in=\"{a}\"/></Sequence>", registry);
  EXPECT_EQ(r.tick(), Status::kFailure);
  EXPECT_FALSE(r.error().has_value());
}

TEST(PolymorphicPorts, AreAClashWithoutACast) {
  const Registry registry = animals(false);
  EXPECT_FALSE(
      load(in_tree("<Sequence><MakePuppy out=\"{p}\"/><TakeDog in=\"{p}\"/></Sequence>"), {.registry = &registry})
          .ok());
}

TEST(PolymorphicPorts, ThatWriteBackTakeTheirOwnTypeOnly) {
  Registry registry = animals(true);
  registry.action("Update", {inout<std::shared_ptr<Animal>>("animal")}, [](Context&) { return Status::kSuccess; });
  const auto messages = [&](const std::string& body) {
    std::string all;
    for (const Diagnostic& d : load(in_tree(body), {.registry = &registry}).diagnostics) all += to_string(d);
    return all;
  };
  EXPECT_THAT(messages("<Sequence><MakeCat out=\"{p}\"/><Update animal=\"{p}\"/></Sequence>"),
              HasSubstr("for port \"animal\" of Update, which writes it, too"));
  EXPECT_EQ(messages("<Sequence><MakeCat out=\"{c}\"/><AsAnimal in=\"{c}\" out=\"{p}\"/><Update animal=\"{p}\"/>"
                     "<TakeAnimal in=\"{p}\"/></Sequence>"),
            "");
}

// A tree in which Give writes {o} through a port of that type, and a script goes on with it: how it ended.
template <class Port, class Given>
std::string given(const Given& value, const std::string& script) {
  Registry registry;
  registry.action("Give", {output<Port>("o")}, [&](Context& self) {
    static_cast<void>(self.output("o", value));
    return Status::kSuccess;
  });
  Runner r = runner("<Sequence><Give o=\"{o}\"/><Script code=\"" + script + "\"/></Sequence>", registry);
  r.tick();
  if (r.error()) return r.error()->message;
  return to_json(export_blackboard(r.tree(), r.state()));
}

TEST(Outputs, AreConvertedToWhatTheirPortDeclares) {
  EXPECT_EQ(given<double>(1, "o := 0.5"), R"({"":{"o":0.5}})");
  EXPECT_EQ(given<double>(1, "o := o / 2"), R"({"":{"o":0.5}})");
  EXPECT_EQ(given<double>(1.0F, "o /= 4"), R"({"":{"o":0.25}})");
  EXPECT_EQ(given<int>(true, "o := 5"), R"({"":{"o":5}})");
  EXPECT_EQ(given<bool>(2, "o := !o"), R"({"":{"o":false}})");
  EXPECT_EQ(given<std::string>(5, "o := o .. '!'"), R"({"":{"o":"5!"}})");
  EXPECT_THAT(given<int>(3.5, "o := 5"), HasSubstr("Give \"Give\": port \"o\": 3.5 is no int"));
  EXPECT_THAT(given<std::int8_t>(300, "o := 5"), HasSubstr("port \"o\": 300 is no int8_t"));
}

TEST(Outputs, OfTextMayBeLiteralsAndViews) {
  EXPECT_EQ(given<std::string>("The answer is 42", "n := 1"), R"({"":{"o":"The answer is 42","n":1}})");
  EXPECT_EQ(given<std::string>(std::string_view("a view"), "o := o .. '!'"), R"({"":{"o":"a view!"}})");
  const char* const text = "7";
  EXPECT_EQ(given<int>(text, "o += 1"), R"({"":{"o":8}})");
}

TEST(Outputs, OfWholeNumbersEndWhereInt64Ends) {
  EXPECT_EQ(given<std::uint64_t>(std::uint64_t{1} << 62, "n := 1"), R"({"":{"o":4611686018427387904,"n":1}})");
  EXPECT_THAT(given<std::uint64_t>(std::numeric_limits<std::uint64_t>::max(), "n := 1"), HasSubstr("is no uint64_t"));
  EXPECT_EQ(given<char>('A', "o += 1"), R"({"":{"o":66}})");
}

TEST(Load, SaysWhyAWholeNumberIsTooGreat) {
  Registry registry;
  registry.action("Take", {input<std::uint64_t>("n")}, [](Context&) { return Status::kSuccess; });
  const Loaded<Tree> loaded = load(in_tree("<Take n=\"18446744073709551615\"/>"), {.registry = &registry});
  ASSERT_EQ(loaded.diagnostics.size(), 1U);
  EXPECT_THAT(loaded.diagnostics[0].message, HasSubstr("is no uint64_t: whole numbers end at 9223372036854775807"));
}

TEST(Entries, HoldObjectsThatAreGivenFromOutside) {
  Registry registry = animals(true);
  const auto dog = std::make_shared<Puppy>();
  Runner r =
      runner("<SubTree ID=\"Sub\" pet=\"{animal}\"/>", registry,
             "<BehaviorTree ID=\"Sub\"><Sequence><TakeDog in=\"{pet}\"/><TakeAnimal in=\"{@animal}\"/></Sequence>"
             "</BehaviorTree>");
  EXPECT_EQ(r.tick(), Status::kFailure);
  ASSERT_TRUE(set_entry_as<std::shared_ptr<Dog>>(r.tree(), r.state(), "animal", dog, TimePoint{}));
  EXPECT_EQ(r.tick(), Status::kSuccess);
  EXPECT_EQ(entry_as<std::shared_ptr<Animal>>(r.tree(), r.state(), "animal").value(), dog);
  EXPECT_EQ(entry_as<std::shared_ptr<Cat>>(r.tree(), r.state(), "animal").error().code, "bt.conversion");
  EXPECT_EQ(entry_as<int>(r.tree(), r.state(), "none").error().code, "bt.no-entry");
  EXPECT_EQ(set_entry_as<int>(r.tree(), r.state(), "animal", 1, TimePoint{}).error().code, "bt.entry-type");
  ASSERT_TRUE(set_entry_as<double>(r.tree(), r.state(), "speed", 1, TimePoint{}));
  EXPECT_EQ(entry_as<std::string>(r.tree(), r.state(), "speed").value(), "1.000000");
}

TEST(SubTreeConstants, ThatLookLikeNumbersAreTextWhereAPortSaysSo) {
  Registry registry;
  std::string seen;
  registry.action("Say", {input<std::string>("message")}, [&](Context& self) {
    seen += self.input_or<std::string>("message", "?") + " ";
    return Status::kSuccess;
  });
  const std::string body = "<SubTree ID=\"Sub\" name=\"Sub\" version=\"1.10\"/>";
  const std::string sub = "<BehaviorTree ID=\"Sub\"><Say message=\"{version}\"/></BehaviorTree>";
  EXPECT_EQ(to_string(load(in_tree(body, sub), {.registry = &registry}, "m.xml").diagnostics.at(0)),
            "m.xml:2:108: warning: entry \"version\" is a double for the constant of SubTree \"Sub\" and text for port "
            "\"message\" of Say; BehaviorTree.CPP refuses that");
  Runner r = runner(body, registry, sub);
  EXPECT_EQ(r.tick(), Status::kSuccess);
  EXPECT_EQ(seen, "1.10 ");
  registry.action("Add", {input<double>("by")}, [](Context&) { return Status::kSuccess; });
  const std::string whole = in_tree("<SubTree ID=\"Sub\" name=\"Sub\" n=\"1\"/>",
                                    "<BehaviorTree ID=\"Sub\"><Add by=\"{n}\"/></BehaviorTree>");
  EXPECT_THAT(load(whole, {.registry = &registry}).diagnostics.at(0).message,
              HasSubstr("is an int for the constant of SubTree \"Sub\" and a double for port \"by\" of Add; write it "
                        "with a point: \"1.0\""));
}

TEST(SubTreeConstants, ThatAPortCannotTakeAreToldWhereTheyStandWithTheWayOutOfTheType) {
  const auto told_of = [](const std::string& constant, const std::string& type) {
    const auto tree = load(in_tree("<SubTree ID=\"Sub\" v=\"" + constant + "\"/>",
                                   "<BehaviorTree ID=\"Sub\"><Go v=\"{v}\"/></BehaviorTree><TreeNodesModel><Action "
                                   "ID=\"Go\"><input_port name=\"v\" type=\"" +
                                       type + "\"/></Action></TreeNodesModel>"),
                           {}, "m.xml");
    return tree.diagnostics.empty() ? "" : to_string(tree.diagnostics.front());
  };
  EXPECT_EQ(told_of("20", "double"),
            "m.xml:2:46: entry \"v\" is an int for the constant of SubTree \"Sub\" and a double for port \"v\" of Go; "
            "write it with a point: \"20.0\"");
  EXPECT_THAT(told_of("0", "bool"), ::testing::EndsWith("; write \"false\""));
  EXPECT_THAT(told_of("3.0", "int"), ::testing::EndsWith("; write it without a point: \"3\""));
  EXPECT_THAT(told_of("3", "unsigned"),
              ::testing::EndsWith("; let a Script before the SubTree say v := 3, and write v=\"{v}\""));
  EXPECT_THAT(told_of("-3", "unsigned"), ::testing::EndsWith("for port \"v\" of Go")) << "there is no way";
  EXPECT_EQ(told_of("3", "int"), "");
  EXPECT_EQ(told_of("true", "bool"), "");
  EXPECT_EQ(told_of("fast", "std::string"), "");
  EXPECT_EQ(told_of("fast", "double"),
            "m.xml:2:46: warning: SubTree \"Sub\" gives \"fast\" to port \"v\", which is a double: what reads it "
            "fails");
}

TEST(SubTreeConstants, OfTextArePutToEachPortByItself) {
  Registry registry;
  registry.action("Flag", {input<bool>("v")},
                  [](Context& self) { return *self.input<bool>("v") ? Status::kSuccess : Status::kFailure; });
  registry.action("Count", {input<unsigned>("v")}, [](Context&) { return Status::kSuccess; });
  registry.action("Say", {input<std::string>("v")}, [](Context& self) {
    return *self.input<std::string>("v") == "true" ? Status::kSuccess : Status::kFailure;
  });
  const std::string body = "<SubTree ID=\"Sub\" name=\"Sub\" v=\"true\"/>";
  const std::string sub =
      "<BehaviorTree ID=\"Sub\"><Sequence><Flag v=\"{v}\"/><Say v=\"{v}\"/></Sequence></BehaviorTree>";
  EXPECT_TRUE(load(in_tree(body, sub), {.registry = &registry}).diagnostics.empty());
  EXPECT_EQ(runner(body, registry, sub).tick(), Status::kSuccess);
  // The way out that is told for a number of another type.
  const std::string script =
      "<Sequence><Script code=\"v := 3\"/><SubTree ID=\"Sub\" name=\"Sub\" v=\"{v}\"/></Sequence>";
  EXPECT_EQ(runner(script, registry, "<BehaviorTree ID=\"Sub\"><Count v=\"{v}\"/></BehaviorTree>").tick(),
            Status::kSuccess);
}

TEST(Queues, ArePoppedCountedConsumedAndLoopedOver) {
  Registry registry;
  registry.add<PopFromQueue<double>>("PopFromQueue");
  registry.add<QueueSize<double>>("QueueSize");
  registry.add<ConsumeQueue<double>>("ConsumeQueue", Category::kDecorator);
  registry.loop<Pose>("LoopPose");
  std::vector<double> seen;
  registry.action("Fill", {output<std::vector<double>>("queue"), output<std::vector<Pose>>("poses")},
                  [](Context& self) {
                    return self.output("queue", std::vector<double>{1, 2, 3, 4}) &&
                                   self.output("poses", std::vector<Pose>{{5, 1}, {7, 1}})
                               ? Status::kSuccess
                               : Status::kFailure;
                  });
  registry.action("See", {input<double>("value")}, [&](Context& self) {
    seen.push_back(self.input_or("value", -1.0));
    return Status::kSuccess;
  });
  registry.action("SeePose", {input<Pose>("value")}, [&](Context& self) {
    seen.push_back(self.input_or("value", Pose{}).x);
    return Status::kSuccess;
  });
  Runner r = runner(
      "<Sequence><RunOnce then_skip=\"false\"><Fill queue=\"{q}\" poses=\"{ps}\"/></RunOnce>"
      "<PopFromQueue queue=\"{q}\" popped_item=\"{v}\"/><See value=\"{v}\"/><QueueSize queue=\"{q}\" size=\"{n}\"/>"
      "<ConsumeQueue queue=\"{q}\" popped_item=\"{v}\"><See value=\"{v}\"/></ConsumeQueue>"
      "<Inverter><QueueSize queue=\"{q}\" size=\"{n}\"/></Inverter>"
      "<Inverter><PopFromQueue queue=\"{q}\" popped_item=\"{v}\"/></Inverter>"
      "<LoopPose queue=\"{ps}\" value=\"{p}\"><SeePose value=\"{p}\"/></LoopPose></Sequence>",
      registry);
  EXPECT_EQ(r.tick_until_waiting(), Status::kRunning);
  while (r.tick() == Status::kRunning) {
  }
  EXPECT_THAT(seen, ::testing::ElementsAre(1, 2, 3, 4, 5, 7));
  EXPECT_EQ(*entry(r.tree(), r.state(), "n"), Value(3));
  EXPECT_TRUE(save(r.tree(), r.state()).has_value());
}

TEST(Stamps, TellWhenAnEntryWasWritten) {
  Registry registry;
  Stamped<int> seen{};
  registry.action("Look", {input<int>("at")}, [&](Context& self) {
    const auto stamped = self.stamped<int>("at");
    if (stamped) seen = *stamped;
    return stamped ? Status::kSuccess : Status::kFailure;
  });
  Runner r = runner("<Sequence><Script code=\"n := 1\"/><Look at=\"{n}\"/></Sequence>", registry);
  r.tick(TimePoint(3ms));
  EXPECT_EQ(r.tick(TimePoint(8ms)), Status::kSuccess);
  EXPECT_EQ(seen.value, 1);
  EXPECT_EQ(seen.sequence, 2U);
  EXPECT_EQ(seen.stamp, TimePoint(8ms));
}

const char* const kTwoScopes =
    "<BehaviorTree ID=\"S\"><Sequence><Script code=\"inner := 'x'; _own := 2.5\"/><Sleep msec=\"10\"/></Sequence>"
    "</BehaviorTree>";

TEST(BlackboardJson, ComesBackAsItWas) {
  const Registry registry;
  const std::string body = "<Sequence><Script code=\"n := 1\"/><SubTree ID=\"S\" name=\"sub\"/></Sequence>";
  Runner r = runner(body, registry, kTwoScopes);
  r.tick();
  const std::string json = to_json(export_blackboard(r.tree(), r.state()));
  EXPECT_EQ(json, R"({"":{"n":1},"sub":{"inner":"x","_own":2.5}})");
  Runner other = runner(body, registry, kTwoScopes);
  ASSERT_TRUE(import_blackboard(other.tree(), other.state(), text::parse_json(json).value(), TimePoint{}));
  EXPECT_EQ(to_json(export_blackboard(other.tree(), other.state())), json);
}

TEST(BlackboardJson, TellsSubTreesApartThatNobodyHasNamed) {
  const Registry registry;
  const std::string body =
      "<Sequence><SubTree ID=\"S\"/><SubTree ID=\"T\"/><SubTree ID=\"S\" name=\"sub\"/></Sequence>";
  const std::string more =
      "<BehaviorTree ID=\"S\"><Script code=\"a := 1\"/></BehaviorTree>"
      "<BehaviorTree ID=\"T\"><Sequence><Script code=\"b := 2\"/><SubTree ID=\"S\"/></Sequence></BehaviorTree>";
  Runner r = runner(body, registry, more);
  ASSERT_EQ(r.tick(), Status::kSuccess);
  const std::string json = to_json(export_blackboard(r.tree(), r.state()));
  EXPECT_EQ(json, R"({"S::2":{"a":1},"T::4":{"b":2},"T::4.S::7":{"a":1},"sub":{"a":1}})");
  Runner other = runner(body, registry, more);
  ASSERT_TRUE(import_blackboard(other.tree(), other.state(), text::parse_json(json).value(), TimePoint{}));
  EXPECT_EQ(to_json(export_blackboard(other.tree(), other.state())), json);
  EXPECT_EQ(find_scope(r.tree(), "T::4"), 3U);
  EXPECT_EQ(find_scope(r.tree(), "U::4"), kNoNode);
}

TEST(BlackboardJson, IsTakenWholeOrNotAtAll) {
  const Registry registry;
  Runner r = runner("<Script code=\"n := 1\"/>", registry);
  r.tick();
  const State before = r.state();
  for (const std::string wrong :
       {R"({"": {"m": 2, "n": "text"}})", R"({"": {"m": 2}, "nowhere": {}})", R"({"": 3})", "7"}) {
    EXPECT_FALSE(import_blackboard(r.tree(), r.state(), text::parse_json(wrong).value(), TimePoint{})) << wrong;
    EXPECT_TRUE(r.state() == before) << wrong;
  }
}

TEST(BlackboardBackup, RestoresTheEntriesAndNothingElse) {
  const Registry registry;
  Runner r =
      runner("<Sequence><Script code=\"n := 1\"/><Sleep msec=\"10\"/><Script code=\"n += 1\"/></Sequence>", registry);
  EXPECT_EQ(r.tick(TimePoint(0ms)), Status::kRunning);
  const State backup = r.state();
  ASSERT_TRUE(set_entry(r.tree(), r.state(), "n", Value(40), TimePoint(1ms)));
  ASSERT_TRUE(set_entry(r.tree(), r.state(), "extra", Value(1), TimePoint(1ms)));
  EXPECT_EQ(r.tick(TimePoint(5ms)), Status::kRunning);
  restore_blackboard(r.state(), backup);
  EXPECT_EQ(*entry(r.tree(), r.state(), "n"), Value(1));
  EXPECT_EQ(entry(r.tree(), r.state(), "extra"), nullptr);
  EXPECT_EQ(r.tick(TimePoint(10ms)), Status::kSuccess);
  EXPECT_EQ(*entry(r.tree(), r.state(), "n"), Value(2));
}

TEST(Schema, HasEveryNodeWithItsPortsAndIsWellFormed) {
  Registry registry;
  registry.action("Dance", {input<double>("speed"), input_default<bool>("loud", "true")},
                  [](Context&) { return Status::kSuccess; });
  const std::string schema = write_schema(models(registry, true));
  const auto document = text::XmlDocument::parse(schema);
  ASSERT_TRUE(document.has_value());
  EXPECT_THAT(schema, HasSubstr("<xs:attribute name=\"speed\" type=\"realPort\"/>"));
  EXPECT_THAT(schema, HasSubstr("<xs:attribute name=\"loud\" type=\"boolPort\" default=\"true\"/>"));
  for (const NodeModel& model : models(registry, true)) {
    if (model.category == Category::kSubTree) continue;
    EXPECT_THAT(schema, HasSubstr("<xs:element name=\"" + model.id + "\">"));
    EXPECT_THAT(schema, HasSubstr("<xs:element ref=\"" + model.id + "\"/>"));
  }
}

}  // namespace
}  // namespace sentree::bt
