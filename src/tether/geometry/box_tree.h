#pragma once

#include <cstddef>
#include <vector>

#include "tether/geometry/distance/bounds.h"

namespace tether::geometry {

/// A tree of boxes, to find those near a place without testing all.
class BoxTree {
 public:
  BoxTree() = default;
  explicit BoxTree(std::vector<geometry::Aabb> boxes);

  /// The numbers of the boxes that meet `box`, in order.
  std::vector<size_t> Meeting(const geometry::Aabb& box) const;

 private:
  /// A leaf has one box; any other node two children, the left of which follows it.
  struct Node {
    geometry::Aabb box;
    size_t right = 0;  ///< 0: a leaf.
    size_t index = 0;
  };
  void Build(size_t* begin, size_t* end);

  std::vector<geometry::Aabb> boxes_;
  std::vector<Node> nodes_;
};

}  // namespace tether::geometry
