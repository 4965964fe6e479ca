#include "features/regress/database.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <cmath>
#include <filesystem>

#include "base/markup.h"
#include "base/types.h"

namespace mbv {

void Database::Closer::operator()(sqlite3* db) const { sqlite3_close(db); }

Database::Database(const std::string& path, Mode mode, double busy_s) : path_(path) {
  const int flags = mode == Mode::kRead    ? SQLITE_OPEN_READONLY
                    : mode == Mode::kWrite ? SQLITE_OPEN_READWRITE
                                           : SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
  Open(path, flags, busy_s);
  if (mode != Mode::kRead || !ok() || CanRead()) return;
  // A write-ahead log needs files beside the database, which a folder that cannot be written does
  // not take; without anything in the log the database alone is whole.
  std::error_code error;
  const auto log = std::filesystem::file_size(path + "-wal", error);
  if (!error && log > 0) return;
  Open("file:" + EncodeLink(path) + "?immutable=1", flags | SQLITE_OPEN_URI, busy_s);
}

bool Database::CanRead() {
  const int status =
      sqlite3_exec(db_.get(), "SELECT COUNT(*) FROM sqlite_master", nullptr, nullptr, nullptr);
  const int kind = status & 0xFF;
  return kind != SQLITE_CANTOPEN && kind != SQLITE_READONLY;
}

void Database::Open(const std::string& name, int flags, double busy_s) {
  sqlite3* db = nullptr;
  const int status = sqlite3_open_v2(name.c_str(), &db, flags, nullptr);
  db_.reset(db);
  if (status != SQLITE_OK) {
    Fail();
    return;
  }
  sqlite3_busy_timeout(db, static_cast<int>(1e3 * busy_s));
}

void Database::Fail() {
  if (!trouble_.empty()) return;
  trouble_ = fmt::format("history {}: {}", path_,
                         db_ == nullptr ? "out of memory" : sqlite3_errmsg(db_.get()));
  const int code = db_ == nullptr ? SQLITE_NOMEM : sqlite3_errcode(db_.get()) & 0xFF;
  locked_ = code == SQLITE_BUSY || code == SQLITE_LOCKED;
}

void Database::Run(const std::string& sql) {
  if (!ok()) return;
  if (sqlite3_exec(db_.get(), sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) Fail();
}

long Database::last_id() const { return ok() ? sqlite3_last_insert_rowid(db_.get()) : 0; }

Statement::Statement(Database* database, const std::string& sql) : database_(database) {
  if (!database->ok()) return;
  if (sqlite3_prepare_v2(database->db_.get(), sql.c_str(), -1, &statement_, nullptr) != SQLITE_OK) {
    database->Fail();
  }
}

Statement::~Statement() { sqlite3_finalize(statement_); }

void Statement::Reset() {
  next_ = 1;
  if (statement_ == nullptr) return;
  sqlite3_reset(statement_);
  sqlite3_clear_bindings(statement_);
}

bool Statement::Step() {
  if (!database_->ok() || statement_ == nullptr) return false;
  const int status = sqlite3_step(statement_);
  if (status == SQLITE_ROW) return true;
  if (status != SQLITE_DONE) database_->Fail();
  return false;
}

long Statement::Integer(int column) const {
  return static_cast<long>(sqlite3_column_int64(statement_, column));
}

double Statement::Real(int column) const {
  if (sqlite3_column_type(statement_, column) == SQLITE_NULL) return kNan;
  return sqlite3_column_double(statement_, column);
}

std::string Statement::Text(int column) const {
  const void* bytes = sqlite3_column_blob(statement_, column);
  const int size = sqlite3_column_bytes(statement_, column);
  return bytes == nullptr ? ""
                          : std::string(static_cast<const char*>(bytes), static_cast<size_t>(size));
}

void Statement::BindNext(long value) {
  if (statement_ != nullptr) sqlite3_bind_int64(statement_, next_++, value);
}

void Statement::BindNext(double value) {
  if (statement_ == nullptr) return;
  if (std::isfinite(value)) {
    sqlite3_bind_double(statement_, next_++, value);
  } else {
    sqlite3_bind_null(statement_, next_++);
  }
}

void Statement::BindNext(const std::optional<double>& value) { BindNext(value.value_or(kNan)); }

void Statement::BindNext(const std::string& value) {
  if (statement_ == nullptr) return;
  sqlite3_bind_text(statement_, next_++, value.data(), static_cast<int>(value.size()),
                    SQLITE_TRANSIENT);
}

void Statement::BindNext(const Blob& value) {
  if (statement_ == nullptr) return;
  sqlite3_bind_blob(statement_, next_++, value.bytes.data(), static_cast<int>(value.bytes.size()),
                    SQLITE_TRANSIENT);
}

}  // namespace mbv
