#pragma once

#include "tether/qp/problem.h"
#include "tether/qp/solver.h"

namespace tether::qp {

/// How far a point and multipliers are from the Karush–Kuhn–Tucker conditions of a problem: each residual
/// over the terms that it is the difference of, so that units and scales of rows and variables do not matter.
/// With c_j = max(|x_j|, |(H⁻¹g)_j|), and 0/0 = 0:
struct KktResidual {
  /// Largest entry of |Hx + g − Eᵀλ_E − Aᵀλ_A − λ_x| over that of |H||x| + |g| + |E|ᵀ|λ_E| + |A|ᵀ|λ_A| +
  /// |λ_x|.
  double stationarity = 0;
  /// Largest violation of a row a over |a|ᵀc + |side|.
  double primal = 0;
  /// Largest distance of a row with a multiplier from its active side, over |a|ᵀc + |side|; infinite where
  /// that side is.
  double complementarity = 0;
  double largest() const;
};

/// May allocate.
KktResidual ComputeKktResidual(const Problem& problem, const Eigen::VectorXd& x,
                               const RowWeights& multipliers);

/// The residuals of a proof of infeasibility by Farkas' lemma.
struct FarkasCheck {
  double residual = 0;  ///< ‖Eᵀ y_E + Aᵀ y_A + y_x‖∞
  double gap = 0;       ///< Σ y lower (y > 0) + Σ y upper (y < 0); positive in a proof
  /// Every x that satisfies all constraints has ‖x‖₁ at least this; infinite for an exact proof.
  double radius() const;
};

/// `weights` is Solver::conflict(). May allocate.
FarkasCheck CheckFarkas(const Problem& problem, const RowWeights& weights);

}  // namespace tether::qp
