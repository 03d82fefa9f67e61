#pragma once

#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "tether/geometry/shape.h"
#include "tether/math/pose.h"
#include "tether/nlp/program.h"

namespace tether::constraints {

/// A vector-valued function of the poses of a few frames, all given in one common frame. It never changes
/// when all poses are moved together (left-invariance), so that any common ancestor will do. The optimiser
/// chains it with the kinematic tree; a controller may chain it with the arm's Jacobian.
class PoseFunction {
 public:
  virtual ~PoseFunction() = default;

  int size() const { return size_; }
  int num_frames() const { return num_frames_; }
  nlp::Unit unit() const { return unit_; }

  /// `X` has num_frames() poses. Writes size() rows to `r`, and if `J` is not null the exact derivative in a
  /// right perturbation of each pose: size() × 6·num_frames(), every entry.
  virtual void Evaluate(std::span<const math::Pose> X, nlp::VectorRef r, nlp::JacobianRef* J) const = 0;

 protected:
  PoseFunction(int size, int num_frames, nlp::Unit unit)
      : size_(size), num_frames_(num_frames), unit_(unit) {}

 private:
  int size_;
  int num_frames_;
  nlp::Unit unit_;
};

using PoseFunctionPtr = std::shared_ptr<const PoseFunction>;

/// One row of HalfSpaces: n_B · p_BQ − offset, for the point Q fixed in frame A.
struct HalfSpaceRow {
  Eigen::Vector3d p_AQ;  ///< m
  Eigen::Vector3d n_B;   ///< Unit.
  double offset;         ///< m
};

/// Frames (B, A). Signed distances of points of A to planes of B, m.
PoseFunctionPtr MakeHalfSpaces(std::vector<HalfSpaceRow> rows);

/// A plane of B: n_B · x = offset.
struct Plane {
  Eigen::Vector3d n_B;  ///< Unit.
  double offset;        ///< m
};

/// A point Q fixed in a frame A, with its share of a mean.
struct SharedPoint {
  Eigen::Vector3d p_AQ;  ///< m
  double share;          ///< All together are 1.
};

/// Frames (B, A1, A2 …), one A for each point. Signed distance of the mean of the points to planes of B, m:
/// with shares of mass and centres of mass, of the bodies' common centre of mass.
PoseFunctionPtr MakeMeanHalfSpaces(std::vector<Plane> planes, std::vector<SharedPoint> points);

/// One row of DirectionRows: e_B · (R_BA d_A) − value.
struct DirectionRow {
  Eigen::Vector3d d_A;  ///< Unit.
  Eigen::Vector3d e_B;  ///< Unit.
  double value;  ///< A cosine; 0 asks for a right angle, and the row is then the sine of the error, rad to
                 ///< first order.
};

/// Frames (B, A). Alignment of directions of A with directions of B.
PoseFunctionPtr MakeDirections(std::vector<DirectionRow> rows);

/// The two rows of which zero means that direction d_A of A is parallel or opposite to e_B of B: its
/// components across e_B.
std::vector<DirectionRow> ParallelRows(const Eigen::Vector3d& d_A, const Eigen::Vector3d& e_B);

/// Frames (B, A). The rotation vector of R_BA_desiredᵀ · R_BA, 3 rows, rad. Regular below an error of π
/// (ERRATA A6, A9).
PoseFunctionPtr MakeRotationMatch(const Eigen::Matrix3d& R_BA_desired);

/// Frames (B0, A0, B1, A1). The rotation vector of R_B0A0ᵀ · R_B1A1: how A has turned in B between two steps.
/// 3 rows, rad.
PoseFunctionPtr MakeRotationChange();

/// Frames (B0, A0, B1, A1). Displacement of A in B between two steps, d_B = p_B1A1 − p_B0A0, along directions
/// given in A0: row i is (R_B0A0 n_i) · d_B. Paper A, eq. (13a), with the sign of ERRATA A5. m.
PoseFunctionPtr MakeDisplacement(std::vector<Eigen::Vector3d> n_A);

/// Frames (B0, A0, B1, A1). As MakeDisplacement, along directions fixed in B: row i is n_i · d_B. Paper A,
/// eq. (15).
PoseFunctionPtr MakeDisplacementInTarget(std::vector<Eigen::Vector3d> n_B);

/// Frames (B, A). sign · (‖p_BQ − p_BP‖ − distance) for Q fixed in A, P fixed in B. m. Undefined direction at
/// zero distance: the derivative is zero there.
PoseFunctionPtr MakePointDistance(const Eigen::Vector3d& p_BP, const Eigen::Vector3d& p_AQ, double distance,
                                  double sign);

/// Frames (B, A). sign · (distance of the point Q of A from the line through P along unit u in B − distance).
/// m.
PoseFunctionPtr MakeAxisDistance(const Eigen::Vector3d& p_BP, const Eigen::Vector3d& u_B,
                                 const Eigen::Vector3d& p_AQ, double distance, double sign = 1);

/// Frames (A, B). sign · (signed distance between two convex parts − distance). m. Paper A, eqs. (8), (9),
/// (17), one row per pair (ERRATA A2, A3, A8).
PoseFunctionPtr MakePartDistance(geometry::Part a, geometry::Part b, double distance, double sign);

/// Frames (F0, F1). weight · (p_F1 − p_F0) in the common frame, 3 rows; left-invariant in norm only, so it
/// serves as a cost. Paper A, eq. (4), first term.
PoseFunctionPtr MakeTravel(double weight);

/// Frames (F0, F1). weight · log(R_F0ᵀ R_F1), 3 rows. Paper A, eq. (4), second term.
PoseFunctionPtr MakeTurn(double weight);

}  // namespace tether::constraints
