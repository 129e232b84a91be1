#include "sentree/exec/coroutine_action.h"

#include <memory>
#include <optional>
#include <string_view>

namespace sentree::exec {

bool Coroutine::resume(bt::Context& context, const Task& task) {
  context_ = &context;
  if (here_ == nullptr) here_ = task.handle();
  if (!ready_ || ready_()) {
    ready_ = nullptr;
    here_.resume();
  }
  context_ = nullptr;
  return task.handle().done();
}

namespace {

/// A coroutine on its way.
struct Frame {
  Coroutine self;  // before the task, whose frame refers to it
  std::optional<Task> task;
};

class CoroutineMemory final : public bt::NodeMemory {
 public:
  std::unique_ptr<Frame> frame;
  bool lost = false;  ///< This is a copy made while the original was on its way.

  [[nodiscard]] std::unique_ptr<NodeMemory> clone() const override {
    auto copy = std::make_unique<CoroutineMemory>();
    copy->lost = lost || frame != nullptr;
    return copy;
  }
  [[nodiscard]] bool equals(const NodeMemory& other) const override {
    const auto* same = dynamic_cast<const CoroutineMemory*>(&other);
    return same == this || (same != nullptr && same->frame == nullptr && frame == nullptr && !same->lost && !lost);
  }
  [[nodiscard]] std::optional<Value> save() const override {
    if (frame != nullptr || lost) return std::nullopt;
    return Value(true);
  }
  [[nodiscard]] bool restore(const Value& /*saved*/) override {
    frame.reset();
    lost = false;
    return true;
  }
};

class CoroutineAction final : public bt::Behaviour {
 public:
  explicit CoroutineAction(std::function<Task(Coroutine&)> body) : body_(std::move(body)) {}

  [[nodiscard]] std::unique_ptr<bt::NodeMemory> make_memory() const override {
    return std::make_unique<CoroutineMemory>();
  }

  [[nodiscard]] std::string_view unsaved() const override {
    return "it is a coroutine on its way: save when it is not running, or make it a class with on_start(), "
           "on_running(), save() and restore()";
  }
  [[nodiscard]] bt::Next tick(bt::Context& self, bt::NodeMemory* memory) const override {
    const bt::Status kept = self.status();
    if (bt::is_completed(kept)) return bt::Next::done(kept);  // until its parent resets it
    auto& mine = *static_cast<CoroutineMemory*>(memory);
    if (mine.lost) {
      mine.lost = false;
      return failed(self, "the state was copied while the coroutine ran, and a coroutine cannot be copied");
    }
    try {
      if (mine.frame == nullptr) {
        mine.frame = std::make_unique<Frame>();
        mine.frame->task.emplace(body_(mine.frame->self));
      }
      if (!mine.frame->self.resume(self, *mine.frame->task)) return bt::Next::done(bt::Status::kRunning);
      const std::unique_ptr<Frame> over = std::move(mine.frame);
      const Task::promise_type& promise = over->task->handle().promise();
      if (promise.thrown) std::rethrow_exception(promise.thrown);
      if (promise.status == bt::Status::kRunning || promise.status == bt::Status::kIdle) {
        return failed(self, "the coroutine returned " + std::string(to_string(promise.status)) +
                                ", which is no result; co_await self.next_tick() is RUNNING");
      }
      return bt::Next::done(promise.status);
    } catch (const std::exception& thrown) {
      mine.frame.reset();
      return failed(self, thrown.what());
    } catch (...) {
      mine.frame.reset();
      return failed(self, "threw what is no std::exception");
    }
  }

  void halted(bt::Context& /*self*/, bt::NodeMemory* memory) const override {
    auto& mine = *static_cast<CoroutineMemory*>(memory);
    mine.frame.reset();
    mine.lost = false;
  }

 private:
  static bt::Next failed(bt::Context& self, std::string why) {
    self.fail(std::move(why));
    return bt::Next::done(bt::Status::kFailure);
  }

  std::function<Task(Coroutine&)> body_;
};

}  // namespace

void coroutine_action(bt::Registry& registry, std::string id, bt::Ports ports, std::function<Task(Coroutine&)> body) {
  bt::Registry::Entry entry;
  entry.id = std::move(id);
  entry.category = bt::Category::kAction;
  entry.ports = std::move(ports);
  entry.behaviour = std::make_shared<CoroutineAction>(std::move(body));
  registry.add(std::move(entry));
}

}  // namespace sentree::exec
