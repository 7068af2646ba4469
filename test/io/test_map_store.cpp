// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/map_store.h"

#include "support/as_nobody.h"
#include "support/snapshots.h"
#include "tools/run_program.h"

#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/stat.h>

#include <string>
#include <tuple>

namespace cuboid_mapping {
namespace {

using test::Random;
using test::TemporaryFolder;

/// Changes a store as another program would.
void runSql(const std::string& file, const std::string& sql) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
      << sqlite3_errmsg(database);
  sqlite3_close(database);
}

/// Expects an error of a kind, with the file's name and some words in its text.
template <typename WorkT>
void expectError(MapFileDefect defect, const std::string& file, const std::string& words,
                 const WorkT& work) {
  try {
    work();
    ADD_FAILURE() << "no error: " << words;
  } catch (const MapFileError& error) {
    EXPECT_EQ(error.defect(), defect) << error.what();
    EXPECT_EQ(std::string(error.what()).rfind(file, 0), 0U) << error.what();
    EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
  }
}

void expectEqual(const MapSnapshot& a, const MapSnapshot& b) {
  EXPECT_EQ(std::tie(a.resolution_m, a.environment, a.frame_id),
            std::tie(b.resolution_m, b.environment, b.frame_id));
  EXPECT_TRUE(test::isSameModel(a.sensor_model, b.sensor_model));
  EXPECT_EQ(test::voxelsOf(a.bricks), test::voxelsOf(b.bricks));
  ASSERT_EQ(a.bricks.size(), b.bricks.size());
  for (std::size_t i = 0; i < a.bricks.size(); ++i) {
    EXPECT_EQ(a.bricks[i].brick, b.bricks[i].brick);
  }
}

TEST(MapStore, givesBackExactlyWhatItGot) {
  const TemporaryFolder folder;
  const std::string file = folder / "map.sqlite";
  Random random(811);
  for (int i = 0; i < 20; ++i) {
    // Offsets also reach around corners of pages, and far out.
    const Cell offset{random.integer(-9, 9) * 8, random.integer(-9, 9) * 8,
                      i == 19 ? Grid::kMaxCell - 640 : random.integer(-9, 9) * 8};
    const MapSnapshot snapshot = test::randomSnapshot(random, offset);
    writeStore(file, snapshot);  // Overwrites the store of the previous case.
    const MapStore store(file, StoreAccess::kRead);
    expectEqual(readStore(store), snapshot);
    EXPECT_EQ(store.pages().size(), pagesOf(snapshot.bricks).size())
        << test::seedNote(static_cast<std::size_t>(i));
  }
}

TEST(MapStore, leavesNothingBesideItsFile) {
  const TemporaryFolder folder;
  Random random(812);
  writeStore(folder / "map.sqlite", test::randomSnapshot(random));
  EXPECT_EQ(folder.list(), std::vector<std::string>{"map.sqlite"});
}

/// A folder that may only be read, such as a volume that is mounted so, with a name that needs quoting in a URI.
TEST(MapStore, canBeReadWhereNobodyMayWrite) {
  const TemporaryFolder folder;
  Random random(820);
  const MapSnapshot snapshot = test::randomSnapshot(random);
  const std::string old = folder / "old.sqlite";
  const std::string quoted = folder / "a?b#c%41 d.sqlite";
  for (const std::string& file : {old, quoted}) writeStore(file, snapshot);
  runSql(
      old,
      "PRAGMA journal_mode = WAL; DELETE FROM pages WHERE x = 1");  // As stores of version 0.1 are.
  const std::string opened = folder / "opened.sqlite";
  writeStore(opened, snapshot);
  sqlite3* writer = nullptr;  // A process that ended without closing it: its pages are in the -wal.
  ASSERT_EQ(sqlite3_open(opened.c_str(), &writer), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(writer, "PRAGMA journal_mode = WAL; DELETE FROM pages", nullptr, nullptr,
                         nullptr),
            SQLITE_OK);
  std::filesystem::copy(opened, folder / "broken.sqlite");
  std::filesystem::copy(opened + "-wal", folder / "broken.sqlite-wal");
  sqlite3_close(writer);
  ASSERT_EQ(chmod((folder / ".").c_str(), 0555), 0);
  {
    const test::AsNobody nobody;
    for (const std::string& file : {old, quoted}) {
      expectEqual(readStore(MapStore(file, StoreAccess::kRead)), snapshot);
    }
    expectError(MapFileDefect::kInaccessible, folder / "broken.sqlite", "broken.sqlite-wal",
                [&] { MapStore(folder / "broken.sqlite", StoreAccess::kRead); });
  }
  ASSERT_EQ(chmod((folder / ".").c_str(), 0755), 0);
}

TEST(MapStore, isNotThereWhenItsFirstWriteIsGivenUp) {
  const TemporaryFolder folder;
  Random random(819);
  std::filesystem::create_symlink(folder / "target.sqlite", folder / "link.sqlite");
  const auto give_up = [](std::uint64_t, std::uint64_t) { throw std::runtime_error("given up"); };
  for (const std::string name : {"map.sqlite", "link.sqlite"}) {
    EXPECT_THROW(writeStore(folder / name, test::randomSnapshot(random), give_up),
                 std::runtime_error);
    EXPECT_EQ(folder.list(), std::vector<std::string>{"link.sqlite"}) << name;
  }
}

TEST(MapStore, saysThatItsFirstSaveDidNotEnd) {
  const TemporaryFolder folder;
  (void)MapStore(folder / "tables.sqlite", StoreAccess::kWrite);
  runSql(folder / "empty.sqlite", "CREATE TABLE a (b); DROP TABLE a");
  for (const std::string name : {"tables.sqlite", "empty.sqlite"}) {
    expectError(MapFileDefect::kTruncated, folder / name, "its first save did not end",
                [&] { MapStore(folder / name, StoreAccess::kRead); });
  }
}

TEST(MapStore, writesAndRemovesSinglePages) {
  const TemporaryFolder folder;
  Random random(813);
  const MapSnapshot snapshot = test::randomSnapshot(random);
  const auto store = openStoreOf(snapshot, folder / "map.sqlite");
  const Cell here{0, 0, 0};
  const Cell there{-64, 64, 128};
  EXPECT_TRUE(store->pages().empty());
  EXPECT_TRUE(store->read(here).empty());
  const auto brick_in = [](const Cell& page, float log_odds) {
    VoxelValues values{};
    values.fill(log_odds);
    return std::vector<VoxelBrick>{{page, PackedVoxels(BrickMask::all(), values)}};
  };
  store->write({here, there}, [&](const Cell& page) { return brick_in(page, 0.25F); });
  store->write({here}, [&](const Cell& page) { return brick_in(page, -1.5F); });
  EXPECT_EQ(test::voxelsOf(store->read(here)), test::voxelsOf(brick_in(here, -1.5F)));
  EXPECT_EQ(test::voxelsOf(store->read(there)), test::voxelsOf(brick_in(there, 0.25F)));
  store->write({here}, [](const Cell&) { return std::vector<VoxelBrick>(); });
  EXPECT_EQ(store->pages(), std::vector<Cell>{there});
}

TEST(MapStore, isAsBeforeWhenAWriteIsGivenUp) {
  const TemporaryFolder folder;
  Random random(814);
  const MapSnapshot snapshot = test::randomSnapshot(random);
  writeStore(folder / "map.sqlite", snapshot);
  MapStore store(folder / "map.sqlite", StoreAccess::kWrite);
  int num_asked = 0;
  const auto fail_later = [&](const Cell& /*page*/) -> std::vector<VoxelBrick> {
    if (++num_asked == 2) throw std::runtime_error("given up");
    return {};
  };
  EXPECT_THROW(store.write({{0, 0, 0}, {-64, 0, 0}}, fail_later), std::runtime_error);
  num_asked = 0;
  EXPECT_THROW(store.replaceAll(snapshot, {{0, 0, 0}, {-64, 0, 0}}, fail_later),
               std::runtime_error);
  expectEqual(readStore(store), snapshot);
}

TEST(MapStore, findsADamagedPageAndReadsTheOthers) {
  const TemporaryFolder folder;
  const std::string file = folder / "map.sqlite";
  Random random(815);
  const MapSnapshot snapshot = test::randomSnapshot(random);  // Around the origin: eight pages.
  const std::vector<Cell> pages = pagesOf(snapshot.bricks);
  ASSERT_GT(pages.size(), 2U);
  for (int i = 0; i < 30; ++i) {
    writeStore(file, snapshot);
    const Cell page = pages[random.index(pages.size())];
    const std::string where = " WHERE x = " + std::to_string(page.x) +
                              " AND y = " + std::to_string(page.y) +
                              " AND z = " + std::to_string(page.z);
    // Changes one byte, at a place that depends on the case.
    const std::string place =
        "(1 + " + std::to_string(random.integer(0, 1 << 20)) + " % length(content))";
    runSql(file, "UPDATE pages SET content = CAST(substr(content, 1, " + place +
                     " - 1) || CASE WHEN substr(content, " + place +
                     ", 1) = x'00' THEN x'01' ELSE x'00' END || substr(content, " + place +
                     " + 1) AS BLOB)" + where);
    const MapStore store(file, StoreAccess::kRead);
    std::ostringstream name;
    name << "page " << page;
    expectError(MapFileDefect::kCorrupted, file, name.str(), [&] { (void)store.read(page); });
    for (const Cell& other : pages) {
      if (other == page) continue;
      EXPECT_FALSE(store.read(other).empty()) << test::seedNote(static_cast<std::size_t>(i));
    }
  }
}

TEST(MapStore, findsAPageThatIsInThePlaceOfAnother) {
  const TemporaryFolder folder;
  const std::string file = folder / "map.sqlite";
  Random random(816);
  writeStore(file, test::randomSnapshot(random));
  runSql(file, "UPDATE pages SET x = x + 6400");
  const MapStore store(file, StoreAccess::kRead);
  const std::vector<Cell> pages = store.pages();
  ASSERT_FALSE(pages.empty());
  for (const Cell& page : pages) {
    expectError(MapFileDefect::kCorrupted, file, "another page", [&] { (void)store.read(page); });
  }
}

TEST(MapStore, losesNoPageWhosePlaceIsDamagedWithoutAWord) {
  const TemporaryFolder folder;
  const std::string file = folder / "map.sqlite";
  Random random(818);
  const MapSnapshot snapshot = test::randomSnapshot(random);
  // The first is the old place as a 32-bit number; others are beyond the map, between pages, or no place.
  for (const std::string place :
       {"x + 4294967296", "2147483584", "-2147483648", "x + 1", "x + 0.5", "NULL", "'here'"}) {
    SCOPED_TRACE(place);
    writeStore(file, snapshot);
    runSql(file, "UPDATE pages SET x = " + place + " WHERE rowid = 1");
    const MapStore store(file, StoreAccess::kRead);
    const std::string words = "where none can be";
    expectError(MapFileDefect::kCorrupted, file, words, [&] { (void)store.pages(); });
    expectError(MapFileDefect::kCorrupted, file, words, [&] { (void)readStore(store); });
  }
}

TEST(MapStore, refusesWhatIsNoStore) {
  const TemporaryFolder folder;
  Random random(817);
  const std::string file = folder / "map.sqlite";
  const std::string missing = "No such file or directory. Check that the folder is there";
  for (const StoreAccess access : {StoreAccess::kRead, StoreAccess::kWrite}) {
    std::ofstream(file) << "a text that is longer than the head of a database, and then some more";
    const std::string before = test::readText(file);
    expectError(MapFileDefect::kForeign, file, "no SQLite file", [&] { MapStore(file, access); });
    EXPECT_EQ(test::readText(file), before);
    std::filesystem::remove(file);
    runSql(file, "CREATE TABLE theirs (a INTEGER)");
    expectError(MapFileDefect::kForeign, file, "another program", [&] { MapStore(file, access); });
    std::filesystem::remove(file);
    writeStore(file, test::randomSnapshot(random));
    runSql(file, "PRAGMA user_version = 2");
    expectError(MapFileDefect::kNewerVersion, file, "update cuboid_mapping",
                [&] { MapStore(file, access); });
    std::filesystem::remove(file);
    expectError(MapFileDefect::kInaccessible, folder / "no", missing,
                [&] { MapStore(folder / "no/map.sqlite", access); });
  }
  expectError(MapFileDefect::kInaccessible, file, missing,
              [&] { MapStore(file, StoreAccess::kRead); });
}

TEST(MapStore, belongsToOneMap) {
  const TemporaryFolder folder;
  const std::string file = folder / "map.sqlite";
  MapSnapshot head;
  head.resolution_m = 0.2;
  head.frame_id = "map";
  (void)openStoreOf(head, file);
  MapSnapshot other = head;
  other.resolution_m = 0.1;
  expectError(MapFileDefect::kForeign, file, "resolution 0.2 m, but this map has 0.1 m",
              [&] { (void)openStoreOf(other, file); });
  other = head;
  other.frame_id = "odom";
  expectError(MapFileDefect::kForeign, file, "frame 'map', but this map has 'odom'",
              [&] { (void)openStoreOf(other, file); });
  other = head;
  other.environment = Environment::kStatic;
  expectError(MapFileDefect::kForeign, file, "environment",
              [&] { (void)openStoreOf(other, file); });
  other = head;
  other.sensor_model.hit = 0.65;  // The store keeps this model, as for a node that is reconfigured.
  (void)openStoreOf(other, file);
  EXPECT_EQ(MapStore(file, StoreAccess::kRead).head()->sensor_model.hit, 0.65);
}

TEST(MapStore, keepsTheProgressOfItsObservationsWhenAMapWithoutAnyGoesOn) {
  const TemporaryFolder folder;
  const std::string file = folder / "map.sqlite";
  MapSnapshot head;
  head.resolution_m = 0.2;
  head.progress = "of two robots";
  (void)openStoreOf(head, file);
  head.progress.clear();
  EXPECT_EQ(openStoreOf(head, file)->head()->progress, "of two robots");
  head.progress = "of three robots";
  (void)openStoreOf(head, file);
  EXPECT_EQ(MapStore(file, StoreAccess::kRead).head()->progress, "of three robots");
}

TEST(MapStore, hasOneWriterWhichHasItAlone) {
  const TemporaryFolder folder;
  const std::string file = folder / "map.sqlite";
  {
    const MapStore store(file, StoreAccess::kWrite);
    for (const StoreAccess access : {StoreAccess::kRead, StoreAccess::kWrite}) {
      expectError(MapFileDefect::kInaccessible, file, "is open in another process",
                  [&] { MapStore(file, access); });
    }
  }
  const MapStore again(file, StoreAccess::kWrite);
  EXPECT_TRUE(again.pages().empty());
}

TEST(MapStore, saysThatThereIsTooMuch) {
  const TemporaryFolder folder;
  Random random(818);
  writeStore(folder / "map.sqlite", test::randomSnapshot(random));
  const MapStore store(folder / "map.sqlite", StoreAccess::kRead);
  expectError(MapFileDefect::kTooBig, store.file(), "more than 3 bricks", [&] {
    (void)readStore(store, {3, 1 << 30});
  });
}

}  // namespace
}  // namespace cuboid_mapping
