#include "sentree/record/compression.h"

#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include <memory>

#include <fmt/format.h>

#include "sentree/base/assert.h"

namespace sentree::record {

namespace {

struct FreeZstd {
  void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
};
struct FreeLz4 {
  void operator()(LZ4F_dctx* context) const { LZ4F_freeDecompressionContext(context); }
};

constexpr int kZstdLevel = 1;

tl::unexpected<Diagnostic> damaged(const std::string& why) {
  return fail("record.damaged-chunk", "a chunk cannot be unpacked: " + why);
}

Result<std::string> decompress_lz4(std::string_view bytes, std::size_t size) {
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION))) return damaged("no memory for LZ4");
  const std::unique_ptr<LZ4F_dctx, FreeLz4> context(raw);
  std::string out(size, '\0');
  std::size_t written = 0;
  std::size_t hint = 1;
  while (!bytes.empty() && hint != 0) {
    std::size_t room = size - written;
    std::size_t taken = bytes.size();
    hint = LZ4F_decompress(context.get(), out.data() + written, &room, bytes.data(), &taken, nullptr);
    if (LZ4F_isError(hint)) return damaged(LZ4F_getErrorName(hint));
    if (taken == 0 && room == 0) break;  // more than was announced
    written += room;
    bytes.remove_prefix(taken);
  }
  if (hint != 0 || written != size) return damaged("it does not have the size that it says");
  return out;
}

}  // namespace

std::string_view to_string(Compression compression) {
  switch (compression) {
    case Compression::kNone: return "";
    case Compression::kLz4: return "lz4";
    case Compression::kZstd: return "zstd";
  }
  return "";
}

std::uint32_t crc32_of(std::string_view bytes, std::uint32_t crc) {
  return static_cast<std::uint32_t>(crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

void compress(Compression compression, std::string_view bytes, std::string& out) {
  if (compression == Compression::kNone) {
    out = bytes;
  } else if (compression == Compression::kLz4) {
    out.resize(LZ4F_compressFrameBound(bytes.size(), nullptr));
    const std::size_t size = LZ4F_compressFrame(out.data(), out.size(), bytes.data(), bytes.size(), nullptr);
    SENTREE_ASSERT(!LZ4F_isError(size));
    out.resize(size);
  } else {
    // A context costs more to make than a small chunk to compress.
    thread_local const std::unique_ptr<ZSTD_CCtx, FreeZstd> context(ZSTD_createCCtx());
    out.resize(ZSTD_compressBound(bytes.size()));
    const std::size_t size =
        ZSTD_compressCCtx(context.get(), out.data(), out.size(), bytes.data(), bytes.size(), kZstdLevel);
    SENTREE_ASSERT(!ZSTD_isError(size));
    out.resize(size);
  }
}

Result<std::string> decompress(std::string_view compression, std::string_view bytes, std::size_t size) {
  if (compression.empty()) {
    if (bytes.size() != size) return damaged("it does not have the size that it says");
    return std::string(bytes);
  }
  // Neither format packs more tightly, so that a few bytes cannot ask for a lot of memory.
  if (compression == "lz4") {
    if (size / 256 > bytes.size()) return damaged("it does not have the size that it says");
    return decompress_lz4(bytes, size);
  }
  if (compression == "zstd") {
    if (size / 40'000 > bytes.size()) return damaged("it does not have the size that it says");
    std::string out(size, '\0');
    const std::size_t got = ZSTD_decompress(out.data(), out.size(), bytes.data(), bytes.size());
    if (ZSTD_isError(got)) return damaged(ZSTD_getErrorName(got));
    if (got != size) return damaged("it does not have the size that it says");
    return out;
  }
  return fail("record.compression",
              fmt::format("compression \"{}\" is not known; there are lz4, zstd and none", compression));
}

}  // namespace sentree::record
