#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sentree/ros/detail/service.h"
#include "sentree/ros/detail/test_graph.h"

namespace sentree::ros {

/// An action's server as rcl_action has it, as far as its clients see.
class CountServer {
 public:
  using Octets = std::vector<std::uint8_t>;

  CountServer(std::shared_ptr<Node> node, const std::string& name, bool finishes)
      : finishes_(finishes), node_(std::move(node)) {
    const std::string base = name + "/_action/";
    const std::string type = "demo::action::dds_::Count_";
    const auto open = [&](const char* service, const std::string& request, const std::string& reply,
                          ServiceServer::Handle handle) {
      servers_.push_back(*ServiceServer::open(node_, {base + service, request, reply}, worker_, std::move(handle), {}));
    };
    feedback_ = *node_->write({"rt" + base + "feedback", type + "FeedbackMessage_", {}}, [](const std::string&) {});
    status_ = *node_->write({"rt" + base + "status",
                             "action_msgs::msg::dds_::GoalStatusArray_",
                             {.reliable = true, .transient_local = true, .depth = 1}},
                            [](const std::string&) {});
    open("send_goal", type + "SendGoal_Request_", type + "SendGoal_Response_",
         [this](const Octets& request, const auto& answer) {
           id_.assign(request.begin() + 4, request.begin() + 20);
           upto_ = request[20];
           answer(Octets{0, 1, 0, 0, static_cast<std::uint8_t>(upto_ < 100), 0, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0});
         });
    open("get_result", type + "GetResult_Request_", type + "GetResult_Response_",
         [this](const Octets&, const auto& answer) {
           ended_ = answer;
           tell_status(2);
           Octets feedback{0, 1, 0, 0};
           feedback.insert(feedback.end(), id_.begin(), id_.end());
           feedback.insert(feedback.end(), {3, 0, 0, 0});
           static_cast<void>(feedback_->writer()->write(feedback, nullptr));
           if (finishes_) end(4, "fine");
         });
    open("cancel_goal", "action_msgs::srv::dds_::CancelGoal_Request_", "action_msgs::srv::dds_::CancelGoal_Response_",
         [this](const Octets& request, const auto& answer) {
           cancelled_.add(Octets(request.begin() + 4, request.begin() + 20));
           Octets reply{0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0};
           reply.insert(reply.end(), id_.begin(), id_.end());
           reply.insert(reply.end(), {7, 0, 0, 0, 0, 0, 0, 0});
           answer(reply);
           if (ended_) end(5, "stopped");
         });
  }
  ~CountServer() {
    servers_.clear();
    worker_.stop();
  }
  Heard<Octets> cancelled_;

 private:
  // Of a goal that has succeeded before, and of the one that was sent; octets follow each other without padding.
  void tell_status(std::uint8_t status) {
    Octets out{0, 1, 0, 0, 2, 0, 0, 0};
    out.insert(out.end(), 16, 0xee);
    out.insert(out.end(), {3, 0, 0, 0, 0, 0, 0, 0, 4});
    out.insert(out.end(), id_.begin(), id_.end());
    out.insert(out.end(), {0, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0, status});
    static_cast<void>(status_->writer()->write(out, nullptr));
  }
  void end(std::uint8_t status, const std::string& how) {
    tell_status(status);
    Octets reply{0,
                 1,
                 0,
                 0,
                 status,
                 0,
                 0,
                 0,
                 static_cast<std::uint8_t>(upto_),
                 0,
                 0,
                 0,
                 static_cast<std::uint8_t>(how.size() + 1),
                 0,
                 0,
                 0};
    reply.insert(reply.end(), how.begin(), how.end());
    reply.push_back(0);
    ended_(reply);
    ended_ = nullptr;
  }

  const bool finishes_;
  const std::shared_ptr<Node> node_;
  Worker worker_;
  Octets id_;
  int upto_ = 0;
  ServiceServer::Answer ended_;
  ToldPtr feedback_;
  ToldPtr status_;
  std::vector<std::unique_ptr<ServiceServer>> servers_;
};

}  // namespace sentree::ros
