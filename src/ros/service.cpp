#include "sentree/ros/detail/service.h"

#include <fmt/format.h>

#include <algorithm>
#include <random>

#include "sentree/ros/detail/cdr.h"

namespace sentree::ros {
namespace {

using SteadyClock = std::chrono::steady_clock;

// rmw_cyclonedds writes who asks into the message: the client's number and the request's.
constexpr std::size_t kIdentity = 16;
// How long a reply waits for the asker's reader to be discovered; afterwards it would reach nobody.
constexpr std::chrono::milliseconds kMatchMax{100};
constexpr std::size_t kListenersMax = 256;
// How often who waits for a server looks by itself.
constexpr std::chrono::milliseconds kLookForServer{100};

void put(std::vector<std::uint8_t>& out, std::uint64_t number) {
  for (int i = 0; i < 8; ++i) out.push_back(static_cast<std::uint8_t>(number >> (8 * i)));
}

std::string user_data(const char* key, std::uint64_t id) {
  static const char* const kDigits = "0123456789abcdef";
  std::string out = fmt::format("{}=", key);
  for (int i = 0; i < 16; ++i) {
    const auto octet = static_cast<unsigned>(i < 8 ? id >> (8 * i) & 0xffU : 0);
    if (i > 0) out += '.';
    if (octet >= 16) out += kDigits[octet >> 4U];
    out += kDigits[octet & 15U];
  }
  return out + ";";
}

bool has_prefix(const std::vector<dds::Guid>& all, const dds::Guid& guid) {
  return std::any_of(all.begin(), all.end(),
                     [&](const dds::Guid& each) { return std::equal(each.begin(), each.begin() + 12, guid.begin()); });
}

dds::Channel request_channel(const ServiceName& s, std::string data) {
  return {fmt::format("rq{}Request", s.name), s.request_type, {}, std::move(data)};
}
dds::Channel reply_channel(const ServiceName& s, std::string data) {
  return {fmt::format("rr{}Reply", s.name), s.reply_type, {}, std::move(data)};
}

}  // namespace

Result<std::shared_ptr<ServiceClient>> ServiceClient::of(const std::shared_ptr<Node>& node,
                                                         const ServiceName& service) {
  return node->shared<ServiceClient>(fmt::format("client {} {}", service.name, service.request_type),
                                     [&] { return make(node, service); });
}

Result<std::shared_ptr<ServiceClient>> ServiceClient::make(const std::shared_ptr<Node>& node,
                                                           const ServiceName& service) {
  auto out = std::make_shared<ServiceClient>();
  std::random_device random;
  out->id_ = static_cast<std::uint64_t>(random()) << 32U | random();
  const std::string data = user_data("clientid", out->id_);
  // They go with the client, before anything of it.
  ServiceClient* const client = out.get();
  const auto changed = [client](const std::string&) { client->wake(); };
  auto reader = node->read(
      reply_channel(service, data), [client](dds::Sample sample) { client->take_reply(std::move(sample)); }, changed);
  if (!reader) return tl::unexpected(std::move(reader.error()));
  auto writer = node->write(request_channel(service, data), changed);
  if (!writer) return tl::unexpected(std::move(writer.error()));
  {
    const std::lock_guard lock(client->mutex_);
    client->reader_ = std::move(*reader);
    client->writer_ = std::move(*writer);
  }
  client->wake();
  return out;
}

bool ServiceClient::is_available_now() const {
  if (reader_ == nullptr || writer_ == nullptr) return false;
  const std::vector<dds::Guid> answering = reader_->reader()->matched();
  const std::vector<dds::Guid> asked = writer_->writer()->matched();
  return std::any_of(asked.begin(), asked.end(), [&](const dds::Guid& each) { return has_prefix(answering, each); });
}
bool ServiceClient::is_available() const {
  const std::lock_guard lock(mutex_);
  return is_available_now();
}

bool ServiceClient::wait_available(rpc::Deadline deadline, const std::function<bool()>& interrupted) {
  std::unique_lock lock(mutex_);
  const auto over = [&] { return is_available_now() || interrupted(); };
  // A server may become ready by the time that has passed, of which nobody tells.
  while (!over() && SteadyClock::now() < deadline)
    changed_.wait_until(lock, std::min(deadline, SteadyClock::now() + kLookForServer), over);
  return is_available_now() && !interrupted();
}

std::optional<ServiceClient::Key> ServiceClient::send(const Octets& request) {
  const std::vector<dds::Guid> servers = writer_->writer()->matched();
  if (servers.empty()) return std::nullopt;
  if (std::all_of(servers.begin(), servers.end(), dds::is_cyclone)) {
    std::int64_t number = 0;
    {
      const std::lock_guard lock(mutex_);
      number = ++last_;
    }
    Octets marked(request.begin(), request.begin() + kEncapsulation);
    put(marked, id_);
    put(marked, static_cast<std::uint64_t>(number));
    marked.insert(marked.end(), request.begin() + kEncapsulation, request.end());
    if (writer_->writer()->write(marked, nullptr) == 0) return std::nullopt;
    return Key{true, number};
  }
  const dds::SampleId from{reader_->guid(), -(std::int64_t{1} << 32)};
  const std::int64_t number = writer_->writer()->write(request, &from);
  if (number == 0) return std::nullopt;
  return Key{false, number};
}

void ServiceClient::take_reply(dds::Sample sample) {
  Key key;
  {
    const std::lock_guard lock(mutex_);
    if (reader_ == nullptr || writer_ == nullptr) return;
    if (sample.related.is_known()) {
      if (sample.related.writer != reader_->guid() && sample.related.writer != writer_->guid()) return;
      key = {false, sample.related.sequence};
    } else {
      if (sample.octets.size() < kEncapsulation + kIdentity) return;
      const auto number = [&](std::size_t at) {
        std::uint64_t out = 0;
        const bool little = sample.octets[1] == 1;
        for (std::size_t i = 0; i < 8; ++i)
          out |= static_cast<std::uint64_t>(sample.octets[kEncapsulation + at + i]) << (8 * (little ? i : 7 - i));
        return out;
      };
      if (number(0) != id_) return;
      key = {true, static_cast<std::int64_t>(number(8))};
      sample.octets.erase(sample.octets.begin() + kEncapsulation, sample.octets.begin() + kEncapsulation + kIdentity);
    }
    if (replies_.size() >= kRepliesMax) replies_.pop_front();
    replies_.emplace_back(key, std::move(sample.octets));
  }
  wake();
}

std::optional<ServiceClient::Octets> ServiceClient::take(const Key& key) {
  const std::lock_guard lock(mutex_);
  const auto found =
      std::find_if(replies_.begin(), replies_.end(), [&](const auto& each) { return each.first == key; });
  if (found == replies_.end()) return std::nullopt;
  Octets out = std::move(found->second);
  replies_.erase(found);
  return out;
}

std::optional<ServiceClient::Octets> ServiceClient::wait(const Key& key, rpc::Deadline deadline,
                                                         const std::function<bool()>& interrupted) {
  std::unique_lock lock(mutex_);
  const auto there = [&] {
    return std::any_of(replies_.begin(), replies_.end(), [&](const auto& each) { return each.first == key; });
  };
  changed_.wait_until(lock, std::min(deadline, SteadyClock::now() + std::chrono::hours(1)),
                      [&] { return there() || interrupted() || !is_available_now(); });
  lock.unlock();
  return take(key);
}

void ServiceClient::wake() {
  std::vector<std::weak_ptr<std::function<void()>>> listeners;
  {
    const std::lock_guard lock(mutex_);
    listeners = listeners_;
  }
  changed_.notify_all();
  for (const auto& each : listeners) {
    if (const auto listener = each.lock()) (*listener)();
  }
}

void ServiceClient::also_tell(std::weak_ptr<std::function<void()>> listener) {
  const std::lock_guard lock(mutex_);
  std::erase_if(listeners_, [](const auto& each) { return each.expired(); });
  if (listeners_.size() < kListenersMax) listeners_.push_back(std::move(listener));
}

struct ServiceServer::Shared {
  std::mutex mutex;
  std::condition_variable matched;
  bool closed = false;
  std::shared_ptr<Told> writer;

  // Waits a little for who asked to be discovered.
  void await(const std::function<bool(const std::vector<dds::Guid>&)>& is_there) {
    std::unique_lock lock(mutex);
    matched.wait_until(lock, SteadyClock::now() + kMatchMax,
                       [&] { return closed || writer == nullptr || is_there(writer->writer()->matched()); });
  }
  // Without the lock: DDS may be telling of a reader with locks of its own.
  void write(const std::vector<std::uint8_t>& octets, const dds::SampleId* related) {
    std::shared_ptr<Told> to;
    {
      const std::lock_guard lock(mutex);
      to = writer;
    }
    if (to != nullptr) static_cast<void>(to->writer()->write(octets, related));
  }
  void changed() {
    { const std::lock_guard lock(mutex); }
    matched.notify_all();
  }
};

Result<std::unique_ptr<ServiceServer>> ServiceServer::open(const std::shared_ptr<Node>& node,
                                                           const ServiceName& service, Worker& worker, Handle handle,
                                                           Problem problem) {
  std::random_device random;
  const std::string data = user_data("serviceid", static_cast<std::uint64_t>(random()) << 32U | random());
  auto shared = std::make_shared<Shared>();
  auto writer = node->write(reply_channel(service, data), [weak = std::weak_ptr(shared)](const std::string&) {
    if (const auto there = weak.lock()) there->changed();
  });
  if (!writer) return tl::unexpected(std::move(writer.error()));
  shared->writer = std::move(*writer);
  std::unique_ptr<ServiceServer> out(new ServiceServer(shared));

  const auto serve = [shared, handle = std::move(handle)](dds::Sample sample) {
    if (sample.octets.size() < kEncapsulation) return;
    if (dds::is_cyclone(sample.id.writer)) {
      if (sample.octets.size() < kEncapsulation + kIdentity) return;
      const auto body = sample.octets.begin() + kEncapsulation;
      const std::vector<std::uint8_t> identity(body, body + kIdentity);
      const std::uint8_t order = sample.octets[1];
      sample.octets.erase(body, body + kIdentity);
      shared->await([&](const auto& readers) { return has_prefix(readers, sample.id.writer); });
      handle(std::move(sample.octets), [shared, identity, order](const std::vector<std::uint8_t>& reply) {
        std::vector<std::uint8_t> marked(reply.begin(), reply.begin() + kEncapsulation);
        // The numbers have the byte order of the message that they stand in.
        if (order == 1) {
          marked.insert(marked.end(), identity.begin(), identity.end());
        } else {
          marked.insert(marked.end(), identity.rbegin() + 8, identity.rend());
          marked.insert(marked.end(), identity.rbegin(), identity.rbegin() + 8);
        }
        marked.insert(marked.end(), reply.begin() + kEncapsulation, reply.end());
        shared->write(marked, nullptr);
      });
      return;
    }
    const dds::SampleId to{sample.related.is_known() ? sample.related.writer : sample.id.writer, sample.id.sequence};
    shared->await([&](const auto& readers) {
      return sample.related.is_known() ? std::find(readers.begin(), readers.end(), to.writer) != readers.end()
                                       : has_prefix(readers, to.writer);
    });
    handle(std::move(sample.octets),
           [shared, to](const std::vector<std::uint8_t>& reply) { shared->write(reply, &to); });
  };
  auto on_change = [problem](const std::string& what) {
    if (!what.empty() && problem) problem(what);
  };
  auto reader = node->read(
      request_channel(service, data),
      [serve, &worker, problem = std::move(problem), name = service.name](dds::Sample sample) {
        auto kept = std::make_shared<dds::Sample>(std::move(sample));
        if (!worker.post([serve, kept] { serve(std::move(*kept)); }) && problem)
          problem(name + " gets more requests than it answers: the oldest is dropped");
      },
      std::move(on_change));
  if (!reader) return tl::unexpected(std::move(reader.error()));
  out->reader_ = std::move(*reader);
  return out;
}

ServiceServer::~ServiceServer() {
  reader_.reset();
  std::shared_ptr<Told> writer;
  {
    const std::lock_guard lock(shared_->mutex);
    shared_->closed = true;
    writer = std::move(shared_->writer);
  }
  shared_->matched.notify_all();
}

}  // namespace sentree::ros
