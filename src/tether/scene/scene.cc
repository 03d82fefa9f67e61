#include "tether/scene/scene.h"

#include <stdexcept>

namespace tether::scene {
namespace {

template <typename T>
const T* FindByName(const std::vector<T>& all, const std::string& name) {
  for (const T& one : all) {
    if (one.name == name) return &one;
  }
  return nullptr;
}

}  // namespace

ObjectId Scene::FindObjectId(const std::string& name) const {
  const Object* object = FindObject(name);
  return object == nullptr ? ObjectId() : ObjectId(static_cast<int>(object - objects.data()));
}

const Object* Scene::FindObject(const std::string& name) const { return FindByName(objects, name); }
const Region* Scene::FindRegion(const std::string& name) const { return FindByName(regions, name); }
const Robot* Scene::FindRobot(const std::string& name) const { return FindByName(robots, name); }

math::Pose Scene::InitialPose(const std::string& name) const {
  if (name == kWorld) return {};
  if (const Object* object = FindObject(name)) return InitialPose(object->parent) * object->X_ParentObject;
  if (const Region* region = FindRegion(name)) return InitialPose(region->parent) * region->X_ParentRegion;
  if (const Robot* robot = FindRobot(name)) return InitialPose(robot->parent) * robot->X_ParentBase;
  throw std::logic_error("no frame named '" + name + "'");
}

}  // namespace tether::scene
