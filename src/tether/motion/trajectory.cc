#include "tether/motion/trajectory.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace tether::motion {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Distance of the samples, s.
constexpr double kPeriod = 0.004;
// Windows of the two moving averages, in samples: the first bounds accelerations, the second jerks.
constexpr int kFirstWindow = 24, kSecondWindow = 12;
// Shares of the accelerations that pieces and the corners between them get before both are stretched.
constexpr double kPieceShare = 0.8, kCornerShare = 0.7;
// Pieces shorter than this are none, rad.
constexpr double kLeastPiece = 1e-7;

/// A straight piece of the path, in units of s: its parameter runs at ds/dt ≤ 1.
struct Piece {
  VectorXd from, rate;  ///< q = from + s · rate: |rate| is at most the velocity limit.
  double length = 0;    ///< s
  double acceleration = 0;
  double begin_speed = 0, end_speed = 0;
};

std::vector<Piece> MakePieces(const std::vector<VectorXd>& path, const JointLimits& limits) {
  std::vector<Piece> pieces;
  for (size_t i = 0; i + 1 < path.size(); ++i) {
    const VectorXd along = path[i + 1] - path[i];
    if (along.cwiseAbs().maxCoeff() < kLeastPiece) continue;
    Piece piece;
    piece.from = path[i];
    piece.length = along.cwiseAbs().cwiseQuotient(limits.velocity).maxCoeff();
    piece.rate = along / piece.length;
    piece.acceleration = kPieceShare / piece.rate.cwiseAbs().cwiseQuotient(limits.acceleration).maxCoeff();
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

/// Speeds at the corners: what the first moving average turns into a bounded acceleration, and what can be
/// reached and braked along the pieces.
void SetSpeeds(std::vector<Piece>& pieces, const JointLimits& limits, Corners corners) {
  const double window = kPeriod * kFirstWindow;
  for (size_t i = 0; i + 1 < pieces.size(); ++i) {
    const double jump = (pieces[i + 1].rate - pieces[i].rate)
                            .cwiseAbs()
                            .cwiseQuotient(limits.acceleration * window)
                            .maxCoeff();
    const double speed = corners == Corners::kStop ? 0 : std::min(1.0, kCornerShare / std::max(jump, 1e-9));
    pieces[i].end_speed = pieces[i + 1].begin_speed = speed;
  }
  for (size_t i = 0; i < pieces.size(); ++i) {
    Piece& piece = pieces[i];
    piece.end_speed = std::min(piece.end_speed, std::sqrt(piece.begin_speed * piece.begin_speed +
                                                          2 * piece.acceleration * piece.length));
    if (i + 1 < pieces.size()) pieces[i + 1].begin_speed = piece.end_speed;
  }
  for (size_t i = pieces.size(); i-- > 0;) {
    Piece& piece = pieces[i];
    piece.begin_speed = std::min(piece.begin_speed, std::sqrt(piece.end_speed * piece.end_speed +
                                                              2 * piece.acceleration * piece.length));
    if (i > 0) pieces[i - 1].end_speed = piece.begin_speed;
  }
}

/// When a piece accelerates, runs and brakes.
struct Phases {
  double up = 0, flat = 0, down = 0;  ///< s
  double top = 0;                     ///< ds/dt
  double total() const { return up + flat + down; }
};

Phases PhasesOf(const Piece& piece) {
  Phases phases;
  const double a = piece.acceleration, v0 = piece.begin_speed, v1 = piece.end_speed;
  phases.top = std::min(1.0, std::sqrt(std::max(0.0, a * piece.length + 0.5 * (v0 * v0 + v1 * v1))));
  phases.top = std::max({phases.top, v0, v1});
  phases.up = (phases.top - v0) / a;
  phases.down = (phases.top - v1) / a;
  const double rest =
      piece.length - 0.5 * (v0 + phases.top) * phases.up - 0.5 * (phases.top + v1) * phases.down;
  phases.flat = std::max(0.0, rest) / phases.top;
  return phases;
}

double PlaceAt(const Piece& piece, const Phases& phases, double t) {
  const double a = piece.acceleration;
  if (t < phases.up) return piece.begin_speed * t + 0.5 * a * t * t;
  const double left = phases.total() - t;
  if (left < phases.down) return piece.length - piece.end_speed * left - 0.5 * a * left * left;
  return piece.begin_speed * phases.up + 0.5 * a * phases.up * phases.up + phases.top * (t - phases.up);
}

/// Samples of the pieces one after the other, with `lead` samples of rest before and after; with stops, at
/// each corner too.
MatrixXd Sample(const std::vector<Piece>& pieces, const VectorXd& end, int lead, Corners corners) {
  std::vector<Phases> phases;
  double total = 0;
  const double stop = corners == Corners::kStop ? lead * kPeriod : 0;
  for (const Piece& piece : pieces) {
    phases.push_back(PhasesOf(piece));
    total += phases.back().total() + stop;
  }
  const auto count = static_cast<Index>(std::ceil(total / kPeriod)) + 1;
  MatrixXd q(end.size(), count + 2 * lead);
  size_t i = 0;
  double begin = 0;
  for (Index k = 0; k < q.cols(); ++k) {
    const double t = static_cast<double>(k - lead) * kPeriod;
    while (i < pieces.size() && t >= begin + phases[i].total() + stop) begin += phases[i++].total() + stop;
    if (i == pieces.size()) {
      q.col(k) = end;
      continue;
    }
    const double s =
        std::clamp(PlaceAt(pieces[i], phases[i], std::clamp(t - begin, 0.0, phases[i].total())), 0.0,
                   pieces[i].length);
    q.col(k) = pieces[i].from + s * pieces[i].rate;
  }
  return q;
}

/// The mean over `window` samples up to each.
MatrixXd Average(const MatrixXd& q, int window) {
  MatrixXd mean(q.rows(), q.cols());
  VectorXd sum = q.col(0) * window;
  for (Index k = 0; k < q.cols(); ++k) {
    sum += q.col(k) - q.col(std::max<Index>(0, k - window));
    mean.col(k) = sum / window;
  }
  return mean;
}

}  // namespace

JointLimits LimitsOf(const robot::Model& model, double velocity_share, double acceleration_share,
                     double jerk_share) {
  return {velocity_share * model.max_velocity(), acceleration_share * model.max_acceleration(),
          jerk_share * model.max_jerk()};
}

Trajectory::Trajectory(MatrixXd q, double period) : q_(std::move(q)), period_(period) {
  assert(q_.cols() >= 2 && period > 0);
}

void Trajectory::Evaluate(double time, JointReference* at) const {
  assert(!empty());
  const Index last = q_.cols() - 1;
  const double place = std::clamp(time / period_, 0.0, static_cast<double>(last));
  const Index k = std::min(static_cast<Index>(place), last - 1);
  const double u = place - static_cast<double>(k);
  at->q.resize(q_.rows());
  at->v.resize(q_.rows());
  at->a.resize(q_.rows());
  const bool rests = time <= 0 || time >= duration();
  // Catmull-Rom: slopes from the neighbours.
  const Index before = std::max<Index>(0, k - 1), after = std::min(last, k + 2);
  for (Index i = 0; i < q_.rows(); ++i) {
    const double a = q_(i, k), b = q_(i, k + 1);
    const double slope_a = 0.5 * (b - q_(i, before)), slope_b = 0.5 * (q_(i, after) - a);
    const double c2 = 3 * (b - a) - 2 * slope_a - slope_b, c3 = 2 * (a - b) + slope_a + slope_b;
    at->q[i] = a + u * (slope_a + u * (c2 + u * c3));
    at->v[i] = rests ? 0 : (slope_a + u * (2 * c2 + 3 * u * c3)) / period_;
    // Of the samples, which is smoother than that of the pieces.
    const double second_a = k > 0 ? q_(i, k - 1) - 2 * a + b : 0;
    const double second_b = k + 2 <= last ? a - 2 * b + q_(i, k + 2) : 0;
    at->a[i] = rests ? 0 : ((1 - u) * second_a + u * second_b) / (period_ * period_);
  }
}

double Trajectory::StretchFor(const JointLimits& limits) const {
  double velocity = 0, acceleration = 0, jerk = 0;
  for (Index k = 0; k + 1 < q_.cols(); ++k) {
    for (Index i = 0; i < q_.rows(); ++i) {
      const double first = q_(i, k + 1) - q_(i, k);
      velocity = std::max(velocity, std::abs(first) / (period_ * limits.velocity[i]));
      if (k + 2 >= q_.cols()) continue;
      const double second = q_(i, k + 2) - 2 * q_(i, k + 1) + q_(i, k);
      acceleration = std::max(acceleration, std::abs(second) / (period_ * period_ * limits.acceleration[i]));
      if (k + 3 >= q_.cols()) continue;
      const double third = q_(i, k + 3) - 3 * q_(i, k + 2) + 3 * q_(i, k + 1) - q_(i, k);
      jerk = std::max(jerk, std::abs(third) / (period_ * period_ * period_ * limits.jerk[i]));
    }
  }
  return std::max({velocity, std::sqrt(acceleration), std::cbrt(jerk)});
}

Trajectory TimePath(const std::vector<VectorXd>& path, const JointLimits& limits, Corners corners) {
  assert(!path.empty());
  std::vector<Piece> pieces = MakePieces(path, limits);
  if (pieces.empty()) {
    MatrixXd q(path.back().size(), 2);
    q.col(0) = q.col(1) = path.back();
    return {std::move(q), kPeriod};
  }
  SetSpeeds(pieces, limits, corners);
  const int lead = kFirstWindow + kSecondWindow;
  const MatrixXd raw = Sample(pieces, path.back(), lead, corners);
  const MatrixXd smooth = Average(Average(raw, kFirstWindow), kSecondWindow);
  // The averages lag by half their windows: rest before the motion is left out.
  const Index first = lead - 1;
  Trajectory trajectory(smooth.rightCols(smooth.cols() - first), kPeriod);
  const double factor = trajectory.StretchFor(limits);
  if (factor > 1) trajectory.Stretch(factor);
  return trajectory;
}

void StretchForLoad(const LoadLimits& limits, robot::State& state, Trajectory* trajectory) {
  // Samples that are looked at.
  constexpr int kLooks = 24;
  constexpr int kRounds = 2;
  const robot::Model& model = state.model();
  const Index n = model.dof();
  JointReference at{VectorXd::Zero(n), VectorXd::Zero(n), VectorXd::Zero(n)};
  const VectorXd rest = VectorXd::Zero(n);
  VectorXd gravity(n), torque(n);
  for (int round = 0; round < kRounds; ++round) {
    double factor = 1;
    Eigen::Vector3d v_before = Eigen::Vector3d::Zero();
    const double step = trajectory->duration() / kLooks;
    if (step <= 0) return;
    for (int look = 1; look <= kLooks; ++look) {
      trajectory->Evaluate(look * step, &at);
      state.Set(at.q, rest);
      gravity = state.bias();
      state.Set(at.q, at.v);
      torque.noalias() = state.M() * at.a;
      torque += state.bias() - gravity;
      const Eigen::Vector3d v_hand = state.J_BH().topRows(3) * at.v;
      const Eigen::Vector3d a_hand = (v_hand - v_before) / step;
      v_before = v_hand;
      if (limits.payload > 0) {
        const Eigen::Vector3d arm = state.X_BH().R * limits.p_HC;
        const Eigen::Vector3d force = limits.payload * a_hand, weight(0, 0, limits.payload * robot::kGravity);
        torque += state.J_BH().topRows(3).transpose() * force +
                  state.J_BH().bottomRows(3).transpose() * arm.cross(force);
        gravity += state.J_BH().topRows(3).transpose() * weight +
                   state.J_BH().bottomRows(3).transpose() * arm.cross(weight);
      }
      for (Index i = 0; i < n; ++i) {
        // Where gravity alone needs nearly all, a tenth is left to move with.
        const double most = model.max_torque()[i];
        const double room = std::max(limits.torque_share * most - std::abs(gravity[i]), 0.1 * most);
        factor = std::max(factor, std::sqrt(std::abs(torque[i]) / room));
      }
      factor = std::max({factor, v_hand.norm() / limits.hand_speed,
                         std::sqrt(a_hand.norm() / limits.hand_acceleration)});
    }
    if (factor <= 1.001) return;
    trajectory->Stretch(factor);
  }
}

}  // namespace tether::motion
