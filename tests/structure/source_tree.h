#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace tether::structure {

/// A text file of the project; `path` is relative to its top folder, with '/'.
struct File {
  std::string path;
  std::string text;
};

/// The text files below `top`, sorted by path. Left out: what is built or fetched (build*, snapshots, names
/// that begin with a dot other than .ci and the dot files of the top folder) and files that hold a zero byte.
std::vector<File> ReadTree(const std::string& top);

/// Room → the rooms that it knows directly.
using RoomTable = std::map<std::string, std::set<std::string>>;
/// Room → its sub-folders; rooms without any are left out.
using FolderTable = std::map<std::string, std::set<std::string>>;

/// Reads the rows "| `room` {`folder`, …} | what | knows |" of the table of rooms in docs/architecture.md;
/// the braces are there only where a room has sub-folders.
RoomTable ParseRoomTable(const std::string& markdown);
FolderTable ParseFolderTable(const std::string& markdown);

/// A room, the rooms it knows, and those they know.
std::set<std::string> Reachable(const RoomTable& table, const std::string& room);

/// What an #include directive names: `spelled` is `"tether/math/pose.h"` or `<vector>`, delimiters included.
struct Include {
  int line;
  std::string spelled;
};
std::vector<Include> FindIncludes(const std::string& text);

/// Each rule returns what breaks it, one line per finding: "path:line: what".
using Findings = std::vector<std::string>;

/// Files of a room include only rooms that the room may know, and rooms are those of the table. Helpers in
/// testing/<room> obey the same, and only they, tests and benchmarks include helpers, of rooms that they may
/// know.
Findings CheckRoomIncludes(const std::vector<File>& files, const RoomTable& table);
/// The sub-folders of each room are those of the table, and no folder holds more than `most` sources.
Findings CheckFolders(const std::vector<File>& files, const FolderTable& table, int most);
/// A room that another is let know directly is included by some product source of that other.
Findings CheckEdgesAreUsed(const std::vector<File>& files, const RoomTable& table);
/// `tether_room(NAME KNOWS …)` in a room's CMakeLists.txt names only rooms that the room may know.
Findings CheckRoomTargets(const std::vector<File>& files, const RoomTable& table);
/// Nobody knows himself, directly or through others, and every room that is named is a row.
Findings CheckTable(const RoomTable& table);
/// Headers include the standard library, Eigen and Tether, nothing else.
Findings CheckHeaderIncludes(const std::vector<File>& files);
/// foo.cc includes foo.h first, so that building the one shows that the other compiles alone.
Findings CheckOwnHeaderFirst(const std::vector<File>& files);
/// Headers have #pragma once, no `using namespace` and no <iostream>.
Findings CheckHeaderManners(const std::vector<File>& files);
/// No file names a folder of some machine.
Findings CheckMachinePaths(const std::vector<File>& files);
/// No source has more than `most` lines, unless its first line says why: "// Long: …".
Findings CheckFileLengths(const std::vector<File>& files, int most);
/// No function has more than `most` lines, from its first line to its last brace.
Findings CheckFunctionLengths(const std::vector<File>& files, int most);

}  // namespace tether::structure
