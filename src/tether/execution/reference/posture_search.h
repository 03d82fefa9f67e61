#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "tether/math/pose.h"
#include "tether/robot/model.h"

namespace tether::execution {

/// Chooses between equivalent hand poses (a parallel gripper turned by half a turn), and finds an IK solution
/// for the choice: damped least-squares inverse kinematics from the present configuration, a few microseconds
/// of work per tick.
class PostureSearch {
 public:
  explicit PostureSearch(const std::shared_ptr<const robot::Model>& model);

  /// Starts over from joint positions `q` for the candidates, hand poses in the base frame (at most
  /// kMaxCandidates). With `ik_solution`, the plan's for a hand pose near the first candidate, that
  /// candidate's search begins there and stays near, and it is chosen if it is reached: the plan was checked
  /// in that configuration.
  void Start(const Eigen::VectorXd& q, const math::Pose* X_BH, int count,
             const Eigen::VectorXd* ik_solution = nullptr);
  /// One iteration for each candidate. Allocates nothing.
  void Advance();
  bool done() const { return iteration_ >= kIterations; }

  /// The best candidate: one that is reached before one that isn't, then more room to the joint limits, then
  /// less joint motion. Valid when done().
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
    double error = 0;   ///< Position error plus 0.2 m times the angle, m.
    double room = 0;    ///< Least distance to a joint limit, rad.
    double motion = 0;  ///< Greatest change of a joint, rad.
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
