// The server of a skill in a process of its own.
#include "sentree/processes/remote_skill.h"

#include <gtest/gtest.h>

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <string>

#include "sentree/base/temporary_folder.h"
#include "sentree/runtime/scheduler.h"
#include "sentree/text/file.h"

namespace sentree::processes {
namespace {

// Listens, and answers nobody.
int listener(const std::string& path) {
  const int made = ::socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  EXPECT_EQ(::bind(made, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  EXPECT_EQ(::listen(made, 8), 0);
  return made;
}

TEST(SkillServer, ConnectsToComponentsBeforeItsFirstTick) {
  const TemporaryFolder folder("skill");
  const std::string socket = (folder.path() / "door.sock").string();
  const auto put = [&](const char* name, const std::string& text) {
    std::filesystem::create_directories((folder.path() / name).parent_path());
    ASSERT_TRUE(text::write_file(folder.path() / name, text));
  };
  put("interfaces/door.thrift", "service Door { bool open() }\n");
  put("skills/Open.scxml", R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="asking">
  <state id="asking"><onentry><send type="thrift" target="door" event="open"/></onentry>
    <transition event="door.open.reply" target="success"/><transition event="error halt" target="failure"/></state>
  <final id="success"/><final id="failure"/></scxml>)");
  put("mission.xml", R"(<root BTCPP_format="4"><BehaviorTree ID="Main"><Action ID="Open"/></BehaviorTree></root>)");
  put("sentree.yaml",
      "mission: {file: mission.xml}\nservices: {door: {interface: door.thrift/Door, at: \"unix:" + socket + "\"}}\n");
  const int listening = listener(socket);
  const auto project = project::load_project(folder.path());
  ASSERT_TRUE(project.ok());
  const auto plan = project::prepare_skill(*project.value, "Open");
  ASSERT_TRUE(plan.ok());
  const auto publisher = make_silent_publisher();
  const auto scheduler = runtime::make_real_scheduler();
  const auto service = make_skill_service(*plan.value, *served_skill_interface(), *publisher, *scheduler, {});
  pollfd somebody{listening, POLLIN, 0};
  EXPECT_EQ(::poll(&somebody, 1, 10'000), 1) << "nobody has connected";
  ::close(listening);
}

}  // namespace
}  // namespace sentree::processes
