#include "sentree/cli/png.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/text/file.h"

extern char** environ;

namespace sentree::cli {

int write_png(const std::string& svg, const std::string& output) {
  if (output.empty() && isatty(STDOUT_FILENO) == 1) {
    say("a PNG is not for a terminal; name a file with --output, e.g. -o picture.png");
    return kUsage;
  }
  std::string name = (std::filesystem::temp_directory_path() / "sentree-XXXXXX").string();
  const int file = mkstemp(name.data());
  if (file < 0) {
    say(name + ": cannot be made");
    return kEnvironment;
  }
  close(file);
  int code = kEnvironment;
  if (const auto written = text::write_file(name, svg); !written) {
    say(to_string(written.error()));
  } else {
    std::string program = "rsvg-convert";
    std::string format = "--format=png";
    std::string unlimited = "--unlimited";
    std::string to = "--output=" + output;
    char* const arguments[] = {
        program.data(), format.data(), unlimited.data(), name.data(), output.empty() ? nullptr : to.data(), nullptr};
    pid_t child = 0;
    int status = 0;
    if (posix_spawnp(&child, program.c_str(), nullptr, nullptr, arguments, environ) != 0) {
      say("PNG needs the program rsvg-convert (Debian package librsvg2-bin); SVG does not: --to svg");
    } else if (waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0) {
      code = kOk;
    } else {
      say("rsvg-convert could not write the picture");
    }
  }
  std::error_code error;
  std::filesystem::remove(name, error);
  return code;
}

}  // namespace sentree::cli
