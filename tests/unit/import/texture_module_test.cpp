// SPDX-License-Identifier: Apache-2.0
#include "base/texture_module.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <thread>

#include "base/module_loader.h"
#include "import/texture.h"
#include "tests/support/files.h"
#include "tests/support/png_files.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

std::string failure_of(const std::vector<fs::path>& folders) {
  const auto module = load_texture_module(folders);
  if (module) return "";
  EXPECT_EQ(module.error().code, ErrorCode::Io);
  EXPECT_NE(module.error().message.find("FARFIELD_MODULE_DIR"), std::string::npos) << module.error().message;
  return module.error().message;
}

TEST(TextureModule, AMissingOneIsAnErrorThatNamesEveryPlace) {
  const test::TemporaryFolder folder;
  const std::string message = failure_of({folder.path() / "one", folder.path() / "two"});
  for (const char* place : {"one/farfield_textures.so", "two/farfield_textures.so"})
    EXPECT_NE(message.find((folder.path() / place).string()), std::string::npos) << message;
  EXPECT_NE(failure_of({}), "");
}

TEST(TextureModule, OneThatDoesNotLoadIsAnErrorAndNotPassedOver) {
  const test::TemporaryFolder folder;
  const fs::path broken = folder.write("farfield_textures.so", "not a library");
  EXPECT_NE(failure_of({folder.path(), FARFIELD_TEXTURE_MODULE_FOLDER}).find(broken.string()), std::string::npos);
}

TEST(TextureModule, ALibraryWithoutTheEntryIsOfAnotherVersion) {
  const test::TemporaryFolder folder;
  fs::copy_file(FARFIELD_OTHER_LIBRARY, folder.path() / "farfield_textures.so");
  EXPECT_NE(failure_of({folder.path()}).find("version"), std::string::npos);
}

TEST(TextureModule, TheBuildTreeHasItWhereItIsLookedFor) {
  const std::vector<fs::path> folders = module_folders();
  EXPECT_NE(std::find(folders.begin(), folders.end(), fs::path(FARFIELD_TEXTURE_MODULE_FOLDER)), folders.end());
}

TEST(TextureModule, TheVariableReplacesThePlaces) {
  setenv("FARFIELD_MODULE_DIR", "/some/where", 1);
  EXPECT_EQ(module_folders(), std::vector<fs::path>{"/some/where"});
  setenv("FARFIELD_MODULE_DIR", "", 1);
  EXPECT_GT(module_folders().size(), 1u);
  unsetenv("FARFIELD_MODULE_DIR");
}

TEST(TextureModule, ThreadsThatReadTheFirstImageTogetherAllGetIt) {
  const std::string bytes = test::png(2, 1, {{255, 0, 0, 255}, {0, 0, 255, 255}});
  const std::span<const unsigned char> view(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  std::vector<std::string> wrong(8);
  std::vector<std::thread> threads;
  for (std::string& mine : wrong) {
    threads.emplace_back([&mine, view] {
      const auto texture = decode_texture(view, "red and blue", TextureUse::Data);
      if (!texture)
        mine = texture.error().message;
      else if (texture->texel(texture->level(0), 0, 0) != vec4(1, 0, 0, 1) || texture->width() != 2)
        mine = "not the texels of the file";
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, std::vector<std::string>(8));
}

}  // namespace
}  // namespace farfield
