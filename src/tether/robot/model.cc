#include "tether/robot/model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <set>
#include <utility>

#include <mujoco/mujoco.h>

#include "tether/common/bounds.h"
#include "tether/common/document/reader.h"
#include "tether/common/file.h"
#include "tether/common/text.h"
#include "tether/robot/arm_reader.h"
#include "tether/robot/model_impl.h"
#include "tether/robot/mujoco_setup.h"

namespace tether::robot {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFormat = "tether.robot/1";
// Where a description does not say: all of the torque within 0.1 s, the greatest velocity within 0.2 s, the
// greatest acceleration within 0.01 s. 1/s.
constexpr double kTorqueRate = 10;
constexpr double kAcceleration = 5;
constexpr double kJerk = 100;

std::vector<std::string> ShippedModels(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code failed;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, failed)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

fs::path FindDescription(const std::string& name_or_path) {
  const fs::path path(name_or_path);
  const std::string extension = path.extension().string();
  if (path.has_parent_path() || extension == ".yaml" || extension == ".yml") return path;
  const fs::path folder = fs::path(DataDirectory()) / "models" / "robots";
  const fs::path shipped = folder / (name_or_path + ".yaml");
  if (fs::exists(shipped)) return shipped;
  throw InputError(
      "there is no robot model '" + name_or_path + "'",
      SuggestFrom(name_or_path, ShippedModels(folder)) + ", or the path of a YAML file of format " + kFormat);
}

double Positive(ObjectReader& reader, std::string_view key) {
  const Value* value = reader.Required(key, "a finite number above zero");
  return value ? ReadPositive(*value, "'" + std::string(key) + "' of " + reader.what(), reader.diagnostics())
               : 1;
}

double RequiredNumber(ObjectReader& reader, std::string_view key) {
  const Value* value = reader.Required(key, "a finite number");
  return value ? ReadNumber(*value, "'" + std::string(key) + "' of " + reader.what(), reader.diagnostics())
               : 0;
}

std::string RequiredText(ObjectReader& reader, std::string_view key, std::string_view accepted) {
  const Value* value = reader.Required(key, accepted);
  return value ? ReadText(*value, "'" + std::string(key) + "' of " + reader.what(), reader.diagnostics())
               : "";
}

Eigen::VectorXd RequiredVector(ObjectReader& reader, std::string_view key, int size) {
  const Eigen::VectorXd zeros = Eigen::VectorXd::Zero(size);
  const Value* value = reader.Required(key, "a list of " + std::to_string(size) + " finite numbers");
  if (value == nullptr) return zeros;
  return ReadVector(*value, size, "'" + std::string(key) + "' of " + reader.what(), reader.diagnostics())
      .value_or(zeros);
}

/// `otherwise` where the description does not say.
Eigen::VectorXd OptionalVector(ObjectReader& reader, std::string_view key, const Eigen::VectorXd& otherwise) {
  if (reader.Optional(key) == nullptr) return otherwise;
  return RequiredVector(reader, key, static_cast<int>(otherwise.size()));
}

std::vector<std::string> RequiredNames(ObjectReader& reader, std::string_view key) {
  const Value* value = reader.Required(key, "a list of names of joints");
  std::vector<std::string> names = reader.TextList(key);
  if (value != nullptr && value->is_array() && names.empty()) {
    reader.diagnostics().Add(value->where(), "'" + std::string(key) + "' of " + reader.what() + " is empty",
                             "a list of names of joints is accepted");
  }
  const std::set<std::string> distinct(names.begin(), names.end());
  if (distinct.size() != names.size()) {
    reader.diagnostics().Add(value->where(),
                             "'" + std::string(key) + "' of " + reader.what() + " names a joint twice",
                             "each joint once is accepted");
  }
  return names;
}

// Fingers on hinges: all of `open`, `closed` and `closing_torque`, or none.
void ReadHinges(ObjectReader& reader, size_t fingers, Gripper& gripper) {
  const auto keys = {std::pair{"open", &gripper.open}, std::pair{"closed", &gripper.closed},
                     std::pair{"closing_torque", &gripper.closing_torque}};
  if (std::none_of(keys.begin(), keys.end(),
                   [&](const auto& key) { return reader.Optional(key.first) != nullptr; })) {
    return;
  }
  for (const auto& [key, numbers] : keys) {
    const Eigen::VectorXd read = RequiredVector(reader, key, static_cast<int>(fingers));
    numbers->assign(read.data(), read.data() + read.size());
  }
  for (size_t i = 0; i < fingers; ++i) {
    if (reader.value().Find("closed") != nullptr && gripper.open[i] == gripper.closed[i]) {
      reader.diagnostics().Add(
          reader.value().Find("closed")->where(),
          "'closed' of gripper has finger " + std::to_string(i + 1) + " where it is open",
          "angles that differ from those of 'open' are accepted");
    }
    if (reader.value().Find("closing_torque") != nullptr && !(gripper.closing_torque[i] > 0)) {
      reader.diagnostics().Add(reader.value().Find("closing_torque")->where(),
                               "'closing_torque' of gripper has an entry that is not above zero",
                               "numbers above zero are accepted");
    }
  }
}

void ReadGripper(const Value& value, Gripper& gripper, std::vector<std::string>& joints,
                 Diagnostics& diagnostics) {
  ObjectReader reader(value, "gripper", diagnostics);
  joints = RequiredNames(reader, "joints");
  ReadHinges(reader, joints.size(), gripper);
  gripper.max_opening = Positive(reader, "max_opening");
  gripper.max_width = gripper.max_opening;
  if (const Value* width = reader.Optional("max_width")) {
    gripper.max_width = ReadPositive(*width, "'max_width' of gripper", diagnostics);
  }
  gripper.pad_half_width = Positive(reader, "pad_half_width");
  gripper.pad_half_height = Positive(reader, "pad_half_height");
  gripper.palm_depth = Positive(reader, "palm_depth");
  gripper.max_force = Positive(reader, "max_force");
  reader.Finish();
}

void ReadReach(const Value& value, Reach& reach, Diagnostics& diagnostics) {
  ObjectReader reader(value, "reach", diagnostics);
  reach.centre = RequiredVector(reader, "centre", 3);
  reach.wrist_hand = RequiredVector(reader, "wrist", 3);
  reach.min = RequiredNumber(reader, "min");
  reach.max = Positive(reader, "max");
  reader.Finish();
  if (reach.min < 0 || reach.min >= reach.max) {
    diagnostics.Add(value.where(),
                    "reach has min " + WriteJson(reach.min, 0) + " and max " + WriteJson(reach.max, 0),
                    "0 ≤ min < max is accepted");
  }
}

void ReadSolid(const Value& value, bool hinged, HandSolid& solid, Diagnostics& diagnostics) {
  ObjectReader reader(value, "solid", diagnostics);
  if (const Value* palm = reader.Required("palm", "a map with box, or radius and length, and position")) {
    ObjectReader part(*palm, "palm", diagnostics);
    if (part.Optional("box") != nullptr) {
      const Eigen::Vector3d size = RequiredVector(part, "box", 3);
      if (size.minCoeff() <= 0)
        diagnostics.Add(palm->where(), "palm has a side that is not positive", "box: [x, y, z] in m");
      solid.palm.primitive = geometry::Box{size};
    } else {
      const double radius = Positive(part, "radius"), length = Positive(part, "length");
      solid.palm = {geometry::Capsule{radius, length},
                    math::Pose(math::RotationFromRpy({M_PI / 2, 0, 0}), Eigen::Vector3d::Zero())};
    }
    solid.palm.X_SP.p = RequiredVector(part, "position", 3);
    part.Finish();
  }
  const char* finger_keys = "a map with radius, outward, from and to";
  if (const Value* finger = hinged ? nullptr : reader.Required("finger", finger_keys)) {
    ObjectReader part(*finger, "finger", diagnostics);
    solid.finger_radius = Positive(part, "radius");
    solid.finger_outward = RequiredNumber(part, "outward");
    solid.finger_from = RequiredNumber(part, "from");
    solid.finger_to = RequiredNumber(part, "to");
    part.Finish();
    if (solid.finger_from >= solid.finger_to) {
      diagnostics.Add(finger->where(), "finger has 'from' at or above 'to'",
                      "heights in the hand frame with from < to are accepted");
    }
  }
  reader.Finish();
}

// "planned_range: {joint4: [-3.0, -0.9]}", within the limits, which `lower` and `upper` are before, and about
// home.
void ReadPlannedRange(const Value& value, const std::vector<std::string>& joints, const Eigen::VectorXd& home,
                      Eigen::VectorXd& lower, Eigen::VectorXd& upper, Diagnostics& diagnostics) {
  ObjectReader reader(value, "planned_range", diagnostics);
  for (size_t i = 0; i < joints.size(); ++i) {
    const auto joint = static_cast<Eigen::Index>(i);
    if (reader.Optional(joints[i]) == nullptr) continue;
    const Eigen::VectorXd range = RequiredVector(reader, joints[i].c_str(), 2);
    if (range.size() != 2) continue;
    if (range[0] < lower[joint] || range[1] > upper[joint] || range[0] > home[joint] ||
        range[1] < home[joint]) {
      diagnostics.Add(value.Find(joints[i])->where(),
                      "planned_range of '" + joints[i] + "' is " + WriteJson(range[0], 0) + " to " +
                          WriteJson(range[1], 0),
                      "a range about home (" + WriteJson(home[joint], 0) + ") within the limits " +
                          WriteJson(lower[joint], 0) + " and " + WriteJson(upper[joint], 0) + " is accepted");
      continue;
    }
    lower[joint] = range[0];
    upper[joint] = range[1];
  }
  reader.Finish();
}

void CheckPositive(const Value& root, std::string_view key, const Eigen::VectorXd& vector,
                   Diagnostics& diagnostics) {
  const Value* value = root.Find(key);
  if (value == nullptr || vector.size() == 0 || (vector.array() > 0).all() || vector.isZero()) return;
  diagnostics.Add(value->where(), "'" + std::string(key) + "' has an entry that is not above zero",
                  "numbers above zero are accepted");
}

std::vector<std::string> NamesOf(const mjModel* model, int type, int count) {
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) {
    if (const char* name = mj_id2name(model, type, i)) names.emplace_back(name);
  }
  return names;
}

// The id of a joint or site of the MJCF file, or −1 after reporting that it isn't there.
int FindInMjcf(const mjModel* model, mjtObj type, int count, const std::string& word, const std::string& name,
               const Location& where, Diagnostics& diagnostics) {
  const int id = mj_name2id(model, type, name.c_str());
  if (id >= 0) return id;
  const std::vector<std::string> names = NamesOf(model, type, count);
  diagnostics.Add(where, "the MJCF file has no " + word + " '" + name + "'",
                  names.empty() ? "it has none" : SuggestFrom(name, names));
  return -1;
}

/// The elements of an MJCF file that are farther than 10 km from their parent, or larger.
void CheckLengths(const mjModel* model, const std::string& path, Diagnostics& diagnostics) {
  const auto check = [&](const mjtNum* numbers, int count, int each, int type, const char* what) {
    for (int i = 0; i < count; ++i) {
      const Eigen::Map<const Eigen::VectorXd> entries(numbers + each * i, each);
      if (entries.allFinite() && entries.cwiseAbs().maxCoeff() <= kGreatestLength) continue;
      const char* name = mj_id2name(model, type, i);
      diagnostics.Add({path, 0, 0},
                      std::string("a ") + what + " of '" + (name != nullptr ? name : "") + "' (number " +
                          std::to_string(i) + ") is beyond 10 km",
                      "lengths of a robot, m");
    }
  };
  check(model->geom_size, model->ngeom, 3, mjOBJ_GEOM, "size");
  check(model->geom_pos, model->ngeom, 3, mjOBJ_GEOM, "position");
  check(model->body_pos, model->nbody, 3, mjOBJ_BODY, "position");
  check(model->jnt_pos, model->njnt, 3, mjOBJ_JOINT, "position");
  check(model->site_pos, model->nsite, 3, mjOBJ_SITE, "position");
}

}  // namespace

void Model::Impl::DeleteModel::operator()(mjModel_* model) const { mj_deleteModel(model); }

Model::Model(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Model::~Model() = default;

std::string Model::Impl::ReadDescription(const Value& root, Diagnostics& diagnostics) {
  ObjectReader reader(root, "the robot description", diagnostics);
  if (const Value* format = reader.Required("format", kFormat); format && format->AsText() != kFormat) {
    diagnostics.Add(format->where(), "format is '" + format->AsText() + "'",
                    std::string(kFormat) + " is accepted");
  }
  name = RequiredText(reader, "name", "a name");
  std::string path = RequiredText(reader, "mjcf", "the path of an MJCF file, relative to this one");
  joints = RequiredNames(reader, "joints");
  const int n = static_cast<int>(joints.size());
  max_torque = RequiredVector(reader, "max_torque", n);
  max_velocity = RequiredVector(reader, "max_velocity", n);
  max_torque_rate = OptionalVector(reader, "max_torque_rate", kTorqueRate * max_torque);
  max_acceleration = OptionalVector(reader, "max_acceleration", kAcceleration * max_velocity);
  max_jerk = OptionalVector(reader, "max_jerk", kJerk * max_acceleration);
  home = RequiredVector(reader, "home", n);
  hand_site = RequiredText(reader, "hand", "the name of a site");
  if (const Value* value = reader.Required("gripper", "a map")) {
    ReadGripper(*value, gripper, finger_joints, diagnostics);
  }
  if (const Value* value = reader.Required("reach", "a map")) ReadReach(*value, reach, diagnostics);
  if (const Value* value = reader.Required("solid", "a map")) {
    ReadSolid(*value, gripper.hinged(), solid, diagnostics);
  }
  reader.Optional("planned_range");
  reader.Finish();
  CheckPositive(root, "max_torque", max_torque, diagnostics);
  CheckPositive(root, "max_velocity", max_velocity, diagnostics);
  CheckPositive(root, "max_torque_rate", max_torque_rate, diagnostics);
  CheckPositive(root, "max_acceleration", max_acceleration, diagnostics);
  CheckPositive(root, "max_jerk", max_jerk, diagnostics);
  if (n > kMostJoints) {
    diagnostics.Add(root.Find("joints")->where(), "'joints' are " + std::to_string(n),
                    "up to " + std::to_string(kMostJoints) + " joints are accepted");
  }
  return path;
}

void Model::Impl::LoadMjcf(const Value& root, Diagnostics& diagnostics) {
  try {
    mjcf = ReadFile(mjcf_path);
  } catch (const InputError& error) {
    diagnostics.Add(root.Find("mjcf")->where(), error.what(),
                    "the path of an MJCF file, relative to this one");
    diagnostics.ThrowIfAny();
  }
  std::array<char, 1000> message{};
  try {
    const PlainLocale plain;  // MuJoCo reads numbers as the locale says.
    mujoco.reset(mj_loadXML(mjcf_path.c_str(), nullptr, message.data(), message.size()));
  } catch (const MujocoError& error) {
    throw InputError({{{mjcf_path}, error.what(), "MJCF as MuJoCo 2.2 reads it is accepted"}});
  }
  if (mujoco == nullptr) {
    throw InputError({{{mjcf_path}, message.data(), "MJCF as MuJoCo 2.2 reads it is accepted"}});
  }
  // Only kinematics and dynamics are computed with it: room for contacts would be 90 % of each mjData.
  mujoco->nconmax = mujoco->njmax = 1;
}

std::vector<int> Model::Impl::FindJoints(const Value& root, Diagnostics& diagnostics) {
  const mjModel* model = mujoco.get();
  const int n = static_cast<int>(joints.size());
  std::vector<int> joint_ids;
  lower.resize(n);
  upper.resize(n);
  for (int i = 0; i < n; ++i) {
    const Location& where = root.Find("joints")->items()[i].where();
    const std::string& joint = joints[i];
    const int id = FindInMjcf(model, mjOBJ_JOINT, model->njnt, "joint", joint, where, diagnostics);
    if (id < 0) continue;
    if (model->jnt_type[id] != mjJNT_HINGE || !model->jnt_limited[id]) {
      diagnostics.Add(where, "joint '" + joint + "' of the MJCF file is not a hinge with limits",
                      "a joint of type hinge with a range is accepted");
      continue;
    }
    joint_ids.push_back(id);
    qpos_address.push_back(model->jnt_qposadr[id]);
    dof_address.push_back(model->jnt_dofadr[id]);
    lower[i] = model->jnt_range[2 * id];
    upper[i] = model->jnt_range[2 * id + 1];
    if (home[i] < lower[i] || home[i] > upper[i]) {
      diagnostics.Add(root.Find("home")->where(),
                      "home has joint '" + joint + "' at " + WriteJson(home[i], 0),
                      "its limits are " + WriteJson(lower[i], 0) + " and " + WriteJson(upper[i], 0));
    }
  }
  return joint_ids;
}

std::vector<int> Model::Impl::FindFingers(const Value& root, Diagnostics& diagnostics) const {
  const mjModel* model = mujoco.get();
  std::vector<int> finger_ids;
  for (size_t i = 0; i < finger_joints.size(); ++i) {
    const Location& where = root.Find("gripper")->Find("joints")->items()[i].where();
    const std::string& joint = finger_joints[i];
    const int id = FindInMjcf(model, mjOBJ_JOINT, model->njnt, "joint", joint, where, diagnostics);
    finger_ids.push_back(id);
    const bool hinged = gripper.hinged();
    if (id >= 0 && (model->jnt_type[id] != (hinged ? mjJNT_HINGE : mjJNT_SLIDE) || !model->jnt_limited[id])) {
      const std::string type = hinged ? "hinge" : "slide";
      diagnostics.Add(where, "joint '" + joint + "' of the MJCF file is not a " + type + " with limits",
                      "a joint of type " + type + " with a range is accepted" +
                          (hinged ? "" : "; hinges need 'open', 'closed' and 'closing_torque'"));
    }
  }
  return finger_ids;
}

std::shared_ptr<const Model> Model::Load(const std::string& name_or_path) {
  PrepareMujoco();
  const fs::path path = FindDescription(name_or_path);
  const Value root = ReadYaml(path.string());
  auto impl = std::make_unique<Impl>();
  Diagnostics diagnostics;

  const std::string mjcf = impl->ReadDescription(root, diagnostics);
  diagnostics.ThrowIfAny();

  impl->mjcf_path = (path.parent_path() / mjcf).string();
  impl->LoadMjcf(root, diagnostics);
  const mjModel* model = impl->mujoco.get();
  CheckLengths(model, impl->mjcf_path, diagnostics);
  diagnostics.ThrowIfAny();
  const std::vector<int> joint_ids = impl->FindJoints(root, diagnostics);
  impl->planned_lower = impl->lower;
  impl->planned_upper = impl->upper;
  const Value* planned_range = root.Find("planned_range");
  if (planned_range != nullptr && joint_ids.size() == impl->joints.size())
    ReadPlannedRange(*planned_range, impl->joints, impl->home, impl->planned_lower, impl->planned_upper,
                     diagnostics);
  const std::vector<int> finger_ids = impl->FindFingers(root, diagnostics);
  impl->site_id = FindInMjcf(model, mjOBJ_SITE, model->nsite, "site", impl->hand_site,
                             root.Find("hand")->where(), diagnostics);
  diagnostics.ThrowIfAny();

  impl->gripper.pad_friction = ReadPadFriction(model, finger_ids).value_or(impl->gripper.pad_friction);
  ArmDescription arm = ReadArm(model, joint_ids, finger_ids, impl->site_id);
  for (const std::string& problem : arm.problems) {
    diagnostics.Add(root.Find("joints")->where(), problem,
                    "a chain of joints is accepted, each moving the next one and the last one the hand");
  }
  diagnostics.ThrowIfAny();
  impl->chain = std::move(arm.chain);
  impl->outer_reach = FindOuterReach(impl->chain);
  impl->solids.links = std::move(arm.links);
  const std::shared_ptr<Model> loaded(new Model(std::move(impl)));
  loaded->impl_->solids.pairs = PairsToCheck(loaded, arm.excluded);
  return loaded;
}

double Gripper::FingerPosition(size_t finger, size_t fingers, double opening) const {
  if (!hinged()) return opening / static_cast<double>(fingers);
  return closed[finger] + (open[finger] - closed[finger]) * opening / max_opening;
}

double Gripper::OpeningShare(size_t finger, size_t fingers, double position) const {
  if (!hinged()) return position;
  return max_opening / static_cast<double>(fingers) * (position - closed[finger]) /
         (open[finger] - closed[finger]);
}

const std::string& Model::name() const { return impl_->name; }
int Model::dof() const { return static_cast<int>(impl_->joints.size()); }
const std::vector<std::string>& Model::joint_names() const { return impl_->joints; }
const Eigen::VectorXd& Model::lower() const { return impl_->lower; }
const Eigen::VectorXd& Model::upper() const { return impl_->upper; }
const Eigen::VectorXd& Model::planned_lower() const { return impl_->planned_lower; }
const Eigen::VectorXd& Model::planned_upper() const { return impl_->planned_upper; }
const Eigen::VectorXd& Model::max_velocity() const { return impl_->max_velocity; }
const Eigen::VectorXd& Model::max_torque() const { return impl_->max_torque; }
const Eigen::VectorXd& Model::max_torque_rate() const { return impl_->max_torque_rate; }
const Eigen::VectorXd& Model::max_acceleration() const { return impl_->max_acceleration; }
const Eigen::VectorXd& Model::max_jerk() const { return impl_->max_jerk; }
const Eigen::VectorXd& Model::home() const { return impl_->home; }
const Gripper& Model::gripper() const { return impl_->gripper; }
const Reach& Model::reach() const { return impl_->reach; }
const Chain& Model::chain() const { return impl_->chain; }
const OuterReach& Model::outer_reach() const { return impl_->outer_reach; }
const ArmSolids& Model::solids() const { return impl_->solids; }
const std::string& Model::mjcf() const { return impl_->mjcf; }
const std::string& Model::mjcf_path() const { return impl_->mjcf_path; }
const std::string& Model::hand_site() const { return impl_->hand_site; }
const std::vector<std::string>& Model::finger_joints() const { return impl_->finger_joints; }

geometry::Shape Model::HandShape(double opening) const {
  const HandSolid& solid = impl_->solid;
  std::vector<geometry::Part> parts;
  parts.push_back(solid.palm);
  if (impl_->gripper.hinged()) {
    for (geometry::Part& part : ReadFingers(*this, impl_->mujoco.get(), impl_->site_id, opening)) {
      parts.push_back(std::move(part));
    }
    return geometry::Shape(std::move(parts));
  }
  for (const double side : {1.0, -1.0}) {
    const math::Pose X_HFinger(Eigen::Vector3d(0, side * (opening / 2 + solid.finger_outward),
                                               (solid.finger_from + solid.finger_to) / 2));
    parts.push_back({geometry::Capsule{solid.finger_radius, solid.finger_to - solid.finger_from}, X_HFinger});
  }
  return geometry::Shape(std::move(parts));
}

}  // namespace tether::robot
