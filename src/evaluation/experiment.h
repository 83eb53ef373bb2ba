#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "evaluation/place_recogniser.h"
#include "visual_localization/localization/localizer_config.h"
#include "visual_localization/map/map_builder.h"

namespace visual_localization {

/// Which images decide what is noise in a drive's image.
enum class Pruning {
  kPrevious,  ///< the one before, as on a robot (Weiss et al., section III)
  kBoth,      ///< the one before and the one after (Kronfeld et al., conference section VI, journal section 6)
  kNone,      ///< none: all features stay, also where the round is the map
};

/// What is right and what is wrong, as far as the true positions of a round allow to say.
struct Accuracy {
  double right_m = 5.0;   ///< an estimate nearer to the truth is right
  double wrong_m = 10.0;  ///< one farther from it is wrong
};

/// One recorded round of an experiment.
struct RoundSpec {
  std::string name;
  std::string bag;  ///< file name as the experiment gives it
  std::string group;
  std::string image_topic;
  std::string fix_topic;    ///< what a map of this round gets its positions from
  std::string truth_topic;  ///< what estimates are judged by; if it is the fix topic, its cleaned positions
  std::string camera_info;  ///< calibration, a file beside the bag; empty: the bag's camera_info
  std::string poses;        ///< true poses of the camera, a file beside the bag; empty: not known
  Accuracy accuracy = {};   ///< of its true positions: what counts as right where it is driven
  Pruning pruning = Pruning::kPrevious;
};

/// One round becomes the map, another one is driven. Indices into Experiment::rounds.
struct PairSpec {
  std::size_t map = 0;
  std::size_t drive = 0;
};

/// A tracker of the localizer, or a place recogniser beside it.
struct MethodSpec {
  std::string name;
  std::string tracker;        ///< "dpso", ... or a name of placeRecogniserNames()
  LocalizerConfig localizer;  ///< its `features` hold for place recognisers too
  PlaceRecogniserConfig recogniser;
  double speed = 1.0;          ///< simulated speed: images of the drive per step
  bool kidnapped = false;      ///< carried by half of the drive, back on an open one after half of the run
  double map_gap = 0.0;        ///< share of the map's images that are left out
  double map_spacing_m = 0.0;  ///< training images nearer than this to the last one are left out
  double covered = 0.0;        ///< share of the run, after its half, during which something covers the camera
  std::vector<std::pair<std::string, std::string>> settings;  ///< all of the above that the experiment sets, as text

  bool isTracker() const;
};

/// An experiment of the papers: which rounds, which pairs, which methods.
struct Experiment {
  std::string name;
  bool closed = true;  ///< the rounds end where they begin: indices wrap
  std::vector<RoundSpec> rounds;
  std::vector<PairSpec> pairs;
  std::size_t starts = 0;       ///< runs per pair, spread evenly over the start images; 0 = one for every image
  std::size_t seeds = 1;        ///< each start is run with so many seeds
  std::size_t start_every = 0;  ///< instead: a run from every so many images; 0: no
  std::size_t run_images = 0;   ///< the longest run; 0: to the end of an open drive, once around a closed one
  std::size_t judge_from = 0;   ///< image of a run from which on estimates are judged
  double found_within_m = 5.0;  ///< how near the truth an estimate is that counts as localised
  std::size_t trace_start = 0;  ///< the run whose track is written out
  MapBuilderConfig map;
  LocalizerConfig front_end;  ///< extraction, pruning and matching, the same for all methods
  std::vector<MethodSpec> methods;

  /// From landmarks: then drives need all their features.
  bool solvesPoses() const;
};

/// `path` is for messages; `preset`: in place of the one that the experiment names. Throws ParameterError, in one line
/// that names the file and the key, for anything unknown, missing or contradictory.
Experiment parseExperiment(const std::string& yaml, const std::string& path, const std::string& preset = "");

}  // namespace visual_localization
