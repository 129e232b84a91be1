#include <algorithm>
#include <map>
#include <utility>

#include "sentree/bt/write.h"
#include "sentree/text/xml.h"

// What differs in meaning between two files.

namespace sentree::bt {

using text::XmlElement;

namespace {

/// Children are aligned exactly up to this many pairs, beyond it in order of their appearance.
constexpr std::size_t kPairsMax = 4'000'000;

bool is_explicit(std::string_view tag) {
  return tag == "Action" || tag == "Condition" || tag == "Control" || tag == "Decorator";
}

std::string registration(const XmlElement& element) {
  if (is_explicit(element.name())) return std::string(element.attribute("ID").value_or(""));
  if (element.name() == "SubTree" || element.name() == "SubTreePlus") {
    return "SubTree " + std::string(element.attribute("ID").value_or(""));
  }
  return std::string(element.name());
}

std::string shown_name(const XmlElement& element) {
  if (const auto name = element.attribute("name")) return std::string(*name);
  return registration(element);
}

std::string key(const XmlElement& element) {
  return registration(element) + "\n" + std::string(element.attribute("name").value_or(""));
}

using Attributes = std::map<std::string, std::string, std::less<>>;

Attributes attributes(const XmlElement& element) {
  Attributes all;
  const bool id_is_identity =
      is_explicit(element.name()) || element.name().starts_with("SubTree") || element.name() == "BehaviorTree";
  element.for_each_attribute([&](std::string_view name, std::string_view value) {
    if (name == "ID" && id_is_identity) return;
    all.emplace(name, value);
  });
  return all;
}

class Comparison {
 public:
  std::vector<Difference> found;

  void nodes(const XmlElement& a, const XmlElement& b, const std::string& path) {
    const Attributes before = attributes(a);
    const Attributes after = attributes(b);
    for (const auto& [name, value] : before) {
      const auto other = after.find(name);
      if (other == after.end()) {
        change(path, name + ": \"" + value + "\" removed", a, b);
      } else if (other->second != value) {
        change(path, name + ": \"" + value + "\" → \"" + other->second + "\"", a, b);
      }
    }
    for (const auto& [name, value] : after) {
      if (!before.contains(name)) change(path, name + ": \"" + value + "\" added", a, b);
    }
    if (a.text() != b.text() && !a.first_child() && !b.first_child()) change(path, "text changed", a, b);
    children(a.children(), b.children(), path);
  }

  void children(const std::vector<XmlElement>& a, const std::vector<XmlElement>& b, const std::string& path) {
    std::vector<std::size_t> partner(a.size(), b.size());
    std::vector<bool> taken(b.size(), false);
    align(a, b, partner, taken);
    // What was not aligned and has an equal elsewhere has moved; one of the same kind in between has been changed.
    std::vector<bool> moved(a.size(), false);
    for (const bool same_name : {true, false}) {
      for (std::size_t i = 0; i < a.size(); ++i) {
        if (partner[i] != b.size()) continue;
        for (std::size_t j = 0; j < b.size(); ++j) {
          if (taken[j] || (same_name ? key(a[i]) != key(b[j]) : registration(a[i]) != registration(b[j]))) continue;
          partner[i] = j;
          taken[j] = true;
          moved[i] = same_name;
          break;
        }
      }
    }
    for (std::size_t i = 0; i < a.size(); ++i) {
      const std::string inner = path + "/" + shown_name(a[i]);
      if (partner[i] == b.size()) {
        found.push_back({Difference::Kind::kRemoved, inner, registration(a[i]) + " removed", a[i].span(), {}});
        continue;
      }
      const XmlElement& other = b[partner[i]];
      if (moved[i])
        found.push_back({Difference::Kind::kMoved, inner, "moved among its siblings", a[i].span(), other.span()});
      nodes(a[i], other, inner);
    }
    for (std::size_t j = 0; j < b.size(); ++j) {
      if (taken[j]) continue;
      found.push_back(
          {Difference::Kind::kAdded, path + "/" + shown_name(b[j]), registration(b[j]) + " added", {}, b[j].span()});
    }
  }

 private:
  void change(const std::string& path, std::string what, const XmlElement& a, const XmlElement& b) {
    found.push_back({Difference::Kind::kChanged, path, std::move(what), a.span(), b.span()});
  }

  /// The longest common subsequence by registration and name.
  static void align(const std::vector<XmlElement>& a, const std::vector<XmlElement>& b,
                    std::vector<std::size_t>& partner, std::vector<bool>& taken) {
    std::vector<std::string> x, y;
    for (const XmlElement& e : a) x.push_back(key(e));
    for (const XmlElement& e : b) y.push_back(key(e));
    if (a.size() * b.size() > kPairsMax) {
      for (std::size_t i = 0, j = 0; i < x.size() && j < y.size(); ++i) {
        const auto place = std::find(y.begin() + static_cast<std::ptrdiff_t>(j), y.end(), x[i]);
        if (place == y.end()) continue;
        partner[i] = static_cast<std::size_t>(place - y.begin());
        taken[partner[i]] = true;
        j = partner[i] + 1;
      }
      return;
    }
    const std::size_t width = b.size() + 1;
    std::vector<std::uint32_t> length((a.size() + 1) * width, 0);
    for (std::size_t i = a.size(); i-- > 0;) {
      for (std::size_t j = b.size(); j-- > 0;) {
        length[i * width + j] = x[i] == y[j] ? length[(i + 1) * width + j + 1] + 1
                                             : std::max(length[(i + 1) * width + j], length[i * width + j + 1]);
      }
    }
    for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
      if (x[i] == y[j]) {
        partner[i] = j;
        taken[j] = true;
        ++i;
        ++j;
      } else if (length[(i + 1) * width + j] >= length[i * width + j + 1]) {
        ++i;
      } else {
        ++j;
      }
    }
  }
};

/// Children of the root that have an ID of their own: trees by ID, models together.
std::map<std::string, XmlElement> parts(const XmlElement& root, std::string_view tag) {
  std::map<std::string, XmlElement> found;
  for (XmlElement e = root.first_child(); e; e = e.next_sibling()) {
    if (e.name() == tag) found.emplace(std::string(e.attribute("ID").value_or(e.attribute("path").value_or(""))), e);
  }
  return found;
}

std::map<std::string, XmlElement> model_parts(const XmlElement& root) {
  std::map<std::string, XmlElement> found;
  const XmlElement models = root.child("TreeNodesModel");
  for (XmlElement e = models ? models.first_child() : XmlElement(); e; e = e.next_sibling()) {
    found.emplace(std::string(e.attribute("ID").value_or("")), e);
  }
  return found;
}

void compare_parts(Comparison& comparison, const std::map<std::string, XmlElement>& a,
                   const std::map<std::string, XmlElement>& b, const std::string& prefix) {
  for (const auto& [id, element] : a) {
    const auto other = b.find(id);
    if (other == b.end()) {
      comparison.found.push_back(
          {Difference::Kind::kRemoved, prefix + id, std::string(element.name()) + " removed", element.span(), {}});
    } else {
      comparison.nodes(element, other->second, prefix + id);
    }
  }
  for (const auto& [id, element] : b) {
    if (!a.contains(id)) {
      comparison.found.push_back(
          {Difference::Kind::kAdded, prefix + id, std::string(element.name()) + " added", {}, element.span()});
    }
  }
}

}  // namespace

Result<std::vector<Difference>> diff(std::string_view before, std::string_view after, std::string before_file,
                                     std::string after_file) {
  auto a = text::XmlDocument::parse(std::string(before), std::move(before_file), {.lenient = true});
  if (!a) return tl::unexpected(std::move(a.error()));
  auto b = text::XmlDocument::parse(std::string(after), std::move(after_file), {.lenient = true});
  if (!b) return tl::unexpected(std::move(b.error()));
  Comparison comparison;
  const XmlElement x = a->root();
  const XmlElement y = b->root();
  for (const std::string_view name : {"BTCPP_format", "main_tree_to_execute"}) {
    const std::string was(x.attribute(name).value_or(""));
    const std::string is(y.attribute(name).value_or(""));
    if (was != is) {
      comparison.found.push_back({Difference::Kind::kChanged, "root",
                                  std::string(name) + ": \"" + was + "\" → \"" + is + "\"", x.span(), y.span()});
    }
  }
  compare_parts(comparison, parts(x, "BehaviorTree"), parts(y, "BehaviorTree"), "");
  compare_parts(comparison, parts(x, "include"), parts(y, "include"), "include ");
  compare_parts(comparison, model_parts(x), model_parts(y), "TreeNodesModel/");
  return std::move(comparison.found);
}

}  // namespace sentree::bt
