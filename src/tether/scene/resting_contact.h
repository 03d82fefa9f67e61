#pragma once

#include <map>
#include <string>

#include "tether/scene/scene.h"

namespace tether::scene {

/// How one body rests on another.
struct Resting {
  double distance = 0;        ///< Signed distance between the two, m.
  bool upward = false;        ///< The contact normal points up, to within 45°: one is above the other.
  bool centre_above = false;  ///< The upper one's centre of mass is above the lower one.

  /// In contact to within `tolerance` (m), carried from below.
  bool Holds(double tolerance) const {
    return distance <= tolerance && distance >= -tolerance && upward && centre_above;
  }
};

/// How `upper` rests on `lower`, from their shapes and poses in the world alone. Gravity is along −z.
Resting FindResting(const scene::Object& upper, const math::Pose& X_WUpper, const scene::Object& lower,
                    const math::Pose& X_WLower);

/// How far a body, with `down` (unit, in its own frame) pointing down, is from standing on a face or lying on
/// a side: the angle to the nearest orientation at which turning no longer lowers its centre of mass, rad; at
/// most 0.2.
double FindLean(const geometry::Shape& shape, const Eigen::Vector3d& down);

/// Whether `upper` stands or lies on `lower`: Resting::Holds(contact), and FindLean() is at most `lean`, rad.
bool StandsOn(const scene::Object& upper, const math::Pose& X_WUpper, const scene::Object& lower,
              const math::Pose& X_WLower, double contact, double lean);

/// Initial poses in the world of all objects.
std::map<std::string, math::Pose> InitialPoses(const scene::Scene& scene);

/// The object that carries `object`, with the poses given: the one in contact with it from below (to within 2
/// mm), the nearest if there are several. Null if there is none.
const scene::Object* FindSupport(const scene::Scene& scene, const std::map<std::string, math::Pose>& X_WO,
                                 const scene::Object& object);

/// The scene with each movable object attached to the movable one that carries it (FindSupport()), whatever
/// frame its pose was written in; an object written on a movable one that stands on something fixed is
/// attached to that. All poses in the world stay.
scene::Scene WithCarriers(const scene::Scene& scene);

}  // namespace tether::scene
