#include "sentree/rpc/server.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <list>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include "sentree/idl/conform.h"
#include "sentree/rpc/detail/answers.h"
#include "sentree/rpc/detail/connection.h"
#include "sentree/rpc/detail/listener.h"

namespace sentree::rpc {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

// Without a free descriptor nothing can be accepted; the next try comes after this.
constexpr milliseconds kExhaustedWait{100};

std::int64_t now_ns() { return steady_clock::now().time_since_epoch().count(); }

}  // namespace

class Server::Impl {
 public:
  Impl(Listener listener, Address address, std::vector<NamedService> services, ServerOptions options,
       std::shared_ptr<const TlsContext> tls)
      : listener_(std::make_unique<Listener>(std::move(listener))),
        address_(std::move(address)),
        services_(std::move(services)),
        options_(std::move(options)),
        tls_(std::move(tls)) {}
  ~Impl() {
    stop();
    for (const int fd : wake_) {
      if (fd >= 0) ::close(fd);
    }
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  Result<void> run() {
    if (::pipe2(wake_, O_CLOEXEC | O_NONBLOCK) != 0) return fail("rpc.address", "no descriptor left for a server");
    try {
      acceptor_ = std::thread([this] { accept_all(); });
    } catch (const std::system_error& e) {
      return fail("rpc.address", std::string("no thread left for a server: ") + e.what());
    }
    return {};
  }

  const Address& address() const { return address_; }

  void stop() {
    stopping_.store(true);
    wake();
    if (acceptor_.joinable()) acceptor_.join();
    listener_.reset();
    {
      const std::lock_guard lock(mutex_);
      for (Peer& p : peers_) p.stream->shut_down();
    }
    for (Peer& p : peers_) p.thread.join();
    peers_.clear();
  }

  ServerCounters counters() const { return {connections_.load(), refused_.load(), calls_.load(), peer_errors_.load()}; }

 private:
  struct Peer {
    std::unique_ptr<Stream> accepted;  // taken over by the thread
    Stream* stream = nullptr;          // outlives the thread, for shut_down
    std::unique_ptr<Connection> connection;
    std::thread thread;
    std::atomic<std::int64_t> idle_since_ns{0};  // 0: within a call
    std::atomic<bool> done{false};
  };

  // The acceptor looks up: the server stops, or a connection has ended.
  void wake() const {
    const char byte = 0;
    [[maybe_unused]] const auto written = ::write(wake_[1], &byte, 1);  // A full pipe wakes as well.
  }

  void accept_all() {
    while (!stopping_.load()) {
      pollfd watched[2] = {{listener_->descriptor(), POLLIN, 0}, {wake_[0], POLLIN, 0}};
      ::poll(watched, 2, -1);
      if (stopping_.load()) return;
      if (watched[1].revents != 0) {
        char bytes[64];
        [[maybe_unused]] const auto read = ::read(wake_[0], bytes, sizeof bytes);
      }
      reap();
      if (watched[0].revents == 0) continue;
      bool exhausted = false;
      Descriptor socket = listener_->accept(exhausted);
      if (exhausted) ::poll(&watched[1], 1, static_cast<int>(kExhaustedWait.count()));
      if (!socket) continue;
      if (!make_room()) {
        refused_.fetch_add(1);
        continue;
      }
      connections_.fetch_add(1);
      welcome(std::move(socket));
    }
  }

  void reap() {
    const std::lock_guard lock(mutex_);
    for (auto p = peers_.begin(); p != peers_.end();) {
      if (p->done.load()) {
        p->thread.join();
        p = peers_.erase(p);
      } else {
        ++p;
      }
    }
  }

  // At the bound, the connection on which nothing has come for longest has to go, if that is long enough.
  bool make_room() {
    Peer* oldest = nullptr;
    {
      const std::lock_guard lock(mutex_);
      if (peers_.size() < options_.connections_max) return true;
      for (Peer& p : peers_) {
        const std::int64_t since = p.idle_since_ns.load();
        if (since != 0 && (oldest == nullptr || since < oldest->idle_since_ns.load())) oldest = &p;
      }
      const std::int64_t limit = std::chrono::nanoseconds(options_.idle_before_eviction).count();
      if (oldest == nullptr || now_ns() - oldest->idle_since_ns.load() < limit) return false;
      oldest->stream->shut_down();
    }
    oldest->thread.join();
    const std::lock_guard lock(mutex_);
    peers_.remove_if([&](const Peer& p) { return &p == oldest; });
    return true;
  }

  void welcome(Descriptor socket) {
    const std::lock_guard lock(mutex_);
    Peer& p = peers_.emplace_back();
    p.idle_since_ns.store(now_ns());
    p.accepted = plain_stream(std::move(socket));
    p.stream = p.accepted.get();
    try {
      p.thread = std::thread([this, &p] {
        attend(p);
        p.stream->shut_down();
        p.done.store(true);
        wake();  // What is left of the connection goes now, not with the next one.
      });
    } catch (const std::system_error&) {
      peers_.pop_back();
      refused_.fetch_add(1);
    }
  }

  void attend(Peer& p) {
    try {
      if (tls_ != nullptr) {
        Connected secured = tls_stream(std::make_unique<Borrowed>(*p.stream), tls_, {},
                                       steady_clock::now() + options_.message_time_max);
        if (secured.stream == nullptr) throw WireError{StreamStatus::kFailed, secured.why};
        p.connection = std::make_unique<Connection>(std::move(secured.stream), options_.limits);
      } else {
        p.connection = std::make_unique<Connection>(std::make_unique<Borrowed>(*p.stream), options_.limits);
      }
      serve(p);
    } catch (const WireError& e) {
      complain(e.why);
    } catch (const std::exception& e) {
      complain(e.what());
    }
  }

  // The stream stays with the peer, so that `stop` can shut it down whatever the thread is doing.
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

  void complain(const std::string& why) {
    if (stopping_.load()) return;
    peer_errors_.fetch_add(1);
    if (options_.on_peer_error)
      options_.on_peer_error("a peer of " + to_string(address_) + " was disconnected: " + why);
  }

  // However a connection ends, the answers that it still owes find it closed.
  struct Closing {
    Answers& answers;
    ~Closing() { answers.close(); }
  };

  void serve(Peer& p) {
    Connection& c = *p.connection;
    const auto answers = std::make_shared<Answers>(c, options_.message_time_max);
    const Closing closing{*answers};
    while (!stopping_.load()) {
      if (answers->wait() != StreamStatus::kOk) return;  // Gone between messages, as peers do.
      p.idle_since_ns.store(0);
      c.in.begin_message(steady_clock::now() + options_.message_time_max);
      if (c.wire == nullptr) {
        const Encoding e = detect_encoding(c.in);
        c.wire = Wire::make(e.protocol, e.framed, c.in, c.out, options_.limits);
      }
      answer(c, answers);
      p.idle_since_ns.store(now_ns());
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
      return answers->fail(std::string(method_name), head.sequence,
                           service == nullptr
                               ? "there is no service for \"" + head.name + "\" here; there is " + service_names()
                               : service->interface().name + " has no method \"" + std::string(method_name) + "\"" +
                                     (head.name == method_name && services_.size() > 1
                                          ? "; a call that names no service is for the first of " + service_names()
                                          : std::string()),
                           kUnknownMethod);
    }
    const Value arguments = c.wire->read_arguments(*method);
    c.wire->end_message();
    calls_.fetch_add(1, std::memory_order_relaxed);
    if (method->oneway || head.type == MessageType::kOneway)
      return invoke(*service, *method, arguments, Reply([](Outcome, bool) {}));
    answers->owe();
    const Question question{method, head.sequence};
    invoke(*service, *method, arguments, Reply([answers, question](Outcome outcome, bool is_last) {
      answers->give(question, std::move(outcome), is_last);
    }));
  }

  std::string service_names() const {
    std::string out;
    for (const NamedService& s : services_) out += (out.empty() ? "\"" : ", \"") + s.name + "\"";
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

  std::unique_ptr<Listener> listener_;
  Address address_;
  const std::vector<NamedService> services_;
  const ServerOptions options_;
  const std::shared_ptr<const TlsContext> tls_;
  int wake_[2] = {-1, -1};
  std::atomic<bool> stopping_{false};
  std::thread acceptor_;
  std::mutex mutex_;  // peers_: the acceptor changes it, stop reads it
  std::list<Peer> peers_;
  std::atomic<std::uint64_t> connections_{0};
  std::atomic<std::uint64_t> refused_{0};
  std::atomic<std::uint64_t> calls_{0};
  std::atomic<std::uint64_t> peer_errors_{0};
};

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Server::~Server() = default;

Result<std::unique_ptr<Server>> Server::start(const Address& address, std::vector<NamedService> services,
                                              ServerOptions options) {
  std::shared_ptr<const TlsContext> tls;
  if (address.kind == Address::Kind::kTls) {
    auto made = tls_context(options.tls, true);
    if (!made) return tl::unexpected(made.error());
    tls = std::move(*made);
  }
  Address bound = address;
  auto listener = Listener::open(bound, options.insecure);
  if (!listener) return tl::unexpected(listener.error());
  auto impl = std::make_unique<Impl>(std::move(*listener), std::move(bound), std::move(services), std::move(options),
                                     std::move(tls));
  if (auto running = impl->run(); !running) return tl::unexpected(running.error());
  return std::unique_ptr<Server>(new Server(std::move(impl)));
}

const Address& Server::address() const { return impl_->address(); }
void Server::stop() { impl_->stop(); }
ServerCounters Server::counters() const { return impl_->counters(); }

}  // namespace sentree::rpc
