#include "sentree/cli/live_view.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "sentree/cli/output.h"

namespace sentree::cli {

namespace {

constexpr std::size_t kEventsMax = 200;
constexpr auto kReset = "\x1b[0m";
constexpr auto kDim = "\x1b[2m";
constexpr auto kRed = "\x1b[31m";
constexpr auto kGreen = "\x1b[32m";
constexpr auto kYellow = "\x1b[33m";
constexpr auto kBlue = "\x1b[36m";
constexpr auto kBanner = "\x1b[97;41;1m";

std::string coloured(const char* colour, const std::string& text) { return colour + text + kReset; }

// Columns that a UTF-8 text takes when each character takes one.
std::size_t columns(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

std::string cut(const std::string& text, std::size_t width) {
  if (columns(text) <= width) return text;
  std::string out;
  std::size_t used = 0;
  for (const char c : text) {
    if ((static_cast<unsigned char>(c) & 0xC0) != 0x80 && ++used >= width) break;
    out += c;
  }
  return out + "…";
}

}  // namespace

LiveView::LiveView(const runtime::Plan& plan) : plan_(plan) {
  for (const auto& model : plan.monitors) verdicts_[model.name()] = "undecided";
  print("\x1b[?1049h\x1b[?25l");  // another screen, no cursor
  thread_ = std::thread([this] { draw_until_done(); });
}

LiveView::~LiveView() {
  {
    const std::lock_guard lock(mutex_);
    done_ = true;
  }
  changed_.notify_all();
  thread_.join();
  print("\x1b[?25h\x1b[?1049l");
}

void LiveView::attach(runtime::RunView* view) {
  const std::lock_guard lock(mutex_);
  view_ = view;
}

void LiveView::observe(const Message& message) {
  const std::lock_guard lock(mutex_);
  tick_ = message.tick;
  if (message.name == "node.status") {
    const auto node = static_cast<bt::NodeId>(message.data.find("node")->number());
    const std::string to(message.data.find("to")->text());
    status_[node] = to;
    if (to == "SUCCESS" || to == "FAILURE") {
      last_[node] = to;
      status_tick_[node] = message.tick;
    }
  }
  const std::string text = narrator_.tell(message);
  if (text.empty()) return;
  events_.push_back(text);
  if (events_.size() > kEventsMax) events_.pop_front();
}

void LiveView::decided(const runtime::MonitorReport& report) {
  const std::lock_guard lock(mutex_);
  verdicts_[report.name] = fmt::format("{} at {:.1f} s", to_string(report.verdict), seconds(report.decision->at));
  events_.push_back(time_column(report.decision->at) + "  monitor " + report.name + ": " +
                    std::string(to_string(report.verdict)));
}

void LiveView::note(const std::string& what) {
  const std::lock_guard lock(mutex_);
  events_.push_back(what);
  if (events_.size() > kEventsMax) events_.pop_front();
}

void LiveView::draw_until_done() {
  std::unique_lock lock(mutex_);
  while (!done_) {
    if (view_ != nullptr) print(frame());
    changed_.wait_for(lock, std::chrono::milliseconds(100), [&] { return done_; });
  }
}

std::vector<std::string> LiveView::tree_lines() const {
  std::vector<std::string> lines;
  std::vector<std::size_t> depth(plan_.tree.size(), 0);
  for (bt::NodeId node = 0; node < plan_.tree.size(); ++node) {
    const bt::NodeId parent = plan_.tree.parent(node);
    if (parent != bt::kNoNode) depth[node] = depth[parent] + 1;
    const auto present = status_.find(node);
    const bool running = present != status_.end() && present->second == "RUNNING";
    const auto completed = status_tick_.find(node);
    const bool fresh = completed != status_tick_.end() && completed->second + 1 >= tick_;
    std::string mark = coloured(kDim, "·");
    if (running)
      mark = coloured(kYellow, "▶");
    else if (fresh && last_.at(node) == "SUCCESS")
      mark = coloured(kGreen, "✓");
    else if (fresh)
      mark = coloured(kRed, "✗");
    std::string label(plan_.tree.name(node));
    const std::string id(plan_.tree.registration(node));
    if (id != label) label += "  " + std::string(kDim) + id + kReset;
    lines.push_back(std::string(depth[node] * 2, ' ') + mark + " " + label);
  }
  return lines;
}

std::vector<std::string> LiveView::map_lines(const sim::State& state, int width, int height) const {
  // Two rows of cells a line: half blocks. Each terminal cell shows the most occupied map cell below it.
  const sim::World& world = *plan_.world;
  const sim::GridMap& map = world.map;
  const double scale =
      std::max(static_cast<double>(map.width()) / width, static_cast<double>(map.height()) / (2.0 * height));
  const int w = std::min(width, static_cast<int>(map.width() / scale));
  const int h = std::min(2 * height, static_cast<int>(map.height() / scale)) & ~1;
  const auto wall = [&](int x, int y) {
    for (int j = static_cast<int>(y * scale); j < static_cast<int>((y + 1) * scale); ++j) {
      for (int i = static_cast<int>(x * scale); i < static_cast<int>((x + 1) * scale); ++i) {
        if (i < map.width() && j < map.height() && map.is_occupied({i, j})) return true;
      }
    }
    return false;
  };
  std::vector<std::vector<std::string>> cells(static_cast<std::size_t>(h / 2),
                                              std::vector<std::string>(static_cast<std::size_t>(w), " "));
  for (int row = 0; row < h / 2; ++row) {
    for (int x = 0; x < w; ++x) {
      const bool above = wall(x, h - 1 - 2 * row);
      const bool below = wall(x, h - 2 - 2 * row);
      cells[row][x] = above && below ? "█" : above ? "▀" : below ? "▄" : " ";
    }
  }
  const auto put = [&](const sim::Pose2& pose, const std::string& what) {
    const auto cell = map.cell_at({pose.x, pose.y});
    const int x = static_cast<int>(cell.x / scale);
    const int row = h / 2 - 1 - static_cast<int>(cell.y / scale) / 2;
    if (row >= 0 && row < h / 2 && x >= 0 && x < w) cells[row][x] = what;
  };
  for (const auto& location : world.locations) put(location.pose, coloured(kBlue, location.name.substr(0, 1)));
  for (const auto& station : world.stations) put(station.pose, coloured(kGreen, "⚡"));
  const sim::Pose2 robot = state.robots.front().truth.pose;
  constexpr const char* kArrows[] = {"→", "↗", "↑", "↖", "←", "↙", "↓", "↘"};
  const int direction = static_cast<int>(std::lround(robot.theta / (3.14159265358979 / 4)) + 8) % 8;
  put(robot, coloured(kYellow, kArrows[direction]));
  std::vector<std::string> lines;
  for (const auto& row : cells) {
    std::string text;
    for (const std::string& cell : row) text += cell;
    lines.push_back(text);
  }
  return lines;
}

std::string LiveView::frame() {
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0)
    size = {.ws_row = 40, .ws_col = 120, .ws_xpixel = 0, .ws_ypixel = 0};
  const int width = size.ws_col;
  const int height = size.ws_row;
  const auto state = view_->world();
  std::vector<std::string> lines;
  std::string head = fmt::format(" {}   {:.1f} s   tick {}", plan_.scenario.name, seconds(view_->now()), tick_);
  if (state) {
    const double charge = state->robots.front().battery.charge * 100.0;
    const int blocks = static_cast<int>(std::lround(charge / 5));
    std::string bar;
    for (int i = 0; i < 20; ++i) bar += i < blocks ? "█" : "░";
    head += fmt::format("   battery {} {:.1f} %",
                        coloured(charge < 20   ? kRed
                                 : charge < 30 ? kYellow
                                               : kGreen,
                                 bar),
                        charge);
  }
  lines.push_back(head);
  std::string lights;
  bool violated = false;
  for (const auto& [name, verdict] : verdicts_) {
    const bool bad = verdict.starts_with("violated");
    violated = violated || bad;
    lights += bad ? coloured(kBanner, " ✗ " + name + ": " + verdict + " ") + " "
                  : coloured(kGreen, " ● ") + name + ": " + verdict + "  ";
  }
  lines.push_back(lights);
  lines.push_back("");
  const int room = height - 3;
  if (state && room >= 24) {
    for (const std::string& text : map_lines(*state, width - 2, std::min(room / 2, 20))) lines.push_back(" " + text);
    lines.push_back("");
  }
  const auto tree = tree_lines();
  const int left = height - static_cast<int>(lines.size()) - 1;
  const std::size_t tree_width = 52;
  const std::size_t event_width =
      width > static_cast<int>(tree_width) + 20 ? static_cast<std::size_t>(width) - tree_width - 4 : 0;
  const std::size_t rows = static_cast<std::size_t>(std::max(left, 1));
  const std::size_t first_event = events_.size() > rows ? events_.size() - rows : 0;
  for (std::size_t i = 0; i < rows; ++i) {
    std::string text = i < tree.size() ? " " + tree[i] : "";
    if (event_width > 0 && first_event + i < events_.size()) {
      text += fmt::format("\x1b[{}G│ {}", tree_width, cut(events_[first_event + i], event_width));
    }
    lines.push_back(text);
  }
  std::string out = "\x1b[H";
  for (std::size_t i = 0; i < lines.size() && i < static_cast<std::size_t>(height); ++i) {
    out += lines[i] + "\x1b[K" + (i + 1 < static_cast<std::size_t>(height) ? "\r\n" : "");
  }
  return out + "\x1b[J";
}

}  // namespace sentree::cli
