// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "base/result.h"
#include "import/gltf_scene.h"
#include "path_tracer/scene_setup.h"
#include "tools/commands.h"
#include "tools/console.h"
#include "tools/flags.h"

namespace farfield::tool {
namespace {

struct SkyArguments {
  std::string scene, output;
  int width = 2048;
};

Result<void> run_sky(const SkyArguments& arguments) {
  FARFIELD_TRY(check_can_write(arguments.output, Output::Exr, {arguments.scene}));
  GltfScene scene;
  if (!arguments.scene.empty()) {
    FARFIELD_TRY_LET(auto read, read_gltf_scene(arguments.scene));
    scene = std::move(read);
  }
  std::vector<std::string> warnings = scene.warnings;
  FARFIELD_TRY_LET(const auto lights, make_lights(scene, {}, warnings));
  print_warnings("sky", warnings);
  return write_exr(arguments.output, lights.environment.to_image(arguments.width));
}

}  // namespace

void add_sky_command(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<SkyArguments>();
  CLI::App* command =
      app.add_subcommand("sky", "Write the sun and sky that light a scene as a picture, for other renderers");
  command->add_option("scene", arguments->scene, "glTF scene whose sun it is. Without it the default sun")
      ->check(is_named);
  command->add_option("-o,--output", arguments->output, "EXR to write: latitude-longitude, +y up, -z in the middle")
      ->required()
      ->check(is_named);
  command->add_option("--width", arguments->width, "Pixels; half as many rows")
      ->check(CLI::Range(2, 1 << 14))
      ->capture_default_str();
  command->footer("Example:\n  farfield sky forest.glb -o sky.exr");
  command->callback([arguments, &action] { action = [arguments] { return run_sky(*arguments); }; });
}

}  // namespace farfield::tool
