/// Changes a map file as somebody would who knows its format, so that the fuzzer gets beyond header and checksums: by
/// SQL, or byte by byte, and then all checksums may be made anew.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <sqlite3.h>

#include "map/map_schema.h"
#include "visual_localization/map/map_file.h"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace visual_localization {
namespace {

using Random = std::minstd_rand;
using Row = std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)>;

template <std::size_t n>
const char* oneOf(const std::array<const char*, n>& options, Random& random) {
  return options.at(random() % n);
}

/// A map in memory that may be changed at will.
class Editor {
 public:
  Editor(const std::uint8_t* bytes, std::size_t size) {
    sqlite3_open(":memory:", &handle_);
    auto* copy = static_cast<std::uint8_t*>(sqlite3_malloc64(size));
    std::memcpy(copy, bytes, size);
    constexpr unsigned kFlags = SQLITE_DESERIALIZE_RESIZEABLE | SQLITE_DESERIALIZE_FREEONCLOSE;
    const auto count = static_cast<sqlite3_int64>(size);
    sqlite3_deserialize(handle_, "main", copy, count, count, kFlags);
    sqlite3_limit(handle_, SQLITE_LIMIT_LENGTH, 1 << 20);
    sqlite3_progress_handler(
        handle_, 100000, [](void*) { return 1; }, nullptr);
    sqlite3_db_config(handle_, SQLITE_DBCONFIG_WRITABLE_SCHEMA, 1, nullptr);
  }
  ~Editor() { sqlite3_close_v2(handle_); }
  Editor(const Editor&) = delete;
  Editor& operator=(const Editor&) = delete;

  void execute(const std::string& sql) { sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr); }

  Row prepare(const char* sql) {
    sqlite3_stmt* statement = nullptr;
    sqlite3_prepare_v2(handle_, sql, -1, &statement, nullptr);
    return {statement, sqlite3_finalize};
  }

  /// To be called before the checksums are repaired.
  void readImages() {
    const Row row =
        prepare("SELECT id, session, stamp_ns, east_m, north_m, yaw_rad, feature_count FROM images ORDER BY id");
    while (row && sqlite3_step(row.get()) == SQLITE_ROW) {
      const auto integer = [&row](int column) { return std::int64_t{sqlite3_column_int64(row.get(), column)}; };
      const auto real = [&row](int column) { return sqlite3_column_double(row.get(), column); };
      images_.push_back({integer(0), integer(1), integer(2), real(3), real(4), real(5), integer(6)});
    }
  }

  /// To be called before repairRows().
  void computeSeeds() {
    for (const map_schema::ImageRow& image : images_) seeds_[image.id] = map_schema::rowSeed(image);
  }

  /// `select`: the image, its blobs and their checksum.
  void repairRows(const char* select, int blobs, const char* update) {
    std::vector<std::pair<std::int64_t, std::int64_t>> checksums;
    const Row row = prepare(select);
    while (row && sqlite3_step(row.get()) == SQLITE_ROW) {
      const auto blob = [&row](int column) {
        const void* data = sqlite3_column_blob(row.get(), column);
        return sqlite::Bytes{static_cast<const std::uint8_t*>(data),
                             static_cast<std::size_t>(sqlite3_column_bytes(row.get(), column))};
      };
      const std::int64_t image = sqlite3_column_int64(row.get(), 0);
      const std::int64_t seed = seeds_[image];
      const std::int64_t checksum =
          blobs == 1 ? map_schema::rowChecksum(seed, {blob(1)}) : map_schema::rowChecksum(seed, {blob(1), blob(2)});
      if (sqlite3_column_int64(row.get(), blobs + 1) != checksum) checksums.emplace_back(image, checksum);
    }
    if (checksums.empty()) return;
    const Row change = prepare(update);
    for (const auto& [image, checksum] : checksums) {
      sqlite3_bind_int64(change.get(), 1, checksum);
      sqlite3_bind_int64(change.get(), 2, image);
      sqlite3_step(change.get());
      sqlite3_reset(change.get());
    }
  }

  /// To be called before repairChecksum().
  void repairMasks() {
    std::vector<std::pair<std::int64_t, std::int64_t>> checksums;
    const Row row = prepare("SELECT session, bits FROM masks");
    while (row && sqlite3_step(row.get()) == SQLITE_ROW) {
      const auto* data = static_cast<const std::uint8_t*>(sqlite3_column_blob(row.get(), 1));
      const auto size = static_cast<std::size_t>(sqlite3_column_bytes(row.get(), 1));
      checksums.emplace_back(sqlite3_column_int64(row.get(), 0), map_schema::crc32Of({data, size}));
    }
    const Row change = prepare("INSERT OR REPLACE INTO meta VALUES('session/' || ? || '/mask', ?)");
    for (const auto& [session, checksum] : checksums) {
      sqlite3_bind_int64(change.get(), 1, session);
      sqlite3_bind_int64(change.get(), 2, checksum);
      sqlite3_step(change.get());
      sqlite3_reset(change.get());
    }
  }

  /// To be called before repairChecksum().
  void repairVocabulary() {
    const Row row = prepare("SELECT learnt FROM vocabulary");
    if (!row || sqlite3_step(row.get()) != SQLITE_ROW) return;
    const auto* data = static_cast<const std::uint8_t*>(sqlite3_column_blob(row.get(), 0));
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(row.get(), 0));
    const Row change = prepare("INSERT OR REPLACE INTO meta VALUES('vocabulary', ?)");
    sqlite3_bind_int64(change.get(), 1, map_schema::crc32Of({data, size}));
    sqlite3_step(change.get());
  }

  void repairChecksum() {
    map_schema::Checksum checksum;
    for (const map_schema::ImageRow& image : images_) image.addTo(checksum);
    checksum.add(meta());
    const Row change = prepare("INSERT OR REPLACE INTO meta VALUES('checksum', ?)");
    sqlite3_bind_int64(change.get(), 1, checksum.value());
    sqlite3_step(change.get());
  }

  std::vector<std::uint8_t> bytes() {
    sqlite3_int64 size = 0;
    std::uint8_t* data = sqlite3_serialize(handle_, "main", &size, 0);
    if (data == nullptr) return {};
    std::vector<std::uint8_t> copy(data, data + size);
    sqlite3_free(data);
    return copy;
  }

 private:
  ParameterValues meta() {
    ParameterValues values;
    const Row row = prepare("SELECT key, value FROM meta WHERE key <> 'checksum'");
    while (row && sqlite3_step(row.get()) == SQLITE_ROW) {
      const auto text = [&row](int column) {
        const auto* data = reinterpret_cast<const char*>(sqlite3_column_text(row.get(), column));
        return std::string(data == nullptr ? "" : data,
                           static_cast<std::size_t>(sqlite3_column_bytes(row.get(), column)));
      };
      const int type = sqlite3_column_type(row.get(), 1);
      ParameterValue& value = values[text(0)];
      if (type == SQLITE_INTEGER) {
        value = std::int64_t{sqlite3_column_int64(row.get(), 1)};
      } else if (type == SQLITE_FLOAT) {
        value = sqlite3_column_double(row.get(), 1);
      } else {
        value = text(1);
      }
    }
    return values;
  }

  sqlite3* handle_ = nullptr;
  std::vector<map_schema::ImageRow> images_;
  std::map<std::int64_t, std::int64_t> seeds_;  ///< of the images' rows
};

/// A statement, and the table that it changes alone; empty: it may be any.
struct Sql {
  std::string text;
  std::string table;
};

Sql anySql(Random& random) {
  static const std::array<const char*, 27> kColumns{
      "images.id",      "images.session",       "images.stamp_ns",    "images.east_m",        "images.north_m",
      "images.yaw_rad", "images.feature_count", "features.keypoints", "features.descriptors", "features.image",
      "globals.wgoh",   "globals.wgii",         "previews.jpeg",      "previews.image",       "meta.key",
      "meta.value",     "landmarks.pose",       "landmarks.points",   "landmarks.image",      "landmarks.crc32",
      "masks.session",  "masks.bits",           "vlads.image",        "vlads.descriptor",     "vlads.crc32",
      "vocabulary.id",  "vocabulary.learnt"};
  static const std::array<const char*, 25> kValues{"0",
                                                   "1",
                                                   "-1",
                                                   "9223372036854775807",
                                                   "-9223372036854775808",
                                                   "4294967296",
                                                   "1e308",
                                                   "-1e308",
                                                   "9e999",
                                                   "0.5",
                                                   "'text'",
                                                   "x''",
                                                   "x'00'",
                                                   "zeroblob(16)",
                                                   "zeroblob(140)",
                                                   "zeroblob(20)",
                                                   "randomblob(40)",
                                                   "zeroblob(512)",
                                                   "zeroblob(100000)",
                                                   "randomblob(128)",
                                                   "1e5",
                                                   "'learned'",
                                                   "'sift'",
                                                   "4294967296000000001",
                                                   "-4294967296000000001"};
  static const std::array<const char*, 30> kOthers{
      "CREATE VIEW v AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i+1 FROM n) SELECT i FROM n",
      "CREATE TRIGGER t AFTER INSERT ON images BEGIN DELETE FROM meta; END",
      "CREATE INDEX i ON images(abs(session))",
      "CREATE VIRTUAL TABLE f USING fts5(a)",
      "CREATE TABLE g(a, b AS (a * 2))",
      "UPDATE sqlite_master SET rootpage = (SELECT abs(random()) % 12)",
      "UPDATE sqlite_master SET name = name || char(10)",
      "UPDATE sqlite_master SET sql = sql || char(10)",
      "UPDATE sqlite_master SET type = 'view'",
      "INSERT INTO meta VALUES('session/2' || char(10), 'x')",
      "DELETE FROM images WHERE id = (SELECT max(id) FROM images)",
      "DELETE FROM features",
      "DROP TABLE previews",
      "DELETE FROM landmarks",
      "INSERT OR REPLACE INTO landmarks SELECT image + 1, pose, points, 0 FROM landmarks",
      "UPDATE landmarks SET pose = CAST(substr(pose, 1, 56) || randomblob(84) AS BLOB)",
      "UPDATE meta SET value = 'learned' WHERE key = 'features/kind'",
      "UPDATE meta SET value = value - 1 WHERE key LIKE '%/dimension'",
      "UPDATE images SET stamp_ns = stamp_ns * (1 - 2 * (id % 2)) * 3",
      "UPDATE landmarks SET points = CAST(points || points AS BLOB)",
      "DELETE FROM vlads",
      "DELETE FROM vocabulary; DELETE FROM meta WHERE key = 'vocabulary'",
      "INSERT OR REPLACE INTO vlads SELECT image + 1, descriptor, 0 FROM vlads",
      "UPDATE vlads SET descriptor = randomblob(length(descriptor))",
      "UPDATE vocabulary SET learnt = CAST(substr(learnt, 1, 4) || randomblob(length(learnt) - 4) AS BLOB)",
      "UPDATE vocabulary SET learnt = CAST(substr(learnt, 1, 4) || zeroblob(length(learnt) - 4) AS BLOB)",
      "UPDATE vocabulary SET learnt = CAST(randomblob(4) || substr(learnt, 5) AS BLOB)",
      "PRAGMA page_size = 1024; VACUUM",
      "PRAGMA auto_vacuum = FULL; VACUUM",
      "PRAGMA encoding = 'UTF-16'; VACUUM"};
  if (random() % 6 == 0) return {oneOf(kOthers, random), ""};
  const std::string column = oneOf(kColumns, random);
  const std::size_t dot = column.find('.');
  const std::string table = column.substr(0, dot);
  const std::string where = random() % 4 == 0 ? "" : " WHERE rowid = " + std::to_string(random() % 4);
  const std::string which = table == "meta" ? " WHERE random() % 5 = 0" : where;
  return {"UPDATE OR REPLACE " + table + " SET " + column.substr(dot + 1) + " = " + oneOf(kValues, random) + which,
          table};
}

/// `changed`: the only table whose rows need new checksums; empty: all. Those of all depend on the table `images`.
void repairChecksums(Editor& editor, const std::string& changed) {
  const auto is_changed = [&changed](const char* table) {
    return changed.empty() || changed == "images" || changed == table;
  };
  editor.readImages();
  if (is_changed("features") || is_changed("globals") || is_changed("previews") || is_changed("landmarks") ||
      is_changed("vlads")) {
    editor.computeSeeds();
  }
  if (is_changed("features")) {
    editor.repairRows("SELECT image, keypoints, descriptors, crc32 FROM features", 2,
                      "UPDATE features SET crc32 = ? WHERE image = ?");
  }
  if (is_changed("globals")) {
    editor.repairRows("SELECT image, wgoh, wgii, crc32 FROM globals", 2,
                      "UPDATE globals SET crc32 = ? WHERE image = ?");
  }
  if (is_changed("previews")) {
    editor.repairRows("SELECT image, jpeg, crc32 FROM previews", 1, "UPDATE previews SET crc32 = ? WHERE image = ?");
  }
  if (is_changed("landmarks")) {
    editor.repairRows("SELECT image, pose, points, crc32 FROM landmarks", 2,
                      "UPDATE landmarks SET crc32 = ? WHERE image = ?");
  }
  if (is_changed("vlads")) {
    editor.repairRows("SELECT image, descriptor, crc32 FROM vlads", 1, "UPDATE vlads SET crc32 = ? WHERE image = ?");
  }
  if (is_changed("masks")) editor.repairMasks();
  if (is_changed("vocabulary")) editor.repairVocabulary();
  editor.repairChecksum();
}

void putBigEndian(std::vector<std::uint8_t>& bytes, std::size_t at, std::uint64_t value) {
  for (std::size_t i = 0; i < 4; ++i) bytes.at(at + i) = static_cast<std::uint8_t>(value >> (24 - 8 * i));
}

/// What tells a map from another file, and the number of its pages.
void repairHeader(std::vector<std::uint8_t>& bytes) {
  if (bytes.size() < 512) return;
  const std::size_t declared = bytes[16] * 256U + bytes[17];
  const std::size_t page = declared == 1 ? 65536 : std::max<std::size_t>(declared, 512);
  bytes.resize((bytes.size() + page - 1) / page * page);
  putBigEndian(bytes, 28, bytes.size() / page);
  putBigEndian(bytes, 60, kMapSchemaVersion);
  putBigEndian(bytes, 68, static_cast<std::uint64_t>(map_schema::kApplicationId));
}

void mutateBytes(std::vector<std::uint8_t>& bytes, std::size_t max_size, Random& random) {
  if (bytes.size() < 64 || random() % 4 == 0) {
    const std::size_t size = bytes.size();
    bytes.resize(max_size);
    bytes.resize(LLVMFuzzerMutate(bytes.data(), size, max_size));
    return;
  }
  const std::size_t length = 1 + random() % 64;
  const std::size_t at = random() % (bytes.size() - length + 1);
  LLVMFuzzerMutate(&bytes[at], length, length);  // in place: everything else stays where it is
}

}  // namespace
}  // namespace visual_localization

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned int seed) {
  using namespace visual_localization;
  Random random(seed);
  std::vector<std::uint8_t> bytes(data, data + size);
  const bool by_sql = size >= 512 && random() % 2 == 0;
  if (!by_sql) mutateBytes(bytes, max_size, random);
  if (random() % 8 != 0) repairHeader(bytes);
  if (bytes.size() >= 512 && (by_sql || random() % 4 == 0)) {
    Editor editor(bytes.data(), bytes.size());
    const Sql sql = by_sql ? anySql(random) : Sql();
    if (by_sql) editor.execute(sql.text);
    if (random() % 8 != 0) repairChecksums(editor, sql.table);
    if (std::vector<std::uint8_t> changed = editor.bytes(); !changed.empty()) bytes = std::move(changed);
    if (random() % 8 != 0) repairHeader(bytes);
  }
  if (bytes.size() > max_size) return 0;
  std::copy(bytes.begin(), bytes.end(), data);
  return bytes.size();
}
