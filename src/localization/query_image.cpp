#include "visual_localization/localization/query_image.h"

#include "base/text.h"
#include "base/time.h"

namespace visual_localization {

LiveImage::LiveImage(const TrainingMap& map, const FrontEndConfig& front_end, const SimilarityConfig& similarity)
    : map_(map),
      name_(upperCase(map.header().kind->name())),
      front_end_(front_end),
      local_similarity_(front_end.match, similarity, map.header().image_size.width, map.header().kind),
      global_similarity_(similarity) {}

void LiveImage::set(std::int64_t stamp_ns, const cv::Mat& grey) {
  front_end_.setImage(stamp_ns, grey);
  vlad_.reset();
  match_ms_ = 0.0;
}

Score LiveImage::compare(FeatureKind kind, std::size_t training_image) {
  // What the map must read from its file counts as comparing: without the comparison there would be no need.
  if (kind == FeatureKind::kLocal) {
    const LocalFeatures& current = front_end_.local();
    const Stopwatch stopwatch;
    const Score score = local_similarity_.compare(current, *map_.local(training_image));
    match_ms_ += stopwatch.elapsed_ms();
    return score;
  }
  if (kind == FeatureKind::kVlad) {
    if (!vlad_) vlad_ = map_.header().vocabulary->describe(front_end_.local());
    const double similarity = vladSimilarity(*vlad_, *map_.vlad(training_image));
    return {similarity, similarity};
  }
  const GlobalFeatures& current = front_end_.global();
  const Stopwatch stopwatch;
  const Score score = global_similarity_.compare(current, *map_.global(training_image));
  match_ms_ += stopwatch.elapsed_ms();
  return score;
}

ImageReport LiveImage::report() const {
  return {front_end_.statistics(), name_,    front_end_.localExtracted(), local() == nullptr ? 0 : local()->size(),
          front_end_.extract_ms(), match_ms_};
}

void LiveImage::configure(const FrontEndConfig& front_end, const SimilarityConfig& similarity) {
  front_end_.configure(front_end);
  local_similarity_ = LocalSimilarity(front_end.match, similarity, map_.header().image_size.width, map_.header().kind);
  global_similarity_ = GlobalSimilarity(similarity);
}

}  // namespace visual_localization
