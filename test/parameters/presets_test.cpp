#include "visual_localization/parameters/presets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/support/refusal.h"
#include "test/support/synthetic.h"
#include "visual_localization/localization/localizer_config.h"
#include "visual_localization/map/map_builder.h"

namespace visual_localization {
namespace {

using testing::HasSubstr;

LocalizerConfig localizerOf(const ParameterValues& given) {
  LocalizerConfig config;
  assignParameters(config, localizerValues(given, valuesOf(LocalizerConfig())));
  return config;
}

MapBuilderConfig builderOf(const ParameterValues& given) {
  MapBuilderConfig config;
  assignParameters(config, mapBuilderValues(given, valuesOf(MapBuilderConfig())));
  return config;
}

std::string refusalBeside(const std::string& preset, const std::string& name, const ParameterValue& value) {
  return test::refusalOf<ParameterError>([&] { localizerOf({{"preset", preset}, {name, value}}); });
}

TEST(Presets, TheTextHasTheNumbersOfThePapers) {
  const LocalizerConfig config = localizerOf({{"preset", std::string("paper")}});
  // Kronfeld et al. (journal), section 5: parameters of the swarm.
  EXPECT_EQ(config.dpso.particles, 80);
  EXPECT_DOUBLE_EQ(config.dpso.inertia, 0.99);
  EXPECT_DOUBLE_EQ(config.dpso.phi0, 0.3);
  EXPECT_DOUBLE_EQ(config.dpso.phi2, 0.6);
  EXPECT_DOUBLE_EQ(config.dpso.quantum_share, 0.10);
  EXPECT_DOUBLE_EQ(config.dpso.quantum_std, 0.15);
  EXPECT_DOUBLE_EQ(config.dpso.high_energy_share, 0.10);
  EXPECT_DOUBLE_EQ(config.dpso.high_energy_factor, 3.0);
  EXPECT_DOUBLE_EQ(config.dpso.v0, 0.015);
  EXPECT_DOUBLE_EQ(config.dpso.ema_alpha, 1.0 / 8.0);
  EXPECT_DOUBLE_EQ(config.dpso.v0_max, 0.1);
  EXPECT_DOUBLE_EQ(config.dpso.quantum_share_max, 0.20);
  EXPECT_DOUBLE_EQ(config.dpso.phi2_min, 0.01);
  EXPECT_DOUBLE_EQ(config.similarity.sift_recognised, 0.05);
  EXPECT_DOUBLE_EQ(config.match.max_angle_ratio, 0.6) << "delta, journal, section 4";
  // Journal, Table 3: the best cell.
  EXPECT_DOUBLE_EQ(config.pf.rotation_std_deg, 60.0);
  EXPECT_DOUBLE_EQ(config.pf.acceleration_std, 0.001);
  EXPECT_DOUBLE_EQ(config.pf.initial_speed_m, 3.0 * 0.6);
  // Weiss et al., section IV.
  EXPECT_EQ(config.pf.particles, 300);
  EXPECT_DOUBLE_EQ(config.pf.gaussian_std_m, 4.0);
  EXPECT_DOUBLE_EQ(config.pf.pull, 0.2);
  EXPECT_DOUBLE_EQ(config.pf.random_share, 0.05);
  EXPECT_DOUBLE_EQ(config.hybrid.sift_below_m, 7.0);
  EXPECT_DOUBLE_EQ(config.hybrid.global_above_m, 5.5);
  EXPECT_EQ(config.hybrid.sift_every, 0);
  EXPECT_EQ(config.fitness.sharpen, "product");
  EXPECT_DOUBLE_EQ(config.similarity.global_exponent, 20.0);
}

TEST(Presets, TheProgramDiffersFromTheTextInWhatIsListed) {
  const LocalizerConfig swarm = localizerOf({{"preset", std::string("paper_program")}});
  EXPECT_EQ(swarm.dpso.confine, "reflect");
  EXPECT_EQ(swarm.dpso.speed_limit, "diagonal");
  EXPECT_EQ(swarm.dpso.speed_of, "velocity");
  EXPECT_EQ(swarm.dpso.ema_start, "growing");
  EXPECT_TRUE(swarm.dpso.high_energy_perturbation);
  EXPECT_DOUBLE_EQ(swarm.dpso.v0_min, 0.003);
  EXPECT_DOUBLE_EQ(swarm.dpso.v0_decrease, 0.97);
  const LocalizerConfig filter =
      localizerOf({{"preset", std::string("paper_program")}, {"tracker", std::string("pf_linear")}});
  EXPECT_EQ(filter.pf.selection, "scaled");
  EXPECT_DOUBLE_EQ(filter.pf.selection_floor, 0.5);
  EXPECT_EQ(filter.pf.draws, "independent");
  EXPECT_EQ(filter.pf.random_particles, "selection");
  EXPECT_DOUBLE_EQ(filter.pf.pull, 0.0);
  EXPECT_EQ(filter.pf.confine, "box");
  EXPECT_EQ(filter.pf.position, "best");
  EXPECT_DOUBLE_EQ(filter.pf.rotation_std_deg, 30.0);
  EXPECT_EQ(filter.pf.initial_speed_of, "range");
  std::size_t differences = 0;
  for (const auto& [name, value] : presetNamed("paper").localizer) {
    differences += presetNamed("paper_program").localizer.at(name) == value ? 0 : 1;
  }
  EXPECT_EQ(differences, 7U);
  EXPECT_EQ(presetNamed("paper").map_builder, presetNamed("paper_program").map_builder);
}

TEST(Presets, TheyNameEveryParameterOfTheTrackersThatTheyOffer) {
  for (const std::string& name : presetNames()) {
    for (const auto& [parameter, value] : valuesOf(LocalizerConfig())) {
      const bool is_of_tracker = parameter.rfind("dpso/", 0) == 0 || parameter.rfind("pf/", 0) == 0;
      if (!is_of_tracker || parameter == "dpso/swarms" || parameter == "pf/selection_floor") continue;
      EXPECT_EQ(presetNamed(name).localizer.count(parameter), 1U) << name << ": " << parameter;
    }
  }
}

TEST(Presets, MapsAreNeitherAdjustedNorThinned) {
  const MapBuilderConfig config = builderOf({{"preset", std::string("paper")}});
  EXPECT_FALSE(config.geometry.enabled);
  EXPECT_TRUE(config.prune);
  EXPECT_DOUBLE_EQ(config.spacing_m, 0.0);
  EXPECT_DOUBLE_EQ(config.max_megapixels, 0.0);
  EXPECT_DOUBLE_EQ(config.trajectory.speed_tolerance, 0.05);
  EXPECT_THAT(test::refusalOf<ParameterError>([] {
                builderOf({{"preset", std::string("paper")}, {"sift/contrast_threshold", 0.02}});
              }),
              HasSubstr("'sift/contrast_threshold' = 0.02 contradicts preset 'paper': must be 0.04"));
}

TEST(Presets, WhatContradictsIsRefusedByName) {
  EXPECT_THAT(refusalBeside("paper", "dpso/phi0", 1.5), HasSubstr("'dpso/phi0' = 1.5 contradicts preset 'paper'"));
  EXPECT_THAT(refusalBeside("paper", "dpso/particles", std::int64_t{40}), HasSubstr("must be 80"));
  EXPECT_THAT(refusalBeside("paper", "fitness/distance_sigma", 30.0), HasSubstr("must be 10"));
  EXPECT_THAT(refusalBeside("paper_program", "tracker", std::string("dpso_multi")),
              HasSubstr("must be one of dpso, pf_gaussian, pf_linear"));
  EXPECT_THAT(refusalBeside("papers\n", "seed", std::int64_t{3}), HasSubstr("must be one of paper, paper_program"));
}

TEST(Presets, WhatIsOpenAgreesOrIsADefaultIsAllowedBeside) {
  EXPECT_EQ(localizerOf({{"preset", std::string("paper")}, {"match/mode", std::string("one_way")}}).match.mode,
            "one_way");
  EXPECT_EQ(localizerOf({{"preset", std::string("paper")}, {"features", std::string("hybrid")}}).features, "hybrid");
  EXPECT_EQ(localizerOf({{"preset", std::string("paper")}, {"seed", std::int64_t{7}}}).seed, 7);
  ParameterValues shipped = valuesOf(LocalizerConfig());  // config/localizer.yaml
  shipped["preset"] = std::string("paper");
  EXPECT_EQ(valuesOf(localizerOf(shipped)), valuesOf(localizerOf({{"preset", std::string("paper")}})));
}

TEST(Presets, AMapThatWasNotBuiltWithItDoesNotFit) {
  const LocalizerConfig config = localizerOf({{"preset", std::string("paper")}});
  const auto mapWith = [](const std::string& preset) {
    const auto map = test::mapAt(test::street(5, 2.0));
    MapHeader header = map->header();
    header.preset = preset;
    std::vector<TrainingImage> images;
    for (std::size_t i = 0; i < map->size(); ++i) images.push_back(map->image(i));
    return TrainingMap(header, std::move(images));
  };
  EXPECT_NO_THROW(requirePresetFits(config, mapWith("paper")));
  EXPECT_NO_THROW(requirePresetFits(config, mapWith("paper_program"))) << "the same from the bag to the map";
  EXPECT_THAT(test::refusalOf<ParameterError>([&] { requirePresetFits(config, mapWith("")); }),
              HasSubstr("build one with map_builder --preset paper"));
  EXPECT_NO_THROW(requirePresetFits(LocalizerConfig(), mapWith("")));
}

}  // namespace
}  // namespace visual_localization
