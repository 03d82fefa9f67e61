#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tether/geometry/polygon/polygon.h"
#include "tether/math/infinity.h"

namespace tether::geometry {
namespace {

using Eigen::Vector2d;
using std::numbers::pi;

/// How far a fit may be from one, m.
constexpr double kFit = 1e-9;
/// Half degrees in a turn.
constexpr int kYaws = 720;
constexpr double kYawStep = pi / 360;

double EdgeAngle(const Polygon& polygon, size_t i) {
  const Vector2d d = polygon[(i + 1) % polygon.size()] - polygon[i];
  return std::atan2(d.y(), d.x());
}

/// The least distance between two parallel lines that hold the polygon.
double LeastWidth(const Polygon& polygon) {
  double least = math::kInfinity;
  for (const HalfPlane& edge : EdgeHalfPlanes(polygon)) {
    double nearest = math::kInfinity;
    for (const Vector2d& p : polygon) nearest = std::min(nearest, edge.normal.dot(p));
    least = std::min(least, edge.offset - nearest);
  }
  return polygon.size() < 3 ? 0.0 : least;
}

/// Tries turns of one polygon inside another. A turn is refused early where the outer polygon is too narrow:
/// weights w ≥ 0 of its edges with Σ w n = 0 add their rows n · t ≤ offset − h(n) up to 0 ≤ Σ w offset − Σ w
/// h(n), which no longer contains the translation t (Farkas).
class FitSearch {
 public:
  FitSearch(const Polygon& inner, const Polygon& outer)
      : inner_(inner), outer_(outer), edges_(EdgeHalfPlanes(outer)), heights_(edges_.size()) {
    double reach = 0;
    for (const Vector2d& p : inner) reach = std::max(reach, p.norm());
    for (const Vector2d& p : outer) reach = std::max(reach, p.norm());
    const Vector2d centre = Centroid(inner);
    for (const Vector2d& p : inner) radius_ = std::max(radius_, (p - centre).norm());
    for (int i = 0; i < static_cast<int>(edges_.size()); ++i) AddWidth(i, reach);
  }

  /// Whether no turn at all can fit.
  bool NeverFits() const {
    const double width = LeastWidth(inner_);
    // Σ w h(n) is at least the first weight times the inner polygon's width along the first normal.
    return std::any_of(widths_.begin(), widths_.end(),
                       [&](const Width& w) { return w.weights[0] * width - w.room > w.tolerance; });
  }

  /// A lower bound on how far this turn is from fitting, m: no turn nearer than result / radius() fits.
  double Excess(double yaw) {
    const double c = std::cos(yaw);
    const double s = std::sin(yaw);
    for (size_t i = 0; i < edges_.size(); ++i) {
      const Vector2d& n = edges_[i].normal;
      const Vector2d turned(c * n.x() + s * n.y(), c * n.y() - s * n.x());
      double height = -math::kInfinity;
      for (const Vector2d& p : inner_) height = std::max(height, turned.dot(p));
      heights_[i] = height;
    }
    double excess = -math::kInfinity;
    for (const Width& w : widths_) {
      double demand = 0;
      for (int k = 0; k < 3; ++k) demand += w.weights[k] * heights_[w.edges[k]];
      excess = std::max(excess, demand - w.room - w.tolerance);
    }
    return excess;
  }

  std::optional<Fit> At(double yaw) {
    turned_.clear();
    const double c = std::cos(yaw);
    const double s = std::sin(yaw);
    // The translations that keep every vertex inside every edge, cut out of a square that contains them all.
    double reach = 0;
    for (const Vector2d& p : inner_) turned_.emplace_back(c * p.x() - s * p.y(), s * p.x() + c * p.y());
    for (const Vector2d& p : turned_) reach = std::max(reach, p.norm());
    for (const Vector2d& p : outer_) reach = std::max(reach, p.norm());
    reach *= 3;
    translations_ = {{-reach, -reach}, {reach, -reach}, {reach, reach}, {-reach, reach}};
    for (HalfPlane half_plane : edges_) {
      double farthest = -math::kInfinity;
      for (const Vector2d& p : turned_) farthest = std::max(farthest, half_plane.normal.dot(p));
      half_plane.offset += kFit - farthest;
      CutInto(translations_, half_plane, &cut_);
      translations_.swap(cut_);
      if (translations_.empty()) return std::nullopt;
    }
    return Fit{yaw, Centroid(translations_)};
  }

  /// No vertex of the inner polygon is farther from its centre, m.
  double radius() const { return radius_; }

 private:
  /// Of an edge and the two that meet at the vertex opposite: weights that sum to 1, and Σ w offset.
  struct Width {
    std::array<int, 3> edges;
    std::array<double, 3> weights;
    double room;
    double tolerance;  ///< For rounding, m.
  };

  void AddWidth(int i, double reach) {
    const int count = static_cast<int>(edges_.size());
    const Vector2d& n = edges_[i].normal;
    int opposite = 0;
    for (int k = 1; k < count; ++k) {
      if (n.dot(outer_[k]) < n.dot(outer_[opposite])) opposite = k;
    }
    const int before = (opposite + count - 1) % count;
    const Vector2d& a = edges_[before].normal;
    const Vector2d& b = edges_[opposite].normal;
    const double sine = a.x() * b.y() - a.y() * b.x();
    if (!(sine > 1e-9)) return;
    Width w;
    w.edges = {i, before, opposite};
    w.weights = {1, std::max(0.0, (n.y() * b.x() - n.x() * b.y()) / sine),
                 std::max(0.0, (n.x() * a.y() - n.y() * a.x()) / sine)};
    const double sum = w.weights[0] + w.weights[1] + w.weights[2];
    Vector2d residual = Vector2d::Zero();
    w.room = kFit;
    for (int k = 0; k < 3; ++k) {
      w.weights[k] /= sum;
      residual += w.weights[k] * edges_[w.edges[k]].normal;
      w.room += w.weights[k] * edges_[w.edges[k]].offset;
    }
    w.tolerance = (1e-12 + 10 * residual.norm()) * reach;
    widths_.push_back(w);
  }

  const Polygon& inner_;
  const Polygon& outer_;
  std::vector<HalfPlane> edges_;
  std::vector<Width> widths_;
  std::vector<double> heights_;
  Polygon turned_, translations_, cut_;
  double radius_ = 0;
};

/// The half degrees of a turn that are not ruled out yet.
class OpenYaws {
 public:
  /// Rules out those nearer to `yaw` than `range`.
  void Close(double yaw, double range) {
    if (!(range > 0)) return;
    const int first = static_cast<int>(std::floor((yaw - std::min(range, pi)) / kYawStep)) + 1;
    const int last = static_cast<int>(std::ceil((yaw + std::min(range, pi)) / kYawStep)) - 1;
    for (int k = first; k <= last; ++k) closed_[Index(k)] = true;
  }
  bool Holds(int k) const { return !closed_[Index(k)]; }

 private:
  static int Index(int k) { return ((k % kYaws) + kYaws) % kYaws; }
  std::array<bool, kYaws> closed_{};
};

}  // namespace

std::optional<Fit> FitsInside(const Polygon& inner, const Polygon& outer, double yaw) {
  if (inner.empty() || outer.size() < 3) return std::nullopt;
  return FitSearch(inner, outer).At(yaw);
}

std::optional<Fit> FitsInside(const Polygon& inner, const Polygon& outer) {
  if (inner.empty() || outer.size() < 3) return std::nullopt;
  FitSearch search(inner, outer);
  if (search.NeverFits()) return std::nullopt;

  OpenYaws open;
  const auto attempt = [&](double yaw) -> std::optional<Fit> {
    const double excess = search.Excess(yaw);
    if (!(excess > 0)) return search.At(yaw);
    // A part of 1e-9 keeps clear of the rounding of yaws.
    open.Close(yaw, excess / search.radius() - 1e-9);
    return std::nullopt;
  };
  std::vector<double> inner_angles, outer_angles, yaws;
  for (size_t i = 0; i < inner.size() && inner.size() > 1; ++i) inner_angles.push_back(EdgeAngle(inner, i));
  for (size_t j = 0; j < outer.size(); ++j) outer_angles.push_back(EdgeAngle(outer, j));
  yaws.reserve(inner_angles.size() * outer_angles.size());
  for (const double a : inner_angles) {
    for (const double b : outer_angles) yaws.push_back(std::remainder(b - a, 2 * pi));
  }
  std::stable_sort(yaws.begin(), yaws.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  for (const double yaw : yaws) {
    if (const std::optional<Fit> fit = attempt(yaw)) return fit;
  }
  for (int i = 0; i < kYaws; ++i) {
    const int k = (i % 2 == 0 ? 1 : -1) * ((i + 1) / 2);
    if (!open.Holds(k)) continue;
    if (const std::optional<Fit> fit = attempt(k * pi / 360)) return fit;
  }
  return std::nullopt;
}

}  // namespace tether::geometry
