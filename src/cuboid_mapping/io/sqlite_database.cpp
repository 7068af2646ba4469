// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/sqlite_database.h"

#include <new>
#include <system_error>
#include <utility>

namespace cuboid_mapping {
namespace {

/// Time to wait for a file of a process that has just ended.
constexpr int kWait_ms = 500;

}  // namespace

SqliteDatabase::SqliteDatabase(std::string file, int flags, const std::string& uri)
    : file_(std::move(file)) {
  const std::string& name = uri.empty() ? file_ : uri;
  const int code = sqlite3_open_v2(name.c_str(), &handle_, flags, nullptr);
  if (code == SQLITE_OK) {
    sqlite3_busy_timeout(handle_, kWait_ms);
    return;
  }
  try {
    fail(code);
  } catch (...) {
    sqlite3_close(handle_);
    throw;
  }
}

void SqliteDatabase::run(const char* sql) const {
  const int code = sqlite3_exec(handle_, sql, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) fail(code);
}

std::int64_t SqliteDatabase::readNumber(const char* sql) const {
  SqliteStatement statement(*this, sql);
  return statement.step() ? statement.number(0) : 0;
}

void SqliteDatabase::rollBack() const noexcept {
  if (sqlite3_get_autocommit(handle_) == 0) {
    sqlite3_exec(handle_, "ROLLBACK", nullptr, nullptr, nullptr);
  }
}

void SqliteDatabase::fail(int code) const {
  const std::string reason = handle_ == nullptr ? sqlite3_errstr(code) : sqlite3_errmsg(handle_);
  const auto say = [this](MapFileDefect defect, const std::string& text) {
    throw MapFileError(defect, file_ + ' ' + text);
  };
  switch (code & 0xFF) {
    case SQLITE_NOMEM: throw std::bad_alloc();
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      say(MapFileDefect::kInaccessible,
          "is open in another process: end that one first, or name another file");
      break;
    case SQLITE_FULL:
      say(MapFileDefect::kInaccessible, "cannot be written: the disk is full. Make room on it");
      break;
    case SQLITE_CANTOPEN:
      say(MapFileDefect::kInaccessible,
          "cannot be opened: " + std::generic_category().message(sqlite3_system_errno(handle_)) +
              ". Check that the folder is there, and the name");
      break;
    case SQLITE_NOTADB:
      say(MapFileDefect::kForeign, "is not a store of a map: it is no SQLite file");
      break;
    case SQLITE_CORRUPT:
      say(MapFileDefect::kCorrupted, "is damaged (" + reason +
                                         "): take another copy of the file, or save the rest "
                                         "with `sqlite3 FILE .recover`");
      break;
    default:
      say(MapFileDefect::kInaccessible,
          "cannot be read or written: " + reason +
              ". Check that the folder may be written, and that the disk is not full");
  }
  throw std::bad_alloc();  // Not reached.
}

SqliteStatement::SqliteStatement(const SqliteDatabase& database, const char* sql)
    : database_(database) {
  check(sqlite3_prepare_v2(database.handle(), sql, -1, &statement_, nullptr));
}

void SqliteStatement::bindText(int parameter, std::string_view text) {
  check(sqlite3_bind_text(statement_, parameter, text.data(), static_cast<int>(text.size()),
                          SQLITE_STATIC));
}

void SqliteStatement::bindBytes(int parameter, std::string_view bytes) {
  check(sqlite3_bind_blob64(statement_, parameter, bytes.data(), bytes.size(), SQLITE_STATIC));
}

bool SqliteStatement::step() {
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) return true;
  sqlite3_reset(statement_);
  if (code != SQLITE_DONE) database_.fail(code);
  return false;
}

std::string_view SqliteStatement::bytes(int column) const {
  const auto* data = static_cast<const char*>(sqlite3_column_blob(statement_, column));
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_, column));
  if (data == nullptr && sqlite3_errcode(database_.handle()) == SQLITE_NOMEM)
    throw std::bad_alloc();
  return {data, data == nullptr ? 0 : size};
}

}  // namespace cuboid_mapping
