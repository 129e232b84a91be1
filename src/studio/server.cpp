#include "sentree/studio/server.h"

#include <fmt/format.h>

#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <random>
#include <thread>

#include "sentree/base/json.h"
#include "sentree/http/http.h"
#include "sentree/http/websocket.h"
#include "sentree/studio/assets.h"
#include "sentree/studio/detail/conversation.h"

namespace sentree::studio {

namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr int kProtocol = 1;

std::string random_word() {
  std::random_device device;
  std::string word;
  constexpr char kDigits[] = "0123456789abcdef";
  for (int i = 0; i < 8; ++i) {
    unsigned number = device();
    for (int digit = 0; digit < 4; ++digit, number >>= 4U) word += kDigits[number & 15U];
  }
  return word;
}

bool is_address(std::string_view host) {
  return host.starts_with('[') || (!host.empty() && host.find_first_not_of("0123456789.") == std::string_view::npos);
}

std::string host_name() {
  char name[256] = {};
  return gethostname(name, sizeof name - 1) == 0 ? name : "";
}

// Between the network's thread and the one that composes.
struct Inbox {
  struct Event {
    enum class Kind : std::uint8_t { kOpened, kReceived, kSteered, kClosed, kTold, kShown };
    std::uint64_t client = 0;
    Kind kind = Kind::kOpened;
    std::string text;
    std::optional<http::Socket> socket = {};
    std::optional<SteeringQueue::Outcome> outcome = {};
    std::optional<Server::Shown> shown = {};
  };

  void put(Event event) {
    const std::lock_guard lock(mutex);
    events.push_back(std::move(event));
    changed.notify_one();
  }

  std::mutex mutex;
  std::condition_variable changed;
  std::deque<Event> events;
  bool stopping = false;
};

class SocketSink final : public MessageSink {
 public:
  explicit SocketSink(http::Socket socket) : socket_(std::move(socket)) {}
  bool send(std::shared_ptr<const std::string> text) override { return socket_.send(std::move(text)); }
  std::size_t queued() const override { return socket_.queued(); }
  void close(std::uint16_t code, std::string reason) override { socket_.close(code, std::move(reason)); }

 private:
  http::Socket socket_;
};

class Handler final : public http::SocketHandler {
 public:
  Handler(std::uint64_t client, std::shared_ptr<Inbox> inbox, std::shared_ptr<std::atomic<std::size_t>> open)
      : client_(client), inbox_(std::move(inbox)), open_(std::move(open)) {}
  ~Handler() override {
    --*open_;
    inbox_->put({client_, Inbox::Event::Kind::kClosed, {}});
  }
  void received(std::string text) override { inbox_->put({client_, Inbox::Event::Kind::kReceived, std::move(text)}); }

 private:
  std::uint64_t client_;
  std::shared_ptr<Inbox> inbox_;
  std::shared_ptr<std::atomic<std::size_t>> open_;
};

}  // namespace

bool is_own_page(std::string_view host, std::string_view origin, std::string_view address, std::uint16_t port) {
  if (!origin.empty() && origin != fmt::format("http://{}", host)) return false;
  std::string_view name = host;
  const std::string ending = fmt::format(":{}", port);
  constexpr std::uint16_t kDefaultPort = 80;
  if (name.ends_with(ending))
    name.remove_suffix(ending.size());
  else if (port != kDefaultPort)
    return false;
  if (name == "localhost" || name == "127.0.0.1" || name == "[::1]") return true;
  if (name == address || name == fmt::format("[{}]", address)) return true;
  // Where others may come, they come by a number or by this machine's name: no other site can make its name mean these.
  return !http::is_loopback(address) && (is_address(name) || (!name.empty() && name == host_name()));
}

struct Server::Impl {
  const Subject& subject;
  const History& history;
  RunAccess run;
  ServerOptions options;
  std::string token;  // empty: whoever reaches the server may steer
  mutable std::mutex map_mutex;
  std::string map;
  mutable std::mutex pages_mutex;
  std::set<std::string> pages;
  std::string boot = random_word();
  std::shared_ptr<Inbox> inbox = std::make_shared<Inbox>();
  std::shared_ptr<std::atomic<std::size_t>> open = std::make_shared<std::atomic<std::size_t>>(0);
  std::atomic<std::uint64_t> next_client = 1;
  std::optional<http::Server> http;
  std::atomic<std::uint16_t> bound = 0;
  std::thread thread;

  Impl(const Subject& shown, const History& past, RunAccess access, ServerOptions given)
      : subject(shown), history(past), run(std::move(access)), options(std::move(given)) {}
  ~Impl() { stop(); }

  void stop() {
    http.reset();
    {
      const std::lock_guard lock(inbox->mutex);
      inbox->stopping = true;
      inbox->changed.notify_one();
    }
    if (thread.joinable()) thread.join();
  }

  Result<void> start();
  std::optional<http::Response> refusal(const http::Request& request) const;
  http::Response answer(const http::Request& request) const;
  std::string hello_of(const Subject& shown, bool steered, bool recording) const;
  void compose();
};

// ---- HTTP, in the network's thread ----

namespace {

http::Response text_response(int status, std::string text) { return {status, "text/plain", std::move(text) + "\n"}; }

http::Response secured(http::Response response) {
  response.headers.emplace_back(
      "Content-Security-Policy",
      "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
      "font-src 'self'; connect-src 'self'; worker-src 'self' blob:; base-uri 'none'; form-action 'none'; "
      "frame-ancestors 'none'");
  response.headers.emplace_back("X-Content-Type-Options", "nosniff");
  response.headers.emplace_back("Referrer-Policy", "no-referrer");
  response.headers.emplace_back("Cross-Origin-Resource-Policy", "same-origin");
  return response;
}

http::Response file_response(std::string_view path) {
  if (path == "/") path = "/index.html";
  for (const Asset& asset : assets()) {
    if (asset.path != path) continue;
    http::Response response{200, std::string(asset.media_type), std::string(asset.content)};
    if (asset.gzipped) response.headers.emplace_back("Content-Encoding", "gzip");
    // Names of built files hold a hash of what they contain.
    response.headers.emplace_back("Cache-Control",
                                  path.starts_with("/assets/") ? "public, max-age=31536000, immutable" : "no-cache");
    return response;
  }
  if (path == "/index.html") {
    return {200, "text/html; charset=utf-8",
            "<!doctype html><title>Sentree</title><p>This program was built without the web page: Node and npm were "
            "not there. Install them, run <code>cmake</code> again and build.</p>\n"};
  }
  return text_response(404, "there is no such file");
}

}  // namespace

std::optional<http::Response> Server::Impl::refusal(const http::Request& request) const {
  if (!is_own_page(request.header("Host"), request.header("Origin"), options.address, bound))
    return secured(text_response(403, "this server answers its own page only"));
  return std::nullopt;
}

http::Response Server::Impl::answer(const http::Request& request) const {
  if (auto refused = refusal(request)) return std::move(*refused);
  if (request.method != "GET" && request.method != "HEAD") return secured(text_response(405, "only GET is answered"));
  const std::string path = request.target.substr(0, request.target.find('?'));
  http::Response response;
  if (path == "/api/health") {
    response = {
        200, "application/json",
        to_json(Value(Map{{"ok", true}, {"version", options.version}, {"mode", options.live ? "live" : "recording"}})) +
            "\n"};
  } else if (path == "/api/map") {
    const std::lock_guard lock(map_mutex);
    response =
        map.empty() ? text_response(404, "this run has no map") : http::Response{200, "application/octet-stream", map};
  } else {
    response = file_response(path);
  }
  if (request.method == "HEAD") response.body.clear();
  return secured(std::move(response));
}

std::string Server::Impl::hello_of(const Subject& shown, bool steered, bool recording) const {
  const project::Scenario& scenario = shown.plan.scenario;
  return to_json(Value(Map{{"type", "hello"},
                           {"protocol", kProtocol},
                           {"version", options.version},
                           {"mode", recording ? "recording" : "live"},
                           {"title", scenario.name},
                           {"description", scenario.description},
                           {"clock", scenario.virtual_time ? "virtual" : "real"},
                           {"seed", static_cast<std::int64_t>(scenario.seed)},
                           {"steerable", steered},
                           {"coverage", static_cast<bool>(run.coverage)},
                           {"repeatable", static_cast<bool>(options.again)},
                           {"design", options.design},
                           {"compare", options.compare},
                           {"boot", boot}}));
}

Result<void> Server::Impl::start() {
  map = map_octets(subject);
  if (!http::is_loopback(options.address)) token = random_word();

  http::SocketService sockets;
  constexpr std::size_t kEditBytesMax = std::size_t{8} << 20U;
  if (options.design) sockets.limits.message_bytes_max = kEditBytesMax;
  sockets.refuse = [this](const http::Request& request) -> std::optional<http::Response> {
    if (auto refused = refusal(request)) return refused;
    if (request.target != "/api/ws") return secured(text_response(404, "the socket is at /api/ws"));
    // One comes after the other in this thread, so nobody slips in between the look and the count.
    if (*open >= kClientsMax)
      return secured(text_response(503, fmt::format("more than {} pages are open", kClientsMax)));
    ++*open;
    return std::nullopt;
  };
  sockets.open = [this](const http::Request&, http::Socket socket) -> std::unique_ptr<http::SocketHandler> {
    const std::uint64_t client = next_client++;
    inbox->put({client, Inbox::Event::Kind::kOpened, {}, std::move(socket)});
    return std::make_unique<Handler>(client, inbox, open);
  };
  auto listening = http::Server::listen(
      options.address, options.port, [this](const http::Request& request) { return answer(request); },
      {.body_bytes_max = 1024}, options.insecure, std::move(sockets));
  if (!listening) {
    listening.error().message = "the page: " + listening.error().message;
    return tl::unexpected(std::move(listening.error()));
  }
  http.emplace(std::move(*listening));
  bound = http->port();
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  thread = std::thread([this] { compose(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return {};
}

// ---- Composing ----

void Server::Impl::compose() {
  // Before what asks it, and gone after it.
  std::optional<SteeringQueue> queue;
  if (run.steer || run.coverage) {
    const auto carry_out = [this](const std::string& op, const Value& request) {
      if (op != "coverage" || !run.coverage) return run.steer(op, request);
      const Value* const verification = request.find("verification");
      const bool* const wanted = verification != nullptr ? verification->as_bool() : nullptr;
      if (wanted == nullptr || !*wanted) return run.coverage();
      return run.verified ? run.verified() : Value();
    };
    queue.emplace(carry_out, [inbox = inbox](SteeringQueue::Outcome outcome) {
      const std::uint64_t client = outcome.client;
      inbox->put({.client = client, .kind = Inbox::Event::Kind::kSteered, .text = {}, .outcome = std::move(outcome)});
    });
  }
  // What is shown is changed only by what comes through the inbox, and outlives who shows it.
  Shown shown;
  RunAccess access = run;
  const auto make_composer = [&](const Subject& shown_subject, const History& shown_history, bool steered,
                                 bool recording) {
    return std::make_unique<Composer>(shown_subject, shown_history, access, queue ? &*queue : nullptr,
                                      Composer::Options{.hello = hello_of(shown_subject, steered, recording),
                                                        .token = token,
                                                        .steerable = static_cast<bool>(run.steer),
                                                        .coverage = static_cast<bool>(run.coverage)});
  };
  std::unique_ptr<Composer> composer = make_composer(
      subject, history, static_cast<bool>(run.steer) && !options.design && !options.compare, !options.live);
  std::map<std::uint64_t, std::unique_ptr<Conversation>> clients;
  auto next_delta = SteadyClock::now();
  for (;;) {
    std::deque<Inbox::Event> events;
    {
      std::unique_lock lock(inbox->mutex);
      const auto ready = [&] { return inbox->stopping || !inbox->events.empty(); };
      const bool busy = std::any_of(clients.begin(), clients.end(), [](const auto& c) { return c.second->has_work(); });
      if (clients.empty())
        inbox->changed.wait(lock, ready);
      else if (!busy)
        inbox->changed.wait_until(lock, next_delta, ready);
      if (inbox->stopping) return;
      events.swap(inbox->events);
    }
    for (Inbox::Event& event : events) {
      switch (event.kind) {
        case Inbox::Event::Kind::kOpened:
          clients[event.client] = std::make_unique<Conversation>(
              *composer, event.client, std::make_unique<SocketSink>(std::move(*event.socket)));
          break;
        case Inbox::Event::Kind::kReceived:
          if (const auto client = clients.find(event.client); client != clients.end())
            client->second->received(event.text);
          break;
        case Inbox::Event::Kind::kSteered:
          if (const auto client = clients.find(event.client); client != clients.end())
            client->second->steered(event.outcome->id, std::move(event.outcome->result));
          break;
        case Inbox::Event::Kind::kTold: {
          const auto text = std::make_shared<const std::string>(std::move(event.text));
          for (auto& [id, client] : clients) client->told(text);
          break;
        }
        case Inbox::Event::Kind::kShown: {
          const Shown before = std::exchange(shown, std::move(*event.shown));
          access.update = shown.update;
          access.facts = shown.facts;
          auto next = make_composer(*shown.subject, *shown.history, shown.steered, shown.recording);
          {
            const std::lock_guard lock(map_mutex);
            map = map_octets(*shown.subject);
          }
          for (auto& [id, client] : clients) client->show(*next, shown.stays);
          composer = std::move(next);
          break;
        }
        case Inbox::Event::Kind::kClosed: clients.erase(event.client); break;
      }
    }
    for (auto& [id, client] : clients) client->work();
    if (options.design) {
      std::set<std::string> names;
      for (const auto& [id, client] : clients) names.insert(client->page());
      names.erase("");
      const std::lock_guard lock(pages_mutex);
      if (names != pages) {
        pages = std::move(names);
        queue->put({0, 0, "design_pages", Map()});
      }
    }
    if (SteadyClock::now() < next_delta) continue;
    next_delta = SteadyClock::now() + kDeltaPeriod;
    if (clients.empty()) continue;
    composer->refresh();
    for (auto& [id, client] : clients) client->send_delta();
  }
}

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Server::~Server() = default;
void Server::stop() { impl_->stop(); }

Result<std::unique_ptr<Server>> Server::start(const Subject& subject, const History& history, RunAccess run,
                                              ServerOptions options) {
  auto impl = std::unique_ptr<Impl>(new Impl(subject, history, std::move(run), std::move(options)));
  if (auto started = impl->start(); !started) return tl::unexpected(started.error());
  return std::unique_ptr<Server>(new Server(std::move(impl)));
}

std::string Server::url() const {
  return fmt::format("{}/{}", impl_->http->url(), impl_->token.empty() ? "" : "#token=" + impl_->token);
}
std::uint16_t Server::port() const { return impl_->bound; }
std::size_t Server::clients() const { return *impl_->open; }
std::set<std::string> Server::pages() const {
  const std::lock_guard lock(impl_->pages_mutex);
  return impl_->pages;
}
void Server::tell(std::string message) {
  impl_->inbox->put({.kind = Inbox::Event::Kind::kTold, .text = std::move(message)});
}
void Server::show(Shown shown) {
  impl_->inbox->put({.kind = Inbox::Event::Kind::kShown, .text = {}, .shown = std::move(shown)});
}

}  // namespace sentree::studio
