#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/bt/object.h"
#include "sentree/bt/status.h"
#include "sentree/bt/types.h"

namespace sentree::bt {

class Machine;
class Tree;

/// What a C++ node wants next: it is done for this tick, or one of its children is to be ticked.
struct Next {
  std::uint32_t child = kNoNode;
  Status status = Status::kIdle;

  [[nodiscard]] static Next done(Status status) { return {kNoNode, status}; }
  /// Tick the child with that index (0 …); its status comes back through `on_child`.
  [[nodiscard]] static Next tick(std::size_t child) { return {static_cast<std::uint32_t>(child), Status::kIdle}; }
};

/// A value with the number and the time of its last write; 0 and zero for a literal.
template <class T>
struct Stamped {
  T value;
  std::uint64_t sequence;
  TimePoint stamp;
};

/// What a C++ node sees of itself while it runs. Valid during the call only.
class Context {
 public:
  Context(Machine& machine, NodeId node, Status kept) : machine_(machine), node_(node), kept_(kept) {}
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  [[nodiscard]] NodeId id() const { return node_; }
  [[nodiscard]] std::string_view name() const;
  [[nodiscard]] std::string path() const;
  [[nodiscard]] const Tree& tree() const;
  /// The run's time, which all nodes of one tick have in common. `sentree verify` tells states of different times apart
  /// in missions with a node that asks for it; a clock of the node's own is not seen there.
  [[nodiscard]] TimePoint now() const;
  /// What the node kept from its last tick.
  [[nodiscard]] Status status() const { return kept_; }

  /// The present value of an input port: a literal, an entry, or the default.
  /// Errors: bt.no-port, bt.no-entry, bt.empty-entry, bt.conversion.
  template <class T>
  [[nodiscard]] Result<T> input(PortName port) const;
  template <class T>
  [[nodiscard]] T input_or(PortName port, T otherwise) const {
    auto read = input<T>(port);
    return read ? std::move(*read) : std::move(otherwise);
  }
  /// Writes the entry that an output port names; the first typed write locks its type. What is of another type than the
  /// port declares is converted: 1 to a double. A literal and a view are written as std::string. These errors fail the
  /// tick: bt.not-an-entry, bt.entry-type, and bt.no-port of a port that the node does not declare. A declared port
  /// that the file gives no entry is bt.no-port too, which fails nothing: nobody asks for what is written there. So do
  /// not make your status of what this returns.
  template <class T>
  Result<void> output(PortName port, const T& value);
  /// What an input port holds, as it is, for code that does not know the type (e.g. to take it elsewhere). Null if
  /// there is nothing. Valid until something is written.
  [[nodiscard]] const Datum* held(const PortName& port) const { return peek(port); }
  /// The port's text as the file gives it; empty if it is absent.
  [[nodiscard]] std::string_view raw(const PortName& port) const;
  /// How often the entry of a port was written; 0 if there is none.
  [[nodiscard]] std::uint64_t sequence(const PortName& port) const;
  /// When the entry of a port was last written; zero if there is none.
  [[nodiscard]] TimePoint stamp(const PortName& port) const;
  /// The value with both. Errors as `input`.
  template <class T>
  [[nodiscard]] Result<Stamped<T>> stamped(PortName port) const {
    auto read = input<T>(port);
    if (!read) return tl::unexpected(std::move(read.error()));
    return Stamped<T>{std::move(*read), sequence(port), stamp(port)};
  }

  /// Asks for another tick at once.
  void wake();
  /// A function that any thread may call, at any time, to ask for a tick: for work that finishes between ticks.
  [[nodiscard]] std::function<void()> waker() const;
  /// Gives the tick up with that message (BehaviorTree.CPP's exceptions). Return any status afterwards.
  void fail(std::string message);

  /// True once something in this step failed; only halting goes on after that.
  [[nodiscard]] bool failed() const;

  [[nodiscard]] std::size_t child_count() const;
  /// Of a child beyond the last one: IDLE, and the tick fails.
  [[nodiscard]] Status child_status(std::size_t child) const;
  /// Halts the child if it runs, and makes it IDLE. A child beyond the last one fails the tick.
  void reset_child(std::size_t child);
  void reset_children();

 private:
  /// `input` where the port does not hold a T as it is.
  template <class T>
  [[nodiscard, gnu::noinline]] Result<T> converted(const PortName& port) const;
  /// What the port holds, unconverted; null if there is nothing.
  [[nodiscard]] const Datum* peek(const PortName& port) const;
  [[nodiscard, gnu::noinline]] const Datum* peek_long(const PortName& port) const;
  /// The same converted to `wanted`, in `scratch` where it is of another type.
  const Datum* read(const PortName& port, const PortType& wanted, Datum& scratch) const;
  [[nodiscard]] Diagnostic read_error(const PortName& port, const PortType& wanted) const;
  /// The value to overwrite, counted and stamped, if the entry is of exactly that type and holds one; else null.
  Value* writable(const PortName& port, const PortType& type, Value::Type held);
  [[gnu::noinline]] Value* writable_long(const PortName& port, const PortType& type, Value::Type held);
  /// `output` where the entry has to be made, or holds something else.
  template <class T>
  [[gnu::noinline]] Result<void> output_anew(const PortName& port, const T& value);
  Result<void> write(const PortName& port, Datum&& datum, const PortType& type);

  Machine& machine_;
  NodeId node_;
  Status kept_;
};

namespace detail {
/// The value as T where it is held as one: no text, no conversion of numbers.
template <class T>
[[nodiscard]] std::optional<T> exactly(const Value& value) {
  if constexpr (std::is_same_v<T, bool>) {
    if (const bool* b = value.as_bool()) return *b;
  } else if constexpr (std::is_integral_v<T>) {
    if (const auto* i = value.as_int(); i != nullptr && holds<T>(*i)) return static_cast<T>(*i);
  } else if constexpr (std::is_floating_point_v<T>) {
    if (const double* d = value.as_double()) return static_cast<T>(*d);
  } else if constexpr (std::is_same_v<T, std::string>) {
    if (const auto* s = value.as_string()) return *s;
  } else {
    if (!value.is_null() && value.as_string() == nullptr) return Convert<T>::from_value(value);
  }
  return std::nullopt;
}

/// Overwrites a value of the same type in place. `Value` gives no mutable access to scalars; this one is not const.
template <class T>
void overwrite(Value& held, const T& value) {
  if constexpr (std::is_same_v<T, bool>) {
    *const_cast<bool*>(held.as_bool()) = value;
  } else if constexpr (std::is_integral_v<T>) {
    *const_cast<std::int64_t*>(held.as_int()) = static_cast<std::int64_t>(value);
  } else if constexpr (std::is_floating_point_v<T>) {
    *const_cast<double*>(held.as_double()) = static_cast<double>(value);
  } else {
    *const_cast<std::string*>(held.as_string()) = value;
  }
}

/// Written as the std::string that it reads as: "text", a view.
template <class T>
inline constexpr bool kIsText =
    std::is_convertible_v<const T&, std::string_view> && !std::is_same_v<T, std::string> && !Convertible<T>;
template <class T>
inline constexpr bool kOverwritable = std::is_arithmetic_v<T> || std::is_same_v<T, std::string>;
/// False: the value has no form that an entry of its type could hold.
template <class T>
[[nodiscard]] constexpr bool is_held(const T& value) {
  if constexpr (std::is_unsigned_v<T> && sizeof(T) >= sizeof(std::int64_t)) {
    return value <= static_cast<T>(std::numeric_limits<std::int64_t>::max());
  }
  return true;
}
template <class T>
inline constexpr Value::Type kHeldAs = std::is_same_v<T, bool>       ? Value::Type::kBool
                                       : std::is_integral_v<T>       ? Value::Type::kInt
                                       : std::is_floating_point_v<T> ? Value::Type::kDouble
                                                                     : Value::Type::kString;
}  // namespace detail

template <class T>
[[gnu::always_inline]] inline Result<T> Context::input(PortName port) const {
  if constexpr (Convertible<T> && !std::is_same_v<T, Value>) {
    if (const Datum* datum = peek(port)) {
      if (auto value = detail::exactly<T>(datum->value)) return std::move(*value);
    }
  }
  return converted<T>(port);
}

template <class T>
Result<T> Context::converted(const PortName& port) const {
  Datum scratch;
  const Datum* datum = read(port, type_of<T>(), scratch);
  if (datum == nullptr) return tl::unexpected(read_error(port, type_of<T>()));
  if constexpr (Convertible<T>) {
    if (auto value = Convert<T>::from_value(datum->value)) return std::move(*value);
  } else {
    if (const auto* boxed = dynamic_cast<const Boxed<T>*>(datum->object.get())) return boxed->content();
  }
  return tl::unexpected(read_error(port, type_of<T>()));
}

template <class T>
[[gnu::always_inline]] inline Result<void> Context::output(PortName port, const T& value) {
  if constexpr (detail::kIsText<T>) {
    return output(port, std::string(std::string_view(value)));
  } else {
    if constexpr (detail::kOverwritable<T>) {
      if (Value* held = detail::is_held(value) ? writable(port, type_of<T>(), detail::kHeldAs<T>) : nullptr) {
        detail::overwrite(*held, value);
        return {};
      }
    }
    return output_anew(port, value);
  }
}

template <class T>
Result<void> Context::output_anew(const PortName& port, const T& value) {
  if constexpr (Convertible<T>) {
    return write(port, Datum{Convert<T>::to_value(value), nullptr}, type_of<T>());
  } else {
    return write(port, Datum{Value(), std::make_shared<Boxed<T>>(value)}, type_of<T>());
  }
}

}  // namespace sentree::bt
