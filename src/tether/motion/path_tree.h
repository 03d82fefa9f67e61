#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "tether/common/random.h"

/// What searches with two trees of configurations share; not for users of the room.
namespace tether::motion {

/// A tree of configurations, each joined to its parent by a straight line that is free.
class PathTree {
 public:
  explicit PathTree(Eigen::Index dof) : dof_(static_cast<size_t>(dof)) {}

  /// The new node's index. `root`: of its tree, where there are several; a root has the parent −1.
  int Add(const Eigen::VectorXd& q, int parent, int root = 0) {
    q_.insert(q_.end(), q.data(), q.data() + q.size());
    nodes_.push_back({parent, root, std::numeric_limits<double>::infinity()});
    return size() - 1;
  }
  int size() const { return static_cast<int>(nodes_.size()); }
  int root(int node) const { return nodes_[static_cast<size_t>(node)].root; }
  /// Within which it is extended, for dynamic domains, rad; infinite at first.
  double& radius(int node) { return nodes_[static_cast<size_t>(node)].radius; }
  Eigen::VectorXd q(int node) const {
    return Eigen::Map<const Eigen::VectorXd>(q_.data() + static_cast<size_t>(node) * dof_,
                                             static_cast<Eigen::Index>(dof_));
  }
  int Nearest(const Eigen::VectorXd& q, double* distance = nullptr) const {
    int nearest = 0;
    double least = std::numeric_limits<double>::infinity();
    const double* at = q_.data();
    for (int i = 0; i < size(); ++i, at += dof_) {
      double squared = 0;
      for (size_t j = 0; j < dof_; ++j) squared += (at[j] - q.data()[j]) * (at[j] - q.data()[j]);
      if (squared >= least) continue;
      least = squared;
      nearest = i;
    }
    if (distance != nullptr) *distance = std::sqrt(least);
    return nearest;
  }
  /// From a node to its root, both included.
  std::vector<Eigen::VectorXd> ToRoot(int node) const {
    std::vector<Eigen::VectorXd> path;
    for (; node >= 0; node = nodes_[static_cast<size_t>(node)].parent) path.push_back(q(node));
    return path;
  }

 private:
  struct Node {
    int parent = -1, root = 0;
    double radius = 0;
  };
  size_t dof_;
  std::vector<double> q_;  // one after the other
  std::vector<Node> nodes_;
};

/// The path from the root of one tree over the nodes at which both met to the root of the other.
inline std::vector<Eigen::VectorXd> JoinTrees(const PathTree& from_start, int in_start_tree,
                                              const PathTree& from_goals, int in_goal_tree) {
  std::vector<Eigen::VectorXd> path = from_start.ToRoot(in_start_tree);
  std::reverse(path.begin(), path.end());
  const std::vector<Eigen::VectorXd> rest = from_goals.ToRoot(in_goal_tree);
  path.insert(path.end(), rest.begin() + 1, rest.end());
  return path;
}

/// A configuration that is uniform between two.
inline Eigen::VectorXd SampleBetween(const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
                                     Random& random) {
  Eigen::VectorXd q(lower.size());
  for (Eigen::Index i = 0; i < q.size(); ++i) q[i] = random.Uniform(lower[i], upper[i]);
  return q;
}

}  // namespace tether::motion
