#include "sentree/design/detail/disk.h"

#include <fmt/format.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <system_error>
#include <utility>

#include "sentree/base/write_all.h"
#include "sentree/text/encoding.h"
#include "sentree/text/file.h"
#include "sentree/text/rewrite.h"
#include "sentree/text/xml.h"

namespace sentree::design {

namespace {

namespace fs = std::filesystem;

tl::unexpected<Diagnostic> unwritable(const std::string& file) {
  return fail("file.unwritable", fmt::format("{} cannot be written: {}", file, std::generic_category().message(errno)),
              SourceSpan{file});
}

// A descriptor that is closed, and a temporary file that is gone, whatever happens.
class Temporary {
 public:
  Temporary(fs::path path, int descriptor) : path_(std::move(path)), descriptor_(descriptor) {}
  ~Temporary() {
    if (descriptor_ >= 0) close(descriptor_);
    if (!path_.empty()) unlink(path_.c_str());
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;

  bool write(std::string_view text) const { return write_all(descriptor_, text); }
  bool finish(const fs::path& as) {
    const int descriptor = std::exchange(descriptor_, -1);
    const bool synchronised = fsync(descriptor) == 0;
    if (close(descriptor) != 0 || !synchronised || rename(path_.c_str(), as.c_str()) != 0) return false;
    path_.clear();
    return true;
  }

 private:
  fs::path path_;
  int descriptor_;
};

bool synchronise_folder(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool done = fsync(descriptor) == 0;
  close(descriptor);
  return done;
}

}  // namespace

OnDisk look_at(const fs::path& path, std::size_t size_max) {
  std::error_code error;
  switch (fs::symlink_status(path, error).type()) {
    case fs::file_type::regular: break;
    case fs::file_type::not_found: return {};
    case fs::file_type::none: return {{}, {}, "it cannot be looked at: " + error.message()};
    case fs::file_type::symlink: return {{}, {}, "it is a link"};
    case fs::file_type::directory: return {{}, {}, "it is a folder"};
    default: return {{}, {}, "it is no regular file"};
  }
  auto content = text::read_file(path, {}, size_max);
  if (!content) {
    // It may have gone meanwhile.
    if (content.error().code == "file.not-found") return {};
    return {{},
            {},
            content.error().code == "file.too-large" ? fmt::format("it is larger than {} bytes", size_max)
                                                     : content.error().message};
  }
  // Control characters may be typed any moment; what is no UTF-8 cannot be shown.
  const auto bad = text::first_unreadable(*content);
  if (bad && static_cast<unsigned char>((*content)[bad->first]) >= 0x80U)
    return {{}, {}, fmt::format("it is no UTF-8 (byte {})", bad->first + 1)};
  std::string begin;
  if (const std::size_t first = content->find_first_not_of(" \t\r\n");
      first != std::string::npos && (*content)[first] == '<') {
    constexpr std::size_t kBegin = 1024;
    begin.resize(kBegin);
    std::ifstream file(path, std::ios::binary);
    file.read(begin.data(), kBegin);
    begin.resize(static_cast<std::size_t>(file.gcount()));
    if (!text::xml_as_utf8(begin)) begin.clear();
  }
  return {std::move(*content), std::move(begin), {}};
}

Result<void> write_safely(const fs::path& path, const std::string& file, std::string_view text) {
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  constexpr mode_t kNewFile = 0644;
  constexpr mode_t kPermissions = 07777;
  struct stat before {};
  const bool is_there = stat(path.c_str(), &before) == 0;
  const mode_t mode = is_there ? before.st_mode & kPermissions : kNewFile;
  // A file beside it could take its place all the same, against the will of who protected it.
  if (text::is_read_only(path))
    return fail("file.read-only",
                fmt::format("{} is read-only; what is edited is kept: make it writable (chmod u+w {}), and save again",
                            file, file),
                SourceSpan{file});
  const fs::path beside = path.parent_path() / fmt::format(".{}.part", path.filename().string());
  unlink(beside.c_str());  // what a machine that stopped has left
  const int descriptor = ::open(beside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, mode);
  if (descriptor < 0) return unwritable(file);
  Temporary temporary(beside, descriptor);
  if (fchmod(descriptor, mode) != 0 || !temporary.write(text) || !temporary.finish(path)) return unwritable(file);
  // The file is there; whether its name would survive a crash of the machine, a file system may not be able to say.
  (void)synchronise_folder(path.parent_path());
  return {};
}

Result<void> take_away(const fs::path& path, const std::string& file) {
  if (unlink(path.c_str()) != 0 && errno != ENOENT && errno != ENOTDIR) return unwritable(file);
  return {};
}

}  // namespace sentree::design
