#pragma once

namespace sentree {

/// Prints the failed condition and its place to stderr and aborts. For bugs of ours only.
[[noreturn]] void assertion_failed(const char* condition, const char* file, int line);

}  // namespace sentree

/// A condition that only a bug of ours can break; checked in every build. The file's name alone is said: the same
/// sources give the same program in whatever folder they are built.
#define SENTREE_ASSERT(condition) \
  ((condition) ? static_cast<void>(0) : ::sentree::assertion_failed(#condition, __FILE_NAME__, __LINE__))
