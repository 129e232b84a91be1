#pragma once

#include "sentree/base/archive.h"
#include "sentree/scxml/session.h"

namespace sentree::scxml {

// The members of what a session is made of, once, for hashing, saving and restoring alike (base/archive.h).
template <class S, class V>
requires archive::MaybeConst<S, Event>
void visit_members(S& s, V&& visit) {
  visit("name", s.name);
  visit("type", s.type);
  visit("sendid", s.sendid);
  visit("origin", s.origin);
  visit("origintype", s.origintype);
  visit("invokeid", s.invokeid);
  visit("data", s.data);
  visit("raw", s.raw);
  visit("session", s.session);
}
template <class S, class V>
requires archive::MaybeConst<S, Place>
void visit_members(S& s, V&& visit) {
  visit("line", s.line);
  visit("column", s.column);
  visit("length", s.length);
}
template <class S, class V>
requires archive::MaybeConst<S, Timer>
void visit_members(S& s, V&& visit) {
  visit("due", s.due);
  visit("sequence", s.sequence);
  visit("event", s.event);
  visit("target", s.target);
  visit("type", s.type);
  visit("is_content", s.is_content);
  visit("delay", s.delay);
  visit("place", s.place);
}

template <class S, class V>
requires archive::MaybeConst<S, SessionIdentity>
void visit_members(S& s, V&& visit) {
  visit("id", s.id);
  visit("parent", s.parent);
  visit("invokeid", s.invokeid);
}

struct SessionMembers {
  /// All but the chart's fingerprint, which `restore` looks at first, and the invocations, whose charts have to be
  /// loaded.
  template <class S, class V>
  static void visit(S& s, V&& visit) {
    visit("status", s.status_);
    visit("scripts_run", s.scripts_run_);
    visit("identity", s.identity_);
    visit("configuration", s.configuration_);
    visit("initialized", s.initialized_);
    visit("history", s.history_);
    visit("internal", s.internal_);
    visit("external", s.external_);
    visit("timers", s.timers_);
    visit("variables", s.variables_);
    visit("globals", s.globals_);
    visit("sequence", s.sequence_);
    visit("ids", s.ids_);
    visit("random", s.rng_);
    visit("failure", s.failure_);
    visit("done_data", s.done_data_);
  }
};

}  // namespace sentree::scxml
