// SPDX-License-Identifier: Apache-2.0
#include "import/subdivision_options.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>

#include "import/read_source.h"
#include "tests/support/files.h"

namespace farfield {
namespace {

SubdivisionOptions catmull_clark() {
  SubdivisionOptions options;
  options.scheme = SubdivisionScheme::CatmullClark;
  return options;
}

TEST(SubdivisionOptions, NamesAreReadAsTheyAreWritten) {
  for (const auto scheme : {SubdivisionScheme::None, SubdivisionScheme::CatmullClark, SubdivisionScheme::Loop})
    EXPECT_EQ(parse_subdivision_scheme(name_of(scheme)).value(), scheme);
  for (const auto boundary : {CageBoundary::EdgeAndCorner, CageBoundary::EdgeOnly})
    EXPECT_EQ(parse_cage_boundary(name_of(boundary)).value(), boundary);
  for (const auto uv :
       {CageUv::None, CageUv::CornersOnly, CageUv::CornersPlus1, CageUv::CornersPlus2, CageUv::Boundaries, CageUv::All})
    EXPECT_EQ(parse_cage_uv(name_of(uv)).value(), uv);
  EXPECT_NE(parse_subdivision_scheme("catmark").error().message.find("catmull-clark, loop"), std::string::npos);
  EXPECT_FALSE(parse_cage_boundary(""));
  EXPECT_FALSE(parse_cage_uv("linear"));
}

void expect_all_differ(const std::vector<SubdivisionOptions>& all) {
  std::set<std::string> texts;
  std::set<uint64_t> hashes;
  for (const SubdivisionOptions& options : all) {
    texts.insert(canonical_text(options));
    hashes.insert(hash_of(options));
  }
  EXPECT_EQ(texts.size(), all.size());
  EXPECT_EQ(hashes.size(), all.size());
}

TEST(SubdivisionOptions, EachHasItsOwnTextAndHash) {
  std::vector<SubdivisionOptions> all(6, catmull_clark());
  all[1].scheme = SubdivisionScheme::Loop;
  all[2].error = 1;
  all[3].edge = 1;
  all[4].boundary = CageBoundary::EdgeOnly;
  all[5].uv = CageUv::All;
  expect_all_differ(all);
  SubdivisionOptions finer = catmull_clark();
  finer.grid = 64;  // which is no part of what the source is, but of what the bake makes of it
  EXPECT_NE(canonical_text(finer), canonical_text(catmull_clark()));
  EXPECT_EQ(hash_of(finer), hash_of(catmull_clark()));
}

TEST(SubdivisionOptions, WithoutSchemeAndAllAsUsualSourcesKeepTheirHash) {
  SubdivisionOptions options;
  options.grid = 64;
  EXPECT_EQ(canonical_text(options), "");
  EXPECT_EQ(hash_of(options), 0u);
  const test::TemporaryFolder folder;
  const auto file = folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  ImportOptions plain, cage;
  cage.subdivision = catmull_clark();
  EXPECT_NE(read_source(file, plain)->source_hash, read_source(file, cage)->source_hash);
  EXPECT_EQ(*hash_source(file, {}, cage), read_source(file, cage)->source_hash);
  cage.subdivision = options;
  EXPECT_EQ(read_source(file, plain)->source_hash, read_source(file, cage)->source_hash);
}

/// Meshes may say their own scheme, and displaced ones need none.
TEST(SubdivisionOptions, WithoutSchemeTheyAreHeardAllTheSame) {
  std::vector<SubdivisionOptions> all(6);
  all[0].error = 1;
  all[1].detail = 0.5;
  all[2].displace = false;
  all[3].edge = 2;
  all[4].boundary = CageBoundary::EdgeOnly;
  expect_all_differ(all);
  SubdivisionOptions bad;
  bad.detail = 0;
  EXPECT_FALSE(check_options(bad));
}

}  // namespace
}  // namespace farfield
