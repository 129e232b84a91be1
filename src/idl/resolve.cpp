#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <unordered_map>
#include <unordered_set>

#include <fmt/format.h>

#include "sentree/base/value.h"
#include "sentree/idl/detail/program.h"

namespace sentree::idl {
namespace {

using syntax::Definition;

// Of all services of a file together, each with those that it inherits.
constexpr std::size_t kMethodsMax = 1'000'000;

template <class Names>
std::vector<std::string> keys(const Names& names) {
  std::vector<std::string> out;
  for (const auto& [name, ignored] : names) out.push_back(name);
  return out;
}

std::string_view last_part(std::string_view dotted) {
  const auto dot = dotted.rfind('.');
  return dot == std::string_view::npos ? dotted : dotted.substr(dot + 1);
}

class Resolver {
 public:
  Resolver(const syntax::File& file, Schema::Program& program, Diagnostics& diagnostics)
      : file_(file), program_(program), diagnostics_(diagnostics) {}

  bool run() {
    declare();
    if (failed_) return false;
    for (const Definition& d : file_.definitions) {
      define(d);
      defined_.insert(d.name);
    }
    if (!failed_) fill_in_absent();
    return !failed_;
  }

 private:
  void error(const SourceSpan& at, std::string code, std::string message) {
    diagnostics_.push_back({Severity::kError, std::move(code), std::move(message), at});
    failed_ = true;
  }
  void warn(const SourceSpan& at, std::string code, std::string message) {
    diagnostics_.push_back({Severity::kWarning, std::move(code), std::move(message), at});
  }

  // All names first, so that a field can be of a type that comes later.
  void declare() {
    for (const Definition& d : file_.definitions) {
      if (d.form == Definition::Form::kConst) continue;
      if (!declarations_.emplace(d.name, &d).second) {
        error(d.span, "idl.duplicate", fmt::format("the name \"{}\" is defined already", d.name));
        continue;
      }
      if (d.form == Definition::Form::kEnum) {
        Enum& e = program_.enums.emplace_back(Enum{d.name, d.enumerators, d.span});
        Type& t = program_.types.emplace_back();
        t.kind = Kind::kEnum;
        t.name = d.name;
        t.enumeration = &e;
        program_.type_names.emplace(d.name, &t);
      } else if (d.form == Definition::Form::kStruct) {
        Struct& s = program_.structs.emplace_back(Struct{d.name, d.struct_kind, {}, d.span});
        Type& t = program_.types.emplace_back();
        t.kind = Kind::kStruct;
        t.name = d.name;
        t.structure = &s;
        program_.type_names.emplace(d.name, &t);
        structs_[d.name] = &s;
      }
    }
  }

  void define(const Definition& d) {
    switch (d.form) {
      case Definition::Form::kConst: define_constant(d); break;
      case Definition::Form::kTypedef: define_typedef(d); break;
      case Definition::Form::kEnum: define_enumerators(d); break;
      case Definition::Form::kStruct: define_struct(d); break;
      case Definition::Form::kService: define_service(d); break;
    }
  }

  const Type* base(Kind kind) {
    static const std::pair<Kind, const char*> kNames[] = {
        {Kind::kVoid, "void"},     {Kind::kBool, "bool"},     {Kind::kI8, "i8"},
        {Kind::kI16, "i16"},       {Kind::kI32, "i32"},       {Kind::kI64, "i64"},
        {Kind::kDouble, "double"}, {Kind::kString, "string"}, {Kind::kBinary, "binary"}};
    const Type*& cached = bases_[static_cast<std::size_t>(kind)];
    if (cached == nullptr) {
      Type& t = program_.types.emplace_back();
      t.kind = kind;
      for (const auto& [k, name] : kNames) {
        if (k == kind) t.name = name;
      }
      cached = &t;
    }
    return cached;
  }

  // A typedef before its target is resolved on the way; `typedef_depth` ends circles.
  const Type* named(const std::string& name, const SourceSpan& at, int typedef_depth) {
    if (const Type* found = program_.find(name, &Schema::Program::type_names)) return found;
    const auto declared = declarations_.find(name);
    if (declared != declarations_.end() && declared->second->form == Definition::Form::kTypedef) {
      if (typedef_depth > kSyntaxNestingMax) {
        error(at, "idl.unknown-type",
              fmt::format("typedef \"{}\" leads back to itself, or through too many others", name));
        return nullptr;
      }
      const Type* target = type(declared->second->type, typedef_depth + 1);
      if (target != nullptr) program_.type_names[name] = target;
      return target;
    }
    if (declared != declarations_.end()) {
      error(at, "idl.unknown-type", fmt::format("\"{}\" is a service, not a type", name));
      return nullptr;
    }
    auto known = keys(program_.type_names);
    for (const auto& [other, d] : declarations_) {
      if (d->form == Definition::Form::kTypedef) known.push_back(other);
    }
    for (const auto& [prefix, included] : program_.includes) {
      for (const auto& [other, ignored] : included->type_names) known.push_back(fmt::format("{}.{}", prefix, other));
    }
    error(at, "idl.unknown-type", fmt::format("there is no type \"{}\"{}", name, did_you_mean(name, known)));
    return nullptr;
  }

  const Type* type(const syntax::TypeUse& use, int typedef_depth = 0) {
    using Form = syntax::TypeUse::Form;
    if (use.form == Form::kBase) return base(use.base);
    if (use.form == Form::kNamed) return named(use.name, use.span, typedef_depth);
    const Type* first = type(use.arguments[0], typedef_depth);
    const Type* second = use.form == Form::kMap ? type(use.arguments[1], typedef_depth) : first;
    if (first == nullptr || second == nullptr) return nullptr;
    Type t;
    t.element = second;
    if (use.form == Form::kMap) {
      t.kind = Kind::kMap;
      t.key = first;
      t.name = fmt::format("map<{}, {}>", first->name, second->name);
    } else {
      t.kind = use.form == Form::kList ? Kind::kList : Kind::kSet;
      t.name = fmt::format("{}<{}>", use.form == Form::kList ? "list" : "set", first->name);
    }
    // Names grow with nesting through typedefs: list<list<…>> of a typedef of a map of itself twice would double each
    // time.
    if (t.name.size() > kTypeNameMax) t.name = use.form == Form::kMap ? "map<…>" : "list<…>";
    return &program_.types.emplace_back(std::move(t));
  }

  // What the compiler calls "not defined": a constant's or exception's type has to come before it.
  bool defined_before(const syntax::TypeUse& use) {
    if (use.form == syntax::TypeUse::Form::kNamed) {
      if (declarations_.contains(use.name) && !defined_.contains(use.name)) {
        error(use.span, "idl.unknown-type", fmt::format("\"{}\" must be defined before it is used here", use.name));
        return false;
      }
      return true;
    }
    return std::all_of(use.arguments.begin(), use.arguments.end(), [&](const auto& a) { return defined_before(a); });
  }

  void define_typedef(const Definition& d) {
    const Type* target = type(d.type, 1);
    if (target == nullptr) return;
    program_.type_names[d.name] = target;
    program_.typedefs.push_back({d.name, target, d.span});
  }

  void define_enumerators(const Definition& d) {
    const Type* t = program_.type_names.at(d.name);
    std::unordered_set<std::string_view> names;
    std::map<std::int64_t, std::string_view> numbers;
    for (const Enumerator& e : d.enumerators) {
      if (!names.insert(e.name).second) {
        error(e.span, "idl.duplicate", fmt::format("enum {} has \"{}\" already", d.name, e.name));
        continue;
      }
      if (const auto [other, is_new] = numbers.emplace(e.number, e.name); !is_new) {
        warn(e.span, "idl.duplicate",
             fmt::format("{} and {} of enum {} have one number, {}: who reads it takes it for {}", other->second,
                         e.name, d.name, e.number, other->second));
      }
      const Constant& c =
          program_.enumerator_constants.emplace_back(Constant{e.name, t, Value(std::int64_t{e.number}), e.span});
      program_.constant_names.emplace(fmt::format("{}.{}", d.name, e.name), &c);
    }
  }

  std::vector<Field> fields(const std::vector<syntax::Field>& written, const Struct* owner, bool arguments) {
    std::vector<Field> out;
    const Field* union_default = nullptr;
    out.reserve(written.size());
    for (const syntax::Field& w : written) {
      Field f;
      f.id = static_cast<std::int16_t>(w.id);
      f.name = w.name;
      f.span = w.span;
      f.unit = w.unit;
      const bool is_share = w.unit == "%" || w.unit == "ratio";
      f.min = w.min || !is_share ? w.min : std::optional<double>(0);
      f.max = w.max || !is_share ? w.max : std::optional<double>(w.unit == "%" ? 100 : 1);
      if (f.min && f.max && *f.min > *f.max) {
        error(w.span, "idl.annotation",
              fmt::format("no value of \"{}\" is within its bounds: min = {} is above max = {}", w.name,
                          plain_decimal(*f.min), plain_decimal(*f.max)));
      }
      f.requiredness = w.requiredness;
      if (arguments && f.requiredness == Requiredness::kOptional) {
        f.requiredness = Requiredness::kDefault;
        warn(w.span, "idl.field-id", "optional means nothing in a list of arguments");
      }
      f.type = type(w.type);
      if (f.type == nullptr) continue;
      if (owner != nullptr && owner->kind == StructKind::kUnion) f.requiredness = Requiredness::kOptional;
      if (!w.value.empty() && defined_before(w.type)) f.default_value = constant(*f.type, w.value[0]);
      out.push_back(std::move(f));
      if (owner != nullptr && owner->kind == StructKind::kUnion && out.back().default_value) {
        if (union_default != nullptr) {
          error(w.span, "idl.union",
                fmt::format("union {} has a default already, for \"{}\"", owner->name, union_default->name));
        }
        union_default = &out.back();
      }
    }
    return out;
  }

  void define_struct(const Definition& d) {
    Struct& s = *structs_.at(d.name);
    s.fields = fields(d.fields, &s, false);
  }

  void define_service(const Definition& d) {
    if (methods_ > kMethodsMax) return;
    const Service* parent = nullptr;
    if (!d.base.empty()) {
      parent = program_.find(d.base, &Schema::Program::service_names);
      if (parent == nullptr) {
        auto known = keys(program_.service_names);
        for (const auto& [prefix, included] : program_.includes) {
          for (const auto& [other, ignored] : included->service_names)
            known.push_back(fmt::format("{}.{}", prefix, other));
        }
        error(d.base_span, "idl.unknown-service",
              fmt::format("there is no service \"{}\" before this line{}", d.base, did_you_mean(d.base, known)));
      }
    }
    // Each has those that it inherits, so that a long chain would have the square of its length.
    methods_ += d.methods.size() + (parent != nullptr ? parent->methods.size() : 0);
    if (methods_ > kMethodsMax) {
      error(d.span, "idl.too-large",
            fmt::format("the services of this file have more than {} methods, with those that they inherit",
                        kMethodsMax));
      return;
    }
    Service& s = program_.services.emplace_back();
    s.name = d.name;
    s.span = d.span;
    s.base = parent;
    std::unordered_set<std::string_view> names;
    if (parent != nullptr) {
      for (const Method* m : parent->methods) names.insert(m->name);
    }
    for (const syntax::Method& w : d.methods) {
      if (!names.insert(w.name).second) {
        error(w.span, "idl.duplicate", fmt::format("service {} has a method \"{}\" already", d.name, w.name));
        continue;
      }
      Method& m = s.own_methods.emplace_back();
      m.name = w.name;
      m.service = d.name;
      m.span = w.span;
      m.oneway = w.oneway;
      m.unit = w.unit;
      m.idempotent = w.idempotent;
      m.result = type(w.result);
      m.arguments = Struct{w.name + "_args", StructKind::kStruct, fields(w.arguments, nullptr, true), w.span};
      m.exceptions = fields(w.exceptions, nullptr, false);
      check_method(w, m);
      s.methods.push_back(&m);
    }
    if (parent != nullptr) s.methods.insert(s.methods.end(), parent->methods.begin(), parent->methods.end());
    program_.service_names.emplace(d.name, &s);
  }

  void check_method(const syntax::Method& w, const Method& m) {
    if (m.oneway && m.result != nullptr && m.result->kind != Kind::kVoid) {
      warn(w.result.span, "idl.deprecated", "a oneway method returns nothing; write void");
    }
    if (m.oneway && !w.exceptions.empty()) {
      error(w.exceptions[0].span, "idl.syntax",
            fmt::format("the oneway method \"{}\" cannot throw exceptions", w.name));
    }
    for (const syntax::Field& e : w.exceptions) {
      if (!defined_before(e.type)) continue;
      const auto f =
          std::find_if(m.exceptions.begin(), m.exceptions.end(), [&](const Field& x) { return x.name == e.name; });
      if (f == m.exceptions.end()) continue;
      if (f->type->kind != Kind::kStruct || f->type->structure->kind != StructKind::kException) {
        error(e.type.span, "idl.not-an-exception",
              fmt::format("\"{}\" is not an exception, so it cannot be thrown", f->type->name));
      }
    }
  }

  void define_constant(const Definition& d) {
    if (!defined_before(d.type)) return;
    const Type* t = type(d.type);
    if (t == nullptr) return;
    auto value = constant(*t, d.value);
    if (!value) return;
    if (program_.constant_names.contains(d.name)) {
      error(d.span, "idl.duplicate", fmt::format("the constant \"{}\" is defined already", d.name));
      return;
    }
    const Constant& c = program_.constants.emplace_back(Constant{d.name, t, std::move(*value), d.span});
    program_.constant_names.emplace(d.name, &c);
  }

  std::optional<Value> wrong_constant(const Type& t, const syntax::Constant& c, std::string_view found) {
    error(c.span, "idl.constant-type", fmt::format("expected a constant of type {}, found {}", t.name, found));
    return std::nullopt;
  }

  std::optional<Value> integer(const Type& t, std::int64_t number, const SourceSpan& at) {
    const int bits = t.kind == Kind::kI8 ? 8 : t.kind == Kind::kI16 ? 16 : t.kind == Kind::kI32 ? 32 : 64;
    if (bits == 64) return Value(number);
    const int shift = 64 - bits;
    // As generated code does; the compiler says nothing.
    const std::int64_t kept = static_cast<std::int64_t>(static_cast<std::uint64_t>(number) << shift) >> shift;
    if (kept != number) {
      warn(at, "idl.number-range", fmt::format("{} does not fit into an {} and becomes {}", number, t.name, kept));
    }
    return Value(kept);
  }

  const Constant* named_constant(const syntax::Constant& c) {
    const Constant* found = program_.find(c.text, &Schema::Program::constant_names);
    if (found == nullptr) {
      error(c.span, "idl.unknown-constant",
            fmt::format("there is no constant or enumerator \"{}\" before this line{}", c.text,
                        did_you_mean(c.text, keys(program_.constant_names))));
    }
    return found;
  }

  std::optional<Value> enumerator(const Type& t, const syntax::Constant& c) {
    const Enum& e = *t.enumeration;
    if (c.form == syntax::Constant::Form::kName) {
      if (c.text.find('.') == std::string::npos) {
        error(c.span, "idl.unknown-constant",
              fmt::format("the enumerator \"{}\" must be written with its enum: {}.{}", c.text, e.name, c.text));
        return std::nullopt;
      }
      const std::string name(last_part(c.text));
      if (e.find(name) != nullptr) return Value(name);
      std::vector<std::string> known;
      for (const Enumerator& x : e.enumerators) known.push_back(x.name);
      error(c.span, "idl.unknown-constant",
            fmt::format("enum {} has no \"{}\"{}", e.name, name, did_you_mean(name, known)));
      return std::nullopt;
    }
    // Whatever is no number counts as 0 to the compiler.
    const std::int64_t number = c.form == syntax::Constant::Form::kInt ? c.integer : 0;
    if (const Enumerator* found = e.find(number)) {
      if (c.form != syntax::Constant::Form::kInt)
        warn(c.span, "idl.constant-type", fmt::format("this is no enumerator of {}; it counts as 0", e.name));
      return Value(found->name);
    }
    error(c.span, "idl.unknown-constant", fmt::format("enum {} has no enumerator with the number {}", e.name, number));
    return std::nullopt;
  }

  std::optional<Value> structure(const Type& t, const syntax::Constant& c) {
    if (c.form != syntax::Constant::Form::kMap) return wrong_constant(t, c, "something else than {…}");
    const Struct& s = *t.structure;
    Map given;
    for (std::size_t i = 0; i + 1 < c.items.size(); i += 2) {
      const syntax::Constant& key = c.items[i];
      const Field* f = key.form == syntax::Constant::Form::kText ? s.find(key.text) : nullptr;
      if (f == nullptr) {
        error(key.span, "idl.constant-type",
              key.form == syntax::Constant::Form::kText
                  ? fmt::format("{} has no field \"{}\"{}", s.name, key.text, did_you_mean(key.text, s.field_names()))
                  : std::string("the fields of a constant are named by strings"));
        return std::nullopt;
      }
      auto value = constant(*f->type, c.items[i + 1]);
      if (!value) return std::nullopt;
      given[f->name] = std::move(*value);
    }
    Map out;
    for (const Field& f : s.fields) {
      if (const Value* v = given.find(f.name)) {
        out[f.name] = *v;
      } else if (f.default_value && s.kind != StructKind::kUnion) {
        out[f.name] = *f.default_value;
      }
    }
    return Value(std::move(out));
  }

  std::optional<Value> container(const Type& t, const syntax::Constant& c) {
    using Form = syntax::Constant::Form;
    const bool map = t.kind == Kind::kMap;
    if (c.form == Form::kName) {
      const Constant* found = named_constant(c);
      if (found == nullptr) return std::nullopt;
      if (found->type->name == t.name) return found->value;
      return wrong_constant(t, c, fmt::format("\"{}\" of type {}", c.text, found->type->name));
    }
    if (c.form != (map ? Form::kMap : Form::kList)) {
      if (c.items.empty() && (c.form == Form::kMap || c.form == Form::kList)) return empty(t);
      // The compiler takes anything here, and nothing from it.
      warn(c.span, "idl.constant-type",
           fmt::format("expected {} for {}; this counts as empty", map ? "{…}" : "[…]", t.name));
      return empty(t);
    }
    if (!map) {
      List out;
      std::unordered_multimap<std::uint64_t, std::size_t> known;
      for (const syntax::Constant& item : c.items) {
        auto value = constant(*t.element, item);
        if (!value) return std::nullopt;
        if (t.kind == Kind::kSet && place_of(*value, known, [&](std::size_t i) -> const Value& { return out[i]; }))
          continue;
        if (t.kind == Kind::kSet) known.emplace(value->hash(), out.size());
        out.push_back(std::move(*value));
      }
      return Value(std::move(out));
    }
    std::vector<std::pair<Value, Value>> pairs;
    std::unordered_multimap<std::uint64_t, std::size_t> known;
    for (std::size_t i = 0; i + 1 < c.items.size(); i += 2) {
      auto key = constant(*t.key, c.items[i]);
      auto value = constant(*t.element, c.items[i + 1]);
      if (!key || !value) return std::nullopt;
      if (const auto same = place_of(*key, known, [&](std::size_t k) -> const Value& { return pairs[k].first; })) {
        pairs[*same].second = std::move(*value);
        continue;
      }
      known.emplace(key->hash(), pairs.size());
      pairs.emplace_back(std::move(*key), std::move(*value));
    }
    if (t.key->kind == Kind::kString) {
      Map named;
      for (auto& [key, value] : pairs) named.append(std::string(key.text()), std::move(value));
      return Value(std::move(named));
    }
    List list;
    for (auto& [key, value] : pairs) list.emplace_back(List{std::move(key), std::move(value)});
    return Value(std::move(list));
  }

  // Where a value stands already among those that are known by their hashes.
  template <class At>
  static std::optional<std::size_t> place_of(const Value& value,
                                             const std::unordered_multimap<std::uint64_t, std::size_t>& known, At at) {
    const auto [begin, end] = known.equal_range(value.hash());
    for (auto it = begin; it != end; ++it) {
      if (at(it->second) == value) return it->second;
    }
    return std::nullopt;
  }

  static Value empty(const Type& t) {
    return t.kind == Kind::kMap && t.key->kind == Kind::kString ? Value(Map()) : Value(List());
  }

  std::optional<Value> constant(const Type& t, const syntax::Constant& c) {
    using Form = syntax::Constant::Form;
    switch (t.kind) {
      case Kind::kEnum: return enumerator(t, c);
      case Kind::kStruct: return structure(t, c);
      case Kind::kList:
      case Kind::kSet:
      case Kind::kMap: return container(t, c);
      case Kind::kVoid: return wrong_constant(t, c, "a value");
      default: break;
    }
    Form form = c.form;
    std::int64_t number = c.integer;
    double real = c.real;
    std::string text = c.text;
    if (form == Form::kName) {
      const Constant* found = named_constant(c);
      if (found == nullptr) return std::nullopt;
      const Value& v = found->value;
      if (const auto* i = v.as_int()) {
        form = Form::kInt;
        number = *i;
      } else if (const auto* b = v.as_bool()) {
        form = Form::kInt;
        number = *b ? 1 : 0;
      } else if (const auto* d = v.as_double()) {
        form = Form::kDouble;
        real = *d;
      } else if (const auto* bytes = v.as_bytes()) {
        form = Form::kText;
        text.assign(reinterpret_cast<const char*>(bytes->octets.data()), bytes->octets.size());
      } else if (found->type->kind == Kind::kString) {
        form = Form::kText;
        text = v.text();
      } else {
        return wrong_constant(t, c, fmt::format("\"{}\" of type {}", c.text, found->type->name));
      }
    }
    switch (t.kind) {
      case Kind::kBool:
        if (form == Form::kInt) return Value(number > 0);
        break;
      case Kind::kI8:
      case Kind::kI16:
      case Kind::kI32:
      case Kind::kI64:
        if (form == Form::kInt) return integer(t, number, c.span);
        break;
      case Kind::kDouble:
        if (form == Form::kInt) return Value(static_cast<double>(number));
        if (form == Form::kDouble) return Value(real);
        break;
      case Kind::kString:
        if (form == Form::kText) return Value(text);
        break;
      case Kind::kBinary:
        if (form == Form::kText) {
          const auto* octets = reinterpret_cast<const std::byte*>(text.data());
          return Value(Bytes{{octets, octets + text.size()}});
        }
        break;
      default: break;
    }
    return wrong_constant(t, c,
                          form == Form::kInt      ? "an integer"
                          : form == Form::kDouble ? "a real number"
                          : form == Form::kText   ? "a string"
                          : form == Form::kList   ? "a list"
                                                  : "a map");
  }

  // The zero of a type, as generated code initialises it; nothing for unions, and for structs that contain themselves.
  std::optional<Value> zero(const Type& t) {
    switch (t.kind) {
      case Kind::kVoid: return std::nullopt;
      case Kind::kBool: return Value(false);
      case Kind::kI8:
      case Kind::kI16:
      case Kind::kI32:
      case Kind::kI64: return Value(std::int64_t{0});
      case Kind::kDouble: return Value(0.0);
      case Kind::kString: return Value(std::string());
      case Kind::kBinary: return Value(Bytes());
      case Kind::kEnum: {
        const Enumerator* e = t.enumeration->find(std::int64_t{0});
        return e != nullptr ? Value(e->name) : Value(std::int64_t{0});
      }
      case Kind::kList:
      case Kind::kSet:
      case Kind::kMap: return empty(t);
      case Kind::kStruct: return zero_struct(*t.structure);
    }
    return std::nullopt;
  }

  struct Zero {
    bool known = false;
    std::size_t size = 0;
    std::optional<Value> value;
  };

  std::optional<Value> zero_struct(const Struct& s) {
    if (s.kind == StructKind::kUnion) return std::nullopt;
    if (!in_progress_.insert(&s).second) return std::nullopt;
    if (in_progress_.size() > static_cast<std::size_t>(kSyntaxNestingMax)) {
      in_progress_.erase(&s);
      return std::nullopt;
    }
    Zero& z = zeros_[&s];
    if (!z.known) {
      Map out;
      bool whole = true;
      z.size = 1;
      for (const Field& f : s.fields) {
        auto value = f.default_value;
        if (!value && f.requiredness != Requiredness::kOptional) {
          value = zero(*f.type);
          if (!value && f.type->kind == Kind::kStruct && f.type->structure->kind != StructKind::kUnion) whole = false;
          z.size += f.type->kind == Kind::kStruct ? zeros_[f.type->structure].size : 1;
        }
        if (value) out[f.name] = std::move(*value);
        // Structs of structs of structs double in size with each level; such a zero is nobody's wish.
        if (z.size > kZeroValuesMax) whole = false;
        if (!whole) break;
      }
      if (whole) z.value = Value(std::move(out));
      z.known = true;
    }
    in_progress_.erase(&s);
    return z.value;
  }

  void fill_in(std::vector<Field>& all) {
    for (Field& f : all) {
      f.when_absent = f.default_value;
      if (!f.when_absent && f.requiredness != Requiredness::kOptional) f.when_absent = zero(*f.type);
    }
  }

  void fill_in_absent() {
    for (Struct& s : program_.structs) fill_in(s.fields);
    for (Service& s : program_.services) {
      for (Method& m : s.own_methods) fill_in(m.arguments.fields);
    }
    for (Struct& s : program_.structs) {
      if (s.kind != StructKind::kUnion) continue;
      for (Field& f : s.fields) f.when_absent.reset();
    }
  }

  static constexpr std::size_t kTypeNameMax = 200;
  static constexpr std::size_t kZeroValuesMax = 10000;

  const syntax::File& file_;
  Schema::Program& program_;
  Diagnostics& diagnostics_;
  bool failed_ = false;
  std::size_t methods_ = 0;  // of all services, each with those that it inherits
  std::unordered_map<std::string, const Definition*> declarations_;
  std::unordered_set<std::string> defined_;
  std::unordered_map<std::string, Struct*> structs_;
  const Type* bases_[16] = {};
  std::set<const Struct*> in_progress_;
  std::unordered_map<const Struct*, Zero> zeros_;
};

}  // namespace

bool resolve(const syntax::File& file, Schema::Program& program, Diagnostics& diagnostics) {
  return Resolver(file, program, diagnostics).run();
}

}  // namespace sentree::idl
