#include "tether/robot/arm_reader.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include <mujoco/mujoco.h>

#include "tether/common/random.h"
#include "tether/geometry/distance/bounds.h"
#include "tether/geometry/distance/distance.h"
#include "tether/geometry/hull/polytope.h"
#include "tether/robot/model.h"

namespace tether::robot {
namespace {

using Eigen::Vector3d;
using math::Pose;
using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// Pairs that overlap in each of this many random configurations are excluded from checks.
constexpr int kSamples = 100;
// Hulls of links need no more corners than this.
constexpr int kLinkCorners = 40;

/// A geom that collides, in the base frame; none of other kinds.
std::optional<geometry::Part> ReadGeom(const mjModel* model, const mjData* data, int geom) {
  if (model->geom_contype[geom] == 0 && model->geom_conaffinity[geom] == 0) return std::nullopt;
  const double* size = model->geom_size + 3 * geom;
  const Pose X_BG(Eigen::Map<const RowMajor>(data->geom_xmat + 9 * geom),
                  Eigen::Map<const Vector3d>(data->geom_xpos + 3 * geom));
  switch (model->geom_type[geom]) {
    case mjGEOM_BOX:
      return geometry::Part{geometry::Box{2 * Vector3d(size[0], size[1], size[2])}, X_BG};
    case mjGEOM_SPHERE:
      return geometry::Part{geometry::Sphere{size[0]}, X_BG};
    case mjGEOM_CAPSULE:
      return geometry::Part{geometry::Capsule{size[0], 2 * size[1]}, X_BG};
    case mjGEOM_CYLINDER:
      return geometry::Part{geometry::Cylinder{size[0], 2 * size[1]}, X_BG};
    case mjGEOM_ELLIPSOID:
      return geometry::Part{geometry::Box{2 * Vector3d(size[0], size[1], size[2])}, X_BG};
    case mjGEOM_MESH: {
      const int mesh = model->geom_dataid[geom];
      std::vector<Vector3d> points;
      const float* vertex = model->mesh_vert + 3 * model->mesh_vertadr[mesh];
      for (int i = 0; i < model->mesh_vertnum[mesh]; ++i, vertex += 3)
        points.emplace_back(vertex[0], vertex[1], vertex[2]);
      const geometry::HullResult hull = geometry::MakeHull(points, kLinkCorners);
      if (!hull.hull) return std::nullopt;
      return geometry::CentredPart(*hull.hull, X_BG);
    }
    default:
      return std::nullopt;
  }
}

/// The arm at its reference configuration.
class Reader {
 public:
  Reader(const mjModel* model, const std::vector<int>& joints, const std::vector<int>& fingers, int site)
      : model_(model),
        joints_(joints),
        fingers_(fingers),
        site_(site),
        data_(mj_makeData(model), mj_deleteData) {
    mj_resetData(model_, data_.get());
    mj_kinematics(model_, data_.get());
  }

  ArmDescription Read() {
    ReadChain();
    if (out_.problems.empty()) {
      ReadLinks();
      ReadExclusions();
    }
    return std::move(out_);
  }

 private:
  Pose X_BBody(int body) const {
    return {Eigen::Map<const RowMajor>(data_->xmat + 9 * body),
            Eigen::Map<const Vector3d>(data_->xpos + 3 * body)};
  }

  bool IsAncestor(int ancestor, int body) const {
    for (;; body = model_->body_parentid[body]) {
      if (body == ancestor) return true;
      if (body == 0) return false;
    }
  }

  std::string JointName(int joint) const {
    const char* name = mj_id2name(model_, mjOBJ_JOINT, joint);
    return name != nullptr ? name : "";
  }

  void ReadChain() {
    Pose X_BP;
    for (size_t i = 0; i < joints_.size(); ++i) {
      const int joint = joints_[i], body = model_->jnt_bodyid[joint];
      const int next =
          i + 1 < joints_.size() ? model_->jnt_bodyid[joints_[i + 1]] : model_->site_bodyid[site_];
      const bool same = i + 1 < joints_.size() && next == body && joints_[i + 1] < joint;
      if (!IsAncestor(body, next) || same)
        out_.problems.push_back(
            "joint '" + JointName(joint) + "' does not move " +
            (i + 1 < joints_.size() ? "joint '" + JointName(joints_[i + 1]) + "'" : "the hand"));
      const Vector3d axis = Eigen::Map<const Vector3d>(data_->xaxis + 3 * joint).normalized();
      Pose X_BJ;
      // The body's own axes where the joint's is one of them keep the frames readable.
      const Vector3d x = X_BBody(body).R.col(0);
      const Vector3d across = x - axis * axis.dot(x);
      X_BJ.R.col(2) = axis;
      X_BJ.R.col(0) = across.norm() > 0.1 ? across.normalized() : axis.unitOrthogonal();
      X_BJ.R.col(1) = axis.cross(X_BJ.R.col(0));
      X_BJ.p = Eigen::Map<const Vector3d>(data_->xanchor + 3 * joint);
      out_.chain.joints.push_back({math::Between(X_BP, X_BJ), model_->qpos0[model_->jnt_qposadr[joint]]});
      X_BP = X_BJ;
      X_BLink_.push_back(X_BJ);
    }
    const Pose X_BSite(Eigen::Map<const RowMajor>(data_->site_xmat + 9 * site_),
                       Eigen::Map<const Vector3d>(data_->site_xpos + 3 * site_));
    out_.chain.X_LH = math::Between(X_BP, X_BSite);
  }

  /// The number of the last joint that moves a body, from 1; 0: none does.
  int LinkOf(int body) const {
    for (size_t i = joints_.size(); i-- > 0;) {
      if (IsAncestor(model_->jnt_bodyid[joints_[i]], body)) return static_cast<int>(i) + 1;
    }
    return 0;
  }

  bool BelongsToHand(int body) const {
    for (const int finger : fingers_) {
      if (IsAncestor(model_->jnt_bodyid[finger], body)) return true;
    }
    const int hand = model_->site_bodyid[site_];
    const bool own = std::none_of(joints_.begin(), joints_.end(),
                                  [&](int joint) { return model_->jnt_bodyid[joint] == hand; });
    return own && IsAncestor(hand, body);
  }

  void ReadLinks() {
    for (int body = 1; body < model_->nbody; ++body) {
      if (BelongsToHand(body)) continue;
      LinkSolid solid;
      const char* name = mj_id2name(model_, mjOBJ_BODY, body);
      solid.name = name != nullptr ? name : "body " + std::to_string(body);
      solid.link = LinkOf(body);
      const Pose X_BL = solid.link == 0 ? Pose() : X_BLink_[static_cast<size_t>(solid.link) - 1];
      for (int i = 0; i < model_->body_geomnum[body]; ++i) {
        const int geom = model_->body_geomadr[body] + i;
        if (auto part = ReadGeom(model_, data_.get(), geom)) {
          part->X_SP = math::Between(X_BL, part->X_SP);
          solid.shape.parts.push_back(std::move(*part));
        }
      }
      if (solid.shape.parts.empty()) continue;
      out_.links.push_back(std::move(solid));
      bodies_.push_back(body);
    }
  }

  /// The solids that a body belongs to: its own, or the hand's.
  int SolidOf(int body) const {
    if (body > 0 && BelongsToHand(body)) return static_cast<int>(out_.links.size());
    for (size_t i = 0; i < bodies_.size(); ++i) {
      if (bodies_[i] == body) return static_cast<int>(i);
    }
    return -1;
  }

  void ReadExclusions() {
    const int hand = static_cast<int>(out_.links.size()), last = out_.chain.dof();
    const auto link = [&](int solid) { return solid == hand ? last : out_.links[solid].link; };
    for (int a = 0; a <= hand; ++a) {
      for (int b = a + 1; b <= hand; ++b) {
        if (std::abs(link(a) - link(b)) <= 1) out_.excluded.emplace_back(a, b);
      }
    }
    for (int i = 0; i < model_->nexclude; ++i) {
      // Bodies are counted from 1 in signatures.
      int a = SolidOf((model_->exclude_signature[i] >> 16) - 1);
      int b = SolidOf((model_->exclude_signature[i] & 0xFFFF) - 1);
      if (a < 0 || b < 0 || a == b) continue;
      if (a > b) std::swap(a, b);
      out_.excluded.emplace_back(a, b);
    }
  }

  const mjModel* model_;
  const std::vector<int>& joints_;
  const std::vector<int>& fingers_;
  int site_;
  std::unique_ptr<mjData, decltype(&mj_deleteData)> data_;
  std::vector<Pose> X_BLink_;  // of links 1 … n
  std::vector<int> bodies_;    // of out_.links
  ArmDescription out_;
};

}  // namespace

ArmDescription ReadArm(const mjModel_* model, const std::vector<int>& joints, const std::vector<int>& fingers,
                       int site) {
  return Reader(model, joints, fingers, site).Read();
}

std::vector<geometry::Part> ReadFingers(const Model& robot, const mjModel* model, int site, double opening) {
  const std::unique_ptr<mjData, decltype(&mj_deleteData)> data(mj_makeData(model), mj_deleteData);
  mj_resetData(model, data.get());
  const size_t fingers = robot.finger_joints().size();
  std::vector<int> bodies;
  for (size_t i = 0; i < fingers; ++i) {
    const int joint = mj_name2id(model, mjOBJ_JOINT, robot.finger_joints()[i].c_str());
    data->qpos[model->jnt_qposadr[joint]] = robot.gripper().FingerPosition(i, fingers, opening);
    bodies.push_back(model->jnt_bodyid[joint]);
  }
  mj_kinematics(model, data.get());
  const Pose X_BH(Eigen::Map<const RowMajor>(data->site_xmat + 9 * site),
                  Eigen::Map<const Vector3d>(data->site_xpos + 3 * site));
  std::vector<geometry::Part> parts;
  for (int geom = 0; geom < model->ngeom; ++geom) {
    for (int body = model->geom_bodyid[geom]; body > 0; body = model->body_parentid[body]) {
      if (std::find(bodies.begin(), bodies.end(), body) == bodies.end()) continue;
      if (auto part = ReadGeom(model, data.get(), geom)) {
        part->X_SP = math::Between(X_BH, part->X_SP);
        parts.push_back(std::move(*part));
      }
      break;
    }
  }
  return parts;
}

std::optional<double> ReadPadFriction(const mjModel* model, const std::vector<int>& fingers) {
  std::optional<double> friction;
  for (int geom = 0; geom < model->ngeom; ++geom) {
    if (model->geom_contype[geom] == 0 && model->geom_conaffinity[geom] == 0) continue;
    for (int body = model->geom_bodyid[geom]; body > 0; body = model->body_parentid[body]) {
      const bool finger = std::any_of(fingers.begin(), fingers.end(),
                                      [&](int joint) { return model->jnt_bodyid[joint] == body; });
      if (!finger) continue;
      friction = std::max(friction.value_or(0), model->geom_friction[3 * geom]);
      break;
    }
  }
  return friction;
}

std::vector<std::pair<int, int>> PairsToCheck(const std::shared_ptr<const Model>& model,
                                              const std::vector<std::pair<int, int>>& excluded) {
  const ArmSolids& solids = model->solids();
  const geometry::Shape hand = model->HandShape(model->gripper().max_opening);
  std::vector<std::pair<int, int>> open, pairs;
  for (int a = 0; a < solids.hand(); ++a) {
    for (int b = a + 1; b <= solids.hand(); ++b) {
      const std::pair<int, int> pair(a, b);
      if (std::find(excluded.begin(), excluded.end(), pair) == excluded.end()) open.push_back(pair);
    }
  }
  const auto shape = [&](int solid) -> const geometry::Shape& {
    return solid == solids.hand() ? hand : solids.links[solid].shape;
  };
  Random random(1);
  Kinematics kinematics(model);
  Eigen::VectorXd q = model->home();
  std::vector<char> came_apart(open.size(), 0);
  for (int sample = 0; sample < kSamples; ++sample) {
    for (int i = 0; i < model->dof(); ++i) q[i] = random.Uniform(model->lower()[i], model->upper()[i]);
    kinematics.Set(q);
    bool all = true;
    for (size_t k = 0; k < open.size(); ++k) {
      if (came_apart[k]) continue;
      const auto [a, b] = open[k];
      came_apart[k] =
          geometry::SignedDistance(shape(a), kinematics.X_BSolid(a), shape(b), kinematics.X_BSolid(b))
              .distance > 0;
      all = all && came_apart[k];
    }
    if (all) break;
  }
  for (size_t k = 0; k < open.size(); ++k) {
    if (came_apart[k]) pairs.push_back(open[k]);
  }
  return pairs;
}

}  // namespace tether::robot
