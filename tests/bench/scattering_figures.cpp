// SPDX-License-Identifier: Apache-2.0
// Writes the numbers behind the figures of docs/results/light.md as CSV files into a folder; scripts/plot_light.py
// draws them. usage: scattering_figures FOLDER
#include <cstdio>
#include <fstream>
#include <string>

#include "scattering/carlson.h"
#include "scattering/flake_phase.h"
#include "scattering/media/carlson_fast.h"
#include "scattering/media/lobe_fit.h"
#include "scattering/media/microflake_medium.h"
#include "scattering/sggx_codec.h"
#include "scattering/surface_bsdf.h"

namespace farfield {
namespace {

SymMat3 random_sggx(Rng& rng, double middle, double smallest) {
  const Frame frame(uniform_sphere(rng.next(), rng.next()));
  return SymMat3::outer(frame.z) + SymMat3::outer(frame.x) * float(middle) + SymMat3::outer(frame.y) * float(smallest);
}

/// Error of sigma after packing, by smallest eigenvalue, for needles (1, e, e) and disks (1, 1, e): mean and maximum
/// over orientations and directions.
void write_codec(const std::string& folder) {
  std::ofstream out(folder + "/codec.csv");
  out << "shape,smallest,bytes,mean,max\n";
  Rng rng(1);
  for (const bool needle : {true, false}) {
    for (double exponent = -6; exponent <= 0; exponent += 0.25) {
      const double e = std::pow(10, exponent);
      double sum[2] = {0, 0}, worst[2] = {0, 0};
      constexpr int count = 4000, per_matrix = 20;
      for (int i = 0; i < count; ++i) {
        const SymMat3 s = random_sggx(rng, needle ? e : 1, e);
        const SymMat3 packed[2] = {unpack(pack_flake_sggx(s)), unpack(pack_surface_sggx(s))};
        const BasicSggx<double> exact(s);
        for (int b = 0; b < 2; ++b) {
          const BasicSggx<double> decoded(packed[b]);
          for (int k = 0; k < per_matrix; ++k) {
            const dvec3 w = uniform_sphere(double(rng.next()), double(rng.next()));
            const double error = std::abs(decoded.sigma(w) - exact.sigma(w));
            sum[b] += error, worst[b] = std::max(worst[b], error);
          }
        }
      }
      for (int b = 0; b < 2; ++b) {
        out << (needle ? "needle" : "disk") << ',' << e << ',' << (b == 0 ? 6 : 12) << ','
            << sum[b] / (count * per_matrix) << ',' << worst[b] << '\n';
      }
    }
  }
}

/// Relative error of the fast fit of R_G over the ratios of eigenvalues (square roots on the axes).
void write_rg(const std::string& folder) {
  std::ofstream out(folder + "/rg.csv");
  out << "p,q,error\n";
  constexpr int n = 100;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) {
      const double p = double(i) / n, q = double(j) / n;
      const double exact = carlson_rg(1.0, p * p, q * q);
      out << p << ',' << q << ',' << carlson_rg_fast(1, float(p * p), float(q * q)) / exact - 1 << '\n';
    }
  }
}

/// Any function of a direction on a longitude-latitude grid.
template <typename Value>
void write_map(const std::string& path, const Value& value) {
  std::ofstream out(path);
  constexpr int rows = 128;
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < 2 * rows; ++j) {
      const double theta = kPiOf<double> * (i + 0.5) / rows, phi = kPiOf<double> * (j + 0.5) / rows;
      const vec3 w(float(std::sin(theta) * std::cos(phi)), float(std::sin(theta) * std::sin(phi)),
                   float(std::cos(theta)));
      out << (j > 0 ? "," : "") << value(w);
    }
    out << '\n';
  }
}

void write_lobes(const std::string& folder) {
  const vec3 wo = glm::normalize(vec3(0.6f, 0.3f, 0.74f));
  const SymMat3 s{1, 0.1f, 0.4f, 0, 0, 0};
  const LobeFit fit = fit_lobes(s);
  const Sggx sggx(s);
  const float rg = carlson_rg(1.0f, 0.1f, 0.4f);
  write_map(folder + "/d_sggx.csv", [&](const vec3& m) { return sggx.ndf(m) / (4 * rg); });
  write_map(folder + "/d_lobes.csv", [&](const vec3& m) { return fit.flakes.ndf(m); });
  write_map(folder + "/phase_specular.csv", [&](const vec3& wi) { return sggx.specular_phase(wo, wi); });
  const LobeMedium medium(1, fit.flakes, SymMat3{0.9f, 0.5f, 0.3f, 0, 0, 0});
  write_map(folder + "/phase_shadowed.csv", [&](const vec3& wi) { return medium.pdf(wo, wi); });

  FlakeParams leaf;
  leaf.sggx = s, leaf.diffuse = vec3(0.5f), leaf.transmission = vec3(0.3f);
  const FlakePhase diffuse(leaf, wo);
  const auto average = [](const auto& model, const vec3& wi) {
    Rng rng(1);
    float sum = 0;
    for (int i = 0; i < 400; ++i) sum += model.eval(wi, rng).x;
    return sum / 400;
  };
  write_map(folder + "/phase_leaf.csv", [&](const vec3& wi) { return average(diffuse, wi); });
  leaf.specular = vec3(0.04f), leaf.roughness2 = 0.04f;
  const FlakePhase glossy(leaf, wo);
  write_map(folder + "/phase_glossy_leaf.csv", [&](const vec3& wi) { return average(glossy, wi); });
}

/// How the albedo of a white plastic (diffuse 1, F0 0.04) and of a white metal depends on angle and roughness.
void write_furnace(const std::string& folder) {
  std::ofstream out(folder + "/furnace.csv");
  out << "surface,roughness2,cos,albedo\n";
  const vec3 n(0, 0, 1);
  for (const char* surface : {"diffuse", "plastic", "metal"}) {
    for (const float roughness2 : {0.01f, 0.1f, 0.5f}) {
      for (int i = 1; i <= 25; ++i) {
        const float cos = float(i) / 25;
        SurfaceParams p;
        p.roughness2 = roughness2;
        if (surface[0] != 'm') p.diffuse = vec3(1.0f);
        if (surface[0] == 'p') p.specular = vec3(0.04f);
        if (surface[0] == 'm') p.specular = vec3(1.0f);
        const SurfaceBsdf bsdf(p, n, {std::sqrt(1 - cos * cos), 0, cos});
        Rng rng(1);
        double sum = 0;
        constexpr int count = 20000;
        for (int k = 0; k < count; ++k) sum += bsdf.sample(rng).weight.x;
        out << surface << ',' << roughness2 << ',' << cos << ',' << sum / count << '\n';
      }
    }
  }
}

/// The worst relative error of the float segments of a lobe, by exponent.
void write_segments(const std::string& folder) {
  std::ofstream out(folder + "/segments.csv");
  out << "kind,n,error\n";
  for (const LobeKind kind : {LobeKind::Cosine, LobeKind::Sine}) {
    for (int n = 1; n <= kLargestLobeExponent; ++n) {
      const BasicTrigLobe<double> exact(kind, n, dvec3(0, 0, 1));
      const TrigLobe lobe(kind, n, vec3(0, 0, 1));
      double worst = 0;
      for (int i = 0; i <= 10000; ++i) {
        const double t = i / 10000.0;
        const dvec3 w(std::sqrt(1 - t * t), 0, t);
        worst = std::max(worst, std::abs(lobe.sigma(vec3(w)) / exact.sigma(dvec3(vec3(w))) - 1));
      }
      out << (kind == LobeKind::Cosine ? "cos" : "sin") << ',' << n << ',' << worst << '\n';
    }
  }
}

}  // namespace
}  // namespace farfield

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: scattering_figures FOLDER\n");
    return 1;
  }
  const std::string folder = argv[1];
  farfield::write_codec(folder);
  farfield::write_rg(folder);
  farfield::write_lobes(folder);
  farfield::write_furnace(folder);
  farfield::write_segments(folder);
  return 0;
}
