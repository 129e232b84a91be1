#include "sentree/monitor/detail/model.h"

#include <algorithm>
#include <iterator>
#include <set>

#include <fmt/format.h>

#include "sentree/base/assert.h"
#include "sentree/base/pattern.h"
#include "sentree/monitor/observed.h"
#include "sentree/monitor/tested.h"
#include "sentree/scxml/check.h"
#include "sentree/scxml/event.h"
#include "sentree/scxml/model.h"
#include "sentree/scxml/script_syntax.h"

namespace sentree::monitor {

namespace {

// What the expressions of a renamed event look at of the observation, and of its data then and there.
std::set<std::string> members_read(const Rename& rename) {
  std::set<std::string> names = scxml::names_in_script(rename.when);
  for (const auto& [name, expression] : rename.data) names.merge(scxml::names_in_script(expression));
  std::erase_if(names, [](const std::string& name) {
    const bool is_member = name == "value" || name == "last" || observed_members().contains(name);
    return !is_member || scxml::is_reserved_word(name);
  });
  return names;
}

std::string xml_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '"')
      out += "&quot;";
    else if (c == '\n' || c == '\r')
      out += "&#10;";
    else
      out += c;
  }
  return out;
}

constexpr std::string_view kChanged = "changed";

// A chart is the one place that evaluates expressions, so renaming is a chart too: for rename i it takes the event
// "rename<i>" with the observation's data and sends the computed data out, and says by a <send> in answer to "when<i>"
// whether the event comes. One line for each rename, so that a line tells which one is wrong.
std::string renaming_chart(const std::vector<Rename>& renames) {
  std::string members;
  std::string assigned;
  std::set<std::string> read;
  for (const Rename& rename : renames) read.merge(members_read(rename));
  for (const std::string& member : read) {
    members += fmt::format("<data id=\"{}\"/>", member);
    assigned += fmt::format("<assign location=\"{}\" expr=\"_event.data.{}\"/>", member, member);
  }
  std::string xml = fmt::format(
      "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" "
      "datamodel=\"ecmascript\"><datamodel>{}</datamodel><state id=\"s\">",
      members);
  for (std::size_t i = 0; i < renames.size(); ++i) {
    const std::string number = std::to_string(i);
    xml +=
        fmt::format("\n<transition event=\"rename{}\">{}<send type=\"rename\" event=\"{}\">", number, assigned, number);
    for (const auto& [name, expression] : renames[i].data) {
      xml += fmt::format("<param name=\"{}\" expr=\"{}\"/>", xml_text(name), xml_text(expression));
    }
    xml += "</send></transition>";
    if (renames[i].when.empty() || renames[i].when == kChanged) continue;
    xml += fmt::format(
        "<transition event=\"when{}\">{}<if cond=\"{}\"><send type=\"rename\" event=\"comes\"/></if></transition>",
        number, assigned, xml_text(renames[i].when));
  }
  return xml + "</state></scxml>";
}

// Which events look back at what was observed last: those of which one source does.
void find_looking_back(Model::Parts& parts) {
  std::map<std::string, std::size_t> places;
  for (const Rename& rename : parts.spec.renames) {
    if (!rename.when.empty()) places.emplace(rename.event, places.size());
  }
  for (const Rename& rename : parts.spec.renames) {
    const auto place = places.find(rename.event);
    parts.last_of.push_back(place != places.end() ? std::optional(place->second) : std::nullopt);
  }
  parts.lasts = places.size();
}

// An expression of `events:` that does not parse would make the monitor blind.
void check_renames(const Model::Parts& parts, Diagnostics& diagnostics) {
  for (const Diagnostic& problem : scxml::check(*parts.renaming)) {
    if (problem.severity != Severity::kError) continue;
    const auto index = static_cast<std::size_t>(std::max(problem.span.line - 2, 0));
    const Rename& rename = parts.spec.renames[std::min(index, parts.spec.renames.size() - 1)];
    diagnostics.push_back(
        {Severity::kError, "monitor.bad-expression",
         fmt::format("event \"{}\" of monitor \"{}\": {}", rename.event, parts.spec.name, problem.message),
         rename.span});
  }
}

// Observations of which a requirement names the source wherever it speaks of them.
void find_sources(Model::Parts& parts) {
  std::vector<std::string> of_all;
  for (const Source& source : sources_of(parts.spec.origin->requirement)) {
    if (source.from.empty())
      of_all.push_back(source.observation);
    else
      parts.only_of[source.observation].push_back(source.from);
  }
  for (const std::string& name : of_all) parts.only_of.erase(name);
}

void plan_plain_steps(Model::Parts& parts) {
  // What the chart tells itself is no observation.
  const std::vector<std::string> sent = parts.spec.chart.events_sent();
  for (const std::string& name : parts.descriptors) {
    if (std::binary_search(sent.begin(), sent.end(), name)) continue;
    scxml::PlainPaths paths;
    auto plan = scxml::PlainPlan::make(parts.spec.chart, name, paths);
    if (plan && paths.all().size() <= kPlainMembersMax)
      parts.plain.emplace(name, Model::Parts::Plain{*std::move(plan), Reader(paths)});
  }
}

}  // namespace

bool is_one_of(std::string_view name, const std::vector<std::string>& patterns) {
  return std::any_of(patterns.begin(), patterns.end(),
                     [&](const std::string& pattern) { return matches_pattern(pattern, name); });
}

std::string_view to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::kUndecided: return "undecided";
    case Verdict::kViolated: return "violated";
    case Verdict::kSatisfied: return "satisfied";
  }
  return "undecided";
}

Loaded<Model> Model::make(Spec spec) {
  Loaded<Model> made;
  auto parts = std::make_shared<Parts>(Parts{.spec = std::move(spec)});
  const scxml::Chart& chart = parts->spec.chart;
  parts->decides.assign(chart.states().size(), Verdict::kUndecided);
  parts->pending.assign(chart.states().size(), false);

  // Who names a chart alone has no other line than its first.
  const SourceSpan named = parts->spec.span.line > 0 ? parts->spec.span : chart.span(chart.states().front().place);

  std::vector<std::string> ids;
  for (const scxml::State& state : chart.states()) ids.push_back(state.id);
  bool can_decide = false;
  for (const std::string& id : parts->spec.violated) {
    if (const auto state = chart.find(id)) {
      parts->decides[*state] = Verdict::kViolated;
      can_decide = true;
    } else {
      made.diagnostics.push_back({Severity::kError, "monitor.unknown-state",
                                  fmt::format("monitor \"{}\": \"{}\" is no state of {}{}", parts->spec.name, id,
                                              chart.file(), did_you_mean(id, ids)),
                                  named});
    }
  }
  for (scxml::StateIndex i = 0; i < chart.states().size(); ++i) {
    const scxml::State& state = chart.states()[i];
    if (state.kind != scxml::StateKind::kFinal || state.parent != 0) continue;
    if (state.id == "violated") parts->decides[i] = Verdict::kViolated;
    if (state.id == "satisfied" && parts->decides[i] == Verdict::kUndecided) parts->decides[i] = Verdict::kSatisfied;
    can_decide = can_decide || parts->decides[i] != Verdict::kUndecided;
  }
  if (parts->spec.origin) {
    for (const Situation& situation : parts->spec.origin->situations) {
      const auto state = chart.find(situation.state);
      if (state && situation.role == Situation::Role::kPending) parts->pending[*state] = true;
    }
  }
  if (parts->spec.origin) {
    find_sources(*parts);
    parts->overwritten.resize(chart.model().variables.size());
    for (const std::string& id : parts->spec.origin->overwritten) {
      const auto slot = chart.model().slots.find(id);
      if (slot != chart.model().slots.end()) parts->overwritten[slot->second] = true;
    }
  }
  parts->forgets = parts->spec.renames.empty() &&
                   (chart.model().variables.empty() || (parts->spec.origin && parts->spec.origin->forgets));
  // A requirement without an end is told of by its check; its monitor can be satisfied, or only looks on.
  if (!can_decide && parts->spec.violated.empty() && !parts->spec.origin) {
    made.diagnostics.push_back({Severity::kError, "monitor.no-verdict",
                                fmt::format("monitor \"{}\" can never decide: name its bad states with violated: "
                                            "[STATE], or give it a top-level <final id=\"violated\">",
                                            parts->spec.name),
                                named});
  }

  parts->descriptors = chart.events_handled();
  parts->projection = Projection::of(chart);
  for (const scxml::Transition& transition : chart.transitions()) {
    // An eventless transition may look at any event that has just been delivered.
    if (transition.events.empty() && transition.condition.find("_event") != std::string::npos)
      parts->listens_to_all = true;
  }
  if (!parts->spec.renames.empty()) {
    auto renaming = scxml::load(renaming_chart(parts->spec.renames));
    if (renaming.ok()) {
      parts->renaming = std::move(renaming.value);
      parts->renamed.assign(parts->renaming->model().variables.size(), true);
      for (const Rename& rename : parts->spec.renames) {
        for (const std::string& member : members_read(rename)) parts->projection.add_member(member);
      }
      find_looking_back(*parts);
      check_renames(*parts, made.diagnostics);
    } else {
      made.diagnostics.push_back({Severity::kError, "monitor.bad-expression",
                                  fmt::format("monitor \"{}\": its renamed events cannot be read: {}", parts->spec.name,
                                              renaming.diagnostics.front().message),
                                  parts->spec.renames.front().span});
    }
  }
  if (has_errors(made.diagnostics)) return made;
  if (!parts->renaming) plan_plain_steps(*parts);
  made.value = Model(std::move(parts));
  return made;
}

namespace {

Loaded<Model> synthesized(const Requirement& requirement, const Typing& typing) {
  Loaded<Model> made;
  Synthesis synthesis = synthesize(requirement, typing);
  auto chart = scxml::load(synthesis.chart, requirement.name + ".scxml");
  if (!chart.ok()) {
    made.diagnostics.push_back({Severity::kError, "monitor.unwritable",
                                fmt::format("requirement {} cannot be written as a chart: {}", requirement.name,
                                            chart.diagnostics.front().message),
                                requirement.span});
    return made;
  }
  Spec spec{.name = requirement.name, .chart = std::move(*chart.value)};
  if (requirement.re_arming) spec.violated = {"violated"};
  spec.span = requirement.span;
  spec.re_arming = requirement.re_arming;
  spec.origin =
      std::make_shared<const Origin>(Origin{requirement, std::move(synthesis.situations), std::move(synthesis.data),
                                            std::move(synthesis.overwritten), synthesis.forgets});
  return Model::make(std::move(spec));
}

}  // namespace

Loaded<Model> Model::make(const Requirement& requirement, const Vocabulary* vocabulary) {
  Loaded<Model> made;
  const Typing typing = check_requirement(requirement, vocabulary, made.diagnostics);
  if (has_errors(made.diagnostics)) return made;
  auto model = synthesized(requirement, typing);
  made.diagnostics.insert(made.diagnostics.end(), model.diagnostics.begin(), model.diagnostics.end());
  made.value = std::move(model.value);
  if (!made.value) return made;
  // What it speaks of is the same, and has been checked.
  if (const auto asked = test_of(requirement)) {
    auto test = synthesized(*asked, typing);
    SENTREE_ASSERT(test.ok());
    Parts parts = *made.value->parts_;
    // What can violate nothing, and puts it to the test all the same.
    const std::vector<std::string>& heard = test.value->parts_->descriptors;
    std::copy_if(heard.begin(), heard.end(), std::back_inserter(parts.descriptors), [&](const std::string& name) {
      const auto& own = made.value->parts_->descriptors;
      return std::find(own.begin(), own.end(), name) == own.end();
    });
    parts.test = std::move(test.value);
    Access::exchange(*made.value, std::move(parts));
  }
  return made;
}

const Model* Model::test() const { return parts_->test ? &*parts_->test : nullptr; }
const Origin* Model::origin() const { return parts_->spec.origin.get(); }
bool Model::re_arming() const { return parts_->spec.re_arming; }
const std::string& Model::name() const { return parts_->spec.name; }
const scxml::Chart& Model::chart() const { return parts_->spec.chart; }

std::optional<std::span<const std::string>> Model::listens_to_only(std::string_view observation) const {
  const auto found = parts_->only_of.find(observation);
  if (found == parts_->only_of.end()) return std::nullopt;
  return std::span<const std::string>(found->second);
}

bool Model::listens_to(std::string_view observation) const {
  if (!parts_->spec.renames.empty()) {
    return std::any_of(parts_->spec.renames.begin(), parts_->spec.renames.end(),
                       [&](const Rename& rename) { return is_one_of(observation, rename.on); });
  }
  return parts_->listens_to_all ||
         std::any_of(parts_->descriptors.begin(), parts_->descriptors.end(),
                     [&](const std::string& descriptor) { return scxml::event_matches(descriptor, observation); });
}

}  // namespace sentree::monitor
