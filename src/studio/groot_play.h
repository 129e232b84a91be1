#pragma once

#include <memory>
#include <string>

#include "sentree/groot/server.h"
#include "sentree/replay/recorded_code.h"

namespace sentree::studio {

/// A recording of a run played to Groot 1 and Groot 2, at its own speed times a factor. It begins when Groot asks for
/// the tree, and begins again when Groot asks after its end. Hooks are refused: what is over cannot be changed.
class GrootPlay {
 public:
  /// @param factor  Recorded seconds per second; above 0.
  /// Errors: those of `RecordedRun` and `groot::Server::start`; what is wrong with the recorded project is in
  /// `diagnostics`. `code`: as for `RecordedRun::scenario`.
  [[nodiscard]] static Result<std::unique_ptr<GrootPlay>> start(const std::string& path, replay::RecordedCode code,
                                                                double factor, groot::ServerOptions options,
                                                                Diagnostics& diagnostics);
  ~GrootPlay();
  GrootPlay(const GrootPlay&) = delete;
  GrootPlay& operator=(const GrootPlay&) = delete;

  [[nodiscard]] const groot::Server& server() const;

 private:
  struct Impl;
  explicit GrootPlay(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::studio
