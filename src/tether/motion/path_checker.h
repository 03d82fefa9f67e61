#pragma once

#include <cstdint>
#include <memory>

#include <Eigen/Core>

#include "tether/motion/collision_scene.h"
#include "tether/motion/line_checker.h"

namespace tether::motion {

/// Which code looks at bounding spheres. The answers are the same.
enum class Lanes {
  kBest,   ///< Eight configurations at once where the processor has AVX2.
  kPlain,  ///< One after the other.
};

/// Answers whether configurations, and straight lines between them, are free in a scene. The mutable part,
/// one per thread; an answer never depends on what was asked before. Polls the limits of its thread.
///
/// A line that is called free is free everywhere, not only at samples: it is cut into intervals, and at the
/// middle of each the distances have to exceed what any point can move to the interval's ends (bounded by the
/// joints' angles times the lengths between their axes). Bounding spheres that are grown by this decide most
/// intervals, several at once; where they do not, the exact distances of the pairs concerned decide, and
/// intervals are halved where these are too near. A line that comes closer than kResolution to something (or
/// to the scene's clearance) counts as blocked.
class PathChecker final : public LineChecker {
 public:
  static constexpr double kResolution = 1e-5;  ///< m

  explicit PathChecker(std::shared_ptr<const CollisionScene> scene, Lanes lanes = Lanes::kBest);
  ~PathChecker() override;
  PathChecker(const PathChecker&) = delete;
  PathChecker& operator=(const PathChecker&) = delete;

  /// Of a configuration, n, rad. Joint limits are not looked at.
  bool IsFree(const Eigen::VectorXd& q) override;
  /// Of the straight line between two.
  bool IsFree(const Eigen::VectorXd& a, const Eigen::VectorXd& b) override;

  const CollisionScene& scene() const;
  /// Configurations that were looked at so far: by spheres, and by exact distances.
  int64_t checks() const override;
  int64_t exact_checks() const override;
  /// "link7 is 3.1 mm from post"
  std::string Why(const Eigen::VectorXd& q) const override;

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace tether::motion
