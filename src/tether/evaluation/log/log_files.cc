#include "tether/evaluation/log/log_files.h"

#include <stdlib.h>  // NOLINT: mkdtemp() is POSIX

#include <algorithm>
#include <filesystem>

#include "tether/common/error.h"
#include "tether/common/file.h"
#include "tether/robot/model.h"

namespace tether::evaluation {
namespace {

namespace fs = std::filesystem;

constexpr uintmax_t kMostBytes = uintmax_t{16} << 20;

bool IsSame(const std::string& path, const std::string& text) {
  std::error_code error;
  if (!fs::is_regular_file(path, error) || fs::file_size(path, error) != text.size()) return false;
  try {
    return ReadFile(path) == text;
  } catch (const InputError&) {
    return false;
  }
}

}  // namespace

std::map<std::string, std::string> FilesOfThisRun() {
  std::map<std::string, std::string> files;
  std::error_code error;
  const std::string shipped =
      (fs::absolute(robot::DataDirectory(), error) / "models").lexically_normal().string() + "/";
  for (const std::string& given : FilesRead()) {
    const std::string path = fs::absolute(given, error).lexically_normal().string();
    if (path.starts_with(shipped) || !fs::is_regular_file(path, error)) continue;
    if (fs::file_size(path, error) > kMostBytes || error) continue;
    files[path] = ReadFile(path);
  }
  return files;
}

LogFiles::LogFiles(const std::map<std::string, std::string>& files) {
  const bool there = std::all_of(files.begin(), files.end(),
                                 [](const auto& file) { return IsSame(file.first, file.second); });
  if (there) return;
  std::string folder = (fs::temp_directory_path() / "tether_log_XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr)
    throw InputError("no temporary folder can be made for a log's files");
  folder_ = folder;
  for (const auto& [path, text] : files) {
    const fs::path inside = fs::path(path).lexically_normal().relative_path();
    // A name in a log that someone made must not lead out of the folder.
    if (inside.empty() || *inside.begin() == "..") continue;
    std::error_code error;
    fs::create_directories((folder_ / inside).parent_path(), error);
    WriteFile((folder_ / inside).string(), text);
  }
}

LogFiles::~LogFiles() {
  std::error_code ignored;
  if (!folder_.empty()) fs::remove_all(folder_, ignored);
}

std::string LogFiles::PathOf(const std::string& path) const {
  return folder_.empty() ? path : (folder_ / fs::path(path).lexically_normal().relative_path()).string();
}

}  // namespace tether::evaluation
