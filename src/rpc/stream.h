#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "sentree/base/result.h"
#include "sentree/rpc/address.h"
#include "sentree/rpc/call.h"
#include "sentree/rpc/transport.h"

/// Sockets with deadlines, for every middleware that speaks over streams.
namespace sentree::rpc {

enum class StreamStatus : std::uint8_t { kOk, kLate, kClosed, kFailed };

struct Received {
  StreamStatus status = StreamStatus::kOk;
  std::size_t bytes = 0;  ///< kOk: at least one.
};

/// A connected byte stream. One thread at a time reads and writes, another may `send_now`; any thread may `shut_down`.
class Stream {
 public:
  virtual ~Stream() = default;
  /// Waits for some bytes until the deadline; a deadline that has passed takes what is there.
  [[nodiscard]] virtual Received receive(std::uint8_t* out, std::size_t size, Deadline deadline) = 0;
  /// Something has come, as `poll` says: the next `receive` takes it and does not ask once more.
  virtual void came() {}
  /// Sends all, or fails; after anything but kOk the stream is of no more use.
  [[nodiscard]] virtual StreamStatus send(const std::uint8_t* data, std::size_t size, Deadline deadline) = 0;
  /// Sends what goes without waiting and returns how much that was: none
  /// where that needs the reader's thread (TLS), or after an error, which the next `send` tells.
  [[nodiscard]] virtual std::size_t send_now(const std::uint8_t* /*data*/, std::size_t /*size*/) { return 0; }
  /// Ends every `receive` and `send`, now and later.
  virtual void shut_down() = 0;
  [[nodiscard]] virtual int descriptor() const = 0;
  /// What went wrong, for messages.
  [[nodiscard]] virtual std::string why() const = 0;
};

/// A file descriptor with one owner.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept;
  ~Descriptor();
  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] explicit operator bool() const { return fd_ >= 0; }

 private:
  int fd_ = -1;
};

/// Takes over a connected socket.
[[nodiscard]] std::unique_ptr<Stream> plain_stream(Descriptor socket);

/// The certificates of one side, read once. Errors: rpc.tls naming the file.
class TlsContext;
[[nodiscard]] Result<std::shared_ptr<const TlsContext>> tls_context(const TlsFiles& files, bool server);

/// Whether this moment is within the dates of a side's own certificate, so that others can accept it. Error: rpc.tls.
[[nodiscard]] Result<void> check_dates(const TlsContext& context, const TlsFiles& files);

struct Connected {
  std::unique_ptr<Stream> stream;
  StreamStatus status = StreamStatus::kOk;
  std::string why;
};

/// Puts TLS on a connected stream: handshake, both certificates checked; a client also checks that the server's names
/// `host`.
[[nodiscard]] Connected tls_stream(std::unique_ptr<Stream> plain, const std::shared_ptr<const TlsContext>& context,
                                   const std::string& host, Deadline deadline);

/// Turns names into socket addresses without ever waiting beyond a deadline: the system's resolver runs in a thread of
/// its own, whose answer a later attempt can still use.
class Resolver {
 public:
  struct Answer {
    StreamStatus status = StreamStatus::kOk;
    std::string why;
    std::string socket_address;  ///< The bytes of a sockaddr.
    int family = 0;
  };
  /// Waits for the name service as long as that takes.
  using LookUp = std::function<Answer(const std::string& host, std::uint16_t port, bool passive)>;

  /// Asks the system.
  Resolver();
  explicit Resolver(LookUp look_up);
  ~Resolver();
  [[nodiscard]] Answer resolve(const std::string& host, std::uint16_t port, bool passive, Deadline deadline);

 private:
  struct Lookup;
  const LookUp look_up_;
  std::shared_ptr<Lookup> lookup_;
};

/// Connects to a unix:, tcp:// or tls:// address.
[[nodiscard]] Connected connect_to(const Address& address, Resolver& resolver,
                                   const std::shared_ptr<const TlsContext>& tls, Deadline deadline);

/// Milliseconds for poll(), rounded up; -1 for no deadline.
[[nodiscard]] int poll_timeout(Deadline deadline);

}  // namespace sentree::rpc
