#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "sentree/base/diagnostic.h"
#include "sentree/base/result.h"
#include "sentree/scxml/chart.h"

namespace sentree::cli {

/// Whether a document is a state chart, by its root element, whatever the file is called. One that is not well-formed
/// is judged by its first tag.
[[nodiscard]] bool is_chart_source(std::string_view source);

/// Whether the text begins like XML does.
[[nodiscard]] bool is_xml_source(std::string_view source);

/// What reads the files that a chart names, from beside it.
[[nodiscard]] std::function<Result<std::string>(std::string_view uri)> reader_beside(
    const std::filesystem::path& chart);

/// A chart to look at (check, draw), with what it names beside it.
[[nodiscard]] Loaded<scxml::Chart> look_at_chart(std::string_view source, const std::string& file);

/// Diagnostics for people, one a line: findings that say the same are one, with their number and lines. Of more than
/// `kFindingsShownMax`, errors come first, and the rest is counted.
[[nodiscard]] std::string told(const Diagnostics& diagnostics);
inline constexpr std::size_t kFindingsShownMax = 200;

/// One line for all warnings, which names `sentree check` of the project, or of the file where all of them are in one;
/// empty without warnings.
[[nodiscard]] std::string warnings_in_short(const Diagnostics& diagnostics, const std::string& project = {});

}  // namespace sentree::cli
