// SPDX-License-Identifier: Apache-2.0
#include "lodselect/footprint.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

#include "base/nonfinite.h"
#include "base/random.h"

namespace farfield {
namespace {

TEST(LambdaOfFootprint, IsExactAtTheResolutionOfEachLevel) {
  for (const float base : {0.37f, 1.0f, 1e-20f, 12345.678f}) {
    for (int k = 0; k <= 40; ++k) EXPECT_EQ(lambda_of_footprint(std::ldexp(base, k), base, 64), static_cast<float>(k));
  }
}

TEST(LambdaOfFootprint, NeverDecreasesAlongAllFloatsOfAnOctave) {
  float previous = 0;
  for (uint32_t bits = std::bit_cast<uint32_t>(1.0f); bits <= std::bit_cast<uint32_t>(2.0f); ++bits) {
    const float lambda = lambda_of_footprint(std::bit_cast<float>(bits), 1.0f, 8);
    ASSERT_GE(lambda, previous) << std::bit_cast<float>(bits);
    ASSERT_LE(lambda, 1.0f);
    previous = lambda;
  }
  EXPECT_EQ(previous, 1.0f);
}

TEST(LambdaOfFootprint, NeverDecreasesAcrossAllMagnitudes) {
  float previous = 0;
  for (uint32_t bits = 0; bits < std::bit_cast<uint32_t>(kInfinity); bits += 9973) {
    const float lambda = lambda_of_footprint(std::bit_cast<float>(bits), 0.37f, 200);
    ASSERT_GE(lambda, previous) << std::bit_cast<float>(bits);
    previous = lambda;
  }
}

TEST(LambdaOfFootprint, AgreesWithTheLogarithmInDouble) {
  Rng rng(3);
  for (int i = 0; i < 10000; ++i) {
    const float base = 0.01f + rng.next();
    const float footprint = base * std::exp2(10.0f * rng.next());
    EXPECT_NEAR(lambda_of_footprint(footprint, base, 64), std::log2(static_cast<double>(footprint) / base), 2e-6);
  }
}

TEST(LambdaOfFootprint, SendsOddFootprintsToTheEnds) {
  EXPECT_EQ(lambda_of_footprint(0.0f, 1.0f, 5), 0.0f);
  EXPECT_EQ(lambda_of_footprint(-3.0f, 1.0f, 5), 0.0f);
  EXPECT_EQ(lambda_of_footprint(kNan, 1.0f, 5), 0.0f);
  EXPECT_EQ(lambda_of_footprint(1.0f, kNan, 5), 0.0f);
  EXPECT_EQ(lambda_of_footprint(std::numeric_limits<float>::denorm_min(), 1.0f, 5), 0.0f);
  EXPECT_EQ(lambda_of_footprint(kInfinity, 1.0f, 5), 5.0f);
  EXPECT_EQ(lambda_of_footprint(3e38f, 1e-40f, 5), 5.0f);
  EXPECT_EQ(lambda_of_footprint(1.0f, 0.0f, 5), 5.0f);
  EXPECT_EQ(lambda_of_footprint(100.0f, 1.0f, 0), 0.0f);
  EXPECT_EQ(lambda_of_footprint(100.0f, 1.0f, -1), 0.0f);
}

TEST(SplitLambda, GivesIntegersExactly) {
  for (int k = 0; k < 64; ++k) {
    const LevelBlend split = split_lambda(static_cast<float>(k));
    EXPECT_EQ(split.level, k);
    EXPECT_EQ(split.blend, 0.0f);
  }
}

TEST(SplitLambda, PartsAddUpAndTheBlendStaysBelowOne) {
  for (float lambda = 0.0f; lambda < 70.0f; lambda = std::nextafter(lambda * 1.001f, kInfinity)) {
    const LevelBlend split = split_lambda(lambda);
    ASSERT_EQ(static_cast<float>(split.level) + split.blend, lambda);
    ASSERT_GE(split.blend, 0.0f);
    ASSERT_LT(split.blend, 1.0f);
  }
  const LevelBlend below = split_lambda(std::nextafter(3.0f, 0.0f));
  EXPECT_EQ(below.level, 2);
  EXPECT_LT(below.blend, 1.0f);
}

TEST(SplitLambda, SendsNanAndNegativeValuesToTheFinestLevelAndSurvivesInfinity) {
  for (const float lambda : {kNan, -1.0f, -kInfinity, -0.0f}) {
    EXPECT_EQ(split_lambda(lambda).level, 0);
    EXPECT_EQ(split_lambda(lambda).blend, 0.0f);
  }
  EXPECT_EQ(split_lambda(kInfinity).level, 1000000);
  EXPECT_EQ(split_lambda(kInfinity).blend, 0.0f);
}

TEST(FinestFootprint, IsThatOfTheNearestPointOfTheBox) {
  const Box3 box{vec3(-1.0f), vec3(1.0f)};
  const auto at = [&](vec3 position) {
    const TessellationCamera camera{position, 0.0f, 0.01f};
    return finest_footprint(std::span(&camera, 1), box);
  };
  EXPECT_FLOAT_EQ(at({11.0f, 0.5f, 0.5f}), 0.1f);   // a face
  EXPECT_FLOAT_EQ(at({4.0f, -5.0f, 0.0f}), 0.05f);  // an edge
  EXPECT_FLOAT_EQ(at({3.0f, 3.0f, 2.0f}), 0.03f);   // a corner
  EXPECT_EQ(at({0.0f, 0.5f, 1.0f}), 0.0f);          // inside
}

TEST(FinestFootprint, IsNeverAboveTheFootprintOfAnyPointOfTheBox) {
  Rng rng(4);
  const auto point = [&] { return vec3(rng.next(), rng.next(), rng.next()) * 20.0f - 10.0f; };
  for (int i = 0; i < 1000; ++i) {
    Box3 box;
    box.extend(point());
    box.extend(point());
    const std::array cameras = {TessellationCamera{point(), 0.001f, 0.01f}, TessellationCamera{point(), 0.01f, 0.0f}};
    const float finest = finest_footprint(cameras, box);
    for (int j = 0; j < 100; ++j) {
      const vec3 inside = box.lower + box.size() * vec3(rng.next(), rng.next(), rng.next());
      for (const TessellationCamera& camera : cameras) {
        const float there = camera.pixel_width + camera.pixel_spread * glm::length(inside - camera.position);
        ASSERT_LE(finest, there * 1.00001f);
      }
    }
  }
}

TEST(FinestFootprint, TakesTheFinestOfTheCamerasAndInfinityWithoutAny) {
  const Box3 box{vec3(-1.0f), vec3(1.0f)};
  const std::array cameras = {TessellationCamera{{101.0f, 0.0f, 0.0f}, 0.0f, 0.01f},
                              TessellationCamera{{}, 0.5f, 0.0f}};
  EXPECT_FLOAT_EQ(finest_footprint(cameras, box), 0.5f);
  EXPECT_EQ(finest_footprint({}, box), kInfinity);
  EXPECT_EQ(finest_footprint(cameras, Box3{}), kInfinity);
}

TEST(FinestFootprint, AsksForTheFinestLevelWhenSomethingIsNan) {
  const Box3 box{vec3(-1.0f), vec3(1.0f)};
  const std::array cameras = {TessellationCamera{{kNan, 0.0f, 0.0f}, 0.0f, 0.01f},
                              TessellationCamera{{5.0f, 0.0f, 0.0f}, 0.0f, 0.01f}};
  EXPECT_EQ(finest_footprint(cameras, box), 0.0f);
  EXPECT_EQ(finest_footprint(std::span(cameras).last(1), Box3{vec3(kNan), vec3(1.0f)}), 0.0f);
}

TEST(FinestFootprint, SurvivesHugeDistances) {
  const TessellationCamera camera{{1e30f, 0.0f, 0.0f}, 0.0f, 0.01f};
  EXPECT_FLOAT_EQ(finest_footprint(std::span(&camera, 1), Box3{vec3(-1.0f), vec3(1.0f)}), 1e28f);
  const TessellationCamera far{{3e38f, 0.0f, 0.0f}, 0.0f, 1000.0f};
  EXPECT_EQ(finest_footprint(std::span(&far, 1), Box3{vec3(-1.0f), vec3(1.0f)}), kInfinity);
}

TEST(CoveredPixels, AreThoseOfTheMiddleAndOfTheSlant) {
  const TessellationCamera camera{vec3(0.0f), 0.0f, 0.01f};
  const auto of = [&](const Box3& box) { return covered_pixels(std::span(&camera, 1), box); };
  EXPECT_NEAR(of({vec3(-1, -1, 99), vec3(1, 1, 101)}), 4, 0.01);  // pixels of 1 x 1, a cube of 2 x 2
  const Box3 below{vec3(-100, -2, -100), vec3(100, -1, 100)}, ahead{vec3(200, -2, -100), vec3(400, -1, 100)};
  EXPECT_GT(of(below), 100 * of(ahead)) << "a ground ahead is seen at a slant";
  EXPECT_NEAR(of(ahead), (200 * 200 * (1.5 / 300) + 200) / 9, 0.5);
  EXPECT_GT(of({vec3(-1e9f), vec3(1e9f)}), 0) << "all around the camera";
  EXPECT_EQ(of(Box3()), 0);
  EXPECT_EQ(covered_pixels({}, below), 0);
  EXPECT_EQ(of({vec3(1), vec3(1)}), 0) << "a point";
}

TEST(CoveredPixels, OfTheCameraThatSeesMost) {
  const TessellationCamera cameras[] = {{vec3(0, 0, 1000), 0, 0.01f}, {vec3(0, 0, 10), 0, 0.01f}, {vec3(0), 0.5f, 0}};
  const Box3 box{vec3(-1), vec3(1)};
  EXPECT_NEAR(covered_pixels(std::span(cameras, 1), box), 0.04, 0.001);
  EXPECT_NEAR(covered_pixels(std::span(cameras, 2), box), 400, 1);
  EXPECT_EQ(covered_pixels(std::span(cameras + 2, 1), box), 48) << "orthographic: at most so many";
  const TessellationCamera points{vec3(0), 0, 0};
  EXPECT_EQ(covered_pixels(std::span(&points, 1), box), INFINITY);
}

TEST(TessellationCamera, AsksForLessOfWhatItDoesNotSee) {
  auto perspective = TessellationCamera::perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 1.5707963f, 200, 100);
  auto orthographic = TessellationCamera::orthographic({0, 0, 0}, {0, 0, -2}, {0, 1, 0}, 4.0f, 200, 100);
  EXPECT_FLOAT_EQ(perspective.pixel_spread, 0.02f);
  EXPECT_FLOAT_EQ(orthographic.pixel_width, 0.02f);
  for (TessellationCamera* camera : {&perspective, &orthographic}) camera->off_screen_scale = 4.0f;
  const auto scale = [](const TessellationCamera& camera, const vec3& center) {
    const Box3 box{center - 0.25f, center + 0.25f};
    TessellationCamera plain = camera;
    plain.off_screen_scale = 1.0f;
    return finest_footprint(std::span(&camera, 1), box) / finest_footprint(std::span(&plain, 1), box);
  };
  // At a distance of 10 the perspective one sees from -20 to 20 and from -10 to 10, the other one from -2 to 2 and from
  // -1 to 1.
  EXPECT_FLOAT_EQ(scale(perspective, {0, 0, -10}), 1.0f);
  EXPECT_FLOAT_EQ(scale(perspective, {19.5f, 0, -10}), 1.0f);
  EXPECT_FLOAT_EQ(scale(perspective, {21, 0, -10}), 4.0f);
  EXPECT_FLOAT_EQ(scale(perspective, {-21, 0, -10}), 4.0f);
  EXPECT_FLOAT_EQ(scale(perspective, {0, 11, -10}), 4.0f);
  EXPECT_FLOAT_EQ(scale(perspective, {0, -11, -10}), 4.0f);
  EXPECT_FLOAT_EQ(scale(perspective, {0, 0, 10}), 4.0f);
  EXPECT_FLOAT_EQ(scale(perspective, {20.1f, 0, -10}), 1.0f);  // its border is inside
  EXPECT_FLOAT_EQ(scale(orthographic, {1.5f, 0, -10}), 1.0f);
  EXPECT_FLOAT_EQ(scale(orthographic, {2.5f, 0, -10}), 4.0f);
  EXPECT_FLOAT_EQ(scale(orthographic, {0, -1.5f, -10}), 4.0f);
  EXPECT_FLOAT_EQ(scale(orthographic, {0, 0, 1}), 4.0f);
}

TEST(TessellationCamera, WithoutAFrustumSeesAllAround) {
  const TessellationCamera camera{vec3(0.0f), 0.0f, 0.01f, 8.0f};
  EXPECT_FLOAT_EQ(finest_footprint(std::span(&camera, 1), Box3{vec3(9, 0, 0), vec3(10, 0, 0)}), 0.09f);
}

}  // namespace
}  // namespace farfield
