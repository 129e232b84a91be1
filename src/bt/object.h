#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>

#include "sentree/base/value.h"
#include "sentree/bt/types.h"

namespace sentree::bt {

/// A C++ object on the blackboard that has no `Value` form. Immutable, so copies of a state share it.
class Object {
 public:
  virtual ~Object() = default;
  [[nodiscard]] virtual const PortType& type() const = 0;
  [[nodiscard]] virtual bool equals(const Object& other) const = 0;
};

template <class T>
class Boxed final : public Object {
 public:
  explicit Boxed(T content) : content_(std::move(content)) {}
  [[nodiscard]] const PortType& type() const override { return type_of<T>(); }
  [[nodiscard]] bool equals(const Object& other) const override {
    if (this == &other) return true;
    if constexpr (std::equality_comparable<T>) {
      const auto* same = dynamic_cast<const Boxed*>(&other);
      return same != nullptr && same->content_ == content_;
    } else {
      return false;
    }
  }
  [[nodiscard]] const T& content() const { return content_; }

 private:
  T content_;
};

/// One step from a pointer type to another one; null where the object is not of that kind.
struct PolymorphicCast {
  const PortType* from;
  const PortType* to;
  std::shared_ptr<const Object> (*cast)(const Object& object);
};

/// What an entry holds: a value, or a C++ object.
struct Datum {
  Value value;
  std::shared_ptr<const Object> object;

  [[nodiscard]] bool empty() const { return value.is_null() && object == nullptr; }
  friend bool operator==(const Datum& a, const Datum& b) {
    if (!(a.value == b.value) || (a.object == nullptr) != (b.object == nullptr)) return false;
    return a.object == nullptr || a.object->equals(*b.object);
  }
};

/// What one C++ node remembers between ticks.
class NodeMemory {
 public:
  virtual ~NodeMemory() = default;
  [[nodiscard]] virtual std::unique_ptr<NodeMemory> clone() const = 0;
  [[nodiscard]] virtual bool equals(const NodeMemory& other) const = 0;
  /// Nothing if it has no saved form.
  [[nodiscard]] virtual std::optional<Value> save() const = 0;
  [[nodiscard]] virtual bool restore(const Value& saved) = 0;
};

/// A memory of type T. T can be saved if it has `Value save() const` and `bool restore(const Value&)`, if `Convert<T>`
/// exists, or if it is empty.
template <class T>
class TypedMemory final : public NodeMemory {
 public:
  explicit TypedMemory(T initial) : content(std::move(initial)) {}

  [[nodiscard]] std::unique_ptr<NodeMemory> clone() const override { return std::make_unique<TypedMemory>(content); }
  [[nodiscard]] bool equals(const NodeMemory& other) const override {
    const auto* same = dynamic_cast<const TypedMemory*>(&other);
    if (same == nullptr) return false;
    if constexpr (std::equality_comparable<T>) {
      return content == same->content;
    } else {
      const auto a = save();
      const auto b = same->save();
      return a && b ? *a == *b : this == &other;
    }
  }
  [[nodiscard]] std::optional<Value> save() const override {
    if constexpr (std::is_empty_v<T>) {
      return Value(true);
    } else if constexpr (requires {
                           { content.save() } -> std::convertible_to<Value>;
                         }) {
      return content.save();
    } else if constexpr (Convertible<T>) {
      return Convert<T>::to_value(content);
    } else {
      return std::nullopt;
    }
  }
  [[nodiscard]] bool restore(const Value& saved) override {
    if constexpr (std::is_empty_v<T>) {
      return true;
    } else if constexpr (requires {
                           { content.restore(saved) } -> std::convertible_to<bool>;
                         }) {
      return content.restore(saved);
    } else if constexpr (Convertible<T>) {
      auto restored = Convert<T>::from_value(saved);
      if (restored) content = std::move(*restored);
      return restored.has_value();
    } else {
      return false;
    }
  }

  T content;
};

/// Owner of a NodeMemory with the semantics of a value. Where copying it threw, the copy has none: the node's next tick
/// fails, and says so.
class ObjectSlot {
 public:
  ObjectSlot() = default;
  explicit ObjectSlot(std::unique_ptr<NodeMemory> memory) : memory_(std::move(memory)) {}
  ObjectSlot(const ObjectSlot& other) : memory_(other.cloned()) {}
  ObjectSlot(ObjectSlot&&) noexcept = default;
  ObjectSlot& operator=(const ObjectSlot& other) {
    if (this != &other) memory_ = other.cloned();
    return *this;
  }
  ObjectSlot& operator=(ObjectSlot&&) noexcept = default;
  ~ObjectSlot() = default;

  [[nodiscard]] NodeMemory* get() const { return memory_.get(); }
  friend bool operator==(const ObjectSlot& a, const ObjectSlot& b) {
    if (a.memory_ == nullptr || b.memory_ == nullptr) return a.memory_ == b.memory_;
    return a.memory_->equals(*b.memory_);
  }

 private:
  [[nodiscard]] std::unique_ptr<NodeMemory> cloned() const {
    if (memory_ == nullptr) return nullptr;
    try {
      return memory_->clone();
    } catch (...) {
      return nullptr;
    }
  }

  std::unique_ptr<NodeMemory> memory_;
};

}  // namespace sentree::bt
