#include "sentree/cli/document.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <tuple>
#include <vector>

#include "sentree/cli/shell_word.h"
#include "sentree/scxml/diff.h"
#include "sentree/text/file.h"
#include "sentree/text/xml.h"

namespace sentree::cli {

namespace {

constexpr std::size_t kLinesNamedMax = 5;

struct Finding {
  Diagnostic first;
  std::vector<int> lines;  ///< Of all, the first one's included.
};

// By what they say and in which file; in the order of the first of each.
std::vector<Finding> grouped_findings(const Diagnostics& diagnostics) {
  std::vector<Finding> findings;
  std::map<std::tuple<Severity, std::string_view, std::string_view, std::string_view>, std::size_t> known;
  for (const Diagnostic& d : diagnostics) {
    const auto [place, added] = known.try_emplace({d.severity, d.span.file, d.code, d.message}, findings.size());
    if (added) findings.push_back({d, {}});
    findings[place->second].lines.push_back(d.span.line);
  }
  return findings;
}

std::string line_of(const Finding& finding) {
  std::string text = to_string(finding.first);
  const std::size_t count = finding.lines.size();
  if (count == 1) return text + "\n";
  text += fmt::format(" (×{}", count);
  int last = finding.lines.front();
  std::size_t named = 0;
  for (const int line : finding.lines) {
    if (line == last) continue;
    if (++named > kLinesNamedMax) break;
    text += (named == 1 ? ", also in line " : ", ") + std::to_string(line);
    last = line;
  }
  return text + (named > kLinesNamedMax ? ", …)\n" : ")\n");
}

}  // namespace

bool is_xml_source(std::string_view source) {
  if (source.starts_with("\xEF\xBB\xBF")) source.remove_prefix(3);
  const std::size_t first = source.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && source[first] == '<';
}

bool is_chart_source(std::string_view source) {
  if (!is_xml_source(source)) return false;
  if (const auto document = text::XmlDocument::parse(std::string(source), {}, {.lenient = true}))
    return scxml::is_chart(document->root());
  for (std::size_t at = source.find('<'); at != std::string_view::npos; at = source.find('<', at + 1)) {
    if (source.substr(at).starts_with("<!--")) {
      at = source.find("-->", at);
      if (at == std::string_view::npos) break;
      continue;
    }
    const std::string_view rest = source.substr(at + 1);
    if (rest.starts_with('?') || rest.starts_with('!')) continue;
    std::string_view name = rest.substr(0, rest.find_first_of(" \t\r\n/>"));
    if (const std::size_t colon = name.find(':'); colon != std::string_view::npos) name.remove_prefix(colon + 1);
    return name == "scxml" || name == "ascxml";
  }
  return false;
}

std::function<Result<std::string>(std::string_view)> reader_beside(const std::filesystem::path& chart) {
  return [folder = chart.parent_path()](std::string_view uri) -> Result<std::string> {
    return text::read_file(folder / (uri.starts_with("file:") ? uri.substr(5) : uri), std::string(uri));
  };
}

Loaded<scxml::Chart> look_at_chart(std::string_view source, const std::string& file) {
  scxml::LoadOptions options;
  options.to_run = false;
  options.read = reader_beside(file);
  return scxml::load(source, file, options);
}

std::string told(const Diagnostics& diagnostics) {
  std::vector<Finding> findings = grouped_findings(diagnostics);
  const auto is_error = [](const Finding& finding) { return finding.first.severity == Severity::kError; };
  std::size_t left_out = 0;
  if (findings.size() > kFindingsShownMax) {
    std::stable_partition(findings.begin(), findings.end(), is_error);
    left_out = findings.size() - kFindingsShownMax;
    findings.resize(kFindingsShownMax);
  }
  std::string text;
  for (const Finding& finding : findings) text += line_of(finding);
  if (left_out > 0) text += fmt::format("… and {} more findings of other kinds\n", left_out);
  return text;
}

std::string warnings_in_short(const Diagnostics& diagnostics, const std::string& project) {
  std::size_t count = 0;
  std::string file;
  bool one_file = true;
  for (const Diagnostic& d : diagnostics) {
    if (d.severity != Severity::kWarning) continue;
    one_file = one_file && (count == 0 || d.span.file == file);
    file = d.span.file;
    ++count;
  }
  if (count == 0) return {};
  if (!one_file) file.clear();
  const std::string& checked = project.empty() ? file : project;
  return fmt::format("{}{}{}; `sentree check{}` tells {}", count, count == 1 ? " warning" : " warnings",
                     file.empty() ? "" : " in " + file,
                     checked.empty() || checked == "." ? "" : " " + shell_word(checked), count == 1 ? "it" : "them");
}

}  // namespace sentree::cli
