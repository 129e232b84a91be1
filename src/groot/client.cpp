#include "sentree/groot/client.h"

#include <fmt/format.h>

#include <random>

#ifdef SENTREE_HAS_ZMQ
#include "sentree/groot/detail/zmq.h"
#endif

namespace sentree::groot {

#ifdef SENTREE_HAS_ZMQ

namespace {

constexpr std::size_t kPartsMax = 4;

// "HOST" and the port of an address.
Result<std::pair<std::string, std::uint16_t>> host_of(const std::string& address) {
  std::string rest = address.starts_with("zmq://") ? address.substr(6) : address;
  std::uint16_t port = kGroot2Port;
  const auto colon = rest.rfind(':');
  if (colon != std::string::npos) {
    unsigned number = 0;
    for (const char c : rest.substr(colon + 1))
      number = c >= '0' && c <= '9' && number < 100'000 ? 10 * number + static_cast<unsigned>(c - '0') : 100'000;
    if (number == 0 || number >= 0xFFFF) rest.clear();
    port = static_cast<std::uint16_t>(number);
    rest = rest.substr(0, std::min(colon, rest.size()));
  }
  if (rest.empty() || rest.find('/') != std::string::npos)
    return fail("groot.bad-address", address + ": not the address of a publisher, such as zmq://robot:1667");
  return std::pair(rest, port);
}

}  // namespace

struct Client::Impl {
  Impl(const std::string& host, std::uint16_t port) : where(fmt::format("tcp://{}:{}", host, port)) {
    listen.set(zmq::sockopt::linger, 0);
    listen.set(zmq::sockopt::maxmsgsize, std::int64_t{1} << 10);
    listen.set(zmq::sockopt::subscribe, "");
    listen.connect(fmt::format("tcp://{}:{}", host, port + 1));
    renew();
  }

  // One whose answer did not come is of no use any more.
  void renew() {
    ask = zmq::socket_t(context, zmq::socket_type::req);
    ask.set(zmq::sockopt::linger, 0);
    ask.set(zmq::sockopt::maxmsgsize, kReplyBytesMax);
    ask.connect(where);
  }

  const std::string where;
  zmq::context_t context{1};
  zmq::socket_t ask;
  zmq::socket_t listen{context, zmq::socket_type::sub};
  std::minstd_rand random{std::random_device()()};
};

Result<std::unique_ptr<Client>> Client::connect(const std::string& address) {
  const auto host = host_of(address);
  if (!host) return tl::unexpected(host.error());
  try {
    return std::unique_ptr<Client>(new Client(std::make_unique<Impl>(host->first, host->second)));
  } catch (const zmq::error_t& error) {
    return fail("groot.bad-address", fmt::format("{}: {}", address, error.what()));
  }
}

Result<Reply> Client::ask(Ask type, std::optional<std::string> body) {
  Request request{
      .type = type, .id = static_cast<std::uint32_t>(impl_->random()), .body = {}, .has_body = body.has_value()};
  if (body) request.body = std::move(*body);
  try {
    send_now(impl_->ask, write_request(request));
    zmq::pollitem_t item{impl_->ask, 0, ZMQ_POLLIN, 0};
    zmq::poll(&item, 1, kPatience);
    const auto parts = receive_now(impl_->ask, kPartsMax);
    if (parts) return parse_reply(request, *parts);
    impl_->renew();
  } catch (const zmq::error_t& error) {
    impl_->renew();
    return fail("groot.silent", fmt::format("{}: {}", impl_->where, error.what()));
  }
  return fail("groot.silent", "nobody answers at " + impl_->where);
}

std::optional<std::uint16_t> Client::next_reached() {
  try {
    while (const auto parts = receive_now(impl_->listen, kPartsMax)) {
      if (const auto uid = parse_reached(*parts)) return uid;
    }
  } catch (const zmq::error_t&) {
    // What cannot be heard has not been said; the statuses tell all the same.
  }
  return std::nullopt;
}

#else

struct Client::Impl {};

Result<std::unique_ptr<Client>> Client::connect(const std::string&) {
  return fail("groot.not-built",
              "this program was built without ZeroMQ: install libzmq3-dev and cppzmq-dev, configure and build again");
}
Result<Reply> Client::ask(Ask, std::optional<std::string>) { return fail("groot.not-built", "built without ZeroMQ"); }
std::optional<std::uint16_t> Client::next_reached() { return std::nullopt; }

#endif

Client::Client(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Client::~Client() = default;

}  // namespace sentree::groot
