#include "map/map_schema.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

#include <sqlite3.h>
#include <zlib.h>

#include "map/map_rows.h"

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

namespace visual_localization::map_schema {
namespace {

static_assert(kPoseBytes + kMaxFeaturesPerImage * landmarkBytes(kMaxFeaturesPerImage) <= kMaxRowBytes);

/// Of every version, in order of name.
constexpr std::array<Table, 7> kTables{{
    {"features",
     "CREATE TABLE features(image INTEGER PRIMARY KEY, keypoints BLOB NOT NULL, descriptors BLOB NOT NULL, "
     "crc32 INTEGER NOT NULL)"},
    {"globals",
     "CREATE TABLE globals(image INTEGER PRIMARY KEY, wgoh BLOB NOT NULL, wgii BLOB NOT NULL, crc32 INTEGER NOT NULL)"},
    {"images",
     "CREATE TABLE images(id INTEGER PRIMARY KEY, session INTEGER NOT NULL, stamp_ns INTEGER NOT NULL, "
     "east_m REAL NOT NULL, north_m REAL NOT NULL, yaw_rad REAL NOT NULL, feature_count INTEGER NOT NULL)"},
    {"landmarks",
     "CREATE TABLE landmarks(image INTEGER PRIMARY KEY, pose BLOB NOT NULL, points BLOB NOT NULL, "
     "crc32 INTEGER NOT NULL)",
     kSinceLandmarks},
    {"masks", "CREATE TABLE masks(session INTEGER PRIMARY KEY, bits BLOB NOT NULL)", kSinceCameras},
    {"meta", "CREATE TABLE meta(key TEXT PRIMARY KEY, value NOT NULL) WITHOUT ROWID"},
    {"previews", "CREATE TABLE previews(image INTEGER PRIMARY KEY, jpeg BLOB NOT NULL, crc32 INTEGER NOT NULL)"},
}};

std::uint64_t bitsOf(double value) {
  // SQLite does not keep the sign of zero.
  const double normal = value == 0.0 ? 0.0 : value;
  std::uint64_t bits = 0;
  std::memcpy(&bits, &normal, sizeof(bits));
  return bits;
}

}  // namespace

std::vector<Table> tablesOf(int version) {
  std::vector<Table> tables;
  std::copy_if(kTables.begin(), kTables.end(), std::back_inserter(tables),
               [version](const Table& table) { return table.since <= version; });
  return tables;
}

std::int64_t crc32Of(sqlite::Bytes bytes, std::int64_t previous) {
  // SQLite's own limit of 2 GiB a value keeps every size within zlib's 32 bits.
  if (bytes.size == 0) return previous;
  return static_cast<std::int64_t>(::crc32(static_cast<uLong>(previous), bytes.data, static_cast<uInt>(bytes.size)));
}

void Checksum::addRaw(const std::uint8_t* data, std::size_t size) {
  value_ = static_cast<std::uint32_t>(crc32Of({data, size}, value_));
}

void Checksum::add(std::int64_t value) {
  std::array<std::uint8_t, 8> bytes{};
  putLittleEndian(static_cast<std::uint64_t>(value), bytes.data());
  addRaw(bytes.data(), bytes.size());
}

void Checksum::add(double value) { add(static_cast<std::int64_t>(bitsOf(value))); }

void Checksum::add(const std::string& value) {
  add(static_cast<std::int64_t>(value.size()));
  addRaw(reinterpret_cast<const std::uint8_t*>(value.data()), value.size());
}

void Checksum::add(const ParameterValues& values) {
  add(static_cast<std::int64_t>(values.size()));
  for (const auto& [key, value] : values) {
    add(key);
    add(static_cast<std::int64_t>(value.index()));
    if (const auto* integer = std::get_if<std::int64_t>(&value)) add(*integer);
    if (const auto* real = std::get_if<double>(&value)) add(*real);
    if (const auto* text = std::get_if<std::string>(&value)) add(*text);
    // A switch would come back from SQLite as an integer.
    if (std::holds_alternative<bool>(value)) throw std::logic_error("map: '" + key + "' has no form in a map file");
  }
}

void ImageRow::addTo(Checksum& checksum) const {
  // At once: the checksum of a few bytes costs more than that of many.
  std::array<std::uint8_t, 56> bytes{};
  std::uint8_t* to = bytes.data();
  for (const std::int64_t value : {id, session, stamp_ns, feature_count}) {
    putLittleEndian(static_cast<std::uint64_t>(value), to);
    to += sizeof(value);
  }
  for (const double value : {east_m, north_m, yaw_rad}) {
    putLittleEndian(bitsOf(value), to);
    to += sizeof(value);
  }
  checksum.addRaw(bytes.data(), bytes.size());
}

ImageRow rowOf(const TrainingPoses& poses, std::size_t i) {
  const Eigen::Vector2d& position_m = poses.positions_m[i];
  return {static_cast<std::int64_t>(i),
          poses.sessions[i],
          poses.stamps_ns[i],
          position_m.x(),
          position_m.y(),
          poses.yaws_rad[i],
          poses.feature_counts[i]};
}

std::int64_t rowSeed(const ImageRow& image, int version) {
  Checksum checksum;
  if (version >= kSinceBoundRows) {
    image.addTo(checksum);
  } else {
    checksum.add(image.id);
  }
  return checksum.value();
}

std::vector<std::uint32_t> rowSeeds(const TrainingPoses& poses, int version) {
  std::vector<std::uint32_t> seeds(poses.size());
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    seeds[i] = static_cast<std::uint32_t>(rowSeed(rowOf(poses, i), version));
  }
  return seeds;
}

std::int64_t rowChecksum(std::int64_t seed, std::initializer_list<sqlite::Bytes> blobs) {
  std::int64_t checksum = seed;
  for (const sqlite::Bytes& blob : blobs) checksum = crc32Of(blob, checksum);
  return checksum;
}

std::vector<std::uint8_t> packMask(const Mask& mask) {
  std::vector<std::uint8_t> bytes((mask.grey().total() + 7) / 8);
  std::size_t pixel = 0;
  for (int row = 0; row < mask.grey().rows; ++row) {
    for (int column = 0; column < mask.grey().cols; ++column, ++pixel) {
      const unsigned bit = mask.grey().at<std::uint8_t>(row, column) != 0 ? 0x80U : 0U;
      bytes[pixel / 8] = static_cast<std::uint8_t>(bytes[pixel / 8] | bit >> (pixel % 8));
    }
  }
  return bytes;
}

Mask unpackMask(sqlite::Bytes bytes, const cv::Size& size) {
  const auto pixels = static_cast<std::size_t>(size.area());
  if (bytes.size != (pixels + 7) / 8) {
    throw std::runtime_error("a mask has " + std::to_string(bytes.size) + " bytes instead of " +
                             std::to_string((pixels + 7) / 8));
  }
  cv::Mat grey(size, CV_8U);
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    grey.data[pixel] = (bytes.data[pixel / 8] << (pixel % 8) & 0x80) != 0 ? 255 : 0;
  }
  return Mask(grey);
}

std::vector<std::uint8_t> packKeypoints(const std::vector<SiftKeypoint>& keypoints) {
  std::vector<std::uint8_t> bytes(keypoints.size() * kKeypointBytes);
  std::uint8_t* to = bytes.data();
  for (const SiftKeypoint& keypoint : keypoints) {
    for (const float value : {keypoint.x_px, keypoint.y_px, keypoint.size_px, keypoint.angle_deg}) {
      putFloat(value, to);
      to += sizeof(float);
    }
  }
  return bytes;
}

std::vector<SiftKeypoint> unpackKeypoints(sqlite::Bytes bytes) {
  std::vector<SiftKeypoint> keypoints(bytes.size / kKeypointBytes);
  const std::uint8_t* from = bytes.data;
  for (SiftKeypoint& keypoint : keypoints) {
    keypoint = {getFloat(from), getFloat(from + 4), getFloat(from + 8), getFloat(from + 12)};
    for (const float value : {keypoint.x_px, keypoint.y_px, keypoint.size_px, keypoint.angle_deg}) {
      if (!std::isfinite(value)) throw std::runtime_error("a keypoint is not finite");
    }
    from += kKeypointBytes;
  }
  return keypoints;
}

std::vector<std::uint8_t> packHistogram(const GlobalFeatures::Histogram& histogram) {
  std::vector<std::uint8_t> bytes(kHistogramBytes);
  for (std::size_t i = 0; i < histogram.size(); ++i) putFloat(histogram[i], &bytes[i * sizeof(float)]);
  return bytes;
}

GlobalFeatures::Histogram unpackHistogram(sqlite::Bytes bytes) {
  if (bytes.size != kHistogramBytes) throw std::runtime_error("a global descriptor has a wrong size");
  GlobalFeatures::Histogram histogram{};
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    histogram[i] = getFloat(bytes.data + i * sizeof(float));
    if (!(std::isfinite(histogram[i]) && histogram[i] >= 0.0F)) {
      throw std::runtime_error("a global descriptor is not finite or negative");
    }
  }
  return histogram;
}

}  // namespace visual_localization::map_schema
