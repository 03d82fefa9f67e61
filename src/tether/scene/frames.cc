#include "tether/scene/frames.h"

#include <cassert>

namespace tether::scene {

Frames::Frames(const Scene& scene) : num_objects_(scene.objects.size()), num_regions_(scene.regions.size()) {
  const auto add = [&](const std::string& name) {
    by_name_.emplace(name, names_.next_id());
    names_.push_back(name);
  };
  add(kWorld);
  for (const Object& object : scene.objects) add(object.name);
  for (const Region& region : scene.regions) add(region.name);
  for (const Robot& robot : scene.robots) add(robot.name);
  add(kHand);

  const auto hang = [&](const std::string& parent) {
    parents_.push_back(Find(parent));
    assert(parents_.back().valid());
  };
  parents_.emplace_back();
  for (const Object& object : scene.objects) hang(object.parent);
  for (const Region& region : scene.regions) hang(region.parent);
  for (const Robot& robot : scene.robots) hang(robot.parent);
  hang(kWorld);
}

int Frames::RegionOf(FrameId frame) const {
  const int index = frame.value() - 1 - static_cast<int>(num_objects_);
  return index >= 0 && index < static_cast<int>(num_regions_) ? index : -1;
}

FrameId Frames::Find(const std::string& name) const {
  const auto found = by_name_.find(name);
  return found == by_name_.end() ? FrameId() : found->second;
}

}  // namespace tether::scene
