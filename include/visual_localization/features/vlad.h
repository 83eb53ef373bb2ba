#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "visual_localization/features/local_features.h"

namespace visual_localization {

/// What a whole image shows, by its local features, for quick comparisons with many others. Made by a VladVocabulary,
/// and only comparable with what the same one made. Empty: not known.
using VladDescriptor = std::vector<std::int8_t>;

/// Cosine of the angle between two descriptors, cut off below 0; 0 unless both are of the same length.
double vladSimilarity(const VladDescriptor& a, const VladDescriptor& b);

/// Vectors of locally aggregated descriptors (Jegou et al., "Aggregating local image descriptors into compact codes",
/// PAMI 2012) over a grid of the picture, so that the layout counts. The residuals of the local descriptors to their
/// nearest words are projected, summed for each cell and word, their signed square root normalised for each word and in
/// all, projected once more, whitened by half, and rounded to a byte an axis. Words and both projections are learnt
/// from the images of a map, of any kind of local features.
class VladVocabulary {
 public:
  static constexpr Eigen::Index kWords = 8;
  static constexpr Eigen::Index kColumns = 4;
  static constexpr Eigen::Index kRows = 3;
  static constexpr Eigen::Index kBlocks = kColumns * kRows * kWords;  ///< sums of residuals
  static constexpr Eigen::Index kMostComponents = 32;                 ///< of a projected residual
  static constexpr Eigen::Index kMostBytes = 256;                     ///< of the descriptor of an image

  /// What was learnt.
  struct Tables {
    Eigen::MatrixXf words;                                            ///< of unit descriptors, a column each
    Eigen::MatrixXf components;                                       ///< of residuals, a column each
    Eigen::VectorXf mean;                                             ///< of the normalised sums
    Eigen::Matrix<std::int8_t, Eigen::Dynamic, Eigen::Dynamic> axes;  ///< of the sums, a column for each byte
    Eigen::VectorXf scales;                                           ///< of the axes
  };

  /// Local features of an image; never null.
  using ImageFeatures = std::function<std::shared_ptr<const LocalFeatures>(std::size_t image)>;
  /// Of up to 768 of so many images of this size, each asked for twice. Null when images or features are too few to
  /// learn from.
  static std::shared_ptr<const VladVocabulary> learn(std::size_t images, const ImageFeatures& features,
                                                     cv::Size image_size);

  /// Throws std::invalid_argument when the sizes of the tables do not agree or a number is not finite.
  VladVocabulary(Tables tables, cv::Size image_size);

  const Tables& tables() const { return tables_; }
  /// Elements of a local descriptor.
  std::size_t dimension() const { return static_cast<std::size_t>(tables_.words.rows()); }
  /// Of the descriptor of an image.
  std::size_t bytes() const { return static_cast<std::size_t>(tables_.axes.cols()); }
  /// Zeros for an image without features. Throws std::invalid_argument for descriptors of another dimension.
  VladDescriptor describe(const LocalFeatures& features) const;

 private:
  Eigen::VectorXf sums(const LocalFeatures& features) const;
  void learnAxes(const std::vector<std::size_t>& sample, const ImageFeatures& features);

  Tables tables_;
  cv::Size image_size_;
};

}  // namespace visual_localization
