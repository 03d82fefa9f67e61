#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tether/control/clearance_pairs.h"
#include "tether/qp/hierarchy.h"

namespace tether::control {

/// The most rows of a goal or a field.
inline constexpr int kMostFunctionRows = 12;

/// What both constrained controllers work with: the arm and what is around it in the base frame B, their
/// constraints by number (clearances, the arm itself, fields, extra fields), and a tick's rows with their
/// derivatives in q. `Row` is a controller's own. Not for users of the room.
template <typename Row>
struct ConstrainedArm {
  /// `self_distance`: that the arm's own parts keep, m.
  ConstrainedArm(std::shared_ptr<const robot::Model> model_in, const math::Pose& X_WBase,
                 const std::vector<Solid>& objects, const std::vector<ClearanceConstraint>& clearances,
                 std::vector<FieldConstraint> fields_in, double self_distance)
      : model(std::move(model_in)),
        X_BW(X_WBase.Inverse()),
        n(model->dof()),
        kinematics(model),
        bodies(model, objects) {
    for (const ClearanceConstraint& clearance : clearances) {
      AddClearancePairs(bodies, clearance, static_cast<int>(names.size()), pairs);
      names.push_back(clearance.name);
    }
    AddSelfPairs(*model, self_distance, static_cast<int>(names.size()), pairs);
    names.emplace_back("self");
    first_field = static_cast<int>(names.size());
    AddFields(std::move(fields_in));
    fixed_fields = fields.size();
  }

  /// In place of the extra fields before.
  void SetExtraFields(std::vector<FieldConstraint> extra) {
    fields.resize(fixed_fields);
    names.resize(first_field + fixed_fields);
    AddFields(std::move(extra));
  }

  /// The most rows that a tick has.
  size_t MostRows() const {
    size_t room = NumPartPairs(bodies, pairs);
    for (const FieldConstraint& field : fields) room += field.function->size();
    return room;
  }
  void ReserveRows(size_t room) {
    rows.resize(room);
    jacobians.resize(room * n);
  }
  /// Its derivative, n entries, all zero; within what is reserved.
  double* NewRow(const Row& row) {
    const int index = num_rows++;
    rows[index] = row;
    double* jacobian = jacobians.data() + index * n;
    std::fill(jacobian, jacobian + n, 0.0);
    return jacobian;
  }
  Eigen::Map<const Eigen::RowVectorXd> Jacobian(int row) const { return {jacobians.data() + row * n, n}; }

  static bool AllFinite(std::span<const MovingPose> objects) {
    return std::all_of(objects.begin(), objects.end(), [](const MovingPose& object) {
      return object.X.R.allFinite() && object.X.p.allFinite() && object.V.allFinite();
    });
  }
  /// The arm as `kinematics` has it, and the objects, which are given in the world.
  void PlaceBodies(double opening, std::span<const MovingPose> objects) {
    bodies.PlaceArm(kinematics, opening);
    for (size_t i = 0; i < objects.size(); ++i) {
      MovingPose moved;
      moved.X = X_BW * objects[i].X;
      moved.V.head<3>() = X_BW.R * objects[i].V.head<3>();
      moved.V.tail<3>() = X_BW.R * objects[i].V.tail<3>();
      bodies.Place(static_cast<int>(i), moved);
    }
  }

  std::shared_ptr<const robot::Model> model;
  math::Pose X_BW;
  int n;
  robot::Kinematics kinematics;
  ArmBodies bodies;
  std::vector<std::string> names;  ///< By constraint number.
  std::vector<ClearancePair> pairs;
  std::vector<FieldConstraint> fields;
  size_t fixed_fields = 0;
  int first_field = 0;  ///< The constraint number of the first field.

  std::vector<Row> rows;
  std::vector<double> jacobians;  ///< n per row
  int num_rows = 0;
  bool rows_finite = true;
  std::vector<int> levels;
  std::unique_ptr<qp::Problem> problem, conflict_problem;
  std::unique_ptr<qp::Solver> solver;
  std::unique_ptr<qp::HierarchySolver> conflict_solver;
  double error_m = 0, error_rad = 0;  ///< Of the goal.

 private:
  void AddFields(std::vector<FieldConstraint> added) {
    for (FieldConstraint& field : added) {
      names.push_back(field.name);
      fields.push_back(std::move(field));
    }
  }
};

}  // namespace tether::control
