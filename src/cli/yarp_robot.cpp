#include "sentree/cli/yarp_robot.h"

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "sentree/idl/conform.h"
#include "sentree/project/interface_file.h"
#include "sentree/rpc/middleware.h"
#include "sentree/sim/topics.h"
#include "sentree/yarp/address.h"

namespace sentree::cli {

namespace {

constexpr std::chrono::milliseconds kTurn{100};

// Every how many turns it is published: what changes with each motion at 10 Hz, scans at 5 Hz, the rest at 2 Hz.
std::int64_t turns_between(std::string_view topic) {
  if (topic == "position" || topic == "odometry") return 1;
  return topic == "scan" ? 2 : 5;
}

Result<idl::ServicePtr> telemetry() {
  const auto file = project::find_interface("interfaces", "robot.thrift");
  if (!file) return fail("check.no-interface", "there is no interfaces/robot.thrift");
  const auto schema = project::load_interface(*file, "robot.thrift");
  if (!schema.value) return tl::unexpected(schema.diagnostics.front());
  return idl::find_service(*schema.value, std::string(sim::kTelemetry));
}

}  // namespace

class YarpRobot::Impl {
 public:
  explicit Impl(processes::SimServer& server) : server_(server) {}
  ~Impl() {
    {
      const std::lock_guard lock(mutex_);
      stopped_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
  }

  Result<void> open(const sim::World& world, const rpc::Address& at) {
    auto base = yarp::PortAddress::parse(at.path);
    if (!base) return tl::unexpected(std::move(base.error()));
    auto interface = telemetry();
    if (!interface) return tl::unexpected(std::move(interface.error()));
    const std::string prefix = base->name.ends_with('/') ? base->name : base->name + "/";
    for (const sim::RobotSpec& robot : world.robots) {
      for (const sim::TopicInfo& topic : sim::topics()) {
        yarp::PortAddress port = *base;
        port.open = true;
        port.name =
            prefix + (world.robots.size() > 1 ? robot.name + "/" : "") + "telemetry/" + std::string(topic.topic) + ":o";
        auto opened = rpc::connect(*rpc::Address::parse(to_string(port)), *interface,
                                   {.target = std::string(topic.topic), .limits = {}, .tls = {}});
        if (!opened) return tl::unexpected(std::move(opened.error()));
        topics_.push_back({robot.name, topic, std::move(*opened)});
      }
    }
    thread_ = std::thread([this] { run(); });
    return {};
  }

 private:
  struct Topic {
    std::string robot;
    sim::TopicInfo info;
    std::unique_ptr<rpc::Caller> port;
  };

  void run() {
    std::unique_lock lock(mutex_);
    for (std::int64_t turn = 0; !stopped_; ++turn) {
      lock.unlock();
      for (Topic& topic : topics_) {
        if (turn % turns_between(topic.info.topic) == 0) publish(topic);
      }
      lock.lock();
      changed_.wait_for(lock, kTurn, [&] { return stopped_; });
    }
  }

  void publish(Topic& topic) {
    mission::CallOutcome state =
        server_.host().call(std::string(topic.info.service), std::string(topic.info.method), Value(Map{}), topic.robot);
    if (!state.ok) return;
    topic.port->call(std::string(topic.info.topic), Value(Map{{"state", std::move(state.result)}}), rpc::kNoDeadline,
                     [](const rpc::Outcome&) {});
  }

  processes::SimServer& server_;
  std::vector<Topic> topics_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopped_ = false;
  std::thread thread_;
};

YarpRobot::YarpRobot(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
YarpRobot::~YarpRobot() = default;

Result<std::unique_ptr<YarpRobot>> YarpRobot::start(processes::SimServer& server, const sim::World& world,
                                                    const rpc::Address& at) {
  auto impl = std::make_unique<Impl>(server);
  if (auto opened = impl->open(world, at); !opened) return tl::unexpected(std::move(opened.error()));
  return std::unique_ptr<YarpRobot>(new YarpRobot(std::move(impl)));
}

}  // namespace sentree::cli
