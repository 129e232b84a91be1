#pragma once

#include <memory>
#include <optional>
#include <utility>

namespace sentree::mission {

/// A value that never changes, shared by all copies of what holds it. Compared by content.
template <class T>
class Shared {
 public:
  Shared() = default;
  explicit Shared(T&& value) : value_(std::make_shared<const T>(std::move(value))) {}
  explicit Shared(const T& value) : value_(std::make_shared<const T>(value)) {}

  const T& operator*() const { return *value_; }
  const T* operator->() const { return value_.get(); }
  /// Nothing has been put in.
  [[nodiscard]] bool empty() const { return value_ == nullptr; }

  friend bool operator==(const Shared& a, const Shared& b) {
    return a.value_ == b.value_ || (a.value_ && b.value_ && *a.value_ == *b.value_);
  }

 private:
  std::shared_ptr<const T> value_;
};

/// For `archive`: what is in it.
template <class T>
[[nodiscard]] std::optional<T> archived(const Shared<T>& shared) {
  return shared.empty() ? std::nullopt : std::optional<T>(*shared);
}
template <class T>
void unarchive(std::optional<T>&& content, Shared<T>& shared) {
  shared = content ? Shared<T>(*std::move(content)) : Shared<T>();
}

}  // namespace sentree::mission
