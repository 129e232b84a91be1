#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "sentree/base/result.h"
#include "sentree/base/value.h"
#include "sentree/campaign/coverage.h"
#include "sentree/text/file.h"

namespace sentree::studio {

/// The file beside counterexamples in which `sentree verify` says what it has reached, for pages.
inline constexpr std::string_view kVerifiedFile = "reached.json";

/// What a verification has reached, of a project as it was then.
struct Verified {
  campaign::Coverage coverage;
  bool with_requirements = true;  ///< All were judged.
  bool complete = false;
  std::uint32_t complete_to_tick = 0;
  std::uint64_t states = 0;
};

/// The text of that file.
/// @param project  The project's folder; what was read outside of it is not in the text.
/// @param folder   The file's own.
[[nodiscard]] std::string verified_text(const Verified& verified, const std::filesystem::path& project,
                                        const std::filesystem::path& folder, std::span<const text::ReadFile> read);

/// What such a file says, as `coverage_value`, with `verification`: {complete, tick, states, changed}, where `changed`
/// names the files of the project that are others now. Null: there is no such file.
/// @param text_of  The text of a file of the project, if it is not what the disk has; may be empty.
/// Errors: those of `text::read_file` and `text::parse_json`; studio.verified (it says something else).
[[nodiscard]] Result<Value> read_verified(
    const std::filesystem::path& file,
    const std::function<std::optional<std::string>(const std::string& name)>& text_of = {});

}  // namespace sentree::studio
