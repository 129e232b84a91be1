#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/base/value.h"
#include "sentree/cli/commands.h"
#include "sentree/project/plan.h"
#include "sentree/verify/any_reply.h"

namespace sentree::cli {

/// What `sentree verify --json` gives, as docs/verification.md lists it, in a verification and in statistics: every
/// member is there, and null (or an empty list) until somebody has something to say of it.
/// @param any     Models that were made for the services without one.
/// @param faults  That are tried.
[[nodiscard]] Map verify_result(const VerifyCommand& command, const project::Plan& plan,
                                const std::vector<verify::MadeModel>& any,
                                const std::vector<project::Intervention>& faults);

/// An entry of its `requirements`, likewise.
[[nodiscard]] Map requirement_result(const std::string& name, std::string_view verdict);

/// The entry's `probability`, likewise.
[[nodiscard]] Map probability_result(double low, double high, std::string_view method, double confidence);

/// Says what is in the way of a verification; with --json its errors are the result's one member. Returns the exit
/// code.
[[nodiscard]] int refuse(const VerifyCommand& command, const Diagnostics& what);

/// A list of texts.
[[nodiscard]] List to_list(const std::vector<std::string>& texts);

}  // namespace sentree::cli
