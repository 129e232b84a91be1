#pragma once

#include <map>
#include <string>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/base/value.h"
#include "sentree/scxml/chart.h"

namespace sentree::project {

/// What a choice of a model can be, as far as its chart tells.
struct Alternatives {
  std::vector<Value> values;
  bool numbers = false;  ///< Or numbers, which are not listed.
  bool open = false;     ///< Or others, which are computed.
};

/// What is known of the choices that a chart makes.
struct KnownChoices {
  std::map<std::string, Alternatives> by_name;  ///< By pick('NAME', …).
  bool open = false;                            ///< Or others, whose names are computed.
  Alternatives all;                             ///< Of all together, those without a name too.

  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const auto& [name, alternatives] : by_name) names.push_back(name);
    return names;
  }
};

/// Those of the charts that it invokes too. Cost: O(length of its scripts).
[[nodiscard]] KnownChoices choices_of(const scxml::Chart& chart);

/// That `fair:` names none of the choices there are, which are told: verify.fair.
[[nodiscard]] Diagnostic no_such_fair(const std::string& fair, const std::vector<std::string>& choices,
                                      const SourceSpan& span);

}  // namespace sentree::project
