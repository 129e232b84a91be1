#pragma once

#include <filesystem>
#include <string>

#include "sentree/idl/schema.h"

namespace sentree::project {

/// Reads a Thrift IDL file with all that it includes. As for the Thrift compiler, an include is looked for in the
/// folder of the file that has it, then among the interfaces that come with Sentree.
///
/// `shown` is the file's name in messages; included files are named beside it. Codes: those of `idl::Schema::load`, and
/// of `text::read_file` for `file` itself.
[[nodiscard]] Loaded<idl::Schema> load_interface(const std::filesystem::path& file, const std::string& shown);

}  // namespace sentree::project
