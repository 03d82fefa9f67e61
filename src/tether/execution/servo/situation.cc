#include "tether/execution/servo/situation.h"

#include <algorithm>
#include <numbers>
#include <utility>

#include "tether/common/error.h"
#include "tether/common/text.h"
#include "tether/control/constrained_velocity.h"
#include "tether/execution/servo/servo.h"

namespace tether::execution {
namespace {

std::shared_ptr<const robot::Model> FindModel(
    const std::map<std::string, std::shared_ptr<const robot::Model>>& models, const std::string& robot) {
  const auto found = models.find(robot);
  if (found != models.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& entry : models) names.push_back(entry.first);
  throw InputError("the plan is for robot '" + robot + "', which is not in the scene",
                   JoinAlternatives(names));
}

}  // namespace

std::string Length(double metres) {
  char text[40];
  if (metres < 1)
    FormatInto(text, sizeof text, "%.1f mm", 1000 * metres);
  else
    FormatInto(text, sizeof text, "%.1f m", metres);
  return text;
}

std::string Deviation(double metres, double radians) {
  if (radians == 0) return Length(metres);
  return Length(metres) + " and " + Fixed(radians * 180 / std::numbers::pi, 1) + " degrees";
}

Situation::Situation(const scene::Scene& scene_in, ResolvedPlan resolved,
                     const std::map<std::string, std::shared_ptr<const robot::Model>>& models)
    : scene(scene_in),
      plan(std::move(resolved.plan)),
      steps(std::move(resolved.steps)),
      robot(plan.robot),
      model(FindModel(models, robot)),
      X_WB(scene.InitialPose(robot)),
      q(model->home()),
      v(Eigen::VectorXd::Zero(model->dof())),
      tau_external(Eigen::VectorXd::Zero(model->dof())),
      objects(scene.objects.size()),
      records(steps.size()) {
  for (const ObjectId id : objects.ids()) {
    objects[id].X = scene.InitialPose(object_name(id));
    stands_on.push_back(FindFrame(scene, object(id).parent).value_or(AttachedFrame{}).object);
  }
  for (const scene::Region& place : scene.regions)
    regions.push_back(FindFrame(scene, place.name).value_or(AttachedFrame{}));
  for (const int i : records.ids()) records[i].step = i;
  for (const scene::Robot& other : scene.robots) {
    if (other.name == robot) continue;
    const auto found = models.find(other.name);
    if (found == models.end()) continue;
    others.push_back({other.name, found->second, scene.InitialPose(other.name), found->second->home()});
  }
}

void Situation::Record(EventKind kind, std::string text) {
  events.push_back({time, kind, std::min(step, records.next_id() - 1), std::move(text)});
}

math::Pose Situation::X_WF(const AttachedFrame& frame) const {
  return frame.object == kNone ? frame.X_OF : X_WO(frame.object) * frame.X_OF;
}

math::Vector6d Situation::V_WF(const AttachedFrame& frame) const {
  if (frame.object == kNone) return math::Vector6d::Zero();
  const control::MovingPose& object = objects[frame.object];
  math::Vector6d V = object.V;
  const Eigen::Vector3d p_OF_W = object.X.R * frame.X_OF.p;
  V.head<3>() += V.tail<3>().cross(p_OF_W);
  return V;
}

int Situation::GraspStep(ObjectId object) const {
  for (int i = std::min(step, num_steps() - 1); i >= 0; --i) {
    const IndexedVector<int, ObjectId>& closes = steps[i].close_on;
    if (std::find(closes.begin(), closes.end(), object) != closes.end()) return i;
  }
  return kNoStep;
}

const TouchList& Servo::allowed() const {
  static const TouchList none;
  return none;
}

const std::vector<control::FieldConstraint>& Servo::verb_fields() const {
  static const std::vector<control::FieldConstraint> none;
  return none;
}

}  // namespace tether::execution
