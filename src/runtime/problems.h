#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace sentree::runtime {

/// Problems of one run, each once however often it comes. Those that differ in plain numbers alone ("tried again in
/// 601 ms"), or in whether they say that, are the same. After `kKindsMax` kinds no other is listed.
class Problems {
 public:
  static constexpr std::size_t kKindsMax = 100;

  /// How often it has come by now. Those that are not listed any more count as one.
  std::size_t add(const std::string& what);
  /// In the order of their first coming, as they were then, and how often if more than once: "… (12 times)".
  [[nodiscard]] std::vector<std::string> list() const;

 private:
  struct Kind {
    std::string first;
    std::size_t times = 0;
  };
  std::vector<Kind> kinds_;
  std::map<std::string, std::size_t> index_;  // by the text without its numbers
  std::size_t others_ = 0;                    // that are not listed
};

/// 1, 10, 100 …: when what comes again and again is told.
[[nodiscard]] bool is_power_of_ten(std::size_t number);

}  // namespace sentree::runtime
