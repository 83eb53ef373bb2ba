#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

struct sqlite3;
struct sqlite3_stmt;

/// The few parts of SQLite that a map needs, as objects that clean up after themselves.
namespace visual_localization::sqlite {

/// What SQLite reports, without the path: whoever catches it knows that.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A file that SQLite does not even open.
class OpenError : public Error {
 public:
  using Error::Error;
};

/// Bytes inside a row; valid until the statement steps on.
struct Bytes {
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;
};

/// An open database file.
class Database {
 public:
  /// For files that may come from anyone: nothing is written beside or into the file, nothing in its schema is
  /// executed, and neither a large schema nor a value longer than `max_value_bytes` is read.
  static Database openUntrusted(const std::string& path, std::int64_t max_value_bytes);
  /// For filling a new file as fast as the disk takes it: without journal, so only for a file that is thrown
  /// away when anything fails. `path` is an empty file.
  static Database create(const std::string& path);

  ~Database();
  Database(Database&& other) noexcept;
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  void execute(const std::string& sql);
  /// Closes the file and reports what the destructor could not.
  void close();
  sqlite3* handle() const { return handle_; }

 private:
  explicit Database(sqlite3* handle) : handle_(handle) {}
  sqlite3* handle_ = nullptr;
};

/// One prepared statement. Parameters and columns count from 0.
class Statement {
 public:
  Statement(const Database& database, const std::string& sql);
  ~Statement();
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  void bind(int parameter, std::int64_t value);
  void bind(int parameter, double value);
  void bind(int parameter, const std::string& value);
  /// The bytes must outlive the next run().
  void bind(int parameter, Bytes value);

  /// Goes to the next row; false when there is none.
  bool step();
  /// Executes a statement that has no rows and makes it ready for the next values.
  void run();
  /// Ready to be executed anew; whatever went wrong before is forgotten.
  void reset();

  enum class Type { kInteger, kReal, kText, kBlob, kNull };
  Type type(int column) const;
  // Each throws Error when the column holds another type, so that nothing is converted silently.
  std::int64_t integer(int column) const;
  double real(int column) const;
  std::string text(int column) const;
  Bytes blob(int column) const;

 private:
  void require(int column, Type type) const;

  sqlite3* database_;
  sqlite3_stmt* statement_ = nullptr;
};

}  // namespace visual_localization::sqlite
