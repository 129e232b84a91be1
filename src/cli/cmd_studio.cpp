#include <fmt/format.h>

#include <signal.h>

#include <filesystem>
#include <optional>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/page.h"
#include "sentree/cli/report.h"
#include "sentree/cli/requirement_file.h"
#include "sentree/cli/shell_word.h"
#include "sentree/studio/difference.h"
#include "sentree/studio/groot_play.h"
#include "sentree/studio/recorded.h"
#include "sentree/studio/workshop.h"

namespace sentree::cli {

namespace {

// A project to edit: a folder, or its sentree.yaml.
std::optional<std::filesystem::path> project_folder(const std::string& named) {
  const std::filesystem::path path(named);
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return path;
  if (path.filename() != "sentree.yaml") return std::nullopt;
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

// The folder of the project that a file of it is given for; empty: it is none.
std::string folder_meant(const std::string& named) {
  const std::filesystem::path path(named);
  std::error_code error;
  const std::filesystem::path ending = path.extension();
  const bool is_part = ending == ".xml" || ending == ".scxml" || ending == ".req" || ending == ".yaml";
  if (!is_part || !std::filesystem::is_regular_file(path, error)) return "";
  const std::filesystem::path above = project_above(path);
  return above.empty() ? "." : above.string();
}

int design(const std::filesystem::path& folder, const StudioCommand& command,
           const sentree::studio::ServerOptions& where, const sigset_t& signals) {
  auto page = start_page(where, command.at.empty(), [&](const sentree::studio::ServerOptions& there) {
    return sentree::studio::Workshop::start(folder, there, story_without_witness);
  });
  if (!page) {
    say(to_string(page.error()));
    return page.error().code.starts_with("http.") ? kEnvironment : kInvalidInput;
  }
  if (const std::string other = (*page)->held_by(); !other.empty())
    say(fmt::format("! {} edits this project; until it ends, it is only shown here", other));
  announce((*page)->server().url(), command.open);
  int signal = 0;
  sigwait(&signals, &signal);
  return kOk;
}

// Who compares files one after the other, as git difftool does, closes the page to go on.
int compare(const StudioCommand& command, const sentree::studio::ServerOptions& where, const sigset_t& signals) {
  auto page = start_page(where, command.at.empty(), [&](const sentree::studio::ServerOptions& there) {
    return sentree::studio::DifferencePage::start(command.diff[0], command.diff[1], there);
  });
  if (!page) {
    say(to_string(page.error()));
    return page.error().code.starts_with("http.") ? kEnvironment : kInvalidInput;
  }
  announce((*page)->server().url(), command.open);
  // A page that is loaded anew is away for a moment.
  constexpr int kAwayLooks = 8;
  const timespec period{.tv_sec = 0, .tv_nsec = 250'000'000};
  bool seen = false;
  for (int away = 0; away < kAwayLooks;) {
    if (sigtimedwait(&signals, nullptr, &period) > 0) break;
    const bool there = (*page)->server().clients() > 0;
    seen = seen || there;
    away = seen && !there ? away + 1 : 0;
  }
  return kOk;
}

}  // namespace

int studio(const StudioCommand& command) {
  if (command.attach) return attach(command);
  if (command.recording.empty() && command.diff.empty()) {
    say("sentree studio needs a project, a recording, --diff with two files, or --attach for a run that goes on");
    return kUsage;
  }
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM}) sigaddset(&signals, signal);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  const auto where = page_options(command.at.empty() ? "true" : command.at, command.insecure);
  if (!where) return kUsage;
  if (!command.diff.empty()) return compare(command, *where, signals);
  if (const auto folder = project_folder(command.recording)) return design(*folder, command, *where, signals);
  if (const std::string folder = folder_meant(command.recording); !folder.empty()) {
    say(fmt::format("{}: no recording, and a project is a folder; `sentree studio {}` shows it", command.recording,
                    shell_word(folder)));
    return kInvalidInput;
  }
  Diagnostics diagnostics;
  auto page = start_page(*where, command.at.empty(), [&](const sentree::studio::ServerOptions& there) {
    return sentree::studio::Recorded::open(command.recording, command.recorded_code, there, diagnostics);
  });
  say(diagnostics);
  if (!page) {
    say(to_string(page.error()));
    return page.error().code.starts_with("http.") ? kEnvironment : kInvalidInput;
  }
  std::unique_ptr<sentree::studio::GrootPlay> played;
  if (!command.groot.empty()) {
    auto at = groot::parse_server_address(command.groot);
    if (at) {
      at->insecure = command.insecure;
      at->on_problem = [](const std::string& what) { say("! " + what); };
    }
    // What the project lacks has been told.
    auto playing = at ? sentree::studio::GrootPlay::start(command.recording, command.recorded_code, command.factor,
                                                          std::move(*at), diagnostics)
                      : tl::unexpected(at.error());
    if (!playing) {
      say(to_string(playing.error()));
      return kEnvironment;
    }
    played = std::move(*playing);
    say(played->server().told());
  }
  announce((*page)->server().url(), command.open);
  int signal = 0;
  sigwait(&signals, &signal);
  return kOk;
}

}  // namespace sentree::cli
