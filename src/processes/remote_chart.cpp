#include "sentree/processes/detail/remote_chart.h"

#include <chrono>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "sentree/base/packed.h"
#include "sentree/processes/environment.h"
#include "sentree/processes/remote_skill.h"
#include "sentree/processes/wire_message.h"
#include "sentree/rpc/client.h"

namespace sentree::processes {

namespace {

using mission::ChartElsewhere;
using SteadyClock = std::chrono::steady_clock;

// Of one that was away for long: whether it has come back.
constexpr std::chrono::milliseconds kShortPatience{200};
constexpr std::chrono::milliseconds kChartRetry{5};

class RemoteChart final : public ChartElsewhere {
 public:
  RemoteChart(std::unique_ptr<rpc::Client> client, RemoteChartOptions options)
      : client_(std::move(client)), options_(std::move(options)) {}

  tl::expected<Value, Away> execute(const scxml::Session& session, const scxml::StepOrder& order) override {
    const bool starts = order.kind == scxml::StepOrder::Kind::kStart;
    bool has_it = number_ > 0 && session == session_;
    Map arguments{{"leaf", options_.leaf}, {"order", octets_of(pack(save(order)))}};
    const auto until = SteadyClock::now() + (is_away_ ? SteadyClock::duration(kShortPatience) : kChartPatience);
    for (;;) {
      arguments["behind"] = has_it ? number_ : 0;
      arguments["number"] = number_ + 1;
      arguments["session"] = Bytes();
      if (!has_it && !starts) {
        const auto saved = scxml::save(options_.chart, session);
        if (!saved) return lost(saved.error().message);
        arguments["session"] = octets_of(pack(*saved));
      }
      const auto reply = client_->call("step", arguments, SteadyClock::now() + options_.step_deadline);
      if (reply) {
        const std::string_view packed = text_in(&*reply);
        if (packed.empty() && has_it) {  // it was started anew
          has_it = false;
          continue;
        }
        auto told = unpack(packed);
        if (!told) return lost(told.error().message);
        is_away_ = false;
        return std::move(*told);
      }
      if (reply.error().kind == rpc::CallErrorKind::kLate) {
        options_.hangs();
        return lost(fmt::format("a step takes longer than {} ms",
                                std::chrono::duration_cast<std::chrono::milliseconds>(options_.step_deadline).count()));
      }
      if (reply.error().kind != rpc::CallErrorKind::kUnreachable || SteadyClock::now() > until)
        return lost(reply.error().message);
      std::this_thread::sleep_for(kChartRetry);
    }
  }

  void took(const scxml::Session& session) override {
    ++number_;
    session_ = session;
  }

 private:
  tl::unexpected<Away> lost(const std::string& why) {
    number_ = 0;
    if (!std::exchange(is_away_, true))
      options_.problem(fmt::format("{}: its process does not execute it: {}", options_.leaf, why));
    return tl::unexpected(Away::kLost);
  }

  const std::unique_ptr<rpc::Client> client_;
  const RemoteChartOptions options_;
  std::int64_t number_ = 0;  // of the step that made `session_`, which its process may still have; 0: none
  scxml::Session session_;
  bool is_away_ = false;
};

}  // namespace

Result<std::unique_ptr<ChartElsewhere>> make_remote_chart(RemoteChartOptions options) {
  auto interface = served_skill_interface();
  if (!interface) return tl::unexpected(interface.error());
  rpc::ClientOptions client_options;
  client_options.target = options.leaf;
  client_options.tls = environment_tls();
  client_options.backoff_last = std::chrono::milliseconds(50);
  auto client = rpc::Client::remote(options.address, std::move(*interface), std::move(client_options));
  if (!client) return tl::unexpected(client.error());
  return std::unique_ptr<ChartElsewhere>(std::make_unique<RemoteChart>(std::move(*client), std::move(options)));
}

rpc::Outcome ChartServer::step(const Value& arguments) {
  const auto refused = [](const std::string& why) {
    return tl::unexpected(rpc::CallError{rpc::CallErrorKind::kProtocol, why, {}, {}});
  };
  const auto packed = unpack(text_in(arguments.find("order")));
  const auto order = packed ? scxml::restore_order(*packed) : tl::unexpected(packed.error());
  if (!order) return refused(order.error().message);
  const std::string leaf = text_of(arguments, "leaf");
  const auto behind = static_cast<std::int64_t>(number_of(arguments, "behind"));
  const std::string_view saved = text_in(arguments.find("session"));

  const std::lock_guard lock(mutex_);
  scxml::Session session;
  if (behind != 0) {
    const auto known = leaves_.find(leaf);
    if (known == leaves_.end() || known->second.number != behind) return Value(Bytes());
    session = known->second.session;
  } else if (!saved.empty()) {
    const auto value = unpack(saved);
    auto restored = value ? scxml::restore(plan_.chart, *value) : tl::unexpected(value.error());
    if (!restored) return refused(restored.error().message);
    session = std::move(*restored);
  }
  scxml::Host host;
  host.processors.push_back({"thrift", ""});
  host.on_send = [this](const scxml::OutgoingSend& send) { return mission::check_call(send, plan_.services); };
  auto told = scxml::execute_and_tell(plan_.chart, session, *order, std::move(host));
  if (!told) return refused(told.error().message);
  if (leaves_.contains(leaf) || leaves_.size() < kServedLeavesMax)
    leaves_[leaf] = {static_cast<std::int64_t>(number_of(arguments, "number")), std::move(session)};
  return octets_of(pack(*told));
}

}  // namespace sentree::processes
