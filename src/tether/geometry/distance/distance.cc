#include "tether/geometry/distance/distance.h"

#include <cassert>

#include <Eigen/Geometry>

#include "tether/geometry/distance/core.h"

namespace tether::geometry {
namespace {

using internal::Core;
using internal::Gap;
using internal::Query;

Gap (*const kKernels[5][5])(const Query&) = {
    {internal::PointPoint, internal::PointSegment, internal::PointBox, internal::PointCylinder,
     internal::PointHull},
    {nullptr, internal::SegmentSegment, internal::SegmentBox, internal::SegmentCylinder,
     internal::SegmentHull},
    {nullptr, nullptr, internal::BoxBox, internal::BoxCylinder, internal::BoxHull},
    {nullptr, nullptr, nullptr, internal::CylinderCylinder, internal::CylinderHull},
    {nullptr, nullptr, nullptr, nullptr, internal::HullHull}};

Distance CoreDistance(const Core& a, const math::Pose& X_WA, const Core& b, const math::Pose& X_WB) {
  const bool swapped = a.kind > b.kind;
  const math::Pose& X_WF = swapped ? X_WB : X_WA;  // the frame of the kernel's first core
  Query query;
  query.a = swapped ? b : a;
  query.b = swapped ? a : b;
  query.X_AB = math::Between(X_WF, swapped ? X_WA : X_WB);
  query.up_A = (swapped ? -1.0 : 1.0) * X_WF.R.row(2).transpose();
  const Gap gap = kKernels[static_cast<int>(query.a.kind)][static_cast<int>(query.b.kind)](query);

  Distance result;
  result.distance = gap.distance - query.a.rounding - query.b.rounding;
  const Eigen::Vector3d n_W = X_WF.R * gap.n;
  const Eigen::Vector3d p_first = X_WF * (gap.p_A + query.a.rounding * gap.n);
  const Eigen::Vector3d p_second = X_WF * (gap.p_B - query.b.rounding * gap.n);
  result.n_W = swapped ? -n_W : n_W;
  result.p_WA = swapped ? p_second : p_first;
  result.p_WB = swapped ? p_first : p_second;
  return result;
}

}  // namespace

Distance SignedDistance(const Primitive& a, const math::Pose& X_WA, const Primitive& b,
                        const math::Pose& X_WB) {
  return CoreDistance(internal::MakeCore(a), X_WA, internal::MakeCore(b), X_WB);
}

Distance SignedDistance(const Shape& a, const math::Pose& X_WA, const Shape& b, const math::Pose& X_WB) {
  assert(!a.parts.empty() && !b.parts.empty());
  Distance least;
  bool first = true;
  for (size_t i = 0; i < a.parts.size(); ++i) {
    const math::Pose X_WP = X_WA * a.parts[i].X_SP;
    for (size_t j = 0; j < b.parts.size(); ++j) {
      Distance distance =
          SignedDistance(a.parts[i].primitive, X_WP, b.parts[j].primitive, X_WB * b.parts[j].X_SP);
      if (!first && distance.distance >= least.distance) continue;
      first = false;
      distance.part_a = static_cast<int>(i);
      distance.part_b = static_cast<int>(j);
      least = distance;
    }
  }
  return least;
}

std::vector<Distance> PartDistances(const Shape& a, const math::Pose& X_WA, const Shape& b,
                                    const math::Pose& X_WB, double cutoff) {
  std::vector<Distance> distances;
  for (size_t i = 0; i < a.parts.size(); ++i) {
    const math::Pose X_WP = X_WA * a.parts[i].X_SP;
    for (size_t j = 0; j < b.parts.size(); ++j) {
      Distance distance =
          SignedDistance(a.parts[i].primitive, X_WP, b.parts[j].primitive, X_WB * b.parts[j].X_SP);
      if (distance.distance >= cutoff) continue;
      distance.part_a = static_cast<int>(i);
      distance.part_b = static_cast<int>(j);
      distances.push_back(distance);
    }
  }
  return distances;
}

DistanceDerivative DifferentiateDistance(const Distance& distance, const math::Pose& X_WA,
                                         const math::Pose& X_WB) {
  const auto row = [&](const math::Pose& X, const Eigen::Vector3d& p_W) {
    const Eigen::Vector3d n = X.R.transpose() * distance.n_W;
    const Eigen::Vector3d arm = X.R.transpose() * (p_W - X.p);
    Eigen::Matrix<double, 1, 6> derivative;
    derivative << n.transpose(), arm.cross(n).transpose();
    return derivative;
  };
  return {-row(X_WA, distance.p_WA), row(X_WB, distance.p_WB)};
}

}  // namespace tether::geometry
