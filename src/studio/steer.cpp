#include "sentree/studio/steer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <iterator>

#include "sentree/project/scenario_text.h"
#include "sentree/text/file.h"
#include "sentree/text/overlay.h"

namespace sentree::studio {

namespace {

using namespace project::intervention;

// What a request says, each with a message that names what is wrong.
class Asked {
 public:
  Asked(const std::string& op, const Value& request) : op_(op), request_(request) {}

  Result<std::string> text(const char* name) const {
    const Value* value = request_.find(name);
    if (value != nullptr && value->as_string() != nullptr) return *value->as_string();
    return fail("studio.request", fmt::format("{} needs a text \"{}\"", op_, name));
  }
  std::string text_or(const char* name, const std::string& otherwise) const {
    const Value* value = request_.find(name);
    return value != nullptr && value->as_string() != nullptr ? *value->as_string() : otherwise;
  }
  Result<std::uint64_t> count(const char* name, std::optional<std::uint64_t> otherwise) const {
    const Value* value = request_.find(name);
    if ((value == nullptr || value->is_null()) && otherwise) return *otherwise;
    constexpr double kExact = 9007199254740992.0;
    if (value != nullptr && value->is_number() && value->number() >= 0 && value->number() <= kExact)
      return static_cast<std::uint64_t>(value->number());
    return fail("studio.request", fmt::format("{} needs a whole number \"{}\"", op_, name));
  }
  Result<double> number(const char* name) const {
    const Value* value = request_.find(name);
    if (value != nullptr && value->is_number()) return value->number();
    return fail("studio.request", fmt::format("{} needs a number \"{}\"", op_, name));
  }
  Value value(const char* name) const {
    const Value* found = request_.find(name);
    return found != nullptr ? *found : Value();
  }
  bool flag(const char* name) const {
    const Value* found = request_.find(name);
    return found != nullptr && found->as_bool() != nullptr && *found->as_bool();
  }

 private:
  const std::string& op_;
  const Value& request_;
};

Result<Value> done(const Result<void>& result) {
  if (!result) return tl::unexpected(result.error());
  return Value(Map());
}

Result<Value> standing(const char* name, const Result<std::uint64_t>& id) {
  if (!id) return tl::unexpected(id.error());
  return Value(Map{{name, static_cast<std::int64_t>(*id)}});
}

Result<Value> call(runtime::Steering& steering, const Asked& asked) {
  const auto service = asked.text("service");
  if (!service) return tl::unexpected(service.error());
  const auto method = asked.text("method");
  if (!method) return tl::unexpected(method.error());
  Value args = asked.value("args");
  auto outcome = steering.call(*service, *method, args.as_map() != nullptr ? std::move(args) : Value(Map()));
  if (!outcome) return tl::unexpected(outcome.error());
  if (!outcome->ok) return fail("studio.call", fmt::format("{}.{}: {}", *service, *method, outcome->message));
  return Value(Map{{"result", std::move(outcome->result)}});
}

Result<Value> set_breakpoint(runtime::Steering& steering, const Subject& subject, const Asked& asked) {
  const std::string kind = asked.text_or("kind", "");
  if (kind == "node") {
    const auto node = asked.count("node", std::nullopt);
    if (!node) return tl::unexpected(node.error());
    if (*node >= subject.plan.tree.size()) return fail("studio.request", fmt::format("there is no node {}", *node));
    return standing("breakpoint", steering.break_at_node(subject.plan.tree.path(static_cast<bt::NodeId>(*node)),
                                                         asked.text_or("status", "")));
  }
  if (kind == "state") {
    const auto chart = asked.text("chart");
    if (!chart) return tl::unexpected(chart.error());
    const auto state = asked.text("state");
    if (!state) return tl::unexpected(state.error());
    return standing("breakpoint", steering.break_at_state(*chart, *state));
  }
  if (kind == "message") {
    const auto pattern = asked.text("pattern");
    if (!pattern) return tl::unexpected(pattern.error());
    return standing("breakpoint", steering.break_at_message(*pattern));
  }
  return fail("studio.request", fmt::format("a breakpoint is of kind node, state or message, not \"{}\"", kind));
}

Value to_value(const Subject& subject, const mission::StandingIntervention& standing) {
  const project::Intervention& what = standing.what;
  Map value{{"id", static_cast<std::int64_t>(standing.id)}, {"used", static_cast<std::int64_t>(standing.used)}};
  value["kind"] = std::string(project::word_of(what));
  std::string text = project::describe(what);
  if (const auto* delay = std::get_if<Delay>(&what)) {
    value["message"] = delay->message;
    value["by"] = delay->by.count();
    text = fmt::format("{} late by {} s", delay->message, shortest_decimal(seconds(delay->by)));
  } else if (const auto* falsify = std::get_if<Falsify>(&what)) {
    value["call"] = falsify->call;
    value["path"] = falsify->path;
    value["value"] = falsify->value;
    text = fmt::format("{}{} = {}", falsify->call, falsify->path.empty() ? "" : ": " + falsify->path,
                       to_json(falsify->value));
  } else if (const auto* unreachable = std::get_if<Unreachable>(&what)) {
    value["call"] = unreachable->call;
  } else if (const auto* late = std::get_if<Late>(&what)) {
    value["call"] = late->call;
  } else if (const auto* force = std::get_if<Force>(&what)) {
    value["leaf"] = force->leaf;
    value["status"] = force->status;
    text = fmt::format("{} is {}", force->leaf, force->status);
  } else if (const auto* breakpoint = std::get_if<Breakpoint>(&what)) {
    const std::string& target = breakpoint->target;
    if (breakpoint->point == Breakpoint::Point::kNode) {
      if (const bt::NodeId node = subject.plan.tree.find(target); node != bt::kNoNode)
        value["node"] = static_cast<std::int64_t>(node);
      value["status"] = breakpoint->status;
      text = target + (breakpoint->status.empty() ? " changes" : " is " + breakpoint->status);
    } else if (breakpoint->point == Breakpoint::Point::kState) {
      value["chart"] = target;
      value["state"] = breakpoint->state;
      text = fmt::format("{} enters {}", target, breakpoint->state);
    } else {
      value["pattern"] = target;
      text = "observation " + target;
    }
  }
  if (const std::uint64_t count = project::count_of(what); count > 0) value["count"] = static_cast<std::int64_t>(count);
  value["text"] = std::move(text);
  return value;
}

Result<Value> save_scenario(const runtime::Steering& steering, const Subject& subject, const Asked& asked) {
  const auto name = asked.text("name");
  if (!name) return tl::unexpected(name.error());
  constexpr std::size_t kNameMax = 80;
  bool is_plain = !name->empty() && name->size() <= kNameMax && name->front() != '.';
  for (const char c : *name) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_' || c == '.';
    is_plain = is_plain && plain;
  }
  if (!is_plain)
    return fail("studio.request", fmt::format("\"{}\" is no name of a scenario: letters, digits, - and _", *name));
  const auto yaml = steering.scenario();
  if (!yaml) return tl::unexpected(yaml.error());
  const std::filesystem::path file = subject.plan.scenario.project.folder / "scenarios" / (*name + ".yaml");
  std::error_code error;
  if (std::filesystem::exists(file, error))
    return fail("studio.exists", file.string() + " is there already; choose another name");
  std::filesystem::create_directories(file.parent_path(), error);
  if (auto written = text::write_file(file, *yaml); !written) return tl::unexpected(written.error());
  return Value(Map{{"yaml", *yaml}, {"file", file.string()}});
}

// What was done to the run goes into a scenario that is there. Its text is edited: comments and all else stay.
Result<Value> add_to_scenario(const runtime::Steering& steering, const Subject& subject, const Asked& asked) {
  const auto name = asked.text("name");
  if (!name) return tl::unexpected(name.error());
  const auto files = project::scenario_files(subject.plan.scenario.project);
  const auto file = std::find_if(files.begin(), files.end(), [&](const auto& one) { return one.stem() == *name; });
  if (file == files.end()) return fail("studio.request", fmt::format("there is no scenario \"{}\"", *name));
  const auto run = steering.scenario();
  if (!run) return tl::unexpected(run.error());
  std::vector<project::Injection> done;
  {
    // The run as a scenario says what was done to it, read as if it stood where the other one does.
    const text::Overlay overlay{{std::filesystem::absolute(*file).lexically_normal().string(), *run}};
    const text::ReadThrough through(overlay);
    const auto read = project::load_scenario(*file);
    if (!read.ok()) return fail("studio.request", "what was done to this run cannot be read as a scenario");
    std::copy_if(read.value->timeline.begin(), read.value->timeline.end(), std::back_inserter(done),
                 [](const project::Injection& one) { return one.source != "scenario"; });
  }
  if (done.empty()) return fail("studio.nothing-done", "nothing was done to this run by hand yet");
  const auto there = project::load_scenario(*file);
  if (!there.ok()) return fail("studio.request", file->string() + " cannot be read: sentree check says why");
  const auto before = text::read_file(*file);
  if (!before) return tl::unexpected(before.error());
  auto with = project::with_injections(*before, there.value->timeline, done, file->string());
  if (!with) return tl::unexpected(with.error());
  if (*with == *before)
    return fail("studio.nothing-done", fmt::format("all that was done is in {} already", file->string()));
  if (auto written = text::write_file(*file, *with); !written) return tl::unexpected(written.error());
  return Value(Map{{"yaml", *with}, {"file", file->string()}});
}

}  // namespace

Result<Value> steer(runtime::Steering& steering, const Subject& subject, const std::string& op, const Value& request) {
  const Asked asked(op, request);
  if (op == "pause") return done(steering.pause());
  if (op == "resume") return done(steering.resume());
  if (op == "stop") return done(steering.stop());
  if (op == "call") return call(steering, asked);
  if (op == "breakpoint") return set_breakpoint(steering, subject, asked);
  if (op == "save_scenario") return save_scenario(steering, subject, asked);
  if (op == "add_to_scenario") return add_to_scenario(steering, subject, asked);
  if (op == "interventions") {
    List list;
    for (const mission::StandingIntervention& one : steering.standing()) list.push_back(to_value(subject, one));
    return Value(std::move(list));
  }
  if (op == "step") {
    const auto ticks = asked.count("ticks", 1);
    if (!ticks) return tl::unexpected(ticks.error());
    return done(steering.step(*ticks));
  }
  if (op == "factor") {
    const auto value = asked.number("value");
    if (!value) return tl::unexpected(value.error());
    return done(steering.set_factor(*value));
  }
  if (op == "kill" || op == "restart") {
    const auto part = asked.text("part");
    if (!part) return tl::unexpected(part.error());
    return done(op == "kill" ? steering.kill(*part) : steering.restart(*part));
  }
  if (op == "delay") {
    const auto message = asked.text("message");
    if (!message) return tl::unexpected(message.error());
    const auto by = asked.count("by", std::nullopt);
    if (!by) return tl::unexpected(by.error());
    const auto count = asked.count("count", 0);
    if (!count) return tl::unexpected(count.error());
    return standing("id", steering.delay(*message, Duration(static_cast<std::int64_t>(*by)), *count));
  }
  if (op == "falsify") {
    const auto calls = asked.text("call");
    if (!calls) return tl::unexpected(calls.error());
    const auto count = asked.count("count", 0);
    if (!count) return tl::unexpected(count.error());
    return standing("id", steering.falsify(*calls, asked.text_or("path", ""), asked.value("value"), *count));
  }
  if (op == "unreachable" || op == "late") {
    const auto calls = asked.text("call");
    if (!calls) return tl::unexpected(calls.error());
    const auto applied = op == "late" ? steering.apply(Late{*calls}) : steering.apply(Unreachable{*calls});
    if (!applied) return tl::unexpected(applied.error());
    return standing("id", applied->id);
  }
  if (op == "force") {
    const auto leaf = asked.text("leaf");
    if (!leaf) return tl::unexpected(leaf.error());
    return standing("id", steering.force(*leaf, asked.text_or("status", ""), asked.flag("once")));
  }
  if (op == "clear") {
    const auto what = asked.count("what", std::nullopt);
    if (!what) return tl::unexpected(what.error());
    return done(steering.clear(*what));
  }
  return fail("studio.unknown-request", fmt::format("there is no request \"{}\"", op));
}

}  // namespace sentree::studio
