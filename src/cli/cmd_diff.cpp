#include <algorithm>

#include "sentree/bt/write.h"
#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/text/file.h"

namespace sentree::cli {

namespace {

using Kind = bt::Difference::Kind;

struct Look {
  const char* name;
  const char* sign;
  const char* colour;
};

Look look(Kind kind) {
  switch (kind) {
    case Kind::kAdded: return {"added", "+", "\x1b[32m"};
    case Kind::kRemoved: return {"removed", "-", "\x1b[31m"};
    case Kind::kChanged: return {"changed", "~", "\x1b[33m"};
    case Kind::kMoved: return {"moved", ">", "\x1b[36m"};
  }
  return {"", "", ""};
}

Value place(const SourceSpan& span) {
  if (span.line == 0) return {};
  return Map{{"file", span.file}, {"line", span.line}, {"column", span.column}};
}

// The place that the reader will want to open: in the new file, unless it is gone from there.
const SourceSpan& where(const bt::Difference& d) { return d.kind == Kind::kRemoved ? d.before : d.after; }

void tell(const std::vector<bt::Difference>& differences, bool colour) {
  std::string path;
  for (const bt::Difference& d : differences) {
    const Look shown = look(d.kind);
    if (d.path != path) print((colour ? "\x1b[1m" : "") + d.path + (colour ? "\x1b[0m" : "") + "\n");
    path = d.path;
    std::string line = std::string("  ") + (colour ? shown.colour : "") + shown.sign + " " + d.what;
    if (colour) line += "\x1b[0m";
    print(line + (colour ? "  \x1b[2m" : "  ") + to_string(where(d)) + (colour ? "\x1b[0m" : "") + "\n");
  }
  print(std::to_string(differences.size()) + (differences.size() == 1 ? " difference\n" : " differences\n"));
}

}  // namespace

int diff(const DiffCommand& command) {
  std::string sources[2];
  const std::string* names[2] = {&command.before, &command.after};
  for (int i = 0; i < 2; ++i) {
    auto source = read_named(*names[i]);
    if (!source) {
      say(to_string(source.error()));
      return kInvalidInput;
    }
    sources[i] = std::move(*source);
  }
  auto differences = bt::diff(sources[0], sources[1], command.before, command.after);
  if (!differences) {
    say(to_string(differences.error()));
    return kInvalidInput;
  }
  if (command.json) {
    List list;
    for (const bt::Difference& d : *differences) {
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
