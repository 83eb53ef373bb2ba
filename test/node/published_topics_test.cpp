#include "node/published_topics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace visual_localization {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const char* const kRaw = "sensor_msgs/Image";
const char* const kCompressed = "sensor_msgs/CompressedImage";

TEST(TopicHint, IsEmptyWhereAllIsWellOrNothingIsThere) {
  EXPECT_EQ(topicHint("/a/image_raw", kRaw, {{"/a/image_raw", kRaw}}), "");
  EXPECT_EQ(topicHint("/a/image_raw", kRaw, {{"/b/image_raw", kRaw}}), "");
  EXPECT_EQ(topicHint("/a/image_raw/compressed", kCompressed, {}), "");
}

TEST(TopicHint, NamesTheDoubledSuffix) {
  const std::string topic = "/a/image_raw/compressed/compressed";
  EXPECT_THAT(topicHint(topic, kCompressed, {}), AllOf(HasSubstr("twice"), HasSubstr("set image to /a/image_raw")));
  EXPECT_EQ(topicHint(topic, kCompressed, {{"/a/image_raw/compressed", kCompressed}}),
            "; /a/image_raw/compressed is of type sensor_msgs/CompressedImage: set image to /a/image_raw and "
            "image_transport to compressed");
}

TEST(TopicHint, NamesTheTypeFoundAndTheOtherTransport) {
  EXPECT_EQ(topicHint("/a/points", kRaw, {{"/a/points", "sensor_msgs/PointCloud2"}}),
            "; /a/points is of type sensor_msgs/PointCloud2");
  EXPECT_THAT(topicHint("/a/image_raw", kRaw, {{"/a/image_raw/compressed", kCompressed}}),
              HasSubstr("image_transport to compressed"));
  EXPECT_THAT(topicHint("/a/image_raw/compressed", kCompressed, {{"/a/image_raw", kRaw}}),
              HasSubstr("set image to /a/image_raw and image_transport to raw"));
  EXPECT_THAT(topicHint("/a/image_raw/compressed", kRaw, {{"/a/image_raw/compressed", kCompressed}}),
              HasSubstr("set image to /a/image_raw and image_transport to compressed"));
  EXPECT_THAT(topicHint("/a/jpeg", kRaw, {{"/a/jpeg", kCompressed}}), HasSubstr("must end in /compressed"));
}

TEST(TopicHint, IsOneLine) {
  const std::string hint = topicHint("/a", kRaw, {{"/a", "evil/T\n\x1b[31m" + std::string(10000, 'x')}});
  EXPECT_EQ(hint.find_first_of("\n\x1b"), std::string::npos);
  EXPECT_LT(hint.size(), 400U);
}

}  // namespace
}  // namespace visual_localization
