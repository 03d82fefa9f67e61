#include "structure/source_tree.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>

namespace tether::structure {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRooms = "src/tether/";
constexpr const char* kTesting = "testing/";

bool IsLeftOut(const fs::path& relative) {
  const std::string name = relative.filename().string();
  if (name == "__pycache__" || name == "node_modules") return true;
  const bool at_top = relative.parent_path().empty();
  if (at_top && (name.starts_with("build") || name == "snapshots" || name == ".git" || name == ".ccache"))
    return true;
  return !at_top && name.starts_with('.');
}

bool IsHeader(const File& file) { return file.path.ends_with(".h"); }

bool IsSource(const File& file) { return IsHeader(file) || file.path.ends_with(".cc"); }

std::string Finding(const std::string& path, int line, const std::string& what) {
  return path + ":" + std::to_string(line) + ": " + what;
}

/// The room whose folder below src/tether/ or testing/ a path lies in; empty elsewhere.
std::string RoomOf(const std::string& path) {
  for (const std::string prefix : {kRooms, kTesting}) {
    if (!path.starts_with(prefix)) continue;
    const size_t end = path.find('/', prefix.size());
    return end == std::string::npos ? "" : path.substr(prefix.size(), end - prefix.size());
  }
  return "";
}

/// Of an #include: the room, and whether it is of its helpers for tests. Empty for what is not ours.
struct Target {
  std::string room;
  bool testing = false;
};
Target TargetOf(const Include& include) {
  for (const bool testing : {false, true}) {
    const std::string prefix = testing ? "\"testing/" : "\"tether/";
    if (!include.spelled.starts_with(prefix)) continue;
    return {include.spelled.substr(prefix.size(), include.spelled.find('/', prefix.size()) - prefix.size()),
            testing};
  }
  return {};
}

/// Tests, benchmarks and the helpers of tests: not part of any product library.
bool IsForTesting(const std::string& path) {
  return path.starts_with(kTesting) || path.ends_with("_test.cc") || path.ends_with("_benchmark.cc");
}

std::vector<std::string> Lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::string WithoutComment(const std::string& line) { return line.substr(0, line.find("//")); }

std::vector<std::string> Words(const std::string& text) {
  static const std::regex word("[a-z_]+");
  return {std::sregex_token_iterator(text.begin(), text.end(), word), std::sregex_token_iterator()};
}

}  // namespace

std::vector<File> ReadTree(const std::string& top) {
  std::vector<File> files;
  auto it = fs::recursive_directory_iterator(top);
  for (; it != fs::recursive_directory_iterator(); ++it) {
    const fs::path relative = fs::relative(it->path(), top);
    if (IsLeftOut(relative)) {
      if (it->is_directory()) it.disable_recursion_pending();
      continue;
    }
    if (!it->is_regular_file()) continue;
    std::ifstream stream(it->path(), std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    if (text.find('\0') == std::string::npos) files.push_back({relative.generic_string(), std::move(text)});
  }
  std::sort(files.begin(), files.end(), [](const File& a, const File& b) { return a.path < b.path; });
  return files;
}

RoomTable ParseRoomTable(const std::string& markdown) {
  static const std::regex row(R"(^\| `([a-z_]+)`[^|]*\|.*\| ([^|]*) \|\s*$)");
  RoomTable table;
  for (const std::string& line : Lines(markdown)) {
    std::smatch match;
    if (!std::regex_match(line, match, row)) continue;
    const std::vector<std::string> known = Words(match[2].str());
    table[match[1].str()] = {known.begin(), known.end()};
  }
  return table;
}

FolderTable ParseFolderTable(const std::string& markdown) {
  static const std::regex row(R"(^\| `([a-z_]+)` \{([^}]*)\} \|.*$)");
  FolderTable table;
  for (const std::string& line : Lines(markdown)) {
    std::smatch match;
    if (!std::regex_match(line, match, row)) continue;
    const std::vector<std::string> folders = Words(match[2].str());
    table[match[1].str()] = {folders.begin(), folders.end()};
  }
  return table;
}

std::set<std::string> Reachable(const RoomTable& table, const std::string& room) {
  std::set<std::string> seen;
  std::vector<std::string> open{room};
  while (!open.empty()) {
    const std::string next = open.back();
    open.pop_back();
    const auto row = table.find(next);
    if (!seen.insert(next).second || row == table.end()) continue;
    open.insert(open.end(), row->second.begin(), row->second.end());
  }
  return seen;
}

std::vector<Include> FindIncludes(const std::string& text) {
  static const std::regex directive(R"(^\s*#\s*include\s*("[^"]*"|<[^>]*>).*$)");
  std::vector<Include> includes;
  int number = 0;
  for (const std::string& line : Lines(text)) {
    ++number;
    std::smatch match;
    if (std::regex_match(line, match, directive)) includes.push_back({number, match[1].str()});
  }
  return includes;
}

Findings CheckTable(const RoomTable& table) {
  Findings findings;
  for (const auto& [room, known] : table) {
    for (const std::string& other : known) {
      if (!table.contains(other)) {
        findings.push_back("the table lets " + room + " know " + other + ", which is not a room");
      } else if (Reachable(table, other).contains(room)) {
        findings.push_back("the table has a circle: " + room + " knows " + other + ", which knows " + room);
      }
    }
  }
  return findings;
}

Findings CheckRoomIncludes(const std::vector<File>& files, const RoomTable& table) {
  Findings findings;
  for (const File& file : files) {
    const std::string room = RoomOf(file.path);
    if (!IsSource(file) || room.empty()) continue;
    if (!table.contains(room)) {
      findings.push_back(Finding(file.path, 1, "'" + room + "' is not a room of the table"));
      continue;
    }
    const std::set<std::string> may_know = Reachable(table, room);
    for (const Include& include : FindIncludes(file.text)) {
      const Target other = TargetOf(include);
      if (other.room.empty()) continue;
      if (!may_know.contains(other.room)) {
        findings.push_back(Finding(file.path, include.line, room + " may not know " + other.room));
      }
      if (other.testing && !IsForTesting(file.path)) {
        findings.push_back(Finding(file.path, include.line, include.spelled + " is for tests only"));
      }
    }
  }
  return findings;
}

Findings CheckFolders(const std::vector<File>& files, const FolderTable& table, int most) {
  std::map<std::string, int> sources;  // By folder.
  FolderTable found;
  for (const File& file : files) {
    const std::string room = RoomOf(file.path);
    if (!IsSource(file) || room.empty()) continue;
    const std::string folder = file.path.substr(0, file.path.rfind('/'));
    ++sources[folder];
    const std::string top = kRooms + room;
    if (file.path.starts_with(kRooms) && folder != top) found[room].insert(folder.substr(top.size() + 1));
  }
  Findings findings;
  for (const auto& [folder, count] : sources) {
    if (count > most)
      findings.push_back(folder + " holds " + std::to_string(count) + " sources, more than " +
                         std::to_string(most));
  }
  for (const auto& [room, folders] : found) {
    const auto row = table.find(room);
    for (const std::string& folder : folders) {
      if (row == table.end() || !row->second.contains(folder))
        findings.push_back("the table does not name " + room + "'s folder " + folder);
    }
  }
  for (const auto& [room, folders] : table) {
    for (const std::string& folder : folders) {
      if (!found[room].contains(folder))
        findings.push_back("the table names " + room + "/" + folder + ", which is not there");
    }
  }
  return findings;
}

Findings CheckEdgesAreUsed(const std::vector<File>& files, const RoomTable& table) {
  RoomTable used;
  for (const File& file : files) {
    if (!IsSource(file) || IsForTesting(file.path)) continue;
    for (const Include& include : FindIncludes(file.text))
      used[RoomOf(file.path)].insert(TargetOf(include).room);
  }
  Findings findings;
  for (const auto& [room, known] : table) {
    for (const std::string& other : known) {
      if (!used[room].contains(other)) findings.push_back("no source of " + room + " includes " + other);
    }
  }
  return findings;
}

Findings CheckRoomTargets(const std::vector<File>& files, const RoomTable& table) {
  static const std::regex call(R"(tether_room\(\s*([a-z_]+)([^)]*)\))");
  static const std::regex knows(R"(KNOWS((\s+[a-z_]+)*))");
  Findings findings;
  for (const File& file : files) {
    if (!file.path.starts_with(kRooms) || !file.path.ends_with("/CMakeLists.txt")) continue;
    std::smatch match;
    if (!std::regex_search(file.text, match, call)) continue;
    const std::string room = match[1].str();
    const std::string arguments = match[2].str();
    if (room != RoomOf(file.path)) findings.push_back(Finding(file.path, 1, "the room is called " + room));
    if (!std::regex_search(arguments, match, knows)) continue;
    const std::set<std::string> may_know = Reachable(table, room);
    for (const std::string& other : Words(match[1].str())) {
      if (!may_know.contains(other))
        findings.push_back(Finding(file.path, 1, room + " may not know " + other));
    }
  }
  return findings;
}

Findings CheckHeaderIncludes(const std::vector<File>& files) {
  static constexpr const char* kOwn[] = {"\"tether/", "\"testing/", "\"apps/", "\"structure/"};
  Findings findings;
  for (const File& file : files) {
    if (!IsHeader(file)) continue;
    for (const Include& include : FindIncludes(file.text)) {
      const std::string& name = include.spelled;
      // Names of the standard library have neither a dot nor a slash; those of C libraries have.
      const bool standard = name.starts_with('<') && name.find_first_of("./") == std::string::npos;
      const bool own = std::any_of(std::begin(kOwn), std::end(kOwn),
                                   [&](const char* prefix) { return name.starts_with(prefix); });
      if (!standard && !own && !name.starts_with("<Eigen/")) {
        findings.push_back(Finding(file.path, include.line, name + " belongs in a .cc file"));
      }
    }
  }
  return findings;
}

Findings CheckOwnHeaderFirst(const std::vector<File>& files) {
  std::set<std::string> paths;
  for (const File& file : files) paths.insert(file.path);
  Findings findings;
  for (const File& file : files) {
    if (!file.path.starts_with(kRooms) || !file.path.ends_with(".cc")) continue;
    const std::string header = file.path.substr(0, file.path.size() - 2) + "h";
    if (!paths.contains(header)) continue;
    const std::string own = "\"" + header.substr(std::string("src/").size()) + "\"";
    const std::vector<Include> includes = FindIncludes(file.text);
    if (includes.empty() || includes.front().spelled != own) {
      findings.push_back(
          Finding(file.path, includes.empty() ? 1 : includes.front().line, own + " comes first"));
    }
  }
  return findings;
}

Findings CheckHeaderManners(const std::vector<File>& files) {
  Findings findings;
  for (const File& file : files) {
    if (!IsHeader(file)) continue;
    bool once = false;
    int number = 0;
    for (const std::string& line : Lines(file.text)) {
      ++number;
      const std::string code = WithoutComment(line);
      once = once || code.starts_with("#pragma once");
      if (code.find("using namespace") != std::string::npos) {
        findings.push_back(Finding(file.path, number, "`using namespace` in a header"));
      }
      if (code.starts_with("#include <iostream>")) {
        findings.push_back(
            Finding(file.path, number, "<iostream> in a header; <iosfwd> or <ostream> will do"));
      }
    }
    if (!once) findings.push_back(Finding(file.path, 1, "no `#pragma once`"));
  }
  return findings;
}

Findings CheckMachinePaths(const std::vector<File>& files) {
  // Written in pieces, so that this file passes its own rule.
  static const std::regex machine_path(std::string(R"(\.\./)") + "shared|/(work|root|home|tmp)/[a-z]");
  Findings findings;
  for (const File& file : files) {
    int number = 0;
    for (const std::string& line : Lines(file.text)) {
      ++number;
      std::smatch match;
      if (std::regex_search(line, match, machine_path)) {
        findings.push_back(
            Finding(file.path, number, "names a folder of some machine: '" + match.str() + "'"));
      }
    }
  }
  return findings;
}

}  // namespace tether::structure
