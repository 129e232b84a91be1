#include <csignal>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/report.h"
#include "sentree/project/project.h"
#include "sentree/rpc/client.h"
#include "sentree/runtime/control.h"
#include "sentree/runtime/wire_message.h"
#include "sentree/text/json.h"

namespace sentree::cli {

namespace {

volatile std::sig_atomic_t interrupted = 0;

constexpr std::chrono::milliseconds kWait{500};

}  // namespace

int echo(const EchoCommand& command) {
  const auto run = runtime::connect_control(std::atoi(command.run.c_str()));
  if (!run) {
    say(run.error().message);
    return kEnvironment;
  }
  struct sigaction on_interrupt {};
  on_interrupt.sa_handler = [](int) { interrupted = 1; };
  sigaction(SIGINT, &on_interrupt, nullptr);
  sigaction(SIGTERM, &on_interrupt, nullptr);

  std::int64_t after = -1;
  std::uint64_t shown = 0;
  std::uint64_t missed = 0;
  bool heard = false;
  while (interrupted == 0) {
    const auto reply = (*run)->call(
        "observe",
        Map{{"after", after}, {"pattern", command.pattern}, {"wait_ms", static_cast<std::int64_t>(kWait.count())}},
        std::chrono::steady_clock::now() + kWait + std::chrono::seconds(2));
    if (!reply) {
      if (interrupted != 0) break;
      // A run that has been heard and is gone has ended.
      if (!heard) say(reply.error().message);
      return heard ? kOk : kEnvironment;
    }
    heard = true;
    after = static_cast<std::int64_t>(runtime::number_of(*reply, "upto"));
    if (const std::uint64_t lost = runtime::number_of(*reply, "missed"); lost > 0) {
      missed += lost;
      say("! " + std::to_string(lost) + " messages came faster than they could be shown");
    }
    for (const Value& text : *reply->find("messages")->as_list()) {
      if (command.json) {
        print(std::string(text.text()) + "\n");
      } else if (const auto json = text::parse_json(text.text())) {
        print(line(runtime::message_from_json(*json)) + "\n");
      }
      if (command.count > 0 && ++shown >= command.count) return kOk;
    }
  }
  return kInterrupted;
}

}  // namespace sentree::cli
