#pragma once

#include <memory>
#include <string>

#include "sentree/replay/recording.h"
#include "sentree/runtime/run.h"
#include "sentree/studio/server.h"

namespace sentree::studio {

/// The page of a run that goes on.
///
/// It is there from the run's beginning (`start`, then `tap`), or opened later (`open`). Before, it costs nothing.
class Live {
 public:
  /// `plan` is borrowed. Errors: those of `Server::start`.
  [[nodiscard]] static Result<std::unique_ptr<Live>> start(const project::Plan& plan, ServerOptions options);
  /// The run is shown by the server of something else, from its beginning; `plan` is borrowed. See `access`.
  [[nodiscard]] static std::unique_ptr<Live> beside(const project::Plan& plan);
  /// No page yet; `plan` is borrowed.
  explicit Live(const project::Plan& plan);
  ~Live();
  Live(const Live&) = delete;
  Live& operator=(const Live&) = delete;

  /// Opens the page while the run goes on, if it is not open yet. What was before is read from the file `recording`,
  /// which `recorder` (borrowed) writes; the run goes on meanwhile. From any thread until `ended`.
  /// Errors: those of `Server::start`, record.*; then there is no page, and one may try again.
  [[nodiscard]] Result<void> open(ServerOptions options, replay::RunRecorder& recorder, const std::string& recording);
  /// Whether there is a page. From any thread.
  [[nodiscard]] bool is_open() const;

  /// For the run's recorder: what it records is what the page shows. With `start` and `beside` only.
  [[nodiscard]] std::function<void(TimePoint, record::RunRecord)> tap();
  void install(runtime::RunOptions& options);
  /// Pages steer through it (borrowed) from now on; null: through nobody. Returns when nobody uses the one before.
  void steer_by(runtime::Steering* steering);
  /// The run is over; the page stays.
  void ended(const runtime::RunReport& report);

  /// Of a page that is open.
  [[nodiscard]] const Server& server() const;
  /// Of a page that is open, or of a run that another server shows, which reaches the run through `access`.
  [[nodiscard]] const History& history() const;
  [[nodiscard]] const Subject& subject() const;
  [[nodiscard]] RunAccess access();

 private:
  struct Impl;
  explicit Live(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::studio
