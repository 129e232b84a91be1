#include "sentree/runtime/telemetry.h"

#include <utility>

#include "sentree/project/check_intervention.h"

namespace sentree::runtime {

Telemetry::Telemetry(Scheduler& scheduler, Publisher& publisher, ActorId actor)
    : scheduler_(scheduler), publisher_(publisher), actor_(actor) {}

void Telemetry::start(const mission::State* from) {
  for (std::size_t i = 0; i < topics_.size(); ++i) {
    TimePoint first{};
    if (from != nullptr) {
      const Duration period = topics_[i].period;
      first += period * (from->now.time_since_epoch() / period);
      // What is published comes first at its instant.
      if (first < from->now || from->begun) first += period;
    }
    publish_at(i, first);
  }
}

void Telemetry::publish_at(std::size_t index, TimePoint when) {
  scheduler_.at(actor_, when, mission::Rank::kSimulator, [this, index, when] {
    const Topic& topic = topics_[index];
    idl::Method method;
    method.name = topic.source;
    topic.port->call(method, Value(Map()), [&](mission::CallOutcome outcome) {
      if (outcome.ok) publish(topic, std::move(outcome.result));
    });
    // In real time one that comes too late is left out.
    TimePoint next = when + topic.period;
    if (const TimePoint now = scheduler_.now(); next < now) next += topic.period * ((now - next) / topic.period + 1);
    publish_at(index, next);
  });
}

void Telemetry::publish(const Topic& topic, Value what) {
  Message request;
  request.kind = MessageKind::kRequest;
  request.source = std::string(project::kSimulatorPart);
  request.target = topic.service;
  request.name = topic.service + "." + topic.method + ".request";
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
  data["message"] = "vetoed" + (veto.by.empty() ? "" : " by " + veto.by) + ": " + veto.reason;
  if (!veto.by.empty()) data["vetoed_by"] = veto.by;
  request.data = std::move(data);
  publisher_.publish(std::move(request));
}

}  // namespace sentree::runtime
