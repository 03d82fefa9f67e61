#include "tether/scene/region.h"

#include <algorithm>
#include <numbers>

#include <gtest/gtest.h>

#include "tether/common/random.h"
#include "tether/geometry/hull/polytope.h"

namespace tether::scene {
namespace {

using Eigen::Vector3d;
using math::Pose;

Pose RandomPose(Random& random) {
  math::Vector6d delta;
  for (double& one : delta) one = random.Normal();
  return math::ExpSE3(delta);
}

Pose At(double x, double y, double z) { return Pose(Eigen::Matrix3d::Identity(), {x, y, z}); }

geometry::Shape Box(double x, double y, double z) {
  return geometry::Shape(geometry::Box{Vector3d(x, y, z)});
}

/// Its corners are further out than they are wide, whatever the yaw.
TEST(RegionTest, ABoxIsInADiscWhenItsCornersAre) {
  const geometry::Shape box = Box(0.06, 0.04, 0.1);
  const double corner = std::hypot(0.03, 0.02);
  for (double yaw : {0.0, 0.4, 1.2}) {
    Pose X = At(0.02, 0, 0.05);
    X.R = math::RotationFromRpy({0, 0, yaw});
    double furthest = 0;
    for (double sx : {-1, 1}) {
      for (double sy : {-1, 1})
        furthest = std::max(furthest, (X * Vector3d(0.03 * sx, 0.02 * sy, 0)).head<2>().norm());
    }
    const RegionFit fit = FitRegion(Disc{0.06}, Pose(), box, X);
    EXPECT_NEAR(fit.outside, furthest - 0.06, 1e-6);
    EXPECT_NEAR(fit.height, 0, 1e-12);
  }
  EXPECT_TRUE(FitRegion(Disc{corner + 1e-4}, Pose(), box, At(0, 0, 0.05)).Holds());
  EXPECT_FALSE(FitRegion(Disc{corner - 2e-3}, Pose(), box, At(0, 0, 0.05)).Holds());
}

TEST(RegionTest, WhatHoversOrSinksIsNotIn) {
  const geometry::Shape box = Box(0.04, 0.04, 0.1);
  EXPECT_TRUE(FitRegion(Disc{0.06}, Pose(), box, At(0, 0, 0.055)).Holds());
  EXPECT_FALSE(FitRegion(Disc{0.06}, Pose(), box, At(0, 0, 0.08)).Holds());
  EXPECT_FALSE(FitRegion(Disc{0.06}, Pose(), box, At(0, 0, 0.02)).Holds());
  // A solid region has a height: what stands on its floor or on something within is in.
  const RegionForm shelf = geometry::Box{Vector3d(0.2, 0.2, 0.3)};
  EXPECT_TRUE(FitRegion(shelf, Pose(), box, At(0, 0, -0.1)).Holds());
  EXPECT_TRUE(FitRegion(shelf, Pose(), box, At(0.05, 0, 0.15)).Holds());
  EXPECT_FALSE(FitRegion(shelf, Pose(), box, At(0, 0, 0.25)).Holds());
  EXPECT_FALSE(FitRegion(shelf, Pose(), box, At(0.09, 0, 0)).Holds());
}

TEST(RegionTest, RectanglesAndSolidsHaveTheirOutline) {
  const geometry::Shape ball(geometry::Sphere{0.02});
  EXPECT_NEAR(FitRegion(Rectangle{{0.2, 0.1}}, Pose(), ball, At(0.05, 0.01, 0.02)).outside, -0.02, 1e-9);
  EXPECT_NEAR(FitRegion(Rectangle{{0.2, 0.1}}, Pose(), ball, At(0.09, 0.01, 0.02)).outside, 0.01, 1e-9);
  EXPECT_NEAR(FitRegion(geometry::Cylinder{0.1, 0.4}, Pose(), ball, At(0.05, 0, 0)).outside, -0.03, 1e-6);
  const auto hull = geometry::MakeHull({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}).hull;
  EXPECT_NEAR(FitRegion(*hull, Pose(), ball, At(0.5, 0.5, 0.1)).outside, 0.02, 1e-9);
  EXPECT_NEAR(OutlineArea(*hull), 0.5, 1e-12);
  EXPECT_NEAR(OutlineArea(Disc{0.1}), 0.01 * std::numbers::pi, 1e-12);
}

TEST(RegionTest, MovingTheWholeWorldChangesNothing) {
  Random random(1);
  for (int i = 0; i < 30; ++i) {
    const Pose X_WR = RandomPose(random), X_WO = RandomPose(random), X = RandomPose(random);
    const geometry::Shape shape = Box(0.1, 0.2, 0.3);
    for (const RegionForm& form : {RegionForm(Disc{0.3}), RegionForm(Rectangle{{0.4, 0.3}}),
                                   RegionForm(geometry::Primitive(geometry::Sphere{0.5}))}) {
      const RegionFit a = FitRegion(form, X_WR, shape, X_WO), b = FitRegion(form, X * X_WR, shape, X * X_WO);
      EXPECT_NEAR(a.outside, b.outside, 1e-9);
      EXPECT_NEAR(a.height, b.height, 1e-9);
    }
  }
}

Scene Table() {
  Scene scene;
  const auto object = [&](const std::string& name, std::optional<double> mass, const std::string& parent,
                          const Vector3d& p) {
    Object one;
    one.name = name;
    one.shape = Box(0.04, 0.04, 0.1);
    one.mass = mass;
    one.parent = parent;
    one.X_ParentObject = At(p.x(), p.y(), p.z());
    scene.objects.push_back(one);
  };
  const auto region = [&](const std::string& name, RegionForm form, const std::string& parent, double x) {
    Region one;
    one.name = name;
    one.form = form;
    one.parent = parent;
    one.X_ParentRegion = At(x, 0, 0);
    scene.regions.push_back(one);
  };
  object("tray", 1.0, kWorld, {0, 1, 0});
  region("left", Disc{0.06}, kWorld, -0.5);
  region("right", Disc{0.06}, kWorld, 0.5);
  region("half", Rectangle{{1, 1}}, kWorld, 0.5);
  region("on_tray", Disc{0.06}, "tray", 0);
  object("cup", 0.1, "left", {0, 0, 0.05});
  scene.groups["sides"] = {"left", "right"};
  return scene;
}

TEST(RegionTest, FindsWhereAnObjectIs) {
  const Scene scene = Table();
  const Object& cup = *scene.FindObject("cup");
  const auto where = [&](const Pose& X_WCup, double tray_x = 0) {
    std::string names;
    for (const Region* region : FindRegionsOf(scene, {{"cup", X_WCup}, {"tray", At(tray_x, 1, 0)}}, cup))
      names += region->name + " ";
    return names;
  };
  EXPECT_EQ(where(At(-0.5, 0, 0.05)), "left ");
  EXPECT_EQ(where(At(0.5, 0, 0.05)), "right half ");  // The smallest first.
  EXPECT_EQ(where(At(0.3, 0, 0.05)), "half ");
  EXPECT_EQ(where(At(-0.2, 0, 0.05)), "");
  // A region moves with the object that it is attached to.
  EXPECT_EQ(where(At(0, 1, 0.05)), "on_tray ");
  EXPECT_EQ(where(At(0, 1, 0.05), 0.2), "");
  EXPECT_EQ(where(At(0.2, 1, 0.05), 0.2), "on_tray ");
  // Nothing is in a region of its own.
  const std::map<std::string, Pose> X_WO = {{"tray", At(0, 1, 0.05)}, {"cup", At(0.5, 0, 0.05)}};
  EXPECT_TRUE(FindRegionsOf(scene, X_WO, *scene.FindObject("tray")).empty());
  EXPECT_TRUE(IsIn(scene, X_WO, cup, "right"));
  EXPECT_TRUE(IsIn(scene, X_WO, cup, "sides"));
  EXPECT_FALSE(IsIn(scene, X_WO, cup, "left"));
}

}  // namespace
}  // namespace tether::scene
