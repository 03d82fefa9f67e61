#include "tether/planning/program/frame_tree.h"

#include <algorithm>
#include <cassert>

#include "tether/constraints/core/context.h"

namespace tether::planning {

FrameTree::FrameTree(const scene::Scene& scene, const math::Pose& X_WHand, const std::string& holds) {
  const auto add = [&](const std::string& name) {
    index_.emplace(name, static_cast<int>(names_.size()));
    names_.push_back(name);
  };
  add(scene::kWorld);
  for (const scene::Object& object : scene.objects) add(object.name);
  for (const scene::Region& region : scene.regions) add(region.name);
  for (const scene::Robot& robot : scene.robots) add(robot.name);
  add(constraints::kHand);

  // In the order in which they were added.
  std::vector<Node> start{Node()};
  const auto hang = [&](const std::string& parent) { start.push_back({IndexOf(parent), -1}); };
  for (const scene::Object& object : scene.objects) hang(object.parent);
  for (const scene::Region& region : scene.regions) hang(region.parent);
  for (const scene::Robot& robot : scene.robots) hang(robot.parent);
  hang(holds.empty() ? scene::kWorld : holds);
  states_.push_back(std::move(start));
  MoveTo(scene, X_WHand);
}

void FrameTree::MoveTo(const scene::Scene& scene, const math::Pose& X_WHand) {
  X_start_.assign(names_.size(), math::Pose());
  const auto at = [&](const std::string& name) -> math::Pose& {
    return X_start_[static_cast<size_t>(IndexOf(name))];
  };
  for (const scene::Object& object : scene.objects) at(object.name) = object.X_ParentObject;
  for (const scene::Region& region : scene.regions) at(region.name) = region.X_ParentRegion;
  for (const scene::Robot& robot : scene.robots) at(robot.name) = robot.X_ParentBase;
  const std::string& holder = ParentAt(constraints::kHand, -1);
  at(constraints::kHand) =
      holder == scene::kWorld ? X_WHand : math::Between(scene.InitialPose(holder), X_WHand);
  for (size_t i = 0; i < parameters_.size(); ++i)
    parameters_[i] = PoseAtStart(parameter_frames_[i].first, parameter_frames_[i].second);
}

math::Pose FrameTree::PoseAtStart(int frame, int ancestor) const {
  math::Pose X;
  for (int i = frame; i != ancestor; i = states_.front()[static_cast<size_t>(i)].parent)
    X = X_start_[static_cast<size_t>(i)] * X;
  return X;
}

int FrameTree::ParameterOf(int frame, int ancestor) const {
  const std::pair wanted(frame, ancestor);
  const auto found = std::find(parameter_frames_.begin(), parameter_frames_.end(), wanted);
  if (found != parameter_frames_.end()) return static_cast<int>(found - parameter_frames_.begin());
  parameter_frames_.push_back(wanted);
  parameters_.push_back(PoseAtStart(frame, ancestor));
  return static_cast<int>(parameters_.size()) - 1;
}

bool FrameTree::AddStep(const std::string& control, const std::string& target) {
  if (HangsOn(target, control, num_steps() - 1)) return false;
  std::vector<Node> next = states_.back();
  next[static_cast<size_t>(IndexOf(control))] = {IndexOf(target), num_steps()};
  states_.push_back(std::move(next));
  return true;
}

std::string FrameTree::ParentAt(const std::string& frame, int step) const {
  const Node& node = states_[static_cast<size_t>(step + 1)][static_cast<size_t>(IndexOf(frame))];
  return node.parent < 0 ? std::string() : names_[static_cast<size_t>(node.parent)];
}

int FrameTree::LastMoved(const std::string& frame, int step) const {
  return states_[static_cast<size_t>(step + 1)][static_cast<size_t>(IndexOf(frame))].variable;
}

bool FrameTree::HangsOn(const std::string& frame, const std::string& ancestor, int step) const {
  const std::vector<Node>& nodes = states_[static_cast<size_t>(step + 1)];
  const int wanted = IndexOf(ancestor);
  for (int i = IndexOf(frame); i >= 0; i = nodes[static_cast<size_t>(i)].parent) {
    if (i == wanted) return true;
  }
  return false;
}

const Chain& FrameTree::ChainTo(const std::string& frame, int step) const {
  chains_.resize(states_.size());
  std::vector<Chain>& chains = chains_[static_cast<size_t>(step + 1)];
  const std::vector<Node>& nodes = states_[static_cast<size_t>(step + 1)];
  chains.resize(nodes.size());
  const int index = IndexOf(frame);
  Chain& chain = chains[static_cast<size_t>(index)];
  if (!chain.empty()) return chain;
  for (int i = index; i > 0;) {
    const int variable = nodes[static_cast<size_t>(i)].variable;
    if (variable >= 0) {
      chain.push_back({variable, -1});
      i = nodes[static_cast<size_t>(i)].parent;
      continue;
    }
    int ancestor = i;
    while (ancestor > 0 && nodes[static_cast<size_t>(ancestor)].variable < 0)
      ancestor = nodes[static_cast<size_t>(ancestor)].parent;
    chain.push_back({-1, ParameterOf(i, ancestor)});
    i = ancestor;
  }
  std::reverse(chain.begin(), chain.end());
  return chain;
}

math::Pose FrameTree::PoseAt(const std::string& frame, int step,
                             const std::vector<math::Pose>& variables) const {
  math::Pose X_WF;
  for (const ChainLink& link : ChainTo(frame, step)) {
    assert(link.variable < static_cast<int>(variables.size()));
    X_WF = X_WF * (link.variable < 0 ? parameters_[static_cast<size_t>(link.parameter)]
                                     : variables[static_cast<size_t>(link.variable)]);
  }
  return X_WF;
}

void FrameTree::PosesAt(int step, const std::vector<math::Pose>& variables,
                        std::vector<math::Pose>& X_W) const {
  const std::vector<Node>& nodes = states_[static_cast<size_t>(step + 1)];
  X_W.assign(nodes.size(), math::Pose());
  std::vector<char> done(nodes.size(), 0);
  std::vector<size_t> waiting;
  for (size_t start = 0; start < nodes.size(); ++start) {
    // Up to a frame whose pose is known, and back down.
    for (size_t i = start; done[i] == 0; i = static_cast<size_t>(nodes[i].parent)) {
      waiting.push_back(i);
      if (nodes[i].parent < 0) break;
    }
    for (; !waiting.empty(); waiting.pop_back()) {
      const size_t i = waiting.back();
      const Node& node = nodes[i];
      if (node.parent >= 0) {
        const math::Pose& X = node.variable < 0 ? X_start_[i] : variables[static_cast<size_t>(node.variable)];
        X_W[i] = X_W[static_cast<size_t>(node.parent)] * X;
      }
      done[i] = 1;
    }
  }
}

}  // namespace tether::planning
