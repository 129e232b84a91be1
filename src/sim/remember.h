#pragma once

namespace sentree::sim {

/// While it lives, what this thread computes is looked up in `memo`, and kept there.
template <typename Memo>
class Remember {
 public:
  explicit Remember(Memo& memo) : before_(present_) { present_ = &memo; }
  ~Remember() { present_ = before_; }
  Remember(const Remember&) = delete;
  Remember& operator=(const Remember&) = delete;

  /// Null: nothing is remembered.
  [[nodiscard]] static Memo* present() { return present_; }

 private:
  static inline thread_local Memo* present_ = nullptr;
  Memo* before_;
};

}  // namespace sentree::sim
