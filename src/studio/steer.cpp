#include "sentree/studio/detail/steer.h"

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

// What a request says, each with a message that names what is wrong.
class Asked {
 public:
  Asked(const std::string& op, const Value& request) : op_(op), request_(request) {}

  Result<std::string> text(const char* name) const {
    const Value* value = request_.find(name);
    if (value != nullptr && value->as_string() != nullptr) return *value->as_string();
    return fail("studio.request", fmt::format("{} needs a text \"{}\"", op_, name));
  }
  Result<std::uint64_t> count_or(const char* name, std::uint64_t otherwise) const {
    const Value* value = request_.find(name);
    if (value == nullptr || value->is_null()) return otherwise;
    constexpr double kExact = 9007199254740992.0;
    if (value->is_number() && value->number() >= 0 && value->number() <= kExact)
      return static_cast<std::uint64_t>(value->number());
    return fail("studio.request", fmt::format("{} needs a whole number \"{}\"", op_, name));
  }
  Result<double> number(const char* name) const {
    const Value* value = request_.find(name);
    if (value != nullptr && value->is_number()) return value->number();
    return fail("studio.request", fmt::format("{} needs a number \"{}\"", op_, name));
  }

 private:
  const std::string& op_;
  const Value& request_;
};

Result<Value> done(const Result<void>& result) {
  if (!result) return tl::unexpected(result.error());
  return Value(Map());
}

// The request says what an entry of a timeline says.
Result<Value> intervene(runtime::Steering& steering, const Value& request) {
  Map entry = request.as_map() != nullptr ? *request.as_map() : Map();
  entry.erase("op");
  entry.erase("id");
  const auto what = project::from_entry(entry);
  if (!what) return fail("studio.request", what.error().message);
  auto applied = steering.apply(*what);
  if (!applied) return tl::unexpected(applied.error());
  if (const auto* call = std::get_if<project::intervention::Call>(&*what)) {
    if (!applied->outcome.ok) return fail("studio.call", fmt::format("{}: {}", call->method, applied->outcome.message));
    return Value(Map{{"result", std::move(applied->outcome.result)}});
  }
  return Value(applied->id > 0 ? Map{{"id", static_cast<std::int64_t>(applied->id)}} : Map());
}

Value standing_entry(const mission::StandingIntervention& standing) {
  Map value = project::to_entry(standing.what);
  value["id"] = static_cast<std::int64_t>(standing.id);
  value["used"] = static_cast<std::int64_t>(standing.used);
  value["text"] = project::describe(standing.what);
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
  if (op == "intervene") return intervene(steering, request);
  if (op == "save_scenario") return save_scenario(steering, subject, asked);
  if (op == "add_to_scenario") return add_to_scenario(steering, subject, asked);
  if (op == "interventions") {
    List list;
    for (const mission::StandingIntervention& one : steering.standing()) list.push_back(standing_entry(one));
    return Value(std::move(list));
  }
  if (op == "step") {
    const auto ticks = asked.count_or("ticks", 1);
    if (!ticks) return tl::unexpected(ticks.error());
    return done(steering.step(*ticks));
  }
  if (op == "factor") {
    const auto value = asked.number("value");
    if (!value) return tl::unexpected(value.error());
    return done(steering.set_factor(*value));
  }
  return fail("studio.unknown-request", fmt::format("there is no request \"{}\"", op));
}

}  // namespace sentree::studio
