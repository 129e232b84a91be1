#include "sentree/bt/kept_state.h"

#include <string>
#include <utility>

namespace sentree::bt {

namespace {

std::size_t held(const Value& value) {
  std::size_t bytes = 0;
  if (const auto* text = value.as_string()) return text->size();
  if (const auto* octets = value.as_bytes()) return octets->octets.size();
  if (const auto* list = value.as_list()) {
    for (const Value& item : *list) bytes += sizeof(item) + held(item);
  } else if (const auto* map = value.as_map()) {
    for (const auto& [name, item] : *map) bytes += sizeof(Map::Entry) + name.size() + held(item);
  }
  return bytes;
}

template <class T>
Blocks<T> taken(std::vector<T>& from, const Blocks<T>* like) {
  return Blocks<T>(std::exchange(from, {}), like);
}

}  // namespace

KeptState::KeptState(State&& state, const KeptState* like)
    : status_(taken(state.status_, like != nullptr ? &like->status_ : nullptr)),
      memory_(taken(state.memory_, like != nullptr ? &like->memory_ : nullptr)),
      links_(taken(state.links_, like != nullptr ? &like->links_ : nullptr)),
      entries_(taken(state.entries_, like != nullptr ? &like->entries_ : nullptr)),
      dynamic_(taken(state.dynamic_, like != nullptr ? &like->dynamic_ : nullptr)),
      rest_(std::move(state)) {}

State KeptState::state() const {
  State state = rest_;
  state.status_ = status_.whole();
  state.memory_ = memory_.whole();
  state.links_ = links_.whole();
  state.entries_ = entries_.whole();
  state.dynamic_ = dynamic_.whole();
  return state;
}

std::size_t KeptState::bytes_beside(const KeptState* like) const {
  return sizeof(*this) + status_.bytes_beside(like != nullptr ? &like->status_ : nullptr) +
         memory_.bytes_beside(like != nullptr ? &like->memory_ : nullptr) +
         links_.bytes_beside(like != nullptr ? &like->links_ : nullptr) +
         entries_.bytes_beside(like != nullptr ? &like->entries_ : nullptr,
                               [](const State::Entry& entry) { return held(entry.datum.value); }) +
         dynamic_.bytes_beside(like != nullptr ? &like->dynamic_ : nullptr,
                               [](const State::DynamicCell& cell) { return cell.name.size(); });
}

}  // namespace sentree::bt
