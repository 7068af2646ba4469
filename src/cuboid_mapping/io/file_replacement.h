// SPDX-License-Identifier: BSD-3-Clause
// Files that are read at once, and replaced as a whole or not at all.
#pragma once

#include "cuboid_mapping/io/map_file_error.h"

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

namespace cuboid_mapping {

/// All bytes of a file. @throws MapFileError: kInaccessible when it is not there, a folder, a device, a
/// pipe, not readable, or its name has a zero byte, as for all functions here; kTooBig when it has more bytes than
/// allowed.
[[nodiscard]] std::string readFile(
    const std::string& file, std::uint64_t max_bytes = std::numeric_limits<std::uint64_t>::max());

/// Replaces the content of a file, all of it or none: a reader finds the old content or the new one,
/// also after a crash of the program or the machine.
///
/// A symbolic link stays, and its target is replaced; permissions stay. Writes FILE.partial in the same folder, flushes
/// it to the disk, and renames it to FILE. After an error FILE is as it was and FILE.partial is gone; after a crash
/// the latter may stay, and the next call removes it first, also a link. Of two calls for one file at once, also of
/// two programs, one fails and says so.
///
/// @throws MapFileError (kInaccessible) with the system's reason: an unwritable folder, a path that
///         is a folder, a device or a pipe, a full disk.
void replaceFile(const std::string& file, std::string_view bytes);

/// As above, for content written by a function.
/// @param write  Writes the file whose name it gets; its exceptions are passed on.
void replaceFile(const std::string& file, const std::function<void(const std::string&)>& write);

/// Refuses a folder, a device or a pipe, which may be waited for for ever. Nothing happens if nothing is there.
/// @throws MapFileError (kInaccessible)
void requireFile(const std::string& file);

/// The size of a file and the time of its last change. Another value after each replaceFile(), also of another program,
/// unless it writes as many bytes within the same tick of the system's clock, some milliseconds.
struct FileVersion {
  std::uint64_t num_bytes = 0;
  std::int64_t seconds = 0;
  std::int64_t nanoseconds = 0;

  friend bool operator==(const FileVersion& a, const FileVersion& b) {
    return a.num_bytes == b.num_bytes && a.seconds == b.seconds && a.nanoseconds == b.nanoseconds;
  }
};

/// Nothing if there is no file. Follows symbolic links.
[[nodiscard]] std::optional<FileVersion> versionOf(const std::string& file);

/// Whether replaceFile() could begin, for programs that work long before they write.
/// @throws MapFileError (kInaccessible) as replaceFile() does. The file stays as it is.
void checkReplaceable(const std::string& file);

}  // namespace cuboid_mapping
