#include "tether/nlp/block_cholesky.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <set>

namespace tether::nlp {
namespace {

using Block = BlockCholesky::Block;

constexpr double kHugePivot = 1e30;

void FactorizeDiagonal(Block& A) {
  for (int j = 0; j < 6; ++j) {
    double pivot = A(j, j);
    for (int k = 0; k < j; ++k) pivot -= A(j, k) * A(j, k);
    pivot = pivot > 0 ? std::sqrt(pivot) : kHugePivot;
    A(j, j) = pivot;
    for (int i = j + 1; i < 6; ++i) {
      double value = A(i, j);
      for (int k = 0; k < j; ++k) value -= A(i, k) * A(j, k);
      A(i, j) = value / pivot;
    }
  }
}

/// A ← A · L⁻ᵀ.
void SolveFromRight(const Block& L, Block& A) {
  for (int j = 0; j < 6; ++j) {
    for (int k = 0; k < j; ++k) A.col(j) -= A.col(k) * L(j, k);
    A.col(j) *= 1 / L(j, j);
  }
}

}  // namespace

std::vector<int> EliminationPositions(int count, const std::vector<std::pair<int, int>>& edges) {
  const auto n = static_cast<size_t>(count);
  std::vector<std::set<int>> neighbours(n);
  for (const auto& [i, j] : edges) {
    if (i == j) continue;
    neighbours[static_cast<size_t>(i)].insert(j);
    neighbours[static_cast<size_t>(j)].insert(i);
  }
  std::set<std::pair<size_t, int>> by_degree;
  for (int k = 0; k < count; ++k) by_degree.emplace(neighbours[static_cast<size_t>(k)].size(), k);
  std::vector<int> positions(n, -1);
  for (int position = 0; position < count; ++position) {
    const int best = by_degree.begin()->second;
    by_degree.erase(by_degree.begin());
    positions[static_cast<size_t>(best)] = position;
    const std::set<int> joined = std::move(neighbours[static_cast<size_t>(best)]);
    for (const int i : joined) {
      std::set<int>& others = neighbours[static_cast<size_t>(i)];
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
    if (i != j) below[static_cast<size_t>(std::min(i, j))].push_back(std::max(i, j));
  }
  for (size_t k = 0; k < n; ++k) {
    std::vector<int>& rows = below[k];
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    // The rest of the column fills the column of its first row; from there it goes on.
    if (rows.size() > 1) {
      std::vector<int>& parent = below[static_cast<size_t>(rows.front())];
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
  const auto begin = rows_.begin() + first_[static_cast<size_t>(column)];
  const auto end = rows_.begin() + first_[static_cast<size_t>(column) + 1];
  const auto it = std::lower_bound(begin, end, row);
  assert(it != end && *it == row);
  return static_cast<int>(it - rows_.begin());
}

void BlockCholesky::Factorize() {
  for (size_t k = 0; k < static_cast<size_t>(count_); ++k) {
    const auto first = static_cast<size_t>(first_[k]), end = static_cast<size_t>(first_[k + 1]);
    FactorizeDiagonal(blocks_[first]);
    for (size_t slot = first + 1; slot < end; ++slot) SolveFromRight(blocks_[first], blocks_[slot]);
    const auto last = static_cast<size_t>(first_update_[k + 1]);
    for (auto u = static_cast<size_t>(first_update_[k]); u < last; ++u) {
      const Update& update = updates_[u];
      blocks_[static_cast<size_t>(update.target)].noalias() -=
          blocks_[static_cast<size_t>(update.left)].lazyProduct(
              blocks_[static_cast<size_t>(update.right)].transpose());
    }
  }
}

void BlockCholesky::Solve(Eigen::VectorXd& b) const {
  for (int k = 0; k < count_; ++k) {
    const int first = first_[static_cast<size_t>(k)], end = first_[static_cast<size_t>(k) + 1];
    const Block& L = blocks_[static_cast<size_t>(first)];
    auto x = b.segment<6>(6 * k);
    for (int j = 0; j < 6; ++j) {
      x[j] /= L(j, j);
      for (int i = j + 1; i < 6; ++i) x[i] -= L(i, j) * x[j];
    }
    for (int slot = first + 1; slot < end; ++slot)
      b.segment<6>(6 * row(slot)).noalias() -= blocks_[static_cast<size_t>(slot)].lazyProduct(x);
  }
  for (int k = count_ - 1; k >= 0; --k) {
    const int first = first_[static_cast<size_t>(k)], end = first_[static_cast<size_t>(k) + 1];
    const Block& L = blocks_[static_cast<size_t>(first)];
    auto x = b.segment<6>(6 * k);
    for (int slot = first + 1; slot < end; ++slot) {
      x.noalias() -= blocks_[static_cast<size_t>(slot)].transpose().lazyProduct(b.segment<6>(6 * row(slot)));
    }
    for (int j = 5; j >= 0; --j) {
      for (int i = j + 1; i < 6; ++i) x[j] -= L(i, j) * x[i];
      x[j] /= L(j, j);
    }
  }
}

}  // namespace tether::nlp
