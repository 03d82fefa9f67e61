#pragma once

#include <cstddef>
#include <cstdint>

#include "tether/motion/kernel/sphere_kernel.h"

/// The code of both kernels. `V` says what a number is: one float, or eight. Each operation rounds as IEEE
/// 754 says, so that both give the same bits. Everything is a template of `V`, whose types are local to their
/// files: no function that is compiled for one processor is ever taken for the other.
namespace tether::motion::internal {

template <class V>
struct KernelBody {
  using F = typename V::F;
  using I = typename V::I;
  struct Vec {
    F x, y, z;
  };

  static F Square(F x) { return x * x; }

  /// Cody and Waite's reduction by multiples of π/2, then the polynomials of the Cephes library.
  static void SinCos(F x, F* sin, F* cos) {
    const F shifted = x * V::Splat(0.636619772367581343f) + V::Splat(12582912.0f);
    const I quadrant = V::Bits(shifted);
    const F k = shifted - V::Splat(12582912.0f);
    F r = x - k * V::Splat(1.5703125f);
    r = r - k * V::Splat(4.837512969970703125e-4f);
    r = r - k * V::Splat(7.549789948768648e-8f);
    const F z = r * r;
    F s = V::Splat(-1.9515295891e-4f) * z + V::Splat(8.3321608736e-3f);
    s = (s * z - V::Splat(1.6666654611e-1f)) * z * r + r;
    F c = V::Splat(2.443315711809948e-5f) * z - V::Splat(1.388731625493765e-3f);
    c = (c * z + V::Splat(4.166664568298827e-2f)) * z * z - V::Splat(0.5f) * z + V::Splat(1.0f);
    const I swap = V::IsBitSet(quadrant, 1);
    const F sine = V::Select(swap, c, s), cosine = V::Select(swap, s, c);
    *sin = V::Select(V::IsBitSet(quadrant, 2), V::Splat(0.0f) - sine, sine);
    *cos = V::Select(V::IsBitSet(quadrant + V::One(), 2), V::Splat(0.0f) - cosine, cosine);
  }

  static Vec Cross(const Vec& a, const Vec& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  }
  static Vec Difference(const Vec& a, const Vec& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  static F Length(const Vec& a) { return V::Sqrt(a.x * a.x + a.y * a.y + a.z * a.z); }

  /// A link's axes and origin, its angular velocity and that of its origin, per unit of t.
  struct Frame {
    Vec x, y, z, p, w, v;
    Vec operator*(const float* point) const {
      const F a = V::Splat(point[0]), b = V::Splat(point[1]), c = V::Splat(point[2]);
      return {x.x * a + y.x * b + z.x * c + p.x, x.y * a + y.y * b + z.y * c + p.y,
              x.z * a + y.z * b + z.z * c + p.z};
    }
    Vec Turn(float a0, float b0, float c0) const {
      const F a = V::Splat(a0), b = V::Splat(b0), c = V::Splat(c0);
      return {x.x * a + y.x * b + z.x * c, x.y * a + y.y * b + z.y * c, x.z * a + y.z * b + z.z * c};
    }
  };

  /// The frames of links 0 … n at t.
  static void PlaceLinks(const KernelTables& tables, const KernelSegment& segment, F t, Frame* frames) {
    const F zero = V::Splat(0.0f), one = V::Splat(1.0f);
    frames[0] = {{one, zero, zero},  {zero, one, zero},  {zero, zero, one},
                 {zero, zero, zero}, {zero, zero, zero}, {zero, zero, zero}};
    for (size_t j = 0; j < tables.joints.size(); ++j) {
      const float* X = tables.joints[j].data();
      const Frame& parent = frames[j];
      F s, c;
      SinCos(V::Splat(segment.begin[j]) + V::Splat(segment.along[j]) * t, &s, &c);
      const Vec x = parent.Turn(X[0], X[3], X[6]), y = parent.Turn(X[1], X[4], X[7]);
      const Vec z = parent.Turn(X[2], X[5], X[8]), p = parent * (X + 9);
      const F rate = V::Splat(segment.along[j]);
      const Vec lever = Cross(parent.w, Difference(p, parent.p));
      frames[j + 1] = {{x.x * c + y.x * s, x.y * c + y.y * s, x.z * c + y.z * s},
                       {y.x * c - x.x * s, y.y * c - x.y * s, y.z * c - x.z * s},
                       z,
                       p,
                       {parent.w.x + z.x * rate, parent.w.y + z.y * rate, parent.w.z + z.z * rate},
                       {parent.v.x + lever.x, parent.v.y + lever.y, parent.v.z + lever.z}};
    }
  }

  /// The squared distance of a point to the obstacle's core; of a hull, a lower bound of it that is 0 inside.
  static F SquaredDistance(const KernelTables& tables, const KernelObstacle& o, const Vec& c) {
    const F zero = V::Splat(0.0f);
    const F dx = c.x - V::Splat(o.origin[0]), dy = c.y - V::Splat(o.origin[1]),
            dz = c.z - V::Splat(o.origin[2]);
    const float* A = o.axes;
    const F x = dx * V::Splat(A[0]) + dy * V::Splat(A[1]) + dz * V::Splat(A[2]);
    const F y = dx * V::Splat(A[3]) + dy * V::Splat(A[4]) + dz * V::Splat(A[5]);
    const F z = dx * V::Splat(A[6]) + dy * V::Splat(A[7]) + dz * V::Splat(A[8]);
    const F over_z = V::Max(V::Abs(z) - V::Splat(o.half[2]), zero);
    switch (o.kind) {
      case KernelObstacle::Kind::kBox:
        return Square(V::Max(V::Abs(x) - V::Splat(o.half[0]), zero)) +
               Square(V::Max(V::Abs(y) - V::Splat(o.half[1]), zero)) + Square(over_z);
      case KernelObstacle::Kind::kSegment:
        return x * x + y * y + Square(over_z);
      case KernelObstacle::Kind::kCylinder:
        return Square(V::Max(V::Sqrt(x * x + y * y) - V::Splat(o.half[0]), zero)) + Square(over_z);
      case KernelObstacle::Kind::kHull:
        break;
    }
    F most = zero;
    for (int f = o.first_face; f < o.first_face + o.num_faces; ++f) {
      const float* n = tables.faces[static_cast<size_t>(f)].data();
      most = V::Max(most, x * V::Splat(n[0]) + y * V::Splat(n[1]) + z * V::Splat(n[2]) - V::Splat(n[3]));
    }
    return most * most;
  }

  static uint32_t Closer(F squared, float threshold) {
    return threshold > 0 ? V::Mask(V::Less(squared, V::Splat(threshold * threshold))) : 0;
  }
  /// The same for thresholds of its own in each lane, none below 0.
  static uint32_t CloserBy(F squared, F threshold) {
    return V::Mask(V::Less(squared, threshold * threshold));
  }

  /// The most that spheres about `middle` move within the interval; `bound` and `curve` as in the query.
  static F Motion(const Frame& frame, const Vec& middle, float spread, float half, float bound, float curve) {
    const Vec lever = Cross(frame.w, Difference(middle, frame.p));
    const Vec velocity = {frame.v.x + lever.x, frame.v.y + lever.y, frame.v.z + lever.z};
    const F speed = Length(velocity) + Length(frame.w) * V::Splat(spread);
    const F curved = speed * V::Splat(half) + V::Splat(curve);
    const F most = V::Splat(bound);
    return V::Select(V::Less(curved, most), curved, most);
  }

  /// A part's spheres against one obstacle; false if it is blocked.
  static bool CheckPart(const KernelTables& tables, int index, int other, const Frame& frame, F motion,
                        uint32_t lanes, KernelAnswer& answer) {
    const KernelPart& part = tables.parts[static_cast<size_t>(index)];
    const KernelObstacle& o = tables.obstacles[static_cast<size_t>(other)];
    const F add = motion + V::Splat(o.rounding + o.margin);
    const uint32_t near =
        lanes & CloserBy(SquaredDistance(tables, o, frame * part.centre), V::Splat(part.radius) + add);
    if (near == 0) return true;
    uint32_t unsure = 0;
    // Of a hull only a lower bound of the distance is known.
    const bool hull = o.kind == KernelObstacle::Kind::kHull;
    for (int s = part.first_sphere; s < part.first_sphere + part.num_spheres; ++s) {
      const KernelSphere& sphere = tables.spheres[static_cast<size_t>(s)];
      const F squared = SquaredDistance(tables, o, frame * sphere.centre);
      const float touch = hull ? 0.0f : sphere.inner + o.rounding - o.margin;
      answer.blocked |= near & Closer(squared, touch);
      unsure |= near & CloserBy(squared, V::Splat(sphere.outer) + add);
      if (answer.blocked != 0) return false;
    }
    if (unsure == 0) return true;
    answer.unsure |= unsure;
    V::Add(answer, index, other, unsure);
    return true;
  }

  /// A group against the obstacles near it.
  static bool CheckGroup(const KernelTables& tables, const KernelGroup& group, const Frame* frames,
                         const KernelQuery& query, uint32_t lanes, KernelAnswer& answer) {
    if (group.num_obstacles == 0) return true;
    const Frame& frame = frames[group.link];
    float bound = 0, curve = 0;
    for (int i = group.first_part; i < group.first_part + group.num_parts; ++i) {
      bound = bound < query.part_motion[i] ? query.part_motion[i] : bound;
      curve = curve < query.part_curve[i] ? query.part_curve[i] : curve;
    }
    const Vec middle = frame * group.centre;
    const F motion = Motion(frame, middle, group.spread, query.half, bound, curve);
    F part_motion[KernelGroup::kMostParts];
    bool known = false;
    for (int k = group.first_obstacle; k < group.first_obstacle + group.num_obstacles; ++k) {
      const int other = tables.nearby[static_cast<size_t>(k)];
      const KernelObstacle& o = tables.obstacles[static_cast<size_t>(other)];
      const F reach = motion + V::Splat(group.radius + o.rounding + o.margin);
      const uint32_t near = lanes & CloserBy(SquaredDistance(tables, o, middle), reach);
      if (near == 0) continue;
      for (int i = 0; i < group.num_parts; ++i) {
        const int index = group.first_part + i;
        const KernelPart& part = tables.parts[static_cast<size_t>(index)];
        if (!known) {
          part_motion[i] = Motion(frame, frame * part.centre, part.spread, query.half,
                                  query.part_motion[index], query.part_curve[index]);
        }
        if (!CheckPart(tables, index, other, frame, part_motion[i], near, answer)) return false;
      }
      known = true;
    }
    return true;
  }

  /// Two parts of the arm.
  static bool CheckPair(const KernelTables& tables, int index, const Frame* frames, const KernelQuery& query,
                        uint32_t lanes, KernelAnswer& answer) {
    const KernelPair& pair = tables.pairs[static_cast<size_t>(index)];
    const KernelPart& a = tables.parts[static_cast<size_t>(pair.a)];
    const KernelPart& b = tables.parts[static_cast<size_t>(pair.b)];
    const Frame &frame_a = frames[a.link], &frame_b = frames[b.link];
    const float add = pair.margin + query.pair_motion[index];
    const auto squared = [](const Vec& p, const Vec& q) {
      return Square(p.x - q.x) + Square(p.y - q.y) + Square(p.z - q.z);
    };
    const Vec middle_b = frame_b * b.centre;
    const uint32_t near = lanes & Closer(squared(frame_a * a.centre, middle_b), a.radius + b.radius + add);
    if (near == 0) return true;
    uint32_t unsure = 0;
    for (int s = a.first_sphere; s < a.first_sphere + a.num_spheres; ++s) {
      const KernelSphere& sphere = tables.spheres[static_cast<size_t>(s)];
      const Vec centre = frame_a * sphere.centre;
      if ((near & Closer(squared(centre, middle_b), sphere.outer + b.radius + add)) == 0) continue;
      for (int r = b.first_sphere; r < b.first_sphere + b.num_spheres; ++r) {
        const KernelSphere& other = tables.spheres[static_cast<size_t>(r)];
        const F apart = squared(centre, frame_b * other.centre);
        answer.blocked |= near & Closer(apart, sphere.inner + other.inner - pair.margin);
        unsure |= near & Closer(apart, sphere.outer + other.outer + add);
      }
      if (answer.blocked != 0) return false;
    }
    if (unsure != 0) {
      answer.unsure |= unsure;
      V::Add(answer, pair.a, -1 - index, unsure);
    }
    return true;
  }

  static void Check(const KernelTables& tables, const KernelSegment& segment, const KernelQuery& query, F t,
                    uint32_t lanes, KernelAnswer& answer) {
    Frame frames[kMostLinks];
    PlaceLinks(tables, segment, t, frames);
    // The hand first: it is the likeliest to touch something.
    for (size_t i = tables.groups.size(); i-- > 0;) {
      if (!CheckGroup(tables, tables.groups[i], frames, query, lanes, answer)) return;
    }
    for (int i = 0; i < static_cast<int>(tables.pairs.size()); ++i) {
      if (!CheckPair(tables, i, frames, query, lanes, answer)) return;
    }
  }
};

}  // namespace tether::motion::internal
