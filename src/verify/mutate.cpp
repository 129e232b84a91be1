#include "sentree/verify/mutate.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>

#include "sentree/base/value.h"
#include "sentree/text/xml.h"

namespace sentree::verify {

namespace {

using text::XmlElement;

struct Edit {
  std::size_t from = 0;
  std::size_t to = 0;
  std::string text;
};

std::string edited(std::string_view source, std::vector<Edit> edits) {
  std::sort(edits.begin(), edits.end(), [](const Edit& a, const Edit& b) { return a.from > b.from; });
  std::string out(source);
  for (const Edit& edit : edits) out.replace(edit.from, edit.to - edit.from, edit.text);
  return out;
}

// Of tags: what one is easily taken for.
constexpr std::array<std::pair<std::string_view, std::string_view>, 10> kOthers{
    {{"Sequence", "ReactiveSequence"},
     {"Sequence", "Fallback"},
     {"ReactiveSequence", "Sequence"},
     {"ReactiveSequence", "ReactiveFallback"},
     {"SequenceWithMemory", "Sequence"},
     {"Fallback", "ReactiveFallback"},
     {"Fallback", "Sequence"},
     {"ReactiveFallback", "Fallback"},
     {"ReactiveFallback", "ReactiveSequence"},
     {"AsyncSequence", "Sequence"}}};

// Of expressions as they stand in attributes, longer ones first.
constexpr std::array<std::pair<std::string_view, std::string_view>, 14> kOperators{{{"===", "!=="},
                                                                                    {"!==", "==="},
                                                                                    {"==", "!="},
                                                                                    {"!=", "=="},
                                                                                    {"&lt;=", "&lt;"},
                                                                                    {"&gt;=", "&gt;"},
                                                                                    {">=", ">"},
                                                                                    {"<=", "<"},
                                                                                    {"&lt;", "&lt;="},
                                                                                    {"&gt;", "&gt;="},
                                                                                    {">", ">="},
                                                                                    {"<", "<="},
                                                                                    {"&amp;&amp;", "||"},
                                                                                    {"||", "&amp;&amp;"}}};

bool is_word(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '$' || c == '.';
}

std::optional<double> number_of(std::string_view text) {
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(number)) return std::nullopt;
  return number;
}

// Of an operator: "<" for "&lt;".
std::string meant(std::string_view written) {
  std::string out(written);
  for (const auto& [entity, c] : {std::pair("&lt;", "<"), {"&gt;", ">"}, {"&amp;", "&"}}) {
    for (std::size_t at = out.find(entity); at != std::string::npos; at = out.find(entity))
      out.replace(at, std::string_view(entity).size(), c);
  }
  return out;
}

// As people write it: 31, not 31.0.
std::string as_text(double number) {
  std::string text = shortest_decimal(number);
  return text.ends_with(".0") ? text.substr(0, text.size() - 2) : text;
}

// Nothing that would have to be written otherwise somewhere else.
bool is_plain(std::string_view text) {
  return !text.empty() && text.find_first_of("{}<>&\"'\\") == std::string_view::npos;
}

// A number by which something may be called.
bool is_whole(std::string_view text) {
  const auto number = number_of(text);
  return number && *number == std::floor(*number) && text.find_first_of(".eE") == std::string_view::npos;
}

// Of a leaf, and no time: what else is counted is called by no number.
bool may_pass_number(const XmlElement& node, std::string_view port) {
  return !node.first_child() && !port.ends_with("msec");
}

void collect_ports(const XmlElement& element, Passed& all) {
  element.for_each_attribute([&](std::string_view name, std::string_view value) {
    if (name == "name" || name == "ID" || name.starts_with('_') || !is_plain(value)) return;
    if (!number_of(value) || (is_whole(value) && may_pass_number(element, name))) all[std::string(name)].emplace(value);
  });
  for (const XmlElement& child : element.children()) {
    if (child.name() != "TreeNodesModel") collect_ports(child, all);
  }
}

// The constant that an expression is, without its quotes; nothing: it is none, or no plain one.
std::optional<std::string> constant(std::string_view expression) {
  if (is_whole(expression)) return std::string(expression);
  if (expression.size() < 3 || (expression.front() != '\'' && expression.front() != '"')) return std::nullopt;
  if (expression.back() != expression.front()) return std::nullopt;
  const std::string_view inside = expression.substr(1, expression.size() - 2);
  return is_plain(inside) && !number_of(inside) ? std::optional<std::string>(inside) : std::nullopt;
}

void collect_parameters(const XmlElement& element, Passed& all) {
  if (element.local_name() == "param") {
    const auto passes = constant(element.attribute("expr").value_or(""));
    if (passes) all[std::string(element.attribute("name").value_or(""))].insert(*passes);
  }
  for (const XmlElement& child : element.children()) collect_parameters(child, all);
}

void collect(const XmlElement& root, Passed& all) {
  if (root.local_name() == "root")
    collect_ports(root, all);
  else if (root.local_name() == "scxml")
    collect_parameters(root, all);
}

class Mutator {
 public:
  Mutator(std::string_view source, const text::XmlDocument& document, Passed passed)
      : source_(source), document_(document), passed_(std::move(passed)) {
    collect(document.root(), passed_);
  }

  // A change whose text is not made yet: of a large file there are many.
  struct Change {
    std::size_t at = 0;
    std::string what;
    std::vector<Edit> edits;
  };

  std::vector<Change> run() {
    const XmlElement root = document_.root();
    const bool is_tree = root.local_name() == "root";
    if (!is_tree && root.local_name() != "scxml") return {};
    for (const XmlElement& element : root.children()) {
      if (!is_tree)
        chart(element);
      else if (element.name() == "BehaviorTree")
        for (const XmlElement& node : element.children()) tree(node, 1);
    }
    return std::move(changes_);
  }

 private:
  void add(std::size_t at, std::string what, std::vector<Edit> edits) {
    changes_.push_back({at, std::move(what), std::move(edits)});
  }

  [[nodiscard]] static std::string called(const XmlElement& node) {
    return std::string(node.attribute("name").value_or(node.attribute("ID").value_or(node.name())));
  }

  // ---- Trees ----

  void tree(const XmlElement& node, std::size_t siblings) {
    for (const auto& [tag, other] : kOthers) {
      if (node.name() != tag) continue;
      std::vector<Edit> edits{{node.offset() + 1, node.offset() + 1 + tag.size(), std::string(other)}};
      if (const std::size_t end = source_.rfind("</", node.end_offset() - 1);
          end != std::string_view::npos && node.first_child())
        edits.push_back({end + 2, end + 2 + tag.size(), std::string(other)});
      add(node.offset(), fmt::format("{}: {} → {}", called(node), tag, other), std::move(edits));
    }
    const auto children = node.children();
    const bool is_control =
        std::any_of(kOthers.begin(), kOthers.end(), [&](const auto& pair) { return pair.first == node.name(); });
    if (siblings > 1) add(node.offset(), called(node) + " dropped", {{node.offset(), node.end_offset(), ""}});
    if (!is_control && children.size() == 1)
      add(node.offset(), called(node) + " dropped, not what is in it",
          {{node.offset(), node.end_offset(), text_of(children.front())}});
    ports(node);
    for (std::size_t i = 0; i + 1 < children.size(); ++i) {
      const XmlElement& a = children[i];
      const XmlElement& b = children[i + 1];
      add(a.offset(), fmt::format("{} and {} exchanged", called(a), called(b)),
          {{a.offset(), a.end_offset(), text_of(b)}, {b.offset(), b.end_offset(), text_of(a)}});
    }
    for (const XmlElement& child : children) tree(child, children.size());
  }

  [[nodiscard]] std::string text_of(const XmlElement& element) const {
    return std::string(source_.substr(element.offset(), element.end_offset() - element.offset()));
  }

  [[nodiscard]] static bool is_script(std::string_view tag, std::string_view attribute) {
    constexpr std::array<std::string_view, 8> kConditions{"_failureIf", "_successIf", "_skipIf",   "_while",
                                                          "_onSuccess", "_onFailure", "_onHalted", "_post"};
    return ((tag == "Script" || tag == "ScriptCondition") && attribute == "code") ||
           (tag == "Precondition" && attribute == "if") ||
           std::find(kConditions.begin(), kConditions.end(), attribute) != kConditions.end();
  }

  void ports(const XmlElement& node) {
    for (const auto& attribute : node.attributes()) {
      const auto& name = attribute.name;
      const auto& value = attribute.value;
      if (is_script(node.name(), name)) expression(node, name);
      if (name == "name" || name == "ID" || name.starts_with('_')) continue;
      const std::size_t at = node.attribute_value_offset(name);
      const auto change = [&](const std::string& other) {
        add(at, fmt::format("{}: {} {} → {}", called(node), name, value, other), {{at, at + value.size(), other}});
      };
      const auto number = number_of(value);
      if (number) {
        change(as_text(*number + 1));
        change(as_text(*number - 1));
      }
      if (!is_plain(value) || source_.substr(at, value.size()) != value) continue;
      if (number && !may_pass_number(node, name)) continue;
      for (const std::string& other : others(std::string(value), {std::string(name)})) change(other);
    }
  }

  // What else is passed so: texts for a text, numbers for a number that are not next to it.
  [[nodiscard]] std::set<std::string> others(const std::string& value, const std::vector<std::string>& as) const {
    std::set<std::string> all;
    const auto number = number_of(value);
    for (const std::string& name : as) {
      const auto passed = passed_.find(name);
      if (passed == passed_.end()) continue;
      for (const std::string& other : passed->second) {
        const auto another = number_of(other);
        const bool is_like = number ? is_whole(value) && another && std::abs(*another - *number) > 1 : !another;
        if (other != value && is_like) all.insert(other);
      }
    }
    return all;
  }

  // ---- Charts ----

  void chart(const XmlElement& element) {
    const std::string_view name = element.local_name();
    const std::string of = fmt::format("<{}>", name);
    for (const std::string_view attribute : {"cond", "expr"}) {
      if (element.attribute(attribute)) expression(element, attribute);
    }
    if (name == "transition" || name == "send" || name == "raise" || name == "assign")
      add(element.offset(),
          fmt::format("{} {} dropped", of,
                      element.attribute("event").value_or(element.attribute("location").value_or(""))),
          {{element.offset(), element.end_offset(), ""}});
    for (const XmlElement& child : element.children()) {
      if (child.local_name() == "param") parameter(child, element);
      chart(child);
    }
  }

  void parameter(const XmlElement& element, const XmlElement& of) {
    const std::string_view written = element.attribute("expr").value_or("");
    const auto value = constant(written);
    if (!value) return;
    const std::size_t at = element.attribute_value_offset("expr") + (written == *value ? 0 : 1);
    if (source_.substr(at, value->size()) != *value) return;  // written with entities
    const std::string name(element.attribute("name").value_or(""));
    const std::string call =
        fmt::format("{}.{}.{}", of.attribute("target").value_or(""), of.attribute("event").value_or(""), name);
    for (const std::string& other : others(*value, {name, call}))
      add(at, fmt::format("<param> {} {} → {}", name, *value, other), {{at, at + value->size(), other}});
  }

  void expression(const XmlElement& element, std::string_view attribute) {
    const std::size_t begin = element.attribute_value_offset(attribute);
    const std::size_t end = std::min(source_.find(source_[begin - 1], begin), source_.size());
    const std::string_view written = source_.substr(begin, end - begin);
    const auto change = [&](std::size_t at, std::size_t size, const std::string& other) {
      add(begin + at, fmt::format("{} {} → {}", attribute, meant(written.substr(at, size)), meant(other)),
          {{begin + at, begin + at + size, other}});
    };
    for (std::size_t at = 0; at < written.size();) {
      const char c = written[at];
      if (c == '\'' || c == '"') {
        at = std::min(written.find(c, at + 1), written.size() - 1) + 1;
        continue;
      }
      if (is_word(c)) {
        std::size_t word_end = at;
        while (word_end < written.size() && is_word(written[word_end])) ++word_end;
        const std::string_view word = written.substr(at, word_end - at);
        if (const auto number = number_of(word)) {
          change(at, word.size(), as_text(*number + 1));
          change(at, word.size(), as_text(*number - 1));
        } else if (word == "true" || word == "false") {
          change(at, word.size(), word == "true" ? "false" : "true");
        }
        at = word_end;
        continue;
      }
      const auto found = std::find_if(kOperators.begin(), kOperators.end(),
                                      [&](const auto& pair) { return written.substr(at).starts_with(pair.first); });
      if (found != kOperators.end()) {
        change(at, found->first.size(), std::string(found->second));
        at += found->first.size();
        continue;
      }
      ++at;
    }
  }

  std::string_view source_;
  const text::XmlDocument& document_;
  Passed passed_;
  std::vector<Change> changes_;
};

}  // namespace

void collect_passed(std::string_view source, Passed& all) {
  if (const auto document = text::XmlDocument::parse(std::string(source))) collect(document->root(), all);
}

void collect_passed(const std::string& name, const idl::Service& service, Passed& all) {
  for (const idl::Method* const method : service.methods) {
    for (const idl::Field& field : method->arguments.fields) {
      if (field.type->kind != idl::Kind::kEnum) continue;
      auto& values = all[fmt::format("{}.{}.{}", name, method->name, field.name)];
      for (const idl::Enumerator& one : field.type->enumeration->enumerators) values.insert(one.name);
    }
  }
}

std::vector<Mutant> mutants(std::string_view source, const std::string& file, Passed passed) {
  const auto document = text::XmlDocument::parse(std::string(source), file);
  if (!document) return {};
  const auto all = Mutator(source, *document, std::move(passed)).run();
  const std::size_t count = std::min(all.size(), kMutantsMax);
  std::vector<Mutant> out;
  for (std::size_t i = 0; i < count; ++i) {
    const auto& change = all[i * all.size() / count];
    out.push_back({document->span_at(change.at), change.what, edited(source, change.edits)});
  }
  return out;
}

bool same_behaviour(const Graph& a, const Graph& b) {
  // Where a choice stands nobody can tell: models of any reply are made anew.
  const auto are_alike = [](const std::vector<Made>& one, const std::vector<Made>& other) {
    return std::equal(one.begin(), one.end(), other.begin(), other.end(), [](Made x, const Made& y) {
      x.place = y.place;
      return x == y;
    });
  };
  return a.complete == b.complete && a.nodes == b.nodes && a.edges == b.edges && a.sequences == b.sequences &&
         std::equal(a.decisions.begin(), a.decisions.end(), b.decisions.begin(), b.decisions.end(), are_alike) &&
         a.observations == b.observations && a.said == b.said;
}

}  // namespace sentree::verify
