#include "evaluation/experiment.h"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "test/evaluation/small_experiment.h"
#include "test/support/refusal.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::Pair;
using ::testing::StartsWith;

struct Mistake {
  std::string part;         ///< of the small experiment
  std::string replacement;  ///< for it
  std::string expected;     ///< what the refusal says
};

std::string refusalOfYaml(const std::string& yaml) {
  return test::refusalOf<ParameterError>([&] { parseExperiment(yaml, "e.yaml"); });
}

void expectRefused(const std::vector<Mistake>& mistakes) {
  for (const Mistake& mistake : mistakes) {
    EXPECT_THAT(refusalOfYaml(test::smallYamlWith(mistake.part, mistake.replacement)),
                AllOf(StartsWith("e.yaml: "), HasSubstr(mistake.expected), Not(HasSubstr("\n"))))
        << mistake.replacement;
  }
}

std::vector<std::string> namesOfMethods(const std::string& yaml) {
  std::vector<std::string> names;
  for (const MethodSpec& method : parseExperiment(yaml, "e.yaml").methods) names.push_back(method.name);
  return names;
}

const std::string kBestMethod = "{name: best, tracker: exhaustive}";

TEST(Experiment, SaysWhatTheFileSays) {
  const Experiment experiment = test::smallExperiment();
  EXPECT_EQ(experiment.name, "small");
  EXPECT_TRUE(experiment.closed);
  EXPECT_EQ(experiment.starts, 3U);
  ASSERT_EQ(experiment.rounds.size(), 3U);
  EXPECT_EQ(experiment.rounds[1].bag, "a2.bag");
  EXPECT_EQ(experiment.rounds[1].group, "a");
  EXPECT_EQ(experiment.rounds[1].truth_topic, "/gps/fix");
  ASSERT_EQ(experiment.methods.size(), 3U);
  EXPECT_TRUE(experiment.methods[1].kidnapped);
  EXPECT_FALSE(experiment.methods[2].isTracker());
  EXPECT_THAT(experiment.methods[0].settings, ::testing::Contains(Pair("dpso/particles", "20")));
}

TEST(Experiment, RunsAndAccuracyOfTheTruth) {
  std::string yaml = test::smallYamlWith("starts: 3", "start_every: 7\nrun_images: 60\njudge_from: 10");
  yaml.replace(yaml.find("rounds:\n"), 8, "rounds:\n  right: 3\n");
  yaml.replace(yaml.find("bag: a2.bag"), 11, "bag: a2.bag, right: 4, wrong: 8");
  const Experiment experiment = parseExperiment(yaml, "e.yaml");
  EXPECT_EQ(experiment.start_every, 7U);
  EXPECT_EQ(experiment.run_images, 60U);
  EXPECT_EQ(experiment.judge_from, 10U);
  EXPECT_EQ(experiment.rounds[0].accuracy.right_m, 3.0);
  EXPECT_EQ(experiment.rounds[0].accuracy.wrong_m, 10.0);
  EXPECT_EQ(experiment.rounds[1].accuracy.right_m, 4.0);
  EXPECT_EQ(experiment.rounds[1].accuracy.wrong_m, 8.0);
  expectRefused({{"bag: a1.bag", "bag: a1.bag, right: 11", "wrong' = 10 must not be below right = 11"},
                 {"starts: 3", "starts: 3\nstart_every: 7", "start_every"}});
}

TEST(Experiment, AGroupStandsForAllOfItsRounds) {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (const PairSpec& pair : test::smallExperiment().pairs) pairs.emplace_back(pair.map, pair.drive);
  EXPECT_THAT(pairs, ElementsAre(Pair(0, 2), Pair(1, 2), Pair(2, 0), Pair(2, 1)));
  const std::string among_itself = test::smallYamlWith("[[a, b], [b, a]]", "[[a, a]]");
  EXPECT_EQ(parseExperiment(among_itself, "e.yaml").pairs.size(), 2U);
}

TEST(Experiment, ASweepGivesAMethodForEveryCombination) {
  const std::string swept =
      "{name: 'PF {pf/particles} {speed}', tracker: pf_linear, "
      "sweep: {pf/particles: [10, 20], speed: [1, 2.5]}}";
  const std::string yaml = test::smallYamlWith(kBestMethod, swept);
  EXPECT_THAT(namesOfMethods(yaml), ElementsAre("swarm", "filter", "PF 10 1", "PF 10 2.5", "PF 20 1", "PF 20 2.5"));
  EXPECT_EQ(parseExperiment(yaml, "e.yaml").methods[3].speed, 2.5);
}

TEST(Experiment, PlacesOnlyUnlessTheFileAsksForLandmarks) {
  EXPECT_FALSE(test::smallExperiment().map.geometry.enabled);
  EXPECT_FALSE(test::smallExperiment().solvesPoses());
  const auto with = [](const std::string& parameters) {
    return parseExperiment(
        test::smallYamlWith("starts: 3", "starts: 3\nmap_parameters: {geometry/enabled: true}") + parameters, "e.yaml");
  };
  EXPECT_TRUE(with("").solvesPoses());
  const std::string places =
      "  - {name: p, tracker: dpso, parameters: {pose_source: place}}\n"
      "  - {name: m, tracker: dpso, parameters: {pose_source: metric}}\n";
  EXPECT_EQ(with(places).methods[3].localizer.metric.pose_source, "place");
  EXPECT_EQ(with(places).methods[4].localizer.metric.pose_source, "metric");
  const std::string yaml = test::smallYamlWith("starts: 3", "starts: 3\nmap_parameters: {geometry/enabled: true}");
  std::string all_places = yaml;
  const std::string common = "parameters: {recovery: paper}";
  all_places.replace(all_places.find(common), common.size(), "parameters: {recovery: paper, pose_source: place}");
  EXPECT_FALSE(parseExperiment(all_places, "e.yaml").solvesPoses());
}

TEST(Experiment, RoundsMayHaveACalibrationAndTruePoses) {
  const std::string yaml = test::smallYamlWith("bag: a1.bag", "bag: a1.bag, camera_info: own.yaml, poses: a1.csv");
  const std::string common = std::string(yaml).replace(yaml.find("rounds:\n"), 8, "rounds:\n  camera_info: all.yaml\n");
  const Experiment experiment = parseExperiment(common, "e.yaml");
  EXPECT_EQ(experiment.rounds[0].camera_info, "own.yaml");
  EXPECT_EQ(experiment.rounds[0].poses, "a1.csv");
  EXPECT_EQ(experiment.rounds[1].camera_info, "all.yaml");
  EXPECT_EQ(experiment.rounds[1].poses, "");
  EXPECT_EQ(test::smallExperiment().rounds[1].camera_info, "");
}

TEST(Experiment, ARoundSaysHowItIsPruned) {
  const auto pruning = [](const std::string& entry) {
    return parseExperiment(test::smallYamlWith("bag: a1.bag", "bag: a1.bag" + entry), "e.yaml").rounds[0].pruning;
  };
  EXPECT_EQ(pruning(""), Pruning::kPrevious);
  EXPECT_EQ(pruning(", pruning: previous"), Pruning::kPrevious);
  EXPECT_EQ(pruning(", pruning: both"), Pruning::kBoth);
  EXPECT_EQ(pruning(", pruning: none"), Pruning::kNone);
  expectRefused({{"bag: a1.bag", "bag: a1.bag, pruning: next",
                  "'rounds/bags[0]/pruning' = 'next' must be previous, both or none"}});
}

TEST(Experiment, TheSpacingOfTheMapMayBeSwept) {
  const std::string yaml =
      test::smallYamlWith(kBestMethod, "{name: 's {map_spacing}', tracker: dpso, sweep: {map_spacing: [0, 2, 10]}}");
  const Experiment experiment = parseExperiment(yaml, "e.yaml");
  ASSERT_EQ(experiment.methods.size(), 5U);
  EXPECT_EQ(experiment.methods[3].map_spacing_m, 2.0);
  EXPECT_THAT(experiment.methods[3].settings, ::testing::Contains(Pair("map_spacing", "2")));
  EXPECT_THAT(experiment.methods[2].settings, Not(::testing::Contains(::testing::Key("map_spacing"))));
  expectRefused(
      {{kBestMethod, "{name: x, tracker: dpso, map_spacing: -1}", "'methods[2]/map_spacing' = -1 must be"},
       {kBestMethod, "{name: x, tracker: dpso, map_spacing: 1, sweep: {map_spacing: [1]}}",
        "'methods[2]/sweep/map_spacing' is set for this method already"},
       {kBestMethod, "{name: x, tracker: dpso, sweep: {map_spacing: [x]}}", "map_spacing = x must be a number"},
       {"bag: a1.bag", "bag: a1.bag, poses: [a]", "'rounds/bags[0]/poses' must be a single value"},
       {"bag: a1.bag", "bag: a1.bag, camera_info: {a: b}", "'rounds/bags[0]/camera_info' must be a single"},
       {"bag: a1.bag", "bag: a1.bag, pose: a", "'rounds/bags[0]/pose' is unknown"},
       {kBestMethod, "{name: x, tracker: dpso, parameters: {pose_source: geometry}}", "pose_source"},
       {"starts: 3", "starts: 3\nmap_parameters: {geometry/enabled: perhaps}", "geometry/enabled"}});
}

TEST(Experiment, EveryExperimentThatShipsIsValid) {
  int read = 0;
  for (const auto& file : std::filesystem::directory_iterator(TEST_DATA_DIR "/../../config/evaluation")) {
    if (file.path().extension() != ".yaml") continue;
    EXPECT_NO_THROW(parseExperiment(readFile(file.path().string()), file.path().string())) << file.path();
    ++read;
  }
  EXPECT_GT(read, 5);
}

/// What a name says of its method.
std::string trackerIn(const std::string& name) {
  const std::vector<std::pair<std::string, std::string>> words{
      {"DPSO", "dpso"}, {"PF-g", "pf_gaussian"}, {"PF-l", "pf_linear"}, {"Bayes filter", "bayes"}};
  for (const auto& [word, tracker] : words) {
    if (name.find(word) != std::string::npos) return tracker;
  }
  return "";
}

TEST(Experiment, TheMethodsOfExperimentsThatShipRunWhatTheirNamesSay) {
  int named = 0;
  for (const auto& file : std::filesystem::directory_iterator(TEST_DATA_DIR "/../../config/evaluation")) {
    if (file.path().extension() != ".yaml") continue;
    for (const MethodSpec& method : parseExperiment(readFile(file.path().string()), file.path().string()).methods) {
      const std::string tracker = trackerIn(method.name);
      if (tracker.empty() || method.name.rfind("topological", 0) == 0) continue;
      EXPECT_EQ(method.tracker, tracker) << file.path() << ": " << method.name;
      ++named;
    }
  }
  EXPECT_GT(named, 50);
}

TEST(Experiment, AMethodNamesItsTracker) {
  expectRefused({{"name: swarm, tracker: dpso,", "name: swarm,", "'methods[0]/tracker' is missing"}});
}

TEST(Experiment, RefusesParametersThatNoTrackerOfTheMethodUses) {
  expectRefused(
      {{kBestMethod, "{name: x, tracker: bayes, parameters: {dpso/phi0: 0.5}}",
        "'methods[2]/parameters' of 'x': 'dpso/phi0' changes nothing with tracker 'bayes'"},
       {kBestMethod, "{name: x, tracker: bayes, parameters: {recovery: none}}", "'recovery' changes nothing with"},
       {kBestMethod, "{name: x, tracker: dpso, sweep: {pf/particles: [10]}}", "'pf/particles' changes nothing with"},
       {"name: swarm, tracker: dpso, parameters: {dpso/particles: 20}", "name: swarm, tracker: bayes",
        "'parameters' 'recovery' changes nothing: no method has a tracker that uses it"}});
}

TEST(Experiment, APresetIsForMapAndMethods) {
  const std::string yaml = test::smallYamlWith("parameters: {recovery: paper}", "preset: paper_program");
  const Experiment experiment = parseExperiment(yaml, "e.yaml");
  EXPECT_EQ(experiment.map.preset, "paper_program");
  EXPECT_TRUE(experiment.map.prune);
  EXPECT_EQ(experiment.front_end.match.mode, "symmetric");
  EXPECT_EQ(experiment.methods[0].localizer.dpso.speed_limit, "diagonal");
  EXPECT_EQ(experiment.methods[0].localizer.dpso.particles, 20) << "what a method sets is what it tries";
  EXPECT_EQ(experiment.methods[1].localizer.pf.selection, "weights") << "Gaussian motion is of the other paper";
  EXPECT_EQ(parseExperiment(yaml, "e.yaml", "paper").methods[0].localizer.dpso.speed_limit, "norm");
  const std::string beside = "preset: paper\nparameters: {dpso/phi0: 1.5}";
  expectRefused({{"parameters: {recovery: paper}", "preset: thesis", "preset 'thesis' is not allowed"},
                 {"parameters: {recovery: paper}", beside, "'dpso/phi0' = 1.5 contradicts preset 'paper': must be 0.3"},
                 {"parameters: {recovery: paper}", "preset: paper\nmap_parameters: {map/prune: false}",
                  "'map/prune' = false contradicts preset 'paper': must be true"}});
}

TEST(Experiment, WithoutAPresetItIsThePackage) {
  const Experiment experiment = test::smallExperiment();
  EXPECT_EQ(experiment.front_end.match.mode, "votes");
  EXPECT_FALSE(experiment.map.prune);
  EXPECT_EQ(experiment.methods[0].localizer.state.witness, "probability");
}

TEST(Experiment, RefusesAFileThatIsNoExperiment) {
  for (const char* text : {"", "# nothing", "[]", "words"}) EXPECT_EQ(refusalOfYaml(text), "e.yaml: must be a mapping");
  EXPECT_EQ(refusalOfYaml("{}"), "e.yaml: 'experiment' is missing");
  EXPECT_THAT(refusalOfYaml("experiment: {a: "), StartsWith("e.yaml: not valid YAML"));
}

TEST(Experiment, RefusesUnknownMissingAndRepeatedKeys) {
  expectRefused({{"starts: 3", "start: 3", "'start' is unknown; allowed here: experiment, found_within"},
                 {"starts: 3", "starts: 3\nstarts: 4", "'starts' appears twice"},
                 {"rounds:\n", "rounds:\n  colsed: true\n", "'rounds/colsed' is unknown"},
                 {"bag: a1.bag", "bug: a1.bag", "'rounds/bags[0]/bag' is missing"},
                 {"bag: a1.bag", "bag: a1.bag, topic: x", "'rounds/bags[0]/topic' is unknown"},
                 {"kidnapped: true", "kidnaped: true", "'methods[1]/kidnaped' is unknown"},
                 {"experiment: small", "", "'experiment' is missing"},
                 {"experiment: small", "experiment: ''", "'experiment' must be a name"}});
}

TEST(Experiment, RefusesRoundsThatDoNotMakeAnExperiment) {
  const std::string& yaml = test::smallYaml();
  const std::size_t begin = yaml.find("    - {name: a2");
  const std::string two_more = yaml.substr(begin, yaml.find("pairs:") - begin);
  expectRefused({{two_more, "", "'rounds/bags' has one round only"},
                 {"bags:\n", "bugs:\n", "'rounds/bags' is missing"},
                 {"name: a2", "name: a1", "'rounds/bags[1]/name' = 'a1' appears twice"},
                 {"name: a2", "name: 'a/2'", "must be a name without slash"},
                 {"name: a2", "name: ''", "must be a name without slash"},
                 {"bag: a2.bag", "bag: [a2.bag]", "'rounds/bags[1]/bag' must be a single value"},
                 {"rounds:\n", "rounds:\n  closed: 3\n", "'rounds/closed' = 3 must be true or false"}});
}

TEST(Experiment, RefusesPairsThatCannotBeRun) {
  expectRefused({{"[a, b], ", "[a, c], ", "[a, c]: no round or group is called 'c'"},
                 {"[a, b], ", "[b, b], ", "[b, b] needs two different rounds, but there is one only"},
                 {"[a, b], ", "[a, b], [a1, b1], ", "the pair of map a1 and drive b1 twice"},
                 {"[a, b], ", "[a, b, a], ", "must be a list of lists of 2 names"},
                 {"[[a, b], [b, a]]", "[]", "must be a list of lists of 2 names"},
                 {"pairs: [[a, b], [b, a]]", "", "'pairs' is missing"}});
}

TEST(Experiment, RefusesNumbersOutsideTheirRange) {
  for (const char* value : {"0", "-1", "99999999999999999999", "2.5", ".nan", "every"}) {
    expectRefused({{"starts: 3", std::string("starts: ") + value, "must be an integer in [1, 1000000]"}});
  }
  expectRefused(
      {{"starts: 3", "trace_start: -1", "'trace_start' = -1 must be an integer in [0, 1000000]"},
       {kBestMethod, "{name: x, tracker: dpso, speed: 0}", "'methods[2]/speed' = 0 must be a number in [0.015625, 64]"},
       {kBestMethod, "{name: x, tracker: dpso, speed: .nan}", "must be a number in [0.015625, 64]"},
       {kBestMethod, "{name: x, tracker: dpso, sweep: {speed: [1, 65]}}",
        "speed = 65 must be a number in [0.015625, 64]"},
       {"dpso/particles: 20", "dpso/particles: 1", "'dpso/particles' = 1 is not allowed: must be an integer"},
       {"dpso/particles: 20", "dpso/particles: many", "'dpso/particles' = many is not allowed"},
       {"recovery: paper", "match/ratio_angle: .nan", "e.yaml: 'parameters' parameter 'match/"}});
}

TEST(Experiment, RefusesMethodsThatCannotBeRun) {
  expectRefused(
      {{"name: swarm", "name: best", "'methods[2]/name' = 'best' appears twice"},
       {"name: swarm", "name: ''", "'methods[0]/name' must be a name of one line"},
       {"name: swarm", "name: \"a\\nb\"", "'methods[0]/name' must be a name of one line"},
       {"tracker: dpso", "tracker: crystal_ball", "(beside the trackers: exhaustive, sequence, topological)"},
       {kBestMethod, "{name: x, tracker: exhaustive, features: hybrid}", "hybrid needs a tracker's cloud"},
       {kBestMethod, "{name: x, tracker: dpso, features: smell}", "one of sift, learned, global, hybrid"},
       {kBestMethod, "{name: x, tracker: dpso, parameters: {prune: false}}", "'prune' holds for all methods"},
       {kBestMethod, "{name: x, tracker: dpso, parameters: {nonsense: 1}}", "'nonsense' = 1 is unknown"},
       {kBestMethod, "{name: x, tracker: dpso, parameters: 3}", "must be a mapping of parameter names to values"},
       {"recovery: paper", "nonsense: 1", "'nonsense' = 1 is unknown"},
       {"starts: 3", "map_parameters: {nonsense: 1}", "'nonsense' = 1 is unknown"}});
}

TEST(Experiment, RefusesSweepsThatCannotBeMeant) {
  std::string many = "{name: x, tracker: dpso, sweep: {";
  for (const char* key : {"a", "b", "c"}) {
    many += std::string(key) + ": [";
    for (int i = 0; i < 100; ++i) many += std::to_string(i) + ", ";
    many += "0], ";
  }
  expectRefused(
      {{kBestMethod, "{name: x, tracker: pf_linear, sweep: {pf/particles: [10, 20]}}", "'x' appears twice"},
       {kBestMethod, "{name: x, tracker: pf_linear, sweep: {pf/particles: []}}", "to lists of values"},
       {kBestMethod, "{name: x, tracker: dpso, sweep: {nonsense: [1]}}", "'nonsense' = 1 is unknown"},
       {kBestMethod, "{name: x, tracker: dpso, speed: 2, sweep: {speed: [1]}}", "'methods[2]/sweep/speed' is set for"},
       {kBestMethod, "{name: x, tracker: dpso, parameters: {prune: true}, sweep: {prune: [true]}}",
        "is set for this method"},
       {kBestMethod, "{name: '{speed}', tracker: dpso, sweep: {speed: ['{speed}']}}",
        "speed = {speed} must be a number"},
       {kBestMethod, many + "}}", "'methods[2]/sweep' has more than 10000 combinations"}});
}

TEST(Experiment, ANameThatASweepMakesTooLongIsRefused) {
  std::string name;
  for (int i = 0; i < 50; ++i) name += "{speed}";
  const std::string swept = "{name: '" + name + "', tracker: dpso, sweep: {speed: [1." + std::string(50, '0') + "]}}";
  expectRefused({{kBestMethod, swept, "becomes too long"}});
}

}  // namespace
}  // namespace visual_localization
