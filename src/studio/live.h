#pragma once

#include <memory>
#include <string>

#include "sentree/runtime/recording.h"
#include "sentree/runtime/run.h"
#include "sentree/studio/server.h"

namespace sentree::studio {

/// The page of a run that goes on.
class Live {
 public:
  /// `plan` is borrowed. Errors: those of `Server::start`.
  [[nodiscard]] static Result<std::unique_ptr<Live>> start(const runtime::Plan& plan, ServerOptions options);
  ~Live();
  Live(const Live&) = delete;
  Live& operator=(const Live&) = delete;

  /// For the run's recorder: what it records is what the page shows.
  [[nodiscard]] std::function<void(const record::Channel&, TimePoint, std::string_view)> tap();
  void install(runtime::RunOptions& options);
  /// The run is over; the page stays.
  void ended(const runtime::RunReport& report);

  [[nodiscard]] const Server& server() const;
  [[nodiscard]] const History& history() const;

 private:
  struct Impl;
  explicit Live(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::studio
