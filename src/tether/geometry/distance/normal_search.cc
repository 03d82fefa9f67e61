#include "tether/geometry/distance/normal_search.h"

#include <algorithm>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>

namespace tether::geometry::internal {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

/// The cosine and sine of evenly spaced angles.
struct CircleTable {
  static constexpr int kSize = 8;
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
/// The most splits of a search, some hundred times what solids of a robot's world need: beyond, the solids
/// are so large that a double can't resolve kGain, and the best so far is the result.
constexpr int kMostSplits = 1 << 17;

/// The separation is the least of g · n over the differences g of points of B and A. So at every n it is at
/// most g · n of any one of them: with supports at sampled normals this bounds it between the samples, and a
/// branch-and-bound finds its greatest value for certain.
class CircleSearch {
 public:
  CircleSearch(const Query& query, const Vector3d& axis, BestNormal* best)
      : CircleSearch(query, UpAcross(axis, query.up_A), axis, best) {}
  /// Angles are measured from `start` about `axis`, unit and at right angles.
  CircleSearch(const Query& query, const Vector3d& start, const Vector3d& axis, BestNormal* best)
      : query_(query),
        best_(best),
        u_(start),
        v_(axis.cross(start)),
        discs_{Disc(query.a, Vector3d::UnitZ(), axis), Disc(query.b, query.X_AB.R.col(2), axis)} {}

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

  /// A disc as seen along the circle.
  struct OnCircle {
    double share;  // its radius times the squared cosine between its axis and the circle's
    double u, v;   // its axis across the circle's
    double across;
  };
  OnCircle Disc(const Core& core, const Vector3d& core_axis, const Vector3d& axis) const {
    const double cosine = core_axis.dot(axis);
    const double u = u_.dot(core_axis), v = v_.dot(core_axis);
    return {std::max(core.disc, 0.0) * cosine * cosine, u, v, std::hypot(u, v)};
  }

  /// Between kinks the separation f along the circle has f'' = −f − c, where c ≥ 0 is the curvature that
  /// discs have there. So at a peak c ≥ −f. False if that rules out a peak on the arc, given a bound of f;
  /// kinks are for the caller to try.
  bool MayPeak(const Sample& a, const Sample& b, double bound) const {
    double curvature = 0;
    for (const OnCircle& disc : discs_) {
      if (disc.share == 0) continue;
      const auto tilt = [&](const Vector3d& n) { return std::abs(u_.dot(n) * disc.u + v_.dot(n) * disc.v); };
      const double most =
          std::min(disc.across, std::max(tilt(a.n), tilt(b.n)) + 0.5 * (b.angle - a.angle) * disc.across);
      const double sine2 = 1 - most * most;
      if (!(sine2 > 1e-12)) return true;
      curvature += disc.share / (sine2 * std::sqrt(sine2));
    }
    return curvature >= -bound - kTie;
  }

  bool MayGain(const Sample& a, const Sample& b, double gain) const {
    const double bound = Bound(a, b);
    return bound > best_->separation() + gain && MayPeak(a, b, bound);
  }

  void Polish(const Sample& a, const Sample& b) {
    if (!(a.slope >= 0 && b.slope <= 0) || !MayGain(a, b, 0)) return;
    const double angle =
        FindRoot([this](double t) { return -Take(t).slope; }, a.angle, -a.slope, b.angle, -b.slope);
    best_->Try(std::cos(angle) * u_ + std::sin(angle) * v_, 1);
  }

  void Split(const Sample& a, const Sample& b, int depth) {
    if (depth > 24 || ++splits_ > kMostSplits || !MayGain(a, b, kGain)) return;
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
  int splits_ = 0;
  Vector3d u_, v_;
  std::array<OnCircle, 2> discs_;
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

/// All normals of two cylinders whose rims meet: branch-and-bound over spherical triangles, with the bound
/// that CircleSearch explains. The separation has ridges where the normal is across an axis. The triangles
/// don't straddle them, so that every sample belongs to one rim of either.
class RimSearch {
 public:
  RimSearch(const Query& query, BestNormal* best)
      : query_(query),
        best_(best),
        axis_B_(query.X_AB.R.col(2)),
        crossed_(Vector3d::UnitZ().cross(axis_B_)) {}

  void Run() {
    const Vector3d z = Vector3d::UnitZ();
    const double sine = crossed_.norm();
    const Vector3d w = sine > 10 * kParallel ? Vector3d(crossed_ / sine) : Vector3d::UnitX();
    const Vector3d y = w.cross(z);
    const double turn = std::atan2(axis_B_.dot(y), axis_B_.z());
    // Ridges run between w and −w. Lunes between them that are wide are cut in two.
    std::array<double, 9> ridges{-0.5 * pi, 0.5 * pi, turn - 0.5 * pi, turn + 0.5 * pi};
    int count = 4;
    for (int i = 0; i < count; ++i) ridges[i] = std::remainder(ridges[i], 2 * pi);
    std::sort(ridges.begin(), ridges.begin() + count);
    for (int i = 0, end = count; i < end; ++i) {
      const double next = i + 1 < end ? ridges[i + 1] : ridges[0] + 2 * pi;
      if (next - ridges[i] > 0.55 * pi) ridges[count++] = 0.5 * (ridges[i] + next);
    }
    std::sort(ridges.begin(), ridges.begin() + count);
    ridges[count] = ridges[0] + 2 * pi;
    const auto direction = [&](double angle) { return Vector3d(std::cos(angle) * z + std::sin(angle) * y); };
    for (int i = 0; i < count; ++i) {
      if (ridges[i + 1] - ridges[i] < 1e-9) continue;
      const Vector3d middle = direction(0.5 * (ridges[i] + ridges[i + 1]));
      end_A_ = (middle.z() >= 0 ? query_.a.half.z() : -query_.a.half.z()) * z;
      end_B_ = query_.X_AB.p - (middle.dot(axis_B_) >= 0 ? query_.b.half.z() : -query_.b.half.z()) * axis_B_;
      const Sample from = Take(direction(ridges[i])), to = Take(direction(ridges[i + 1]));
      Split(Take(w), from, to, 0);
      Split(Take(-w), from, to, 0);
    }
  }

 private:
  struct Sample {
    Vector3d n, g;
    double value = 0;
  };

  /// The support difference of the rims at hand.
  Sample Take(const Vector3d& n) const {
    const auto on_rim = [&](double radius, const Vector3d& axis) {
      const Vector3d across = n - n.dot(axis) * axis;
      const double length = across.norm();
      return length > 1e-12 ? Vector3d(radius / length * across) : Vector3d::Zero();
    };
    const Vector3d g =
        end_B_ - end_A_ - on_rim(query_.a.disc, Vector3d::UnitZ()) - on_rim(query_.b.disc, axis_B_);
    return {n, g, g.dot(n)};
  }

  /// The separation is at most g · n for any mean g of the samples'. That is linear, so over the flat
  /// triangle it is greatest at a corner; the sphere lies outside of it.
  static double Bound(const Sample& a, const Sample& b, const Sample& c) {
    Eigen::Matrix3d g, n;
    g << a.g, b.g, c.g;
    n << a.n, b.n, c.n;
    const Eigen::Matrix3d at = g.transpose() * n;  // of each g at each corner
    double bound = at.colwise().sum().maxCoeff() / 3;
    for (int i = 0; i < 3; ++i) {
      bound = std::min(bound, at.row(i).maxCoeff());
      bound = std::min(bound, 0.5 * (at.row(i) + at.row((i + 1) % 3)).maxCoeff());
    }
    return bound > 0 ? bound / std::max(0.3, n.rowwise().sum().norm() / 3) : bound;
  }

  void Split(const Sample& a, const Sample& b, const Sample& c, int depth) {
    const double bound = Bound(a, b, c);
    if (depth > 14 || ++splits_ > kMostSplits || !(bound > best_->separation() + kGain)) return;
    if (bound < 0 && !MayPeak(a, b, c, bound)) return;
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

  /// Between kinks, two rims have curvatures c_A = r_A / |n × z_A| along t_A = z_A × n / |z_A × n|, and
  /// likewise B. At a peak of the separation f the least curvature of both together is at least −f. False if
  /// that rules out a peak within the triangle, given a bound of f: the curvatures are bounded over a cap
  /// around it.
  bool MayPeak(const Sample& a, const Sample& b, const Sample& c, double bound) const {
    const Vector3d middle = (a.n + b.n + c.n).normalized();
    const double cosine = std::min({middle.dot(a.n), middle.dot(b.n), middle.dot(c.n)});
    const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
    const auto range = [&](double along) {  // of |n × axis| over the cap
      along = std::abs(along);
      const double across = std::sqrt(std::max(0.0, 1 - along * along));
      return std::pair(std::max(0.0, across * cosine - along * sine),
                       along * cosine <= across * sine ? 1.0 : across * cosine + along * sine);
    };
    const auto [a_low, a_high] = range(middle.z());
    const auto [b_low, b_high] = range(middle.dot(axis_B_));
    const double r_a = query_.a.disc, r_b = query_.b.disc;
    // No more than either, and no more than twice the determinant over the trace.
    if (r_a < -bound * a_low || r_b < -bound * b_low) return false;
    const double tilt = std::abs(middle.dot(crossed_)) + std::sqrt(2 - 2 * cosine) * crossed_.norm();
    const double trace = r_a / a_high + r_b / b_high;
    const double cube = a_low * b_low;
    return 2 * r_a * r_b * tilt * tilt >= (-bound - kTie) * trace * cube * cube * cube;
  }

  const Query& query_;
  BestNormal* best_;
  int splits_ = 0;
  Vector3d axis_B_, crossed_;
  Vector3d end_A_ = Vector3d::Zero(), end_B_ = Vector3d::Zero();  // the middles of the rims at hand
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

void TryRims(const Query& query, BestNormal* best) { RimSearch(query, best).Run(); }

}  // namespace tether::geometry::internal
