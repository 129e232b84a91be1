#include <algorithm>
#include <filesystem>
#include <iostream>
#include <iterator>

#include "sentree/bt/write.h"
#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/scxml/format.h"
#include "sentree/text/file.h"
#include "sentree/text/xml.h"

namespace sentree::cli {

namespace {

using std::filesystem::path;

constexpr const char* kStandardInput = "<stdin>";

/// Nothing for a document that is neither a tree nor a chart.
std::optional<Result<std::string>> formatted(const std::string& source, const std::string& file) {
  const auto document = text::XmlDocument::parse(source, file, {.lenient = true});
  if (!document) return tl::unexpected(document.error());
  const std::string_view root = document->root().local_name();
  if (root == "root") return bt::format(source, file);
  if (root == "scxml") return scxml::format(source, file);
  return std::nullopt;
}

class FileFormatter {
 public:
  explicit FileFormatter(const FmtCommand& command) : command_(command) {}

  void input() {
    const std::string source{std::istreambuf_iterator<char>(std::cin), {}};
    const auto result = format(source, kStandardInput, true);
    if (!result) return;
    if (!command_.check && !command_.json) print(*result);
    note(kStandardInput, *result != source);
  }

  /// A folder stands for the trees and charts in it.
  void folder(const path& folder) {
    std::vector<path> files;
    std::error_code error;
    for (auto at = std::filesystem::recursive_directory_iterator(folder, error); at != decltype(at)();
         at.increment(error)) {
      if (at->path().filename().string().starts_with('.')) {
        at.disable_recursion_pending();
      } else if (at->is_regular_file(error) &&
                 (at->path().extension() == ".xml" || at->path().extension() == ".scxml")) {
        files.push_back(at->path());
      }
    }
    if (error) complain({Severity::kError, "file.unreadable", error.message(), SourceSpan{folder.string()}});
    std::sort(files.begin(), files.end());
    for (const path& file : files) this->file(file, false);
  }

  void file(const path& file, bool named) {
    const auto source = text::read_file(file);
    if (!source) return complain(source.error());
    const auto result = format(*source, file.string(), named);
    if (!result) return;
    const bool changes = *result != *source;
    if (changes && !command_.check && !replace(file, *result)) return;
    note(file.string(), changes);
  }

  int finish() {
    if (command_.json) {
      print(to_json(Value(Map{{"files", std::move(files_)}, {"diagnostics", to_value(problems_)}})) + "\n");
    }
    if (unwritable_) return kEnvironment;
    if (!problems_.empty()) return kInvalidInput;
    return command_.check && changed_ ? kFindings : kOk;
  }

 private:
  std::optional<std::string> format(const std::string& source, const std::string& file, bool named) {
    auto result = formatted(source, file);
    if (!result) {
      if (named) {
        complain({Severity::kError, "fmt.unknown-document",
                  "neither a Behavior Tree (<root>) nor a state chart (<scxml>)", SourceSpan{file}});
      }
      return std::nullopt;
    }
    if (*result) return std::move(**result);
    complain(result->error());
    return std::nullopt;
  }

  bool replace(const path& file, const std::string& content) {
    // What a link points at is written, and keeps its permissions.
    std::error_code error;
    const path target = std::filesystem::canonical(file, error);
    const auto permissions = std::filesystem::status(target, error).permissions();
    if (const auto written = text::write_file(target, content); !written) {
      unwritable_ = true;
      complain(written.error());
      return false;
    }
    std::filesystem::permissions(target, permissions, error);
    return true;
  }

  void note(const std::string& file, bool changes) {
    changed_ = changed_ || changes;
    if (command_.json) {
      files_.push_back(Map{{"file", file}, {"changed", changes}});
    } else if (changes && (command_.check || file != kStandardInput)) {
      print(file + "\n");
    }
  }

  void complain(const Diagnostic& diagnostic) {
    problems_.push_back(diagnostic);
    if (!command_.json) say(to_string(diagnostic));
  }

  const FmtCommand& command_;
  List files_;
  Diagnostics problems_;
  bool changed_ = false;
  bool unwritable_ = false;
};

}  // namespace

int fmt(const FmtCommand& command) {
  FileFormatter formatter(command);
  for (const std::string& name : command.files) {
    std::error_code error;
    if (name == "-") {
      formatter.input();
    } else if (std::filesystem::is_directory(name, error)) {
      formatter.folder(name);
    } else {
      formatter.file(name, true);
    }
  }
  return formatter.finish();
}

}  // namespace sentree::cli
