#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/design/findings.h"
#include "sentree/lsp/detail/outline.h"
#include "sentree/lsp/detail/recorded.h"
#include "sentree/lsp/index.h"
#include "sentree/lsp/lines.h"
#include "sentree/lsp/server.h"
#include "sentree/project/part_cache.h"
#include "sentree/text/overlay.h"

namespace sentree::lsp {

namespace fs = std::filesystem;

enum Code : int {
  kParseError = -32700,
  kInvalidRequest = -32600,
  kMethodNotFound = -32601,
  kInvalidParams = -32602,
  kInternalError = -32603,
  kServerNotInitialized = -32002,
  kRequestFailed = -32803,
  kServerCancelled = -32802,
  kRequestCancelled = -32800,
};

/// Why a request cannot be answered; thrown by what answers it, and told by `Server::handle`.
struct Refusal {
  int code;
  std::string message;
};

inline const Value& member(const Value& value, std::string_view name) {
  static const Value kNone;
  const Value* const found = value.find(name);
  return found != nullptr ? *found : kNone;
}

inline std::string text_of(const Value& value, std::string_view name) {
  return std::string(member(value, name).text());
}

inline const List& list_of(const Value& value) {
  static const List kNone;
  return value.as_list() != nullptr ? *value.as_list() : kNone;
}

inline bool flag_at(const Value& value, std::initializer_list<std::string_view> path) {
  const Value* const found = value.at(path);
  return found != nullptr && found->as_bool() != nullptr && *found->as_bool();
}

inline std::uint64_t count_of(const Value& value) {
  const std::int64_t* const number = value.as_int();
  if (number == nullptr || *number < 0) throw Refusal{kInvalidParams, "a position has a line and a character from 0"};
  return static_cast<std::uint64_t>(*number);
}

inline Position position_of(const Value& value) {
  return {count_of(member(value, "line")), count_of(member(value, "character"))};
}

inline Value to_value(const Position& position) {
  return Map{{"line", static_cast<std::int64_t>(position.line)},
             {"character", static_cast<std::int64_t>(position.character)}};
}

/// What the server knows of texts and projects, and its answers to what editors ask about them.
struct Server::Impl {
  struct Text {
    std::string uri;  // as the editor writes it
    fs::path path;    // empty: no file
    std::string text;
    Lines lines;
    Value version;  // as the editor counts; null: it does not
  };
  struct Project {
    explicit Project(const fs::path& folder) : index(folder) {}
    Index index;
    project::PartCache cache;
    bool is_outdated = true;  // texts have changed since the index saw them
    bool is_unchecked = true;
    std::uint64_t used = 0;
    std::map<std::string, std::vector<design::Finding>> findings;  // by absolute file
    std::map<std::string, std::string> told;                       // URI, by absolute file
  };

  explicit Impl(std::string program_version) : version(std::move(program_version)) {}

  std::string version;
  Units units = Units::kUtf16;
  bool renames_files = false;
  bool watches = false;
  std::map<std::string, Text> texts;     // by URI
  std::map<fs::path, Project> projects;  // by folder; "": texts of no project
  std::vector<fs::path> roots;           // the folders that the editor works in
  bool is_looked_through = false;        // they have been, for projects
  std::uint64_t uses = 0;
  Recorded recorded;
  std::vector<std::string> notes;
  std::int64_t requests = 0;  // of ours

  // ---- Texts ----

  [[nodiscard]] const Text* text_at(const fs::path& path) const;
  [[nodiscard]] std::string uri_at(const fs::path& path) const;

  // What the editor has open of a project, by file.
  [[nodiscard]] text::Overlay overlay(const fs::path& folder) const;
  Project& project_at(const fs::path& folder);
  // Those below the folders of the editor too, of which nothing need be open.
  void find_projects();
  void changed(const fs::path& path);
  const Index& fresh(Project& project);

  // ---- Where a request is about ----

  struct Where {
    const Text& text;
    Project& project;
    const Index& index;
    std::string file;
    std::size_t offset = 0;
  };
  Where where(const Value& params, bool has_position);
  Value range(const std::string& text, const Lines& lines, std::size_t from, std::size_t to) const;
  Value range(const IndexedFile& file, std::size_t from, std::size_t to) const;
  Value location(const Index& index, const Index::Place& place) const;
  Value edits_value(const std::string& text, const Lines& lines, const design::TextEdits& edits) const;

  // ---- Notes to the editor ----

  void note(std::string_view method, Value params);

  // Nothing is wrong with its files any more, as far as the editor is told.
  void clear(Project& project);
  void publish(Project& project);
  Value finding_value(const Project& project, const std::string& name, const design::Finding& finding) const;

  // ---- Checking ----

  [[nodiscard]] Project* unchecked();

  // A file by itself, as far as it can be told without a project.
  static Diagnostics check_alone(const std::string& name, const IndexedFile& file);
  void check(Project& project);

  // ---- Requests ----

  Value initialize(const Value& params);
  void initialized();
  void opened(const Value& params);
  void edited(const Value& params);
  void closed(const Value& params);
  void files_changed(const Value& params);
  Value completion(const Value& params);
  Value hover(const Value& params);

  // What the newest recording has of the port of a leaf that is hovered over.
  std::string last_of_port(const Where& at);
  static std::string shown(const std::string& what, const Value& value, const Recorded::Last& last);

  // What the newest recording has of a method, of each service that has it.
  std::string last_of(const Where& at, const Occurrence& occurrence);
  Value definition(const Value& params);

  // The skill that the element with this name runs: the last one named before it, in the same tag.
  static const Occurrence* skill_of(const Where& at, const Occurrence& name);
  Value references(const Value& params);
  Value highlights(const Value& params);
  Value prepare_rename(const Value& params);
  void tell_unfollowed(const Index& index, const Symbol& symbol);
  Value renamed(const Value& params);
  Value outline_value(const IndexedFile& file, const std::vector<OutlinePart>& parts) const;
  Value symbols(const Value& params);
  Value all_symbols(const Value& params);
  Value formatted(const Value& params);
  Value actions(const Value& params);
  Value lens(const IndexedFile& file, std::size_t at, const char* title, const char* command, List arguments) const;
  Value lenses(const Value& params);

  // sentree.draw(URI, tree): a picture of a tree or a chart, as SVG.
  Value execute(const Value& params);

  /// Of one text that is edited bit by bit.
  static constexpr std::size_t kTextBytesMax = std::size_t{16} << 20U;

  using Request = Value (Impl::*)(const Value&);
  static Request request(std::string_view method);
  void notified(const std::string& method, const Value& params);
};

}  // namespace sentree::lsp
