#pragma once

#include <cstddef>
#include <deque>
#include <vector>

#include "evaluation/place_recogniser.h"

namespace visual_localization {

/// Recognises short sequences instead of single images, in the manner of SeqSLAM (Milford and Wyeth, "SeqSLAM:
/// Visual Route-Based Navigation for Sunny Summer Days and Stormy Winter Nights", ICRA 2012), but online: the answer is
/// where the best straight line through the last images ends.
///
/// Ours besides: what leaves an open route, and an image that says nothing, counts as average difference; chance
/// similarities among zeros are kept from looking like perfect contrast (min_contrast).
/// The confidence is 1 - best / rival: mean differences of the best line and of the best one that ends elsewhere, both
/// counted from the least that local contrast can be. It lies in [0, 1]; 0 when the map is too small for a rival.
class SequenceMatcher final : public PlaceRecogniser {
 public:
  /// `config` must be without violations. `closed`: the first training image follows the last.
  SequenceMatcher(const SequenceConfig& config, bool closed);

  Recognition update(const std::vector<double>& similarities) override;

 private:
  void remember(const std::vector<double>& similarities);
  void addLines(const std::vector<std::ptrdiff_t>& line, std::vector<double>& sums) const;
  void scoreLines();
  double confidence(std::size_t best) const;

  SequenceConfig config_;
  bool closed_;
  std::vector<std::vector<std::ptrdiff_t>> lines_;  ///< per speed: training images back from the end, newest first
  Route route_;                                     ///< empty until the first image tells how long it is
  std::deque<std::vector<double>> columns_;         ///< locally normalised differences of the last images
  std::vector<double> sums_;                        ///< along the lines of one speed ending at each training image
  std::vector<double> scores_;                      ///< of the best line ending at each training image
};

}  // namespace visual_localization
