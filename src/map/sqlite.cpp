#include "map/sqlite.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#include <sqlite3.h>

namespace visual_localization::sqlite {
namespace {

[[noreturn]] void fail(sqlite3* database) {
  if (database == nullptr) throw Error("out of memory");
  std::string text = sqlite3_errmsg(database);
  const int error = sqlite3_system_errno(database);
  const int code = sqlite3_errcode(database);
  if (error != 0 && (code == SQLITE_IOERR || code == SQLITE_FULL || code == SQLITE_CANTOPEN)) {
    text += std::string(" (") + std::strerror(error) + ")";
  }
  throw Error(text);
}

void check(int result, sqlite3* database) {
  if (result != SQLITE_OK) fail(database);
}

/// The path as a URI. `immutable` keeps SQLite from looking for, or making, any file beside it.
std::string immutableUri(const std::string& path) {
  static const char* const digits = "0123456789ABCDEF";
  std::string uri = path.front() == '/' ? "file://" : "file:";
  for (const char c : path) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '/' ||
                       c == '.' || c == '-' || c == '_';
    if (plain) {
      uri += c;
    } else {
      uri += {'%', digits[byte >> 4U], digits[byte & 15U]};
    }
  }
  return uri + "?immutable=1";
}

sqlite3* open(const std::string& name, int flags, const char* system = nullptr) {
  sqlite3* handle = nullptr;
  if (sqlite3_open_v2(name.c_str(), &handle, flags | SQLITE_OPEN_NOMUTEX, system) != SQLITE_OK) {
    const std::string text = handle == nullptr ? "out of memory" : sqlite3_errmsg(handle);
    const bool not_opened = handle != nullptr && sqlite3_errcode(handle) == SQLITE_CANTOPEN;
    sqlite3_close(handle);
    if (not_opened) throw OpenError(text + "; SQLite takes paths of at most 512 bytes, links and '..' resolved");
    throw Error(text);
  }
  sqlite3_extended_result_codes(handle, 0);
  return handle;
}

void distrust(sqlite3* handle, std::int64_t max_value_bytes) {
  const auto limit = static_cast<int>(std::clamp<std::int64_t>(max_value_bytes, 4096, std::numeric_limits<int>::max()));
  sqlite3_limit(handle, SQLITE_LIMIT_LENGTH, limit);
  sqlite3_limit(handle, SQLITE_LIMIT_SQL_LENGTH, 100000);
  sqlite3_limit(handle, SQLITE_LIMIT_COLUMN, 100);
  sqlite3_limit(handle, SQLITE_LIMIT_EXPR_DEPTH, 20);
  sqlite3_limit(handle, SQLITE_LIMIT_COMPOUND_SELECT, 2);
  sqlite3_limit(handle, SQLITE_LIMIT_VDBE_OP, 10000);
  sqlite3_limit(handle, SQLITE_LIMIT_FUNCTION_ARG, 8);
  sqlite3_limit(handle, SQLITE_LIMIT_TRIGGER_DEPTH, 1);
  sqlite3_limit(handle, SQLITE_LIMIT_WORKER_THREADS, 0);
  sqlite3_limit(handle, SQLITE_LIMIT_ATTACHED, 0);
  check(sqlite3_db_config(handle, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr), handle);
#ifdef SQLITE_DBCONFIG_TRUSTED_SCHEMA
  check(sqlite3_db_config(handle, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr), handle);
#endif
  check(sqlite3_db_config(handle, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr), handle);
#ifdef SQLITE_DBCONFIG_ENABLE_VIEW
  check(sqlite3_db_config(handle, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr), handle);
#endif
  check(sqlite3_db_config(handle, SQLITE_DBCONFIG_ENABLE_LOAD_EXTENSION, 0, nullptr), handle);
}

/// Has the schema read, which SQLite does before it answers anything, and gives up when that takes long: the pages of a
/// damaged tree may lead to the same rows without end.
void readSchema(sqlite3* handle) {
  constexpr int kMostSteps = 5000;  // of SQLite's virtual machine; a hundred do for five tables
  sqlite3_progress_handler(
      handle, kMostSteps, [](void*) { return 1; }, nullptr);
  const int result = sqlite3_exec(handle, "SELECT 1 FROM sqlite_master LIMIT 1", nullptr, nullptr, nullptr);
  sqlite3_progress_handler(handle, 0, nullptr, nullptr);
  if (result == SQLITE_INTERRUPT) throw Error("its schema is too large");
  check(result, handle);
}

}  // namespace

Database Database::openUntrusted(const std::string& path, std::int64_t max_value_bytes) {
  if (path.empty()) throw Error("the name is empty");
  Database database(open(immutableUri(path), SQLITE_OPEN_READONLY | SQLITE_OPEN_URI));
  distrust(database.handle_, max_value_bytes);
  database.execute("PRAGMA cell_size_check = ON");
  database.execute("PRAGMA temp_store = MEMORY");
  readSchema(database.handle_);
  return database;
}

Database Database::create(const std::string& path) {
  // "./" keeps a relative name that begins with "file:" or ":" from being taken for something else.
  const std::string name = !path.empty() && path.front() == '/' ? path : "./" + path;
  // The file is its maker's alone, and locked: on network disks SQLite's own locks would wait for that one.
  Database database(open(name, SQLITE_OPEN_READWRITE, "unix-none"));
  database.execute("PRAGMA journal_mode = OFF");
  database.execute("PRAGMA synchronous = OFF");
  database.execute("PRAGMA locking_mode = EXCLUSIVE");
  return database;
}

Database::~Database() { sqlite3_close_v2(handle_); }

Database::Database(Database&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}

void Database::execute(const std::string& sql) {
  check(sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr), handle_);
}

void Database::close() {
  check(sqlite3_close(handle_), handle_);
  handle_ = nullptr;
}

Statement::Statement(const Database& database, const std::string& sql) : database_(database.handle()) {
  check(sqlite3_prepare_v2(database_, sql.c_str(), -1, &statement_, nullptr), database_);
}

Statement::~Statement() { sqlite3_finalize(statement_); }

void Statement::bind(int parameter, std::int64_t value) {
  check(sqlite3_bind_int64(statement_, parameter + 1, value), database_);
}

void Statement::bind(int parameter, double value) {
  check(sqlite3_bind_double(statement_, parameter + 1, value), database_);
}

void Statement::bind(int parameter, const std::string& value) {
  check(sqlite3_bind_text64(statement_, parameter + 1, value.data(), value.size(), SQLITE_TRANSIENT, SQLITE_UTF8),
        database_);
}

void Statement::bind(int parameter, Bytes value) {
  // Of no bytes SQLite would make NULL when their address is null.
  const void* data = value.size == 0 ? "" : static_cast<const void*>(value.data);
  check(sqlite3_bind_blob64(statement_, parameter + 1, data, value.size, SQLITE_STATIC), database_);
}

bool Statement::step() {
  const int result = sqlite3_step(statement_);
  if (result == SQLITE_ROW) return true;
  if (result != SQLITE_DONE) fail(database_);
  return false;
}

void Statement::run() {
  while (step()) {
  }
  check(sqlite3_reset(statement_), database_);
}

void Statement::reset() { sqlite3_reset(statement_); }

Statement::Type Statement::type(int column) const {
  switch (sqlite3_column_type(statement_, column)) {
    case SQLITE_INTEGER:
      return Type::kInteger;
    case SQLITE_FLOAT:
      return Type::kReal;
    case SQLITE_TEXT:
      return Type::kText;
    case SQLITE_BLOB:
      return Type::kBlob;
    default:
      return Type::kNull;
  }
}

void Statement::require(int column, Type wanted) const {
  if (type(column) == wanted) return;
  throw Error(std::string("column '") + sqlite3_column_name(statement_, column) + "' holds a value of the wrong type");
}

std::int64_t Statement::integer(int column) const {
  require(column, Type::kInteger);
  return sqlite3_column_int64(statement_, column);
}

double Statement::real(int column) const {
  require(column, Type::kReal);
  return sqlite3_column_double(statement_, column);
}

std::string Statement::text(int column) const {
  require(column, Type::kText);
  const auto* data = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
  if (data == nullptr) throw Error("out of memory");
  return std::string(data, static_cast<std::size_t>(sqlite3_column_bytes(statement_, column)));
}

Bytes Statement::blob(int column) const {
  require(column, Type::kBlob);
  const auto* data = static_cast<const std::uint8_t*>(sqlite3_column_blob(statement_, column));
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_, column));
  if (data == nullptr && size > 0) throw Error("out of memory");
  return {data, size};
}

}  // namespace visual_localization::sqlite
