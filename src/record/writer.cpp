#include "sentree/record/writer.h"

#include <algorithm>
#include <utility>

#include "sentree/record/compression.h"
#include "sentree/record/detail/bytes.h"

namespace sentree::record {

using detail::begin_record;
using detail::end_record;
using detail::put;
using detail::put_string;

namespace {

void put_strings(std::string& out, const std::vector<std::pair<std::string, std::string>>& entries) {
  const std::size_t begin = out.size();
  put(out, std::uint32_t{0});
  for (const auto& [key, value] : entries) {
    put_string(out, key);
    put_string(out, value);
  }
  detail::patch(out, begin, static_cast<std::uint32_t>(out.size() - begin - 4));
}

void put_counts(std::string& out, const std::map<ChannelId, std::uint64_t>& counts) {
  put(out, static_cast<std::uint32_t>(counts.size() * 10));
  for (const auto& [channel, count] : counts) {
    put(out, channel);
    put(out, count);
  }
}

void put_schema(std::string& out, const Schema& schema) {
  const std::size_t begin = begin_record(out, Op::kSchema);
  put(out, schema.id);
  put_string(out, schema.name);
  put_string(out, schema.encoding);
  put_string(out, schema.data);
  end_record(out, begin);
}

void put_channel(std::string& out, const Channel& channel) {
  const std::size_t begin = begin_record(out, Op::kChannel);
  put(out, channel.id);
  put(out, channel.schema);
  put_string(out, channel.topic);
  put_string(out, channel.encoding);
  put_strings(out, channel.metadata);
  end_record(out, begin);
}

void put_chunk_index(std::string& out, const ChunkIndex& chunk) {
  const std::size_t begin = begin_record(out, Op::kChunkIndex);
  put(out, chunk.start_time);
  put(out, chunk.end_time);
  put(out, chunk.offset);
  put(out, chunk.length);
  put_counts(out, chunk.message_indexes);
  put(out, chunk.message_index_length);
  put_string(out, chunk.compression);
  put(out, chunk.compressed_size);
  put(out, chunk.uncompressed_size);
  end_record(out, begin);
}

void put_attachment_index(std::string& out, const AttachmentIndex& attachment) {
  const std::size_t begin = begin_record(out, Op::kAttachmentIndex);
  put(out, attachment.offset);
  put(out, attachment.length);
  put(out, attachment.log_time);
  put(out, attachment.create_time);
  put(out, attachment.data_size);
  put_string(out, attachment.name);
  put_string(out, attachment.media_type);
  end_record(out, begin);
}

void put_metadata_index(std::string& out, const MetadataIndex& metadata) {
  const std::size_t begin = begin_record(out, Op::kMetadataIndex);
  put(out, metadata.offset);
  put(out, metadata.length);
  put_string(out, metadata.name);
  end_record(out, begin);
}

void put_statistics(std::string& out, const Statistics& statistics) {
  const std::size_t begin = begin_record(out, Op::kStatistics);
  put(out, statistics.messages);
  put(out, statistics.schemas);
  put(out, statistics.channels);
  put(out, statistics.attachments);
  put(out, statistics.metadata);
  put(out, statistics.chunks);
  put(out, statistics.start_time);
  put(out, statistics.end_time);
  put_counts(out, statistics.channel_messages);
  end_record(out, begin);
}

}  // namespace

void Chunk::clear() {
  records.clear();
  start_time = end_time = messages = 0;
  for (auto& [channel, entries] : index) entries.clear();
}

void Chunk::add(const Schema& schema) { put_schema(records, schema); }
void Chunk::add(const Channel& channel) { put_channel(records, channel); }

void Chunk::add(const RawMessage& message) {
  const std::size_t begin = begin_message(message.channel, message.sequence, message.log_time, message.publish_time);
  records += message.data;
  end_message(begin);
}

std::size_t Chunk::begin_message(ChannelId channel, std::uint32_t sequence, std::uint64_t log_time,
                                 std::uint64_t publish_time) {
  index[channel].emplace_back(log_time, records.size());
  start_time = messages == 0 ? log_time : std::min(start_time, log_time);
  end_time = std::max(end_time, log_time);
  ++messages;
  const std::size_t begin = begin_record(records, Op::kMessage);
  put(records, channel);
  put(records, sequence);
  put(records, log_time);
  put(records, publish_time);
  return begin;
}

void Chunk::end_message(std::size_t begin) { end_record(records, begin); }

Writer::Writer(Sink& sink, Compression compression) : sink_(sink), compression_(compression) {}

Result<void> Writer::emit() {
  if (!failure_) {
    if (auto written = sink_.write(buffer_); !written) failure_ = written.error();
  }
  if (failure_) return tl::unexpected(*failure_);
  offset_ += buffer_.size();
  return {};
}

Result<void> Writer::begin(std::string_view profile, std::string_view library) {
  buffer_ = kMagic;
  const std::size_t begin = begin_record(buffer_, Op::kHeader);
  put_string(buffer_, profile);
  put_string(buffer_, library);
  end_record(buffer_, begin);
  return emit();
}

Result<void> Writer::write(const Chunk& chunk) {
  if (failure_) return tl::unexpected(*failure_);
  compress(compression_, chunk.records, records_);
  ChunkIndex entry{.start_time = chunk.start_time,
                   .end_time = chunk.end_time,
                   .offset = offset_,
                   .compression = std::string(to_string(compression_)),
                   .compressed_size = records_.size(),
                   .uncompressed_size = chunk.records.size(),
                   .message_indexes = {}};
  buffer_.clear();
  const std::size_t begin = begin_record(buffer_, Op::kChunk);
  put(buffer_, chunk.start_time);
  put(buffer_, chunk.end_time);
  put(buffer_, static_cast<std::uint64_t>(chunk.records.size()));
  put(buffer_, crc32_of(chunk.records));
  put_string(buffer_, to_string(compression_));
  put(buffer_, static_cast<std::uint64_t>(records_.size()));
  buffer_ += records_;
  end_record(buffer_, begin);
  entry.length = buffer_.size();
  for (const auto& [channel, messages] : chunk.index) {
    if (messages.empty()) continue;
    entry.message_indexes[channel] = offset_ + buffer_.size();
    const std::size_t index = begin_record(buffer_, Op::kMessageIndex);
    put(buffer_, channel);
    put(buffer_, static_cast<std::uint32_t>(messages.size() * 16));
    for (const auto& [time, place] : messages) {
      put(buffer_, time);
      put(buffer_, place);
    }
    end_record(buffer_, index);
  }
  entry.message_index_length = buffer_.size() - entry.length;
  if (auto written = emit(); !written) return written;

  chunks_.push_back(std::move(entry));
  if (chunk.messages > 0) {
    const bool first = statistics_.messages == 0;
    statistics_.start_time = first ? chunk.start_time : std::min(statistics_.start_time, chunk.start_time);
    statistics_.end_time = std::max(statistics_.end_time, chunk.end_time);
  }
  statistics_.messages += chunk.messages;
  for (const auto& [channel, messages] : chunk.index) {
    if (!messages.empty()) statistics_.channel_messages[channel] += messages.size();
  }
  return {};
}

Result<void> Writer::write(const Attachment& attachment) {
  if (failure_) return tl::unexpected(*failure_);
  buffer_.clear();
  const std::size_t begin = begin_record(buffer_, Op::kAttachment);
  put(buffer_, attachment.log_time);
  put(buffer_, attachment.create_time);
  put_string(buffer_, attachment.name);
  put_string(buffer_, attachment.media_type);
  put(buffer_, static_cast<std::uint64_t>(attachment.data.size()));
  buffer_ += attachment.data;
  put(buffer_, crc32_of(std::string_view(buffer_).substr(begin)));
  end_record(buffer_, begin);
  attachments_.push_back({offset_, buffer_.size(), attachment.log_time, attachment.create_time, attachment.data.size(),
                          attachment.name, attachment.media_type});
  return emit();
}

Result<void> Writer::write(const Metadata& metadata) {
  if (failure_) return tl::unexpected(*failure_);
  buffer_.clear();
  const std::size_t begin = begin_record(buffer_, Op::kMetadata);
  put_string(buffer_, metadata.name);
  put_strings(buffer_, metadata.entries);
  end_record(buffer_, begin);
  metadata_.push_back({offset_, buffer_.size(), metadata.name});
  return emit();
}

Result<void> Writer::end(const std::vector<Schema>& schemas, const std::vector<Channel>& channels) {
  if (failure_) return tl::unexpected(*failure_);
  buffer_.clear();
  const std::size_t data_end = begin_record(buffer_, Op::kDataEnd);
  put(buffer_, std::uint32_t{0});
  end_record(buffer_, data_end);

  const std::size_t summary = buffer_.size();
  std::vector<std::pair<Op, std::size_t>> groups;
  const auto group = [&](Op op, bool any) {
    if (any) groups.emplace_back(op, buffer_.size());
  };
  group(Op::kSchema, !schemas.empty());
  for (const Schema& schema : schemas) put_schema(buffer_, schema);
  group(Op::kChannel, !channels.empty());
  for (const Channel& channel : channels) put_channel(buffer_, channel);
  statistics_.schemas = static_cast<std::uint16_t>(schemas.size());
  statistics_.channels = static_cast<std::uint32_t>(channels.size());
  statistics_.attachments = static_cast<std::uint32_t>(attachments_.size());
  statistics_.metadata = static_cast<std::uint32_t>(metadata_.size());
  statistics_.chunks = static_cast<std::uint32_t>(chunks_.size());
  group(Op::kStatistics, true);
  put_statistics(buffer_, statistics_);
  group(Op::kChunkIndex, !chunks_.empty());
  for (const ChunkIndex& chunk : chunks_) put_chunk_index(buffer_, chunk);
  group(Op::kAttachmentIndex, !attachments_.empty());
  for (const AttachmentIndex& attachment : attachments_) put_attachment_index(buffer_, attachment);
  group(Op::kMetadataIndex, !metadata_.empty());
  for (const MetadataIndex& metadata : metadata_) put_metadata_index(buffer_, metadata);

  const std::size_t offsets = buffer_.size();
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const std::size_t until = i + 1 < groups.size() ? groups[i + 1].second : offsets;
    const std::size_t begin = begin_record(buffer_, Op::kSummaryOffset);
    put(buffer_, static_cast<std::uint8_t>(groups[i].first));
    put(buffer_, static_cast<std::uint64_t>(offset_ + groups[i].second));
    put(buffer_, static_cast<std::uint64_t>(until - groups[i].second));
    end_record(buffer_, begin);
  }
  const std::size_t footer = begin_record(buffer_, Op::kFooter);
  put(buffer_, static_cast<std::uint64_t>(offset_ + summary));
  put(buffer_, static_cast<std::uint64_t>(offset_ + offsets));
  // The checksum covers the beginning of the footer too, its length included.
  detail::patch(buffer_, footer - 8, static_cast<std::uint64_t>(kFooterSize));
  put(buffer_, crc32_of(std::string_view(buffer_).substr(summary)));
  buffer_ += kMagic;
  return emit();
}

}  // namespace sentree::record
