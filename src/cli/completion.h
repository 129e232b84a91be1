#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace sentree::cli {

/// What a shell offers for one word. The shells' scripts ask for it by `sentree __complete WORD…`, so that they need to
/// know nothing of the commands.
struct Completion {
  struct Candidate {
    std::string word;
    std::string description;  ///< One line; may be empty.
  };
  enum class Files { kNone, kFolders, kAll };

  std::vector<Candidate> candidates;  ///< All begin with what was typed.
  Files files = Files::kNone;         ///< Which files the shell shall offer too.
  std::vector<std::string> endings;   ///< kAll: only files with one of these, where given; folders always.
};

/// @param words  Those behind `sentree` up to the cursor; the last is the one to complete and may be empty.
/// Reads the project or asks the running mission where a word names something in it; says nothing if that fails.
[[nodiscard]] Completion complete(const CLI::App& app, const std::vector<std::string>& words);

/// A line per candidate, "word<TAB>description"; then ":folders" or ":files ENDING…" where files are wanted.
[[nodiscard]] std::string to_lines(const Completion& completion);

/// The script that makes a shell ask. Empty for a shell that is not known.
[[nodiscard]] std::string completion_script(const std::string& shell);

}  // namespace sentree::cli
