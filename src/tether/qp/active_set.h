#pragma once

#include "tether/qp/status.h"

namespace tether::qp {

/// Everything that a kernel of the active-set method reads and writes: plain arrays on cache lines, so that
/// the same code compiles for each instruction set. `stride` is n rounded up to 8; vectors over variables
/// have that length, and zeros in their last entries.
///
/// A position names a constraint: i ≥ 0 is row i of A, padded_m + j the bound of variable j, −1 − k equality
/// k. Of an active constraint the normal is signed, so that it reads normalᵀ x ≥ side.
struct Frame {
  int n, stride, m, padded_m, num_equalities;
  const double *H, *g, *A, *lower, *upper, *x_lower, *x_upper, *E, *e;

  double *J, *Jt;  ///< J by columns and by rows; J Jᵀ = H⁻¹, and its first q columns span the active normals.
  double* R;       ///< By rows, upper triangular, q × q: Jᵀ N = [R; 0] with the active normals N.
  double* inverse_diagonal;  ///< Of R.
  double *x, *x0;            ///< The iterate, and the minimiser without constraints.
  double *d, *z, *r, *v;     ///< Jᵀ a; the step in x; the step of the multipliers; of the reflection.
  double* normal;            ///< Of the row that is being added.
  double *normals, *sides;   ///< Of the active ones, stride entries each.
  double *u, *norms, *w;     ///< Multipliers; lengths of the columns of R; work.
  double *rows, *violation;  ///< A x; how much each position is violated.
  double* mask;              ///< −∞ at positions that are excluded, else 0.
  int* position;             ///< Of the active ones.
  int* sign;                 ///< +1: lower side, −1: upper.
  int q;                     ///< How many are active; the first `fixed` are equalities.
  int fixed;
  int iterations, max_iterations;

  /// If infeasible: the row that conflicts with the active ones, whose weights are −r.
  int conflict_position, conflict_sign;
  /// Those to start with, at most n.
  const int *warm_position, *warm_sign;
  int num_warm;
};

namespace baseline {
Status SolveActiveSet(Frame& frame);
}  // namespace baseline
namespace avx2 {
Status SolveActiveSet(Frame& frame);
}  // namespace avx2

}  // namespace tether::qp
