#include "tether/constraints/grasps/contact.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tether/constraints/grasps/surface.h"
#include "tether/constraints/kinds/known.h"

namespace tether::constraints {
namespace {

using Eigen::Vector3d;
using geometry::Part;

// A direction within about 6° of level or upright counts as such.
constexpr double kLevel = 0.1;
// The side of a hull must be this upright: it is touched somewhere along its height, rad.
constexpr double kUpright = 0.01;

Vector3d Level(const Vector3d& v, const Vector3d& up) { return v - up * up.dot(v); }

// A side of a hull is pressed at least this far from its edges, or a quarter of its width, m.
constexpr double kInset = 0.002;

struct Side {
  Vector3d normal_B;
  double offset_B;
  std::string label;
  double lowest_B = -std::numeric_limits<double>::infinity();
  double highest_B = std::numeric_limits<double>::infinity();
  Extent reach{0, 0}, heights{0, 0};  // as Contact's
};

Extent PartExtent(const Part& part, const Vector3d& direction) {
  return {-PartSupport(part, -direction), PartSupport(part, direction)};
}

/// The part of an extent that keeps off its ends.
Extent Within(const Extent& extent) {
  const double inset = std::min(kInset, 0.25 * (extent.high - extent.low));
  return {extent.low + inset, extent.high - inset};
}

/// The level sides of a hull behind the object's centre of mass: pushed anywhere else, it would turn.
void AddHullSides(const Part& part, const std::string& prefix, const Vector3d& com_B, const Vector3d& up_B,
                  std::vector<Side>& sides) {
  for (const FlatSide& side : FlatSides(part)) {
    if (std::abs(side.normal.dot(up_B)) > kUpright) continue;
    const Vector3d n = Level(side.normal, up_B).normalized();
    const Vector3d across = up_B.cross(n);
    const Extent reach = Within(ExtentAlong(side, across)), heights = Within(ExtentAlong(side, up_B));
    if (across.dot(com_B) < reach.low || across.dot(com_B) > reach.high) continue;
    sides.push_back(
        {n, PartSupport(part, n), prefix + "side " + side.name, heights.low, heights.high, reach, heights});
  }
}

/// The level sides of a solid that something can lean against. Round ones are offered where they face away
/// from `pull_B`, the level direction in which the object should go, and a little to either side.
std::vector<Side> FindSides(const geometry::Shape& shape, const Vector3d& up_B, const Vector3d& pull_B) {
  std::vector<Side> sides;
  const Vector3d com_B = geometry::CentreOfMass(shape);
  for (size_t i = 0; i < shape.parts.size(); ++i) {
    const Part& part = shape.parts[i];
    const std::string prefix = shape.is_compound() ? "part " + std::to_string(i + 1) + " " : "";
    const auto add = [&](const Vector3d& n, const std::string& label) {
      Side& side = sides.emplace_back(Side{n, PartSupport(part, n), prefix + label});
      side.reach = PartExtent(part, up_B.cross(n));
      side.heights = PartExtent(part, up_B);
      return &side;
    };
    // What is round is touched where it comes nearest.
    const auto middle = [](Extent& extent) { extent.low = extent.high = 0.5 * (extent.low + extent.high); };
    const auto add_round = [&] {
      for (double degrees : {0.0, 20.0, -20.0, 45.0, -45.0, 90.0, -90.0}) {
        const Vector3d n = math::ExpSO3(up_B * (degrees * std::numbers::pi / 180)) * -pull_B;
        Side* side = add(n, "round side at " + std::to_string(static_cast<int>(degrees)) + " deg");
        middle(side->reach);
        if (std::holds_alternative<geometry::Sphere>(part.primitive)) middle(side->heights);
        if (const auto* capsule = std::get_if<geometry::Capsule>(&part.primitive))
          side->heights = {side->heights.low + capsule->radius, side->heights.high - capsule->radius};
      }
    };
    if (std::holds_alternative<geometry::Box>(part.primitive)) {
      static const char* const names[] = {"x", "y", "z"};
      for (int axis = 0; axis < 3; ++axis) {
        for (int sign : {1, -1}) {
          const Vector3d n = part.X_SP.R.col(axis) * sign;
          if (std::abs(n.dot(up_B)) < kLevel)
            add(n, std::string(sign > 0 ? "+" : "-") + names[axis] + " side");
        }
      }
    } else if (std::holds_alternative<geometry::Sphere>(part.primitive)) {
      add_round();
    } else if (std::holds_alternative<geometry::Hull>(part.primitive)) {
      AddHullSides(part, prefix, com_B, up_B, sides);
    } else {
      const Vector3d axis = part.X_SP.R.col(2);
      if (std::abs(axis.dot(up_B)) > 1 - kLevel) {
        add_round();
      } else if (std::abs(axis.dot(up_B)) < kLevel) {
        for (int sign : {1, -1}) {
          Side* end = add(axis * sign, sign > 0 ? "+ end" : "- end");
          const auto* capsule = std::get_if<geometry::Capsule>(&part.primitive);
          if (capsule != nullptr) {
            middle(end->reach);
            middle(end->heights);
          }
          Side* side = add(up_B.cross(axis).normalized() * sign, sign > 0 ? "left side" : "right side");
          middle(side->heights);
          if (capsule != nullptr)
            side->reach = {side->reach.low + capsule->radius, side->reach.high - capsule->radius};
        }
      }
    }
  }
  return sides;
}

/// The contacts that a part of the tool can make with an upright side while the tool is held level.
std::vector<Contact> FindTips(const geometry::Shape& tool, const Vector3d& down_A) {
  std::vector<Contact> tips;
  for (size_t i = 0; i < tool.parts.size(); ++i) {
    const Part& part = tool.parts[i];
    Contact tip;
    tip.tool_part = static_cast<int>(i);
    tip.centre_A = part.X_SP.p;
    const std::string name = "part " + std::to_string(i + 1);
    if (const auto* box = std::get_if<geometry::Box>(&part.primitive)) {
      tip.form = Contact::Form::kFace;
      for (int axis = 0; axis < 3; ++axis) {
        const Vector3d u = part.X_SP.R.col(axis);
        if (std::abs(u.dot(down_A)) > kLevel) continue;
        // The box's other level axis runs across the push.
        double half_width = 0;
        for (int other = 0; other < 3; ++other) {
          if (other != axis && std::abs(part.X_SP.R.col(other).dot(down_A)) < kLevel)
            half_width = 0.5 * box->size[other];
        }
        tip.half_height = 0;
        for (int other = 0; other < 3; ++other) {
          if (other != axis && std::abs(part.X_SP.R.col(other).dot(down_A)) > 1 - kLevel)
            tip.half_height = 0.5 * box->size[other];
        }
        for (int sign : {1, -1}) {
          tip.direction_A = u * sign;
          tip.tool_depth = 0.5 * box->size[axis];
          tip.half_width = half_width;
          tip.label = name + (sign > 0 ? " face +" : " face -") + "xyz"[axis];
          tips.push_back(tip);
        }
      }
    } else if (const auto* sphere = std::get_if<geometry::Sphere>(&part.primitive)) {
      tip.tool_depth = sphere->radius;
      tip.label = name;
      tips.push_back(tip);
    } else if (std::holds_alternative<geometry::Hull>(part.primitive)) {
      tip.form = Contact::Form::kFace;
      for (const FlatSide& side : FlatSides(part)) {
        if (std::abs(side.normal.dot(down_A)) > kUpright) continue;
        tip.direction_A = Level(side.normal, down_A).normalized();
        const Vector3d across = down_A.cross(tip.direction_A);
        const Extent reach = ExtentAlong(side, across), heights = ExtentAlong(side, down_A);
        tip.half_width = 0.5 * (reach.high - reach.low);
        tip.half_height = 0.5 * (heights.high - heights.low);
        tip.centre_A = tip.direction_A * tip.direction_A.dot(part.X_SP.p) +
                       across * (0.5 * (reach.low + reach.high)) +
                       down_A * (0.5 * (heights.low + heights.high));
        tip.tool_depth = PartSupport(part, tip.direction_A) - tip.direction_A.dot(part.X_SP.p);
        tip.label = name + " side " + side.name;
        tips.push_back(tip);
      }
    } else {
      const auto* capsule = std::get_if<geometry::Capsule>(&part.primitive);
      const auto* cylinder = std::get_if<geometry::Cylinder>(&part.primitive);
      const Vector3d axis = part.X_SP.R.col(2);
      tip.tool_depth = capsule != nullptr ? capsule->radius : cylinder->radius;
      tip.label = name;
      if (std::abs(axis.dot(down_A)) < kLevel) {
        tip.form = Contact::Form::kLine;
        tip.direction_A = axis;
        tip.half_width = 0.5 * (capsule != nullptr ? capsule->length : cylinder->length);
        tips.push_back(tip);
      } else if (std::abs(axis.dot(down_A)) > 1 - kLevel) {
        tip.half_height = 0.5 * (capsule != nullptr ? capsule->length : cylinder->length);
        tips.push_back(tip);
      }
    }
  }
  return tips;
}

}  // namespace

std::vector<Contact> FindContacts(const Context& context, FrameId tool, FrameId object, int step) {
  const geometry::Shape* a = context.ShapeOf(tool);
  const geometry::Shape* b = context.ShapeOf(object);
  if (a == nullptr || b == nullptr) return {};
  // The push of a first step begins at the start itself.
  const int before = std::max(step - 1, -1);
  const math::Pose X_WB = context.PoseAt({object, before}), X_WA = context.PoseAt({tool, before});
  const Vector3d up_B = -context.DownFace(object);
  const Vector3d down_A = tool == context.hand() ? Vector3d(Vector3d::UnitZ()) : context.DownFace(tool);
  const Vector3d toward_W = context.X_WBase().p - X_WB.p;
  Vector3d pull_B = Level(X_WB.R.transpose() * toward_W, up_B);
  const double far = pull_B.norm();
  pull_B = far > 1e-6 ? Vector3d(pull_B / far) : up_B.unitOrthogonal();
  std::vector<Contact> contacts;
  for (const Side& side : FindSides(*b, up_B, pull_B)) {
    for (Contact contact : FindTips(*a, down_A)) {
      contact.normal_B = Level(side.normal_B, up_B).normalized();
      contact.offset_B = side.offset_B;
      contact.lowest_B = side.lowest_B;
      contact.highest_B = side.highest_B;
      contact.reach_B = side.reach;
      contact.heights_B = side.heights;
      contact.label =
          context.Name(tool) + " " + contact.label + " against " + context.Name(object) + " " + side.label;
      // First the direction of the push, then a wide contact, then little turning of the tool.
      contact.score = 1 + contact.normal_B.dot(pull_B) - 0.5 * std::min(contact.half_width, 0.1);
      // The tool should reach over the object from the robot's side: the rest of it lies towards the robot.
      const Vector3d n_W = X_WB.R * contact.normal_B;
      if (contact.form == Contact::Form::kFace) {
        contact.score += 0.02 * (1 + (X_WA.R * contact.direction_A).dot(n_W));
      } else if (contact.form == Contact::Form::kLine) {
        contact.score += 0.02 * std::abs((X_WA.R * contact.direction_A).dot(n_W));
      }
      // Held near its middle, a tool's far part pulls: the centre of mass lies on the pushed side of the
      // contact.
      const Vector3d arm_W = X_WA.R * (geometry::CentreOfMass(*a) - contact.centre_A);
      if (a->is_compound() && arm_W.dot(n_W) > 0) contact.score += 0.1;
      contacts.push_back(contact);
    }
  }
  std::stable_sort(contacts.begin(), contacts.end(),
                   [](const Contact& x, const Contact& y) { return x.score < y.score - 1e-9; });
  return contacts;
}

std::optional<Contact> ChosenContact(const Context& context, FrameId tool, FrameId object, int step) {
  const auto contacts = context.known_of_program().contacts.Get(
      {tool, object, step}, [&] { return FindContacts(context, tool, object, step); });
  if (contacts->empty()) return std::nullopt;
  std::vector<Option> options;
  for (const Contact& contact : *contacts) options.push_back({contact.label, contact.score});
  const ChoiceKey key{ChoiceKey::Kind::kContact, tool, object, step};
  return (*contacts)[ToIndex(context.Choose(key, options))];
}

}  // namespace tether::constraints
