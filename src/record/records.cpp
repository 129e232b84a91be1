#include "sentree/record/detail/records.h"
#include "sentree/record/compression.h"
#include "sentree/record/detail/bytes.h"

namespace sentree::record::detail {

namespace {

std::vector<std::pair<std::string, std::string>> get_strings(Cursor& cursor) {
  std::vector<std::pair<std::string, std::string>> entries;
  Cursor inside(cursor.string());
  while (inside.ok() && !inside.rest().empty()) {
    std::string key(inside.string());
    std::string value(inside.string());
    if (inside.ok()) entries.emplace_back(std::move(key), std::move(value));
  }
  return entries;
}

std::map<ChannelId, std::uint64_t> get_counts(Cursor& cursor) {
  std::map<ChannelId, std::uint64_t> counts;
  Cursor inside(cursor.string());
  while (inside.ok() && !inside.rest().empty()) {
    const auto channel = inside.get<ChannelId>();
    const auto count = inside.get<std::uint64_t>();
    if (inside.ok()) counts[channel] = count;
  }
  return counts;
}

template <class T>
std::optional<T> if_whole(const Cursor& cursor, T value) {
  if (!cursor.ok()) return std::nullopt;
  return value;
}

}  // namespace

// Members are read in the order of the fields: braces evaluate from left to right.
std::optional<Schema> read_schema(std::string_view content) {
  Cursor c(content);
  Schema schema{c.get<SchemaId>(), std::string(c.string()), std::string(c.string()), std::string(c.string())};
  return if_whole(c, std::move(schema));
}

std::optional<Channel> read_channel(std::string_view content) {
  Cursor c(content);
  Channel channel{c.get<ChannelId>(), c.get<SchemaId>(), std::string(c.string()), std::string(c.string()),
                  get_strings(c)};
  return if_whole(c, std::move(channel));
}

std::optional<RawMessage> read_message(std::string_view content) {
  Cursor c(content);
  RawMessage message{c.get<ChannelId>(), c.get<std::uint32_t>(), c.get<std::uint64_t>(), c.get<std::uint64_t>(), {}};
  message.data = c.rest();
  return if_whole(c, message);
}

std::optional<Attachment> read_attachment(std::string_view content) {
  Cursor c(content);
  Attachment attachment{
      c.get<std::uint64_t>(), c.get<std::uint64_t>(), std::string(c.string()), std::string(c.string()), {}};
  attachment.data = std::string(c.bytes(c.get<std::uint64_t>()));
  const std::size_t covered = content.size() - c.rest().size();
  const auto crc = c.get<std::uint32_t>();
  if (!c.ok() || (crc != 0 && crc32_of(content.substr(0, covered)) != crc)) return std::nullopt;
  return attachment;
}

std::optional<AttachmentIndex> read_attachment_head(std::string_view content) {
  Cursor c(content);
  AttachmentIndex index;
  index.log_time = c.get<std::uint64_t>();
  index.create_time = c.get<std::uint64_t>();
  index.name = std::string(c.string());
  index.media_type = std::string(c.string());
  index.data_size = c.get<std::uint64_t>();
  return if_whole(c, std::move(index));
}

std::optional<Metadata> read_metadata(std::string_view content) {
  Cursor c(content);
  Metadata metadata{std::string(c.string()), get_strings(c)};
  return if_whole(c, std::move(metadata));
}

std::optional<ChunkIndex> read_chunk_index(std::string_view content) {
  Cursor c(content);
  ChunkIndex index;
  index.start_time = c.get<std::uint64_t>();
  index.end_time = c.get<std::uint64_t>();
  index.offset = c.get<std::uint64_t>();
  index.length = c.get<std::uint64_t>();
  index.message_indexes = get_counts(c);
  index.message_index_length = c.get<std::uint64_t>();
  index.compression = std::string(c.string());
  index.compressed_size = c.get<std::uint64_t>();
  index.uncompressed_size = c.get<std::uint64_t>();
  return if_whole(c, std::move(index));
}

std::optional<AttachmentIndex> read_attachment_index(std::string_view content) {
  Cursor c(content);
  AttachmentIndex index{c.get<std::uint64_t>(), c.get<std::uint64_t>(),  c.get<std::uint64_t>(), c.get<std::uint64_t>(),
                        c.get<std::uint64_t>(), std::string(c.string()), std::string(c.string())};
  return if_whole(c, std::move(index));
}

std::optional<MetadataIndex> read_metadata_index(std::string_view content) {
  Cursor c(content);
  MetadataIndex index{c.get<std::uint64_t>(), c.get<std::uint64_t>(), std::string(c.string())};
  return if_whole(c, std::move(index));
}

std::optional<Statistics> read_statistics(std::string_view content) {
  Cursor c(content);
  Statistics s{c.get<std::uint64_t>(), c.get<std::uint16_t>(), c.get<std::uint32_t>(),
               c.get<std::uint32_t>(), c.get<std::uint32_t>(), c.get<std::uint32_t>(),
               c.get<std::uint64_t>(), c.get<std::uint64_t>(), get_counts(c)};
  return if_whole(c, std::move(s));
}

void read_header(std::string_view record, std::string& profile, std::string& library) {
  Cursor c(record);
  if (c.get<std::uint8_t>() != static_cast<std::uint8_t>(Op::kHeader)) return;
  (void)c.get<std::uint64_t>();
  profile = std::string(c.string());
  library = std::string(c.string());
}

bool for_each_record(std::string_view records, const std::function<bool(Op op, std::string_view content)>& take) {
  Cursor c(records);
  while (!c.rest().empty()) {
    const auto op = static_cast<Op>(c.get<std::uint8_t>());
    const std::string_view content = c.bytes(c.get<std::uint64_t>());
    if (!c.ok()) return false;
    if (!take(op, content)) return true;
  }
  return true;
}

}  // namespace sentree::record::detail
