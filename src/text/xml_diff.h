#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/text/xml.h"

namespace sentree::text {

/// One difference in meaning between two files.
struct Difference {
  enum class Kind { kAdded, kRemoved, kChanged, kMoved };
  Kind kind = Kind::kChanged;
  std::string path;   ///< The names of the elements around it, from the outside: "Main/Root/GoToKitchen".
  std::string what;   ///< For people: `destination: "kitchen" → "hall"`.
  SourceSpan before;  ///< In the first file; no line for kAdded.
  SourceSpan after;   ///< In the second; no line for kRemoved.
};

/// What elements mean in a kind of document, so that those of two files can be paired.
struct XmlMeaning {
  using Say = std::function<std::string(const XmlElement&)>;
  Say kind;      ///< What it is: its name, as a rule.
  Say shown;     ///< As it appears in paths.
  Say key;       ///< Elements with one key are paired first; it holds the kind, unless a pair may change that.
  Say like;      ///< Of those that are left, two with the same may be one that was changed.
  Say identity;  ///< What it keeps when it goes to another parent; empty: it cannot be told from others.
  Say text;      ///< The text of one without children, as far as it counts.
  /// Attributes that do not count here.
  std::function<bool(const XmlElement&, std::string_view attribute)> passes_over_attribute;
  /// Elements that do not count; not set: all count.
  std::function<bool(const XmlElement&)> passes_over;
};

/// Elements that are one another's counterparts: the byte of the '<' in the first document, and in the second.
using ElementPairs = std::vector<std::pair<std::size_t, std::size_t>>;

/// Pairs the elements of two documents and collects what differs. The documents outlive it.
class XmlComparison {
 public:
  explicit XmlComparison(XmlMeaning meaning) : meaning_(std::move(meaning)) {}

  /// Two elements that are one another's counterpart, with all that is below them.
  /// Cost: O(size), and for the children of one element the product of their numbers, up to 4 million.
  void nodes(const XmlElement& before, const XmlElement& after, const std::string& path);

  /// What went from one parent to another (wrapped by another, say) was found as removed here and added there.
  /// Recognised if it is the same with all that is below it, else by its identity. Left as it is where more than 20,000
  /// elements came or went.
  void join_moved();

  std::vector<Difference> found;
  ElementPairs pairs;  ///< In no order; those that moved are among them.

 private:
  using Elements = std::vector<XmlElement>;
  using Attributes = std::map<std::string, std::string, std::less<>>;
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
  using Places = std::map<std::string, std::vector<Place>>;

  [[nodiscard]] Elements children_of(const XmlElement& element) const;
  [[nodiscard]] Attributes attributes_of(const XmlElement& element) const;
  [[nodiscard]] std::string signature(const XmlElement& element) const;
  [[nodiscard]] std::string identity(const XmlElement& element, bool exact) const;
  [[nodiscard]] bool went_along(XmlElement element) const;
  void children(const Elements& a, const Elements& b, const std::string& path);
  void pair_rest(const std::vector<std::string>& x, const std::vector<std::string>& y,
                 std::vector<std::size_t>& partner, std::vector<bool>& taken, std::vector<bool>* moved) const;
  void collect(const Loose& loose, bool exact, Places& sources);
  void match(const XmlElement& element, const std::string& path, const Loose& top, bool exact, Places& sources);
  void change(const std::string& path, std::string what, const XmlElement& a, const XmlElement& b);
  void pair_all(const XmlElement& before, const XmlElement& after);

  XmlMeaning meaning_;
  std::vector<Loose> removed_;
  std::vector<Loose> added_;
  std::set<std::size_t> moved_;    ///< Offsets in the first file.
  std::set<std::size_t> arrived_;  ///< Offsets in the second.
};

}  // namespace sentree::text
