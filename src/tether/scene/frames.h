#pragma once

#include <map>
#include <string>

#include "tether/common/id.h"
#include "tether/scene/scene.h"

namespace tether::scene {

/// The name of the acting robot's hand as a frame.
inline constexpr const char* kHand = "hand";

/// The frames of a scene by number: the world, the objects, the regions, the robots' bases, each in the
/// scene's order, and the acting robot's hand, which hangs on the world. A tree. Immutable; it keeps names,
/// not the scene.
class Frames {
 public:
  /// The scene's names must be unique, and its parents must be among them.
  explicit Frames(const Scene& scene);

  size_t size() const { return names_.size(); }
  IdRange<FrameId> ids() const { return names_.ids(); }
  IdRange<ObjectId> objects() const { return IdRange<ObjectId>(num_objects_); }

  static constexpr FrameId world() { return FrameId(0); }
  static constexpr FrameId Of(ObjectId object) { return FrameId(object.value() + 1); }
  FrameId hand() const { return FrameId(names_.size() - 1); }
  /// The object whose frame it is; not valid if it is no object's.
  ObjectId ObjectOf(FrameId frame) const {
    return frame.value() >= 1 && frame.index() <= num_objects_ ? ObjectId(frame.value() - 1) : ObjectId();
  }
  /// Index of the region in Scene::regions; −1 if it is none.
  int RegionOf(FrameId frame) const;

  /// The frame of that name; not valid if there is none.
  FrameId Find(const std::string& name) const;
  const std::string& Name(FrameId frame) const { return names_[frame]; }
  /// At the start; not valid for the world.
  FrameId Parent(FrameId frame) const { return parents_[frame]; }

  /// An id names the same in both.
  bool HasSameNames(const Frames& other) const { return names_ == other.names_; }

 private:
  size_t num_objects_, num_regions_;
  IndexedVector<FrameId, std::string> names_;
  IndexedVector<FrameId, FrameId> parents_;
  std::map<std::string, FrameId> by_name_;
};

}  // namespace tether::scene
