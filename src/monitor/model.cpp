#include "sentree/monitor/model.h"

#include <algorithm>

#include "sentree/scxml/event.h"

namespace sentree::monitor {

namespace {

constexpr std::string_view kMembers[] = {"source", "target", "call",    "tick",   "time",   "args",
                                         "result", "kind",   "message", "status", "inputs", "outputs"};

std::string xml_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

// A chart is the one place that evaluates expressions, so renaming is a chart too: for rename i it takes the event
// "i" with the observation's data and sends the computed data out.
std::string renaming_chart(const std::vector<Rename>& renames) {
  std::string xml =
      "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\"><datamodel>";
  for (const std::string_view member : kMembers) xml += "<data id=\"" + std::string(member) + "\"/>";
  xml += "</datamodel><state id=\"s\">";
  for (std::size_t i = 0; i < renames.size(); ++i) {
    xml += "<transition event=\"rename" + std::to_string(i) + "\">";
    for (const std::string_view member : kMembers) {
      xml += "<assign location=\"" + std::string(member) + "\" expr=\"_event.data." + std::string(member) + "\"/>";
    }
    xml += "<send type=\"rename\" event=\"" + std::to_string(i) + "\">";
    for (const auto& [name, expression] : renames[i].data) {
      xml += "<param name=\"" + xml_text(name) + "\" expr=\"" + xml_text(expression) + "\"/>";
    }
    xml += "</send></transition>";
  }
  return xml + "</state></scxml>";
}

}  // namespace

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
  auto parts =
      std::make_shared<Parts>(Parts{.spec = std::move(spec), .violated = {}, .descriptors = {}, .renaming = {}});
  const scxml::Chart& chart = parts->spec.chart;

  std::vector<std::string> ids;
  for (const scxml::State& state : chart.states()) ids.push_back(state.id);
  bool can_decide = false;
  for (const std::string& id : parts->spec.violated) {
    if (const auto state = chart.find(id)) {
      parts->violated.push_back(*state);
      can_decide = true;
    } else {
      made.diagnostics.push_back({Severity::kError, "monitor.unknown-state",
                                  "monitor \"" + parts->spec.name + "\": \"" + id + "\" is no state of " +
                                      chart.file() + did_you_mean(id, ids),
                                  parts->spec.span});
    }
  }
  for (const scxml::State& state : chart.states()) {
    if (state.kind == scxml::StateKind::kFinal && state.parent == 0 &&
        (state.id == "violated" || state.id == "satisfied")) {
      can_decide = true;
    }
  }
  if (!can_decide && parts->spec.violated.empty()) {
    made.diagnostics.push_back({Severity::kError, "monitor.no-verdict",
                                "monitor \"" + parts->spec.name +
                                    "\" can never decide: name its bad states with violated: [STATE], or give it a "
                                    "top-level <final id=\"violated\">",
                                parts->spec.span});
  }

  parts->descriptors = chart.events_handled();
  for (const scxml::Transition& transition : chart.transitions()) {
    // An eventless transition may look at any event that has just been delivered.
    if (transition.events.empty() && transition.condition.find("_event") != std::string::npos)
      parts->listens_to_all = true;
  }
  if (!parts->spec.renames.empty()) {
    auto renaming = scxml::load(renaming_chart(parts->spec.renames));
    if (renaming.ok()) {
      parts->renaming = std::move(renaming.value);
    } else {
      made.diagnostics.push_back({Severity::kError, "monitor.bad-expression",
                                  "monitor \"" + parts->spec.name +
                                      "\": its renamed events cannot be read: " + renaming.diagnostics.front().message,
                                  parts->spec.renames.front().span});
    }
  }
  if (!has_errors(made.diagnostics)) made.value = Model(std::move(parts));
  return made;
}

const std::string& Model::name() const { return parts_->spec.name; }
const scxml::Chart& Model::chart() const { return parts_->spec.chart; }

bool Model::listens_to(std::string_view observation) const {
  if (!parts_->spec.renames.empty()) {
    return std::any_of(parts_->spec.renames.begin(), parts_->spec.renames.end(),
                       [&](const Rename& rename) { return rename.on == observation; });
  }
  return parts_->listens_to_all ||
         std::any_of(parts_->descriptors.begin(), parts_->descriptors.end(),
                     [&](const std::string& descriptor) { return scxml::event_matches(descriptor, observation); });
}

}  // namespace sentree::monitor
