#include "sentree/bt/load.h"
#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/png.h"
#include "sentree/cli/tour.h"
#include "sentree/draw/chart.h"
#include "sentree/draw/tree.h"
#include "sentree/graph/chart.h"
#include "sentree/graph/tree.h"
#include "sentree/project/plan.h"
#include "sentree/project/project.h"
#include "sentree/sim/drawing.h"
#include "sentree/sim/services.h"
#include "sentree/sim/simulation.h"
#include "sentree/text/file.h"
#include "sentree/text/xml.h"

namespace sentree::cli {

namespace {

std::string format_of(const GraphCommand& command) {
  if (!command.format.empty()) return command.format;
  const std::string ending = std::filesystem::path(command.output).extension().string();
  if (ending == ".png") return "png";
  if (ending == ".dot" || ending == ".gv") return "dot";
  if (ending == ".mmd" || ending == ".mermaid") return "mermaid";
  if (ending == ".puml" || ending == ".plantuml") return "plantuml";
  return "svg";
}

/// What to draw, and the C++ nodes that a tree of a project may have.
struct Drawn {
  std::string file;
  std::string tree;
  bt::Registry registry;
};

// A project stands for its mission.
std::optional<Drawn> drawn(const GraphCommand& command) {
  std::error_code error;
  const std::filesystem::path path(command.file);
  if (!std::filesystem::is_directory(path, error) && path.filename() != "sentree.yaml")
    return Drawn{command.file, command.tree, {}};
  const auto project = project::load_project(path);
  say(project.diagnostics);
  if (!project.ok()) return std::nullopt;
  Drawn found{(project.value->folder / project.value->mission.path).string(),
              command.tree.empty() ? project.value->tree : command.tree,
              {}};
  Diagnostics problems;
  if (project::load_plugins(*project.value, found.registry, problems)) return found;
  say(problems);
  return std::nullopt;
}

std::optional<std::string> draw_tree(std::string source, const Drawn& what, const GraphCommand& command,
                                     const std::string& format) {
  bt::LoadOptions options;
  options.registry = &what.registry;
  options.main_tree = what.tree;
  options.read_file = [](const std::filesystem::path& path) { return text::read_file(path); };
  const auto tree = bt::load(std::move(source), options, what.file);
  say(tree.diagnostics);
  if (!tree.ok()) return std::nullopt;
  draw::Tree picture = graph::drawing_of(*tree.value);
  picture.direction = command.direction == "auto"    ? draw::best_direction(picture)
                      : command.direction == "right" ? draw::Direction::kRight
                                                     : draw::Direction::kDown;
  if (format == "svg" || format == "png") return draw::to_svg(picture);
  if (format == "dot") return draw::to_dot(picture);
  return draw::to_mermaid(picture);
}

std::optional<std::string> draw_chart(const std::string& source, const std::string& file, const std::string& format) {
  const auto chart = scxml::load(source, file);
  say(chart.diagnostics);
  if (!chart.ok()) return std::nullopt;
  const draw::Chart picture = graph::drawing_of(*chart.value);
  if (format == "svg" || format == "png") return draw::to_svg(picture);
  if (format == "dot") return draw::to_dot(picture);
  if (format == "mermaid") return draw::to_mermaid(picture);
  return draw::to_plantuml(picture);
}

// The world at its start, or on the way of a tour.
int draw_world(const GraphCommand& command, std::string& picture) {
  const auto world = sim::load_world(command.file);
  say(world.diagnostics);
  if (!world.ok()) return kInvalidInput;
  auto tour = Tour::parse(*world.value, command.stops);
  if (!tour) {
    say(tour.error().message);
    return kUsage;
  }
  Duration after{};
  if (!command.after.empty()) {
    const auto parsed = project::parse_duration(command.after);
    if (!parsed || *parsed > sim::kAdvanceMax) {
      say("--after " + command.after + ": not a duration such as 20 s, at most a day");
      return kUsage;
    }
    after = *parsed;
  }
  sim::State state = sim::initial_state(*world.value, command.seed);
  state.clock.paused = true;
  const Tour::Call call = [&](const std::string& robot, const std::string& method, const Map& arguments) {
    return sim::call(*world.value, state,
                     {.service = "Navigation", .method = method, .args = arguments, .robot = robot}, {});
  };
  while (state.time.time_since_epoch() < after) {
    tour->step(call);
    sim::advance_by(*world.value, state,
                    std::min<Duration>(std::chrono::milliseconds(100),
                                       std::max(world.value->step, after - state.time.time_since_epoch())));
  }
  // As large as fits a page; labels keep their size.
  constexpr double kPixels = 1200.0;
  const sim::GridMap& map = world.value->map;
  const double side_m = std::max(map.width(), map.height()) * map.resolution_m();
  picture = sim::to_svg(*world.value, state, {.pixels_per_m = std::clamp(kPixels / side_m, 1.0, 100.0)});
  return kOk;
}

int deliver(const GraphCommand& command, const std::string& format, const std::string& picture) {
  if (format == "png") return write_png(picture, command.output);
  if (command.output.empty()) {
    print(picture);
    return kOk;
  }
  if (const auto written = text::write_file(command.output, picture); !written) {
    say(to_string(written.error()));
    return kEnvironment;
  }
  return kOk;
}

}  // namespace

int graph(const GraphCommand& command) {
  const std::string format = format_of(command);
  if (is_world(command.file)) {
    if (format != "svg" && format != "png") {
      say("a world can be drawn as svg or png");
      return kUsage;
    }
    std::string picture;
    const int code = draw_world(command, picture);
    return code == kOk ? deliver(command, format, picture) : code;
  }
  const auto what = drawn(command);
  if (!what) return kInvalidInput;
  auto source = text::read_file(what->file);
  if (!source) {
    say(to_string(source.error()));
    return kInvalidInput;
  }
  const auto document = text::XmlDocument::parse(*source, what->file, {.lenient = true});
  if (!document) {
    say(to_string(document.error()));
    return kInvalidInput;
  }
  const bool is_chart = document->root().local_name() == "scxml";
  if (!is_chart && format == "plantuml") {
    say("PlantUML is for state charts; a tree can be drawn as svg, png, dot or mermaid");
    return kUsage;
  }
  const auto picture = is_chart ? draw_chart(*source, what->file, format) : draw_tree(*source, *what, command, format);
  if (!picture) return kInvalidInput;
  return deliver(command, format, *picture);
}

}  // namespace sentree::cli
