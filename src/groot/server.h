#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "sentree/base/result.h"
#include "sentree/groot/responder.h"
#include "sentree/groot/scene.h"

namespace sentree::groot {

/// Whether this was built with ZeroMQ; if not, servers and clients are refused with groot.not-built.
[[nodiscard]] bool is_built();

/// A tree's ID that no other has.
[[nodiscard]] TreeId new_tree_id();
/// Where Groot 1's numbers of a tree begin, in all likelihood elsewhere than those of any tree before.
[[nodiscard]] std::uint16_t new_base();

struct ServerOptions {
  std::string address = "127.0.0.1";
  /// Of Groot 2, which gets this port and the next one; Groot 1's publisher is one below, its server two above. 0: any
  /// free ones.
  std::uint16_t port = kGroot2Port;
  /// Others may reach it. ZeroMQ authenticates nobody, so they may look only: hooks are refused.
  bool insecure = false;
  /// Told once if serving ends because something is broken; in the server's thread.
  std::function<void(const std::string&)> on_problem = {};
};

/// "1667", "0.0.0.0:1667", or "true" for the usual place. Error: groot.bad-address.
[[nodiscard]] Result<ServerOptions> parse_server_address(const std::string& where);

/// Serves a scene to Groot 1 and Groot 2, both at once, as BehaviorTree.CPP's publishers do.
///
/// Has a thread of its own (and ZeroMQ's). Requests are at most 64 KiB a part; more than four parts are not looked at;
/// a listener that does not keep up misses messages. Whoever connects and says nothing sensible costs nothing but time;
/// but ZeroMQ keeps the parts of a message until it is whole, and has no bound for how many there are.
class Server {
 public:
  static constexpr std::int64_t kPartBytesMax = 64 << 10;
  static constexpr std::size_t kPartsMax = 4;
  /// Hooks that were reached and are still to be told; more are not told.
  static constexpr std::size_t kNoticesMax = 256;

  /// `scene` has a tree; both are borrowed. `hooks` null: hooks are refused.
  /// Errors: groot.not-built, groot.bad-address, groot.not-loopback, groot.port-taken.
  [[nodiscard]] static Result<std::unique_ptr<Server>> start(Scene& scene, Hooks* hooks, ServerOptions options);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  struct Ports {
    std::uint16_t groot2 = 0;  ///< And the next one.
    std::uint16_t groot1_publisher = 0;
    std::uint16_t groot1_server = 0;
  };
  [[nodiscard]] Ports ports() const;
  /// In a sentence, for whoever opened it: where it is, and that nobody is authenticated.
  [[nodiscard]] std::string told() const;

  /// A hook was reached; `used`: and is used up. From any thread; never waits.
  void reached(std::uint16_t uid, Hook::Position position, bool used);
  /// Another tree began, of which there are no hooks yet. From any thread.
  void forget_hooks();
  /// How often anybody has asked for the tree. From any thread.
  [[nodiscard]] std::uint64_t trees_asked() const;

 private:
  struct Impl;
  explicit Server(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::groot
