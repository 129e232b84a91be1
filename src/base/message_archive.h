#pragma once

#include "sentree/base/archive.h"
#include "sentree/base/message.h"

// The members of an observation, for saving and restoring (archive.h).
namespace sentree {

constexpr MessageKind last_enumerator(MessageKind) { return MessageKind::kEvent; }

template <class S, class V>
requires archive::MaybeConst<S, Message>
void visit_members(S& s, V&& visit) {
  visit("sequence", s.sequence);
  visit("time", s.time);
  visit("stamp", s.stamp);
  visit("kind", s.kind);
  visit("source", s.source);
  visit("target", s.target);
  visit("name", s.name);
  visit("call", s.call);
  visit("tick", s.tick);
  visit("data", s.data);
}

}  // namespace sentree
