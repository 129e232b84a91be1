#include "sentree/rpc/server.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <utility>

#include "sentree/idl/conform.h"
#include "sentree/rpc/acceptor.h"
#include "sentree/rpc/detail/answers.h"
#include "sentree/rpc/detail/connection.h"

namespace sentree::rpc {
using std::chrono::steady_clock;

class Server::Impl {
 public:
  Impl(Address address, std::vector<NamedService> services, ServerOptions options,
       std::shared_ptr<const TlsContext> tls)
      : address_(std::move(address)),
        services_(std::move(services)),
        options_(std::move(options)),
        tls_(std::move(tls)) {}

  Result<void> run(Listener listener) {
    auto acceptor =
        Acceptor::start(std::move(listener), [this](Visitor& visitor) { attend(visitor); },
                        {.connections_max = options_.connections_max,
                         .idle_before_eviction = options_.idle_before_eviction,
                         .newcomers_max = tls_ == nullptr ? 0 : std::max<std::size_t>(options_.connections_max / 2, 1),
                         .on_refused = [this] { refuse(); }});
    if (!acceptor) return tl::unexpected(std::move(acceptor.error()));
    acceptor_ = std::move(*acceptor);
    return {};
  }

  const Address& address() const { return address_; }

  void stop() {
    stopping_.store(true);
    acceptor_->stop();
  }

  ServerCounters counters() const {
    const Acceptor::Counters accepted = acceptor_->counters();
    return {accepted.connections, accepted.refused, calls_.load(), peer_errors_.load()};
  }

 private:
  void attend(Visitor& visitor) {
    try {
      auto stream = std::make_unique<Borrowed>(visitor.stream());
      if (tls_ == nullptr) {
        Connection connection(std::move(stream), options_.limits);
        return serve(visitor, connection);
      }
      Connected secured = tls_stream(std::move(stream), tls_, {}, steady_clock::now() + options_.message_time_max);
      if (visitor.is_gone() || (secured.stream != nullptr && !visitor.arrive()))
        throw WireError{StreamStatus::kFailed, "others came before it had shown its certificate"};
      if (secured.stream == nullptr) throw WireError{StreamStatus::kFailed, secured.why};
      Connection connection(std::move(secured.stream), options_.limits);
      serve(visitor, connection);
    } catch (const WireError& e) {
      complain(e.why);
    } catch (const std::exception& e) {
      complain(e.what());
    }
  }

  // The stream stays with the visitor, so that `stop` can shut it down whatever the thread is doing.
  class Borrowed final : public Stream {
   public:
    explicit Borrowed(Stream& stream) : stream_(stream) {}
    Received receive(std::uint8_t* out, std::size_t size, Deadline deadline) override {
      return stream_.receive(out, size, deadline);
    }
    StreamStatus send(const std::uint8_t* data, std::size_t size, Deadline deadline) override {
      return stream_.send(data, size, deadline);
    }
    void shut_down() override { stream_.shut_down(); }
    int descriptor() const override { return stream_.descriptor(); }
    std::size_t send_now(const std::uint8_t* data, std::size_t size) override { return stream_.send_now(data, size); }
    std::string why() const override { return stream_.why(); }

   private:
    Stream& stream_;
  };

  // In the acceptor's thread, once: whoever is refused tries again.
  void refuse() {
    if (stopping_.load() || told_full_.exchange(true) || !options_.on_peer_error) return;
    options_.on_peer_error(fmt::format("{} has {} connections, and takes no more; one was closed at once",
                                       to_string(address_), options_.connections_max));
  }

  void complain(const std::string& why) {
    if (stopping_.load()) return;
    peer_errors_.fetch_add(1);
    if (options_.on_peer_error)
      options_.on_peer_error(fmt::format("a peer of {} was disconnected: {}", to_string(address_), why));
  }

  // However a connection ends, the answers that it still owes find it closed.
  struct Closing {
    Answers& answers;
    ~Closing() { answers.close(); }
  };

  void serve(Visitor& visitor, Connection& c) {
    const auto answers = std::make_shared<Answers>(c, options_.message_time_max);
    const Closing closing{*answers};
    while (!stopping_.load()) {
      if (answers->wait() != StreamStatus::kOk) return;  // Gone between messages, as peers do.
      visitor.busy();
      c.in.begin_message(steady_clock::now() + options_.message_time_max);
      if (c.wire == nullptr) {
        const Encoding e = detect_encoding(c.in);
        c.wire = Wire::make(e.protocol, e.framed, c.in, c.out, options_.limits);
      }
      answer(c, answers);
      visitor.idle();
    }
  }

  Service* find(std::string_view name, std::string_view& method) const {
    const auto colon = name.find(':');
    method = colon == std::string_view::npos ? name : name.substr(colon + 1);
    if (colon == std::string_view::npos) return services_.empty() ? nullptr : services_.front().service.get();
    const auto found = std::find_if(services_.begin(), services_.end(),
                                    [&](const NamedService& s) { return s.name == name.substr(0, colon); });
    return found == services_.end() ? nullptr : found->service.get();
  }

  void answer(Connection& c, const std::shared_ptr<Answers>& answers) {
    const MessageHead head = c.wire->read_head();
    if (head.type != MessageType::kCall && head.type != MessageType::kOneway) {
      throw WireError{StreamStatus::kFailed, "it sent a reply where a request was due"};
    }
    std::string_view method_name;
    Service* service = find(head.name, method_name);
    const idl::Method* method = service == nullptr ? nullptr : service->interface().find(method_name);
    if (method == nullptr) {
      c.wire->skip_body();
      c.wire->end_message();
      if (head.type == MessageType::kOneway) return;
      return answers->fail(
          std::string(method_name), head.sequence,
          service == nullptr
              ? fmt::format("there is no service for \"{}\" here; there is {}", head.name, service_names())
              : fmt::format("{} has no method \"{}\"{}", service->interface().name, method_name,
                            head.name == method_name && services_.size() > 1
                                ? fmt::format("; a call that names no service is for the first of {}: name one behind "
                                              "the address, tcp://HOST:PORT/NAME or unix:PATH#NAME",
                                              service_names())
                                : std::string()),
          kUnknownMethod);
    }
    const Value arguments = c.wire->read_arguments(*method);
    c.wire->end_message();
    calls_.fetch_add(1, std::memory_order_relaxed);
    if (method->oneway || head.type == MessageType::kOneway)
      return invoke(*service, *method, arguments, Reply([](const Outcome&, bool) {}));
    answers->owe();
    const Question question{method, head.sequence};
    invoke(*service, *method, arguments, Reply([answers, question](Outcome outcome, bool is_last) {
      answers->give(question, std::move(outcome), is_last);
    }));
  }

  std::string service_names() const {
    std::string out;
    for (const NamedService& s : services_) out += fmt::format("{}\"{}\"", out.empty() ? "" : ", ", s.name);
    return out;
  }

  static void invoke(Service& service, const idl::Method& method, const Value& arguments, const Reply& reply) {
    const auto unfit = [&](std::string message) {
      reply.give(tl::unexpected(CallError{CallErrorKind::kProtocol, std::move(message), {}, {}}));
    };
    try {
      if (idl::conforms_arguments(method, arguments)) return service.serve(method, arguments, reply);
      // A peer may leave out what has no stand-in, and sets are in no order that could be checked without work.
      const auto conformed = idl::conform_arguments(method, arguments);
      if (!conformed) return unfit(conformed.error().message);
      service.serve(method, *conformed, reply);
    } catch (const std::exception& e) {
      unfit(e.what());
    }
  }

  const Address address_;
  const std::vector<NamedService> services_;
  const ServerOptions options_;
  const std::shared_ptr<const TlsContext> tls_;
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint64_t> calls_{0};
  std::atomic<std::uint64_t> peer_errors_{0};
  std::atomic<bool> told_full_{false};
  std::unique_ptr<Acceptor> acceptor_;  // last: its threads use the others
};

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Server::~Server() = default;

Result<std::unique_ptr<Server>> Server::start(const Address& address, std::vector<NamedService> services,
                                              ServerOptions options) {
  std::shared_ptr<const TlsContext> tls;
  if (address.kind == Address::Kind::kTls) {
    auto made = tls_context(options.tls, true);
    if (!made) return tl::unexpected(made.error());
    if (auto valid = check_dates(**made, options.tls); !valid) return tl::unexpected(valid.error());
    tls = std::move(*made);
  }
  Address bound = address;
  auto listener = Listener::open(bound, options.insecure);
  if (!listener) return tl::unexpected(listener.error());
  auto impl = std::make_unique<Impl>(std::move(bound), std::move(services), std::move(options), std::move(tls));
  if (auto running = impl->run(std::move(*listener)); !running) return tl::unexpected(running.error());
  return std::unique_ptr<Server>(new Server(std::move(impl)));
}

const Address& Server::address() const { return impl_->address(); }
void Server::stop() { impl_->stop(); }
ServerCounters Server::counters() const { return impl_->counters(); }

}  // namespace sentree::rpc
