#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "tether/math/pose.h"
#include "tether/robot/model.h"

namespace tether::execution {

/// Chooses between hand poses that serve alike (a parallel gripper turned by half a turn), and finds joint
/// angles for the choice: damped least-squares inverse kinematics from the present configuration, a few
/// microseconds of work per tick.
class PostureSearch {
 public:
  explicit PostureSearch(const std::shared_ptr<const robot::Model>& model);

  /// Starts over from joint positions `q` for the candidates, hand poses in the base frame (at most
  /// kMaxCandidates).
  /// With `witness`, joint positions that a plan gives for about the first candidate, the search for that one
  /// begins there and stays near, and it is taken if it is reached: the arm was planned to stand so.
  void Start(const Eigen::VectorXd& q, const math::Pose* X_BH, int count,
             const Eigen::VectorXd* ik_solution = nullptr);
  /// One iteration for each candidate. Allocates nothing.
  void Advance();
  bool done() const { return iteration_ >= kIterations; }

  /// The candidate to take: one that is reached goes before one that isn't, then more room to the joint
  /// limits, then the shorter way. Valid when done().
  int best() const { return best_; }
  /// Whether joint angles for the best candidate were found.
  bool reached() const;
  /// Those joint angles, n, rad.
  const Eigen::VectorXd& q() const;

  static constexpr int kMaxCandidates = 2;
  static constexpr int kIterations = 40;

 private:
  struct Candidate {
    math::Pose X_BH;
    Eigen::VectorXd q;
    double error = 0;  ///< Position error plus 0.2 m times the angle, m.
    double room = 0;   ///< Least distance to a joint limit, rad.
    double way = 0;    ///< Greatest change of a joint, rad.
  };
  void Improve(Candidate& candidate);
  void Choose();

  std::shared_ptr<const robot::Model> model_;
  robot::State state_;
  Eigen::VectorXd start_, rest_, zero_, step_;
  std::vector<Candidate> candidates_;
  int count_ = 0;
  int iteration_ = kIterations;
  int best_ = 0;
  bool planned_ = false;
};

}  // namespace tether::execution
