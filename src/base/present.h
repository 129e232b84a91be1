#pragma once

namespace sentree {

/// While it lives, one `T` is at hand to all that its thread does (`present`), and then the one before again. For what
/// looks on or remembers, and is of no consequence to what is computed.
template <typename T>
class Present {
 public:
  /// @param one  Borrowed. Null: none is.
  explicit Present(T* one) : before_(at_hand) { at_hand = one; }
  explicit Present(T& one) : Present(&one) {}
  ~Present() { at_hand = before_; }
  Present(const Present&) = delete;
  Present& operator=(const Present&) = delete;

  /// Of the calling thread; null: none.
  [[nodiscard]] static T* present() { return at_hand; }

 private:
  static inline thread_local T* at_hand = nullptr;
  T* before_;
};

}  // namespace sentree
