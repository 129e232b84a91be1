#include "sentree/rpc/listener.h"

#include <fmt/format.h>

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

namespace sentree::rpc {
namespace {

constexpr int kBacklog = 64;

tl::unexpected<Diagnostic> failed(const Address& address, int error) {
  const std::string at = to_string(address);
  struct stat info {};
  if (error == EADDRINUSE && address.kind == Address::Kind::kUnix && ::lstat(address.path.c_str(), &info) == 0 &&
      !S_ISSOCK(info.st_mode))
    return fail(
        "rpc.address",
        fmt::format("cannot listen at {}: a file that is no socket is there; remove it or choose another path", at));
  if (error == EADDRINUSE) {
    return fail("rpc.port-taken",
                fmt::format("{} is taken: another process listens there; stop it or choose another {}", at,
                            address.kind == Address::Kind::kUnix ? "path" : "port (0 takes a free one)"));
  }
  return fail("rpc.address", fmt::format("cannot listen at {}: {}", at, std::generic_category().message(error)));
}

bool loopback(const std::string& bytes, int family) {
  if (family == AF_INET) {
    sockaddr_in at{};
    std::memcpy(&at, bytes.data(), sizeof at);
    return (ntohl(at.sin_addr.s_addr) >> 24U) == 127;
  }
  sockaddr_in6 at{};
  std::memcpy(&at, bytes.data(), sizeof at);
  return IN6_IS_ADDR_LOOPBACK(&at.sin6_addr) != 0;
}

// True if a socket file is left over from a server that is gone.
bool stale(const sockaddr_un& at) {
  struct stat info {};
  if (::lstat(at.sun_path, &info) != 0 || !S_ISSOCK(info.st_mode)) return false;
  const Descriptor probe(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  return ::connect(probe.get(), reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0 && errno == ECONNREFUSED;
}

}  // namespace

Listener::~Listener() {
  if (!file_.empty()) ::unlink(file_.c_str());
}

Result<Listener> Listener::open(Address& address, bool insecure) {
  Listener out;
  if (address.kind == Address::Kind::kLocal) {
    return fail("rpc.address",
                fmt::format("address \"{}\" is in this process; nothing can listen there", to_string(address)));
  }
  if (address.kind == Address::Kind::kOther)
    return fail("rpc.address", fmt::format("address \"{}\" is none of a socket", to_string(address)));
  if (address.kind == Address::Kind::kUnix) {
    sockaddr_un at{};
    at.sun_family = AF_UNIX;
    if (address.path.size() >= sizeof at.sun_path) return failed(address, ENAMETOOLONG);
    std::memcpy(at.sun_path, address.path.c_str(), address.path.size() + 1);
    out.socket_ = Descriptor(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (!out.socket_) return failed(address, errno);
    if (stale(at)) ::unlink(at.sun_path);
    if (::bind(out.socket_.get(), reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0)
      return failed(address, errno);
    out.file_ = address.path;
    if (::listen(out.socket_.get(), kBacklog) != 0) return failed(address, errno);
    return out;
  }
  Resolver resolver;
  const auto at = resolver.resolve(address.host, address.port, true, kNoDeadline);
  if (at.status != StreamStatus::kOk)
    return fail("rpc.address", fmt::format("cannot listen at {}: {}", to_string(address), at.why));
  if (address.kind == Address::Kind::kTcp && !insecure && !loopback(at.socket_address, at.family)) {
    return fail("rpc.not-loopback", fmt::format("{} can be reached from other machines, and tcp:// hides and checks "
                                                "nothing; use tls://, or allow it with --insecure",
                                                to_string(address)));
  }
  out.socket_ = Descriptor(::socket(at.family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!out.socket_) return failed(address, errno);
  const int on = 1;
  // A port of a server that has just stopped can be taken again at once; one that is in use cannot.
  ::setsockopt(out.socket_.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (::bind(out.socket_.get(), reinterpret_cast<const sockaddr*>(at.socket_address.data()),
             static_cast<socklen_t>(at.socket_address.size())) != 0 ||
      ::listen(out.socket_.get(), kBacklog) != 0) {
    return failed(address, errno);
  }
  sockaddr_storage bound{};
  socklen_t size = sizeof bound;
  ::getsockname(out.socket_.get(), reinterpret_cast<sockaddr*>(&bound), &size);
  // The port is at the same place in both families' addresses.
  address.port = ntohs(reinterpret_cast<const sockaddr_in*>(&bound)->sin_port);
  return out;
}

Descriptor Listener::accept(bool& exhausted) const {
  Descriptor got(::accept4(socket_.get(), nullptr, nullptr, SOCK_CLOEXEC));
  exhausted = !got && (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM);
  if (got) {
    const int on = 1;
    ::setsockopt(got.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);  // No effect on a Unix socket.
  }
  return got;
}

}  // namespace sentree::rpc
