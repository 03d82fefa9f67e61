#include "tether/sim/world.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <mujoco/mujoco.h>

#include "tether/common/error.h"
#include "tether/sim/world_impl.h"

namespace tether::sim {
namespace {

// The share of a push in which it rises, and in which it falls.
constexpr double kPushRamp = 1.0 / 6;

std::vector<std::string> Names(const auto& entries) {
  std::vector<std::string> names;
  for (const auto& entry : entries) names.push_back(entry.name);
  return names;
}

[[noreturn]] void ThrowUnknown(const std::string& word, const std::string& name,
                               const std::vector<std::string>& names) {
  throw InputError("the world has no " + word + " '" + name + "'",
                   names.empty() ? "it has none" : SuggestFrom(name, names));
}

bool IsFinite(const math::Pose& X) { return X.R.allFinite() && X.p.allFinite(); }

}  // namespace

World::World(const scene::Scene& scene,
             const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
             const WorldOptions& options)
    : impl_(std::make_unique<Impl>(scene, models, options)) {}
World::~World() = default;

std::string PhysicsVersion() { return std::string("MuJoCo ") + mj_versionString(); }

double World::time() const { return impl_->time(); }

robot::Observations World::Observe() const {
  robot::Observations observations;
  Observe(&observations);
  return observations;
}

void World::Observe(robot::Observations* observations) const {
  const mjModel* model = impl_->model.get();
  const mjData* data = impl_->data.get();
  for (const Impl::RobotEntry& robot : impl_->robots) {
    robot::Observation& seen = (*observations)[robot.name];
    const int n = robot.model->dof();
    seen.time = time();
    seen.q.resize(n);
    seen.v.resize(n);
    seen.tau_external.resize(n);
    for (int i = 0; i < n; ++i) {
      seen.q[i] = data->qpos[robot.qpos[i]];
      seen.v[i] = data->qvel[robot.dof[i]];
      seen.tau_external[i] = data->qfrc_constraint[robot.dof[i]];
    }
    if (robot.pushed.size() == n) seen.tau_external += robot.pushed;
    // What is left of the constraint torques without the joints' end stops and friction is contact.
    for (int row = 0; row < data->nefc; ++row) {
      const int type = data->efc_type[row];
      if (type != mjCNSTR_LIMIT_JOINT && type != mjCNSTR_FRICTION_DOF) continue;
      const int dof = type == mjCNSTR_LIMIT_JOINT ? model->jnt_dofadr[data->efc_id[row]] : data->efc_id[row];
      const auto found = std::find(robot.dof.begin(), robot.dof.end(), dof);
      if (found == robot.dof.end()) continue;
      const double slope =
          mj_isSparse(model) ? data->efc_J[data->efc_J_rowadr[row]] : data->efc_J[row * model->nv + dof];
      seen.tau_external[found - robot.dof.begin()] -= slope * data->efc_force[row];
    }
    seen.gripper_opening = 0;
    const size_t fingers = robot.finger_qpos.size();
    for (size_t i = 0; i < fingers; ++i) {
      seen.gripper_opening +=
          robot.model->gripper().OpeningShare(i, fingers, data->qpos[robot.finger_qpos[i]]);
    }
  }
}

void World::Apply(const robot::Commands& commands, double period) {
  Impl& world = *impl_;
  if (!std::isfinite(period) || period <= 0) {
    throw InputError("the control period is " + std::to_string(period) + " s",
                     "a period above zero is accepted");
  }
  for (Impl::RobotEntry& robot : world.robots) robot.commanded = false;
  for (const auto& [name, command] : commands) {
    const auto robot =
        std::find_if(world.robots.begin(), world.robots.end(),
                     [&name = name](const Impl::RobotEntry& entry) { return entry.name == name; });
    if (robot == world.robots.end()) ThrowUnknown("robot", name, Names(world.robots));
    const bool velocity = command.mode == robot::Command::Mode::kVelocity;
    const Eigen::VectorXd& wanted = velocity ? command.velocity : command.torque;
    if (wanted.size() != robot->model->dof() || !wanted.allFinite() ||
        !std::isfinite(command.gripper.opening) || !std::isfinite(command.gripper.force)) {
      throw InputError("the command for robot '" + name + "' is of the wrong size or not finite",
                       std::to_string(robot->model->dof()) + " finite " +
                           (velocity ? "velocities" : "torques") + " are accepted");
    }
    if (velocity) {
      const Eigen::VectorXd& limit = robot->model->max_velocity();
      robot->velocity = wanted.cwiseMin(limit).cwiseMax(-limit);
      if (!robot->follows_velocity) {
        for (int i = 0; i < robot->model->dof(); ++i) robot->reference[i] = world.data->qpos[robot->qpos[i]];
      }
    } else {
      const Eigen::VectorXd& limit = robot->model->max_torque();
      robot->torque = wanted.cwiseMin(limit).cwiseMax(-limit);
    }
    robot->follows_velocity = velocity;
    robot->gripper = command.gripper;
    robot->commanded = true;
  }
  world.target_time += period;
  while (world.time() + 0.5 * world.options.timestep < world.target_time) world.Step();
}

scene::WorldEstimate World::Truth() const {
  scene::WorldEstimate estimate;
  Truth(&estimate);
  return estimate;
}

void World::Truth(scene::WorldEstimate* estimate) const {
  estimate->time = time();
  for (const Impl::ObjectEntry& object : impl_->objects) {
    estimate->X_WO[object.name] = impl_->ObjectPose(object);
  }
}

math::Vector6d World::ObjectVelocity(const std::string& object) const {
  const Impl::ObjectEntry& entry = impl_->objects[impl_->ObjectIndex(object)];
  math::Vector6d V_WO = math::Vector6d::Zero();
  if (entry.dof < 0) return V_WO;
  const Eigen::Map<const math::Vector6d> stored(impl_->data->qvel + entry.dof);
  V_WO.head<3>() = stored.head<3>();
  V_WO.tail<3>() = impl_->ObjectPose(entry).R * stored.tail<3>();
  return V_WO;
}

double World::ContactForce(const std::string& a, const std::string& b) const {
  const int owner_a = impl_->OwnerIndex(a);
  const int owner_b = impl_->OwnerIndex(b);
  const mjModel* model = impl_->model.get();
  const mjData* data = impl_->data.get();
  double sum = 0;
  for (int i = 0; i < data->ncon; ++i) {
    const mjContact& contact = data->contact[i];
    const int first = impl_->owner[model->geom_bodyid[contact.geom1]];
    const int second = impl_->owner[model->geom_bodyid[contact.geom2]];
    if (!(first == owner_a && second == owner_b) && !(first == owner_b && second == owner_a)) continue;
    mjtNum force[6];
    mj_contactForce(model, data, i, force);
    sum += force[0];
  }
  return sum;
}

std::vector<Contact> World::Contacts() const {
  const mjModel* model = impl_->model.get();
  const mjData* data = impl_->data.get();
  std::map<std::pair<int, int>, double> sums;
  for (int i = 0; i < data->ncon; ++i) {
    const mjContact& contact = data->contact[i];
    const int first = impl_->owner[model->geom_bodyid[contact.geom1]];
    const int second = impl_->owner[model->geom_bodyid[contact.geom2]];
    if (first < 0 || second < 0 || first == second) continue;
    mjtNum force[6];
    mj_contactForce(model, data, i, force);
    sums[std::minmax(first, second)] += force[0];
  }
  const auto name = [&](int owner) -> const std::string& {
    const auto objects = static_cast<int>(impl_->objects.size());
    return owner < objects ? impl_->objects[owner].name : impl_->robots[owner - objects].name;
  };
  std::vector<Contact> contacts;
  for (const auto& [pair, force] : sums) contacts.push_back({name(pair.first), name(pair.second), force});
  return contacts;
}

World::Touch World::Touching(const std::string& a, const std::string& b) const {
  const int owner_a = impl_->OwnerIndex(a);
  const int owner_b = impl_->OwnerIndex(b);
  const mjModel* model = impl_->model.get();
  const mjData* data = impl_->data.get();
  Touch touch;
  touch.speed = -1e9;
  for (int i = 0; i < data->ncon; ++i) {
    const mjContact& contact = data->contact[i];
    const int body1 = model->geom_bodyid[contact.geom1], body2 = model->geom_bodyid[contact.geom2];
    const int first = impl_->owner[body1], second = impl_->owner[body2];
    const bool forward = first == owner_a && second == owner_b;
    if (!forward && !(first == owner_b && second == owner_a)) continue;
    mjtNum force[6], velocity[6];
    mj_contactForce(model, data, i, force);
    touch.force += force[0];
    const int body = forward ? body2 : body1;
    mj_objectVelocity(model, data, mjOBJ_BODY, body, velocity, 0);
    const Eigen::Map<const Eigen::Vector3d> w(velocity), v(velocity + 3);
    const Eigen::Map<const Eigen::Vector3d> at(contact.pos), centre(data->xipos + 3 * body);
    // MuJoCo's normal points from the first geom to the second.
    const Eigen::Vector3d into = (forward ? -1 : 1) * Eigen::Map<const Eigen::Vector3d>(contact.frame);
    touch.speed = std::max(touch.speed, (v + w.cross(at - centre)).dot(into));
  }
  return touch;
}

// Smooth ramps: nothing pushes at once with all its force.
void World::Impl::ApplyPush(RobotEntry& robot) {
  const double now = time();
  robot.pushed.setZero(robot.model->dof());
  if (robot.push.size() == 0 || now < robot.push_begin || now >= robot.push_end) return;
  const double ramp = kPushRamp * (robot.push_end - robot.push_begin);
  const double inside = std::min(now - robot.push_begin, robot.push_end - now);
  robot.pushed = std::min(1.0, inside / ramp) * robot.push;
  for (size_t i = 0; i < robot.dof.size(); ++i) {
    data->qfrc_applied[robot.dof[i]] += robot.pushed[static_cast<Eigen::Index>(i)];
  }
}

void World::PushArm(const std::string& robot, const Eigen::VectorXd& torques, double duration) {
  Impl& world = *impl_;
  const auto found = std::find_if(world.robots.begin(), world.robots.end(),
                                  [&](const Impl::RobotEntry& entry) { return entry.name == robot; });
  if (found == world.robots.end()) ThrowUnknown("robot", robot, Names(world.robots));
  if (torques.size() != found->model->dof() || !torques.allFinite() || !std::isfinite(duration) ||
      duration <= 0) {
    throw InputError("a push of robot '" + robot + "' is of the wrong size or not finite",
                     std::to_string(found->model->dof()) + " finite torques, for a time above zero");
  }
  found->push = torques;
  found->push_begin = time();
  found->push_end = time() + duration;
}

bool World::IsPushed(const std::string& robot, double after) const {
  return std::any_of(impl_->robots.begin(), impl_->robots.end(), [&](const Impl::RobotEntry& entry) {
    return entry.name == robot && time() < entry.push_end + after;
  });
}

void World::PlaceObject(const std::string& object, const math::Pose& X_WO) {
  Impl& world = *impl_;
  const int index = world.ObjectIndex(object);
  if (!IsFinite(X_WO)) throw InputError("the pose for object '" + object + "' is not finite");
  const math::Pose X_OldNew = math::Between(world.ObjectPose(world.objects[index]), X_WO);
  const math::Pose X_WOld = world.ObjectPose(world.objects[index]);
  for (const int moved : world.Mounted(index)) {
    Impl::ObjectEntry& entry = world.objects[moved];
    entry.X_WO = X_WOld * X_OldNew * math::Between(X_WOld, world.ObjectPose(entry));
    entry.leader = -1;
    if (entry.mode == Impl::Mode::kStatic) {
      const Eigen::Quaterniond q = entry.X_WO.Quaternion();
      const double quaternion[4] = {q.w(), q.x(), q.y(), q.z()};
      mju_copy3(world.model->body_pos + 3 * entry.body, entry.X_WO.p.data());
      mju_copy4(world.model->body_quat + 4 * entry.body, quaternion);
    } else {
      world.SetFreePose(entry, entry.X_WO);
      world.SetFreeVelocity(entry, entry.X_WO, math::Vector6d::Zero());
    }
  }
  world.drives.erase(index);
  mj_forward(world.model.get(), world.data.get());
}

void World::MoveObject(const std::string& object, const math::Pose& X_WO_goal, double duration, bool steady) {
  Impl& world = *impl_;
  const int index = world.ObjectIndex(object);
  if (!IsFinite(X_WO_goal)) throw InputError("the goal for object '" + object + "' is not finite");
  if (!std::isfinite(duration) || duration <= 0) {
    throw InputError("object '" + object + "' is to move over " + std::to_string(duration) + " s",
                     "a duration above zero is accepted: nothing teleports");
  }
  const math::Pose X_WO = world.ObjectPose(world.objects[index]);
  bool compile = false;
  for (const int moved : world.Mounted(index)) {
    Impl::ObjectEntry& entry = world.objects[moved];
    entry.leader = index;
    entry.X_LO = math::Between(X_WO, world.ObjectPose(entry));
    if (entry.mode == Impl::Mode::kStatic) {
      entry.mode = Impl::Mode::kDriven;
      compile = true;
    }
  }
  if (compile) world.Compile();
  Drive drive;
  drive.start = X_WO;
  drive.change.head<3>() = X_WO_goal.p - X_WO.p;
  drive.change.tail<3>() = math::LogSO3(X_WO.R.transpose() * X_WO_goal.R);
  drive.begin = world.time();
  drive.duration = duration;
  drive.steady = steady;
  world.drives[index] = drive;
}

bool World::IsDriven(const std::string& object) const {
  const Impl::ObjectEntry& entry = impl_->objects[static_cast<size_t>(impl_->ObjectIndex(object))];
  return entry.leader >= 0 && impl_->drives.contains(entry.leader);
}

}  // namespace tether::sim
