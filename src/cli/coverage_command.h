#pragma once

#include <string>

#include "sentree/cli/commands.h"

namespace sentree::cli {

/// `sentree test` that also says what of the projects its scenarios have reached.
/// @param min  Less of it is a failure: "90 %"; empty: nothing is.
int test_coverage(const TestCommand& command, const std::string& min);

}  // namespace sentree::cli
