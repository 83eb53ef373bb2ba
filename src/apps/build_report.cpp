#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include <unistd.h>

#include "apps/app_support.h"
#include "apps/bag_sessions.h"
#include "base/numbers.h"
#include "base/text.h"
#include "ros/message_readers.h"
#include "visual_localization/features/front_end.h"

namespace visual_localization::apps {
namespace {

const char* const kNoCalibration = "no calibration (no camera_info, no --camera-info)";

void printFixes(const PlottedSession& session) {
  constexpr std::array<FixVerdict, 7> verdicts{FixVerdict::kKept,    FixVerdict::kNoFix,     FixVerdict::kDisordered,
                                               FixVerdict::kSpike,   FixVerdict::kMultipath, FixVerdict::kTooFast,
                                               FixVerdict::kRepeated};
  std::cout << session.name << ": " << session.fixes.size() << " fixes:";
  for (const FixVerdict verdict : verdicts) {
    const auto count = std::count(session.cleaned.verdicts.begin(), session.cleaned.verdicts.end(), verdict);
    if (count == 0 && (verdict == FixVerdict::kTooFast || verdict == FixVerdict::kRepeated)) continue;
    std::cout << (verdict == FixVerdict::kKept ? " " : ", ") << count << ' ' << toString(verdict);
  }
  std::cout << "; " << session.cleaned.gaps_closed << " gaps closed, the longest " << session.cleaned.longest_gap_s
            << " s; path " << session.cleaned.trajectory.length() << " m\n";
}

void printRemarks(const PlottedSession& session) {
  for (const Remark& remark : session.remarks) std::cout << session.name << ": " << remark.text << '\n';
}

void printCamera(const SessionImages& session, const MapBuilderOptions& options, const GeometryConfig& geometry) {
  std::cout << session.name << ": ";
  if (session.calibrated_by_images) {
    std::cout << kNoCalibration << "; by its images: camera " << describe(*session.camera.model);
  } else if (session.camera.model) {
    std::cout << "camera " << describe(*session.camera.model) << ", from "
              << oneLine(options.camera_info.empty() ? cameraInfoTopic(options.image_topic) : options.camera_info);
  } else {
    std::cout << kNoCalibration << ": a map of places";
    std::cout << (geometry.self_calibration ? " (its images are not certain about one)"
                                            : "; --self-calibrate looks for one");
  }
  if (!options.mask.empty())
    std::cout << "; mask uses " << 100.0 * session.camera.mask.usedShare() << " % of the image";
  std::cout << '\n';
}

void printMount(const SessionImages& session) {
  if (!session.camera.mount) return;
  std::cout << session.name << ": " << describe(*session.camera.mount) << '\n';
}

/// A hand measures a mounting better than that.
constexpr double kMountingError_rad = 5.0 * kPi / 180.0;

/// How the images turn the camera against the mounting that was said; empty while they agree.
std::string mountingTrouble(const SessionImages& session) {
  const Eigen::Vector3d& off_rad = session.geometry.mounting_off_rad;
  if (!session.camera.mount || off_rad.cwiseAbs().maxCoeff() < kMountingError_rad) return "";
  constexpr std::array<std::array<const char*, 2>, 3> kWays{
      {{"up", "down"}, {"to the right", "to the left"}, {"clockwise", "anticlockwise"}}};
  std::ostringstream text;
  text << std::fixed << std::setprecision(1);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double degrees = toDegrees(off_rad[axis]);
    text << (axis == 0 ? "" : ", ") << std::abs(degrees) << " degrees "
         << kWays[static_cast<std::size_t>(axis)][degrees < 0.0 ? 1 : 0];
  }
  return session.name +
         ": where the robot drives the images have the camera turned against its mounting: " + text.str() +
         "; headings are off by the turn to the side";
}

/// Empty for what the images do not tell.
std::string plusMinus(double sigma) {
  if (sigma == 0.0) return " (the images do not tell it better)";
  std::ostringstream out;
  out << std::fixed << std::setprecision(2) << " +- " << sigma;
  return out.str();
}

/// What the images want to change most, and what that points to.
void printContradiction(const SessionImages& session, const GeometryConfig& config) {
  const SessionLandmarks& geometry = session.geometry;
  constexpr std::array<const char*, 6> kEntries{"focal length",         "ratio of the focal lengths",
                                                "principal point in x", "principal point in y",
                                                "distortion k1",        "distortion k2"};
  Eigen::Index entry = 0;
  const double sigmas = geometry.lens_sigmas.cwiseAbs().maxCoeff(&entry);
  std::cout << session.name << ": the images contradict the calibration, most of all its "
            << kEntries[static_cast<std::size_t>(entry)] << " (" << sigmas << " sigmas of a calibration): they ask for "
            << 100.0 * geometry.focal_scale
            << " % of its focal length (one sigma of a calibration: " << 100.0 * config.focal_sigma << " %). "
            << (entry == 0
                    ? "Another camera, or K of the raw images with rectified ones?"
                    : "The calibration of another size of the images, or of images that are distorted otherwise?")
            << " A map of places\n";
}

void printGeometry(const SessionImages& session, const GeometryConfig& config) {
  const SessionLandmarks& geometry = session.geometry;
  if (!session.camera.model) return;
  if (geometry.contradicts_calibration) return printContradiction(session, config);
  if (geometry.contradicts_fixes) {
    std::cout << session.name << ": images and fixes disagree: of " << session.kept << " images " << geometry.off_fixes
              << " lie elsewhere than the fixes around them, and around " << geometry.unexplained
              << " too little fits together; of the matched features " << 100.0 * geometry.agreeing_share
              << " % agree. A map of places\n";
    return;
  }
  std::cout << session.name << ": " << geometry.located << " of " << session.kept
            << " images with landmarks: " << geometry.landmarks << " landmarks, " << geometry.observations
            << " observations, median error " << std::setprecision(2) << geometry.median_error_px
            << " px; images moved the cleaned path by " << geometry.mean_shift_m << " m on average, "
            << geometry.largest_shift_m << " m at most; focal length by the images " << 100.0 * geometry.focal_scale
            << " %" << plusMinus(100.0 * geometry.focal_sigma) << " of the calibration's; delay of fixes "
            << std::showpos << geometry.fix_delay_s << std::noshowpos << plusMinus(geometry.delay_sigma_s) << " s\n";
  if (geometry.found_camera) {
    std::cout << session.name << ": nobody said how the camera is mounted; by the images: "
              << describe(SensorMount{*geometry.found_camera}) << "; the map keeps that\n";
  }
  if (geometry.off_fixes + geometry.unexplained > 0) {
    std::cout << session.name << ": " << geometry.off_fixes << " images lie elsewhere than the fixes around them, "
              << geometry.unexplained << " have no landmarks because too little around them fits together\n";
  }
  if (geometry.tied_apart_m > 0.0) {
    std::cout << session.name << ": tied to the sessions before; median offset before that " << geometry.tied_apart_m
              << " m\n";
  }
  std::cout << std::setprecision(1);
}

void printImages(const SessionImages& session, cv::Size in_map) {
  std::cout << session.name << ": " << session.kept << " images";
  if (session.kept != 0) std::cout << " of " << session.recorded.width << 'x' << session.recorded.height << " px";
  if (session.kept != 0 && session.recorded != in_map) {
    std::cout << ", resized to " << in_map.width << 'x' << in_map.height;
    const double stretch = stretchOf(session.recorded, in_map);
    constexpr double kHarmless = 0.02;
    if (std::abs(stretch - 1.0) > kHarmless) {
      std::cout << "; this distorts them (width times " << std::setprecision(2) << stretch << std::setprecision(1)
                << "): only the same camera will recognise them";
    }
  }
  std::cout << '\n';
}

/// As of a camera that changes its mode or starts.
void printOtherSizes(const SessionImages& session) {
  constexpr std::size_t kMostNamed = 4;
  if (session.other_sizes.empty()) return;
  std::cout << session.name << ": its images are of " << session.recorded.width << 'x' << session.recorded.height
            << " px, but for";
  std::size_t named = 0;
  for (const auto& [size, images] : session.other_sizes) {
    if (++named > kMostNamed) break;
    std::cout << (named == 1 ? " " : ", ") << images << " of " << size.first << 'x' << size.second;
  }
  if (session.other_sizes.size() > kMostNamed) {
    std::cout << " and others of " << session.other_sizes.size() - kMostNamed << " more sizes";
  }
  std::cout << '\n';
}

std::size_t fixesKept(const MapBuildReport& report) {
  std::size_t kept = 0;
  for (const CleanedTrajectory& session : report.sessions) {
    kept += static_cast<std::size_t>(std::count(session.verdicts.begin(), session.verdicts.end(), FixVerdict::kKept));
  }
  return kept;
}

void printIfAny(std::size_t images, const char* what) {
  if (images > 0) std::cout << ", " << images << ' ' << what;
}

}  // namespace

void announceCalibration(const MapBuildReport& report) {
  for (const SessionImages& session : report.session_images) {
    if (session.camera.model) continue;
    std::cerr << session.name << ": " << kNoCalibration << ": looking for one by its images, which takes minutes"
              << std::endl;
  }
}

void printReport(const MapBuilderOptions& options, const MapBuildReport& report, const GeometryConfig& geometry,
                 const std::vector<PlottedSession>& sessions) {
  std::cout << std::fixed << std::setprecision(1);
  for (const SessionImages& session : report.session_images) printCamera(session, options, geometry);
  for (const SessionImages& session : report.session_images) printMount(session);
  for (const PlottedSession& session : sessions) printRemarks(session);
  for (const PlottedSession& session : sessions) printFixes(session);
  for (const SessionImages& session : report.session_images) {
    if (geometry.enabled) printGeometry(session, geometry);
  }
  for (const SessionImages& session : report.session_images) {
    std::cout << session.name << ": expected error of its positions " << describe(session.fixes) << '\n';
  }
  for (const SessionImages& session : report.session_images) printOtherSizes(session);
  for (const SessionImages& session : report.session_images) {
    if (sessions.size() > 1 || session.recorded != report.image_size) printImages(session, report.image_size);
  }
  std::cout << "images: " << (report.images_kept - report.images_thinned) << " kept, " << report.images_without_position
            << " without position, " << report.images_too_close << " too close, " << report.images_thinned
            << " left out after the adjustment, " << report.images_disordered << " out of order, "
            << report.images_unusable << " unusable";
  printIfAny(report.images_of_other_shape, "of another shape than most, left out");
  printIfAny(report.images_standing, "left out while the robot stood (for more than 10 s)");
  std::cout << '\n';
  const double dropped = report.features_extracted == 0 ? 0.0
                                                        : 100.0 - 100.0 * static_cast<double>(report.features_kept) /
                                                                      static_cast<double>(report.features_extracted);
  std::cout << "features: " << report.features_extracted << " extracted, " << report.features_kept
            << " kept after pruning (" << dropped << " % dropped)\n";
}

void printSummary(const MapBuilderOptions& options, const MapBuildReport& report, double seconds) {
  std::size_t fixes = 0;
  std::size_t gaps = 0;
  for (const CleanedTrajectory& session : report.sessions) {
    fixes += session.verdicts.size();
    gaps += session.gaps_closed;
  }
  std::cout << oneLine(options.output) << ": " << (report.images_kept - report.images_thinned) << " images, "
            << fixesKept(report) << " of " << fixes << " fixes, " << gaps << " gaps closed, features "
            << report.features_extracted << " -> " << report.features_kept << ", "
            << humanSize(static_cast<double>(std::filesystem::file_size(options.output))) << ", " << seconds << " s\n";
}

namespace {

constexpr std::size_t kFewFeatures = 50;  ///< an image, on average

std::vector<std::string> disagreementsOf(const MapBuildReport& report, const std::vector<PlottedSession>& sessions) {
  std::vector<std::string> found;
  if (report.features_extracted < kFewFeatures * report.images_kept) {
    found.push_back("only " + std::to_string(report.features_extracted / report.images_kept) +
                    " features an image, at " + std::to_string(report.image_size.width) + "x" +
                    std::to_string(report.image_size.height) + " px: places look alike; from " +
                    std::to_string(kFewFeatures) + " on, and from 320x240 px, they can be told apart");
  }
  for (const PlottedSession& session : sessions) {
    for (const Remark& remark : session.remarks) {
      if (remark.disagrees) found.push_back(session.name + ": " + remark.text);
    }
  }
  for (const SessionImages& session : report.session_images) {
    for (const DoubtfulStretch& stretch : session.geometry.doubtful) {
      found.push_back(session.name + ": " + describe(stretch));
    }
    if (session.geometry.contradicts_calibration) {
      found.push_back(session.name + ": images and calibration disagree, so it has places only");
    } else if (session.geometry.contradicts_fixes) {
      found.push_back(session.name + ": images and fixes disagree, so it has places only");
    } else if (const std::string trouble = mountingTrouble(session); !trouble.empty()) {
      found.push_back(trouble);
    }
  }
  return found;
}

}  // namespace

void printDisagreements(const MapBuildReport& report, const std::vector<PlottedSession>& sessions) {
  const std::vector<std::string> found = disagreementsOf(report, sessions);
  if (found.empty()) return;
  const bool terminal = ::isatty(STDOUT_FILENO) != 0;
  std::cout << (terminal ? "\033[33m" : "")
            << "check before use (\"What disagrees\" in doc/faults.md): " << joined(found, "; ")
            << (terminal ? "\033[0m" : "") << '\n';
}

}  // namespace visual_localization::apps
