// SPDX-License-Identifier: BSD-3-Clause
// SQLite's C interface with owners, and with errors that say what to do.
#pragma once

#include "cuboid_mapping/io/map_file_error.h"

#include <sqlite3.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace cuboid_mapping {

/// An open database. Functions throw MapFileError, whose text begins with the name of the file. Not
/// thread-safe.
class SqliteDatabase {
 public:
  /// @param flags  SQLITE_OPEN_... @param uri  With SQLITE_OPEN_URI, the URI of the file; else empty.
  SqliteDatabase(std::string file, int flags, const std::string& uri = {});
  ~SqliteDatabase() { sqlite3_close(handle_); }
  SqliteDatabase(const SqliteDatabase&) = delete;
  SqliteDatabase& operator=(const SqliteDatabase&) = delete;

  /// Runs statements, and discards their rows.
  void run(const char* sql) const;
  /// The number of the first row, for example of a PRAGMA.
  [[nodiscard]] std::int64_t readNumber(const char* sql) const;
  /// Rolls back a transaction, if there is one. Throws nothing.
  void rollBack() const noexcept;

  [[nodiscard]] sqlite3* handle() const { return handle_; }
  /// Reason why the last call of SQLite failed. @param code  Its result.
  [[noreturn]] void fail(int code) const;

 private:
  std::string file_;
  sqlite3* handle_ = nullptr;
};

/// A prepared statement.
class SqliteStatement {
 public:
  SqliteStatement(const SqliteDatabase& database, const char* sql);
  ~SqliteStatement() { sqlite3_finalize(statement_); }
  SqliteStatement(const SqliteStatement&) = delete;
  SqliteStatement& operator=(const SqliteStatement&) = delete;

  /// Parameters are numbered from 1. Bytes must live until the next step.
  ///@{
  void bind(int parameter, std::int64_t value) {
    check(sqlite3_bind_int64(statement_, parameter, value));
  }
  void bind(int parameter, double value) {
    check(sqlite3_bind_double(statement_, parameter, value));
  }
  void bindText(int parameter, std::string_view text);
  void bindBytes(int parameter, std::string_view bytes);
  ///@}

  /// Goes to the next row. @return Whether there is one; after the last the statement can be used again.
  bool step();

  /// Columns of the row, numbered from 0. Bytes are valid until the next step.
  ///@{
  [[nodiscard]] std::int64_t number(int column) const {
    return sqlite3_column_int64(statement_, column);
  }
  [[nodiscard]] bool isInteger(int column) const {
    return sqlite3_column_type(statement_, column) == SQLITE_INTEGER;
  }
  [[nodiscard]] double real(int column) const { return sqlite3_column_double(statement_, column); }
  [[nodiscard]] std::string_view bytes(int column) const;  ///< @throws std::bad_alloc
                                                           ///@}

 private:
  void check(int code) const {
    if (code != SQLITE_OK) database_.fail(code);
  }

  const SqliteDatabase& database_;
  sqlite3_stmt* statement_ = nullptr;
};

}  // namespace cuboid_mapping
