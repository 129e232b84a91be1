#include "sentree/groot/scene.h"

#include <algorithm>

namespace sentree::groot {

void Scene::begin(TreeImage image, const TreeId& id) {
  const std::lock_guard lock(mutex_);
  image_ = std::move(image);
  id_ = id;
  statuses_.assign(image_.nodes, bt::Status::kIdle);
  codes_.assign(image_.nodes, 0);
  told_ = statuses_;
  changes_.clear();
  entries_ = Value();
  records_.clear();
}

void Scene::keep(bt::NodeId node, std::int64_t at_us, bt::Status status) {
  if (!recording_) return;
  if (records_.size() == kRecordedMax) records_.pop_front();
  records_.push_back(
      {std::max<std::int64_t>(at_us - record_from_us_, 0), uid_of(node), static_cast<std::uint8_t>(status)});
}

void Scene::changed(const Change& change) {
  const std::lock_guard lock(mutex_);
  if (change.node >= statuses_.size() || change.from == change.to) return;
  statuses_[change.node] = change.to;
  codes_[change.node] = next_code(codes_[change.node], change.to);
  keep(change.node, change.at_us, change.to);
  changes_.push_back(change);
  if (changes_.size() < kUpdateMax) return;
  // Nobody took them: of each node, from what was told to what it is.
  std::vector<Change> last;
  for (std::size_t node = 0; node < statuses_.size(); ++node) {
    if (told_[node] != statuses_[node])
      last.push_back({change.at_us, static_cast<bt::NodeId>(node), told_[node], statuses_[node]});
  }
  // A tree larger than that is told in part, and whole to whom asks for it.
  if (last.size() >= kUpdateMax) last.clear();
  changes_ = std::move(last);
}

void Scene::skipped(bt::NodeId node, std::int64_t at_us) {
  const std::lock_guard lock(mutex_);
  if (node >= codes_.size()) return;
  codes_[node] = next_code(codes_[node], bt::Status::kSkipped);
  keep(node, at_us, bt::Status::kSkipped);
}

void Scene::blackboard(Value entries) {
  const std::lock_guard lock(mutex_);
  entries_ = std::move(entries);
}

bool Scene::has_tree() const {
  const std::lock_guard lock(mutex_);
  return image_.nodes > 0;
}

TreeId Scene::id() const {
  const std::lock_guard lock(mutex_);
  return id_;
}

std::size_t Scene::nodes() const {
  const std::lock_guard lock(mutex_);
  return image_.nodes;
}

std::string Scene::xml() const {
  const std::lock_guard lock(mutex_);
  return image_.xml;
}

std::string Scene::groot1_tree() const {
  const std::lock_guard lock(mutex_);
  return groot::groot1_tree(image_, statuses_);
}

std::string Scene::take_update() {
  const std::lock_guard lock(mutex_);
  if (changes_.empty()) return {};
  std::string update = groot1_update(image_, told_, changes_);
  told_ = statuses_;
  changes_.clear();
  return update;
}

std::string Scene::statuses() const {
  const std::lock_guard lock(mutex_);
  std::vector<NodeStatus> all;
  all.reserve(codes_.size());
  for (std::size_t node = 0; node < codes_.size(); ++node)
    all.push_back({uid_of(static_cast<bt::NodeId>(node)), codes_[node]});
  return write_statuses(all);
}

Value Scene::boards(std::string_view names) const {
  const std::lock_guard lock(mutex_);
  Map found;
  for (const TreeImage::Board& board : image_.boards) {
    bool is_asked = false;
    for (std::string_view rest = names; !rest.empty() && !is_asked;) {
      const auto end = std::min(rest.find(';'), rest.size());
      is_asked = rest.substr(0, end) == board.name;
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    if (!is_asked) continue;
    const Value* entries = entries_.find(board.scope);
    found[board.name] = entries != nullptr ? *entries : Value(Map());
  }
  if (found.empty()) return {};
  return found;
}

void Scene::record(bool on, std::int64_t now_us) {
  const std::lock_guard lock(mutex_);
  recording_ = on;
  record_from_us_ = now_us;
  records_.clear();
}

std::string Scene::take_records() {
  const std::lock_guard lock(mutex_);
  std::string out;
  for (const Record& record : records_) append_record(out, record);
  records_.clear();
  return out;
}

}  // namespace sentree::groot
