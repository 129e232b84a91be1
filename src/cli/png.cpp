#include "sentree/cli/png.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "sentree/base/temporary_folder.h"
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
  const TemporaryFolder folder("picture");
  if (folder.path().empty()) {
    say("no temporary folder can be made; TMPDIR names where");
    return kEnvironment;
  }
  std::string name = (folder.path() / "picture.svg").string();
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
  return code;
}

}  // namespace sentree::cli
