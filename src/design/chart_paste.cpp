#include "sentree/design/detail/chart_paste.h"

#include <fmt/format.h>

#include <map>
#include <set>
#include <utility>

#include "sentree/design/detail/element_edits.h"
#include "sentree/scxml/edit.h"
#include "sentree/text/xml.h"

namespace sentree::design {

namespace {

using text::XmlElement;

bool is_state(const XmlElement& element) {
  const std::string_view name = element.local_name();
  return name == "state" || name == "parallel" || name == "final" || name == "history";
}
// What is inside of it, but for that of which `visit` says no, and of charts in it, which have states of their own.
template <class Visit>
void for_each_own(const XmlElement& element, const Visit& visit) {
  for (XmlElement child = element.first_child(); child; child = child.next_sibling()) {
    if (visit(child) && child.local_name() != "scxml") for_each_own(child, visit);
  }
}

}  // namespace

Result<std::vector<XmlElement>> states_pasted(XmlElement root) {
  if (root.first_child().local_name() == "scxml") root = root.first_child();
  auto states = root.children();
  const bool is_chart = root.local_name() == "scxml";
  if (is_chart) std::erase_if(states, [](const XmlElement& element) { return !is_state(element); });
  for (const XmlElement& state : states) {
    if (!is_state(state)) return fail("design.no-nodes", fmt::format("<{}> is no state of a chart", state.name()));
  }
  if (states.empty()) return fail("design.no-nodes", "there is no state in what was copied");
  return states;
}

Result<PastedStates> pasted_states(const std::string& xml, const scxml::Chart& chart, std::string_view datamodel) {
  const auto given = pasted(xml, "states", text::xml_attribute("datamodel", datamodel));
  if (!given) return tl::unexpected(given.error());
  const auto states = states_pasted(given->root());
  if (!states) return tl::unexpected(states.error());
  std::set<std::string, std::less<>> own;
  const auto for_each_pasted = [](const std::vector<XmlElement>& all, const auto& visit) {
    for (const XmlElement& state : all) {
      if (visit(state)) for_each_own(state, visit);
    }
  };
  for_each_pasted(*states, [&](const XmlElement& element) {
    if (is_state(element)) own.emplace(element.attribute("id").value_or(""));
    return true;
  });
  std::size_t left_out = 0;
  text::XmlEdit kept(*given);
  ElementEdits out(*given);
  for_each_pasted(*states, [&](const XmlElement& element) {
    const bool is_transition = element.local_name() == "transition" && element.attribute("target");
    std::string targets;
    bool all = true;
    scxml::for_each_name(element.attribute("target").value_or(""), [&](std::string_view target) {
      if (own.contains(target) || chart.find(target))
        targets += (targets.empty() ? "" : " ") + std::string(target);
      else
        all = false;
    });
    if (element.local_name() == "editorinfo" || (is_transition && !all && targets.empty())) {
      out.take_out(element);
      left_out += is_transition ? 1 : 0;
      return false;
    }
    if (is_transition && !all) kept.set_attribute(element, "target", targets);
    kept.remove_attribute(element, "qt:editorinfo");
    return true;
  });
  for (TextEdit& edit : out.take()) kept.replace_text(edit.from, edit.to, std::move(edit.text));
  const auto text = kept.apply();
  if (!text) return tl::unexpected(text.error());
  const auto document = text::XmlDocument::parse(*text, {}, {.lenient = true});
  if (!document) return tl::unexpected(document.error());

  std::map<std::string, std::string, std::less<>> names;
  std::set<std::string, std::less<>> taken = own;
  for (const std::string& id : own) {
    if (!chart.find(id)) continue;
    int number = 2;
    const auto name = [&] { return fmt::format("{}_{}", unnumbered(id), number); };
    while (chart.find(name()) || taken.contains(name())) ++number;
    taken.insert(name());
    names.emplace(id, name());
  }
  text::XmlEdit renamed(*document);
  const auto left = states_pasted(document->root());
  for_each_pasted(*left, [&](const XmlElement& element) {
    const auto found = is_state(element) ? names.find(element.attribute("id").value_or("")) : names.end();
    if (found != names.end()) renamed.set_attribute(element, "id", found->second);
    return true;
  });
  for (const XmlElement& state : *left) scxml::rename_states(*document, state, names, renamed);
  const auto written = renamed.apply();
  if (!written) return tl::unexpected(written.error());
  auto whole = text::XmlDocument::parse(*written, {}, {.lenient = true});
  if (!whole) return tl::unexpected(whole.error());
  return PastedStates{std::move(*whole), left_out};
}

}  // namespace sentree::design
