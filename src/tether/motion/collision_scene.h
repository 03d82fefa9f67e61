#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "tether/geometry/shape.h"
#include "tether/math/pose.h"
#include "tether/robot/model.h"

namespace tether::motion {

namespace internal {
struct KernelTables;
}

/// A solid that stands still while the arm moves.
struct Obstacle {
  std::string name;
  geometry::Shape shape;
  math::Pose X_BO;  ///< In the arm's base frame.
};

/// A solid that moves with the hand.
struct HeldSolid {
  std::string name;
  geometry::Shape shape;
  math::Pose X_HO;  ///< In the hand's frame.
};

/// Everything that a path has to be clear of, as it is at one moment.
struct Snapshot {
  std::shared_ptr<const robot::Model> model;
  double opening = 0;  ///< Between the fingers, m; may be beyond what the gripper reaches.
  std::vector<Obstacle> obstacles;
  std::vector<HeldSolid> held;
  double clearance = 0;  ///< The arm keeps further away than this, from everything and itself, m.
};

/// Two solids that are nearer to each other than they should be.
struct Touch {
  std::string a, b;     ///< `a` is a link, "hand" or what is held.
  double distance = 0;  ///< m; negative: they overlap.
  std::string Text() const;
};

/// A snapshot made ready for many checks: the arm's convex parts and the obstacles, each in single precision
/// with bounding spheres too, and the pairs of them that can touch at all. Immutable; shared between threads.
/// The base is not checked against obstacles: no motion changes that. What is held is checked against
/// obstacles, and against the links that the hand is checked against.
class CollisionScene {
 public:
  static std::shared_ptr<const CollisionScene> Compile(const Snapshot& snapshot);
  ~CollisionScene();
  CollisionScene(const CollisionScene&) = delete;
  CollisionScene& operator=(const CollisionScene&) = delete;

  /// A convex part of the arm, the hand or what is held.
  struct ArmPart {
    int body = 0;  ///< Into body_names().
    int link = 0;  ///< 0 … n
    geometry::Primitive primitive;
    math::Pose X_LP;
    double radius = 0;           ///< Of a ball about its frame's origin that holds it, m.
    std::vector<int> obstacles;  ///< Parts of obstacles that are within its reach.
    /// By joint: no point of the part is ever further than this from the joint's axis, m; 0 beyond its link.
    std::vector<double> reach;
  };
  struct ObstaclePart {
    int obstacle = 0;  ///< Into obstacle_names().
    geometry::Primitive primitive;
    math::Pose X_BP;
  };
  /// Two parts of which the second is the nearer to the hand.
  struct PartPair {
    int a = 0, b = 0;
  };

  const robot::Model& model() const { return *model_; }
  double clearance() const { return clearance_; }
  const std::vector<ArmPart>& arm() const { return arm_; }
  const std::vector<ObstaclePart>& obstacles() const { return obstacles_; }
  const std::vector<PartPair>& pairs() const { return pairs_; }
  const std::string& body_name(int body) const { return body_names_[static_cast<size_t>(body)]; }
  const std::string& obstacle_name(int obstacle) const {
    return obstacle_names_[static_cast<size_t>(obstacle)];
  }
  const internal::KernelTables& tables() const { return *tables_; }

  /// The worst touch of a configuration (n, rad) by exact distances alone; none: it is free.
  std::optional<Touch> FindTouch(const Eigen::VectorXd& q) const;

 private:
  explicit CollisionScene(const Snapshot& snapshot);
  void AddArm(const Snapshot& snapshot);
  void AddPart(int body, int link, const geometry::Part& part);
  void AddObstacles(const Snapshot& snapshot);
  void AddPairs();

  std::shared_ptr<const robot::Model> model_;
  double clearance_ = 0;
  std::vector<std::string> body_names_, obstacle_names_;
  int num_links_ = 0;  ///< Bodies before the hand.
  std::vector<ArmPart> arm_;
  std::vector<ObstaclePart> obstacles_;
  std::vector<PartPair> pairs_;
  std::unique_ptr<internal::KernelTables> tables_;
};

}  // namespace tether::motion
