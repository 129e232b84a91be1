#include "sentree/groot/responder.h"

#include <fmt/format.h>

#include "sentree/groot/message_pack.h"

namespace sentree::groot {

Parts Responder::answer(const Parts& parts, Now now, std::int64_t now_us) {
  heard_ = now;
  if (silent_) {
    silent_ = false;
    for (auto& [place, hook] : all_) {
      hook.enabled = true;
      if (!hooks_->set(hook)) hook.enabled = false;
    }
  }
  const auto request = parse_request(parts);
  if (!request) return write_error(request.error().message);
  if (!scene_.has_tree()) return write_error("no tree is executed yet");
  auto body = body_of(*request, now_us);
  if (!body) return write_error(body.error().message);
  return write_reply(*request, scene_.id(), std::move(*body));
}

Result<std::optional<std::string>> Responder::body_of(const Request& request, std::int64_t now_us) {
  using Body = std::optional<std::string>;
  const auto done = [](const Result<void>& result) -> Result<Body> {
    if (!result) return tl::unexpected(result.error());
    return Body();
  };
  switch (request.type) {
    case Ask::kTree: return Body(scene_.xml());
    case Ask::kStatus: return Body(scene_.statuses());
    case Ask::kBlackboard:
      if (request.body.size() > kNamesMax) return fail("groot.request", "too many names of blackboards");
      return Body(message_pack(scene_.boards(request.body)));
    case Ask::kRecording:
      if (request.body == "start" || request.body == "stop") scene_.record(request.body == "start", now_us);
      return request.body == "start" ? Body(std::to_string(now_us)) : Body();
    case Ask::kTransitions: return Body(scene_.take_records());
    case Ask::kDumpHooks: {
      std::vector<Hook> hooks;
      for (const auto& [place, hook] : all_) hooks.push_back(hook);
      return Body(write_hooks(hooks));
    }
    case Ask::kInsertHook: return done(insert(request));
    case Ask::kRemoveHook: return done(remove(request));
    case Ask::kUnlock: return done(unlock(request));
    case Ask::kRemoveHooks:
      for (auto& [place, hook] : all_) disable(hook);
      all_.clear();
      return Body();
    case Ask::kDisableHooks:
      for (auto& [place, hook] : all_) disable(hook);
      return Body();
    case Ask::kReached: break;
  }
  return fail("groot.request", "Request not recognized");
}

Result<void> Responder::insert(const Request& request) {
  if (hooks_ == nullptr) return fail("groot.read-only", "hooks are not taken here: this can only be looked at");
  const auto asked = parse_hooks(request.body);
  if (!asked) return tl::unexpected(asked.error());
  for (const Hook& hook : *asked) {
    // As BehaviorTree.CPP does it: a node that is not there is no error.
    if (hook.uid == 0 || hook.uid > scene_.nodes()) continue;
    const Place place{hook.uid, hook.position};
    const auto known = all_.find(place);
    if (known == all_.end() && all_.size() >= kHooksMax)
      return fail("groot.hook", fmt::format("there are {} hooks already", kHooksMax));
    if (known != all_.end() && known->second == hook) continue;
    if (hook.enabled) {
      if (auto set = hooks_->set(hook); !set) return set;
    } else if (known != all_.end()) {
      disable(known->second);
    }
    all_[place] = hook;
  }
  return {};
}

Result<void> Responder::remove(const Request& request) {
  const auto asked = parse_hook_place(request.body);
  if (!asked) return tl::unexpected(asked.error());
  const auto known = all_.find({asked->uid, asked->position});
  if (known == all_.end()) return fail("groot.request", std::string(kNoSuchHook));
  disable(known->second);
  all_.erase(known);
  return {};
}

Result<void> Responder::unlock(const Request& request) {
  const auto asked = parse_hook_place(request.body);
  if (!asked) return tl::unexpected(asked.error());
  const auto known = all_.find({asked->uid, asked->position});
  if (known == all_.end()) return fail("groot.request", std::string(kNoSuchHook));
  const Hook hook = known->second;
  if (is_on(hook)) {
    if (auto unlocked = hooks_->unlock(hook, asked->desired); !unlocked) return unlocked;
  }
  if (!asked->remove && !hook.once) return {};
  disable(known->second);
  all_.erase(known);
  return {};
}

void Responder::disable(Hook& hook) {
  if (is_on(hook)) hooks_->unset(hook);
  hook.enabled = false;
}

void Responder::look_after(Now now) {
  if (silent_ || all_.empty() || now - heard_ < kSilenceMax) return;
  for (auto& [place, hook] : all_) {
    if (hook.enabled) hooks_->unset(hook);
  }
  silent_ = true;
}

void Responder::used(std::uint16_t uid, Hook::Position position) {
  const auto known = all_.find({uid, position});
  if (known != all_.end() && known->second.once && known->second.mode == Hook::Mode::kReplace) all_.erase(known);
}

}  // namespace sentree::groot
