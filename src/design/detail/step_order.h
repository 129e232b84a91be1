#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/design/text_edit.h"
#include "sentree/design/workspace.h"

namespace sentree::design {

/// Never 0.
[[nodiscard]] std::int64_t hash_of(const std::string& text);

/// Two edits of one text, one after the other, that are made in the other order.
struct Swapped {
  TextEdits second;  ///< Of the text that `first` was of.
  TextEdits first;   ///< Of what that makes.
};
/// With the same outcome. `text`: between them. Nothing: both change the same line.
[[nodiscard]] std::optional<Swapped> swapped(const TextEdits& first, std::string_view text, const TextEdits& second);

/// FileTexts by file.
using FileTexts = std::map<std::string, std::string>;
/// What a step, or with `back` its undoing, makes of texts. False: it is of other texts, or files come or go with it;
/// some of `texts` may be changed.
[[nodiscard]] bool step_over(const Step& step, bool back, FileTexts& texts);

/// What undoes it.
[[nodiscard]] Step undoing(const Step& step);

/// Carries step `from` of a row of steps to place `to`, past the others, with the same outcome. `texts`: those of its
/// files before it. Where it stands then: it stops at one that changes the same line, or a file that comes or goes.
std::size_t carry(std::vector<Step>& row, std::size_t from, std::size_t to, FileTexts texts);

}  // namespace sentree::design
