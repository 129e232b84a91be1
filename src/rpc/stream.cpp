#include "sentree/rpc/stream.h"

#include <fmt/format.h>

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <limits>
#include <mutex>
#include <system_error>
#include <thread>

namespace sentree::rpc {
namespace {

using std::chrono::steady_clock;

constexpr std::int64_t kSecond = 1'000'000'000;  // [ns]

std::string text_of(int error) { return std::generic_category().message(error); }

class PlainStream final : public Stream {
 public:
  explicit PlainStream(Descriptor socket) : socket_(std::move(socket)) {
    int family = AF_UNIX;
    socklen_t size = sizeof family;
    ::getsockopt(socket_.get(), SOL_SOCKET, SO_DOMAIN, &family, &size);
    sleeps_in_recv_ = family != AF_UNIX;
  }

  // On a Unix socket waits with poll: a thread that sleeps in recv there is woken as well when the peer takes what was
  // sent to it.
  Received receive(std::uint8_t* out, std::size_t size, Deadline deadline) override {
    while (true) {
      const bool sleeps = sleeps_in_recv_ && deadline == kNoDeadline;
      const bool in_time = std::exchange(came_, false) || sleeps || wait_for(POLLIN, deadline);
      const ssize_t got = ::recv(socket_.get(), out, size, sleeps ? 0 : MSG_DONTWAIT);
      if (got > 0) return {StreamStatus::kOk, static_cast<std::size_t>(got)};
      if (got == 0) return {StreamStatus::kClosed, 0};
      if (const auto status = failed(in_time); status != StreamStatus::kOk) return {status, 0};
    }
  }

  void came() override { came_ = true; }

  StreamStatus send(const std::uint8_t* data, std::size_t size, Deadline deadline) override {
    // Almost always the socket takes everything at once, and nobody has to ask for the time.
    bool in_time = true;
    while (size > 0) {
      const ssize_t sent = ::send(socket_.get(), data, size, MSG_NOSIGNAL | MSG_DONTWAIT);
      if (sent > 0) {
        data += sent;
        size -= static_cast<std::size_t>(sent);
        continue;
      }
      if (const auto status = failed(in_time); status != StreamStatus::kOk) return status;
      in_time = wait_for(POLLOUT, deadline);
    }
    return StreamStatus::kOk;
  }

  std::size_t send_now(const std::uint8_t* data, std::size_t size) override {
    const ssize_t sent = ::send(socket_.get(), data, size, MSG_NOSIGNAL | MSG_DONTWAIT);
    return sent > 0 ? static_cast<std::size_t>(sent) : 0;
  }

  void shut_down() override { ::shutdown(socket_.get(), SHUT_RDWR); }
  int descriptor() const override { return socket_.get(); }
  std::string why() const override { return error_ == 0 ? "the peer closed the connection" : text_of(error_); }

 private:
  // False: the deadline has passed.
  bool wait_for(short events, Deadline deadline) {
    pollfd p{socket_.get(), events, 0};
    if (deadline == kNoDeadline) {
      ::poll(&p, 1, -1);
      return true;
    }
    const std::int64_t left = std::chrono::nanoseconds(deadline - steady_clock::now()).count();
    if (left <= 0) return false;
    const timespec t{left / kSecond, left % kSecond};
    return ::ppoll(&p, 1, &t, nullptr) != 0;
  }

  // After a call that moved nothing: kOk means "try again".
  StreamStatus failed(bool in_time) {
    if (errno == EINTR) return StreamStatus::kOk;
    if (errno == EAGAIN || errno == EWOULDBLOCK) return in_time ? StreamStatus::kOk : StreamStatus::kLate;
    error_ = errno;
    return errno == EPIPE || errno == ECONNRESET ? StreamStatus::kClosed : StreamStatus::kFailed;
  }

  Descriptor socket_;
  bool sleeps_in_recv_ = false;
  bool came_ = false;
  int error_ = 0;
};

bool wait_connected(int fd, Deadline deadline, int& error) {
  while (true) {
    pollfd p{fd, POLLOUT, 0};
    const int ready = ::poll(&p, 1, poll_timeout(deadline));
    if (ready < 0 && errno == EINTR) continue;
    if (ready == 0 && steady_clock::now() < deadline) continue;
    if (ready <= 0) {
      error = ETIMEDOUT;
      return false;
    }
    socklen_t size = sizeof error;
    ::getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size);
    return error == 0;
  }
}

Connected connect_socket(int family, const sockaddr* address, socklen_t size, Deadline deadline) {
  Descriptor socket(::socket(family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!socket) return {nullptr, StreamStatus::kFailed, text_of(errno)};
  int error = ::connect(socket.get(), address, size) == 0 ? 0 : errno;
  if (error == EINPROGRESS) {
    error = 0;
    if (!wait_connected(socket.get(), deadline, error)) {
      return {nullptr, error == ETIMEDOUT ? StreamStatus::kLate : StreamStatus::kFailed, text_of(error)};
    }
  }
  // A full backlog of a Unix socket: somebody is there, but accepts nobody.
  if (error != 0) return {nullptr, StreamStatus::kFailed, text_of(error)};
  const int flags = ::fcntl(socket.get(), F_GETFL);
  ::fcntl(socket.get(), F_SETFL, flags & ~O_NONBLOCK);
  if (family != AF_UNIX) {
    const int on = 1;
    ::setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  }
  return {plain_stream(std::move(socket)), StreamStatus::kOk, {}};
}

}  // namespace

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  if (this != &other) {
    if (fd_ >= 0) ::close(fd_);
    fd_ = std::exchange(other.fd_, -1);
  }
  return *this;
}

Descriptor::~Descriptor() {
  if (fd_ >= 0) ::close(fd_);
}

std::unique_ptr<Stream> plain_stream(Descriptor socket) { return std::make_unique<PlainStream>(std::move(socket)); }

int poll_timeout(Deadline deadline) {
  if (deadline == kNoDeadline) return -1;
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - steady_clock::now()).count();
  return static_cast<int>(std::clamp<std::int64_t>(left, 0, 60'000));
}

struct Resolver::Lookup {
  std::mutex mutex;
  std::condition_variable done;
  std::string host;
  std::uint16_t port = 0;
  bool finished = false;
  Answer answer;
};

namespace {

Resolver::Answer look_up(const std::string& host, std::uint16_t port, bool passive, bool numeric_only) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_NUMERICSERV | (passive ? AI_PASSIVE : 0) | (numeric_only ? AI_NUMERICHOST : 0);
  addrinfo* found = nullptr;
  const int error = ::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found);
  if (error != 0) return {StreamStatus::kFailed, ::gai_strerror(error), {}, 0};
  // An IPv4 address where there is one: "localhost" is served there more often.
  const addrinfo* best = found;
  for (const addrinfo* a = found; a != nullptr; a = a->ai_next) {
    if (a->ai_family == AF_INET) {
      best = a;
      break;
    }
  }
  Resolver::Answer out{StreamStatus::kOk,
                       {},
                       std::string(reinterpret_cast<const char*>(best->ai_addr), best->ai_addrlen),
                       best->ai_family};
  ::freeaddrinfo(found);
  return out;
}

}  // namespace

Resolver::Resolver()
    : Resolver([](const std::string& host, std::uint16_t port, bool passive) {
        return look_up(host, port, passive, false);
      }) {}
Resolver::Resolver(LookUp look_up) : look_up_(std::move(look_up)) {}
Resolver::~Resolver() = default;

Resolver::Answer Resolver::resolve(const std::string& host, std::uint16_t port, bool passive, Deadline deadline) {
  Answer numeric = look_up(host == "localhost" ? "127.0.0.1" : host, port, passive, true);
  if (numeric.status == StreamStatus::kOk) return numeric;
  // One look-up at a time: while the system's resolver hangs, later calls wait for the same answer.
  if (lookup_ == nullptr) {
    lookup_ = std::make_shared<Lookup>();
    lookup_->host = host;
    lookup_->port = port;
    try {
      std::thread([lookup = lookup_, look_up = look_up_, passive] {
        Answer answer = look_up(lookup->host, lookup->port, passive);
        const std::lock_guard lock(lookup->mutex);
        lookup->answer = std::move(answer);
        lookup->finished = true;
        lookup->done.notify_all();
      }).detach();
    } catch (const std::system_error& e) {
      lookup_.reset();
      return {StreamStatus::kFailed, e.what(), {}, 0};
    }
  }
  std::unique_lock lock(lookup_->mutex);
  const auto finished = [&] { return lookup_->finished; };
  if (deadline == kNoDeadline) {
    lookup_->done.wait(lock, finished);
  } else if (!lookup_->done.wait_until(lock, deadline, finished)) {
    return {StreamStatus::kLate, "no answer from the name service yet", {}, 0};
  }
  Answer out = lookup_->answer;
  lock.unlock();
  lookup_.reset();  // Names may move; the next connection asks again.
  return out;
}

Connected connect_to(const Address& address, Resolver& resolver, const std::shared_ptr<const TlsContext>& tls,
                     Deadline deadline) {
  if (address.kind == Address::Kind::kUnix) {
    sockaddr_un at{};
    at.sun_family = AF_UNIX;
    if (address.path.size() >= sizeof at.sun_path)
      return {nullptr, StreamStatus::kFailed, "a socket's path has 107 octets at most"};
    std::memcpy(at.sun_path, address.path.c_str(), address.path.size() + 1);
    return connect_socket(AF_UNIX, reinterpret_cast<const sockaddr*>(&at), sizeof at, deadline);
  }
  const Resolver::Answer at = resolver.resolve(address.host, address.port, false, deadline);
  if (at.status != StreamStatus::kOk) return {nullptr, at.status, fmt::format("\"{}\": {}", address.host, at.why)};
  Connected out = connect_socket(at.family, reinterpret_cast<const sockaddr*>(at.socket_address.data()),
                                 static_cast<socklen_t>(at.socket_address.size()), deadline);
  if (out.stream == nullptr || address.kind != Address::Kind::kTls) return out;
  return tls_stream(std::move(out.stream), tls, address.host, deadline);
}

}  // namespace sentree::rpc
