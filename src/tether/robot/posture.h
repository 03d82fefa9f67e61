#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "tether/geometry/distance/bounds.h"
#include "tether/geometry/shape.h"
#include "tether/robot/kinematics.h"

namespace tether::robot {

/// A convex part that the arm's links have to keep clear of, in the base frame.
struct PostureObstacle {
  const geometry::Primitive* primitive = nullptr;  ///< Must outlive its use.
  math::Pose X_BP;
  geometry::Aabb box;        ///< About it, in the base frame.
  bool still = true;         ///< It has not moved since the start, so the base's own link may touch it.
  std::vector<int> ignored;  ///< Solids of the arm that may touch it.

  PostureObstacle() = default;
  /// A part of an object at X_BO in the base frame. `part` must outlive this.
  PostureObstacle(const geometry::Part& part, const math::Pose& X_BO, bool stands_still);
};

/// A problem of inverse kinematics with clearances.
struct PostureProblem {
  math::Pose X_BH;  ///< The hand's desired pose.
  std::vector<PostureObstacle> obstacles;
  Eigen::VectorXd lower, upper;  ///< n, rad: the limits, less a margin.
  Eigen::VectorXd rest;          ///< n, rad: redundancy is resolved towards this posture.
  double clearance = 0.01;       ///< Wanted between links and obstacles, and among links, m.
};

/// Joint positions, with their errors.
struct Posture {
  Eigen::VectorXd q;          ///< n, rad
  double position_error = 0;  ///< Of the hand, m.
  double rotation_error = 0;  ///< rad
  /// The least distance, m, of a link from an obstacle or from another link; `clearance` if none is nearer.
  double distance = 0;
  int solid = -1;        ///< Index in ArmSolids::links of that link; −1: nothing is near.
  int obstacle = -1;     ///< Index of the obstacle; −1 if it is …
  int other_solid = -1;  ///< … another link, or the hand.
  bool reaches() const { return position_error < 1e-6 && rotation_error < 1e-6; }
};

/// The limits of a model less `margin` (rad) at each end, or a twentieth of the range if that is less, within
/// the range that is planned with.
void NarrowLimits(const Model& model, double margin, Eigen::VectorXd& lower, Eigen::VectorXd& upper);

/// Inverse kinematics with clearances: damped least squares in which the hand's pose comes first; its null
/// space serves the links' clearances, then the rest posture. A workspace, one per thread; tens of
/// microseconds per solve.
class PostureSolver {
 public:
  explicit PostureSolver(std::shared_ptr<const Model> model);
  PostureSolver(const PostureSolver&) = delete;
  PostureSolver& operator=(const PostureSolver&) = delete;

  /// Solves from `posture.q`, and sets all fields of `posture`. True if the hand is at its pose and the links
  /// are clear by `problem.clearance`; else the posture is the best one found.
  bool Solve(const PostureProblem& problem, Posture& posture, int max_iterations = 60);
  /// Sets the errors of `posture.q`.
  void Assess(const PostureProblem& problem, Posture& posture);

  const Kinematics& kinematics() const { return kinematics_; }

 private:
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostJoints, kMostJoints>;
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostJoints, 1>;

  struct NearPair {
    double distance;
    Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, kMostJoints> gradient;
  };

  // Spheres about solids, then about their parts, decide for most pairs that they are far apart; poses and
  // boxes are worked out for the others only. All in the base frame B; S is the solid's.
  struct Part {
    const geometry::Part* source = nullptr;
    double radius = 0;     // m
    Eigen::Vector3d p_SC;  // the sphere's centre
    Eigen::Vector3d p_BC;
    math::Pose X_BP;
    bool has_box = false;
    geometry::Aabb box;
  };
  struct Solid {
    double radius = 0;  // m
    Eigen::Vector3d p_SC = Eigen::Vector3d::Zero(), p_BC = p_SC;
    bool is_placed = false;
    std::vector<Part> parts;
  };

  /// Sets the solids' spheres at the present configuration.
  void PlaceSolids();
  /// The parts of a solid of ArmSolids, with poses and spheres at the present configuration.
  std::vector<Part>& PartsOf(int solid);
  /// The part's box, worked out once a configuration.
  static const geometry::Aabb& BoxOf(Part& part);
  /// Finds the pairs nearer than the clearance at the present configuration.
  void FindNearPairs(const PostureProblem& problem, Posture& posture, bool gradients);
  void Step(const PostureProblem& problem, const math::Vector6d& error, const Vector& q, Vector& step);

  std::shared_ptr<const Model> model_;
  Kinematics kinematics_;
  geometry::Shape hand_;
  std::vector<Solid> solids_;
  std::vector<NearPair> near_;
  Eigen::MatrixXd J_;
  Eigen::RowVectorXd row_;
};

}  // namespace tether::robot
