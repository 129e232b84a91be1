#include "sentree/text/xml_diff.h"

#include <algorithm>
#include <deque>
#include <unordered_map>

namespace sentree::text {

namespace {

/// Children are aligned exactly up to this many pairs, beyond it in order of their appearance.
constexpr std::size_t kPairsMax = 4'000'000;
/// Elements that came or went, up to which those that moved are looked for.
constexpr std::size_t kLooseMax = 20'000;
constexpr std::size_t kShownMax = 60;

/// The longest common subsequence.
void align(const std::vector<std::string>& x, const std::vector<std::string>& y, std::vector<std::size_t>& partner,
           std::vector<bool>& taken) {
  if (x.size() * y.size() > kPairsMax) {
    std::unordered_map<std::string_view, std::deque<std::size_t>> places;
    for (std::size_t j = 0; j < y.size(); ++j) places[y[j]].push_back(j);
    for (std::size_t i = 0, next = 0; i < x.size(); ++i) {
      const auto place = places.find(x[i]);
      if (place == places.end()) continue;
      while (!place->second.empty() && place->second.front() < next) place->second.pop_front();
      if (place->second.empty()) continue;
      partner[i] = place->second.front();
      taken[partner[i]] = true;
      next = partner[i] + 1;
    }
    return;
  }
  const std::size_t width = y.size() + 1;
  std::vector<std::uint32_t> length((x.size() + 1) * width, 0);
  for (std::size_t i = x.size(); i-- > 0;) {
    for (std::size_t j = y.size(); j-- > 0;) {
      length[i * width + j] = x[i] == y[j] ? length[(i + 1) * width + j + 1] + 1
                                           : std::max(length[(i + 1) * width + j], length[i * width + j + 1]);
    }
  }
  for (std::size_t i = 0, j = 0; i < x.size() && j < y.size();) {
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

// The first line in which two texts differ, shortened.
std::string first_difference(std::string_view text, std::string_view other) {
  std::size_t line = 0;
  for (std::size_t i = 0; i < std::min(text.size(), other.size()) && text[i] == other[i]; ++i) {
    if (text[i] == '\n') line = i + 1;
  }
  std::string_view shown = text.substr(std::min(line, text.size()));
  shown = shown.substr(0, shown.find('\n'));
  while (!shown.empty() && (shown.front() == ' ' || shown.front() == '\t')) shown.remove_prefix(1);
  if (shown.size() <= kShownMax) return std::string(shown);
  std::size_t end = kShownMax;
  while (end > 0 && (static_cast<unsigned char>(shown[end]) & 0xC0U) == 0x80U) --end;  // no half characters
  return std::string(shown.substr(0, end)) + "…";
}

// What a prefix stands for; empty: nothing.
std::string_view namespace_of(const XmlElement& element, std::string_view prefix) {
  const std::string declaration = "xmlns:" + std::string(prefix);
  for (XmlElement e = element; e; e = e.parent()) {
    if (const auto uri = e.attribute(declaration)) return *uri;
  }
  return {};
}

}  // namespace

XmlComparison::Elements XmlComparison::children_of(const XmlElement& element) const {
  Elements elements = element.children();
  if (meaning_.passes_over) std::erase_if(elements, meaning_.passes_over);
  return elements;
}

XmlComparison::Attributes XmlComparison::attributes_of(const XmlElement& element) const {
  Attributes all;
  element.for_each_attribute([&](std::string_view name, std::string_view value) {
    if (meaning_.passes_over_attribute(element, name)) return;
    // A prefix is any word for its namespace.
    const std::size_t colon = name.find(':');
    const std::string_view uri =
        colon != std::string_view::npos ? namespace_of(element, name.substr(0, colon)) : std::string_view();
    all.emplace(uri.empty() ? std::string(name) : std::string(name.substr(colon + 1)) + " (" + std::string(uri) + ")",
                value);
  });
  return all;
}

// Everything that counts of a node and of what is below it. Equal signatures: equal in meaning.
std::string XmlComparison::signature(const XmlElement& element) const {
  std::string all = "<" + meaning_.kind(element);
  for (const auto& [name, value] : attributes_of(element)) all += "\n" + name + "\t" + value;
  if (!element.first_child()) all += "\t" + meaning_.text(element);
  for (const XmlElement& child : children_of(element)) all += signature(child);
  return all + ">";
}

void XmlComparison::change(const std::string& path, std::string what, const XmlElement& a, const XmlElement& b) {
  found.push_back({Difference::Kind::kChanged, path, std::move(what), a.span(), b.span()});
}

void XmlComparison::nodes(const XmlElement& before, const XmlElement& after, const std::string& path) {
  pairs.emplace_back(before.offset(), after.offset());
  if (const std::string was = meaning_.kind(before), is = meaning_.kind(after); was != is)
    change(path, was + " → " + is, before, after);
  const Attributes old = attributes_of(before);
  const Attributes now = attributes_of(after);
  for (const auto& [name, value] : old) {
    const auto other = now.find(name);
    if (other == now.end()) {
      change(path, name + ": \"" + value + "\" removed", before, after);
    } else if (other->second != value) {
      change(path, name + ": \"" + value + "\" → \"" + other->second + "\"", before, after);
    }
  }
  for (const auto& [name, value] : now) {
    if (!old.contains(name)) change(path, name + ": \"" + value + "\" added", before, after);
  }
  const Elements a = children_of(before);
  const Elements b = children_of(after);
  if (a.empty() && b.empty()) {
    const std::string was = meaning_.text(before);
    const std::string is = meaning_.text(after);
    if (was != is) {
      change(path, "text: \"" + first_difference(was, is) + "\" → \"" + first_difference(is, was) + "\"", before,
             after);
    }
  }
  children(a, b, path);
}

// Two that are equal with all that is below them.
void XmlComparison::pair_all(const XmlElement& before, const XmlElement& after) {
  std::vector<std::pair<XmlElement, XmlElement>> rest{{before, after}};
  while (!rest.empty()) {
    const auto [a, b] = rest.back();
    rest.pop_back();
    pairs.emplace_back(a.offset(), b.offset());
    const Elements x = children_of(a);
    const Elements y = children_of(b);
    for (std::size_t i = 0; i < std::min(x.size(), y.size()); ++i) rest.emplace_back(x[i], y[i]);
  }
}

// The first that is left with the same word, for each.
void XmlComparison::pair_rest(const std::vector<std::string>& x, const std::vector<std::string>& y,
                              std::vector<std::size_t>& partner, std::vector<bool>& taken,
                              std::vector<bool>* moved) const {
  std::unordered_map<std::string_view, std::deque<std::size_t>> left;
  for (std::size_t j = 0; j < y.size(); ++j) {
    if (!taken[j]) left[y[j]].push_back(j);
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    const auto place = partner[i] == y.size() ? left.find(x[i]) : left.end();
    if (place == left.end() || place->second.empty()) continue;
    partner[i] = place->second.front();
    place->second.pop_front();
    taken[partner[i]] = true;
    if (moved != nullptr) (*moved)[i] = true;
  }
}

void XmlComparison::children(const Elements& a, const Elements& b, const std::string& path) {
  const auto said = [](const Elements& elements, const XmlMeaning::Say& say) {
    std::vector<std::string> words;
    words.reserve(elements.size());
    for (const XmlElement& element : elements) words.push_back(say(element));
    return words;
  };
  std::vector<std::size_t> partner(a.size(), b.size());
  std::vector<bool> taken(b.size(), false);
  std::vector<bool> moved(a.size(), false);
  const std::vector<std::string> x = said(a, meaning_.key);
  const std::vector<std::string> y = said(b, meaning_.key);
  align(x, y, partner, taken);
  // What was not aligned and has an equal elsewhere has moved; one that is like it has been changed.
  pair_rest(x, y, partner, taken, &moved);
  pair_rest(said(a, meaning_.like), said(b, meaning_.like), partner, taken, nullptr);

  for (std::size_t i = 0; i < a.size(); ++i) {
    const std::string inner = path + "/" + meaning_.shown(a[i]);
    if (partner[i] == b.size()) {
      removed_.push_back({a[i], inner, found.size()});
      found.push_back({Difference::Kind::kRemoved, inner, meaning_.kind(a[i]) + " removed", a[i].span(), {}});
      continue;
    }
    const XmlElement& other = b[partner[i]];
    if (moved[i])
      found.push_back({Difference::Kind::kMoved, inner, "moved among its siblings", a[i].span(), other.span()});
    nodes(a[i], other, inner);
  }
  for (std::size_t j = 0; j < b.size(); ++j) {
    if (taken[j]) continue;
    const std::string inner = path + "/" + meaning_.shown(b[j]);
    added_.push_back({b[j], inner, found.size()});
    found.push_back({Difference::Kind::kAdded, inner, meaning_.kind(b[j]) + " added", {}, b[j].span()});
  }
}

void XmlComparison::join_moved() {
  std::size_t loose_elements = 0;
  for (const auto* side : {&removed_, &added_}) {
    for (const Loose& loose : *side) loose_elements += loose.element.size();
  }
  if (loose_elements > kLooseMax) return;
  for (const bool exact : {true, false}) {
    Places sources;
    for (const Loose& loose : removed_) collect(loose, exact, sources);
    if (sources.empty()) break;
    const std::vector<Loose> added = added_;
    for (const Loose& loose : added) match(loose.element, loose.path, loose, exact, sources);
  }
  std::erase_if(found, [](const Difference& d) { return d.path.empty(); });
}

std::string XmlComparison::identity(const XmlElement& element, bool exact) const {
  return exact ? signature(element) : meaning_.identity(element);
}

void XmlComparison::collect(const Loose& loose, bool exact, Places& sources) {
  if (found[loose.difference].path.empty()) return;
  std::vector<std::pair<XmlElement, std::string>> rest{{loose.element, loose.path}};
  while (!rest.empty()) {
    auto [element, path] = std::move(rest.back());
    rest.pop_back();
    if (moved_.contains(element.offset())) continue;
    for (const XmlElement& child : children_of(element)) rest.emplace_back(child, path + "/" + meaning_.shown(child));
    const std::string id = identity(element, exact);
    if (!id.empty()) sources[id].push_back({element, path, loose.difference, element == loose.element});
  }
}

// It or one of its ancestors has been recognised already.
bool XmlComparison::went_along(XmlElement element) const {
  for (; element; element = element.parent()) {
    if (moved_.contains(element.offset())) return true;
  }
  return false;
}

void XmlComparison::match(const XmlElement& element, const std::string& path, const Loose& top, bool exact,
                          Places& sources) {
  if (found[top.difference].kind == Difference::Kind::kMoved || arrived_.contains(element.offset())) return;
  const auto place = sources.find(identity(element, exact));
  if (place != sources.end()) {
    std::erase_if(place->second, [this](const Place& p) { return went_along(p.element); });
  }
  if (place == sources.end() || place->second.empty()) {
    for (const XmlElement& child : children_of(element))
      match(child, path + "/" + meaning_.shown(child), top, exact, sources);
    return;
  }
  const Place from = place->second.front();
  place->second.erase(place->second.begin());
  moved_.insert(from.element.offset());
  arrived_.insert(element.offset());
  Difference moved{Difference::Kind::kMoved, path, "moved here from " + from.path, from.element.span(), element.span()};
  if (from.whole) found[from.difference].path.clear();  // it is not gone
  if (element == top.element) {
    found[top.difference] = std::move(moved);
  } else {
    found.push_back(std::move(moved));
  }
  if (exact)
    pair_all(from.element, element);
  else
    nodes(from.element, element, path);
}

}  // namespace sentree::text
