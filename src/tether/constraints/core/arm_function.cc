#include "tether/constraints/core/arm_function.h"

#include <cassert>
#include <utility>

#include "tether/geometry/distance/distance.h"
#include "tether/robot/kinematics.h"

namespace tether::constraints {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using math::Matrix6d;
using math::Pose;
using nlp::JacobianRef;
using nlp::Unit;
using nlp::VectorRef;
using ModelPtr = std::shared_ptr<const robot::Model>;
using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, robot::kMostJoints>;

/// Row i of `rows` in H, as a function of X_BH, is minus that in B, carried over.
void FillBase(const Pose& X_BF, JacobianRef& J_X) {
  J_X.leftCols<6>().noalias() = -J_X.middleCols<6>(6) * math::AdjointInverse(X_BF);
}

class HandPosition final : public ArmFunction {
 public:
  HandPosition(ModelPtr model, const Offset& offset)
      : ArmFunction(std::move(model), 3, 2, Unit::kMetre), offset_(offset) {}

  void Evaluate(const Eigen::VectorXd& q, std::span<const Pose> X, VectorRef r, JacobianRef* J_q,
                JacobianRef* J_X) const override {
    const robot::LinkPoses links(model().chain(), q);
    const Pose X_BH = math::Between(X[0], X[1]);
    const Pose& X_BHand = links.X_BH();
    const Vector3d p_HandQ = X_BHand.R.transpose() * (X_BH * offset_.by_H + offset_.by_B - X_BHand.p);
    r = p_HandQ;
    if (J_q == nullptr) return;
    Jacobian J(6, dof());
    links.HandBodyJacobian(J);
    *J_q = math::Hat(p_HandQ) * J.bottomRows<3>() - J.topRows<3>();
    const Matrix3d R_HandH = X_BHand.R.transpose() * X_BH.R;
    J_X->middleCols<3>(6) = R_HandH;
    J_X->middleCols<3>(9) = -R_HandH * math::Hat(offset_.by_H);
    FillBase(X_BH, *J_X);
  }

 private:
  Offset offset_;
};

class HandRotation final : public ArmFunction {
 public:
  explicit HandRotation(ModelPtr model) : ArmFunction(std::move(model), 3, 2, Unit::kRadian) {}

  void Evaluate(const Eigen::VectorXd& q, std::span<const Pose> X, VectorRef r, JacobianRef* J_q,
                JacobianRef* J_X) const override {
    const robot::LinkPoses links(model().chain(), q);
    const Pose X_BH = math::Between(X[0], X[1]);
    const Vector3d w = math::LogSO3(links.X_BH().R.transpose() * X_BH.R);
    r = w;
    if (J_q == nullptr) return;
    Jacobian J(6, dof());
    links.HandBodyJacobian(J);
    // Log(Exp(−a) R) = w − J_l⁻¹(w) a, and J_l(w) = J_r(−w).
    *J_q = -math::RightJacobianInverseSO3(-w) * J.bottomRows<3>();
    J_X->middleCols<3>(6).setZero();
    J_X->middleCols<3>(9) = math::RightJacobianInverseSO3(w);
    FillBase(X_BH, *J_X);
  }
};

class LinkClearance final : public ArmFunction {
 public:
  LinkClearance(ModelPtr model, int solid, int part, geometry::Part other, double distance)
      : ArmFunction(model, 1, 2, Unit::kMetre),
        link_(model->solids().links[solid].link),
        part_(model->solids().links[solid].shape.parts[part]),
        other_(std::move(other)),
        distance_(distance) {}

  void Evaluate(const Eigen::VectorXd& q, std::span<const Pose> X, VectorRef r, JacobianRef* J_q,
                JacobianRef* J_X) const override {
    const robot::LinkPoses links(model().chain(), q);
    const Pose X_BA = math::Between(X[0], X[1]);
    const Pose& X_BL = links.X_BL(link_);
    const geometry::Distance d =
        geometry::SignedDistance(part_.primitive, X_BL * part_.X_SP, other_.primitive, X_BA * other_.X_SP);
    r[0] = distance_ - d.distance;
    if (J_q == nullptr) return;
    links.AlongNormal(link_, d.p_WA, d.n_W, J_q->row(0));
    J_X->middleCols<6>(6) = -geometry::DifferentiateDistance(d, X_BL, X_BA).dB;
    FillBase(X_BA, *J_X);
  }

 private:
  int link_;
  geometry::Part part_, other_;
  double distance_;
};

class SelfClearance final : public ArmFunction {
 public:
  SelfClearance(const ModelPtr& model, int solid_a, int part_a, int solid_b, int part_b, double distance)
      : ArmFunction(model, 1, 1, Unit::kMetre),
        a_(Find(*model, solid_a, part_a)),
        b_(Find(*model, solid_b, part_b)),
        distance_(distance) {}

  void Evaluate(const Eigen::VectorXd& q, std::span<const Pose>, VectorRef r, JacobianRef* J_q,
                JacobianRef* J_X) const override {
    const robot::LinkPoses links(model().chain(), q);
    const geometry::Distance d = geometry::SignedDistance(a_.primitive, links.X_BL(a_.link) * a_.X_LP,
                                                          b_.primitive, links.X_BL(b_.link) * b_.X_LP);
    r[0] = distance_ - d.distance;
    if (J_q == nullptr) return;
    Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, robot::kMostJoints> of_a(dof()), of_b(dof());
    links.AlongNormal(a_.link, d.p_WA, d.n_W, of_a);
    links.AlongNormal(b_.link, d.p_WB, d.n_W, of_b);
    J_q->row(0) = of_a - of_b;
    J_X->setZero();
  }

 private:
  struct Placed {
    int link;
    geometry::Primitive primitive;
    Pose X_LP;
  };
  static Placed Find(const robot::Model& model, int solid, int part) {
    const robot::ArmSolids& solids = model.solids();
    if (solid == solids.hand()) {
      const geometry::Part found = model.HandShape(model.gripper().max_opening).parts[part];
      return {model.dof(), found.primitive, model.chain().X_LH * found.X_SP};
    }
    const robot::LinkSolid& link = solids.links[solid];
    const geometry::Part& found = link.shape.parts[part];
    return {link.link, found.primitive, found.X_SP};
  }

  Placed a_, b_;
  double distance_;
};

}  // namespace

ArmFunctionPtr MakeHandPosition(ModelPtr model, const Offset& offset) {
  return std::make_shared<HandPosition>(std::move(model), offset);
}

ArmFunctionPtr MakeHandRotation(ModelPtr model) { return std::make_shared<HandRotation>(std::move(model)); }

ArmFunctionPtr MakeLinkClearance(ModelPtr model, int solid, int part, geometry::Part other, double distance) {
  return std::make_shared<LinkClearance>(std::move(model), solid, part, std::move(other), distance);
}

ArmFunctionPtr MakeSelfClearance(ModelPtr model, int solid_a, int part_a, int solid_b, int part_b,
                                 double distance) {
  return std::make_shared<SelfClearance>(model, solid_a, part_a, solid_b, part_b, distance);
}

}  // namespace tether::constraints
