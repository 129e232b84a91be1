#include <algorithm>
#include <map>
#include <set>
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

/// Everything that counts of a node and of what is below it. Equal signatures: equal in meaning.
std::string signature(const XmlElement& element) {
  std::string all = "<" + registration(element);
  for (const auto& [name, value] : attributes(element)) all += "\n" + name + "\t" + value;
  if (!element.first_child()) all += "\t" + element.text();
  for (XmlElement child = element.first_child(); child; child = child.next_sibling()) all += signature(child);
  return all + ">";
}

class Comparison {
 public:
  std::vector<Difference> found;

  /// What went from one parent to another (wrapped by a decorator, say) was found as removed here and added there.
  /// Recognised if it is the same with all that is below it, else by its ID and a name of its own.
  void join_moved() {
    for (const bool exact : {true, false}) {
      std::map<std::string, std::vector<Place>> sources;
      for (const Loose& loose : removed_) collect(loose, exact, sources);
      if (sources.empty()) break;
      const std::vector<Loose> added = added_;
      for (const Loose& loose : added) match(loose.element, loose.path, loose, exact, sources);
    }
    std::erase_if(found, [](const Difference& d) { return d.path.empty(); });
  }

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
        removed_.push_back({a[i], inner, found.size()});
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
      const std::string inner = path + "/" + shown_name(b[j]);
      added_.push_back({b[j], inner, found.size()});
      found.push_back({Difference::Kind::kAdded, inner, registration(b[j]) + " added", {}, b[j].span()});
    }
  }

 private:
  /// A node that was found removed or added, and which difference says so.
  struct Loose {
    XmlElement element;
    std::string path;
    std::size_t difference;
  };
  struct Place {
    XmlElement element;
    std::string path;
    std::size_t difference;  ///< Of the removed node that it is or that it was below.
    bool whole;              ///< It is that node.
  };

  static std::string identity(const XmlElement& element, bool exact) {
    if (exact) return signature(element);
    return element.attribute("name") ? key(element) : std::string();
  }

  void collect(const Loose& loose, bool exact, std::map<std::string, std::vector<Place>>& sources) {
    if (found[loose.difference].path.empty()) return;
    std::vector<std::pair<XmlElement, std::string>> rest{{loose.element, loose.path}};
    while (!rest.empty()) {
      auto [element, path] = std::move(rest.back());
      rest.pop_back();
      if (moved_.contains(element.offset())) continue;
      for (const XmlElement& child : element.children()) rest.emplace_back(child, path + "/" + shown_name(child));
      const std::string id = identity(element, exact);
      if (!id.empty()) sources[id].push_back({element, path, loose.difference, element == loose.element});
    }
  }

  /// It or one of its ancestors has been recognised already.
  [[nodiscard]] bool went_along(XmlElement element) const {
    for (; element; element = element.parent()) {
      if (moved_.contains(element.offset())) return true;
    }
    return false;
  }

  void match(const XmlElement& element, const std::string& path, const Loose& top, bool exact,
             std::map<std::string, std::vector<Place>>& sources) {
    if (found[top.difference].kind == Difference::Kind::kMoved || arrived_.contains(element.offset())) return;
    const auto place = sources.find(identity(element, exact));
    if (place != sources.end()) {
      std::erase_if(place->second, [this](const Place& p) { return went_along(p.element); });
    }
    if (place == sources.end() || place->second.empty()) {
      for (const XmlElement& child : element.children())
        match(child, path + "/" + shown_name(child), top, exact, sources);
      return;
    }
    const Place from = place->second.front();
    place->second.erase(place->second.begin());
    moved_.insert(from.element.offset());
    arrived_.insert(element.offset());
    Difference moved{Difference::Kind::kMoved, path, "moved here from " + from.path, from.element.span(),
                     element.span()};
    if (from.whole) found[from.difference].path.clear();  // it is not gone
    if (element == top.element) {
      found[top.difference] = std::move(moved);
    } else {
      found.push_back(std::move(moved));
    }
    if (!exact) nodes(from.element, element, path);
  }

  std::vector<Loose> removed_;
  std::vector<Loose> added_;
  std::set<std::size_t> moved_;    ///< Offsets in the first file.
  std::set<std::size_t> arrived_;  ///< Offsets in the second.

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
  for (const XmlElement& root : {x, y}) {
    if (root.name() != "root") return fail("bt.not-a-tree", "the root element is no <root>", root.span());
  }
  for (const std::string_view name : {"BTCPP_format", "main_tree_to_execute"}) {
    const std::string was(x.attribute(name).value_or(""));
    const std::string is(y.attribute(name).value_or(""));
    if (was != is) {
      comparison.found.push_back({Difference::Kind::kChanged, "root",
                                  std::string(name) + ": \"" + was + "\" → \"" + is + "\"", x.span(), y.span()});
    }
  }
  compare_parts(comparison, parts(x, "BehaviorTree"), parts(y, "BehaviorTree"), "");
  comparison.join_moved();
  compare_parts(comparison, parts(x, "include"), parts(y, "include"), "include ");
  compare_parts(comparison, model_parts(x), model_parts(y), "TreeNodesModel/");
  return std::move(comparison.found);
}

}  // namespace sentree::bt
