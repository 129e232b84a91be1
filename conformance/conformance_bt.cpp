#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/bt/detail/blackboard.h"
#include "sentree/bt/load.h"
#include "sentree/bt/model.h"
#include "sentree/bt/registry.h"
#include "sentree/bt/state.h"
#include "sentree/bt/step.h"
#include "sentree/text/json.h"

// Replays recordings of BehaviorTree.CPP (conformance/bt/README.md) and compares statuses, events and blackboards.

namespace {

using namespace sentree;

constexpr int kTicks = 20;

/// What the test leaves did in the present item.
struct Events {
  std::string text;
  void add(const bt::Context& self, char letter) {
    // The recorder stops at the first error.
    if (self.failed()) return;
    if (!text.empty()) text += ' ';
    // Recordings of format 3 give names only.
    for (const char c : self.tree().format() == 3 ? std::string(self.name()) : self.path()) text += c == '.' ? '/' : c;
    text += ':';
    text += letter;
  }
};

bt::Status status_of(char letter) {
  switch (letter) {
    case 'S': return bt::Status::kSuccess;
    case 'F': return bt::Status::kFailure;
    case 'R': return bt::Status::kRunning;
    default: return bt::Status::kSkipped;
  }
}

/// Consults its plan at every tick while IDLE or RUNNING; forgets its place only when halted.
struct Scripted {
  Events* events = nullptr;
  std::int64_t index = 0;

  static bt::Ports ports() { return {bt::input<std::string>("plan")}; }
  bt::Status consult(bt::Context& self) {
    const std::string plan = self.input_or<std::string>("plan", "S");
    const char letter = plan[static_cast<std::size_t>(index) * 2];
    index = (index + 1) % static_cast<std::int64_t>((plan.size() + 1) / 2);
    events->add(self, letter);
    return status_of(letter);
  }
  [[nodiscard]] Value save() const { return index; }
  bool restore(const Value& saved) {
    const auto* number = saved.as_int();
    if (number != nullptr) index = *number;
    return number != nullptr;
  }
};

struct ScriptedAction : Scripted {
  bt::Status on_start(bt::Context& self) { return consult(self); }
  bt::Status on_running(bt::Context& self) { return consult(self); }
  void on_halted(bt::Context& self) {
    index = 0;
    events->add(self, 'H');
  }
};

struct ScriptedCondition : Scripted {
  bt::Status tick(bt::Context& self) { return consult(self); }
};

template <class T>
void add_copy(bt::Registry& registry, const std::string& id, Events* events, T (*change)(const T&)) {
  registry.action(id, {bt::input<T>("in"), bt::output<T>("out")}, [events, change](bt::Context& self) {
    const auto value = self.input<T>("in");
    if (!value) {
      events->add(self, 'F');
      return bt::Status::kFailure;
    }
    if (self.output<T>("out", change(*value))) events->add(self, 'S');
    return bt::Status::kSuccess;
  });
}

struct Item {
  std::string status;
  std::string events;
  std::map<std::string, Value> blackboard;
};

Value shown(const Value& value) {
  const double* number = value.as_double();
  if (number == nullptr || std::isfinite(*number)) return value;
  return std::isnan(*number) ? "#nan" : *number > 0 ? "#inf" : "#-inf";
}

bool same(const Value& a, const Value& b) {
  if (a.is_number() && b.is_number()) {
    const double x = a.number();
    const double y = b.number();
    return std::abs(x - y) <= 1e-12 * std::max(std::abs(x), std::abs(y));
  }
  return a == b;
}

bool same(const std::map<std::string, Value>& a, const std::map<std::string, Value>& b) {
  if (a.size() != b.size()) return false;
  for (const auto& [key, value] : a) {
    const auto other = b.find(key);
    if (other == b.end() || !same(value, other->second)) return false;
  }
  return true;
}

std::string to_text(const std::map<std::string, Value>& blackboard) {
  std::string text;
  for (const auto& [key, value] : blackboard) text += key + "=" + to_json(value) + " ";
  return text;
}

/// The whole blackboard as the recordings list it: numbers and strings, each under its owner; in format 3 under every
/// blackboard that knows the entry.
std::map<std::string, Value> listing(const bt::Tree& tree, const bt::State& state) {
  std::map<std::string, Value> all;
  const auto add = [&all](const std::string& key, const Value& value) {
    if (const bool* truth = value.as_bool()) all[key] = static_cast<std::int64_t>(*truth);
    if (value.is_number() || value.as_string() != nullptr) all[key] = shown(value);
  };
  if (tree.format() == 3) {
    const bt::Model& model = tree.model();
    // A blackboard knows a name once a port or a write inside it has made it, and those above, through which it is
    // remapped, know it then.
    std::vector<bool> known(model.cells.size(), false);
    const auto know = [&](std::uint32_t cell) {
      for (; cell != bt::kNone && !known[cell]; cell = model.cells[cell].parent) known[cell] = true;
    };
    for (const bt::DeclaredEntry& entry : model.declared) know(entry.cell);
    for (std::uint32_t cell = 0; cell < model.cells.size(); ++cell) {
      if (bt::Blackboard::is_linked(state, cell)) know(cell);
    }
    std::size_t number = 0;
    for (std::size_t scope = 0; scope < model.scopes.size(); ++scope) {
      const bt::Scope& s = model.scopes[scope];
      if (s.shared) continue;
      const std::string start = scope == 0 ? "" : "#" + std::to_string(++number) + "/";
      for (const std::uint32_t cell : s.first_mention) {
        if (!known[cell]) continue;
        const std::string& name = model.strings[model.cells[cell].name];
        if (const Value* value = bt::entry(tree, state, name, s.subtree)) add(start + name, *value);
      }
    }
    return all;
  }
  for (const bt::EntryFact& fact : bt::blackboard(tree, state)) {
    std::string key = fact.scope.empty() ? "" : fact.scope + "/";
    for (char& c : key) c = c == '.' ? '/' : c;
    add(key + fact.name, *fact.value);
  }
  return all;
}

/// Runs one recorded case; `error` is "load", "tick", "halt" or empty.
struct Replay {
  std::string error;
  std::vector<Item> items;
  Diagnostics diagnostics;

  void run(const std::string& xml, int halt_after) {
    Events events;
    bt::Registry registry;
    ScriptedAction action;
    ScriptedCondition condition;
    action.events = condition.events = &events;
    registry.add<ScriptedAction>("ScriptedAction", action);
    registry.add<ScriptedCondition>("ScriptedCondition", bt::Category::kCondition, condition);
    add_copy<double>(registry, "CopyDouble", &events, [](const double& v) { return v + 1.0; });
    add_copy<std::string>(registry, "CopyString", &events, [](const std::string& v) { return v + "!"; });
    registry.enum_value("RED", 0);
    registry.enum_value("GREEN", 1);
    registry.enum_value("BLUE", 2);
    bt::LoadOptions options;
    options.registry = &registry;
    options.main_tree = "Main";
    auto loaded = bt::load(xml, options);
    diagnostics = std::move(loaded.diagnostics);
    if (!loaded.ok()) {
      error = "load";
      return;
    }
    const bt::Tree& tree = *loaded.value;
    bt::State state(tree);
    bt::Effects effects;
    const auto item = [&](const bt::Input& input) {
      events.text.clear();
      const bt::StepResult result = bt::step(tree, state, input, TimePoint{}, effects);
      const bool halt = input.kind == bt::Input::Kind::kHalt;
      std::string status = halt ? "H" : std::string(to_string(result.status)).substr(0, 1);
      if (result.status == bt::Status::kSkipped && !halt) status = "K";
      if (result.kind == bt::StepResult::Kind::kFailed) {
        status = "X";
        error = halt ? "halt" : "tick";
        diagnostics.push_back(*effects.error);
      }
      items.push_back({status, events.text, listing(tree, state)});
      return error.empty();
    };
    for (int tick = 1; tick <= kTicks; ++tick) {
      if (!item(bt::Input::tick())) return;
      if (tick == halt_after && !item(bt::Input::halt())) return;
    }
  }
};

/// The first difference in words; empty if there is none.
std::string difference(const Value& recorded, const Replay& replay) {
  const Value* error = recorded.find("error");
  const std::string wanted(error != nullptr ? error->text() : "");
  std::string why;
  for (const Diagnostic& d : replay.diagnostics) {
    if (d.severity == Severity::kError) why += "\n      " + to_string(d);
  }
  if (wanted != replay.error) {
    const Value* cause = recorded.find("cause");
    return "error: expected \"" + wanted + "\"" + (cause != nullptr ? " (" + std::string(cause->text()) + ")" : "") +
           ", got \"" + replay.error + "\"" + why;
  }
  std::map<std::string, Value> blackboard;
  const Value* ticks = recorded.find("ticks");
  const List none;
  const List& items = ticks != nullptr && ticks->as_list() != nullptr ? *ticks->as_list() : none;
  for (std::size_t i = 0; i < items.size() && i < replay.items.size(); ++i) {
    const Item& got = replay.items[i];
    if (items[i].find("r")->text() != got.status || items[i].find("ev")->text() != got.events) {
      return "item " + std::to_string(i) + ": expected " + std::string(items[i].find("r")->text()) + " [" +
             std::string(items[i].find("ev")->text()) + "], got " + got.status + " [" + got.events + "]" + why;
    }
    if (const Value* bb = items[i].find("bb"); bb != nullptr && bb->as_map() != nullptr) {
      blackboard.clear();
      for (const auto& [key, value] : *bb->as_map()) blackboard[key] = value;
    }
    if (!same(blackboard, got.blackboard)) {
      return "item " + std::to_string(i) + ": blackboard expected " + to_text(blackboard) + "got " +
             to_text(got.blackboard);
    }
  }
  if (items.size() != replay.items.size()) {
    return "expected " + std::to_string(items.size()) + " items, got " + std::to_string(replay.items.size());
  }
  return {};
}

/// docs/deviations.md: files that BehaviorTree.CPP refuses and we load, with a warning that says so.
bool is_deviation(const Value& recorded, const Replay& replay) {
  const Value* error = recorded.find("error");
  if (error == nullptr || error->text() != "load" || replay.error == "load") return false;
  for (const Diagnostic& d : replay.diagnostics) {
    if (d.code == "bt.explicit-in-reactive" || d.code == "bt.text-of-number") return true;
  }
  return false;
}

}  // namespace

int main(int argc, char** argv) {
  bool json = false;
  bool usage = argc < 2;
  std::vector<std::string> files;
  std::string only;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--json") {
      json = true;
    } else if (argument == "--case" && i + 1 < argc) {
      only = argv[++i];
    } else if (argument.starts_with("--")) {
      usage = true;
    } else {
      files.emplace_back(argument);
    }
  }
  if (usage || files.empty()) {
    std::cerr
        << "usage: conformance_bt FILE… [--json] [--case ID]\n"
           "Replays recordings of BehaviorTree.CPP. Exit status: 0 all as recorded or a documented deviation, 1 not.\n";
    return 2;
  }
  int passed = 0, failed = 0, deviations = 0;
  for (const std::string& file : files) {
    std::ifstream stream(file);
    if (!stream) {
      std::cerr << file << ": cannot be read\n";
      return 3;
    }
    std::string line;
    while (std::getline(stream, line)) {
      if (line.empty()) continue;
      const auto recorded = text::parse_json(line, file);
      if (!recorded || recorded->find("id") == nullptr || recorded->find("xml") == nullptr) {
        std::cerr << file << ": a line is no record\n";
        return 3;
      }
      const std::string id(recorded->find("id")->text());
      if (!only.empty() && id != only) continue;
      const Value* halt_after = recorded->find("halt_after");
      Replay replay;
      replay.run(std::string(recorded->find("xml")->text()),
                 halt_after != nullptr ? static_cast<int>(halt_after->number()) : 0);
      const std::string what = difference(*recorded, replay);
      if (what.empty()) {
        ++passed;
      } else if (is_deviation(*recorded, replay)) {
        ++deviations;
      } else {
        ++failed;
        std::cerr << file << ": " << id << ": " << what << "\n";
      }
    }
  }
  if (json) {
    std::cout << "{\"passed\":" << passed << ",\"failed\":" << failed << ",\"deviations\":" << deviations << "}\n";
  } else {
    std::cout << passed << " passed, " << failed << " failed, " << deviations << " documented deviations\n";
  }
  return failed == 0 ? 0 : 1;
}
