#include "tether/planning/program/frame_tree.h"

#include <algorithm>
#include <array>
#include <cassert>

namespace tether::planning {

FrameTree::FrameTree(const scene::Frames& frames, const scene::Scene& scene, const math::Pose& X_WHand,
                     FrameId holds) {
  State start(frames.size());
  for (const FrameId frame : frames.ids()) start[frame].parent = frames.Parent(frame);
  if (holds.valid()) start[frames.hand()].parent = holds;
  int parameters = 0;
  for (const FrameId frame : frames.ids()) {
    first_parameter_.push_back(parameters);
    for (FrameId i = frame; start[i].parent.valid(); i = start[i].parent) ++parameters;
  }
  states_.push_back(std::move(start));
  parameters_.resize(ToIndex(parameters));
  MoveTo(scene, X_WHand);
}

void FrameTree::MoveTo(const scene::Scene& scene, const math::Pose& X_WHand) {
  X_start_.clear();
  X_start_.reserve(first_parameter_.size());
  X_start_.emplace_back();
  for (const scene::Object& object : scene.objects) X_start_.push_back(object.X_ParentObject);
  for (const scene::Region& region : scene.regions) X_start_.push_back(region.X_ParentRegion);
  for (const scene::Robot& robot : scene.robots) X_start_.push_back(robot.X_ParentBase);
  const State& start = StateAfter(-1);
  std::vector<FrameId> under;  // the hand, from what it holds on
  for (FrameId i = start.values().back().parent; start[i].parent.valid(); i = start[i].parent)
    under.push_back(i);
  math::Pose X_WHolder;
  for (; !under.empty(); under.pop_back()) X_WHolder = X_WHolder * X_start_[under.back()];
  X_start_.push_back(
      start.values().back().parent == scene::Frames::world() ? X_WHand : math::Between(X_WHolder, X_WHand));
  assert(X_start_.size() == first_parameter_.size());
  for (const FrameId frame : start.ids()) {
    math::Pose X;
    size_t at = ToIndex(first_parameter_[frame]);
    for (FrameId i = frame; start[i].parent.valid(); i = start[i].parent)
      parameters_[at++] = X = X_start_[i] * X;
  }
}

bool FrameTree::AddStep(FrameId control, FrameId target) {
  if (HangsOn(target, control, num_steps() - 1)) return false;
  State next = states_.back();
  next[control] = {target, num_steps()};
  states_.push_back(std::move(next));
  return true;
}

bool FrameTree::HangsOn(FrameId frame, FrameId ancestor, int step) const {
  const State& nodes = StateAfter(step);
  for (FrameId i = frame; i.valid(); i = nodes[i].parent) {
    if (i == ancestor) return true;
  }
  return false;
}

template <typename Visit>
void FrameTree::ForEachLink(FrameId frame, int step, Visit visit) const {
  const State& nodes = StateAfter(step);
  for (FrameId i = frame; nodes[i].parent.valid();) {
    if (nodes[i].variable >= 0) {
      visit(ChainLink{nodes[i].variable, -1});
      i = nodes[i].parent;
      continue;
    }
    int parameter = first_parameter_[i] - 1;
    for (; nodes[i].parent.valid() && nodes[i].variable < 0; i = nodes[i].parent) ++parameter;
    visit(ChainLink{-1, parameter});
  }
}

Chain FrameTree::ChainTo(FrameId frame, int step) const {
  Chain chain;
  ForEachLink(frame, step, [&](const ChainLink& link) { chain.push_back(link); });
  std::reverse(chain.begin(), chain.end());
  return chain;
}

math::Pose FrameTree::PoseAt(FrameId frame, int step, const std::vector<math::Pose>& variables) const {
  // From the world to the frame, as residuals compose chains: the same to the last bit. Links come the other
  // way round.
  constexpr size_t kUsual = 16;
  std::array<const math::Pose*, kUsual> usual;  // NOLINT: as many as are written are read
  std::vector<const math::Pose*> more;
  size_t links = 0;
  ForEachLink(frame, step, [&](const ChainLink& link) {
    assert(link.variable < static_cast<int>(variables.size()));
    const math::Pose* X =
        link.variable < 0 ? &parameters_[ToIndex(link.parameter)] : &variables[ToIndex(link.variable)];
    if (links < kUsual) {
      usual[links] = X;
    } else {
      more.push_back(X);
    }
    ++links;
  });
  math::Pose X_WF;
  for (size_t i = links; i-- > 0;) X_WF = X_WF * (i < kUsual ? *usual[i] : *more[i - kUsual]);
  return X_WF;
}

void FrameTree::PosesAt(int step, const std::vector<math::Pose>& variables, Poses& X_W) const {
  const State& nodes = StateAfter(step);
  X_W.assign(nodes.size(), math::Pose());
  IndexedVector<FrameId, char> done(nodes.size(), 0);
  std::vector<FrameId> waiting;
  for (const FrameId start : nodes.ids()) {
    // Up to a frame whose pose is known, and back down.
    for (FrameId i = start; i.valid() && done[i] == 0; i = nodes[i].parent) waiting.push_back(i);
    for (; !waiting.empty(); waiting.pop_back()) {
      const FrameId i = waiting.back();
      const Node& node = nodes[i];
      if (node.parent.valid()) {
        const math::Pose& X = node.variable < 0 ? X_start_[i] : variables[ToIndex(node.variable)];
        X_W[i] = X_W[node.parent] * X;
      }
      done[i] = 1;
    }
  }
}

}  // namespace tether::planning
