#include <fmt/format.h>

#include <condition_variable>
#include <mutex>

#include "sentree/cli/commands.h"
#include "sentree/cli/interrupts.h"
#include "sentree/cli/output.h"
#include "sentree/cli/report.h"
#include "sentree/processes/control.h"
#include "sentree/processes/wire_message.h"
#include "sentree/project/project.h"
#include "sentree/rpc/client.h"
#include "sentree/rpc/middleware.h"
#include "sentree/text/json.h"

namespace sentree::cli {

namespace {

constexpr std::chrono::milliseconds kWait{500};

// What comes at an address that is read from.
int echo_address(const EchoCommand& command) {
  const auto address = rpc::Address::parse(command.pattern);
  if (!address) {
    say(address.error().message);
    return kUsage;
  }
  rpc::Middleware& middleware = rpc::middleware_of(*address);
  if (!middleware.is_source(*address, nullptr)) {
    say(fmt::format("nothing can be read from {}; a port for data is yarp:/NAME:o, a topic of ROS ros:/NAME",
                    command.pattern));
    return kUsage;
  }
  const Interrupts interrupts;
  std::mutex mutex;
  std::condition_variable changed;
  std::uint64_t shown = 0;
  const auto is_enough = [&] { return command.count > 0 && shown >= command.count; };
  const auto opened = middleware.watch(
      *address,
      [&](const std::string& text) {
        const std::lock_guard lock(mutex);
        if (is_enough()) return;
        print((command.json ? to_json(Value(Map{{"at", command.pattern}, {"text", text}})) : text) + "\n");
        ++shown;
        changed.notify_all();
      },
      {.target = "echo", .problem = [](const std::string& what) { say("! " + what); }});
  if (!opened) {
    say(to_string(opened.error()));
    return kEnvironment;
  }
  std::unique_lock lock(mutex);
  while (!is_interrupted() && !is_enough()) changed.wait_for(lock, kWait);
  lock.unlock();
  (*opened)->stop();
  return kOk;
}

}  // namespace

int echo(const EchoCommand& command) {
  if (command.pattern.find(':') != std::string::npos) return echo_address(command);
  const auto run = processes::connect_control(std::atoi(command.run.c_str()));
  if (!run) {
    say(run.error().message);
    return kEnvironment;
  }
  const Interrupts interrupts;
  std::int64_t after = -1;
  std::uint64_t shown = 0;
  std::uint64_t missed = 0;
  bool heard = false;
  while (!is_interrupted()) {
    const auto reply = (*run)->call(
        "observe",
        Map{{"after", after}, {"pattern", command.pattern}, {"wait_ms", static_cast<std::int64_t>(kWait.count())}},
        std::chrono::steady_clock::now() + kWait + std::chrono::seconds(2));
    if (!reply) {
      if (is_interrupted()) break;
      // A run that has been heard and is gone has ended.
      if (!heard) say(reply.error().message);
      return heard ? kOk : kEnvironment;
    }
    heard = true;
    after = static_cast<std::int64_t>(processes::number_of(*reply, "upto"));
    if (const std::uint64_t lost = processes::number_of(*reply, "missed"); lost > 0) {
      missed += lost;
      say(fmt::format("! {} messages came faster than they could be shown", lost));
    }
    for (const Value& text : *reply->find("messages")->as_list()) {
      if (command.json) {
        print(fmt::format("{}\n", text.text()));
      } else if (const auto json = text::parse_json(text.text())) {
        print(line(processes::message_from_json(*json)) + "\n");
      }
      if (command.count > 0 && ++shown >= command.count) return kOk;
    }
  }
  return kInterrupted;
}

}  // namespace sentree::cli
