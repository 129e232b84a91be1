#pragma once

namespace sentree {

/// Prints the failed condition and its place to stderr and aborts. For bugs of ours only.
[[noreturn]] void assertion_failed(const char* condition, const char* file, int line);

}  // namespace sentree

/// A condition that only a bug of ours can break; checked in every build.
#define SENTREE_ASSERT(condition) \
  ((condition) ? static_cast<void>(0) : ::sentree::assertion_failed(#condition, __FILE__, __LINE__))
