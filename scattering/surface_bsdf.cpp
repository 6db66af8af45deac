// SPDX-License-Identifier: Apache-2.0
#include "scattering/surface_bsdf.h"

#include "scattering/fresnel.h"

namespace farfield {
namespace {

/// Up to this share of tr(S) away from n n^T, normals count as equal to n: 0.2 degrees, where the lobes cannot be told
/// apart. Larger than what packing to 12 bytes does to n n^T.
constexpr float kFlatShare = 1e-5f;
/// Smoother specular lobes are rendered as this one (alpha = 0.001).
constexpr float kSmallestRoughness2 = 1e-6f;

bool is_flat(const SymMat3& s, const vec3& n) {
  const float trace = s.trace();
  return !(trace - s.quadratic(n) > kFlatShare * trace);
}

vec3 clamp_albedo(const vec3& albedo) {
  // max first: it turns NaN into 0.
  return glm::min(vec3(std::fmax(0.0f, albedo.x), std::fmax(0.0f, albedo.y), std::fmax(0.0f, albedo.z)), vec3(1.0f));
}

vec3 reflectance(const vec3& f0, float f90, float grazing_share) { return f0 + (vec3(f90) - f0) * grazing_share; }

/// The roughness that a distribution shows on a surface with normal n: that of GGX with as much spread.
float effective_alpha(const SymMat3& s, const vec3& n) {
  const float upright = s.quadratic(n);
  const float spread = s.trace() - upright;
  return spread < 2.0f * upright ? std::sqrt(std::max(0.0f, spread / (2.0f * upright))) : 1.0f;
}

}  // namespace

SurfaceBsdf::SurfaceBsdf(const SurfaceParams& params, const vec3& n, const vec3& wo)
    : n_(n), wo_(wo), cos_o_(glm::dot(n, wo)) {
  if (!(cos_o_ > 0)) return;
  diffuse_ = clamp_albedo(params.diffuse);
  transmission_ = clamp_albedo(params.transmission);
  specular_ = clamp_albedo(params.specular);
  const vec3 excess = glm::max(vec3(1.0f), diffuse_ + transmission_);
  diffuse_ /= excess, transmission_ /= excess;
  flat_ = is_flat(params.sggx, n);

  diffuse_chance_ = max_component(diffuse_);
  transmission_chance_ = max_component(transmission_);
  if (!flat_ && diffuse_chance_ + transmission_chance_ > 0) base_facets_ = Microfacets(params.sggx, n);

  f90_ = grazing_reflectance(specular_);
  if (f90_ > 0) {
    const float roughness2 = params.roughness2 < 1.0f ? std::max(params.roughness2, kSmallestRoughness2) : 1.0f;
    const SymMat3 lobe = specular_sggx(flat_ ? SymMat3::outer(n) : params.sggx, roughness2);
    specular_facets_ = Microfacets(lobe, n);
    alpha_ = flat_ ? std::sqrt(roughness2) : effective_alpha(lobe, n);
    const VisibleFresnel fresnel(alpha_);
    const vec3 reflected = reflectance(specular_, f90_, fresnel.grazing_share(cos_o_));
    specular_chance_ = max_component(reflected);
    diffuse_chance_ *= 1 - min_component(reflected);
    transmission_chance_ *= 1 - min_component(reflected);
    const vec3 left_in_all = vec3(1.0f) - reflectance(specular_, f90_, fresnel.mean_grazing_share());
    const vec3 coupling = (flat_ ? vec3(1.0f) - reflected : vec3(1.0f)) / glm::max(left_in_all, vec3(1e-6f));
    diffuse_ *= coupling, transmission_ *= coupling;
  }
  const float sum = specular_chance_ + diffuse_chance_ + transmission_chance_;
  if (!(sum > 0)) return;
  specular_chance_ /= sum, diffuse_chance_ /= sum, transmission_chance_ /= sum;
}

vec3 SurfaceBsdf::eval(const vec3& wi, Rng& rng) const {
  const float cos_i = glm::dot(n_, wi);
  if (cos_i > 0) {
    vec3 value(0.0f);
    if (specular_chance_ > 0) value += eval_specular(wi, cos_i);
    if (diffuse_chance_ > 0) value += diffuse_ * eval_base(wi, cos_i, rng);
    return value;
  }
  if (cos_i < 0 && transmission_chance_ > 0) return transmission_ * eval_base(wi, cos_i, rng);
  return vec3(0.0f);
}

// F D G2 / (4 n.wo), with G2 / G1u(wo) = masking_weight and G1u(wo) = n.wo / a(wo).
vec3 SurfaceBsdf::eval_specular(const vec3& wi, float cos_i) const {
  const vec3 h = half_vector(wo_, wi);
  const float cos_h = glm::dot(h, wo_);
  if (!(cos_h > 0)) return vec3(0.0f);
  const float area_o = specular_facets_.projected_area(wo_);
  const float area_i = specular_facets_.projected_area(wi);
  if (!(area_o > 0)) return vec3(0.0f);
  const float masking = masking_weight<Masking::HeightCorrelated>(cos_o_, area_o, cos_i, area_i);
  return schlick(specular_, f90_, cos_h) * (specular_facets_.ndf(h) * masking / (4.0f * area_o));
}

// The diffuse lobe for albedo 1, on the side of wi.
vec3 SurfaceBsdf::eval_base(const vec3& wi, float cos_i, Rng& rng) const {
  vec3 facet = n_;
  float masking = 1;
  if (!flat_) {
    const float area_o = base_facets_.projected_area(wo_);
    if (!(area_o > 0)) return vec3(0.0f);
    facet = base_facets_.sample_visible(wo_, rng.next(), rng.next());
    // On the other side the facets are the same, seen from behind; heights there are independent of ours.
    masking = cos_i > 0
                  ? masking_weight<Masking::HeightCorrelated>(cos_o_, area_o, cos_i, base_facets_.projected_area(wi))
                  : masking_weight<Masking::Separable>(cos_o_, area_o, -cos_i, base_facets_.projected_area(-wi));
  }
  const float cos_facet = cos_i > 0 ? glm::dot(facet, wi) : -glm::dot(facet, wi);
  if (!(cos_facet > 0)) return vec3(0.0f);
  const float value = cos_facet * kInvPi * masking;
  if (!(f90_ > 0)) return vec3(value);
  if (!flat_) return value * left_by_specular(wo_, rng) * left_by_specular(cos_i > 0 ? wi : -wi, rng);
  return value * (vec3(1.0f) - reflectance(specular_, f90_, VisibleFresnel(alpha_).grazing_share(cos_facet)));
}

// 1 - F of one specular facet visible from w: its mean is exactly what specular reflection leaves, whatever sggx is.
vec3 SurfaceBsdf::left_by_specular(const vec3& w, Rng& rng) const {
  const vec3 facet = specular_facets_.sample_visible(w, rng.next(), rng.next());
  return vec3(1.0f) - schlick(specular_, f90_, std::max(0.0f, glm::dot(facet, w)));
}

float SurfaceBsdf::pdf(const vec3& wi) const {
  const float cos_i = glm::dot(n_, wi);
  if (!(cos_i > 0)) return transmission_chance_ * std::max(0.0f, -cos_i) * kInvPi;
  float density = diffuse_chance_ * cos_i * kInvPi;
  if (specular_chance_ > 0) {
    const vec3 h = half_vector(wo_, wi);
    const float area_o = specular_facets_.projected_area(wo_);
    if (glm::dot(h, wo_) > 0 && area_o > 0) density += specular_chance_ * specular_facets_.ndf(h) / (4.0f * area_o);
  }
  return density;
}

ScatterResult SurfaceBsdf::sample(Rng& rng) const {
  if (!(specular_chance_ + diffuse_chance_ + transmission_chance_ > 0)) return {};
  const float lobe = rng.next(), u1 = rng.next(), u2 = rng.next();
  ScatterResult result;
  if (lobe < specular_chance_) {
    result.wi = reflect_about(wo_, specular_facets_.sample_visible(wo_, u1, u2));
    if (!(glm::dot(n_, result.wi) > 0)) return {};
  } else {
    const bool through = transmission_chance_ > 0 && !(lobe < specular_chance_ + diffuse_chance_);
    result.wi = cosine_lobe(through ? -n_ : n_, u1, u2);
  }
  result.pdf = pdf(result.wi);
  if (result.pdf > 0) result.weight = eval(result.wi, rng) / result.pdf;
  return result;
}

static_assert(sizeof(SurfaceBsdf) <= 160);

}  // namespace farfield
