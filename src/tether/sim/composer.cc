#include "tether/sim/composer.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <variant>

#include <tinyxml2.h>

#include "tether/common/error.h"
#include "tether/common/text.h"
#include "tether/geometry/hull/polytope.h"
#include "tether/robot/gravity.h"
#include "tether/sim/rolling.h"

namespace tether::sim {
namespace {

using tinyxml2::XMLElement;

// Attributes whose text is the name of something, or refers to one, anywhere in MJCF.
constexpr std::array kNameAttributes = {"name", "class",   "childclass", "joint",  "joint1",   "joint2",
                                        "body", "body1",   "body2",      "geom",   "geom1",    "geom2",
                                        "site", "mesh",    "hfield",     "tendon", "material", "texture",
                                        "skin", "tendon1", "tendon2",    "target", "sidesite"};

// Sections of a robot's MJCF that the scene replaces or has no use for.
constexpr std::array kLeftOut = {"compiler", "option",   "size",   "visual",  "statistic",
                                 "actuator", "keyframe", "sensor", "default", "custom"};
constexpr std::array kTaken = {"asset", "contact", "equality", "tendon"};

// Object colours: muted, told apart at a glance.
constexpr std::array<std::array<double, 3>, 8> kPalette = {{{0.87, 0.44, 0.29},
                                                            {0.27, 0.51, 0.71},
                                                            {0.46, 0.66, 0.36},
                                                            {0.90, 0.72, 0.30},
                                                            {0.58, 0.44, 0.70},
                                                            {0.35, 0.67, 0.66},
                                                            {0.80, 0.47, 0.60},
                                                            {0.55, 0.45, 0.38}}};
constexpr std::array<std::array<double, 3>, 3> kFixedPalette = {
    {{0.74, 0.71, 0.66}, {0.60, 0.65, 0.70}, {0.68, 0.62, 0.58}}};

// 17 digits give the same double back.
std::string Text(std::initializer_list<double> numbers) {
  std::string text;
  for (const double number : numbers) {
    std::array<char, 32> buffer;
    FormatInto(buffer.data(), buffer.size(), "%.17g", number);
    if (!text.empty()) text += ' ';
    text += buffer.data();
  }
  return text;
}

void SetPose(XMLElement* element, const math::Pose& X) {
  const Eigen::Quaterniond q = X.Quaternion();
  element->SetAttribute("pos", Text({X.p.x(), X.p.y(), X.p.z()}).c_str());
  element->SetAttribute("quat", Text({q.w(), q.x(), q.y(), q.z()}).c_str());
}

struct GeomWriter {
  XMLElement* geom;
  void Set(const char* type, std::initializer_list<double> size) const {
    geom->SetAttribute("type", type);
    geom->SetAttribute("size", Text(size).c_str());
  }
  XMLElement* assets;
  std::string mesh_name;
  void operator()(const geometry::Hull& hull) const {
    XMLElement* mesh = assets->InsertNewChildElement("mesh");
    mesh->SetAttribute("name", mesh_name.c_str());
    std::string vertices;
    for (const Eigen::Vector3d& p : hull.polytope->vertices) {
      vertices += (vertices.empty() ? "" : " ") + Text({p.x(), p.y(), p.z()});
    }
    mesh->SetAttribute("vertex", vertices.c_str());
    geom->SetAttribute("type", "mesh");
    geom->SetAttribute("mesh", mesh_name.c_str());
  }
  void operator()(const geometry::Box& box) const {
    Set("box", {box.size.x() / 2, box.size.y() / 2, box.size.z() / 2});
  }
  void operator()(const geometry::Sphere& sphere) const { Set("sphere", {sphere.radius}); }
  void operator()(const geometry::Capsule& capsule) const {
    Set("capsule", {capsule.radius, capsule.length / 2});
  }
  void operator()(const geometry::Cylinder& cylinder) const {
    Set("cylinder", {cylinder.radius, cylinder.length / 2});
  }
};

void AddObject(const scene::Object& object, const math::Pose& X_WO, bool driven, int index,
               XMLElement* root) {
  XMLElement* worldbody = root->FirstChildElement("worldbody");
  XMLElement* body = worldbody->InsertNewChildElement("body");
  body->SetAttribute("name", ObjectBodyName(object.name).c_str());
  SetPose(body, X_WO);
  if (object.movable() || driven) {
    XMLElement* joint = body->InsertNewChildElement("joint");
    joint->SetAttribute("type", "free");
    joint->SetAttribute("name", ObjectBodyName(object.name).c_str());
    if (driven) joint->SetAttribute("armature", "1e6");
  }
  double volume = 0;
  for (const geometry::Part& part : object.shape.parts) volume += geometry::Volume(part.primitive);
  const double mass = object.mass.value_or(1.0);
  for (const geometry::Part& part : object.shape.parts) {
    XMLElement* geom = body->InsertNewChildElement("geom");
    const std::string mesh_name =
        ObjectBodyName(object.name) + "/" + std::to_string(&part - object.shape.parts.data() + 1);
    std::visit(GeomWriter{geom, root->FirstChildElement("asset"), mesh_name}, part.primitive);
    SetPose(geom, part.X_SP);
    geom->SetAttribute("mass", Text({mass * geometry::Volume(part.primitive) / volume}).c_str());
    geom->SetAttribute("friction", Text({object.friction, 0.02, 0.0001}).c_str());
    if (object.rgba) {
      const Eigen::Vector4d& c = *object.rgba;
      geom->SetAttribute("rgba", Text({c[0], c[1], c[2], c[3]}).c_str());
    } else {
      const std::array<double, 3>& c =
          object.movable() ? kPalette[index % kPalette.size()] : kFixedPalette[index % kFixedPalette.size()];
      geom->SetAttribute("rgba", Text({c[0], c[1], c[2], 1}).c_str());
    }
  }
}

template <typename Kind>
bool HasPart(const scene::Object& object) {
  return std::any_of(object.shape.parts.begin(), object.shape.parts.end(),
                     [](const geometry::Part& part) { return std::holds_alternative<Kind>(part.primitive); });
}

bool Contains(const auto& words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

void Prefix(XMLElement* element, const std::string& prefix) {
  for (const char* attribute : kNameAttributes) {
    const char* value = element->Attribute(attribute);
    if (value == nullptr || std::string_view(value) == "world") continue;
    element->SetAttribute(attribute, (prefix + value).c_str());
  }
  for (XMLElement* child = element->FirstChildElement(); child; child = child->NextSiblingElement()) {
    Prefix(child, prefix);
  }
}

// Converts one robot's MJCF for inclusion in the scene's.
class RobotMerger {
 public:
  RobotMerger(const scene::Robot& robot, const robot::Model& model, const math::Pose& X_WB, XMLElement* root)
      : prefix_(RobotPrefix(robot.name)), path_(model.mjcf_path()), X_WB_(X_WB), root_(root) {
    if (document_.Parse(model.mjcf().c_str(), model.mjcf().size()) != tinyxml2::XML_SUCCESS) {
      throw InputError({{{path_}, document_.ErrorStr(), "well-formed XML is accepted"}});
    }
  }

  void Merge() {
    XMLElement* source = document_.RootElement();
    ReadCompiler(source);
    for (XMLElement* section = source->FirstChildElement(); section;
         section = section->NextSiblingElement()) {
      const std::string_view kind = section->Name();
      if (kind == "default") MergeDefaults(section);
    }
    XMLElement* base = root_->FirstChildElement("worldbody")->InsertNewChildElement("body");
    base->SetAttribute("name", prefix_.substr(0, prefix_.size() - 1).c_str());
    if (has_defaults_) base->SetAttribute("childclass", MainClass().c_str());
    SetPose(base, X_WB_);
    for (XMLElement* section = source->FirstChildElement(); section;
         section = section->NextSiblingElement()) {
      const std::string_view kind = section->Name();
      if (kind == "worldbody") {
        Prefix(section, prefix_);
        CopyChildren(section, base, false);
      } else if (Contains(kTaken, kind)) {
        if (kind == "asset") LocateFiles(section);
        Prefix(section, prefix_);
        CopyChildren(section, root_->InsertNewChildElement(section->Name()), has_defaults_);
      } else if (!Contains(kLeftOut, kind)) {
        diagnostics_.Add(
            {path_, section->GetLineNum()},
            "the section '" + std::string(kind) + "' can't be put into a scene",
            "a robot's MJCF with worldbody, default, asset, contact, equality and tendon is accepted");
      }
    }
    diagnostics_.ThrowIfAny();
  }

 private:
  std::string MainClass() const { return prefix_ + "main"; }

  void ReadCompiler(XMLElement* source) {
    const char* angle = nullptr;
    int line = source->GetLineNum();
    for (XMLElement* compiler = source->FirstChildElement("compiler"); compiler;
         compiler = compiler->NextSiblingElement("compiler")) {
      line = compiler->GetLineNum();
      if (compiler->Attribute("angle")) angle = compiler->Attribute("angle");
      if (compiler->Attribute("meshdir")) mesh_folder_ = compiler->Attribute("meshdir");
      if (compiler->Attribute("texturedir")) texture_folder_ = compiler->Attribute("texturedir");
      for (const auto& [name, usual] : {std::pair{"eulerseq", "xyz"}, std::pair{"coordinate", "local"},
                                        std::pair{"autolimits", "true"}}) {
        const char* value = compiler->Attribute(name);
        if (value == nullptr || std::string_view(value) == usual) continue;
        diagnostics_.Add({path_, line}, "the compiler option " + std::string(name) + " is '" + value + "'",
                         "'" + std::string(usual) + "' is accepted in a robot's MJCF");
      }
    }
    if (angle == nullptr || std::string_view(angle) != "radian") {
      diagnostics_.Add({path_, line}, "the robot's MJCF has angles in degrees",
                       "<compiler angle=\"radian\"/> is accepted");
    }
  }

  void MergeDefaults(XMLElement* section) {
    XMLElement* defaults = root_->FirstChildElement("default");
    Prefix(section, prefix_);
    section->SetAttribute("class", MainClass().c_str());
    defaults->InsertEndChild(section->DeepClone(root_->GetDocument()));
    has_defaults_ = true;
  }

  // Files are named relative to the robot's MJCF; meshes without a name are called after their file.
  void LocateFiles(XMLElement* assets) {
    namespace fs = std::filesystem;
    for (XMLElement* asset = assets->FirstChildElement(); asset; asset = asset->NextSiblingElement()) {
      const char* file = asset->Attribute("file");
      if (file == nullptr) continue;
      const bool texture = std::string_view(asset->Name()) == "texture";
      if (!asset->Attribute("name")) asset->SetAttribute("name", fs::path(file).stem().c_str());
      const fs::path located =
          fs::path(path_).parent_path() / (texture ? texture_folder_ : mesh_folder_) / file;
      asset->SetAttribute("file", fs::absolute(located).c_str());
    }
  }

  // Elements outside of bodies have no childclass to inherit: those that may have a class get it one by one.
  void CopyChildren(XMLElement* from, XMLElement* to, bool set_class) {
    constexpr std::array kClassless = {"exclude", "texture", "hfield", "skin"};
    for (XMLElement* child = from->FirstChildElement(); child; child = child->NextSiblingElement()) {
      if (set_class && !child->Attribute("class") && !Contains(kClassless, child->Name())) {
        child->SetAttribute("class", MainClass().c_str());
      }
      to->InsertEndChild(child->DeepClone(root_->GetDocument()));
    }
  }

  std::string prefix_;
  std::string path_;
  math::Pose X_WB_;
  XMLElement* root_;
  tinyxml2::XMLDocument document_;
  std::string mesh_folder_, texture_folder_;
  bool has_defaults_ = false;
  Diagnostics diagnostics_;
};

// Everything here is the same for all scenes. reference: contact settings that hold a grasp by friction, with
// the default ones held objects creep out of the gripper.
constexpr const char* kFrame = R"(<mujoco model="tether">
  <compiler angle="radian" autolimits="true"/>
  <option cone="elliptic" jacobian="sparse" impratio="100" solver="Newton" iterations="100" tolerance="1e-9"/>
  <statistic meaninertia="0.1"/>
  <size/>
  <visual>
    <headlight ambient="0.38 0.38 0.4" diffuse="0.35 0.35 0.35" specular="0.05 0.05 0.05"/>
    <quality shadowsize="2048"/>
    <map znear="0.02" zfar="40"/>
  </visual>
  <default>
    <geom condim="4" friction="0.8 0.02 0.0001" solref="0.004 1" solimp="0.95 0.99 0.001"/>
  </default>
  <asset>
    <texture name="sky" type="skybox" builtin="gradient" rgb1="0.98 0.98 0.99" rgb2="0.78 0.83 0.88" width="256" height="256"/>
  </asset>
  <worldbody>
    <light directional="true" pos="1.5 -1.5 4" dir="-0.35 0.4 -1" diffuse="0.5 0.5 0.48" specular="0.15 0.15 0.15"/>
  </worldbody>
</mujoco>)";

}  // namespace

bool HasHull(const scene::Object& object) { return HasPart<geometry::Hull>(object); }

std::string ObjectBodyName(const std::string& object) { return "object/" + object; }
std::string RobotPrefix(const std::string& robot) { return robot + "/"; }

std::string ComposeMjcf(const scene::Scene& scene, const Composition& composition) {
  tinyxml2::XMLDocument document;
  document.Parse(kFrame);
  XMLElement* root = document.RootElement();
  root->FirstChildElement("option")->SetAttribute("timestep", Text({composition.timestep}).c_str());
  root->FirstChildElement("option")->SetAttribute("gravity", Text({0, 0, -robot::kGravity}).c_str());
  const bool roll = std::any_of(scene.objects.begin(), scene.objects.end(), [](const scene::Object& object) {
    return object.movable() && Rolls(object.shape);
  });
  const int contacts = std::max(1, composition.contact_room);
  root->FirstChildElement("size")->SetAttribute("nconmax", contacts);
  root->FirstChildElement("size")->SetAttribute("njmax", (roll ? 6 : 4) * contacts + 100);

  // Without it, hulls and cylinders get one contact point only, on which nothing stands still. Other pairs
  // don't use it.
  const bool one_point = std::any_of(scene.objects.begin(), scene.objects.end(), [](const auto& object) {
    return HasPart<geometry::Hull>(object) || HasPart<geometry::Cylinder>(object);
  });
  if (one_point) {
    root->FirstChildElement("option")->InsertNewChildElement("flag")->SetAttribute("multiccd", "enable");
  }

  for (const scene::Robot& robot : scene.robots) {
    RobotMerger(robot, *composition.models.at(robot.name), scene.InitialPose(robot.name), root).Merge();
  }
  int movable = 0, fixed = 0;
  for (const scene::Object& object : scene.objects) {
    AddObject(object, composition.X_WO.at(object.name), composition.driven.contains(object.name),
              object.movable() ? movable++ : fixed++, root);
  }
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

}  // namespace tether::sim
