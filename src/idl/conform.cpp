#include "sentree/idl/conform.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>

namespace sentree::idl {
namespace {

constexpr std::size_t kShownTextMax = 40;
constexpr std::size_t kShownNamesMax = 12;

std::string shown(const Value& value) {
  std::string type(to_string(value.type()));
  switch (value.type()) {
    case Value::Type::kString: {
      std::string text(value.text().substr(0, kShownTextMax));
      if (value.text().size() > kShownTextMax) text += "…";
      return fmt::format("{} \"{}\"", type, text);
    }
    case Value::Type::kBool:
    case Value::Type::kInt:
    case Value::Type::kDouble: return fmt::format("{} {}", type, to_json(value));
    case Value::Type::kList: return fmt::format("{} of {}", type, value.as_list()->size());
    default: return type;
  }
}

// The likely name; where none is near, those that there are.
std::string way_out(std::string_view name, const std::vector<std::string>& known) {
  std::string out = did_you_mean(name, known);
  if (!out.empty() || known.empty()) return out;
  for (std::size_t i = 0; i < known.size() && i < kShownNamesMax; ++i)
    out += (i == 0 ? "; there is " : ", ") + known[i];
  return known.size() > kShownNamesMax ? out + ", …" : out;
}

struct Misfit {
  std::string code;
  std::string path;  // ".pose.x", "[3]"; built while unwinding.
  std::string message;
};

bool misfit(Misfit& out, std::string code, std::string message) {
  out.code = std::move(code);
  out.message = std::move(message);
  return false;
}

bool wrong(Misfit& out, const Type& type, const Value& value) {
  return misfit(out, "idl.wrong-type", fmt::format("expected {}, got {}", type.name, shown(value)));
}

struct Range {
  std::int64_t low;
  std::int64_t high;
};

Range range(Kind kind) {
  switch (kind) {
    case Kind::kI8: return {-128, 127};
    case Kind::kI16: return {std::numeric_limits<std::int16_t>::min(), std::numeric_limits<std::int16_t>::max()};
    case Kind::kI32:
    case Kind::kEnum: return {std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max()};
    default: return {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()};
  }
}

// An integer that `value` stands for, if any: int, integral double, decimal text.
std::optional<std::int64_t> integral(const Value& value) {
  if (const auto* i = value.as_int()) return *i;
  if (const auto* d = value.as_double()) {
    if (*d >= -0x1p63 && *d < 0x1p63 && std::trunc(*d) == *d) return static_cast<std::int64_t>(*d);
    return std::nullopt;
  }
  if (const auto* s = value.as_string()) {
    std::int64_t parsed = 0;
    const auto end = s->data() + s->size();
    const auto read = std::from_chars(s->data(), end, parsed);
    if (read.ec == std::errc() && read.ptr == end && !s->empty()) return parsed;
  }
  return std::nullopt;
}

bool fit(const Type& type, Value& value, int depth, Misfit& out);

bool fit_integer(const Type& type, Value& value, Misfit& out) {
  const auto number = integral(value);
  if (!number) return wrong(out, type, value);
  const Range r = range(type.kind);
  if (*number < r.low || *number > r.high) {
    return misfit(out, "idl.out-of-range",
                  fmt::format("expected {} ({} to {}), got {}", type.name, r.low, r.high, shown(value)));
  }
  value = Value(*number);
  return true;
}

bool fit_double(const Type& type, Value& value, Misfit& out) {
  if (value.as_double() != nullptr) return true;
  if (const auto* i = value.as_int()) {
    value = Value(static_cast<double>(*i));
    return true;
  }
  const std::string_view text = value.text();
  if (text == "NaN") return value = Value(std::numeric_limits<double>::quiet_NaN()), true;
  if (text == "Infinity") return value = Value(std::numeric_limits<double>::infinity()), true;
  if (text == "-Infinity") return value = Value(-std::numeric_limits<double>::infinity()), true;
  return wrong(out, type, value);
}

bool fit_enum(const Type& type, Value& value, Misfit& out) {
  const Enum& e = *type.enumeration;
  if (const auto* name = value.as_string()) {
    if (e.find(*name) != nullptr) return true;
    // "NavigationStatus.IDLE" means the same.
    if (name->size() > e.name.size() + 1 && name->starts_with(e.name) && (*name)[e.name.size()] == '.') {
      std::string rest = name->substr(e.name.size() + 1);
      if (e.find(rest) != nullptr) return value = Value(std::move(rest)), true;
    }
    std::vector<std::string> known;
    for (const Enumerator& x : e.enumerators) known.push_back(x.name);
    return misfit(out, "idl.unknown-name",
                  fmt::format("enum {} has no \"{}\"{}", e.name, *name, way_out(*name, known)));
  }
  if (!fit_integer(type, value, out)) return false;
  if (const Enumerator* named = e.find(*value.as_int())) value = Value(named->name);
  return true;
}

bool fit_items(const Type& type, Value& value, int depth, Misfit& out) {
  List* items = value.as_list();
  if (items == nullptr) return wrong(out, type, value);
  for (std::size_t i = 0; i < items->size(); ++i) {
    if (fit(*type.element, (*items)[i], depth + 1, out)) continue;
    out.path = fmt::format("[{}]{}", i, out.path);
    return false;
  }
  if (type.kind == Kind::kSet) drop_duplicates(*items);
  return true;
}

bool fit_map(const Type& type, Value& value, int depth, Misfit& out) {
  if (type.key->kind == Kind::kString) {
    Map* map = value.as_map();
    if (map == nullptr) return wrong(out, type, value);
    for (auto& [key, item] : *map) {
      if (fit(*type.element, item, depth + 1, out)) continue;
      out.path = fmt::format("[\"{}\"]{}", key, out.path);
      return false;
    }
    return true;
  }
  if (const Map* map = value.as_map()) {
    // Keys of a script's object are strings; those that read as the key's type are taken.
    List pairs;
    for (const auto& [key, item] : *map) pairs.emplace_back(List{Value(key), item});
    value = Value(std::move(pairs));
  }
  List* pairs = value.as_list();
  if (pairs == nullptr) return wrong(out, type, value);
  for (std::size_t i = 0; i < pairs->size(); ++i) {
    List* pair = (*pairs)[i].as_list();
    const std::string at = fmt::format("[{}]", i);
    if (pair == nullptr || pair->size() != 2) {
      out.path = at;
      return misfit(out, "idl.wrong-type", "expected [key, value], got " + shown((*pairs)[i]));
    }
    for (std::size_t side = 0; side < 2; ++side) {
      if (fit(side == 0 ? *type.key : *type.element, (*pair)[side], depth + 1, out)) continue;
      out.path = at + (side == 0 ? "[0]" : "[1]") + out.path;
      return false;
    }
  }
  drop_duplicate_keys(*pairs);
  return true;
}

bool fit_union(const Struct& s, Map& given, int depth, Misfit& out) {
  Map kept;
  for (auto& [name, item] : given) {
    if (item.is_null()) continue;
    const Field* field = s.find(name);
    if (field == nullptr) {
      return misfit(out, "idl.unknown-name",
                    fmt::format("union {} has no member \"{}\"{}", s.name, name, way_out(name, s.field_names())));
    }
    if (!kept.empty()) {
      return misfit(out, "idl.union",
                    fmt::format("union {} holds one member, got \"{}\" and \"{}\"", s.name, kept.begin()->first, name));
    }
    Value v = std::move(item);
    if (!fit(*field->type, v, depth + 1, out)) {
      out.path = fmt::format(".{}{}", name, out.path);
      return false;
    }
    kept.append(name, std::move(v));
  }
  if (kept.empty()) {
    const auto preset =
        std::find_if(s.fields.begin(), s.fields.end(), [](const Field& f) { return f.default_value.has_value(); });
    if (preset == s.fields.end())
      return misfit(out, "idl.union", fmt::format("union {} holds one member, got none", s.name));
    kept.append(preset->name, *preset->default_value);
  }
  given = std::move(kept);
  return true;
}

// Each that there must be, in the order of the fields, and nothing else.
bool is_in_order(const Struct& s, const Map& given) {
  auto entry = given.begin();
  for (const Field& f : s.fields) {
    if (entry != given.end() && entry->first == f.name && !entry->second.is_null())
      ++entry;
    else if (f.requiredness != Requiredness::kOptional || f.default_value)
      return false;
  }
  return entry == given.end();
}

bool fit_fields(const Struct& s, Map& given, int depth, std::string_view what, Misfit& out) {
  if (is_in_order(s, given)) {
    auto f = s.fields.begin();
    for (auto& [name, item] : given) {
      while (f->name != name) ++f;
      if (fit(*f->type, item, depth + 1, out)) continue;
      out.path = fmt::format(".{}{}", name, out.path);
      return false;
    }
    return true;
  }
  for (const auto& [name, item] : given) {
    if (s.find(name) != nullptr) continue;
    return misfit(out, "idl.unknown-name",
                  fmt::format("there is no {} \"{}\"{}", what, name, way_out(name, s.field_names())));
  }
  Map made;
  made.reserve(s.fields.size());
  // Nearly all come in the order of the fields.
  auto next = given.begin();
  const auto take_entry = [&](const std::string& name) -> Map::Entry* {
    if (next == given.end() || next->first != name)
      next = std::find_if(given.begin(), given.end(), [&](const Map::Entry& entry) { return entry.first == name; });
    return next == given.end() ? nullptr : &*next++;
  };
  for (const Field& f : s.fields) {
    Map::Entry* const entry = take_entry(f.name);
    if (entry == nullptr || entry->second.is_null()) {
      if (f.default_value) {
        made.append(f.name, *f.default_value);
      } else if (f.requiredness != Requiredness::kOptional) {
        out.path = "." + f.name;
        return misfit(out, "idl.missing", "is missing; it is of type " + f.type->name);
      }
      continue;
    }
    if (!fit(*f.type, entry->second, depth + 1, out)) {
      out.path = fmt::format(".{}{}", f.name, out.path);
      return false;
    }
    made.append(std::move(entry->first), std::move(entry->second));
  }
  given = std::move(made);
  return true;
}

bool fit(const Type& type, Value& value, int depth, Misfit& out) {
  if (depth > kValueNestingMax) {
    return misfit(out, "idl.too-deep", fmt::format("is nested more than {} deep", kValueNestingMax));
  }
  switch (type.kind) {
    case Kind::kVoid: return value.is_null() || wrong(out, type, value);
    case Kind::kBool: return value.as_bool() != nullptr || wrong(out, type, value);
    case Kind::kI8:
    case Kind::kI16:
    case Kind::kI32:
    case Kind::kI64: return fit_integer(type, value, out);
    case Kind::kDouble: return fit_double(type, value, out);
    case Kind::kString: return value.as_string() != nullptr || wrong(out, type, value);
    case Kind::kBinary:
      if (const auto* text = value.as_string()) {
        const auto* octets = reinterpret_cast<const std::byte*>(text->data());
        value = Value(Bytes{{octets, octets + text->size()}});
      }
      return value.as_bytes() != nullptr || wrong(out, type, value);
    case Kind::kEnum: return fit_enum(type, value, out);
    case Kind::kStruct: {
      Map* map = value.as_map();
      if (map == nullptr) return wrong(out, type, value);
      return type.structure->kind == StructKind::kUnion ? fit_union(*type.structure, *map, depth, out)
                                                        : fit_fields(*type.structure, *map, depth, "field", out);
    }
    case Kind::kList:
    case Kind::kSet: return fit_items(type, value, depth, out);
    case Kind::kMap: return fit_map(type, value, depth, out);
  }
  return false;
}

std::string told(std::string_view what, const Misfit& m) {
  const bool sentence = m.message.starts_with("is ");
  return std::string(what) + m.path + (sentence ? " " : ": ") + m.message;
}

// `argument "target.x" of Navigation.goto: …`; the path's first part is the argument's name.
std::string told_of_argument(const Method& method, const Misfit& m) {
  const std::string call = fmt::format("{}.{}", method.service, method.name);
  if (m.path.empty()) return fmt::format("{}: {}", call, m.message);
  return told(fmt::format("argument \"{}\" of {}", m.path.substr(m.path[0] == '.' ? 1 : 0), call),
              {m.code, "", m.message});
}

bool right(const Type& type, const Value& value, int depth);

bool right_fields(const Struct& s, const Map& map, int depth) {
  auto entry = map.begin();
  for (const Field& f : s.fields) {
    if (entry != map.end() && entry->first == f.name) {
      if (!right(*f.type, entry->second, depth + 1)) return false;
      ++entry;
    } else if (f.requiredness != Requiredness::kOptional || f.default_value) {
      return false;
    }
  }
  return entry == map.end();
}

bool right_union(const Struct& s, const Map& map, int depth) {
  if (map.size() != 1) return false;
  const Field* f = s.find(map.begin()->first);
  return f != nullptr && right(*f->type, map.begin()->second, depth + 1);
}

bool right(const Type& type, const Value& value, int depth) {
  if (depth > kValueNestingMax) return false;
  switch (type.kind) {
    case Kind::kVoid: return value.is_null();
    case Kind::kBool: return value.as_bool() != nullptr;
    case Kind::kI8:
    case Kind::kI16:
    case Kind::kI32: {
      const auto* i = value.as_int();
      if (i == nullptr) return false;
      const Range r = range(type.kind);
      return *i >= r.low && *i <= r.high;
    }
    case Kind::kI64: return value.as_int() != nullptr;
    case Kind::kDouble: return value.as_double() != nullptr;
    case Kind::kString: return value.as_string() != nullptr;
    case Kind::kBinary: return value.as_bytes() != nullptr;
    case Kind::kEnum: {
      const auto* name = value.as_string();
      return name != nullptr && type.enumeration->find(*name) != nullptr;
    }
    case Kind::kStruct: {
      const Map* map = value.as_map();
      if (map == nullptr) return false;
      return type.structure->kind == StructKind::kUnion ? right_union(*type.structure, *map, depth)
                                                        : right_fields(*type.structure, *map, depth);
    }
    case Kind::kList: {
      const List* items = value.as_list();
      return items != nullptr && std::all_of(items->begin(), items->end(),
                                             [&](const Value& v) { return right(*type.element, v, depth + 1); });
    }
    case Kind::kMap: {
      if (type.key->kind != Kind::kString) return false;
      const Map* map = value.as_map();
      return map != nullptr && std::all_of(map->begin(), map->end(),
                                           [&](const auto& e) { return right(*type.element, e.second, depth + 1); });
    }
    case Kind::kSet: return false;  // Duplicates have to be looked for.
  }
  return false;
}

void make_scripted(Value& value, int depth) {
  if (const auto* i = value.as_int()) {
    if (*i > kExactInDouble || *i < -kExactInDouble) value = Value(std::to_string(*i));
  } else if (depth > kValueNestingMax) {
    return;
  } else if (List* list = value.as_list()) {
    for (Value& item : *list) make_scripted(item, depth + 1);
  } else if (Map* map = value.as_map()) {
    for (auto& entry : *map) make_scripted(entry.second, depth + 1);
  }
}

}  // namespace

void drop_duplicates(List& items) {
  struct Hash {
    std::size_t operator()(const Value* v) const { return v->hash(); }
  };
  struct Same {
    bool operator()(const Value* a, const Value* b) const { return *a == *b; }
  };
  std::unordered_set<const Value*, Hash, Same> seen;
  std::vector<bool> kept(items.size());
  bool any = false;
  for (std::size_t i = 0; i < items.size(); ++i) {
    kept[i] = seen.insert(&items[i]).second;
    any = any || !kept[i];
  }
  if (!any) return;
  List out;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (kept[i]) out.push_back(std::move(items[i]));
  }
  items = std::move(out);
}

void drop_duplicate_keys(List& pairs) {
  struct Hash {
    std::size_t operator()(const Value* v) const { return v->hash(); }
  };
  struct Same {
    bool operator()(const Value* a, const Value* b) const { return *a == *b; }
  };
  std::unordered_map<const Value*, std::size_t, Hash, Same> last;
  for (std::size_t i = 0; i < pairs.size(); ++i) last[&(*pairs[i].as_list())[0]] = i;
  if (last.size() == pairs.size()) return;
  std::vector<bool> kept(pairs.size());
  for (const auto& [key, i] : last) kept[i] = true;
  List out;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (kept[i]) out.push_back(std::move(pairs[i]));
  }
  pairs = std::move(out);
}

Result<Value> conform(const Type& type, Value value, std::string_view what) {
  Misfit m;
  if (fit(type, value, 0, m)) return value;
  return fail(m.code, told(what, m));
}

Result<Value> conform_arguments(const Method& method, Value arguments) {
  if (arguments.is_null()) arguments = Value(Map());
  Misfit m;
  Map* map = arguments.as_map();
  if (map == nullptr) {
    return fail("idl.wrong-type", fmt::format("{}.{}: expected a map of arguments, got {}", method.service, method.name,
                                              shown(arguments)));
  }
  if (fit_fields(method.arguments, *map, 0, "argument", m)) return arguments;
  return fail(m.code, told_of_argument(method, m));
}

Result<Value> conform_exception(const Method& method, Value exception) {
  Map* const map = exception.as_map();
  std::vector<std::string> names;
  for (const Field& declared : method.exceptions) names.push_back(declared.type->structure->name);
  if (map == nullptr || map->size() != 1) {
    return fail("idl.wrong-type",
                fmt::format("exception: expected the fields of one of {}'s exceptions{} under its name", method.name,
                            names.empty() ? ", of which there are none" : ""));
  }
  auto& [name, fields] = *map->begin();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) {
    return fail("idl.unknown-name",
                fmt::format("{}.{} throws no \"{}\"{}", method.service, method.name, name, did_you_mean(name, names)));
  }
  const Field& declared = method.exceptions[static_cast<std::size_t>(found - names.begin())];
  auto conforming = conform(*declared.type, std::move(fields), "exception." + name);
  if (!conforming) return tl::unexpected(conforming.error());
  return Value(Map{{name, std::move(*conforming)}});
}

Result<void> check_ranges(const Field& field, const Value& value, std::string_view what) {
  if (value.is_number() && ((field.min && value.number() < *field.min) || (field.max && value.number() > *field.max))) {
    const auto bound = [](double number) {
      std::string text = shortest_decimal(number);
      if (text.ends_with(".0")) text.resize(text.size() - 2);
      return text;
    };
    const std::string unit = field.unit.empty() || field.unit == "ratio" ? "" : " " + field.unit;
    return fail(
        "idl.out-of-range",
        fmt::format("{}: {} is {}{}", what, to_json(value),
                    field.min && field.max ? fmt::format("not from {} to {}", bound(*field.min), bound(*field.max))
                    : field.min            ? "less than " + bound(*field.min)
                                           : "more than " + bound(*field.max),
                    unit));
  }
  return check_ranges(*field.type, value, what);
}

Result<void> check_ranges(const Type& type, const Value& value, std::string_view what) {
  // As deep as the value, which `conform` has bounded.
  if (type.kind == Kind::kStruct && value.as_map() != nullptr) {
    for (const auto& [name, item] : *value.as_map()) {
      const Field* field = type.structure->find(name);
      if (field == nullptr) continue;
      if (auto checked = check_ranges(*field, item, fmt::format("{}.{}", what, name)); !checked) return checked;
    }
  }
  if ((type.kind == Kind::kList || type.kind == Kind::kSet) && value.as_list() != nullptr) {
    for (const Value& item : *value.as_list()) {
      if (auto checked = check_ranges(*type.element, item, what); !checked) return checked;
    }
  }
  return {};
}

Result<void> check_ranges(const Method& method, const Value& arguments) {
  for (const Field& field : method.arguments.fields) {
    const Value* item = arguments.find(field.name);
    if (item == nullptr) continue;
    const std::string what = fmt::format("argument \"{}\" of {}.{}", field.name, method.service, method.name);
    if (auto checked = check_ranges(field, *item, what); !checked) return checked;
  }
  return {};
}

bool conforms(const Type& type, const Value& value) { return right(type, value, 0); }

bool conforms_arguments(const Method& method, const Value& arguments) {
  const Map* map = arguments.as_map();
  return map != nullptr && right_fields(method.arguments, *map, 0);
}

Diagnostics check_arguments(const Method& method, const std::vector<WrittenArgument>& arguments, const SourceSpan& at) {
  Diagnostics out;
  const auto report = [&](const SourceSpan& where, std::string code, std::string message) {
    out.push_back({Severity::kError, std::move(code), std::move(message), where});
  };
  const std::string call = fmt::format("{}.{}", method.service, method.name);
  std::unordered_set<std::string_view> given;
  for (const WrittenArgument& a : arguments) {
    const Field* f = method.arguments.find(a.name);
    if (f == nullptr) {
      report(a.span, "idl.unknown-name",
             fmt::format("{} has no argument \"{}\"{}", call, a.name, way_out(a.name, method.arguments.field_names())));
      continue;
    }
    if (!given.insert(a.name).second) {
      report(a.span, "idl.duplicate", fmt::format("argument \"{}\" of {} is given twice", a.name, call));
      continue;
    }
    if (!a.value) continue;
    Misfit m;
    Value copy = *a.value;
    if (!fit(*f->type, copy, 1, m)) {
      m.path = fmt::format(".{}{}", f->name, m.path);
      report(a.span, m.code, told_of_argument(method, m));
    } else if (const auto checked = check_ranges(*f, copy, fmt::format("argument \"{}\" of {}", f->name, call));
               !checked) {
      report(a.span, checked.error().code, checked.error().message);
    }
  }
  for (const Field& f : method.arguments.fields) {
    if (given.contains(f.name) || f.default_value) continue;
    report(at, "idl.missing",
           fmt::format("argument \"{}\" of {} is missing; it is of type {}", f.name, call, f.type->name));
  }
  return out;
}

Result<const Method*> find_method(const Service& service, std::string_view method, std::string_view service_shown,
                                  const SourceSpan& at) {
  if (const Method* found = service.find(method)) return found;
  const auto known = service.method_names();
  std::string message = fmt::format("service \"{}\" ({}) has no method \"{}\"", service_shown, service.name, method);
  return fail("idl.unknown-method", message + way_out(method, known), at);
}

Result<ServicePtr> find_service(const Schema& schema, std::string_view service, const SourceSpan& at) {
  if (ServicePtr found = schema.service(service)) return found;
  return fail(
      "idl.unknown-service",
      fmt::format("{} has no service \"{}\"{}", schema.file(), service, way_out(service, schema.service_names())), at);
}

Value for_script(Value value) {
  make_scripted(value, 0);
  return value;
}

std::string signature(const Method& method) {
  std::string out = method.name + "(";
  for (const Field& f : method.arguments.fields) {
    if (out.back() != '(') out += ", ";
    out += fmt::format("{}: {} {}", f.id, f.type->name, f.name);
    if (f.default_value) out += " = " + to_json(*f.default_value);
  }
  return fmt::format("{}): {}{}", out, method.oneway ? "oneway " : "", method.result->name);
}

}  // namespace sentree::idl
