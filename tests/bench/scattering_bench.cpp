// SPDX-License-Identifier: Apache-2.0
// What does one evaluation, one density and one sample of each light model cost, against the plain isotropic phase
// function? And how often do the rejection samplers accept, against the bounds of the thesis?
// Results: docs/results/light.md. Every benchmark walks over 1024 random pairs of directions, so that no branch is
// learnt.
#include <benchmark/benchmark.h>

#include <string>
#include <vector>

#include "scattering/carlson.h"
#include "scattering/flake_phase.h"
#include "scattering/media/carlson_fast.h"
#include "scattering/media/lobe_fit.h"
#include "scattering/media/microflake_medium.h"
#include "scattering/sggx_codec.h"
#include "scattering/surface_bsdf.h"

namespace farfield {
namespace {

constexpr int kDirections = 1024;

struct Directions {
  std::vector<vec3> a, b;
  Directions() {
    Rng rng(1);
    for (int i = 0; i < kDirections; ++i) {
      a.push_back(uniform_sphere(rng.next(), rng.next()));
      b.push_back(uniform_sphere(rng.next(), rng.next()));
    }
  }
};

const Directions& directions() {
  static const Directions all;
  return all;
}

/// Times value(wo, wi, rng); a float or a vec3.
template <typename Value>
void run(benchmark::State& state, const Value& value) {
  const Directions& d = directions();
  Rng rng(2);
  int i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(value(d.a[i], d.b[i], rng));
    i = (i + 1) % kDirections;
  }
}

template <typename Value>
void add(const std::string& name, const Value& value) {
  benchmark::RegisterBenchmark(name.c_str(), [value](benchmark::State& state) { run(state, value); });
}

SymMat3 sggx(const vec3& eigenvalues) {
  const Frame frame(glm::normalize(vec3(1, 2, -0.5f)));
  return SymMat3::outer(frame.z) * eigenvalues.x + SymMat3::outer(frame.x) * eigenvalues.y +
         SymMat3::outer(frame.y) * eigenvalues.z;
}

LobeMixture mixture(int cosine, int sine) {
  const WeightedLobe<float> lobes[] = {{TrigLobe(LobeKind::Cosine, cosine, glm::normalize(vec3(1, 2, -0.5f))), 0.5f},
                                       {TrigLobe(LobeKind::Sine, sine, glm::normalize(vec3(-1, 0.3f, 2))), 0.3f},
                                       {TrigLobe(), 0.2f}};
  return LobeMixture(lobes);
}

void add_baseline() {
  add("isotropic/eval", [](const vec3& wo, const vec3&, Rng&) { return wo.x < 2 ? kInvPi / 4 : 0.0f; });
  add("isotropic/sample", [](const vec3&, const vec3&, Rng& rng) { return uniform_sphere(rng.next(), rng.next()); });
}

void add_sggx() {
  const Sggx flakes(sggx({1, 0.4f, 0.1f}));
  add("sggx/sigma", [=](const vec3& wo, const vec3&, Rng&) { return flakes.sigma(wo); });
  add("sggx/ndf", [=](const vec3& wo, const vec3&, Rng&) { return flakes.ndf(wo); });
  add("sggx/specular eval=pdf", [=](const vec3& wo, const vec3& wi, Rng&) { return flakes.specular_phase(wo, wi); });
  add("sggx/specular sample",
      [=](const vec3& wo, const vec3&, Rng& rng) { return flakes.sample_specular(wo, rng.next(), rng.next()); });
  add("sggx/visible normal",
      [=](const vec3& wo, const vec3&, Rng& rng) { return flakes.sample_visible(wo, rng.next(), rng.next()); });
  add("sggx/diffuse eval",
      [=](const vec3& wo, const vec3& wi, Rng& rng) { return flakes.diffuse_phase(wo, wi, rng.next(), rng.next()); });
  add("sggx/diffuse sample", [=](const vec3& wo, const vec3&, Rng& rng) {
    return flakes.sample_diffuse(wo, rng.next(), rng.next(), rng.next(), rng.next());
  });
  add("sggx/sample sigma", [=](const vec3&, const vec3&, Rng& rng) { return flakes.sample_sigma(rng); });
  add("sggx/cholesky", [](const vec3& wo, const vec3&, Rng&) { return cholesky(SymMat3::outer(wo)); });
}

void add_lobes() {
  for (const int n : {1, 3, 7, 13, 20}) {
    for (const LobeKind kind : {LobeKind::Cosine, LobeKind::Sine}) {
      const std::string name = (kind == LobeKind::Cosine ? "lobe cos " : "lobe sin ") + std::to_string(n);
      const TrigLobe lobe(kind, n, glm::normalize(vec3(1, 2, -0.5f)));
      add(name + "/sigma", [=](const vec3& wo, const vec3&, Rng&) { return lobe.sigma(wo); });
      add(name + "/visible normal",
          [=](const vec3& wo, const vec3&, Rng& rng) { return lobe.sample_visible(wo, rng); });
    }
  }
}

template <typename Medium>
void add_medium(const std::string& name, const Medium& medium) {
  add(name + "/sigma_t", [=](const vec3& wo, const vec3&, Rng&) { return medium.extinction(wo); });
  add(name + "/eval", [=](const vec3& wo, const vec3& wi, Rng&) { return medium.eval(wo, wi); });
  add(name + "/pdf", [=](const vec3& wo, const vec3& wi, Rng&) { return medium.pdf(wo, wi); });
  add(name + "/sample", [=](const vec3& wo, const vec3&, Rng& rng) { return medium.scatter(wo, rng).weight; });
}

void add_media() {
  const SymMat3 s = sggx({1, 0.4f, 0.1f}), shadowing = sggx({0.9f, 0.5f, 0.3f});
  add_medium("medium sggx, A = 1", BasicSggxMedium<float, false>(1, s, 1));
  add_medium("medium sggx, A = 0.6", SggxMedium(1, s, 0.6f));
  const LobeFit fit = fit_lobes(s);
  add_medium("medium lobes fitted, A = 1",
             BasicLobeMedium<float, false>(fit.rho_factor, fit.flakes, SymMat3::identity()));
  add_medium("medium lobes fitted, aniso A", LobeMedium(fit.rho_factor, fit.flakes, shadowing));
  add_medium("medium lobes 20+20+iso, A = 1", BasicLobeMedium<float, false>(1, mixture(20, 20), SymMat3::identity()));
  add_medium("medium lobes 20+20+iso, aniso A", LobeMedium(1, mixture(20, 20), shadowing));
}

/// Set up + one call: what a renderer pays per hit.
template <typename Bsdf>
void add_surface(const std::string& name, const SurfaceParams& p) {
  const vec3 n = glm::normalize(vec3(1, 2, -0.5f));
  const auto over = [n](const vec3& w) { return glm::dot(n, w) < 0 ? -w : w; };
  add(name + "/set up", [=](const vec3& wo, const vec3&, Rng&) { return Bsdf(p, n, over(wo)); });
  add(name + "/eval", [=](const vec3& wo, const vec3& wi, Rng&) { return Bsdf(p, n, over(wo)).eval(wi); });
  add(name + "/pdf", [=](const vec3& wo, const vec3& wi, Rng&) { return Bsdf(p, n, over(wo)).pdf(wi); });
  add(name + "/sample", [=](const vec3& wo, const vec3&, Rng& rng) { return Bsdf(p, n, over(wo)).sample(rng); });
}

void add_surfaces() {
  SurfaceParams p;
  p.diffuse = vec3(0.5f);
  add_surface<SurfaceModel<kDiffuse>>("surface diffuse, trimmed", p);
  add_surface<SurfaceBsdf>("surface diffuse, full model", p);
  SurfaceParams plastic = p;
  plastic.specular = vec3(0.04f), plastic.roughness2 = 0.1f;
  add_surface<SurfaceModel<kDiffuse | kSpecular>>("surface plastic, trimmed", plastic);
  add_surface<SurfaceBsdf>("surface plastic, full model", plastic);
  plastic.transmission = vec3(0.2f);
  add_surface<SurfaceBsdf>("surface plastic leaf, full model", plastic);
}

template <typename Phase>
void add_flakes(const std::string& name, const FlakeParams& p) {
  add(name + "/set up", [=](const vec3& wo, const vec3&, Rng&) { return Phase(p, wo); });
  add(name + "/eval", [=](const vec3& wo, const vec3& wi, Rng& rng) { return Phase(p, wo).eval(wi, rng); });
  add(name + "/pdf", [=](const vec3& wo, const vec3& wi, Rng&) { return Phase(p, wo).pdf(wi); });
  add(name + "/sample", [=](const vec3& wo, const vec3&, Rng& rng) { return Phase(p, wo).sample(rng); });
}

void add_all_flakes() {
  FlakeParams p;
  p.sggx = sggx({1, 0.4f, 0.1f}), p.diffuse = vec3(0.5f);
  add_flakes<FlakeModel<kDiffuse>>("flakes diffuse, trimmed", p);
  add_flakes<FlakePhase>("flakes diffuse, full model", p);
  p.transmission = vec3(0.3f);
  add_flakes<FlakeModel<kDiffuse | kTransmission>>("flakes leaf, trimmed", p);
  p.specular = vec3(0.04f), p.roughness2 = 0.2f, p.self_shadowing = 0.6f;
  add_flakes<FlakePhase>("flakes glossy leaf, A = 0.6, full model", p);
}

void add_helpers() {
  add("R_G/exact, double", [](const vec3& wo, const vec3&, Rng&) {
    return carlson_rg(1.0, double(std::abs(wo.x)), double(std::abs(wo.y)));
  });
  add("R_G/exact, float",
      [](const vec3& wo, const vec3&, Rng&) { return carlson_rg(1.0f, std::abs(wo.x), std::abs(wo.y)); });
  add("R_G/fast", [](const vec3& wo, const vec3&, Rng&) { return carlson_rg_fast(1, std::abs(wo.x), std::abs(wo.y)); });
  add("eigenvalues",
      [](const vec3& wo, const vec3& wi, Rng&) { return eigenvalues(SymMat3::outer(wo) + SymMat3::outer(wi) * 0.5f); });
  add("codec 6 bytes/pack", [](const vec3& wo, const vec3& wi, Rng&) {
    return pack_flake_sggx(SymMat3::outer(wo) + SymMat3::outer(wi) * 0.5f);
  });
  const PackedFlakeSggx packed = pack_flake_sggx(sggx({1, 0.4f, 0.1f}));
  add("codec 6 bytes/unpack", [=](const vec3&, const vec3&, Rng&) {
    PackedFlakeSggx copy = packed;
    benchmark::DoNotOptimize(copy);
    return unpack(copy);
  });
  add("fit lobes", [](const vec3& wo, const vec3& wi, Rng&) {
    return fit_lobes(SymMat3::outer(wo) + SymMat3::outer(wi) * 0.5f).rms_error;
  });
}

// Acceptance rates have closed forms: the integral of the density over that of its bound. Reported as counters of a
// benchmark that computes them, over exponents and directions, or over shapes.
struct Range {
  double lowest = 1, sum = 0;
  int count = 0;
  void add(double x) { lowest = std::min(lowest, x), sum += x, ++count; }
};

void report(benchmark::State& state, const Range& ours, const Range& thesis) {
  for (auto _ : state) {
  }
  state.counters["min"] = ours.lowest, state.counters["mean"] = ours.sum / ours.count;
  state.counters["thesis_min"] = thesis.lowest, state.counters["thesis_mean"] = thesis.sum / thesis.count;
}

void add_acceptance() {
  for (const LobeKind kind : {LobeKind::Cosine, LobeKind::Sine}) {
    const std::string name = kind == LobeKind::Cosine ? "cos" : "sin";
    benchmark::RegisterBenchmark(("acceptance/visible normals " + name).c_str(), [kind](benchmark::State& state) {
      Range ours, thesis;
      for (int n = 1; n <= kLargestLobeExponent; ++n) {
        const BasicTrigLobe<double> lobe(kind, n, dvec3(0, 0, 1));
        const double e = kind == LobeKind::Cosine ? (2 * n + 1) / (2.0 * n + 3) : 1 / (2.0 * n + 3);
        for (int i = 0; i <= 100; ++i) {
          const double t = i / 100.0, c2 = t * t * e + (1 - t * t) * (1 - e) / 2;
          const double sigma = lobe.sigma(dvec3(std::sqrt(1 - t * t), 0, t));
          ours.add(2 * sigma / std::sqrt(c2)), thesis.add(2 * sigma / (c2 + 0.25));
        }
      }
      report(state, ours, thesis);
    });
  }
  benchmark::RegisterBenchmark("acceptance/sigma of sggx", [](benchmark::State& state) {
    Range ours, thesis;
    for (int i = 0; i <= 40; ++i) {
      for (int j = 0; j <= i; ++j) {
        const double y = std::pow(i / 40.0, 3), z = std::pow(j / 40.0, 3), mean = (1 + y + z) / 3;
        const double rg = carlson_rg(1.0, y, z);
        ours.add(rg / std::sqrt(mean)), thesis.add(rg / (mean + 0.25));
      }
    }
    report(state, ours, thesis);
  });
  benchmark::RegisterBenchmark("acceptance/f_ss and f_ms of lobes", [](benchmark::State& state) {
    // f_ss: ours draws the event itself and rejects nothing but in the visible normals; the thesis's 13.2.50 accepts
    // Q / (P A_max). f_ms: the same rate in both.
    Range single_thesis, multiple;
    Rng rng(3);
    for (int i = 0; i < 1000; ++i) {
      const LobeMixture flakes = mixture(1 + int(rng.next() * 20), 1 + int(rng.next() * 20));
      const Frame frame(uniform_sphere(rng.next(), rng.next()));
      const SymMat3 a = SymMat3::outer(frame.x) * (0.01f + 0.99f * rng.next()) +
                        SymMat3::outer(frame.y) * (0.01f + 0.99f * rng.next()) +
                        SymMat3::outer(frame.z) * (0.01f + 0.99f * rng.next());
      const dvec3 range = eigenvalues(a);
      const vec3 w = uniform_sphere(rng.next(), rng.next());
      single_thesis.add(flakes.shadowed_sigma(w, a) / (flakes.sigma(w) * range.x));
      const double b = flakes.integral_shadowed(a, SymMat3::identity() + a * -1.0f);
      multiple.add(b / (kPiOf<double> * range.x * (1 - range.z)));
    }
    for (auto _ : state) {
    }
    state.counters["f_ss_thesis_min"] = single_thesis.lowest;
    state.counters["f_ss_thesis_mean"] = single_thesis.sum / single_thesis.count;
    state.counters["f_ms_min"] = multiple.lowest, state.counters["f_ms_mean"] = multiple.sum / multiple.count;
  });
}

}  // namespace
}  // namespace farfield

int main(int argc, char** argv) {
  using namespace farfield;
  add_baseline();
  add_sggx();
  add_lobes();
  add_media();
  add_surfaces();
  add_all_flakes();
  add_helpers();
  add_acceptance();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
