// What a map says about the errors of its fixes.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/map/stored_map.h"

namespace visual_localization {
namespace {

using test::MapStore;
using testing::HasSubstr;

class MapBudget : public MapStore {
 protected:
  void SetUp() override {
    MapHeader header = test::exampleHeader();
    header.sessions[0].fixes = FixBudget{0.85, true, 0.5, 43.0, 404.0, 0.7};
    header.sessions[0].doubtful = {{1, 2, 0.5, 7.5, 4.0, 12.0, 0.0}, {5, -1, 100.0, 130.0, 9.0, 0.5, 8.75}};
    saveMap({header, test::exampleImages(12, 20, 1)}, path_);
  }
};

TEST_F(MapBudget, IsReadAsItWasWritten) {
  const auto map = loadMap(path_);
  const auto& fixes = map->header().sessions[0].fixes;
  ASSERT_TRUE(fixes);
  EXPECT_EQ(fixes->declared_m, 0.85);
  EXPECT_TRUE(fixes->assumed);
  EXPECT_EQ(fixes->residual_m, 0.5);
  EXPECT_EQ(fixes->correlation_s, 43.0);
  EXPECT_EQ(fixes->duration_s, 404.0);
  EXPECT_EQ(fixes->sigma_m, 0.7);
  EXPECT_FALSE(map->header().sessions[1].fixes) << "nobody said";
}

TEST_F(MapBudget, DoubtfulStretchesAreReadAsTheyWereWritten) {
  const auto map = loadMap(path_);
  const std::vector<DoubtfulStretch>& doubtful = map->header().sessions[0].doubtful;
  ASSERT_EQ(doubtful.size(), 2U);
  EXPECT_EQ(doubtful[0].from_ns, 1);
  EXPECT_EQ(doubtful[0].to_ns, 2);
  EXPECT_EQ(doubtful[0].from_m, 0.5);
  EXPECT_EQ(doubtful[0].to_m, 7.5);
  EXPECT_EQ(doubtful[0].sigma_m, 4.0);
  EXPECT_EQ(doubtful[0].off_fixes_m, 12.0);
  EXPECT_EQ(doubtful[1].off_turns_m, 8.75);
  EXPECT_TRUE(map->header().sessions[1].doubtful.empty());
}

TEST_F(MapBudget, ThatCannotBeIsRefused) {
  const std::string whole = test::readAll(path_);
  const std::string fixes = "'session/0/fixes/";
  const struct {
    std::string sql, reason;
  } cases[] = {
      {"UPDATE meta SET value = -0.1 WHERE key = " + fixes + "sigma_m'", "fixes/sigma_m' = -0.1"},
      {"UPDATE meta SET value = 9e999 WHERE key = " + fixes + "residual_m'", "residual_m' = inf"},
      {"UPDATE meta SET value = 2 WHERE key = " + fixes + "assumed'", "assumed' = 2 is not 0 or 1"},
      {"UPDATE meta SET value = 'x' WHERE key = " + fixes + "duration_s'", "duration_s' is of the wrong type"},
      {"DELETE FROM meta WHERE key = " + fixes + "correlation_s'", "correlation_s' is missing"},
      {"INSERT INTO meta VALUES(" + fixes + "mood', 1.0)", "fixes/mood' is unknown"},
      {"UPDATE meta SET value = -4.0 WHERE key = 'session/0/doubtful/1/sigma_m'", "doubtful/1/sigma_m' = -4"},
      {"UPDATE meta SET value = 1.5 WHERE key = 'session/0/doubtful/0/from_ns'", "from_ns' is of the wrong type"},
      {"DELETE FROM meta WHERE key = 'session/0/doubtful/0/to_m'", "to_m' is missing"},
      {"DELETE FROM meta WHERE key LIKE 'session/0/doubtful/0/%'", "doubtful/1/from_m' is unknown"},
      {"INSERT INTO meta VALUES('session/0/doubtful/1/mood', 1.0)", "doubtful/1/mood' is unknown"},
  };
  for (const auto& [sql, reason] : cases) {
    test::writeAll(path_, whole);
    tamper(sql);
    EXPECT_THAT(refusal(path_), HasSubstr(reason)) << sql;
  }
}

}  // namespace
}  // namespace visual_localization
