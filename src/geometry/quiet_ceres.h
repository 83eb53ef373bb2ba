#pragma once

#include <utility>

#include <ceres/problem.h>
#include <ceres/solver.h>
#include <glog/logging.h>

namespace visual_localization {

/// A step that cannot be solved is tried again with more damping. Ceres warns of each on stderr, but not while one of
/// these lives.
class QuietCeres {
 public:
  QuietCeres() : before_(std::exchange(FLAGS_minloglevel, google::GLOG_ERROR)) {}
  ~QuietCeres() { FLAGS_minloglevel = before_; }
  QuietCeres(const QuietCeres&) = delete;
  QuietCeres& operator=(const QuietCeres&) = delete;

 private:
  int before_;
};

/// Without a word, and with no other options than Ceres' own.
inline ceres::Solver::Summary solveQuietly(ceres::LinearSolverType linear_solver, ceres::Problem& problem) {
  ceres::Solver::Options options;
  options.linear_solver_type = linear_solver;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  const QuietCeres quiet;
  ceres::Solve(options, &problem, &summary);
  return summary;
}

}  // namespace visual_localization
