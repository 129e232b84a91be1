#include "sentree/groot/server.h"

#include <fmt/format.h>

#include <charconv>
#include <random>

#include "sentree/base/assert.h"

#ifdef SENTREE_HAS_ZMQ
#include <algorithm>
#include <array>
#include <atomic>
#include <mutex>
#include <thread>

#include "sentree/groot/detail/wall.h"
#include "sentree/groot/detail/zmq.h"
#endif

namespace sentree::groot {

TreeId new_tree_id() {
  std::random_device random;
  TreeId id;
  for (std::uint8_t& byte : id) byte = static_cast<std::uint8_t>(random());
  id[6] = (id[6] & 0x0FU) | 0x40U;
  id[8] = (id[8] & 0x3FU) | 0x80U;
  return id;
}

std::uint16_t new_base() { return static_cast<std::uint16_t>(std::random_device()()); }

Result<ServerOptions> parse_server_address(const std::string& where) {
  ServerOptions options;
  if (where == "true") return options;
  std::string port = where;
  if (const auto colon = where.rfind(':'); colon != std::string::npos) {
    options.address = where.substr(0, colon);
    port = where.substr(colon + 1);
    if (options.address == "localhost") options.address = "127.0.0.1";
  }
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), options.port);
  const bool is_port = error == std::errc() && end == port.data() + port.size();
  // The four ports must be there.
  if (is_port && !options.address.empty() && (options.port == 0 || (options.port > 1 && options.port < 0xFFFF - 2)))
    return options;
  return fail("groot.bad-address", where + ": neither a port from 2 to 65532 nor an address such as 127.0.0.1:1667");
}

#ifdef SENTREE_HAS_ZMQ

bool is_built() { return true; }

namespace {

// Between two looks at what is to be told: Groot 1 follows about 25 messages a second.
constexpr std::chrono::milliseconds kTurn{40};
// Requests answered in one turn by each socket; then what is to be told has its turn.
constexpr int kRequestsPerTurn = 64;
// Who sends more is disconnected by ZeroMQ without a word.
constexpr std::int64_t kReceivedBytesMax = 16 * Server::kPartBytesMax;
constexpr int kTriesMax = 20;
// Parts that say how an answer finds its way back.
constexpr std::size_t kWayMax = 8;

constexpr const char* kServer2 = "Groot 2's server";
constexpr const char* kPublisher2 = "Groot 2's publisher";
constexpr const char* kPublisher1 = "Groot 1's publisher";
constexpr const char* kServer1 = "Groot 1's server";

bool is_loopback(const std::string& address) { return address.starts_with("127.") || address == "[::1]"; }

std::uint16_t port_of(const zmq::socket_t& socket) {
  const std::string end = socket.get(zmq::sockopt::last_endpoint);
  return static_cast<std::uint16_t>(std::stoi(end.substr(end.rfind(':') + 1)));
}

}  // namespace

struct Server::Impl {
  Impl(Scene& shown, Hooks* taken, ServerOptions said)
      : scene(shown), options(std::move(said)), responder(shown, is_loopback(options.address) ? taken : nullptr) {
    for (zmq::socket_t* socket : {&reply1, &publish1, &reply2, &publish2}) {
      socket->set(zmq::sockopt::linger, 0);
      socket->set(zmq::sockopt::maxmsgsize, kReceivedBytesMax);
    }
  }
  ~Impl() {
    stop = true;
    if (thread.joinable()) thread.join();
  }

  void bind(zmq::socket_t& socket, std::uint16_t port, const char* of) {
    binding = port;
    binding_of = of;
    socket.bind(fmt::format("tcp://{}:{}", options.address, port == 0 ? "*" : std::to_string(port)));
  }

  void bind_all() {
    const std::uint16_t port = options.port;
    if (port != 0) {
      bind(reply2, port, kServer2);
      bind(publish2, static_cast<std::uint16_t>(port + 1), kPublisher2);
      bind(publish1, static_cast<std::uint16_t>(port - 1), kPublisher1);
      bind(reply1, static_cast<std::uint16_t>(port + 2), kServer1);
    } else {
      bind(publish1, 0, kPublisher1);
      bind(reply1, 0, kServer1);
      for (int left = kTriesMax;; --left) {
        bind(reply2, 0, kServer2);
        try {
          bind(publish2, static_cast<std::uint16_t>(port_of(reply2) + 1), kPublisher2);
          break;
        } catch (const zmq::error_t&) {
          if (left == 0) throw;
          reply2.unbind(reply2.get(zmq::sockopt::last_endpoint));
        }
      }
    }
    ports = {port_of(reply2), port_of(publish1), port_of(reply1)};
  }

  void serve() {
    try {
      while (!stop) turn();
    } catch (const zmq::error_t& error) {
      if (options.on_problem) options.on_problem(std::string("Groot is served no longer: ") + error.what());
    }
  }

  void turn() {
    std::array<zmq::pollitem_t, 2> items{{{reply1, 0, ZMQ_POLLIN, 0}, {reply2, 0, ZMQ_POLLIN, 0}}};
    zmq::poll(items.data(), items.size(), kTurn);
    answer_all(reply1, [this](const Parts&) {
      ++asked;
      return Parts{scene.groot1_tree()};
    });
    answer_all(reply2, [this](const Parts& request) {
      if (!request.empty() && request.front().size() > 1 && request.front()[1] == static_cast<char>(Ask::kTree))
        ++asked;
      const bool is_large = std::any_of(request.begin(), request.end(), [](const std::string& part) {
        return part.size() > static_cast<std::size_t>(kPartBytesMax);
      });
      if (is_large) return write_error(fmt::format("a request has at most {} octets", kPartBytesMax));
      return responder.answer(request, SteadyClock::now(), wall_us());
    });
    const auto now = SteadyClock::now();
    responder.look_after(now);
    tell_reached();
    if (now - told1 < kTurn) return;
    told1 = now;
    if (std::string update = scene.take_update(); !update.empty()) send_now(publish1, {std::move(update)});
  }

  // A ROUTER in the place of REP: that one loses answers when a peer before broke off in the middle of a message. What
  // comes before the empty part is the way back.
  template <class Answer>
  static void answer_all(zmq::socket_t& socket, const Answer& answer) {
    for (int left = kRequestsPerTurn; left > 0; --left) {
      auto parts = receive_now(socket, kWayMax + kPartsMax);
      if (!parts) return;
      const auto empty = std::find(parts->begin(), parts->end(), "");
      if (empty == parts->end()) continue;  // from nobody who waits for an answer
      Parts answered(parts->begin(), empty + 1);
      const Parts request(empty + 1, parts->end());
      for (std::string& part : answer(request)) answered.push_back(std::move(part));
      send_now(socket, answered);
    }
  }

  void tell_reached() {
    std::vector<Notice> all;
    {
      const std::lock_guard lock(mutex);
      all.swap(notices);
      if (std::exchange(forgetting, false)) responder.forget();
    }
    for (const Notice& notice : all) {
      if (notice.used) responder.used(notice.uid, notice.position);
      send_now(publish2, write_reached(static_cast<std::uint32_t>(random()), notice.uid));
    }
  }

  using SteadyClock = std::chrono::steady_clock;
  struct Notice {
    std::uint16_t uid;
    Hook::Position position;
    bool used;
  };
  Scene& scene;
  const ServerOptions options;
  Responder responder;
  zmq::context_t context{1};
  zmq::socket_t reply1{context, zmq::socket_type::router};
  zmq::socket_t publish1{context, zmq::socket_type::pub};
  zmq::socket_t reply2{context, zmq::socket_type::router};
  zmq::socket_t publish2{context, zmq::socket_type::pub};
  Ports ports;
  std::uint16_t binding = 0;  // for the message, where that is not to be had
  const char* binding_of = "";
  SteadyClock::time_point told1{};
  std::minstd_rand random{std::random_device()()};
  std::mutex mutex;
  std::vector<Notice> notices;
  bool forgetting = false;
  bool takes_hooks = false;
  std::atomic<std::uint64_t> asked = 0;
  std::atomic<bool> stop = false;
  std::thread thread;
};

Result<std::unique_ptr<Server>> Server::start(Scene& scene, Hooks* hooks, ServerOptions options) {
  SENTREE_ASSERT(scene.has_tree());
  if (!is_loopback(options.address) && !options.insecure) {
    return fail("groot.not-loopback", options.address +
                                          " can be reached by other machines, and ZeroMQ asks nobody who he is; "
                                          "--insecure allows it, to look only");
  }
  const std::string address = options.address;
  std::unique_ptr<Impl> impl;
  try {
    impl = std::make_unique<Impl>(scene, hooks, std::move(options));
    impl->takes_hooks = hooks != nullptr;
    impl->bind_all();
    impl->thread = std::thread([raw = impl.get()] { raw->serve(); });
    return std::unique_ptr<Server>(new Server(std::move(impl)));
  } catch (const zmq::error_t& error) {
    const std::string where =
        impl != nullptr ? fmt::format("{}:{} ({})", address, impl->binding, impl->binding_of) : address;
    if (error.num() == EADDRINUSE) {
      return fail("groot.port-taken",
                  fmt::format("Groot: {} is taken: another process listens there; stop it or choose another port for "
                              "Groot 2, which takes the one before and the next two as well (0 takes free ones)",
                              where));
    }
    return fail("groot.bad-address", fmt::format("Groot: cannot listen on {}: {}", where, error.what()));
  }
}

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Server::~Server() = default;

Server::Ports Server::ports() const { return impl_->ports; }

std::string Server::told() const {
  const Ports& ports = impl_->ports;
  const bool takes = is_loopback(impl_->options.address) && impl_->takes_hooks;
  const bool alone = is_loopback(impl_->options.address);
  return fmt::format(
      "Groot 2: {}:{}; Groot 1: publisher port {}, server port {}{}", impl_->options.address, ports.groot2,
      ports.groot1_publisher, ports.groot1_server,
      takes   ? "; nobody is authenticated: any program of this machine can look, and set breakpoints"
      : alone ? "; nobody is authenticated: any program of this machine can look; what has been recorded takes no "
                "breakpoints"
              : "; nobody is authenticated: whoever reaches this machine can look, so breakpoints are refused");
}

void Server::reached(std::uint16_t uid, Hook::Position position, bool used) {
  const std::lock_guard lock(impl_->mutex);
  if (impl_->notices.size() < kNoticesMax) impl_->notices.push_back({uid, position, used});
}

void Server::forget_hooks() {
  const std::lock_guard lock(impl_->mutex);
  impl_->notices.clear();
  impl_->forgetting = true;
}

std::uint64_t Server::trees_asked() const { return impl_->asked; }

#else

bool is_built() { return false; }

struct Server::Impl {};

Result<std::unique_ptr<Server>> Server::start(Scene& scene, Hooks*, ServerOptions) {
  SENTREE_ASSERT(scene.has_tree());
  return fail("groot.not-built",
              "this program was built without ZeroMQ: install libzmq3-dev and cppzmq-dev, configure and build again");
}

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Server::~Server() = default;
Server::Ports Server::ports() const { return {}; }
std::string Server::told() const { return {}; }
void Server::reached(std::uint16_t, Hook::Position, bool) {}
void Server::forget_hooks() {}
std::uint64_t Server::trees_asked() const { return 0; }

#endif

}  // namespace sentree::groot
