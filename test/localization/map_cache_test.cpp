// A track does not depend on what of the map is kept in memory.

#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "test/localization/wall_street.h"
#include "test/support/swarm_config.h"
#include "test/support/temporary_folder.h"
#include "visual_localization/localization/localizer.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization {
namespace {

class MapCache : public test::WallStreet {
 protected:
  /// Positions and similarities, image by image, of a drive along the street with a jump in the middle.
  static std::vector<double> track(const std::shared_ptr<const TrainingMap>& map, const std::string& features) {
    LocalizerConfig config = test::swarmConfig();
    config.features = features;
    Localizer localizer(map, config);
    std::vector<double> numbers;
    for (int i = 0; i < 16; ++i) {
      const Estimate estimate = localizer.process(i * test::kSecond, noisy(viewAt(i < 8 ? 0.6 * i : 20.0), i));
      numbers.insert(numbers.end(),
                     {estimate.pose.position_m.x(), estimate.pose.position_m.y(), estimate.tracked.best.similarity,
                      static_cast<double>(estimate.comparisons), estimate.pose.covariance_m2(0, 0)});
    }
    return numbers;
  }
};

TEST_F(MapCache, TheTrackIsTheSameWithAnyCache) {
  const test::TemporaryFolder folder;
  const std::string path = folder / "street.map";
  saveMap(*map(), path);
  for (const char* features : {"sift", "hybrid"}) {
    const std::vector<double> expected = track(map(), features);
    for (const std::size_t bytes :
         {std::size_t{0}, std::size_t{1}, std::size_t{100'000}, std::numeric_limits<std::size_t>::max()}) {
      EXPECT_EQ(track(loadMap(path, {bytes, {}}), features), expected) << features << ", " << bytes << " bytes";
    }
  }
}

}  // namespace
}  // namespace visual_localization
