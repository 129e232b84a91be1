#include "sentree/yarp/detail/registrar.h"

#include <fmt/format.h>

#include <utility>

namespace sentree::yarp {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr milliseconds kPatience{2000};
// A process that ends does not wait for a name server that hangs.
constexpr milliseconds kFarewell{300};

}  // namespace

Registrar::Registrar(HostPort server, std::function<void(const std::string&)> problem, milliseconds period)
    : server_(std::move(server)), problem_(std::move(problem)), period_(period), thread_([this] { run(); }) {}

Registrar::~Registrar() { stop(); }

Result<void> Registrar::add(const std::string& name, const HostPort& at) {
  NameClient names(server_);
  auto entered = names.enter(name, at, steady_clock::now() + kPatience);
  if (!entered) return tl::unexpected(std::move(entered.error()));
  const std::lock_guard lock(mutex_);
  entries_.push_back({name, at});
  return {};
}

void Registrar::also(std::function<void(NameClient&)> work) {
  const std::lock_guard lock(mutex_);
  also_ = std::move(work);
  poked_ = true;
  changed_.notify_all();
}

void Registrar::stop() {
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(stopping_, true)) return;
  }
  changed_.notify_all();
  thread_.join();
  NameClient names(server_);
  const auto deadline = steady_clock::now() + kFarewell;
  for (const Entry& entry : entries_) {
    // A name that another has taken over is his.
    if (!entry.taken) (void)names.remove(entry.name, deadline);
  }
}

void Registrar::run() {
  NameClient names(server_);
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    for (std::size_t i = 0; i < entries_.size() && !stopping_; ++i) {
      Entry entry = entries_[i];
      lock.unlock();
      const auto deadline = steady_clock::now() + kPatience;
      auto known = names.query(entry.name, deadline);
      std::string trouble;
      const bool taken = known && *known && !((*known)->at == entry.at);
      if (!known) {
        trouble = known.error().message;
      } else if (taken) {
        trouble = fmt::format("yarp:{} is registered at {} now: somebody has taken over its name", entry.name,
                              to_string((*known)->at));
      } else if (!*known) {
        if (auto entered = names.enter(entry.name, entry.at, deadline); !entered) trouble = entered.error().message;
      }
      lock.lock();
      entries_[i].taken = taken;
      if (!trouble.empty() && !entries_[i].told && problem_) problem_(trouble);
      entries_[i].told = !trouble.empty();
    }
    if (const auto work = also_; work && !stopping_) {
      lock.unlock();
      work(names);
      lock.lock();
    }
    changed_.wait_for(lock, period_, [this] { return stopping_ || poked_; });
    poked_ = false;
  }
}

}  // namespace sentree::yarp
