#include "visual_localization/features/vlad.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include <Eigen/Eigenvalues>

namespace visual_localization {
namespace {

constexpr std::size_t kMostSampled = 768;        ///< images to learn from
constexpr std::size_t kMostDescriptors = 20000;  ///< local ones, likewise
constexpr std::size_t kImagesForEachByte = 2;    ///< an axis from less would describe single images
constexpr std::size_t kLeastDescriptors = 10 * VladVocabulary::kWords;
constexpr float kWhitening = 0.5F;  ///< an element is divided by this power of its standard deviation
constexpr float kClipped = 4.0F;    ///< times the root mean square of the elements: larger ones are hardly there
constexpr float kLargest = std::numeric_limits<std::int8_t>::max();

/// `count` numbers, evenly spread over [0, size).
std::vector<std::size_t> spread(std::size_t size, std::size_t count) {
  std::vector<std::size_t> numbers(std::min(size, count));
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = i * size / numbers.size();
  return numbers;
}

template <class Element>
void copyUnit(const Element* descriptor, float inverse_norm, Eigen::Ref<Eigen::VectorXf> to) {
  for (Eigen::Index i = 0; i < to.size(); ++i) to[i] = static_cast<float>(descriptor[i]) * inverse_norm;
}

void copyUnit(const LocalFeatures& features, std::size_t i, Eigen::Ref<Eigen::VectorXf> to) {
  if (features.form().element == DescriptorElement::kByte) {
    copyUnit(features.bytes(i), features.inverseNorm(i), to);
  } else {
    copyUnit(features.floats(i), features.inverseNorm(i), to);
  }
}

/// Unit descriptors of these images, a column each.
Eigen::MatrixXf sampledDescriptors(const std::vector<std::size_t>& sample,
                                   const VladVocabulary::ImageFeatures& features) {
  Eigen::MatrixXf descriptors;
  Eigen::Index count = 0;
  for (const std::size_t image : sample) {
    const std::shared_ptr<const LocalFeatures> local = features(image);
    if (local->empty()) continue;
    if (count == 0) descriptors.resize(static_cast<Eigen::Index>(local->form().dimension), kMostDescriptors);
    for (const std::size_t i : spread(local->size(), kMostDescriptors / sample.size())) {
      copyUnit(*local, i, descriptors.col(count++));
    }
  }
  descriptors.conservativeResize(Eigen::NoChange, count);
  return descriptors;
}

/// Restores OpenCV's generator, which k-means draws from: it is the whole program's.
class SeededOpenCv {
 public:
  explicit SeededOpenCv(std::uint64_t seed) : before_(std::exchange(cv::theRNG(), cv::RNG(seed))) {}
  ~SeededOpenCv() { cv::theRNG() = before_; }
  SeededOpenCv(const SeededOpenCv&) = delete;
  SeededOpenCv& operator=(const SeededOpenCv&) = delete;

 private:
  cv::RNG before_;
};

/// The same for the same descriptors.
Eigen::MatrixXf learnWords(Eigen::MatrixXf& descriptors) {
  constexpr std::uint64_t kSeed = 1;
  const SeededOpenCv seeded(kSeed);
  const cv::Mat rows(static_cast<int>(descriptors.cols()), static_cast<int>(descriptors.rows()), CV_32F,
                     descriptors.data());
  const cv::TermCriteria until(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 20, 1e-4);
  cv::Mat labels;
  cv::Mat centres;
  cv::kmeans(rows, static_cast<int>(VladVocabulary::kWords), labels, until, 1, cv::KMEANS_PP_CENTERS, centres);
  return Eigen::Map<const Eigen::MatrixXf>(centres.ptr<float>(), descriptors.rows(), VladVocabulary::kWords);
}

/// Half of the squared length of each.
Eigen::VectorXf halvedSquares(const Eigen::MatrixXf& words) {
  Eigen::VectorXf halves(words.cols());
  for (Eigen::Index i = 0; i < words.cols(); ++i) halves[i] = 0.5F * words.col(i).squaredNorm();
  return halves;
}

/// Of a unit descriptor. Half of the squared distance is what is smallest, but for the length of the descriptor.
Eigen::Index nearestWord(const Eigen::MatrixXf& words, const Eigen::VectorXf& halves,
                         const Eigen::VectorXf& descriptor) {
  Eigen::Index nearest = 0;
  float least = std::numeric_limits<float>::max();
  for (Eigen::Index i = 0; i < words.cols(); ++i) {
    const float distance = halves[i] - words.col(i).dot(descriptor);
    if (distance >= least) continue;
    least = distance;
    nearest = i;
  }
  return nearest;
}

/// Directions in which residuals differ most, a column each, the first the most.
Eigen::MatrixXf learnComponents(Eigen::MatrixXf descriptors, const Eigen::MatrixXf& words) {
  const Eigen::VectorXf halves = halvedSquares(words);
  for (auto descriptor : descriptors.colwise()) {
    const Eigen::VectorXf copy = descriptor;
    descriptor -= words.col(nearestWord(words, halves, copy));
  }
  const Eigen::MatrixXf covariance = descriptors * descriptors.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXf> solver(covariance);
  const Eigen::Index count = std::min(VladVocabulary::kMostComponents, words.rows());
  return solver.eigenvectors().rightCols(count).rowwise().reverse();
}

/// Factor of an element of a unit vector.
float stepsOf(std::size_t elements) {
  return kLargest * std::max(1.0F, std::sqrt(static_cast<float>(elements)) / kClipped);
}

/// Where in the grid.
Eigen::Index cellOf(const Keypoint& keypoint, cv::Size image_size) {
  const auto line = [](float at_px, int length_px, Eigen::Index count) {
    const auto number = static_cast<Eigen::Index>(at_px * static_cast<float>(count) / static_cast<float>(length_px));
    return std::clamp<Eigen::Index>(number, 0, count - 1);
  };
  return line(keypoint.x_px, image_size.width, VladVocabulary::kColumns) * VladVocabulary::kRows +
         line(keypoint.y_px, image_size.height, VladVocabulary::kRows);
}

void require(bool met, const std::string& what) {
  if (!met) throw std::invalid_argument("vocabulary: " + what);
}

}  // namespace

double vladSimilarity(const VladDescriptor& a, const VladDescriptor& b) {
  if (a.size() != b.size() || a.empty()) return 0.0;
  std::int32_t product = 0;
  for (std::size_t i = 0; i < a.size(); ++i) product += std::int32_t{a[i]} * std::int32_t{b[i]};
  const double step = static_cast<double>(stepsOf(a.size()));
  return std::clamp(static_cast<double>(product) / (step * step), 0.0, 1.0);
}

VladVocabulary::VladVocabulary(Tables tables, cv::Size image_size)
    : tables_(std::move(tables)), image_size_(image_size) {
  const Eigen::Index sums = kBlocks * tables_.components.cols();
  require(image_size_.width > 0 && image_size_.height > 0, "the size of the images is not positive");
  require(tables_.words.rows() > 0 && tables_.words.cols() == kWords, "there are not 8 words");
  require(tables_.components.rows() == tables_.words.rows(), "words and components are of different dimensions");
  require(tables_.components.cols() > 0 && tables_.components.cols() <= kMostComponents,
          "1 to 32 components are needed");
  require(tables_.mean.size() == sums && tables_.axes.rows() == sums, "mean or axes are of another dimension");
  require(tables_.axes.cols() > 0 && tables_.axes.cols() <= kMostBytes, "1 to 256 axes are needed");
  require(tables_.scales.size() == tables_.axes.cols(), "there is not a scale for each axis");
  require(tables_.words.allFinite() && tables_.components.allFinite() && tables_.mean.allFinite() &&
              tables_.scales.allFinite(),
          "a number is not finite");
}

std::shared_ptr<const VladVocabulary> VladVocabulary::learn(std::size_t images, const ImageFeatures& features,
                                                            cv::Size image_size) {
  const std::vector<std::size_t> sample = spread(images, kMostSampled);
  const auto bytes = std::min<Eigen::Index>(kMostBytes, static_cast<Eigen::Index>(sample.size() / kImagesForEachByte));
  if (bytes == 0) return nullptr;
  Eigen::MatrixXf descriptors = sampledDescriptors(sample, features);
  if (static_cast<std::size_t>(descriptors.cols()) < kLeastDescriptors) return nullptr;
  Tables tables;
  tables.words = learnWords(descriptors);
  tables.components = learnComponents(std::move(descriptors), tables.words);
  const Eigen::Index sums = kBlocks * tables.components.cols();
  tables.mean = Eigen::VectorXf::Zero(sums);
  tables.axes.setZero(sums, bytes);
  tables.scales = Eigen::VectorXf::Zero(bytes);
  const auto vocabulary = std::make_shared<VladVocabulary>(std::move(tables), image_size);
  vocabulary->learnAxes(sample, features);
  return vocabulary;
}

/// Principal axes of the sums, from the products of the images with each other: they are fewer than the sums.
void VladVocabulary::learnAxes(const std::vector<std::size_t>& sample, const ImageFeatures& features) {
  Eigen::MatrixXf of_images(tables_.mean.size(), static_cast<Eigen::Index>(sample.size()));
  for (std::size_t i = 0; i < sample.size(); ++i)
    of_images.col(static_cast<Eigen::Index>(i)) = sums(*features(sample[i]));
  tables_.mean = of_images.rowwise().mean();
  of_images.colwise() -= tables_.mean;
  const Eigen::MatrixXf products = of_images.transpose() * of_images;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXf> solver(products);
  for (Eigen::Index i = 0; i < tables_.axes.cols(); ++i) {
    const Eigen::Index from = products.cols() - 1 - i;
    const float variance = solver.eigenvalues()[from];
    const Eigen::VectorXf axis = of_images * solver.eigenvectors().col(from);  // of length sqrt(variance)
    const float largest = axis.cwiseAbs().maxCoeff();
    // All images may be alike.
    if (!(variance > std::numeric_limits<float>::epsilon() * solver.eigenvalues().tail<1>()[0]) || !(largest > 0.0F)) {
      continue;
    }
    tables_.axes.col(i) = (axis * (kLargest / largest)).array().round().cast<std::int8_t>();
    // To unit length, and a part of the whitening.
    tables_.scales[i] = largest / kLargest * std::pow(variance, -0.5F * (1.0F + kWhitening));
  }
}

/// For each cell and word what its descriptors have in common, against the word.
Eigen::VectorXf VladVocabulary::sums(const LocalFeatures& features) const {
  if (!features.empty() && features.form().dimension != dimension()) {
    throw std::invalid_argument("vocabulary: a descriptor has " + std::to_string(features.form().dimension) +
                                " elements instead of " + std::to_string(dimension()));
  }
  Eigen::MatrixXf residuals = Eigen::MatrixXf::Zero(tables_.words.rows(), kBlocks);
  Eigen::VectorXf descriptor(tables_.words.rows());
  const Eigen::VectorXf halves = halvedSquares(tables_.words);
  std::size_t i = 0;
  for (const Keypoint& keypoint : features.keypoints()) {
    copyUnit(features, i++, descriptor);
    const Eigen::Index word = nearestWord(tables_.words, halves, descriptor);
    residuals.col(cellOf(keypoint, image_size_) * kWords + word) += descriptor - tables_.words.col(word);
  }
  Eigen::MatrixXf projected = tables_.components.transpose() * residuals;
  projected = projected.array().sign() * projected.array().abs().sqrt();
  for (auto block : projected.colwise()) block.normalize();
  const Eigen::VectorXf all = Eigen::Map<const Eigen::VectorXf>(projected.data(), projected.size());
  return all.normalized();
}

VladDescriptor VladVocabulary::describe(const LocalFeatures& features) const {
  VladDescriptor descriptor(bytes(), 0);
  if (features.empty()) return descriptor;
  const Eigen::VectorXf centred = sums(features) - tables_.mean;
  Eigen::VectorXf elements(tables_.axes.cols());
  for (Eigen::Index i = 0; i < elements.size(); ++i) {
    elements[i] = tables_.scales[i] * tables_.axes.col(i).cast<float>().dot(centred);
  }
  elements = elements.normalized() * stepsOf(bytes());
  for (std::size_t i = 0; i < descriptor.size(); ++i) {
    const float rounded = std::round(elements[static_cast<Eigen::Index>(i)]);
    descriptor[i] = static_cast<std::int8_t>(std::clamp(rounded, -kLargest, kLargest));
  }
  return descriptor;
}

}  // namespace visual_localization
