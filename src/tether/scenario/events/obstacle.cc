#include "tether/scenario/events/obstacle.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tether/common/random.h"
#include "tether/control/arm_bodies.h"
#include "tether/execution/sequencer/constraint_builder.h"
#include "tether/geometry/distance/distance.h"
#include "tether/geometry/distance/query.h"
#include "tether/geometry/polygon/support.h"
#include "tether/scenario/problem.h"

namespace tether::scenario {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using math::Pose;

constexpr int kDraws = 5000;
constexpr double kSide = 0.05, kLowest = 0.05, kHighest = 0.25;
constexpr double kFromHub = 0.2, kFromAxis = 0.2, kGap = 0.03, kNear = 0.3;
constexpr double kLeastSlide = 0.1, kSlide = 0.1, kCrossing = 0.2;
// Spacing of the samples along the obstacle's path, m.
constexpr double kSample = 0.01;
// A ball comes from this far, and goes as far, m.
constexpr double kHalfLength = 0.9;
constexpr double kFirstStart = 5.0;
// What carries an object is no further below its origin than this, and takes up a place of this radius, m.
constexpr double kBelow = 0.3, kPlaceRadius = 0.05;

std::string FreeName(const scene::Scene& scene) {
  std::string name = "obstacle";
  for (int i = 2; scene.FindObject(name) != nullptr || scene.FindRegion(name) != nullptr ||
                  scene.FindRobot(name) != nullptr;
       ++i)
    name = "obstacle_" + std::to_string(i);
  return name;
}

/// How far a region reaches from its centre across its normal, m.
double RadiusOf(const scene::RegionForm& form) {
  if (const auto* disc = std::get_if<scene::Disc>(&form)) return disc->radius;
  if (const auto* rectangle = std::get_if<scene::Rectangle>(&form)) return 0.5 * rectangle->size.norm();
  const auto& solid = std::get<geometry::Primitive>(form);
  return std::max(geometry::Support(solid, Vector3d::UnitX()), geometry::Support(solid, Vector3d::UnitY()));
}

/// Where regions, hubs and the arm are at the start.
class Layout {
 public:
  Layout(const Scenario& scenario, const scene::Scene& scene) : scene_(scene) {
    const scene::Robot* robot = ActingRobot(scene);
    if (robot == nullptr) return;
    model_ = scenario.models.at(robot->name);
    X_WBase_ = scene.InitialPose(robot->name);
    const geometry::Shape hand = model_->HandShape(model_->gripper().max_opening);
    hand_radius_ =
        std::max({geometry::Support(hand, Vector3d::UnitX()), geometry::Support(hand, Vector3d::UnitY()),
                  geometry::Support(hand, -Vector3d::UnitY())});
    const execution::ControlScene control(scene, robot->name);
    for (const scene::Region& region : scene.regions) {
      const Vector3d p = scene.InitialPose(region.name).p;
      if (region.hub) {
        hubs_.push_back(p);
        continue;
      }
      places_.push_back({p, RadiusOf(region.form)});
      if (const std::string name = control.SupportOf(region.name); !name.empty() && support_ == nullptr)
        support_ = scene.FindObject(name);
    }
    for (const scene::Object& object : scene.objects) poses_.push_back(scene.InitialPose(object.name));
    if (support_ == nullptr) FindPlacesOfObjects();
    PlaceArm(*robot);
  }

  bool usable() const { return model_ != nullptr && support_ != nullptr && !places_.empty(); }
  const robot::Model& model() const { return *model_; }
  const Pose& X_WBase() const { return X_WBase_; }
  const std::vector<Vector3d>& hubs() const { return hubs_; }
  size_t num_places() const { return places_.size(); }
  const Vector3d& place(size_t index) const { return places_[index].p; }

  /// The support's top, and a place on it.
  double top() const {
    const Pose X = scene_.InitialPose(support_->name);
    return X.p.z() + geometry::Support(support_->shape, X.R.transpose() * Vector3d::UnitZ());
  }
  Vector2d DrawOnSupport(Random& random) const {
    const Pose X = scene_.InitialPose(support_->name);
    Vector2d p;
    for (int i = 0; i < 2; ++i) {
      const Vector3d d = X.R.transpose() * Vector3d::Unit(i);
      p[i] = random.Uniform(X.p[i] - geometry::Support(support_->shape, -d) + kSide,
                            X.p[i] + geometry::Support(support_->shape, d) - kSide);
    }
    return p;
  }
  double HighestMovable() const {
    double height = top();
    for (size_t i = 0; i < poses_.size(); ++i) {
      if (!scene_.objects[i].movable()) continue;
      const Vector3d up = poses_[i].R.transpose() * Vector3d::UnitZ();
      height = std::max(height, poses_[i].p.z() + geometry::Support(scene_.objects[i].shape, up));
    }
    return height;
  }
  double FromAxis(const Vector3d& p_W) const { return (X_WBase_.Inverse() * p_W).head<2>().norm(); }

  /// Whether the task stays possible with the post standing there; see the header.
  bool StaysPossible(const geometry::Primitive& post, const Pose& X) const {
    const double half = kSide / std::numbers::sqrt2;
    if (FromAxis(X.p) < kFromAxis + half) return false;
    for (const Place& place : places_) {
      const double room = 0.5 * place.radius + hand_radius_ + 0.02 + half;
      if ((X.p - place.p).head<2>().norm() < std::max(room, place.radius + half + 0.02)) return false;
    }
    for (const Vector3d& hub : hubs_) {
      if (geometry::DistanceToPoint(post, X, hub).distance < kFromHub) return false;
    }
    for (size_t i = 0; i < poses_.size(); ++i) {
      if (&scene_.objects[i] == support_) continue;
      if (geometry::SignedDistance(geometry::Shape(post), X, scene_.objects[i].shape, poses_[i]).distance <
          kGap)
        return false;
    }
    return true;
  }
  bool ClearOfArm(const geometry::Primitive& post, const Pose& X) const {
    return std::all_of(arm_.begin(), arm_.end(), [&](const auto& part) {
      return geometry::SignedDistance(part.first, part.second, post, X).distance > kGap;
    });
  }
  bool IsNear(const Vector3d& p) const {
    return std::any_of(places_.begin(), places_.end(),
                       [&](const Place& place) { return (p - place.p).head<2>().norm() < kNear; });
  }

 private:
  struct Place {
    Vector3d p;
    double radius;
  };

  /// Without regions that something carries: where movable objects stand, on what is beneath the most of
  /// them.
  void FindPlacesOfObjects() {
    places_.clear();
    size_t most = 0;
    for (const scene::Object& candidate : scene_.objects) {
      if (candidate.movable()) continue;
      const Pose X = scene_.InitialPose(candidate.name);
      size_t carried = 0;
      for (size_t i = 0; i < poses_.size(); ++i) {
        if (!scene_.objects[i].movable()) continue;
        const auto below = geometry::CastRay(candidate.shape, X, poses_[i].p, -Vector3d::UnitZ(),
                                             geometry::RayStart::kIgnore, kBelow);
        carried += below.has_value() ? 1 : 0;
      }
      if (carried <= most) continue;
      most = carried;
      support_ = &candidate;
    }
    for (size_t i = 0; i < poses_.size(); ++i) {
      if (scene_.objects[i].movable()) places_.push_back({poses_[i].p, kPlaceRadius});
    }
  }

  void PlaceArm(const scene::Robot& robot) {
    control::ArmBodies bodies(model_, {});
    robot::Kinematics kinematics(model_);
    kinematics.Set(
        Eigen::Map<const Eigen::VectorXd>(robot.q.data(), static_cast<Eigen::Index>(robot.q.size())));
    bodies.PlaceArm(kinematics, model_->gripper().max_opening);
    for (int body = 0; body < bodies.num_bodies(); ++body) {
      for (const auto* part = bodies.begin(body); part != bodies.end(body); ++part)
        arm_.emplace_back(part->primitive, X_WBase_ * part->X_BP);
    }
  }

  const scene::Scene& scene_;
  std::shared_ptr<const robot::Model> model_;
  Pose X_WBase_;
  double hand_radius_ = 0;
  const scene::Object* support_ = nullptr;
  std::vector<Place> places_;
  std::vector<Vector3d> hubs_;
  std::vector<Pose> poses_;  ///< Of the scene's objects.
  std::vector<std::pair<geometry::Primitive, Pose>> arm_;
};

Obstacle MakeObstacle(const scene::Scene& scene, const geometry::Primitive& shape, const Pose& from,
                      const Vector3d& to, double time, double over, bool steady) {
  Obstacle obstacle;
  obstacle.object.name = FreeName(scene);
  obstacle.object.shape = shape;
  obstacle.object.X_ParentObject = from;
  obstacle.event.time = time;
  obstacle.event.object = obstacle.object.name;
  obstacle.event.X_by.p = to - from.p;
  obstacle.event.over = over;
  obstacle.event.steady = steady;
  return obstacle;
}

}  // namespace

std::optional<Obstacle> DrawMovedObstacle(const Scenario& scenario, const scene::Scene& start, int actions,
                                          uint64_t seed) {
  const Layout layout(scenario, start);
  if (!layout.usable()) return std::nullopt;
  Random random = Random(seed).Split("moved obstacle");
  const double height = random.Uniform(kLowest, kHighest);
  const geometry::Primitive post = geometry::Box{{kSide, kSide, height}};
  const auto draw = [&](double yaw) {
    const Vector2d p = layout.DrawOnSupport(random);
    // A little above what it stands on, so that it does not rub.
    return Pose(math::RotationFromRpy({0, 0, yaw}),
                Vector3d(p.x(), p.y(), layout.top() + 0.5 * height + 1e-3));
  };
  const double yaw = random.Uniform(-std::numbers::pi, std::numbers::pi);
  for (int i = 0; i < kDraws; ++i) {
    const Pose from = draw(yaw), to = draw(yaw);
    const double length = (to.p - from.p).norm();
    if (!layout.IsNear(to.p) || length < kLeastSlide || !layout.ClearOfArm(post, from)) continue;
    bool clear = true;
    const int samples = static_cast<int>(std::ceil(length / kSample));
    for (int k = 0; k <= samples && clear; ++k)
      clear = layout.StaysPossible(post, {from.R, from.p + (to.p - from.p) * k / samples});
    if (!clear) continue;
    const bool before = random.Index(4) == 0;
    const double time = before ? 0 : random.Uniform(0, kFirstStart * actions);
    return MakeObstacle(start, post, from, to.p, time, length / kSlide, false);
  }
  return std::nullopt;
}

std::optional<Obstacle> DrawCrossingObstacle(const Scenario& scenario, const scene::Scene& start, int actions,
                                             uint64_t seed) {
  const Layout layout(scenario, start);
  if (!layout.usable()) return std::nullopt;
  Random random = Random(seed).Split("crossing obstacle");
  const double radius = random.Uniform(0.04, 0.06);
  const geometry::Primitive ball = geometry::Sphere{radius};
  const double least = std::max(0.25, 1.1 * kCrossing / layout.model().max_velocity()[0]);
  const double low = layout.HighestMovable() + radius + kGap;
  for (int i = 0; i < kDraws; ++i) {
    const Vector3d& place = layout.place(random.Index(static_cast<int>(layout.num_places())));
    const Vector3d hub = layout.hubs().empty()
                             ? layout.X_WBase() * Vector3d(0.5 * layout.model().reach().max, 0, 0.3)
                             : layout.hubs().front();
    Vector3d p = hub + random.Uniform(0, 0.8) * (place - hub);
    p.z() = random.Uniform(low, low + 0.25);
    const double angle = random.Uniform(-std::numbers::pi, std::numbers::pi);
    const Vector3d along(std::cos(angle), std::sin(angle), 0);
    const Vector3d to_axis = layout.X_WBase().p - p;
    const double from_axis = std::abs(along.x() * to_axis.y() - along.y() * to_axis.x());
    const Pose from(p - kHalfLength * along);
    if (from_axis < least || !layout.ClearOfArm(ball, from)) continue;
    const double time = random.Uniform(0, 0.9 * kFirstStart * actions);
    return MakeObstacle(start, ball, from, p + kHalfLength * along, time, 2 * kHalfLength / kCrossing, true);
  }
  return std::nullopt;
}

void AddObstacle(const Obstacle& obstacle, scene::Scene& scene, Scenario& scenario) {
  scene.objects.push_back(obstacle.object);
  if (&scene != &scenario.scene) scenario.scene.objects.push_back(obstacle.object);
  for (control::ConstraintSpec& spec : scenario.control_constraints) {
    if (spec.kind == "clearance") spec.to.push_back(obstacle.object.name);
  }
}

}  // namespace tether::scenario
