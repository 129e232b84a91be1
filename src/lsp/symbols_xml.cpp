// Names in trees and charts.

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "sentree/lsp/detail/collector.h"
#include "sentree/lsp/symbols.h"
#include "sentree/scxml/edit.h"

namespace sentree::lsp {

namespace {

using text::XmlElement;

// Calls `visit(from, to)` for each word between white space.
template <class Visit>
void each_word(std::string_view text, std::size_t from, std::size_t to, Visit&& visit) {
  while (from < to) {
    while (from < to && is_space(text[from])) ++from;
    const std::size_t begin = from;
    while (from < to && !is_space(text[from])) ++from;
    if (from > begin) visit(begin, from);
  }
}

const text::XmlAttributePlace* attribute_place(const XmlElement& element, std::string_view name,
                                               const std::string& source) {
  for (const text::XmlAttributePlace& place : element.attribute_places()) {
    if (std::string_view(source).substr(place.name_begin, place.name_end - place.name_begin) == name) return &place;
  }
  return nullptr;
}

// ---- Trees ----

constexpr std::array<std::string_view, 5> kByAttribute{"Action", "Condition", "Control", "Decorator", "SubTree"};

class TreeCollector : public Collector {
 public:
  TreeCollector(const text::XmlDocument& document, const Names& names)
      : Collector(document.source(), names), source_(document.source()) {
    for (XmlElement child = document.root().first_child(); child; child = child.next_sibling()) {
      if (child.local_name() == "BehaviorTree") {
        attribute(child, "ID", SymbolKind::kTree, true);
        for (XmlElement node = child.first_child(); node; node = node.next_sibling())
          text::for_each_element(node, [&](const XmlElement& element) { of_node(element); });
      } else if (child.local_name() == "TreeNodesModel") {
        for (XmlElement model = child.first_child(); model; model = model.next_sibling()) {
          attribute(model, "ID", model.local_name() == "SubTree" ? SymbolKind::kTree : SymbolKind::kSkill, false);
          text::for_each_element(model, [&](const XmlElement& part) {
            if (const auto* const value = attribute_place(part, "default", source_))
              place(value->value_begin, value->value_end);
          });
        }
      }
    }
    attribute(document.root(), "main_tree_to_execute", SymbolKind::kTree, false);
  }

 private:
  void attribute(const XmlElement& element, std::string_view name, SymbolKind kind, bool defines) {
    const auto* const place = attribute_place(element, name, source_);
    if (place == nullptr) return;
    const std::string value(element.attribute(name).value_or(""));
    if (kind == SymbolKind::kSkill && names_.builtins.contains(value)) return;
    add_meant(kind, {}, value, place->value_begin, place->value_end, defines);
  }

  void of_node(const XmlElement& element) {
    static const std::set<std::string, std::less<>> kOfCode{"code", "if", "else"};
    const std::string_view tag = element.name();
    const bool is_builtin = names_.builtins.contains(tag);
    const bool by_attribute = std::find(kByAttribute.begin(), kByAttribute.end(), tag) != kByAttribute.end();
    const bool is_tree = tag == "SubTree";
    if (by_attribute) {
      attribute(element, "ID", is_tree ? SymbolKind::kTree : SymbolKind::kSkill, false);
    } else if (!is_builtin) {
      const std::size_t from = element.offset() + 1;
      add(SymbolKind::kSkill, std::string(tag), from, from + tag.size());
      // Only an end tag has nothing but its name before it: of <A/> it is not looked for.
      std::size_t end = element.end_offset() - 1;
      while (end > from && is_space(source_[end - 1])) --end;
      const std::size_t last = end - std::min(end, tag.size());
      if (last > from + 1 && source_.compare(last - 2, 2, "</") == 0 && source_.compare(last, tag.size(), tag) == 0)
        add(SymbolKind::kSkill, std::string(tag), last, end);
    }
    attribute(element, "name", SymbolKind::kNode, true);
    for (const text::XmlAttributePlace& written : element.attribute_places()) {
      const std::string name = at(written.name_begin, written.name_end);
      if (name == "name" || name == "ID" || name == "output_key") continue;
      if (name.starts_with('_') || (is_builtin && kOfCode.contains(name)))
        places_in_code(written.value_begin, written.value_end);
      else
        place(written.value_begin, written.value_end);
    }
  }

  const std::string& source_;
};

// ---- Charts ----

class ChartCollector : public Collector {
 public:
  ChartCollector(const text::XmlDocument& document, const std::string& file, const Names& names)
      : Collector(document.source(), names), source_(document.source()), file_(file) {
    const auto skill = names.charts.find(file);
    if (skill != names.charts.end()) {
      const auto* const place = attribute_place(document.root(), "name", source_);
      if (place != nullptr && at(place->value_begin, place->value_end) == skill->second) {
        add(SymbolKind::kSkill, skill->second, place->value_begin, place->value_end, true);
      } else {
        const std::size_t from = document.root().offset() + 1;
        add(SymbolKind::kSkill, skill->second, from, from + document.root().name().size(), true);
      }
    }
    text::for_each_element(document.root(), [&](const XmlElement& element) {
      of_element(element);
      places_of(element);
      for (const scxml::StateInScript& state : scxml::states_in_scripts(document, element))
        add_meant(SymbolKind::kState, file_ + "#", state.id, state.from, state.to);
    });
    sources_compared(document.root());
  }

 private:
  void of_element(const XmlElement& element) {
    const std::string_view tag = element.local_name();
    const bool is_state = tag == "state" || tag == "parallel" || tag == "final" || tag == "history";
    const bool is_send = tag == "send";
    const bool to_service =
        is_send && element.attribute("type").value_or("") == "thrift" && element.attribute("target").has_value();
    for (const text::XmlAttributePlace& place : element.attribute_places()) {
      const std::string name = at(place.name_begin, place.name_end);
      const std::size_t from = place.value_begin;
      const std::size_t to = place.value_end;
      const std::string meant(element.attribute(name).value_or(""));
      if (is_state && name == "id") {
        add_meant(SymbolKind::kState, file_ + "#", meant, from, to, true);
      } else if (tag == "data" && name == "id") {
        add(SymbolKind::kData, fmt::format("{}#{}", file_, at(from, to)), from, to, true);
      } else if (name == "initial" || name == "initialstate" || (tag == "transition" && name == "target")) {
        each_word(text_, from, to, [&](std::size_t begin, std::size_t end) {
          // Several with references in them are left as they are written.
          const bool is_whole = begin == from && end == to;
          add_meant(SymbolKind::kState, file_ + "#", is_whole ? meant : at(begin, end), begin, end);
        });
      } else if (tag == "transition" && name == "event") {
        each_word(text_, from, to, [&](std::size_t begin, std::size_t end) { event(begin, end); });
      } else if (to_service && name == "target") {
        if (names_.services.contains(at(from, to))) add(SymbolKind::kService, at(from, to), from, to);
      } else if (to_service && name == "event") {
        const auto service = names_.services.find(*element.attribute("target"));
        if (service == names_.services.end() || !service->second.service) continue;
        if (const idl::Method* method = service->second.service->find(at(from, to))) {
          const Symbol symbol = method_symbol(*method, service->second.file);
          add(symbol.kind, symbol.name, from, to);
        }
      } else if ((tag == "assign" && name == "location") || (tag == "param" && name == "expr")) {
        if (std::all_of(text_.begin() + static_cast<std::ptrdiff_t>(from),
                        text_.begin() + static_cast<std::ptrdiff_t>(to), is_word))
          add(SymbolKind::kData, fmt::format("{}#{}", file_, at(from, to)), from, to);
      }
    }
  }

  void places_of(const XmlElement& element) {
    static const std::set<std::string, std::less<>> kOfCode{"cond",      "expr",       "location", "array",
                                                            "delayexpr", "targetexpr", "eventexpr"};
    static const std::set<std::string, std::less<>> kCode{"script", "data", "assign", "content"};
    const std::string owner(element.attribute(element.local_name() == "data" ? "id" : "location").value_or(""));
    for (const text::XmlAttributePlace& written : element.attribute_places()) {
      if (kOfCode.contains(at(written.name_begin, written.name_end)))
        places_in_code(written.value_begin, written.value_end, owner);
    }
    if (!kCode.contains(element.local_name())) return;
    const std::string_view code = element.inner_source();
    const auto from = static_cast<std::size_t>(code.data() - source_.data());
    if (!code.empty()) places_in_code(from, from + code.size(), owner);
  }

  void event(std::size_t from, std::size_t to) {
    constexpr std::string_view kDone = "done.state.";
    if (text_.substr(from, to - from).starts_with(kDone)) {
      const std::size_t id = from + kDone.size();
      add(SymbolKind::kState, fmt::format("{}#{}", file_, at(id, to)), id, to);
    } else {
      dotted(from, to);
    }
  }

  // What a message's source is compared with.
  void sources_compared(const XmlElement& root) {
    for (std::size_t place = root.offset(); place < root.end_offset(); ++place) {
      const char quote = text_[place];
      if (quote != '\'' && quote != '"') continue;
      const std::size_t from = place + 1;
      std::size_t to = from;
      while (to < root.end_offset() && (is_word(text_[to]) || text_[to] == '-' || text_[to] == '.')) ++to;
      if (to == from || to >= root.end_offset() || text_[to] != quote) continue;
      std::size_t before = place;
      while (before > 0 && is_space(text_[before - 1])) --before;
      if (before > 0 && text_[before - 1] == '=') {
        while (before > 0 && (text_[before - 1] == '=' || text_[before - 1] == '!' || is_space(text_[before - 1])))
          --before;
        constexpr std::string_view kSource = "_event.data.source";
        if (before >= kSource.size() && text_.substr(before - kSource.size(), kSource.size()) == kSource)
          path(from, to, true);
      }
      place = to;
    }
  }

  const std::string& source_;
  const std::string& file_;
};

}  // namespace

Occurrences occurrences_in_tree(const text::XmlDocument& document, const Names& names) {
  return std::move(TreeCollector(document, names).found);
}

Occurrences occurrences_in_chart(const text::XmlDocument& document, const std::string& file, const Names& names) {
  return std::move(ChartCollector(document, file, names).found);
}

}  // namespace sentree::lsp
