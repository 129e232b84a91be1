#pragma once

#include <deque>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sentree/idl/detail/syntax.h"
#include "sentree/idl/schema.h"

namespace sentree::idl {

/// One file with its names resolved. Everything is in deques, because types point to each other.
struct Schema::Program {
  std::string file;
  std::string prefix;  ///< The file's name without folder and ".thrift": how others name what is in it.
  std::vector<std::pair<std::string, std::shared_ptr<const Program>>> includes;  ///< By prefix, in the order written.

  std::deque<Type> types;
  std::deque<Enum> enums;
  std::deque<Struct> structs;
  std::deque<Service> services;
  std::deque<Constant> constants;
  std::deque<Typedef> typedefs;

  std::map<std::string, const Type*, std::less<>> type_names;
  std::map<std::string, const Service*, std::less<>> service_names;
  std::map<std::string, const Constant*, std::less<>> constant_names;  ///< Enumerators too, as "Enum.NAME".
  std::deque<Constant> enumerator_constants;

  /// Looks `name` up in `names` of this program, or of the included one that its prefix names.
  template <class T>
  [[nodiscard]] const T* find(std::string_view name,
                              std::map<std::string, const T*, std::less<>> Program::*names) const {
    const auto& own = this->*names;
    if (const auto found = own.find(name); found != own.end()) return found->second;
    for (const auto& [included, program] : includes) {
      if (name.size() <= included.size() + 1 || !name.starts_with(included) || name[included.size()] != '.') continue;
      const auto& others = (*program).*names;
      if (const auto found = others.find(name.substr(included.size() + 1)); found != others.end()) return found->second;
    }
    return nullptr;
  }
};

/// Gives names their meaning, checks what the grammar cannot, works out constants. Private to the library.
/// `program.includes` are there already. @returns false if there was an error.
[[nodiscard]] bool resolve(const syntax::File& file, Schema::Program& program, Diagnostics& diagnostics);

}  // namespace sentree::idl
