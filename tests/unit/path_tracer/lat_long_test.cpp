// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/lat_long.h"

#include <gtest/gtest.h>

#include "tests/support/statistics.h"

namespace farfield {
namespace {

TEST(LatLongGrid, CentreLooksAlongMinusZAndTheTopRowUp) {
  const LatLongGrid grid{360, 180};
  EXPECT_LT(glm::length(grid.direction(180, 90) - vec3(0, 0, -1)), 1e-5f);
  EXPECT_LT(glm::length(grid.direction(270, 90) - vec3(1, 0, 0)), 1e-5f);
  EXPECT_LT(glm::length(grid.direction(90, 90) - vec3(-1, 0, 0)), 1e-5f);
  EXPECT_LT(glm::length(grid.direction(17, 0) - vec3(0, 1, 0)), 1e-5f);
}

TEST(LatLongGrid, CellIsTheInverseOfDirection) {
  for (const LatLongGrid grid : {LatLongGrid{1, 1}, LatLongGrid{7, 3}, LatLongGrid{128, 64}}) {
    for (int row = 0; row < grid.height; ++row) {
      for (int column = 0; column < grid.width; ++column) {
        const vec3 inside = grid.direction(static_cast<float>(column) + 0.4f, static_cast<float>(row) + 0.6f);
        EXPECT_EQ(grid.cell(inside), static_cast<size_t>(row) * static_cast<size_t>(grid.width) + column);
      }
    }
  }
}

TEST(LatLongGrid, EveryDirectionHasACellEvenPolesAndTheSeam) {
  const LatLongGrid grid{8, 4};
  for (const vec3& direction :
       {vec3(0, 1, 0), vec3(0, -1, 0), vec3(0, 0, 1), vec3(-0.0f, 0, 1), vec3(0, 1.0000001f, 0)})
    EXPECT_LT(grid.cell(direction), grid.cell_count());
}

TEST(LatLongGrid, SolidAnglesOfAllCellsAreTheSphere) {
  for (const LatLongGrid grid : {LatLongGrid{1, 1}, LatLongGrid{5, 9}, LatLongGrid{4096, 2048}}) {
    double sum = 0;
    for (int row = 0; row < grid.height; ++row) sum += grid.solid_angle(row) * grid.width;
    EXPECT_NEAR(sum, 4 * 3.14159265358979, 1e-9);
  }
}

struct NamedWeights {
  const char* name;
  LatLongGrid grid;
  std::vector<float> weights;
};

std::vector<NamedWeights> sample_weights() {
  std::vector<NamedWeights> all = {
      {"one cell", {1, 1}, {3.0f}},
      {"only one cell of many", {4, 2}, {0, 0, 0, 0, 0, 7, 0, 0}},
      {"rows without light", {3, 4}, {0, 0, 0, 1, 2, 3, 0, 0, 0, 5, 0, 5}},
      {"very different cells", {2, 2}, {1e-6f, 1.0f, 1e3f, 1.0f}},
  };
  NamedWeights noise{"noise", {16, 8}, {}};
  Rng rng(3);
  for (size_t i = 0; i < noise.grid.cell_count(); ++i) noise.weights.push_back(rng.next());
  all.push_back(noise);
  return all;
}

TEST(LatLongDistribution, PdfIntegratesToOneAndIsProportionalToTheWeights) {
  for (const NamedWeights& test : sample_weights()) {
    const LatLongDistribution distribution(test.grid, test.weights);
    double sum = 0;
    for (int row = 0; row < test.grid.height; ++row) {
      for (int column = 0; column < test.grid.width; ++column) {
        const size_t cell = static_cast<size_t>(row * test.grid.width + column);
        const float pdf = distribution.pdf(test.grid.direction(float(column) + 0.5f, float(row) + 0.5f));
        EXPECT_NEAR(pdf * distribution.integral(), test.weights[cell], 1e-5f * test.weights[cell]) << test.name;
        sum += static_cast<double>(pdf) * test.grid.solid_angle(row);
      }
    }
    EXPECT_NEAR(sum, 1.0, 1e-5) << test.name;
  }
}

TEST(LatLongDistribution, SamplesFollowThePdf) {
  // Seed 1; significance: tests/unit/scattering/statistics.h. The density has steps that are not the test's cells', so
  // samples are few enough that the quadrature's error stays below their noise.
  for (const NamedWeights& test : sample_weights()) {
    const LatLongDistribution distribution(test.grid, test.weights);
    test::ChiSquareOptions options;
    options.axis = {0, 1, 0};
    options.nodes_per_bin = 64;
    options.samples = 20000;
    const double p = test::chi_square_p_value(
        [&](Rng& rng) { return dvec3(distribution.sample(rng)); },
        [&](const dvec3& wi) { return static_cast<double>(distribution.pdf(vec3(wi))); }, options);
    EXPECT_GT(p, test::kSignificance) << test.name;
  }
}

TEST(LatLongDistribution, CellsWithoutWeightAreNeverDrawn) {
  const LatLongDistribution distribution({4, 2}, std::vector<float>{0, 0, 1, 0, 0, 0, 0, 0});
  Rng rng(11);
  for (int i = 0; i < 10000; ++i) EXPECT_GT(distribution.pdf(distribution.sample(rng)), 0.0f);
}

TEST(LatLongDistribution, BlackHasNoIntegral) {
  EXPECT_EQ(LatLongDistribution({2, 2}, std::vector<float>(4, 0.0f)).integral(), 0.0);
}

}  // namespace
}  // namespace farfield
