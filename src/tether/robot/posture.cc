#include "tether/robot/posture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>

#include "tether/geometry/distance/distance.h"
#include "tether/math/pose_error.h"
#include "tether/robot/model.h"

namespace tether::robot {
namespace {

// Weight of violated clearances, per m², relative to the length of a step.
constexpr double kClearanceWeight = 1e3;
// Pairs within this beyond the clearance come no nearer, and violated ones are brought this far beyond it, m.
constexpr double kBand = 0.004;
constexpr double kBeyond = 0.001;
// Near obstacles reduce the weight of the rest posture.
constexpr double kWeakPull = 0.02;
constexpr double kLeastDamping = 1e-9;
constexpr double kMostDamping = 3e-3;
constexpr double kMaxStep = 0.5;  // rad
constexpr double kMaxPull = 0.3;  // rad, towards the rest posture in one step
// Links are checked once the hand's error is below this (m + rad).
constexpr double kNearlyThere = 0.3;
constexpr double kThere = 1e-8;
constexpr double kSettled = 2e-3;  // rad
// It ends after this many iterations without progress.
constexpr int kPatience = 12;

/// a.DistanceTo(b) < range; mostly one axis is enough to tell that it is not.
bool AreWithin(double range, const geometry::Aabb& a, const geometry::Aabb& b) {
  for (int axis = 0; axis < 3; ++axis) {
    if (a.lower[axis] - b.upper[axis] >= range || b.lower[axis] - a.upper[axis] >= range) return false;
  }
  return a.DistanceTo(b) < range;
}

double SquaredDistance(const Eigen::Vector3d& p, const geometry::Aabb& box) {
  return (p - p.cwiseMax(box.lower).cwiseMin(box.upper)).squaredNorm();
}

}  // namespace

PostureObstacle::PostureObstacle(const geometry::Part& part, const math::Pose& X_BO, bool stands_still)
    : primitive(&part.primitive), X_BP(X_BO * part.X_SP), still(stands_still) {
  box = geometry::BoundingBox(*primitive, X_BP);
}

void NarrowLimits(const Model& model, double margin, Eigen::VectorXd& lower, Eigen::VectorXd& upper) {
  const Eigen::VectorXd room = (0.05 * (model.upper() - model.lower())).cwiseMin(margin);
  lower = (model.lower() + room).cwiseMax(model.planned_lower());
  upper = (model.upper() - room).cwiseMin(model.planned_upper());
}

PostureSolver::PostureSolver(std::shared_ptr<const Model> model)
    : model_(std::move(model)), kinematics_(model_), hand_(model_->HandShape(model_->gripper().max_opening)) {
  near_.reserve(64);
  const ArmSolids& solids = model_->solids();
  for (int k = 0; k <= solids.hand(); ++k) {
    Solid solid;
    geometry::Aabb all;
    const geometry::Shape& shape = k == solids.hand() ? hand_ : solids.links[k].shape;
    for (const geometry::Part& part : shape.parts) {
      const geometry::Aabb box = geometry::BoundingBox(part.primitive, part.X_SP);
      all.Include(box);
      Part& added = solid.parts.emplace_back();
      added.source = &part;
      added.radius = 0.5 * (box.upper - box.lower).norm();
      added.p_SC = 0.5 * (box.lower + box.upper);
    }
    if (!shape.parts.empty()) {
      solid.p_SC = 0.5 * (all.lower + all.upper);
      solid.radius = 0.5 * (all.upper - all.lower).norm();
    }
    solids_.push_back(std::move(solid));
  }
}

void PostureSolver::PlaceSolids() {
  for (size_t k = 0; k < solids_.size(); ++k) {
    solids_[k].p_BC = kinematics_.X_BSolid(static_cast<int>(k)) * solids_[k].p_SC;
    solids_[k].is_placed = false;
  }
}

std::vector<PostureSolver::Part>& PostureSolver::PartsOf(int k) {
  Solid& solid = solids_[k];
  if (!solid.is_placed) {
    const math::Pose& X_BS = kinematics_.X_BSolid(k);
    for (Part& part : solid.parts) {
      part.X_BP = X_BS * part.source->X_SP;
      part.p_BC = X_BS * part.p_SC;
      part.has_box = false;
    }
    solid.is_placed = true;
  }
  return solid.parts;
}

const geometry::Aabb& PostureSolver::BoxOf(Part& part) {
  if (!part.has_box) part.box = geometry::BoundingBox(part.source->primitive, part.X_BP);
  part.has_box = true;
  return part.box;
}

void PostureSolver::FindNearPairs(const PostureProblem& problem, Posture& posture, bool gradients) {
  const ArmSolids& solids = model_->solids();
  const int n = kinematics_.dof();
  // Those within the band affect only the steps.
  const double range = problem.clearance + (gradients ? kBand : 0);
  posture.distance = problem.clearance;
  posture.solid = posture.obstacle = posture.other_solid = -1;
  near_.clear();
  PlaceSolids();
  const auto note = [&](const geometry::Distance& d, int solid, int obstacle, int other) {
    if (d.distance < posture.distance) {
      posture.distance = d.distance;
      posture.solid = solid;
      posture.obstacle = obstacle;
      posture.other_solid = other;
    }
    if (!gradients) return;
    NearPair pair;
    pair.distance = d.distance;
    pair.gradient.resize(n);
    Eigen::RowVectorXd& row = row_;
    kinematics_.AlongNormal(kinematics_.LinkOf(solid), d.p_WA, -d.n_W, row);
    pair.gradient = row;
    if (other >= 0) {
      kinematics_.AlongNormal(kinematics_.LinkOf(other), d.p_WB, d.n_W, row);
      pair.gradient += row;
    }
    near_.push_back(pair);
  };
  for (size_t k = 0; k < problem.obstacles.size(); ++k) {
    const PostureObstacle& obstacle = problem.obstacles[k];
    const auto is_near = [&](const Eigen::Vector3d& p_BC, double radius) {
      const double reach = radius + range;
      return SquaredDistance(p_BC, obstacle.box) < reach * reach;
    };
    for (int solid = 0; solid < solids.hand(); ++solid) {
      if (obstacle.still && solids.links[solid].link == 0) continue;
      const Solid& bound = solids_[solid];
      if (!is_near(bound.p_BC, bound.radius)) continue;
      if (std::find(obstacle.ignored.begin(), obstacle.ignored.end(), solid) != obstacle.ignored.end())
        continue;
      for (Part& part : PartsOf(solid)) {
        if (!is_near(part.p_BC, part.radius) || !AreWithin(range, BoxOf(part), obstacle.box)) continue;
        const geometry::Distance d =
            geometry::SignedDistance(part.source->primitive, part.X_BP, *obstacle.primitive, obstacle.X_BP);
        if (d.distance < range) note(d, solid, static_cast<int>(k), -1);
      }
    }
  }
  const auto are_near = [range](const auto& a, const auto& b) {
    const double reach = a.radius + b.radius + range;
    return (a.p_BC - b.p_BC).squaredNorm() < reach * reach;
  };
  for (const auto& [a, b] : solids.pairs) {
    if (!are_near(solids_[a], solids_[b])) continue;
    for (Part& part_a : PartsOf(a)) {
      for (Part& part_b : PartsOf(b)) {
        if (!are_near(part_a, part_b) || !AreWithin(range, BoxOf(part_a), BoxOf(part_b))) continue;
        const geometry::Distance d = geometry::SignedDistance(part_a.source->primitive, part_a.X_BP,
                                                              part_b.source->primitive, part_b.X_BP);
        if (d.distance < range) note(d, a, -1, b);
      }
    }
  }
}

void PostureSolver::Step(const PostureProblem& problem, const math::Vector6d& error, const Vector& q,
                         Vector& step) {
  const int n = kinematics_.dof();
  kinematics_.HandJacobian(J_);
  Matrix H = Matrix::Identity(n, n);
  Vector pull = (problem.rest - q).cwiseMax(-kMaxPull).cwiseMin(kMaxPull);
  if (!near_.empty()) pull *= kWeakPull;
  for (const NearPair& pair : near_) {
    H.noalias() += kClearanceWeight * pair.gradient.transpose() * pair.gradient;
    const double lacking = std::max(0.0, problem.clearance + kBeyond - pair.distance);
    pull.noalias() += kClearanceWeight * lacking * pair.gradient.transpose();
  }
  const double damping = kLeastDamping + kMostDamping * std::min(1.0, error.squaredNorm());
  // Joints that would leave their limits are held there, and the others compensate.
  std::array<bool, kMostJoints> held{};
  for (int round = 0; round < 4; ++round) {
    Eigen::Matrix<double, Eigen::Dynamic, 6, 0, kMostJoints, 6> Y = J_.transpose();
    for (int i = 0; i < n; ++i) {
      if (held[i]) Y.row(i).setZero();
    }
    const Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, kMostJoints> J = Y.transpose();
    if (near_.empty()) {
      step = pull;  // H is the identity.
    } else {
      const Eigen::LLT<Matrix> factor(H);
      factor.solveInPlace(Y);
      step = factor.solve(pull);
    }
    math::Matrix6d A = J * Y;
    A.diagonal().array() += damping;
    const Eigen::LDLT<math::Matrix6d> solver(A);
    const math::Vector6d y = solver.solve(error - J * step);
    step.noalias() += Y * y;
    const double largest = step.cwiseAbs().maxCoeff();
    if (largest > kMaxStep) step *= kMaxStep / largest;
    bool more = false;
    for (int i = 0; i < n; ++i) {
      const double to = q[i] + step[i];
      const bool leaves = (to > problem.upper[i] && step[i] > 0) || (to < problem.lower[i] && step[i] < 0);
      const bool at_limit = q[i] >= problem.upper[i] - 1e-9 || q[i] <= problem.lower[i] + 1e-9;
      if (held[i] || !leaves || !at_limit) continue;
      held[i] = more = true;
      H.row(i).setZero();
      H.col(i).setZero();
      H(i, i) = 1;
      pull[i] = 0;
    }
    if (!more) return;
  }
}

bool PostureSolver::Solve(const PostureProblem& problem, Posture& posture, int max_iterations) {
  const int n = kinematics_.dof();
  J_.resize(6, n);
  row_.resize(n);
  Vector q = posture.q.cwiseMax(problem.lower).cwiseMin(problem.upper), step(n), best = q;
  double least = std::numeric_limits<double>::infinity(), least_error = least;
  int since = 0;
  bool found = false;
  for (int iteration = 0; iteration < max_iterations && !found; ++iteration) {
    kinematics_.Set(q);
    const math::Vector6d error = math::PoseError(kinematics_.X_BH(), problem.X_BH);
    const double distance = error.head<3>().norm() + error.tail<3>().norm();
    near_.clear();
    double overlap = 0;
    if (distance < kNearlyThere) {
      FindNearPairs(problem, posture, true);
      overlap = problem.clearance - posture.distance;
    }
    const double rank = distance < kThere ? overlap : 1 + distance;
    if (rank <= least) best = q;
    since = rank < 0.95 * least || distance < 0.8 * least_error ? 0 : since + 1;
    least = std::min(least, rank);
    least_error = std::min(least_error, distance);
    if (since >= kPatience) break;
    Step(problem, error, q, step);
    found = distance < kThere && overlap <= 0 && step.cwiseAbs().maxCoeff() < kSettled;
    if (!found) q = (q + step).cwiseMax(problem.lower).cwiseMin(problem.upper);
  }
  posture.q = best;
  Assess(problem, posture);
  return posture.reaches() && posture.distance >= problem.clearance;
}

void PostureSolver::Assess(const PostureProblem& problem, Posture& posture) {
  kinematics_.Set(posture.q);
  posture.position_error = (problem.X_BH.p - kinematics_.X_BH().p).norm();
  posture.rotation_error = math::AngleBetween(problem.X_BH.R, kinematics_.X_BH().R);
  FindNearPairs(problem, posture, false);
}

}  // namespace tether::robot
