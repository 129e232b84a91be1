#include "sentree/studio/foxglove.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <utility>

#include "sentree/base/json.h"
#include "sentree/http/http.h"
#include "sentree/http/websocket.h"
#include "sentree/text/json.h"

namespace sentree::studio {

// Foxglove WebSocket protocol: https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md. Its later name,
// foxglove.sdk.v1, has the same messages of those that are sent here.

namespace {

constexpr std::array<std::string_view, 2> kSubprotocols = {"foxglove.sdk.v1", "foxglove.websocket.v1"};
// First octet of binary messages.
constexpr char kMessageData = 1;
constexpr char kTime = 2;
enum class Level { kInfo = 0, kWarning = 1, kError = 2 };
// Between two tellings of the time [recorded ns].
constexpr std::uint64_t kTimePeriod = 1'000'000;
constexpr std::chrono::seconds kEndPatience{2};
constexpr std::uint16_t kGoingAway = 1001;  // RFC 6455, 7.4.1
// Channels of one run are numbered below this.
constexpr std::uint32_t kChannelsPerRun = 0x10000;

template <class Number>
void append_little(std::string& out, Number number) {
  for (std::size_t i = 0; i < sizeof number; ++i) out += static_cast<char>(number >> (8 * i) & 0xFFU);
}

std::string status_text(Level level, std::string text) {
  return to_json(
      Value(Map{{"op", "status"}, {"level", static_cast<std::int64_t>(level)}, {"message", std::move(text)}}));
}

// The first one offered that is spoken here.
std::string chosen_subprotocol(const http::Request& request) {
  std::string_view offered = request.header("Sec-WebSocket-Protocol");
  while (!offered.empty()) {
    const std::size_t comma = std::min(offered.find(','), offered.size());
    std::string_view name = offered.substr(0, comma);
    offered.remove_prefix(std::min(comma + 1, offered.size()));
    name.remove_prefix(std::min(name.find_first_not_of(" \t"), name.size()));
    name = name.substr(0, name.find_last_not_of(" \t") + 1);
    if (std::find(kSubprotocols.begin(), kSubprotocols.end(), name) != kSubprotocols.end()) return std::string(name);
  }
  return {};
}

std::optional<std::uint32_t> small_number(const Value* value) {
  const std::int64_t* number = value != nullptr ? value->as_int() : nullptr;
  if (number == nullptr || *number < 0 || *number > 0xFFFF'FFFF) return std::nullopt;
  return static_cast<std::uint32_t>(*number);
}

http::Response foxglove_refusal(int status, std::string text) { return {status, "text/plain", std::move(text) + "\n"}; }

// What the connections share with who records. All is done with the lock held; no send waits.
class Hub {
 public:
  void open(std::uint64_t id, http::Socket socket) {
    const std::lock_guard lock(mutex_);
    const Client& client = clients_.emplace(id, Client(std::move(socket))).first->second;
    client.socket.send(server_info());
    client.socket.send(advertisement());
  }

  void closed(std::uint64_t id) {
    const std::lock_guard lock(mutex_);
    clients_.erase(id);
    gone_.notify_all();
  }

  void received(std::uint64_t id, const std::string& text) {
    const std::lock_guard lock(mutex_);
    const auto found = clients_.find(id);
    if (found == clients_.end()) return;
    Client& client = found->second;
    const auto request = text::parse_json(text);
    const Value* op = request && request->as_map() != nullptr ? request->find("op") : nullptr;
    const std::string_view name = op != nullptr ? op->text() : std::string_view();
    if (name == "subscribe") {
      each(*request, "subscriptions", [&](const Value& wanted) { subscribe(client, wanted); });
    } else if (name == "unsubscribe") {
      each(*request, "subscriptionIds", [&](const Value& wanted) { unsubscribe(client, wanted); });
    } else {
      complain(client, name.empty() ? "this is no JSON object with an \"op\""
                                    : fmt::format("\"{}\" is not offered: clients look, and change nothing", name));
    }
  }

  void drained(std::uint64_t id) {
    const std::lock_guard lock(mutex_);
    const auto found = clients_.find(id);
    if (found != clients_.end() && found->second.lost > 0) catch_up(found->second);
  }

  void begin(std::string_view run, const std::string& version) {
    const std::lock_guard lock(mutex_);
    const std::string withdrawal = to_json(Value(Map{{"op", "unadvertise"}, {"channelIds", channel_ids()}}));
    const bool had_any = !topics_.empty();
    topics_.clear();
    first_channel_ += kChannelsPerRun;
    time_ = 0;
    run_ = run;
    version_ = version;
    session_ = fmt::format("{}-{}", std::random_device()(), first_channel_ / kChannelsPerRun);
    for (auto& [id, client] : clients_) {
      client.subscriptions.clear();
      if (had_any) client.socket.send(withdrawal);
      client.socket.send(server_info());
    }
  }

  void channel(const record::Channel& channel, const record::Schema& schema) {
    const std::lock_guard lock(mutex_);
    const std::uint32_t id = first_channel_ + channel.id;
    Topic& topic = topics_[id];
    topic.offered = Map{{"id", static_cast<std::int64_t>(id)}, {"topic", channel.topic},
                        {"encoding", channel.encoding},        {"schemaName", schema.name},
                        {"schemaEncoding", schema.encoding},   {"schema", schema.data}};
    const auto text = std::make_shared<const std::string>(
        to_json(Value(Map{{"op", "advertise"}, {"channels", List{topic.offered}}})));
    for (auto& [key, client] : clients_) client.socket.send(text);
  }

  void message(const record::RawMessage& message) {
    const std::lock_guard lock(mutex_);
    const auto found = topics_.find(first_channel_ + message.channel);
    if (found == topics_.end()) return;
    Topic& topic = found->second;
    topic.published = true;
    topic.time = message.log_time;
    topic.latest = message.data;
    const bool advances = message.log_time >= time_ + kTimePeriod;
    if (advances) time_ = message.log_time;
    for (auto& [id, client] : clients_) {
      if (advances && client.lost == 0) client.socket.send(time_message(), http::Socket::Form::kBinary);
      const auto subscription = client.subscriptions.find(found->first);
      if (subscription != client.subscriptions.end()) deliver(client, subscription->second, topic);
    }
  }

  void end() {
    std::unique_lock lock(mutex_);
    for (auto& [id, client] : clients_) client.socket.close(kGoingAway, "the run is over");
    gone_.wait_for(lock, kEndPatience, [this] { return clients_.empty(); });
  }

 private:
  struct Topic {
    Value offered;
    bool published = false;
    std::uint64_t time = 0;
    std::string latest;
  };
  struct Subscription {
    std::uint32_t id = 0;
    bool missed = false;  // the latest message
  };
  struct Client {
    explicit Client(http::Socket s) : socket(std::move(s)) {}
    http::Socket socket;
    std::map<std::uint32_t, Subscription> subscriptions;  // by channel: one for each, so they are bounded
    std::uint64_t lost = 0;                               // and nothing more is sent until it has taken the rest
  };

  static void complain(const Client& client, std::string what) {
    client.socket.send(status_text(Level::kError, std::move(what)));
  }

  template <class Do>
  static void each(const Value& request, const char* name, Do&& act) {
    const Value* all = request.find(name);
    const List* const list = all != nullptr ? all->as_list() : nullptr;
    if (list == nullptr) return;
    for (const Value& one : *list) act(one);
  }

  void subscribe(Client& client, const Value& wanted) {
    const auto id = wanted.as_map() != nullptr ? small_number(wanted.find("id")) : std::nullopt;
    const auto channel = wanted.as_map() != nullptr ? small_number(wanted.find("channelId")) : std::nullopt;
    if (!id || !channel)
      return complain(client, "a subscription has an id and a channelId, numbers from 0 to 4294967295");
    const auto topic = topics_.find(*channel);
    if (topic == topics_.end()) return complain(client, fmt::format("there is no channel {}", *channel));
    if (client.subscriptions.count(*channel) != 0)
      return complain(client, fmt::format("channel {} is subscribed already", *channel));
    for (const auto& [other, subscription] : client.subscriptions) {
      if (subscription.id == *id) return complain(client, fmt::format("subscription {} is there already", *id));
    }
    Subscription& made = client.subscriptions[*channel] = {*id, false};
    if (topic->second.published) deliver(client, made, topic->second);
  }

  static void unsubscribe(Client& client, const Value& wanted) {
    const auto id = small_number(&wanted);
    const auto ended = std::find_if(client.subscriptions.begin(), client.subscriptions.end(),
                                    [&](const auto& one) { return id && one.second.id == *id; });
    if (ended == client.subscriptions.end()) return complain(client, "there is no such subscription");
    client.subscriptions.erase(ended);
  }

  static void deliver(Client& client, Subscription& to, const Topic& topic) {
    if (client.lost > 0 || !send(client, to, topic)) {
      ++client.lost;
      to.missed = true;
    }
  }

  static bool send(const Client& client, const Subscription& to, const Topic& topic) {
    std::string octets;
    octets.reserve(topic.latest.size() + 13);
    octets += kMessageData;
    append_little(octets, to.id);
    append_little(octets, topic.time);
    octets += topic.latest;
    return client.socket.send(std::make_shared<const std::string>(std::move(octets)), http::Socket::Form::kBinary);
  }

  // It has taken all: it is told what it missed, and stands where the others do.
  void catch_up(Client& client) {
    const auto missed = static_cast<std::uint64_t>(std::count_if(
        client.subscriptions.begin(), client.subscriptions.end(), [](const auto& s) { return s.second.missed; }));
    if (client.lost > missed &&
        !client.socket.send(status_text(
            Level::kWarning, fmt::format("{} messages are not here: this connection takes fewer than the run makes",
                                         client.lost - missed))))
      return;
    client.lost = 0;
    client.socket.send(time_message(), http::Socket::Form::kBinary);
    for (auto& [channel, subscription] : client.subscriptions) {
      if (!std::exchange(subscription.missed, false)) continue;
      const auto topic = topics_.find(channel);
      if (topic != topics_.end()) deliver(client, subscription, topic->second);
    }
  }

  [[nodiscard]] std::shared_ptr<const std::string> time_message() const {
    std::string octets(1, kTime);
    append_little(octets, time_);
    return std::make_shared<const std::string>(std::move(octets));
  }

  [[nodiscard]] std::string server_info() const {
    return to_json(Value(Map{{"op", "serverInfo"},
                             {"name", run_.empty() ? "sentree" : "sentree: " + run_},
                             {"capabilities", List{"time"}},
                             {"metadata", Map{{"version", version_}}},
                             {"sessionId", session_}}));
  }

  [[nodiscard]] std::string advertisement() const {
    List channels;
    for (const auto& [id, topic] : topics_) channels.push_back(topic.offered);
    return to_json(Value(Map{{"op", "advertise"}, {"channels", std::move(channels)}}));
  }

  [[nodiscard]] List channel_ids() const {
    List ids;
    for (const auto& [id, topic] : topics_) ids.emplace_back(static_cast<std::int64_t>(id));
    return ids;
  }

  std::mutex mutex_;
  std::condition_variable gone_;
  std::map<std::uint64_t, Client> clients_;
  std::map<std::uint32_t, Topic> topics_;
  std::uint32_t first_channel_ = 0;
  std::uint64_t time_ = 0;
  std::string run_, version_, session_;
};

class FoxgloveHandler final : public http::SocketHandler {
 public:
  FoxgloveHandler(std::uint64_t id, std::shared_ptr<Hub> hub, std::shared_ptr<std::atomic<std::size_t>> open)
      : id_(id), hub_(std::move(hub)), open_(std::move(open)) {}
  ~FoxgloveHandler() override {
    --*open_;
    hub_->closed(id_);
  }
  void received(std::string text) override { hub_->received(id_, text); }
  void drained() override { hub_->drained(id_); }

 private:
  std::uint64_t id_;
  std::shared_ptr<Hub> hub_;
  std::shared_ptr<std::atomic<std::size_t>> open_;
};

}  // namespace

bool may_look(std::string_view origin) {
  if (origin.empty()) return true;
  const std::size_t end = origin.find("://");
  if (end == std::string_view::npos) return false;  // "null": a page that hides where it is from
  const std::string_view scheme = origin.substr(0, end);
  if (scheme != "http" && scheme != "https") return true;
  std::string_view host = origin.substr(end + 3);
  host = host.substr(0, host.starts_with("[::1]:") ? 5 : host.starts_with('[') ? host.size() : host.find(':'));
  if (scheme == "https" && (host == "app.foxglove.dev" || host == "studio.foxglove.dev")) return true;
  return host == "localhost" || host == "127.0.0.1" || host == "[::1]";
}

struct Foxglove::Impl {
  FoxgloveOptions options;
  std::shared_ptr<Hub> hub = std::make_shared<Hub>();
  std::shared_ptr<std::atomic<std::size_t>> open = std::make_shared<std::atomic<std::size_t>>(0);
  std::uint64_t next_client = 1;  // of the server's thread
  std::optional<http::Server> http;
};

Foxglove::Foxglove(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Foxglove::~Foxglove() = default;

Result<std::unique_ptr<Foxglove>> Foxglove::start(FoxgloveOptions options) {
  auto impl = std::make_unique<Impl>();
  impl->options = std::move(options);
  http::SocketService sockets;
  sockets.limits.queue_bytes_max = impl->options.queue_bytes_max;
  sockets.subprotocol = chosen_subprotocol;
  sockets.refuse = [raw = impl.get()](const http::Request& request) -> std::optional<http::Response> {
    if (!raw->options.insecure && !may_look(request.header("Origin")))
      return foxglove_refusal(403, "pages of this site may not look at the run; --insecure lets all");
    if (chosen_subprotocol(request).empty())
      return foxglove_refusal(400, "the subprotocols here are foxglove.sdk.v1 and foxglove.websocket.v1");
    // One comes after the other in this thread, so nobody slips in between the look and the count.
    if (*raw->open >= kFoxgloveClientsMax)
      return foxglove_refusal(503, fmt::format("more than {} clients are there", kFoxgloveClientsMax));
    ++*raw->open;
    return std::nullopt;
  };
  sockets.open = [raw = impl.get()](const http::Request&, http::Socket socket) -> std::unique_ptr<http::SocketHandler> {
    const std::uint64_t id = raw->next_client++;
    auto handler = std::make_unique<FoxgloveHandler>(id, raw->hub, raw->open);
    raw->hub->open(id, std::move(socket));
    return handler;
  };
  auto listening = http::Server::listen(
      impl->options.address, impl->options.port,
      [](const http::Request&) { return foxglove_refusal(426, "here is a run for Foxglove: a WebSocket, no page"); },
      {.body_bytes_max = 1024}, impl->options.insecure, std::move(sockets));
  if (!listening) {
    listening.error().message = "Foxglove: " + listening.error().message;
    return tl::unexpected(std::move(listening.error()));
  }
  impl->http.emplace(std::move(*listening));
  return std::unique_ptr<Foxglove>(new Foxglove(std::move(impl)));
}

void Foxglove::begin(std::string_view run) { impl_->hub->begin(run, impl_->options.version); }
void Foxglove::channel(const record::Channel& channel, const record::Schema& schema) {
  impl_->hub->channel(channel, schema);
}
void Foxglove::message(const record::RawMessage& message) { impl_->hub->message(message); }
void Foxglove::end() { impl_->hub->end(); }

std::string Foxglove::url() const { return "ws" + impl_->http->url().substr(4); }
std::uint16_t Foxglove::port() const { return impl_->http->port(); }

std::string Foxglove::told() const {
  const bool is_local = http::is_loopback(impl_->options.address);
  return fmt::format("Foxglove: {} (no authentication: any {} that reaches it can look)", url(),
                     is_local ? "program of this machine" : "machine");
}

}  // namespace sentree::studio
