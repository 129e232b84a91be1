#include "sentree/studio/detail/alternatives.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <optional>
#include <string_view>
#include <utility>

#include "sentree/base/diagnostic.h"
#include "sentree/text/json.h"

namespace sentree::studio {
namespace {

/// Alternatives of choices that come again and again are kept once.
constexpr std::size_t kKnownMax = 16;

// "hall#2": the model and the number.
std::optional<std::pair<std::string_view, std::uint64_t>> parse_named(std::string_view named) {
  const auto hash = named.rfind('#');
  if (hash == std::string_view::npos) return std::nullopt;
  std::uint64_t number = 0;
  const char* const end = named.data() + named.size();
  const auto [rest, error] = std::from_chars(named.data() + hash + 1, end, number);
  if (error != std::errc() || rest != end) return std::nullopt;
  return std::pair(named.substr(0, hash), number);
}

}  // namespace

void Alternatives::install(const std::vector<std::string>& models, runtime::RunOptions& options) {
  options.on_choice = [this, next = std::move(options.on_choice)](const mission::Choice& choice) {
    if (next) next(choice);
    take(choice);
  };
  for (const std::string& model : models)
    options.listeners_of.emplace_back(model + ".choice",
                                      [this, name = model](const Message& message) { hear(name, message); });
}

void Alternatives::take(const mission::Choice& choice) {
  Of of{.function = choice.function, .name = choice.name, .place = choice.place, .values = {}, .last = {}};
  of.count = choice.count;
  for (std::uint64_t i = 0; i < std::min(choice.count, kKeptMax); ++i) of.values.push_back(choice.alternative(i));
  of.last = choice.alternative(choice.count - 1);
  const std::lock_guard lock(mutex_);
  Model& model = models_[choice.model];
  auto& known = model.known;
  auto same = std::find_if(known.begin(), known.end(), [&](const auto& one) { return *one == of; });
  if (same == known.end()) {
    if (known.size() == kKnownMax) known.erase(known.begin());
    same = known.insert(known.end(), std::make_shared<const Of>(std::move(of)));
  }
  if (model.made.size() == kMadeMax) model.made.erase(model.made.begin());
  model.made[choice.number] = {.of = *same, .value = {}};
  if (model.untold.size() == kMadeMax) model.untold.pop_front();
  model.untold.push_back(choice.number);
}

void Alternatives::hear(const std::string& model, const Message& message) {
  const Value* const value = message.data.find("value");
  const std::lock_guard lock(mutex_);
  const auto found = models_.find(model);
  if (found == models_.end() || found->second.untold.empty()) return;
  const std::uint64_t number = found->second.untold.front();
  found->second.untold.pop_front();
  const auto made = found->second.made.find(number);
  if (value != nullptr && made != found->second.made.end()) made->second.value = *value;
}

const Alternatives::Made* Alternatives::find(std::string_view named) const {
  const auto which = parse_named(named);
  if (!which) return nullptr;
  const auto model = models_.find(which->first);
  if (model == models_.end()) return nullptr;
  const auto made = model->second.made.find(which->second);
  return made == model->second.made.end() ? nullptr : &made->second;
}

Result<Value> Alternatives::answer(const Value& choices) const {
  const List* const asked = choices.as_list();
  if (asked == nullptr) return fail("studio.request", "\"choices\" is a list of MODEL#NUMBER");
  List told;
  const std::lock_guard lock(mutex_);
  for (const Value& one : *asked) {
    const Made* const made = find(one.text());
    told.push_back(made == nullptr ? Value()
                                   : Value(Map{{"values", List(made->of->values.begin(), made->of->values.end())},
                                               {"count", static_cast<std::int64_t>(made->of->count)},
                                               {"last", made->of->last}}));
  }
  return Value(std::move(told));
}

Result<void> Alternatives::check(const Value& choose) const {
  const List* const entries = choose.as_list();
  if (entries == nullptr) return {};
  const std::lock_guard lock(mutex_);
  for (const Value& one : *entries) {
    const std::string text(one.text());
    const auto equals = text.find('=', std::min(text.find('#'), text.size()));
    const Made* const made = find(text.substr(0, equals));
    // From the first choice that is another on, or is not known, the run may have others.
    if (made == nullptr || equals == std::string::npos) return {};
    const std::string written = text.substr(equals + 1);
    auto json = text::parse_json(written);
    const Value given = json ? std::move(*json) : Value(written);
    if (mission::is_meant(made->value, given)) continue;
    const Of& of = *made->of;
    const auto is_given = [&](const Value& alternative) { return mission::is_meant(alternative, given); };
    if (std::any_of(of.values.begin(), of.values.end(), is_given) || is_given(of.last)) return {};
    mission::Choice choice{.model = {}, .function = of.function.c_str(), .name = of.name, .place = of.place};
    const auto [model, number] = *parse_named(std::string_view(text).substr(0, equals));
    choice.model = model;
    choice.number = number;
    choice.count = of.count;
    choice.alternative = [&of](std::uint64_t i) { return i < of.values.size() ? of.values[i] : of.last; };
    if (of.count > of.values.size()) {
      if (of.function != "between") return {};  // those that were not kept
      const double low = of.values[0].number();
      const double step = of.values[1].number() - low;
      const double i = given.is_number() ? std::round((given.number() - low) / step) : -1;
      constexpr double kRounding = 1e-9;  // the step is known from two of them
      if (i >= 0 && i < static_cast<double>(of.count) &&
          std::abs(low + step * i - given.number()) <= kRounding * std::max(step, std::abs(given.number())))
        return {};
    }
    return fail("studio.choice", mission::no_such_alternative(choice, given));
  }
  return {};
}

}  // namespace sentree::studio
