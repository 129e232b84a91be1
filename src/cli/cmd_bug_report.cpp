#include <fmt/format.h>
#include <sys/utsname.h>

#include <algorithm>
#include <ctime>
#include <thread>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/tarball.h"
#include "sentree/cli/version.h"
#include "sentree/record/reader.h"
#include "sentree/text/file.h"
#include "sentree/text/json.h"

namespace sentree::cli {

namespace {

std::string machine() {
  utsname name{};
  uname(&name);
  std::string text = fmt::format("{} {} {}\n{} cores\n\n", name.sysname, name.release, name.machine,
                                 std::thread::hardware_concurrency());
  for (const char* file : {"/etc/os-release", "/proc/meminfo"}) {
    if (const auto content = text::read_file(file, file)) text += fmt::format("{}\n{}\n", file, *content);
  }
  return text;
}

std::string default_output() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  char text[64];
  std::strftime(text, sizeof text, "sentree-bug-report-%Y%m%d-%H%M%S.tar.gz", &local);
  return text;
}

}  // namespace

int bug_report(const BugReportCommand& command) {
  const std::filesystem::path output = command.output.empty() ? default_output() : command.output;
  std::error_code error;
  if (std::filesystem::exists(output, error)) {
    say(output.string() + " is there already; name another file with --output");
    return kEnvironment;
  }
  if (!command.recording.empty()) {
    if (!std::filesystem::is_regular_file(command.recording, error)) {
      say(command.recording + ": no such recording");
      return kInvalidInput;
    }
    // A recording that cannot be read may be what the report is about.
    const auto reader = record::Reader::open(command.recording);
    if (!reader) say(fmt::format("packed as it is, although it cannot be read: {}", to_string(reader.error())));
  }
  Tarball tarball(output);
  const std::string folder = "sentree-bug-report/";
  const auto pack = [&]() -> Result<void> {
    if (auto done = tarball.add(folder + "version.txt", version_text() + "\n"); !done) return done;
    if (auto done = tarball.add(folder + "version.json", to_json(version_facts()) + "\n"); !done) return done;
    if (auto done = tarball.add(folder + "doctor.json", to_json(examine_machine()) + "\n"); !done) return done;
    if (auto done = tarball.add(folder + "machine.txt", machine()); !done) return done;
    if (!command.recording.empty()) {
      if (auto done = tarball.add_file(folder + "recording.mcap", command.recording); !done) return done;
    }
    return tarball.finish();
  };
  if (const auto done = pack(); !done) {
    say(to_string(done.error()));
    return done.error().code == "file.unwritable" ? kEnvironment : kInvalidInput;
  }
  print(
      fmt::format("{}, {} bytes\n"
                  "  version.txt, version.json  version, commit, compiler, libraries\n"
                  "  doctor.json                what sentree doctor says\n"
                  "  machine.txt                kernel, distribution, processor, memory\n",
                  output.string(), std::filesystem::file_size(output, error)));
  if (!command.recording.empty()) {
    print(
        fmt::format("  recording.mcap             {}\nThe recording holds the project's files and all that was said in "
                    "the run. Look at it before you pass it on.\n",
                    command.recording));
  }
  return kOk;
}

}  // namespace sentree::cli
