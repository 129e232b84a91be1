#include "sentree/yarp/detail/output.h"

#include <fmt/format.h>

#include <system_error>
#include <utility>

#include "sentree/yarp/detail/frame.h"
#include "sentree/yarp/detail/port.h"

namespace sentree::yarp {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr milliseconds kConnectTime{2000};
// A receiver that neither takes nor confirms a message for this long is given up.
constexpr milliseconds kSendTime{5000};
constexpr std::size_t kWelcomeMax = 4096;

}  // namespace

Result<std::unique_ptr<rpc::Stream>> connect_socket(const HostPort& at, rpc::Deadline deadline) {
  rpc::Address address;
  address.kind = rpc::Address::Kind::kTcp;
  address.host = at.host;
  address.port = at.port;
  rpc::Resolver resolver;
  rpc::Connected made = rpc::connect_to(address, resolver, nullptr, deadline);
  if (made.stream == nullptr)
    return fail("yarp.connect", fmt::format("nobody listens at {}: {}", to_string(at), made.why));
  return std::move(made.stream);
}

Result<std::unique_ptr<Output>> Output::open(const std::string& from, const std::string& to, const HostPort& at,
                                             Carrier carrier) {
  const auto deadline = steady_clock::now() + kConnectTime;
  auto stream = connect_socket(at, deadline);
  if (!stream) return tl::unexpected(std::move(stream.error()));
  std::vector<std::uint8_t> greeting;
  put_greeting(greeting, carrier, from);
  std::unique_ptr<Output> out(new Output(to, carrier, std::move(*stream)));
  if (out->stream_->send(greeting.data(), greeting.size(), deadline) != rpc::StreamStatus::kOk)
    return fail("yarp.connect", fmt::format("{} takes no connection: {}", to, out->stream_->why()));
  try {
    out->in_.begin(deadline);
    (void)take_mark(out->in_, "the answer of a port of YARP");
    out->thread_ = std::thread([output = out.get()] { output->run(); });
  } catch (const Broken& e) {
    return fail("yarp.connect", fmt::format("{} takes no connection: {}", to, e.why));
  } catch (const std::system_error& e) {
    return fail("yarp.connect", std::string("no thread is left for a connection: ") + e.what());
  }
  return out;
}

Output::Output(std::string to, Carrier carrier, std::unique_ptr<rpc::Stream> stream)
    : to_(std::move(to)), carrier_(carrier), stream_(std::move(stream)), in_(stream_.get(), kWelcomeMax) {}

Output::~Output() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
    if (!over_.load() && waiting_.empty()) {
      // In order, as a port of YARP does; whoever does not take it at once finds the connection closed.
      std::vector<std::uint8_t> quit;
      finish_frame(quit, begin_frame(quit, 'q'));
      (void)stream_->send_now(quit.data(), quit.size());
    }
  }
  stream_->shut_down();
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

std::size_t Output::put(Octets message) {
  std::size_t lost = 0;
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() >= kOutputWaitingMax) {
      waiting_.pop_front();
      lost = 1;
    }
    waiting_.push_back(std::move(message));
  }
  changed_.notify_one();
  return lost;
}

void Output::run() {
  try {
    while (true) {
      Octets message;
      {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return closing_ || !waiting_.empty(); });
        if (closing_) return;
        message = std::move(waiting_.front());
        waiting_.pop_front();
      }
      const auto deadline = steady_clock::now() + kSendTime;
      if (stream_->send(message->data(), message->size(), deadline) != rpc::StreamStatus::kOk) break;
      if (carrier_ == Carrier::kFastTcp) continue;
      in_.begin(deadline);
      (void)take_mark(in_, "an acknowledgement");
    }
  } catch (const Broken&) {
    // Whoever looks next finds it over.
  }
  over_.store(true);
}

Result<std::string> ask_port(const HostPort& at, const std::string& admin_command, milliseconds patience) {
  const auto deadline = steady_clock::now() + patience;
  auto stream = connect_socket(at, deadline);
  if (!stream) return tl::unexpected(std::move(stream.error()));
  const std::string request = fmt::format("CONNACK admin\r\na\r\n{}\r\nq\r\n", admin_command);
  const auto failed = [&](const std::string& why) {
    return fail("yarp.connect",
                fmt::format("the port at {} does not answer as a port of YARP: {}", to_string(at), why));
  };
  if ((*stream)->send(reinterpret_cast<const std::uint8_t*>(request.data()), request.size(), deadline) !=
      rpc::StreamStatus::kOk)
    return failed((*stream)->why());
  try {
    Inbox in(stream->get(), rpc::Limits().message_bytes);
    in.begin(deadline);
    if (!in.line(kWelcomeMax).starts_with("Welcome")) return failed("it does not welcome");
    std::string answer;
    while (true) {
      std::string line = in.line(rpc::Limits().message_bytes);
      if (line == "<ACK>") return answer;
      answer += (answer.empty() ? "" : "\n") + line;
    }
  } catch (const Broken& e) {
    return failed(e.why);
  }
}

}  // namespace sentree::yarp
