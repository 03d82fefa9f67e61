#include "tether/scenario/generators/generate_draft.h"

#include <algorithm>
#include <cmath>

#include "tether/common/overloaded.h"
#include "tether/common/text.h"
#include "tether/geometry/distance/distance.h"
#include "tether/geometry/hull/polytope.h"

namespace tether::scenario {
namespace {

constexpr double kWood = 600;  // kg/m³

const char* const kPalette[] = {"[0.76, 0.70, 0.60, 1]", "[0.55, 0.55, 0.58, 1]", "[0.85, 0.25, 0.20, 1]",
                                "[0.20, 0.40, 0.80, 1]", "[0.25, 0.65, 0.35, 1]", "[0.95, 0.70, 0.15, 1]",
                                "[0.55, 0.30, 0.65, 1]", "[0.20, 0.65, 0.70, 1]", "[0.95, 0.45, 0.40, 1]",
                                "[0.45, 0.35, 0.25, 1]"};

/// Up to five decimals, without trailing zeros.
std::string Number(double value) {
  char text[32];
  FormatInto(text, sizeof text, "%.5f", value == 0 ? 0.0 : value);  // no −0
  std::string number = text;
  while (number.back() == '0') number.pop_back();
  if (number.back() == '.') number.pop_back();
  return number == "-0" ? "0" : number;
}

std::string Numbers(const Eigen::Vector3d& v) {
  return "[" + Number(v.x()) + ", " + Number(v.y()) + ", " + Number(v.z()) + "]";
}

std::string PrimitiveText(const geometry::Primitive& primitive) {
  const auto rod = [](const char* kind, double radius, double length) {
    return std::string(kind) + ": {radius: " + Number(radius) + ", length: " + Number(length) + "}";
  };
  return std::visit(
      Overloaded{[](const geometry::Box& box) { return "box: " + Numbers(box.size); },
                 [](const geometry::Sphere& sphere) { return "sphere: " + Number(sphere.radius); },
                 [&](const geometry::Capsule& c) { return rod("capsule", c.radius, c.length); },
                 [&](const geometry::Cylinder& c) { return rod("cylinder", c.radius, c.length); },
                 [](const geometry::Hull& hull) {
                   std::string text;
                   for (const Eigen::Vector3d& p : hull.polytope->vertices) {
                     text += (text.empty() ? "" : ", ") + Numbers(p);
                   }
                   return "hull: [" + text + "]";
                 }},
      primitive);
}

/// Roll, pitch, yaw of a part that lies along x or y of its object, or has not been turned.
std::string PartPose(const math::Pose& X_SP) {
  const Eigen::Vector3d z = X_SP.R.col(2);
  std::string text = "{position: " + Numbers(X_SP.p);
  if (z.x() > 0.9) text += ", rpy: [0, 1.57079633, 0]";
  if (z.y() < -0.9) text += ", rpy: [1.57079633, 0, 0]";
  return text + "}";
}

std::string ObjectText(const DraftObject& object) {
  std::string text = "  " + object.name + ":" + (object.remark.empty() ? "" : "  # " + object.remark) + "\n";
  if (object.mass > 0) text += "    mass: " + Number(object.mass) + "\n    friction: 0.8\n";
  text +=
      "    rgba: " + std::string(kPalette[static_cast<size_t>(object.colour) % std::size(kPalette)]) + "\n";
  text += "    pose: {position: " + Numbers(object.p_W);
  if (object.yaw != 0) text += ", rpy: [0, 0, " + Number(object.yaw) + "]";
  text += "}\n";
  if (!object.shape.is_compound()) {
    return text + "    shape: {" + PrimitiveText(object.shape.parts.front().primitive) + "}\n";
  }
  text += "    shape:\n";
  for (const geometry::Part& part : object.shape.parts) {
    text += "    - " + PrimitiveText(part.primitive) + "\n      pose: " + PartPose(part.X_SP) + "\n";
  }
  return text;
}

}  // namespace

math::Pose DraftObject::X_WO() const { return {math::RotationFromRpy({0, 0, yaw}), p_W}; }

bool SceneDraft::IsClear(const DraftObject& object, double gap,
                         const std::vector<std::string>& except) const {
  return std::all_of(objects.begin(), objects.end(), [&](const DraftObject& other) {
    if (std::find(except.begin(), except.end(), other.name) != except.end()) return true;
    return geometry::SignedDistance(object.shape, object.X_WO(), other.shape, other.X_WO()).distance >= gap;
  });
}

std::string SceneDraft::Write() const {
  std::string text = "# Made by: " + command + "\n";
  for (size_t begin = 0; begin < about.size();) {
    const size_t end = std::min(about.find('\n', begin), about.size());
    text += "# " + about.substr(begin, end - begin) + "\n";
    begin = end + 1;
  }
  text += "# Lengths in m, angles in rad, masses in kg.\n";
  text += "format: " + std::string(kScenarioFormat) + "\n";
  text += "title: " + title + "\nseed: " + std::to_string(seed) + "\n";
  text += "robots:\n  panda: {model: panda}\nobjects:\n";
  for (const DraftObject& object : objects) text += ObjectText(object);
  text += "regions:\n  workspace: {box: " + Numbers(workspace_size) +
          ", pose: {position: " + Numbers(workspace_p_W) + "}}\n";
  if (hand_radius > 0) {
    text += "  arm: {disc: " + Number(hand_radius) + "}  # about the base: where the hand gets\n";
  }
  text +=
      "task:\n  domain: domain.pddl\n  problem: problem.pddl\n  max_actions: " + std::to_string(max_actions) +
      "\nactions: [" + actions + "]\n";
  text += "constraints:\n- inside: {frame: moved, of: workspace}\n";
  if (hand_radius > 0) text += "- inside: {frame: hand, of: arm}\n";
  text += "planning: {solver: native" +
          (max_plans > 0 ? ", max_plans: " + std::to_string(max_plans) : std::string()) +
          (min_candidates > 0 ? ", min_candidates: " + std::to_string(min_candidates) + ", patience: 1"
                              : std::string()) +
          "}\n";
  if (perturb_position > 0 || perturb_rotation > 0) {
    text +=
        "perturb: {position: " + Number(perturb_position) + ", rotation: " + Number(perturb_rotation) + "}\n";
  }
  return text;
}

double OnGrid(double value, double step) { return std::round(value / step) * step; }

double DrawLength(Random& random, double lower, double upper) {
  return OnGrid(random.Uniform(lower, upper), 0.001);
}

double WoodenMass(double volume) { return std::max(0.01, OnGrid(kWood * volume, 0.005)); }

DraftObject DrawBox(Random& random, const std::string& name, double lower, double upper) {
  DraftObject box;
  box.name = name;
  Eigen::Vector3d size;
  for (int i = 0; i < 3; ++i) size[i] = DrawLength(random, lower, upper);
  box.shape = geometry::Shape(geometry::Box{size});
  box.p_W.z() = 0.5 * size.z();
  box.mass = WoodenMass(size.prod());
  return box;
}

std::string Fact(const std::string& predicate, const std::string& a, const std::string& b) {
  return "(" + predicate + " " + a + " " + b + ")";
}

std::vector<std::string> Numbered(const std::string& stem, int count) {
  std::vector<std::string> names;
  for (int i = 1; i <= count; ++i) names.push_back(stem + "_" + std::to_string(i));
  return names;
}

std::string Joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : " ") + name;
  return text;
}

}  // namespace tether::scenario
