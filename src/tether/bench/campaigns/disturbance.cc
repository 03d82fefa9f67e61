#include "tether/bench/campaigns/disturbance.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tether/common/random.h"
#include "tether/geometry/distance/bounds.h"
#include "tether/scenario/problem.h"

namespace tether::bench {
namespace {

using Eigen::Vector3d;
using math::Pose;

constexpr double kPerAction = 5;                     // s
constexpr double kNearest = 0.05, kFurthest = 0.35;  // m
constexpr double kFastest = 0.25;                    // m/s
// A motion that rises and falls smoothly peaks at so many times its mean.
constexpr double kPeak = 15.0 / 8;
constexpr double kPush = 20, kWristPush = 5;  // Nm
constexpr int kStrongJoints = 4;
constexpr double kPushFor = 0.3;  // s
constexpr int kDraws = 60;

/// The box about an object in the world.
geometry::Aabb BoxOf(const scene::Scene& scene, const scene::Object& object) {
  return geometry::BoundingBox(object.shape, scene.InitialPose(object.name));
}

class Drawing {
 public:
  Drawing(const scenario::Scenario& scenario, const scene::Scene& start, const planning::Plan& plan,
          uint64_t seed)
      : scenario_(scenario), start_(start), plan_(plan), random_(Random(seed).Split("disturb")) {}

  Disturbances Draw() {
    const int count = 1 + random_.Index(3);
    for (int i = 0; i < count; ++i) {
      switch (random_.Index(5)) {
        case 0:
          Moved();
          break;
        case 1:
          Support();
          break;
        case 2:
          Knocked();
          break;
        case 3:
          Crossing();
          break;
        default:
          Pushed();
      }
    }
    return std::move(drawn_);
  }

 private:
  double Time() { return random_.Uniform(0.3, kPerAction * static_cast<double>(plan_.actions.size())); }

  void Add(const char* kind, scenario::Event event) {
    drawn_.kinds.emplace_back(kind);
    drawn_.events.push_back(std::move(event));
  }

  /// A horizontal displacement of a random length and direction, with the time that it takes.
  scenario::Event Slide(const std::string& object, double least, double most) {
    scenario::Event event;
    event.object = object;
    const double length = random_.Uniform(least, most), angle = random_.Uniform(-M_PI, M_PI);
    event.X_by.p = length * Vector3d(std::cos(angle), std::sin(angle), 0);
    event.over = kPeak * length / kFastest * random_.Uniform(1, 2);
    return event;
  }

  bool CarriesRobot(const scene::Object& object) const {
    const geometry::Aabb box = BoxOf(start_, object);
    return std::any_of(start_.robots.begin(), start_.robots.end(), [&](const scene::Robot& robot) {
      const Vector3d p = start_.InitialPose(robot.name).p;
      return p.x() > box.lower.x() && p.x() < box.upper.x() && p.y() > box.lower.y() && p.y() < box.upper.y();
    });
  }

  /// Whether an object that is moved so is still above something fixed.
  bool StaysOnSomething(const scene::Object& object, const Vector3d& by) const {
    const Vector3d p = start_.InitialPose(object.name).p + by;
    return std::any_of(start_.objects.begin(), start_.objects.end(), [&](const scene::Object& other) {
      if (other.movable()) return false;
      const geometry::Aabb box = BoxOf(start_, other);
      return p.x() > box.lower.x() && p.x() < box.upper.x() && p.y() > box.lower.y() &&
             p.y() < box.upper.y() && box.lower.z() < p.z();
    });
  }

  void Moved() {
    std::vector<const scene::Object*> objects;
    for (const scene::Object& object : start_.objects) {
      if (object.movable()) objects.push_back(&object);
    }
    if (objects.empty()) return;
    const scene::Object& object = *objects[random_.Index(static_cast<int>(objects.size()))];
    for (int i = 0; i < kDraws; ++i) {
      scenario::Event event = Slide(object.name, kNearest, kFurthest);
      if (!StaysOnSomething(object, event.X_by.p)) continue;
      event.time = Time();
      return Add("moved", std::move(event));
    }
  }

  void Support() {
    std::vector<std::string> names;
    for (const scene::Object& object : start_.objects) {
      bool target = !object.movable();
      for (const planning::PlanStep& step : plan_.steps) {
        target = target || (step.mode == planning::StepMode::kPlace && step.target == object.name);
      }
      if (target && !CarriesRobot(object)) names.push_back(object.name);
    }
    if (names.empty()) return Moved();
    const std::string& name = names[random_.Index(static_cast<int>(names.size()))];
    scenario::Event event = Slide(name, kNearest, kFurthest);
    event.time = Time();
    Add("support", std::move(event));
  }

  void Knocked() {
    std::vector<size_t> puts;
    for (size_t i = 0; i < plan_.steps.size(); ++i) {
      const planning::PlanStep& step = plan_.steps[i];
      const bool last = step.action_index + 1 >= static_cast<int>(plan_.actions.size());
      if (step.mode == planning::StepMode::kPlace && !last && start_.FindObject(step.control) != nullptr)
        puts.push_back(i);
    }
    if (puts.empty()) return Moved();
    const planning::PlanStep& step = plan_.steps[puts[random_.Index(static_cast<int>(puts.size()))]];
    const auto after = static_cast<size_t>(step.action_index) + 1;
    const size_t left = plan_.actions.size() - after;
    scenario::Event event = Slide(step.control, 0.03, 0.07);
    event.over = kPeak * event.X_by.p.norm() / kFastest;
    event.starts = plan_.actions[after + static_cast<size_t>(random_.Index(static_cast<int>(left)))];
    if (random_.Index(4) == 0) {
      std::vector<std::string> others;
      for (const scene::Object& object : start_.objects) {
        if (object.movable() && object.name != step.control) others.push_back(object.name);
      }
      if (!others.empty()) {
        event.has_goal = true;
        event.parent = others[random_.Index(static_cast<int>(others.size()))];
        event.X_ParentGoal.p = {random_.Uniform(-0.02, 0.02), random_.Uniform(-0.02, 0.02), 0.06};
        event.over = 2;
      }
    }
    Add("knocked", std::move(event));
  }

  void Crossing() {
    if (drawn_.obstacle) return Pushed();
    drawn_.obstacle = scenario::DrawCrossingObstacle(scenario_, start_,
                                                     static_cast<int>(plan_.actions.size()), random_.Next());
    if (!drawn_.obstacle) return Pushed();
    Add("crossing", drawn_.obstacle->event);
  }

  void Pushed() {
    const scene::Robot* robot = scenario::ActingRobot(start_);
    if (robot == nullptr) return;
    scenario::Event event;
    event.robot = robot->name;
    event.over = kPushFor;
    event.time = Time();
    const auto joints = static_cast<Eigen::Index>(robot->q.size());
    event.torques.setZero(joints);
    const bool strong = random_.Index(2) == 0;
    for (Eigen::Index i = 0; i < joints; ++i) {
      if ((i < kStrongJoints) != strong) continue;
      event.torques[i] = strong ? random_.Uniform(-kPush, kPush) : random_.Uniform(-kWristPush, kWristPush);
    }
    Add("pushed", std::move(event));
  }

  const scenario::Scenario& scenario_;
  const scene::Scene& start_;
  const planning::Plan& plan_;
  Random random_;
  Disturbances drawn_;
};

}  // namespace

Disturbances DrawDisturbances(const scenario::Scenario& scenario, const scene::Scene& start,
                              const planning::Plan& plan, uint64_t seed) {
  return Drawing(scenario, start, plan, seed).Draw();
}

}  // namespace tether::bench
