// SPDX-License-Identifier: BSD-3-Clause
// Stores of maps whose pages have arbitrary bytes and places: raw ones, and files of maps with right checksums.
#include "cuboid_mapping/io/map_store.h"

#include "cuboid_mapping/io/native_format.h"
#include "cuboid_mapping/map/cuboid_map.h"

#include "fuzz_input.h"
#include "fuzz_limits.h"
#include "fuzz_target.h"

#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>

namespace {

using namespace cuboid_mapping;

/// A map of some boxes in one or a few pages.
MapSnapshot takeMap(FuzzInput& input) {
  CuboidMap map(MapConfig{});
  const std::size_t num_boxes = 1 + input.upTo(3);
  for (std::size_t i = 0; i < num_boxes; ++i) {
    const Cell cell{input.take<std::int8_t>(), input.take<std::int8_t>(), 0};
    const CellBox box{cell, {cell.x + 5, cell.y + 5, 3}};
    (void)map.replace(box, {UniformBox{box, input.chance() ? 1.0F : -1.0F}});
  }
  return takeSnapshot(map, "map");
}

/// A store that only this process uses.
class Store {
 public:
  Store() {
    writeStore(file_, takeSnapshot(CuboidMap(MapConfig{}), "map"));
    sqlite3_open(file_.c_str(), &database_);
    run("PRAGMA journal_mode = MEMORY; PRAGMA synchronous = OFF");
  }
  ~Store() {
    sqlite3_close(database_);
    std::filesystem::remove(file_);
  }
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  [[nodiscard]] const std::string& file() const { return file_; }
  void run(const char* sql) {
    require(sqlite3_exec(database_, sql, nullptr, nullptr, nullptr) == SQLITE_OK);
  }
  /// Writes bytes as the page at x, 0, 0.
  void put(std::int64_t x, const std::string& bytes) {
    sqlite3_stmt* put = nullptr;
    sqlite3_prepare_v2(database_, "INSERT OR REPLACE INTO pages VALUES (?, 0, 0, ?)", -1, &put,
                       nullptr);
    sqlite3_bind_int64(put, 1, x);
    sqlite3_bind_blob(put, 2, bytes.data(), static_cast<int>(bytes.size()), SQLITE_STATIC);
    require(sqlite3_step(put) == SQLITE_DONE);
    sqlite3_finalize(put);
  }

 private:
  std::string file_ = std::filesystem::temp_directory_path() /
                      ("fuzz_map_store_" + std::to_string(getpid()) + ".sqlite");
  sqlite3* database_ = nullptr;
};

/// Bytes of a valid page, of one with some changed bytes, or arbitrary bytes.
std::string takePage(FuzzInput& input) {
  const std::size_t kind = input.upTo(3);
  if (kind == 0) return input.rest();
  std::string bytes = toNativeFormat(takeMap(input));
  if (kind == 1) bytes[input.take<std::uint16_t>() % bytes.size()] = input.take<char>();
  return bytes;
}

std::int64_t takePlace(FuzzInput& input) {
  switch (input.upTo(7)) {
    case 0: return input.take<std::int64_t>();
    case 1: return std::int64_t{input.take<std::int32_t>()};
    default: return kPageEdge * std::int64_t{input.take<std::int8_t>()};
  }
}

}  // namespace

FUZZ_TARGET(fuzz_map_store) {
  static Store file;
  FuzzInput input(data, size);
  file.run("BEGIN; DELETE FROM pages");
  const std::size_t num_pages = 1 + input.upTo(2);
  for (std::size_t i = 0; i < num_pages; ++i) {
    const std::int64_t place = takePlace(input);
    file.put(place, takePage(input));
  }
  file.run("COMMIT");
  try {
    const MapStore store(file.file(), StoreAccess::kRead);
    const MapSnapshot snapshot = readStore(store, fuzzLimits());
    const auto pages = store.pages();
    const VoxelBrick* last = nullptr;
    for (const VoxelBrick& brick : snapshot.bricks) {
      require(std::find(pages.begin(), pages.end(), pageOf(brick.brick)) != pages.end());
      require(last == nullptr || isBeforeOnMortonCurve(last->brick, brick.brick));
      last = &brick;
    }
  } catch (const MapFileError& error) {
    require(std::string(error.what()).rfind(file.file(), 0) == 0);
  }
  return 0;
}
