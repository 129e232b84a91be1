#include "sentree/ros/detail/cdr.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <utility>

namespace sentree::ros {

using idl::Kind;
using idl::Type;

// A type as it is on the wire.
struct Codec::Node {
  enum class Form : std::uint8_t { kBool, kInteger, kReal, kText, kWideText, kOctets, kEnum, kStruct, kList, kMap };
  enum class Many : std::uint8_t { kFixed, kBounded, kAny };

  Form form = Form::kStruct;
  std::uint8_t size = 1;  // kInteger, kReal: octets, which is its alignment too
  bool is_signed = true;
  Many many = Many::kAny;                             // kOctets, kList
  std::uint32_t count = 0;                            // of items, or most of them; kText: most octets, 0: any
  const Type* type = nullptr;                         // kEnum
  std::vector<std::shared_ptr<const Node>> children;  // fields; element; key and element
  std::vector<const idl::Field*> fields;              // kStruct
  std::vector<bool> optional;                         // kStruct
};

namespace {

using CodecNode = Codec::Node;
using CodecForm = CodecNode::Form;

constexpr int kNestingMax = 64;

struct Scalar {
  const char* name;
  CodecForm form;
  std::uint8_t size;
  bool is_signed;
};
constexpr Scalar kScalars[] = {
    {"bool", CodecForm::kBool, 1, false},      {"byte", CodecForm::kInteger, 1, false},
    {"char", CodecForm::kInteger, 1, false},   {"int8", CodecForm::kInteger, 1, true},
    {"uint8", CodecForm::kInteger, 1, false},  {"int16", CodecForm::kInteger, 2, true},
    {"uint16", CodecForm::kInteger, 2, false}, {"int32", CodecForm::kInteger, 4, true},
    {"uint32", CodecForm::kInteger, 4, false}, {"int64", CodecForm::kInteger, 8, true},
    {"uint64", CodecForm::kInteger, 8, false}, {"float32", CodecForm::kReal, 4, true},
    {"float64", CodecForm::kReal, 8, true},
};

std::uint32_t number_in(std::string_view text) {
  std::uint32_t out = 0;
  std::from_chars(text.data(), text.data() + text.size(), out);
  return out;
}

// "[4]", "[<=4]", "[]" at the end of a name of ROS.
void read_suffix(std::string_view name, CodecNode& node) {
  const auto open = name.rfind('[');
  if (open == std::string_view::npos || name.back() != ']') return;
  const std::string_view length = name.substr(open + 1, name.size() - open - 2);
  if (length.empty()) return;
  node.many = length.starts_with("<=") ? CodecNode::Many::kBounded : CodecNode::Many::kFixed;
  node.count = number_in(length.starts_with("<=") ? length.substr(2) : length);
}

class Maker {
 public:
  Result<std::shared_ptr<const CodecNode>> structure(const idl::Struct& s) {
    if (s.kind == idl::StructKind::kUnion)
      return fail("ros.type", fmt::format("\"{}\" is a union, which messages of ROS cannot hold", s.name));
    const auto made = made_.find(&s);
    const std::size_t depth = inside_.size() + (made != made_.end() ? made->second.depth : 1);
    if (depth > kNestingMax || !inside_.insert(&s).second)
      return fail("ros.type",
                  fmt::format("\"{}\" holds itself, or too many others, which messages of ROS cannot", s.name));
    const std::size_t deepest_outside = std::exchange(deepest_, depth);
    const auto leave = [&] {
      inside_.erase(&s);
      deepest_ = std::max(deepest_, deepest_outside);
    };
    if (made != made_.end()) {
      leave();
      return made->second.node;
    }
    auto node = std::make_shared<CodecNode>();
    for (const idl::Field& f : s.fields) {
      auto child = type(*f.type);
      if (!child) return child;
      node->children.push_back(std::move(*child));
      node->fields.push_back(&f);
      node->optional.push_back(f.requiredness == idl::Requiredness::kOptional);
    }
    made_[&s] = {node, deepest_ - inside_.size() + 1};
    leave();
    return node;
  }

 private:
  Result<std::shared_ptr<const CodecNode>> type(const Type& t) {
    if (t.kind == Kind::kStruct) return structure(*t.structure);
    auto node = std::make_shared<CodecNode>();
    const std::string_view name = t.name;
    switch (t.kind) {
      case Kind::kVoid: return fail("ros.type", "a value of type void cannot be carried");
      case Kind::kBool: node->form = CodecForm::kBool; break;
      case Kind::kI8: set(*node, CodecForm::kInteger, 1); break;
      case Kind::kI16: set(*node, CodecForm::kInteger, 2); break;
      case Kind::kI32: set(*node, CodecForm::kInteger, 4); break;
      case Kind::kI64: set(*node, CodecForm::kInteger, 8); break;
      case Kind::kDouble: set(*node, CodecForm::kReal, 8); break;
      case Kind::kEnum:
        set(*node, CodecForm::kEnum, 4);
        node->type = &t;
        break;
      case Kind::kString:
        node->form = name.starts_with("wstring") ? CodecForm::kWideText : CodecForm::kText;
        if (const auto less = name.find("<="); less != std::string_view::npos)
          node->count = number_in(name.substr(less + 2));
        break;
      case Kind::kBinary:
        node->form = CodecForm::kOctets;
        read_suffix(name, *node);
        break;
      case Kind::kList:
      case Kind::kSet:
      case Kind::kMap: {
        node->form = t.kind == Kind::kMap ? CodecForm::kMap : CodecForm::kList;
        if (t.kind == Kind::kList) read_suffix(name, *node);
        if (++depth_ > kNestingMax) return fail("ros.type", fmt::format("\"{}\" is nested too deep", t.name));
        for (const Type* part : {t.kind == Kind::kMap ? t.key : nullptr, t.element}) {
          if (part == nullptr) continue;
          auto child = type(*part);
          if (!child) return child;
          node->children.push_back(std::move(*child));
        }
        --depth_;
        break;
      }
      case Kind::kStruct: break;
    }
    for (const Scalar& s : kScalars) {
      if (name != s.name) continue;
      node->form = s.form;
      node->size = s.size;
      node->is_signed = s.is_signed;
    }
    return node;
  }
  static void set(CodecNode& node, CodecForm form, std::uint8_t size) {
    node.form = form;
    node.size = size;
  }

  // A struct in many others is made once: by its paths it may be there any number of times.
  struct Made {
    std::shared_ptr<const CodecNode> node;
    std::size_t depth = 0;  // structs within structs, from this one on
  };
  std::map<const idl::Struct*, Made> made_;
  std::set<const idl::Struct*> inside_;
  std::size_t deepest_ = 0;  // of the struct that is being made
  int depth_ = 0;
};

struct Wrong {
  std::string path;
  std::string message;
};

bool wrong(Wrong& out, std::string message) {
  out.message = std::move(message);
  return false;
}
std::string item(std::size_t i) { return fmt::format("[{}]", i); }

class Writer {
 public:
  explicit Writer(std::vector<std::uint8_t>& out) : out_(out) {}

  bool structure(const CodecNode& node, const Value& value, Wrong& w) {
    // As the generators of DDS want it: a struct has a member.
    if (node.children.empty()) out_.push_back(0);
    for (std::size_t i = 0; i < node.children.size(); ++i) {
      const Value* field = value.find(node.fields[i]->name);
      bool good = true;
      if (node.optional[i]) {
        integer(field == nullptr ? 0 : 1, 4);
        if (field != nullptr) good = write(*node.children[i], *field, w);
      } else {
        good = field != nullptr ? write(*node.children[i], *field, w) : wrong(w, "is missing");
      }
      if (good) continue;
      w.path = fmt::format(".{}{}", node.fields[i]->name, w.path);
      return false;
    }
    return true;
  }

 private:
  void align(std::size_t size) {
    while ((out_.size() - kEncapsulation) % size != 0) out_.push_back(0);
  }
  void integer(std::uint64_t number, std::size_t size) {
    align(size);
    for (std::size_t i = 0; i < size; ++i) out_.push_back(static_cast<std::uint8_t>(number >> (8 * i)));
  }

  bool length(const CodecNode& node, std::size_t count, Wrong& w) {
    if (node.many == CodecNode::Many::kFixed) {
      return count == node.count || wrong(w, fmt::format("has {} items, and must have {}", count, node.count));
    }
    if (node.many == CodecNode::Many::kBounded && count > node.count)
      return wrong(w, fmt::format("has {} items, and may have {}", count, node.count));
    if (count > std::numeric_limits<std::uint32_t>::max()) return wrong(w, "has too many items");
    integer(count, 4);
    return true;
  }

  bool number(const CodecNode& node, std::int64_t n, Wrong& w) {
    if (node.size < 8) {
      const int bits = 8 * node.size;
      const std::int64_t low = node.is_signed ? -(std::int64_t{1} << (bits - 1)) : 0;
      const std::int64_t high = (std::int64_t{1} << (node.is_signed ? bits - 1 : bits)) - 1;
      if (n < low || n > high) return wrong(w, fmt::format("is {}, and must be from {} to {}", n, low, high));
    }
    integer(static_cast<std::uint64_t>(n), node.size);
    return true;
  }

  bool write(const CodecNode& node, const Value& value, Wrong& w) {
    switch (node.form) {
      case CodecForm::kBool: out_.push_back(value.as_bool() != nullptr && *value.as_bool() ? 1 : 0); return true;
      case CodecForm::kInteger: return number(node, value.as_int() != nullptr ? *value.as_int() : 0, w);
      case CodecForm::kReal:
        if (node.size == 4)
          integer(std::bit_cast<std::uint32_t>(static_cast<float>(value.number())), 4);
        else
          integer(std::bit_cast<std::uint64_t>(value.number()), 8);
        return true;
      case CodecForm::kEnum: {
        const idl::Enumerator* named =
            value.as_string() != nullptr ? node.type->enumeration->find(value.text()) : nullptr;
        return number(node, named != nullptr ? named->number : value.as_int() != nullptr ? *value.as_int() : 0, w);
      }
      case CodecForm::kText: {
        const std::string_view text = value.text();
        if (node.count > 0 && text.size() > node.count)
          return wrong(w, fmt::format("has {} bytes, and may have {}", text.size(), node.count));
        integer(text.size() + 1, 4);
        out_.insert(out_.end(), text.begin(), text.end());
        out_.push_back(0);
        return true;
      }
      case CodecForm::kWideText: return wide(node, value.text(), w);
      case CodecForm::kOctets: {
        static const Bytes kEmpty;
        const Bytes& bytes = value.as_bytes() != nullptr ? *value.as_bytes() : kEmpty;
        if (!length(node, bytes.octets.size(), w)) return false;
        const auto* first = reinterpret_cast<const std::uint8_t*>(bytes.octets.data());
        out_.insert(out_.end(), first, first + bytes.octets.size());
        return true;
      }
      case CodecForm::kStruct: return structure(node, value, w);
      case CodecForm::kList: {
        static const List kEmpty;
        const List& list = value.as_list() != nullptr ? *value.as_list() : kEmpty;
        if (!length(node, list.size(), w)) return false;
        for (std::size_t i = 0; i < list.size(); ++i) {
          if (write(*node.children[0], list[i], w)) continue;
          w.path = item(i) + w.path;
          return false;
        }
        return true;
      }
      case CodecForm::kMap: return pairs(node, value, w);
    }
    return false;
  }

  // A map with text as keys, or a list of [key, value].
  bool pairs(const CodecNode& node, const Value& value, Wrong& w) {
    const Map* map = value.as_map();
    const List* list = value.as_list();
    if (!length(node, map != nullptr ? map->size() : list != nullptr ? list->size() : 0, w)) return false;
    std::size_t i = 0;
    const auto pair = [&](const Value& key, const Value& item_value) {
      if (write(*node.children[0], key, w) && write(*node.children[1], item_value, w)) return ++i, true;
      w.path = item(i) + w.path;
      return false;
    };
    if (map != nullptr) {
      for (const auto& [key, item_value] : *map) {
        if (!pair(Value(key), item_value)) return false;
      }
    } else if (list != nullptr) {
      for (const Value& each : *list) {
        if (!pair((*each.as_list())[0], (*each.as_list())[1])) return false;
      }
    }
    return true;
  }

  // Four octets for each unit of UTF-16, as both implementations of ROS have it on Linux.
  bool wide(const CodecNode& node, std::string_view text, Wrong& w) {
    std::vector<std::uint32_t> units;
    for (std::size_t i = 0; i < text.size();) {
      const auto lead = static_cast<std::uint8_t>(text[i]);
      const std::size_t size = lead < 0x80 ? 1 : lead < 0xE0 ? 2 : lead < 0xF0 ? 3 : 4;
      if ((lead >= 0x80 && lead < 0xC2) || lead > 0xF4 || i + size > text.size()) return wrong(w, "is no UTF-8");
      std::uint32_t point = size == 1 ? lead : lead & (0x7FU >> size);
      for (std::size_t k = 1; k < size; ++k) {
        const auto next = static_cast<std::uint8_t>(text[i + k]);
        if ((next & 0xC0U) != 0x80U) return wrong(w, "is no UTF-8");
        point = point << 6U | (next & 0x3FU);
      }
      i += size;
      if (point >= 0x10000) {
        point -= 0x10000;
        units.push_back(0xD800U + (point >> 10U));
        units.push_back(0xDC00U + (point & 0x3FFU));
      } else {
        units.push_back(point);
      }
    }
    if (node.count > 0 && units.size() > node.count)
      return wrong(w, fmt::format("has {} characters, and may have {}", units.size(), node.count));
    integer(units.size(), 4);
    for (const std::uint32_t unit : units) integer(unit, 4);
    return true;
  }

  std::vector<std::uint8_t>& out_;
};

class Reader {
 public:
  Reader(std::span<const std::uint8_t> message, std::size_t from, bool little, std::size_t values)
      : bytes_(message), at_(from), little_(little), left_(values) {}

  bool structure(const CodecNode& node, Value& out, Wrong& w) {
    if (!one(w)) return false;
    Map made;
    made.reserve(node.children.size());
    std::uint64_t ignored = 0;
    if (node.children.empty() && !integer(1, ignored, w)) return false;
    for (std::size_t i = 0; i < node.children.size(); ++i) {
      Value field;
      std::uint64_t there = 1;
      bool good = !node.optional[i] || integer(4, there, w);
      if (good && there > 1) good = wrong(w, "is there several times");
      if (good && there == 1) good = read(*node.children[i], field, w);
      if (!good) {
        w.path = fmt::format(".{}{}", node.fields[i]->name, w.path);
        return false;
      }
      if (there == 1) made.append(node.fields[i]->name, std::move(field));
    }
    out = Value(std::move(made));
    return true;
  }

 private:
  bool one(Wrong& w) {
    if (left_ == 0) return wrong(w, "more values than are taken");
    --left_;
    return true;
  }
  bool has(std::size_t size, Wrong& w) { return bytes_.size() - at_ >= size || wrong(w, "the message ends before it"); }

  bool integer(std::size_t size, std::uint64_t& out, Wrong& w) {
    const std::size_t behind = (at_ - kEncapsulation) % size;
    const std::size_t padding = behind == 0 ? 0 : size - behind;
    if (!has(padding + size, w)) return false;
    at_ += padding;
    out = 0;
    for (std::size_t i = 0; i < size; ++i)
      out |= static_cast<std::uint64_t>(bytes_[at_ + i]) << (8 * (little_ ? i : size - 1 - i));
    at_ += size;
    return true;
  }

  // Every item takes an octet at least, so that a count is never more than what is left.
  bool length(const CodecNode& node, std::uint64_t& count, Wrong& w) {
    if (node.many == CodecNode::Many::kFixed) return count = node.count, true;
    if (!integer(4, count, w)) return false;
    if (node.many == CodecNode::Many::kBounded && count > node.count)
      return wrong(w, fmt::format("has {} items, and may have {}", count, node.count));
    return has(count, w);
  }

  bool read(const CodecNode& node, Value& out, Wrong& w) {
    if (node.form == CodecForm::kStruct) return structure(node, out, w);
    if (!one(w)) return false;
    std::uint64_t number = 0;
    switch (node.form) {
      case CodecForm::kBool:
        if (!integer(1, number, w)) return false;
        out = Value(number != 0);
        return true;
      case CodecForm::kInteger:
      case CodecForm::kEnum: {
        if (!integer(node.size, number, w)) return false;
        const int unused = 64 - 8 * node.size;
        const std::int64_t n =
            node.is_signed ? static_cast<std::int64_t>(number << unused) >> unused : static_cast<std::int64_t>(number);
        const idl::Enumerator* named = node.form == CodecForm::kEnum ? node.type->enumeration->find(n) : nullptr;
        out = named != nullptr ? Value(named->name) : Value(n);
        return true;
      }
      case CodecForm::kReal:
        if (!integer(node.size, number, w)) return false;
        out = Value(node.size == 4 ? static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(number)))
                                   : std::bit_cast<double>(number));
        return true;
      case CodecForm::kText: {
        if (!integer(4, number, w) || !has(number, w)) return false;
        std::string_view text(reinterpret_cast<const char*>(bytes_.data()) + at_, number);
        at_ += number;
        // Some write an empty text without its NUL.
        if (!text.empty() && text.back() == '\0') text.remove_suffix(1);
        if (node.count > 0 && text.size() > node.count)
          return wrong(w, fmt::format("has {} bytes, and may have {}", text.size(), node.count));
        out = Value(std::string(text));
        return true;
      }
      case CodecForm::kWideText: return wide(out, w);
      case CodecForm::kOctets: {
        if (!length(node, number, w) || !has(number, w)) return false;
        const auto* first = reinterpret_cast<const std::byte*>(bytes_.data()) + at_;
        at_ += number;
        out = Value(Bytes{{first, first + number}});
        return true;
      }
      case CodecForm::kList:
      case CodecForm::kMap: return items(node, out, w);
      case CodecForm::kStruct: break;
    }
    return false;
  }

  bool items(const CodecNode& node, Value& out, Wrong& w) {
    std::uint64_t count = 0;
    if (!length(node, count, w)) return false;
    List list;
    Map map;
    std::set<std::string> seen;  // the first of equal keys
    const bool is_map = node.form == CodecForm::kMap && node.children[0]->form == CodecForm::kText;
    for (std::uint64_t i = 0; i < count; ++i) {
      Value first;
      Value second;
      const bool good =
          read(*node.children[0], first, w) && (node.form == CodecForm::kList || read(*node.children[1], second, w));
      if (!good) {
        w.path = item(i) + w.path;
        return false;
      }
      if (is_map)
        seen.insert(std::string(first.text())).second ? map.append(std::string(first.text()), std::move(second))
                                                      : void();
      else if (node.form == CodecForm::kMap)
        list.emplace_back(List{std::move(first), std::move(second)});
      else
        list.push_back(std::move(first));
    }
    out = is_map ? Value(std::move(map)) : Value(std::move(list));
    return true;
  }

  bool wide(Value& out, Wrong& w) {
    std::uint64_t count = 0;
    if (!integer(4, count, w) || !has(count, w)) return false;
    std::string text;
    std::uint64_t high = 0;
    for (std::uint64_t i = 0; i < count; ++i) {
      std::uint64_t unit = 0;
      if (!integer(4, unit, w)) return false;
      if (unit >= 0xD800 && unit < 0xDC00) {
        high = unit;
        continue;
      }
      if (unit >= 0xDC00 && unit < 0xE000 && high != 0) unit = 0x10000 + ((high - 0xD800) << 10U) + (unit - 0xDC00);
      high = 0;
      if (unit > 0x10FFFF) return wrong(w, "is no UTF-16");
      if (unit < 0x80) {
        text += static_cast<char>(unit);
      } else if (unit < 0x800) {
        text += static_cast<char>(0xC0U | unit >> 6U);
        text += static_cast<char>(0x80U | (unit & 0x3FU));
      } else {
        if (unit < 0x10000) {
          text += static_cast<char>(0xE0U | unit >> 12U);
        } else {
          text += static_cast<char>(0xF0U | unit >> 18U);
          text += static_cast<char>(0x80U | (unit >> 12U & 0x3FU));
        }
        text += static_cast<char>(0x80U | (unit >> 6U & 0x3FU));
        text += static_cast<char>(0x80U | (unit & 0x3FU));
      }
    }
    out = Value(std::move(text));
    return true;
  }

  const std::span<const std::uint8_t> bytes_;
  std::size_t at_;
  const bool little_;
  std::size_t left_;
};

std::string told(const Wrong& w) {
  return (w.path.starts_with('.') ? w.path.substr(1) : w.path) + (w.path.empty() ? "" : ": ") + w.message;
}

}  // namespace

Result<Codec> Codec::make(const idl::Struct& structure) {
  auto root = Maker().structure(structure);
  if (!root) return tl::unexpected(std::move(root.error()));
  return Codec(std::move(*root));
}

Result<void> Codec::write(std::vector<std::uint8_t>& out, const Value& value) const {
  Wrong w;
  if (Writer(out).structure(*root_, value, w)) return {};
  return fail("ros.value", told(w));
}

Result<Value> Codec::read(std::span<const std::uint8_t> message, std::size_t from, const rpc::Limits& limits) const {
  if (message.size() < kEncapsulation || from < kEncapsulation || from > message.size())
    return fail("ros.message", fmt::format("the message of {} octets is too short", message.size()));
  if (message[0] != 0 || message[1] > 1)
    return fail("ros.message", fmt::format("the message is not encoded as plain CDR, but with number {}",
                                           message[0] * 256 + message[1]));
  if (message.size() > limits.message_bytes)
    return fail("ros.message", fmt::format("the message has more than {} octets", limits.message_bytes));
  Wrong w;
  Value out;
  if (Reader(message, from, message[1] == 1, limits.values).structure(*root_, out, w)) return out;
  return fail("ros.message", told(w));
}

void begin_message(std::vector<std::uint8_t>& out) {
  out.clear();
  out.insert(out.end(), {0, 1, 0, 0});
}

}  // namespace sentree::ros
