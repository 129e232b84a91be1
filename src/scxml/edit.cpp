#include "sentree/scxml/edit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <system_error>

#include "sentree/base/assert.h"
#include "sentree/scxml/loader.h"
#include "sentree/scxml/script_syntax.h"

namespace sentree::scxml {

namespace {

text::XmlDocument parse(const Chart& chart) {
  auto document = text::XmlDocument::parse(chart.source(), chart.file());
  SENTREE_ASSERT(document.has_value());  // it has been loaded from these bytes
  return *std::move(document);
}

using NewNames = std::map<std::string, std::string, std::less<>>;

// `text` with what is new of its names in their place, and everything between the names kept. `prefix`: of the names
// that are meant; of events one may end with ".*".
std::string replace_names(std::string_view text, std::string_view prefix, const NewNames& names) {
  std::string result;
  std::size_t copied = 0;
  for_each_name(text, [&](std::string_view name) {
    if (!name.starts_with(prefix)) return;
    const std::string_view whole = name.substr(prefix.size());
    const bool any = !prefix.empty() && whole.ends_with(".*");
    const auto found = names.find(any ? whole.substr(0, whole.size() - 2) : whole);
    if (found == names.end()) return;
    const auto begin = static_cast<std::size_t>(whole.data() - text.data());
    result.append(text, copied, begin - copied);
    result += found->second;
    copied = begin + found->first.size();
  });
  result.append(text, copied);
  return result;
}

// Code as it is meant, and where each of its bytes is written.
struct WrittenCode {
  std::string text;
  std::vector<std::size_t> places;  // and the end

  void add(std::string_view bytes, std::size_t place) {
    text += bytes;
    places.insert(places.end(), bytes.size(), place);
  }
};

std::string utf8(std::uint32_t code) {
  const auto tail = [&](unsigned shift) { return static_cast<char>(0x80U | (code >> shift & 0x3FU)); };
  if (code < 0x80) return {static_cast<char>(code)};
  if (code < 0x800) return {static_cast<char>(0xC0U | code >> 6U), tail(0)};
  if (code < 0x10000) return {static_cast<char>(0xE0U | code >> 12U), tail(6), tail(0)};
  return {static_cast<char>(0xF0U | code >> 18U), tail(12), tail(6), tail(0)};
}

// What a reference without its '&' and ';' stands for; empty: it is none.
std::string referred(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, const char*>, 5> kPredefined{
      {{"lt", "<"}, {"gt", ">"}, {"amp", "&"}, {"quot", "\""}, {"apos", "'"}}};
  for (const auto& [entity, meaning] : kPredefined) {
    if (entity == name) return meaning;
  }
  if (!name.starts_with('#')) return {};
  const bool hex = name.starts_with("#x");
  std::uint32_t code = 0;
  const char* const end = name.data() + name.size();
  const auto read = std::from_chars(name.data() + (hex ? 2 : 1), end, code, hex ? 16 : 10);
  return read.ec == std::errc() && read.ptr == end && code != 0 && code <= 0x10FFFF ? utf8(code) : std::string();
}

// Of an attribute's value, or of what is between two tags that have no element between them.
WrittenCode written_code(std::string_view source, std::size_t from, std::size_t to, bool is_value) {
  WrittenCode code;
  const std::string_view all = source.substr(0, to);
  const auto skip_to = [&](std::string_view end, std::size_t at) {
    const std::size_t found = all.find(end, at);
    return found == std::string_view::npos ? to : found + end.size();
  };
  constexpr std::string_view kCdata = "<![CDATA[";
  for (std::size_t at = from; at < to;) {
    const std::string_view rest = all.substr(at);
    if (rest.starts_with(kCdata)) {
      const std::size_t behind = skip_to("]]>", at);
      for (at += kCdata.size(); at + 3 <= behind && at < to && !all.substr(at).starts_with("]]>"); ++at)
        code.add(all.substr(at, 1), at);
      at = behind;
    } else if (rest.starts_with("<!--")) {
      at = skip_to("-->", at);
    } else if (rest.starts_with("<?")) {
      at = skip_to("?>", at);
    } else if (rest.front() == '&') {
      constexpr std::size_t kReferenceMax = 64;
      const std::size_t end = rest.substr(0, kReferenceMax).find(';');
      const std::string meant = end == std::string_view::npos ? std::string() : referred(rest.substr(1, end - 1));
      code.add(meant.empty() ? "&" : std::string_view(meant), at);
      at += meant.empty() ? 1 : end + 1;
    } else {
      const bool is_break = rest.front() == '\n' || rest.front() == '\r';
      code.add(is_value && is_break ? " " : rest.substr(0, 1), at);
      ++at;
    }
  }
  code.places.push_back(to);
  return code;
}

// The expressions of an element, and the script that it holds.
std::vector<WrittenCode> codes_of(const text::XmlDocument& document, const text::XmlElement& element) {
  const std::string_view source = document.source();
  std::vector<WrittenCode> codes;
  for (const text::XmlAttributePlace& place : element.attribute_places()) {
    const std::string_view name = source.substr(place.name_begin, place.name_end - place.name_begin);
    const bool is_code = name == "cond" || name == "location" || name == "array" || name.ends_with("expr");
    if (is_code && name.find(':') == std::string_view::npos)
      codes.push_back(written_code(source, place.value_begin, place.value_end, true));
  }
  const std::string_view kind = element.local_name();
  if ((kind == "script" || kind == "data" || kind == "assign") && !element.first_child()) {
    const std::string_view inside = element.inner_source();
    const auto from = static_cast<std::size_t>(inside.data() - source.data());
    if (!inside.empty()) codes.push_back(written_code(source, from, from + inside.size(), false));
  }
  return codes;
}

bool asks_without_quotes(const text::XmlDocument& document) {
  return document.root().attribute("datamodel").value_or("null") == "null";
}

}  // namespace

std::vector<StateInScript> states_in_scripts(const text::XmlDocument& document, const text::XmlElement& element) {
  std::vector<StateInScript> found;
  for (const WrittenCode& code : codes_of(document, element)) {
    for (const std::string_view id : states_asked_for(code.text, asks_without_quotes(document))) {
      const auto at = static_cast<std::size_t>(id.data() - code.text.data());
      // What follows is a quote, a blank or a parenthesis: where the last byte ends.
      found.push_back({std::string(id), code.places[at], code.places[at + id.size()]});
    }
  }
  return found;
}

std::vector<TextInScript> texts_in_scripts(const text::XmlDocument& document, const text::XmlElement& element) {
  std::vector<TextInScript> found;
  for (const WrittenCode& code : codes_of(document, element)) {
    for (const ScriptMention& one : texts_in_script(code.text, asks_without_quotes(document))) {
      const auto at = static_cast<std::size_t>(one.text.data() - code.text.data());
      found.push_back(
          {std::string(one.text), one.is_computed_state, code.places[at], code.places[at + one.text.size()]});
    }
  }
  return found;
}

void rename_states(const text::XmlDocument& document, const text::XmlElement& element, const NewNames& names,
                   text::XmlEdit& edit) {
  const std::string_view kind = element.local_name();
  for (const StateInScript& state : states_in_scripts(document, element)) {
    if (const auto found = names.find(state.id); found != names.end())
      edit.replace_text(state.from, state.to, found->second);
  }
  element.for_each_attribute([&](std::string_view name, std::string_view value) {
    std::string changed(value);
    if ((kind == "transition" && name == "target") || name == "initial" || name == "initialstate")
      changed = replace_names(value, "", names);
    else if (kind == "transition" && name == "event")
      changed = replace_names(value, "done.state.", names);
    if (changed != value) edit.set_attribute(element, name, changed);
  });
  for (text::XmlElement child = element.first_child(); child; child = child.next_sibling()) {
    // A chart inside <content> has states of its own.
    if (child.local_name() != "scxml") rename_states(document, child, names, edit);
  }
}

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
  if (old_id.empty() || new_id.empty() || new_id.find_first_of(" \t\r\n'\"&<>\\") != std::string_view::npos) {
    return fail(
        "scxml.bad-attribute",
        fmt::format("state \"{}\" cannot be renamed to \"{}\": an id is a name without spaces, quotes, &, <, > and \\",
                    old_id, new_id));
  }
  if (new_id == old_id) return {};
  if (const auto other = chart_.find(new_id)) {
    return fail("scxml.duplicate-id", fmt::format("there is a state \"{}\" already", new_id),
                chart_.span(chart_.states()[*other].place));
  }
  edit_.set_attribute(of_state(state), "id", new_id);
  rename_states(document_, document_.root(), {{old_id, std::string(new_id)}}, edit_);
  return {};
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
