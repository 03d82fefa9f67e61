#include <algorithm>
#include <cmath>
#include <utility>

#include "tether/nlp/backends.h"
#include "tether/nlp/native/elastic_qp.h"
#include "tether/nlp/native/manifold_view.h"

namespace tether::nlp {
namespace {

constexpr double kFirstPenalty = 10;
constexpr double kLargestPenalty = 1e5;
constexpr double kPenaltyGrowth = 10;
// The penalty grows at once, up to this, where the subproblem leaves more than such a share of the violation.
constexpr double kSteeredPenalty = 300;
constexpr double kSteeredShare = 0.8;
constexpr double kLeastSteered = 1e-3;   // m or rad, in all
constexpr double kBlockingShare = 1e-3;  // of the penalty
constexpr double kLeastDamping = 1e-6;
constexpr double kFirstDamping = 1e-3;
constexpr double kLargestDamping = 1e8;
constexpr double kLongestTurn = 1.2;  // rad, of one pose in one step
constexpr double kAcceptance = 1e-3;  // least share of the predicted decrease
constexpr double kPredictionNoise = 1e-13;
// Nearly converged for this many iterations, of which this many were refused: the iterates only jump across a
// kink.
constexpr int kQuietIterations = 5;
constexpr int kQuietRefusals = 2;
// Practically converged: where rows curve much, Gauss–Newton gains its last digits slowly.
constexpr int kSlowIterations = 5;
constexpr int kCutRounds = 3;
constexpr double kQuietChange = 1e-4;  // of the merit, relative

/// Sequential quadratic programming on the manifold: Gauss–Newton in the cost, exact Jacobians of the rows,
/// an ℓ1 merit function f + ν Σ violation, and Levenberg–Marquardt damping in place of a trust region. The
/// subproblems are elastic, so they always have a solution; where the merit function is stationary though
/// rows are violated, ν grows, and at its largest value the point is locally infeasible.
class NativeRun {
 public:
  NativeRun(const Program& program, const Point& guess, const Options& options, const WarmStart& warm)
      : monitor_(program, options),
        view_(program),
        qp_(view_),
        x_(view_.Start(guess)),
        trial_(x_),
        here_(view_.MakeValues()),
        there_(view_.MakeValues()),
        Hd_(Eigen::VectorXd::Zero(view_.num_coordinates())),
        step_(Hd_),
        Jd_(Eigen::VectorXd::Zero(view_.num_rows())),
        model_rows_(Jd_) {
    qp_.SetStop([this] { return monitor_.ReasonToEnd().has_value(); });
    if (warm.empty()) return;
    if (warm.penalty > 0) penalty_ = std::clamp(warm.penalty, kFirstPenalty, kLargestPenalty);
    damping_ = kLeastDamping;
    qp_.StartFrom(view_.ReadMultipliers(warm));
  }

  Result Run() {
    Iterate();
    Result result =
        monitor_.Finish(std::move(x_), status_, std::move(message_), iterations_, view_.evaluations());
    result.assembly_s = qp_.assembly_s();
    result.linear_algebra_s = subproblem_s_ - qp_.assembly_s();
    const Eigen::VectorXd y = qp_.y();
    view_.WriteMultipliers(y, result.warm_start);
    result.warm_start.penalty = penalty_;
    // At such a penalty the cost's own multipliers are small beside those of conflicting rows.
    if (result.status == Status::kLocallyInfeasible)
      result.blocking_terms = view_.TermsByWeight(y.cwiseAbs(), kBlockingShare * penalty_);
    return result;
  }

 private:
  void End(Status status, const char* message = "") {
    status_ = status;
    message_ = message;
  }

  bool Evaluate(const Point& x, ManifoldView::Values& values) {
    if (monitor_.ReasonToEnd()) return false;
    if (EvaluateView(x, values)) return true;
    monitor_.FailNotFinite(view_.not_finite());
    return false;
  }

  /// A residual that is not finite at a trial point refuses the step, and fails the solve only if no shorter
  /// one helps.
  bool EvaluateTrial() { return !monitor_.ReasonToEnd() && EvaluateView(trial_, there_); }

  bool EvaluateView(const Point& x, ManifoldView::Values& values) {
    const Stopwatch watch(monitor_.evaluation_s());
    return view_.Evaluate(x, values);
  }

  void SolveSubproblem(const Eigen::VectorXd& rows) {
    const Stopwatch watch(subproblem_s_);
    qp_.Solve(here_, rows, penalty_, damping_, QpTolerance());
  }

  double Merit(const ManifoldView::Values& values) const {
    return values.cost + penalty_ * view_.TotalViolation(values.rows);
  }

  /// Sets step_ to the subproblem's step, shortened where it turns a pose too far; returns the decrease of
  /// the merit that the undamped model predicts.
  double Predict(double merit) {
    const double turn = view_.LargestTurn(qp_.d());
    step_ = kLongestTurn / std::max(turn, kLongestTurn) * qp_.d();
    qp_.MultiplyCurvature(here_, step_, Hd_);
    qp_.Multiply(here_, step_, Jd_);
    model_rows_ = here_.rows + Jd_;
    qp_.RaiseToCuts(step_, model_rows_);
    return merit - (here_.cost + here_.gradient.dot(step_) + 0.5 * step_.dot(Hd_) +
                    penalty_ * view_.TotalViolation(model_rows_));
  }

  bool Converged(double predicted, double merit) const {
    // With multipliers y the gradient of the Lagrangian is −(H + λI) d.
    const double slope = step_.size() == 0 ? 0 : (Hd_ + damping_ * step_).cwiseAbs().maxCoeff();
    const double tolerance = monitor_.cost_tolerance();
    return (slope <= tolerance && predicted <= tolerance * (1 + merit)) ||
           predicted <= kPredictionNoise * (1 + merit) || slow_iterations_ >= kSlowIterations;
  }

  void NoteProgress(double predicted, double merit, bool accepted) {
    const bool quiet = predicted <= kQuietChange * (1 + merit);
    quiet_iterations_ = quiet ? quiet_iterations_ + 1 : 0;
    slow_iterations_ = predicted <= 1e-2 * monitor_.cost_tolerance() * (1 + merit) ? slow_iterations_ + 1 : 0;
    quiet_refusals_ = quiet ? quiet_refusals_ + (accepted ? 0 : 1) : 0;
  }

  /// Where the model itself stays far from feasible, the penalty may be too small: raising it now is cheaper
  /// than after convergence (Byrd, Nocedal and Waltz, "Steering exact penalty methods", 2008).
  bool SteerPenalty() {
    if (penalty_ >= kSteeredPenalty) return false;
    const double left = view_.TotalViolation(model_rows_);
    if (left <= std::max(kLeastSteered, kSteeredShare * view_.TotalViolation(here_.rows))) return false;
    penalty_ = std::min(kSteeredPenalty, kPenaltyGrowth * penalty_);
    return true;
  }

  void GrowPenalty() {
    penalty_ *= kPenaltyGrowth;
    damping_ = std::min(damping_, kFirstDamping);
    quiet_iterations_ = quiet_refusals_ = slow_iterations_ = 0;
  }

  void Iterate() {
    if (!Evaluate(x_, here_)) return;
    Record();
    for (;;) {
      if (monitor_.ReasonToEnd()) return;
      const double merit = Merit(here_);
      SolveSubproblem(here_.rows);
      if (monitor_.ReasonToEnd()) return;
      if (!qp_.d().allFinite()) return End(Status::kFailed, "the subproblem broke down");
      const double predicted = Predict(merit);
      if (SteerPenalty()) continue;
      const bool settled = damping_ > kLargestDamping ||
                           (quiet_iterations_ >= kQuietIterations && quiet_refusals_ >= kQuietRefusals);
      if (settled || Converged(predicted, merit)) {
        if (!settled && qp_.DropOldCuts()) continue;
        if (settled && !view_.not_finite().empty()) return monitor_.FailNotFinite(view_.not_finite());
        if (view_.Violation(here_.rows) <= monitor_.constraint_tolerance())
          return End(Status::kSolved, settled ? "settled" : "");
        if (penalty_ >= kLargestPenalty) return End(Status::kLocallyInfeasible);
        GrowPenalty();
        continue;
      }
      if (iterations_ >= monitor_.max_iterations()) return End(Status::kIterationLimit);
      ++iterations_;
      const bool accepted = TryStep(merit, predicted);
      if (monitor_.ReasonToEnd()) return;
      NoteProgress(predicted, merit, accepted);
      // With new cuts the next step differs already.
      cut_rounds_ = !accepted && cuts_added_ > 0 ? cut_rounds_ + 1 : 0;
      if (!accepted && (cut_rounds_ == 0 || cut_rounds_ > kCutRounds))
        damping_ = std::max(damping_ * 8, kFirstDamping);
    }
  }

  /// Moves to the trial point if it is good enough. If not, adds cuts from it.
  bool TryStep(double merit, double predicted) {
    cuts_added_ = 0;
    view_.Move(x_, step_, 1, trial_);
    if (!EvaluateTrial()) return false;
    double ratio = (merit - Merit(there_)) / predicted;
    if (ratio < kAcceptance) {
      // Perhaps only the rows' curvature and kinks prevent it: a second-order correction, with the rows'
      // values at the trial point.
      cuts_added_ = qp_.AddCuts(there_, step_, model_rows_);
      for (int row = 0; row < view_.num_rows(); ++row)
        model_rows_[row] = qp_.HasFreshCut(row) ? here_.rows[row] : there_.rows[row] - Jd_[row];
      SolveSubproblem(model_rows_);
      // A correction compensates for what the model lacks, so the model would refuse it: it is compared with
      // the decrease predicted for the step before it. With cuts the model itself has changed.
      const double corrected = Predict(merit);
      if (cuts_added_ > 0) predicted = corrected;
      if (predicted <= 0) return false;
      view_.Move(x_, step_, 1, trial_);
      if (!EvaluateTrial()) return false;
      ratio = (merit - Merit(there_)) / predicted;
      if (ratio < kAcceptance) {
        cuts_added_ += qp_.AddCuts(there_, step_, model_rows_);
        return false;
      }
    }
    if (ratio > 0.75) damping_ = std::max(kLeastDamping, damping_ / 5);
    if (ratio < 0.25) damping_ = std::max(2 * damping_, kFirstDamping);
    std::swap(x_, trial_);
    std::swap(here_, there_);
    qp_.MoveCuts(step_);
    Record();
    return true;
  }

  void Record() {
    if (!monitor_.WantsRecord(iterations_)) return;
    monitor_.Record(iterations_, here_.cost, view_.Violation(here_.rows, Unit::kMetre),
                    view_.Violation(here_.rows, Unit::kRadian));
  }

  /// Multipliers grow with the penalty, and the subproblem's errors with them.
  double QpTolerance() const { return 1e-10 * penalty_; }

  Monitor monitor_;
  ManifoldView view_;
  ElasticQp qp_;
  Point x_, trial_;
  ManifoldView::Values here_, there_;
  Eigen::VectorXd Hd_, step_, Jd_, model_rows_;
  double penalty_ = kFirstPenalty;
  double damping_ = kFirstDamping;
  int quiet_iterations_ = 0;
  int quiet_refusals_ = 0;
  int slow_iterations_ = 0;
  int cuts_added_ = 0;  // in the last iteration
  int cut_rounds_ = 0;  // iterations in a row that were refused and added cuts
  int iterations_ = 0;
  double subproblem_s_ = 0;
  Status status_ = Status::kFailed;
  std::string message_;
};

class NativeSolver : public Solver {
 protected:
  Result DoSolve(const Program& program, const Point& guess, const Options& options,
                 const WarmStart& warm) const override {
    return NativeRun(program, guess, options, warm).Run();
  }
};

}  // namespace

std::unique_ptr<Solver> MakeNativeSolver() { return std::make_unique<NativeSolver>(); }

}  // namespace tether::nlp
