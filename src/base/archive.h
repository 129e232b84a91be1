#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "sentree/base/copy_on_write.h"
#include "sentree/base/diagnostic.h"
#include "sentree/base/rng.h"
#include "sentree/base/time.h"
#include "sentree/base/value.h"

/// Hashing, saving and restoring of states, from one list of the members of each type:
/// `visit_members(object, visit)`, found by its argument, calls `visit(name, member)` for each in a fixed order.
///
/// A type whose content is that of another one (a queue that is a vector) has `archived(const T&)`, which gives that,
/// and `unarchive(Other&&, T&)` instead. An enumeration that counts from 0 may have `last_enumerator(E)`, which gives
/// its last one: no other number is restored.
namespace sentree::archive {

template <class S, class Of>
concept MaybeConst = std::is_same_v<std::remove_const_t<S>, Of>;

template <class T>
concept HasSubstitute = requires(const T& object) {
  archived(object);
};

template <class T>
struct IsSequence : std::false_type {};
template <class T>
struct IsSequence<std::vector<T>> : std::true_type {};
template <class T>
struct IsSequence<std::deque<T>> : std::true_type {};
template <class T>
struct IsSequence<std::set<T>> : std::true_type {};
template <class T, std::size_t N>
struct IsSequence<std::array<T, N>> : std::true_type {};

template <class T>
concept Plain = !HasSubstitute<T> && !IsSequence<T>::value && std::is_class_v<T>;

struct Hasher {
  std::uint64_t value = 0;

  void operator()(std::string_view, bool v) { mix(v ? 1U : 0U); }
  template <class T>
  requires(std::is_integral_v<T> || std::is_enum_v<T>) void operator()(std::string_view, const T& v) {
    mix(static_cast<std::uint64_t>(v));
  }
  // -0.0 == 0.0, so they hash alike.
  void operator()(std::string_view, double v) { mix(std::bit_cast<std::uint64_t>(v + 0.0)); }
  void operator()(std::string_view, TimePoint v) { mix(static_cast<std::uint64_t>(v.time_since_epoch().count())); }
  void operator()(std::string_view, Duration v) { mix(static_cast<std::uint64_t>(v.count())); }
  void operator()(std::string_view, const std::string& v) { mix(hash_bytes(v)); }
  void operator()(std::string_view, const Rng& v) { mix(v.state()); }
  void operator()(std::string_view, const Value& v) { mix(v.hash()); }
  void operator()(std::string_view, const Map& v) {
    for (const auto& [key, item] : v) {
      mix(hash_bytes(key));
      mix(item.hash());
    }
    mix(v.size());
  }
  template <class T>
  void operator()(std::string_view name, const std::optional<T>& v) {
    mix(v ? 1U : 0U);
    if (v) (*this)(name, *v);
  }
  template <class T>
  void operator()(std::string_view name, const CopyOnWrite<T>& v) {
    (*this)(name, *v);
  }
  template <class A, class B>
  void operator()(std::string_view name, const std::pair<A, B>& v) {
    (*this)(name, v.first);
    (*this)(name, v.second);
  }
  template <class... T>
  void operator()(std::string_view name, const std::variant<T...>& v) {
    mix(v.index());
    std::visit([&](const auto& alternative) { (*this)(name, alternative); }, v);
  }
  template <class T>
  requires(IsSequence<T>::value) void operator()(std::string_view name, const T& items) {
    for (const auto& item : items) (*this)(name, item);
    mix(items.size());
  }
  template <HasSubstitute T>
  void operator()(std::string_view name, const T& object) {
    (*this)(name, archived(object));
  }
  template <Plain T>
  void operator()(std::string_view, const T& object) {
    visit_members(object, *this);
  }
  void mix(std::uint64_t v) { value = hash_combine(value, v); }
};

struct Saver {
  Map map;

  void operator()(std::string_view name, const auto& member) { map.append(std::string(name), saved(member)); }

  static Value saved(bool v) { return v; }
  // Unsigned words keep their bits.
  template <class T>
  requires(std::is_integral_v<T> || std::is_enum_v<T>) static Value saved(T v) { return static_cast<std::int64_t>(v); }
  static Value saved(double v) { return v; }
  static Value saved(TimePoint v) { return static_cast<std::int64_t>(v.time_since_epoch().count()); }
  static Value saved(Duration v) { return static_cast<std::int64_t>(v.count()); }
  static Value saved(const std::string& v) { return v; }
  static Value saved(const Rng& v) { return static_cast<std::int64_t>(v.state()); }
  static Value saved(const Value& v) { return v; }
  static Value saved(const Map& v) { return v; }
  template <class T>
  static Value saved(const std::optional<T>& v) {
    return v ? Value(List{saved(*v)}) : Value(List{});
  }
  template <class T>
  static Value saved(const CopyOnWrite<T>& v) {
    return saved(*v);
  }
  template <class A, class B>
  static Value saved(const std::pair<A, B>& v) {
    return List{saved(v.first), saved(v.second)};
  }
  template <class... T>
  static Value saved(const std::variant<T...>& v) {
    return List{static_cast<std::int64_t>(v.index()),
                std::visit([](const auto& alternative) { return Value(saved(alternative)); }, v)};
  }
  template <class T>
  requires(IsSequence<T>::value) static Value saved(const T& items) {
    List list;
    list.reserve(items.size());
    for (const auto& item : items) list.push_back(saved(item));
    return list;
  }
  template <HasSubstitute T>
  static Value saved(const T& object) {
    return saved(archived(object));
  }
  template <Plain T>
  static Value saved(const T& object) {
    Saver inner;
    visit_members(object, inner);
    return std::move(inner.map);
  }
};

/// The first thing that does not fit is remembered by its path; the rest is left as it is.
struct Restorer {
  const Value* from;
  std::string path;
  std::string* problem;

  template <class T>
  void operator()(std::string_view name, T& member) {
    if (!problem->empty()) return;
    const Value* value = from->find(name);
    const std::string here = path.empty() ? std::string(name) : path + "." + std::string(name);
    if (value == nullptr)
      *problem = here + " is missing";
    else
      restored(*value, here, member);
  }

  void wrong(const std::string& here, const Value& value) const {
    if (problem->empty()) *problem = here + " is " + std::string(to_string(value.type()));
  }
  template <class T>
  void exactly(const T* v, const Value& value, const std::string& here, T& out) const {
    if (v != nullptr)
      out = *v;
    else
      wrong(here, value);
  }
  void restored(const Value& value, const std::string& here, bool& out) const {
    exactly(value.as_bool(), value, here, out);
  }
  template <class T>
  requires(std::is_integral_v<T> || std::is_enum_v<T>) void restored(const Value& value, const std::string& here,
                                                                     T& out) const {
    const std::int64_t* v = value.as_int();
    if (v == nullptr) return wrong(here, value);
    bool fits = true;
    if constexpr (requires { last_enumerator(T{}); })
      fits = *v >= 0 && *v <= static_cast<std::int64_t>(last_enumerator(T{}));
    if (fits) out = static_cast<T>(*v);
    if (!fits || static_cast<std::int64_t>(out) != *v) *problem = here + " is out of range";
  }
  void restored(const Value& value, const std::string& here, double& out) const {
    exactly(value.as_double(), value, here, out);
  }
  void restored(const Value& value, const std::string& here, TimePoint& out) const {
    std::int64_t ns = 0;
    restored(value, here, ns);
    out = TimePoint(Duration(ns));
  }
  void restored(const Value& value, const std::string& here, Duration& out) const {
    std::int64_t ns = 0;
    restored(value, here, ns);
    out = Duration(ns);
  }
  void restored(const Value& value, const std::string& here, std::string& out) const {
    exactly(value.as_string(), value, here, out);
  }
  void restored(const Value& value, const std::string& here, Rng& out) const {
    std::int64_t word = 0;
    restored(value, here, word);
    out = Rng(static_cast<std::uint64_t>(word));
  }
  void restored(const Value& value, const std::string&, Value& out) const { out = value; }
  void restored(const Value& value, const std::string& here, Map& out) const {
    exactly(value.as_map(), value, here, out);
  }
  template <class T>
  void restored(const Value& value, const std::string& here, std::optional<T>& out) const {
    const List* list = value.as_list();
    if (list == nullptr || list->size() > 1) return wrong(here, value);
    out.reset();
    if (!list->empty()) restored(list->front(), here, *(out = T{}));
  }
  template <class T>
  void restored(const Value& value, const std::string& here, CopyOnWrite<T>& out) const {
    T content{};
    restored(value, here, content);
    out = content == T{} ? CopyOnWrite<T>() : CopyOnWrite<T>(std::move(content));
  }
  template <class A, class B>
  void restored(const Value& value, const std::string& here, std::pair<A, B>& out) const {
    const List* list = value.as_list();
    if (list == nullptr || list->size() != 2) return wrong(here, value);
    restored(list->front(), here, out.first);
    restored(list->back(), here, out.second);
  }
  template <class... T>
  void restored(const Value& value, const std::string& here, std::variant<T...>& out) const {
    const List* list = value.as_list();
    const std::int64_t* index = list != nullptr && list->size() == 2 ? list->front().as_int() : nullptr;
    if (index == nullptr || *index < 0 || static_cast<std::uint64_t>(*index) >= sizeof...(T)) return wrong(here, value);
    std::int64_t next = 0;
    ((next++ == *index ? restored(list->back(), here, out.template emplace<T>()) : void()), ...);
  }
  template <class Sequence>
  requires(IsSequence<Sequence>::value) void restored(const Value& value, const std::string& here,
                                                      Sequence& out) const {
    const List* list = value.as_list();
    if (list == nullptr) return wrong(here, value);
    out.clear();
    for (std::size_t i = 0; i < list->size() && problem->empty(); ++i) {
      typename Sequence::value_type item{};
      restored((*list)[i], here + "[" + std::to_string(i) + "]", item);
      out.insert(out.end(), std::move(item));
    }
  }
  template <class T, std::size_t N>
  void restored(const Value& value, const std::string& here, std::array<T, N>& out) const {
    const List* list = value.as_list();
    if (list == nullptr || list->size() != N) return wrong(here, value);
    for (std::size_t i = 0; i < N; ++i) restored((*list)[i], here + "[" + std::to_string(i) + "]", out[i]);
  }
  template <HasSubstitute T>
  void restored(const Value& value, const std::string& here, T& out) const {
    auto content = archived(out);
    restored(value, here, content);
    if (problem->empty()) unarchive(std::move(content), out);
  }
  template <Plain T>
  void restored(const Value& value, const std::string& here, T& out) const {
    if (value.as_map() == nullptr) return wrong(here, value);
    visit_members(out, Restorer{&value, here, problem});
  }
};

template <class T>
[[nodiscard]] std::uint64_t hash(const T& object) {
  Hasher hasher;
  hasher({}, object);
  return hasher.value;
}
template <class T>
[[nodiscard]] Value save(const T& object) {
  return Saver::saved(object);
}
/// Empty, or what does not fit, for people: "robots[0].pose is missing". `object` holds the rest then.
template <class T>
[[nodiscard]] std::string restore(const Value& saved, T& object) {
  std::string problem;
  Restorer{&saved, {}, &problem}.restored(saved, {}, object);
  return problem;
}

}  // namespace sentree::archive

namespace sentree {

template <class S, class V>
requires archive::MaybeConst<S, SourceSpan>
void visit_members(S& s, V&& visit) {
  visit("file", s.file);
  visit("line", s.line);
  visit("column", s.column);
  visit("length", s.length);
}
template <class S, class V>
requires archive::MaybeConst<S, Diagnostic>
void visit_members(S& s, V&& visit) {
  visit("severity", s.severity);
  visit("code", s.code);
  visit("message", s.message);
  visit("span", s.span);
}

}  // namespace sentree
