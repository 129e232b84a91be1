#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "sentree/bt/write.h"
#include "sentree/cli/colours.h"
#include "sentree/cli/commands.h"
#include "sentree/cli/document.h"
#include "sentree/cli/output.h"
#include "sentree/cli/tree_files.h"
#include "sentree/scxml/diff.h"
#include "sentree/text/file.h"

namespace sentree::cli {

namespace {

using text::Difference;
using Kind = Difference::Kind;

struct Look {
  const char* name;
  const char* sign;
  const char* colour;
};

Look look(Kind kind) {
  switch (kind) {
    case Kind::kAdded: return {"added", "+", kGreen};
    case Kind::kRemoved: return {"removed", "-", kRed};
    case Kind::kChanged: return {"changed", "~", kYellow};
    case Kind::kMoved: return {"moved", ">", kBlue};
  }
  return {"", "", ""};
}

Value place(const SourceSpan& span) {
  if (span.line == 0) return {};
  return Map{{"file", span.file}, {"line", span.line}, {"column", span.column}};
}

// The place that the reader will want to open: in the new file, unless it is gone from there.
const SourceSpan& where(const Difference& d) { return d.kind == Kind::kRemoved ? d.before : d.after; }

void tell(const std::vector<Difference>& differences, bool colour) {
  std::string path;
  for (const Difference& d : differences) {
    const Look shown = look(d.kind);
    if (d.path != path) print((colour ? coloured(kBold, d.path) : d.path) + "\n");
    path = d.path;
    const std::string what = fmt::format("{} {}", shown.sign, d.what);
    const std::string place = to_string(where(d));
    print(fmt::format("  {}\n", colour ? fmt::format("{}  {}", coloured(shown.colour, what), coloured(kDim, place))
                                       : fmt::format("{}  {}", what, place)));
  }
  print(std::to_string(differences.size()) + (differences.size() == 1 ? " difference\n" : " differences\n"));
}

}  // namespace

namespace {

// What differs between two files.
Result<std::vector<bt::Difference>> diff_files(const std::string& before, const std::string& after) {
  for (const std::string& file : {before, after}) {
    if (const auto other = other_kind(file)) return tl::unexpected(*other);
  }
  const auto first = read_named(before);
  if (!first) return tl::unexpected(first.error());
  const auto second = read_named(after);
  if (!second) return tl::unexpected(second.error());
  const bool charts = is_chart_source(*first);
  if (charts != is_chart_source(*second)) {
    return fail("diff.unlike",
                fmt::format("{} is {} state chart, {} is {}; what can be compared are two trees or two charts", before,
                            charts ? "a" : "no", after, charts ? "none" : "one"));
  }
  return charts ? scxml::diff(*first, *second, before, after) : bt::diff(*first, *second, before, after);
}

using Files = std::map<std::string, std::filesystem::path>;  // By the path below the folder.

Files documents_below(const std::string& folder, Diagnostics& problems) {
  Files files;
  for (const GivenFile& file : given_files({folder}, problems)) {
    const auto source = text::read_file(file.path);
    if (!source)
      problems.push_back(source.error());
    else if (!document_kind(*source).empty())
      files.emplace(file.path.lexically_relative(folder).generic_string(), file.path);
  }
  return files;
}

// Files of the same path below the two folders are compared; of the others it is told that they came or went.
std::vector<bt::Difference> diff_folders(const DiffCommand& command, Diagnostics& problems) {
  const Files before = documents_below(command.before, problems);
  const Files after = documents_below(command.after, problems);
  std::vector<bt::Difference> all;
  for (const auto& [name, file] : before) {
    const auto other = after.find(name);
    if (other == after.end()) {
      all.push_back({Kind::kRemoved, name, "file removed", SourceSpan{file.string(), 1, 1, 0}, {}});
      continue;
    }
    auto found = diff_files(file.string(), other->second.string());
    if (!found) {
      problems.push_back(found.error());
      continue;
    }
    for (bt::Difference& difference : *found) {
      difference.path = fmt::format("{}: {}", name, difference.path);
      all.push_back(std::move(difference));
    }
  }
  for (const auto& [name, file] : after) {
    if (!before.contains(name))
      all.push_back({Kind::kAdded, name, "file added", {}, SourceSpan{file.string(), 1, 1, 0}});
  }
  return all;
}

}  // namespace

int diff(const DiffCommand& command) {
  std::error_code error;
  const bool is_folder = std::filesystem::is_directory(command.before, error);
  if (is_folder != std::filesystem::is_directory(command.after, error)) {
    say("a folder can only be compared with a folder");
    return kUsage;
  }
  Diagnostics problems;
  const TreeFiles palettes({}, command.trees, problems);
  Result<std::vector<bt::Difference>> differences =
      is_folder ? diff_folders(command, problems) : diff_files(command.before, command.after);
  if (!differences) problems.push_back(differences.error());
  if (has_errors(problems)) {
    say(problems);
    return kInvalidInput;
  }
  if (command.json) {
    List list;
    for (const Difference& d : *differences) {
      list.push_back(Map{{"kind", look(d.kind).name},
                         {"path", d.path},
                         {"what", d.what},
                         {"before", place(d.before)},
                         {"after", place(d.after)}});
    }
    print(to_json(Value(Map{{"same", differences->empty()}, {"differences", std::move(list)}})) + "\n");
  } else if (!differences->empty()) {
    tell(*differences, wants_colour());
  }
  return differences->empty() ? kOk : kFindings;
}

}  // namespace sentree::cli
