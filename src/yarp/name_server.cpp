#include "sentree/yarp/name_server.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <iomanip>
#include <mutex>
#include <set>
#include <sstream>

#include "sentree/rpc/acceptor.h"
#include "sentree/yarp/detail/bottle.h"
#include "sentree/yarp/detail/frame.h"
#include "sentree/yarp/detail/inbox.h"
#include "sentree/yarp/detail/listen.h"
#include "sentree/yarp/detail/port.h"

namespace sentree::yarp {
namespace {

using rpc::StreamStatus;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr std::string_view kEndLine = "*** end of message\r\n";
constexpr std::size_t kRequestMax = 8192;
constexpr milliseconds kLineTime{5000};
constexpr std::size_t kConnectionsMax = 256;
constexpr std::size_t kSubscriptionsMax = 1000;
constexpr milliseconds kConnectPatience{2000};

std::vector<std::string> words_of(const std::string& line) {
  std::istringstream in(line);
  std::vector<std::string> out;
  // Tools may quote what has no need of it.
  for (std::string word; in >> std::ws && in.peek() != std::istringstream::traits_type::eof();) {
    if (in.peek() == '"')
      in >> std::quoted(word);
    else
      in >> word;
    out.push_back(std::move(word));
  }
  return out;
}

std::string end(std::string answer = {}) { return std::move(answer) + std::string(kEndLine); }

// "/a/b" is below "/a", and "/ab" is not.
bool is_below(const std::string& name, const std::string& prefix) {
  if (prefix.empty() || prefix == "/") return true;
  if (!name.starts_with(prefix)) return false;
  return name.size() == prefix.size() || name[prefix.size()] == '/' || prefix.ends_with('/');
}

Item pair(const char* name, Item value) { return Item::list({Item::of(name), std::move(value)}); }

Item as_item(const Registration& r) {
  return Item::list({Item::of("port"), pair("name", Item::of(r.name)), pair("ip", Item::of(r.at.host)),
                     pair("port_number", Item::of(std::int64_t{r.at.port})), pair("carrier", Item::of(r.carrier))});
}

}  // namespace

NameTable::NameTable(HostPort own) : own_(std::move(own)) {
  entries_.push_back({{"/root", own_, "tcp"}, {}});
  entries_.push_back({{"fallback", {"224.2.1.1", 10000}, "mcast"}, {}});
}

NameTable::Entry* NameTable::find(const std::string& name) {
  const auto found =
      std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.registration.name == name; });
  return found == entries_.end() ? nullptr : &*found;
}

std::vector<Registration> NameTable::all() const {
  std::vector<Registration> out;
  for (const Entry& entry : entries_) out.push_back(entry.registration);
  return out;
}

std::string NameTable::answer(const std::string& line) {
  std::vector<std::string> words = words_of(line);
  if (words.empty() || words.front() != "NAME_SERVER") return end();
  words.erase(words.begin());
  if (words.empty()) return end();
  const std::string& verb = words[0];
  const std::string name = words.size() > 1 ? words[1] : std::string();
  if (verb == "register") return enter(words);
  if (verb == "unregister") {
    // Its own entry stays.
    std::erase_if(entries_, [&](const Entry& e) { return e.registration.name == name && name != "/root"; });
    return end();
  }
  if (verb == "query") {
    const Entry* entry = find(name);
    return end(entry != nullptr ? to_line(entry->registration) + "\r\n" : std::string());
  }
  if (verb == "list") {
    std::vector<Registration> found;
    for (const Entry& entry : entries_) {
      if (is_below(entry.registration.name, name)) found.push_back(entry.registration);
    }
    std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
    std::string out;
    for (const Registration& r : found) out += to_line(r) + "\r\n";
    return end(std::move(out));
  }
  if (verb == "set" || verb == "get" || verb == "check") return property(words);
  if (verb == "route" && words.size() > 2) {
    if (find(words[2]) == nullptr) return end();
    return end(fmt::format("port {} route {} = tcp:/{}\r\n", name, words[2], words[2]));
  }
  if (verb == "gc") return end("garbage collection done.\r\n");
  if (verb == "announce") return "[ok]\r\n";
  if (verb == "bot") return bottle(words);
  if (verb == "help") {
    return end(
        "register $portname\r\nunregister $portname\r\nquery $portname\r\nlist\r\nlist $prefix\r\n"
        "set $portname $property $value\r\nget $portname $property\r\ncheck $portname $property $value\r\n"
        "route $port1 $port2\r\ngc\r\nannounce $portname\r\nbot query $portname\r\nbot list\r\n");
  }
  return end();
}

std::string NameTable::enter(const std::vector<std::string>& words) {
  const auto given = [&](std::size_t i) { return i < words.size() && words[i] != "..." ? words[i] : std::string(); };
  Registration made;
  made.name = given(1);
  if (made.name.empty()) {
    do {
      made.name = fmt::format("/tmp/port/{}", next_unnamed_++);
    } while (find(made.name) != nullptr);
  }
  if (made.name.size() > kNameMax || made.name == "/root") return end();
  made.carrier = given(2).empty() ? "tcp" : given(2);
  made.at.host = given(3).empty() ? own_.host : given(3);
  const std::string number = given(4);
  if (!number.empty()) {
    const auto read = std::from_chars(number.data(), number.data() + number.size(), made.at.port);
    if (read.ec != std::errc() || read.ptr != number.data() + number.size()) return end();
  } else {
    const auto is_taken = [&](std::uint16_t port) {
      return std::any_of(entries_.begin(), entries_.end(),
                         [&](const Entry& e) { return e.registration.at.port == port; });
    };
    while (is_taken(next_port_) || next_port_ < kFirstPort) ++next_port_;
    made.at.port = next_port_++;
  }
  Entry* known = find(made.name);
  if (known == nullptr) {
    if (entries_.size() >= kNamesMax) return end();
    known = &entries_.emplace_back();
  }
  *known = {made, {}};
  return end(to_line(made) + "\r\n");
}

std::string NameTable::property(const std::vector<std::string>& words) {
  if (words.size() < 3) return end();
  Entry* entry = find(words[1]);
  if (entry == nullptr) return end();
  const std::string head = fmt::format("port {} property {}", words[1], words[2]);
  auto slot = std::find_if(entry->properties.begin(), entry->properties.end(),
                           [&](const auto& known) { return known.first == words[2]; });
  const bool known = slot != entry->properties.end();
  if (words[0] == "check") {
    const std::string value = words.size() > 3 ? words[3] : std::string();
    const bool has = known && std::find(slot->second.begin(), slot->second.end(), value) != slot->second.end();
    return end(fmt::format("{} value {} present {}\r\n", head, value, has ? "true" : "false"));
  }
  if (words[0] == "set") {
    std::vector<std::string> values(words.begin() + 3, words.end());
    std::sort(values.begin(), values.end());
    if (known) {
      slot->second = std::move(values);
    } else if (entry->properties.size() < kPropertiesMax) {
      entry->properties.emplace_back(words[2], std::move(values));
    }
    slot = std::find_if(entry->properties.begin(), entry->properties.end(),
                        [&](const auto& each) { return each.first == words[2]; });
  }
  std::string values;
  if (slot != entry->properties.end()) {
    for (const std::string& value : slot->second) values += " " + value;
  }
  return end(fmt::format("{} ={}\r\n", head, values));
}

std::string NameTable::bottle(const std::vector<std::string>& words) {
  if (words.size() > 2 && words[1] == "query") {
    const Entry* entry = find(words[2]);
    if (entry != nullptr) return to_text(as_item(entry->registration).items) + "\r\n";
    return "port (error -2 \"port not known\")\r\n";
  }
  if (words.size() > 1 && words[1] == "list") {
    std::vector<Item> out = {Item::of("ports")};
    for (const Entry& entry : entries_) out.push_back(as_item(entry.registration));
    return to_text(out) + "\r\n";
  }
  return end();
}

class NameServer::Impl {
 public:
  explicit Impl(NameServerOptions options) : options_(std::move(options)) {}
  ~Impl() { stop(); }

  Result<void> start() {
    at_ = options_.listen;
    auto listener = listen(at_, options_.insecure);
    if (!listener) {
      listener.error().message = "name server of YARP: " + listener.error().message;
      return tl::unexpected(std::move(listener.error()));
    }
    table_ = std::make_unique<NameTable>(at_);
    auto acceptor =
        rpc::Acceptor::start(std::move(*listener), [this](rpc::Visitor& visitor) { attend(visitor); },
                             {.connections_max = kConnectionsMax, .idle_before_eviction = milliseconds(1000)});
    if (!acceptor) return tl::unexpected(std::move(acceptor.error()));
    acceptor_ = std::move(*acceptor);
    return {};
  }

  void stop() {
    if (acceptor_ != nullptr) acceptor_->stop();
  }

  const HostPort& at() const { return at_; }
  std::vector<Registration> all() const {
    const std::lock_guard lock(mutex_);
    return table_->all();
  }

 private:
  void attend(rpc::Visitor& visitor) {
    try {
      Inbox in(&visitor.stream(), 16U << 20U);
      bool talks = false;
      bool confirms = false;
      while (!acceptor_is_stopping()) {
        visitor.idle();
        if (in.wait(rpc::kNoDeadline) != StreamStatus::kOk) return;
        visitor.busy();
        in.begin(steady_clock::now() + kLineTime);
        // Of what is asked here nothing begins so; the carriers in octets do, which send no line.
        if (!talks && *in.peek(1) == 'Y') {
          (void)say(visitor, std::string(kNotFound));
          return;
        }
        const std::string line = in.line(kRequestMax);
        std::string answer;
        if (!talks && (line.starts_with("CONNACK ") || line.starts_with("CONNECT "))) {
          talks = true;
          confirms = line.starts_with("CONNACK ");
          answer = fmt::format("Welcome {}\r\n", line.substr(8));
        } else if (talks) {
          if (line == "q") {
            if (confirms) (void)say(visitor, "<ACK>\r\n");
            return;
          }
          std::string second;
          if (line == "a" || line == "d") second = in.line(kRequestMax);
          answer = tell(line, second) + "<ACK>\r\n";
          if (!confirms) continue;  // the carrier "text" has no answers
        } else {
          if (!line.starts_with("NAME_SERVER") && !line.empty())
            throw Broken{StreamStatus::kFailed, "it asks nothing that a name server is asked"};
          answer = ask(line);
        }
        if (!say(visitor, answer)) return;
      }
    } catch (const Broken& e) {
      if (e.status == StreamStatus::kClosed || !options_.on_peer_error) return;
      options_.on_peer_error("a peer of the name server was disconnected: " + e.why);
    }
  }

  [[nodiscard]] bool acceptor_is_stopping() const { return acceptor_ != nullptr && acceptor_->is_stopping(); }

  bool say(rpc::Visitor& visitor, const std::string& text) {
    return visitor.stream().send(reinterpret_cast<const std::uint8_t*>(text.data()), text.size(),
                                 steady_clock::now() + kLineTime) == StreamStatus::kOk;
  }

  std::string ask(const std::string& line) {
    std::string out;
    {
      const std::lock_guard lock(mutex_);
      out = table_->answer(line);
    }
    const auto words = words_of(line);
    if (words.size() > 2 && words[1] == "announce") connect_subscribed(words[2]);
    return out;
  }

  std::string tell(const std::string& line, const std::string& second) {
    if (line == "*") {
      return fmt::format(
          "This is /root at tcp://{}/\r\nThere are no outgoing connections\r\nThere are no incoming connections\r\n",
          to_string(at_));
    }
    const auto request = parse_text(second);
    const bool is_text = request && !request->empty() && request->front().form == Item::Form::kText;
    if (line == "a") {
      if (request && !request->empty() && request->front().is_word("ver")) return "[ver] 1 2 3\r\n";
      if (request && !request->empty() && request->front().is_word("list")) return "\r\n";
      return "[fail] \"send [help] for list of valid commands\"\r\n";
    }
    if (line != "d" || !is_text) return {};
    const std::string& verb = request->front().text;
    if ((verb == "subscribe" || verb == "unsubscribe") && request->size() > 2) {
      const std::pair<std::string, std::string> wanted = {(*request)[1].text, (*request)[2].text};
      {
        const std::lock_guard lock(mutex_);
        if (verb == "unsubscribe")
          subscriptions_.erase(wanted);
        else if (subscriptions_.size() < kSubscriptionsMax)
          subscriptions_.insert(wanted);
      }
      if (verb == "subscribe") connect_subscribed(wanted.first);
      return "[ok]\r\n";
    }
    return ask("NAME_SERVER " + second);
  }

  // Connects those ports that are to stay connected and of which one has just come, or come again.
  void connect_subscribed(const std::string& name) {
    std::vector<std::pair<HostPort, std::string>> wanted;
    {
      const std::lock_guard lock(mutex_);
      for (const auto& [from, to] : subscriptions_) {
        if (from != name && to != name) continue;
        const auto all = table_->all();
        const auto at = std::find_if(all.begin(), all.end(), [&, f = from](const auto& r) { return r.name == f; });
        const bool both = std::any_of(all.begin(), all.end(), [&, t = to](const auto& r) { return r.name == t; });
        if (at != all.end() && both) wanted.emplace_back(at->at, to);
      }
    }
    for (const auto& [at, to] : wanted) {
      const auto known = ask_port(at, fmt::format("[list] [out] \"{}\"", to), kConnectPatience);
      if (known && known->empty()) (void)ask_port(at, fmt::format("[add] \"tcp:/{}\"", to), kConnectPatience);
    }
  }

  const NameServerOptions options_;
  HostPort at_;
  mutable std::mutex mutex_;
  std::unique_ptr<NameTable> table_;
  std::set<std::pair<std::string, std::string>> subscriptions_;
  std::unique_ptr<rpc::Acceptor> acceptor_;  // last: its threads use the others
};

NameServer::NameServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
NameServer::~NameServer() = default;

Result<std::unique_ptr<NameServer>> NameServer::start(NameServerOptions options) {
  auto impl = std::make_unique<Impl>(std::move(options));
  if (auto started = impl->start(); !started) return tl::unexpected(std::move(started.error()));
  return std::unique_ptr<NameServer>(new NameServer(std::move(impl)));
}

const HostPort& NameServer::at() const { return impl_->at(); }
std::vector<Registration> NameServer::all() const { return impl_->all(); }
void NameServer::stop() { impl_->stop(); }

bool answers(const HostPort& server, milliseconds patience) {
  NameClient names(server);
  return names.query("/root", steady_clock::now() + patience).has_value();
}

}  // namespace sentree::yarp
