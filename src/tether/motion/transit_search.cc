#include "tether/motion/transit_search.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <Eigen/Eigenvalues>

#include "tether/common/limits.h"
#include "tether/common/random.h"
#include "tether/robot/posture.h"

namespace tether::motion {
namespace {

using Eigen::VectorXd;
using math::Pose;

// Shares of the wanted clearance that are tried one after the other.
constexpr double kShares[] = {1, 0.4, 0.1};
// Configurations keep this from the joints' limits, rad.
constexpr double kLimitMargin = 0.03;
// IK solutions nearer to each other than this are the same, rad.
constexpr double kSame = 0.15;
// Along straight motions: the distance of samples, m, and the most that a joint turns between two, rad.
constexpr double kSpacing = 0.03;
constexpr double kMostTurn = 0.6;
// What an IK solution costs whose joints are at a limit, and one that is singular, s; below this distance
// from a limit, rad, or this least mobility of the hand, m/rad.
constexpr double kLimitCost = 0.5, kLimitRoom = 0.25;
constexpr double kSingularCost = 1, kSingular = 0.05, kRotationWeight = 0.2;
// The share of the checks that may go to the preferred IK solution alone, and to the first goal's.
constexpr double kPreferred = 0.25;
// The ends of a known path are replaced if they are no further than this, rad.
constexpr double kKnown = 0.3;
// Rounds of cutting corners.
constexpr int kSmoothing = 3;
// How far trees grow at once where what is held stays upright, rad.
constexpr double kTiltRange = 0.4, kTiltResolution = 0.03;
// Leaving a start that touches: the deepest, m, steps of that many rad, and how many.
constexpr double kDeepest = 0.02, kEscapeStep = 0.02;
constexpr int kEscapeSteps = 20;

struct IkCandidate {
  VectorXd q, end;
  int goal = 0;
  double cost = 0;  // s
  bool preferred = false;
};

class TransitSearch {
 public:
  explicit TransitSearch(const TransitProblem& problem)
      : problem_(problem), model_(*problem.snapshot.model), solver_(problem.snapshot.model) {
    robot::NarrowLimits(model_, kLimitMargin, posture_problem_.lower, posture_problem_.upper);
    for (const Obstacle& obstacle : problem.snapshot.obstacles) {
      for (const geometry::Part& part : obstacle.shape.parts) {
        posture_problem_.obstacles.emplace_back(part, obstacle.X_BO, true);
        names_.push_back(obstacle.name);
      }
    }
    posture_problem_.clearance = problem.snapshot.clearance;
  }

  Transit Run() {
    FindCandidates();
    if (problem_.tilt) KeepTilt();
    if (candidates_.empty()) {
      transit_.status = PathStatus::kNoFreeGoal;
      transit_.reason = "no joint angles were found for the hand there";
      if (!in_the_way_.empty()) transit_.reason += ": links would be inside " + in_the_way_;
      transit_.blocker = in_the_way_;
      return std::move(transit_);
    }
    for (const double share : kShares) {
      Snapshot snapshot = problem_.snapshot;
      snapshot.clearance *= share;
      scene_ = CollisionScene::Compile(snapshot);
      transit_.clearance = snapshot.clearance;
      const bool last = share == kShares[std::size(kShares) - 1];
      if (Search(last)) break;
    }
    return std::move(transit_);
  }

 private:
  /// A tilt that the start or every goal exceeds is none that a path could keep.
  void KeepTilt() {
    TiltManifold manifold(problem_.snapshot.model, *problem_.tilt);
    if (!manifold.Holds(problem_.start)) return;
    std::vector<IkCandidate> kept;
    for (const IkCandidate& candidate : candidates_) {
      if (manifold.Holds(candidate.q)) kept.push_back(candidate);
    }
    if (kept.empty()) return;
    candidates_ = std::move(kept);
    tilt_.emplace(problem_.snapshot.model, *problem_.tilt);
  }

  /// Costs of being at `q`, in seconds of detour.
  double CostOf(const VectorXd& q) {
    double cost = (q - problem_.start).cwiseAbs().cwiseQuotient(model_.max_velocity()).maxCoeff();
    const double room = std::min((q - model_.lower()).minCoeff(), (model_.upper() - q).minCoeff());
    cost += kLimitCost * std::clamp(1 - room / kLimitRoom, 0.0, 1.0);
    const robot::LinkPoses poses(model_.chain(), q);
    Eigen::MatrixXd J(6, q.size());
    poses.HandJacobian(J);
    J.bottomRows(3) *= kRotationWeight;
    const math::Matrix6d JJt = J * J.transpose();
    const Eigen::SelfAdjointEigenSolver<math::Matrix6d> eigen(JJt, Eigen::EigenvaluesOnly);
    const double least = std::sqrt(std::max(0.0, eigen.eigenvalues()[0]));
    return cost + kSingularCost * std::clamp(1 - least / kSingular, 0.0, 1.0);
  }

  bool Solve(const Pose& X_BH, const VectorXd& from, const VectorXd& rest, robot::Posture* posture) {
    posture_problem_.X_BH = X_BH;
    posture_problem_.rest = rest;
    posture->q = from;
    PollLimitsNow();
    solver_.Solve(posture_problem_, *posture);
    return posture->reaches() && posture->distance >= 0;
  }

  /// Whether the arm can follow straight lines from a goal on, joints turning steadily.
  bool FollowsThen(const TransitGoal& goal, const VectorXd& from, VectorXd* end) {
    VectorXd& q = *end;
    q = from;
    Pose X = goal.X_BH;
    for (const Pose& next : goal.then) {
      const Pose between = math::Between(X, next);
      const math::Vector6d whole = math::LogSE3(between);
      const int steps = std::max(1, static_cast<int>(std::ceil(between.p.norm() / kSpacing)));
      for (int i = 1; i <= steps; ++i) {
        robot::Posture posture;
        posture_problem_.X_BH = X * math::ExpSE3(whole * (static_cast<double>(i) / steps));
        posture_problem_.rest = q;
        posture.q = q;
        PollLimits();
        solver_.Solve(posture_problem_, posture, 25);
        if (posture.position_error > 1e-3 || posture.rotation_error > 5e-3 ||
            (posture.q - q).cwiseAbs().maxCoeff() > kMostTurn)
          return false;
        q = posture.q;
      }
      X = next;
    }
    return true;
  }

  void FindCandidates() {
    const double clearance = posture_problem_.clearance;
    Random random(problem_.seed);
    VectorXd home = model_.home();
    for (size_t g = 0; g < problem_.goals.size(); ++g) {
      const TransitGoal& goal = problem_.goals[g];
      const auto attempt = [&](const VectorXd& from, const VectorXd& rest, bool preferred) {
        robot::Posture posture;
        if (!Solve(goal.X_BH, from, rest, &posture)) {
          if (posture.reaches() && posture.obstacle >= 0 && in_the_way_.empty())
            in_the_way_ = names_[static_cast<size_t>(posture.obstacle)];
          return;
        }
        for (const IkCandidate& known : candidates_) {
          if (known.goal == static_cast<int>(g) && (known.q - posture.q).cwiseAbs().maxCoeff() < kSame)
            return;
        }
        VectorXd end;
        if (!FollowsThen(goal, posture.q, &end)) return;
        candidates_.push_back({posture.q, end, static_cast<int>(g), CostOf(posture.q), preferred});
      };
      // Straight ahead: joint 1 looks at the hand.
      home[0] = std::clamp(std::atan2(goal.X_BH.p.y(), goal.X_BH.p.x()), posture_problem_.lower[0],
                           posture_problem_.upper[0]);
      if (goal.near.size() == home.size()) attempt(goal.near, goal.near, true);
      if (!candidates_.empty() && candidates_.back().preferred) continue;
      attempt(problem_.start, home, false);
      attempt(home, home, false);
      for (int i = 0; i < problem_.random_starts; ++i) {
        VectorXd q(home.size());
        for (Eigen::Index j = 0; j < q.size(); ++j)
          q[j] = random.Uniform(posture_problem_.lower[j], posture_problem_.upper[j]);
        attempt(q, q, false);
      }
    }
    posture_problem_.clearance = clearance;
    std::stable_sort(candidates_.begin(), candidates_.end(), [](const IkCandidate& a, const IkCandidate& b) {
      return a.preferred != b.preferred ? a.preferred : a.goal != b.goal ? a.goal < b.goal : a.cost < b.cost;
    });
  }

  /// One step after another away from what is touched, until nothing is. Empty: that does not help.
  std::vector<VectorXd> Escape(const VectorXd& from) const {
    std::vector<VectorXd> path{from};
    VectorXd q = from;
    std::optional<Touch> touch = scene_->FindTouch(q);
    if (!touch || touch->distance < -kDeepest) return {};
    for (int step = 0; step < kEscapeSteps; ++step) {
      VectorXd gradient(q.size());
      for (Eigen::Index i = 0; i < q.size(); ++i) {
        VectorXd moved = q;
        moved[i] += 1e-4;
        const std::optional<Touch> there = scene_->FindTouch(moved);
        gradient[i] = (there ? there->distance : scene_->clearance()) - touch->distance;
      }
      if (gradient.norm() < 1e-12) return {};
      q = (q + gradient * (kEscapeStep / gradient.norm())).cwiseMax(model_.lower()).cwiseMin(model_.upper());
      const std::optional<Touch> next = scene_->FindTouch(q);
      if (next && next->distance < touch->distance) return {};
      path.push_back(q);
      if (!next) return path;
      touch = next;
    }
    return {};
  }

  Path Find(const VectorXd& start, const std::vector<const IkCandidate*>& to, int64_t checks) {
    PathProblem path_problem;
    path_problem.scene = scene_;
    path_problem.lower = posture_problem_.lower;
    path_problem.upper = posture_problem_.upper;
    path_problem.start = start;
    for (const IkCandidate* candidate : to) path_problem.goals.push_back(candidate->q);
    path_problem.seed = problem_.seed;
    path_problem.max_checks = checks;
    path_problem.smoothing = kSmoothing;
    if (tilt_) {
      path_problem.tilt = problem_.tilt;
      path_problem.model = problem_.snapshot.model;
      path_problem.range = kTiltRange;
    }
    Path path = FindPath(path_problem);
    transit_.checks += path.checks;
    return path;
  }

  /// With the present scene. `last`: with no less clearance will it be tried again.
  bool Search(bool last) {
    PathChecker checker(scene_);
    std::vector<VectorXd> lead;
    VectorXd start = problem_.start;
    if (!checker.IsFree(start)) {
      if (!last) return Note(PathStatus::kStartNotFree, start);
      lead = Escape(start);
      if (lead.empty() || !checker.IsFree(lead.back())) return Note(PathStatus::kStartNotFree, start);
      start = lead.back();
      lead.pop_back();
    }
    std::vector<const IkCandidate*> free, preferred;
    for (const IkCandidate& candidate : candidates_) {
      if (!checker.IsFree(candidate.q)) continue;
      free.push_back(&candidate);
      if (candidate.preferred) preferred.push_back(&candidate);
    }
    transit_.checks += checker.checks();
    if (free.empty()) return Note(PathStatus::kNoFreeGoal, candidates_.front().q);
    if (TryKnown(checker, start, *free.front())) {
      Keep(*free.front(), std::move(lead), {});
      return true;
    }
    // The best of the first goal alone; then all of it; then all.
    std::vector<std::vector<const IkCandidate*>> rounds;
    if (!preferred.empty()) rounds.push_back({preferred.front()});
    std::vector<const IkCandidate*> first;
    for (const IkCandidate* candidate : free) {
      if (candidate->goal == free.front()->goal) first.push_back(candidate);
    }
    if (first.size() > rounds.size()) rounds.push_back(first);
    if (free.size() > first.size()) rounds.push_back(free);
    // Of what is left, half is kept for less clearance.
    const double left = static_cast<double>(problem_.max_checks - transit_.checks) * (last ? 1 : 0.5);
    for (size_t round = 0; round < rounds.size(); ++round) {
      const bool end = round + 1 == rounds.size();
      const auto checks = static_cast<int64_t>(left * (end ? 1 - kPreferred : kPreferred));
      Path path = Find(start, rounds[round], checks);
      if (path.status != PathStatus::kFound) {
        transit_.status = path.status;
        transit_.reason = path.reason;
        continue;
      }
      Keep(*rounds[round][static_cast<size_t>(path.goal)], std::move(lead), std::move(path.q));
      return true;
    }
    return false;
  }

  /// The known path with other ends, into transit_.path, if it is free.
  bool TryKnown(PathChecker& checker, const VectorXd& start, const IkCandidate& goal) {
    std::vector<VectorXd> path = problem_.known;
    if (path.size() < 2 || goal.goal != 0) return false;
    const bool fits = (path.front() - start).cwiseAbs().maxCoeff() < kKnown &&
                      (path.back() - goal.q).cwiseAbs().maxCoeff() < kKnown;
    if (!fits) return false;
    path.front() = start;
    path.back() = goal.q;
    std::optional<TiltChecker> upright;
    if (tilt_) upright.emplace(checker, *tilt_, kTiltResolution);
    LineChecker& all = upright ? static_cast<LineChecker&>(*upright) : checker;
    for (size_t i = 0; i + 1 < path.size(); ++i) {
      if (!all.IsFree(path[i], path[i + 1])) return false;
    }
    transit_.path = std::move(path);
    return true;
  }

  void Keep(const IkCandidate& goal, std::vector<VectorXd> lead, std::vector<VectorXd> path) {
    transit_.status = PathStatus::kFound;
    transit_.reason.clear();
    transit_.blocker.clear();
    transit_.goal = goal.goal;
    transit_.near = goal.preferred;
    transit_.end = goal.end;
    if (path.empty()) path = std::move(transit_.path);
    transit_.path = std::move(lead);
    transit_.path.insert(transit_.path.end(), path.begin(), path.end());
  }

  bool Note(PathStatus status, const VectorXd& q) {
    transit_.status = status;
    const std::optional<Touch> touch = scene_->FindTouch(q);
    transit_.reason =
        status == PathStatus::kStartNotFree ? "where the arm stands, " : "where the hand goes, ";
    transit_.reason += touch ? touch->Text() : std::string("something is too near");
    transit_.blocker = touch ? touch->b : "";
    return false;
  }

  const TransitProblem& problem_;
  const robot::Model& model_;
  robot::PostureSolver solver_;
  robot::PostureProblem posture_problem_;
  std::vector<std::string> names_;  // of the parts in posture_problem_.obstacles
  std::string in_the_way_;
  std::vector<IkCandidate> candidates_;
  std::shared_ptr<const CollisionScene> scene_;
  std::optional<TiltManifold> tilt_;  // That the path keeps.
  Transit transit_;
};

}  // namespace

void EndAbove(TransitGoal& goal, const Eigen::Vector3d& up_B) {
  constexpr double kRise = 0.02;  // m
  goal.then.insert(goal.then.begin(), goal.X_BH);
  goal.X_BH.p += kRise * up_B;
}

Transit FindTransit(const TransitProblem& problem) {
  assert(!problem.goals.empty() && problem.snapshot.model != nullptr);
  return TransitSearch(problem).Run();
}

double LeastClearance(const Snapshot& snapshot, const std::vector<VectorXd>& path, double most) {
  constexpr double kStep = 0.05;  // rad
  Snapshot wide = snapshot;
  wide.clearance = most;
  const auto scene = CollisionScene::Compile(wide);
  double least = most;
  for (size_t i = 0; i < path.size(); ++i) {
    const VectorXd& from = path[i > 0 ? i - 1 : 0];
    const int steps =
        std::max(1, static_cast<int>(std::ceil((path[i] - from).cwiseAbs().maxCoeff() / kStep)));
    for (int k = 1; k <= steps; ++k) {
      const std::optional<Touch> touch =
          scene->FindTouch(from + (path[i] - from) * (static_cast<double>(k) / steps));
      if (touch) least = std::min(least, touch->distance);
    }
  }
  return least;
}

}  // namespace tether::motion
