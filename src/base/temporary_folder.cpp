#include "sentree/base/temporary_folder.h"

#include <cstdlib>
#include <string>
#include <system_error>

namespace sentree {

TemporaryFolder::TemporaryFolder(std::string_view purpose) {
  std::error_code error;
  const std::filesystem::path place = std::filesystem::temp_directory_path(error);
  if (error) return;
  std::string name = (place / ("sentree-" + std::string(purpose) + "-XXXXXX")).string();
  if (mkdtemp(name.data()) != nullptr) path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code error;
  if (!path_.empty()) std::filesystem::remove_all(path_, error);
}

}  // namespace sentree
