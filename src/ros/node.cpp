#include "sentree/ros/detail/node.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <dlfcn.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "sentree/base/diagnostic.h"
#include "sentree/ros/detail/cdr.h"
#include "sentree/ros/detail/goal_id.h"
#include "sentree/ros/detail/mapping.h"

namespace sentree::ros {
namespace {

void put_text(std::vector<std::uint8_t>& out, const std::string& text) {
  put_number(out, static_cast<std::uint32_t>(text.size() + 1));
  out.insert(out.end(), text.begin(), text.end());
  out.push_back(0);
}

}  // namespace

std::pair<std::string, std::string> shown(const dds::Endpoint& endpoint) {
  const std::string& topic = endpoint.topic;
  const std::string type = ros_name(endpoint.type);
  if (endpoint.overhears) return {};
  const auto without = [](std::string text, std::string_view end) {
    if (text.ends_with(end)) text.resize(text.size() - end.size());
    return text;
  };
  if (topic.starts_with("rq/") && topic.ends_with("Request") && !endpoint.is_writer) {
    const std::string name = without(topic.substr(2), "Request");
    if (name.ends_with("/_action/send_goal"))
      return {without(name, "/_action/send_goal"), "action " + without(type, "_SendGoal_Request")};
    if (name.find("/_action/") != std::string::npos) return {};
    return {name, "service " + without(type, "_Request")};
  }
  if (topic.starts_with("rt/") && topic.find("/_action/") == std::string::npos)
    return {topic.substr(2), "topic " + type};
  return {};
}

std::string near_names(const Node& node, const std::string& name, const std::string& kind, const std::string& type) {
  std::set<std::string> all;
  std::set<std::string> alike;
  for (const dds::Endpoint& each : node.endpoints()) {
    const auto [other, what] = shown(each);
    // Whoever reads a topic is not who publishes it.
    if (!what.starts_with(kind + " ") || (kind == "topic" && !each.is_writer)) continue;
    all.insert(other);
    if (each.type == type) alike.insert(other);
  }
  constexpr std::size_t kShownMax = 5;
  const std::vector<std::string> names(all.begin(), all.end());
  if (std::string near = did_you_mean(name, names); !near.empty()) return near;
  if (alike.empty() || alike.size() > kShownMax) return {};
  return fmt::format("; of its type there {} {}", alike.size() > 1 ? "are" : "is", fmt::join(alike, ", "));
}

bool Settling::look(SteadyClock::time_point now, std::size_t endpoints) {
  if (std::exchange(endpoints_, endpoints) != endpoints) last_ = now;
  const auto since = now - begun_;
  if (since >= kAtMost) return true;
  return endpoints == 0 ? since >= kNobody : since >= kAtLeast && now - last_ >= kQuiet;
}

bool Worker::post(std::function<void()> work) {
  bool kept = true;
  {
    const std::lock_guard lock(mutex_);
    if (stopped_) return true;
    if (waiting_.size() >= kWaitingMax) {
      waiting_.pop_front();
      kept = false;
    }
    waiting_.push_back(std::move(work));
  }
  changed_.notify_one();
  return kept;
}

void Worker::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
    waiting_.clear();
  }
  changed_.notify_one();
  const std::lock_guard lock(join_mutex_);
  if (thread_.joinable()) thread_.join();
}

void Worker::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return stopped_ || !waiting_.empty(); });
    if (stopped_) return;
    const std::function<void()> work = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    work();
    lock.lock();
  }
}

Told::~Told() {
  const bool is_writer = writer_ != nullptr;
  reader_.reset();
  writer_.reset();
  node_->tell_of(guid_, is_writer, false);
}

Result<dds::Open> load_dds() {
  static const Result<dds::Open> loaded = []() -> Result<dds::Open> {
    std::error_code error;
    const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
    const auto file = (program.parent_path() / "../lib/sentree/libsentree_dds.so").lexically_normal();
    if (!std::filesystem::exists(file, error)) {
      return fail("rpc.address",
                  fmt::format("this build of Sentree has no ROS 2: there is no {}; install the package sentree-ros, or "
                              "libfastrtps-dev and build again",
                              file.string()));
    }
    void* const object = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (object == nullptr) {
      const char* const why = ::dlerror();
      return fail("rpc.address",
                  fmt::format("ROS 2 needs Fast DDS (Debian: libfastrtps2.9): {}", why != nullptr ? why : ""));
    }
    const auto open = reinterpret_cast<dds::Open>(::dlsym(object, dds::kOpenName));
    if (open == nullptr) return fail("rpc.address", file.string() + " is of another version of Sentree");
    return open;
  }();
  return loaded;
}

Result<std::shared_ptr<Node>> Node::of(const GraphAddress& address) {
  static std::mutex mutex;
  static std::map<dds::ParticipantOptions, std::weak_ptr<Node>> nodes;
  if (auto can_be_meant = address.check_environment(); !can_be_meant)
    return tl::unexpected(std::move(can_be_meant.error()));
  const auto open = load_dds();
  if (!open) return tl::unexpected(open.error());
  const dds::ParticipantOptions key = address.participant();
  const std::lock_guard lock(mutex);
  if (auto known = nodes[key].lock()) {
    if (known->release_ == address.release_or_environment()) return known;
    return fail("rpc.address", fmt::format("\"ros:{}\" is of another release than what is open in domain {} already, "
                                           "and all of that is one node; write the same release= everywhere",
                                           address.name, key.domain));
  }
  std::string error;
  std::unique_ptr<dds::Participant> participant((*open)(key, error));
  if (participant == nullptr) return fail("rpc.exhausted", "ROS 2: " + error);
  auto made = std::make_shared<Node>(std::move(participant), address.release_or_environment(), key.domain);
  nodes[key] = made;
  return made;
}

Node::Node(std::unique_ptr<dds::Participant> participant, Release release, std::uint32_t domain)
    : participant_(std::move(participant)), release_(release), domain_(domain), settling_(SteadyClock::now()) {
  std::string error;
  graph_ = participant_->write(
      {.topic = "ros_discovery_info",
       .type = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_",
       .qos = {.reliable = true, .transient_local = true, .depth = 1}},
      [](const std::string&) {}, error);
}

bool Node::is_settled() {
  const std::size_t there = endpoints().size();
  const std::lock_guard lock(settling_mutex_);
  return settling_.look(SteadyClock::now(), there);
}

std::string Node::other_type(const std::string& topic, const std::string& type) const {
  for (const dds::Endpoint& each : endpoints()) {
    if (each.is_writer || each.topic != topic || each.type == type) continue;
    const std::string name = ros_name(each.type);
    return fmt::format(", but somebody has {} there", name.empty() ? each.type : name);
  }
  return {};
}

Result<ToldPtr> Node::read(const dds::Channel& channel, dds::Participant::OnSample on_sample,
                           dds::Participant::OnChange on_change) {
  std::string error;
  auto reader = participant_->read(channel, std::move(on_sample), std::move(on_change), error);
  if (reader == nullptr) return fail("rpc.exhausted", "ROS 2: " + error);
  tell_of(reader->guid(), false, true);
  return ToldPtr(new Told(shared_from_this(), std::move(reader), nullptr));
}

Result<ToldPtr> Node::write(const dds::Channel& channel, dds::Participant::OnChange on_change) {
  std::string error;
  auto writer = participant_->write(channel, std::move(on_change), error);
  if (writer == nullptr) return fail("rpc.exhausted", "ROS 2: " + error);
  tell_of(writer->guid(), true, true);
  return ToldPtr(new Told(shared_from_this(), nullptr, std::move(writer)));
}

// ParticipantEntitiesInfo: what our node is made of. Without it everything works, but no node is listed.
void Node::tell_of(const dds::Guid& guid, bool is_writer, bool is_there) {
  const std::lock_guard lock(mutex_);
  std::set<dds::Guid>& own = is_writer ? writers_ : readers_;
  if (is_there)
    own.insert(guid);
  else
    own.erase(guid);
  if (graph_ == nullptr) return;
  std::vector<std::uint8_t> out;
  begin_message(out);
  const auto put_gid = [&](const dds::Guid& each) {
    out.insert(out.end(), each.begin(), each.end());
    if (release_ == Release::kHumble) out.insert(out.end(), 8, 0);
  };
  put_gid(participant_->guid());
  put_number(out, 1);
  put_text(out, "/");
  put_text(out, fmt::format("sentree_{}", ::getpid()));
  for (const auto* all : {&readers_, &writers_}) {
    put_number(out, static_cast<std::uint32_t>(all->size()));
    for (const dds::Guid& each : *all) put_gid(each);
  }
  static_cast<void>(graph_->write(out, nullptr));
}

}  // namespace sentree::ros
