#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/base/value.h"
#include "sentree/design/chart_edit.h"
#include "sentree/design/comparison.h"
#include "sentree/design/findings.h"
#include "sentree/design/requirement_edit.h"
#include "sentree/design/tree_edit.h"
#include "sentree/design/workspace.h"
#include "sentree/design/yaml_gesture.h"
#include "sentree/scxml/chart.h"

// What is edited, as data for pages: docs/studio-protocol.md.

namespace sentree::studio {

/// "project", "mission", "skill", "monitor", "requirement", "scenario", "world", "interface", "model" or "other".
[[nodiscard]] std::string_view kind_of_file(const std::string& file, std::string_view text);

/// A file's text and, of a file of trees or of a chart, its picture with the places of its parts; of requirements,
/// their parts.
[[nodiscard]] Value document_value(const std::string& file, const design::Document& document,
                                   const design::Kinds& kinds);

/// Why a text cannot be read as what its name says that it is; nothing: it can, or that is not known.
[[nodiscard]] std::optional<Diagnostic> unreadable(const std::string& file, std::string_view text,
                                                   const design::Kinds& kinds);

/// A chart's picture, with the lines of its parts.
[[nodiscard]] Value chart_value(const scxml::Chart& chart);

/// The picture of a chart in which the states of these ids hide what is in them. Errors: studio.request (no chart).
[[nodiscard]] Result<Value> folded_value(const std::string& file, const design::Document& document,
                                         const std::set<std::string>& closed);

/// Two texts of one file as one picture; where they cannot be drawn so, only the texts, and why. Null: the file is not
/// there; all of the other is then added, or removed. At least one is there.
[[nodiscard]] Value comparison_value(const std::string* before, const std::string* after, const design::Kinds& kinds,
                                     const std::string& file);

[[nodiscard]] Value finding_value(const design::Finding& finding);

/// Nodes that can be put into trees; `own` are the project's.
[[nodiscard]] Value palette_value(const design::Kinds& kinds, const std::vector<bt::NodeModel>& own);

/// Services that `interface:` can name: those of the project's files in interfaces/, and those of the simulator.
[[nodiscard]] List interfaces_value(const std::filesystem::path& folder,
                                    const std::map<std::string, std::string>& texts);

/// What a page wants done to a tree, a chart, requirements or a YAML file, as edits of its text. Errors:
/// studio.request, and those of the `edit_*` of that kind of file.
[[nodiscard]] Result<design::GestureResult> edited_by(const Value& gesture, const std::string& file,
                                                      std::string_view text, const design::Kinds& kinds);

}  // namespace sentree::studio
