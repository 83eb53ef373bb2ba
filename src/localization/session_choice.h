#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/map/training_map.h"

namespace visual_localization {

class SessionIndex;

/// Which session of a map images are compared with. A map that was recorded on many days has several images of each
/// position, and most of them show another light: to compare with all costs more and tells no more. The session that
/// matched best lately is asked; another one is tried now and then, every second time the first of the map, which was
/// surveyed. After Churchill and Newman, "Experience-based navigation for long-term localisation" (2013).
/// Off, or in a map of one session, every training image counts alike.
class SessionChoice {
 public:
  /// `map` must outlive it.
  SessionChoice(const TrainingMap& map, bool on);
  ~SessionChoice();
  SessionChoice(const SessionChoice&) = delete;
  SessionChoice& operator=(const SessionChoice&) = delete;

  void configure(bool on) { on_ = on; }
  /// The next image. Before the first one the session of the nearest time of day is chosen, the latest of equals.
  void startImage(std::int64_t stamp_ns);
  /// The session that images are compared with; nothing while all count.
  std::optional<std::size_t> chosen() const;

  /// The training image that stands for a position: the nearest of the chosen session if that one was there, else the
  /// nearest of all.
  Neighbour nearest(const Eigen::Vector2d& position_m) const;
  /// Up to `count` training images around a position that face alike, the nearest first: of the chosen session where
  /// that one was there, else of all.
  std::vector<std::size_t> around(const Eigen::Vector2d& position_m, double yaw_rad, std::size_t count) const;
  /// The same around a training image, of its session.
  std::vector<std::size_t> aroundLike(std::size_t training_image, std::size_t count) const;
  /// The same of all sessions alike.
  std::vector<std::size_t> aroundAny(const Eigen::Vector2d& position_m, double yaw_rad, std::size_t count) const;
  /// A training image of another session there, when one is to be tried in this image: the same until the next one.
  std::optional<std::size_t> trial(const Eigen::Vector2d& position_m, double yaw_rad);

  /// How well the current image matches two training images of one position: weights of their scores, or inliers. The
  /// session of the better one may be chosen.
  void learn(std::size_t training_image, double match, std::size_t other_image, double other_match);
  /// The session of this training image is the right one: its landmarks verified a pose that was not expected.
  void choose(std::size_t training_image);
  /// Whether the image showed anything known, by any session. After a few that did not, every second image is compared
  /// with the next session.
  void noteRecognition(bool recognised);

 private:
  std::vector<std::size_t> aroundOf(std::optional<std::size_t> session, const Eigen::Vector2d& position_m,
                                    double yaw_rad, std::size_t count) const;
  bool isOn() const { return on_ && matches_.size() > 1; }
  std::size_t sessionOf(std::size_t training_image) const;
  std::size_t nextInTurn();
  std::size_t bestOr(std::size_t session) const;
  void relateToChosen();

  const TrainingMap& map_;
  bool on_;
  std::unique_ptr<const SessionIndex> images_;  ///< in a map of several sessions
  bool started_ = false;
  std::size_t chosen_ = 0;
  std::size_t chosen_before_ = 0;  ///< before images showed nothing
  std::vector<double> matches_;    ///< of each session, as a share of the one chosen when something was learned
  std::size_t images_seen_ = 0;
  std::size_t nothing_seen_ = 0;  ///< images in a row
  std::size_t trials_ = 0;
  std::size_t turn_ = 0;
  std::optional<std::size_t> tried_;  ///< session that is tried in this image
};

}  // namespace visual_localization
