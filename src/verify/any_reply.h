#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sentree/project/plan.h"

namespace sentree::verify {

/// Values of one member of a reply that are tried; more are too many to try in every state.
inline constexpr std::size_t kReplyValuesMax = 40;
/// Structs in all replies of a service, each counted as often as it comes.
inline constexpr std::size_t kReplyRecordsMax = 10'000;

/// A value that is ordered against earlier ones, so that each may be greater than the one before, without end: a row of
/// them is only as long as the values that are tried.
struct Untried {
  std::string value;    ///< "battery.getBatteryState.percentage"
  Diagnostic told;      ///< verify.not-all, with the comparison's place and a way out.
  std::string monitor;  ///< Whose verdict alone depends on it; empty: what the mission does.
};

/// A model of one service that answers every call with any reply of its type.
struct AnyReply {
  std::string chart;               ///< An SCXML document.
  std::vector<std::string> tried;  ///< What is varied, a line each: "getBatteryState.percentage: 0, 0.1, 0.2, 0.3".
  std::vector<Untried> untried;
  /// Why that is not all that the mission tells apart: verify.any-reply, at a use that is no comparison with constants,
  /// or at a service that publishes what somebody waits for.
  std::optional<Diagnostic> unsure;
};

/// Writes a model of a service that nobody models, from its interface and from what the mission makes of its replies.
///
/// Varied are the members of results that some skill that calls the service, or some monitor, names: truth values both
/// ways; enumerators that some chart or the tree writes down, and one other. Numbers are tried at each constant that
/// they are compared with (after + - * / by constants, also through variables of the chart, constants and literal
/// ports), between each two, and beyond the outermost, within the interface's bounds: there at one, or, where they are
/// compared with earlier replies, at as many as are compared at once; where they are ordered against them, at all that
/// the interface allows, if it allows no more than kReplyValuesMax; a double without bounds is NaN too. Texts are tried
/// at each that they are compared with, and one other, or so many. Of a union it is each member that something names,
/// or one other; optional members of which something is made are there or not. Everything else has one value: what
/// nothing looks at changes nothing. A method that throws may do so.
///
/// Error: verify.any-reply, if a value is compared with too many constants, or replies hold too many structs.
[[nodiscard]] Result<AnyReply> any_reply(const project::Plan& plan, const std::string& service);

struct MadeModel {
  std::string service;
  std::string file;  ///< Relative to the project's folder.
  std::vector<std::string> tried;
  std::vector<Untried> untried;      ///< As of its AnyReply.
  std::optional<Diagnostic> unsure;  ///< Likewise.
};

/// Of all of them.
[[nodiscard]] std::vector<Untried> untried(const std::vector<MadeModel>& made);

/// Writes a model for each service of the scenario that has none, FOLDER/SERVICE.scxml, and makes the scenario use it;
/// written down, it does so too.
/// @param plan  Of the scenario as it is.
/// @param keeps  They are to be edited: one that is unsure is no error, but a file that is there and says something
/// else. Errors: those of `any_reply`; verify.any-reply; those of writing.
[[nodiscard]] Result<std::vector<MadeModel>> add_models(project::Scenario& scenario, const project::Plan& plan,
                                                        const std::filesystem::path& folder, bool keeps = false);

}  // namespace sentree::verify
