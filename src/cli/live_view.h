#pragma once

#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "sentree/cli/report.h"
#include "sentree/cli/terminal_map.h"
#include "sentree/runtime/run.h"

namespace sentree::cli {

/// The run in a terminal: map with robot, battery, tree with statuses, monitors, the last events; drawn ten times a
/// second by a thread of its own. On a terminal that is too small it leaves out the map.
class LiveView {
 public:
  explicit LiveView(const project::Plan& plan);
  ~LiveView();
  LiveView(const LiveView&) = delete;
  LiveView& operator=(const LiveView&) = delete;

  void observe(const Message& message);
  void decided(const runtime::MonitorReport& report);
  void note(const std::string& what);
  /// Null ends the drawing.
  void attach(runtime::RunView* view);

 private:
  void draw_until_done();
  [[nodiscard]] std::vector<std::string> frame(const TerminalSize& size);
  [[nodiscard]] std::vector<std::string> tree_lines() const;

  const project::Plan& plan_;
  Narrator narrator_;
  std::mutex mutex_;
  std::condition_variable changed_;
  runtime::RunView* view_ = nullptr;
  bool done_ = false;
  std::uint64_t tick_ = 0;
  std::map<bt::NodeId, std::string> status_;         // present status
  std::map<bt::NodeId, std::uint64_t> status_tick_;  // tick of its last completed status
  std::map<bt::NodeId, std::string> last_;           // last completed status
  std::map<std::string, std::string> verdicts_;
  std::deque<std::string> events_;
  std::thread thread_;
};

}  // namespace sentree::cli
