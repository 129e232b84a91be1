#pragma once

#include <filesystem>
#include <memory>

#include "sentree/studio/server.h"

namespace sentree::studio {

/// A page that shows what differs between two files, two folders, or a folder and the project of a recording, as one
/// picture. What is compared is read once, when it starts.
class DifferencePage {
 public:
  /// Errors: those of `Server::start` and `texts_at`; diff.unlike (a file and a folder).
  [[nodiscard]] static Result<std::unique_ptr<DifferencePage>> start(const std::filesystem::path& before,
                                                                     const std::filesystem::path& after,
                                                                     ServerOptions options);
  ~DifferencePage();
  DifferencePage(const DifferencePage&) = delete;
  DifferencePage& operator=(const DifferencePage&) = delete;

  [[nodiscard]] const Server& server() const;

 private:
  struct Impl;
  explicit DifferencePage(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::studio
