#include "sentree/monitor/projection.h"

#include <algorithm>

#include "sentree/base/assert.h"
#include "sentree/base/encoder.h"
#include "sentree/scxml/model.h"

namespace sentree::monitor {

namespace {

bool is_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '$' ||
         static_cast<unsigned char>(c) >= 0x80;
}

// Facts of the message.
constexpr std::string_view kSource = "source";
constexpr std::string_view kTarget = "target";
constexpr std::string_view kCall = "call";
constexpr std::string_view kTick = "tick";
constexpr std::string_view kTime = "time";

// What stands before the form of a member.
constexpr std::uint8_t kMissing = 0;
constexpr std::uint8_t kAsItIs = 1;
constexpr std::uint8_t kCut = 2;

}  // namespace

Projection Projection::of(const scxml::Chart& chart) {
  Projection projection;
  for (const scxml::Expression& expression : chart.model().expressions) projection.scan(expression.text);
  // Children of an <invoke> may get the event as it is.
  if (!chart.model().invokes.empty()) projection.whole_ = true;
  return projection;
}

void Projection::scan(std::string_view expression) {
  constexpr std::string_view kEvent = "_event";
  for (std::size_t at = expression.find(kEvent); at != std::string_view::npos; at = expression.find(kEvent, at + 1)) {
    const std::string_view rest = expression.substr(at + kEvent.size());
    if ((at > 0 && is_name(expression[at - 1])) || (!rest.empty() && is_name(rest[0]))) continue;  // part of a name
    constexpr std::string_view kData = ".data.";
    if (!rest.starts_with(kData)) {
      const bool other = rest.starts_with(".") && !rest.starts_with(".data") && rest.size() > 1 && is_name(rest[1]);
      if (!other) whole_ = true;
      continue;
    }
    std::size_t end = kData.size();
    while (end < rest.size() && (is_name(rest[end]) || rest[end] == '.')) ++end;
    std::string_view path = rest.substr(kData.size(), end - kData.size());
    if (path.empty() || path.back() == '.' || path.front() == '.') {
      whole_ = true;
      continue;
    }
    // Of "args.name.indexOf(…)" the last is a function of what is before it.
    if (end < rest.size() && (rest[end] == '(' || rest[end] == ' ')) {
      const std::size_t next = rest.find_first_not_of(" \t\r\n", end);
      if (next != std::string_view::npos && rest[next] == '(') {
        const std::size_t dot = path.rfind('.');
        if (dot == std::string_view::npos) {
          whole_ = true;
          continue;
        }
        path = path.substr(0, dot);
      }
    }
    add_path(members_, path);
  }
}

void Projection::add_path(std::vector<Member>& members, std::string_view path) {
  const std::size_t dot = path.find('.');
  const std::string_view first = path.substr(0, dot);
  auto member = std::find_if(members.begin(), members.end(), [&](const Member& m) { return m.name == first; });
  if (member == members.end()) member = members.insert(members.end(), {std::string(first), false, {}});
  if (dot == std::string_view::npos)
    member->whole = true;
  else
    add_path(member->members, path.substr(dot + 1));
}

void Projection::merge(std::vector<Member>& into, const std::vector<Member>& from) {
  for (const Member& theirs : from) {
    auto ours = std::find_if(into.begin(), into.end(), [&](const Member& m) { return m.name == theirs.name; });
    if (ours == into.end()) {
      into.push_back(theirs);
      continue;
    }
    ours->whole = ours->whole || theirs.whole;
    merge(ours->members, theirs.members);
  }
}

void Projection::add(const Projection& other) {
  whole_ = whole_ || other.whole_;
  merge(members_, other.members_);
}

const Map* Projection::cuttable(const Value& value, const Member& member) {
  const Map* const map = member.whole ? nullptr : value.as_map();
  // A map of one entry with $ is something else than a record (octets, XML).
  return map == nullptr || (map->size() == 1 && map->begin()->first.starts_with('$')) ? nullptr : map;
}

Value Projection::cut(const Value& value, const Member& member) {
  const Map* const map = cuttable(value, member);
  if (map == nullptr) return value;
  Map result;
  result.reserve(member.members.size());
  for (const Member& inner : member.members) {
    if (const Value* content = map->find(inner.name)) result.append(inner.name, cut(*content, inner));
  }
  return result;
}

// The members have one order, so that which of them are there says their names.
void Projection::encode(const Value& value, const Member& member, std::string& out) {
  Encoder to(out);
  const Map* const map = cuttable(value, member);
  to.byte(map == nullptr ? kAsItIs : kCut);
  if (map == nullptr) return to.value(value);
  for (const Member& inner : member.members) {
    const Value* const content = map->find(inner.name);
    if (content == nullptr)
      to.byte(kMissing);
    else
      encode(*content, inner, out);
  }
}

void Projection::encode(const Message& message, std::string& out) const {
  SENTREE_ASSERT(!whole_);
  Encoder to(out);
  for (const Member& member : members_) {
    const std::string_view name = member.name;
    if (name == kSource || name == kTarget) continue;
    if (name == kCall) {
      to.number(message.call);
    } else if (name == kTick) {
      to.number(message.tick);
    } else if (name == kTime) {
      to.integer(message.time.time_since_epoch().count());
    } else if (const Value* const content = message.data.find(name)) {
      encode(*content, member, out);
    } else {
      to.byte(kMissing);
    }
  }
}

Value Projection::data(const Message& message) const {
  if (whole_) return event_data(message);
  Map result;
  result.reserve(members_.size());
  for (const Member& member : members_) {
    const std::string& name = member.name;
    // The facts of the message come before its data, as in `event_data`.
    if (name == kSource)
      result.append(name, message.source);
    else if (name == kTarget)
      result.append(name, message.target);
    else if (name == kCall)
      result.append(name, static_cast<std::int64_t>(message.call));
    else if (name == kTick)
      result.append(name, static_cast<std::int64_t>(message.tick));
    else if (name == kTime)
      result.append(name, seconds(message.time));
    else if (const Value* content = message.data.find(name))
      result.append(name, cut(*content, member));
  }
  return result;
}

}  // namespace sentree::monitor
