// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/asset_view.h"

#include <limits>

#include "base/embree.h"
#include "base/hash.h"
#include "base/parallel.h"
#include "base/random.h"
#include "base/result.h"
#include "path_tracer/camera.h"

namespace farfield {

struct AssetView::Impl {
  EmbreeDevice device;  // first: everything else lives on it
  std::unique_ptr<Runtime> runtime;
  EmbreeScene scene;
  AssetId asset{0};
};

AssetView::AssetView() : impl_(std::make_unique<Impl>()) {}
AssetView::~AssetView() = default;

Result<std::unique_ptr<AssetView>> AssetView::open(const std::filesystem::path& folder, float lambda,
                                                   uint64_t budget_bytes, Blend blend) {
  std::unique_ptr<AssetView> view(new AssetView);
  Impl& impl = *view->impl_;
  FARFIELD_TRY_LET(impl.device, make_embree_device(thread_count()));  // as many threads as parallel_for uses

  RuntimeOptions options;
  options.budget_bytes = budget_bytes;
  options.forced_lambda = lambda;
  options.blend = blend;
  FARFIELD_TRY_LET(auto runtime, Runtime::create(impl.device.get(), options));
  impl.runtime = std::move(runtime);

  FARFIELD_TRY_LET(const auto asset, impl.runtime->open_asset(folder.string()));
  impl.asset = asset;
  FARFIELD_TRY(impl.runtime->add_instance(asset, mat4x3(1.0f)));
  FARFIELD_TRY(impl.runtime->plan_frame());

  FARFIELD_TRY_LET(auto scene, make_scene(impl.device.get(), *impl.runtime));
  impl.scene = std::move(scene);
  return view;
}

Box3 AssetView::bounds() const {
  Box3 box;
  impl_->runtime->bounds(impl_->asset, box.lower, box.upper);
  return box;
}

const std::vector<LevelInfo>& AssetView::levels() const { return impl_->runtime->levels(impl_->asset); }

Stats AssetView::stats() const { return impl_->runtime->stats(); }

Result<ViewImages> AssetView::render(const ViewOptions& options, const Lights& lights, const Job& job) const {
  // Rays start outside of the asset, however far from its middle the view's centre is.
  const Box3 box = bounds();
  const float distance = glm::length(box.size()) + glm::length(options.center - box.center());
  const vec3 direction = glm::normalize(options.direction);
  const Camera camera = Camera::orthographic(options.center - distance * direction, direction, options.up,
                                             options.width_world, options.width, options.height);
  TraceOptions trace = options.trace;
  trace.transparent = true;
  Film film(options.width, options.height, {.half_buffers = true});
  const TraceScene scene{impl_->scene.get(), impl_->runtime.get(), &lights};
  FARFIELD_TRY(path_trace(scene, camera, trace, film, job));
  return ViewImages{select_channels(film.image(), {"R", "G", "B", "A"}), {film.half(0), film.half(1)}};
}

std::vector<float> AssetView::first_hits(std::span<const ProbeRay> rays, uint64_t seed) const {
  constexpr size_t kGrain = 1024;
  std::vector<float> distances(rays.size(), std::numeric_limits<float>::infinity());
  parallel_for(rays.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      Rng rng(mix64(seed, i));
      RayContext context;
      context.path_seed = rng.next_uint();
      context.ray_seed = rng.next_uint();
      EmbreeRayHit ray_hit = make_ray_hit(rays[i].origin, rays[i].direction);
      if (trace_nearest(impl_->scene.get(), context.embree, ray_hit)) distances[i] = ray_hit.ray.tfar;
    }
  });
  return distances;
}

}  // namespace farfield
