#pragma once

#include <coroutine>
#include <exception>
#include <functional>
#include <string>
#include <utility>

#include "sentree/bt/registry.h"

namespace sentree::exec {

/// What a coroutine action returns: its status, some ticks later. Coroutines may await one another: `co_await
/// other(self)` gives the status of `other`, and an exception passes through.
class [[nodiscard]] Task {
 public:
  struct promise_type;
  using Handle = std::coroutine_handle<promise_type>;

  struct promise_type {
    bt::Status status = bt::Status::kIdle;
    std::exception_ptr thrown;
    std::coroutine_handle<> continuation;  ///< Who awaits it; none for the outermost.

    struct Final {
      static bool await_ready() noexcept { return false; }
      static std::coroutine_handle<> await_suspend(Handle done) noexcept {
        const std::coroutine_handle<> next = done.promise().continuation;
        return next ? next : std::noop_coroutine();
      }
      static void await_resume() noexcept {}
    };
    Task get_return_object() { return Task(Handle::from_promise(*this)); }
    static std::suspend_always initial_suspend() noexcept { return {}; }
    static Final final_suspend() noexcept { return {}; }
    void return_value(bt::Status value) { status = value; }
    void unhandled_exception() { thrown = std::current_exception(); }
  };

  Task(Task&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
  Task& operator=(Task&& other) noexcept {
    if (this != &other) {
      if (handle_) handle_.destroy();
      handle_ = std::exchange(other.handle_, nullptr);
    }
    return *this;
  }
  ~Task() {
    if (handle_) handle_.destroy();
  }

  struct Awaiter {
    Handle handle;
    static bool await_ready() noexcept { return false; }
    std::coroutine_handle<> await_suspend(std::coroutine_handle<> awaiting) const noexcept {
      handle.promise().continuation = awaiting;
      return handle;
    }
    [[nodiscard]] bt::Status await_resume() const {
      if (handle.promise().thrown) std::rethrow_exception(handle.promise().thrown);
      return handle.promise().status;
    }
  };
  Awaiter operator co_await() const noexcept { return {handle_}; }

  [[nodiscard]] Handle handle() const { return handle_; }

 private:
  explicit Task(Handle handle) : handle_(handle) {}
  Handle handle_;
};

/// What a coroutine sees of its node. It stays the same from the first tick to the last, while each tick brings a
/// `bt::Context` of its own, reached by `->`.
class Coroutine {
 public:
  /// Waits that end when `ready` says so, which is asked at once and then at each tick.
  class [[nodiscard]] Until {
   public:
    Until(Coroutine& self, std::function<bool()> ready) : self_(self), ready_(std::move(ready)) {}
    [[nodiscard]] bool await_ready() const { return ready_(); }
    void await_suspend(std::coroutine_handle<> here) {
      self_.here_ = here;
      self_.ready_ = std::move(ready_);
    }
    static void await_resume() noexcept {}

   private:
    Coroutine& self_;
    std::function<bool()> ready_;
  };
  struct [[nodiscard]] NextTick {
    Coroutine& self;
    static bool await_ready() noexcept { return false; }
    void await_suspend(std::coroutine_handle<> here) const noexcept { self.here_ = here; }
    static void await_resume() noexcept {}
  };

  Coroutine() = default;
  Coroutine(const Coroutine&) = delete;
  Coroutine& operator=(const Coroutine&) = delete;

  /// The present tick's context. Do not keep it over a co_await.
  [[nodiscard]] bt::Context& operator*() const { return *context_; }
  [[nodiscard]] bt::Context* operator->() const { return context_; }

  /// `co_await self.next_tick()`: RUNNING, and on at the next tick.
  NextTick next_tick() { return {*this}; }
  /// `co_await self.until([&] { return arrived; })`: RUNNING until it holds at a tick.
  Until until(std::function<bool()> ready) { return {*this, std::move(ready)}; }
  /// RUNNING for that long on the tree's clock, so on to the first tick at or after its end.
  Until sleep(Duration duration) {
    return until([this, due = add_saturating(context_->now(), duration)] { return context_->now() >= due; });
  }

  // --- For the node -------------------------------------------------------------------------------------------------

  /// Goes on where it waits, unless what it waits for is not there. True: it is at its end.
  bool resume(bt::Context& context, const Task& task);

 private:
  bt::Context* context_ = nullptr;
  std::coroutine_handle<> here_;  ///< The innermost coroutine, which waits.
  std::function<bool()> ready_;
};

/// Registers an action that is written as one function and waits in the middle (BehaviorTree.CPP's CoroActionNode),
/// without a thread:
///
///     exec::coroutine_action(registry, "Deliver", {bt::input<std::string>("to")}, [](exec::Coroutine& self) ->
///     exec::Task {
///       Request request = send(self->input_or<std::string>("to", ""));
///       co_await self.until([&] { return request.answered(); });
///       if (!request.accepted()) co_return bt::Status::kFailure;
///       co_await self.sleep(2s);
///       co_return bt::Status::kSuccess;
///     });
///
/// RUNNING while it waits. Halting destroys it where it stands: destructors of its locals clean up. An exception fails
/// the tick with its text. The next tick of an idle node begins it anew.
///
/// A coroutine is no value: in a copy of a state in which one waits, its next tick fails with that message, and such a
/// state cannot be saved (bt.unsavable).
/// The function is kept as long as the registry or a tree; what it captures may be used throughout. Parameters of
/// coroutines of yours that it awaits should be taken by value, as always with coroutines.
void coroutine_action(bt::Registry& registry, std::string id, bt::Ports ports, std::function<Task(Coroutine&)> body);

}  // namespace sentree::exec
