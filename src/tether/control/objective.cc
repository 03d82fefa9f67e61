#include "tether/control/objective.h"

#include <array>
#include <utility>

namespace tether::control {
namespace {

using Eigen::Vector3d;

constexpr std::array kNames = {
    std::pair{Objective::kPose, "pose"},         std::pair{Objective::kOrientation, "orientation"},
    std::pair{Objective::kPosition, "position"}, std::pair{Objective::kLine, "line"},
    std::pair{Objective::kPlane, "plane"},       std::pair{Objective::kDistance, "distance"}};

/// F's origin in the planes through X_TF.p across these directions of T.
constraints::PoseFunctionPtr Planes(const math::Pose& X_TF, const std::vector<Vector3d>& normals_T) {
  std::vector<constraints::HalfSpaceRow> rows;
  for (const Vector3d& n : normals_T) rows.push_back({Vector3d::Zero(), n, n.dot(X_TF.p)});
  return constraints::MakeHalfSpaces(std::move(rows));
}

}  // namespace

std::vector<std::string> ObjectiveNames() {
  std::vector<std::string> names;
  for (const auto& [objective, name] : kNames) names.emplace_back(name);
  return names;
}

std::optional<Objective> FindObjective(const std::string& name) {
  for (const auto& [objective, known] : kNames) {
    if (name == known) return objective;
  }
  return std::nullopt;
}

std::string ToString(Objective objective) {
  for (const auto& [known, name] : kNames) {
    if (known == objective) return name;
  }
  return "";
}

std::vector<constraints::PoseFunctionPtr> MakeObjective(Objective objective, const math::Pose& X_TF) {
  const Vector3d x = Vector3d::UnitX(), y = Vector3d::UnitY(), z = Vector3d::UnitZ();
  const Vector3d axis_T = X_TF.R.col(2);
  switch (objective) {
    case Objective::kPose:
      return {Planes(X_TF, {x, y, z}), constraints::MakeRotationMatch(X_TF.R)};
    case Objective::kOrientation:
      return {constraints::MakeRotationMatch(X_TF.R)};
    case Objective::kPosition:
      return {Planes(X_TF, {x, y, z})};
    case Objective::kLine:
      return {Planes(X_TF, {X_TF.R.col(0), X_TF.R.col(1)}),
              constraints::MakeDirections(constraints::ParallelRows(z, axis_T))};
    case Objective::kPlane:
      return {Planes(X_TF, {axis_T}), constraints::MakeDirections(constraints::ParallelRows(z, axis_T))};
    case Objective::kDistance:
      return {Planes(X_TF, {z})};
  }
  return {};
}

}  // namespace tether::control
