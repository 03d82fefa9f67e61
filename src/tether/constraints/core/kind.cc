#include "tether/constraints/core/kind.h"

#include <cmath>

#include "tether/common/document/reader.h"
#include "tether/constraints/kinds/kinds.h"

namespace tether::constraints {
namespace {

std::string ShowNumber(double number) { return Value(number).AsText(); }

}  // namespace

std::vector<std::string> Parameters::AllFrames() const {
  std::vector<std::string> all;
  for (const std::string& name : frame_order_) {
    if (const auto pair = frames_.find(name); pair != frames_.end()) {
      all.insert(all.end(), pair->second.begin(), pair->second.end());
    } else {
      all.push_back(texts_.at(name));
    }
  }
  return all;
}

void Parameters::BindFrames(const scene::Frames& frames, FrameId moved) {
  const auto find = [&](const std::string& name) { return name == kMoved ? moved : frames.Find(name); };
  frame_ids_.clear();
  pair_ids_.clear();
  for (const std::string& name : frame_order_) {
    if (const auto pair = frames_.find(name); pair != frames_.end()) {
      for (const std::string& frame : pair->second) pair_ids_[name].push_back(find(frame));
    } else {
      frame_ids_[name] = find(texts_.at(name));
    }
  }
}

const std::vector<Kind>& Registry() {
  static const std::vector<Kind> kinds{GraspableKind(), InsideKind(),    PushNormalKind(), RestsOnKind(),
                                       SlideKind(),     SupportedKind(), TouchKind()};
  return kinds;
}

const Kind* FindKind(const std::string& name) {
  for (const Kind& kind : Registry()) {
    if (kind.name == name) return &kind;
  }
  return nullptr;
}

std::vector<std::string> KindNames() {
  std::vector<std::string> names;
  for (const Kind& kind : Registry()) names.push_back(kind.name);
  return names;
}

Parameters ReadParameters(const Kind& kind, const Value& value, Diagnostics& diagnostics) {
  Parameters parameters;
  const std::string what = "constraint '" + kind.name + "'";
  ObjectReader reader(value, what, diagnostics);
  for (const ParameterDoc& doc : kind.parameters) {
    const Value* given = doc.required ? reader.Required(doc.name, doc.doc) : reader.Optional(doc.name);
    const std::string which = "'" + doc.name + "' of " + what;
    switch (doc.type) {
      case ParameterDoc::Type::kFrame:
        parameters.texts_[doc.name] = given != nullptr ? ReadText(*given, which, diagnostics) : "";
        if (given != nullptr) parameters.frame_order_.push_back(doc.name);
        break;
      case ParameterDoc::Type::kText: {
        const std::string text =
            given != nullptr ? ReadText(*given, which, diagnostics) : doc.accepted.front();
        bool known = false;
        for (const std::string& accepted : doc.accepted) known |= accepted == text;
        if (!known) {
          diagnostics.Add(given->where(), which + " is '" + text + "'",
                          JoinAlternatives(doc.accepted) + " is accepted");
        }
        parameters.texts_[doc.name] = known ? text : doc.accepted.front();
        break;
      }
      case ParameterDoc::Type::kNumber: {
        double number = doc.default_number;
        if (given != nullptr) {
          number = ReadNumber(*given, which, diagnostics, number);
          if (number < doc.lower || number > doc.upper) {
            diagnostics.Add(
                given->where(), which + " is '" + given->AsText() + "'",
                "from " + ShowNumber(doc.lower) + " to " + ShowNumber(doc.upper) + " is accepted");
            number = doc.default_number;
          }
        }
        parameters.numbers_[doc.name] = number;
        break;
      }
      case ParameterDoc::Type::kFramePair: {
        std::vector<std::string> pair;
        if (given != nullptr) {
          if (given->is_array() && given->items().size() == 2) {
            for (const Value& item : given->items()) pair.push_back(ReadText(item, which, diagnostics));
          } else {
            diagnostics.Add(given->where(), which + " is not a pair of frames", "[a, b] is accepted");
          }
        }
        pair.resize(2);
        parameters.frames_[doc.name] = pair;
        parameters.frame_order_.push_back(doc.name);
        break;
      }
    }
  }
  reader.Finish();
  return parameters;
}

std::string RegistryReference() {
  std::string page;
  for (const Kind& kind : Registry()) {
    page += "### `" + kind.name + "`\n\n" + kind.summary + " *Source: " + kind.source + ".*\n\n";
    page += "| parameter | accepted | meaning |\n| --- | --- | --- |\n";
    for (const ParameterDoc& doc : kind.parameters) {
      std::string accepted;
      switch (doc.type) {
        case ParameterDoc::Type::kFrame:
          accepted = "a frame";
          break;
        case ParameterDoc::Type::kFramePair:
          accepted = "[frame, frame]";
          break;
        case ParameterDoc::Type::kNumber:
          accepted = ShowNumber(doc.lower) + " … " + ShowNumber(doc.upper) + ", default " +
                     ShowNumber(doc.default_number);
          break;
        case ParameterDoc::Type::kText:
          accepted = JoinAlternatives(doc.accepted) + ", default " + doc.accepted.front();
          break;
      }
      page += "| `" + doc.name + "` | " + accepted + " | " + doc.doc + " |\n";
    }
    page += "\n";
  }
  return page;
}

}  // namespace tether::constraints
