#include "sentree/text/json.h"

#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <unordered_map>

namespace sentree::text {

namespace {

// Builds a Value straight from the parser's events, so that depth is bounded before anything is built.
class JsonBuilder final : public nlohmann::json_sax<nlohmann::json> {
 public:
  JsonBuilder(const LineIndex& lines, const std::string& file) : lines_(lines), file_(file) {}

  bool null() override { return add(Value()); }
  bool boolean(bool v) override { return add(v); }
  bool number_integer(number_integer_t v) override { return add(Value(static_cast<std::int64_t>(v))); }
  bool number_unsigned(number_unsigned_t v) override {
    if (v <= static_cast<number_unsigned_t>(std::numeric_limits<std::int64_t>::max())) {
      return add(Value(static_cast<std::int64_t>(v)));
    }
    return add(static_cast<double>(v));
  }
  bool number_float(number_float_t v, const string_t&) override { return add(static_cast<double>(v)); }
  bool string(string_t& v) override { return add(std::move(v)); }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return open(Map()); }
  bool key(string_t& v) override {
    keys_.back().key = std::move(v);
    return true;
  }
  bool end_object() override { return close(); }
  bool start_array(std::size_t) override { return open(List()); }
  bool end_array() override { return close(); }
  bool parse_error(std::size_t position, const std::string& token, const nlohmann::detail::exception& error) override {
    const auto at = lines_.position(position == 0 ? 0 : position - 1);
    // The library's text begins with its own id and place: "[json.exception…] parse error at line …: text".
    std::string what = error.what();
    if (const auto colon = what.find(": "); colon != std::string::npos) what = what.substr(colon + 2);
    (void)token;
    failure = Diagnostic{Severity::kError, "json.syntax", "not JSON: " + what, {file_, at.line, at.column, 0}};
    return false;
  }

  Value root;
  std::optional<Diagnostic> failure;

 private:
  struct Object {
    std::string key;                                      // of the value that comes
    std::unordered_map<std::string, std::size_t> places;  // of the keys before, where they are many
  };

  bool add(Value value) {
    if (open_.empty()) {
      root = std::move(value);
    } else if (List* list = open_.back().as_list()) {
      list->push_back(std::move(value));
    } else {
      add(*open_.back().as_map(), keys_.back(), std::move(value));
    }
    return true;
  }
  // Few keys are compared, many are looked up.
  static void add(Map& map, Object& object, Value value) {
    constexpr std::size_t kFew = 16;
    if (map.size() < kFew) {
      map[object.key] = std::move(value);
      return;
    }
    if (object.places.empty()) {
      for (const auto& [key, old] : map) object.places.emplace(key, object.places.size());
    }
    const auto [place, is_new] = object.places.try_emplace(object.key, map.size());
    if (is_new)
      map.append(std::move(object.key), std::move(value));
    else
      std::next(map.begin(), static_cast<std::ptrdiff_t>(place->second))->second = std::move(value);
  }
  bool open(Value container) {
    if (open_.size() >= kNestingMax) {
      failure = Diagnostic{Severity::kError, "json.too-deep",
                           "nested deeper than " + std::to_string(kNestingMax) + " levels", SourceSpan{file_}};
      return false;
    }
    open_.push_back(std::move(container));
    keys_.emplace_back();
    return true;
  }
  bool close() {
    Value done = std::move(open_.back());
    open_.pop_back();
    keys_.pop_back();
    return add(std::move(done));
  }

  const LineIndex& lines_;
  const std::string& file_;
  std::vector<Value> open_;
  std::vector<Object> keys_;  // of those, where they are objects
};

}  // namespace

Result<Value> parse_json(std::string_view source, const std::string& file) {
  const LineIndex lines(source);
  JsonBuilder builder(lines, file);
  const bool parsed = nlohmann::json::sax_parse(source.begin(), source.end(), &builder);
  if (builder.failure) return tl::unexpected(*builder.failure);
  if (!parsed) return fail("json.syntax", "not JSON", SourceSpan{file});
  return std::move(builder.root);
}

}  // namespace sentree::text
