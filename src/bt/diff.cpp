#include <fmt/format.h>

#include <map>
#include <utility>

#include "sentree/bt/tree.h"
#include "sentree/bt/write.h"
#include "sentree/text/xml.h"

// What differs in meaning between two files.

namespace sentree::bt {

using text::XmlElement;

namespace {

std::string registration(const XmlElement& element) {
  if (is_explicit_tag(element.name())) return std::string(element.attribute("ID").value_or(""));
  if (element.name() == "SubTree" || element.name() == "SubTreePlus") {
    return fmt::format("SubTree {}", element.attribute("ID").value_or(""));
  }
  return std::string(element.name());
}

std::string shown_name(const XmlElement& element) {
  if (const auto name = element.attribute("name")) return std::string(*name);
  return registration(element);
}

std::string key(const XmlElement& element) {
  return fmt::format("{}\n{}", registration(element), element.attribute("name").value_or(""));
}

text::XmlMeaning meaning() {
  return {
      .kind = registration,
      .shown = shown_name,
      .key = key,
      .like = registration,
      .identity = [](const XmlElement& element) { return element.attribute("name") ? key(element) : std::string(); },
      .text = [](const XmlElement& element) { return element.text(); },
      .passes_over_attribute =
          [](const XmlElement& element, std::string_view attribute) {
            return attribute == "ID" && (is_explicit_tag(element.name()) || element.name().starts_with("SubTree") ||
                                         element.name() == "BehaviorTree");
          },
      .passes_over = {},
  };
}

/// Another of one name.
void add_part(std::map<std::string, XmlElement>& found, std::string name, const XmlElement& element) {
  std::string own = name;
  for (std::size_t number = 2; !found.emplace(own, element).second; ++number) own = fmt::format("{} #{}", name, number);
}

/// Children of the root that have an ID of their own: trees by ID, models together.
std::map<std::string, XmlElement> parts(const XmlElement& root, std::string_view tag) {
  std::map<std::string, XmlElement> found;
  for (XmlElement e = root.first_child(); e; e = e.next_sibling()) {
    if (e.name() == tag) add_part(found, std::string(e.attribute("ID").value_or(e.attribute("path").value_or(""))), e);
  }
  return found;
}

std::map<std::string, XmlElement> model_parts(const XmlElement& root) {
  std::map<std::string, XmlElement> found;
  const XmlElement models = root.child("TreeNodesModel");
  for (XmlElement e = models ? models.first_child() : XmlElement(); e; e = e.next_sibling()) {
    add_part(found, std::string(e.attribute("ID").value_or("")), e);
  }
  return found;
}

void compare_parts(text::XmlComparison& comparison, const std::map<std::string, XmlElement>& a,
                   const std::map<std::string, XmlElement>& b, const std::string& prefix) {
  for (const auto& [id, element] : a) {
    const auto other = b.find(id);
    if (other == b.end()) {
      comparison.found.push_back(
          {Difference::Kind::kRemoved, prefix + id, fmt::format("{} removed", element.name()), element.span(), {}});
    } else {
      comparison.nodes(element, other->second, prefix + id);
    }
  }
  for (const auto& [id, element] : b) {
    if (!a.contains(id)) {
      comparison.found.push_back(
          {Difference::Kind::kAdded, prefix + id, fmt::format("{} added", element.name()), {}, element.span()});
    }
  }
}

}  // namespace

Result<std::vector<Difference>> diff(std::string_view before, std::string_view after, std::string before_file,
                                     std::string after_file, text::ElementPairs* pairs) {
  auto a = text::XmlDocument::parse(std::string(before), std::move(before_file), {.lenient = true});
  if (!a) return tl::unexpected(std::move(a.error()));
  auto b = text::XmlDocument::parse(std::string(after), std::move(after_file), {.lenient = true});
  if (!b) return tl::unexpected(std::move(b.error()));
  text::XmlComparison comparison(meaning());
  const XmlElement x = a->root();
  const XmlElement y = b->root();
  for (const XmlElement& root : {x, y}) {
    if (root.name() != "root") return fail("bt.not-a-tree", "the root element is no <root>", root.span());
  }
  for (const std::string_view name : {"BTCPP_format", "main_tree_to_execute"}) {
    const std::string was(x.attribute(name).value_or(""));
    const std::string is(y.attribute(name).value_or(""));
    if (was != is) {
      comparison.found.push_back(
          {Difference::Kind::kChanged, "root", fmt::format("{}: \"{}\" → \"{}\"", name, was, is), x.span(), y.span()});
    }
  }
  compare_parts(comparison, parts(x, "BehaviorTree"), parts(y, "BehaviorTree"), "");
  comparison.join_moved();
  if (pairs != nullptr) *pairs = std::move(comparison.pairs);
  compare_parts(comparison, parts(x, "include"), parts(y, "include"), "include ");
  compare_parts(comparison, model_parts(x), model_parts(y), "TreeNodesModel/");
  return std::move(comparison.found);
}

}  // namespace sentree::bt
