#include "tether/planning/ik/turned_grasps.h"

#include <algorithm>
#include <numbers>
#include <utility>
#include <variant>

#include "tether/planning/ik/ik_rows.h"

namespace tether::planning {
namespace {

// Joints that are nearer to their limits than this have little room, rad.
constexpr double kRoom = 0.1;
// What a key pose without an IK solution counts, beside 1 for one with a joint at its limit.
constexpr double kMissing = 10;
// Worth a grasp that is turned further.
constexpr double kWorth = 0.25;
// The hand turns by no more than this from the key pose before to a grasp that is turned, rad.
constexpr double kMostTurn = 2.4;

bool IsGrasp(const SceneFacts& facts, const BoundStep& step) {
  return step.control == facts.hand() &&
         std::any_of(step.schema.execute.begin(), step.schema.execute.end(), [](const Verb& verb) {
           const auto* gripper = std::get_if<GripperVerb>(&verb);
           return gripper != nullptr && !gripper->close_on.empty();
         });
}

double LackOfRoom(const robot::Model& model, const std::vector<IkSolution>& solutions) {
  Eigen::VectorXd lower, upper;
  robot::NarrowLimits(model, kLimitMargin, lower, upper);
  double lack = 0;
  for (const IkSolution& solution : solutions) {
    if (!solution.found || !solution.problem.empty()) lack += kMissing;
    if (!solution.found) continue;
    const double room = std::min((solution.q - lower).minCoeff(), (upper - solution.q).minCoeff());
    lack += std::clamp(1 - room / kRoom, 0.0, 1.0);
  }
  return lack;
}

}  // namespace

void PreferTurnedGrasps(const SceneFacts& facts, const std::vector<BoundStep>& steps,
                        std::vector<math::Pose>& poses, KeyPoseProgram& key_poses) {
  if (!NeedsIkSolutions(facts.problem()) || !key_poses.joints.empty()) return;
  const robot::Model& model = *facts.problem().robot.model;
  if (model.gripper().hinged() || poses.size() != steps.size()) return;
  double lack = LackOfRoom(model, key_poses.ik_solutions);
  static const math::Pose half_turn(math::ExpSO3(Eigen::Vector3d(0, 0, std::numbers::pi)),
                                    Eigen::Vector3d::Zero());
  for (size_t t = 0; t < steps.size() && lack > kWorth; ++t) {
    if (!IsGrasp(facts, steps[t])) continue;
    const int step = static_cast<int>(t);
    const Eigen::Matrix3d R_before = key_poses.tree.PoseAt(facts.hand(), step - 1, poses).R;
    const Eigen::Matrix3d R_turned = key_poses.tree.PoseAt(facts.hand(), step, poses).R * half_turn.R;
    if (math::AngleBetween(R_before, R_turned) > kMostTurn) continue;
    std::vector<IkSolution> before = key_poses.ik_solutions;
    nlp::Point turned;
    turned.poses = poses;
    turned.poses[t] = poses[t] * half_turn;
    FindIkSolutions(facts, steps, turned, key_poses);
    const double lack_turned = LackOfRoom(model, key_poses.ik_solutions);
    if (lack_turned < lack - kWorth) {
      lack = lack_turned;
      poses = std::move(turned.poses);
    } else {
      key_poses.ik_solutions = std::move(before);
    }
  }
}

}  // namespace tether::planning
