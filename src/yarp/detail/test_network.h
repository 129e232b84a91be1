#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/rpc/service.h"
#include "sentree/yarp/address.h"
#include "sentree/yarp/detail/test_octets.h"

/// Sockets without any protocol, for the tests of the library.
namespace sentree::yarp::test {

inline constexpr std::chrono::seconds kPatience{20};

/// Bytes to and from a TCP socket.
class RawPeer {
 public:
  explicit RawPeer(int connected) : fd_(connected) {}
  explicit RawPeer(const HostPort& at) : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(at.port);
    ::inet_pton(AF_INET, at.host.c_str(), &address.sin_addr);
    EXPECT_EQ(::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0) << to_string(at);
  }
  RawPeer(RawPeer&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  RawPeer(const RawPeer&) = delete;
  RawPeer& operator=(const RawPeer&) = delete;
  ~RawPeer() { close(); }
  void close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }
  void send(std::string_view bytes) const { (void)!::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL); }
  /// That many bytes, fewer if the other side closes.
  [[nodiscard]] std::string receive(std::size_t bytes) const {
    std::string out;
    while (out.size() < bytes) {
      pollfd p{fd_, POLLIN, 0};
      if (::poll(&p, 1, static_cast<int>(std::chrono::milliseconds(kPatience).count())) <= 0) break;
      std::array<char, 4096> buffer;
      const ssize_t got = ::recv(fd_, buffer.data(), std::min(buffer.size(), bytes - out.size()), 0);
      if (got <= 0) break;
      out.append(buffer.data(), static_cast<std::size_t>(got));
    }
    return out;
  }
  [[nodiscard]] std::string receive_line() const {
    std::string out;
    while (!out.ends_with("\n")) {
      const std::string byte = receive(1);
      if (byte.empty()) break;
      out += byte;
    }
    return out;
  }
  /// Up to and with the last line.
  [[nodiscard]] std::string receive_until(std::string_view last) const {
    std::string out;
    while (!out.ends_with(last)) {
      const std::string line = receive_line();
      if (line.empty()) break;
      out += line;
    }
    return out;
  }
  /// All until the other side has closed.
  [[nodiscard]] std::string receive_rest() const { return receive(1U << 24U); }

 private:
  int fd_;
};

/// A listening socket that does nothing by itself.
class RawServer {
 public:
  RawServer() : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::listen(fd_, 8), 0);
    socklen_t size = sizeof address;
    ::getsockname(fd_, reinterpret_cast<sockaddr*>(&address), &size);
    at = {"127.0.0.1", ntohs(address.sin_port)};
  }
  ~RawServer() { ::close(fd_); }
  RawServer(const RawServer&) = delete;
  RawServer& operator=(const RawServer&) = delete;
  [[nodiscard]] RawPeer accept() const { return RawPeer(::accept(fd_, nullptr, nullptr)); }

  HostPort at;

 private:
  int fd_;
};

/// Things that happen in other threads.
class Events {
 public:
  void add(std::string what) {
    const std::lock_guard lock(mutex_);
    all_.push_back(std::move(what));
    changed_.notify_all();
  }
  /// Waits until there are that many.
  [[nodiscard]] std::vector<std::string> await(std::size_t count) {
    std::unique_lock lock(mutex_);
    EXPECT_TRUE(changed_.wait_for(lock, kPatience, [&] { return all_.size() >= count; }));
    return all_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> all_;
};

/// Asks again until it holds, or patience ends.
inline bool becomes_true(const std::function<bool()>& holds) {
  const auto until = std::chrono::steady_clock::now() + kPatience;
  while (!holds()) {
    if (std::chrono::steady_clock::now() > until) return false;
    ::poll(nullptr, 0, 2);
  }
  return true;
}

/// Echoes its argument; "rstring" of "refuse" fails, and so do methods that are told to.
inline std::shared_ptr<rpc::Service> probe_service(Events* calls = nullptr) {
  return std::make_shared<rpc::FunctionService>(
      schema().service("Probe"), [calls](const idl::Method& method, const Value& arguments) -> rpc::Outcome {
        if (calls != nullptr) calls->add(method.name + to_json(arguments));
        const Value* x = arguments.find("x");
        const bool fails = (x != nullptr && x->text() == "refuse") || method.name == "two_args" ||
                           (method.name == "rbool" && *x->as_bool()) || method.name == "ri64";
        if (fails) return tl::unexpected(rpc::CallError{rpc::CallErrorKind::kProtocol, "the robot refuses", {}, {}});
        if (method.name == "rstruct") return Value(Map{{"a", *arguments.find("a")}, {"s", "in"}});
        if (method.name == "request_ack") return Value(3);
        return x != nullptr ? *x : Value();
      });
}

}  // namespace sentree::yarp::test
