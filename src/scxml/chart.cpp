#include "sentree/scxml/chart.h"

#include <algorithm>
#include <array>

#include "sentree/scxml/model.h"

namespace sentree::scxml {

std::string_view to_string(StateKind kind) {
  constexpr std::array<std::string_view, 7> kNames{"scxml", "atomic",          "compound",    "parallel",
                                                   "final", "shallow history", "deep history"};
  return kNames[static_cast<std::size_t>(kind)];
}

const std::string& Chart::name() const { return model_->name; }
const std::string& Chart::file() const { return model_->file; }
const std::string& Chart::source() const { return model_->source; }
DataModelKind Chart::data_model() const { return model_->data_model; }
std::span<const State> Chart::states() const { return model_->states; }
std::span<const Transition> Chart::transitions() const { return model_->transitions; }
std::span<const DataItem> Chart::data() const { return model_->data; }
std::span<const SendInfo> Chart::sends() const { return model_->sends; }
std::span<const AmbientUse> Chart::ambient() const { return model_->ambient; }
std::uint64_t Chart::fingerprint() const { return model_->fingerprint; }
const std::optional<Diagnostic>& Chart::obstacle() const { return model_->obstacle; }

std::vector<Chart> with_invoked(const Chart& chart) {
  std::vector<Chart> all{chart};
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Chart outer = all[i];
    for (const Invoke& invoke : outer.model().invokes) {
      if (invoke.child) all.push_back(*invoke.child);
    }
  }
  return all;
}

std::vector<SendInfo> sends_with_invoked(const Chart& chart) {
  std::vector<SendInfo> all;
  for (const Chart& one : with_invoked(chart)) all.insert(all.end(), one.sends().begin(), one.sends().end());
  return all;
}

bool invokes_unknown(const Chart& chart) {
  const std::vector<Chart> all = with_invoked(chart);
  return std::any_of(all.begin(), all.end(), [](const Chart& one) {
    const auto& invokes = one.model().invokes;
    return std::any_of(invokes.begin(), invokes.end(), [](const Invoke& invoke) {
      return !invoke.child && (invoke.src.expr != kNoExpression || invoke.payload.content_expr != kNoExpression ||
                               invoke.type.expr != kNoExpression);
    });
  });
}

std::vector<std::string> Chart::events_handled() const {
  std::vector<std::string> names = model_->descriptors.all();
  std::sort(names.begin(), names.end());
  return names;
}

std::vector<std::string> Chart::events_sent() const {
  std::vector<std::string> names;
  for (const SendInfo& send : model_->sends) {
    if (send.event && !send.event->empty()) names.push_back(*send.event);
  }
  for (const auto& [name, place] : model_->raises) names.push_back(name);
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

std::optional<StateIndex> Chart::find(std::string_view state_id) const {
  const auto found = model_->ids.find(state_id);
  return found == model_->ids.end() ? std::nullopt : std::optional(found->second);
}

SourceSpan Chart::span(const Place& place) const { return {model_->file, place.line, place.column, place.length}; }

const std::string* xml_text(const Value& value) {
  const Map* map = value.as_map();
  if (map == nullptr || map->size() != 1 || map->begin()->first != "$xml") return nullptr;
  return map->begin()->second.as_string();
}

Value tag_xml(std::string_view source) { return Map{{"$xml", source}}; }

}  // namespace sentree::scxml
