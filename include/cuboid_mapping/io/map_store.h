// SPDX-License-Identifier: BSD-3-Clause
// A map on disk that is read and written in parts.
#pragma once

#include "cuboid_mapping/geometry/page.h"
#include "cuboid_mapping/io/map_file_error.h"
#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/map/progress_listener.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping {

class SqliteDatabase;

/// Version of the layout. Stores with a newer one are refused.
constexpr int kStoreVersion = 1;

/// Purpose of opening a store.
enum class StoreAccess : unsigned char {
  kRead,  ///< The file must be a store with a head. It stays as it is.
  kWrite  ///< A missing or empty file becomes a store.
};

/// Whether a file begins as an SQLite database does; false when it cannot be read.
[[nodiscard]] bool isSqliteFile(const std::string& file);

/// A map in an SQLite file, page by page, with the exact log-odds of all voxels. doc/window.md describes the
/// layout.
///
/// A change is one transaction: after a crash of the program or the machine, the file has all of it or none,
/// and each page whole. A process that writes locks the file; the system releases the lock when the
/// process dies.
///
/// All functions throw MapFileError, whose text names the file and says what to do:
///   - kForeign: the file is no store; kNewerVersion;
///   - kTruncated: StoreAccess::kRead, and the store has no map yet;
///   - kCorrupted: the checksum or the place of a page is wrong;
///   - kInaccessible: another process has the file open, it cannot be read or written, or the disk is full.
/// The store is then as before. Locks of a map are not stored. Not thread-safe.
class MapStore {
 public:
  /// The bricks of a page, along the Morton curve; empty for a page without bricks.
  using BricksOfPage = std::function<std::vector<VoxelBrick>(const Cell& page)>;

  /// Opens a file, or makes one. @throws As above.
  MapStore(const std::string& file, StoreAccess access);
  ~MapStore();
  MapStore(const MapStore&) = delete;
  MapStore& operator=(const MapStore&) = delete;

  /// File name, as given.
  [[nodiscard]] const std::string& file() const { return file_; }

  /// Resolution, sensor model, environment and frame of the map, without bricks; nothing for a new
  /// store.
  [[nodiscard]] const std::optional<MapSnapshot>& head() const { return head_; }

  /// Sets the head; ignores its bricks and locks. Pages stay as they are.
  void setHead(const MapSnapshot& head);

  /// All pages that have a known voxel, in no particular order. @complexity O(pages).
  [[nodiscard]] std::vector<Cell> pages() const;

  /// The bricks of a page, along the Morton curve; empty when it is not in the store.
  /// @param cuboids  If not null, gets the fused cuboids whose least voxel is in the page, too.
  [[nodiscard]] std::vector<VoxelBrick> read(const Cell& page,
                                             std::vector<Cuboid>* cuboids = nullptr) const;

  /// Replaces some pages of the store by these bricks, in one transaction. A page without
  /// bricks is removed. Fused cuboids of these pages are not kept.
  /// @pre head() is there. @param pages  Each once. Exceptions of `bricks_of` are passed on.
  void write(const std::vector<Cell>& pages, const BricksOfPage& bricks_of);

  /// Replaces the content of the store by a map, in one transaction.
  /// @param head  As for setHead(), with the fused cuboids. @param pages, bricks_of  As for write().
  void replaceAll(const MapSnapshot& head, const std::vector<Cell>& pages,
                  const BricksOfPage& bricks_of);

 private:
  void readHead();
  void createTables();
  void transact(const std::function<void()>& work);
  void putHead(const MapSnapshot& head);
  void putPages(const MapSnapshot& head, const std::vector<Cell>& pages,
                const BricksOfPage& bricks_of);

  std::string file_;
  std::unique_ptr<SqliteDatabase> database_;
  std::optional<MapSnapshot> head_;
};

/// Opens a store for writing a map, and sets its head: an existing store gets a new sensor model, and its
/// progress unless it is empty: the observations of robots in the store stay known.
/// @throws MapFileError  as MapStore, and kForeign for a store of another resolution, environment or frame.
[[nodiscard]] std::unique_ptr<MapStore> openStoreOf(const MapSnapshot& head,
                                                    const std::string& file);

/// The pages of a map. @pre The bricks lie along the Morton curve, where bricks of one page are neighbours.
[[nodiscard]] std::vector<Cell> pagesOf(const std::vector<VoxelBrick>& bricks);

/// The map of a store. @param part  Pages that share no cell with it are left out. @param limits  For files of others.
/// @throws MapFileError  as MapStore::read(), and kTooBig beyond the limits.
[[nodiscard]] MapSnapshot readStore(const MapStore& store,
                                    const SnapshotLimits& limits = SnapshotLimits::none(),
                                    const CellBox& part = kAllCells);

/// Replaces the content of a store by a map, in one transaction; see MapStore::replaceAll(). A store that it creates is
/// removed after an error.
///@{
void writeStore(const std::string& file, const MapSnapshot& head, const std::vector<Cell>& pages,
                const MapStore::BricksOfPage& bricks_of);
void writeStore(const std::string& file, const MapSnapshot& snapshot,
                const ProgressListener& listener = {});
///@}

}  // namespace cuboid_mapping
