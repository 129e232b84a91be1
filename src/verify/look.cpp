#include "sentree/verify/detail/look.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "sentree/verify/detail/reply_flow.h"

namespace sentree::verify {

namespace {

// Looks at one reply.
class ReplyLook {
 public:
  ReplyLook(const Distinctions& distinctions, bool exact, Look& out)
      : known_(distinctions), exact_(exact || distinctions.trouble), out_(out) {}

  // @param name  Under which expressions read it. Nothing: it is not looked at.
  std::optional<Value> operator()(const idl::Type& type, const Value& value, const std::string& name,
                                  const std::string& path, int depth) {
    const bool named = exact_ || name == "result" || known_.mentions(name);
    switch (type.kind) {
      case idl::Kind::kVoid:
      case idl::Kind::kBinary: return std::nullopt;
      case idl::Kind::kStruct: return record(*type.structure, value, path, depth);
      case idl::Kind::kList:
      case idl::Kind::kSet: return items(type, value, name, path, depth);
      case idl::Kind::kMap: return named ? shown(path, value, value) : std::nullopt;
      case idl::Kind::kBool: return named ? shown(path, value, value) : std::nullopt;
      case idl::Kind::kEnum:
        if (!named) return std::nullopt;
        return shown(path, value, exact_ || known_.writes(std::string(value.text())) ? value : Value());
      case idl::Kind::kString: {
        if (!named) return std::nullopt;
        const auto texts = known_.texts.find(name);
        if (exact_) return shown(path, value, value);
        if (texts == known_.texts.end()) return hand(name, value);
        return shown(path, value, texts->second.contains(std::string(value.text())) ? value : Value());
      }
      case idl::Kind::kI8:
      case idl::Kind::kI16:
      case idl::Kind::kI32:
      case idl::Kind::kI64:
      case idl::Kind::kDouble: {
        if (!named) return std::nullopt;
        if (exact_ || !value.is_number()) return shown(path, value, value);
        const auto numbers = known_.numbers.find(name);
        if (numbers == known_.numbers.end()) return hand(name, value);
        return shown(path, value, Value(place(numbers->second, value.number())));
      }
    }
    return std::nullopt;
  }

 private:
  // 2 i: the i-th constant itself; 2 i + 1: between it and the one below. What is as near as rounding is the constant.
  static std::int64_t place(const std::set<double>& constants, double number) {
    std::int64_t below = 0;
    for (const double constant : constants) {
      if (std::abs(number - constant) <= 1e-9 * std::max(1.0, std::abs(constant))) return 2 * below;
      if (number < constant) break;
      ++below;
    }
    return 2 * below - 1;
  }

  std::optional<Value> shown(const std::string& path, const Value& value, Value alike) {
    out_.shown.emplace_back(path, value);
    return alike;
  }
  std::optional<Value> hand(const std::string& name, const Value& value) {
    out_.handed.emplace_back(name, value);
    return std::nullopt;
  }

  std::optional<Value> record(const idl::Struct& type, const Value& value, const std::string& path, int depth) {
    Map alike;
    if (depth >= kReplyNestingMax) return std::nullopt;
    for (const idl::Field& field : type.fields) {
      const Value* const member = value.find(field.name);
      if (member == nullptr) continue;
      if (known_.absent.contains(field.name)) alike.append(field.name + " is there", true);
      const std::string inner = path == "result" ? field.name : fmt::format("{}.{}", path, field.name);
      if (auto seen = (*this)(*field.type, *member, field.name, inner, depth + 1)) alike.append(field.name, *seen);
    }
    return Value(std::move(alike));
  }

  std::optional<Value> items(const idl::Type& type, const Value& value, const std::string& name,
                             const std::string& path, int depth) {
    const List* const list = value.as_list();
    if (list == nullptr || depth >= kReplyNestingMax) return std::nullopt;
    if (!exact_ && name != "result" && !known_.mentions(name)) return std::nullopt;
    List alike;
    for (std::size_t i = 0; i < list->size(); ++i) {
      auto seen = (*this)(*type.element, (*list)[i], name, fmt::format("{}[{}]", path, i), depth + 1);
      alike.push_back(seen ? std::move(*seen) : Value());
    }
    return Value(std::move(alike));
  }

  const Distinctions& known_;
  bool exact_;
  Look& out_;
};

}  // namespace

Look look(const Distinctions& distinctions, const idl::Method& method, const Value& result, bool exact) {
  Look out;
  if (auto alike = ReplyLook(distinctions, exact, out)(*method.result, result, "result", "result", 0))
    out.alike = std::move(*alike);
  return out;
}

}  // namespace sentree::verify
