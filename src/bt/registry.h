#pragma once

#include <concepts>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/bt/context.h"
#include "sentree/bt/object.h"
#include "sentree/bt/tree.h"
#include "sentree/bt/types.h"

namespace sentree::bt {

/// What a C++ node does. One object serves all nodes of its ID; what a node remembers is in the state.
class Behaviour {
 public:
  virtual ~Behaviour() = default;
  /// What a fresh node remembers; null if nothing.
  [[nodiscard]] virtual std::unique_ptr<NodeMemory> make_memory() const { return nullptr; }
  [[nodiscard]] virtual Next tick(Context& self, NodeMemory* memory) const = 0;
  [[nodiscard]] virtual Next child_done(Context& /*self*/, NodeMemory* /*memory*/, std::size_t /*child*/,
                                        Status status) const {
    return Next::done(status);
  }
  /// `tick` of a leaf, which has no children to tick.
  [[nodiscard]] virtual Status tick_leaf(Context& self, NodeMemory* memory) const;
  /// All that a leaf does, if that is one function without memory; else null, and `tick` says.
  [[nodiscard]] virtual const std::function<Status(Context&)>* function() const { return nullptr; }
  /// What to do where a node's memory cannot be saved, for the message.
  [[nodiscard]] virtual std::string_view unsaved() const { return "give its class save() and restore()"; }
  /// Called when the node is halted while it runs, before its children are.
  virtual void halted(Context& /*self*/, NodeMemory* /*memory*/) const {}
};

/// Bounds of a script enum's value and of the number of ports a node may declare.
inline constexpr std::size_t kPortsMax = 1'000;

/// The C++ nodes and script enums that trees may use, beside what is built in.
///
///     bt::Registry registry;
///     registry.action("SayHello", {bt::input<std::string>("to")}, [](bt::Context& self) {
///       fmt::print("Hello {}\n", self.input_or<std::string>("to", "world"));
///       return bt::Status::kSuccess;
///     });
///
/// Errors while registering (a name twice, a reserved port name …) are kept and reported by `load`.
class Registry {
 public:
  struct Entry {
    std::string id;
    Category category = Category::kAction;
    bool synchronous = false;  ///< May not return RUNNING.
    Ports ports;
    std::string description;
    std::shared_ptr<const Behaviour> behaviour;
    bool loop = false;        ///< The built-in Loop decorator with ports of other types; see `loop`.
    std::string plugin = {};  ///< Whose node it is; empty: this program's.
  };
  using Function = std::function<Status(Context&)>;

  /// An action that is done at once: SUCCESS, FAILURE or SKIPPED.
  void action(std::string id, Ports ports, Function tick);
  void action(std::string id, Function tick) { action(std::move(id), {}, std::move(tick)); }
  /// A condition; consulted at every tick.
  void condition(std::string id, Ports ports, Function tick);
  void condition(std::string id, Function tick) { condition(std::move(id), {}, std::move(tick)); }
  /// A decorator that maps its child's status.
  void decorator(std::string id, Ports ports, std::function<Status(Context&, Status child)> map);

  /// A class whose object is what a node remembers; each node has a copy of `prototype` in the state.
  ///
  /// Stateful action: `Status on_start(Context&)`, `Status on_running(Context&)`, `void on_halted(Context&)`.
  /// Anything that ticks at once: `Status tick(Context&)`.
  /// Control or decorator: `Next on_tick(Context&)`, `Next on_child(Context&, std::size_t child, Status)`,
  ///   optionally `void on_halted(Context&)`.
  /// `static Ports ports()` is optional. Nodes are copied, with the states of their tree: what cannot be copied goes
  /// into a `std::shared_ptr`.
  template <class Node>
  void add(std::string id, Category category, Node prototype = {});
  template <class Node>
  void add(std::string id, Node prototype = {});

  /// Any behaviour, e.g. one that keeps a thread (see `runtime`).
  void add(Entry entry);
  /// Forgets an ID; true if there was one.
  bool remove(std::string_view id);

  /// A name that scripts and ports may use for a number.
  void enum_value(std::string name, std::int64_t value);
  template <class T>
  requires std::is_enum_v<T>
  void enum_value(std::string name, T value) { enum_value(std::move(name), static_cast<std::int64_t>(value)); }

  /// A decorator like LoopDouble, for elements of type T. A literal queue "a;b" needs `Convert<T>::from_text`.
  template <Convertible T>
  void loop(std::string id) {
    add(Entry{std::move(id),
              Category::kDecorator,
              false,
              {inout<std::vector<T>>("queue"), input_default<Status>("if_empty", "SUCCESS"), output<T>("value")},
              {},
              nullptr,
              true});
  }

  /// Ports of `std::shared_ptr<Base>` may read entries that hold a `std::shared_ptr<Derived>`, and the other way round
  /// where the object is one. Casts chain.
  template <class Derived, class Base>
  void polymorphic_cast() {
    static_assert(std::is_base_of_v<Base, Derived> && std::is_polymorphic_v<Base>);
    using From = std::shared_ptr<Derived>;
    using To = std::shared_ptr<Base>;
    casts_.push_back({&type_of<From>(), &type_of<To>(), [](const Object& object) -> std::shared_ptr<const Object> {
                        return std::make_shared<Boxed<To>>(static_cast<const Boxed<From>&>(object).content());
                      }});
    casts_.push_back({&type_of<To>(), &type_of<From>(), [](const Object& object) -> std::shared_ptr<const Object> {
                        auto down = std::dynamic_pointer_cast<Derived>(static_cast<const Boxed<To>&>(object).content());
                        return down != nullptr ? std::make_shared<Boxed<From>>(std::move(down)) : nullptr;
                      }});
  }

  /// Loads a shared library and lets it register its nodes: what SENTREE_REGISTER_NODES begins. The library stays
  /// loaded as long as the program. Errors: bt.plugin-unreadable (no such file, or not loadable), bt.plugin-symbol (no
  /// plug-in of ours), bt.plugin-abi (built against another version of Sentree or with another compiler's ABI),
  /// bt.plugin-threw.
  [[nodiscard]] Result<void> plugin(const std::filesystem::path& path);

  [[nodiscard]] const Entry* find(std::string_view id) const;
  [[nodiscard]] const std::map<std::string, Entry, std::less<>>& entries() const { return entries_; }
  [[nodiscard]] const std::vector<std::pair<std::string, std::int64_t>>& enums() const { return enums_; }
  [[nodiscard]] const std::vector<PolymorphicCast>& casts() const { return casts_; }
  [[nodiscard]] const Diagnostics& problems() const { return problems_; }

 private:
  void no_function(const std::string& id);

  std::map<std::string, Entry, std::less<>> entries_;
  std::vector<std::pair<std::string, std::int64_t>> enums_;
  std::vector<PolymorphicCast> casts_;
  Diagnostics problems_;
  std::string plugin_;  // that is registering its nodes
};

namespace detail {

template <class Node>
concept Stateful = requires(Node node, Context& self) {
  { node.on_start(self) } -> std::same_as<Status>;
  { node.on_running(self) } -> std::same_as<Status>;
};
template <class Node>
concept Composite = requires(Node node, Context& self) {
  { node.on_tick(self) } -> std::same_as<Next>;
  { node.on_child(self, std::size_t{}, Status{}) } -> std::same_as<Next>;
};

/// Its `on_halted`, if there is one, can be called.
template <class Node>
inline constexpr bool kHaltFits = !requires {
  &Node::on_halted;
}
|| requires(Node node, Context& self) { node.on_halted(self); };
/// It has a function that is called when the node is halted nowhere but in other libraries, and none of ours.
template <class Node>
inline constexpr bool kHaltIsMisspelt = !requires {
  &Node::on_halted;
}
&&(
    requires { &Node::onHalted; } || requires { &Node::on_halt; });

template <class Node>
class ClassBehaviour final : public Behaviour {
 public:
  explicit ClassBehaviour(Node prototype) : prototype_(std::move(prototype)) {}
  [[nodiscard]] std::unique_ptr<NodeMemory> make_memory() const override {
    return std::make_unique<TypedMemory<Node>>(prototype_);
  }
  [[nodiscard]] Next tick(Context& self, NodeMemory* memory) const override {
    Node& node = static_cast<TypedMemory<Node>*>(memory)->content;
    if constexpr (Composite<Node>) {
      return node.on_tick(self);
    } else if constexpr (Stateful<Node>) {
      // A completed action keeps its status until its parent resets it.
      const Status kept = self.status();
      if (kept == Status::kIdle) return Next::done(node.on_start(self));
      if (kept == Status::kRunning) return Next::done(node.on_running(self));
      return Next::done(kept);
    } else {
      return Next::done(node.tick(self));
    }
  }
  [[nodiscard]] Status tick_leaf(Context& self, NodeMemory* memory) const override {
    if constexpr (Composite<Node>) {
      return Behaviour::tick_leaf(self, memory);
    } else {
      return ClassBehaviour::tick(self, memory).status;
    }
  }
  [[nodiscard]] Next child_done(Context& self, NodeMemory* memory, std::size_t child, Status status) const override {
    if constexpr (Composite<Node>) {
      return static_cast<TypedMemory<Node>*>(memory)->content.on_child(self, child, status);
    } else {
      return Next::done(status);
    }
  }
  void halted(Context& self, NodeMemory* memory) const override {
    if constexpr (requires(Node node) { node.on_halted(self); }) {
      static_cast<TypedMemory<Node>*>(memory)->content.on_halted(self);
    }
  }

 private:
  Node prototype_;
};

}  // namespace detail

template <class Node>
void Registry::add(std::string id, Category category, Node prototype) {
  static_assert(std::is_copy_constructible_v<Node>,
                "nodes are copied, with the states of their tree: keep what cannot be copied (a unique_ptr, a mutex, a "
                "connection) in a shared_ptr");
  static_assert(detail::kHaltFits<Node>, "on_halted cannot be called; write void on_halted(sentree::bt::Context&)");
  static_assert(!detail::kHaltIsMisspelt<Node>,
                "nobody calls onHalted or on_halt; write void on_halted(sentree::bt::Context&)");
  Entry entry;
  entry.id = std::move(id);
  entry.category = category;
  entry.synchronous = !detail::Stateful<Node> && !detail::Composite<Node> && category == Category::kAction;
  if constexpr (requires { Node::ports(); }) entry.ports = Node::ports();
  entry.behaviour = std::make_shared<detail::ClassBehaviour<Node>>(std::move(prototype));
  add(std::move(entry));
}

template <class Node>
void Registry::add(std::string id, Node prototype) {
  static_assert(!detail::Composite<Node>,
                "say whether it is a control or a decorator: add<Node>(id, Category::kControl)");
  add<Node>(std::move(id), Category::kAction, std::move(prototype));
}

}  // namespace sentree::bt

/// What plug-in and program must agree on, since they exchange C++ objects: these headers, and the standard library's
/// ABI. Raise the version whenever Registry, Behaviour, Context or what they hand over changes.
#define SENTREE_PLUGIN_VERSION 3
#define SENTREE_PLUGIN_TEXT(number) #number
#define SENTREE_PLUGIN_EXPANDED(number) SENTREE_PLUGIN_TEXT(number)
#define SENTREE_PLUGIN_ABI                                                                             \
  "sentree::bt " SENTREE_PLUGIN_EXPANDED(SENTREE_PLUGIN_VERSION) ", C++ ABI " SENTREE_PLUGIN_EXPANDED( \
      __GXX_ABI_VERSION) ", standard library " SENTREE_PLUGIN_EXPANDED(_GLIBCXX_USE_CXX11_ABI)

/// Begins the function by which a plug-in registers its nodes: `SENTREE_REGISTER_NODES(registry) { registry.add…; }`.
#define SENTREE_REGISTER_NODES(registry)                                                                            \
  extern "C" __attribute__((visibility("default"))) const char* sentree_plugin_abi() { return SENTREE_PLUGIN_ABI; } \
  extern "C" __attribute__((visibility("default"))) void sentree_register_nodes(sentree::bt::Registry& registry)
