#include "tether/motion/path_checker.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "tether/common/limits.h"
#include "tether/geometry/distance/distance.h"
#include "tether/motion/kernel/sphere_kernel.h"
#include "tether/robot/kinematics.h"

namespace tether::motion {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

// Half of what a point may move between two samples at most, by the crudest bound, m.
constexpr double kGrowth = 0.06;
// The error of a speed in single precision, as a share of the sum of the joints' speeds.
constexpr double kSpeedError = 1e-4;

}  // namespace

struct PathChecker::Work {
  Work(std::shared_ptr<const CollisionScene> compiled, Lanes lanes)
      : scene(std::move(compiled)),
        kernel(lanes == Lanes::kBest && internal::HaveWideKernel() ? internal::CheckSpheresWide
                                                                   : internal::CheckSpheresPlain),
        poses(scene->model().chain(), scene->model().home()),
        part_motion(scene->arm().size()),
        part_curve(scene->arm().size()),
        pair_motion(scene->pairs().size()) {
    const auto& arm = scene->arm();
    const int dof = scene->model().dof();
    const auto parts = static_cast<Eigen::Index>(arm.size());
    const auto pairs = static_cast<Eigen::Index>(scene->pairs().size());
    part_reach = Eigen::MatrixXd::Zero(parts, dof);
    pair_reach = Eigen::MatrixXd::Zero(pairs, dof);
    part_path = part_bend = VectorXd::Zero(parts);
    pair_path = VectorXd::Zero(pairs);
    for (size_t i = 0; i < arm.size(); ++i) {
      for (int j = 0; j < arm[i].link; ++j)
        part_reach(static_cast<Eigen::Index>(i), j) = arm[i].reach[static_cast<size_t>(j)];
    }
    for (Eigen::Index i = 0; i < pairs; ++i) {
      const CollisionScene::PartPair& pair = scene->pairs()[static_cast<size_t>(i)];
      const auto& b = arm[static_cast<size_t>(pair.b)];
      // Joints that move both do not bring them nearer.
      for (int j = arm[static_cast<size_t>(pair.a)].link; j < b.link; ++j)
        pair_reach(i, j) = b.reach[static_cast<size_t>(j)];
    }
  }

  /// Two parts that are looked at exactly; `other` as in internal::KernelAnswer::Unsure.
  struct Near {
    int part = 0, other = 0;
  };

  void SetSegment(const VectorXd& a, const VectorXd& b);
  /// Grows the spheres by what moves while t changes by `half`.
  void SetHalf(double half);
  /// Looks at the first `lanes` of query.t, and all within `half` of them.
  bool CheckLanes(int lanes, double half);
  /// Whether the pairs near[first …] stay apart within `half` of t. Leaves `near` as it was.
  bool CheckExactly(double t, double half, size_t first);
  double Distance(const Near& pair) const;
  /// The most that the pair comes nearer within `half` of t, where `poses` are.
  double Motion(const Near& pair, double half) const;

  std::shared_ptr<const CollisionScene> scene;
  decltype(&internal::CheckSpheresPlain) kernel;
  robot::LinkPoses poses;
  VectorXd begin, along, q;
  internal::KernelSegment segment;
  internal::KernelQuery query;
  internal::KernelAnswer answer;
  Eigen::MatrixXd part_reach, pair_reach;  ///< From the joints' axes, by part or pair and joint, m.
  VectorXd rate;
  VectorXd part_path;  ///< The most that a part moves from t = 0 to 1, m …
  VectorXd part_bend;  ///< … its greatest acceleration, m per unit of t squared …
  VectorXd pair_path;  ///< … and what pairs move relative to each other, m.
  std::vector<float> part_motion, part_curve, pair_motion;
  std::vector<Near> near;
  std::vector<internal::KernelAnswer::Unsure> unsure;
  int64_t checks = 0, exact_checks = 0;
};

void PathChecker::Work::SetSegment(const VectorXd& a, const VectorXd& b) {
  begin = a;
  along = b - a;
  const robot::Chain& chain = scene->model().chain();
  for (int j = 0; j < chain.dof(); ++j) {
    // Single precision is for angles of up to one turn.
    const double from = a[j] - chain.joints[static_cast<size_t>(j)].reference;
    segment.begin[j] = static_cast<float>(std::remainder(from, 2 * M_PI));
    segment.along[j] = static_cast<float>(along[j]);
  }
  rate = along.cwiseAbs();
  part_path.noalias() = part_reach * rate;
  pair_path.noalias() = pair_reach * rate;
  double before = 0;
  for (int j = 0; j < chain.dof(); ++j) {
    // Of two joints' cross terms each bends by the speed that the later one gives.
    const double own = rate[j];
    rate[j] *= 2 * before + own;
    before += own;
  }
  part_bend.noalias() = part_reach * rate;
}

void PathChecker::Work::SetHalf(double half) {
  const auto grown = [&](double motion) {
    return static_cast<float>((motion + scene->clearance()) * (1 + 1e-6));
  };
  for (size_t i = 0; i < part_motion.size(); ++i) {
    const auto part = static_cast<Eigen::Index>(i);
    part_motion[i] = grown(part_path[part] * half);
    part_curve[i] = grown(0.5 * part_bend[part] * half * half + kSpeedError * part_path[part] * half);
  }
  for (size_t i = 0; i < pair_motion.size(); ++i)
    pair_motion[i] = grown(pair_path[static_cast<Eigen::Index>(i)] * half);
  query.half = static_cast<float>(half);
  query.part_motion = part_motion.data();
  query.part_curve = part_curve.data();
  query.pair_motion = pair_motion.data();
}

double PathChecker::Work::Motion(const Near& pair, double half) const {
  if (pair.other < 0) return pair_path[-1 - pair.other] * half;
  const CollisionScene::ArmPart& part = scene->arm()[static_cast<size_t>(pair.part)];
  const Vector3d middle = poses.X_BL(part.link) * part.X_LP.p;
  Vector3d velocity = Vector3d::Zero(), turn = Vector3d::Zero();
  for (int j = 1; j <= part.link; ++j) {
    const math::Pose& X_BL = poses.X_BL(j);
    velocity += along[j - 1] * X_BL.R.col(2).cross(middle - X_BL.p);
    turn += along[j - 1] * X_BL.R.col(2);
  }
  const double speed = velocity.norm() + turn.norm() * part.radius;
  return std::min(part_path[pair.part] * half, (speed + 0.5 * part_bend[pair.part] * half) * half);
}

bool PathChecker::Work::CheckLanes(int lanes, double half) {
  query.lanes = lanes;
  for (int i = lanes; i < internal::kLanes; ++i) query.t[i] = query.t[lanes - 1];
  answer.pairs.clear();
  kernel(scene->tables(), segment, query, answer);
  checks += lanes;
  if (answer.blocked != 0) return false;
  if (answer.unsure == 0) return true;
  for (int lane = 0; lane < lanes; ++lane) {
    if ((answer.unsure >> lane & 1) == 0) continue;
    near.clear();
    for (const auto& pair : answer.pairs) {
      if ((pair.lanes >> lane & 1) != 0) near.push_back({pair.part, pair.other});
    }
    if (!CheckExactly(static_cast<double>(query.t[lane]), half, 0)) return false;
  }
  return true;
}

double PathChecker::Work::Distance(const Near& pair) const {
  const auto place = [&](const CollisionScene::ArmPart& part) { return poses.X_BL(part.link) * part.X_LP; };
  if (pair.other >= 0) {
    const auto& part = scene->arm()[static_cast<size_t>(pair.part)];
    const auto& obstacle = scene->obstacles()[static_cast<size_t>(pair.other)];
    return geometry::SignedDistance(part.primitive, place(part), obstacle.primitive, obstacle.X_BP).distance;
  }
  const CollisionScene::PartPair& parts = scene->pairs()[static_cast<size_t>(-1 - pair.other)];
  const auto &a = scene->arm()[static_cast<size_t>(parts.a)], &b = scene->arm()[static_cast<size_t>(parts.b)];
  return geometry::SignedDistance(a.primitive, place(a), b.primitive, place(b)).distance;
}

bool PathChecker::Work::CheckExactly(double t, double half, size_t first) {
  q = begin + t * along;
  poses.Set(q);
  ++exact_checks;
  const size_t end = near.size();
  double longest = 0;
  for (size_t i = first; i < end; ++i) {
    const double distance = Distance(near[i]) - scene->clearance();
    if (distance <= 0) return false;
    const double motion = Motion(near[i], half);
    if (distance > motion) continue;
    longest = std::max(longest, motion);
    near.push_back(near[i]);
  }
  const bool open = near.size() > end;
  const bool free = !open || (longest > kResolution && CheckExactly(t - half / 2, half / 2, end) &&
                              CheckExactly(t + half / 2, half / 2, end));
  near.resize(end);
  return free;
}

PathChecker::PathChecker(std::shared_ptr<const CollisionScene> scene, Lanes lanes)
    : work_(std::make_unique<Work>(std::move(scene), lanes)) {}
PathChecker::~PathChecker() = default;

bool PathChecker::IsFree(const VectorXd& q) {
  PollLimits();
  work_->SetSegment(q, q);
  work_->SetHalf(0);
  work_->query.t[0] = 0;
  return work_->CheckLanes(1, 0);
}

bool PathChecker::IsFree(const VectorXd& a, const VectorXd& b) {
  PollLimits();
  Work& work = *work_;
  work.SetSegment(a, b);
  const double longest = work.part_path.maxCoeff();
  const int batches = std::max(1, static_cast<int>(std::ceil(longest / (2 * kGrowth * internal::kLanes))));
  const int intervals = batches * internal::kLanes;
  const double half = 0.5 / intervals;
  work.SetHalf(half * (1 + 1e-4));  // `t` is rounded.
  for (int batch = 0; batch < batches; ++batch) {
    // The lanes are spread over the line: what blocks it is found early.
    for (int lane = 0; lane < internal::kLanes; ++lane)
      work.query.t[lane] = static_cast<float>((batch + lane * batches + 0.5) / intervals);
    if (!work.CheckLanes(internal::kLanes, half * (1 + 1e-4))) return false;
  }
  return true;
}

const CollisionScene& PathChecker::scene() const { return *work_->scene; }
int64_t PathChecker::checks() const { return work_->checks; }
int64_t PathChecker::exact_checks() const { return work_->exact_checks; }

std::string PathChecker::Why(const VectorXd& q) const {
  const std::optional<Touch> touch = work_->scene->FindTouch(q);
  return touch ? touch->Text() : "something is too near";
}

}  // namespace tether::motion
