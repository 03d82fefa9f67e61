#include "tether/evaluation/log/log_channels.h"

#include <string>
#include <utility>

namespace tether::evaluation {
namespace {

using Fields = std::vector<std::pair<std::string, std::string>>;

const std::string kNumber = R"({"type":"number"})";
const std::string kNumberOrNull = R"({"type":["number","null"]})";
const std::string kWhole = R"({"type":"integer"})";
const std::string kCount = R"({"type":"integer","minimum":0})";
const std::string kText = R"({"type":"string"})";
const std::string kFlag = R"({"type":"boolean"})";
const std::string kAnything = R"({"type":"object"})";

std::string Titled(const std::string& title) { return title.empty() ? "" : R"("title":")" + title + R"(",)"; }

/// A map with these fields, all required but those whose names end in '?'.
std::string Object(const std::string& title, const Fields& fields) {
  std::string properties, required;
  for (const auto& [name, schema] : fields) {
    const bool optional = name.ends_with('?');
    const std::string key = '"' + (optional ? name.substr(0, name.size() - 1) : name) + '"';
    properties += (properties.empty() ? "" : ",") + key + ":" + schema;
    if (!optional) required += (required.empty() ? "" : ",") + key;
  }
  return "{" + Titled(title) + R"("type":"object","properties":{)" + properties + R"(},"required":[)" +
         required + "]}";
}

std::string List(const std::string& items) { return R"({"type":"array","items":)" + items + "}"; }

std::string Choice(const std::string& title, const std::vector<std::string>& names) {
  std::string options;
  for (size_t i = 0; i < names.size(); ++i) {
    options += (i == 0 ? "" : ",") + ("{" + Titled(names[i])) + R"("const":)" + std::to_string(i) + "}";
  }
  return "{" + Titled(title) + R"("oneOf":[)" + options + "]}";
}

std::string Binary() { return R"({"type":"string","contentEncoding":"base64"})"; }

std::string Time() {
  return R"({"type":"object","title":"time","properties":{"sec":{"type":"integer","minimum":0},)"
         R"("nsec":{"type":"integer","minimum":0,"maximum":999999999}}})";
}
std::string Duration() {
  return R"({"type":"object","title":"duration","properties":{"sec":{"type":"integer"},)"
         R"("nsec":{"type":"integer","minimum":0,"maximum":999999999}}})";
}

std::string Vector3(const std::string& title = "foxglove.Vector3") {
  return Object(title, {{"x", kNumber}, {"y", kNumber}, {"z", kNumber}});
}
std::string Quaternion() {
  return Object("foxglove.Quaternion", {{"x", kNumber}, {"y", kNumber}, {"z", kNumber}, {"w", kNumber}});
}
std::string PoseSchema() {
  return Object("foxglove.Pose", {{"position", Vector3()}, {"orientation", Quaternion()}});
}
std::string Colour() {
  return Object("foxglove.Color", {{"r", kNumber}, {"g", kNumber}, {"b", kNumber}, {"a", kNumber}});
}

std::string TransformsSchema() {
  return Object("foxglove.FrameTransforms",
                {{"transforms", List(Object("foxglove.FrameTransform", {{"timestamp", Time()},
                                                                        {"parent_frame_id", kText},
                                                                        {"child_frame_id", kText},
                                                                        {"translation", Vector3()},
                                                                        {"rotation", Quaternion()}}))}});
}

std::string EntitySchema() {
  const std::string points = List(Vector3("foxglove.Point3")), colours = List(Colour()), pose = PoseSchema();
  const std::string arrow = Object("foxglove.ArrowPrimitive", {{"pose", pose},
                                                               {"shaft_length", kNumber},
                                                               {"shaft_diameter", kNumber},
                                                               {"head_length", kNumber},
                                                               {"head_diameter", kNumber},
                                                               {"color", Colour()}});
  const std::string cube =
      Object("foxglove.CubePrimitive", {{"pose", pose}, {"size", Vector3()}, {"color", Colour()}});
  const std::string sphere =
      Object("foxglove.SpherePrimitive", {{"pose", pose}, {"size", Vector3()}, {"color", Colour()}});
  const std::string cylinder = Object("foxglove.CylinderPrimitive", {{"pose", pose},
                                                                     {"size", Vector3()},
                                                                     {"bottom_scale", kNumber},
                                                                     {"top_scale", kNumber},
                                                                     {"color", Colour()}});
  const std::string line =
      Object("foxglove.LinePrimitive",
             {{"type", Choice("foxglove.LineType", {"LINE_STRIP", "LINE_LOOP", "LINE_LIST"})},
              {"pose", pose},
              {"thickness", kNumber},
              {"scale_invariant", kFlag},
              {"points", points},
              {"color", Colour()},
              {"colors", colours},
              {"indices", List(kCount)}});
  const std::string triangles = Object("foxglove.TriangleListPrimitive", {{"pose", pose},
                                                                          {"points", points},
                                                                          {"color", Colour()},
                                                                          {"colors", colours},
                                                                          {"indices", List(kCount)}});
  const std::string text = Object("foxglove.TextPrimitive", {{"pose", pose},
                                                             {"billboard", kFlag},
                                                             {"font_size", kNumber},
                                                             {"scale_invariant", kFlag},
                                                             {"color", Colour()},
                                                             {"text", kText}});
  const std::string model = Object("foxglove.ModelPrimitive", {{"pose", pose},
                                                               {"scale", Vector3()},
                                                               {"color", Colour()},
                                                               {"override_color", kFlag},
                                                               {"url", kText},
                                                               {"media_type", kText},
                                                               {"data", Binary()}});
  const std::string pair = Object("foxglove.KeyValuePair", {{"key", kText}, {"value", kText}});
  return Object("foxglove.SceneEntity", {{"timestamp", Time()},
                                         {"frame_id", kText},
                                         {"id", kText},
                                         {"lifetime", Duration()},
                                         {"frame_locked", kFlag},
                                         {"metadata", List(pair)},
                                         {"arrows", List(arrow)},
                                         {"cubes", List(cube)},
                                         {"spheres", List(sphere)},
                                         {"cylinders", List(cylinder)},
                                         {"lines", List(line)},
                                         {"triangles", List(triangles)},
                                         {"texts", List(text)},
                                         {"models", List(model)}});
}

std::string SceneSchema() {
  const std::string deletion =
      Object("foxglove.SceneEntityDeletion",
             {{"timestamp", Time()},
              {"type", Choice("foxglove.SceneEntityDeletionType", {"MATCHING_ID", "ALL"})},
              {"id", kText}});
  return Object("foxglove.SceneUpdate", {{"deletions", List(deletion)}, {"entities", List(EntitySchema())}});
}

std::string JointsSchema() {
  return Object("foxglove.JointStates",
                {{"timestamp", Time()},
                 {"joints", List(Object("foxglove.JointState", {{"name", kText},
                                                                {"position?", kNumber},
                                                                {"velocity?", kNumber},
                                                                {"acceleration?", kNumber},
                                                                {"effort?", kNumber}}))}});
}

std::string MessageSchema() {
  return Object(
      "foxglove.Log",
      {{"timestamp", Time()},
       {"level", Choice("foxglove.LogLevel", {"UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"})},
       {"message", kText},
       {"name", kText},
       {"file", kText},
       {"line", kCount}});
}

std::string ImageSchema() {
  return Object("foxglove.CompressedImage",
                {{"timestamp", Time()}, {"frame_id", kText}, {"data", Binary()}, {"format", kText}});
}

std::string CommandSchema() {
  return Object("tether.Commands", {{"timestamp", Time()},
                                    {"robots", List(Object("", {{"name", kText},
                                                                {"mode", kText},
                                                                {"values", List(kNumberOrNull)},
                                                                {"gripper", kText},
                                                                {"gripper_value", kNumberOrNull}}))}});
}

std::string ContactSchema() {
  return Object("tether.Contacts",
                {{"timestamp", Time()},
                 {"contacts", List(Object("", {{"a", kText}, {"b", kText}, {"force", kNumberOrNull}}))}});
}

std::string MarginSchema() {
  return Object(
      "tether.Margins",
      {{"timestamp", Time()},
       {"margins",
        List(Object("", {{"name", kText}, {"unit", kText}, {"group", kText}, {"least", kNumberOrNull}}))}});
}

std::string StateSchema() {
  return Object("tether.State", {{"timestamp", Time()},
                                 {"step", kWhole},
                                 {"actions_done", kWhole},
                                 {"action", kText},
                                 {"held", kText},
                                 {"running", kFlag},
                                 {"retries", kWhole},
                                 {"replans", kWhole}});
}

std::string EventSchema() {
  return Object("tether.Event", {{"timestamp", Time()},
                                 {"time_s", kNumber},
                                 {"kind", kText},
                                 {"step", kWhole},
                                 {"action", kText},
                                 {"text", kText}});
}

std::string RobotSchema() {
  const std::string joint = Object("", {{"name", kText},
                                        {"lower", kNumber},
                                        {"upper", kNumber},
                                        {"max_velocity", kNumber},
                                        {"max_torque", kNumber}});
  return Object("tether.Robots",
                {{"robots", List(Object("", {{"name", kText}, {"model", kText}, {"joints", List(joint)}}))}});
}

}  // namespace

std::vector<LogChannel> LogChannels() {
  return {
      {"/tf", "foxglove.FrameTransforms", TransformsSchema()},
      {"/tf_static", "foxglove.FrameTransforms", TransformsSchema()},
      {"/scene", "foxglove.SceneUpdate", SceneSchema()},
      {"/joints", "foxglove.JointStates", JointsSchema()},
      {"/commands", "tether.Commands", CommandSchema()},
      {"/contacts", "tether.Contacts", ContactSchema()},
      {"/margins", "tether.Margins", MarginSchema()},
      {"/state", "tether.State", StateSchema()},
      {"/events", "tether.Event", EventSchema()},
      {"/log", "foxglove.Log", MessageSchema()},
      {"/marks", "tether.Mark",
       Object("tether.Mark", {{"timestamp", Time()}, {"kind", kText}, {"text", kText}})},
      {"/plan", "tether.Plan", Object("tether.Plan", {{"timestamp", Time()}, {"plan", kAnything}})},
      {"/camera", "foxglove.CompressedImage", ImageSchema()},
      {"/robots", "tether.Robots", RobotSchema()},
      {"/result", "tether.Result", Object("tether.Result", {{"timestamp", Time()}, {"report", kAnything}})},
  };
}

}  // namespace tether::evaluation
