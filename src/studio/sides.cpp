#include "sentree/studio/detail/sides.h"

#include <fmt/format.h>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <set>
#include <utility>

#include "sentree/base/time.h"
#include "sentree/design/workspace.h"
#include "sentree/project/plan.h"
#include "sentree/replay/recorded_run.h"
#include "sentree/replay/recording.h"
#include "sentree/studio/detail/design_values.h"
#include "sentree/text/file.h"

extern char** environ;

namespace sentree::studio {

namespace fs = std::filesystem;

namespace {

struct File {
  int descriptor = -1;
  File() = default;
  explicit File(int opened) : descriptor(opened) {}
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  ~File() { reset(); }
  void reset() {
    if (descriptor >= 0) close(descriptor);
    descriptor = -1;
  }
};

// Ends a child that nobody waits for any more.
void end(pid_t child) {
  kill(child, SIGKILL);
  while (waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
  }
}

Diagnostic git_problem(const std::string& what) {
  return {.severity = Severity::kError, .code = "git.failed", .message = what};
}

// What a git command writes. It reads objects only: no hook, no filter, no network.
Result<std::string> git(const fs::path& folder, std::vector<std::string> arguments, const std::string& input) {
  File in(memfd_create("sentree-git", MFD_CLOEXEC));
  if (in.descriptor < 0 || write(in.descriptor, input.data(), input.size()) != static_cast<ssize_t>(input.size()) ||
      lseek(in.descriptor, 0, SEEK_SET) != 0)
    return tl::unexpected(git_problem("no memory for a list of files"));
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return tl::unexpected(git_problem("no pipe to git"));
  File out(ends[0]);
  File theirs(ends[1]);

  arguments.insert(arguments.begin(), {"git", "-c", "core.fsmonitor=false", "-C", folder.string()});
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  std::string own[] = {"GIT_OPTIONAL_LOCKS=0", "GIT_TERMINAL_PROMPT=0", "GIT_NO_LAZY_FETCH=1", "LC_ALL=C"};
  std::vector<char*> environment;
  for (std::string& one : own) environment.push_back(one.data());
  for (char** one = environ; *one != nullptr; ++one) {
    // Where a hook or a difftool runs, git's own variables name another repository and folder.
    const std::string_view variable(*one);
    if (!variable.starts_with("GIT_") && !variable.starts_with("LC_ALL=")) environment.push_back(*one);
  }
  environment.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, in.descriptor, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, theirs.descriptor, STDOUT_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t child = 0;
  const int spawned = posix_spawnp(&child, "git", &actions, nullptr, argv.data(), environment.data());
  posix_spawn_file_actions_destroy(&actions);
  if (spawned != 0) return tl::unexpected(git_problem("there is no git here (package git)"));
  theirs.reset();

  std::string written;
  char buffer[64 * 1024];
  for (;;) {
    pollfd waiting{out.descriptor, POLLIN, 0};
    const int ready = poll(&waiting, 1, kGitPatience_ms);
    if (ready < 0 && errno == EINTR) continue;
    const ssize_t size = ready > 0 ? read(out.descriptor, buffer, sizeof buffer) : -1;
    if (size < 0 && ready > 0 && errno == EINTR) continue;
    if (size == 0) break;
    if (size < 0 || written.size() + static_cast<std::size_t>(size) > kGitBytesMax) {
      end(child);
      if (size >= 0) return fail("git.too-large", "the commit has more than can be compared");
      return tl::unexpected(git_problem("git does not answer"));
    }
    written.append(buffer, static_cast<std::size_t>(size));
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    return tl::unexpected(git_problem(
        fmt::format("git knows no such commit of {}; is it in a repository, with a first commit?", folder.string())));
  return written;
}

// The project of a recording, from the folder of its sentree.yaml.
Result<ProjectTexts> texts_of_recording(const fs::path& path) {
  auto run = replay::RecordedRun::open(path.string());
  if (!run) return tl::unexpected(run.error());
  const fs::path folder = fs::path(run->fact("project")).parent_path();
  ProjectTexts texts;
  for (const record::AttachmentIndex& index : run->reader().attachments()) {
    if (!index.name.starts_with(replay::kProjectPrefix)) continue;
    const fs::path name = index.name.substr(replay::kProjectPrefix.size());
    const fs::path inside = folder.empty() ? name : name.lexically_relative(folder);
    if (inside.empty() || *inside.begin() == ".." || !design::is_project_text(inside)) continue;
    auto attachment = run->reader().attachment(index);
    if (!attachment) return tl::unexpected(attachment.error());
    texts.emplace(inside.generic_string(), std::move(attachment->data));
  }
  if (texts.empty()) return fail("record.no-project", "the recording holds no project", SourceSpan{path.string()});
  return texts;
}

}  // namespace

Result<ProjectTexts> texts_at(const fs::path& path) {
  std::error_code error;
  ProjectTexts texts;
  if (fs::is_directory(path, error)) {
    Result<void> done;
    const bool all = design::each_project_text(path, [&](const fs::path& file) {
      auto text = text::read_file(file);
      if (text && text->size() <= design::kDocumentBytesMax)
        texts.emplace(file.lexically_relative(path).generic_string(), std::move(*text));
    });
    if (!all) return fail("design.too-many-files", path.string() + " has too many files");
    return texts;
  }
  if (path.extension() == ".mcap") return texts_of_recording(path);
  if (fs::is_character_file(path, error)) return texts;
  auto text = text::read_file(path);
  if (!text) return tl::unexpected(text.error());
  texts.emplace(path.filename().string(), std::move(*text));
  return texts;
}

Result<ProjectTexts> texts_of_commit(const fs::path& folder, const std::string& commit) {
  if (commit.empty() || commit.starts_with('-'))
    return tl::unexpected(git_problem(fmt::format("\"{}\" is no commit", commit)));
  const auto listed = git(folder, {"ls-tree", "-r", "-z", "--name-only", commit}, {});
  if (!listed) return tl::unexpected(listed.error());
  std::vector<std::string> names;
  std::string wanted;
  for (std::size_t at = 0; at < listed->size();) {
    const std::size_t end = std::min(listed->find('\0', at), listed->size());
    std::string name = listed->substr(at, end - at);
    at = end + 1;
    if (!design::is_project_text(name) || name.starts_with("runs/") || name.find('\n') != std::string::npos) continue;
    if (names.size() == design::kFilesMax)
      return fail("design.too-many-files", "the commit has too many files of this folder");
    wanted += fmt::format("{}:./{}\n", commit, name);
    names.push_back(std::move(name));
  }
  auto objects = git(folder, {"cat-file", "--batch"}, wanted);
  if (!objects) return tl::unexpected(objects.error());
  // "<id> blob <size>", a line feed, the bytes, a line feed.
  ProjectTexts texts;
  std::size_t at = 0;
  for (const std::string& name : names) {
    const std::size_t end = objects->find('\n', at);
    if (end == std::string::npos) break;
    const std::string head = objects->substr(at, end - at);
    const std::size_t blob = head.find(" blob ");
    at = end + 1;
    if (blob == std::string::npos) continue;  // A link to another repository has no bytes.
    const std::size_t size = std::strtoull(head.c_str() + blob + 6, nullptr, 10);
    if (size > objects->size() - at) return tl::unexpected(git_problem("git ended early"));
    texts.emplace(name, objects->substr(at, size));
    at += size + 1;
  }
  return texts;
}

void keep_what_was_read(const ProjectTexts& recorded, ProjectTexts& folder) {
  std::erase_if(folder, [&](const auto& one) { return !recorded.contains(one.first); });
  const std::pair<fs::path, fs::path> shipped[] = {{"interfaces", project::shipped_folder("interfaces")},
                                                   {"skills", project::shipped_folder("skills") / "nav2"}};
  for (const auto& [name, text] : recorded) {
    if (folder.contains(name)) continue;
    for (const auto& [inside, place] : shipped) {
      const fs::path relative = fs::path(name).lexically_relative(inside);
      if (relative.empty() || *relative.begin() == "..") continue;
      if (auto there = text::read_file(place / relative)) folder.emplace(name, std::move(*there));
    }
  }
}

Value changed_files(const Sides& sides) {
  std::set<std::string> names;
  for (const auto* side : {&sides.before, &sides.after}) {
    for (const auto& [name, text] : *side) names.insert(name);
  }
  List list;
  for (const std::string& name : names) {
    const auto was = sides.before.find(name);
    const auto is = sides.after.find(name);
    const char* change = was == sides.before.end()   ? "added"
                         : is == sides.after.end()   ? "removed"
                         : was->second != is->second ? "changed"
                                                     : nullptr;
    if (change != nullptr) list.push_back(Map{{"file", name}, {"change", change}});
  }
  return list;
}

Result<Value> comparison_of(const Sides& sides, const std::string& file, const design::Kinds& kinds) {
  const auto was = sides.before.find(file);
  const auto is = sides.after.find(file);
  if (was == sides.before.end() && is == sides.after.end())
    return fail("design.no-such-file", fmt::format("neither has a file \"{}\"", file));
  return comparison_value(was != sides.before.end() ? &was->second : nullptr,
                          is != sides.after.end() ? &is->second : nullptr, kinds, file);
}

}  // namespace sentree::studio
