#include "tether/geometry/normal_search.h"

#include <algorithm>
#include <numbers>

#include <Eigen/Geometry>

namespace tether::geometry::internal {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

/// The cosine and sine of evenly spaced angles.
struct CircleTable {
  static constexpr int kSize = 32;
  std::array<double, kSize> cosine, sine;
  CircleTable() {
    for (int i = 0; i < kSize; ++i) {
      cosine[i] = std::cos(2 * pi * i / kSize);
      sine[i] = std::sin(2 * pi * i / kSize);
    }
  }
};
const CircleTable kCircle;

/// A better normal than the best so far is sought only where one might gain more than this, m.
constexpr double kGain = 4e-6;

/// The separation is the least of g · n over the differences g of points of B and A. So at every n it is at
/// most g · n of any one of them: with supports at sampled normals this bounds it between the samples, and a
/// branch-and-bound finds its greatest value for certain.
class CircleSearch {
 public:
  CircleSearch(const Query& query, const Vector3d& axis, BestNormal* best)
      : CircleSearch(query, UpAcross(axis, query.up_A), axis, best) {}
  /// Angles are measured from `start` about `axis`, unit and at right angles.
  CircleSearch(const Query& query, const Vector3d& start, const Vector3d& axis, BestNormal* best)
      : query_(query), best_(best), u_(start), v_(axis.cross(start)) {}

  void Run() {
    constexpr int kSize = CircleTable::kSize;
    std::array<Sample, kSize + 1> samples;
    for (int i = 0; i < kSize; ++i) samples[i] = Take(2 * pi * i / kSize, kCircle.cosine[i], kCircle.sine[i]);
    samples[kSize] = samples[0];
    samples[kSize].angle = 2 * pi;
    best_->Try(u_, 1);
    for (int i = 0; i < kSize; ++i) Polish(samples[i], samples[i + 1]);
    for (int i = 0; i < kSize; ++i) Split(samples[i], samples[i + 1], 0);
  }

  void RunTo(double turn) {
    const int pieces = 1 + static_cast<int>(turn / (2 * pi / CircleTable::kSize));
    Sample before = Take(0, 1, 0);
    for (int i = 1; i <= pieces; ++i) {
      const Sample after = Take(turn * i / pieces);
      Polish(before, after);
      Split(before, after, 0);
      before = after;
    }
  }

 private:
  struct Sample {
    double angle = 0;
    Vector3d n, g;
    double value = 0, slope = 0;
  };

  Sample Take(double angle, double cosine, double sine) const {
    Sample sample;
    sample.angle = angle;
    sample.n = cosine * u_ + sine * v_;
    sample.g = SupportDifference(query_, sample.n);
    sample.value = sample.g.dot(sample.n);
    sample.slope = sample.g.dot(cosine * v_ - sine * u_);
    return sample;
  }
  Sample Take(double angle) const { return Take(angle, std::cos(angle), std::sin(angle)); }

  static double Bound(const Sample& a, const Sample& b) {
    return BoundOnArc(a.n, a.g, b.n, b.g, b.angle - a.angle);
  }

  void Polish(const Sample& a, const Sample& b) {
    if (!(a.slope >= 0 && b.slope <= 0) || Bound(a, b) <= best_->separation()) return;
    const double angle =
        FindRoot([this](double t) { return -Take(t).slope; }, a.angle, -a.slope, b.angle, -b.slope);
    best_->Try(std::cos(angle) * u_ + std::sin(angle) * v_, 1);
  }

  void Split(const Sample& a, const Sample& b, int depth) {
    if (depth > 24 || Bound(a, b) <= best_->separation() + kGain) return;
    const Sample middle = Take(0.5 * (a.angle + b.angle));
    if (middle.value > best_->separation()) {
      Polish(a, middle);
      Polish(middle, b);
      // On a slope that rises to the far end of the arc there is nothing to polish yet.
      if (middle.value > best_->separation()) best_->Try(middle.n, 1);
    }
    // The better half first: what it finds rules out more of the other.
    if (a.value > b.value) {
      Split(a, middle, depth + 1);
      Split(middle, b, depth + 1);
    } else {
      Split(middle, b, depth + 1);
      Split(a, middle, depth + 1);
    }
  }

  const Query& query_;
  BestNormal* best_;
  Vector3d u_, v_;
};

/// The derivative of a support function's gradient, R (I − …) R^T for the disc of a core: zero for its box
/// part.
Eigen::Matrix3d DiscCurvature(const Core& core, const Eigen::Matrix3d& R, const Vector3d& n) {
  const Vector3d axis = R.col(2);
  const Vector3d across = n - n.dot(axis) * axis;
  const double length = across.norm();
  if (length < 1e-9) return Eigen::Matrix3d::Zero();
  const Vector3d tangent = axis.cross(across / length);
  return core.disc / length * tangent * tangent.transpose();
}

/// Climbs the separation over the unit sphere from n: Newton's method, with the plain gradient where it
/// fails.
Vector3d Climb(const Query& query, Vector3d n) {
  double value = query.Separation(n);
  for (int i = 0; i < 40; ++i) {
    const Vector3d u = n.unitOrthogonal();
    const Vector3d v = n.cross(u);
    const Vector3d g = SupportDifference(query, n);
    const Eigen::Vector2d slope(u.dot(g), v.dot(g));
    if (slope.norm() < 1e-13) break;
    const Eigen::Matrix3d curvature =
        DiscCurvature(query.a, Eigen::Matrix3d::Identity(), n) + DiscCurvature(query.b, query.X_AB.R, n);
    // On the sphere the Hessian of −separation is that of the supports plus (n·g) I.
    Eigen::Matrix2d hessian;
    hessian << u.dot(curvature * u), u.dot(curvature * v), v.dot(curvature * u), v.dot(curvature * v);
    hessian += n.dot(g) * Eigen::Matrix2d::Identity();
    const double determinant = hessian.determinant();
    Eigen::Vector2d step = slope / (std::abs(n.dot(g)) + hessian.norm() + 1e-9);
    if (determinant > 0 && hessian.trace() > 0) {
      step = Eigen::Vector2d(hessian(1, 1) * slope.x() - hessian(0, 1) * slope.y(),
                             hessian(0, 0) * slope.y() - hessian(1, 0) * slope.x()) /
             determinant;
      const double length = step.norm();
      if (length > 0.3) step *= 0.3 / length;
    }
    bool gained = false;
    for (int halving = 0; halving < 12 && !gained; ++halving, step *= 0.3) {
      const Vector3d trial = (n + step.x() * u + step.y() * v).normalized();
      const double there = query.Separation(trial);
      if (there > value) {
        gained = true;
        n = trial;
        value = there;
      }
    }
    if (!gained) break;
  }
  return n;
}

/// Branch-and-bound over spherical triangles, with the bound that CircleSearch explains.
class SphereSearch {
 public:
  SphereSearch(const Query& query, BestNormal* best) : query_(query), best_(best) {}

  void Run() {
    std::array<Sample, 6> corner;
    for (int i = 0; i < 6; ++i) corner[i] = Take((i % 2 == 0 ? 1.0 : -1.0) * Vector3d::Unit(i / 2));
    for (int octant = 0; octant < 8; ++octant) {
      Split(corner[octant & 1], corner[2 + ((octant >> 1) & 1)], corner[4 + (octant >> 2)], 0);
    }
  }

 private:
  struct Sample {
    Vector3d n, g;
    double value = 0;
  };

  Sample Take(const Vector3d& n) const {
    const Vector3d g = SupportDifference(query_, n);
    return {n, g, g.dot(n)};
  }

  void Split(const Sample& a, const Sample& b, const Sample& c, int depth) {
    // The mean g is linear, so over the flat triangle it is greatest at a corner; the sphere lies outside of
    // it.
    const Vector3d g = (a.g + b.g + c.g) / 3;
    double bound = std::max({g.dot(a.n), g.dot(b.n), g.dot(c.n)});
    if (bound > 0) bound /= std::max(0.5, (a.n + b.n + c.n).norm() / 3);
    if (depth > 14 || (depth > 0 && bound <= best_->separation() + kGain)) return;
    const double value = std::max({a.value, b.value, c.value});
    if (value > best_->separation() + kTie) {
      const Sample& top = a.value == value ? a : b.value == value ? b : c;
      best_->Try(Climb(query_, top.n), 2);
    }
    const Sample ab = Take((a.n + b.n).normalized());
    const Sample bc = Take((b.n + c.n).normalized());
    const Sample ca = Take((c.n + a.n).normalized());
    Split(ab, bc, ca, depth + 1);
    Split(a, ab, ca, depth + 1);
    Split(ab, b, bc, depth + 1);
    Split(ca, bc, c, depth + 1);
  }

  const Query& query_;
  BestNormal* best_;
};

}  // namespace

double BoundOnArc(const Vector3d& n_a, const Vector3d& g_a, const Vector3d& n_b, const Vector3d& g_b,
                  double turn) {
  const double a = g_a.dot(n_a);
  const double b = g_b.dot(n_b);
  const double a_at_b = g_a.dot(n_b);
  const double b_at_a = g_b.dot(n_a);
  const double greatest = std::max({0.0, a, b, a_at_b, b_at_a});
  const double slack = greatest > 0 ? greatest * turn * turn / (8 * std::cos(0.5 * turn)) : 0.0;
  const double drop_a = b_at_a - a;  // ≥ 0: b's chord starts above a's
  const double drop_b = a_at_b - b;  // ≥ 0: and ends below
  const double sum = drop_a + drop_b;
  const double t = sum > 0 ? std::clamp(drop_a / sum, 0.0, 1.0) : 0.0;
  return std::max({a, b, a + t * (a_at_b - a)}) + slack;
}

void TryCircle(const Query& query, const Vector3d& axis, BestNormal* best) {
  CircleSearch(query, axis, best).Run();
}

void TryArc(const Query& query, const Vector3d& from, const Vector3d& to, BestNormal* best) {
  const Vector3d axis = from.cross(to);
  const double sine = axis.norm();
  if (!(sine > 10 * kParallel)) return;
  CircleSearch(query, from, axis / sine, best).RunTo(std::atan2(sine, from.dot(to)));
}

void TrySphere(const Query& query, BestNormal* best) { SphereSearch(query, best).Run(); }

}  // namespace tether::geometry::internal
