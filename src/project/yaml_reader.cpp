#include "sentree/project/yaml_reader.h"

#include <algorithm>
#include <map>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sentree/project/project.h"
#include "sentree/project/variant.h"

namespace sentree::project {

YamlReader::YamlReader(const text::YamlNode& node, std::string what, Diagnostics& diagnostics)
    : node_(node), what_(std::move(what)), diagnostics_(diagnostics) {
  if (!node_.is_mapping() && !node_.is_null())
    error(node_.span, "project.type", what_ + " must be a mapping (key: value)");
}

YamlReader::~YamlReader() {
  if (given_up_) return;
  const std::set<std::string_view> known(known_.begin(), known_.end());
  for (const auto& [key, value] : node_.entries) {
    if (known.contains(key.scalar)) continue;
    std::string way_out = did_you_mean(key.scalar, known_);
    // Where nothing is like it, what there is, if one can take it in at a glance.
    constexpr std::size_t kShownMax = 8;
    if (way_out.empty() && !known_.empty() && known_.size() <= kShownMax)
      way_out = fmt::format("; it can have {}", fmt::join(known_, ", "));
    error(key.span, "project.unknown-key", fmt::format("{} has no key \"{}\"{}", what_, key.scalar, way_out));
  }
}

void YamlReader::error(const SourceSpan& span, std::string code, std::string message) {
  diagnostics_.push_back({Severity::kError, std::move(code), std::move(message), span});
}

SourceSpan YamlReader::span(const std::string& key) const {
  const text::YamlNode* found = node_.find(key);
  return found ? found->span : node_.span;
}

const text::YamlNode* YamlReader::node(const std::string& key) {
  const bool is_first = std::find(known_.begin(), known_.end(), key) == known_.end();
  if (is_first) known_.push_back(key);
  const text::YamlNode* found = node_.find(key);
  if (is_first && found != nullptr && found->is_null()) {
    diagnostics_.push_back({Severity::kWarning, "project.no-value",
                            fmt::format("\"{}\" of {} has no value, and counts as left out", key, what_), found->span});
  }
  return found != nullptr && found->is_null() ? nullptr : found;
}

std::optional<std::string> YamlReader::string(const std::string& key) {
  const text::YamlNode* found = node(key);
  if (found == nullptr) return std::nullopt;
  if (!found->is_scalar()) {
    error(found->span, "project.type", fmt::format("\"{}\" of {} must be a text", key, what_));
    return std::nullopt;
  }
  return found->scalar;
}

std::string YamlReader::required_string(const std::string& key) {
  const auto value = string(key);
  if (!value && node_.find(key) == nullptr) {
    error(node_.span, "project.missing-key", fmt::format("{} needs \"{}\"", what_, key));
  }
  return value.value_or("");
}

namespace {

template <class T>
std::optional<T> converted(YamlReader& reader, const text::YamlNode* node, const std::string& key,
                           const std::string& what, std::optional<T> value, const char* kind) {
  if (node == nullptr || value) return value;
  reader.error(node->span, "project.type",
               fmt::format("\"{}\" of {} must be {}{}", key, what, kind,
                           node->is_scalar() ? fmt::format(", not \"{}\"", node->scalar) : std::string()));
  return std::nullopt;
}

}  // namespace

std::optional<double> YamlReader::number(const std::string& key) {
  const text::YamlNode* found = node(key);
  return converted(*this, found, key, what_, found ? found->number() : std::nullopt, "a number");
}

std::optional<std::int64_t> YamlReader::integer(const std::string& key) {
  const text::YamlNode* found = node(key);
  return converted(*this, found, key, what_, found ? found->integer() : std::nullopt, "a whole number");
}

std::optional<bool> YamlReader::boolean(const std::string& key) {
  const text::YamlNode* found = node(key);
  return converted(*this, found, key, what_, found ? found->boolean() : std::nullopt, "true or false");
}

std::optional<Duration> YamlReader::duration(const std::string& key) {
  const text::YamlNode* found = node(key);
  return converted(*this, found, key, what_, found && found->is_scalar() ? parse_duration(found->scalar) : std::nullopt,
                   "a duration such as 40 ms, 2 s or 5 min, up to ten years");
}

std::vector<std::string> YamlReader::strings(const std::string& key) {
  const text::YamlNode* found = node(key);
  if (found == nullptr) return {};
  if (found->is_scalar()) return {found->scalar};
  std::vector<std::string> texts;
  for (const text::YamlNode& item : found->items) {
    if (item.is_scalar())
      texts.push_back(item.scalar);
    else
      error(item.span, "project.type", fmt::format("\"{}\" of {} must be a list of texts", key, what_));
  }
  if (!found->is_sequence())
    error(found->span, "project.type", fmt::format("\"{}\" of {} must be a list of texts", key, what_));
  return texts;
}

const text::YamlNode* YamlReader::mapping(const std::string& key) {
  const text::YamlNode* found = node(key);
  if (found == nullptr || found->is_mapping()) return found;
  error(found->span, "project.type", fmt::format("\"{}\" of {} must be a mapping (key: value)", key, what_));
  return nullptr;
}

const text::YamlNode* YamlReader::sequence(const std::string& key) {
  const text::YamlNode* found = node(key);
  if (found == nullptr || found->is_sequence()) return found;
  error(found->span, "project.type", fmt::format("\"{}\" of {} must be a list", key, what_));
  return nullptr;
}

void merge(text::YamlNode& into, const text::YamlNode& changes) {
  std::map<std::string, std::size_t, std::less<>> places;
  for (std::size_t i = 0; i < into.entries.size(); ++i) places.emplace(into.entries[i].first.scalar, i);
  for (const auto& [key, change] : changes.entries) {
    const auto [place, is_new] = places.emplace(key.scalar, into.entries.size());
    if (is_new) {
      into.entries.emplace_back(key, change);
      continue;
    }
    text::YamlNode& old = into.entries[place->second].second;
    if (old.is_mapping() && change.is_mapping())
      merge(old, change);
    else
      old = change;
  }
}

}  // namespace sentree::project
