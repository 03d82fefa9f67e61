// The container: what is written is read again, and what was damaged or cut off says where.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tether/common/error.h"
#include "tether/evaluation/mcap/crc32.h"
#include "tether/evaluation/mcap/mcap_reader.h"
#include "tether/evaluation/mcap/mcap_writer.h"
#include "tether/evaluation/mcap/zstd.h"

namespace tether::evaluation {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct Seen : McapHandler {
  void OnMetadata(const std::string& name, const std::map<std::string, std::string>& values,
                  uint64_t) override {
    for (const auto& [key, value] : values) all.push_back(name + "." + key + "=" + value);
  }
  void OnAttachment(const std::string& name, std::string_view data, uint64_t) override {
    all.push_back(name + ":" + std::string(data));
  }
  void OnMessage(const McapChannel& channel, const McapSchema& schema, uint64_t time, std::string_view data,
                 uint64_t) override {
    all.push_back(channel.topic + " " + schema.name + " " + std::to_string(time) + " " + std::string(data));
  }
  std::vector<std::string> all;
  std::optional<McapProblem> problem;
};

Seen Read(const std::string& bytes) {
  Seen seen;
  seen.problem = ReadMcap(BytesOf(bytes), "a.mcap", seen);
  return seen;
}

std::string Written() {
  McapWriter writer("test");
  const uint16_t schema = writer.AddSchema({"s", "jsonschema", "{}"});
  const uint16_t one = writer.AddChannel({"/one", schema, "json"}),
                 two = writer.AddChannel({"/two", schema, "json"});
  writer.AddMetadata("m", {{"k", "v"}});
  writer.AddAttachment("file", "text/plain", "text");
  writer.AddMessage(one, 10, "{\"a\":1}");
  writer.AddMessage(two, 20, "{}");
  writer.CloseChunk();
  writer.AddMessage(one, 30, "{\"a\":2}");
  writer.Finish();
  return writer.Take();
}

TEST(Crc32, IsThatOfZip) {
  EXPECT_EQ(Crc32(0, "123456789"), 0xcbf43926U);
  const std::string text = "a text that is longer than what is looked up at once";
  for (size_t i = 0; i <= text.size(); ++i)
    EXPECT_EQ(Crc32(Crc32(0, text.substr(0, i)), text.substr(i)), Crc32(0, text)) << i;
}

TEST(Zstd, ReadsWhatItWroteAndNothingElse) {
  std::string text;
  for (int i = 0; i < 100000; ++i) text += std::to_string(i * i % 977);
  std::string frame, again;
  ZstdCompressor compressor;
  compressor.Append(text, &frame);
  EXPECT_LT(frame.size(), text.size() / 2);
  ASSERT_TRUE(DecompressZstd(frame, text.size(), &again));
  EXPECT_EQ(again, text);
  EXPECT_FALSE(DecompressZstd(frame, text.size() - 1, &again));
  EXPECT_FALSE(DecompressZstd(frame, text.size() + 1, &again));
  EXPECT_FALSE(DecompressZstd(std::string_view(frame).substr(0, frame.size() / 2), text.size(), &again));
  EXPECT_FALSE(DecompressZstd("no frame", 8, &again));
}

TEST(Mcap, IsReadAsItWasWritten) {
  const Seen seen = Read(Written());
  EXPECT_FALSE(seen.problem) << seen.problem->text;
  EXPECT_THAT(seen.all, ElementsAre("m.k=v", "file:text", "/one s 10 {\"a\":1}", "/two s 20 {}",
                                    "/one s 30 {\"a\":2}"));
}

TEST(Mcap, IsReadAsFarAsItGoesWhereverItIsCutOff) {
  const std::string whole = Written();
  const Seen all = Read(whole);
  size_t before = 0;
  for (size_t size = 0; size < whole.size(); ++size) {
    const Seen part = Read(whole.substr(0, size));
    ASSERT_TRUE(part.problem) << size;
    EXPECT_LE(part.problem->offset, size);
    EXPECT_THAT(part.problem->text, HasSubstr("the file ends")) << size;
    ASSERT_LE(part.all.size(), all.all.size());
    EXPECT_TRUE(std::equal(part.all.begin(), part.all.end(), all.all.begin())) << size;
    EXPECT_GE(part.all.size(), before) << size;
    before = part.all.size();
  }
  EXPECT_EQ(before, all.all.size());
}

TEST(Mcap, EveryChangedByteIsNoticed) {
  const std::string whole = Written();
  for (size_t i = 0; i < whole.size(); ++i) {
    std::string changed = whole;
    changed[i] = static_cast<char>(changed[i] ^ 0x10);
    try {
      EXPECT_TRUE(Read(changed).problem) << "byte " << i << " of " << whole.size();
    } catch (const InputError& error) {
      EXPECT_LT(i, 8U) << error.what();
    }
  }
}

TEST(Mcap, AnotherVersionIsRefusedWithItsPlace) {
  std::string other = Written();
  other[5] = '1';
  try {
    Read(other);
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("a.mcap: this is an MCAP file of version '1' (byte 5)"));
    EXPECT_THAT(error.what(), HasSubstr("version '0'"));
  }
}

TEST(Mcap, LengthsThatLieAskForNoMemory) {
  std::string lying = Written().substr(0, 8);
  lying += '\x06';  // A chunk of 2^29 bytes,
  lying += std::string("\0\0\0\x20\0\0\0\0", 8);
  lying += "of which there are few";
  const Seen seen = Read(lying);
  ASSERT_TRUE(seen.problem);
  EXPECT_EQ(seen.problem->offset, 8U);
  EXPECT_EQ(seen.problem->text, "the file ends within a chunk record: it was cut off");
}

}  // namespace
}  // namespace tether::evaluation
