#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace sentree::text {

/// Texts that stand for files, by absolute, lexically normal path: what somebody edits and has not saved.
using Overlay = std::map<std::filesystem::path, std::string>;

/// While it lives, `read_file` in this thread reads what `overlay` (borrowed) has instead of those files. One at a time
/// per thread.
class ReadThrough {
 public:
  explicit ReadThrough(const Overlay& overlay);
  ~ReadThrough();
  ReadThrough(const ReadThrough&) = delete;
  ReadThrough& operator=(const ReadThrough&) = delete;
};

}  // namespace sentree::text
