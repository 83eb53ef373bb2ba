#include <chrono>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "test/support/example_map.h"
#include "test/support/refusal.h"
#include "test/support/tamper.h"
#include "test/support/temporary_folder.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization {
namespace {

using testing::HasSubstr;

constexpr std::size_t kPage = 4096;

void putBigEndian(std::string& bytes, std::size_t at, std::uint64_t value, std::size_t count) {
  for (std::size_t i = count; i > 0; --i, value >>= 8U) bytes.at(at + i - 1) = static_cast<char>(value & 0xFFU);
}

/// The pages of a map file, to be changed below SQLite; see https://www.sqlite.org/fileformat.html.
class Pages {
 public:
  explicit Pages(const std::string& path) : path_(path), bytes_(test::readAll(path)) {}

  std::string page(std::size_t number) const { return bytes_.substr((number - 1) * kPage, kPage); }
  void put(std::size_t number, const std::string& page) { bytes_.replace((number - 1) * kPage, kPage, page); }
  /// Returns the number of the new page.
  std::size_t append(const std::string& page) {
    bytes_ += page;
    return bytes_.size() / kPage;
  }
  void save() {
    putBigEndian(bytes_, 28, bytes_.size() / kPage, 4);
    test::writeAll(path_, bytes_);
  }
  std::string& bytes() { return bytes_; }

  /// A page of an inner node: as many cells as given, each a number of a page and then `rest`, and the last page.
  static std::string inner(char type, std::size_t child, const std::string& rest, std::size_t cells,
                           std::size_t last_child, std::size_t header_at = 0) {
    std::string page(kPage, '\0');
    std::size_t content = kPage;
    for (std::size_t i = 0; i < cells; ++i) {
      content -= 4 + rest.size();
      putBigEndian(page, content, child, 4);
      page.replace(content + 4, rest.size(), rest);
      putBigEndian(page, header_at + 12 + 2 * i, content, 2);
    }
    page[header_at] = type;
    putBigEndian(page, header_at + 3, cells, 2);
    putBigEndian(page, header_at + 5, content, 2);
    putBigEndian(page, header_at + 8, last_child, 4);
    return page;
  }

  /// Inner nodes above `leaf`, so deep and wide that there is no end to the ways down. Returns the highest one's
  /// number.
  std::size_t appendMaze(char type, std::size_t leaf, const std::string& rest) {
    constexpr int kDepth = 16;
    constexpr std::size_t kWidth = 200;
    std::size_t child = leaf;
    for (int i = 0; i < kDepth; ++i) child = append(inner(type, child, rest, kWidth, child));
    return child;
  }

 private:
  std::string path_;
  std::string bytes_;
};

class HostileMap : public testing::Test {
 protected:
  void SetUp() override { restore(); }

  void restore() const { saveMap({test::exampleHeader(), test::exampleImages(6, 10)}, path_); }

  void tamper(const std::string& sql) const { test::tamper(path_, "PRAGMA writable_schema = ON; " + sql); }

  std::size_t rootOf(const std::string& table) const {
    sqlite3* database = nullptr;
    sqlite3_stmt* row = nullptr;
    sqlite3_open(path_.c_str(), &database);
    const std::string sql = "SELECT rootpage FROM sqlite_master WHERE name = '" + table + "'";
    sqlite3_prepare_v2(database, sql.c_str(), -1, &row, nullptr);
    sqlite3_step(row);
    const auto root = static_cast<std::size_t>(sqlite3_column_int64(row, 0));
    sqlite3_finalize(row);
    sqlite3_close(database);
    return root;
  }

  /// Why everything that opens a map refuses it, in one line each and soon.
  std::string refusal() const {
    const auto begin = std::chrono::steady_clock::now();
    const std::function<void()> ways[] = {[this] { checkMap(path_); }, [this] { loadMap(path_); }};
    std::string reason;
    for (const auto& way : ways) {
      try {
        way();
        return "accepted";
      } catch (const MapStoreError& error) {
        reason = error.what();
        EXPECT_EQ(reason.rfind(path_ + ": ", 0), 0U) << reason;
        EXPECT_EQ(reason.find_first_of("\n\r\033"), std::string::npos) << reason;
        EXPECT_LT(reason.size(), path_.size() + 400) << reason;
      }
    }
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20)) << reason;
    return reason;
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_ / "a.map";
};

std::string sessionsTo(int count, const std::string& name) {
  return "INSERT OR REPLACE INTO meta WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM n WHERE i < " +
         std::to_string(count - 1) + ") SELECT 'session/' || i, " + name + " FROM n;";
}

TEST_F(HostileMap, MoreSessionsThanARobotCanRecordAreRefused) {
  tamper(sessionsTo(10001, "'monday'"));
  EXPECT_THAT(refusal(), HasSubstr("more than the 10000 sessions"));
  restore();
  tamper(sessionsTo(400001, "'monday'"));
  EXPECT_THAT(refusal(), HasSubstr("more than the 400000 meta values"));
}

TEST_F(HostileMap, ANameWithoutEndIsRefused) {
  tamper(sessionsTo(1, "printf('%.*c', 1000000, 'x')"));
  EXPECT_THAT(refusal(), HasSubstr("the name of session/0 has 1000000 bytes, at most 1000 are allowed"));
}

TEST_F(HostileMap, MasksAreSharedAndBounded) {
  MapHeader header = test::exampleHeader();
  header.image_size = {4096, 4096};
  header.sessions.clear();
  std::vector<TrainingImage> images = test::exampleImages(40, 1);
  cv::Mat grey(header.image_size, CV_8UC1, cv::Scalar(255));
  const auto addSession = [&](int top) {
    grey.row(top).setTo(0);
    Session session;
    session.name = std::to_string(header.sessions.size());
    session.mask = Mask(grey);
    images[header.sessions.size()].session = static_cast<int>(header.sessions.size());
    header.sessions.push_back(session);
  };
  for (TrainingImage& image : images) {
    image.session = 0;
    image.geometry.reset();
  }
  for (int i = 0; i < 40; ++i) addSession(0);
  saveMap({header, images}, path_);
  const auto map = loadMap(path_);
  EXPECT_EQ(map->header().sessions[39].mask.grey().data, map->header().sessions[0].mask.grey().data);
  header.sessions.resize(1);
  for (TrainingImage& image : images) image.session = 0;
  for (int i = 1; i < 17; ++i) addSession(i);
  EXPECT_THAT(test::refusalOf<MapStoreError>([&] {
                saveMap({header, images}, path_);
              }),
              HasSubstr("more than 16 different masks of 4096x4096 pixels"));
}

TEST_F(HostileMap, ASchemaThatDoesSomethingIsRefused) {
  for (const char* sql :
       {"CREATE VIEW v AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i FROM n",
        "ALTER TABLE meta RENAME TO m; CREATE VIEW meta AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 "
        "FROM "
        "n) SELECT 'k' || i AS key, i AS value FROM n",
        "CREATE TRIGGER t AFTER INSERT ON images BEGIN DELETE FROM meta; END",
        "CREATE INDEX i ON images(abs(session))",
        "CREATE INDEX i ON images(session) WHERE session > 1",
        "CREATE TABLE g(a, b AS (a * 2) STORED)",
        "ALTER TABLE images ADD COLUMN more AS (abs(session))",
        "CREATE TABLE c(a CHECK (a > 1), b DEFAULT (random()))",
        "ANALYZE",
        "CREATE TABLE s(a INTEGER PRIMARY KEY AUTOINCREMENT)",
        "DROP TABLE meta; CREATE TABLE meta(key TEXT PRIMARY KEY, value NOT NULL)",
        "UPDATE sqlite_master SET type = 'view' WHERE name = 'images'",
        "UPDATE sqlite_master SET rootpage = 0 WHERE name = 'images'",
        "UPDATE sqlite_master SET rootpage = -7 WHERE name = 'images'",
        "UPDATE sqlite_master SET rootpage = 1 WHERE name = 'images'",
        "UPDATE sqlite_master SET rootpage = 1000000 WHERE name = 'images'",
        "UPDATE sqlite_master SET rootpage = (SELECT rootpage FROM sqlite_master WHERE name = 'meta') WHERE name = "
        "'images'",
        "UPDATE sqlite_master SET sql = 'CREATE VIRTUAL TABLE images USING fts5(a)' WHERE name = 'images'",
        "UPDATE sqlite_master SET sql = 'CREATE VIRTUAL TABLE images USING nothing(' || char(10) || ')' WHERE name = "
        "'images'",
        "UPDATE sqlite_master SET sql = NULL WHERE name = 'images'",
        "UPDATE sqlite_master SET sql = 7 WHERE name = 'images'",
        "UPDATE sqlite_master SET sql = sql || printf('%.*c', 200000, ' ') WHERE name = 'images'",
        "INSERT INTO sqlite_master VALUES('table', 'two' || char(10, 27) || '[2Jlines', 'x', 0, 'nonsense')",
        "CREATE TABLE \"two\nlines\"(a)"}) {
    restore();
    tamper(sql);
    EXPECT_NE(refusal(), "accepted") << sql;
  }
}

TEST_F(HostileMap, AWriteAheadLogAndOtherEncodingsAreRefused) {
  tamper("PRAGMA journal_mode = WAL");
  EXPECT_THAT(refusal(), HasSubstr("write-ahead log"));
  restore();
  Pages pages(path_);
  putBigEndian(pages.bytes(), 56, 2, 4);
  pages.save();
  EXPECT_THAT(refusal(), HasSubstr("not UTF-8"));
}

TEST_F(HostileMap, OddPageSizesAreRefused) {
  const std::string good = test::readAll(path_);
  for (const std::size_t size : {0U, 1U, 2U, 511U, 512U, 1000U, 4095U, 8192U, 65535U}) {
    std::string bytes = good;
    putBigEndian(bytes, 16, size, 2);
    const std::size_t real = size == 1 ? 65536 : size;
    if (real >= 512) bytes.resize((bytes.size() + real - 1) / real * real);
    putBigEndian(bytes, 28, real == 0 ? 0 : bytes.size() / real, 4);
    test::writeAll(path_, bytes);
    EXPECT_NE(refusal(), "accepted") << size;
  }
}

TEST_F(HostileMap, LinesInValuesAreShownInOne) {
  tamper("INSERT INTO meta VALUES('two' || char(10, 27) || '[2Jlines' || printf('%.*c', 3000, 'x'), 1)");
  EXPECT_NE(refusal(), "accepted");
}

TEST_F(HostileMap, ValuesLargerThanAnyRowAreRefused) {
  for (const char* sql : {"UPDATE features SET keypoints = zeroblob(160000000) WHERE image = 3",
                          "UPDATE previews SET jpeg = zeroblob(160000000) WHERE image = 3",
                          "UPDATE landmarks SET points = zeroblob(160000000) WHERE image = 4",
                          "UPDATE meta SET value = zeroblob(160000000) WHERE key = 'package_version'"}) {
    restore();
    tamper(sql);
    EXPECT_NE(refusal(), "accepted") << sql;
  }
}

TEST_F(HostileMap, MetaValuesWithoutEndAreRefused) {
  const std::size_t root = rootOf("meta");
  Pages pages(path_);
  const std::size_t leaf = pages.append(pages.page(root));
  const std::string record{4, 3, 15, 9, 'a'};  // its size; three bytes of header: a text of one byte, the number one
  const std::size_t maze = pages.appendMaze(2, leaf, record);
  pages.put(root, pages.page(maze));
  pages.save();
  EXPECT_THAT(refusal(), HasSubstr("meta values are not in order"));
}

TEST_F(HostileMap, ASchemaWithoutEndIsRefused) {
  // Rows that describe the index that belongs to `meta` anyway may be read again and again.
  const std::string name = "sqlite_autoindex_meta_1";
  const std::string cell =
      std::string{39, 9, 6, 23, 59, 21, 1, 0} + "index" + name + "meta" + static_cast<char>(rootOf("meta"));
  Pages pages(path_);
  std::string tables = pages.page(1);
  const std::size_t header = 8 + 2 * static_cast<unsigned char>(tables[104]);  // it ends with a pointer for each cell
  tables.replace(0, header, tables.substr(100, header));  // of another page, the header stands at its beginning
  const std::size_t first = pages.append(tables);
  std::string leaf(kPage, '\0');
  leaf[0] = 13;
  putBigEndian(leaf, 3, 1, 2);
  putBigEndian(leaf, 5, kPage - cell.size(), 2);
  putBigEndian(leaf, 8, kPage - cell.size(), 2);
  leaf.replace(kPage - cell.size(), cell.size(), cell);
  const std::size_t maze = pages.appendMaze(5, pages.append(leaf), std::string(1, 9));
  const std::string root = Pages::inner(5, first, std::string(1, 5), 1, maze, 100);
  pages.put(1, pages.page(1).substr(0, 100) + root.substr(100));
  pages.save();
  EXPECT_THAT(refusal(), HasSubstr("schema is too large"));
}

TEST_F(HostileMap, BytesThatAreClaimedTwiceAreRefused) {
  const std::size_t length = 300'000;
  for (const char* key : {"x0", "x1", "x2"}) {
    tamper("INSERT INTO meta VALUES('" + std::string(key) + "', printf('%.*c', " + std::to_string(length) + ", 'y'))");
  }
  Pages pages(path_);
  std::string& bytes = pages.bytes();
  const auto overflowOf = [&bytes](const std::string& key) {
    return bytes.find_first_not_of('y', bytes.find(key + "yyyy") + 2);
  };
  const std::string first = bytes.substr(overflowOf("x0"), 4);
  const std::string second = bytes.substr(overflowOf("x1"), 4);
  for (const char* key : {"x1", "x2"}) bytes.replace(overflowOf(key), 4, first);
  std::size_t second_page = 0;
  for (const char c : second) second_page = second_page * 256 + static_cast<unsigned char>(c);
  bytes.resize((second_page - 1) * kPage);
  pages.save();
  EXPECT_THAT(refusal(), HasSubstr("claim more bytes than the file has"));
}

}  // namespace
}  // namespace visual_localization
