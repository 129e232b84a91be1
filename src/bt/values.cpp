#include "sentree/bt/detail/values.h"

#include <algorithm>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "sentree/text/json.h"

namespace sentree::bt {

namespace {

constexpr std::string_view kJson = "json:";

std::optional<Value> value_of_json(const PortType& wanted, std::string_view json) {
  auto value = text::parse_json(json);
  if (!value) return std::nullopt;
  switch (wanted.kind) {
    case PortType::Class::kBool: {
      const auto number = detail::to_real(*value);
      if (!number) return std::nullopt;
      return std::optional<Value>(std::in_place, *number != 0.0);
    }
    case PortType::Class::kInteger: {
      const auto number = detail::to_integer(*value);
      if (!number || *number < wanted.min || *number > wanted.max) return std::nullopt;
      return std::optional<Value>(std::in_place, *number);
    }
    case PortType::Class::kReal: {
      const auto number = detail::to_real(*value);
      if (!number) return std::nullopt;
      return std::optional<Value>(std::in_place, *number);
    }
    case PortType::Class::kAny: return std::move(*value);
    default:
      if (wanted.accepts == nullptr || !accepts_value(wanted, *value)) return std::nullopt;
      return std::move(*value);
  }
}

}  // namespace

bool accepts_value(const PortType& wanted, const Value& value) {
  try {
    return wanted.accepts(value);
  } catch (...) {
    return false;
  }
}

std::optional<Value> value_of_text(const Model& model, const PortType& wanted, std::string_view text,
                                   std::string* why) {
  if (text.starts_with(kJson)) return value_of_json(wanted, text.substr(kJson.size()));
  if (wanted.parse != nullptr) {
    // Somebody else's Convert may throw, as convertFromString of BehaviorTree.CPP does.
    try {
      if (auto parsed = wanted.parse(text)) return parsed;
    } catch (const std::exception& thrown) {
      if (why != nullptr) *why = thrown.what();
    } catch (...) {
      if (why != nullptr) *why = "its conversion threw something that is no std::exception";
    }
  }
  const bool integer = wanted.kind == PortType::Class::kInteger;
  if (!integer && wanted.kind != PortType::Class::kReal) return std::nullopt;
  const auto number = model.enum_value(text);
  if (!number || (integer && (*number < wanted.min || *number > wanted.max))) return std::nullopt;
  if (integer) return std::optional<Value>(std::in_place, *number);
  return std::optional<Value>(std::in_place, static_cast<double>(*number));
}

std::shared_ptr<const Object> cast_object(const Model& model, const std::shared_ptr<const Object>& object,
                                          const PortType& wanted) {
  // Breadth first, so that the shortest way is taken; every type is visited once.
  std::vector<std::shared_ptr<const Object>> seen{object};
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i]->type() == wanted) return seen[i];
    for (const PolymorphicCast& cast : model.casts) {
      if (!(*cast.from == seen[i]->type())) continue;
      const bool known = std::any_of(seen.begin(), seen.end(), [&](const auto& o) { return o->type() == *cast.to; });
      if (known) continue;
      if (auto made = cast.cast(*seen[i])) seen.push_back(std::move(made));
    }
  }
  return nullptr;
}

bool castable(const Model& model, const PortType& from, const PortType& to) {
  std::vector<const PortType*> seen{&from};
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (*seen[i] == to) return true;
    for (const PolymorphicCast& cast : model.casts) {
      if (!(*cast.from == *seen[i])) continue;
      const bool known = std::any_of(seen.begin(), seen.end(), [&](const PortType* t) { return *t == *cast.to; });
      if (!known) seen.push_back(cast.to);
    }
  }
  return false;
}

bool fits(const PortType& wanted, const Datum& datum) {
  if (datum.object != nullptr) return wanted.kind == PortType::Class::kObject && datum.object->type() == wanted;
  switch (wanted.kind) {
    case PortType::Class::kAny: return true;
    case PortType::Class::kBool: return datum.value.as_bool() != nullptr;
    case PortType::Class::kReal: return datum.value.as_double() != nullptr;
    case PortType::Class::kString: return datum.value.as_string() != nullptr;
    case PortType::Class::kInteger: {
      const auto* integer = datum.value.as_int();
      return integer != nullptr && *integer >= wanted.min && *integer <= wanted.max;
    }
    case PortType::Class::kStatus:
    case PortType::Class::kOther: return !datum.value.text().empty() ? false : accepts_value(wanted, datum.value);
    case PortType::Class::kObject: return false;
  }
  return false;
}

bool convert(const Model& model, const PortType& wanted, const Datum& from, Datum& into) {
  if (from.object != nullptr && wanted.kind == PortType::Class::kObject) {
    into.object = cast_object(model, from.object, wanted);
    return into.object != nullptr;
  }
  if (from.object != nullptr || wanted.kind == PortType::Class::kObject) return false;
  into.object = nullptr;
  if (const auto* text = from.value.as_string(); text != nullptr && wanted.kind != PortType::Class::kString) {
    auto parsed = value_of_text(model, wanted, *text);
    if (!parsed) return false;
    into.value = std::move(*parsed);
    return true;
  }
  switch (wanted.kind) {
    case PortType::Class::kBool: {
      const auto number = detail::to_real(from.value);
      if (!number) return false;
      into.value = *number != 0.0;
      return true;
    }
    case PortType::Class::kReal: {
      const auto number = detail::to_real(from.value);
      if (!number) return false;
      into.value = *number;
      return true;
    }
    case PortType::Class::kInteger: {
      const auto number = detail::to_integer(from.value);
      if (!number || *number < wanted.min || *number > wanted.max) return false;
      into.value = *number;
      return true;
    }
    case PortType::Class::kString: {
      auto text = detail::to_text(from.value);
      if (!text) return false;
      into.value = std::move(*text);
      return true;
    }
    default: return false;
  }
}

std::string shown(const Datum& datum) {
  return datum.object != nullptr ? "a C++ object of type " + datum.object->type().name : to_json(datum.value);
}

}  // namespace sentree::bt
