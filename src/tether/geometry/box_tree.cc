#include "tether/geometry/box_tree.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace tether::geometry {

BoxTree::BoxTree(std::vector<geometry::Aabb> boxes) : boxes_(std::move(boxes)) {
  std::vector<size_t> order(boxes_.size());
  std::iota(order.begin(), order.end(), size_t{0});
  if (!order.empty()) Build(order.data(), order.data() + order.size());
}

void BoxTree::Build(size_t* begin, size_t* end) {
  const size_t at = nodes_.size();
  nodes_.emplace_back();
  geometry::Aabb around, centres;
  for (const size_t* i = begin; i != end; ++i) {
    around.Include(boxes_[*i]);
    const Eigen::Vector3d centre = boxes_[*i].lower + boxes_[*i].upper;
    centres.Include({centre, centre});
  }
  nodes_[at].box = around;
  if (end - begin == 1) {
    nodes_[at].index = *begin;
    return;
  }
  Eigen::Index axis = 0;
  (centres.upper - centres.lower).maxCoeff(&axis);
  size_t* const middle = begin + (end - begin) / 2;
  std::nth_element(begin, middle, end, [&](size_t i, size_t j) {
    const double a = boxes_[i].lower[axis] + boxes_[i].upper[axis];
    const double b = boxes_[j].lower[axis] + boxes_[j].upper[axis];
    return a != b ? a < b : i < j;
  });
  Build(begin, middle);
  nodes_[at].right = nodes_.size();
  Build(middle, end);
}

std::vector<size_t> BoxTree::Meeting(const geometry::Aabb& box) const {
  std::vector<size_t> found, open;
  if (!nodes_.empty()) open.push_back(0);
  while (!open.empty()) {
    const size_t at = open.back();
    open.pop_back();
    const Node& node = nodes_[at];
    if ((node.box.lower.array() > box.upper.array()).any() ||
        (node.box.upper.array() < box.lower.array()).any())
      continue;
    if (node.right == 0) {
      found.push_back(node.index);
    } else {
      open.push_back(at + 1);
      open.push_back(node.right);
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace tether::geometry
