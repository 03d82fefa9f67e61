#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tether/robot/kinematics.h"

struct mjModel_;

namespace tether::robot {

/// The arm as read once from a MuJoCo model; not for users of the room.
struct ArmDescription {
  Chain chain;
  std::vector<LinkSolid> links;
  std::vector<std::string> problems;  ///< Why the joints are no chain from base to hand; empty if they are.
  /// Pairs of indices of `links`, and links.size() for the hand, that are next to each other or excluded in
  /// the MJCF file.
  std::vector<std::pair<int, int>> excluded;
};

/// `joints` are ids of hinges from base to hand, `fingers` ids of the gripper's joints, `site` that of the
/// hand.
ArmDescription ReadArm(const mjModel_* model, const std::vector<int>& joints, const std::vector<int>& fingers,
                       int site);

/// The collision shapes of a gripper's hinged fingers in the hand frame, at this opening (m).
std::vector<geometry::Part> ReadFingers(const Model& robot, const mjModel_* model, int site, double opening);

/// The greatest friction of the geoms that the fingers' joints move and that collide; none if there is no
/// such geom.
std::optional<double> ReadPadFriction(const mjModel_* model, const std::vector<int>& fingers);

/// ArmSolids::pairs: those not in `excluded` that do not overlap in each of many random configurations.
std::vector<std::pair<int, int>> PairsToCheck(const std::shared_ptr<const Model>& model,
                                              const std::vector<std::pair<int, int>>& excluded);

}  // namespace tether::robot
