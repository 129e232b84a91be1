#pragma once

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/temporary_folder.h"
#include "sentree/rpc/async_client.h"
#include "sentree/rpc/client.h"
#include "sentree/rpc/server.h"

/// What the tests of the library share.
namespace sentree::rpc::test {

inline constexpr std::string_view kIdl = R"(
  enum Status { IDLE = 0, MOVING = 1 }
  struct Pose { 1: double x, 2: double y, 3: double theta = 0 }
  struct Nest { 1: optional Nest nest }
  exception Refused { 1: Status status, 2: string why = "" }
  service Base { void ping() }
  service Robot extends Base {
    Pose go(1: Pose target, 2: bool fast = true) throws (1: Refused refused)
    string echo(1: string text)
    list<i32> numbers(1: list<i32> numbers)
    Nest nest(1: Nest nest)
    oneway void note(1: string text)
    void wait()
  }
)";

inline idl::Schema schema(std::string_view source = kIdl) {
  auto loaded = idl::Schema::load(source, "robot.thrift");
  for (const Diagnostic& d : loaded.diagnostics) ADD_FAILURE() << to_string(d);
  return *loaded.value;
}

/// Echoes; `wait` blocks until `release`.
class Robot final : public Service {
 public:
  explicit Robot(idl::ServicePtr interface = schema().service("Robot")) : interface_(std::move(interface)) {}
  ~Robot() override { release(); }

  const idl::Service& interface() const override { return *interface_; }

  Outcome call(const idl::Method& method, const Value& arguments) override {
    if (method.name == "go") {
      if (arguments.at({"target", "x"})->number() < 0) {
        return tl::unexpected(
            CallError{CallErrorKind::kException, "no", "Refused", Map{{"status", "MOVING"}, {"why", "behind"}}});
      }
      return *arguments.find("target");
    }
    if (method.name == "note") {
      const std::lock_guard lock(mutex_);
      notes_.emplace_back(arguments.find("text")->text());
      changed_.notify_all();
      return Value();
    }
    if (method.name == "wait") {
      std::unique_lock lock(mutex_);
      ++waiting_;
      changed_.notify_all();
      changed_.wait(lock, [&] { return released_; });
      return Value();
    }
    if (method.name == "ping") return Value();
    return arguments.as_map()->begin()->second;
  }

  void release() {
    const std::lock_guard lock(mutex_);
    released_ = true;
    changed_.notify_all();
  }
  void await_waiting(int count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return waiting_ >= count; });
  }
  std::vector<std::string> await_notes(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return notes_.size() >= count; });
    return notes_;
  }

 private:
  idl::ServicePtr interface_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> notes_;
  int waiting_ = 0;
  bool released_ = false;
};

/// A folder of this test's own.
class Folder {
 public:
  [[nodiscard]] std::string file(std::string_view name) const { return (folder_.path() / name).string(); }
  [[nodiscard]] Address socket() const { return *Address::parse("unix:" + file("socket")); }

 private:
  TemporaryFolder folder_{"rpc"};
};

inline Deadline in(std::chrono::milliseconds time) { return std::chrono::steady_clock::now() + time; }

inline std::unique_ptr<Server> serve(const Address& address, std::shared_ptr<Service> service,
                                     ServerOptions options = {}) {
  auto server = Server::start(address, {{"robot", std::move(service)}}, std::move(options));
  if (!server) ADD_FAILURE() << server.error().message;
  return server ? std::move(*server) : nullptr;
}

inline std::unique_ptr<Client> connect(const Address& address, ClientOptions options = {}) {
  auto client = Client::remote(address, schema().service("Robot"), std::move(options));
  if (!client) ADD_FAILURE() << client.error().message;
  return client ? std::move(*client) : nullptr;
}

inline std::unique_ptr<AsyncClient> make_client(const Address& address, ClientOptions options = {}) {
  auto client = AsyncClient::remote(address, schema().service("Robot"), std::move(options));
  if (!client) ADD_FAILURE() << client.error().message;
  return client ? std::move(*client) : nullptr;
}

/// The outcome of a call, once it is there.
inline std::future<Outcome> begin(AsyncClient& client, std::string_view method, Value arguments,
                                  Deadline deadline = kNoDeadline) {
  const auto outcome = std::make_shared<std::promise<Outcome>>();
  client.call(method, std::move(arguments), deadline, [outcome](Outcome out) { outcome->set_value(std::move(out)); });
  return outcome->get_future();
}
inline Outcome call(AsyncClient& client, std::string_view method, Value arguments, Deadline deadline = kNoDeadline) {
  return begin(client, method, std::move(arguments), deadline).get();
}

/// Keeps its answers until it is told to give them.
class LaterRobot final : public Service {
 public:
  const idl::Service& interface() const override { return *interface_; }
  Outcome call(const idl::Method&, const Value&) override { return Value(); }
  void serve(const idl::Method& method, const Value& arguments, const Reply& reply) override {
    const std::lock_guard lock(mutex_);
    held_.push_back({reply, method.name == "echo" ? *arguments.find("text") : Value()});
    most_ = std::max(most_, held_.size());
    ++asked_;
    changed_.notify_all();
  }

  struct Held {
    Reply reply;
    Value answer;
  };
  /// The oldest question, once that many have been asked in all.
  Held take(std::size_t asked) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return asked_ >= asked && !held_.empty(); });
    Held first = std::move(held_.front());
    held_.erase(held_.begin());
    return first;
  }
  std::size_t most() {
    const std::lock_guard lock(mutex_);
    return most_;
  }

 private:
  const idl::ServicePtr interface_ = schema().service("Robot");
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Held> held_;
  std::size_t asked_ = 0;
  std::size_t most_ = 0;
};

/// Bytes to and from a Unix socket, without any protocol.
class RawPeer {
 public:
  explicit RawPeer(int connected) : fd_(connected) {}
  explicit RawPeer(const Address& address) : fd_(::socket(AF_UNIX, SOCK_STREAM, 0)) {
    sockaddr_un at{};
    at.sun_family = AF_UNIX;
    std::memcpy(at.sun_path, address.path.c_str(), address.path.size() + 1);
    EXPECT_EQ(::connect(fd_, reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
  }
  RawPeer(const RawPeer&) = delete;
  RawPeer& operator=(const RawPeer&) = delete;
  ~RawPeer() { close(); }
  void close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }
  void send(std::string_view bytes) const { (void)!::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL); }
  /// Says that nothing more will be sent.
  void finish() const { ::shutdown(fd_, SHUT_WR); }
  /// True once the other side has closed.
  [[nodiscard]] bool await_end() const {
    std::array<char, 4096> buffer;
    ssize_t got = 0;
    while ((got = ::recv(fd_, buffer.data(), buffer.size(), 0)) > 0) {
    }
    return got == 0 || errno == ECONNRESET;
  }
  [[nodiscard]] std::string receive() const {
    std::array<char, 4096> buffer;
    const ssize_t got = ::recv(fd_, buffer.data(), buffer.size(), 0);
    return got > 0 ? std::string(buffer.data(), static_cast<std::size_t>(got)) : std::string();
  }

 private:
  int fd_;
};

/// A server that does nothing by itself.
class RawServer {
 public:
  explicit RawServer(const Address& address) : fd_(::socket(AF_UNIX, SOCK_STREAM, 0)) {
    sockaddr_un at{};
    at.sun_family = AF_UNIX;
    std::memcpy(at.sun_path, address.path.c_str(), address.path.size() + 1);
    EXPECT_EQ(::bind(fd_, reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
    EXPECT_EQ(::listen(fd_, 4), 0);
  }
  RawServer(const RawServer&) = delete;
  RawServer& operator=(const RawServer&) = delete;
  ~RawServer() { ::close(fd_); }
  [[nodiscard]] int accept() const { return ::accept(fd_, nullptr, nullptr); }

 private:
  int fd_;
};

}  // namespace sentree::rpc::test
