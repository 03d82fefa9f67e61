#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "tether/control/arm_bodies.h"

namespace tether::control {

/// Bounds below the distances of bodies and of their parts, which stay valid while the bodies move, and above
/// the speeds with which they close in: what was far off, or is not approached, is not looked at again before
/// it may matter. What a bound excludes is excluded by the distance itself, so that nothing depends on
/// whether there is one. Allocates nothing after Resize().
class PairBounds {
 public:
  /// Room for so many pairs of bodies and pairs of their parts, none of which is known of.
  void Resize(const ArmBodies& bodies, size_t pairs, size_t part_pairs) {
    of_pair_.assign(pairs, -kFar);
    of_parts_.assign(part_pairs, {});
    bodies_.assign(static_cast<size_t>(bodies.num_bodies()), {});
  }
  bool empty() const { return bodies_.empty(); }

  /// One tick: the bodies are where they are now.
  void Follow(const ArmBodies& bodies) {
    for (size_t i = 0; i < bodies_.size(); ++i) {
      const int number = static_cast<int>(i);
      Body& body = bodies_[i];
      const math::Pose& X = bodies.pose(number).X;
      if (body.parts != bodies.begin(number)) {
        // Other parts, as the hand's when its opening changes.
        body.parts = bodies.begin(number);
        body.radius = 0;
        for (const ArmBodies::Part* part = bodies.begin(number); part != bodies.end(number); ++part)
          body.radius = std::max(body.radius, part->X_FP.p.norm() + part->radius);
        body.travel += kOtherParts;
      }
      body.travel += (X.p - body.X.p).norm() + body.radius * (X.R - body.X.R).norm();
      body.X = X;
    }
  }
  /// The velocity of a body's origin and its angular velocity in this tick, m/s and rad/s.
  void Move(int body, const Eigen::Vector3d& v, const Eigen::Vector3d& w) {
    Body& moving = bodies_[static_cast<size_t>(body)];
    moving.v = v;
    moving.w = w;
    moving.fastest = v.norm() + moving.radius * w.norm();
  }
  /// No point of a body moves faster, m/s.
  double Fastest(int body) const { return at(body).fastest; }

  /// How far bodies, or parts of them, are apart at least, m; `pair` and `parts` are their numbers.
  double OfPair(size_t pair, int a, int b) const { return of_pair_[pair] - Travel(a, b); }
  double OfParts(size_t parts, int a, int b) const { return of_parts_[parts].distance - Travel(a, b); }
  /// The parts close in no faster, m/s. Of the nearest points' direction n it is known what it was when the
  /// distance was found. Since then no point has moved further than δ against another, so that what was
  /// beyond a plane at distance d is beyond it less δ, and the nearest point is not further away than d + δ:
  /// cos ∠(n, n_then) ≥ (d − δ) / (d + δ).
  double Closing(size_t parts, int a, int b) const {
    const OfTwoParts& then = of_parts_[parts];
    const Body &body_a = at(a), &body_b = at(b);
    const double most = body_a.fastest + body_b.fastest;
    const double moved = Travel(a, b) - then.travel;
    if (!(then.known && moved < then.distance - then.travel)) return most;
    const double turned = 2 * std::sqrt(moved / (then.distance - then.travel + moved));
    const double along = then.n.dot(body_a.v - body_b.v) + body_a.radius * then.n.cross(body_a.w).norm() +
                         body_b.radius * then.n.cross(body_b.w).norm();
    return std::min(most, along + turned * most) + kRounding;
  }

  /// Two bodies, or parts, are at least so far apart now, m.
  void NotePair(size_t pair, int a, int b, double distance) { of_pair_[pair] = distance + Travel(a, b); }
  void NoteParts(size_t parts, int a, int b, double distance) {
    of_parts_[parts].distance = distance + Travel(a, b);
    of_parts_[parts].known = false;
  }
  /// They are just so far apart, along n, a unit vector from a to b.
  void NoteParts(size_t parts, int a, int b, double distance, const Eigen::Vector3d& n) {
    const double travel = Travel(a, b);
    of_parts_[parts] = {distance + travel, travel, n, distance > 0};
  }

 private:
  // More than a hand's parts differ by, and than what anything is apart, m.
  static constexpr double kOtherParts = 10, kFar = 1e6;
  // What rounding makes of a distance, m, or a speed, m/s.
  static constexpr double kRounding = 1e-9;

  struct Body {
    math::Pose X;
    double radius = 0;  ///< Of a ball about its origin that holds it, m.
    double travel = 0;  ///< No point of it has moved further so far, m.
    const ArmBodies::Part* parts = nullptr;
    Eigen::Vector3d v = Eigen::Vector3d::Zero(), w = Eigen::Vector3d::Zero();
    double fastest = 0;
  };
  struct OfTwoParts {
    double distance = -kFar;  ///< With the travel until then.
    double travel = 0;        ///< Until then.
    Eigen::Vector3d n = Eigen::Vector3d::Zero();
    bool known = false;  ///< The distance is exact, and n known.
  };
  const Body& at(int body) const { return bodies_[static_cast<size_t>(body)]; }
  double Travel(int a, int b) const { return at(a).travel + at(b).travel + kRounding; }

  std::vector<double> of_pair_;
  std::vector<OfTwoParts> of_parts_;
  std::vector<Body> bodies_;
};

}  // namespace tether::control
