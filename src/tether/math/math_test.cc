#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "tether/common/random.h"
#include "tether/math/numeric_derivative.h"
#include "tether/math/pose.h"

namespace tether::math {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d RandomVector(Random& random, double scale) {
  return scale * Vector3d(random.Normal(), random.Normal(), random.Normal());
}

/// Rotation vectors at zero, near it (either side of where series take over), random, and near π.
std::vector<Vector3d> RotationVectors() {
  Random random(11);
  std::vector<Vector3d> all{Vector3d::Zero()};
  for (double angle :
       {1e-12, 1e-8, 1e-4, 0.00999, 0.01001, 0.5, 1.0, 2.0, 3.0, 3.1, std::numbers::pi - 1e-4}) {
    for (int i = 0; i < 20; ++i) all.push_back(angle * RandomVector(random, 1).normalized());
  }
  return all;
}

Pose RandomPose(Random& random) { return {ExpSO3(RandomVector(random, 1)), RandomVector(random, 1)}; }

double Difference(const Pose& a, const Pose& b) { return (a.R - b.R).norm() + (a.p - b.p).norm(); }

TEST(SO3Test, ExpIsARotationAndLogInvertsIt) {
  for (const Vector3d& w : RotationVectors()) {
    const Matrix3d R = ExpSO3(w);
    EXPECT_NEAR((R * R.transpose() - Matrix3d::Identity()).norm(), 0, 1e-12);
    EXPECT_NEAR(R.determinant(), 1, 1e-12);
    EXPECT_NEAR((LogSO3(R) - w).norm(), 0, 1e-9) << w.transpose();
  }
}

TEST(SO3Test, LogAtPiIsAHalfTurn) {
  for (const Vector3d& axis : {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(1, 2, 3).normalized()}) {
    const Matrix3d R = 2 * axis * axis.transpose() - Matrix3d::Identity();
    const Vector3d w = LogSO3(R);
    EXPECT_NEAR(w.norm(), std::numbers::pi, 1e-12);
    EXPECT_NEAR((ExpSO3(w) - R).norm(), 0, 1e-12);
  }
}

TEST(SO3Test, JacobiansAgreeWithNumericDifferentiation) {
  for (const Vector3d& w : RotationVectors()) {
    const Matrix3d R = ExpSO3(w);
    const Eigen::MatrixXd left = NumericJacobian(
        [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
          return LogSO3(ExpSO3(Vector3d(x)) * R.transpose());
        },
        w);
    EXPECT_NEAR((left - LeftJacobianSO3(w)).norm(), 0, 1e-9);
    const Eigen::MatrixXd right = NumericJacobian(
        [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
          return LogSO3(R.transpose() * ExpSO3(Vector3d(x)));
        },
        w);
    EXPECT_NEAR((right - RightJacobianSO3(w)).norm(), 0, 1e-9);
    EXPECT_NEAR((RightJacobianInverseSO3(w) * RightJacobianSO3(w) - Matrix3d::Identity()).norm(), 0, 1e-10);
  }
}

TEST(SE3Test, IsAGroup) {
  Random random(5);
  for (int i = 0; i < 200; ++i) {
    const Pose a = RandomPose(random), b = RandomPose(random), c = RandomPose(random);
    EXPECT_NEAR(Difference((a * b) * c, a * (b * c)), 0, 1e-12);
    EXPECT_NEAR(Difference(a * a.Inverse(), Pose()), 0, 1e-12);
    EXPECT_NEAR(Difference(Between(a, b), a.Inverse() * b), 0, 1e-12);
    const Vector3d q = RandomVector(random, 1);
    EXPECT_NEAR(((a * b) * q - a * (b * q)).norm(), 0, 1e-12);
  }
}

TEST(SE3Test, ExpLogAndAdjoint) {
  Random random(6);
  for (double scale : {0.0, 1e-9, 1e-3, 1.0}) {
    for (int i = 0; i < 50; ++i) {
      Vector6d delta;
      delta << RandomVector(random, scale), RandomVector(random, std::min(scale, 0.8));
      const Pose X = RandomPose(random);
      EXPECT_NEAR((LogSE3(ExpSE3(delta)) - delta).norm(), 0, 1e-9);
      EXPECT_NEAR(Difference(X * ExpSE3(delta) * X.Inverse(), ExpSE3(Adjoint(X) * delta)), 0, 1e-10);
      EXPECT_NEAR((AdjointInverse(X) * Adjoint(X) - Matrix6d::Identity()).norm(), 0, 1e-11);
    }
  }
}

TEST(SE3Test, ProjectionFindsTheNearestRotation) {
  Random random(8);
  for (int i = 0; i < 50; ++i) {
    const Matrix3d R = RandomPose(random).R;
    Matrix3d noise;
    for (int k = 0; k < 9; ++k) noise(k) = 0.01 * random.Normal();
    const Matrix3d P = ProjectToSO3(R + noise);
    EXPECT_NEAR(P.determinant(), 1, 1e-12);
    EXPECT_LE((P - R - noise).norm(), noise.norm() + 1e-12);
  }
}

TEST(SE3Test, ProjectionOfAReflectionIsTheNearestRotation) {
  Random random(9);
  for (int i = 0; i < 50; ++i) {
    // A rotation, stretched, and mirrored along its shortest axis or another: possible results of written
    // digits, or of an interpolation through zero.
    const Matrix3d U = RandomPose(random).R, V = RandomPose(random).R;
    Vector3d stretch(random.Uniform(1, 2), random.Uniform(0.5, 1), random.Uniform(0.1, 0.5));
    stretch[i % 3] *= -1;
    const Matrix3d M = U * stretch.asDiagonal() * V.transpose();
    const Matrix3d P = ProjectToSO3(M);
    EXPECT_NEAR(P.determinant(), 1, 1e-12);
    EXPECT_NEAR((P * P.transpose() - Matrix3d::Identity()).norm(), 0, 1e-12);
    for (int k = 0; k < 200; ++k) {
      const double scale = k % 2 == 0 ? 0.1 : 2;
      EXPECT_LE((P - M).norm(), (P * ExpSO3(RandomVector(random, scale)) - M).norm() + 1e-12);
    }
  }
}

TEST(SE3Test, RpyTurnsAboutFixedAxes) {
  const Matrix3d R = RotationFromRpy({0.3, -0.2, 1.1});
  const Matrix3d expected =
      ExpSO3(Vector3d(0, 0, 1.1)) * ExpSO3(Vector3d(0, -0.2, 0)) * ExpSO3(Vector3d(0.3, 0, 0));
  EXPECT_NEAR((R - expected).norm(), 0, 1e-12);
}

}  // namespace
}  // namespace tether::math
