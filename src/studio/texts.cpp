#include "sentree/studio/texts.h"

#include <algorithm>

namespace sentree::studio {

Place LiveTexts::append(std::string_view text) {
  if (blocks_.empty() || (blocks_.back().size() + text.size() > kBlockSize && !blocks_.back().empty())) {
    blocks_.emplace_back();
    blocks_.back().reserve(std::max(kBlockSize, text.size()));
  }
  std::string& block = blocks_.back();
  const Place place{first_ + static_cast<std::uint32_t>(blocks_.size() - 1), static_cast<std::uint32_t>(block.size()),
                    static_cast<std::uint32_t>(text.size())};
  block += text;
  bytes_ += text.size();
  return place;
}

std::string LiveTexts::read(const Place& place) {
  if (place.block < first_ || place.block - first_ >= blocks_.size()) return {};
  return blocks_[place.block - first_].substr(place.offset, place.length);
}

void LiveTexts::drop_first_block() {
  if (blocks_.empty()) return;
  bytes_ -= blocks_.front().size();
  blocks_.pop_front();
  ++first_;
}

std::shared_ptr<const std::string> RecordedTexts::part(std::uint32_t index) {
  if (const auto known = by_part_.find(index); known != by_part_.end()) {
    kept_.splice(kept_.begin(), kept_, known->second);
    return kept_.front().second;
  }
  auto records = reader_.part(index);
  kept_.emplace_front(index, std::make_shared<const std::string>(records ? std::move(*records) : std::string()));
  by_part_[index] = kept_.begin();
  if (kept_.size() > kKeptParts) {
    by_part_.erase(kept_.back().first);
    kept_.pop_back();
  }
  return kept_.front().second;
}

std::string RecordedTexts::read(const Place& place) {
  const auto records = part(place.block);
  if (place.offset > records->size()) return {};
  return records->substr(place.offset, place.length);
}

}  // namespace sentree::studio
