// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/map_store.h"

#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/native_format.h"
#include "cuboid_mapping/io/sqlite_database.h"
#include "cuboid_mapping/io/text.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string_view>
#include <system_error>
#include <unordered_map>

namespace cuboid_mapping {
namespace {

constexpr std::string_view kSqliteMagic("SQLite format 3\0", 16);
/// PRAGMA application_id of a store: "CUBO".
constexpr std::int64_t kApplicationId = 0x4355424F;
constexpr std::size_t kPageBricks = 512;
/// A page takes less than 3 MB before it is compressed.
constexpr SnapshotLimits kPageLimits{kPageBricks, std::uint64_t{1} << 22};

std::string nameOf(const Cell& page) {
  std::ostringstream text;
  text << "page " << page;
  return text.str();
}

/// Whether the first three columns of a row name a page of a map.
bool isPage(const SqliteStatement& row) {
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t cell = row.number(axis);
    const bool is_in_map = cell >= -Grid::kMaxCell && cell < Grid::kMaxCell;
    if (!row.isInteger(axis) || !is_in_map || cell % kPageEdge != 0) return false;
  }
  return true;
}

void bindPage(SqliteStatement& statement, const Cell& page) {
  for (int axis = 0; axis < 3; ++axis) statement.bind(axis + 1, std::int64_t{page[axis]});
}

bool isBefore(const VoxelBrick& brick, const Cell& cell) {
  return isBeforeOnMortonCurve(brick.brick, cell);
}

MapSnapshot withoutBricks(const MapSnapshot& map) {
  return {map.resolution_m, map.sensor_model, map.environment, map.frame_id, {}, map.progress};
}

/// Bricks of a page. @param bricks  Along the Morton curve, where bricks of one page are neighbours.
std::vector<VoxelBrick> bricksIn(const std::vector<VoxelBrick>& bricks, const Cell& page) {
  const auto first = std::lower_bound(bricks.begin(), bricks.end(), page, isBefore);
  const auto last = std::find_if(
      first, bricks.end(), [&](const VoxelBrick& brick) { return pageOf(brick.brick) != page; });
  return {first, last};
}

/// The URI with which SQLite reads a file and looks for nothing beside it.
std::string immutableUri(const std::string& file) {
  std::string uri = "file:";
  for (const char letter : file) {
    if (letter == '%' || letter == '?' || letter == '#') {
      constexpr std::string_view kDigits = "0123456789abcdef";
      const auto byte = static_cast<unsigned char>(letter);
      uri += {'%', kDigits[byte >> 4], kDigits[byte & 15]};
    } else {
      uri += letter;
    }
  }
  return uri + "?immutable=1";
}

/// A database that can be read, also where nobody may write: SQLite could not make its index of the -wal there, which
/// is not needed if no transaction waits in one.
std::unique_ptr<SqliteDatabase> openForReading(const std::string& file) {
  auto database = std::make_unique<SqliteDatabase>(file, SQLITE_OPEN_READONLY);
  const int code = sqlite3_exec(database->handle(), "SELECT count(*) FROM sqlite_master", nullptr,
                                nullptr, nullptr);
  if (code != SQLITE_CANTOPEN && code != SQLITE_READONLY) return database;
  std::error_code ignored;
  const std::string waiting = std::filesystem::canonical(file, ignored).string() + "-wal";
  if (std::filesystem::exists(waiting, ignored)) {
    throw MapFileError(MapFileDefect::kInaccessible,
                       file +
                           " cannot be read where nobody may write: a program that has ended early "
                           "left changes in " +
                           waiting + ". Copy both files to a folder that may be written");
  }
  return std::make_unique<SqliteDatabase>(file, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI,
                                          immutableUri(file));
}

[[noreturn]] void refuseEmpty(const std::string& file) {
  throw MapFileError(MapFileDefect::kTruncated,
                     file + " is a store without a map: its first save did not end. Save it again");
}

}  // namespace

bool isSqliteFile(const std::string& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return false;  // A pipe would be waited for.
  char bytes[kSqliteMagic.size()] = {};
  std::ifstream in(file, std::ios::binary);
  in.read(bytes, sizeof(bytes));
  return in && std::string_view(bytes, sizeof(bytes)) == kSqliteMagic;
}

MapStore::MapStore(const std::string& file, StoreAccess access) : file_(file) {
  requireFile(file);
  const bool is_writer = access == StoreAccess::kWrite;
  database_ =
      is_writer ? std::make_unique<SqliteDatabase>(file, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE)
                : openForReading(file);
  // Must come before the first read; the first transaction takes the lock, and keeps it.
  if (is_writer) database_->run("PRAGMA locking_mode = EXCLUSIVE");
  const bool is_empty = database_->readNumber("SELECT count(*) FROM sqlite_master") == 0 &&
                        database_->readNumber("PRAGMA application_id") == 0;
  if (is_empty && is_writer) {
    createTables();
  } else if (is_empty) {
    refuseEmpty(file);
  } else if (database_->readNumber("PRAGMA application_id") != kApplicationId) {
    throw MapFileError(MapFileDefect::kForeign,
                       file + " is not a store of a map: it is an SQLite file of another program");
  }
  const std::int64_t version = database_->readNumber("PRAGMA user_version");
  if (version != kStoreVersion) {
    throw MapFileError(MapFileDefect::kNewerVersion,
                       file + " has version " + std::to_string(version) +
                           " of the store, but this program only knows version " +
                           std::to_string(kStoreVersion) + ": update cuboid_mapping");
  }
  if (is_writer) {
    database_->run("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; BEGIN EXCLUSIVE; COMMIT");
  }
  readHead();
  if (!head_ && !is_writer) refuseEmpty(file);
}

MapStore::~MapStore() = default;

void MapStore::transact(const std::function<void()>& work) {
  database_->rollBack();  // Of work that failed when there was no memory for that, either.
  try {
    database_->run("BEGIN IMMEDIATE");
    work();
    database_->run("COMMIT");
  } catch (...) {
    database_->rollBack();
    throw;
  }
}

void MapStore::createTables() {
  transact([this] {
    database_->run(
        "CREATE TABLE map (resolution REAL, hit REAL, miss REAL, min REAL, max REAL,"
        "                  environment TEXT, frame TEXT, progress TEXT);"
        "CREATE TABLE pages (x INTEGER, y INTEGER, z INTEGER, content BLOB NOT NULL,"
        "                    PRIMARY KEY (x, y, z))");
    database_->run(("PRAGMA application_id = " + std::to_string(kApplicationId)).c_str());
    database_->run(("PRAGMA user_version = " + std::to_string(kStoreVersion)).c_str());
  });
}

void MapStore::readHead() {
  SqliteStatement statement(
      *database_, "SELECT resolution, hit, miss, min, max, environment, frame, progress FROM map");
  if (!statement.step()) return;
  MapSnapshot head;
  head.resolution_m = statement.real(0);
  head.sensor_model = {statement.real(1), statement.real(2), statement.real(3), statement.real(4)};
  head.environment = statement.bytes(5) == toString(Environment::kStatic) ? Environment::kStatic
                                                                          : Environment::kDynamic;
  head.frame_id = statement.bytes(6);
  head.progress = statement.bytes(7);
  if (const auto fault = findFault(head)) {
    throw MapFileError(MapFileDefect::kCorrupted,
                       file_ + " is damaged: " + fault->text + ". Take another copy of the file");
  }
  head_ = head;
}

void MapStore::putHead(const MapSnapshot& head) {
  database_->run("DELETE FROM map");
  SqliteStatement put(*database_, "INSERT INTO map VALUES (?, ?, ?, ?, ?, ?, ?, ?)");
  const SensorModelConfig& model = head.sensor_model;
  int column = 0;
  for (const double value :
       {head.resolution_m, model.hit, model.miss, model.alpha_min, model.alpha_max}) {
    put.bind(++column, value);
  }
  put.bindText(++column, toString(head.environment));
  put.bindText(++column, head.frame_id);
  put.bindText(++column, head.progress);
  put.step();
}

void MapStore::setHead(const MapSnapshot& head) {
  transact([&] { putHead(head); });
  head_ = withoutBricks(head);
}

std::vector<Cell> MapStore::pages() const {
  std::vector<Cell> pages;
  SqliteStatement statement(*database_, "SELECT x, y, z FROM pages");
  while (statement.step()) {
    if (!isPage(statement)) {
      throw MapFileError(MapFileDefect::kCorrupted,
                         file_ +
                             " is damaged: it has a page at a place where none can be. Take "
                             "another copy of the file");
    }
    Cell page;
    for (int axis = 0; axis < 3; ++axis) {
      page[axis] = static_cast<std::int32_t>(statement.number(axis));
    }
    pages.push_back(page);
  }
  return pages;
}

std::vector<VoxelBrick> MapStore::read(const Cell& page, std::vector<Cuboid>* cuboids) const {
  SqliteStatement statement(*database_,
                            "SELECT content FROM pages WHERE x = ? AND y = ? AND z = ?");
  bindPage(statement, page);
  if (!statement.step()) return {};
  try {
    MapSnapshot content = fromNativeFormat(statement.bytes(0), kPageLimits);
    for (const VoxelBrick& brick : content.bricks) {
      if (pageOf(brick.brick) != page) {
        throw MapFileError(MapFileDefect::kCorrupted,
                           "is damaged: it has the voxels of another page");
      }
    }
    if (cuboids != nullptr) {
      cuboids->insert(cuboids->end(), content.cuboids.begin(), content.cuboids.end());
    }
    return std::move(content.bricks);
  } catch (const MapFileError& error) {
    throw MapFileError(MapFileDefect::kCorrupted, file_ + ", " + nameOf(page) + ' ' + error.what());
  }
}

void MapStore::write(const std::vector<Cell>& pages, const BricksOfPage& bricks_of) {
  if (pages.empty()) return;
  transact([&] { putPages(head_.value(), pages, bricks_of); });
}

void MapStore::replaceAll(const MapSnapshot& head, const std::vector<Cell>& pages,
                          const BricksOfPage& bricks_of) {
  transact([&] {
    putHead(head);
    database_->run("DELETE FROM pages");
    putPages(head, pages, bricks_of);
  });
  head_ = withoutBricks(head);
}

void MapStore::putPages(const MapSnapshot& head, const std::vector<Cell>& pages,
                        const BricksOfPage& bricks_of) {
  MapSnapshot content = withoutBricks(head);
  std::unordered_map<Cell, std::vector<Cuboid>, CellHash> cuboids;
  for (const Cuboid& cuboid : head.cuboids) cuboids[pageOf(cuboid.box.min)].push_back(cuboid);
  SqliteStatement put(*database_, "INSERT OR REPLACE INTO pages VALUES (?, ?, ?, ?)");
  SqliteStatement remove(*database_, "DELETE FROM pages WHERE x = ? AND y = ? AND z = ?");
  for (const Cell& page : pages) {
    content.bricks = bricks_of(page);
    if (content.bricks.empty()) {
      bindPage(remove, page);
      remove.step();
      continue;
    }
    content.cuboids = std::move(cuboids[page]);
    const std::string bytes = toNativeFormat(content);
    bindPage(put, page);
    put.bindBytes(4, bytes);
    put.step();
  }
}

std::unique_ptr<MapStore> openStoreOf(const MapSnapshot& head, const std::string& file) {
  auto store = std::make_unique<MapStore>(file, StoreAccess::kWrite);
  MapSnapshot new_head = withoutBricks(head);
  if (store->head()) {
    const MapSnapshot& found = *store->head();
    const auto refuse = [&](const std::string& what, const std::string& is,
                            const std::string& own) {
      throw MapFileError(MapFileDefect::kForeign, file + " is the store of a map of " + what + ' ' +
                                                      is + ", but this map has " + own +
                                                      ": set that, or name another file");
    };
    if (std::abs(found.resolution_m - head.resolution_m) > 1e-9 * head.resolution_m) {
      refuse("resolution", toText(found.resolution_m) + " m", toText(head.resolution_m) + " m");
    }
    if (found.environment != head.environment) {
      refuse("environment", toString(found.environment), toString(head.environment));
    }
    if (found.frame_id != head.frame_id && !found.frame_id.empty()) {
      refuse("frame", "'" + found.frame_id + "'", "'" + head.frame_id + "'");
    }
    if (new_head.progress.empty()) new_head.progress = found.progress;
  }
  store->setHead(new_head);
  return store;
}

std::vector<Cell> pagesOf(const std::vector<VoxelBrick>& bricks) {
  std::vector<Cell> pages;
  for (const VoxelBrick& brick : bricks) {
    const Cell page = pageOf(brick.brick);
    if (pages.empty() || pages.back() != page) pages.push_back(page);
  }
  return pages;
}

MapSnapshot readStore(const MapStore& store, const SnapshotLimits& limits, const CellBox& part) {
  MapSnapshot snapshot = *store.head();
  std::vector<Cell> pages = store.pages();
  std::sort(pages.begin(), pages.end(), isBeforeOnMortonCurve);
  for (const Cell& page : pages) {
    if (!part.intersects(pageBox(page))) continue;
    for (VoxelBrick& brick : store.read(page, &snapshot.cuboids)) {
      snapshot.bricks.push_back(std::move(brick));
    }
    if (snapshot.bricks.size() > limits.max_bricks) {
      throw MapFileError(MapFileDefect::kTooBig, store.file() + " has more than " +
                                                     std::to_string(limits.max_bricks) +
                                                     " bricks of 8 x 8 x 8 voxels");
    }
  }
  return snapshot;
}

void writeStore(const std::string& file, const MapSnapshot& head, const std::vector<Cell>& pages,
                const MapStore::BricksOfPage& bricks_of) {
  std::error_code ignored;  // If the path cannot be read, opening fails, too, and reports it.
  const bool is_new = !std::filesystem::exists(file, ignored);
  try {
    MapStore(file, StoreAccess::kWrite).replaceAll(head, pages, bricks_of);
  } catch (...) {
    // The file may be the target of a symbolic link, which stays.
    if (is_new) std::filesystem::remove(std::filesystem::canonical(file, ignored), ignored);
    throw;
  }
}

void writeStore(const std::string& file, const MapSnapshot& snapshot,
                const ProgressListener& listener) {
  const std::vector<Cell> pages = pagesOf(snapshot.bricks);
  std::uint64_t num_done = 0;
  writeStore(file, snapshot, pages, [&](const Cell& page) {
    if (listener) listener(++num_done, pages.size());
    return bricksIn(snapshot.bricks, page);
  });
}

}  // namespace cuboid_mapping
