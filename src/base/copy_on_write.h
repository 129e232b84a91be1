#pragma once

#include <atomic>
#include <cstdint>
#include <utility>

namespace sentree {

/// A value that its copies share until one of them changes it, so that copying a state costs no memory. A new one is
/// `T()` and takes none.
///
/// Copies may live in different threads, as copies of any value may.
/// Cost: a copy is one atomic increment; the first change after it copies the `T`.
template <class T>
class CopyOnWrite {
 public:
  CopyOnWrite() = default;
  explicit CopyOnWrite(T value) : block_(new Block{.value = std::move(value)}) {}
  CopyOnWrite(const CopyOnWrite& other) noexcept : block_(other.block_) {
    if (block_ != nullptr) block_->owners.fetch_add(1, std::memory_order_relaxed);
  }
  CopyOnWrite(CopyOnWrite&& other) noexcept : block_(std::exchange(other.block_, nullptr)) {}
  CopyOnWrite& operator=(CopyOnWrite other) noexcept {
    swap(other);
    return *this;
  }
  ~CopyOnWrite() {
    if (block_ != nullptr && block_->owners.fetch_sub(1, std::memory_order_acq_rel) == 1) delete block_;
  }

  [[nodiscard]] const T& operator*() const { return block_ != nullptr ? block_->value : none(); }
  [[nodiscard]] const T* operator->() const { return &**this; }

  /// To be changed. Ends references that copies of this object have given out of what they shared.
  [[nodiscard]] T& edit() {
    if (block_ == nullptr) {
      block_ = new Block;
    } else if (block_->owners.load(std::memory_order_acquire) != 1) {
      CopyOnWrite(block_->value).swap(*this);
    }
    return block_->value;
  }
  /// To be given another value, of which the present one may be used as room: it is not copied if others have it.
  [[nodiscard]] T& overwrite() {
    if (block_ == nullptr || block_->owners.load(std::memory_order_acquire) != 1) CopyOnWrite(T()).swap(*this);
    return block_->value;
  }
  /// Makes it `T()`.
  void reset() { CopyOnWrite().swap(*this); }

  friend bool operator==(const CopyOnWrite& a, const CopyOnWrite& b) { return a.block_ == b.block_ || *a == *b; }

 private:
  struct Block {
    std::atomic<std::uint32_t> owners{1};
    T value{};
  };
  static const T& none() {
    static const T kNone{};
    return kNone;
  }
  void swap(CopyOnWrite& other) noexcept { std::swap(block_, other.block_); }

  Block* block_ = nullptr;
};

}  // namespace sentree
