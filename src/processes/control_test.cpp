#include "sentree/processes/control.h"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <string>

#include "sentree/base/temporary_folder.h"

namespace sentree::processes {
namespace {

namespace fs = std::filesystem;

// The id of a process that has been.
int dead_process() {
  const pid_t child = fork();
  if (child == 0) _exit(0);
  waitpid(child, nullptr, 0);
  return child;
}

// The control socket of a process.
int listening(int pid) {
  sockaddr_un at{};
  at.sun_family = AF_UNIX;
  const std::string path = (control_folder() / (std::to_string(pid) + ".sock")).string();
  path.copy(at.sun_path, sizeof at.sun_path - 1);
  const int listener = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  EXPECT_EQ(bind(listener, reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
  EXPECT_EQ(listen(listener, 1), 0);
  return listener;
}

TEST(Control, SocketsOfKilledRunsAreTakenAwayByWhoeverLooksForRuns) {
  const TemporaryFolder folder("control");
  setenv("XDG_RUNTIME_DIR", folder.path().c_str(), 1);
  fs::create_directory(control_folder());
  const int dead = dead_process(), elsewhere = dead_process();
  ASSERT_NE(dead, elsewhere);
  close(listening(dead));
  const int answered = listening(elsewhere);  // of another container: its id means nothing here
  EXPECT_TRUE(running_runs(std::chrono::milliseconds(1)).empty());
  unsetenv("XDG_RUNTIME_DIR");
  EXPECT_FALSE(fs::exists(folder.path() / "sentree" / (std::to_string(dead) + ".sock")));
  EXPECT_TRUE(fs::exists(folder.path() / "sentree" / (std::to_string(elsewhere) + ".sock")));
  close(answered);
}

TEST(Control, SaysThatNothingIsObservedWhereNothingIs) {
  const auto server = start_control({.scenario = [] { return std::string("nothing"); },
                                     .now = [] { return TimePoint(); },
                                     .services = [] { return std::vector<runtime::ControlHandler::ServiceEntry>(); },
                                     .call = {}});
  ASSERT_TRUE(server) << to_string(server.error());
  const auto client = connect_control(::getpid());
  ASSERT_TRUE(client) << client.error().message;
  const auto reply = (*client)->call("observe", Map(), std::chrono::steady_clock::now() + std::chrono::seconds(20));
  ASSERT_FALSE(reply);
  EXPECT_EQ(reply.error().kind, rpc::CallErrorKind::kProtocol);
  EXPECT_TRUE((*client)->call("info", Map(), std::chrono::steady_clock::now() + std::chrono::seconds(20)));
}

}  // namespace
}  // namespace sentree::processes
