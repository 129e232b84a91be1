#include "sentree/cli/terminal_map.h"

#include <fmt/format.h>

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sentree/cli/colours.h"
#include "sentree/cli/output.h"

namespace sentree::cli {

namespace {

// The map's cells in characters of the terminal, two rows of cells a character.
class Screen {
 public:
  Screen(const sim::GridMap& map, int width, int height) : map_(map) {
    scale_ =
        std::max({1e-9, static_cast<double>(map.width()) / width, static_cast<double>(map.height()) / (2 * height)});
    columns_ = std::max(1, std::min(width, static_cast<int>(std::ceil(map.width() / scale_))));
    rows_ = std::max(1, std::min(height, static_cast<int>(std::ceil(map.height() / scale_ / 2))));
    cells_.assign(static_cast<std::size_t>(rows_), std::vector<std::string>(static_cast<std::size_t>(columns_), " "));
    for (int row = 0; row < rows_; ++row) {
      for (int x = 0; x < columns_; ++x) {
        const bool above = wall(x, 2 * (rows_ - 1 - row) + 1);
        const bool below = wall(x, 2 * (rows_ - 1 - row));
        at(row, x) = above && below ? "█" : above ? "▀" : below ? "▄" : " ";
      }
    }
  }

  void put(sim::Vec2 point, const std::string& what, bool over_walls = true) {
    const sim::Vec2 grid = map_.to_grid(point);
    const int x = static_cast<int>(std::floor(grid.x / scale_));
    const int row = rows_ - 1 - static_cast<int>(std::floor(grid.y / scale_ / 2));
    if (row < 0 || row >= rows_ || x < 0 || x >= columns_) return;
    if (over_walls || at(row, x) == " ") at(row, x) = what;
  }
  void line(sim::Vec2 a, sim::Vec2 b, const std::string& what, bool over_walls) {
    const double step = scale_ * map_.resolution_m() / 2;
    const int steps = std::min(10'000, static_cast<int>(distance(a, b) / step) + 1);
    for (int i = 0; i <= steps; ++i) put(a + (static_cast<double>(i) / steps) * (b - a), what, over_walls);
  }
  std::vector<std::string> lines() const {
    std::vector<std::string> lines;
    for (const auto& row : cells_) {
      std::string text;
      for (const std::string& cell : row) text += cell;
      lines.push_back(text);
    }
    return lines;
  }

 private:
  std::string& at(int row, int x) { return cells_[static_cast<std::size_t>(row)][static_cast<std::size_t>(x)]; }
  // Some cell below this half of a character is a wall.
  bool wall(int x, int y) const {
    const auto begin = [&](int i) { return static_cast<int>(i * scale_); };
    for (int j = begin(y); j < std::max(begin(y) + 1, begin(y + 1)); ++j) {
      for (int i = begin(x); i < std::max(begin(x) + 1, begin(x + 1)); ++i) {
        if (map_.is_occupied({i, j})) return true;
      }
    }
    return false;
  }

  const sim::GridMap& map_;
  double scale_ = 1.0;  // cells a character's width
  int columns_ = 0;
  int rows_ = 0;
  std::vector<std::vector<std::string>> cells_;
};

std::string first_letter(const std::string& name) {
  std::size_t end = 1;
  while (end < name.size() && (static_cast<unsigned char>(name[end]) & 0xC0U) == 0x80U) ++end;
  return name.substr(0, end);
}

}  // namespace

std::vector<std::string> map_lines(const sim::World& world, const sim::State& state, int width, int height) {
  Screen screen(world.map, width, height);
  for (const auto& robot : state.robots) {
    const auto& path = robot.navigator.path;
    for (std::size_t i = robot.navigator.passed; i + 1 < path.size(); ++i)
      screen.line(path[i], path[i + 1], coloured(kGreen, "·"), false);
  }
  for (const auto& door : state.doors) {
    if (!door.open) screen.line(door.a, door.b, coloured(kBrown, "▒"), true);
  }
  for (const auto& obstacle : state.obstacles) {
    const sim::Shape& shape = obstacle.shape;
    screen.put(shape.pose.position(), coloured(kBrown, "▒"));
    if (shape.kind == sim::Shape::Kind::kBox) {
      const sim::Vec2 half = sim::rotated({shape.length_m / 2, 0.0}, shape.pose.theta);
      screen.line(shape.pose.position() - half, shape.pose.position() + half, coloured(kBrown, "▒"), true);
    }
  }
  for (const auto& location : state.locations)
    screen.put(location.pose.position(), coloured(kBlue, first_letter(location.name)));
  for (const auto& station : world.stations) screen.put(station.pose.position(), coloured(kGreen, "⚡"));
  constexpr const char* kArrows[] = {"→", "↗", "↑", "↖", "←", "↙", "↓", "↘"};
  for (const auto& robot : state.robots) {
    const sim::Pose2& pose = robot.truth.pose;
    const double in_map = pose.theta - world.map.origin().theta;
    const auto direction = static_cast<std::size_t>(std::lround(in_map / (std::numbers::pi / 4)) + 16) % 8;
    screen.put(pose.position(), coloured(kYellow, kArrows[direction]));
  }
  return screen.lines();
}

std::string battery_bar(double charge) {
  const auto blocks = std::lround(charge * 20);
  std::string bar;
  for (int i = 0; i < 20; ++i) bar += i < blocks ? "█" : "░";
  return coloured(charge < 0.2 ? kRed : charge < 0.3 ? kYellow : kGreen, bar);
}

TerminalSize terminal_size() {
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return {};
  return {size.ws_col, size.ws_row};
}

void print_frame(const std::vector<std::string>& lines, const TerminalSize& size) {
  const auto rows = static_cast<std::size_t>(size.rows);
  std::string out = "\x1b[H";
  for (std::size_t i = 0; i < lines.size() && i < rows; ++i)
    out += fmt::format("{}\x1b[K{}", shown_in_colour(lines[i]), i + 1 < rows ? "\r\n" : "");
  print_screen(out + "\x1b[J");
}

}  // namespace sentree::cli
