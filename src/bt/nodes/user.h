#pragma once

#include <algorithm>
#include <array>
#include <exception>
#include <stdexcept>
#include <string>

#include "sentree/bt/nodes/node.h"

namespace sentree::bt::nodes {

/// A node written in C++.
struct User : AnyNode {
  /// Not 0: it has asked for the time.
  static constexpr std::array kWords{Word{}};
  static may::Mask may_return(const may::Asked& asked) {
    return asked.synchronous ? may::kLeaf : may::kLeaf | may::kRunning;
  }

  [[gnu::noinline]] static Next enter(Machine& m, const Node& n, NodeId id) {
    const UserNode& user = m.model().users[n.data];
    Context self(m, id, m.status(id));
    return checked(m, n, id, guarded(m, id, [&] {
                     return user.function != nullptr ? Next::done((*user.function)(self))
                                                     : user.behaviour->tick(self, memory(m, user));
                   }));
  }
  [[gnu::always_inline]] static Next tick(Machine& m, const Node& n, NodeId id) {
    return n.child_count == 0 ? Next::done(checked(m, n, id, ask_leaf(m, n, id))) : enter(m, n, id);
  }
  /// What a leaf says, unchecked: see `said`.
  [[gnu::always_inline]] static Status ask_leaf(Machine& m, const Node& n, NodeId id) {
    if (m.watch() != nullptr) [[unlikely]]
      return ask_watched(m, n, id);
    const UserNode& user = m.user(n);
    Context self(m, id, m.status(id));
    try {
      if (user.function != nullptr) return (*user.function)(self);
      return user.behaviour->tick_leaf(self, memory(m, user));
    } catch (...) {
      return threw(m, id).status;
    }
  }
  [[gnu::noinline]] static Status ask_watched(Machine& m, const Node& n, NodeId id) {
    const UserNode& user = m.user(n);
    Context self(m, id, m.status(id));
    return guarded(m, id,
                   [&] {
                     return Next::done(user.function != nullptr ? (*user.function)(self)
                                                                : user.behaviour->tick_leaf(self, memory(m, user)));
                   })
        .status;
  }
  /// The whole tick of a leaf without conditions.
  template <Status kUsual>
  [[gnu::always_inline]] static Status tick_plain(Machine& m, const Node& n, NodeId id) {
    const Status status = ask_leaf(m, n, id);
    if (m.unusual()) [[unlikely]]
      return said(m, n, id, status);
    if (status == kUsual && kUsual != Status::kRunning) [[likely]] {
      m.keep_unseen(id, status);
    } else if (status == Status::kRunning && (n.flags & Node::kSynchronous) == 0) [[likely]] {
      m.keep_unseen(id, status);
    } else if (is_completed(status)) {
      m.keep_unseen(id, status);
    } else {
      return said(m, n, id, status);
    }
    return status;
  }
  /// What a leaf has said, if it may say so; IDLE: the tick is given up.
  [[gnu::always_inline]] static Status checked(Machine& m, const Node& n, NodeId id, Status status) {
    if (is_completed(status) && !m.failed()) [[likely]]
      return status;
    return checked(m, n, id, Next::done(status)).status;
  }
  /// Takes it.
  [[gnu::noinline]] static Status said(Machine& m, const Node& n, NodeId id, Status status) {
    status = checked(m, n, id, status);
    if (status != Status::kIdle) m.keep(id, status);
    return status;
  }
  [[gnu::noinline]] static Next child_done(Machine& m, const Node& n, NodeId id, NodeId child, Status status) {
    const UserNode& user = m.model().users[n.data];
    // Children are in ascending order of their ids.
    const NodeId* const first = m.model().children.data() + n.first_child;
    const auto index = static_cast<std::size_t>(std::lower_bound(first, first + n.child_count, child) - first);
    Context self(m, id, m.status(id));
    return checked(m, n, id,
                   guarded(m, id, [&] { return user.behaviour->child_done(self, memory(m, user), index, status); }));
  }
  static void halt(Machine& m, const Node& n, NodeId id) {
    if (m.status(id) == Status::kRunning) {
      const UserNode& user = m.model().users[n.data];
      Context self(m, id, Status::kRunning);
      guarded(m, id, [&] {
        user.behaviour->halted(self, memory(m, user));
        return Next::done(Status::kIdle);
      });
    }
    m.reset_children(n);
  }

 private:
  /// While a function of the node is called.
  class Watched {
   public:
    Watched(CallWatch* watch, NodeId id) : watch_(watch), before_(watch != nullptr ? watch->enter(id) : 0) {}
    ~Watched() {
      if (watch_ != nullptr) watch_->leave(before_);
    }
    Watched(const Watched&) = delete;
    Watched& operator=(const Watched&) = delete;

   private:
    CallWatch* const watch_;
    const std::uint64_t before_;
  };

  /// Somebody else's code may throw; that gives the tick up, as `Context::fail` does.
  template <class Call>
  static Next guarded(Machine& m, NodeId id, const Call& call) {
    try {
      const Watched watched(m.watch(), id);
      return call();
    } catch (...) {
      return threw(m, id);
    }
  }
  /// Inside a handler.
  [[gnu::noinline, gnu::cold]] static Next threw(Machine& m, NodeId id) {
    try {
      throw;
    } catch (const std::exception& thrown) {
      return m.fail(id, "bt.node-threw", std::string("threw ") + thrown.what());
    } catch (...) {
      return m.fail(id, "bt.node-threw", "threw something that is no std::exception");
    }
  }
  static NodeMemory* memory(Machine& m, const UserNode& user) {
    if (user.object == kNone) return nullptr;
    NodeMemory* const remembered = m.object(user.object);
    if (remembered == nullptr) [[unlikely]]
      uncopied();
    return remembered;
  }
  /// All who ask for a memory take what is thrown.
  [[noreturn, gnu::noinline, gnu::cold]] static void uncopied() {
    throw std::runtime_error("when it was copied, which the copy of a state asks for");
  }
  [[gnu::noinline]] static Next checked(Machine& m, const Node& n, NodeId id, Next next) {
    if (m.failed()) return Next::done(Status::kIdle);
    if (next.child == kNoNode) {
      if (next.status == Status::kIdle) return m.fail(id, "bt.idle-returned", "returned IDLE, which no tick may");
      if (next.status == Status::kRunning && (n.flags & Node::kSynchronous) != 0) {
        return m.fail(id, "bt.running-returned",
                      "returned RUNNING, which a function may not: make it a class, of an action with on_start() and "
                      "on_running(), of a condition with tick()");
      }
      return next;
    }
    if (next.child >= n.child_count) {
      return m.fail(id, "bt.child-count",
                    "ticks child " + std::to_string(next.child) + " and has " + std::to_string(n.child_count));
    }
    m.set_status(id, Status::kRunning);
    return m.count_cycle(id) ? next : Next::done(Status::kIdle);
  }
};

}  // namespace sentree::bt::nodes
