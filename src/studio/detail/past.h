#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/project/plan.h"

namespace sentree::studio {

/// How many recordings of a project's `runs/` are judged, the newest, and how large they may be.
inline constexpr std::size_t kPastRunsMax = 3;
inline constexpr std::uintmax_t kPastBytesMax = 64U << 20U;
inline constexpr std::size_t kPastObservationsMax = 300'000;

/// What requirements that are being written would have said of the project's last runs. Used by one thread.
class Past {
 public:
  explicit Past(const std::filesystem::path& folder) : runs_(folder / "runs") {}

  /// The message "design_past" about a file of requirements, from its text: for each requirement the picture of the
  /// chart that it becomes, and when each recording would have violated it first, as `sentree monitor check` has it. A
  /// text with errors has no requirements. Cost: a step of the requirements' monitors for each observation that they
  /// listen to.
  [[nodiscard]] Value judge(const std::string& file, const std::string& text, const project::Plan& plan);

 private:
  struct Recording {
    std::filesystem::path path;
    std::filesystem::file_time_type written;
    std::uintmax_t size = 0;
    TimePoint ended{};
    TimePoint judged_until{};
    std::vector<std::shared_ptr<const Message>> observations;
    std::string problem;  ///< Why it is not judged; empty: it is.
  };
  void look(const project::Plan& plan);
  static void read(Recording& recording, const project::Plan& plan);

  const std::filesystem::path runs_;
  std::vector<Recording> recordings_;  // the newest first
};

}  // namespace sentree::studio
