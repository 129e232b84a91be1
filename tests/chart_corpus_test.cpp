// State charts of public projects: whoever wrote them, for whatever engine, they load, draw, format and compare. They
// lie beside the repository, or where SENTREE_CORPUS says, and are no part of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "sentree/draw/chart.h"
#include "sentree/graph/chart.h"
#include "sentree/scxml/check.h"
#include "sentree/scxml/diff.h"
#include "sentree/scxml/format.h"
#include "sentree/text/file.h"
#include "sentree/text/xml.h"

namespace sentree {
namespace {

namespace fs = std::filesystem;

/// Files that are wrong, and stay refused.
const std::map<std::string, std::string> kWrong{
    {"convince-project+scan/scan_scxml/tests/assets/test_datamodel/fsm.scxml", "not well-formed: \"<\" in a condition"},
    {"apache+commons-scxml/src/test/java/org/apache/commons/scxml2/io/scxml-invalid-transition-targets-test2.xml",
     "initial states that cannot be active together, on purpose"},
};

fs::path corpus() {
  if (const char* given = std::getenv("SENTREE_CORPUS")) return given;
  return fs::path(SENTREE_SOURCE_FOLDER) / ".." / "shared" / "corpus";
}

std::string first_error(const Diagnostics& diagnostics) {
  const auto error = std::find_if(diagnostics.begin(), diagnostics.end(),
                                  [](const Diagnostic& d) { return d.severity == Severity::kError; });
  return error == diagnostics.end() ? std::string() : error->code + ": " + to_string(*error);
}

// What goes wrong with a chart on its way through the commands; empty: nothing.
std::string trouble(const std::string& source, const fs::path& file) {
  scxml::LoadOptions options;
  options.to_run = false;
  options.read = [&](std::string_view uri) { return text::read_file(file.parent_path() / std::string(uri)); };
  const auto chart = scxml::load(source, file.filename().string(), options);
  if (!chart.ok()) return first_error(chart.diagnostics);
  if (const std::string error = first_error(scxml::check(*chart.value)); !error.empty()) return error;

  const draw::Chart drawing = graph::drawing_of(*chart.value);
  if (draw::to_svg(drawing).find("</svg>") == std::string::npos) return "no drawing";
  for (const std::string& text : {draw::to_dot(drawing), draw::to_mermaid(drawing), draw::to_plantuml(drawing)}) {
    if (text.empty()) return "no drawing as text";
  }

  const auto once = scxml::format(source);
  if (!once) return "format: " + to_string(once.error());
  const auto twice = scxml::format(*once);
  if (!twice || *twice != *once) return "formatting twice is not formatting once";
  const auto kept = scxml::diff(source, *once);
  if (!kept || !kept->empty()) return "formatting changes " + (kept ? kept->front().path : std::string("everything"));
  const auto same = scxml::diff(source, source);
  if (!same || !same->empty()) return "it differs from itself";

  // Without its first element inside the root it is another chart.
  const auto document = text::XmlDocument::parse(source, {}, {.lenient = true});
  const text::XmlElement first = document->root().first_child();
  if (!first) return {};
  text::XmlEdit edit(*document);
  edit.remove(first);
  const auto other = scxml::diff(source, *edit.apply());
  if (!other || other->empty()) return "it is the same without its first element";
  return {};
}

TEST(ChartCorpus, ChartsOfOthersLoadDrawFormatAndCompare) {
  const fs::path folder = corpus() / "scxml";
  if (!fs::is_directory(folder)) GTEST_SKIP() << "SKIPPED: the charts of others are not in " << folder.string();
  std::size_t charts = 0;
  std::size_t well_formed = 0;
  std::map<std::string, std::string> refused;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string ending = entry.path().extension().string();
    if (!entry.is_regular_file() || (ending != ".scxml" && ending != ".ascxml" && ending != ".xml")) continue;
    const auto source = text::read_file(entry.path());
    ASSERT_TRUE(source) << entry.path();
    const auto strict = text::XmlDocument::parse(*source);
    const auto lenient = text::XmlDocument::parse(*source, {}, {.lenient = true});
    if (lenient && !scxml::is_chart(lenient->root())) continue;
    ++charts;
    well_formed += strict ? 1 : 0;
    const std::string what = trouble(*source, entry.path());
    if (!what.empty()) refused.emplace(fs::relative(entry.path(), folder).string(), what);
  }
  for (const auto& [file, what] : refused) {
    if (!kWrong.contains(file)) std::cout << file << "\n  " << what << "\n";
  }
  const std::size_t taken = charts - refused.size();
  std::cout << taken << " of " << charts << " charts (" << well_formed << " well-formed)\n";
  EXPECT_GE(10 * taken, 9 * well_formed);
  for (const auto& [file, why] : kWrong) {
    EXPECT_TRUE(!fs::exists(folder / file) || refused.contains(file)) << file << " is wrong: " << why;
  }
  EXPECT_LE(refused.size(), kWrong.size());
}

}  // namespace
}  // namespace sentree
