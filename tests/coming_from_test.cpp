// The Sentree half of docs/coming-from-behaviortree-cpp.md: it compiles, it works, and the page shows just this.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <utility>

#include "sentree/bt/library.h"
#include "sentree/exec/coroutine_action.h"
#include "sentree/exec/executor.h"
#include "sentree/exec/threaded_action.h"

namespace bt = sentree::bt;
namespace exec = sentree::exec;
using namespace std::chrono_literals;

std::string said;

struct Position2D {
  double x, y;
};

struct Robot {
  std::string name;
  explicit Robot(std::string called) : name(std::move(called)) {}
};

template <>
struct sentree::bt::Convert<Position2D> {
  static std::string name() { return "Position2D"; }
  static Value to_value(const Position2D& p) { return List{p.x, p.y}; }
  static std::optional<Position2D> from_value(const Value& value) {
    const List* list = value.as_list();
    if (list == nullptr || list->size() != 2) return std::nullopt;
    return Position2D{(*list)[0].number(), (*list)[1].number()};
  }
  static std::optional<Position2D> from_text(std::string_view text) {
    const auto parts = Convert<std::vector<double>>::from_text(text);
    if (!parts || parts->size() != 2) return std::nullopt;
    return Position2D{(*parts)[0], (*parts)[1]};
  }
};

struct Move {
  double left = 0;
  static bt::Ports ports() { return {bt::input<double>("metres")}; }
  bt::Status on_start(bt::Context& self) {
    left = self.input_or("metres", 0.0);
    return bt::Status::kRunning;
  }
  bt::Status on_running(bt::Context&) { return (left -= 0.5) > 0 ? bt::Status::kRunning : bt::Status::kSuccess; }
  void on_halted(bt::Context&) {}
  sentree::Value save() const { return left; }
  bool restore(const sentree::Value& v) {
    left = v.number();
    return v.is_number();
  }
};

struct RoundRobin {
  std::size_t next = 0;
  bt::Next on_tick(bt::Context& self) { return bt::Next::tick(next % self.child_count()); }
  bt::Next on_child(bt::Context& self, std::size_t child, bt::Status status) {
    if (status == bt::Status::kRunning) return bt::Next::done(status);
    self.reset_child(child);
    next = child + 1;
    return bt::Next::done(status);
  }
};

struct UntilTrue {
  static bt::Ports ports() { return {bt::input<bool>("flag")}; }
  bt::Next on_tick(bt::Context&) { return bt::Next::tick(0); }
  bt::Next on_child(bt::Context& self, std::size_t, bt::Status status) {
    if (status == bt::Status::kRunning) return bt::Next::done(status);
    self.reset_child(0);
    return bt::Next::done(self.input_or("flag", false) ? status : bt::Status::kRunning);
  }
};

exec::Task ask(exec::Coroutine& self) {
  said += "may I? ";
  co_await self.sleep(2s);
  said += self->input_or<std::string>("answer", "no");
  co_return bt::Status::kSuccess;
}

SENTREE_REGISTER_NODES(registry) { registry.add<Move>("Move"); }

namespace {

using ::testing::HasSubstr;

void register_all(bt::Registry& registry) {
  registry.action("SayHello", {bt::input<std::string>("to")}, [](bt::Context& self) {
    said += "Hello " + self.input_or<std::string>("to", "") + ";";
    return bt::Status::kSuccess;
  });
  registry.condition("BatteryOk", {bt::input<double>("level")}, [](bt::Context& self) {
    return self.input_or("level", 0.0) > 20 ? bt::Status::kSuccess : bt::Status::kFailure;
  });
  registry.decorator("Not", {}, [](bt::Context&, bt::Status child) {
    if (child == bt::Status::kSuccess) return bt::Status::kFailure;
    return child == bt::Status::kFailure ? bt::Status::kSuccess : child;
  });
  registry.action("Mirror", {bt::input<Position2D>("from"), bt::output<Position2D>("to")}, [](bt::Context& self) {
    const auto from = self.input<Position2D>("from");
    if (!from) return bt::Status::kFailure;
    self.output("to", Position2D{-from->x, from->y});
    return bt::Status::kSuccess;
  });
  registry.action("Greet", {bt::input_default<std::shared_ptr<Robot>>("robot", "{@robot}")}, [](bt::Context& self) {
    const auto robot = self.input<std::shared_ptr<Robot>>("robot");
    if (!robot) return bt::Status::kFailure;
    said += "I am " + (*robot)->name + ";";
    return bt::Status::kSuccess;
  });
  registry.add<RoundRobin>("RoundRobin", bt::Category::kControl);
  registry.add<UntilTrue>("UntilTrue", bt::Category::kDecorator);
  sentree_register_nodes(registry);
  auto threads = std::make_shared<exec::Threads>(4);
  exec::threaded_action(registry, threads, "Search", {bt::input<int>("n"), bt::output<int>("found")},
                        [](exec::Job& job) {
                          for (int i = 0; i < job.input_or("n", 0); ++i) {
                            if (job.stop_requested()) return bt::Status::kFailure;
                          }
                          job.output("found", 42);
                          return bt::Status::kSuccess;
                        });
  exec::coroutine_action(registry, "Ask", {bt::input<std::string>("answer")}, ask);
}

bt::Runner runner(const std::string& body) {
  bt::Registry registry;
  register_all(registry);
  auto loaded = bt::load("<root BTCPP_format=\"4\"><BehaviorTree ID=\"M\">" + body + "</BehaviorTree></root>",
                         {.registry = &registry});
  for (const auto& d : loaded.diagnostics) ADD_FAILURE() << to_string(d);
  said.clear();
  return bt::Runner(std::move(*loaded.value));
}

TEST(ComingFromBehaviorTreeCpp, FunctionsConditionsDecoratorsAndUserTypes) {
  bt::Runner r = runner(
      "<Sequence><SayHello to=\"you\"/><BatteryOk level=\"30\"/><Not><BatteryOk level=\"10\"/></Not>"
      "<Mirror from=\"1;2\" to=\"{p}\"/><Mirror from=\"{p}\" to=\"{q}\"/></Sequence>");
  EXPECT_EQ(r.tick(), bt::Status::kSuccess);
  EXPECT_EQ(said, "Hello you;");
  EXPECT_EQ(*bt::entry(r.tree(), r.state(), "q"), sentree::Value(sentree::List{1.0, 2.0}));
}

TEST(ComingFromBehaviorTreeCpp, ObjectsOnTheBlackboard) {
  bt::Runner r = runner("<Greet/>");
  EXPECT_EQ(r.tick(), bt::Status::kFailure);
  const auto robot = std::make_shared<Robot>("R1");
  const auto now = sentree::TimePoint(0s);
  ASSERT_TRUE(bt::set_entry_as<std::shared_ptr<Robot>>(r.tree(), r.state(), "robot", robot, now));
  ASSERT_TRUE(bt::set_entry_as<double>(r.tree(), r.state(), "speed", 0.5, now));
  EXPECT_EQ(bt::entry_as<double>(r.tree(), r.state(), "speed").value(), 0.5);
  EXPECT_EQ(r.tick(), bt::Status::kSuccess);
  EXPECT_EQ(said, "I am R1;");
}

TEST(ComingFromBehaviorTreeCpp, TreesOfSeveralFiles) {
  const std::string a = "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\"><SubTree ID=\"Hi\"/></BehaviorTree></root>";
  const std::string b = "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Hi\"><SayHello to=\"you\"/></BehaviorTree></root>";
  bt::Library library;
  ASSERT_TRUE(library.add("a.xml", a) && library.add("b.xml", b));
  bt::Registry registry;
  register_all(registry);
  bt::LoadOptions options{.registry = &registry, .main_tree = "Main"};
  options.read_file = [&](const std::filesystem::path& path) -> sentree::Result<std::string> {
    return path == "a.xml" ? a : b;
  };
  library.serve(options);
  auto loaded = bt::load(a, options, library.main_file("Main")->path.string());
  ASSERT_TRUE(loaded.ok());
  said.clear();
  EXPECT_EQ(bt::Runner(std::move(*loaded.value)).tick(), bt::Status::kSuccess);
  EXPECT_EQ(said, "Hello you;");
}

TEST(ComingFromBehaviorTreeCpp, StatefulActions) {
  bt::Runner r = runner("<Move metres=\"1\"/>");
  EXPECT_EQ(r.tick(), bt::Status::kRunning);
  EXPECT_EQ(r.tick(), bt::Status::kRunning);
  const auto saved = bt::save(r.tree(), r.state());
  ASSERT_TRUE(saved);
  EXPECT_EQ(r.tick(), bt::Status::kSuccess);
  r.state() = bt::restore(r.tree(), *saved).value();
  EXPECT_EQ(r.tick(), bt::Status::kSuccess);
}

TEST(ComingFromBehaviorTreeCpp, ControlsAndDecorators) {
  bt::Runner r =
      runner("<RoundRobin><SayHello to=\"a\"/><UntilTrue flag=\"true\"><SayHello to=\"b\"/></UntilTrue></RoundRobin>");
  for (int i = 0; i < 3; ++i) EXPECT_EQ(r.tick(), bt::Status::kSuccess);
  EXPECT_EQ(said, "Hello a;Hello b;Hello a;");
}

TEST(ComingFromBehaviorTreeCpp, ThreadsAndCoroutines) {
  bt::Registry registry;
  register_all(registry);
  auto loaded =
      bt::load("<root BTCPP_format=\"4\"><BehaviorTree ID=\"M\"><Search n=\"3\" found=\"{n}\"/></BehaviorTree></root>",
               {.registry = &registry});
  ASSERT_TRUE(loaded.ok());
  exec::Executor executor(std::move(*loaded.value), {.period = 1h});
  EXPECT_EQ(executor.run(), bt::Status::kSuccess);

  bt::Runner r = runner("<Ask answer=\"yes\"/>");
  EXPECT_EQ(r.tick(sentree::TimePoint(0s)), bt::Status::kRunning);
  EXPECT_EQ(r.tick(sentree::TimePoint(1s)), bt::Status::kRunning);
  EXPECT_EQ(r.tick(sentree::TimePoint(2s)), bt::Status::kSuccess);
  EXPECT_EQ(said, "may I? yes");
}

// --- The page
// ---------------------------------------------------------------------------------------------------------

std::string read(const std::string& file) {
  std::ifstream in(std::string(SENTREE_SOURCE_DIR) + "/" + file);
  std::stringstream content;
  content << in.rdbuf();
  return content.str();
}

/// Without indentation and empty lines.
std::string plain(const std::string& text) {
  std::istringstream lines(text);
  std::string all = "\n";
  for (std::string line; std::getline(lines, line);) {
    const std::size_t begin = line.find_first_not_of(' ');
    if (begin != std::string::npos) all += line.substr(begin) + "\n";
  }
  return all;
}

TEST(ComingFromBehaviorTreeCpp, ThePageShowsTheCodeOfThisTest) {
  const std::string page = read("docs/coming-from-behaviortree-cpp.md");
  const std::string source = plain(read("tests/coming_from_test.cpp"));
  int blocks = 0;
  const std::string begin = "```cpp\n// Sentree\n";
  for (std::size_t at = page.find(begin); at != std::string::npos; at = page.find(begin, at + 1)) {
    const std::size_t from = at + begin.size();
    const std::string block = plain(page.substr(from, page.find("```", from) - from));
    EXPECT_THAT(source, HasSubstr(block));
    ++blocks;
  }
  EXPECT_GE(blocks, 9);
}

}  // namespace
