#include "sentree/runtime/detail/telemetry.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "sentree/project/check_intervention.h"

namespace sentree::runtime {

Telemetry::Telemetry(Scheduler& scheduler, Publisher& publisher, ActorId actor)
    : scheduler_(scheduler), publisher_(publisher), actor_(actor) {}

void Telemetry::start(const mission::State* from) {
  for (Topic& topic : topics_) {
    if (from == nullptr) continue;
    topic.next += topic.period * (from->now.time_since_epoch() / topic.period);
    // What is published comes first at its instant.
    if (topic.next < from->now || from->begun) topic.next += topic.period;
  }
  schedule();
}

// One task for all, so that those of one instant come in one order, whenever the run was copied.
void Telemetry::schedule() {
  if (topics_.empty()) return;
  const auto earlier = [](const Topic& a, const Topic& b) { return a.next < b.next; };
  const TimePoint when = std::min_element(topics_.begin(), topics_.end(), earlier)->next;
  scheduler_.at(actor_, when, mission::Rank::kSimulator, [this, when] {
    for (Topic& topic : topics_) {
      if (topic.next > when) continue;
      idl::Method method;
      method.name = topic.source;
      topic.port->call(method, Value(Map()), [&](mission::CallOutcome outcome) {
        if (outcome.ok) publish(topic, std::move(outcome.result));
      });
      topic.next = when + topic.period;
      // In real time one that comes too late is left out.
      if (const TimePoint now = scheduler_.now(); topic.next < now)
        topic.next += topic.period * ((now - topic.next) / topic.period + 1);
    }
    schedule();
  });
}

void Telemetry::publish(const Topic& topic, Value what) {
  Message request;
  request.kind = MessageKind::kRequest;
  request.source = std::string(project::kSimulatorPart);
  request.target = topic.service;
  request.name = fmt::format("{}.{}.request", topic.service, topic.method);
  request.call = publisher_.next_call();
  Map args;
  args.append(topic.argument, std::move(what));
  Map data;
  data.append("args", std::move(args));
  request.data = std::move(data);
  Message kept = request;
  const auto admission = publisher_.request(std::move(request), [this, kept](const mission::Admission& decided) {
    if (decided.veto) refuse(kept, *decided.veto);
  });
  if (admission && admission->veto) refuse(std::move(kept), *admission->veto);
}

void Telemetry::refuse(Message request, const mission::Veto& veto) {
  request.kind = MessageKind::kError;
  request.name.replace(request.name.rfind('.'), std::string::npos, ".error");
  Map data{{"args", *request.data.find("args")}, {"kind", "vetoed"}};
  data["message"] = fmt::format("vetoed{}: {}", veto.by.empty() ? "" : " by " + veto.by, veto.reason);
  if (!veto.by.empty()) data["vetoed_by"] = veto.by;
  request.data = std::move(data);
  publisher_.publish(std::move(request));
}

}  // namespace sentree::runtime
