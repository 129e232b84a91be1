#pragma once

#include <cstdint>
#include <deque>
#include <list>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>

#include "sentree/record/reader.h"

namespace sentree::studio {

/// Where a text is kept: in which block, and where in it.
struct Place {
  std::uint32_t block = 0;
  std::uint32_t offset = 0;
  std::uint32_t length = 0;
  friend bool operator==(const Place&, const Place&) = default;
};

/// Keeps the texts of messages by their places. One thread at a time.
class Texts {
 public:
  virtual ~Texts() = default;
  /// A copy; empty if it is not kept any more, or cannot be read.
  [[nodiscard]] virtual std::string read(const Place& place) = 0;
};

/// The newest texts of a run that goes on, in memory.
class LiveTexts final : public Texts {
 public:
  static constexpr std::size_t kBlockSize = std::size_t{1} << 20U;

  Place append(std::string_view text);
  [[nodiscard]] std::string read(const Place& place) override;
  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  [[nodiscard]] std::size_t blocks() const { return blocks_.size(); }
  /// The oldest block that is kept.
  [[nodiscard]] std::uint32_t first_block() const { return first_; }
  void drop_first_block();

 private:
  std::deque<std::string> blocks_;
  std::uint32_t first_ = 0;
  std::size_t bytes_ = 0;
};

/// The texts of a recording, read when they are asked for. The parts read last are kept unpacked.
class RecordedTexts final : public Texts {
 public:
  static constexpr std::size_t kKeptParts = 24;

  /// `reader` is borrowed.
  explicit RecordedTexts(record::Reader& reader) : reader_(reader) {}
  [[nodiscard]] std::string read(const Place& place) override;
  /// The records of a part; empty if they cannot be read.
  [[nodiscard]] std::shared_ptr<const std::string> part(std::uint32_t index);

 private:
  using Kept = std::pair<std::uint32_t, std::shared_ptr<const std::string>>;
  record::Reader& reader_;
  std::list<Kept> kept_;  // the part used last first
  std::unordered_map<std::uint32_t, std::list<Kept>::iterator> by_part_;
};

}  // namespace sentree::studio
