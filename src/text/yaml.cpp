#include "sentree/text/yaml.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <sstream>
#include <unordered_set>

#include "sentree/text/json.h"

namespace sentree::text {

namespace {

// No YAML that people write by hand is larger.
constexpr std::size_t kBytesMax = std::size_t{4} << 20U;
constexpr std::size_t kNodesMax = 200'000;
// Of all scalars together, those of aliases counted each time.
constexpr std::size_t kTextMax = std::size_t{64} << 20U;
// Brackets that are open at one place, those in texts counted too. The parser reads on behind many of them before it
// says anything, so the bound on nesting comes too late.
constexpr std::size_t kBracketsMax = 10'000;

struct TooDeep {};
struct TooLarge {
  std::string what;
};
struct BadKey {
  SourceSpan span;
  std::string what;
};

// Builds our nodes from the parser's events: bounds hold before anything is built. Aliases, and what is kept for them,
// are copied under the same count, so that a bomb of either ends at `kNodesMax`.
class YamlBuilder final : public YAML::EventHandler {
 public:
  explicit YamlBuilder(std::string file) : file_(std::move(file)) { root.span = {file_, 1, 1, 0}; }

  /// What the parser saw last: where a bound is reached.
  SourceSpan place() const { return span(last_); }
  /// Where the last document begins.
  SourceSpan document() const { return span(document_); }

  void OnDocumentStart(const YAML::Mark& mark) override { document_ = mark; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    add(make(mark, YamlNode::Kind::kNull), anchor);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    last_ = mark;
    const auto known = anchors_.find(anchor);
    if (known == anchors_.end()) throw BadKey{span(mark), "an alias cannot stand inside what it names"};
    count(known->second);
    add(known->second, YAML::NullAnchor);
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    YamlNode node = make(mark, YamlNode::Kind::kScalar);
    count_text(value);
    node.scalar = value;
    node.quoted = tag == "!";  // yaml-cpp: "!" for quoted, "?" for plain scalars
    if (!node.quoted && (value == "~" || value == "null")) node.kind = YamlNode::Kind::kNull;
    add(std::move(node), anchor);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open(make(mark, YamlNode::Kind::kSequence), anchor);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    open(make(mark, YamlNode::Kind::kMapping), anchor);
  }
  void OnMapEnd() override { close(); }

  YamlNode root;

 private:
  struct Open {
    YamlNode node;
    YAML::anchor_t anchor;
    std::optional<YamlNode> key;
    std::unordered_set<std::string> keys;  // where they are many
  };

  SourceSpan span(const YAML::Mark& mark) const { return {file_, mark.line + 1, mark.column + 1, 0}; }
  YamlNode make(const YAML::Mark& mark, YamlNode::Kind kind) {
    last_ = mark;
    count(1);
    YamlNode node;
    node.kind = kind;
    node.span = span(mark);
    return node;
  }
  void count(std::size_t nodes) {
    if ((nodes_ += nodes) > kNodesMax) throw TooLarge{"more than " + std::to_string(kNodesMax) + " nodes"};
  }
  void count_text(const std::string& text) {
    if ((text_ += text.size()) > kTextMax) throw TooLarge{"more than " + std::to_string(kTextMax) + " bytes of text"};
  }
  void count(const YamlNode& node) {
    count(1);
    count_text(node.scalar);
    for (const YamlNode& item : node.items) count(item);
    for (const auto& [key, value] : node.entries) {
      count(key);
      count(value);
    }
  }
  // Few keys are compared, many are looked up.
  static bool stands_already(Open& parent, const std::string& key) {
    constexpr std::size_t kFew = 16;
    const auto& entries = parent.node.entries;
    if (entries.size() < kFew) return parent.node.find(key) != nullptr;
    if (parent.keys.empty()) {
      for (const auto& [name, value] : entries) parent.keys.insert(name.scalar);
    }
    return !parent.keys.insert(key).second;
  }
  void open(YamlNode node, YAML::anchor_t anchor) {
    if (open_.size() >= kNestingMax) throw TooDeep{};
    open_.push_back({std::move(node), anchor, std::nullopt, {}});
  }
  void close() {
    Open done = std::move(open_.back());
    open_.pop_back();
    add(std::move(done.node), done.anchor);
  }
  void add(YamlNode node, YAML::anchor_t anchor) {
    if (anchor != YAML::NullAnchor) {
      count(node);
      anchors_[anchor] = node;
    }
    if (open_.empty()) {
      root = std::move(node);
      return;
    }
    Open& parent = open_.back();
    if (parent.node.is_sequence()) {
      parent.node.items.push_back(std::move(node));
    } else if (!parent.key) {
      if (node.is_null() && node.scalar.empty()) throw BadKey{node.span, "a key is missing"};
      if (!node.is_scalar() && !node.is_null()) throw BadKey{node.span, "a key must be a plain text"};
      if (stands_already(parent, node.scalar)) throw BadKey{node.span, "key \"" + node.scalar + "\" stands twice"};
      node.kind = YamlNode::Kind::kScalar;
      parent.key = std::move(node);
    } else {
      parent.node.entries.emplace_back(std::move(*parent.key), std::move(node));
      parent.key.reset();
    }
  }

  std::string file_;
  YAML::Mark last_;
  YAML::Mark document_;
  std::size_t nodes_ = 0;
  std::size_t text_ = 0;
  std::vector<Open> open_;
  std::map<YAML::anchor_t, YamlNode> anchors_;
};

}  // namespace

YamlNode::YamlNode() = default;
YamlNode::YamlNode(const YamlNode&) = default;
YamlNode::YamlNode(YamlNode&&) noexcept = default;
YamlNode& YamlNode::operator=(const YamlNode&) = default;
YamlNode& YamlNode::operator=(YamlNode&&) noexcept = default;
YamlNode::~YamlNode() = default;

const YamlNode* YamlNode::find(std::string_view key) const {
  for (const auto& [name, value] : entries) {
    if (name.scalar == key) return &value;
  }
  return nullptr;
}

std::optional<std::int64_t> YamlNode::integer() const {
  if (kind != Kind::kScalar || quoted || scalar.empty()) return std::nullopt;
  const char* begin = scalar.data() + (scalar[0] == '+' ? 1 : 0);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(begin, scalar.data() + scalar.size(), value);
  if (error != std::errc() || end != scalar.data() + scalar.size()) return std::nullopt;
  return value;
}

std::optional<double> YamlNode::number() const {
  if (const auto whole = integer()) return static_cast<double>(*whole);
  if (kind != Kind::kScalar || quoted || scalar.empty()) return std::nullopt;
  if (scalar == ".inf" || scalar == "+.inf") return std::numeric_limits<double>::infinity();
  if (scalar == "-.inf") return -std::numeric_limits<double>::infinity();
  if (scalar == ".nan") return std::nan("");
  const char first = scalar[scalar[0] == '-' || scalar[0] == '+' ? 1 : 0];
  if ((first < '0' || first > '9') && first != '.') return std::nullopt;  // from_chars reads "inf" and "nan"
  const char* begin = scalar.data() + (scalar[0] == '+' ? 1 : 0);
  double value = 0;
  const auto [end, error] = std::from_chars(begin, scalar.data() + scalar.size(), value);
  if (error != std::errc() || end != scalar.data() + scalar.size()) return std::nullopt;
  return value;
}

std::optional<bool> YamlNode::boolean() const {
  if (kind != Kind::kScalar || quoted) return std::nullopt;
  if (scalar == "true") return true;
  if (scalar == "false") return false;
  return std::nullopt;
}

Value YamlNode::value() const {
  switch (kind) {
    case Kind::kNull: return {};
    case Kind::kScalar:
      if (const auto b = boolean()) return *b;
      if (const auto i = integer()) return *i;
      if (const auto d = number()) return *d;
      return scalar;
    case Kind::kSequence: {
      List list;
      for (const YamlNode& item : items) list.push_back(item.value());
      return list;
    }
    case Kind::kMapping: {
      Map map;
      for (const auto& [key, item] : entries) map.append(key.scalar, item.value());
      return map;
    }
  }
  return {};
}

namespace {

/// The line of the bracket that is one too many.
std::optional<int> too_many_brackets(std::string_view source) {
  std::size_t open = 0;
  int line = 1;
  for (const char c : source) {
    if (c == '\n') ++line;
    if (c == '[' || c == '{') {
      if (++open > kBracketsMax) return line;
    } else if ((c == ']' || c == '}') && open > 0) {
      --open;
    }
  }
  return std::nullopt;
}

// What yaml-cpp says names a rule of its own, and not what to do.
std::string_view way_out(std::string_view source, const YAML::Exception& error) {
  if (error.msg.find("flow not found") != std::string::npos)
    return error.msg.find("map") != std::string::npos ? "; a { before this is not closed by }"
                                                      : "; a [ before this is not closed by ]";
  for (int line = 0; line < error.mark.line && !source.empty(); ++line)
    source.remove_prefix(std::min(source.find('\n'), source.size() - 1) + 1);
  const std::string_view line = source.substr(0, source.find('\n'));
  const std::string_view before = line.substr(0, static_cast<std::size_t>(std::max(error.mark.column, 0)));
  if (error.msg == YAML::ErrorMsg::MAP_VALUE && before.find(": ") != std::string_view::npos)
    return "; a text with a colon in it needs quotes: key: \"a: b\"";
  const bool begins_line = before.find_first_not_of(' ') == std::string_view::npos;
  if (error.msg == YAML::ErrorMsg::MAP_VALUE ||
      (begins_line && (error.msg == YAML::ErrorMsg::END_OF_MAP || error.msg == YAML::ErrorMsg::END_OF_SEQ)))
    return "; this line is indented otherwise than those that it belongs to: entries of one mapping or list begin in "
           "one "
           "column";
  if (error.msg == YAML::ErrorMsg::END_OF_MAP || error.msg == YAML::ErrorMsg::END_OF_SEQ)
    return "; the value ends before this: quotes go around a whole text";
  return "";
}

// What is wrong with a line that begins with a tab, or the line before (from 0), YAML says in other words.
std::string_view tab_in(std::string_view source, int line) {
  for (int at = 0; !source.empty(); ++at) {
    const std::string_view text = source.substr(0, source.find('\n'));
    const std::size_t first = text.find_first_not_of(' ');
    if (at >= line - 1 && at <= line && first != std::string_view::npos && text[first] == '\t')
      return "; there is a tab, and YAML is indented by spaces";
    source.remove_prefix(std::min(text.size() + 1, source.size()));
  }
  return "";
}

tl::unexpected<Diagnostic> too_deep(SourceSpan at) {
  return fail("yaml.too-deep", "nested deeper than " + std::to_string(kNestingMax) + " levels", std::move(at));
}

}  // namespace

Result<YamlNode> parse_yaml(std::string_view source, const std::string& file) {
  if (source.size() > kBytesMax) {
    return fail("yaml.too-large", "larger than the " + std::to_string(kBytesMax) + " bytes that are read at most",
                SourceSpan{file});
  }
  if (const auto line = too_many_brackets(source)) return too_deep({file, *line, 1, 0});
  // yaml-cpp throws; keep its message and place.
  YamlBuilder builder(file);
  try {
    std::istringstream stream{std::string(source)};
    YAML::Parser parser(stream);
    if (parser.HandleNextDocument(builder) && parser.HandleNextDocument(builder)) {
      return fail("yaml.syntax", "a second document; one file holds one", builder.document());
    }
  } catch (const YAML::Exception& error) {
    const std::string_view tab = tab_in(source, error.mark.line);
    return fail("yaml.syntax", "not YAML: " + error.msg + std::string(tab.empty() ? way_out(source, error) : tab),
                {file, error.mark.line + 1, error.mark.column + 1, 0});
  } catch (const BadKey& bad) {
    return fail("yaml.duplicate-key", bad.what, bad.span);
  } catch (const TooDeep&) {
    return too_deep(builder.place());
  } catch (const TooLarge& large) {
    return fail("yaml.too-large", large.what, builder.place());
  }
  return std::move(builder.root);
}

}  // namespace sentree::text
