#include <cassert>
#include <cmath>
#include <utility>

#include <mujoco/mujoco.h>

#include "tether/robot/model.h"
#include "tether/robot/model_impl.h"

namespace tether::robot {
namespace {

// Dry friction is made up for by this share, fully from about this joint speed on, rad/s.
constexpr double kFrictionShare = 0.9, kFrictionSpeed = 0.02;

}  // namespace

struct State::Impl {
  explicit Impl(std::shared_ptr<const Model> shared, const Eigen::Vector3d& gravity_B)
      : model(std::move(shared)),
        own(mj_copyModel(nullptr, model->impl_->mujoco.get())),
        data(mj_makeData(own)),
        q(Eigen::VectorXd::Zero(model->dof())),
        v(Eigen::VectorXd::Zero(model->dof())),
        bias(Eigen::VectorXd::Zero(model->dof())),
        J_BH(Eigen::MatrixXd::Zero(6, model->dof())),
        M(Eigen::MatrixXd::Zero(model->dof(), model->dof())),
        full_M(own->nv, own->nv),
        full_J(6, own->nv),
        full_bias(own->nv) {
    for (int i = 0; i < 3; ++i) own->opt.gravity[i] = gravity_B[i];
    // Neither kinematics nor dynamics need to know where geoms are.
    own->ngeom = 0;
  }
  ~Impl() {
    mj_deleteData(data);
    mj_deleteModel(own);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  /// What damping, dry friction and springs of a joint take, Nm. The direction of dry friction is that of the
  /// motion; at rest it is not known, and where it was fully made up for a joint would creep.
  double Passive(int dof, double position, double velocity) const {
    const int joint = own->dof_jntid[dof];
    const int address = own->jnt_qposadr[joint];
    return own->dof_damping[dof] * velocity +
           kFrictionShare * own->dof_frictionloss[dof] * std::tanh(velocity / kFrictionSpeed) +
           own->jnt_stiffness[joint] * (position - own->qpos_spring[address]);
  }

  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  std::shared_ptr<const Model> model;
  mjModel* own;  // A copy, because gravity is part of it.
  mjData* data;
  Eigen::VectorXd q, v, bias;
  math::Pose X_BH;
  Eigen::MatrixXd J_BH, M;
  RowMajor full_M, full_J;
  Eigen::VectorXd full_bias;
};

State::State(std::shared_ptr<const Model> model, const Eigen::Vector3d& gravity_B)
    : impl_(std::make_unique<Impl>(std::move(model), gravity_B)) {
  Set(impl_->model->home(), Eigen::VectorXd::Zero(impl_->model->dof()));
}
State::~State() = default;
State::State(State&&) noexcept = default;
State& State::operator=(State&&) noexcept = default;

void State::Set(const Eigen::VectorXd& q, const Eigen::VectorXd& v) {
  Impl& s = *impl_;
  const Model::Impl& model = *s.model->impl_;
  const int n = s.model->dof();
  assert(q.size() == n && v.size() == n);
  s.q = q;
  s.v = v;
  for (int i = 0; i < n; ++i) {
    s.data->qpos[model.qpos_address[i]] = q[i];
    s.data->qvel[model.dof_address[i]] = v[i];
  }
  mj_kinematics(s.own, s.data);
  mj_comPos(s.own, s.data);
  mj_crb(s.own, s.data);
  mj_comVel(s.own, s.data);
  mj_rne(s.own, s.data, 0, s.full_bias.data());
  mj_fullM(s.own, s.full_M.data(), s.data->qM);
  mj_jacSite(s.own, s.data, s.full_J.data(), s.full_J.data() + 3 * s.own->nv, model.site_id);

  using Rotation = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  s.X_BH.R = Eigen::Map<const Rotation>(s.data->site_xmat + 9 * model.site_id);
  s.X_BH.p = Eigen::Map<const Eigen::Vector3d>(s.data->site_xpos + 3 * model.site_id);
  for (int i = 0; i < n; ++i) {
    const int a = model.dof_address[i];
    s.bias[i] = s.full_bias[a] + s.Passive(a, q[i], v[i]);
    for (int j = 0; j < 6; ++j) s.J_BH(j, i) = s.full_J(j, a);
    for (int j = 0; j < n; ++j) s.M(j, i) = s.full_M(model.dof_address[j], a);
  }
}

const Model& State::model() const { return *impl_->model; }
const Eigen::VectorXd& State::q() const { return impl_->q; }
const Eigen::VectorXd& State::v() const { return impl_->v; }
const math::Pose& State::X_BH() const { return impl_->X_BH; }
const Eigen::MatrixXd& State::J_BH() const { return impl_->J_BH; }
const Eigen::MatrixXd& State::M() const { return impl_->M; }
const Eigen::VectorXd& State::bias() const { return impl_->bias; }

}  // namespace tether::robot
