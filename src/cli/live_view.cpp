#include "sentree/cli/live_view.h"

#include <fmt/format.h>
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

LiveView::LiveView(const project::Plan& plan) : plan_(plan) {
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
    if (view_ != nullptr) {
      const TerminalSize size = terminal_size();
      print_frame(frame(size), size);
    }
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

std::vector<std::string> LiveView::frame(const TerminalSize& size) {
  const int width = size.columns;
  const int height = size.rows;
  const auto state = view_->world();
  std::vector<std::string> lines;
  std::string head = fmt::format(" {}   {:.1f} s   tick {}", plan_.scenario.name, seconds(view_->now()), tick_);
  if (state) {
    for (std::size_t i = 0; i < state->robots.size(); ++i) {
      const double charge = state->robots[i].battery.charge;
      const std::string of = state->robots.size() > 1 ? plan_.world->robots[i].name : "battery";
      head += fmt::format("   {} {} {:.1f} %", of, battery_bar(charge), charge * 100.0);
    }
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
    for (const std::string& text : map_lines(*plan_.world, *state, width - 2, std::min(room / 2, 20)))
      lines.push_back(" " + text);
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
  return lines;
}

}  // namespace sentree::cli
