#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "sentree/idl/schema.h"
#include "sentree/ros/detail/node.h"
#include "sentree/ros/middleware.h"
#include "sentree/rpc/middleware.h"

/// A graph of ROS for tests: a domain of their own, interfaces, and waiting for what comes. For tests only.
namespace sentree::ros {

inline constexpr std::chrono::seconds kPatience{120};

inline rpc::Deadline patience() { return std::chrono::steady_clock::now() + kPatience; }

/// A domain that no other test of this process has, and that of another process hardly ever.
inline std::string own_domain() {
  static std::atomic<int> next{static_cast<int>(::getpid()) * 13};
  return std::to_string(1 + (next++ % 100));
}

inline std::map<std::string, std::string>& definitions() {
  static std::map<std::string, std::string> all{
      {"std_srvs/srv/SetBool.srv", "bool data\n---\nbool success\nstring message\n"},
      {"std_srvs/srv/Trigger.srv", "---\nbool success\nstring message\n"},
      {"builtin_interfaces/msg/Time.msg", "int32 sec\nuint32 nanosec\n"},
      {"std_msgs/msg/Header.msg", "builtin_interfaces/Time stamp\nstring frame_id\n"},
      {"std_msgs/msg/String.msg", "string data\n"},
      {"sensor_msgs/msg/Octets.msg", "uint8[] data\n"},
      {"demo/action/Count.action", "int32 upto\n---\nint32 reached\nstring how\n---\nint32 now\n"}};
  return all;
}

inline Loaded<idl::Schema> load(const std::string& type) {
  const std::string form = type.substr(type.find('/') + 1, type.rfind('/') - type.find('/') - 1);
  const std::string file = type + "." + form;
  return idl::Schema::load(definitions().at(file), file,
                           [](std::string_view path, std::string_view) -> Result<idl::IncludedFile> {
                             const auto found = definitions().find(std::string(path));
                             if (found == definitions().end()) return fail("file.missing", "no such file");
                             return idl::IncludedFile{found->first, found->second};
                           });
}

inline idl::ServicePtr interface(const std::string& type) {
  auto loaded = load(type);
  return loaded.value->service(type.substr(type.rfind('/') + 1));
}

/// What came, one thing after the other.
template <class T>
class Heard {
 public:
  void add(T what) {
    {
      const std::lock_guard lock(mutex_);
      all_.push_back(std::move(what));
    }
    changed_.notify_all();
  }
  /// Waits until `enough` of what there is, with patience.
  template <class F>
  std::vector<T> wait(F&& enough) {
    std::unique_lock lock(mutex_);
    changed_.wait_until(lock, patience(), [&] { return enough(all_); });
    return all_;
  }
  std::vector<T> all() {
    return wait([](const auto&) { return true; });
  }
  std::vector<T> wait_for(std::size_t count) {
    return wait([&](const std::vector<T>& all) { return all.size() >= count; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<T> all_;
};

/// Waits until `condition`, looking now and then.
template <class F>
bool eventually(F&& condition) {
  std::mutex mutex;
  std::condition_variable never;
  std::unique_lock lock(mutex);
  const auto until = patience();
  while (!condition()) {
    if (std::chrono::steady_clock::now() > until) return false;
    never.wait_for(lock, std::chrono::milliseconds(5));
  }
  return true;
}

class Graph : public ::testing::Test {
 protected:
  void SetUp() override {
    rpc::register_middleware(make_middleware({.find = load}));
    if (const auto dds = load_dds(); !dds) GTEST_SKIP() << dds.error().message;
    domain_ = own_domain();
  }
  [[nodiscard]] rpc::Address at(const std::string& name, const std::string& options = "") const {
    return *rpc::Address::parse("ros:" + name + "?domain=" + domain_ + "&range=localhost" + options);
  }
  /// The one of the middleware.
  [[nodiscard]] std::shared_ptr<Node> node_at(const std::string& name) const {
    return *Node::of(*GraphAddress::parse(at(name).path));
  }
  /// Another participant of the same domain, which is not ours to the middleware.
  [[nodiscard]] std::unique_ptr<dds::Participant> stranger() const {
    std::string error;
    return std::unique_ptr<dds::Participant>((*load_dds())(
        {.domain = static_cast<std::uint32_t>(std::stoi(domain_)), .localhost = true, .enclave = "/"}, error));
  }
  std::string domain_;
};

}  // namespace sentree::ros
