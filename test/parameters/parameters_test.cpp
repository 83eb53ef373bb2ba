#include "visual_localization/parameters/parameters.h"

#include <cmath>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/support/refusal.h"

namespace visual_localization {
namespace {

using ::testing::HasSubstr;

struct Engine {
  double power_w = 10.0;
  int cylinders = 4;
  bool turbo = false;
  std::string fuel = "petrol";
  std::string name = "unnamed";

  void declare(ParameterVisitor& visitor) {
    visitor.real({"engine/power", "W", "how strong"}, power_w, 0.0, 100.0);
    visitor.integer({"engine/cylinders", "1", "how many"}, cylinders, 1, 12);
    visitor.flag({"engine/turbo", "", "louder"}, turbo);
    visitor.choice({"engine/fuel", "", "what it drinks"}, fuel, {"petrol", "diesel"});
    visitor.text({"name", "", "what it is called", true}, name);
    visitor.require(!turbo || cylinders >= 2, "engine/turbo", "true", "false with one cylinder");
    visitor.atMost("engine/cylinders", cylinders, "engine/power", power_w);
  }
};

std::string refusalOfValues(const ParameterValues& values) {
  Engine engine;
  return test::refusalOf<ParameterError>([&] { assignParameters(engine, values); });
}

class TemporaryYaml {
 public:
  explicit TemporaryYaml(const std::string& content)
      : path_(std::filesystem::temp_directory_path() /
              ("parameters_test_" + std::to_string(::getpid()) + std::to_string(count_++) + ".yaml")) {
    std::ofstream(path_) << content;
  }
  ~TemporaryYaml() { std::filesystem::remove(path_); }
  std::string path() const { return path_.string(); }

 private:
  static inline int count_ = 0;
  std::filesystem::path path_;
};

TEST(Parameters, SetsOnlyTheNamedFields) {
  Engine engine;
  assignParameters(engine, {{"engine/power", 42.5}, {"engine/fuel", std::string("diesel")}});
  EXPECT_EQ(engine.power_w, 42.5);
  EXPECT_EQ(engine.fuel, "diesel");
  EXPECT_EQ(engine.cylinders, 4);
}

TEST(Parameters, AnIntegerIsANumberButANumberIsNoInteger) {
  Engine engine;
  assignParameters(engine, {{"engine/power", std::int64_t{7}}});
  EXPECT_EQ(engine.power_w, 7.0);
  EXPECT_THAT(refusalOfValues({{"engine/cylinders", 3.5}}), HasSubstr("'engine/cylinders' = 3.5"));
}

TEST(Parameters, RefusalsNameParameterValueAndRange) {
  EXPECT_THAT(refusalOfValues({{"engine/power", 100.5}}),
              HasSubstr("'engine/power' = 100.5 is not allowed: must be in [0, 100]"));
  EXPECT_THAT(refusalOfValues({{"engine/power", std::nan("")}}), HasSubstr("'engine/power' = nan"));
  EXPECT_THAT(refusalOfValues({{"engine/power", true}}), HasSubstr("a number in [0, 100]"));
  EXPECT_THAT(refusalOfValues({{"engine/cylinders", std::int64_t{13}}}), HasSubstr("an integer in [1, 12]"));
  EXPECT_THAT(refusalOfValues({{"engine/turbo", std::string("yes")}}), HasSubstr("true or false"));
  EXPECT_THAT(refusalOfValues({{"engine/fuel", std::string("water")}}), HasSubstr("one of petrol, diesel"));
  EXPECT_THAT(refusalOfValues({{"name", 1.0}}), HasSubstr("a string"));
}

TEST(Parameters, UnknownNamesAreRefusedWithTheKnownOnes) {
  const std::string text = refusalOfValues({{"engine/powr", 1.0}});
  EXPECT_THAT(text, HasSubstr("'engine/powr' = 1 is unknown"));
  EXPECT_THAT(text, HasSubstr("engine/power"));
}

TEST(Parameters, ARefusedSetChangesNothing) {
  Engine engine;
  EXPECT_THROW(assignParameters(engine, {{"engine/cylinders", std::int64_t{8}}, {"engine/power", -1.0}}),
               ParameterError);
  EXPECT_EQ(engine.cylinders, 4);
  EXPECT_THROW(assignParameters(engine, {{"engine/cylinders", std::int64_t{1}}, {"engine/turbo", true}}),
               ParameterError);
  EXPECT_EQ(engine.cylinders, 4);
  EXPECT_FALSE(engine.turbo);
}

TEST(Parameters, RangeViolationsOfAStructFilledByHand) {
  Engine engine;
  EXPECT_TRUE(violationsOf(engine).empty());
  engine.power_w = -3.0;
  engine.fuel = "coal";
  EXPECT_EQ(violationsOf(engine).size(), 3u) << "the constraint on power, too";
}

TEST(Parameters, YamlIsFlattenedAndTyped) {
  const TemporaryYaml yaml("name: '12'\nengine:\n  power: 5\n  turbo: true\n  fuel: diesel\n");
  Engine engine;
  assignParameters(engine, parameters::readYaml(yaml.path()));
  EXPECT_EQ(engine.name, "12");
  EXPECT_EQ(engine.power_w, 5.0);
  EXPECT_TRUE(engine.turbo);
  EXPECT_EQ(engine.fuel, "diesel");
}

TEST(Parameters, BadYamlIsRefusedWithItsPath) {
  for (const char* content :
       {"[1, 2]", "a: [1, 2]", "a: {b: ", "just text", "? {x: 1}\n: 2\n", "? [1]\n: {a: 3}\n", "a: &x {b: *x}"}) {
    const TemporaryYaml yaml(content);
    EXPECT_THAT(test::refusalOf<ParameterError>([&] { parameters::readYaml(yaml.path()); }), HasSubstr(yaml.path()))
        << content;
  }
  EXPECT_THROW(parameters::readYaml("/nonexistent/file.yaml"), ParameterError);
  EXPECT_THROW(parameters::readYaml(std::filesystem::temp_directory_path().string()), ParameterError);
}

TEST(Parameters, AnEmptyFileSetsNothing) {
  const TemporaryYaml yaml("# nothing\n");
  EXPECT_TRUE(parameters::readYaml(yaml.path()).empty());
}

TEST(Parameters, TableHasARowForEveryParameter) {
  Engine engine;
  const auto declare = [&engine](ParameterVisitor& visitor) { engine.declare(visitor); };
  const std::string table = parameters::markdownTable(declare);
  for (const auto& [name, value] : parameters::values(declare)) EXPECT_THAT(table, HasSubstr("`" + name + "`"));
  EXPECT_THAT(table, HasSubstr("| `engine/power` | 10 | W | [0, 100] | how strong |"));
  const std::string longer = parameters::markdownTable(declare, true);
  EXPECT_THAT(longer, HasSubstr("| `engine/power` | 10 | W | [0, 100] | yes | how strong |"));
  EXPECT_THAT(longer, HasSubstr("| `name` | \"unnamed\" |  | text |  | what it is called |"));
}

TEST(Parameters, ConstraintsAcrossFieldsNameBothValues) {
  EXPECT_EQ(refusalOfValues({{"engine/power", 3.0}}),
            "parameter 'engine/cylinders' = 4 is not allowed: must not exceed 'engine/power' = 3");
  EXPECT_EQ(refusalOfValues({{"engine/cylinders", std::int64_t{1}}, {"engine/turbo", true}}),
            "parameter 'engine/turbo' = true is not allowed: must be false with one cylinder");
}

TEST(Parameters, SeveralDocumentsAreRefused) {
  for (const char* text : {"name: a\n---\nname: b\n", "---\n---\nname: b\n", "# nothing\n---\n~\n---\nname: b\n"}) {
    const TemporaryYaml yaml(text);
    EXPECT_THROW(parameters::readYaml(yaml.path()), ParameterError) << text;
  }
}

TEST(Parameters, AYamlFileOfAllParametersReadsBackAsTheyAre) {
  Engine engine;
  const auto declare = [&engine](ParameterVisitor& visitor) { engine.declare(visitor); };
  const std::string text = parameters::yamlFile(declare);
  EXPECT_THAT(text, HasSubstr("  cylinders: 4                            # integer [1, 12]; how many\n"));
  EXPECT_THAT(text, HasSubstr("  power: 10                               # W [0, 100]; how strong\n"));
  const TemporaryYaml yaml(text);
  EXPECT_EQ(parameters::readYaml(yaml.path()).size(), parameters::values(declare).size());
  EXPECT_NO_THROW(assignParameters(engine, parameters::readYaml(yaml.path())));
}

}  // namespace
}  // namespace visual_localization
