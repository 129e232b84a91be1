#include "sentree/scxml/edit.h"

#include <fmt/format.h>

#include <algorithm>

#include "sentree/base/assert.h"
#include "sentree/scxml/loader.h"

namespace sentree::scxml {

namespace {

text::XmlDocument parse(const Chart& chart) {
  auto document = text::XmlDocument::parse(chart.source(), chart.file());
  SENTREE_ASSERT(document.has_value());  // it has been loaded from these bytes
  return *std::move(document);
}

// `names` with every `old_name` replaced, and everything between the names kept.
std::string replace_names(std::string_view names, std::string_view old_name, std::string_view new_name) {
  std::string result;
  std::size_t copied = 0;
  for_each_name(names, [&](std::string_view name) {
    if (name != old_name) return;
    const auto begin = static_cast<std::size_t>(name.data() - names.data());
    result.append(names, copied, begin - copied);
    result += new_name;
    copied = begin + name.size();
  });
  result.append(names, copied);
  return result;
}

void replace_all(std::string& text, const std::string& what, const std::string& with) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + with.size()))
    text.replace(at, what.size(), with);
}

}  // namespace

ChartEdit::ChartEdit(const Chart& chart) : chart_(chart), document_(parse(chart)), edit_(document_) {}

ChartEdit::Element ChartEdit::at(const Place& place) const {
  Element element = document_.root();
  while (element) {
    const auto here = document_.lines().position(element.offset());
    if (here.line == place.line && here.column == place.column) return element;
    // The last child that does not begin behind the place holds it, if any does.
    Element inner;
    for (Element child = element.first_child(); child; child = child.next_sibling()) {
      const auto begin = document_.lines().position(child.offset());
      if (std::pair(begin.line, begin.column) <= std::pair(place.line, place.column)) inner = child;
    }
    element = inner;
  }
  return {};
}

ChartEdit::Element ChartEdit::of_transition(TransitionIndex index) const {
  const Transition& transition = chart_.transitions()[index];
  const Element element = at(transition.place);
  return element ? element : of_state(transition.source);
}

void ChartEdit::set_attribute(const Element& element, std::string_view name, std::string_view value) {
  edit_.set_attribute(element, name, value);
}
void ChartEdit::remove_attribute(const Element& element, std::string_view name) {
  edit_.remove_attribute(element, name);
}
void ChartEdit::append_child(const Element& parent, std::string_view xml) { edit_.append_child(parent, xml); }
void ChartEdit::insert_before(const Element& sibling, std::string_view xml) { edit_.insert_before(sibling, xml); }
void ChartEdit::remove(const Element& element) { edit_.remove(element); }

Result<void> ChartEdit::rename_state(StateIndex state, std::string_view new_id) {
  const std::string& old_id = chart_.states()[state].id;
  if (old_id.empty() || new_id.empty() || new_id.find_first_of(" \t\r\n'\"") != std::string_view::npos) {
    return fail("scxml.bad-attribute",
                fmt::format("state \"{}\" cannot be renamed to \"{}\": an id is a name without spaces and quotes",
                            old_id, new_id));
  }
  if (new_id == old_id) return {};
  if (const auto other = chart_.find(new_id)) {
    return fail("scxml.duplicate-id", fmt::format("there is a state \"{}\" already", new_id),
                chart_.span(chart_.states()[*other].place));
  }
  edit_.set_attribute(of_state(state), "id", new_id);
  rename_in(document_.root(), old_id, new_id);
  return {};
}

void ChartEdit::rename_in(const Element& element, std::string_view old_id, std::string_view new_id) {
  const std::string_view kind = element.local_name();
  const std::string old_name(old_id);
  const std::string new_name(new_id);
  element.for_each_attribute([&](std::string_view name, std::string_view value) {
    std::string changed(value);
    if ((kind == "transition" && name == "target") || name == "initial") {
      changed = replace_names(value, old_id, new_id);
    } else if (kind == "transition" && name == "event") {
      changed = replace_names(value, "done.state." + old_name, "done.state." + new_name);
    } else if (name == "cond" || name == "expr") {
      for (const char quote : {'\'', '"'})
        replace_all(changed, fmt::format("In({}{}{})", quote, old_name, quote),
                    fmt::format("In({}{}{})", quote, new_name, quote));
    }
    if (changed != value) edit_.set_attribute(element, name, changed);
  });
  for (Element child = element.first_child(); child; child = child.next_sibling()) {
    // A chart inside <content> has states of its own.
    if (child.local_name() != "scxml") rename_in(child, old_id, new_id);
  }
}

Result<std::string> ChartEdit::apply() const {
  auto edited = edit_.apply();
  if (!edited) return edited;
  // What src attributes name was readable when the chart was loaded.
  LoadOptions options;
  options.read = [](std::string_view) -> Result<std::string> { return std::string(); };
  const auto loaded = load(*edited, chart_.file(), options);
  if (loaded.ok()) return edited;
  for (const Diagnostic& diagnostic : loaded.diagnostics) {
    if (diagnostic.severity == Severity::kError) return tl::unexpected(diagnostic);
  }
  return edited;
}

}  // namespace sentree::scxml
