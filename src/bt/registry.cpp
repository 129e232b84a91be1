#include "sentree/bt/registry.h"

#include <fmt/format.h>

#include <dlfcn.h>

#include <set>
#include <utility>

#include "sentree/bt/model.h"

namespace sentree::bt {

/// Deletes nothing, and says of which plug-in a node is: Registry has no room for that, since plug-ins know what it
/// looks like. It has a name of its own because they ask for it too, with their own copy of this file.
struct OfPlugin {
  std::string file;
  std::shared_ptr<const Behaviour> behaviour;
  void operator()(const Behaviour* /*kept*/) const {}
};

namespace {

class FunctionLeaf final : public Behaviour {
 public:
  explicit FunctionLeaf(Registry::Function tick) : tick_(std::move(tick)) {}
  [[nodiscard]] Next tick(Context& self, NodeMemory* /*memory*/) const override { return Next::done(tick_(self)); }
  [[nodiscard]] const Registry::Function* function() const override { return &tick_; }

 private:
  Registry::Function tick_;
};

class FunctionDecorator final : public Behaviour {
 public:
  explicit FunctionDecorator(std::function<Status(Context&, Status)> map) : map_(std::move(map)) {}
  [[nodiscard]] Next tick(Context& /*self*/, NodeMemory* /*memory*/) const override { return Next::tick(0); }
  [[nodiscard]] Next child_done(Context& self, NodeMemory* /*memory*/, std::size_t /*child*/,
                                Status status) const override {
    return Next::done(map_(self, status));
  }

 private:
  std::function<Status(Context&, Status)> map_;
};

bool is_identifier(std::string_view name) {
  if (name.empty()) return false;
  const auto letter = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || static_cast<unsigned char>(c) >= 0x80;
  };
  if (!letter(name.front())) return false;
  for (const char c : name) {
    if (!letter(c) && !(c >= '0' && c <= '9') && c != '-' && c != '.' && c != ':') return false;
  }
  return true;
}

}  // namespace

void Registry::no_function(const std::string& id) {
  problems_.push_back({Severity::kError,
                       "bt.no-function",
                       fmt::format("C++ node \"{}\": is registered with an empty function", id),
                       {}});
}

void Registry::action(std::string id, Ports ports, Function tick) {
  if (!tick) return no_function(id);
  add(Entry{
      std::move(id), Category::kAction, true, std::move(ports), {}, std::make_shared<FunctionLeaf>(std::move(tick))});
}

void Registry::condition(std::string id, Ports ports, Function tick) {
  if (!tick) return no_function(id);
  add(Entry{std::move(id),
            Category::kCondition,
            true,
            std::move(ports),
            {},
            std::make_shared<FunctionLeaf>(std::move(tick))});
}

void Registry::decorator(std::string id, Ports ports, std::function<Status(Context&, Status)> map) {
  if (!map) return no_function(id);
  add(Entry{std::move(id),
            Category::kDecorator,
            false,
            std::move(ports),
            {},
            std::make_shared<FunctionDecorator>(std::move(map))});
}

void Registry::add(Entry entry) {
  const auto problem = [this, &entry](std::string code, std::string message) {
    problems_.push_back({Severity::kError, std::move(code), fmt::format("C++ node \"{}\": {}", entry.id, message), {}});
  };
  if (!is_identifier(entry.id)) {
    return problem("bt.bad-name", "an ID starts with a letter and has letters, digits, '_', '-', '.' and ':' only");
  }
  if (find_builtin(entry.id, 4) != nullptr) return problem("bt.duplicate-node", "this ID is built in");
  if (entry.ports.size() > kPortsMax) return problem("bt.too-large", fmt::format("has more than {} ports", kPortsMax));
  for (PortInfo& port : entry.ports) {
    if (!is_identifier(port.name) || port.name.front() == '_' || port.name == "name" || port.name == "ID") {
      return problem("bt.bad-name", fmt::format("\"{}\" cannot be the name of a port", port.name));
    }
    if (port.type == &type_of<AnyType>()) port.type = nullptr;
  }
  std::string id = entry.id;
  const auto [first, is_new] = entries_.try_emplace(std::move(id), std::move(entry));
  if (is_new) return;
  const auto* const of = std::get_deleter<OfPlugin>(first->second.behaviour);
  problems_.push_back(
      {Severity::kError,
       "bt.duplicate-node",
       of == nullptr ? fmt::format("C++ node \"{}\" is registered twice; remove the first", first->first)
                     : fmt::format("C++ node \"{}\" is registered twice; plug-in {}, which was loaded before, has that "
                                   "ID: give one of them another, or load the nodes once only",
                                   first->first, of->file),
       {}});
}

bool Registry::remove(std::string_view id) {
  const auto found = entries_.find(id);
  if (found == entries_.end()) return false;
  entries_.erase(found);
  return true;
}

Status Behaviour::tick_leaf(Context& self, NodeMemory* memory) const {
  const Next next = tick(self, memory);
  if (next.child != kNoNode) self.fail(fmt::format("ticks child {} and has none", next.child));
  return next.status;
}

void Registry::enum_value(std::string name, std::int64_t value) {
  for (const auto& [known, old] : enums_) {
    if (known != name) continue;
    if (old != value) {
      problems_.push_back({Severity::kError,
                           "bt.duplicate-enum",
                           fmt::format("script enum \"{}\" is {} and cannot be {} too", name, old, value),
                           {}});
    }
    return;
  }
  enums_.emplace_back(std::move(name), value);
}

Result<void> Registry::plugin(const std::filesystem::path& path) {
  const std::string shown = "plug-in " + path.string();
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return fail("bt.plugin-unreadable", shown + ": no such file");
  // Without a slash the loader would look for it elsewhere.
  void* library = dlopen(std::filesystem::absolute(path, error).c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    const char* why = dlerror();
    return fail("bt.plugin-unreadable",
                fmt::format("{} cannot be loaded: {}", shown, why != nullptr ? why : "the loader does not say why"));
  }
  const auto abi = reinterpret_cast<const char* (*)()>(dlsym(library, "sentree_plugin_abi"));
  const auto nodes = reinterpret_cast<void (*)(Registry&)>(dlsym(library, "sentree_register_nodes"));
  if (abi == nullptr || nodes == nullptr) {
    dlclose(library);
    return fail("bt.plugin-symbol", shown + " registers no nodes; begin its function with SENTREE_REGISTER_NODES");
  }
  if (std::string_view(abi()) != SENTREE_PLUGIN_ABI) {
    const std::string other = abi();
    dlclose(library);
    return fail("bt.plugin-abi", fmt::format("{} was built for {}; this program needs {}, so build it again", shown,
                                             other, SENTREE_PLUGIN_ABI));
  }
  std::set<std::shared_ptr<const Behaviour>> known;
  for (const auto& [id, entry] : entries_) known.insert(entry.behaviour);
  const std::size_t problems_before = problems_.size();
  Result<void> registered;
  try {
    nodes(*this);
  } catch (const std::exception& thrown) {
    registered = fail("bt.plugin-threw", fmt::format("{}: {}", shown, thrown.what()));
  } catch (...) {
    registered = fail("bt.plugin-threw", shown + ": threw something that is no std::exception");
  }
  for (std::size_t i = problems_before; i < problems_.size(); ++i)
    problems_[i].message = fmt::format("{}: {}", shown, problems_[i].message);
  for (auto& [id, entry] : entries_) {
    if (entry.behaviour == nullptr || known.contains(entry.behaviour)) continue;
    const Behaviour* const raw = entry.behaviour.get();
    entry.behaviour = std::shared_ptr<const Behaviour>(raw, OfPlugin{path.string(), std::move(entry.behaviour)});
  }
  return registered;
}

const Registry::Entry* Registry::find(std::string_view id) const {
  const auto found = entries_.find(id);
  return found != entries_.end() ? &found->second : nullptr;
}

}  // namespace sentree::bt
