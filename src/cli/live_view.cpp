#include "sentree/cli/live_view.h"

#include <fmt/format.h>
#include <algorithm>
#include <cctype>
#include <chrono>
#include <utility>

#include "sentree/cli/colours.h"
#include "sentree/cli/output.h"

namespace sentree::cli {

namespace {

constexpr std::size_t kEventsMax = 200;

// Calls `see(bytes, takes a column)` for each character of a UTF-8 text and each escape sequence.
template <class See>
void each_character(const std::string& text, See see) {
  for (std::size_t at = 0; at < text.size();) {
    std::size_t end = at + 1;
    const bool escape = text[at] == '\x1b';
    if (escape) {
      while (end < text.size() && std::isalpha(static_cast<unsigned char>(text[end])) == 0) ++end;
      end = std::min(end + 1, text.size());
    } else {
      while (end < text.size() && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) ++end;
    }
    see(std::string_view(text).substr(at, end - at), !escape);
    at = end;
  }
}

// Columns that a text takes when each character takes one.
std::size_t columns(const std::string& text) {
  std::size_t count = 0;
  each_character(text, [&](std::string_view, bool visible) { count += visible ? 1 : 0; });
  return count;
}

// The text's beginning, with all its colours.
std::string cut(const std::string& text, std::size_t width) {
  if (columns(text) <= width) return text;
  std::string out;
  std::size_t used = 0;
  each_character(text, [&](std::string_view bytes, bool visible) {
    if (visible && ++used > width) return;
    out += visible && used == width ? "…" : bytes;
  });
  return out;
}

// As many of the pieces on a line as there is room for.
void add_wrapped(std::vector<std::string>& lines, const std::vector<std::string>& pieces, std::size_t width) {
  std::string text;
  for (const std::string& piece : pieces) {
    if (!text.empty() && columns(text) + columns(piece) > width) lines.push_back(std::exchange(text, {}));
    text += cut(piece, width);
  }
  lines.push_back(text);
}

}  // namespace

LiveView::LiveView(const project::Plan& plan) : plan_(plan) {
  for (const auto& model : plan.monitors) verdicts_[model.name()] = "undecided";
  print_screen("\x1b[?1049h\x1b[?25l");  // another screen, no cursor
  thread_ = std::thread([this] { draw_until_done(); });
}

LiveView::~LiveView() {
  {
    const std::lock_guard lock(mutex_);
    done_ = true;
  }
  changed_.notify_all();
  thread_.join();
  print_screen("\x1b[?25h\x1b[?1049l");
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
  events_.push_back(
      fmt::format("{}  monitor {}: {}", time_column(report.decision->at), report.name, to_string(report.verdict)));
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
    if (id != label) label += fmt::format("  {}{}{}", kDim, id, kReset);
    lines.push_back(fmt::format("{}{} {}", std::string(depth[node] * 2, ' '), mark, label));
  }
  return lines;
}

std::vector<std::string> LiveView::frame(const TerminalSize& size) {
  const auto width = static_cast<std::size_t>(std::max(size.columns, 1));
  const auto state = view_->world();
  std::vector<std::string> lines;
  std::vector<std::string> head{" " + plan_.scenario.name, fmt::format("   {:.1f} s", seconds(view_->now())),
                                fmt::format("   tick {}", tick_)};
  if (state) {
    for (std::size_t i = 0; i < state->robots.size(); ++i) {
      const double charge = state->robots[i].battery.charge;
      const std::string of = state->robots.size() > 1 ? plan_.world->robots[i].name : "battery";
      head.push_back(fmt::format("   {} {} {:.1f} %", of, battery_bar(charge), charge * 100.0));
    }
  }
  add_wrapped(lines, head, width);
  std::vector<std::string> lights;
  for (const auto& [name, verdict] : verdicts_) {
    lights.push_back(verdict.starts_with("violated")
                         ? coloured(kBanner, fmt::format(" ✗ {}: {} ", name, verdict)) + " "
                         : fmt::format("{}{}: {}  ", coloured(kGreen, " ● "), name, verdict));
  }
  add_wrapped(lines, lights, width);
  lines.push_back("");
  const int room = size.rows - static_cast<int>(lines.size());
  if (state && room >= 24) {
    for (const std::string& text :
         map_lines(*plan_.world, *state, std::max(size.columns - 2, 1), std::min(room / 2, 20)))
      lines.push_back(" " + text);
    lines.push_back("");
  }
  const auto tree = tree_lines();
  const auto rows = static_cast<std::size_t>(std::max(size.rows - static_cast<int>(lines.size()) - 1, 1));
  const auto event = [&](std::size_t back) -> std::string {
    return back <= events_.size() ? events_[events_.size() - back] : std::string();
  };
  constexpr std::size_t kTreeWidth = 52;
  if (width > kTreeWidth + 20) {  // the events beside the tree
    const std::size_t shown = std::min(rows, events_.size());
    for (std::size_t i = 0; i < rows; ++i) {
      std::string text = i < tree.size() ? cut(" " + tree[i], kTreeWidth - 1) : "";
      if (i < shown)
        text += fmt::format("{}│ {}", std::string(kTreeWidth - 1 - columns(text), ' '),
                            cut(event(shown - i), width - kTreeWidth - 4));
      lines.push_back(text);
    }
    return lines;
  }
  const std::size_t below = std::min(rows / 3, events_.size());
  for (std::size_t i = 0; i + below < rows; ++i) lines.push_back(i < tree.size() ? cut(" " + tree[i], width) : "");
  for (std::size_t i = 0; i < below; ++i) lines.push_back(cut(event(below - i), width));
  return lines;
}

}  // namespace sentree::cli
