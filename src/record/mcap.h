#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace sentree::record {

// The records of MCAP (https://mcap.dev/spec, version 0), as far as both sides share them. Times are nanoseconds.

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};

enum class Op : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kAttachment = 0x09,
  kAttachmentIndex = 0x0A,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

/// Opcode and length before every record.
inline constexpr std::size_t kRecordHeaderSize = 9;
/// Channel, sequence, log time and publish time before the data of a message.
inline constexpr std::size_t kMessageHeaderSize = 22;
/// Content of a footer.
inline constexpr std::size_t kFooterSize = 20;

using SchemaId = std::uint16_t;   ///< From 1.
using ChannelId = std::uint16_t;  ///< From 1 in files of ours.

struct Schema {
  SchemaId id = 0;
  std::string name;
  std::string encoding;  ///< "jsonschema", "protobuf", …
  std::string data;
  friend bool operator==(const Schema&, const Schema&) = default;
};

struct Channel {
  ChannelId id = 0;
  SchemaId schema = 0;  ///< 0: none.
  std::string topic;
  std::string encoding;  ///< Of messages: "json", "protobuf", …
  std::vector<std::pair<std::string, std::string>> metadata;
  friend bool operator==(const Channel&, const Channel&) = default;
};

/// A message as it lies in a chunk; `data` is borrowed.
struct RawMessage {
  ChannelId channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time = 0;
  std::uint64_t publish_time = 0;
  std::string_view data;
};

struct Attachment {
  std::uint64_t log_time = 0;
  std::uint64_t create_time = 0;
  std::string name;
  std::string media_type;
  std::string data;
  friend bool operator==(const Attachment&, const Attachment&) = default;
};

/// Names with values, under one name.
struct Metadata {
  std::string name;
  std::vector<std::pair<std::string, std::string>> entries;
  friend bool operator==(const Metadata&, const Metadata&) = default;
};

struct ChunkIndex {
  std::uint64_t start_time = 0;  ///< Of the earliest message.
  std::uint64_t end_time = 0;    ///< Of the latest.
  std::uint64_t offset = 0;      ///< Of the record in the file.
  std::uint64_t length = 0;      ///< Of the record with its header.
  std::string compression;
  std::uint64_t compressed_size = 0;
  std::uint64_t uncompressed_size = 0;
  std::map<ChannelId, std::uint64_t> message_indexes;  ///< Offsets in the file.
  std::uint64_t message_index_length = 0;
};

struct AttachmentIndex {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::uint64_t log_time = 0;
  std::uint64_t create_time = 0;
  std::uint64_t data_size = 0;
  std::string name;
  std::string media_type;
};

struct MetadataIndex {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::string name;
};

struct Statistics {
  std::uint64_t messages = 0;
  std::uint16_t schemas = 0;
  std::uint32_t channels = 0;
  std::uint32_t attachments = 0;
  std::uint32_t metadata = 0;
  std::uint32_t chunks = 0;
  std::uint64_t start_time = 0;
  std::uint64_t end_time = 0;
  std::map<ChannelId, std::uint64_t> channel_messages;
};

enum class Compression : std::uint8_t { kNone, kLz4, kZstd };
/// "", "lz4", "zstd": the names of the standard.
[[nodiscard]] std::string_view to_string(Compression compression);

}  // namespace sentree::record
