#include "visual_localization/features/learned.h"

#include <cmath>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "test/support/synthetic.h"
#include "test/support/temporary_folder.h"

namespace visual_localization {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const char* const kModel = TEST_DATA_DIR "/models/tiny.onnx";

class LearnedTest : public ::testing::Test {
 protected:
  static cv::Mat viewAt(int left_px) { return test::viewOf(test::wall(1000, 240, 5), left_px); }

  std::unique_ptr<LocalExtractor> extractor() {
    kind_.adopt(choice_);
    return kind_.makeExtractor(choice_);
  }

  std::string refusal(const std::string& model) {
    try {
      Learned().adopt(model);
      return "";
    } catch (const ParameterError& error) {
      return error.what();
    }
  }

  std::string choice_ = kModel;
  Learned kind_;
  test::TemporaryFolder folder_;
};

TEST_F(LearnedTest, FindsTheStrongestFarFromTheBorder) {
  LearnedConfig config;
  config.max_features = 40;
  kind_ = Learned(config);
  const LocalFeatures features = extractor()->extract(viewAt(100));
  EXPECT_EQ(features.size(), 40U);
  EXPECT_EQ(features.form(), kind_.form());
  for (const Keypoint keypoint : features.keypoints()) {
    EXPECT_GT(keypoint.x_px, 0.5F);
    EXPECT_LT(keypoint.x_px, 319.0F);
    EXPECT_GT(keypoint.y_px, 0.5F);
    EXPECT_LT(keypoint.y_px, 239.0F);
  }
}

TEST_F(LearnedTest, FollowsAMovedImage) {
  const auto extract = extractor();
  const LocalFeatures here = extract->extract(viewAt(100));
  const LocalFeatures there = extract->extract(viewAt(132));
  std::vector<FeatureMatch> matches;
  matchMutual(here, there, 240.0, matches);
  std::size_t right = 0;
  for (const FeatureMatch& match : matches) {
    const Keypoint a = here.keypoints()[match.a];
    const Keypoint b = there.keypoints()[match.b];
    if (std::hypot(a.x_px - 32.0F - b.x_px, a.y_px - b.y_px) < 1.5F) ++right;
  }
  EXPECT_GT(right, here.size() / 2);
}

TEST_F(LearnedTest, AMapHasThemAsTheyWereExtracted) {
  const LocalFeatures features = extractor()->extract(viewAt(200));
  const std::vector<std::uint8_t> packed = kind_.pack(features);
  ASSERT_EQ(packed.size(), features.size() * kind_.stored_bytes());
  const LocalFeatures again = kind_.unpack(features.keypoints(), packed.data(), packed.size());
  EXPECT_EQ(again.floats(), features.floats());
  for (std::size_t i = 0; i < features.size(); ++i) EXPECT_NEAR(features.inverseNorm(i), 1.0F, 0.05F);
  EXPECT_THROW(kind_.unpack(features.keypoints(), packed.data(), packed.size() - 1), std::runtime_error);
}

TEST_F(LearnedTest, HasNothingToSayOfAFlatImage) {
  const LocalFeatures features = extractor()->extract(cv::Mat(240, 320, CV_8U, cv::Scalar(90)));
  for (const float element : features.floats()) EXPECT_TRUE(std::isfinite(element));
}

TEST_F(LearnedTest, TakesImagesOfAnySize) {
  const auto extract = extractor();
  for (const cv::Size size : {cv::Size(16, 16), cv::Size(321, 50), cv::Size(100, 243)}) {
    EXPECT_NO_THROW(extract->extract(cv::Mat(size, CV_8U, cv::Scalar(7)))) << size;
  }
}

TEST_F(LearnedTest, RefusesWhatIsNoModel) {
  EXPECT_THAT(refusal(""), HasSubstr("--model"));
  const std::string missing = folder_ / "missing.onnx";
  EXPECT_THAT(refusal(missing), HasSubstr(missing));
  const std::string text = folder_ / "text.onnx";
  std::ofstream(text) << "no model";
  EXPECT_THAT(refusal(text), AllOf(HasSubstr(text), testing::Not(HasSubstr("\n"))));
  const std::string whole = readFile(kModel);
  for (const std::size_t percent : {0U, 30U, 60U, 95U}) {
    const std::string cut = folder_ / "cut.onnx";
    std::ofstream(cut, std::ios::binary) << whole.substr(0, percent * whole.size() / 100);
    EXPECT_THAT(refusal(cut), AllOf(HasSubstr(cut), testing::Not(HasSubstr("\n")))) << percent;
  }
}

TEST_F(LearnedTest, RefusesAModelWhoseScoresAreNotFinite) {
  std::string bytes = readFile(kModel);
  const std::string offset("\x00\x00\x80\xC0", 4);  // -4, of the scores
  const std::size_t at = bytes.find(offset);
  ASSERT_NE(at, std::string::npos);
  bytes.replace(at, 4, std::string("\x00\x00\xC0\x7F", 4));
  const std::string path = folder_ / "nan.onnx";
  std::ofstream(path, std::ios::binary) << bytes;
  EXPECT_THAT(refusal(path), AllOf(HasSubstr(path), HasSubstr("'scores' is not finite")));
}

/// Of ONNX's fields (onnx.proto): number, then length and bytes.
std::string field(char number, const std::string& bytes) {
  return std::string{static_cast<char>(8 * number + 2), static_cast<char>(bytes.size())} + bytes;
}

/// Its scores are a plane of zeros of 3 GiB.
std::string largeModel() {
  const std::string sides("\x01\x01\x80\x80\x02\x80\xc0\x01");  // 1 x 1 x 32768 x 24576
  const std::string shape = "\x08\x04\x10\x07" + field(7, sides) + field(8, "shape");
  const std::string node = field(1, "shape") + field(2, "scores") + field(4, "ConstantOfShape");
  const std::string real_numbers("\x08\x01\x12\x00", 4);
  const std::string output = field(1, "scores") + field(2, field(1, real_numbers));
  const std::string graph = field(1, node) + field(2, "large") + field(5, shape) + field(12, output);
  return "\x08\x07" + field(7, graph) + field(8, "\x10\x0b");
}

TEST_F(LearnedTest, RefusesAModelThatTakesTooMuchMemory) {
  const std::string path = folder_ / "large.onnx";
  std::ofstream(path, std::ios::binary) << largeModel();
  EXPECT_THAT(refusal(path), AllOf(HasSubstr(path), HasSubstr("takes too much memory")));
}

// OpenCV 4.6 is ended by three of them. The map is as strange as the model: it has its checksum.
TEST_F(LearnedTest, SurvivesDamagedModels) {
  const auto refusalOfMapsModel = [](const std::string& model, const std::string& checksum) -> std::string {
    LearnedConfig config;
    config.checksum = checksum;
    try {
      Learned(config).makeExtractor(model);
      return "";
    } catch (const ParameterError& error) {
      return error.what();
    }
  };
  const std::string whole = readFile(TEST_DATA_DIR "/../fuzz/corpus/model/accepted/small.onnx");
  const std::string path = folder_ / "damaged.onnx";
  std::mt19937 random(1);
  for (int i = 0; i < 60; ++i) {
    std::string damaged = whole;
    damaged[random() % damaged.size()] ^= static_cast<char>(1U << random() % 8U);
    std::ofstream(path, std::ios::binary) << damaged;
    const std::string said = "its CRC-32 ";
    const std::string other = refusalOfMapsModel(path, "00000001");
    ASSERT_THAT(other, HasSubstr(said));
    const std::string text = refusalOfMapsModel(path, other.substr(other.find(said) + said.size(), 8));
    EXPECT_THAT(text, Not(HasSubstr(said)));
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
  }
}

TEST_F(LearnedTest, OpenCvSeesNoOtherModelThanTheMaps) {
  const std::string path = folder_ / "other.onnx";
  std::ofstream(path) << "no model at all";
  try {
    kind_.adopt(choice_);
    kind_.makeExtractor(path);
    FAIL() << "was taken for the same";
  } catch (const ParameterError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr(path), HasSubstr("is not that of the model")));
  }
}

TEST_F(LearnedTest, RefusesAnotherModelThanTheMaps) {
  LearnedConfig config;
  config.checksum = "00000001";
  try {
    Learned(config).makeExtractor(choice_);
    FAIL() << "was taken for the same";
  } catch (const ParameterError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("tiny.onnx"), HasSubstr("00000001")));
  }
}

}  // namespace
}  // namespace visual_localization
