#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tether/common/document/reader.h"
#include "tether/common/document/utf8.h"
#include "tether/common/random.h"

namespace tether {
namespace {

using ::testing::HasSubstr;

TEST(ValueTest, KeepsOrderKindsAndPlaces) {
  const Value value = ParseYaml("b: [1, 2.5, x]\na: {c: true, d: '3'}\n", "f.yaml");
  ASSERT_EQ(value.members().size(), 2u);
  EXPECT_EQ(value.members()[0].key, "b");
  const Value& list = *value.Find("b");
  EXPECT_TRUE(list.items()[0].is_integer());
  EXPECT_EQ(list.items()[1].number(), 2.5);
  EXPECT_EQ(list.items()[2].kind(), Value::Kind::kString);
  EXPECT_EQ(list.items()[2].where().ToString(), "f.yaml:1:13");
  EXPECT_EQ(value.Find("a")->Find("d")->kind(), Value::Kind::kString);
}

TEST(ValueTest, JsonRoundTripIsExact) {
  Random random(7);
  Value list = Value::Array();
  for (int i = 0; i < 1000; ++i) list.Append(random.Normal() * std::pow(10, random.Uniform(-30, 30)));
  const Value object = Value::Object().Set("x", list).Set("text", "a \"b\"\n\tc").Set("n", 3).Set("t", true);
  const Value back = ParseYaml(WriteJson(object), "j");
  for (size_t i = 0; i < list.items().size(); ++i) {
    EXPECT_EQ(back.Find("x")->items()[i].number(), list.items()[i].number());
  }
  EXPECT_EQ(back.Find("text")->AsText(), "a \"b\"\n\tc");
}

TEST(ValueTest, MistakesNameTheirPlace) {
  try {
    ParseYaml("a: 1\nb: [1, 2\nc: 3\n", "broken.yaml");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("broken.yaml:3"));
  }
  try {
    ParseYaml("a: 1\na: 2\n", "twice.yaml");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("twice.yaml:2:1: key 'a' is given twice"));
  }
}

TEST(ReaderTest, ReportsEveryMistakeWithTheNearestKey) {
  const Value value = ParseYaml("mas: 1\nfriction: .nan\nsize: [1, 2]\n", "o.yaml");
  Diagnostics diagnostics;
  ObjectReader reader(value, "object 'box'", diagnostics);
  reader.Number("mass", 0);
  reader.Number("friction", 0.5);
  reader.Vector("size", Eigen::VectorXd::Zero(3));
  reader.Finish();
  try {
    diagnostics.ThrowIfAny();
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.diagnostics().size(), 3u);
    EXPECT_THAT(error.what(),
                HasSubstr("o.yaml:1:1: unknown key 'mas' in object 'box' (did you mean 'mass'?"));
    EXPECT_THAT(error.what(), HasSubstr("o.yaml:2:11: 'friction' of object 'box' is '.nan'"));
    EXPECT_THAT(error.what(), HasSubstr("o.yaml:3:7: 'size' of object 'box' is a list of 2"));
  }
}

TEST(DiagnosticTest, LongValuesArePrintedWithoutTheirMiddle) {
  const std::string text =
      InputError("'" + std::string(1'000'000, 'x') + "' is no number", "a number").what();
  EXPECT_LT(text.size(), 500u);
  EXPECT_THAT(text, ::testing::AllOf(::testing::StartsWith("'xxx"), HasSubstr(" bytes) ... "),
                                     ::testing::EndsWith("' is no number (a number)")));
  // Characters stay whole wherever they lie.
  for (int shift = 0; shift < 3; ++shift) {
    std::string euros(shift, '.');
    for (int i = 0; i < 1000; ++i) euros += "\u20ac";
    const std::string shown = InputError(euros).what();
    for (size_t i = 0; i < shown.size();) {
      const size_t length = Utf8Length(std::string_view(shown).substr(i));
      ASSERT_GT(length, 0u) << "at " << i;
      i += length;
    }
  }
}

TEST(NearestMatchTest, SuggestsOnlyWhatIsNear) {
  const std::vector<std::string> words{"position", "quaternion_wxyz", "rpy"};
  EXPECT_EQ(NearestMatch("postion", words), "position");
  EXPECT_EQ(NearestMatch("ryp", words), "rpy");
  EXPECT_EQ(NearestMatch("velocity", words), "");
}

TEST(RandomTest, SplitIsIndependentOfDraws) {
  Random a(3), b(3);
  const Random part = a.Split("part");
  b.Split("other");
  EXPECT_EQ(a.Next(), b.Next());
  Random first = part, second = Random(3).Split("part");
  EXPECT_EQ(first.Next(), second.Next());
}

TEST(RandomTest, MomentsAreRight) {
  Random random(1);
  double mean = 0, square = 0, uniform = 0;
  const int count = 200000;
  for (int i = 0; i < count; ++i) {
    const double x = random.Normal();
    mean += x / count;
    square += x * x / count;
    uniform += random.Uniform(2, 4) / count;
  }
  EXPECT_NEAR(mean, 0, 0.02);
  EXPECT_NEAR(square, 1, 0.02);
  EXPECT_NEAR(uniform, 3, 0.01);
}

}  // namespace
}  // namespace tether
