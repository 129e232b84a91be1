#include "sentree/yarp/detail/encoding.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <string_view>

#include "sentree/base/assert.h"
#include "sentree/idl/conform.h"
#include "sentree/yarp/detail/bottle.h"
#include "sentree/yarp/detail/inbox.h"
#include "sentree/yarp/detail/tags.h"

namespace sentree::yarp {
namespace {

using idl::Kind;
using idl::Type;

static_assert(std::endian::native == std::endian::little, "YARP's bytes are copied as they are");

constexpr std::size_t kReserveMax = 1024;

// What came is a list, but not the one that was to come; what follows it can be read.
struct Misfit {
  std::string why;
};

// ---- what can be carried

// Values of a struct with those of the structs in it, which lie flat in one list.
constexpr std::size_t kLeavesMax = 1'000'000;

// Values of structs that can be carried; nothing: it is around what is looked at.
using CarriedStructs = std::map<const idl::Struct*, std::optional<std::size_t>>;

std::optional<std::string> cannot_carry_type(const Type& type, CarriedStructs& known) {
  switch (type.kind) {
    case Kind::kSet: return type.name + ": YARP reads and writes sets in two forms; use a list";
    case Kind::kList: return cannot_carry_type(*type.element, known);
    case Kind::kMap: {
      if (auto why = cannot_carry_type(*type.key, known)) return why;
      return cannot_carry_type(*type.element, known);
    }
    case Kind::kStruct: {
      const idl::Struct& s = *type.structure;
      if (s.kind == idl::StructKind::kUnion) return type.name + ": YARP has no unions";
      if (const auto [at, is_new] = known.try_emplace(&s); !is_new)
        return at->second ? std::nullopt : std::optional(type.name + " holds itself");
      std::size_t count = 0;
      for (const idl::Field& field : s.fields) {
        if (auto why = cannot_carry_type(*field.type, known)) return why;
        count += field.type->kind == Kind::kStruct ? *known[field.type->structure] : 1;
        if (count > kLeavesMax) return fmt::format("{} holds more than {} values", type.name, kLeavesMax);
      }
      known[&s] = count;
      return std::nullopt;
    }
    default: return std::nullopt;
  }
}

// ---- sizes

std::uint32_t tag_of(const Type& type, Version version) {
  switch (type.kind) {
    case Kind::kBool: return kVocab32;
    case Kind::kI8: return kInt8;
    case Kind::kI16: return kInt16;
    case Kind::kI32:
    case Kind::kEnum: return kInt32;
    case Kind::kI64: return kInt64;
    case Kind::kDouble: return version == Version::kYarp3 ? kReal10 : kReal20;
    case Kind::kString: return kString;
    case Kind::kBinary: return kBlob;
    case Kind::kList:
      return type.element->kind == Kind::kStruct || type.element->kind == Kind::kMap
                 ? kList
                 : kList | tag_of(*type.element, version);
    default: return kList;
  }
}

// Structs lie flat in the list around them.
std::size_t leaves(const Type& type) {
  if (type.kind == Kind::kVoid) return 0;
  if (type.kind != Kind::kStruct) return 1;
  std::size_t out = 0;
  for (const idl::Field& field : type.structure->fields) out += leaves(*field.type);
  return out;
}

std::size_t leaves(const idl::Struct& fields) {
  std::size_t out = 0;
  for (const idl::Field& field : fields.fields) out += leaves(*field.type);
  return out;
}

std::vector<std::string_view> name_words(std::string_view name) {
  std::vector<std::string_view> out;
  while (true) {
    const auto end = name.find('_');
    out.push_back(name.substr(0, end));
    if (end == std::string_view::npos) return out;
    name.remove_prefix(end + 1);
  }
}

// ---- writing

class Writer {
 public:
  Writer(std::vector<std::uint8_t>& out, Version version) : out_(out), version_(version) {}

  void head(std::uint32_t tag, std::size_t count) {
    put_int(out_, static_cast<std::int32_t>(tag));
    put_int(out_, static_cast<std::int32_t>(count));
  }

  void word(std::string_view word) {
    if (word.size() > 4) return text(word);
    put_int(out_, kVocab32);
    const auto at = out_.size();
    out_.resize(at + 4);
    std::memcpy(out_.data() + at, word.data(), word.size());
  }

  void text(std::string_view text) {
    put_int(out_, kString);
    bare_text(text);
  }

  void fields(const idl::Struct& s, const Value& value) {
    const Map* map = value.as_map();
    SENTREE_ASSERT(map != nullptr);
    // The value has the order of the fields, so that one walk finds them all.
    auto entry = map->begin();
    for (const idl::Field& field : s.fields) {
      const bool there = entry != map->end() && entry->first == field.name;
      item(*field.type, there ? entry->second : absent(field));
      if (there) ++entry;
    }
  }

  // A value in an untyped list.
  void item(const Type& type, const Value& value) {
    if (type.kind == Kind::kVoid) return;
    if (type.kind == Kind::kStruct) {
      return value.is_null() ? zeros(*type.structure) : fields(*type.structure, value);
    }
    if (type.kind != Kind::kList && type.kind != Kind::kMap)
      put_int(out_, static_cast<std::int32_t>(tag_of(type, version_)));
    bare(type, value);
  }

 private:
  // Null: the zero of its type.
  static const Value& absent(const idl::Field& field) {
    static const Value nothing;
    if (field.default_value) return *field.default_value;
    return field.when_absent ? *field.when_absent : nothing;
  }

  void zeros(const idl::Struct& s) {
    for (const idl::Field& field : s.fields) item(*field.type, absent(field));
  }

  void bare_text(std::string_view text) {
    put_int(out_, static_cast<std::int32_t>(text.size()));
    put(out_, text);
  }

  template <class T>
  void bytes_of(T value) {
    const auto at = out_.size();
    out_.resize(at + sizeof value);
    std::memcpy(out_.data() + at, &value, sizeof value);
  }

  static std::int64_t integer(const Value& value) { return value.as_int() != nullptr ? *value.as_int() : 0; }

  // A value whose tag stands before it, or before its list.
  void bare(const Type& type, const Value& value) {
    switch (type.kind) {
      case Kind::kVoid:
      case Kind::kSet:
      case Kind::kStruct: return;
      case Kind::kBool:
        put_int(out_, value.as_bool() != nullptr && *value.as_bool() ? vocab("ok") : vocab("fail"));
        return;
      case Kind::kI8: bytes_of(static_cast<std::int8_t>(integer(value))); return;
      case Kind::kI16: bytes_of(static_cast<std::int16_t>(integer(value))); return;
      case Kind::kI32: bytes_of(static_cast<std::int32_t>(integer(value))); return;
      case Kind::kI64: bytes_of(integer(value)); return;
      case Kind::kDouble: bytes_of(value.number()); return;
      case Kind::kString: bare_text(value.text()); return;
      case Kind::kBinary: {
        const Bytes* bytes = value.as_bytes();
        bare_text(bytes == nullptr
                      ? std::string_view()
                      : std::string_view(reinterpret_cast<const char*>(bytes->octets.data()), bytes->octets.size()));
        return;
      }
      case Kind::kEnum: {
        const idl::Enumerator* named = type.enumeration->find(value.text());
        bytes_of(named != nullptr ? named->number : static_cast<std::int32_t>(integer(value)));
        return;
      }
      case Kind::kList: list(type, value); return;
      case Kind::kMap: map(type, value); return;
    }
  }

  void list(const Type& type, const Value& value) {
    static const List none;
    const List& items = value.as_list() != nullptr ? *value.as_list() : none;
    const Type& element = *type.element;
    head(tag_of(type, version_), items.size());
    for (const Value& each : items) element_of(element, each);
  }

  // Of a list whose tag says what its elements are; a struct is a list of its own there.
  void element_of(const Type& element, const Value& value) {
    if (element.kind == Kind::kStruct) {
      head(kList, leaves(element));
      return item(element, value);
    }
    bare(element, value);
  }

  void pair(const Type& type, const Value& key, const Value& value) {
    head(kList, 2);
    boxed(*type.key, key);
    boxed(*type.element, value);
  }

  // A value that is one item, whatever it is.
  void boxed(const Type& type, const Value& value) {
    type.kind == Kind::kStruct ? element_of(type, value) : item(type, value);
  }

  void map(const Type& type, const Value& value) {
    if (const Map* named = value.as_map()) {
      head(kList, named->size());
      for (const auto& [key, item] : *named) pair(type, Value(key), item);
      return;
    }
    static const List none;
    const List& pairs = value.as_list() != nullptr ? *value.as_list() : none;
    head(kList, pairs.size());
    for (const Value& each : pairs) pair(type, (*each.as_list())[0], (*each.as_list())[1]);
  }

  std::vector<std::uint8_t>& out_;
  const Version version_;
};

// ---- reading

// A list being read: what its items are, or that each says so itself.
struct Open {
  std::uint32_t tag = 0;
  std::size_t left = 0;
};

class Reader {
 public:
  Reader(Inbox& in, Version version, const rpc::Limits& limits)
      : in_(in), version_(version), limits_(limits), values_left_(limits.values) {}

  Open open() { return opened(in_.take_tag()); }

  Value fields(const idl::Struct& s, Open& list, int depth) {
    Map out;
    out.reserve(s.fields.size());
    for (const idl::Field& field : s.fields) out.append(field.name, item(*field.type, list, depth));
    return out;
  }

  // The next value of a list.
  Value item(const Type& type, Open& list, int depth) {
    if (type.kind == Kind::kVoid) return {};
    if (type.kind == Kind::kStruct) return fields(*type.structure, list, depth);
    return value(type, next(list), depth);
  }

  // The tag of the next item, which is taken.
  std::uint32_t next(Open& list) {
    if (list.left == 0) throw Misfit{"too few values"};
    --list.left;
    if (values_left_ == 0) throw Broken{rpc::StreamStatus::kFailed, "a message has too many values"};
    --values_left_;
    return list.tag != 0 ? list.tag : in_.take_tag();
  }

  // A word of a name; nothing: it is none.
  std::optional<std::string> word(std::uint32_t tag) {
    if (tag == kString) return text();
    if (tag != kVocab32 && tag != kVocab64) return std::nullopt;
    const std::size_t size = tag == kVocab32 ? 4 : 8;
    const auto* bytes = reinterpret_cast<const char*>(in_.take(size));
    return std::string(bytes, std::find(bytes, bytes + size, '\0'));
  }

  std::string text() {
    const std::int32_t size = in_.take_int();
    if (size < 0) throw Broken{rpc::StreamStatus::kFailed, "a text has a negative length"};
    const auto length = static_cast<std::size_t>(size);
    return {reinterpret_cast<const char*>(in_.take(length)), length};
  }

  void skip(std::uint32_t tag, int depth) {
    if (depth > kBottleNestingMax) throw Broken{rpc::StreamStatus::kFailed, "a message has lists nested too deep"};
    if (tag == kDictionary) return skip(in_.take_tag(), depth + 1);
    if ((tag & kList) == 0) return void(plain(tag));
    for (Open list = opened(tag); list.left > 0;) skip(next(list), depth + 1);
  }

 private:
  Open opened(std::uint32_t tag) {
    if ((tag & kList) == 0 || (tag & ~(kList | kDictionary | 0xffU)) != 0)
      throw Broken{rpc::StreamStatus::kFailed, "no list where one was due"};
    const std::int32_t count = in_.take_int();
    if (count < 0 || static_cast<std::size_t>(count) > limits_.container_items)
      throw Broken{rpc::StreamStatus::kFailed, fmt::format("a list says that it has {} items", count)};
    return {tag & ~kList, static_cast<std::size_t>(count)};
  }

  template <class T>
  T bytes_as() {
    T out{};
    std::memcpy(&out, in_.take(sizeof out), sizeof out);
    return out;
  }

  // What an item of a base type holds, whatever was expected.
  struct Plain {
    enum class Form { kInteger, kReal, kVocab, kText } form = Form::kInteger;
    std::int64_t integer = 0;
    double real = 0;
    std::string text;
    int bytes = 0;  // of an integer
  };

  Plain plain(std::uint32_t tag) {
    Plain out;
    const bool yarp3 = version_ == Version::kYarp3;
    switch (tag) {
      case kInt8: out.integer = +bytes_as<std::int8_t>(), out.bytes = 1; return out;
      case kInt16: out.integer = bytes_as<std::int16_t>(), out.bytes = 2; return out;
      case kInt32: out.integer = bytes_as<std::int32_t>(), out.bytes = 4; return out;
      case kInt64: out.integer = bytes_as<std::int64_t>(), out.bytes = 8; return out;
      case kVocab32:
      case kVocab64:
        out.form = Plain::Form::kVocab;
        out.integer = tag == kVocab32 ? bytes_as<std::int32_t>() : bytes_as<std::int64_t>();
        out.bytes = 4;
        return out;
      case kString:
      case kBlob:
        out.form = Plain::Form::kText;
        out.text = text();
        return out;
      case kReal10:
      case kReal20:
      case kReal128:
        out.form = Plain::Form::kReal;
        // A tag of the other version is read as well where only one meaning is left.
        out.real = tag == kReal128 || (tag == kReal10 && !yarp3) ? bytes_as<float>() : bytes_as<double>();
        return out;
      default: throw Broken{rpc::StreamStatus::kFailed, fmt::format("an item has the unknown tag {}", tag)};
    }
  }

  static std::string vocab_text(std::int64_t number) {
    std::string out(reinterpret_cast<const char*>(&number), sizeof number);
    return out.substr(0, out.find('\0'));
  }

  Value integer(const Type& type, const Plain& got) {
    const int width = type.kind == Kind::kI8 ? 1 : type.kind == Kind::kI16 ? 2 : type.kind == Kind::kI64 ? 8 : 4;
    const bool fits = got.form == Plain::Form::kInteger || (got.form == Plain::Form::kVocab && width >= 4);
    if (!fits || got.bytes > width) throw Misfit{"expected " + type.name};
    if (type.kind == Kind::kEnum) {
      const idl::Enumerator* known = type.enumeration->find(got.integer);
      return known != nullptr ? Value(known->name) : Value(got.integer);
    }
    return Value(got.integer);
  }

  Value value(const Type& type, std::uint32_t tag, int depth) {
    if (depth > limits_.nesting) throw Broken{rpc::StreamStatus::kFailed, "values are nested too deep"};
    const bool is_list = (tag & kList) != 0;
    if (type.kind == Kind::kList || type.kind == Kind::kMap) {
      if (!is_list) {
        skip(tag, depth);
        throw Misfit{"expected " + type.name};
      }
      Open inner = opened(tag);
      return type.kind == Kind::kMap ? map(type, inner, depth) : list(type, inner, depth);
    }
    if (is_list) throw Misfit{fmt::format("expected {}, got a list", type.name)};
    Plain got = plain(tag);
    switch (type.kind) {
      case Kind::kBool:
        if (got.form != Plain::Form::kVocab && got.form != Plain::Form::kInteger) break;
        return Value(got.integer != 0 && got.integer != vocab("fail"));
      case Kind::kDouble:
        if (got.form == Plain::Form::kReal) return Value(got.real);
        if (got.form == Plain::Form::kInteger) return Value(static_cast<double>(got.integer));
        break;
      case Kind::kString:
        if (got.form == Plain::Form::kText) return Value(std::move(got.text));
        if (got.form == Plain::Form::kVocab) return Value(vocab_text(got.integer));
        break;
      case Kind::kBinary: {
        if (got.form != Plain::Form::kText) break;
        const auto* bytes = reinterpret_cast<const std::byte*>(got.text.data());
        return Value(Bytes{{bytes, bytes + got.text.size()}});
      }
      default: return integer(type, got);
    }
    throw Misfit{"expected " + type.name};
  }

  Value list(const Type& type, Open& inner, int depth) {
    List out;
    out.reserve(std::min(inner.left, kReserveMax));
    const Type& element = *type.element;
    while (inner.left > 0) {
      // The elements of a list of lists say themselves what they hold.
      if (element.kind == Kind::kList || element.kind == Kind::kMap || element.kind == Kind::kStruct) {
        Open typed{0, inner.left};
        out.push_back(boxed(element, typed, depth + 1));
        --inner.left;
      } else {
        out.push_back(item(element, inner, depth + 1));
      }
    }
    return out;
  }

  // A value that is one item, whatever it is.
  Value boxed(const Type& type, Open& list, int depth) {
    if (type.kind != Kind::kStruct) return item(type, list, depth);
    const std::uint32_t tag = next(list);
    if ((tag & kList) == 0) throw Misfit{fmt::format("expected {} as a list of its own", type.name)};
    Open inner = opened(tag);
    Value out = fields(*type.structure, inner, depth);
    if (inner.left != 0) throw Misfit{type.name + " has too many values"};
    return out;
  }

  Value map(const Type& type, Open& inner, int depth) {
    const bool named = type.key->kind == Kind::kString;
    Map map;
    List pairs;
    while (inner.left > 0) {
      Open typed{0, inner.left};
      const std::uint32_t tag = next(typed);
      --inner.left;
      if ((tag & kList) == 0) throw Misfit{"expected pairs in " + type.name};
      Open pair = opened(tag);
      Value key = boxed(*type.key, pair, depth + 1);
      Value value = boxed(*type.element, pair, depth + 1);
      if (pair.left != 0) throw Misfit{"expected pairs in " + type.name};
      if (named)
        map[key.text()] = std::move(value);
      else
        pairs.emplace_back(List{std::move(key), std::move(value)});
    }
    if (named) return map;
    idl::drop_duplicate_keys(pairs);
    return pairs;
  }

  Inbox& in_;
  const Version version_;
  const rpc::Limits& limits_;
  std::size_t values_left_;
};

}  // namespace

std::optional<std::string> cannot_carry(const idl::Method& method) {
  CarriedStructs known;
  for (const idl::Field& field : method.arguments.fields) {
    if (auto why = cannot_carry_type(*field.type, known)) return why;
  }
  return cannot_carry_type(*method.result, known);
}

void Encoding::write_call(std::vector<std::uint8_t>& out, const idl::Method& method, const Value& arguments,
                          bool with_name) const {
  Writer writer(out, version_);
  const std::size_t values = leaves(method.arguments);
  if (with_name) {
    const auto words = name_words(method.name);
    writer.head(kList, words.size() + values);
    for (const std::string_view word : words) writer.word(word);
  } else {
    writer.head(kList, values);
  }
  writer.fields(method.arguments, arguments);
}

void Encoding::write_reply(std::vector<std::uint8_t>& out, const idl::Method& method, const Value& result) const {
  Writer writer(out, version_);
  // Called like any other, a one-way method answers this.
  if (method.oneway) {
    writer.head(kList, 1);
    return writer.word("done");
  }
  writer.head(kList, leaves(*method.result));
  writer.item(*method.result, result);
}

Encoding::Call Encoding::read_call(Inbox& in, std::size_t bytes, const idl::Service& service,
                                   const idl::Method* only) const {
  (void)in.peek(bytes);
  const std::size_t end = in.position() + bytes;
  in.fence(end);
  Call out;
  std::string known;  // the first name that a method has
  const auto read_arguments = [&](Reader& reader, Open list, const idl::Method& method) {
    try {
      Value arguments = reader.fields(method.arguments, list, 1);
      if (list.left != 0 || in.position() != end) return false;
      out.arguments = std::move(arguments);
      out.method = &method;
      return true;
    } catch (const Misfit&) {
    } catch (const Broken&) {
    }
    return false;
  };
  try {
    Reader reader(in, version_, limits_);
    Open list = reader.open();
    if (only != nullptr) {
      out.wrong_arguments = !read_arguments(reader, list, *only);
    } else {
      std::string name;
      while (list.left > 0 && name.size() < kNameMax) {
        const auto word = reader.word(reader.next(list));
        if (!word) break;
        name += (name.empty() ? "" : "_") + *word;
        out.asked += (out.asked.empty() ? "" : " ") + *word;
        const idl::Method* method = service.find(name);
        if (method == nullptr) continue;
        const std::size_t behind = in.position();
        if (read_arguments(reader, list, *method)) break;
        in.seek(behind);
        if (!out.wrong_arguments) known = name;
        out.wrong_arguments = true;
      }
    }
  } catch (const Misfit&) {
  } catch (const Broken&) {
    // The bytes are all there; what they should have been does not matter to those that follow.
  }
  in.lift_fence();
  in.seek(end);
  if (out.method != nullptr) out.wrong_arguments = false;
  if (out.wrong_arguments && !known.empty()) out.asked = known;
  return out;
}

rpc::Outcome Encoding::read_reply(Inbox& in, const idl::Method& method) const {
  const auto failed = [&](const std::string& why) -> rpc::Outcome {
    return tl::unexpected(rpc::CallError{rpc::CallErrorKind::kProtocol, why, {}, {}});
  };
  Reader reader(in, version_, limits_);
  Open list = reader.open();
  // The answer to what it knows not, or cannot read: one vocab where another type was due.
  if (list.left == 1 && method.result->kind != Kind::kBool) {
    // Never more is looked at than a reply has: the rest may not come.
    const auto word_at = [&](std::size_t offset) {
      std::int32_t word = 0;
      std::memcpy(&word, in.peek(offset + 4) + offset, 4);
      return word;
    };
    const bool typed = list.tag == kVocab32;
    const std::size_t before = typed ? 0 : 4;
    const bool is_vocab = typed || (list.tag == 0 && word_at(0) == static_cast<std::int32_t>(kVocab32));
    if (is_vocab && word_at(before) == vocab("fail")) {
      (void)in.take(before + 4);
      return failed("it answered [fail]: it knows no such method, not with these arguments, or it failed");
    }
  }
  try {
    if (method.result->kind == Kind::kVoid) {
      while (list.left > 0) reader.skip(reader.next(list), 0);
      return Value();
    }
    Value out = reader.item(*method.result, list, 1);
    if (list.left == 0) return out;
    throw Broken{rpc::StreamStatus::kFailed, fmt::format("its reply has {} values too many", list.left)};
  } catch (const Misfit& e) {
    throw Broken{rpc::StreamStatus::kFailed, "its reply is not that of the interface: " + e.why};
  }
}

void write_fail(std::vector<std::uint8_t>& out) {
  put_int(out, kList | kVocab32);
  put_int(out, 1);
  put_int(out, vocab("fail"));
}

void write_many(std::vector<std::uint8_t>& out, const std::vector<std::string>& lines) {
  put_int(out, kList);
  put_int(out, 2);
  put_int(out, kVocab32);
  put_int(out, vocab("many"));
  put_int(out, kList | kString);
  put_int(out, static_cast<std::int32_t>(lines.size()));
  for (const std::string& line : lines) {
    put_int(out, static_cast<std::int32_t>(line.size()));
    put(out, line);
  }
}

}  // namespace sentree::yarp
