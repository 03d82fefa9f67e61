#include "tether/common/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/common/scratch_folder.h"
#include "tether/common/error.h"

namespace tether {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::string ErrorOf(const std::string& path, const std::string& text = "new") {
  try {
    WriteFile(path, text);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

size_t Entries(const fs::path& folder) {
  return static_cast<size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

mode_t ModeOf(const std::string& path) {
  struct stat status {};
  EXPECT_EQ(stat(path.c_str(), &status), 0);
  return status.st_mode & 07777;
}

class FileTest : public ::testing::Test {
 protected:
  std::string Path(const std::string& name) const { return folder_.File(name); }
  fs::path Folder() const { return fs::path(folder_.File("x")).parent_path(); }

  ScratchFolder folder_;
};

TEST_F(FileTest, ReplacesAndKeepsTheMode) {
  const std::string path = Path("o.json");
  WriteFile(path, "old");
  ASSERT_EQ(chmod(path.c_str(), 0640), 0);
  WriteFile(path, "new");
  EXPECT_EQ(ReadFile(path), "new");
  EXPECT_EQ(ModeOf(path), 0640u);
  EXPECT_EQ(Entries(Folder()), 1u);
  // Files that are not there yet are made as others are.
  const int other = open(Path("other").c_str(), O_CREAT | O_WRONLY, 0666);
  close(other);
  EXPECT_EQ(ModeOf(path) | ModeOf(Path("other")), ModeOf(Path("other")) | 0640u);
  WriteFile(std::string(fs::path(path).parent_path() / std::string(255, 'n')), "long");
}

TEST_F(FileTest, OutputReplacesDeviceOrSymlink) {
  const std::string fifo = Path("fifo");
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  std::string read;
  std::thread reader([&] { read = ReadFile(fifo); });
  WriteFile(fifo, std::string(300000, 'x'));
  reader.join();
  EXPECT_EQ(read.size(), 300000u);
  EXPECT_TRUE(fs::is_fifo(fifo));

  // A chain of links, relative ones too, the last of which leads to nothing yet.
  fs::create_directory(Folder() / "deep");
  fs::create_symlink("deep/second", Path("first"));
  fs::create_symlink("target", Folder() / "deep" / "second");
  for (const char* text : {"one", "two"}) {
    WriteFile(Path("first"), text);
    EXPECT_EQ(ReadFile((Folder() / "deep" / "target").string()), text);
  }
  EXPECT_TRUE(fs::is_symlink(Path("first")));
  EXPECT_TRUE(fs::is_symlink(Folder() / "deep" / "second"));
  fs::create_symlink("b", Path("a"));
  fs::create_symlink("a", Path("b"));
  EXPECT_THAT(ErrorOf(Path("a")), HasSubstr("Too many levels of symbolic links"));

  // The null device, by a link and by its own name.
  fs::create_symlink("/dev/null", Path("null"));
  WriteFile(Path("null"), "gone");
  EXPECT_TRUE(fs::is_symlink(Path("null")));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_THAT(ErrorOf("/dev/full"), HasSubstr("/dev/full: cannot write this file: No space left on device"));
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
}

TEST_F(FileTest, OwnDescriptorsAreWrittenTo) {
  const std::string path = Path("redirected");
  const int fd = open(path.c_str(), O_CREAT | O_WRONLY, 0600);
  ASSERT_EQ(write(fd, "head ", 5), 5);
  WriteFile("/dev/fd/" + std::to_string(fd), "body");
  WriteFile("/proc/self/fd/" + std::to_string(fd), " tail");
  close(fd);
  EXPECT_EQ(ReadFile(path), "head body tail");
  EXPECT_THAT(ErrorOf("/dev/fd/" + std::to_string(fd)), HasSubstr("cannot write"));
}

TEST_F(FileTest, OutputPartFollowsSymlink) {
  const std::string victim = Path("victim"), path = Path("o.json");
  WriteFile(victim, "precious");
  for (const char* name : {"o.json.part", "o.json.tmp", ".o.json", "o.json~"})
    fs::create_symlink("victim", Path(name));
  WriteFile(path, "new");
  EXPECT_EQ(ReadFile(victim), "precious");
  EXPECT_FALSE(fs::is_symlink(path));
  EXPECT_EQ(Entries(Folder()), 6u) << "nothing is left behind";
}

TEST_F(FileTest, NothingIsLeftBehindWhenItFails) {
  fs::create_directory(Path("folder"));
  EXPECT_THAT(ErrorOf(Path("folder")), HasSubstr("it is a folder"));
  EXPECT_THAT(ErrorOf(Path("nowhere/o.json")), HasSubstr("its folder: No such file or directory"));
  EXPECT_THAT(ErrorOf(Path("new/")), HasSubstr("it is a folder"));
  EXPECT_THAT(ErrorOf(""), HasSubstr("its name is empty"));
  WriteFile(Path("file"), "x");
  EXPECT_THAT(ErrorOf(Path("file/o.json")), HasSubstr("Not a directory"));
  EXPECT_EQ(Entries(Folder()), 2u);
  EXPECT_EQ(Entries(Path("folder")), 0u);
}

TEST_F(FileTest, WritersAtOnceDoNotMix) {
  const std::string path = Path("o.json");
  std::vector<std::thread> writers;
  for (char c = 'a'; c < 'g'; ++c)
    writers.emplace_back([&, c] {
      for (int i = 0; i < 50; ++i) WriteFile(path, std::string(10000, c));
    });
  for (std::thread& writer : writers) writer.join();
  const std::string text = ReadFile(path);
  EXPECT_EQ(text, std::string(10000, text[0]));
  EXPECT_EQ(Entries(Folder()), 1u);
}

TEST_F(FileTest, SameFilesAreFoundOut) {
  WriteFile(Path("a"), "x");
  fs::create_symlink("a", Path("link"));
  fs::create_hard_link(Path("a"), Path("hard"));
  fs::create_symlink("new", Path("dangling"));
  EXPECT_TRUE(IsSameFile(Path("a"), Path("link")));
  EXPECT_TRUE(IsSameFile(Path("a"), Path("hard")));
  EXPECT_TRUE(IsSameFile(Path("new"), Path("dangling")));
  EXPECT_TRUE(IsSameFile(Path("new"), Path("./new")));
  EXPECT_FALSE(IsSameFile(Path("a"), Path("new")));
  fs::create_directory(Path("sub"));
  fs::create_directory_symlink("sub", Path("sub_link"));
  EXPECT_TRUE(IsSameFile(Path("new"), Path("sub/../new")));
  EXPECT_TRUE(IsSameFile(Path("sub/new"), Path("sub_link/new")));
  EXPECT_FALSE(IsSameFile(Path("new"), Path("sub/new")));
  // Neither is there.
  EXPECT_TRUE(IsSameFile("no_such_file", "./no_such_file"));
  EXPECT_TRUE(IsSameFile("no_such_file", (fs::current_path() / "no_such_file").string()));
  EXPECT_FALSE(IsSameFile("no_such_file", "./no_such_other"));
  EXPECT_FALSE(IsSameFile("/dev/null", "/dev/null")) << "which both may write to";
  EXPECT_FALSE(WasRead(Path("a")));
  ReadFile(Path("link"));
  EXPECT_TRUE(WasRead(Path("a")));
}

TEST_F(FileTest, TextsAreWrittenPieceByPiece) {
  const std::string path = Path("o.json");
  std::string whole;
  const uint64_t before = WritingProgress();
  WriteFile(path, [&](const TextSink& sink) {
    for (int i = 0; i < 50; ++i) {
      const std::string piece(static_cast<size_t>(i) * 3000, static_cast<char>('A' + i));
      whole += piece;
      sink(piece);
    }
  });
  EXPECT_EQ(ReadFile(path), whole);
  EXPECT_GT(WritingProgress(), before + 10);
  const auto fail = [](const TextSink& sink) {
    sink(std::string(300000, 'x'));
    throw InputError("cut", "");
  };
  EXPECT_THROW(WriteFile(path, fail), InputError);
  EXPECT_EQ(ReadFile(path), whole) << "what is not whole replaces nothing";
  EXPECT_EQ(std::distance(fs::directory_iterator(fs::path(path).parent_path()), {}), 1);
}

TEST_F(FileTest, EndlessFilesAreRefused) {
  try {
    ReadFile("/dev/zero");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("/dev/zero: cannot read this file: it is larger than 256 MiB"));
  }
}

}  // namespace
}  // namespace tether
