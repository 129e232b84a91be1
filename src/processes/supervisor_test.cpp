#include "sentree/processes/supervisor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <future>

#include "sentree/base/temporary_folder.h"
#include "sentree/rpc/server.h"

namespace sentree::processes {
namespace {

constexpr int kPatienceMs = 30'000;

// A process that does as it is told by the octet that comes: listen, or end. It ends with this one, too.
class Told {
 public:
  explicit Told(const std::string& listen) {
    EXPECT_EQ(pipe(pipe_), 0);
    pid_ = fork();
    if (pid_ != 0) return;
    close(pipe_[1]);
    char what = 0;
    if (read(pipe_[0], &what, 1) != 1 || what != 'l') _exit(0);
    const auto server = rpc::Server::start(*rpc::Address::parse(listen), {});
    if (!server) _exit(1);
    [[maybe_unused]] const auto end = read(pipe_[0], &what, 1);
    _exit(0);
  }
  ~Told() {
    close(pipe_[1]);
    close(pipe_[0]);
    waitpid(pid_, nullptr, 0);
  }
  void tell(char what) const { EXPECT_EQ(write(pipe_[1], &what, 1), 1); }
  [[nodiscard]] pid_t pid() const { return pid_; }

 private:
  int pipe_[2]{};
  pid_t pid_ = -1;
};

class Adoption : public testing::Test {
 protected:
  const TemporaryFolder folder_{"adoption"};
  const std::string listen_ = "unix:" + (folder_.path() / "part.sock").string();
  ProcessSpec spec() const { return {.name = "part", .arguments = {}, .listen = listen_}; }
};

TEST_F(Adoption, WaitsUntilItListens) {
  const Told part(listen_);
  Supervisor supervisor("/bin/false", [](const runtime::ProcessEvent&) {});
  auto adopted =
      std::async(std::launch::async, [&] { return supervisor.adopt(spec(), part.pid(), process_begun(part.pid())); });
  part.tell('l');
  EXPECT_TRUE(adopted.get());
  ASSERT_EQ(supervisor.all().size(), 1U);
  EXPECT_EQ(supervisor.all()[0].pid, part.pid());
  EXPECT_EQ(supervisor.address("part"), listen_);
  supervisor.end(std::chrono::milliseconds(kPatienceMs));
}

TEST_F(Adoption, IsNoneOfOneThatEndsBefore) {
  const Told part(listen_);
  Supervisor supervisor("/bin/false", [](const runtime::ProcessEvent&) {});
  auto adopted =
      std::async(std::launch::async, [&] { return supervisor.adopt(spec(), part.pid(), process_begun(part.pid())); });
  part.tell('e');
  EXPECT_FALSE(adopted.get());
  EXPECT_TRUE(supervisor.all().empty());
}

TEST_F(Adoption, IsNoneOfAnotherProcessOfThatNumber) {
  const Told part(listen_);
  part.tell('l');
  Supervisor supervisor("/bin/false", [](const runtime::ProcessEvent&) {});
  EXPECT_FALSE(supervisor.adopt(spec(), part.pid(), process_begun(part.pid()) + 1));
  EXPECT_FALSE(supervisor.adopt(spec(), part.pid(), 0));
  EXPECT_FALSE(supervisor.adopt(spec(), 0, 0));
}

TEST(Processes, AreFoundByTheEndOfTheirCommandLines) {
  const TemporaryFolder folder("processes");
  const std::string own = folder.path().string();
  ASSERT_EQ(mkfifo((own + "/never").c_str(), 0600), 0);
  Supervisor supervisor("/bin/sh", [](const runtime::ProcessEvent&) {});
  // The shell stays, so that its words are there to see.
  ASSERT_TRUE(supervisor.start(
      {.name = "part", .arguments = {"-c", "echo listening on $2; read x < " + own + "/never", "sh"}, .listen = own}));
  ASSERT_EQ(supervisor.all().size(), 1U);
  EXPECT_THAT(processes_with({"--listen", own}), testing::ElementsAre(supervisor.all()[0].pid));
  EXPECT_THAT(processes_with({"--listen", own + "/other"}), testing::IsEmpty());
}

// One that is to survive its executive does so from the moment on at which whoever resumes the run can find it.
TEST(Processes, DieWithWhoStartsThemUntilTheySurvive) {
  int pids[2];
  ASSERT_EQ(pipe(pids), 0);
  const pid_t executive = fork();
  if (executive == 0) {
    Supervisor supervisor("/bin/sh", [](const runtime::ProcessEvent&) {});
    const auto started = supervisor.start({.name = "part",
                                           .arguments = {"-c", "echo listening on $2; exec sleep 1000", "sh"},
                                           .listen = "nowhere",
                                           .survives = true});
    const pid_t part = started ? supervisor.all()[0].pid : 0;
    [[maybe_unused]] const auto told = write(pids[1], &part, sizeof part);
    pause();
  }
  close(pids[1]);
  pid_t part = 0;
  ASSERT_EQ(read(pids[0], &part, sizeof part), static_cast<ssize_t>(sizeof part));
  close(pids[0]);
  ASSERT_GT(part, 0);
  const int watched = static_cast<int>(syscall(SYS_pidfd_open, part, 0));
  ASSERT_GE(watched, 0);
  pollfd ended{watched, POLLIN, 0};
  EXPECT_EQ(poll(&ended, 1, 0), 0);
  kill(executive, SIGKILL);
  waitpid(executive, nullptr, 0);
  EXPECT_EQ(poll(&ended, 1, kPatienceMs), 1);
  close(watched);
}

}  // namespace
}  // namespace sentree::processes
