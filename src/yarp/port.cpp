#include "sentree/yarp/detail/port.h"

#include <fmt/format.h>

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <list>
#include <mutex>
#include <optional>
#include <utility>

#include "sentree/idl/conform.h"
#include "sentree/rpc/acceptor.h"
#include "sentree/yarp/detail/bottle.h"
#include "sentree/yarp/detail/encoding.h"
#include "sentree/yarp/detail/frame.h"
#include "sentree/yarp/detail/listen.h"
#include "sentree/yarp/detail/output.h"
#include "sentree/yarp/name_server.h"
#include "sentree/yarp/names.h"

namespace sentree::yarp {
namespace {

using rpc::StreamStatus;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr std::size_t kLineMax = 65536;
constexpr milliseconds kNameServerPatience{2000};
// How often a thread that waits for the answer of a service looks whether its port is being closed.
constexpr milliseconds kLook{50};

// What services of YARP 4 are asked, and answer: four int16, which are the interface's own version and YARP's.
constexpr std::string_view kVersionQuestion = "getRemoteProtocolVersion";
void write_yarp4(std::vector<std::uint8_t>& out) {
  put_int(out, 256);
  put_int(out, 1);
  for (const int part : {0, 4, 0, 0}) out.insert(out.end(), {static_cast<std::uint8_t>(part), 0});
}

// How people know the carriers that are not spoken here, by the first eight octets of a connection.
std::string carrier_shown(const std::uint8_t* head) {
  const std::string text(reinterpret_cast<const char*>(head), kMarkSize);
  if (text.starts_with("YA") && text.ends_with("RP")) {
    std::int32_t number = 0;
    std::copy_n(head + 2, 4, reinterpret_cast<std::uint8_t*>(&number));
    if (number == 7777) return "udp";
    if (number == 7777 + 128) return "udp with acknowledgements";
    if (number == 7777 + 1 || number == 7777 + 1 + 128) return "mcast";
    return fmt::format("number {}", number);
  }
  if (text.starts_with("GET ") || text.starts_with("POST ")) return "http";
  std::string shown;
  for (const char c : text) shown += c >= ' ' && c < 127 ? c : '?';
  return fmt::format("\"{}\"", shown);
}

// The answer to one call, given by whichever thread has it.
class Answer {
 public:
  Answer(rpc::Stream& stream, const Encoding& encoding, const idl::Method& method, bool confirm, bool with_reply)
      : stream_(stream), encoding_(encoding), method_(method), confirm_(confirm), with_reply_(with_reply) {}

  void give(rpc::Outcome outcome, bool is_last) {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    outcome = rpc::checked(method_, std::move(outcome));
    is_closing_ = !write(outcome);
    if (!outcome) why_ = outcome.error().message;
    if (is_closing_) {
      out_.clear();
    } else {
      if (confirm_) put_mark(out_, kAckMark);
      sent_ = stream_.send_now(out_.data(), out_.size());
    }
    given_ = true;
    is_last_ = is_last;
    if (is_last && sent_ == out_.size()) stream_.shut_down();
    if (waited_for_) changed_.notify_all();
  }

  /// In the thread that reads: until the answer has gone. False: the connection is to be closed.
  bool await(milliseconds send_time_max, const std::atomic<bool>& stopping) {
    std::unique_lock lock(mutex_);
    waited_for_ = true;
    while (!given_ && !stopping.load()) changed_.wait_for(lock, kLook);
    closed_ = true;
    if (!given_ || is_closing_) return false;
    if (sent_ < out_.size()) {
      const auto sent = stream_.send(out_.data() + sent_, out_.size() - sent_, steady_clock::now() + send_time_max);
      if (sent != StreamStatus::kOk) throw Broken{sent, "it does not take its reply"};
    }
    return !is_last_;
  }

  /// Why the connection is closed instead of a reply.
  [[nodiscard]] std::string why() {
    const std::lock_guard lock(mutex_);
    return why_;
  }

 private:
  // False: there is nothing that the caller could read.
  bool write(const rpc::Outcome& outcome) {
    if (!with_reply_) return true;
    if (outcome) {
      encoding_.write_reply(out_, method_, *outcome);
      return true;
    }
    const idl::Kind kind = method_.result->kind;
    if (kind == idl::Kind::kVoid) {
      encoding_.write_reply(out_, method_, Value());
      return true;
    }
    if (kind != idl::Kind::kBool) return false;
    encoding_.write_reply(out_, method_, Value(false));
    return true;
  }

  rpc::Stream& stream_;
  const Encoding& encoding_;
  const idl::Method& method_;
  const bool confirm_;
  const bool with_reply_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::uint8_t> out_;
  std::size_t sent_ = 0;
  bool given_ = false;
  bool is_last_ = false;
  bool is_closing_ = false;
  bool closed_ = false;
  bool waited_for_ = false;
  std::string why_;
};

}  // namespace

class Port::Impl {
 public:
  Impl(PortOptions options, PortRole role)
      : options_(std::move(options)), role_(std::move(role)), encoding_(options_.version, options_.limits) {}
  ~Impl() { stop(); }

  Result<void> start() {
    at_ = options_.listen;
    auto listener = listen(at_, options_.insecure);
    if (!listener) {
      listener.error().message = "port " + options_.name + ": " + listener.error().message;
      return tl::unexpected(std::move(listener.error()));
    }
    auto acceptor =
        rpc::Acceptor::start(std::move(*listener), [this](rpc::Visitor& visitor) { attend(visitor); },
                             {.connections_max = options_.connections_max, .on_refused = [this] { refuse(); }});
    if (!acceptor) return tl::unexpected(std::move(acceptor.error()));
    acceptor_ = std::move(*acceptor);
    return {};
  }

  void stop() {
    stopping_.store(true);
    if (acceptor_ != nullptr) acceptor_->stop();
    std::list<std::unique_ptr<Output>> gone;
    const std::lock_guard lock(mutex_);
    gone.swap(outputs_);
  }

  const PortOptions& options() const { return options_; }
  const HostPort& at() const { return at_; }

  void write(const idl::Method& method, const Value& arguments, bool with_name) {
    std::vector<std::uint8_t> message;
    const std::size_t begun = begin_frame(message, 'D');
    encoding_.write_call(message, method, arguments, with_name);
    finish_frame(message, begun);
    const Octets shared = std::make_shared<const std::vector<std::uint8_t>>(std::move(message));
    const std::lock_guard lock(mutex_);
    drop_outputs_over();
    for (const auto& output : outputs_) lost_ += output->put(shared);
  }

  Result<void> add_output(const std::string& to, Carrier carrier) {
    if (!role_.sends) return fail("yarp.connect", "Outputs not allowed");
    if (options_.name_server.host.empty()) return fail("yarp.connect", "Do not know how to connect to " + to);
    NameClient names(options_.name_server);
    auto found = names.query(to, steady_clock::now() + kNameServerPatience);
    if (!found || !*found) return fail("yarp.connect", "Do not know how to connect to " + to);
    auto output = Output::open(options_.name, to, (*found)->at, carrier);
    if (!output) return fail("yarp.connect", fmt::format("Cannot connect to {}: {}", to, output.error().message));
    const std::lock_guard lock(mutex_);
    drop_outputs_over();
    // The same connection made again replaces the first.
    outputs_.remove_if([&](const auto& known) { return known->to() == to; });
    if (stopping_.load() || outputs_.size() >= kOutputsMax)
      return fail("yarp.connect", fmt::format("the port has {} connections already", kOutputsMax));
    outputs_.push_back(std::move(*output));
    return {};
  }

  std::vector<std::string> outputs() {
    const std::lock_guard lock(mutex_);
    drop_outputs_over();
    std::vector<std::string> out;
    for (const auto& output : outputs_) out.push_back(output->to());
    return out;
  }

  std::vector<std::string> inputs() {
    const std::lock_guard lock(mutex_);
    std::vector<std::string> out;
    for (const Input* input : inputs_) out.push_back(input->from);
    return out;
  }

  PortCounters counters() {
    const rpc::Acceptor::Counters accepted = acceptor_->counters();
    const std::lock_guard lock(mutex_);
    return {accepted.connections, accepted.refused, messages_.load(), peer_errors_.load(), lost_};
  }

 private:
  // A connection that others made, while it lasts.
  struct Input {
    Input(Impl& port, std::string name, std::string spoken, rpc::Stream& socket)
        : owner(port), from(std::move(name)), carrier(std::move(spoken)), stream(socket) {
      const std::lock_guard lock(owner.mutex_);
      for (Input* known : owner.inputs_) {
        // The same port, connected again: what it was connected by before is of no more use to it.
        if (from.starts_with('/') && known->from == from) known->stream.shut_down();
      }
      owner.inputs_.push_back(this);
    }
    ~Input() {
      const std::lock_guard lock(owner.mutex_);
      owner.inputs_.remove(this);
    }
    Input(const Input&) = delete;
    Input& operator=(const Input&) = delete;

    Impl& owner;
    const std::string from;
    const std::string carrier;
    rpc::Stream& stream;
  };

  rpc::Deadline in_time() const { return steady_clock::now() + options_.message_time_max; }

  // In the acceptor's thread.
  void refuse() {
    if (stopping_.load() || told_full_.exchange(true) || !options_.on_peer_error) return;
    options_.on_peer_error(fmt::format("yarp:{} has {} connections, and takes no more; one was closed at once",
                                       options_.name, options_.connections_max));
  }

  void complain(const std::string& why) {
    if (stopping_.load()) return;
    peer_errors_.fetch_add(1);
    if (options_.on_peer_error)
      options_.on_peer_error(fmt::format("a peer of yarp:{} was disconnected: {}", options_.name, why));
  }

  void attend(rpc::Visitor& visitor) {
    try {
      rpc::Stream& stream = visitor.stream();
      Inbox in(&stream, options_.limits.message_bytes);
      in.begin(in_time());
      const std::uint8_t* head = in.peek(kMarkSize);
      const std::string_view text(reinterpret_cast<const char*>(head), kMarkSize);
      if (text == "CONNACK " || text == "CONNECT ") {
        const bool confirms = text == "CONNACK ";
        (void)in.take(kMarkSize);
        return talk(visitor, in, confirms);
      }
      std::int32_t number = 0;
      std::copy_n(head + 2, 4, reinterpret_cast<std::uint8_t*>(&number));
      if (text.starts_with("YA") && text.ends_with("RP") && (number == kTcpMark || number == kFastTcpMark)) {
        (void)in.take(kMarkSize);
        return exchange(visitor, in, number == kTcpMark);
      }
      const std::string shown = carrier_shown(head);
      (void)stream.send_now(reinterpret_cast<const std::uint8_t*>(kNotFound.data()), kNotFound.size());
      complain(fmt::format("it speaks the carrier {}; tcp, fast_tcp, text and text_ack are spoken here", shown));
    } catch (const Broken& e) {
      // Gone between messages, as peers do; tools reset their connections.
      if (e.status != StreamStatus::kClosed) complain(e.why);
    } catch (const std::exception& e) {
      complain(e.what());
    }
  }

  // ---- tcp and fast_tcp

  void exchange(rpc::Visitor& visitor, Inbox& in, bool confirm) {
    const std::int32_t length = in.take_int();
    if (length < 1 || static_cast<std::size_t>(length) > kNameMax + 1)
      throw Broken{StreamStatus::kFailed, fmt::format("its name would have {} octets", length)};
    std::string name(reinterpret_cast<const char*>(in.take(static_cast<std::size_t>(length))),
                     static_cast<std::size_t>(length));
    // Behind a blank stand the modifiers of the connection, which are the sender's own matter.
    name.resize(std::min({name.find('\0'), name.find(' '), name.size()}));
    if (name.starts_with('"')) name.erase(0, 1);
    std::vector<std::uint8_t> out;
    put_mark(out, at_.port);
    rpc::Stream& stream = visitor.stream();
    // Before the answer, so that the order of connections is that in which their senders see them.
    const Input input(*this, name, confirm ? "tcp" : "fast_tcp", stream);
    if (stream.send(out.data(), out.size(), in_time()) != StreamStatus::kOk) return;
    while (!stopping_.load()) {
      visitor.idle();
      if (in.wait(rpc::kNoDeadline) != StreamStatus::kOk) return;
      visitor.busy();
      in.begin(in_time());
      const Frame frame = take_frame(in, options_.limits.message_bytes);
      messages_.fetch_add(1, std::memory_order_relaxed);
      if (!take(frame, in, stream, confirm)) return;
    }
  }

  // False: the connection ends.
  bool take(const Frame& frame, Inbox& in, rpc::Stream& stream, bool confirm) {
    char key = frame.key;
    bool with_reply = key == 'd';
    if (key == '\0' && !frame.command.empty()) {
      key = frame.command[0];
      with_reply = key == 'd' && !frame.command.starts_with("do");
    }
    std::vector<std::uint8_t> out;
    if (key == 'd' || key == 'D') {
      if (role_.service != nullptr) return call(frame.payload, in, stream, confirm, with_reply);
      take_data(frame.payload, in);
    } else if (key == 'a') {
      (void)in.peek(frame.payload);
      const std::size_t end = in.position() + frame.payload;
      in.fence(end);
      std::vector<Item> answer = unknown();
      try {
        answer = administer(read_bottle(in, options_.version));
      } catch (const Broken& e) {
        tell_unread(fmt::format("an administrative message for yarp:{} cannot be read: {}", options_.name, e.why));
      }
      in.lift_fence();
      in.seek(end);
      write_bottle(out, answer, options_.version);
    } else {
      (void)in.take(frame.payload);
    }
    if (confirm) put_mark(out, kAckMark);
    if (!out.empty() && stream.send(out.data(), out.size(), in_time()) != StreamStatus::kOk) return false;
    return key != 'q';
  }

  void take_data(std::size_t bytes, Inbox& in) {
    if (role_.take == nullptr) {
      (void)in.peek(bytes);
      const std::size_t end = in.position() + bytes;
      in.fence(end);
      std::optional<std::vector<Item>> items;
      try {
        if (role_.print) items = read_bottle(in, options_.version);
      } catch (const Broken& e) {
        // The octets are all there: what follows can be read.
        tell_unread(fmt::format("data {} cannot be read: {}", whose_data(), e.why));
      }
      in.lift_fence();
      in.seek(end);
      if (items) role_.print(to_text(*items));
      return;
    }
    const std::size_t begin = in.position();
    Encoding::Call got = encoding_.read_call(in, bytes, *role_.interface, role_.only);
    if (got.method != nullptr && conform(*got.method, got.arguments))
      return role_.take(*got.method, std::move(got.arguments));
    tell_unread(fmt::format("data {} are none of {}{}{}", whose_data(), role_.interface->name,
                            got.asked.empty() ? "" : fmt::format(" (\"{}\")", got.asked), what_came(in, begin)));
  }

  // Behind data that have been read and are of no method: what they are, and what they should be.
  std::string what_came(Inbox& in, std::size_t begin) const {
    const std::size_t end = in.position();
    std::string came;
    in.seek(begin);
    in.fence(end);
    try {
      constexpr std::size_t kShownMax = 100;
      came = to_text(read_bottle(in, options_.version));
      if (came.size() > kShownMax) came = came.substr(0, kShownMax) + "…";
    } catch (const Broken&) {
      came = "octets that are no bottle";
    }
    in.lift_fence();
    in.seek(end);
    std::string due;
    for (const idl::Method* method : role_.interface->methods) {
      if (role_.only != nullptr && method != role_.only) continue;
      due += due.empty() ? "" : " or ";
      if (role_.only == nullptr) due += method->name + " and ";
      std::string fields;
      for (const idl::Field& field : method->arguments.fields)
        fields += fmt::format("{}{} {}", fields.empty() ? "" : ", ", field.type->name, field.name);
      due += fmt::format("({})", fields);
    }
    return fmt::format(": {} came, where {} is due", came.empty() ? "nothing" : came, due);
  }

  std::string whose_data() const { return role_.source.empty() ? "for yarp:" + options_.name : "of " + role_.source; }

  // Whoever writes what cannot be read may do so a thousand times a second.
  void tell_unread(const std::string& what) {
    constexpr std::uint64_t kToldMax = 10;
    const std::uint64_t before = peer_errors_.fetch_add(1);
    if (options_.on_peer_error && before < kToldMax)
      options_.on_peer_error(what + (before + 1 == kToldMax ? "; what follows is not told" : ""));
  }

  static bool conform(const idl::Method& method, Value& arguments) {
    if (idl::conforms_arguments(method, arguments)) return true;
    auto conformed = idl::conform_arguments(method, std::move(arguments));
    if (!conformed) return false;
    arguments = std::move(*conformed);
    return true;
  }

  bool call(std::size_t bytes, Inbox& in, rpc::Stream& stream, bool confirm, bool with_reply) {
    const idl::Service& interface = role_.service->interface();
    Encoding::Call got = encoding_.read_call(in, bytes, interface);
    if (got.method != nullptr && (cannot_carry(*got.method) || !conform(*got.method, got.arguments))) {
      got.wrong_arguments = true;
      got.method = nullptr;
    }
    if (got.method == nullptr) return answer_no_call(got, stream, confirm, with_reply);
    const auto answer = std::make_shared<Answer>(stream, encoding_, *got.method, confirm, with_reply);
    try {
      role_.service->serve(*got.method, got.arguments, rpc::Reply([answer](rpc::Outcome outcome, bool is_last) {
        answer->give(std::move(outcome), is_last);
      }));
    } catch (const std::exception& e) {
      answer->give(tl::unexpected(rpc::CallError{rpc::CallErrorKind::kProtocol, e.what(), {}, {}}), false);
    }
    if (answer->await(options_.message_time_max, stopping_)) return true;
    if (const std::string why = answer->why(); !why.empty())
      complain(fmt::format("{} has no result to send: {}", got.method->name, why));
    return false;
  }

  bool answer_no_call(const Encoding::Call& got, rpc::Stream& stream, bool confirm, bool with_reply) {
    const idl::Service& interface = role_.service->interface();
    std::vector<std::uint8_t> out;
    if (got.asked == "help") {
      std::vector<std::string> lines = interface.method_names();
      lines.insert(lines.begin(), "*** Available commands:");
      lines.emplace_back("help");
      write_many(out, lines);
    } else if (const idl::Method* method =
                   got.asked.starts_with("help ") ? interface.find(got.asked.substr(5)) : nullptr) {
      write_many(out, {idl::signature(*method)});
    } else if (got.asked == kVersionQuestion && options_.version == Version::kYarp4) {
      write_yarp4(out);
    } else {
      // Where the method exists, its caller waits for its result; [fail] is read as one of a bool, or as nothing.
      const idl::Method* meant = got.wrong_arguments ? interface.find(got.asked) : nullptr;
      const bool takes_fail =
          meant != nullptr && (meant->result->kind == idl::Kind::kBool || meant->result->kind == idl::Kind::kVoid);
      if (got.wrong_arguments && with_reply && !takes_fail) {
        complain(fmt::format("it called \"{}\" of {} with other arguments than that has", got.asked, interface.name));
        return false;
      }
      write_fail(out);
    }
    if (!with_reply) out.clear();
    if (confirm) put_mark(out, kAckMark);
    return stream.send(out.data(), out.size(), in_time()) == StreamStatus::kOk;
  }

  // ---- text and text_ack

  void talk(rpc::Visitor& visitor, Inbox& in, bool confirms) {
    rpc::Stream& stream = visitor.stream();
    const std::string name = in.line(kNameMax + 2);
    const auto say = [&](const std::string& text) {
      return stream.send(reinterpret_cast<const std::uint8_t*>(text.data()), text.size(), in_time()) ==
             StreamStatus::kOk;
    };
    const Input input(*this, name, confirms ? "text_ack" : "text", stream);
    if (!say(fmt::format("Welcome {}\r\n", name))) return;
    while (!stopping_.load()) {
      visitor.idle();
      if (in.wait(rpc::kNoDeadline) != StreamStatus::kOk) return;
      visitor.busy();
      in.begin(in_time());
      const std::string line = in.line(kLineMax);
      if (line == "q") {
        if (confirms) (void)say("<ACK>\r\n");
        return;
      }
      std::string answer;
      if (line == "*") {
        answer = describe();
      } else if (line == "a" || line == "d") {
        const std::string text = in.line(kLineMax);
        if (line == "a") {
          const auto request = parse_text(text);
          answer = to_text(request ? administer(*request) : unknown()) + "\r\n";
        } else if (role_.service != nullptr) {
          answer = "[fail]\r\n";
        } else {
          take_text(text);
        }
      } else if (line.starts_with('/') || line.starts_with("!/") || line.starts_with("~/")) {
        answer = rewire(line);
      } else if (line == "?") {
        answer =
            "This is a YARP port. Here are the commands it responds to:\r\n"
            "*       Gives a description of this port\r\n"
            "d       Signals the beginning of input for the port's owner\r\n"
            "q       Disconnects\r\n"
            "a       Signals the beginning of an administrative message\r\n"
            "?       Gives this help\r\n";
      } else if (!line.empty()) {
        answer = "Port command not understood.\r\nType d to send data to the port's owner.\r\nType ? for help.\r\n";
      }
      if (confirms && !say(answer + "<ACK>\r\n")) return;
    }
  }

  // A line typed into `yarp write`.
  void take_text(const std::string& text) {
    const auto items = parse_text(text);
    if (!items) return;
    std::vector<std::uint8_t> bytes;
    write_bottle(bytes, *items, options_.version);
    Inbox in(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
    take_data(bytes.size(), in);
  }

  std::string describe() {
    std::string out = fmt::format("This is {} at tcp://{}/\r\n", options_.name, to_string(at_));
    const std::lock_guard lock(mutex_);
    drop_outputs_over();
    for (const auto& output : outputs_) {
      out += fmt::format("There is an output connection from {} to {} using {}\r\n", options_.name, output->to(),
                         to_string(output->carrier()));
    }
    if (outputs_.empty()) out += "There are no outgoing connections\r\n";
    for (const Input* input : inputs_) {
      out += fmt::format("There is an input connection from {} to {} using {}\r\n", input->from, options_.name,
                         input->carrier);
    }
    if (inputs_.empty()) out += "There are no incoming connections\r\n";
    return out;
  }

  std::string rewire(const std::string& line) {
    if (line.starts_with('/')) {
      const auto added = add_output(line, Carrier::kTcp);
      return (added ? fmt::format("Added connection from {} to {}", options_.name, line) : added.error().message) +
             "\r\n";
    }
    return remove(line.substr(1)).second;
  }

  // With true: there was such a connection.
  std::pair<bool, std::string> remove(const std::string& other) {
    std::list<std::unique_ptr<Output>> gone;  // ends without the lock
    const std::lock_guard lock(mutex_);
    for (auto output = outputs_.begin(); output != outputs_.end(); ++output) {
      if ((*output)->to() != other) continue;
      gone.splice(gone.end(), outputs_, output);
      return {true, fmt::format("Removing connection from {} to {}\r\n", options_.name, other)};
    }
    bool found = false;
    for (Input* input : inputs_) {
      if (input->from != other) continue;
      input->stream.shut_down();
      found = true;
    }
    if (found) return {true, fmt::format("Removing connection from {} to {}\r\n", other, options_.name)};
    return {
        false,
        fmt::format("Could not find an outgoing connection to {}\r\nCould not find an incoming connection from {}\r\n",
                    other, other)};
  }

  static std::vector<Item> unknown() {
    return {Item::word("fail"), Item::of("send [help] for list of valid commands")};
  }

  // With one slash in front, whatever it was written with: "tcp://y" is port /y, "fast_tcp://y" by that carrier.
  static std::string port_of(const std::string& text, std::string& carrier) {
    const auto mark = text.find("://");
    if (mark == std::string::npos) return text.starts_with('/') ? text : "/" + text;
    carrier = text.substr(0, mark);
    return text.substr(mark + 2);
  }

  std::vector<Item> administer(const std::vector<Item>& request) {
    const auto is = [&](std::size_t i, std::string_view word) {
      return i < request.size() &&
             (request[i].is_word(word) || (request[i].form == Item::Form::kText && request[i].text == word));
    };
    const auto text = [&](std::size_t i) {
      return i < request.size() && request[i].form == Item::Form::kText ? request[i].text : std::string();
    };
    if (is(0, "ver")) return {Item::word("ver"), Item::of(1), Item::of(2), Item::of(3)};
    if (is(0, "list")) return list(is(1, "out"), is(1, "in"), text(2));
    if (is(0, "add")) {
      std::string carrier = text(2).empty() ? "tcp" : text(2);
      const std::string to = port_of(text(1), carrier);
      if (carrier != "tcp" && carrier != "fast_tcp") {
        return {Item::of(-1), Item::of(fmt::format("The carrier {} is not spoken by {}\r\n", carrier, options_.name))};
      }
      const auto added = add_output(to, carrier == "tcp" ? Carrier::kTcp : Carrier::kFastTcp);
      if (added)
        return {Item::of(0), Item::of(fmt::format("Added connection from {} to {}\r\n", options_.name, text(1)))};
      return {Item::of(-1), Item::of(added.error().message + "\r\n")};
    }
    if (is(0, "del")) {
      std::string carrier;
      auto [found, answer] = remove(port_of(text(1), carrier));
      return {Item::of(found ? 0 : -1), Item::of(std::move(answer))};
    }
    if (is(0, "prop")) return property(is(1, "set"), text(2), request.size() > 3 ? request[3] : Item());
    if (is(0, "atch") || is(0, "dtch"))
      return {Item::word("fail"),
              Item::of("Portmonitor carrier modifier cannot be find or it is not enabled in YARP!")};
    if (is(0, "help")) {
      return {Item::word("many"),
              Item::of("[help]  # give this help"),
              Item::of("[ver]  # report protocol version"),
              Item::of("[add] $portname  # add an output connection"),
              Item::of("[del] $portname  # remove a connection"),
              Item::of("[list] [in]  # list input connections"),
              Item::of("[list] [out]  # list output connections"),
              Item::of("[prop] [get] $key  # a property of the port"),
              Item::of("[prop] [set] $key $val  # set a property of the port")};
    }
    return unknown();
  }

  std::vector<Item> list(bool out, bool in, const std::string& which) {
    const std::lock_guard lock(mutex_);
    drop_outputs_over();
    std::vector<Item> answer;
    const auto tell = [&](const std::string& from, const std::string& to, const std::string& carrier,
                          const std::string& other) {
      if (which.empty()) return answer.push_back(Item::of(other));
      if (which != other) return;
      answer = {Item::list({Item::of("from"), Item::of(from)}), Item::list({Item::of("to"), Item::of(to)}),
                Item::list({Item::of("carrier"), Item::of(carrier)})};
    };
    if (!in) {
      for (const auto& output : outputs_)
        tell(options_.name, output->to(), std::string(to_string(output->carrier())), output->to());
    }
    if (!out && in) {
      for (const Input* input : inputs_) tell(input->from, options_.name, input->carrier, input->from);
    }
    return answer;
  }

  std::vector<Item> property(bool set, const std::string& key, const Item& value) {
    const auto pair = [](std::string name, Item item) {
      return Item::list({Item::of(std::move(name)), std::move(item)});
    };
    const std::lock_guard lock(mutex_);
    if (set) {
      std::erase_if(properties_, [&](const auto& known) { return known.first == key; });
      if (properties_.size() >= kPropertiesMax) return {Item::word("fail")};
      properties_.emplace_back(key, value);
      return {Item::word("ok")};
    }
    const bool is_rpc = role_.service != nullptr;
    if (key == options_.name) {
      return {pair("sched", Item::list({pair("policy", Item::of(0)), pair("priority", Item::of(0)),
                                        pair("tid", Item::of(::getpid()))})),
              pair("process", Item::list({pair("arguments", Item::of("sentree")), pair("name", Item::of("sentree")),
                                          pair("pid", Item::of(::getpid())), pair("policy", Item::of(0)),
                                          pair("priority", Item::of(0))})),
              pair("platform", Item::list({pair("hostname", Item::of(at_.host)), pair("os", Item::of("Linux"))})),
              pair("port", Item::list({pair("is_input", Item::of(is_rpc || role_.take || role_.print ? 1 : 0)),
                                       pair("is_output", Item::of(role_.sends ? 1 : 0)),
                                       pair("is_rpc", Item::of(is_rpc ? 1 : 0)), pair("type", Item::of(""))}))};
    }
    for (const auto& [name, known] : properties_) {
      if (name == key) return {known};
    }
    return {};
  }

  // With the lock held.
  void drop_outputs_over() {
    outputs_.remove_if([](const auto& output) { return output->is_over(); });
  }

  const PortOptions options_;
  const PortRole role_;
  const Encoding encoding_;
  HostPort at_;
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint64_t> messages_{0};
  std::atomic<std::uint64_t> peer_errors_{0};
  std::mutex mutex_;  // of what follows
  std::list<Input*> inputs_;
  std::list<std::unique_ptr<Output>> outputs_;
  std::vector<std::pair<std::string, Item>> properties_;
  std::uint64_t lost_ = 0;
  std::atomic<bool> told_full_{false};
  std::unique_ptr<rpc::Acceptor> acceptor_;  // last: its threads use the others
};

Port::Port(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Port::~Port() = default;

Result<std::unique_ptr<Port>> Port::open(PortOptions options, PortRole role) {
  auto impl = std::make_unique<Impl>(std::move(options), std::move(role));
  if (auto started = impl->start(); !started) return tl::unexpected(std::move(started.error()));
  return std::unique_ptr<Port>(new Port(std::move(impl)));
}

const std::string& Port::name() const { return impl_->options().name; }
const HostPort& Port::at() const { return impl_->at(); }
void Port::write(const idl::Method& method, const Value& arguments, bool with_name) {
  impl_->write(method, arguments, with_name);
}
Result<void> Port::add_output(const std::string& to, Carrier carrier) { return impl_->add_output(to, carrier); }
std::vector<std::string> Port::outputs() const { return impl_->outputs(); }
std::vector<std::string> Port::inputs() const { return impl_->inputs(); }
PortCounters Port::counters() const { return impl_->counters(); }
void Port::stop() { impl_->stop(); }

}  // namespace sentree::yarp
