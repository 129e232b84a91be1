#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "sentree/base/result.h"
#include "sentree/record/mcap.h"

namespace sentree::record {

/// CRC-32 (zlib's) of `bytes`, continuing `crc`.
[[nodiscard]] std::uint32_t crc32_of(std::string_view bytes, std::uint32_t crc = 0);

/// `bytes` compressed into `out`, replacing it: an LZ4 frame or a Zstandard frame of the fastest level.
/// The same bytes and the same version of the compressor give the same result.
void compress(Compression compression, std::string_view bytes, std::string& out);

/// Exactly `size` bytes out of what `compression` ("", "lz4" or "zstd") made of them.
/// Errors: record.compression (one that is not known), record.damaged-chunk.
[[nodiscard]] Result<std::string> decompress(std::string_view compression, std::string_view bytes, std::size_t size);

}  // namespace sentree::record
