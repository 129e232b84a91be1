#include "sentree/idl/detail/ros.h"
#include "sentree/base/ascii.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "sentree/idl/detail/program.h"

namespace sentree::idl {
namespace {

// Of the zeros that an absent field stands for, arrays of fixed length included.
constexpr std::size_t kZeroValuesMax = 10'000;
constexpr std::uint32_t kFixedLengthMax = 1U << 20U;
constexpr std::size_t kFieldsMax = 10'000;

struct Primitive {
  const char* name;
  Kind kind;
  double min;
  double max;
};
constexpr Primitive kPrimitives[] = {
    {"bool", Kind::kBool, 0, 0},
    {"byte", Kind::kI16, 0, 255},
    {"char", Kind::kI16, 0, 255},
    {"int8", Kind::kI8, -128, 127},
    {"uint8", Kind::kI16, 0, 255},
    {"int16", Kind::kI16, -32768, 32767},
    {"uint16", Kind::kI32, 0, 65535},
    {"int32", Kind::kI32, -2147483648.0, 2147483647},
    {"uint32", Kind::kI64, 0, 4294967295.0},
    {"int64", Kind::kI64, 0, 0},
    {"uint64", Kind::kI64, 0, 0},
    {"float32", Kind::kDouble, 0, 0},
    {"float64", Kind::kDouble, 0, 0},
    {"string", Kind::kString, 0, 0},
    {"wstring", Kind::kString, 0, 0},
};

const Primitive* find_primitive(std::string_view name) {
  const auto* found =
      std::find_if(std::begin(kPrimitives), std::end(kPrimitives), [&](const Primitive& p) { return name == p.name; });
  return found == std::end(kPrimitives) ? nullptr : found;
}

bool is_octet(std::string_view name) { return name == "byte" || name == "char" || name == "uint8" || name == "int8"; }

bool is_lower(char c) { return c >= 'a' && c <= 'z'; }
bool is_upper(char c) { return c >= 'A' && c <= 'Z'; }
bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

// Of packages and fields: lower case, digits, single underscores that do not end it.
bool is_field_name(std::string_view name) {
  if (name.empty() || !is_lower(name.front()) || name.back() == '_') return false;
  if (name.find("__") != std::string_view::npos) return false;
  return std::all_of(name.begin(), name.end(), [](char c) { return is_lower(c) || is_digit(c) || c == '_'; });
}
bool is_constant_name(std::string_view name) {
  if (name.empty() || !is_upper(name.front()) || name.back() == '_') return false;
  if (name.find("__") != std::string_view::npos) return false;
  return std::all_of(name.begin(), name.end(), [](char c) { return is_upper(c) || is_digit(c) || c == '_'; });
}
bool is_message_name(std::string_view name) {
  return !name.empty() && is_upper(name.front()) &&
         std::all_of(name.begin(), name.end(), [](char c) { return is_lower(c) || is_upper(c) || is_digit(c); });
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

struct Identity {
  std::string package;
  std::string form;  // msg, srv, action
  std::string name;

  [[nodiscard]] std::string full() const { return fmt::format("{}/{}/{}", package, form, name); }
};

std::optional<Identity> identity_of(std::string_view file) {
  std::vector<std::string_view> parts;
  while (true) {
    const auto slash = file.find_last_of('/');
    parts.push_back(slash == std::string_view::npos ? file : file.substr(slash + 1));
    if (slash == std::string_view::npos || parts.size() == 3) break;
    file = file.substr(0, slash);
  }
  if (parts.size() < 3) return std::nullopt;
  const auto dot = parts[0].rfind('.');
  if (dot == std::string_view::npos || parts[0].substr(dot + 1) != parts[1]) return std::nullopt;
  return Identity{std::string(parts[2]), std::string(parts[1]), std::string(parts[0].substr(0, dot))};
}

// One line without its comment, and a place in it.
class Line {
 public:
  Line(std::string_view text, const std::string& file, int number) : whole_(text), file_(file), number_(number) {
    rest_ = trimmed(text.substr(0, std::min(text.find('#'), text.size())));
  }
  [[nodiscard]] std::string_view rest() const { return rest_; }
  [[nodiscard]] SourceSpan here(std::size_t length = 0) const {
    const auto column = rest_.empty() ? whole_.size() : static_cast<std::size_t>(rest_.data() - whole_.data());
    return {file_, number_, static_cast<int>(column) + 1, static_cast<int>(length)};
  }
  /// Up to a blank, or to one of `ends`.
  std::string_view word(std::string_view ends = {}) {
    std::size_t size = 0;
    while (size < rest_.size() && !is_blank(rest_[size]) && ends.find(rest_[size]) == std::string_view::npos) ++size;
    const std::string_view out = rest_.substr(0, size);
    rest_ = trimmed(rest_.substr(size));
    return out;
  }
  bool skip(char c) {
    if (rest_.empty() || rest_.front() != c) return false;
    rest_ = trimmed(rest_.substr(1));
    return true;
  }

 private:
  std::string_view whole_;
  const std::string& file_;
  int number_;
  std::string_view rest_;
};

struct Shape {
  std::string base;  // "uint8", "geometry_msgs/msg/Pose"
  const Primitive* primitive = nullptr;
  std::uint32_t text_max = 0;  // 0: any
  enum class Many : std::uint8_t { kOne, kFixed, kBounded, kAny } many = Many::kOne;
  std::uint32_t count = 0;
  SourceSpan span;

  [[nodiscard]] std::string element_name() const { return base + (text_max > 0 ? fmt::format("<={}", text_max) : ""); }
  [[nodiscard]] std::string name() const {
    switch (many) {
      case Many::kOne: return element_name();
      case Many::kFixed: return fmt::format("{}[{}]", element_name(), count);
      case Many::kBounded: return fmt::format("{}[<={}]", element_name(), count);
      case Many::kAny: return element_name() + "[]";
    }
    return {};
  }
};

class Reader {
 public:
  Reader(const IncludeReader& include, Diagnostics& diagnostics, Schema::Program& program)
      : include_(include), diagnostics_(diagnostics), program_(program) {}

  bool run(std::string_view source, const std::string& file) {
    const auto identity = identity_of(file);
    if (!identity || !is_field_name(identity->package) || !is_message_name(identity->name)) {
      return error({file, 0, 0, 0}, "idl.syntax",
                   "an interface of ROS lies in PACKAGE/msg/Name.msg, PACKAGE/srv/Name.srv or "
                   "PACKAGE/action/Name.action, the package in lower case and the name in CamelCase");
    }
    if (source.size() > kFileSizeMax)
      return error({file, 0, 0, 0}, "idl.too-large", fmt::format("the file has more than {} bytes", kFileSizeMax));
    note(file);
    if (identity->form == "msg") return message_service(source, file, *identity);
    return identity->form == "srv" ? service(source, file, *identity) : action(source, file, *identity);
  }

  [[nodiscard]] const std::vector<std::string>& files() const { return files_; }

 private:
  bool error(const SourceSpan& at, std::string code, std::string message) {
    diagnostics_.push_back({Severity::kError, std::move(code), std::move(message), at});
    return false;
  }
  void note(const std::string& file) {
    if (std::find(files_.begin(), files_.end(), file) == files_.end()) files_.push_back(file);
  }

  Type& new_type(Kind kind, std::string name) {
    Type& t = program_.types.emplace_back();
    t.kind = kind;
    t.name = std::move(name);
    return t;
  }

  const Type* struct_type(Struct& s) {
    Type& t = new_type(Kind::kStruct, s.name);
    t.structure = &s;
    program_.type_names.emplace(s.name, &t);
    return &t;
  }

  const Type* named_type(const std::string& name, Kind kind) {
    const Type*& slot = named_[name];
    if (slot == nullptr) slot = &new_type(kind, name);
    return slot;
  }

  // The parts of a file between lines of three dashes.
  static std::vector<std::pair<std::string_view, int>> parts_of(std::string_view source) {
    std::vector<std::pair<std::string_view, int>> out;
    std::size_t from = 0;
    int first = 1;
    int number = 1;
    for (std::size_t at = 0; at <= source.size(); ++number) {
      const std::size_t end = std::min(source.find('\n', at), source.size());
      if (trimmed(source.substr(at, end - at)) == "---") {
        out.emplace_back(source.substr(from, at - from), first);
        from = std::min(end + 1, source.size());
        first = number + 1;
      }
      at = end + 1;
    }
    out.emplace_back(source.substr(from), first);
    return out;
  }

  bool message_service(std::string_view source, const std::string& file, const Identity& identity) {
    const Type* message = this->message(source, file, identity, 0);
    if (message == nullptr) return false;
    Service& out = new_service(identity, file);
    Method& m = new_method(out, "message", file);
    m.oneway = true;
    m.arguments.fields = message->structure->fields;
    finish(out);
    return true;
  }

  bool service(std::string_view source, const std::string& file, const Identity& identity) {
    const auto parts = parts_of(source);
    if (parts.size() != 2)
      return error({file, parts.back().second, 1, 0}, "idl.syntax",
                   "a service is a request and a response, with one line --- between");
    Struct* request = structure(parts[0], file, identity, identity.full() + "_Request", 0);
    Struct* response = structure(parts[1], file, identity, identity.full() + "_Response", 0);
    if (request == nullptr || response == nullptr) return false;
    Service& out = new_service(identity, file);
    Method& m = new_method(out, "call", file);
    m.arguments.fields = request->fields;
    m.result = struct_type(*response);
    finish(out);
    return true;
  }

  bool action(std::string_view source, const std::string& file, const Identity& identity) {
    const auto parts = parts_of(source);
    if (parts.size() != 3)
      return error({file, parts.back().second, 1, 0}, "idl.syntax",
                   "an action is goal, result and feedback, with lines --- between");
    Struct* goal = structure(parts[0], file, identity, identity.full() + "_Goal", 0);
    Struct* result = structure(parts[1], file, identity, identity.full() + "_Result", 0);
    Struct* feedback = structure(parts[2], file, identity, identity.full() + "_Feedback", 0);
    if (goal == nullptr || result == nullptr || feedback == nullptr) return false;
    const SourceSpan here{file, 0, 0, 0};
    Enum& status = program_.enums.emplace_back(Enum{"GoalStatus", {}, here});
    std::int32_t number = 0;
    for (const char* name : {"UNKNOWN", "ACCEPTED", "EXECUTING", "CANCELING", "SUCCEEDED", "CANCELED", "ABORTED"})
      status.enumerators.push_back({name, number++, here});
    Type& status_type = new_type(Kind::kEnum, "GoalStatus");
    status_type.enumeration = &status;
    program_.type_names.emplace(status.name, &status_type);
    const Type* text = named_type("string", Kind::kString);
    Type& texts = new_type(Kind::kList, "string[]");
    texts.element = text;
    const Type* result_type = struct_type(*result);
    const Type* feedback_type = struct_type(*feedback);

    Struct& accepted = program_.structs.emplace_back(Struct{identity.full() + "_Accepted", {}, {}, here});
    add(accepted, "accepted", named_type("bool", Kind::kBool), Value(false));
    add(accepted, "goal_id", text, Value(std::string()));
    Struct& canceled = program_.structs.emplace_back(Struct{identity.full() + "_Canceled", {}, {}, here});
    add(canceled, "return_code", named_type("int8", Kind::kI8), Value(0));
    add(canceled, "goals_canceling", &texts, Value(List()));

    Service& out = new_service(identity, file);
    Method& send = new_method(out, "send_goal", file);
    send.arguments.fields = goal->fields;
    send.result = struct_type(accepted);
    Method& cancel = new_method(out, "cancel_goal", file);
    add(cancel.arguments, "goal_id", text, Value(std::string()));
    cancel.result = struct_type(canceled);
    cancel.idempotent = true;
    for (const auto& [name, type] : {std::pair{"feedback", feedback_type}, std::pair{"result", result_type},
                                     std::pair{"status", (const Type*)nullptr}}) {
      Method& topic = new_method(out, name, file);
      topic.oneway = true;
      add(topic.arguments, "goal_id", text, Value(std::string()));
      if (std::string_view(name) != "feedback") add(topic.arguments, "status", &status_type, Value("UNKNOWN"));
      if (type != nullptr) add(topic.arguments, name, type, zero(*type));
    }
    finish(out);
    return true;
  }

  static void add(Struct& to, std::string name, const Type* type, std::optional<Value> value) {
    Field& f = to.fields.emplace_back();
    f.id = static_cast<std::int16_t>(to.fields.size());
    f.name = std::move(name);
    f.type = type;
    f.default_value = std::move(value);
    f.when_absent = f.default_value;
  }

  Service& new_service(const Identity& identity, const std::string& file) {
    Service& out = program_.services.emplace_back();
    out.name = identity.full();
    out.span = {file, 0, 0, 0};
    program_.service_names.emplace(identity.name, &out);
    return out;
  }
  Method& new_method(Service& service, std::string name, const std::string& file) {
    Method& out = service.own_methods.emplace_back();
    out.name = std::move(name);
    out.service = service.name;
    out.result = named_type("void", Kind::kVoid);
    out.span = {file, 0, 0, 0};
    return out;
  }
  static void finish(Service& service) {
    for (const Method& m : service.own_methods) service.methods.push_back(&m);
  }

  const Type* message(std::string_view source, const std::string& file, const Identity& identity, int depth) {
    const auto parts = parts_of(source);
    if (parts.size() != 1) {
      error({file, parts[1].second - 1, 1, 3}, "idl.syntax", "a message has no parts; --- is for services and actions");
      return nullptr;
    }
    Struct* made = structure(parts[0], file, identity, identity.full(), depth);
    return made == nullptr ? nullptr : struct_type(*made);
  }

  Struct* structure(const std::pair<std::string_view, int>& part, const std::string& file, const Identity& identity,
                    const std::string& name, int depth) {
    Struct made{name, StructKind::kStruct, {}, {file, part.second, 1, 0}};
    std::set<std::string> names;
    bool good = true;
    int number = part.second;
    for (std::size_t at = 0; at < part.first.size(); ++number) {
      const std::size_t end = std::min(part.first.find('\n', at), part.first.size());
      Line line(part.first.substr(at, end - at), file, number);
      if (!line.rest().empty()) good = member(line, identity, made, names, depth) && good;
      at = end + 1;
    }
    return good ? &program_.structs.emplace_back(std::move(made)) : nullptr;
  }

  // `names` are those of the fields made so far.
  bool member(Line& line, const Identity& identity, Struct& made, std::set<std::string>& names, int depth) {
    const SourceSpan start = line.here();
    auto shape = read_shape(line, identity);
    if (!shape) return false;
    const SourceSpan at = line.here();
    const std::string name(line.word("="));
    if (name.empty()) {
      return error(at, "idl.syntax",
                   fmt::format("behind the type \"{}\" the name of a field or a constant is missing", shape->name()));
    }
    SourceSpan named = at;
    named.length = static_cast<int>(name.size());
    if (line.skip('=')) return constant(line, *shape, name, named, made);
    if (!is_field_name(name)) {
      return error(
          named, "idl.syntax",
          fmt::format(
              "a field's name has lower case letters, digits and single underscores between them; \"{}\" is none",
              name));
    }
    if (names.contains(name))
      return error(named, "idl.duplicate", fmt::format("the field \"{}\" is there already", name));
    if (made.fields.size() >= kFieldsMax)
      return error(named, "idl.too-large", fmt::format("more than {} fields", kFieldsMax));
    const Type* type = this->type(*shape, identity, depth);
    if (type == nullptr) return false;
    std::optional<Value> value = zero(*type);
    if (!line.rest().empty()) {
      value = default_of(line, *shape);
      if (!value) return false;
    }
    add(made, name, type, std::move(value));
    names.insert(name);
    made.fields.back().span = start;
    if (shape->many == Shape::Many::kOne && shape->primitive != nullptr &&
        shape->primitive->min < shape->primitive->max) {
      made.fields.back().min = shape->primitive->min;
      made.fields.back().max = shape->primitive->max;
    }
    return true;
  }

  bool constant(Line& line, const Shape& shape, const std::string& name, const SourceSpan& at, const Struct& made) {
    if (!is_constant_name(name))
      return error(at, "idl.syntax",
                   fmt::format("a constant's name is in upper case with underscores; \"{}\" is not", name));
    if (shape.primitive == nullptr || shape.many != Shape::Many::kOne)
      return error(shape.span, "idl.constant-type",
                   fmt::format("a constant is of a base type, not of \"{}\"", shape.name()));
    const SourceSpan where = line.here();
    auto value = scalar(line.rest(), *shape.primitive, where);
    if (!value) return false;
    const std::string struct_name = made.name.substr(made.name.rfind('/') + 1);
    const std::string full = fmt::format("{}.{}", struct_name, name);
    if (program_.constant_names.contains(full))
      return error(at, "idl.duplicate", fmt::format("the constant \"{}\" is there already", name));
    Constant& out = program_.constants.emplace_back(
        Constant{full, named_type(shape.element_name(), shape.primitive->kind), std::move(*value), at});
    program_.constant_names.emplace(full, &out);
    return true;
  }

  std::optional<std::uint32_t> bound(std::string_view digits, const SourceSpan& at) {
    std::uint32_t out = 0;
    const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), out);
    if (digits.empty() || read.ec != std::errc() || read.ptr != digits.data() + digits.size() || out == 0) {
      error(at, "idl.syntax", fmt::format("\"{}\" is no length; write a number from 1", digits));
      return std::nullopt;
    }
    return out;
  }

  std::optional<Shape> read_shape(Line& line, const Identity& identity) {
    Shape out;
    out.span = line.here();
    std::string_view text = line.word();
    out.span.length = static_cast<int>(text.size());
    const std::string written(text);
    if (!text.empty() && text.back() == ']') {
      const auto open = text.rfind('[');
      if (open == std::string_view::npos) return bad_type(out.span, written);
      std::string_view length = text.substr(open + 1, text.size() - open - 2);
      text = text.substr(0, open);
      out.many = length.empty() ? Shape::Many::kAny : Shape::Many::kFixed;
      if (length.starts_with("<=")) {
        out.many = Shape::Many::kBounded;
        length.remove_prefix(2);
      }
      if (out.many != Shape::Many::kAny) {
        const auto count = bound(length, out.span);
        if (!count) return std::nullopt;
        out.count = *count;
        if (out.many == Shape::Many::kFixed && out.count > kFixedLengthMax) {
          error(out.span, "idl.too-large",
                fmt::format("an array of fixed length has at most {} items", kFixedLengthMax));
          return std::nullopt;
        }
      }
    }
    if (const auto less = text.find("<="); less != std::string_view::npos) {
      const auto most = bound(text.substr(less + 2), out.span);
      if (!most) return std::nullopt;
      out.text_max = *most;
      text = text.substr(0, less);
      if (text != "string" && text != "wstring") {
        error(out.span, "idl.syntax",
              "only string and wstring have a bound of their own; an array's stands in its brackets");
        return std::nullopt;
      }
    }
    out.primitive = find_primitive(text);
    if (out.primitive != nullptr) {
      out.base = text;
      return out;
    }
    // pkg/Name, pkg/msg/Name, or Name of the same package.
    const auto first = text.find('/');
    const auto last = text.rfind('/');
    const std::string_view name = last == std::string_view::npos ? text : text.substr(last + 1);
    const std::string_view package =
        first == std::string_view::npos ? std::string_view(identity.package) : text.substr(0, first);
    if (first != last && text.substr(first, last - first) != "/msg") return bad_type(out.span, written);
    if (!is_message_name(name) || !is_field_name(package)) return bad_type(out.span, written);
    out.base = fmt::format("{}/msg/{}", package, name);
    return out;
  }

  std::nullopt_t bad_type(const SourceSpan& at, const std::string& written) {
    std::vector<std::string> known;
    for (const Primitive& p : kPrimitives) known.emplace_back(p.name);
    error(at, "idl.syntax",
          fmt::format(
              "\"{}\" is no type: there are bool, int8 … uint64, float32, float64, string and messages as pkg/Name{}",
              written, did_you_mean(written.substr(0, written.find('[')), known)));
    return std::nullopt;
  }

  const Type* type(const Shape& shape, const Identity& identity, int depth) {
    const Type* one = nullptr;
    if (shape.primitive != nullptr) {
      if (shape.many != Shape::Many::kOne && is_octet(shape.base)) return named_type(shape.name(), Kind::kBinary);
      one = named_type(shape.element_name(), shape.primitive->kind);
    } else {
      one = used(shape, identity, depth);
      if (one == nullptr) return nullptr;
    }
    if (shape.many == Shape::Many::kOne) return one;
    const Type*& slot = named_[shape.name()];
    if (slot == nullptr) {
      Type& list = new_type(Kind::kList, shape.name());
      list.element = one;
      slot = &list;
    }
    return slot;
  }

  // A message of a file of its own.
  const Type* used(const Shape& shape, const Identity& identity, int depth) {
    if (const auto known = messages_.find(shape.base); known != messages_.end()) {
      if (known->second == nullptr && loading_.contains(shape.base))
        error(shape.span, "idl.include-cycle",
              fmt::format("\"{}\" holds itself, by way of {}", shape.base, identity.full()));
      return known->second;
    }
    if (depth >= kIncludeNestingMax) {
      error(shape.span, "idl.too-deep", fmt::format("messages hold each other more than {} deep", kIncludeNestingMax));
      return nullptr;
    }
    if (files_.size() >= kFilesMax) {
      error(shape.span, "idl.too-large", fmt::format("more than {} messages are used", kFilesMax));
      return nullptr;
    }
    auto found = include_ ? include_(shape.base + ".msg", files_.front())
                          : Result<IncludedFile>(sentree::fail("idl.include", "files are not read here"));
    if (!found) {
      error(shape.span, "idl.unknown-type",
            fmt::format("there is no message \"{}\": {}", shape.base, found.error().message));
      return nullptr;
    }
    if (found->source.size() > kFileSizeMax) {
      error(shape.span, "idl.too-large",
            fmt::format("the file of \"{}\" has more than {} bytes", shape.base, kFileSizeMax));
      return nullptr;
    }
    note(found->file);
    const auto first = shape.base.find('/');
    const Identity other{shape.base.substr(0, first), "msg", shape.base.substr(shape.base.rfind('/') + 1)};
    messages_[shape.base] = nullptr;
    loading_.insert(shape.base);
    const Type* made = message(found->source, found->file, other, depth + 1);
    loading_.erase(shape.base);
    messages_[shape.base] = made;
    return made;
  }

  std::optional<Value> default_of(Line& line, const Shape& shape) {
    const SourceSpan at = line.here(line.rest().size());
    if (shape.primitive == nullptr) {
      error(at, "idl.syntax", fmt::format("a field of the message type \"{}\" has no default of its own", shape.base));
      return std::nullopt;
    }
    if (shape.many == Shape::Many::kOne) {
      auto value = scalar(line.rest(), *shape.primitive, at);
      if (value && shape.text_max > 0 && value->text().size() > shape.text_max) {
        error(at, "idl.number-range", fmt::format("the default has more than {} bytes", shape.text_max));
        return std::nullopt;
      }
      return value;
    }
    std::string_view rest = line.rest();
    if (rest.size() < 2 || rest.front() != '[' || rest.back() != ']') {
      error(at, "idl.constant-type", "the default of an array is written [a, b]");
      return std::nullopt;
    }
    rest = trimmed(rest.substr(1, rest.size() - 2));
    List items;
    while (!rest.empty()) {
      std::size_t end = 0;
      char quote = 0;
      for (; end < rest.size() && (quote != 0 || rest[end] != ','); ++end) {
        if (quote != 0 && rest[end] == '\\')
          ++end;
        else if (quote != 0 && rest[end] == quote)
          quote = 0;
        else if (quote == 0 && (rest[end] == '"' || rest[end] == '\''))
          quote = rest[end];
      }
      end = std::min(end, rest.size());
      auto item = scalar(trimmed(rest.substr(0, end)), *shape.primitive, at);
      if (!item) return std::nullopt;
      items.push_back(std::move(*item));
      rest = trimmed(rest.substr(std::min(end + 1, rest.size())));
    }
    const bool fits = shape.many == Shape::Many::kAny ||
                      (shape.many == Shape::Many::kFixed ? items.size() == shape.count : items.size() <= shape.count);
    if (!fits) {
      error(at, "idl.number-range",
            fmt::format("the default has {} items, which {} cannot hold", items.size(), shape.name()));
      return std::nullopt;
    }
    if (!is_octet(shape.base)) return Value(std::move(items));
    Bytes bytes;
    for (const Value& item : items) bytes.octets.push_back(static_cast<std::byte>(*item.as_int()));
    return Value(std::move(bytes));
  }

  std::optional<Value> scalar(std::string_view text, const Primitive& primitive, const SourceSpan& at) {
    const auto wrong = [&](const std::string& code) -> std::optional<Value> {
      error(at, code, fmt::format("\"{}\" is no {}", text, primitive.name));
      return std::nullopt;
    };
    if (primitive.kind == Kind::kString) return Value(unquoted(text));
    if (primitive.kind == Kind::kBool) {
      std::string lower(text);
      std::transform(lower.begin(), lower.end(), lower.begin(),
                     [](char c) { return is_upper(c) ? static_cast<char>(c + 32) : c; });
      if (lower == "true" || lower == "1") return Value(true);
      if (lower == "false" || lower == "0") return Value(false);
      return wrong("idl.constant-type");
    }
    std::string_view digits = text;
    const bool negative = digits.starts_with('-');
    if (negative || digits.starts_with('+')) digits.remove_prefix(1);
    if (primitive.kind == Kind::kDouble) {
      double real = 0;
      const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), real);
      if (digits.empty() || read.ec != std::errc() || read.ptr != digits.data() + digits.size())
        return wrong("idl.constant-type");
      return Value(negative ? -real : real);
    }
    int base = 10;
    if (digits.starts_with("0x") || digits.starts_with("0X")) base = 16;
    if (digits.starts_with("0b") || digits.starts_with("0B")) base = 2;
    if (base != 10) digits.remove_prefix(2);
    std::uint64_t number = 0;
    const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), number, base);
    if (digits.empty() || read.ec == std::errc::invalid_argument || read.ptr != digits.data() + digits.size())
      return wrong("idl.constant-type");
    const bool is_wide = std::string_view(primitive.name) == "uint64";
    const std::uint64_t most =
        is_wide ? std::numeric_limits<std::uint64_t>::max()
        : primitive.min < primitive.max
            ? static_cast<std::uint64_t>(negative ? -primitive.min : primitive.max)
            : static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()) + (negative ? 1 : 0);
    if (read.ec != std::errc() || number > most || (negative && is_wide && number != 0))
      return wrong("idl.number-range");
    // uint64 keeps its bits: what is beyond 2^63 is negative.
    return Value(static_cast<std::int64_t>(negative ? 0 - number : number));
  }

  static std::string unquoted(std::string_view text) {
    const bool quoted =
        text.size() >= 2 && (text.front() == '"' || text.front() == '\'') && text.back() == text.front();
    if (!quoted) return std::string(text);
    const char quote = text.front();
    std::string out;
    for (std::size_t i = 1; i + 1 < text.size(); ++i) {
      if (text[i] == '\\' && text[i + 1] == quote && i + 2 < text.size()) ++i;
      out += text[i];
    }
    return out;
  }

  // What an absent field is: ROS initialises everything. Nothing: it would be too large.
  static std::optional<Value> zero(const Type& type) {
    std::size_t left = kZeroValuesMax;
    return zero(type, left);
  }
  static std::optional<Value> zero(const Type& type, std::size_t& left) {
    if (left == 0) return std::nullopt;
    --left;
    switch (type.kind) {
      case Kind::kBool: return Value(false);
      case Kind::kDouble: return Value(0.0);
      case Kind::kString: return Value(std::string());
      case Kind::kBinary: return Value(Bytes{std::vector<std::byte>(fixed_length(type.name))});
      case Kind::kStruct: {
        Map out;
        for (const Field& f : type.structure->fields) {
          if (!f.default_value || !take(*f.default_value, left)) return std::nullopt;
          out.append(f.name, *f.default_value);
        }
        return Value(std::move(out));
      }
      case Kind::kList: {
        List out;
        for (std::size_t n = fixed_length(type.name); n > 0; --n) {
          auto item = zero(*type.element, left);
          if (!item) return std::nullopt;
          out.push_back(std::move(*item));
        }
        return Value(std::move(out));
      }
      default: return Value(0);
    }
  }
  // Takes the values in `value` off what is left.
  static bool take(const Value& value, std::size_t& left) {
    if (left == 0) return false;
    --left;
    if (const List* list = value.as_list())
      return std::all_of(list->begin(), list->end(), [&](const Value& item) { return take(item, left); });
    if (const Map* map = value.as_map())
      return std::all_of(map->begin(), map->end(), [&](const auto& entry) { return take(entry.second, left); });
    return true;
  }
  static std::size_t fixed_length(std::string_view name) {
    const auto open = name.rfind('[');
    std::size_t out = 0;
    if (open != std::string_view::npos) std::from_chars(name.data() + open + 1, name.data() + name.size(), out);
    return out;
  }

  const IncludeReader& include_;
  Diagnostics& diagnostics_;
  Schema::Program& program_;
  std::vector<std::string> files_;
  std::map<std::string, const Type*> named_;
  std::map<std::string, const Type*> messages_;  // null: wrong, or being read
  std::set<std::string> loading_;
};

}  // namespace

bool is_ros_file(std::string_view file) {
  return file.ends_with(".msg") || file.ends_with(".srv") || file.ends_with(".action");
}

std::shared_ptr<const Schema::Program> load_ros(std::string_view source, const std::string& file,
                                                const IncludeReader& include, Diagnostics& diagnostics) {
  auto program = std::make_shared<Schema::Program>();
  program->file = file;
  Reader reader(include, diagnostics, *program);
  if (!reader.run(source, file)) return nullptr;
  // What is used is part of this program; its files are told of.
  for (const std::string& other : reader.files()) {
    if (other == file) continue;
    auto used = std::make_shared<Schema::Program>();
    used->file = other;
    program->includes.emplace_back(other, std::move(used));
  }
  return program;
}

}  // namespace sentree::idl
