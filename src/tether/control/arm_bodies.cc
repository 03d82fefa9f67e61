#include "tether/control/arm_bodies.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>
#include <variant>

#include "tether/geometry/distance/bounds.h"

namespace tether::control {
namespace {

// The hand's solid is prepared for so many openings, and the next wider one counts.
constexpr int kOpenings = 9;

double BoxToBall(const geometry::Box& box, const math::Pose& X_BBox, const Eigen::Vector3d& p_BQ,
                 double radius) {
  const Eigen::Vector3d p = X_BBox.R.transpose() * (p_BQ - X_BBox.p);
  return (p.cwiseAbs() - 0.5 * box.size).cwiseMax(0.0).norm() - radius;
}

}  // namespace

ArmBodies::ArmBodies(std::shared_ptr<const robot::Model> model, const std::vector<Solid>& objects)
    : model_(std::move(model)) {
  const robot::ArmSolids& solids = model_->solids();
  const auto add = [&](const std::string& name, int link, const geometry::Shape& shape) {
    Body body;
    body.name = name;
    body.link = link;
    body.first_part = static_cast<int>(parts_.size());
    body.num_parts = static_cast<int>(shape.parts.size());
    bodies_.push_back(std::move(body));
    AddParts(shape);
  };
  for (const robot::LinkSolid& link : solids.links) add(link.name, link.link, link.shape);
  hand_ = num_bodies();
  const double widest = model_->gripper().max_opening;
  add("hand", model_->dof(), model_->HandShape(0));
  for (int i = 0; i < kOpenings; ++i) {
    hand_parts_.push_back(i == 0 ? bodies_.back().first_part : static_cast<int>(parts_.size()));
    if (i > 0) AddParts(model_->HandShape(widest * i / (kOpenings - 1)));
  }
  for (const Solid& object : objects) add(object.name, 0, object.shape);
}

void ArmBodies::AddParts(const geometry::Shape& shape) {
  for (const geometry::Part& part : shape.parts) {
    parts_.push_back({part.primitive, part.X_SP, geometry::BoundingRadius(part.primitive), part.X_SP});
  }
}

void ArmBodies::PlaceParts(const Body& body) {
  Part* part = parts_.data() + body.first_part;
  for (int i = 0; i < body.num_parts; ++i, ++part) part->X_BP = body.pose.X * part->X_FP;
}

void ArmBodies::Hold(int object) {
  Release();
  held_ = object;
  bodies_[this->object(object)].link = model_->dof();
}

void ArmBodies::Release() {
  if (held_ >= 0) bodies_[object(held_)].link = 0;
  held_ = -1;
}

void ArmBodies::PlaceArm(const robot::Kinematics& kinematics, double opening) {
  const double share = std::clamp(opening / model_->gripper().max_opening, 0.0, 1.0);
  const auto variant = static_cast<size_t>(std::ceil(share * (kOpenings - 1) - 0.02));
  bodies_[hand_].first_part = hand_parts_[std::min(variant, hand_parts_.size() - 1)];
  for (int body = 0; body <= hand_; ++body) {
    bodies_[body].pose.X = kinematics.X_BSolid(body);
    PlaceParts(at(body));
  }
}

void ArmBodies::Place(int object, const MovingPose& X_BO) {
  Body& body = bodies_[this->object(object)];
  body.pose = X_BO;
  PlaceParts(body);
}

double ArmBodies::LowerBound(const Part& a, const Part& b) {
  const double balls = (a.X_BP.p - b.X_BP.p).norm() - a.radius - b.radius;
  // The bounding balls of tables and walls are far larger than their distance: they exclude nothing.
  if (const auto* box = std::get_if<geometry::Box>(&b.primitive)) {
    return std::max(balls, BoxToBall(*box, b.X_BP, a.X_BP.p, a.radius));
  }
  return balls;
}

}  // namespace tether::control
