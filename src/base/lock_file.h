#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace sentree {

/// A file that one at a time holds, with a line in it that says who. It stays when it is let go.
class LockFile {
 public:
  enum class State {
    kHeld,
    kTaken,    ///< By another, whom `other` names.
    kNoAccess  ///< The file cannot be opened or locked, as `why` says.
  };
  /// Holds nothing.
  LockFile() = default;
  /// Takes the file, or does not; it never waits. It is made, but not its folder.
  [[nodiscard]] static LockFile take(const std::filesystem::path& path);

  [[nodiscard]] State state() const { return state_; }
  /// What the holder has written there; "another program" if that is nothing.
  [[nodiscard]] const std::string& other() const { return other_; }
  /// An errno; 0 unless the state is kNoAccess.
  [[nodiscard]] int why() const { return why_; }
  /// Of who holds it: it is free when the last copy is gone, and those of processes that were forked.
  [[nodiscard]] const std::shared_ptr<const int>& descriptor() const { return descriptor_; }

 private:
  State state_ = State::kNoAccess;
  int why_ = 0;
  std::string other_;
  std::shared_ptr<const int> descriptor_;
};

/// Writes into a file that is held who does. A file of another user stays as it is.
void tell_holder(int descriptor, std::string_view line);

}  // namespace sentree
