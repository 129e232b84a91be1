#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/record/mcap.h"
#include "sentree/record/source.h"

namespace sentree::record {

/// Largest chunk that is unpacked, and largest attachment, summary or other record that is read.
inline constexpr std::uint64_t kChunkSizeMax = std::uint64_t{256} << 20U;
inline constexpr std::uint64_t kRecordSizeMax = std::uint64_t{1} << 30U;
/// What all chunks of a file unpack to: so many bytes, and so many times its size. Recordings of days stay far below;
/// what writers make grows by some ten times.
inline constexpr std::uint64_t kUnpackedMax = std::uint64_t{1} << 30U;
inline constexpr std::uint64_t kUnpackedTimesMax = 250;
/// Messages outside of chunks are unpacked in pieces of up to this size, or of one message.
inline constexpr std::uint64_t kLooseSizeMax = std::uint64_t{4} << 20U;
/// Chunks of one file, with those that hold no message, and pieces of messages outside of chunks.
inline constexpr std::size_t kChunksMax = 1U << 20U;
/// Unpacked bytes of chunks whose times overlap, which are read side by side, if the query does not say.
inline constexpr std::uint64_t kOverlapMax = std::uint64_t{1} << 30U;
/// Problems that are kept.
inline constexpr std::size_t kReaderProblemsMax = 20;

/// Which messages; times are nanoseconds, both ends are included.
struct Query {
  std::vector<ChannelId> channels = {};  ///< Empty: all.
  std::uint64_t from = 0;
  std::uint64_t to = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t overlap_max = kOverlapMax;  ///< Unpacked bytes that may be held at a time.
};

/// An MCAP file, ours or another writer's. It may be damaged or cut off anywhere: what can be read is read.
///
/// A file with a summary is read through its indexes; without one (the writer was killed) it is scanned once.
class Reader {
 public:
  /// Errors: record.not-mcap, record.unreadable, record.too-large.
  [[nodiscard]] static Result<std::unique_ptr<Reader>> open(std::unique_ptr<Source> source, std::string name);
  /// The same of a file.
  [[nodiscard]] static Result<std::unique_ptr<Reader>> open(const std::string& path);

  /// False: the end is missing; `problems` says so.
  [[nodiscard]] bool complete() const { return complete_; }
  /// What was wrong so far, also with chunks that `read` came across.
  [[nodiscard]] const Diagnostics& problems() const { return problems_; }

  [[nodiscard]] const std::string& profile() const { return profile_; }
  [[nodiscard]] const std::string& library() const { return library_; }
  [[nodiscard]] const std::map<SchemaId, Schema>& schemas() const { return schemas_; }
  [[nodiscard]] const std::map<ChannelId, Channel>& channels() const { return channels_; }
  /// The channels of a topic.
  [[nodiscard]] std::vector<ChannelId> channels_of(std::string_view topic) const;
  [[nodiscard]] const std::vector<AttachmentIndex>& attachments() const { return attachments_; }
  [[nodiscard]] const std::vector<MetadataIndex>& metadata() const { return metadata_; }
  /// As the file says, or as counted when it was scanned.
  [[nodiscard]] const Statistics& statistics() const { return statistics_; }
  [[nodiscard]] std::uint64_t size() const { return source_->size(); }

  /// Errors: record.damaged, record.too-large, record.unreadable.
  [[nodiscard]] Result<Attachment> attachment(const AttachmentIndex& index);
  [[nodiscard]] Result<Metadata> metadata(const MetadataIndex& index);

  /// Gives `take` the messages in the order of their log times (equal times: in the order of the file) until it returns
  /// false. What it is given is borrowed until it returns. Damaged chunks are left out and told in `problems`.
  /// Cost: chunks that the query excludes are not read. Errors: record.overlap, record.unreadable.
  [[nodiscard]] Result<void> read(const Query& query, const std::function<bool(const RawMessage&)>& take);

  // For who keeps an index of places of their own: a file is a number of parts, by the time at which each begins.
  [[nodiscard]] std::size_t parts() const { return parts_.size(); }
  /// A part's records, unpacked. Errors: record.damaged-chunk, record.too-large, record.unreadable.
  [[nodiscard]] Result<std::string> part(std::size_t index);
  /// Gives `take` the messages of such records, in the order of the file; their data are views into `records`. Those
  /// of unknown channels are left out, and what follows something damaged.
  void each_message(std::string_view records, const std::function<void(const RawMessage&)>& take) const;

 private:
  // A chunk, or messages that lie in the file without one.
  struct Part {
    ChunkIndex index;
    bool loose = false;
  };
  struct OpenPart;

  explicit Reader(std::unique_ptr<Source> source, std::string name)
      : source_(std::move(source)), name_(std::move(name)) {}

  Result<bool> read_summary();
  Result<void> scan();
  void scan_part(Part part);
  void take_schema(std::string_view content);
  void take_channel(std::string_view content);
  bool take_summary_record(Op op, std::string_view content);
  Result<std::string> unpack(const Part& part);
  void problem(std::string code, std::string message);

  std::unique_ptr<Source> source_;
  std::string name_;
  bool complete_ = false;
  Diagnostics problems_;
  std::string profile_;
  std::string library_;
  std::map<SchemaId, Schema> schemas_;
  std::map<ChannelId, Channel> channels_;
  std::vector<Part> parts_;
  std::set<std::uint64_t> unpacked_;  // where chunks begin that were unpacked
  std::uint64_t unpacked_size_ = 0;   // of all of them
  std::vector<AttachmentIndex> attachments_;
  std::vector<MetadataIndex> metadata_;
  Statistics statistics_;
  bool has_statistics_ = false;
};

}  // namespace sentree::record
