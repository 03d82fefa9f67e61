#include "tether/motion/kernel/kernel_tables.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "tether/common/overloaded.h"
#include "tether/geometry/distance/bounds.h"
#include "tether/geometry/hull/polytope.h"
#include "tether/motion/kernel/sphere_cover.h"
#include "tether/robot/kinematics.h"

namespace tether::motion::internal {
namespace {

using Eigen::Vector3d;

// A single-precision unit in the last place, and how many of them a chain of operations may lose per joint
// and per metre: an angle of up to 2π, its sine and cosine and two products.
constexpr double kUlp = std::numeric_limits<float>::epsilon();
constexpr double kUlpsPerJoint = 16;
constexpr double kUlpsPerObstacle = 16;

// Never reaches anything.
constexpr float kNoInner = -1e6f;

void Copy(const Vector3d& from, float* to) {
  for (int i = 0; i < 3; ++i) to[i] = static_cast<float>(from[i]);
}

/// Rounded up, so that it stays a bound.
float Upper(double x) { return std::nextafter(static_cast<float>(x), std::numeric_limits<float>::max()); }
float Lower(double x) { return std::nextafter(static_cast<float>(x), 0.0f); }

void SetShape(const geometry::Primitive& primitive, KernelTables& tables, KernelObstacle& out) {
  using Kind = KernelObstacle::Kind;
  std::visit(Overloaded{
                 [&](const geometry::Box& box) {
                   out.kind = Kind::kBox;
                   Copy(0.5 * box.size, out.half);
                 },
                 [&](const geometry::Sphere& sphere) {
                   out.kind = Kind::kSegment;
                   out.rounding = static_cast<float>(sphere.radius);
                 },
                 [&](const geometry::Capsule& capsule) {
                   out.kind = Kind::kSegment;
                   out.rounding = static_cast<float>(capsule.radius);
                   out.half[2] = static_cast<float>(0.5 * capsule.length);
                 },
                 [&](const geometry::Cylinder& cylinder) {
                   out.kind = Kind::kCylinder;
                   out.half[0] = static_cast<float>(cylinder.radius);
                   out.half[2] = static_cast<float>(0.5 * cylinder.length);
                 },
                 [&](const geometry::Hull& hull) {
                   out.kind = Kind::kHull;
                   out.first_face = static_cast<int>(tables.faces.size());
                   for (const auto& face : hull.polytope->faces) {
                     tables.faces.push_back(
                         {static_cast<float>(face.normal.x()), static_cast<float>(face.normal.y()),
                          static_cast<float>(face.normal.z()), static_cast<float>(face.offset)});
                   }
                   out.num_faces = static_cast<int>(tables.faces.size()) - out.first_face;
                 },
             },
             primitive);
}

void AddObstacles(const CollisionScene& scene, double reach, KernelTables& tables) {
  const double arm = kUlp * kUlpsPerJoint * (scene.model().dof() + 1) * reach;
  for (const CollisionScene::ObstaclePart& part : scene.obstacles()) {
    KernelObstacle out;
    for (int row = 0; row < 3; ++row) Copy(part.X_BP.R.col(row), out.axes + 3 * row);
    Copy(part.X_BP.p, out.origin);
    SetShape(part.primitive, tables, out);
    const double extent = part.X_BP.p.norm() + geometry::BoundingRadius(part.primitive) + reach;
    out.margin = Upper(arm + kUlp * kUlpsPerObstacle * extent);
    tables.obstacles.push_back(out);
  }
}

void AddPart(const CollisionScene::ArmPart& part, KernelTables& tables) {
  KernelPart out;
  out.link = part.link;
  Copy(part.X_LP.p, out.centre);
  out.first_sphere = static_cast<int>(tables.spheres.size());
  double radius = 0, spread = 0;
  for (const CoverSphere& sphere : CoverWithSpheres(part.primitive)) {
    KernelSphere kernel;
    Copy(part.X_LP * sphere.p, kernel.centre);
    kernel.outer = Upper(sphere.outer);
    kernel.inner = sphere.inner > 0 ? Lower(sphere.inner) : kNoInner;
    radius = std::max(radius, sphere.p.norm() + sphere.outer);
    spread = std::max(spread, sphere.p.norm());
    tables.spheres.push_back(kernel);
  }
  out.num_spheres = static_cast<int>(tables.spheres.size()) - out.first_sphere;
  // The part's own ball about its origin may be smaller than that of its balls.
  out.radius = Upper(std::min(radius, geometry::BoundingRadius(part.primitive)));
  out.spread = Upper(spread);
  tables.parts.push_back(out);
}

/// Parts `first` to `end`, all of one body.
void AddGroup(const CollisionScene& scene, size_t first, size_t end, KernelTables& tables) {
  const std::vector<CollisionScene::ArmPart>& arm = scene.arm();
  KernelGroup out;
  out.link = arm[first].link;
  out.first_part = static_cast<int>(first);
  out.num_parts = static_cast<int>(end - first);
  geometry::Aabb box;
  std::set<int> obstacles;
  for (size_t i = first; i < end; ++i) {
    box.Include(geometry::BoundingBox(arm[i].primitive, arm[i].X_LP));
    obstacles.insert(arm[i].obstacles.begin(), arm[i].obstacles.end());
  }
  const Vector3d centre = 0.5 * (box.lower + box.upper);
  double radius = 0, spread = 0;
  for (size_t i = first; i < end; ++i) {
    const KernelPart& part = tables.parts[i];
    const double away = (arm[i].X_LP.p - centre).norm();
    radius = std::max(radius, away + double{part.radius});
    spread = std::max(spread, away + double{part.spread});
  }
  Copy(centre, out.centre);
  // The single-precision centre is off by less than this.
  out.radius = Upper(radius + 1e-6);
  out.spread = Upper(spread + 1e-6);
  out.first_obstacle = static_cast<int>(tables.nearby.size());
  tables.nearby.insert(tables.nearby.end(), obstacles.begin(), obstacles.end());
  out.num_obstacles = static_cast<int>(obstacles.size());
  tables.groups.push_back(out);
}

void AddGroups(const CollisionScene& scene, KernelTables& tables) {
  const auto& arm = scene.arm();
  for (size_t first = 0, end = 0; first < arm.size(); first = end) {
    while (end < arm.size() && arm[end].body == arm[first].body &&
           end - first < size_t{KernelGroup::kMostParts})
      ++end;
    AddGroup(scene, first, end, tables);
  }
}

}  // namespace

KernelTables MakeKernelTables(const CollisionScene& scene) {
  KernelTables tables;
  double reach = 0;
  for (const robot::Chain::Joint& joint : scene.model().chain().joints) {
    std::array<float, 12> X{};
    for (int row = 0; row < 3; ++row) Copy(joint.X_PJ.R.row(row), X.data() + 3 * row);
    Copy(joint.X_PJ.p, X.data() + 9);
    tables.joints.push_back(X);
    reach += joint.X_PJ.p.norm();
  }
  double extent = 0;
  for (const CollisionScene::ArmPart& part : scene.arm())
    extent = std::max(extent, part.X_LP.p.norm() + geometry::BoundingRadius(part.primitive));
  reach += extent;
  AddObstacles(scene, reach, tables);
  for (const CollisionScene::ArmPart& part : scene.arm()) AddPart(part, tables);
  AddGroups(scene, tables);
  const double margin = 2 * kUlp * kUlpsPerJoint * (scene.model().dof() + 1) * reach;
  for (const CollisionScene::PartPair& pair : scene.pairs())
    tables.pairs.push_back({pair.a, pair.b, Upper(margin)});
  return tables;
}

}  // namespace tether::motion::internal
