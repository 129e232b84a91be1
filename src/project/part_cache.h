#pragma once

#include <memory>

#include "sentree/project/plan.h"

namespace sentree::project {

/// Charts, interfaces and the map of a project as they were read, and what was found in its charts, for what prepares
/// it again and again: what has the same text is not read anew. Bounded; of one thread at a time.
class PartCache {
 public:
  PartCache();
  ~PartCache();
  PartCache(PartCache&&) noexcept;
  PartCache& operator=(PartCache&&) noexcept;

  struct Impl;
  [[nodiscard]] Impl& impl() { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

/// As without a cache; it takes a fraction of the time where little has changed since the last call.
[[nodiscard]] Loaded<Plan> prepare(Scenario scenario, PartCache& cache);
[[nodiscard]] Diagnostics check_project(const std::filesystem::path& folder_or_file, PartCache& cache);
/// As above, of a project that is loaded already.
[[nodiscard]] Diagnostics check_project(const Loaded<Project>& project, PartCache& cache);

}  // namespace sentree::project
