// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/pixel_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/bytes.h"
#include "path_tracer/frame_renderer.h"

namespace farfield {

namespace {

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
  const auto say = [&]<typename... Values>(fmt::format_string<const Values&...> text, const Values&... values) {
    why.push_back(fmt::format(text, values...));
  };
  if (visit.limits.finest > 0 || visit.limits.coarsest < LevelLimits().coarsest)
    say("its levels are held between {} and {}", visit.limits.finest, visit.limits.coarsest);
  if (asked.is_broken) say("level {} could not be loaded, or did not fit; see the warnings", asked.level);
  if (visit.level == of_visit.levels.front().level) say("nothing finer: it is the finest level that there is");
  if (visit.level < asked.level && !asked.is_planned && !asked.is_broken) {
    say("finer than asked: level {} is not in the plan, as it would cost rays more than level {}, or take memory for "
        "nothing",
        asked.level, visit.level);
  } else if (of_visit.levels_given_up > 0 && visit.planned_finest > asked.level) {
    say("nothing finer: the budget. Level {} is asked for, and the plan of {} begins at level {}; {} would do",
        asked.level, format_bytes(report.budget_bytes), visit.planned_finest, format_bytes(report.asked_bytes));
  } else if (visit.level > asked.level && !asked.is_planned) {
    say("coarser than asked: level {} does not pay, and the plan has level {} in its place", asked.level, visit.level);
  } else if (visit.level > of_visit.levels.front().level) {
    say("nothing finer is asked for: a pixel is {:.3g} wide there, and level {} serves from {:.3g} on{}",
        std::max(visit.camera_footprint, visit.ray_footprint), visit.level,
        std::ldexp(visit.level_0_footprint, static_cast<int>(visit.level)),
        visit.blend > 0 ? ", after having blended with the finer one" : "");
  }
  return why;
}

}  // namespace farfield
