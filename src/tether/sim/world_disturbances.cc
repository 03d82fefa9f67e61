#include <algorithm>
#include <cmath>
#include <variant>

#include <mujoco/mujoco.h>

#include "tether/common/error.h"
#include "tether/geometry/hull/polytope.h"
#include "tether/sim/world_impl.h"

namespace tether::sim {
namespace {

// A blow lasts so long, s.
constexpr double kBlow = 0.01;
// What pulls is a spring with a damper, as stiff as steps of the physics allow: in units of mass over step².
constexpr double kPullStiffness = 0.1;
// Removed objects are so far above the scene, and so far apart, m.
constexpr double kAway = 100;
constexpr double kApart = 20;
// No length of an object becomes smaller than this, m.
constexpr double kLeast = 1e-3;

void RequireFinite(const Eigen::Vector3d& v, const std::string& object) {
  if (!v.allFinite()) throw InputError("a disturbance of object '" + object + "' is not finite");
}

/// The primitive with each of its full lengths greater by `grow`; hulls are scaled about their centre by the
/// same share in each direction.
geometry::Primitive Grown(const geometry::Primitive& primitive, double grow) {
  struct Grow {
    double by;
    double More(double length) const { return std::max(kLeast, length + by); }
    geometry::Primitive operator()(geometry::Box box) const {
      for (double& side : box.size) side = More(side);
      return box;
    }
    geometry::Primitive operator()(geometry::Sphere sphere) const {
      return geometry::Sphere{More(2 * sphere.radius) / 2};
    }
    geometry::Primitive operator()(geometry::Capsule capsule) const {
      return geometry::Capsule{More(2 * capsule.radius) / 2, capsule.length};
    }
    geometry::Primitive operator()(geometry::Cylinder cylinder) const {
      return geometry::Cylinder{More(2 * cylinder.radius) / 2, More(cylinder.length)};
    }
    geometry::Primitive operator()(const geometry::Hull& hull) const {
      const std::vector<Eigen::Vector3d>& corners = hull.polytope->vertices;
      Eigen::Vector3d lower = corners.front(), upper = corners.front();
      for (const Eigen::Vector3d& corner : corners) {
        lower = lower.cwiseMin(corner);
        upper = upper.cwiseMax(corner);
      }
      const double extent = (upper - lower).maxCoeff();
      const Eigen::Vector3d centre = (lower + upper) / 2;
      std::vector<Eigen::Vector3d> grown;
      for (const Eigen::Vector3d& corner : corners)
        grown.push_back(centre + More(extent) / extent * (corner - centre));
      const geometry::HullResult result = geometry::MakeHull(grown);
      return result.hull ? geometry::Primitive(*result.hull) : geometry::Primitive(hull);
    }
  };
  return std::visit(Grow{grow}, primitive);
}

}  // namespace

int World::Impl::MovableIndex(const std::string& name) const {
  const int index = ObjectIndex(name);
  if (objects[index].mode != Mode::kFree)
    throw InputError("object '" + name + "' is fixed", "an object with a mass");
  return index;
}

// Before each step: forces on objects, and removed ones stay where they are.
void World::Impl::ActOnObjects() {
  for (ObjectEntry& object : objects) {
    if (object.mode != Mode::kFree) continue;
    if (object.removed) {
      SetFreePose(object, object.X_WO);
      SetFreeVelocity(object, object.X_WO, math::Vector6d::Zero());
      continue;
    }
    Eigen::Map<math::Vector6d> wrench(data->xfrc_applied + 6 * object.body);
    wrench.setZero();
    ObjectEntry::Action& action = object.action;
    if (time() >= action.end - 0.5 * options.timestep) continue;
    const math::Pose X_WO = ObjectPose(object);
    Eigen::Vector3d force = action.force;
    const double mass = model->body_mass[object.body];
    if (action.most > 0) {
      const Eigen::Map<const Eigen::Vector3d> v(data->qvel + object.dof);
      const Eigen::Vector3d lag = action.from + (time() - action.begin) * action.velocity - X_WO.p;
      const double rate = 1 / options.timestep;
      force =
          mass * rate * (kPullStiffness * rate * lag + 2 * std::sqrt(kPullStiffness) * (action.velocity - v));
      force.z() -= mass * model->opt.gravity[2];
      if (force.norm() > action.most) force *= action.most / force.norm();
    }
    // MuJoCo applies the force at the centre of mass.
    const Eigen::Map<const Eigen::Vector3d> centre(data->xipos + 3 * object.body);
    wrench.head<3>() = force;
    if (action.most <= 0) wrench.tail<3>() = (X_WO * action.at - centre).cross(force);
  }
}

void World::RemoveObject(const std::string& object) {
  Impl& world = *impl_;
  const int index = world.MovableIndex(object);
  Impl::ObjectEntry& entry = world.objects[index];
  PlaceObject(object, math::Pose(Eigen::Vector3d(0, 0, kAway + kApart * index)));
  entry.removed = true;
}

void World::ReturnObject(const std::string& object, const math::Pose& X_WO) {
  Impl& world = *impl_;
  world.objects[world.MovableIndex(object)].removed = false;
  PlaceObject(object, X_WO);
}

bool World::IsRemoved(const std::string& object) const {
  return impl_->objects[impl_->ObjectIndex(object)].removed;
}

void World::KnockObject(const std::string& object, const Eigen::Vector3d& impulse,
                        const Eigen::Vector3d& at) {
  Impl& world = *impl_;
  RequireFinite(impulse, object);
  RequireFinite(at, object);
  Impl::ObjectEntry::Action action;
  action.end = time() + kBlow;
  action.force = impulse / kBlow;
  action.at = at;
  world.objects[world.MovableIndex(object)].action = action;
}

void World::PullObject(const std::string& object, const Eigen::Vector3d& by, double duration, double force) {
  Impl& world = *impl_;
  RequireFinite(by, object);
  if (!std::isfinite(duration) || duration <= 0 || !std::isfinite(force) || force <= 0)
    throw InputError("object '" + object + "' is pulled for no time or with no force", "both above zero");
  Impl::ObjectEntry::Action action;
  action.end = time() + duration;
  action.velocity = by / duration;
  action.from = world.ObjectPose(world.objects[world.MovableIndex(object)]).p;
  action.begin = time();
  action.most = force;
  world.objects[world.MovableIndex(object)].action = action;
}

void World::ChangeObject(const std::string& object, const Change& change) {
  Impl& world = *impl_;
  const int index = world.MovableIndex(object);
  scene::Object& changed = world.scene.objects[ToIndex(index)];
  const auto valid = [](const std::optional<double>& value, bool positive) {
    return !value || (std::isfinite(*value) && (!positive || *value > 0));
  };
  if (!valid(change.mass, true) || !valid(change.grow, false) || !valid(change.friction, false) ||
      change.friction.value_or(0) < 0)
    throw InputError("object '" + object + "' can't become so",
                     "a mass above zero, a friction of zero or more");
  if (change.mass) changed.mass = *change.mass;
  if (change.friction) changed.friction = *change.friction;
  if (change.grow) {
    for (geometry::Part& part : changed.shape.parts) part.primitive = Grown(part.primitive, *change.grow);
  }
  // Poses and speeds of all joints are kept.
  world.Compile();
}

}  // namespace tether::sim
