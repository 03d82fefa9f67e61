#include "tether/constraints/core/pose_function.h"

#include "tether/constraints/core/relative.h"
#include "tether/geometry/distance/distance.h"

namespace tether::constraints {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using internal::Relative;
using math::Pose;
using nlp::JacobianRef;
using nlp::Unit;
using nlp::VectorRef;

class HalfSpaces final : public PoseFunction {
 public:
  explicit HalfSpaces(std::vector<HalfSpaceRow> rows)
      : PoseFunction(static_cast<int>(rows.size()), 2, Unit::kMetre), rows_(std::move(rows)) {}

  void Evaluate(std::span<const Pose> X, VectorRef r, JacobianRef* J) const override {
    const Relative relative(X[0], X[1]);
    for (int i = 0; i < size(); ++i) {
      const HalfSpaceRow& row = rows_[i];
      r[i] = row.n_B.dot(relative.X_BA * row.p_AQ) - row.offset;
      if (J != nullptr) relative.PointRow(row.n_B, row.p_AQ, i, 0, 6, *J);
    }
  }

 private:
  std::vector<HalfSpaceRow> rows_;
};

class MeanHalfSpaces final : public PoseFunction {
 public:
  MeanHalfSpaces(std::vector<Plane> planes, std::vector<SharedPoint> points)
      : PoseFunction(static_cast<int>(planes.size()), static_cast<int>(points.size()) + 1, Unit::kMetre),
        planes_(std::move(planes)),
        points_(std::move(points)) {}

  void Evaluate(std::span<const Pose> X, VectorRef r, JacobianRef* J) const override {
    Vector3d p_BC = Vector3d::Zero();
    for (size_t k = 0; k < points_.size(); ++k) {
      const Pose X_BA = math::Between(X[0], X[k + 1]);
      const Vector3d& p_AQ = points_[k].p_AQ;
      p_BC += points_[k].share * (X_BA * p_AQ);
      if (J == nullptr) continue;
      for (int i = 0; i < size(); ++i) {
        const Vector3d n_A = points_[k].share * (X_BA.R.transpose() * planes_[i].n_B);
        const auto column = 6 * static_cast<Eigen::Index>(k + 1);
        J->block<1, 3>(i, column) = n_A.transpose();
        J->block<1, 3>(i, column + 3) = p_AQ.cross(n_A).transpose();
      }
    }
    for (int i = 0; i < size(); ++i) {
      const Plane& plane = planes_[i];
      r[i] = plane.n_B.dot(p_BC) - plane.offset;
      if (J == nullptr) continue;
      J->block<1, 3>(i, 0) = -plane.n_B.transpose();
      J->block<1, 3>(i, 3) = plane.n_B.cross(p_BC).transpose();
    }
  }

 private:
  std::vector<Plane> planes_;
  std::vector<SharedPoint> points_;
};

class Directions final : public PoseFunction {
 public:
  explicit Directions(std::vector<DirectionRow> rows)
      : PoseFunction(static_cast<int>(rows.size()), 2, Unit::kRadian), rows_(std::move(rows)) {}

  void Evaluate(std::span<const Pose> X, VectorRef r, JacobianRef* J) const override {
    const Matrix3d R_BA = X[0].R.transpose() * X[1].R;
    if (J != nullptr) J->setZero();
    for (int i = 0; i < size(); ++i) {
      const DirectionRow& row = rows_[i];
      const Vector3d d_B = R_BA * row.d_A;
      r[i] = row.e_B.dot(d_B) - row.value;
      if (J != nullptr) {
        J->block<1, 3>(i, 9) = row.d_A.cross(R_BA.transpose() * row.e_B).transpose();
        J->block<1, 3>(i, 3) = row.e_B.cross(d_B).transpose();
      }
    }
  }

 private:
  std::vector<DirectionRow> rows_;
};

/// log(R_desiredᵀ R_B0ᵀ R_A0 …): shared by the three functions that measure a rotation vector.
class RotationMatch final : public PoseFunction {
 public:
  explicit RotationMatch(const Matrix3d& R_BA_desired)
      : PoseFunction(3, 2, Unit::kRadian), R_(R_BA_desired) {}

  void Evaluate(std::span<const Pose> X, VectorRef r, JacobianRef* J) const override {
    const Matrix3d R_BA = X[0].R.transpose() * X[1].R;
    const Vector3d w = math::LogSO3(R_.transpose() * R_BA);
    r = w;
    if (J == nullptr) return;
    J->setZero();
    const Matrix3d Jr_inv = math::RightJacobianInverseSO3(w);
    J->block<3, 3>(0, 9) = Jr_inv;
    J->block<3, 3>(0, 3) = -Jr_inv * R_BA.transpose();
  }

 private:
  Matrix3d R_;
};

class RotationChange final : public PoseFunction {
 public:
  RotationChange() : PoseFunction(3, 4, Unit::kRadian) {}

  void Evaluate(std::span<const Pose> X, VectorRef r, JacobianRef* J) const override {
    const Matrix3d R0 = X[0].R.transpose() * X[1].R;
    const Matrix3d R1 = X[2].R.transpose() * X[3].R;
    const Matrix3d R = R0.transpose() * R1;
    const Vector3d w = math::LogSO3(R);
    r = w;
    if (J == nullptr) return;
    J->setZero();
    const Matrix3d Jr_inv = math::RightJacobianInverseSO3(w);
    J->block<3, 3>(0, 21) = Jr_inv;
    J->block<3, 3>(0, 15) = -Jr_inv * R1.transpose();
    J->block<3, 3>(0, 9) = -Jr_inv * R.transpose();
    J->block<3, 3>(0, 3) = Jr_inv * R1.transpose();
  }
};

class Displacement final : public PoseFunction {
 public:
  Displacement(std::vector<Vector3d> n, bool in_target)
      : PoseFunction(static_cast<int>(n.size()), 4, Unit::kMetre), n_(std::move(n)), in_target_(in_target) {}

  void Evaluate(std::span<const Pose> X, VectorRef r, JacobianRef* J) const override {
    const Pose X0 = math::Between(X[0], X[1]), X1 = math::Between(X[2], X[3]);
    const Vector3d d = X1.p - X0.p;
    if (J != nullptr) J->setZero();
    for (int i = 0; i < size(); ++i) {
      const Vector3d& n = n_[i];
      const Vector3d n_B = in_target_ ? n : Vector3d(X0.R * n);
      r[i] = n_B.dot(d);
      if (J == nullptr) continue;
      J->block<1, 3>(i, 18) = n_B.transpose() * X1.R;
      J->block<1, 3>(i, 12) = -n_B.transpose();
      J->block<1, 3>(i, 15) = -X1.p.cross(n_B).transpose();
      J->block<1, 3>(i, 6) = -n_B.transpose() * X0.R;
      J->block<1, 3>(i, 0) = n_B.transpose();
      J->block<1, 3>(i, 3) = X0.p.cross(n_B).transpose();
      if (!in_target_) {
        // The direction turns with A0 and, seen from B0, against B0.
        J->block<1, 3>(i, 9) = n.cross(X0.R.transpose() * d).transpose();
        J->block<1, 3>(i, 3) += d.cross(n_B).transpose();
      }
    }
  }

 private:
  std::vector<Vector3d> n_;
  bool in_target_;
};

class PointDistanceFunction final : public PoseFunction {
 public:
  PointDistanceFunction(const Vector3d& p_BP, const Vector3d& p_AQ, double distance, double sign)
      : PoseFunction(1, 2, Unit::kMetre), p_BP_(p_BP), p_AQ_(p_AQ), distance_(distance), sign_(sign) {}

  void Evaluate(std::span<const Pose> X, VectorRef r, JacobianRef* J) const override {
    const Relative relative(X[0], X[1]);
    const Vector3d d = relative.X_BA * p_AQ_ - p_BP_;
    const double norm = d.norm();
    r[0] = sign_ * (norm - distance_);
    if (J == nullptr) return;
    const Vector3d n = norm > 0 ? Vector3d(sign_ / norm * d) : Vector3d::Zero();
    relative.PointRow(n, p_AQ_, 0, 0, 6, *J);
  }

 private:
  Vector3d p_BP_, p_AQ_;
  double distance_, sign_;
};

class AxisDistance final : public PoseFunction {
 public:
  AxisDistance(const Vector3d& p_BP, const Vector3d& u_B, const Vector3d& p_AQ, double distance, double sign)
      : PoseFunction(1, 2, Unit::kMetre),
        p_BP_(p_BP),
        u_B_(u_B),
        p_AQ_(p_AQ),
        distance_(distance),
        sign_(sign) {}

  void Evaluate(std::span<const Pose> X, VectorRef r, JacobianRef* J) const override {
    const Relative relative(X[0], X[1]);
    Vector3d d = relative.X_BA * p_AQ_ - p_BP_;
    d -= u_B_ * u_B_.dot(d);
    const double norm = d.norm();
    r[0] = sign_ * (norm - distance_);
    if (J == nullptr) return;
    const Vector3d n = norm > 0 ? Vector3d(sign_ * d / norm) : Vector3d::Zero();
    relative.PointRow(n, p_AQ_, 0, 0, 6, *J);
  }

 private:
  Vector3d p_BP_, u_B_, p_AQ_;
  double distance_, sign_;
};

class PartDistance final : public PoseFunction {
 public:
  PartDistance(geometry::Part a, geometry::Part b, double distance, double sign)
      : PoseFunction(1, 2, Unit::kMetre),
        a_(std::move(a)),
        b_(std::move(b)),
        distance_(distance),
        sign_(sign) {}

  void Evaluate(std::span<const Pose> X, VectorRef r, JacobianRef* J) const override {
    const Pose X_A = X[0] * a_.X_SP, X_B = X[1] * b_.X_SP;
    const geometry::Distance result = geometry::SignedDistance(a_.primitive, X_A, b_.primitive, X_B);
    r[0] = sign_ * (result.distance - distance_);
    if (J == nullptr) return;
    const geometry::DistanceDerivative derivative = geometry::DifferentiateDistance(result, X[0], X[1]);
    J->block<1, 6>(0, 0) = sign_ * derivative.dA;
    J->block<1, 6>(0, 6) = sign_ * derivative.dB;
  }

 private:
  geometry::Part a_, b_;
  double distance_, sign_;
};

class Travel final : public PoseFunction {
 public:
  explicit Travel(double weight) : PoseFunction(3, 2, Unit::kMetre), weight_(weight) {}

  void Evaluate(std::span<const Pose> X, VectorRef r, JacobianRef* J) const override {
    r = weight_ * (X[1].p - X[0].p);
    if (J == nullptr) return;
    J->setZero();
    J->block<3, 3>(0, 0) = -weight_ * X[0].R;
    J->block<3, 3>(0, 6) = weight_ * X[1].R;
  }

 private:
  double weight_;
};

class Turn final : public PoseFunction {
 public:
  explicit Turn(double weight)
      : PoseFunction(3, 2, Unit::kRadian), weight_(weight), match_(Matrix3d::Identity()) {}

  void Evaluate(std::span<const Pose> X, VectorRef r, JacobianRef* J) const override {
    match_.Evaluate(X, r, J);
    r *= weight_;
    if (J != nullptr) *J *= weight_;
  }

 private:
  double weight_;
  RotationMatch match_;
};

}  // namespace

PoseFunctionPtr MakeHalfSpaces(std::vector<HalfSpaceRow> rows) {
  return std::make_shared<HalfSpaces>(std::move(rows));
}

PoseFunctionPtr MakeMeanHalfSpaces(std::vector<Plane> planes, std::vector<SharedPoint> points) {
  return std::make_shared<MeanHalfSpaces>(std::move(planes), std::move(points));
}

PoseFunctionPtr MakeDirections(std::vector<DirectionRow> rows) {
  return std::make_shared<Directions>(std::move(rows));
}

std::vector<DirectionRow> ParallelRows(const Vector3d& d_A, const Vector3d& e_B) {
  const Vector3d x = e_B.unitOrthogonal();
  return {{d_A, x, 0}, {d_A, e_B.cross(x), 0}};
}

PoseFunctionPtr MakeRotationMatch(const Matrix3d& R_BA_desired) {
  return std::make_shared<RotationMatch>(R_BA_desired);
}

PoseFunctionPtr MakeRotationChange() { return std::make_shared<RotationChange>(); }

PoseFunctionPtr MakeDisplacement(std::vector<Vector3d> n_A) {
  return std::make_shared<Displacement>(std::move(n_A), false);
}

PoseFunctionPtr MakeDisplacementInTarget(std::vector<Vector3d> n_B) {
  return std::make_shared<Displacement>(std::move(n_B), true);
}

PoseFunctionPtr MakePointDistance(const Vector3d& p_BP, const Vector3d& p_AQ, double distance, double sign) {
  return std::make_shared<PointDistanceFunction>(p_BP, p_AQ, distance, sign);
}

PoseFunctionPtr MakeAxisDistance(const Vector3d& p_BP, const Vector3d& u_B, const Vector3d& p_AQ,
                                 double distance, double sign) {
  return std::make_shared<AxisDistance>(p_BP, u_B, p_AQ, distance, sign);
}

PoseFunctionPtr MakePartDistance(geometry::Part a, geometry::Part b, double distance, double sign) {
  return std::make_shared<PartDistance>(std::move(a), std::move(b), distance, sign);
}

PoseFunctionPtr MakeTravel(double weight) { return std::make_shared<Travel>(weight); }
PoseFunctionPtr MakeTurn(double weight) { return std::make_shared<Turn>(weight); }

}  // namespace tether::constraints
