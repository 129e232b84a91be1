#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "sentree/bt/palette.h"
#include "sentree/cli/commands.h"
#include "sentree/cli/document.h"
#include "sentree/cli/output.h"
#include "sentree/cli/png.h"
#include "sentree/cli/tour.h"
#include "sentree/cli/tree_files.h"
#include "sentree/draw/chart.h"
#include "sentree/draw/tree.h"
#include "sentree/graph/chart.h"
#include "sentree/graph/tree.h"
#include "sentree/project/mission_tree.h"
#include "sentree/project/project.h"
#include "sentree/sim/drawing.h"
#include "sentree/sim/services.h"
#include "sentree/sim/simulation.h"
#include "sentree/text/file.h"

namespace sentree::cli {

namespace {

// Empty: the file's ending is of none.
std::string format_of(const GraphCommand& command) {
  if (!command.format.empty()) return command.format;
  const std::string ending = std::filesystem::path(command.output).extension().string();
  if (ending == ".png") return "png";
  if (ending == ".dot" || ending == ".gv") return "dot";
  if (ending == ".mmd" || ending == ".mermaid") return "mermaid";
  if (ending == ".puml" || ending == ".plantuml") return "plantuml";
  return ending.empty() || ending == ".svg" ? "svg" : "";
}

draw::Direction direction_of(const draw::Tree& picture, const std::string& wanted) {
  if (wanted == "auto") return draw::best_direction(picture);
  return wanted == "right" ? draw::Direction::kRight : draw::Direction::kDown;
}

std::string written(draw::Tree picture, const GraphCommand& command, const std::string& format) {
  picture.direction = direction_of(picture, command.direction);
  if (format == "svg" || format == "png") return draw::to_svg(picture);
  return format == "dot" ? draw::to_dot(picture) : draw::to_mermaid(picture);
}

// A project stands for its mission.
std::optional<std::string> draw_project(const GraphCommand& command, const std::string& format) {
  auto project = project::load_project(command.files.front());
  say(project.diagnostics);
  if (!project.ok()) return std::nullopt;
  if (!command.tree.empty()) project.value->tree = command.tree;
  for (const std::string& palette : command.trees.palettes) project.value->palettes.push_back(palette_file(palette));
  for (const std::string& folder : command.trees.packages)
    project.value->packages.push_back({std::filesystem::absolute(folder).string(), {}});
  bt::Registry registry;
  const auto tree = project::load_mission(*project.value, registry, project::TreePurpose::kLook);
  say(tree.diagnostics);
  if (!tree.ok()) return std::nullopt;
  return written(graph::drawing_of(*tree.value), command, format);
}

// Of several trees the one that the user asks for, else the one that they begin with.
std::optional<std::string> draw_trees(const std::vector<GivenFile>& files, const GraphCommand& command,
                                      const std::string& format) {
  Diagnostics problems;
  const TreeFiles trees(files, command.trees, problems);
  say(problems);
  if (has_errors(problems)) return std::nullopt;
  const bt::TreeFile* const main = trees.library().main_file(command.tree);
  // A file alone says itself what is wrong with it.
  const std::filesystem::path file = files.size() == 1 || main == nullptr ? files.front().path : main->path;
  std::string tree = command.tree;
  if (files.size() > 1 && tree.empty() && main != nullptr && main->main_tree.empty() && !main->trees.empty()) {
    const auto roots = trees.library().roots();
    const auto root = std::find_if(main->trees.begin(), main->trees.end(), [&](const std::string& id) {
      return std::find(roots.begin(), roots.end(), id) != roots.end();
    });
    tree = root != main->trees.end() ? *root : main->trees.front();
    if (roots.size() > 1) {
      std::string others;
      for (const std::string& id : roots) others += (others.empty() ? "" : ", ") + id;
      say(fmt::format("drawn is {} of {}; --tree draws another one of {}", tree, file.string(), others));
    }
  }
  const auto loaded = trees.load(file, tree);
  say(loaded.diagnostics);
  if (loaded.ok()) return written(graph::drawing_of(*loaded.value), command, format);
  if (has_errors(loaded.diagnostics)) return std::nullopt;
  const auto source = text::read_file(file);
  const auto models = source ? bt::read_models(*source, file.string()) : tl::unexpected(source.error());
  return models ? std::optional(written(graph::drawing_of(*models), command, format)) : std::nullopt;
}

std::optional<std::string> draw_chart(const std::string& source, const std::string& file, const std::string& format) {
  const auto chart = look_at_chart(source, file);
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
  const auto world = sim::load_world(command.files.front());
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
      say(fmt::format("--after {}: not a duration such as 20 s, at most a day", command.after));
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
  if (format.empty()) {
    say(fmt::format(
        "{}: pictures are written as .svg, .png, .dot, .mmd (Mermaid) or .puml (PlantUML); --format says which where "
        "the name does not",
        command.output));
    return kUsage;
  }
  const auto no_tree_in = [&](const std::string& file, const char* what) {
    say(fmt::format("--tree {}: {} is {}; without --tree it is drawn", command.tree, file, what));
    return kUsage;
  };
  if (command.files.size() == 1 && is_world(command.files.front())) {
    if (!command.tree.empty()) return no_tree_in(command.files.front(), "a world");
    if (format != "svg" && format != "png") {
      say("a world can be drawn as svg or png");
      return kUsage;
    }
    std::string picture;
    const int code = draw_world(command, picture);
    return code == kOk ? deliver(command, format, picture) : code;
  }
  std::error_code error;
  const std::filesystem::path first(command.files.front());
  const bool is_project = first.filename() == "sentree.yaml" || std::filesystem::exists(first / "sentree.yaml", error);
  std::optional<std::string> picture;
  bool is_chart = false;
  std::string source;
  Diagnostics problems;
  const std::vector<GivenFile> files = is_project ? std::vector<GivenFile>() : given_files(command.files, problems);
  say(problems);
  if (has_errors(problems)) return kInvalidInput;
  if (!is_project && files.empty()) {
    say(first.string() + ": neither a tree nor a chart is in this folder");
    return kInvalidInput;
  }
  if (!is_project && files.size() == 1) {
    auto read = text::read_file(files.front().path);
    if (!read) {
      say(to_string(read.error()));
      return kInvalidInput;
    }
    source = std::move(*read);
    is_chart = document_kind(source) == "chart";
  }
  if (is_chart && !command.tree.empty()) return no_tree_in(files.front().path.string(), "a state chart");
  if (!is_chart && format == "plantuml") {
    say("PlantUML is for state charts; a tree can be drawn as svg, png, dot or mermaid");
    return kUsage;
  }
  picture = is_project ? draw_project(command, format)
            : is_chart ? draw_chart(source, files.front().path.string(), format)
                       : draw_trees(files, command, format);
  if (!picture) return kInvalidInput;
  return deliver(command, format, *picture);
}

}  // namespace sentree::cli
