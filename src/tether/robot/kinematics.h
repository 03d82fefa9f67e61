#pragma once

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "tether/geometry/shape.h"
#include "tether/math/pose.h"

namespace tether::robot {

class Model;

/// The arm as a chain of hinges. Link 0 is the base; link i is all that joint i moves and joint i + 1 does
/// not. Link frame L0 is the base frame B; Li has its origin on joint i's axis and its z along it, so that
/// X_{Li−1,Li}(q) = X_PJ · Rot_z(qᵢ − reference).
struct Chain {
  struct Joint {
    math::Pose X_PJ;       ///< Li in Li−1 where the joint stands at its reference.
    double reference = 0;  ///< rad
  };
  std::vector<Joint> joints;  ///< n, base to hand.
  math::Pose X_LH;            ///< The hand in the last link's frame.
  int dof() const { return static_cast<int>(joints.size()); }
};

struct OuterReach;

/// Computes a ball about the base that a point of the hand never leaves. Consecutive axes are rigidly
/// connected, so a polyline between points fixed on them keeps the lengths of its pieces in every
/// configuration; the points are chosen so that it is shortest.
OuterReach FindOuterReach(const Chain& chain);

/// A rigid body of the arm as a solid, in its link's frame. Fingers and the hand's own body are not among
/// them: Model::HandShape() stands for both.
struct LinkSolid {
  std::string name;  ///< Of the body in the MJCF file.
  int link = 0;      ///< 0 … n
  geometry::Shape shape;
};

/// The arm's solids, and the pairs of them that must not collide.
struct ArmSolids {
  std::vector<LinkSolid> links;  ///< Base to hand.
  /// Pairs of links, by their indices in `links`, whose distance has to be checked. Index links.size() is the
  /// hand's solid. Left out: links next to each other, pairs that the MJCF file excludes, and those that
  /// overlap in each of many random configurations.
  std::vector<std::pair<int, int>> pairs;
  int hand() const { return static_cast<int>(links.size()); }
};

/// The most joints of an arm.
inline constexpr int kMostJoints = 16;

/// The poses of a chain's links in one configuration: a value that allocates nothing. Poses and Jacobians are
/// in the base frame B.
class LinkPoses {
 public:
  using RowRef = Eigen::Ref<Eigen::RowVectorXd, 0, Eigen::InnerStride<>>;

  /// `chain` must outlive this; `q` are its joint positions, n, rad.
  LinkPoses(const Chain& chain, const Eigen::Ref<const Eigen::VectorXd>& q) : chain_(&chain) { Set(q); }
  void Set(const Eigen::Ref<const Eigen::VectorXd>& q);

  int dof() const { return chain_->dof(); }
  /// Pose of link frame Li; i from 0 (the base) to n.
  const math::Pose& X_BL(int link) const { return X_BL_[static_cast<size_t>(link)]; }
  const math::Pose& X_BH() const { return X_BH_; }

  /// Writes the 6 × n Jacobian of the hand: (velocity of its origin; angular velocity) is J v. As
  /// State::J_BH().
  void HandJacobian(Eigen::Ref<Eigen::MatrixXd> J) const;
  /// Writes the derivative in q, 6 × n, of the hand's pose as a right perturbation X_BH · Exp(δ).
  void HandBodyJacobian(Eigen::Ref<Eigen::MatrixXd> J) const;
  /// Writes the 3 × n Jacobian of the velocity of a point fixed to a link, given where it is now.
  void PointJacobian(int link, const Eigen::Vector3d& p_BQ, Eigen::Ref<Eigen::MatrixXd> J) const;
  /// Writes the derivative in q, 1 × n, of n_B · p_BQ for a point Q fixed to a link: the gradient of a
  /// distance with normal n_B.
  void AlongNormal(int link, const Eigen::Vector3d& p_BQ, const Eigen::Vector3d& n_B, RowRef row) const;

 private:
  const Chain* chain_;
  std::array<math::Pose, kMostJoints + 1> X_BL_;
  math::Pose X_BH_;
};

/// The same for the arm of a model, set again and again: for optimisers and velocity control, one per thread.
/// Takes a fraction of a microsecond; State, with dynamics, several.
class Kinematics {
 public:
  /// Set to the model's home.
  explicit Kinematics(std::shared_ptr<const Model> model);

  /// Joint positions, n, rad.
  void Set(const Eigen::Ref<const Eigen::VectorXd>& q);

  const Model& model() const { return *model_; }
  int dof() const { return poses_.dof(); }
  const Eigen::VectorXd& q() const { return q_; }
  const math::Pose& X_BL(int link) const { return poses_.X_BL(link); }
  const math::Pose& X_BH() const { return poses_.X_BH(); }
  /// A solid of the model's ArmSolids, or of the hand for index hand(): the pose of the frame that its shape
  /// is given in.
  const math::Pose& X_BSolid(int solid) const;
  /// The link that a solid is fixed to; the hand's is the last one.
  int LinkOf(int solid) const;

  /// As in LinkPoses.
  void HandJacobian(Eigen::Ref<Eigen::MatrixXd> J) const { poses_.HandJacobian(J); }
  void HandBodyJacobian(Eigen::Ref<Eigen::MatrixXd> J) const { poses_.HandBodyJacobian(J); }
  void PointJacobian(int link, const Eigen::Vector3d& p_BQ, Eigen::Ref<Eigen::MatrixXd> J) const {
    poses_.PointJacobian(link, p_BQ, J);
  }
  void AlongNormal(int link, const Eigen::Vector3d& p_BQ, const Eigen::Vector3d& n_B,
                   LinkPoses::RowRef row) const {
    poses_.AlongNormal(link, p_BQ, n_B, row);
  }

 private:
  std::shared_ptr<const Model> model_;
  Eigen::VectorXd q_;
  LinkPoses poses_;
};

}  // namespace tether::robot
