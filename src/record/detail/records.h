#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "sentree/record/mcap.h"

namespace sentree::record::detail {

// The content of one record each; nothing if it is not what it should be. Fields added behind are ignored.
[[nodiscard]] std::optional<Schema> read_schema(std::string_view content);
[[nodiscard]] std::optional<Channel> read_channel(std::string_view content);
[[nodiscard]] std::optional<RawMessage> read_message(std::string_view content);
[[nodiscard]] std::optional<Attachment> read_attachment(std::string_view content);
/// Everything but the data, of which the content may lack the end; offset and length are the caller's to fill in.
[[nodiscard]] std::optional<AttachmentIndex> read_attachment_head(std::string_view content);
[[nodiscard]] std::optional<Metadata> read_metadata(std::string_view content);
[[nodiscard]] std::optional<ChunkIndex> read_chunk_index(std::string_view content);
[[nodiscard]] std::optional<AttachmentIndex> read_attachment_index(std::string_view content);
[[nodiscard]] std::optional<MetadataIndex> read_metadata_index(std::string_view content);
[[nodiscard]] std::optional<Statistics> read_statistics(std::string_view content);
/// Of a header record with its opcode and length.
void read_header(std::string_view record, std::string& profile, std::string& library);

/// Calls `take` with each record of a chunk until it returns false or the records end. False: they are damaged.
[[nodiscard]] bool for_each_record(std::string_view records,
                                   const std::function<bool(Op op, std::string_view content)>& take);

}  // namespace sentree::record::detail
