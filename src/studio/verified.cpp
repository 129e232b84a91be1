#include "sentree/studio/verified.h"

#include <algorithm>
#include <utility>

#include "sentree/studio/reached.h"
#include "sentree/text/json.h"

namespace sentree::studio {

namespace {

namespace fs = std::filesystem;

std::string fingerprint(std::string_view text) { return std::to_string(hash_bytes(text)); }

bool leads_inside(const fs::path& name) {
  return !name.empty() && name.is_relative() && std::find(name.begin(), name.end(), "..") == name.end();
}

// Where a folder is, seen from another; both may be named by links.
fs::path seen_from(const fs::path& folder, const fs::path& from) {
  std::error_code error;
  return fs::relative(fs::weakly_canonical(folder, error), fs::weakly_canonical(from, error), error);
}

bool is_count(const Value* value) { return value != nullptr && value->as_int() != nullptr && *value->as_int() >= 0; }
bool is_text(const Value* value) { return value != nullptr && value->as_string() != nullptr; }

bool is_kind(const Value& one) {
  return is_text(one.find("kind")) && is_count(one.find("reached")) && is_count(one.find("of"));
}
bool is_missing(const Value& one) {
  return is_text(one.find("kind")) && is_text(one.find("of")) && is_text(one.find("what")) &&
         is_text(one.find("file")) && is_count(one.find("line"));
}

}  // namespace

std::string verified_text(const Verified& verified, const fs::path& project, const fs::path& folder,
                          std::span<const text::ReadFile> read) {
  Value told = coverage_value(verified.coverage, project);
  if (!verified.with_requirements) {
    const auto is_requirement = [](const Value& one) { return one.find("kind")->text() == "requirements"; };
    for (const char* const name : {"kinds", "not_reached"}) {
      List kept;
      for (const Value& one : *told.find(name)->as_list()) {
        if (!is_requirement(one)) kept.push_back(one);
      }
      (*told.as_map())[name] = std::move(kept);
    }
  }
  Map files;
  for (const text::ReadFile& file : read) {
    const fs::path name = seen_from(file.path, project);
    if (leads_inside(name)) files[name.generic_string()] = fingerprint(file.content);
  }
  Map out{{"tool", "sentree verify"},
          {"project", seen_from(project, folder).generic_string()},
          {"files", std::move(files)},
          {"complete", verified.complete},
          {"complete_to_tick", static_cast<std::int64_t>(verified.complete_to_tick)},
          {"states", static_cast<std::int64_t>(verified.states)}};
  for (const char* const name : {"kinds", "not_reached"}) out[name] = *told.find(name);
  return to_json(Value(std::move(out))) + "\n";
}

Result<Value> read_verified(const fs::path& file,
                            const std::function<std::optional<std::string>(const std::string& name)>& text_of) {
  std::error_code error;
  if (!fs::exists(file, error)) return Value();
  const auto source = text::read_file(file);
  if (!source) return tl::unexpected(source.error());
  const auto told = text::parse_json(*source, file.string());
  if (!told) return tl::unexpected(told.error());
  const auto list = [&](const char* name) -> const List* {
    const Value* const found = told->find(name);
    return found != nullptr ? found->as_list() : nullptr;
  };
  const List* const kinds = list("kinds");
  const List* const missing = list("not_reached");
  const Value* const files = told->find("files");
  const Value* const complete = told->find("complete");
  const bool is_right = kinds != nullptr && missing != nullptr && std::all_of(kinds->begin(), kinds->end(), is_kind) &&
                        std::all_of(missing->begin(), missing->end(), is_missing) && files != nullptr &&
                        files->as_map() != nullptr && is_text(told->find("project")) && complete != nullptr &&
                        complete->as_bool() != nullptr && is_count(told->find("complete_to_tick")) &&
                        is_count(told->find("states"));
  if (!is_right) {
    return fail("studio.verified", "this is not what sentree verify writes; run it again, which writes the file anew",
                SourceSpan{file.string()});
  }
  const fs::path project = file.parent_path() / std::string(told->find("project")->text());
  List changed;
  for (const auto& [name, was] : *files->as_map()) {
    if (!leads_inside(name)) continue;
    std::optional<std::string> text = text_of ? text_of(name) : std::nullopt;
    if (!text) {
      if (auto read = text::read_file(project / name)) text = std::move(*read);
    }
    if (!text || fingerprint(*text) != was.text()) changed.emplace_back(name);
  }
  return Value(Map{{"kinds", *kinds},
                   {"not_reached", *missing},
                   {"verification", Map{{"complete", *complete},
                                        {"tick", *told->find("complete_to_tick")},
                                        {"states", *told->find("states")},
                                        {"changed", std::move(changed)}}}});
}

}  // namespace sentree::studio
