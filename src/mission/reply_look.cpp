#include "sentree/mission/reply_look.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "sentree/base/message.h"
#include "sentree/idl/conform.h"

namespace sentree::mission {

namespace {

constexpr std::size_t kReplyMembersMax = 16;

std::string reply_name(const Call& call) { return fmt::format("{}.{}.reply", call.service, call.method); }

}  // namespace

ReplyLook::ReplyLook(const scxml::Chart& chart)
    : chart_(chart), reads_(chart), members_(monitor::Projection::of(chart)) {
  if (const Value facts = members_.data(Message()); !facts.as_map()->empty()) members_.make_whole();
}

std::optional<std::vector<scxml::TransitionIndex>> ReplyLook::enabled(const Call& call, Value& result,
                                                                      const scxml::Session& session, TimePoint now) {
  if (reads_.elsewhere() || !call.session.empty()) return std::nullopt;
  auto found = plainly(of(call), result, session);
  if (!found) {
    scxml::Event event{.name = reply_name(call)};
    event.sendid = call.sendid;
    event.origintype = "thrift";
    Map data;
    data.reserve(2);
    data.append("args", call.args);
    data.append("result", std::move(result));
    Message reply;
    reply.data = std::move(data);
    event.data = idl::for_script(members_.is_whole() ? reply.data : members_.data(reply));
    result = std::move(*reply.data.as_map()->find("result"));
    found = scxml::enabled_by(chart_, session, event, now);
  }
  const auto in_content = [&](scxml::TransitionIndex t) { return reads_.in_content(t); };
  return found && std::none_of(found->begin(), found->end(), in_content) ? std::move(found) : std::nullopt;
}

ReplyLook::Method& ReplyLook::of(const Call& call) {
  const auto known = std::find_if(methods_.begin(), methods_.end(), [&](const Method& one) {
    return one.method == call.method && one.service == call.service;
  });
  if (known != methods_.end()) return *known;
  Method& method = methods_.emplace_back(Method{call.service, call.method, {}, {}, {}});
  scxml::PlainPaths read;
  method.plan = scxml::PlainPlan::make(chart_, reply_name(call), read);
  method.paths = read.members();
  if (method.paths.size() > kReplyMembersMax) method.plan.reset();
  for (std::vector<std::string>& path : method.paths) {
    if (path.front() != "result") method.plan.reset();
    path.erase(path.begin());
    method.hints.emplace_back(path.size());
  }
  return method;
}

std::optional<std::vector<scxml::TransitionIndex>> ReplyLook::plainly(Method& method, const Value& result,
                                                                      const scxml::Session& session) {
  if (!method.plan) return std::nullopt;
  std::array<scxml::PlainValue, kReplyMembersMax> members;
  auto* member = members.data();
  for (std::size_t i = 0; i < method.paths.size(); ++i) {
    const std::vector<std::string>& path = method.paths[i];
    *member = path.empty() ? scxml::PlainValue::of(result) : scxml::plain_member(&result, path, method.hints[i].data());
    // Scripts are given integers that a double cannot hold as texts.
    if (member->kind == scxml::PlainValue::Kind::kNumber &&
        !(std::abs(member->number) < static_cast<double>(idl::kExactInDouble)))
      return std::nullopt;
    ++member;
  }
  return method.plan->enabled(session, members.data());
}

}  // namespace sentree::mission
