#include "sentree/record/reader.h"

#include <algorithm>
#include <optional>
#include <queue>

#include <fmt/format.h>

#include "sentree/record/compression.h"
#include "sentree/record/detail/bytes.h"
#include "sentree/record/detail/records.h"

namespace sentree::record {

using detail::Cursor;

void Reader::problem(std::string code, std::string message) {
  if (problems_.size() < kReaderProblemsMax)
    problems_.push_back({Severity::kWarning, std::move(code), std::move(message), SourceSpan{name_}});
}

std::vector<ChannelId> Reader::channels_of(std::string_view topic) const {
  std::vector<ChannelId> found;
  for (const auto& [id, channel] : channels_) {
    if (channel.topic == topic) found.push_back(id);
  }
  return found;
}

Result<std::unique_ptr<Reader>> Reader::open(const std::string& path) {
  auto source = FileSource::open(path);
  if (!source) return tl::unexpected(source.error());
  return open(std::move(*source), path);
}

Result<std::unique_ptr<Reader>> Reader::open(std::unique_ptr<Source> source, std::string name) {
  std::unique_ptr<Reader> reader(new Reader(std::move(source), std::move(name)));
  const auto magic = reader->source_->read(0, kMagic.size());
  if (!magic) return tl::unexpected(magic.error());
  if (*magic != kMagic)
    return fail("record.not-mcap", "not a recording: it does not begin as an MCAP file does",
                SourceSpan{reader->name_});
  const auto summarized = reader->read_summary();
  if (!summarized) return tl::unexpected(summarized.error());
  if (!*summarized) {
    if (auto scanned = reader->scan(); !scanned) return tl::unexpected(scanned.error());
  }
  std::stable_sort(reader->parts_.begin(), reader->parts_.end(),
                   [](const Part& a, const Part& b) { return a.index.start_time < b.index.start_time; });
  return reader;
}

void Reader::take_schema(std::string_view content) {
  if (auto schema = detail::read_schema(content); schema && schema->id != 0) schemas_[schema->id] = std::move(*schema);
}

void Reader::take_channel(std::string_view content) {
  if (auto channel = detail::read_channel(content)) channels_[channel->id] = std::move(*channel);
}

bool Reader::take_summary_record(Op op, std::string_view content) {
  switch (op) {
    case Op::kSchema: take_schema(content); return true;
    case Op::kChannel: take_channel(content); return true;
    case Op::kChunkIndex: {
      auto index = detail::read_chunk_index(content);
      if (!index || parts_.size() >= kChunksMax) return false;
      parts_.push_back({std::move(*index), false});
      return true;
    }
    case Op::kAttachmentIndex: {
      auto index = detail::read_attachment_index(content);
      if (!index) return false;
      attachments_.push_back(std::move(*index));
      return true;
    }
    case Op::kMetadataIndex: {
      auto index = detail::read_metadata_index(content);
      if (!index) return false;
      metadata_.push_back(std::move(*index));
      return true;
    }
    case Op::kStatistics: {
      auto statistics = detail::read_statistics(content);
      if (!statistics) return false;
      statistics_ = std::move(*statistics);
      has_statistics_ = true;
      return true;
    }
    default: return true;
  }
}

// True if the file has a summary with everything that is needed to read it through its indexes.
Result<bool> Reader::read_summary() {
  const std::uint64_t size = source_->size();
  constexpr std::uint64_t kTail = kRecordHeaderSize + kFooterSize + kMagic.size();
  if (size < kMagic.size() + kTail) return false;
  const auto tail = source_->read(size - kTail, kTail);
  if (!tail) return tl::unexpected(tail.error());
  if (tail->size() != kTail || !std::string_view(*tail).ends_with(kMagic)) return false;
  Cursor footer(*tail);
  if (footer.get<std::uint8_t>() != static_cast<std::uint8_t>(Op::kFooter) ||
      footer.get<std::uint64_t>() != kFooterSize)
    return false;
  complete_ = true;
  const auto start = footer.get<std::uint64_t>();
  (void)footer.get<std::uint64_t>();
  const auto crc = footer.get<std::uint32_t>();
  const std::uint64_t end = size - kTail;
  if (start < kMagic.size() || start >= end || end - start > kRecordSizeMax) return false;
  // Through the footer's first two fields, which the checksum covers.
  const auto summary = source_->read(start, end - start + kRecordHeaderSize + 16);
  if (!summary) return tl::unexpected(summary.error());
  if (crc != 0 && crc32_of(*summary) != crc) {
    problem("record.damaged", "the summary is damaged; the file is read from its beginning");
    return false;
  }
  Cursor cursor(std::string_view(*summary).substr(0, end - start));
  bool sound = true;
  while (sound && !cursor.rest().empty()) {
    const auto op = static_cast<Op>(cursor.get<std::uint8_t>());
    const std::string_view content = cursor.bytes(cursor.get<std::uint64_t>());
    sound = cursor.ok() && take_summary_record(op, content);
  }
  for (const Part& part : parts_) {
    for (const auto& [channel, offset] : part.index.message_indexes) sound = sound && channels_.contains(channel);
  }
  // Messages outside of chunks have no index; without statistics nobody knows whether there are any.
  std::uint64_t indexed = parts_.size();
  sound = sound && has_statistics_ && statistics_.chunks == indexed && (statistics_.messages == 0 || indexed > 0);
  if (sound && !channels_.empty()) {
    const auto header = source_->read(kMagic.size(), std::min<std::uint64_t>(start - kMagic.size(), 4096));
    if (header) detail::read_header(*header, profile_, library_);
    return true;
  }
  schemas_.clear();
  channels_.clear();
  parts_.clear();
  attachments_.clear();
  metadata_.clear();
  statistics_ = {};
  return false;
}

// Unpacks a part to count its messages and to learn its schemas and channels.
void Reader::scan_part(Part part) {
  const auto records = unpack(part);
  if (!records) {
    problem(records.error().code, records.error().message);
    return;
  }
  bool any = false;
  const bool sound = detail::for_each_record(*records, [&](Op op, std::string_view content) {
    if (op == Op::kSchema) take_schema(content);
    if (op == Op::kChannel) take_channel(content);
    if (op != Op::kMessage) return true;
    const auto message = detail::read_message(content);
    if (!message) return true;
    part.index.start_time = any ? std::min(part.index.start_time, message->log_time) : message->log_time;
    part.index.end_time = any ? std::max(part.index.end_time, message->log_time) : message->log_time;
    any = true;
    const bool first = statistics_.messages++ == 0;
    statistics_.start_time = first ? message->log_time : std::min(statistics_.start_time, message->log_time);
    statistics_.end_time = std::max(statistics_.end_time, message->log_time);
    ++statistics_.channel_messages[message->channel];
    return true;
  });
  if (!sound) problem("record.damaged-chunk", fmt::format("the chunk at byte {} is damaged", part.index.offset));
  if (any) parts_.push_back(std::move(part));
}

Result<void> Reader::scan() {
  const std::uint64_t size = source_->size();
  std::uint64_t offset = kMagic.size();
  std::optional<Part> loose;
  const auto end_loose = [&] {
    if (loose) scan_part(std::move(*loose));
    loose.reset();
  };
  bool whole = false;
  std::size_t pieces = 0;
  while (offset + kRecordHeaderSize <= size) {
    const auto head = source_->read(offset, kRecordHeaderSize);
    if (!head) return tl::unexpected(head.error());
    Cursor cursor(*head);
    const auto op = static_cast<Op>(cursor.get<std::uint8_t>());
    const auto length = cursor.get<std::uint64_t>();
    if (length > size - offset - kRecordHeaderSize) break;
    const std::uint64_t total = kRecordHeaderSize + length;
    const bool is_loose = op == Op::kSchema || op == Op::kChannel || op == Op::kMessage;
    if (is_loose && loose && loose->index.length + total <= kLooseSizeMax) {
      loose->index.length += total;
    } else {
      end_loose();
      // Those without messages count too: each costs the work of unpacking it.
      if ((is_loose || op == Op::kChunk) && ++pieces > kChunksMax)
        return fail("record.too-large", fmt::format("more than {} chunks", kChunksMax), SourceSpan{name_});
      if (is_loose) {
        loose = Part{{.offset = offset, .length = total, .compression = {}, .message_indexes = {}}, true};
      } else if (op == Op::kChunk) {
        ++statistics_.chunks;
        scan_part({{.offset = offset, .length = total, .compression = {}, .message_indexes = {}}, false});
      } else if (op == Op::kHeader || op == Op::kAttachment || op == Op::kMetadata) {
        // An attachment's data are not needed: its beginning is.
        const auto content = source_->read(offset, std::min<std::uint64_t>(total, op == Op::kMetadata ? total : 65536));
        if (!content) return tl::unexpected(content.error());
        const std::string_view after = std::string_view(*content).substr(kRecordHeaderSize);
        if (op == Op::kHeader) {
          detail::read_header(*content, profile_, library_);
        } else if (op == Op::kAttachment) {
          if (auto index = detail::read_attachment_head(after)) {
            index->offset = offset;
            index->length = total;
            attachments_.push_back(std::move(*index));
          }
        } else if (auto metadata = detail::read_metadata(after)) {
          metadata_.push_back({offset, total, metadata->name});
        }
      } else if (op == Op::kDataEnd || op == Op::kFooter) {
        whole = true;
        break;
      }
    }
    offset += total;
  }
  end_loose();
  statistics_.schemas = static_cast<std::uint16_t>(schemas_.size());
  statistics_.channels = static_cast<std::uint32_t>(channels_.size());
  statistics_.attachments = static_cast<std::uint32_t>(attachments_.size());
  statistics_.metadata = static_cast<std::uint32_t>(metadata_.size());
  if (!whole || !complete_) {
    complete_ = false;
    problem("record.cut-off", "the end is missing: whoever wrote it was interrupted; what was written is read");
  }
  return {};
}

Result<std::string> Reader::unpack(const Part& part) {
  const ChunkIndex& index = part.index;
  if (index.length > kRecordSizeMax)
    return fail("record.too-large", fmt::format("a chunk of {} bytes", index.length), SourceSpan{name_});
  auto bytes = source_->read(index.offset, index.length);
  if (!bytes || part.loose) return bytes;
  Cursor cursor(*bytes);
  const auto op = static_cast<Op>(cursor.get<std::uint8_t>());
  const auto length = cursor.get<std::uint64_t>();
  if (!cursor.ok() || op != Op::kChunk || length != cursor.rest().size())
    return fail("record.damaged-chunk", fmt::format("there is no chunk at byte {}", index.offset), SourceSpan{name_});
  (void)cursor.get<std::uint64_t>();
  (void)cursor.get<std::uint64_t>();
  const auto size = cursor.get<std::uint64_t>();
  const auto crc = cursor.get<std::uint32_t>();
  const std::string_view compression = cursor.string();
  const std::string_view packed = cursor.bytes(cursor.get<std::uint64_t>());
  if (!cursor.ok() || size > kChunkSizeMax)
    return fail("record.damaged-chunk", fmt::format("the chunk at byte {} is damaged or too large", index.offset),
                SourceSpan{name_});
  if (!unpacked_.contains(index.offset)) {
    if (size > kUnpackedMax + kUnpackedTimesMax * source_->size() - unpacked_size_) {
      return fail(
          "record.too-large",
          fmt::format("its chunks unpack to more than {} times its {} bytes: the rest, from byte {} on, is left "
                      "out",
                      kUnpackedTimesMax, source_->size(), index.offset),
          SourceSpan{name_});
    }
    unpacked_.insert(index.offset);
    unpacked_size_ += size;
  }
  auto records = decompress(compression, packed, size);
  if (!records) {
    records.error().span = SourceSpan{name_};
    return records;
  }
  if (crc != 0 && crc32_of(*records) != crc)
    return fail("record.damaged-chunk", fmt::format("the chunk at byte {} is damaged", index.offset),
                SourceSpan{name_});
  return records;
}

Result<std::string> Reader::part(std::size_t index) {
  if (index >= parts_.size())
    return fail("record.damaged", fmt::format("there is no part {}", index), SourceSpan{name_});
  return unpack(parts_[index]);
}

void Reader::each_message(std::string_view records, const std::function<void(const RawMessage&)>& take) const {
  (void)detail::for_each_record(records, [&](Op op, std::string_view content) {
    if (op != Op::kMessage) return true;
    const auto message = detail::read_message(content);
    if (message && channels_.contains(message->channel)) take(*message);
    return message.has_value();
  });
}

Result<Attachment> Reader::attachment(const AttachmentIndex& index) {
  if (index.length > kRecordSizeMax)
    return fail("record.too-large", fmt::format("attachment \"{}\" is larger than can be read", index.name),
                SourceSpan{name_});
  const auto bytes = source_->read(index.offset, index.length);
  if (!bytes) return tl::unexpected(bytes.error());
  auto attachment = bytes->size() > kRecordHeaderSize
                        ? detail::read_attachment(std::string_view(*bytes).substr(kRecordHeaderSize))
                        : std::nullopt;
  if (!attachment)
    return fail("record.damaged", fmt::format("attachment \"{}\" is damaged", index.name), SourceSpan{name_});
  return std::move(*attachment);
}

Result<Metadata> Reader::metadata(const MetadataIndex& index) {
  if (index.length > kRecordSizeMax)
    return fail("record.too-large", fmt::format("metadata \"{}\" is larger than can be read", index.name),
                SourceSpan{name_});
  const auto bytes = source_->read(index.offset, index.length);
  if (!bytes) return tl::unexpected(bytes.error());
  auto metadata = bytes->size() > kRecordHeaderSize
                      ? detail::read_metadata(std::string_view(*bytes).substr(kRecordHeaderSize))
                      : std::nullopt;
  if (!metadata)
    return fail("record.damaged", fmt::format("metadata \"{}\" is damaged", index.name), SourceSpan{name_});
  return std::move(*metadata);
}

struct Reader::OpenPart {
  std::string records;
  std::vector<RawMessage> messages;  // that the query wants, by time
  std::size_t next = 0;
};

Result<void> Reader::read(const Query& query, const std::function<bool(const RawMessage&)>& take) {
  const auto wanted = [&](ChannelId channel) {
    return query.channels.empty() ||
           std::find(query.channels.begin(), query.channels.end(), channel) != query.channels.end();
  };
  const auto open_part = [&](const Part& part) -> OpenPart {
    OpenPart open;
    auto records = unpack(part);
    if (!records) {
      problem(records.error().code, records.error().message);
      return open;
    }
    open.records = std::move(*records);
    bool unknown = false;
    const bool sound = detail::for_each_record(open.records, [&](Op op, std::string_view content) {
      if (op != Op::kMessage) return true;
      const auto message = detail::read_message(content);
      if (!message) return false;
      unknown = unknown || !channels_.contains(message->channel);
      if (wanted(message->channel) && channels_.contains(message->channel) && message->log_time >= query.from &&
          message->log_time <= query.to)
        open.messages.push_back(*message);
      return true;
    });
    if (!sound || unknown) {
      problem("record.damaged-chunk", fmt::format("the chunk at byte {} {}", part.index.offset,
                                                  sound ? "names unknown channels" : "is damaged inside"));
    }
    const auto earlier = [](const RawMessage& a, const RawMessage& b) { return a.log_time < b.log_time; };
    if (!std::is_sorted(open.messages.begin(), open.messages.end(), earlier))
      std::stable_sort(open.messages.begin(), open.messages.end(), earlier);
    return open;
  };

  // Chunks whose times overlap are merged; `parts_` is sorted by the time at which each begins.
  std::map<std::size_t, OpenPart> open;
  using Next = std::pair<std::uint64_t, std::size_t>;  // time, part
  std::priority_queue<Next, std::vector<Next>, std::greater<>> queue;
  std::uint64_t held = 0;
  std::size_t next_part = 0;
  for (;;) {
    while (next_part < parts_.size() && (queue.empty() || parts_[next_part].index.start_time <= queue.top().first)) {
      const std::size_t index = next_part++;
      const ChunkIndex& facts = parts_[index].index;
      if (facts.start_time > query.to || facts.end_time < query.from) continue;
      const bool relevant =
          facts.message_indexes.empty() || std::any_of(facts.message_indexes.begin(), facts.message_indexes.end(),
                                                       [&](const auto& entry) { return wanted(entry.first); });
      if (!relevant) continue;
      OpenPart part = open_part(parts_[index]);
      if (part.messages.empty()) continue;
      held += part.records.size();
      if (held > query.overlap_max)
        return fail("record.overlap", "too many chunks overlap in time to be read in order", SourceSpan{name_});
      queue.emplace(part.messages.front().log_time, index);
      open.emplace(index, std::move(part));
    }
    if (queue.empty()) {
      if (next_part >= parts_.size()) return {};
      continue;
    }
    const std::size_t index = queue.top().second;
    queue.pop();
    OpenPart& part = open.at(index);
    if (!take(part.messages[part.next])) return {};
    if (++part.next < part.messages.size()) {
      queue.emplace(part.messages[part.next].log_time, index);
    } else {
      held -= part.records.size();
      open.erase(index);
    }
  }
}

}  // namespace sentree::record
