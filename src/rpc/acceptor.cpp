#include "sentree/rpc/acceptor.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <system_error>
#include <utility>

namespace sentree::rpc {
namespace {

using std::chrono::steady_clock;

// Without a free descriptor nothing can be accepted; the next try comes after this.
constexpr std::chrono::milliseconds kExhaustedWait{100};

std::int64_t now_ns() { return steady_clock::now().time_since_epoch().count(); }

}  // namespace

void Visitor::idle() { idle_since_ns_.store(now_ns()); }

bool Visitor::arrive() {
  Stage stage = Stage::kNew;
  return stage_.compare_exchange_strong(stage, Stage::kArrived) || stage == Stage::kArrived;
}

Acceptor::Acceptor(Listener listener, Attend attend, Options options)
    : listener_(std::make_unique<Listener>(std::move(listener))),
      attend_(std::move(attend)),
      options_(std::move(options)) {}

Acceptor::~Acceptor() {
  stop();
  for (const int fd : wake_) {
    if (fd >= 0) ::close(fd);
  }
}

Result<std::unique_ptr<Acceptor>> Acceptor::start(Listener listener, Attend attend, Options options) {
  std::unique_ptr<Acceptor> out(new Acceptor(std::move(listener), std::move(attend), std::move(options)));
  if (::pipe2(out->wake_, O_CLOEXEC | O_NONBLOCK) != 0) return fail("rpc.address", "no descriptor left for a server");
  try {
    out->thread_ = std::thread([acceptor = out.get()] { acceptor->accept_all(); });
  } catch (const std::system_error& e) {
    return fail("rpc.address", std::string("no thread left for a server: ") + e.what());
  }
  return out;
}

void Acceptor::stop() {
  stopping_.store(true);
  wake();
  if (thread_.joinable()) thread_.join();
  listener_.reset();
  {
    const std::lock_guard lock(mutex_);
    for (Visitor& v : visitors_) v.stream_->shut_down();
  }
  for (Visitor& v : visitors_) v.thread_.join();
  visitors_.clear();
}

// The thread looks up: it is to stop, or a connection has ended.
void Acceptor::wake() const {
  const char byte = 0;
  [[maybe_unused]] const auto written = ::write(wake_[1], &byte, 1);  // A full pipe wakes as well.
}

void Acceptor::accept_all() {
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
      if (options_.on_refused) options_.on_refused();
      continue;
    }
    connections_.fetch_add(1);
    welcome(std::move(socket));
  }
}

void Acceptor::reap() {
  const std::lock_guard lock(mutex_);
  for (auto v = visitors_.begin(); v != visitors_.end();) {
    if (v->done_.load()) {
      v->thread_.join();
      v = visitors_.erase(v);
    } else {
      ++v;
    }
  }
}

// At the bound, a newcomer has to go, or else the connection on which nothing has come for longest, if that is long
// enough.
bool Acceptor::make_room() {
  Visitor* leaving = nullptr;
  {
    const std::lock_guard lock(mutex_);
    const auto newcomers = static_cast<std::size_t>(std::count_if(
        visitors_.begin(), visitors_.end(), [](const Visitor& v) { return v.stage_.load() == Visitor::Stage::kNew; }));
    const bool is_full = visitors_.size() >= options_.connections_max;
    if (!is_full && (options_.newcomers_max == 0 || newcomers < options_.newcomers_max)) return true;
    leaving = oldest_newcomer();
    if (leaving == nullptr) {
      if (!is_full) return true;  // they have arrived meanwhile
      leaving = longest_idle();
    }
    if (leaving == nullptr) return false;
    leaving->stream_->shut_down();
  }
  leaving->thread_.join();
  const std::lock_guard lock(mutex_);
  visitors_.remove_if([&](const Visitor& v) { return &v == leaving; });
  return true;
}

// It is one no more. Null: there is none.
Visitor* Acceptor::oldest_newcomer() {
  for (Visitor& v : visitors_) {
    auto stage = Visitor::Stage::kNew;
    if (v.stage_.compare_exchange_strong(stage, Visitor::Stage::kGone)) return &v;
  }
  return nullptr;
}

// Null: none for long enough.
Visitor* Acceptor::longest_idle() {
  Visitor* oldest = nullptr;
  for (Visitor& v : visitors_) {
    const std::int64_t since = v.idle_since_ns_.load();
    if (since != 0 && (oldest == nullptr || since < oldest->idle_since_ns_.load())) oldest = &v;
  }
  const std::int64_t limit = std::chrono::nanoseconds(options_.idle_before_eviction).count();
  return oldest == nullptr || now_ns() - oldest->idle_since_ns_.load() < limit ? nullptr : oldest;
}

void Acceptor::welcome(Descriptor socket) {
  const std::lock_guard lock(mutex_);
  Visitor& v = visitors_.emplace_back();
  v.idle();
  if (options_.newcomers_max == 0) (void)v.arrive();
  v.stream_ = plain_stream(std::move(socket));
  try {
    v.thread_ = std::thread([this, &v] {
      attend_(v);
      v.stream_->shut_down();
      v.done_.store(true);
      wake();  // What is left of the connection goes now, not with the next one.
    });
  } catch (const std::system_error&) {
    visitors_.pop_back();
    refused_.fetch_add(1);
  }
}

}  // namespace sentree::rpc
