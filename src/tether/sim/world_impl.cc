#include "tether/sim/world_impl.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <iterator>
#include <set>
#include <utility>

#include <mujoco/mujoco.h>

#include "tether/common/error.h"
#include "tether/common/log.h"
#include "tether/common/text.h"
#include "tether/math/pose_error.h"
#include "tether/robot/mujoco_setup.h"
#include "tether/sim/box_collision.h"
#include "tether/sim/composer.h"
#include "tether/sim/rolling.h"

namespace tether::sim {
namespace {

// A finger's servo to an opening: stiffness in N/m, and the force at which it saturates, which also bounds
// the fingers' speed.
constexpr double kFingerStiffness = 4000;
constexpr double kFingerServoForce = 20;
// The same for fingers on hinges, in Nm/rad.
constexpr double kFingerTurnStiffness = 4;
// The servo of an arm that follows velocities: stiffness in 1/s², critically damped, and the greatest lag,
// rad.
constexpr double kServoStiffness = 2500;
constexpr double kServoLeash = 0.05;
// An arm without a command floats; this much damping, in Nm s/rad, keeps it from drifting.
constexpr double kFloatDamping = 10;
// How fast a movable object that is driven catches up with its path, 1/s.
constexpr double kCatchUp = 50;
// Friction that a driven object overcomes, in its own weights.
constexpr double kDriveForce = 3;
constexpr double kDriveLearning = 0.2;  // per step

std::unique_ptr<mjModel, DeleteMujoco> LoadText(const std::string& xml) {
  std::array<char, 1000> message{};
  // The virtual file system is 2 MB: too much for the stack.
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  std::unique_ptr<mjModel, DeleteMujoco> model;
  const char* name = "scene.xml";
  try {
    mj_makeEmptyFileVFS(files.get(), name, static_cast<int>(xml.size()));
    std::memcpy(files->filedata[mj_findFileVFS(files.get(), name)], xml.data(), xml.size());
    const PlainLocale plain;  // MuJoCo reads numbers as the locale says.
    model.reset(mj_loadXML(name, files.get(), message.data(), message.size()));
  } catch (const robot::MujocoError& error) {
    mj_deleteVFS(files.get());
    throw InputError(std::string("the scene can't be simulated: ") + error.what());
  }
  mj_deleteVFS(files.get());
  if (model == nullptr) throw InputError(std::string("the scene can't be simulated: ") + message.data());
  return model;
}

// The numbers a joint has in qpos and in qvel.
std::pair<int, int> JointSizes(int type) {
  switch (type) {
    case mjJNT_FREE:
      return {7, 6};
    case mjJNT_BALL:
      return {4, 3};
    default:
      return {1, 1};
  }
}

/// Throws InputError if a robot has no model or starts where it can't be.
void RequireRobots(const scene::Scene& scene,
                   const std::map<std::string, std::shared_ptr<const robot::Model>>& models) {
  Diagnostics diagnostics;
  for (const scene::Robot& robot : scene.robots) {
    const auto found = models.find(robot.name);
    if (found == models.end() || found->second == nullptr) {
      diagnostics.Add({}, "robot '" + robot.name + "' has no model");
      continue;
    }
    const robot::Model& arm = *found->second;
    if (robot.q.empty()) continue;
    if (static_cast<int>(robot.q.size()) != arm.dof()) {
      diagnostics.Add({},
                      "robot '" + robot.name + "' has " + std::to_string(robot.q.size()) + " joint positions",
                      "model '" + arm.name() + "' has " + std::to_string(arm.dof()) + " joints");
      continue;
    }
    for (int i = 0; i < arm.dof(); ++i) {
      const double q = robot.q[i];
      if (q >= arm.lower()[i] - 1e-6 && q <= arm.upper()[i] + 1e-6) continue;
      diagnostics.Add(
          {}, "robot '" + robot.name + "' has " + arm.joint_names()[i] + " at " + Format("%f", q) + " rad",
          "from " + Format("%f to %f", arm.lower()[i], arm.upper()[i]) + " is accepted");
    }
  }
  diagnostics.ThrowIfAny();
}

}  // namespace

void RequireSimulable(const scene::Scene& scene,
                      const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
                      const std::map<std::string, math::Pose>& X_WO) {
  RequireRobots(scene, models);
  scene::Scene doubtful;
  const std::string shipped = robot::DataDirectory() + "/models/robots/";
  const bool own_data = std::getenv("TETHER_DATA_DIR") != nullptr;
  for (const scene::Robot& robot : scene.robots) {
    if (!own_data && models.at(robot.name)->mjcf_path().starts_with(shipped)) continue;
    scene::Robot& alone = doubtful.robots.emplace_back(robot);
    alone.parent = scene::kWorld;
    alone.X_ParentBase = scene.InitialPose(robot.name);
  }
  for (const scene::Object& object : scene.objects) {
    if (HasHull(object)) doubtful.objects.push_back(object);
  }
  if (doubtful.robots.empty() && doubtful.objects.empty()) return;
  robot::PrepareMujoco();
  Composition composition;
  composition.models = models;
  composition.X_WO = X_WO;
  LoadText(ComposeMjcf(doubtful, composition));
}

void DeleteMujoco::operator()(mjModel_* model) const { mj_deleteModel(model); }
void DeleteMujoco::operator()(mjData_* data) const { mj_deleteData(data); }

math::Pose Drive::At(double time) const {
  const double s = std::clamp((time - begin) / duration, 0.0, 1.0);
  const double share = steady ? s : s * s * s * (10 + s * (-15 + 6 * s));
  return {start.R * math::ExpSO3(share * change.tail<3>()), start.p + share * change.head<3>()};
}

namespace {

/// A box on a box has 4 contacts, or 8 where they are turned; one that carries another has those of both.
int FirstContactRoom(const scene::Scene& scene) {
  int parts = 0;
  for (const scene::Object& object : scene.objects) {
    if (object.movable()) parts += static_cast<int>(object.shape.parts.size());
  }
  return 100 + 6 * parts;
}

}  // namespace

World::Impl::Impl(const scene::Scene& scene_in,
                  const std::map<std::string, std::shared_ptr<const robot::Model>>& models_in,
                  const WorldOptions& options_in)
    : scene(scene_in), models(models_in), options(options_in), contact_room(FirstContactRoom(scene_in)) {
  robot::PrepareMujoco();
  GuardBoxCollision();
  if (!std::isfinite(options.timestep) || options.timestep <= 0) {
    throw InputError("the physics step is " + Format("%f", options.timestep) + " s",
                     "a step above zero is accepted; 0.001 or 0.002 work well");
  }
  RequireRobots(scene, models);
  for (const scene::Object& object : scene.objects) {
    ObjectEntry entry;
    entry.name = object.name;
    entry.mode = object.movable() ? Mode::kFree : Mode::kStatic;
    entry.X_WO = scene.InitialPose(object.name);
    objects.push_back(std::move(entry));
  }
  for (const scene::Robot& robot : scene.robots) {
    RobotEntry entry;
    entry.name = robot.name;
    entry.model = models.at(robot.name);
    entry.torque = entry.velocity = entry.reference = Eigen::VectorXd::Zero(entry.model->dof());
    entry.gripper.opening = entry.model->gripper().max_opening;
    robots.push_back(std::move(entry));
  }
  Compile();
  for (size_t r = 0; r < robots.size(); ++r) {
    const RobotEntry& robot = robots[r];
    const std::vector<double>& q = scene.robots[r].q;
    for (size_t i = 0; i < robot.qpos.size(); ++i) {
      data->qpos[robot.qpos[i]] = q.empty() ? robot.model->home()[i] : q[i];
    }
    const size_t fingers = robot.finger_qpos.size();
    for (size_t i = 0; i < fingers; ++i) {
      data->qpos[robot.finger_qpos[i]] =
          robot.model->gripper().FingerPosition(i, fingers, robot.gripper.opening);
    }
  }
  mj_forward(model.get(), data.get());
}

void World::Impl::Compile() {
  Composition composition;
  composition.timestep = options.timestep;
  composition.contact_room = contact_room;
  composition.models = models;
  for (const ObjectEntry& object : objects) {
    composition.X_WO[object.name] = ObjectPose(object);
    if (object.mode == Mode::kDriven) composition.driven.insert(object.name);
  }
  const std::unique_ptr<mjModel, DeleteMujoco> old_model = std::move(model);
  const std::unique_ptr<mjData, DeleteMujoco> old_data = std::move(data);
  model = LoadText(ComposeMjcf(scene, composition));
  data.reset(mj_makeData(model.get()));
  acceleration.assign(model->nv, 0.0);
  inertia_torque.assign(model->nv, 0.0);
  if (old_model != nullptr) {
    for (int old = 0; old < old_model->njnt; ++old) {
      const char* name = mj_id2name(old_model.get(), mjOBJ_JOINT, old);
      const int joint = name ? mj_name2id(model.get(), mjOBJ_JOINT, name) : -1;
      if (joint < 0) continue;
      const auto [positions, velocities] = JointSizes(model->jnt_type[joint]);
      mju_copy(data->qpos + model->jnt_qposadr[joint], old_data->qpos + old_model->jnt_qposadr[old],
               positions);
      const int to = model->jnt_dofadr[joint];
      const int from = old_model->jnt_dofadr[old];
      mju_copy(data->qvel + to, old_data->qvel + from, velocities);
      mju_copy(data->qacc_warmstart + to, old_data->qacc_warmstart + from, velocities);
    }
  }
  FindIds();
  if (old_model != nullptr) mj_forward(model.get(), data.get());
}

void World::Impl::FindIds() {
  owner.assign(model->nbody, -1);
  std::vector<bool> driven(model->nbody, false);
  for (size_t i = 0; i < objects.size(); ++i) {
    ObjectEntry& object = objects[i];
    const std::string name = ObjectBodyName(object.name);
    object.body = mj_name2id(model.get(), mjOBJ_BODY, name.c_str());
    owner[object.body] = static_cast<int>(i);
    driven[object.body] = object.mode == Mode::kDriven;
    if (object.mode == Mode::kStatic) continue;
    const int joint = mj_name2id(model.get(), mjOBJ_JOINT, name.c_str());
    object.qpos = model->jnt_qposadr[joint];
    object.dof = model->jnt_dofadr[joint];
  }
  for (size_t r = 0; r < robots.size(); ++r) {
    RobotEntry& robot = robots[r];
    const auto joint_id = [&](const std::string& name) {
      return mj_name2id(model.get(), mjOBJ_JOINT, (RobotPrefix(robot.name) + name).c_str());
    };
    robot.joint.clear();
    robot.qpos.clear();
    robot.dof.clear();
    robot.finger_qpos.clear();
    robot.finger_dof.clear();
    for (const std::string& name : robot.model->joint_names()) {
      robot.joint.push_back(joint_id(name));
      robot.qpos.push_back(model->jnt_qposadr[robot.joint.back()]);
      robot.dof.push_back(model->jnt_dofadr[robot.joint.back()]);
    }
    for (const std::string& name : robot.model->finger_joints()) {
      const int joint = joint_id(name);
      robot.finger_qpos.push_back(model->jnt_qposadr[joint]);
      robot.finger_dof.push_back(model->jnt_dofadr[joint]);
    }
    const int base = mj_name2id(model.get(), mjOBJ_BODY, robot.name.c_str());
    for (int body = base; body < model->nbody; ++body) {
      if (model->body_rootid[body] == model->body_rootid[base]) {
        owner[body] = static_cast<int>(objects.size() + r);
      }
    }
  }
  // MuJoCo uses the greater of two coefficients, or where priorities differ those of the geom with the higher
  // one. The slipperier geom gets the higher priority (scene::PairFriction).
  std::set<double, std::greater<>> frictions;
  for (int geom = 0; geom < model->ngeom; ++geom) frictions.insert(model->geom_friction[3 * geom]);
  for (int geom = 0; geom < model->ngeom; ++geom) {
    const auto rank = frictions.find(model->geom_friction[3 * geom]);
    model->geom_priority[geom] = static_cast<int>(std::distance(frictions.begin(), rank));
  }
  std::vector<bool> rolls(model->ngeom, false);
  for (int geom = 0; geom < model->ngeom; ++geom) {
    const int object = owner[model->geom_bodyid[geom]];
    if (object < 0 || object >= static_cast<int>(objects.size())) continue;
    const scene::Object& one = scene.objects[object];
    rolls[geom] = one.movable() && Rolls(one.shape);
  }
  SetRollingFriction(model.get(), rolls);
  // What is fixed never collides with what is fixed: tables stand under robot bases, shelves on tables. A
  // robot's own masks, where it has any, are left alone.
  for (int geom = 0; geom < model->ngeom; ++geom) {
    if (model->geom_contype[geom] != 1 || model->geom_conaffinity[geom] != 1) continue;
    const int body = model->geom_bodyid[geom];
    const bool fixed = model->body_weldid[body] == 0 || driven[body];
    model->geom_contype[geom] = fixed ? 2 : 1;
    model->geom_conaffinity[geom] = fixed ? 1 : 3;
  }
}

int World::Impl::ObjectIndex(const std::string& name) const {
  for (size_t i = 0; i < objects.size(); ++i) {
    if (objects[i].name == name) return static_cast<int>(i);
  }
  std::vector<std::string> names;
  for (const ObjectEntry& object : objects) names.push_back(object.name);
  throw InputError("the world has no object '" + name + "'",
                   names.empty() ? "it has none" : SuggestFrom(name, names));
}

int World::Impl::OwnerIndex(const std::string& name) const {
  for (size_t r = 0; r < robots.size(); ++r) {
    if (robots[r].name == name) return static_cast<int>(objects.size() + r);
  }
  return ObjectIndex(name);
}

math::Pose World::Impl::ObjectPose(const ObjectEntry& object) const {
  if (object.mode != Mode::kFree || object.qpos < 0) return object.X_WO;
  const mjtNum* qpos = data->qpos + object.qpos;
  return {Eigen::Quaterniond(qpos[3], qpos[4], qpos[5], qpos[6]), Eigen::Vector3d(qpos[0], qpos[1], qpos[2])};
}

void World::Impl::SetFreePose(const ObjectEntry& object, const math::Pose& X_WO) {
  mjtNum* qpos = data->qpos + object.qpos;
  const Eigen::Quaterniond q = X_WO.Quaternion();
  for (int i = 0; i < 3; ++i) qpos[i] = X_WO.p[i];
  qpos[3] = q.w();
  qpos[4] = q.x();
  qpos[5] = q.y();
  qpos[6] = q.z();
}

void World::Impl::SetFreeVelocity(const ObjectEntry& object, const math::Pose& X_WO,
                                  const math::Vector6d& V_WO) {
  // MuJoCo has a free joint's linear velocity in the world and its angular velocity in the body.
  Eigen::Map<math::Vector6d> stored(data->qvel + object.dof);
  stored.head<3>() = V_WO.head<3>();
  stored.tail<3>() = X_WO.R.transpose() * V_WO.tail<3>();
}

std::vector<int> World::Impl::Mounted(int object) const {
  std::vector<int> mounted = {object};
  if (objects[object].mode == Mode::kFree) return mounted;
  for (size_t i = 0; i < mounted.size(); ++i) {
    for (size_t j = 0; j < scene.objects.size(); ++j) {
      if (!scene.objects[j].movable() && scene.objects[j].parent == objects[mounted[i]].name) {
        mounted.push_back(static_cast<int>(j));
      }
    }
  }
  return mounted;
}

void World::Impl::FollowDrives() {
  const double now = time();
  const double next = now + options.timestep;
  for (ObjectEntry& object : objects) {
    if (object.mode == Mode::kStatic) continue;
    const auto drive = object.leader < 0 ? drives.end() : drives.find(object.leader);
    if (object.mode == Mode::kFree && drive == drives.end()) continue;
    math::Vector6d V_WO = math::Vector6d::Zero();
    math::Pose X_next = object.X_WO;
    if (drive != drives.end()) {
      X_next = drive->second.At(next) * object.X_LO;
      const math::Pose X_now = drive->second.At(now) * object.X_LO;
      V_WO = math::PoseError(X_now, X_next) / options.timestep;
    }
    if (object.mode == Mode::kDriven) {
      SetFreePose(object, object.X_WO);
      SetFreeVelocity(object, object.X_WO, V_WO);
      object.X_WO = X_next;
      continue;
    }
    const math::Pose X_WO = ObjectPose(object);
    const math::Pose X_now = drive->second.At(now);
    // The surface that it slides on brakes it within a step, and what stands on it would lag behind: a force
    // of at most a few times its weight compensates for that.
    if (now > drive->second.begin + 0.5 * options.timestep) {
      const double mass = model->body_mass[object.body];
      Eigen::Map<Eigen::Vector2d> force(data->qfrc_applied + object.dof);
      const Eigen::Vector2d lost = V_WO.head<2>() - Eigen::Map<Eigen::Vector2d>(data->qvel + object.dof);
      force += kDriveLearning * mass / options.timestep * lost;
      const double most = kDriveForce * mass * std::abs(model->opt.gravity[2]);
      if (force.norm() > most) force *= most / force.norm();
    }
    // An obstacle may stop the object: its speed while it catches up is limited to the motion's greatest.
    const double reach = 2 / (kCatchUp * drive->second.duration);
    const math::Vector6d behind = math::PoseError(X_WO, X_now);
    Eigen::Vector3d lag = behind.head<3>(), turn = behind.tail<3>();
    lag *= std::min(1.0, (reach * drive->second.change.head<3>().norm() + 1e-3) / (lag.norm() + 1e-12));
    turn *= std::min(1.0, (reach * drive->second.change.tail<3>().norm() + 1e-2) / (turn.norm() + 1e-12));
    V_WO.head<3>() += kCatchUp * lag;
    V_WO.tail<3>() += kCatchUp * turn;
    V_WO[2] -= options.timestep * model->opt.gravity[2];
    SetFreeVelocity(object, X_WO, V_WO);
  }
}

void World::Impl::ServoVelocity(RobotEntry& robot) {
  std::fill(acceleration.begin(), acceleration.end(), 0.0);
  for (size_t i = 0; i < robot.dof.size(); ++i) {
    const double q = data->qpos[robot.qpos[i]];
    double& reference = robot.reference[static_cast<Eigen::Index>(i)];
    const double velocity = robot.velocity[static_cast<Eigen::Index>(i)];
    // The reference of an arm that is blocked does not wind up.
    reference = std::clamp(reference + velocity * options.timestep, q - kServoLeash, q + kServoLeash);
    acceleration[robot.dof[i]] = kServoStiffness * (reference - q) +
                                 2 * std::sqrt(kServoStiffness) * (velocity - data->qvel[robot.dof[i]]);
  }
  mj_mulM(model.get(), data.get(), inertia_torque.data(), acceleration.data());
  for (size_t i = 0; i < robot.dof.size(); ++i) {
    const double limit = robot.model->max_torque()[static_cast<Eigen::Index>(i)];
    robot.torque[static_cast<Eigen::Index>(i)] =
        std::clamp(data->qfrc_bias[robot.dof[i]] + inertia_torque[robot.dof[i]], -limit, limit);
  }
}

void World::Impl::ApplyForces() {
  for (RobotEntry& robot : robots) {
    if (robot.commanded && robot.follows_velocity) ServoVelocity(robot);
    for (size_t i = 0; i < robot.dof.size(); ++i) {
      const int dof = robot.dof[i];
      data->qfrc_applied[dof] =
          robot.commanded ? robot.torque[i] : data->qfrc_bias[dof] - kFloatDamping * data->qvel[dof];
    }
    ApplyPush(robot);
    const robot::Gripper& gripper = robot.model->gripper();
    const size_t fingers = robot.finger_dof.size();
    const double share = std::clamp(robot.gripper.force, 0.0, gripper.max_force) / gripper.max_force;
    for (size_t i = 0; i < fingers; ++i) {
      const bool hinged = gripper.hinged();
      const double closing = hinged ? gripper.closing_torque[i] : gripper.max_force;
      const double toward_closed = hinged && gripper.closed[i] > gripper.open[i] ? 1.0 : -1.0;
      double force = toward_closed * share * closing;
      if (robot.gripper.mode == robot::GripperCommand::Mode::kOpening) {
        const double opening = std::clamp(robot.gripper.opening, 0.0, gripper.max_opening);
        const double limit = hinged ? closing : std::min(kFingerServoForce, closing);
        const double stiffness = hinged ? kFingerTurnStiffness : kFingerStiffness;
        force = std::clamp(
            stiffness * (gripper.FingerPosition(i, fingers, opening) - data->qpos[robot.finger_qpos[i]]),
            -limit, limit);
      }
      data->qfrc_applied[robot.finger_dof[i]] = force;
    }
  }
}

void World::Impl::CheckStable() const {
  for (const int warning : {mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC}) {
    if (data->warning[warning].number == 0) continue;
    // MuJoCo resets the state when this happens: going on would judge a world that nobody set up.
    throw InputError("the simulation became unstable at " + std::to_string(time()) + " s",
                     "objects that don't start inside one another, and torques a controller keeps bounded");
  }
}

bool World::Impl::LacksRoom() const {
  return data->warning[mjWARN_CONTACTFULL].number > 0 || data->warning[mjWARN_CNSTRFULL].number > 0;
}

void World::Impl::Step() {
  ActOnObjects();
  FollowDrives();
  mj_step1(model.get(), data.get());
  while (LacksRoom()) {
    contact_room *= 2;
    Compile();
    FollowDrives();
    mj_step1(model.get(), data.get());
  }
  ApplyForces();
  mj_step2(model.get(), data.get());
  CheckStable();
  ++steps;
  for (auto drive = drives.begin(); drive != drives.end();) {
    if (time() < drive->second.end()) {
      ++drive;
      continue;
    }
    for (ObjectEntry& object : objects) {
      if (object.leader != drive->first) continue;
      object.leader = -1;
      if (object.mode != Mode::kFree) continue;
      Eigen::Map<math::Vector6d>(data->qvel + object.dof).setZero();
      Eigen::Map<math::Vector6d>(data->qfrc_applied + object.dof).setZero();
    }
    drive = drives.erase(drive);
  }
}

}  // namespace tether::sim
