#include "tether/nlp/native/block_cholesky.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <set>

#include "tether/nlp/native/block_kernels.h"

namespace tether::nlp {
namespace {

constexpr double kHugePivot = 1e30;

/// Works on whole columns; entries above the diagonal are meaningless before and after.
TETHER_KERNEL void FactorizeDiagonal(double* A) {
  for (int j = 0; j < 6; ++j) {
    block::Column column = block::Load(A + 6 * j);
    for (int k = 0; k < j; ++k) block::SubtractScaled(block::Load(A + 6 * k), A[6 * k + j], column);
    block::Store(column, A + 6 * j);
    const double pivot = A[7 * j] > 0 ? std::sqrt(A[7 * j]) : kHugePivot;
    column.head /= pivot;
    column.tail /= pivot;
    block::Store(column, A + 6 * j);
    A[7 * j] = pivot;
  }
}

}  // namespace

std::vector<int> EliminationPositions(int count, const std::vector<std::pair<int, int>>& edges) {
  const auto n = static_cast<size_t>(count);
  std::vector<std::set<int>> neighbours(n);
  for (const auto& [i, j] : edges) {
    if (i == j) continue;
    neighbours[i].insert(j);
    neighbours[j].insert(i);
  }
  std::set<std::pair<size_t, int>> by_degree;
  for (int k = 0; k < count; ++k) by_degree.emplace(neighbours[k].size(), k);
  std::vector<int> positions(n, -1);
  for (int position = 0; position < count; ++position) {
    const int best = by_degree.begin()->second;
    by_degree.erase(by_degree.begin());
    positions[best] = position;
    const std::set<int> joined = std::move(neighbours[best]);
    for (const int i : joined) {
      std::set<int>& others = neighbours[i];
      by_degree.erase({others.size(), i});
      others.erase(best);
      others.insert(joined.begin(), joined.end());
      others.erase(i);
      by_degree.emplace(others.size(), i);
    }
  }
  return positions;
}

BlockCholesky::BlockCholesky(int count, const std::vector<std::pair<int, int>>& edges) : count_(count) {
  const auto n = static_cast<size_t>(count);
  std::vector<std::vector<int>> below(n);
  for (const auto& [i, j] : edges) {
    if (i != j) below[std::min(i, j)].push_back(std::max(i, j));
  }
  for (size_t k = 0; k < n; ++k) {
    std::vector<int>& rows = below[k];
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    // The rest of the column fills the column of its first row; from there it goes on.
    if (rows.size() > 1) {
      std::vector<int>& parent = below[rows.front()];
      parent.insert(parent.end(), rows.begin() + 1, rows.end());
    }
    first_.push_back(static_cast<int>(rows_.size()));
    rows_.push_back(static_cast<int>(k));
    rows_.insert(rows_.end(), rows.begin(), rows.end());
    columns_.resize(rows_.size(), static_cast<int>(k));
  }
  first_.push_back(static_cast<int>(rows_.size()));
  for (size_t k = 0; k < n; ++k) {
    first_update_.push_back(static_cast<int>(updates_.size()));
    for (int right = first_[k] + 1; right < first_[k + 1]; ++right) {
      for (int left = right; left < first_[k + 1]; ++left)
        updates_.push_back({Slot(row(left), row(right)), left, right});
    }
  }
  first_update_.push_back(static_cast<int>(updates_.size()));
  blocks_.assign(rows_.size(), Block::Zero());
}

int BlockCholesky::Slot(int row, int column) const {
  const auto begin = rows_.begin() + first_[column];
  const auto end = rows_.begin() + first_[static_cast<size_t>(column) + 1];
  const auto it = std::lower_bound(begin, end, row);
  assert(it != end && *it == row);
  return static_cast<int>(it - rows_.begin());
}

TETHER_MULTIVERSION void BlockCholesky::Factorize() {
  double* blocks = blocks_.front().data();
  const auto at = [blocks](int slot) { return blocks + 36 * static_cast<size_t>(slot); };
  const Update* update = updates_.data();
  for (size_t k = 0; k < static_cast<size_t>(count_); ++k) {
    const int first = first_[k], end = first_[k + 1];
    FactorizeDiagonal(at(first));
    for (int slot = first + 1; slot < end; ++slot) block::SolveFromRight(at(first), at(slot));
    const Update* last = updates_.data() + first_update_[k + 1];
    for (; update < last; ++update)
      block::SubtractProduct(at(update->left), at(update->right), at(update->target));
  }
}

TETHER_MULTIVERSION void BlockCholesky::Solve(Eigen::VectorXd& b) const {
  const double* blocks = blocks_.front().data();
  for (int k = 0; k < count_; ++k) {
    const int first = first_[k], end = first_[static_cast<size_t>(k) + 1];
    const double* L = blocks + 36 * static_cast<size_t>(first);
    double* x = b.data() + 6 * static_cast<size_t>(k);
    for (int j = 0; j < 6; ++j) {
      x[j] /= L[7 * j];
      for (int i = j + 1; i < 6; ++i) x[i] -= L[6 * j + i] * x[j];
    }
    for (int slot = first + 1; slot < end; ++slot)
      block::SubtractTimes(blocks + 36 * static_cast<size_t>(slot), x, b.data() + 6 * row(slot));
  }
  for (int k = count_ - 1; k >= 0; --k) {
    const int first = first_[k], end = first_[static_cast<size_t>(k) + 1];
    const double* L = blocks + 36 * static_cast<size_t>(first);
    double* x = b.data() + 6 * static_cast<size_t>(k);
    for (int slot = first + 1; slot < end; ++slot)
      block::SubtractTransposedTimes(blocks + 36 * static_cast<size_t>(slot), b.data() + 6 * row(slot), x);
    for (int j = 5; j >= 0; --j) {
      for (int i = j + 1; i < 6; ++i) x[j] -= L[6 * j + i] * x[i];
      x[j] /= L[7 * j];
    }
  }
}

}  // namespace tether::nlp
