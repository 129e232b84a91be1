#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/scxml/chart.h"
#include "sentree/text/xml.h"

namespace sentree::design {

/// The states in what was copied: an element around them, or a whole chart. Error: design.no-nodes.
[[nodiscard]] Result<std::vector<text::XmlElement>> states_pasted(text::XmlElement root);

/// States as they are to be written into a chart.
struct PastedStates {
  text::XmlDocument document;
  std::size_t left_out = 0;  ///< Transitions to states that neither of them has.
};

/// What was copied, for `chart`: ids that it has already get a number, and who names them among what was copied
/// follows; transitions to what is in neither are left out, and so is what editors keep. Cost: O(size of both), but for
/// ids that are taken, which are counted up. Errors: design.no-nodes, xml.*.
/// @param xml        Well-formed, with a root element.
/// @param datamodel  Of the chart.
[[nodiscard]] Result<PastedStates> pasted_states(const std::string& xml, const scxml::Chart& chart,
                                                 std::string_view datamodel);

}  // namespace sentree::design
