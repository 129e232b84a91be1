#pragma once

#include <functional>
#include <memory>
#include <string>

#include "sentree/ros/address.h"
#include "sentree/ros/detail/node.h"
#include "sentree/rpc/middleware.h"

/// What others say to each other in a graph of ROS. Private to the library.
namespace sentree::ros {

/// Listens to a topic, a service or an action, and writes nothing.
///
/// Requests and replies are topics of DDS, which whoever reads them gets. A reader of replies disturbs nobody. But a
/// client of ROS takes a server for ready if there are as many readers of requests as writers of replies: so where the
/// address wants `requests`, beside our reader of requests there is a writer of replies that never writes. The two are
/// there only while a server is that is none of these, and the node does not tell of them; but a client that discovers
/// them before that server takes them for it, for so long.
///
/// @param base  The name in the graph. Errors: ros.type, rpc.exhausted.
[[nodiscard]] Result<std::unique_ptr<rpc::Opened>> overhear(const std::shared_ptr<Node>& node,
                                                            const GraphAddress& address,
                                                            const idl::ServicePtr& interface, const std::string& base,
                                                            const std::string& text, rpc::Middleware::Hearing hearing,
                                                            std::function<void(const std::string&)> problem);

}  // namespace sentree::ros
