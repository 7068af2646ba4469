// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/file_replacement.h"

#include <fcntl.h>
#include <mntent.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <system_error>
#include <utility>

namespace cuboid_mapping {
namespace {

namespace fs = std::filesystem;

// Opening a pipe with these flags does not wait for its other end.
constexpr int kForReading = O_RDONLY | O_NONBLOCK | O_CLOEXEC;
constexpr int kForWriting = O_WRONLY | O_CREAT | O_TRUNC | O_NONBLOCK | O_CLOEXEC;

[[noreturn]] void fail(const std::string& action, const std::string& file, int code) {
  std::string text = action;
  text += ' ' + file + ": " + std::strerror(code);
  if (code == ENOENT) text += " (paths are relative to the folder the program runs in)";
  throw MapFileError(MapFileDefect::kInaccessible, text);
}

/// The system would cut the name off there, and take another file.
void refuseZeroByte(const std::string& action, const std::string& file) {
  if (file.find('\0') == std::string::npos) return;
  throw MapFileError(MapFileDefect::kInaccessible,
                     action + ' ' + file.c_str() + "...: its name has a zero byte");
}

/// A descriptor that is closed by the destructor.
class Descriptor {
 public:
  Descriptor(const std::string& file, int flags) : descriptor_(open(file.c_str(), flags, 0666)) {}
  ~Descriptor() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  [[nodiscard]] int get() const { return descriptor_; }
  [[nodiscard]] bool isOpen() const { return descriptor_ >= 0; }
  /// @return Whether all written bytes arrived.
  bool close() { return ::close(std::exchange(descriptor_, -1)) == 0; }

 private:
  int descriptor_;
};

/// Removes a file in the destructor, unless told to keep it. Needs no memory: the file is there when it begins.
class Removal {
 public:
  /// @param file  Must outlive this object.
  explicit Removal(const std::string& file) : file_(&file) {}
  ~Removal() {
    if (file_ != nullptr) ::unlink(file_->c_str());
  }
  Removal(const Removal&) = delete;
  Removal& operator=(const Removal&) = delete;
  void cancel() { file_ = nullptr; }

 private:
  const std::string* file_;
};

void writeAll(const Descriptor& descriptor, std::string_view bytes, const std::string& file) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(descriptor.get(), bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail("cannot write", file, errno);
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
}

/// Flushes to the disk, if the file system can. @return Whether this succeeded; errno says why not.
bool synchronize(const std::string& path, int flags) {
  Descriptor descriptor(path, flags);
  if (!descriptor.isOpen()) return false;
  return (fsync(descriptor.get()) == 0 || errno == EINVAL) && descriptor.close();
}

/// Refuses devices and pipes: they may never end, and must not be replaced.
void requireRegular(const struct stat& status, const std::string& action, const std::string& file) {
  if (S_ISREG(status.st_mode)) return;
  if (S_ISDIR(status.st_mode)) fail(action, file, EISDIR);
  throw MapFileError(MapFileDefect::kInaccessible,
                     action + ' ' + file + ": it is a device or a pipe, not a file");
}

/// The file that a symbolic link names in the end; it need not be there.
std::string targetOf(const std::string& file) {
  constexpr int kMaxLinks = 40;  // As Linux.
  fs::path target = file;
  std::error_code error;  // If the path cannot be read, writing fails, too, and reports it.
  for (int i = 0; i < kMaxLinks; ++i) {
    if (!fs::is_symlink(target, error)) return target.string();
    target = target.parent_path() / fs::read_symlink(target, error);
  }
  fail("cannot write", file, ELOOP);
}

/// Whether a file system, or another file, is mounted at a path. Renaming would fail, at the end of the work.
bool isMountPoint(const std::string& path) {
  std::error_code error;
  const std::string real = fs::canonical(path, error).string();
  const std::unique_ptr<FILE, int (*)(FILE*)> mounts(setmntent("/proc/self/mounts", "r"),
                                                     endmntent);
  if (!mounts) return false;
  mntent entry{};
  std::array<char, 4 * PATH_MAX> text{};
  while (getmntent_r(mounts.get(), &entry, text.data(), static_cast<int>(text.size())) != nullptr) {
    if (real == entry.mnt_dir) return true;
  }
  return false;
}

/// Gives a new file the permissions of the one that it replaces, if there is one and the file system has permissions.
void keepPermissions(const Descriptor& partial, const std::string& target) {
  struct stat old {};
  struct stat status {};
  if (::stat(target.c_str(), &old) != 0 || fstat(partial.get(), &status) != 0) return;
  if (S_ISREG(status.st_mode)) (void)fchmod(partial.get(), old.st_mode & 07777);
}

[[noreturn]] void failAsBusy(const std::string& file) {
  throw MapFileError(
      MapFileDefect::kInaccessible,
      "cannot write " + file + ": another program, or call, is writing it: try again later");
}

/// Whether this program has the lock now, or the file system has none.
bool tryLock(const Descriptor& descriptor) {
  return ::flock(descriptor.get(), LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
}

/// Removes the temporary file of a program that was killed. What a link there names is not ours to overwrite.
/// @throws MapFileError while another program, or thread, writes it.
void removeLeftover(const std::string& partial, const std::string& file) {
  const Descriptor leftover(partial, kForReading | O_NOFOLLOW);
  if (leftover.isOpen() && !tryLock(leftover)) failAsBusy(file);
  (void)::unlink(partial.c_str());
}

/// A file that will be replaced, and the temporary file beside it.
struct Replacement {
  std::string target;
  std::string partial;
};

/// @throws MapFileError when the path cannot be that of a file.
Replacement replacementOf(const std::string& file) {
  if (file.empty()) fail("cannot write", "''", ENOENT);
  refuseZeroByte("cannot write", file);
  const std::string target = targetOf(file);
  struct stat status {};
  // If stat() fails, writing fails, too, and reports it.
  if (::stat(target.c_str(), &status) == 0) {
    requireRegular(status, "cannot write", file);
    if (isMountPoint(target)) {
      throw MapFileError(
          MapFileDefect::kInaccessible,
          "cannot write " + file +
              ": it is mounted as a single file, which cannot be replaced: mount its "
              "folder instead");
    }
  }
  constexpr char kEnding[] = ".partial";
  constexpr std::size_t kLongestName = NAME_MAX + 1 - sizeof(kEnding);
  const fs::path path = target;
  const std::string name = path.filename().string();
  const bool is_long = name.size() > kLongestName && name.size() <= NAME_MAX;
  const std::string partial =
      is_long ? (path.parent_path() / (name.substr(0, kLongestName) + kEnding)).string()
              : target + kEnding;
  removeLeftover(partial, file);
  return {target, partial};
}

}  // namespace

void requireFile(const std::string& file) {
  refuseZeroByte("cannot open", file);
  struct stat status {};
  if (::stat(file.c_str(), &status) == 0) requireRegular(status, "cannot open", file);
}

std::optional<FileVersion> versionOf(const std::string& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return std::nullopt;
  return FileVersion{static_cast<std::uint64_t>(status.st_size), status.st_mtim.tv_sec,
                     status.st_mtim.tv_nsec};
}

void checkReplaceable(const std::string& file) {
  const std::string partial = replacementOf(file).partial;
  const Removal removal(partial);
  if (!Descriptor(partial, kForWriting).isOpen()) fail("cannot write", file, errno);
}

std::string readFile(const std::string& file, std::uint64_t max_bytes) {
  refuseZeroByte("cannot read", file);
  const Descriptor descriptor(file, kForReading);
  struct stat status {};
  if (!descriptor.isOpen() || fstat(descriptor.get(), &status) != 0) {
    fail("cannot read", file, errno);
  }
  requireRegular(status, "cannot read", file);
  const auto num_bytes = static_cast<std::uint64_t>(std::max<off_t>(status.st_size, 0));
  const auto require_few = [&](std::uint64_t count) {
    if (count <= max_bytes) return;
    throw MapFileError(MapFileDefect::kTooBig, "cannot read " + file + ": it has more than " +
                                                   std::to_string(max_bytes) + " bytes");
  };
  require_few(num_bytes);
  std::string bytes;
  bytes.reserve(static_cast<std::size_t>(num_bytes));
  std::string chunk(std::size_t{1} << 20, '\0');
  for (;;) {
    const ssize_t count = ::read(descriptor.get(), chunk.data(), chunk.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail("cannot read", file, errno);
    if (count == 0) return bytes;
    bytes.append(chunk, 0, static_cast<std::size_t>(count));
    require_few(bytes.size());
  }
}

void replaceFile(const std::string& file, std::string_view bytes) {
  replaceFile(file, [&](const std::string& partial) {
    Descriptor descriptor(partial, kForWriting);
    if (!descriptor.isOpen()) fail("cannot write", file, errno);
    writeAll(descriptor, bytes, file);
    if (!descriptor.close()) fail("cannot write", file, errno);
  });
}

void replaceFile(const std::string& file, const std::function<void(const std::string&)>& write) {
  const auto [target, partial] = replacementOf(file);
  // Checked here, because not every writer says why it fails. Open until the end, for the lock.
  const Descriptor descriptor(partial, kForWriting);
  if (!descriptor.isOpen()) fail("cannot write", file, errno);
  struct stat status {};
  // By another one that began at the same moment.
  const bool is_taken =
      !tryLock(descriptor) || (fstat(descriptor.get(), &status) == 0 && status.st_nlink == 0);
  if (is_taken) failAsBusy(file);
  Removal removal(partial);
  keepPermissions(descriptor, target);
  write(partial);
  // The new name must never stand for bytes that are not on the disk yet.
  if (!synchronize(partial, O_RDONLY | O_CLOEXEC)) fail("cannot write", file, errno);
  if (std::rename(partial.c_str(), target.c_str()) != 0) fail("cannot write", file, errno);
  removal.cancel();
  const std::string folder = fs::path(target).parent_path().string();
  // The new file is there, whether its folder can be synchronized or, as in some file systems, not.
  (void)synchronize(folder.empty() ? "." : folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
}

}  // namespace cuboid_mapping
