#pragma once

#include <memory>
#include <string>

#include "sentree/replay/recorded_run.h"
#include "sentree/studio/server.h"

namespace sentree::studio {

/// The page over a recording.
class Recorded {
 public:
  /// Reads the recording once; of one that takes more than a second the rest comes while the page is there. Errors:
  /// those of `RecordedRun` and `Server::start`; what is wrong with the recorded project is in `diagnostics`.
  /// `code`: as for `RecordedRun::scenario`.
  [[nodiscard]] static Result<std::unique_ptr<Recorded>> open(const std::string& path, replay::RecordedCode code,
                                                              ServerOptions options, Diagnostics& diagnostics);
  /// The same without a page: the server of something else shows it, through `access`.
  [[nodiscard]] static Result<std::unique_ptr<Recorded>> read(const std::string& path, replay::RecordedCode code,
                                                              Diagnostics& diagnostics);
  ~Recorded();
  Recorded(const Recorded&) = delete;
  Recorded& operator=(const Recorded&) = delete;

  /// Of a page.
  [[nodiscard]] const Server& server() const;
  [[nodiscard]] const History& history() const;
  [[nodiscard]] const Subject& subject() const;
  [[nodiscard]] RunAccess access();

 private:
  struct Impl;
  explicit Recorded(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::studio
