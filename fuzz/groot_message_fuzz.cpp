// Takes the bytes for what a Groot, or a publisher for Groot, may send.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "sentree/bt/load.h"
#include "sentree/groot/message_pack.h"
#include "sentree/groot/remote_tree.h"
#include "sentree/groot/responder.h"

namespace {

class Nothing final : public sentree::groot::Hooks {
 public:
  sentree::Result<void> set(const sentree::groot::Hook&) override { return {}; }
  void unset(const sentree::groot::Hook&) override {}
  sentree::Result<void> unlock(const sentree::groot::Hook&, sentree::bt::Status) override { return {}; }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  namespace groot = sentree::groot;
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  if (const auto value = groot::parse_message_pack(bytes)) {
    if (!groot::parse_message_pack(groot::message_pack(*value))) std::abort();
  }
  if (const auto remote = groot::read_remote_tree(bytes)) {
    const auto tree = sentree::bt::load(remote->mission, {.partial = true});
    if (tree.ok() && tree.value->size() > groot::kRemoteNodesMax) std::abort();
  }
  // A letter and the second part of a request.
  static groot::Scene scene;
  static const bool begun = [] {
    const auto tree = sentree::bt::load(
        R"(<root BTCPP_format="4"><BehaviorTree ID="M"><Sequence><AlwaysSuccess/></Sequence></BehaviorTree></root>)");
    scene.begin(*groot::describe(*tree.value), groot::TreeId{1});
    return true;
  }();
  Nothing hooks;
  groot::Responder responder(scene, &hooks);
  if (begun && !bytes.empty()) {
    const groot::Request request{
        .type = static_cast<groot::Ask>(bytes[0]), .id = 1, .body = bytes.substr(1), .has_body = true};
    if (responder.answer(groot::write_request(request), {}, 0).empty()) std::abort();
  }
  return 0;
}
