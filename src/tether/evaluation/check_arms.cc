#include "tether/common/text.h"
#include "tether/evaluation/check.h"
#include "tether/motion/start_check.h"

namespace tether::evaluation {

std::vector<std::string> CheckArms(const scenario::Scenario& scenario) {
  const scene::Scene& scene = scenario.scene;
  const auto joints = [](const scene::Robot& robot) {
    return Eigen::VectorXd(
        Eigen::Map<const Eigen::VectorXd>(robot.q.data(), static_cast<Eigen::Index>(robot.q.size())));
  };
  std::vector<std::string> problems;
  for (const scene::Robot& robot : scene.robots) {
    motion::Snapshot snapshot;
    snapshot.model = scenario.models.at(robot.name);
    snapshot.opening = snapshot.model->gripper().max_opening;
    const math::Pose X_BW = scene.InitialPose(robot.name).Inverse();
    for (const scene::Object& object : scene.objects)
      snapshot.obstacles.push_back({object.name, object.shape, X_BW * scene.InitialPose(object.name)});
    for (const scene::Robot& other : scene.robots) {
      if (other.name == robot.name) continue;
      motion::AddArm(other.name, *scenario.models.at(other.name), joints(other),
                     X_BW * scene.InitialPose(other.name), &snapshot.obstacles);
    }
    for (const motion::Touch& touch : motion::FindOverlaps(snapshot, joints(robot)))
      problems.push_back("robot '" + robot.name + "' starts in something: its " + touch.a + " is " +
                         Fixed(-1e3 * touch.distance, 1) + " mm inside '" + touch.b + "'");
  }
  return problems;
}

}  // namespace tether::evaluation
