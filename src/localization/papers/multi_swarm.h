#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "localization/papers/dpso.h"
#include "visual_localization/localization/particles.h"
#include "visual_localization/localization/tracker.h"

namespace visual_localization {

/// Several swarms for places that look alike, which Kronfeld et al. (journal, section 8) leave to future work:
/// multi-swarms with exclusion (Blackwell and Branke, 2004). One swarm leads, and its estimate is that of all. The
/// others, its rivals, follow other places where the robot may be. As many particles as of one swarm are shared out
/// among them.
///
/// With each image a scout asks one training image of the whole map, drawn by how alike it looks. Where it is
/// recognised, and matches nearly as well as the leader, a rival begins with particles of the leader. A swarm stays out
/// of the places of the others. The one that matched best lately leads. A rival that matches far worse, or meets a
/// better swarm, gives its particles back.
class MultiSwarm final : public Tracker {
 public:
  /// `map` must outlive the tracker. Starts anywhere in the map's area, as one swarm.
  MultiSwarm(const TrainingMap& map, const TrackerConfig& config, std::uint32_t seed);

  void reset(const Prior& prior) override;
  bool configure(const TrackerConfig& config) override;
  void predict(const Motion& motion) override;
  void update(Likelihood& likelihood) override;
  const TrackerEstimate& belief() const override { return belief_; }
  const std::vector<Particle>& particles() const override { return particles_; }
  /// Those that follow a place now, the leader included.
  std::size_t swarms() const { return active_; }

 private:
  struct Swarm {
    std::unique_ptr<Dpso> dpso;
    TrackerEstimate estimate = {};
    double strength = 0.0;         ///< weight of its best match, mean over the last images
    std::size_t images = 0;        ///< that it has followed
    std::size_t unrecognised = 0;  ///< in a row, the last ones
  };

  void restart();
  void share();
  void exclude();
  void follow(Likelihood& likelihood);
  void chooseLeader();
  void dissolve(std::size_t swarm);
  bool isSuperfluous(std::size_t swarm) const;
  bool isTaken(const Eigen::Vector2d& position_m) const;
  void scout(Likelihood& likelihood);
  TrackerEstimate estimate();
  void gather();

  const TrainingMap& map_;
  DpsoConfig config_;
  Random random_;
  std::vector<Swarm> swarms_;  ///< the leader first, then its rivals, then those that wait
  std::size_t active_ = 1;
  TrackerEstimate belief_;
  std::vector<Particle> particles_;        ///< of all
  std::vector<Eigen::Vector2d> others_m_;  ///< places of the other swarms; kept to save the allocation
};

}  // namespace visual_localization
