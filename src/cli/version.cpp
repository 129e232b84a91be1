#include "sentree/cli/version.h"

#include <gnu/libc-version.h>
#include <link.h>

#include <CLI/Version.hpp>
#include <algorithm>
#include <boost/version.hpp>
#include <filesystem>
#include <vector>

namespace sentree::cli {

namespace {

// libz.so.1 is a link to libz.so.1.2.13, whose name says the version.
int note_library(dl_phdr_info* info, std::size_t, void* names) {
  const std::string_view file = info->dlpi_name;
  if (!file.starts_with('/')) return 0;  // the program, and what the kernel lends it
  std::error_code error;
  const auto real = std::filesystem::canonical(file, error);
  const std::string name = (error ? std::filesystem::path(file) : real).filename();
  if (name.starts_with("lib")) static_cast<std::vector<std::string>*>(names)->push_back(name);
  return 0;
}

std::vector<std::string> libraries() {
  std::vector<std::string> names;
  dl_iterate_phdr(note_library, &names);
  std::sort(names.begin(), names.end());
  std::string boost = BOOST_LIB_VERSION;
  std::replace(boost.begin(), boost.end(), '_', '.');
  names.insert(names.begin(),
               {"Boost " + boost, "CLI11 " CLI11_VERSION, std::string("glibc ") + gnu_get_libc_version()});
  return names;
}

constexpr const char* kCompiler =
#ifdef __clang__
    "clang++ " __clang_version__;
#else
    "g++ " __VERSION__;
#endif

}  // namespace

Value version_facts() {
  List names;
  for (std::string& name : libraries()) names.push_back(std::move(name));
  return Map{{"version", SENTREE_VERSION},
             {"commit", commit()},
             {"compiler", kCompiler},
             {"build", SENTREE_BUILD},
             {"libraries", std::move(names)}};
}

std::string version_text() {
  std::string text = std::string("sentree " SENTREE_VERSION "\ncommit     ") + commit() + "\ncompiler   " + kCompiler +
                     ", " SENTREE_BUILD "\nlibraries  ";
  std::size_t column = 0;
  for (const std::string& name : libraries()) {
    constexpr std::size_t kColumns = 100;
    if (column > 0) text += column + name.size() > kColumns ? (column = 0, ",\n           ") : ", ";
    text += name;
    column += name.size() + 2;
  }
  return text;
}

}  // namespace sentree::cli
