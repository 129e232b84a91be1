#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/base/result.h"
#include "sentree/base/value.h"
#include "sentree/project/project.h"

namespace sentree::cli {

/// Data for programs and people who asked for it: standard output. On a terminal nothing in it moves the cursor or
/// hides what follows, whoever wrote it; programs get it as it is.
void print(const std::string& text);
/// Sequences that move the cursor, clear and the like, for a terminal at standard output.
void print_screen(const std::string& sequences);
/// `text` as a terminal may show it, with our colours. O(length).
[[nodiscard]] std::string shown_in_colour(const std::string& text);
/// Messages: standard error.
void say(const std::string& text);
/// What goes on at present, on the last line of the terminal at standard error, below all that is printed; empty:
/// nothing. Where that is no terminal, a line every half a minute. From any thread.
void show_status(const std::string& text);
/// `code`; kEnvironment in place of kOk if something could not be printed, which is said.
[[nodiscard]] int finished(int code);
/// The exit code, once everything has been printed. If threads had to be left behind in endless scripts, the process
/// ends right here, since nothing that they use may be destroyed.
[[nodiscard]] int leave(int code);
/// Errors one by one; all warnings in one line that names `sentree check`, of the project as it was typed.
void say(const Diagnostics& diagnostics, const std::string& project = {});
/// Each in full, warnings too: of a recording, which `sentree check` does not look at.
void say_each(const Diagnostics& diagnostics);

/// Standard output is a terminal that shows colours, and the user did not ask for none (NO_COLOR).
[[nodiscard]] bool wants_colour();

/// Whether a file may be written: nothing is there, or a file that begins as those of its kind do, and none of
/// `inputs`. Says why not.
/// @param begins  How the kind begins; empty: nobody can tell.
[[nodiscard]] bool may_write(const std::filesystem::path& file, std::string_view begins,
                             const std::vector<std::filesystem::path>& inputs);

/// The content of a file, or of standard input for "-".
[[nodiscard]] Result<std::string> read_named(const std::string& name);

[[nodiscard]] Value to_value(const Diagnostic& diagnostic);
[[nodiscard]] Value to_value(const Diagnostics& diagnostics);

/// A scenario by its name in the project, or the plain project.
[[nodiscard]] Loaded<project::Scenario> load(const std::string& project, const std::string& scenario);

/// A yaml file that names a map, as world files do and projects do not.
[[nodiscard]] bool is_world(const std::string& path);

/// A scenario file, or a project (a folder or its sentree.yaml) as a plain scenario. Says what is wrong on standard
/// error.
[[nodiscard]] std::optional<project::Scenario> load_file(const std::string& path);

}  // namespace sentree::cli
