#include "sentree/yarp/middleware.h"

#include <fmt/format.h>

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <utility>

#include "sentree/rpc/async_client.h"
#include "sentree/yarp/detail/line.h"
#include "sentree/yarp/detail/port.h"
#include "sentree/yarp/detail/registrar.h"
#include "sentree/yarp/names.h"

namespace sentree::yarp {
namespace {

using rpc::Address;
using std::chrono::steady_clock;

bool is_data(const idl::Service& interface) {
  return !interface.methods.empty() &&
         std::all_of(interface.methods.begin(), interface.methods.end(), [](const auto* m) { return m->oneway; });
}

// The method whose data bear no name; null: they do.
const idl::Method* unnamed(const PortAddress& address, const idl::Service& interface) {
  return is_data(interface) && interface.methods.size() == 1 && !address.named ? interface.methods.front() : nullptr;
}

// Where something is opened, which needs a name server unless the address says all.
Result<PortAddress> opened_at(const Address& address) {
  auto parsed = PortAddress::parse(address.path);
  if (!parsed || !parsed->server.host.empty() || !parsed->direct.host.empty()) return parsed;
  if (auto can_be_meant = check_name_server(); !can_be_meant) return tl::unexpected(std::move(can_be_meant.error()));
  return parsed;
}

HostPort name_server_of(const PortAddress& address) {
  return address.server.host.empty() ? configured_name_server() : address.server;
}

// Ports that are known to a name server as long as they are served.
class Served final : public rpc::Opened {
 public:
  Served(std::string address, std::vector<std::unique_ptr<Port>> ports, std::unique_ptr<Registrar> registrar)
      : address_(std::move(address)), ports_(std::move(ports)), registrar_(std::move(registrar)) {}
  ~Served() override { stop(); }

  std::string address() const override { return address_; }
  void stop() override {
    if (registrar_ != nullptr) registrar_->stop();
    for (const auto& port : ports_) port->stop();
  }
  [[nodiscard]] Port& port() { return *ports_.front(); }

 private:
  const std::string address_;
  std::vector<std::unique_ptr<Port>> ports_;
  std::unique_ptr<Registrar> registrar_;
};

struct Opening {
  std::string name;
  PortRole role;
};

Result<std::unique_ptr<Served>> open_ports(const PortAddress& address, std::vector<Opening> openings, bool insecure,
                                           const std::function<void(const std::string&)>& problem,
                                           bool serves = false) {
  const bool registers = address.direct.host.empty();
  const HostPort server = registers ? name_server_of(address) : HostPort{};
  const std::string& host = registers ? address.listen : address.direct.host;
  std::vector<std::unique_ptr<Port>> ports;
  std::unique_ptr<Registrar> registrar;
  if (registers) registrar = std::make_unique<Registrar>(server, problem);
  for (Opening& opening : openings) {
    PortOptions options;
    options.name = opening.name;
    options.listen = registers ? HostPort{address.listen, 0} : address.direct;
    // One number serves one port; those beside it take a free one.
    if (!registers && !ports.empty()) options.listen.port = 0;
    options.insecure = insecure;
    options.name_server = server;
    options.version = address.version;
    options.on_peer_error = problem;
    auto port = Port::open(std::move(options), std::move(opening.role));
    if (!port) return tl::unexpected(std::move(port.error()));
    if (registrar != nullptr) {
      if (auto known = registrar->add((*port)->name(), (*port)->at()); !known)
        return tl::unexpected(std::move(known.error()));
    }
    ports.push_back(std::move(*port));
  }
  if (serves && problem) {
    problem(fmt::format("{} listens on {}; whoever reaches it can do everything, YARP has no authentication",
                        to_string(address), host));
  }
  return std::make_unique<Served>(to_string(address), std::move(ports), std::move(registrar));
}

// Publishes on a port of ours: nobody is waited for, nobody need be there.
class Publishing final : public rpc::Caller {
 public:
  Publishing(std::shared_ptr<Served> served, idl::ServicePtr interface, bool with_name)
      : served_(std::move(served)), interface_(std::move(interface)), with_name_(with_name) {}

  const idl::Service& interface() const override { return *interface_; }
  using Caller::call;
  void call(const idl::Method& method, Value arguments, rpc::Deadline, Done done) override {
    calls_.fetch_add(1);
    if (closed_.load()) {
      return done(tl::unexpected(rpc::CallError{
          rpc::CallErrorKind::kUnreachable, fmt::format("the port {} is closed", served_->address()), {}, {}}));
    }
    served_->port().write(method, arguments, with_name_);
    done(Value());
  }
  void close() override { closed_.store(true); }
  void end() override { close(); }
  rpc::ClientCounters counters() const override {
    rpc::ClientCounters out;
    out.calls = calls_.load();
    return out;
  }

 private:
  const std::shared_ptr<Served> served_;
  const idl::ServicePtr interface_;
  const bool with_name_;
  std::atomic<bool> closed_{false};
  std::atomic<std::uint64_t> calls_{0};
};

class Yarp final : public rpc::Middleware {
 public:
  std::vector<std::string> schemes() const override { return {"yarp"}; }
  std::vector<std::string> forms() const override { return {"yarp:/port"}; }

  std::string about() const override {
    if (std::string missing = lacks(); !missing.empty()) return missing;
    const HostPort server = configured_name_server();
    NameClient names(server);
    constexpr std::chrono::milliseconds kPatience{300};
    const bool there = names.query("/root", steady_clock::now() + kPatience).has_value();
    return fmt::format(
        "ports of YARP 3 and 4 by tcp, fast_tcp, text and text_ack, without authentication; name server {}{}",
        to_string(server), there ? " answers" : " does not answer (sentree run --yarp-server brings one)");
  }

  std::string lacks() const override {
    const auto can_be_meant = check_name_server();
    return can_be_meant ? std::string() : can_be_meant.error().message;
  }

  Result<void> check(const Address& address) const override {
    const auto parsed = PortAddress::parse(address.path);
    if (!parsed) return tl::unexpected(parsed.error());
    return {};
  }

  bool is_source(const Address& address, const idl::Service* interface) const override {
    const auto parsed = PortAddress::parse(address.path);
    // Who wants no interface of it can only read.
    return parsed && (parsed->is_source() || (interface == nullptr && parsed->says_no_direction()));
  }

  Result<void> check_service(const Address& address, const idl::Service& interface) const override {
    const auto parsed = PortAddress::parse(address.path);
    if (!parsed) return tl::unexpected(parsed.error());
    const bool is_called =
        !interface.methods.empty() && std::none_of(interface.methods.begin(), interface.methods.end(),
                                                   [](const idl::Method* method) { return method->oneway; });
    if (!is_called || !parsed->is_source()) return {};
    return fail("rpc.address",
                fmt::format("\"{}\" is a port that data are read from, and {} has methods that are called; a port that "
                            "answers calls is yarp:/NAME/rpc:i, or what it is called there",
                            to_string(address), interface.name));
  }

  Result<void> check_called(const Address& address, const idl::Service& interface, const idl::Method&) const override {
    const auto parsed = PortAddress::parse(address.path);
    if (!parsed) return tl::unexpected(parsed.error());
    if (!is_data(interface) || !parsed->is_source()) return {};
    return fail("rpc.address", fmt::format("\"{}\" is read from: nothing can be published there", to_string(address)));
  }

  Address beside(const Address& address, const std::string& service, const std::string& other) const override {
    Address out = address;
    out.service = other;
    const auto at = out.path.find(fmt::format("/{}/", service));
    if (at != std::string::npos) out.path.replace(at + 1, service.size(), other);
    return out;
  }

  Result<std::unique_ptr<rpc::Caller>> connect(const Address& address, idl::ServicePtr interface,
                                               rpc::ClientOptions options) override {
    auto parsed = opened_at(address);
    if (!parsed) return tl::unexpected(std::move(parsed.error()));
    if (options.target.empty()) options.target = interface->name;
    parsed->name = parsed->name_of(address.service.empty() ? options.target : address.service);
    const idl::Method* const data = unnamed(*parsed, *interface);
    if (is_data(*interface)) {
      if (auto can_be = check_called(address, *interface, *interface->methods.front()); !can_be)
        return tl::unexpected(std::move(can_be.error()));
      if (parsed->open) {
        auto served = publisher(*parsed);
        if (!served) return tl::unexpected(std::move(served.error()));
        return std::unique_ptr<rpc::Caller>(
            std::make_unique<Publishing>(std::move(*served), std::move(interface), data == nullptr));
      }
    }
    auto line = std::make_unique<PortLine>(std::move(*parsed), *interface, std::move(options), data);
    auto client = rpc::AsyncClient::over(std::move(line), std::move(interface));
    if (!client) return tl::unexpected(std::move(client.error()));
    return std::unique_ptr<rpc::Caller>(std::move(*client));
  }

  Result<std::unique_ptr<rpc::Opened>> serve(const Address& address, std::vector<rpc::NamedService> services,
                                             rpc::ServerOptions options) override {
    const auto parsed = opened_at(address);
    if (!parsed) return tl::unexpected(parsed.error());
    if (services.size() > 1 && !parsed->name.ends_with('/')) {
      return fail("rpc.address", fmt::format("\"{}\" names one port, but there are {} services; give what their names "
                                             "begin with, such as yarp:/ for /{}/rpc:i",
                                             to_string(address), services.size(), services.front().name));
    }
    std::vector<Opening> openings;
    for (rpc::NamedService& service : services)
      openings.push_back({parsed->name_of(service.name), {.service = service.service}});
    auto served = open_ports(*parsed, std::move(openings), options.insecure, options.on_peer_error, true);
    if (!served) return tl::unexpected(std::move(served.error()));
    return std::unique_ptr<rpc::Opened>(std::move(*served));
  }

  Result<std::unique_ptr<rpc::Opened>> subscribe(const Address& address, idl::ServicePtr interface, Take take,
                                                 SubscribeOptions options) override {
    const auto parsed = opened_at(address);
    if (!parsed) return tl::unexpected(parsed.error());
    PortRole role;
    role.only = unnamed(*parsed, *interface);
    role.interface = std::move(interface);
    role.take = std::move(take);
    return read(*parsed, std::move(role), std::move(options));
  }

  Result<std::unique_ptr<rpc::Opened>> watch(const Address& address, std::function<void(const std::string&)> take,
                                             SubscribeOptions options) override {
    const auto parsed = opened_at(address);
    if (!parsed) return tl::unexpected(parsed.error());
    PortRole role;
    role.print = std::move(take);
    return read(*parsed, std::move(role), std::move(options));
  }

  Result<std::vector<rpc::NetworkEntry>> list(const Address& address, std::chrono::milliseconds patience) override {
    const auto parsed = opened_at(address);
    if (!parsed) return tl::unexpected(parsed.error());
    NameClient names(name_server_of(*parsed));
    auto all = names.list(steady_clock::now() + patience);
    if (!all) return tl::unexpected(std::move(all.error()));
    std::vector<rpc::NetworkEntry> out;
    for (const Registration& r : *all) {
      if (r.name.starts_with('/') && r.name.starts_with(parsed->name))
        out.push_back({r.name, "yarp:" + r.name, r.carrier});
    }
    return out;
  }

 private:
  // A port of ours that another one is to send to.
  class Reading final : public rpc::Opened {
   public:
    Reading(std::unique_ptr<Served> port, std::unique_ptr<Registrar> keeper)
        : port_(std::move(port)), keeper_(std::move(keeper)) {}
    ~Reading() override { stop(); }
    std::string address() const override { return port_->address(); }
    void stop() override {
      keeper_->stop();
      port_->stop();
    }

   private:
    std::unique_ptr<Served> port_;
    std::unique_ptr<Registrar> keeper_;
  };

  static Result<std::unique_ptr<rpc::Opened>> read(const PortAddress& from, PortRole role, SubscribeOptions options) {
    static std::atomic<int> number{0};
    const std::string own =
        from.open ? from.name : fmt::format("/sentree/{}/{}/{}:i", ::getpid(), ++number, options.target);
    PortAddress here = from;
    // A sender finds us by the name server, wherever it is itself.
    if (!from.open) here.direct = {};
    if (!from.open) role.source = "yarp:" + from.name;
    std::vector<Opening> openings;
    openings.push_back({own, std::move(role)});
    auto port = open_ports(here, std::move(openings), false, options.problem);
    if (!port) return tl::unexpected(std::move(port.error()));
    if (from.open) return std::unique_ptr<rpc::Opened>(std::move(*port));
    auto keeper = std::make_unique<Registrar>(name_server_of(from), options.problem);
    keeper->also([from, own, problem = options.problem, told = std::make_shared<bool>(false)](NameClient& names) {
      const auto why = keep_connected(names, from, own);
      if (why && !*told && problem) problem(*why);
      *told = why.has_value();
    });
    return std::unique_ptr<rpc::Opened>(std::make_unique<Reading>(std::move(*port), std::move(keeper)));
  }

  // Why it is not connected; nothing: it is.
  static std::optional<std::string> keep_connected(NameClient& names, const PortAddress& from, const std::string& own) {
    constexpr std::chrono::milliseconds kPatience{2000};
    HostPort at = from.direct;
    if (at.host.empty()) {
      auto found = names.query(from.name, steady_clock::now() + kPatience);
      if (!found) return found.error().message;
      if (!*found) return fmt::format("there is no port {} yet, from which data are to be read", from.name);
      at = (*found)->at;
    }
    const auto known = ask_port(at, fmt::format("[list] [out] \"{}\"", own), kPatience);
    if (!known) return known.error().message;
    if (!known->empty()) return std::nullopt;
    const auto added = ask_port(at, fmt::format("[add] \"{}:/{}\"", to_string(from.carrier), own), kPatience);
    if (!added) return added.error().message;
    if (added->starts_with("0")) return std::nullopt;
    return fmt::format("{} does not send its data here: {}", from.name, *added);
  }

  // One port of a name serves all parts of the process that publish on it.
  Result<std::shared_ptr<Served>> publisher(const PortAddress& address) {
    const std::lock_guard lock(mutex_);
    std::weak_ptr<Served>& slot = publishers_[address.name];
    if (auto known = slot.lock()) return known;
    Opening opening;
    opening.name = address.name;
    opening.role.sends = true;
    std::vector<Opening> openings;
    openings.push_back(std::move(opening));
    auto made = open_ports(address, std::move(openings), false, {});
    if (!made) return tl::unexpected(std::move(made.error()));
    std::shared_ptr<Served> served = std::move(*made);
    slot = served;
    return served;
  }

  std::mutex mutex_;
  std::map<std::string, std::weak_ptr<Served>> publishers_;
};

}  // namespace

std::unique_ptr<rpc::Middleware> make_middleware() { return std::make_unique<Yarp>(); }

}  // namespace sentree::yarp
