#include "parameters/yaml_map.h"

#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/support/refusal.h"
#include "test/support/temporary_folder.h"

namespace visual_localization::parameters {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::Pair;
using ::testing::StartsWith;

/// In a file called f.yaml.
std::string refusalOfText(
    const std::string& text, const std::function<void(YamlMap&)>& use = [](YamlMap&) {}) {
  return test::refusalOf<ParameterError>([&] {
    YamlMap map = YamlMap::parse(text, "f.yaml");
    use(map);
    map.requireNoMore();
  });
}

TEST(YamlMap, GivesWhatTheFileSays) {
  YamlMap map = YamlMap::parse("{name: x, on: yes, share: 0.5, runs: 7, inner: {a: 1}, none: }", "f.yaml");
  EXPECT_EQ(map.text("name"), "x");
  EXPECT_TRUE(map.flag("on", false));
  EXPECT_EQ(map.real("share", 0.0, 0.0, 1.0), 0.5);
  EXPECT_EQ(map.count("runs", 0, 1, 10), 7U);
  EXPECT_EQ(map.map("inner").text("a"), "1");
  EXPECT_FALSE(map.has("none"));
  EXPECT_EQ(map.text("none", "nothing"), "nothing");
  EXPECT_NO_THROW(map.requireNoMore());
}

TEST(YamlMap, GivesTheDefaultsOfWhatTheFileDoesNotSay) {
  YamlMap map = YamlMap::parse("{}", "f.yaml");
  EXPECT_EQ(map.text("name", "x"), "x");
  EXPECT_TRUE(map.flag("on", true));
  EXPECT_EQ(map.real("share", 2.5, 0.0, 1.0), 2.5);
  EXPECT_EQ(map.count("runs", 3, 5, 10), 3U);
  EXPECT_TRUE(map.parameters("parameters").empty());
  EXPECT_TRUE(map.sweep("sweep").empty());
}

TEST(YamlMap, GivesListsAndParameters) {
  YamlMap map = YamlMap::parse("{pairs: [[a, b], [b, a]], p: {a: {b: 2}, c: '3'}, s: {k: [1, two]}}", "f.yaml");
  EXPECT_THAT(map.textLists("pairs", 2), ElementsAre(ElementsAre("a", "b"), ElementsAre("b", "a")));
  EXPECT_THAT(map.parameters("p"),
              ElementsAre(Pair("a/b", ParameterValue(std::int64_t{2})), Pair("c", ParameterValue(std::string("3")))));
  EXPECT_THAT(map.sweep("s"), ElementsAre(Pair("k", ElementsAre("1", "two"))));
}

TEST(YamlMap, RefusesAKeyNobodyAskedForWithTheKnownOnes) {
  const auto use = [](YamlMap& map) {
    map.text("name", "");
    map.flag("closed", true);
  };
  EXPECT_EQ(refusalOfText("{nmae: x}", use), "f.yaml: 'nmae' is unknown; allowed here: closed, name");
}

TEST(YamlMap, RefusesAKeyThatAppearsTwice) {
  EXPECT_EQ(refusalOfText("a: 1\nb: 2\na: 3\n"), "f.yaml: 'a' appears twice");
  EXPECT_EQ(refusalOfText("m: {a: 1, a: 2}", [](YamlMap& map) { map.map("m"); }), "f.yaml: 'm/a' appears twice");
  EXPECT_EQ(refusalOfText("l: [{a: 1}, {a: 1, a: 2}]", [](YamlMap& map) { map.maps("l"); }),
            "f.yaml: 'l[1]/a' appears twice");
  EXPECT_EQ(refusalOfText("p: {a/b: 1, a: {b: 2}}", [](YamlMap& map) { map.parameters("p"); }),
            "f.yaml: p: key 'a/b' appears twice");
  EXPECT_EQ(refusalOfText("s: {a: [1], a: [2]}", [](YamlMap& map) { map.sweep("s"); }), "f.yaml: 's/a' appears twice");
}

TEST(YamlMap, RefusesAKeyThatIsNoText) {
  EXPECT_THAT(refusalOfText("? [1, 2]\n: 3\n"), HasSubstr("f.yaml: has a key that is no text"));
  EXPECT_THAT(refusalOfText("m: {? [1] : 3}", [](YamlMap& map) { map.map("m"); }), HasSubstr("'m/': has a key"));
  EXPECT_THAT(refusalOfText("p: {? [1] : 3}", [](YamlMap& map) { map.parameters("p"); }), HasSubstr("p: has a key"));
  EXPECT_THAT(refusalOfText("s: {? [1] : [3]}", [](YamlMap& map) { map.sweep("s"); }), HasSubstr("'s': has a key"));
}

TEST(YamlMap, RefusesAliasesThatStandForMoreThanAnyMemoryHas) {
  for (const char* innermost : {"{}", "{k: 1}"}) {
    std::string text = std::string("a0: &a0 ") + innermost + "\n";
    for (int i = 1; i < 7; ++i) {
      text += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " {";
      for (int j = 0; j < 50; ++j) text += "k" + std::to_string(j) + ": *a" + std::to_string(i - 1) + ", ";
      text += "}\n";
    }
    EXPECT_THAT(refusalOfText(text, [](YamlMap& map) { map.parameters("a6"); }), HasSubstr("too many keys"));
  }
}

TEST(YamlMap, RefusesInOneLineWhateverTheKeyIs) {
  EXPECT_EQ(refusalOfText("\"a\\nb\\e[2J\": 1").find_first_of("\n\033"), std::string::npos);
  EXPECT_LE(refusalOfText(std::string(100'000, 'k') + "x: {}\n\"" + std::string(100'000, 'y') + "\": 1").size(),
            10'000U);
}

TEST(YamlMap, RefusesNumbersOutsideTheirRangeWithTheRange) {
  const auto real = [](YamlMap& map) { map.real("x", 1.0, 0.0, 2.5); };
  for (const char* value : {"3", "-0.1", ".nan", ".inf", "1e400", "two", "''"}) {
    EXPECT_THAT(refusalOfText(std::string("x: ") + value, real),
                AllOf(StartsWith("f.yaml: 'x' = "), HasSubstr("must be a number in [0, 2.5]")))
        << value;
  }
  const auto count = [](YamlMap& map) { map.count("x", 1, 1, 100); };
  for (const char* value : {"0", "-3", "101", "99999999999999999999", "8.5", "1e2", ".nan", "many", "''"}) {
    EXPECT_THAT(refusalOfText(std::string("x: ") + value, count),
                AllOf(StartsWith("f.yaml: 'x' = "), HasSubstr("must be an integer in [1, 100]")))
        << value;
  }
}

TEST(YamlMap, RefusesValuesOfTheWrongKind) {
  EXPECT_EQ(refusalOfText("{}", [](YamlMap& map) { map.text("x"); }), "f.yaml: 'x' is missing");
  EXPECT_EQ(refusalOfText("x: [1]", [](YamlMap& map) { map.text("x"); }), "f.yaml: 'x' must be a single value");
  EXPECT_EQ(refusalOfText("x: 2", [](YamlMap& map) { map.flag("x", true); }), "f.yaml: 'x' = 2 must be true or false");
  EXPECT_EQ(refusalOfText("x: 2", [](YamlMap& map) { map.map("x"); }), "f.yaml: 'x' must be a mapping");
  for (const char* text : {"x: 2", "x: []", "x: [1]", "x: {a: 1}"}) {
    EXPECT_EQ(refusalOfText(text, [](YamlMap& map) { map.maps("x"); }), "f.yaml: 'x' must be a list of mappings")
        << text;
  }
  for (const char* text : {"x: 2", "x: []", "x: [[a]]", "x: [[a, b, c]]", "x: [[a, [b]]]", "x: [a, b]"}) {
    EXPECT_EQ(refusalOfText(text, [](YamlMap& map) { map.textLists("x", 2); }),
              "f.yaml: 'x' must be a list of lists of 2 names")
        << text;
  }
  EXPECT_THAT(refusalOfText("x: [1]", [](YamlMap& map) { map.parameters("x"); }),
              HasSubstr("'x' must be a mapping of par"));
  EXPECT_THAT(refusalOfText("x: {a: [1]}", [](YamlMap& map) { map.parameters("x"); }),
              HasSubstr("x: key 'a' must be a si"));
  for (const char* text : {"x: 2", "x: {a: 1}", "x: {a: []}", "x: {a: [[1]]}"}) {
    EXPECT_THAT(refusalOfText(text, [](YamlMap& map) { map.sweep("x"); }),
                HasSubstr("'x' must be a mapping of parameter"));
  }
}

TEST(YamlMap, RefusesATextThatTheParserWouldMakeDocumentsOfForEver) {
  for (const char* text : {",", ")", "]", "}", "{a: 1}\n}", "{a: 1}\n,", "a: 1\n]", ",: &a {x: 1}:\n? [ |\n  t\n"}) {
    EXPECT_THAT(refusalOfText(text), StartsWith("f.yaml: ")) << text;
  }
}

TEST(YamlMap, RefusesATextThatIsNoMapping) {
  for (const char* text : {"", "# nothing\n", "[1, 2]", "words", "42"})
    EXPECT_EQ(refusalOfText(text), "f.yaml: must be a mapping") << text;
  EXPECT_THAT(refusalOfText("a: 1\n---\nb: 2\n"), HasSubstr("f.yaml: holds several documents"));
  for (const std::string& text : {std::string("a: {b: "), std::string("\t- x"), std::string("a: *b"),
                                  std::string(100000, '['), std::string("\x01\x02\x7f", 3)}) {
    EXPECT_THAT(refusalOfText(text), AllOf(StartsWith("f.yaml: "), Not(HasSubstr("\n")))) << text.substr(0, 20);
  }
}

TEST(ReadYaml, NamesAFileThatCannotBeRead) {
  const test::TemporaryFolder folder;
  for (const std::string& path : {folder / "absent.yaml", folder.path()}) {
    EXPECT_THAT(test::refusalOf<ParameterError>([&] { readYaml(path); }), StartsWith(path + ": cannot be read: "));
  }
}

}  // namespace
}  // namespace visual_localization::parameters
