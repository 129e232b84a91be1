#include "sentree/text/rewrite.h"

#include <unistd.h>

#include <fstream>
#include <string>

#include "sentree/text/encoding.h"
#include "sentree/text/file.h"

namespace sentree::text {

bool is_read_only(const std::filesystem::path& path) {
  constexpr auto kWrite =
      std::filesystem::perms::owner_write | std::filesystem::perms::group_write | std::filesystem::perms::others_write;
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) return false;
  return (status.permissions() & kWrite) == std::filesystem::perms::none || ::access(path.c_str(), W_OK) != 0;
}

Result<void> rewrite_file(const std::filesystem::path& path, std::string_view text) {
  const SourceSpan place{path.string()};
  if (is_read_only(path))
    return fail("file.read-only", "is read-only, and stays as it is; make it writable (chmod u+w)", place);
  constexpr std::size_t kBegin = 1024;  // tells the encoding
  std::string begin(kBegin, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(begin.data(), static_cast<std::streamsize>(kBegin));
  begin.resize(static_cast<std::size_t>(file.gcount()));
  const auto encoded = xml_encoded_as(begin, text);
  if (!encoded && xml_as_utf8(begin)) {
    return fail("file.encoding", "its encoding has not all characters of the new text; declare encoding=\"UTF-8\"",
                place);
  }
  std::error_code error;
  const auto permissions = std::filesystem::status(path, error).permissions();
  if (auto written = write_file(path, encoded ? *encoded : text); !written) return written;
  std::filesystem::permissions(path, permissions, error);
  return {};
}

}  // namespace sentree::text
