// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/pixel_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/bytes.h"
#include "path_tracer/frame_renderer.h"

namespace farfield {

namespace {

const PixelLevel* find_level(const PixelVisit& visit, uint32_t level) {
  const auto found = std::ranges::find(visit.levels, level, &PixelLevel::level);
  return found != visit.levels.end() ? &*found : nullptr;
}

/// The coarsest stored level that is as fine as asked, or the finest that there is.
const PixelLevel& asked_level(const PixelVisit& visit) {
  const PixelLevel* asked = &visit.levels.front();
  for (const PixelLevel& level : visit.levels)
    if (static_cast<float>(level.level) <= visit.visit.asked_lambda) asked = &level;
  return *asked;
}

}  // namespace

Result<PixelReport> explain_pixel(const RenderOptions& options, int frame, int x, int y) {
  if (x < 0 || y < 0 || x >= options.width || y >= options.height)
    return make_error(
        ErrorCode::InvalidArgument,
        fmt::format("pixel {},{} is not in a picture of {}x{}: --size says it", x, y, options.width, options.height));
  FARFIELD_TRY_LET(const auto renderer, FrameRenderer::prepare(options));
  return renderer->explain(frame, x, y);
}

std::vector<std::string> reasons(const PixelVisit& of_visit, const PixelReport& report) {
  const RayVisit& visit = of_visit.visit;
  const PixelLevel& asked = asked_level(of_visit);
  std::vector<std::string> why;
  if (visit.level == of_visit.levels.front().level) why.push_back("it is the finest level that there is");
  if (visit.limits.finest > 0 || visit.limits.coarsest < LevelLimits().coarsest)
    why.push_back(fmt::format("its levels are held between {} and {}", visit.limits.finest, visit.limits.coarsest));
  if (of_visit.levels_given_up > 0 && visit.planned_finest > asked.level) {
    why.push_back(fmt::format(
        "the budget: level {} is asked for, and the plan of {} begins at level {}; a budget of {} would do",
        asked.level, format_bytes(report.budget_bytes), visit.planned_finest, format_bytes(report.asked_bytes)));
  } else if (visit.level > asked.level && visit.level == visit.planned_finest) {
    why.push_back(fmt::format("level {} does not pay: the plan has level {} in its place", asked.level, visit.level));
  }
  if (asked.is_broken)
    why.push_back(fmt::format("level {} could not be loaded, or did not fit; see the warnings", asked.level));
  if (visit.level > of_visit.levels.front().level && visit.level <= asked.level) {
    const PixelLevel* level = find_level(of_visit, visit.level);
    why.push_back(fmt::format("none is asked for: a pixel is {:.3g} wide there, and level {} serves from {:.3g} on",
                              std::max(visit.camera_footprint, visit.ray_footprint), visit.level,
                              level ? level->footprint : 0.0f));
  }
  return why;
}

}  // namespace farfield
