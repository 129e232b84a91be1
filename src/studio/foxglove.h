#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "sentree/base/result.h"
#include "sentree/record/audience.h"

namespace sentree::studio {

/// Where Foxglove looks when nobody says where.
inline constexpr std::uint16_t kFoxglovePort = 8765;
/// Clients at once; more are refused with 503.
inline constexpr std::size_t kFoxgloveClientsMax = 16;

struct FoxgloveOptions {
  std::string address = "127.0.0.1";
  std::uint16_t port = kFoxglovePort;  ///< 0: any that is free.
  bool insecure = false;               ///< Other machines may look, and pages of any site.
  std::string version;
  std::size_t queue_bytes_max = 8U << 20U;  ///< That wait for one client; what does not fit is lost to it.
};

/// Runs, one after the other, for clients of the Foxglove WebSocket protocol: what is recorded, as it is recorded.
///
/// It is the audience of a recorder, which it never holds up: a client that is too slow loses messages, is told how
/// many, and gets the latest of each topic that it missed. Who subscribes gets the latest message of the topic first,
/// so that a map that was published once is seen. Clients only look; nobody is authenticated.
class Foxglove final : public record::Audience {
 public:
  /// Errors: those of `http::Server::listen`.
  [[nodiscard]] static Result<std::unique_ptr<Foxglove>> start(FoxgloveOptions options);
  /// Ends all connections at once.
  ~Foxglove() override;
  Foxglove(const Foxglove&) = delete;
  Foxglove& operator=(const Foxglove&) = delete;

  /// What is recorded from now on belongs to a run of this name; what was before is forgotten.
  void begin(std::string_view run);
  void channel(const record::Channel& channel, const record::Schema& schema) override;
  void message(const record::RawMessage& message) override;
  /// Closes all connections once they have taken what waits for them, and waits for that, two seconds at most.
  void end();

  [[nodiscard]] std::string url() const;  ///< "ws://127.0.0.1:8765"
  [[nodiscard]] std::uint16_t port() const;
  /// What to say where it is opened: where, and who may look.
  [[nodiscard]] std::string told() const;

 private:
  struct Impl;
  explicit Foxglove(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Whether a page of that origin (header "Origin"; empty: no browser) may look at a run that only this machine may see:
/// pages of this machine, Foxglove's own, and programs whose pages are no web site's.
[[nodiscard]] bool may_look(std::string_view origin);

}  // namespace sentree::studio
