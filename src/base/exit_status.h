#pragma once

#include <string>

namespace sentree {

/// How a process ended, of what `waitpid` says: "exit code 3", "signal 9 (Killed)".
[[nodiscard]] std::string describe_exit(int status);

}  // namespace sentree
