#include "sentree/idl/schema.h"

#include <algorithm>
#include <map>
#include <set>

#include <fmt/format.h>

#include "sentree/idl/detail/program.h"
#include "sentree/idl/detail/ros.h"
#include "sentree/idl/detail/syntax.h"

namespace sentree::idl {
namespace {

using ProgramPtr = std::shared_ptr<const Schema::Program>;

std::string prefix_of(std::string_view file) {
  const auto slash = file.find_last_of("/\\");
  if (slash != std::string_view::npos) file.remove_prefix(slash + 1);
  // The compiler cuts at the last dot, whatever follows it.
  const auto dot = file.rfind('.');
  return std::string(dot == std::string_view::npos ? file : file.substr(0, dot));
}

class Loader {
 public:
  Loader(const IncludeReader& include, Diagnostics& diagnostics) : include_(include), diagnostics_(diagnostics) {}

  ProgramPtr load(std::string_view source, const std::string& file, int depth) {
    if (source.size() > kFileSizeMax)
      return fail({file, 0, 0, 0}, "idl.too-large", fmt::format("the file has more than {} bytes", kFileSizeMax));
    syntax::File parsed;
    if (!syntax::parse(source, file, parsed, diagnostics_)) return nullptr;

    auto program = std::make_shared<Schema::Program>();
    program->file = file;
    program->prefix = prefix_of(file);
    loading_.insert(file);
    bool good = true;
    for (const syntax::Include& line : parsed.includes) good = include(line, file, *program, depth) && good;
    loading_.erase(file);
    if (!good || !resolve(parsed, *program, diagnostics_)) return nullptr;
    return program;
  }

 private:
  ProgramPtr fail(const SourceSpan& at, std::string code, std::string message) {
    diagnostics_.push_back({Severity::kError, std::move(code), std::move(message), at});
    return nullptr;
  }

  bool include(const syntax::Include& line, const std::string& from, Schema::Program& into, int depth) {
    if (depth >= kIncludeNestingMax) {
      fail(line.span, "idl.too-deep", fmt::format("files include each other more than {} deep", kIncludeNestingMax));
      return false;
    }
    auto found = include_ ? include_(line.path, from)
                          : Result<IncludedFile>(sentree::fail("idl.include", "files are not read here"));
    if (!found) {
      // Only a warning, as the compiler has it: what the file would have defined is missed where it is used.
      diagnostics_.push_back({Severity::kWarning, "idl.include",
                              fmt::format("cannot include \"{}\": {}", line.path, found.error().message), line.span});
      return true;
    }
    if (loading_.contains(found->file)) {
      fail(line.span, "idl.include-cycle", fmt::format("\"{}\" includes itself, by way of {}", found->file, from));
      return false;
    }
    auto done = loaded_.find(found->file);
    if (done == loaded_.end()) {
      if (loaded_.size() >= kFilesMax) {
        fail(line.span, "idl.too-large", fmt::format("more than {} files are included", kFilesMax));
        return false;
      }
      ProgramPtr program = load(found->source, found->file, depth + 1);
      done = loaded_.emplace(found->file, std::move(program)).first;
    }
    if (done->second == nullptr) return false;
    into.includes.emplace_back(prefix_of(line.path), done->second);
    return true;
  }

  const IncludeReader& include_;
  Diagnostics& diagnostics_;
  std::set<std::string> loading_;
  std::map<std::string, ProgramPtr> loaded_;
};

void collect_files(const Schema::Program& program, std::vector<std::string>& out) {
  if (std::find(out.begin(), out.end(), program.file) != out.end()) return;
  out.push_back(program.file);
  for (const auto& [prefix, included] : program.includes) collect_files(*included, out);
}

template <class T>
const T* find_named(const std::vector<T>& all, std::string_view name) {
  const auto found = std::find_if(all.begin(), all.end(), [&](const T& x) { return x.name == name; });
  return found == all.end() ? nullptr : &*found;
}

}  // namespace

const Enumerator* Enum::find(std::string_view enumerator) const { return find_named(enumerators, enumerator); }

const Enumerator* Enum::find(std::int64_t number) const {
  const auto found =
      std::find_if(enumerators.begin(), enumerators.end(), [&](const auto& e) { return e.number == number; });
  return found == enumerators.end() ? nullptr : &*found;
}

const Field* Struct::find(std::string_view field) const { return find_named(fields, field); }

std::vector<std::string> Struct::field_names() const {
  std::vector<std::string> out;
  for (const Field& f : fields) out.push_back(f.name);
  return out;
}

const Method* Service::find(std::string_view method) const {
  const auto found = std::find_if(methods.begin(), methods.end(), [&](const Method* m) { return m->name == method; });
  return found == methods.end() ? nullptr : *found;
}

std::vector<std::string> Service::method_names() const {
  std::vector<std::string> out;
  for (const Method* m : methods) out.push_back(m->name);
  return out;
}

Loaded<Schema> Schema::load(std::string_view source, const std::string& file, const IncludeReader& include) {
  Loaded<Schema> out;
  ProgramPtr program = is_ros_file(file) ? load_ros(source, file, include, out.diagnostics)
                                         : Loader(include, out.diagnostics).load(source, file, 0);
  sort_by_place(out.diagnostics);
  if (program != nullptr) out.value = Schema(std::move(program));
  return out;
}

ServicePtr Schema::service(std::string_view name) const {
  const Service* found = program_->find(name, &Program::service_names);
  return found == nullptr ? nullptr : ServicePtr(program_, found);
}

const Type* Schema::type(std::string_view name) const { return program_->find(name, &Program::type_names); }

const Struct* Schema::structure(std::string_view name) const {
  const Type* found = type(name);
  return found == nullptr ? nullptr : found->structure;
}

const Enum* Schema::enumeration(std::string_view name) const {
  const Type* found = type(name);
  return found == nullptr ? nullptr : found->enumeration;
}

const Constant* Schema::constant(std::string_view name) const { return program_->find(name, &Program::constant_names); }

const std::deque<Service>& Schema::services() const { return program_->services; }
const std::deque<Struct>& Schema::structures() const { return program_->structs; }
const std::deque<Enum>& Schema::enumerations() const { return program_->enums; }
const std::deque<Typedef>& Schema::typedefs() const { return program_->typedefs; }

std::vector<std::string> Schema::service_names() const {
  std::vector<std::string> out;
  for (const Service& s : program_->services) out.push_back(s.name);
  return out;
}

const std::string& Schema::file() const { return program_->file; }

std::vector<std::string> Schema::files() const {
  std::vector<std::string> out;
  collect_files(*program_, out);
  return out;
}

}  // namespace sentree::idl
