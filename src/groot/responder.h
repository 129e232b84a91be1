#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <utility>
#include <vector>

#include "sentree/groot/scene.h"

namespace sentree::groot {

/// Carries out what Groot 2 asks for through hooks. Called in the thread that serves Groot; may block until it is done.
class Hooks {
 public:
  virtual ~Hooks() = default;
  /// From now on it is so at this place, whatever was there. Errors: what of it cannot be; nothing has changed then.
  virtual Result<void> set(const Hook& hook) = 0;
  /// Nothing is there any more; who waits there goes on.
  virtual void unset(const Hook& hook) = 0;
  /// Whoever waits at this breakpoint goes on; the node answers `desired` if that is SUCCESS or FAILURE.
  virtual Result<void> unlock(const Hook& hook, bt::Status desired) = 0;
};

/// Answers the requests of Groot 2. Owns no thread and no socket; for one thread.
class Responder {
 public:
  using Now = std::chrono::steady_clock::time_point;
  /// Hooks at a time; one more is refused.
  static constexpr std::size_t kHooksMax = 256;
  /// Names of blackboards in one question, in octets.
  static constexpr std::size_t kNamesMax = 16'384;
  /// Who has hooks and asks nothing for so long is gone: nothing waits for him any more.
  static constexpr std::chrono::seconds kSilenceMax{5};

  /// @param hooks  Null: hooks are refused, and what looks is answered.
  Responder(Scene& scene, Hooks* hooks) : scene_(scene), hooks_(hooks) {}

  /// @param now_us  Microseconds since 1970.
  [[nodiscard]] Parts answer(const Parts& parts, Now now, std::int64_t now_us);
  /// To be called now and then: disables the hooks of who is gone.
  void look_after(Now now);
  /// A hook that is used up is gone.
  void used(std::uint16_t uid, Hook::Position position);
  /// Another run: what was set is of no tree any more. The hooks of the run before are gone with it.
  void forget() { all_.clear(); }

 private:
  using Place = std::pair<std::uint16_t, Hook::Position>;
  [[nodiscard]] Result<std::optional<std::string>> body_of(const Request& request, std::int64_t now_us);
  [[nodiscard]] Result<void> insert(const Request& request);
  [[nodiscard]] Result<void> remove(const Request& request);
  [[nodiscard]] Result<void> unlock(const Request& request);
  [[nodiscard]] bool is_on(const Hook& hook) const { return hook.enabled && !silent_; }
  void disable(Hook& hook);

  Scene& scene_;
  Hooks* hooks_;
  std::map<Place, Hook> all_;
  Now heard_{};
  bool silent_ = false;  // hooks are off because nobody asks
};

}  // namespace sentree::groot
