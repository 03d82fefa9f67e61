#pragma once

#include <string>

#include "tether/common/document/reader.h"
#include "tether/scenario/events.h"

namespace tether::scenario {

/// Reads one event. Mistakes go to `diagnostics`.
class EventReader {
 public:
  EventReader(const EventNames& names, Diagnostics& diagnostics) : names_(names), diagnostics_(diagnostics) {}

  Event Read(const Value& value);

 private:
  // event_reader.cc: moments.
  void ReadWhen(const Value& value, Event& event);
  std::string ReadAction(const Value& value, const std::string& what);
  void ReadRandom(const Value& value, Event& event);

  // event_kinds.cc: what happens.
  void ReadMove(const Value& value, Event& event);
  void ReadRotate(const Value& value, Event& event);
  void ReadPush(const Value& value, Event& event);
  void ReadRemoval(const Value& value, Event& event);
  void ReadReturn(const Value& value, Event& event);
  void ReadPull(const Value& value, Event& event);
  void ReadKnock(const Value& value, Event& event);
  void ReadAlteration(const Value& value, Event& event);
  void ReadGoal(const Value& value, Event& event);
  void ReadFault(const Value& value, Event& event);
  /// `movable`: it needs a mass.
  void ReadObject(ObjectReader& reader, const std::string& what, bool movable, Event& event);
  void ReadDestination(const Value& value, Event& event);
  void ReadOver(ObjectReader& reader, const std::string& meaning, Event& event);
  Eigen::Vector3d ReadVector3(const Value& value, const std::string& what);

  void CheckFrame(const std::string& name, const Location& where);

  const EventNames& names_;
  Diagnostics& diagnostics_;
};

}  // namespace tether::scenario
