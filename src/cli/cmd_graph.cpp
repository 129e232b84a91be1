#include "sentree/bt/graph.h"
#include "sentree/bt/load.h"
#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/draw/chart.h"
#include "sentree/draw/tree.h"
#include "sentree/runtime/project.h"
#include "sentree/scxml/graph.h"
#include "sentree/text/file.h"
#include "sentree/text/xml.h"

namespace sentree::cli {

namespace {

std::string format_of(const GraphCommand& command) {
  if (!command.format.empty()) return command.format;
  const std::string ending = std::filesystem::path(command.output).extension().string();
  if (ending == ".dot" || ending == ".gv") return "dot";
  if (ending == ".mmd" || ending == ".mermaid") return "mermaid";
  if (ending == ".puml" || ending == ".plantuml") return "plantuml";
  return "svg";
}

// A project stands for its mission.
std::optional<std::string> file_of(const GraphCommand& command) {
  std::error_code error;
  const std::filesystem::path path(command.file);
  if (!std::filesystem::is_directory(path, error) && path.filename() != "sentree.yaml") return command.file;
  const auto project = runtime::load_project(path);
  say(project.diagnostics);
  if (!project.ok()) return std::nullopt;
  return (project.value->folder / project.value->mission.path).string();
}

std::optional<std::string> draw_tree(std::string source, const std::string& file, const GraphCommand& command,
                                     const std::string& format) {
  bt::LoadOptions options;
  options.main_tree = command.tree;
  options.read_file = [](const std::filesystem::path& path) { return text::read_file(path); };
  const auto tree = bt::load(std::move(source), options, file);
  say(tree.diagnostics);
  if (!tree.ok()) return std::nullopt;
  const draw::Tree picture = bt::to_graph(*tree.value);
  if (format == "svg") return draw::to_svg(picture);
  if (format == "dot") return draw::to_dot(picture);
  return draw::to_mermaid(picture);
}

std::optional<std::string> draw_chart(const std::string& source, const std::string& file, const std::string& format) {
  const auto chart = scxml::load(source, file);
  say(chart.diagnostics);
  if (!chart.ok()) return std::nullopt;
  const draw::Chart picture = scxml::to_graph(*chart.value);
  if (format == "svg") return draw::to_svg(picture);
  if (format == "dot") return draw::to_dot(picture);
  if (format == "mermaid") return draw::to_mermaid(picture);
  return draw::to_plantuml(picture);
}

}  // namespace

int graph(const GraphCommand& command) {
  const std::string format = format_of(command);
  const auto file = file_of(command);
  if (!file) return kInvalidInput;
  auto source = text::read_file(*file);
  if (!source) {
    say(to_string(source.error()));
    return kInvalidInput;
  }
  const auto document = text::XmlDocument::parse(*source, *file, {.lenient = true});
  if (!document) {
    say(to_string(document.error()));
    return kInvalidInput;
  }
  const bool is_chart = document->root().local_name() == "scxml";
  if (!is_chart && format == "plantuml") {
    say("PlantUML is for state charts; a tree can be drawn as svg, dot or mermaid");
    return kUsage;
  }
  const auto picture = is_chart ? draw_chart(*source, *file, format) : draw_tree(*source, *file, command, format);
  if (!picture) return kInvalidInput;
  if (command.output.empty()) {
    print(*picture);
    return kOk;
  }
  if (const auto written = text::write_file(command.output, *picture); !written) {
    say(to_string(written.error()));
    return kEnvironment;
  }
  return kOk;
}

}  // namespace sentree::cli
