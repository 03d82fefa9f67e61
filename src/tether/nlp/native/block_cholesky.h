#pragma once

#include <utility>
#include <vector>

#include <Eigen/Core>

namespace tether::nlp {

/// An order of `count` nodes in which eliminating them fills little: minimum degree, ties to the lower index.
/// Entry k is the position of node k. `edges` are unordered pairs of nodes.
std::vector<int> EliminationPositions(int count, const std::vector<std::pair<int, int>>& edges);

/// Cholesky factorisation of a symmetric positive definite matrix of 6 × 6 blocks, with its symbolic part
/// done once. Blocks stand in the order of elimination; only those with row ≥ column are kept. Nothing
/// allocates after construction. Not to be shared between threads.
class BlockCholesky {
 public:
  using Block = Eigen::Matrix<double, 6, 6>;
  using Blocks = std::vector<Block, Eigen::aligned_allocator<Block>>;

  /// `edges` are the pairs (row, column) of blocks that may be non-zero, in any order; diagonal ones always
  /// are.
  BlockCholesky(int count, const std::vector<std::pair<int, int>>& edges);

  int count() const { return count_; }
  /// How many blocks the factor has, fill included.
  int num_slots() const { return static_cast<int>(rows_.size()); }
  /// The slot of block (row, column) with row ≥ column, which must be of the pattern.
  int Slot(int row, int column) const;
  int row(int slot) const { return rows_[slot]; }
  int column(int slot) const { return columns_[slot]; }

  /// Factorises the matrix in blocks(), in place. Of diagonal blocks the lower triangle is read. A pivot that
  /// is not positive is replaced by a huge one, which fixes that coordinate.
  void Factorize();
  Blocks& blocks() { return blocks_; }
  /// Solves in place with the factor; `b` has 6 · count() entries.
  void Solve(Eigen::VectorXd& b) const;

 private:
  struct Update {
    int target, left, right;  // target −= left · rightᵀ
  };
  int count_;
  std::vector<int> first_;  // of each column in rows_; the diagonal block comes first
  std::vector<int> rows_, columns_;
  std::vector<Update> updates_;
  std::vector<int> first_update_;
  Blocks blocks_;
};

}  // namespace tether::nlp
