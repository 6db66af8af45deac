// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/cryptomatte.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

namespace farfield {
namespace {

TEST(MurmurHash3, GivesThePublishedValues) {
  EXPECT_EQ(murmur_hash3(""), 0u);
  EXPECT_EQ(murmur_hash3("hello"), 0x248bfa47u);
  EXPECT_EQ(murmur_hash3("The quick brown fox jumps over the lazy dog"), 0x2e4ff723u);
}

// The numbers are those of the specification's sample images.
TEST(Cryptomatte, LayersAreFoundUnderTheFirstSevenDigitsOfTheirHash) {
  const Metadata metadata = cryptomatte_metadata("uCryptoAsset", {"bunny", "a \"quoted\" name"});
  EXPECT_EQ(std::get<std::string>(metadata.at("cryptomatte/d593dd7/name")), "uCryptoAsset");
  EXPECT_EQ(std::get<std::string>(metadata.at("cryptomatte/d593dd7/hash")), "MurmurHash3_32");
  EXPECT_EQ(std::get<std::string>(metadata.at("cryptomatte/d593dd7/conversion")), "uint32_to_float32");
  const auto manifest = nlohmann::json::parse(std::get<std::string>(metadata.at("cryptomatte/d593dd7/manifest")));
  EXPECT_EQ(manifest.size(), 2u);
  EXPECT_EQ(std::stoul(manifest["bunny"].get<std::string>(), nullptr, 16), cryptomatte_id("bunny"));
  EXPECT_EQ(manifest["bunny"].get<std::string>().size(), 8u);
  EXPECT_TRUE(manifest.contains("a \"quoted\" name"));
}

TEST(Cryptomatte, IdsAreOrdinaryFloats) {
  int changed = 0;
  for (int i = 0; i < 20000; ++i) {
    const std::string name = "tree " + std::to_string(i);
    const uint32_t id = cryptomatte_id(name);
    ASSERT_TRUE(std::isnormal(std::bit_cast<float>(id))) << name;
    changed += id != murmur_hash3(name);
  }
  EXPECT_GT(changed, 0);  // 2 in 256 hashes are none
  EXPECT_LT(changed, 400);
  EXPECT_NE(cryptomatte_id(""), 0u);  // whose hash is 0
}

TEST(Cryptomatte, ChannelsAreNumberedPairs) {
  const std::vector<std::string> channels = cryptomatte_channels("CryptoObject");
  ASSERT_EQ(channels.size(), 2 * kCryptomatteRanks);
  EXPECT_EQ(channels.front(), "CryptoObject00.R");
  EXPECT_EQ(channels[7], "CryptoObject01.A");
  EXPECT_EQ(channels.back(), "CryptoObject02.A");
}

TEST(IdCounts, RanksByCoverageAndCountsWhatIsNothing) {
  IdCounts counts;
  for (const uint32_t id : {7u, 9u, 0u, 9u, 5u, 0u, 0u, 0u}) counts.add(id);
  float pairs[2 * kCryptomatteRanks];
  counts.store_ranked(pairs);
  const auto id = [&](size_t rank) { return std::bit_cast<uint32_t>(pairs[2 * rank]); };
  EXPECT_EQ(id(0), 9u);
  EXPECT_EQ(pairs[1], 0.25f);
  EXPECT_EQ(id(1), 5u);  // equal: the smaller id first, whatever came first
  EXPECT_EQ(id(2), 7u);
  EXPECT_EQ(pairs[5], 0.125f);
  EXPECT_EQ(id(3), 0u);
  EXPECT_EQ(pairs[7], 0.0f);
}

TEST(IdCounts, KeepsTheLargestOfManyAndNothingOfNothing) {
  IdCounts many, none;
  for (uint32_t id = 1; id <= 20; ++id)
    for (uint32_t n = 0; n < id; ++n) many.add(id);
  float pairs[2 * kCryptomatteRanks];
  many.store_ranked(pairs);
  for (uint32_t rank = 0; rank < kCryptomatteRanks; ++rank)
    EXPECT_EQ(std::bit_cast<uint32_t>(pairs[2 * rank]), 20 - rank);
  none.store_ranked(pairs);
  for (const float value : pairs) EXPECT_EQ(value, 0.0f);
}

}  // namespace
}  // namespace farfield
