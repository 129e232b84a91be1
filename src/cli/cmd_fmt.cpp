#include <filesystem>
#include <iostream>
#include <iterator>

#include "sentree/bt/write.h"
#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/tree_files.h"
#include "sentree/scxml/diff.h"
#include "sentree/scxml/format.h"
#include "sentree/text/file.h"
#include "sentree/text/rewrite.h"
#include "sentree/text/xml.h"

namespace sentree::cli {

namespace {

using std::filesystem::path;

constexpr const char* kStandardInput = "<stdin>";

/// Nothing for a document that is neither a tree nor a chart.
std::optional<Result<std::string>> formatted(const std::string& source, const std::string& file) {
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  const std::size_t first = source.find_first_not_of(" \t\r\n", source.starts_with(kMark) ? kMark.size() : 0);
  if (first == std::string::npos || source[first] != '<') return std::nullopt;
  const auto document = text::XmlDocument::parse(source, file, {.lenient = true});
  if (!document) return tl::unexpected(document.error());
  if (scxml::is_chart(document->root())) return scxml::format(source, file);
  if (document->root().local_name() == "root") return bt::format(source, file);
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

  void file(const path& file, bool named) {
    const auto source = text::read_file(file);
    if (!source) return complain(source.error());
    const auto result = format(*source, file.string(), named);
    if (!result) return;
    const bool changes = *result != *source;
    if (changes && !command_.check && !replace(file, *result)) return;
    note(file.string(), changes);
  }

  void complain(const Diagnostic& diagnostic) {
    problems_.push_back(diagnostic);
    if (!command_.json) say(to_string(diagnostic));
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
                  "neither a Behavior Tree (<root>) nor a state chart (<scxml>); nothing else is formatted",
                  SourceSpan{file, 1, 1}});
      }
      return std::nullopt;
    }
    if (*result) return std::move(**result);
    complain(result->error());
    return std::nullopt;
  }

  bool replace(const path& file, const std::string& content) {
    if (const auto written = text::rewrite_file(file, content); !written) {
      unwritable_ = true;
      complain(written.error());
      return false;
    }
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

  const FmtCommand& command_;
  List files_;
  Diagnostics problems_;
  bool changed_ = false;
  bool unwritable_ = false;
};

}  // namespace

int fmt(const FmtCommand& command) {
  FileFormatter formatter(command);
  Diagnostics problems;
  std::vector<std::string> names;
  for (const std::string& name : command.files) {
    if (name == "-")
      formatter.input();
    else
      names.push_back(name);
  }
  // The form of a tree does not depend on what its nodes are; a palette that cannot be read is told all the same.
  const TreeFiles palettes({}, command.trees, problems);
  const std::vector<GivenFile> files = given_files(names, problems);
  for (const Diagnostic& problem : problems) formatter.complain(problem);
  for (const GivenFile& file : files) formatter.file(file.path, file.named);
  return formatter.finish();
}

}  // namespace sentree::cli
