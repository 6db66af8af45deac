// SPDX-License-Identifier: Apache-2.0
#include "scattering/media/microflake_medium.h"

#include "scattering/carlson.h"

namespace farfield {
namespace {

/// S_A this close to the identity has no multiple scattering that float could tell from rounding.
constexpr double kSmallestHidden = 1e-6;

template <typename T>
Vec3<T> albedo(const vec3& value) {
  return Vec3<T>(value);
}

SymMat3 complement(const SymMat3& s) { return SymMat3::identity() + s * -1.0f; }

/// D(h) / 4, the specular phase function before it is normalised; 0 for opposite directions.
template <typename Flakes, typename T>
T reflected_density(const Flakes& flakes, const Vec3<T>& wo, const Vec3<T>& wi) {
  const Vec3<T> h = half_vector(wo, wi);
  return h == Vec3<T>(0) ? T(0) : flakes.ndf(h) / T(4);
}

template <typename T>
MediumEvent make_event(const Vec3<T>& wi, const vec3& weight, T density, bool is_multiple) {
  MediumEvent event;
  event.wi = vec3(wi), event.weight = weight, event.pdf = static_cast<float>(density), event.is_multiple = is_multiple;
  return event;
}

}  // namespace

template <typename T, bool kSelfShadowing>
BasicLobeMedium<T, kSelfShadowing>::BasicLobeMedium(T rho, const BasicLobeMixture<T>& flakes, const SymMat3& shadowing,
                                                    const MediumAlbedos& albedos)
    : flakes_(flakes), albedos_(albedos), rho_(rho) {
  if constexpr (kSelfShadowing) {
    shadowing_ = shadowing;
    hidden_ = complement(shadowing);
    const dvec3 range = eigenvalues(shadowing);
    if (1 - range.z < kSmallestHidden) return;
    multiple_norm_ = flakes_.integral_shadowed(shadowing_, hidden_);
    acceptance_bound_ = static_cast<T>(range.x * (1 - range.z));
  }
}

template <typename T, bool kSelfShadowing>
T BasicLobeMedium<T, kSelfShadowing>::visibility(const Vec3<T>& w) const {
  if constexpr (!kSelfShadowing) return T(1);
  const Vec3<T> sw(shadowing_.xx * w.x + shadowing_.xy * w.y + shadowing_.xz * w.z,
                   shadowing_.xy * w.x + shadowing_.yy * w.y + shadowing_.yz * w.z,
                   shadowing_.xz * w.x + shadowing_.yz * w.y + shadowing_.zz * w.z);
  return std::clamp(glm::dot(w, sw), T(0), T(1));
}

template <typename T, bool kSelfShadowing>
T BasicLobeMedium<T, kSelfShadowing>::single(const Vec3<T>& w) const {
  if constexpr (!kSelfShadowing) return extinction(w);
  return rho_ * visibility(w) * flakes_.shadowed_sigma(w, shadowing_);
}

template <typename T, bool kSelfShadowing>
T BasicLobeMedium<T, kSelfShadowing>::multiple(const Vec3<T>& w) const {
  return multiple_norm_ > 0 ? rho_ * visibility(w) * flakes_.shadowed_sigma(w, hidden_) : T(0);
}

template <typename T, bool kSelfShadowing>
T BasicLobeMedium<T, kSelfShadowing>::single_phase(const Vec3<T>& wo, const Vec3<T>& wi) const {
  const T norm = kSelfShadowing ? flakes_.shadowed_sigma(wo, shadowing_) : flakes_.sigma(wo);
  return norm > 0 ? visibility(wi) * reflected_density(flakes_, wo, wi) / norm : T(0);
}

template <typename T, bool kSelfShadowing>
T BasicLobeMedium<T, kSelfShadowing>::multiple_phase(const Vec3<T>& wi) const {
  if (!(multiple_norm_ > 0)) return 0;
  return visibility(wi) * flakes_.shadowed_sigma(wi, hidden_) / multiple_norm_;
}

template <typename T, bool kSelfShadowing>
auto BasicLobeMedium<T, kSelfShadowing>::densities(const Vec3<T>& wo, const Vec3<T>& wi) const -> Split {
  const T sigma = flakes_.sigma(wo);
  if (!(sigma > 0)) return {0, 0};
  const T single = visibility(wi) * reflected_density(flakes_, wo, wi) / sigma;
  if constexpr (!kSelfShadowing) return {single, 0};
  if (!(multiple_norm_ > 0)) return {single, 0};
  return {single, flakes_.shadowed_sigma(wo, hidden_) / sigma * multiple_phase(wi)};
}

template <typename T, bool kSelfShadowing>
Vec3<T> BasicLobeMedium<T, kSelfShadowing>::eval(const Vec3<T>& wo, const Vec3<T>& wi) const {
  const Split split = densities(wo, wi);
  return albedo<T>(albedos_.single) * split.single + albedo<T>(albedos_.multiple) * split.multiple;
}

template <typename T, bool kSelfShadowing>
T BasicLobeMedium<T, kSelfShadowing>::pdf(const Vec3<T>& wo, const Vec3<T>& wi) const {
  const Split split = densities(wo, wi);
  return split.single + split.multiple;
}

// A visible flake reflects; the reflection is seen with probability A, and is then a sample of f_ss; it is hidden
// otherwise, which happens with probability Sigma_ms / sigma_t. No rejection for the anisotropy of A.
template <typename T, bool kSelfShadowing>
MediumEvent BasicLobeMedium<T, kSelfShadowing>::scatter(const Vec3<T>& wo, Rng& rng) const {
  const Vec3<T> wi = reflect_about(wo, flakes_.sample_visible(wo, rng));
  if constexpr (kSelfShadowing) {
    if (multiple_norm_ > 0 && !(T(rng.next()) < visibility(wi))) {
      const Vec3<T> far = sample_multiple(rng);
      return make_event(far, albedos_.multiple, pdf(wo, far), true);
    }
  }
  return make_event(wi, albedos_.single, pdf(wo, wi), false);
}

template <typename T, bool kSelfShadowing>
Vec3<T> BasicLobeMedium<T, kSelfShadowing>::sample_multiple(Rng& rng) const {
  for (;;) {
    const Vec3<T> m = flakes_.sample_normal(rng);
    const Vec3<T> w = cosine_lobe(m, T(rng.next()), T(rng.next()));
    const T seen = visibility(w) * (T(1) - visibility(reflect_about(w, m)));
    if (T(rng.next()) * acceptance_bound_ <= seen) return w;
  }
}

template <typename T, bool kSelfShadowing>
BasicSggxMedium<T, kSelfShadowing>::BasicSggxMedium(T rho, const SymMat3& s, T shadowing, const MediumAlbedos& albedos)
    : flakes_(s), albedos_(albedos), rho_(rho) {
  if constexpr (kSelfShadowing) {
    shadowing_ = shadowing, hidden_ = T(1) - shadowing;
    const dvec3 l = eigenvalues(s);
    const double mean = carlson_rg(l.x, l.y, l.z);
    multiple_norm_ = mean > 0 ? static_cast<T>(1 / (4 * kPiOf<double> * mean)) : T(0);
  }
}

template <typename T, bool kSelfShadowing>
T BasicSggxMedium<T, kSelfShadowing>::single_phase(const Vec3<T>& wo, const Vec3<T>& wi) const {
  const T sigma = flakes_.sigma(wo);
  return sigma > 0 ? reflected_density(flakes_, wo, wi) / sigma : T(0);
}

template <typename T, bool kSelfShadowing>
Vec3<T> BasicSggxMedium<T, kSelfShadowing>::eval(const Vec3<T>& wo, const Vec3<T>& wi) const {
  const Vec3<T> single = albedo<T>(albedos_.single) * (shadowing_ * single_phase(wo, wi));
  if constexpr (!kSelfShadowing) return single;
  return single + albedo<T>(albedos_.multiple) * (hidden_ * multiple_phase(wi));
}

template <typename T, bool kSelfShadowing>
T BasicSggxMedium<T, kSelfShadowing>::pdf(const Vec3<T>& wo, const Vec3<T>& wi) const {
  if constexpr (!kSelfShadowing) return single_phase(wo, wi);
  return shadowing_ * single_phase(wo, wi) + hidden_ * multiple_phase(wi);
}

template <typename T, bool kSelfShadowing>
MediumEvent BasicSggxMedium<T, kSelfShadowing>::scatter(const Vec3<T>& wo, Rng& rng) const {
  if (flakes_.is_empty()) return {};
  if constexpr (kSelfShadowing) {
    if (!(T(rng.next()) < shadowing_)) {
      const Vec3<T> wi = flakes_.sample_sigma(rng);
      return make_event(wi, albedos_.multiple, pdf(wo, wi), true);
    }
  }
  const Vec3<T> wi = flakes_.sample_specular(wo, T(rng.next()), T(rng.next()));
  return make_event(wi, albedos_.single, pdf(wo, wi), false);
}

template class BasicLobeMedium<float, true>;
template class BasicLobeMedium<float, false>;
template class BasicLobeMedium<double, true>;
template class BasicLobeMedium<double, false>;
template class BasicSggxMedium<float, true>;
template class BasicSggxMedium<float, false>;
template class BasicSggxMedium<double, true>;
template class BasicSggxMedium<double, false>;

}  // namespace farfield
