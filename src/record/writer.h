#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/record/mcap.h"
#include "sentree/record/sink.h"

namespace sentree::record {

/// Messages that will be written together, with the schemas and channels they are the first to need.
struct Chunk {
  std::string records;
  std::uint64_t start_time = 0;
  std::uint64_t end_time = 0;
  std::uint64_t messages = 0;
  /// By channel: log time and place in `records` of each message.
  std::map<ChannelId, std::vector<std::pair<std::uint64_t, std::uint64_t>>> index;

  [[nodiscard]] bool empty() const { return records.empty(); }
  /// Forgets the content and keeps the memory.
  void clear();
  void add(const Schema& schema);
  void add(const Channel& channel);
  void add(const RawMessage& message);
  /// The same for a message whose data are written in place: append them to `records`, then call `end_message`.
  std::size_t begin_message(ChannelId channel, std::uint32_t sequence, std::uint64_t log_time,
                            std::uint64_t publish_time);
  void end_message(std::size_t begin);
};

/// Writes the records of one MCAP file in order. One thread at a time.
///
/// After an error nothing more is written; what was written before opens like a file that was cut off.
class Writer {
 public:
  explicit Writer(Sink& sink, Compression compression = Compression::kZstd);

  /// First of all. `profile` says what readers may expect, `library` who wrote it.
  Result<void> begin(std::string_view profile, std::string_view library);
  Result<void> write(const Chunk& chunk);
  Result<void> write(const Attachment& attachment);
  Result<void> write(const Metadata& metadata);
  /// Last of all: the summary with every index, and the footer. `schemas` and `channels` are those of the chunks.
  Result<void> end(const std::vector<Schema>& schemas, const std::vector<Channel>& channels);

  [[nodiscard]] std::uint64_t size() const { return offset_; }
  [[nodiscard]] std::uint64_t messages() const { return statistics_.messages; }

 private:
  Result<void> emit();

  Sink& sink_;
  Compression compression_;
  std::string buffer_;   // records that go to the sink together
  std::string records_;  // of a chunk, compressed
  std::uint64_t offset_ = 0;
  std::optional<Diagnostic> failure_;
  std::vector<ChunkIndex> chunks_;
  std::vector<AttachmentIndex> attachments_;
  std::vector<MetadataIndex> metadata_;
  Statistics statistics_;
};

}  // namespace sentree::record
