// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/compression.h"

#include "cuboid_mapping/io/byte_stream.h"

#include <zlib.h>
#include <zstd.h>
#include <zstd_errors.h>

#include <memory>
#include <new>

namespace cuboid_mapping {

std::uint32_t computeChecksum(std::string_view bytes) {
  uLong checksum = crc32(0L, Z_NULL, 0);
  constexpr std::size_t kStep_bytes = std::size_t{1} << 30;
  for (std::size_t i = 0; i < bytes.size(); i += kStep_bytes) {
    const std::string_view part = bytes.substr(i, kStep_bytes);
    checksum = crc32(checksum, reinterpret_cast<const Bytef*>(part.data()),
                     static_cast<uInt>(part.size()));
  }
  return static_cast<std::uint32_t>(checksum);
}

std::string compress(std::string_view payload, int level) {
  std::string compressed(ZSTD_compressBound(payload.size()), '\0');
  const std::size_t size =
      ZSTD_compress(compressed.data(), compressed.size(), payload.data(), payload.size(), level);
  if (ZSTD_isError(size) != 0) throw std::bad_alloc();  // it fails for lack of memory only
  compressed.resize(size);
  return compressed;
}

std::string decompress(std::string_view compressed, std::uint64_t claimed_bytes) {
  const std::unique_ptr<ZSTD_DCtx, std::size_t (*)(ZSTD_DCtx*)> context(ZSTD_createDCtx(),
                                                                        ZSTD_freeDCtx);
  if (context == nullptr) throw std::bad_alloc();
  std::string payload;
  std::string chunk(ZSTD_DStreamOutSize(), '\0');
  ZSTD_inBuffer in{compressed.data(), compressed.size(), 0};
  std::size_t is_open = 1;  // 0 at the end of the frame
  while (is_open != 0) {
    ZSTD_outBuffer out{chunk.data(), chunk.size(), 0};
    const std::size_t position = in.pos;
    is_open = ZSTD_decompressStream(context.get(), &out, &in);
    if (ZSTD_getErrorCode(is_open) == ZSTD_error_memory_allocation) throw std::bad_alloc();
    if (ZSTD_isError(is_open) != 0) failCorrupted("its content cannot be decompressed");
    payload.append(chunk, 0, out.pos);
    if (payload.size() > claimed_bytes) failCorrupted("its content is longer than its header says");
    if (is_open != 0 && out.pos == 0 && in.pos == position) {
      failCorrupted("its compressed content is cut off");
    }
  }
  if (in.pos != in.size || payload.size() != claimed_bytes) {
    failCorrupted("its content is not as long as its header says");
  }
  return payload;
}

}  // namespace cuboid_mapping
