#include "tether/common/output/outputs.h"

namespace tether {

void Outputs::Add(const std::string& path, const char* option) {
  if (!path.empty()) outputs_.push_back({path, option});
}

void Outputs::Require(const std::vector<std::string>& inputs) const {
  Diagnostics diagnostics;
  for (size_t i = 0; i < outputs_.size(); ++i) {
    const Output& output = outputs_[i];
    const bool stream = output.path == "-";
    const std::string problem = stream ? "" : WhyNotWritable(output.path);
    if (!problem.empty()) {
      diagnostics.Add({}, output.option + ": cannot write " + output.path + ": " + problem,
                      "a path in a writable folder");
      continue;
    }
    for (size_t j = 0; j < i; ++j) {
      const Output& other = outputs_[j];
      const bool same =
          stream || other.path == "-" ? output.path == other.path : IsSameFile(output.path, other.path);
      if (same)
        diagnostics.Add({}, other.option + " and " + output.option + " are both " + output.path,
                        "another file for each");
    }
    for (const std::string& input : inputs) {
      if (!stream && !input.empty() && IsSameFile(output.path, input))
        diagnostics.Add({}, output.option + ": " + output.path + " is a file that is read, " + input,
                        "another file");
    }
  }
  diagnostics.ThrowIfAny();
}

void Outputs::RequireUnread() const {
  Diagnostics diagnostics;
  for (const Output& output : outputs_) {
    if (output.path != "-" && WasRead(output.path))
      diagnostics.Add({}, output.option + ": " + output.path + " is a file that was read", "another file");
  }
  diagnostics.ThrowIfAny();
}

void Outputs::WriteText(const std::string& path, std::string_view text) {
  WriteText(path, [&](const TextSink& sink) { sink(text); });
}

void Outputs::WriteText(const std::string& path, const TextSource& source) {
  if (path.empty()) return;
  try {
    WriteOutput(path, source);
  } catch (const InputError& error) {
    problems_.Add(error);
  }
}

void Outputs::Write(const std::string& path, const Value& value) {
  if (!path.empty()) WriteText(path, WriteJson(value));
}

}  // namespace tether
