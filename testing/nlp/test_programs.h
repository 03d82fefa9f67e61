#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tether/common/random.h"
#include "tether/nlp/program.h"

/// Residuals and programs for the tests and benchmarks of this room.
namespace tether::nlp::testing {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using math::Pose;

/// A residual from a lambda; with no Jacobian asked for, J is null.
class FunctionResidual : public Residual {
 public:
  using Function = std::function<void(const Point&, VectorRef, JacobianRef*)>;
  FunctionResidual(std::string name, int size, Unit unit, std::vector<BlockRef> blocks, Function function)
      : Residual(std::move(name), 0, size, unit, std::move(blocks)), function_(std::move(function)) {}
  void Evaluate(const Point& x, VectorRef r, JacobianRef* J) const override { function_(x, r, J); }

 private:
  Function function_;
};

inline std::shared_ptr<const Residual> MakeResidual(std::string name, int size, Unit unit,
                                                    std::vector<BlockRef> blocks,
                                                    FunctionResidual::Function function) {
  return std::make_shared<FunctionResidual>(std::move(name), size, unit, std::move(blocks),
                                            std::move(function));
}

inline const Pose& At(const Point& x, BlockRef block) { return x.poses[block.index]; }

/// (w_p (p_B − p_T), w_r Log(R_Tᵀ R_B)): the pose against a fixed target T.
inline std::shared_ptr<const Residual> PoseToTarget(BlockRef pose, const Pose& target, double w_p, double w_r,
                                                    Unit unit = Unit::kNone) {
  return MakeResidual("target", 6, unit, {pose}, [=](const Point& x, VectorRef r, JacobianRef* J) {
    const Pose& X = At(x, pose);
    const Vector3d w = math::LogSO3(target.R.transpose() * X.R);
    r << w_p * (X.p - target.p), w_r * w;
    if (J == nullptr) return;
    J->setZero();
    J->topLeftCorner<3, 3>() = w_p * X.R;
    J->bottomRightCorner<3, 3>() = w_r * math::RightJacobianInverseSO3(w);
  });
}

/// (w_p (p_B − p_A), w_r Log(R_Aᵀ R_B)): how far B is from A.
inline std::shared_ptr<const Residual> PoseToPose(BlockRef a, BlockRef b, double w_p, double w_r) {
  return MakeResidual("move", 6, Unit::kNone, {a, b}, [=](const Point& x, VectorRef r, JacobianRef* J) {
    const Pose &A = At(x, a), &B = At(x, b);
    const Matrix3d R_AB = A.R.transpose() * B.R;
    const Vector3d w = math::LogSO3(R_AB);
    r << w_p * (B.p - A.p), w_r * w;
    if (J == nullptr) return;
    J->setZero();
    J->block<3, 3>(0, 0) = -w_p * A.R;
    J->block<3, 3>(0, 6) = w_p * B.R;
    J->block<3, 3>(3, 9) = w_r * math::RightJacobianInverseSO3(w);
    J->block<3, 3>(3, 3) = -w_r * math::RightJacobianInverseSO3(w) * R_AB.transpose();
  });
}

/// n · (X p_BQ) − c, in metres: ≤ 0 keeps the point Q of the body in a half-space.
inline std::shared_ptr<const Residual> PlaneDistance(BlockRef pose, const Vector3d& p_BQ, const Vector3d& n,
                                                     double c) {
  return MakeResidual("plane", 1, Unit::kMetre, {pose}, [=](const Point& x, VectorRef r, JacobianRef* J) {
    const Pose& X = At(x, pose);
    r[0] = n.dot(X * p_BQ) - c;
    if (J == nullptr) return;
    J->leftCols<3>() = n.transpose() * X.R;
    J->rightCols<3>() = -n.transpose() * X.R * math::Hat(p_BQ);
  });
}

/// radius − ‖p_B − centre‖, in metres: ≤ 0 keeps the body's origin out of a ball.
inline std::shared_ptr<const Residual> OutsideBall(BlockRef pose, const Vector3d& centre, double radius) {
  return MakeResidual("ball", 1, Unit::kMetre, {pose}, [=](const Point& x, VectorRef r, JacobianRef* J) {
    const Pose& X = At(x, pose);
    const Vector3d d = X.p - centre;
    r[0] = radius - d.norm();
    if (J == nullptr) return;
    J->setZero();
    J->leftCols<3>() = -d.normalized().transpose() * X.R;
  });
}

/// The first two coordinates of R_Bᵀ ẑ, in radians for small tilts: zero when the body stands upright.
inline std::shared_ptr<const Residual> Upright(BlockRef pose) {
  return MakeResidual("upright", 2, Unit::kRadian, {pose}, [=](const Point& x, VectorRef r, JacobianRef* J) {
    const Vector3d z_B = At(x, pose).R.transpose() * Vector3d::UnitZ();
    r = z_B.head<2>();
    if (J == nullptr) return;
    J->setZero();
    J->rightCols<3>() = math::Hat(z_B).topRows<2>();
  });
}

/// p_AB − offset, in metres: B's origin stands at `offset` in A.
inline std::shared_ptr<const Residual> Offset(BlockRef a, BlockRef b, const Vector3d& offset) {
  return MakeResidual("offset", 3, Unit::kMetre, {a, b}, [=](const Point& x, VectorRef r, JacobianRef* J) {
    const Pose X_AB = math::Between(At(x, a), At(x, b));
    r = X_AB.p - offset;
    if (J == nullptr) return;
    J->setZero();
    J->block<3, 3>(0, 0) = -Matrix3d::Identity();
    J->block<3, 3>(0, 3) = math::Hat(X_AB.p);
    J->block<3, 3>(0, 6) = X_AB.R;
  });
}

/// Residuals in one vector block, from value and Jacobian functions.
inline std::shared_ptr<const Residual> VectorResidual(std::string name, int size, BlockRef block,
                                                      std::function<VectorXd(const VectorXd&)> value,
                                                      std::function<MatrixXd(const VectorXd&)> jacobian,
                                                      Unit unit = Unit::kMetre) {
  return MakeResidual(std::move(name), size, unit, {block}, [=](const Point& x, VectorRef r, JacobianRef* J) {
    const VectorXd& v = x.vectors[block.index];
    r = value(v);
    if (J != nullptr) *J = jacobian(v);
  });
}

struct Example {
  Program program;
  Point guess;
};

inline Vector3d RandomVector(Random& random, double scale) {
  return scale * Vector3d(random.Normal(), random.Normal(), random.Normal());
}

inline Pose RandomPose(Random& random) {
  return {math::ExpSO3(RandomVector(random, 1)), RandomVector(random, 1)};
}

/// A chain of hands and boxes like a key-pose program: the hand grasps the box at an offset, the box stands
/// upright on a table within a rectangle, both keep out of balls, and consecutive poses are near each other
/// (Paper A, eq. (4)).
inline Example KeyPoseChain(int steps, uint64_t seed, double turn = 0.1) {
  Random random(seed);
  Example example;
  Program& program = example.program;
  BlockRef hand, box;
  for (int k = 0; k < steps; ++k) {
    const BlockRef next_hand = program.AddPose("hand" + std::to_string(k));
    const BlockRef next_box = program.AddPose("box" + std::to_string(k));
    const Pose home(math::ExpSO3(RandomVector(random, turn)), Vector3d(0, 0, 0.6));
    const Pose start(math::ExpSO3(0.3 * RandomVector(random, 1)), Vector3d(0.4, 0.0, 0.1));
    example.guess.poses.push_back(home);
    example.guess.poses.push_back(start);
    if (k > 0) {
      program.Add(PoseToPose(hand, next_hand, std::sqrt(0.5), std::sqrt(1.5)), Role::kCost);
      program.Add(PoseToPose(box, next_box, std::sqrt(0.5), std::sqrt(1.5)), Role::kCost);
    } else {
      program.Add(PoseToTarget(next_hand, Pose(Vector3d(0, 0, 0.6)), 1, 1, Unit::kMetre), Role::kEquality);
    }
    hand = next_hand;
    box = next_box;
    const Vector3d goal(random.Uniform(0.2, 0.6), random.Uniform(-0.4, 0.4), 0.1);
    program.Add(Upright(box), Role::kEquality);
    program.Add(PlaneDistance(box, Vector3d::Zero(), Vector3d::UnitZ(), 0.1), Role::kEquality);
    for (const Vector3d& side :
         {Vector3d(1, 0, 0), Vector3d(-1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, -1, 0)}) {
      for (double corner : {-0.05, 0.05}) {
        program.Add(PlaneDistance(box, Vector3d(corner, 0.05, 0), side, side.dot(goal) + 0.1),
                    Role::kInequality);
      }
    }
    if (k % 2 == 1) {
      program.Add(Offset(box, hand, Vector3d(0, 0, 0.05)), Role::kEquality);
      program.Add(Upright(hand), Role::kEquality);
    } else if (k > 0) {
      program.Add(OutsideBall(hand, goal, 0.3), Role::kInequality);
    }
    program.Add(OutsideBall(box, goal + Vector3d(0.02, 0.01, 0), 0.04), Role::kInequality);
  }
  return example;
}

}  // namespace tether::nlp::testing
