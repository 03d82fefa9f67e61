#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tether/common/bounds.h"
#include "tether/common/document/reader.h"
#include "tether/common/text.h"

namespace tether {
namespace {

using ::testing::HasSubstr;

std::string ErrorOf(const std::string& text) {
  try {
    ParseYaml(text, "f.yaml");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(DocumentTest, YamlSelfReference) {
  EXPECT_THAT(ErrorOf("loop: &a [1, *a]\n"), HasSubstr("f.yaml:1:14: an alias inside its own anchor"));
  EXPECT_THAT(ErrorOf("x: &a {y: &b {z: *a}}\n"), HasSubstr("an alias inside its own anchor"));
  EXPECT_THAT(ErrorOf("&a ? *a\n: 1\n"), HasSubstr("f.yaml:"));
  EXPECT_THAT(ErrorOf("x: *nowhere\n"), HasSubstr("not valid YAML"));
  // Side by side is no loop.
  const Value value = ParseYaml("x: &a [1, 2]\ny: [*a, *a]\n", "f.yaml");
  EXPECT_EQ(WriteJson(value, 0), R"({"x":[1,2],"y":[[1,2],[1,2]]})");
}

TEST(DocumentTest, YamlAliasBomb) {
  std::string lists = "l0: &l0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n", maps = "m0: &m0 {a: 1, b: 1}\n";
  for (int i = 1; i < 30; ++i) {
    const std::string below = "*l" + std::to_string(i - 1), map = "*m" + std::to_string(i - 1);
    lists += "l" + std::to_string(i) + ": &l" + std::to_string(i) + " [" + below;
    for (int k = 0; k < 9; ++k) lists += ", " + below;
    lists += "]\n";
    maps += "m" + std::to_string(i) + ": &m" + std::to_string(i) + " {a: " + map + ", b: " + map + "}\n";
  }
  EXPECT_THAT(ErrorOf(lists), HasSubstr("anchors and aliases repeat more than 100000 values"));
  EXPECT_THAT(ErrorOf(maps), HasSubstr("anchors and aliases repeat more than 100000 values"));
  // Anchors within anchors are copied as well.
  std::string nested;
  for (int i = 0; i < 150; ++i) nested += "&n" + std::to_string(i) + " [";
  std::string many = nested;
  for (int i = 0; i < 1000; ++i) many += "1, ";
  EXPECT_THAT(ErrorOf(many + "1" + std::string(150, ']')), HasSubstr("anchors and aliases repeat"));
}

TEST(DocumentTest, DepthIsBounded) {
  for (const auto& [open, close] : {std::pair{"[", "]"}, std::pair{"{\"a\":", "}"}, std::pair{"{a: ", "}"}}) {
    std::string deep, closing;
    for (int i = 0; i < kMaxDepth; ++i) {
      deep += open;
      closing += close;
    }
    EXPECT_EQ(ErrorOf(deep + "1" + closing), "") << open;
    EXPECT_THAT(ErrorOf(deep + open + "1" + close + closing), HasSubstr("deeper than 200")) << open;
    std::string endless;
    for (int i = 0; i < 200000; ++i) endless += open;
    EXPECT_NE(ErrorOf(endless), "") << open;
  }
  std::string dashes;
  for (int i = 0; i < 100000; ++i) dashes += "- ";
  EXPECT_THAT(ErrorOf(dashes), HasSubstr("deeper than 200"));
  std::string chain = "l0: &l0 [1]\n";
  for (int i = 1; i < 300; ++i)
    chain += "l" + std::to_string(i) + ": &l" + std::to_string(i) + " [*l" + std::to_string(i - 1) + "]\n";
  EXPECT_THAT(ErrorOf(chain), HasSubstr("deeper than 200"));
}

TEST(DocumentTest, YamlSecondDocumentIgnored) {
  EXPECT_THAT(ErrorOf("a: 1\n---\nb: 2\n"), HasSubstr("f.yaml:2:1: a second document"));
  EXPECT_THAT(ErrorOf("{\"a\": 1}\n{\"b\": 2}\n"), HasSubstr("f.yaml:2:1: a second document"));
  EXPECT_THAT(ErrorOf("{\"a\": 1} x\n"), HasSubstr("f.yaml:1:10: "));
  EXPECT_THAT(ErrorOf("a: 1\n...\nb: 2\n"), HasSubstr("a second document"));
  // This byte ends a file for yaml-cpp.
  EXPECT_THAT(ErrorOf("a: 1\n\x04"
                      "b: 2\n"),
              HasSubstr("f.yaml:2:1: the byte 0x04 is no part of a text"));
  EXPECT_THAT(ErrorOf("a: \xc3(\n"),
              HasSubstr("f.yaml:1:4: the byte 0xc3 is no part of a text (text in UTF-8"));
  EXPECT_THAT(ErrorOf(std::string("a: 1\0", 5)), HasSubstr("the byte 0x00"));
  EXPECT_EQ(ErrorOf("---\na: grün\n...\n"), "");
  EXPECT_EQ(ErrorOf("\xef\xbb\xbf"
                    "a: 1\n"),
            "");
}

TEST(DocumentTest, KeysAreText) {
  EXPECT_THAT(ErrorOf("? [a]\n: 1\n"), HasSubstr("a key is a list (text as a key"));
  EXPECT_THAT(ErrorOf("{[a]: 1}"), HasSubstr("a key is a list"));
  EXPECT_THAT(ErrorOf("~: 1\n"), HasSubstr("a key is nothing"));
  std::string many;
  for (int i = 0; i < 100; ++i) many += "k" + std::to_string(i) + ": 1\n";
  EXPECT_THAT(ErrorOf(many + "k7: 2\n"), HasSubstr("f.yaml:101:1: key 'k7' is given twice"));
}

TEST(DocumentTest, IntMinInteger) {
  const auto read = [](const std::string& text) {
    Diagnostics diagnostics;
    const int number = ReadInteger(ParseYaml(text, "f.yaml"), "it", diagnostics, 7);
    return diagnostics.empty() ? std::to_string(number) : diagnostics.list()[0].ToString();
  };
  EXPECT_EQ(read("2147483647"), "2147483647");
  EXPECT_EQ(read("-2147483647"), "-2147483647");
  for (const char* beyond : {"-9223372036854775808", "-9223372036854775807", "9223372036854775807",
                             "2147483648", "18446744073709551615", "-2147483648"}) {
    EXPECT_THAT(read(beyond), HasSubstr(std::string("it is '") + beyond +
                                        "' (a whole number from -2147483647 to 2147483647 is accepted"));
  }
  for (const char* other : {"3.0", "+-3", "1e3", "0x10", "1_000", "18446744073709551616", "'3'"})
    EXPECT_THAT(read(other), HasSubstr("(a whole number is accepted")) << other;
}

TEST(DocumentTest, SeedBeyondInt64) {
  EXPECT_EQ(WriteJson(Value(UINT64_MAX), 0), "18446744073709551615");
  EXPECT_EQ(Value(UINT64_MAX).AsText(), "18446744073709551615");
  for (const uint64_t number : {uint64_t{0}, uint64_t{1} << 63, uint64_t{INT64_MAX}, UINT64_MAX}) {
    const Value back = ParseYaml(WriteJson(Value::Object().Set("seed", number)), "f.json");
    EXPECT_EQ(back.Find("seed")->natural(), number);
  }
  for (const char* none : {"-1", "18446744073709551616", "1.5", "x", "1e3"})
    EXPECT_FALSE(ParseYaml(none, "f").natural()) << none;
  EXPECT_EQ(Value(int64_t{-1}).natural(), std::nullopt);
}

TEST(DocumentTest, LongKeyUnreadableJson) {
  for (const size_t length : {1000u, 1023u, 1024u, 1025u, 100000u}) {
    const std::string key(length, 'k');
    const Value value = Value::Object().Set(key, Value::Object().Set(key + ":", 1)).Set("a \\ \"", "b");
    for (const int indent : {0, 2}) {
      const std::string json = WriteJson(value, indent);
      EXPECT_EQ(WriteJson(ParseYaml(json, "f.json"), indent), json) << length;
    }
  }
}

TEST(DocumentTest, JsonReadsAsItIsWritten) {
  std::string all;
  for (int c = 1; c < 128; ++c) all += static_cast<char>(c);
  all += "grün €  \xf0\x9f\xa6\xbe";
  const Value value = Value::Object().Set(all, Value(all)).Set("e", Value::Array()).Set("o", Value::Object());
  EXPECT_EQ(WriteJson(ParseYaml(WriteJson(value), "f"), 2), WriteJson(value));
  EXPECT_EQ(WriteJson(Value("a\xff\xc3"), 0), R"("a\ufffd\ufffd")");
  const Value read =
      ParseYaml(R"({"a": ["\u00fc\ud83e\uddbe\/", 1e400, -1e400, 1e-400, -0.5E+1, null, true]})", "f");
  const std::vector<Value>& items = read.Find("a")->items();
  EXPECT_EQ(items[0].AsText(), "ü\xf0\x9f\xa6\xbe/");
  EXPECT_EQ(items[1].number(), INFINITY);
  EXPECT_EQ(items[2].number(), -INFINITY);
  EXPECT_EQ(items[3].number(), 0);
  EXPECT_EQ(items[4].number(), -5);
  EXPECT_TRUE(items[5].is_null());
  EXPECT_TRUE(items[6].boolean());
  EXPECT_EQ(items[6].where().ToString(), "f:1:70");
  for (const char* zero : {"[-0.0]", "[-0]", "[-0.]"}) {
    const Value back = ParseYaml(WriteJson(ParseYaml(zero, "f")), "f");
    EXPECT_TRUE(std::signbit(back.items()[0].number())) << zero;
  }
  // What is no strict JSON is YAML: single quotes, comments, a comma at the end.
  EXPECT_EQ(WriteJson(ParseYaml("{'a': [1, 2,], b: x} # yes", "f"), 0), R"({"a":[1,2],"b":"x"})");
}

TEST(DocumentTest, NumbersHaveBounds) {
  const auto problem = [](const std::string& text, const auto& read) -> std::string {
    Diagnostics diagnostics;
    read(ParseYaml(text, "f.yaml"), "it", diagnostics);
    return diagnostics.empty() ? "" : diagnostics.list()[0].accepted;
  };
  const auto number = [](const Value& v, const char* w, Diagnostics& d) { ReadNumber(v, w, d); };
  const auto positive = [](const Value& v, const char* w, Diagnostics& d) { ReadPositive(v, w, d); };
  const auto length = [](const Value& v, const char* w, Diagnostics& d) { ReadLength(v, w, d); };
  const auto vector = [](const Value& v, const char* w, Diagnostics& d) { ReadVector(v, 1, w, d); };
  EXPECT_EQ(problem("-1e9", number), "");
  EXPECT_EQ(problem("1e308", number), "a number from -1e9 to 1e9 is accepted");
  EXPECT_EQ(problem("1e400", number), "a finite number is accepted");
  EXPECT_EQ(problem(".nan", number), "a finite number is accepted");
  EXPECT_EQ(problem("nan", number), "a finite number is accepted");
  EXPECT_EQ(problem("1e-300", positive), "a number from 1e-9 to 1e9 is accepted");
  EXPECT_EQ(problem("-1", positive), "a finite number above zero is accepted");
  EXPECT_EQ(problem("1e4", length), "");
  EXPECT_EQ(problem("10001", length), "a length from 0.1 mm to 10 km is accepted");
  EXPECT_EQ(problem("[1e4]", vector), "");
  EXPECT_EQ(problem("[-1e5]", vector), "numbers from -10000 to 10000 (m or rad) are accepted");
}

TEST(TextTest, NumbersAreReadAndWrittenInOneWay) {
  double number = 0;
  EXPECT_TRUE(ParseNumber("+1.25", &number));
  EXPECT_EQ(number, 1.25);
  EXPECT_TRUE(ParseNumber("0.0000001e-400", &number));
  EXPECT_EQ(number, 0);
  EXPECT_TRUE(ParseNumber("-1e999", &number));
  EXPECT_EQ(number, -INFINITY);
  for (const char* none : {"", "+", "+-1", "1,5", "1.5x", " 1", "0x10"})
    EXPECT_FALSE(ParseNumber(none, &number)) << none;
  EXPECT_EQ(Format("%.2f|%5s|%d", 1.5, "x", 3), "1.50|    x|3");
  EXPECT_EQ(LowerCase("TIJ"), "tij");
}

TEST(JsonTest, NumbersAreReadAsTheyWereWrittenNegativeZeroToo) {
  for (const double number :
       {0.0, -0.0, 1.0, -1.0, 1e15, 1e16, 1e300, -1e-300, 0.1, 5e-324, 9007199254740993.0}) {
    const std::string text = WriteJson(Value(number), 0);
    const double again = ParseYaml(text, "written").number();
    EXPECT_EQ(again, number) << text;
    EXPECT_EQ(std::signbit(again), std::signbit(number)) << text;
    EXPECT_EQ(WriteJson(ParseYaml(text, "written"), 0), text);
  }
}

}  // namespace
}  // namespace tether
