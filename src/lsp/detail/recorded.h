#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "sentree/base/value.h"

namespace sentree::lsp {

/// Of the newest recording, bytes that are looked at: its end.
inline constexpr std::size_t kRecordedBytesMax = std::size_t{64} << 20U;
/// Recordings that a folder is searched for the newest of.
inline constexpr std::size_t kRecordingsMax = 1'000;

/// The last observation of each name in the newest recording of a project. It is read when somebody asks, and again
/// when there is a newer one.
class Recorded {
 public:
  struct Last {
    Value data;
    double time_s = 0;
    std::string recording;  ///< File's name.
  };
  /// @param folder  Of the project; recordings are in its runs/.
  /// Nothing: there is no recording, or it has none of that name. Cost: once, that of reading the recording's end.
  [[nodiscard]] std::optional<Last> last(const std::filesystem::path& folder, const std::string& observation);

 private:
  void read(const std::filesystem::path& file);

  std::filesystem::path file_;
  std::filesystem::file_time_type changed_;
  struct Text {
    std::string text;
    std::uint64_t time_ns = 0;
  };
  std::map<std::string, Text, std::less<>> texts_;  // of the last observation of each name
};

}  // namespace sentree::lsp
