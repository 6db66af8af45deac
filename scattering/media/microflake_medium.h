// SPDX-License-Identifier: Apache-2.0
// Microflake media with self-shadowing (thesis chapters 12 and 13): a flake seen along w is hidden by its neighbours
// with probability 1 - A(w), and what is hidden is scattered again and again before it leaves. Two models with one
// interface, which is all that a volume path tracer needs:
//
//   LobeMedium   trigonometric lobes, anisotropic A(w) = w^T S_A w     (13.2)
//   SggxMedium   an SGGX distribution, one scalar A                    (12.2, 13.3)
//
//   extinction(w)            sigma_t(w), 1/length
//   single(w), multiple(w)   Sigma_ss and Sigma_ms: scattering coefficients for albedo 1; they sum to sigma_t
//   single_phase, multiple_phase   f_ss(w, w') and f_ms(w'), 1/steradian, normalised
//   eval(wo, wi)             (albedo_ss Sigma_ss f_ss + albedo_ms Sigma_ms f_ms) / sigma_t: albedo * phase function
//   pdf(wo, wi)              the same for albedo 1: the exact density of scatter()
//   scatter(wo, rng)         one scattering event: direction, weight = albedo, density
//
// Flakes are mirrors. sigma_t(w) eval(w, w') is symmetric. Where the flakes cannot be seen at all (sigma_t = 0) there
// is no event: eval, pdf and weight are 0. All types: immutable; any thread.
//
// Each model has a trimmed form without self-shadowing, kSelfShadowing = false: A is not looked at, there is no
// multiple scattering, and no branch per call decides so.
#pragma once

#include "farfield/scatter_sample.h"
#include "scattering/media/trig_lobe.h"
#include "scattering/sggx.h"

namespace farfield {

/// The distance to the next event for u in [0, 1): infinite where nothing attenuates.
inline float free_flight(float sigma_t, float u) {
  return sigma_t > 0 ? -std::log1p(-u) / sigma_t : std::numeric_limits<float>::infinity();
}

/// 1 - exp(-sigma_t length), without cancellation for thin media.
inline float opacity(float sigma_t, float length) { return -std::expm1(-sigma_t * length); }

struct MediumAlbedos {
  vec3 single{1.0f};    ///< of flakes: light that leaves after one reflection
  vec3 multiple{1.0f};  ///< of light that leaves after many
};

/// One scattering event. weight is an albedo; 0 if there was none.
struct MediumEvent : ScatterSample {
  bool is_multiple = false;
};

template <typename T, bool kSelfShadowing = true>
class BasicLobeMedium {
 public:
  /// rho: flake area per volume, both faces counted (normalised scaling, scattering/convention.h), >= 0.
  /// shadowing: S_A, eigenvalues in (0, 1]; 1 is no self-shadowing.
  BasicLobeMedium(T rho, const BasicLobeMixture<T>& flakes, const SymMat3& shadowing,
                  const MediumAlbedos& albedos = {});

  T extinction(const Vec3<T>& w) const { return rho_ * visibility(w) * flakes_.sigma(w); }
  T single(const Vec3<T>& w) const;
  T multiple(const Vec3<T>& w) const;
  T single_phase(const Vec3<T>& wo, const Vec3<T>& wi) const;
  T multiple_phase(const Vec3<T>& wi) const;
  Vec3<T> eval(const Vec3<T>& wo, const Vec3<T>& wi) const;
  T pdf(const Vec3<T>& wo, const Vec3<T>& wi) const;
  MediumEvent scatter(const Vec3<T>& wo, Rng& rng) const;

  /// A direction with density multiple_phase. Rejection.
  Vec3<T> sample_multiple(Rng& rng) const;
  /// int sigma_t(w) dw and int Sigma_ms(w) dw.
  T total_extinction() const { return rho_ * flakes_.integral_sigma(shadowing_); }
  T total_multiple() const { return rho_ * multiple_norm_; }

 private:
  struct Split {
    T single, multiple;
  };
  /// A(w).
  T visibility(const Vec3<T>& w) const;
  /// The two parts of the density of wi; their sum is pdf().
  Split densities(const Vec3<T>& wo, const Vec3<T>& wi) const;

  BasicLobeMixture<T> flakes_;
  SymMat3 shadowing_ = SymMat3::identity(), hidden_;  ///< S_A and I - S_A
  MediumAlbedos albedos_;
  T rho_;
  T multiple_norm_ = 0;     ///< B(S_A, I - S_A); 0: no multiple scattering
  T acceptance_bound_ = 1;  ///< A_max (1 - A_min)
};

template <typename T, bool kSelfShadowing = true>
class BasicSggxMedium {
 public:
  /// rho and s in the SGGX scaling. shadowing: A in (0, 1]; 1 is none.
  BasicSggxMedium(T rho, const SymMat3& s, T shadowing, const MediumAlbedos& albedos = {});

  T extinction(const Vec3<T>& w) const { return shadowing_ * rho_ * flakes_.sigma(w); }
  T single(const Vec3<T>& w) const { return shadowing_ * extinction(w); }
  T multiple(const Vec3<T>& w) const { return hidden_ * extinction(w); }
  T single_phase(const Vec3<T>& wo, const Vec3<T>& wi) const;
  T multiple_phase(const Vec3<T>& wi) const { return multiple_norm_ * flakes_.sigma(wi); }
  Vec3<T> eval(const Vec3<T>& wo, const Vec3<T>& wi) const;
  T pdf(const Vec3<T>& wo, const Vec3<T>& wi) const;
  MediumEvent scatter(const Vec3<T>& wo, Rng& rng) const;

 private:
  BasicSggx<T> flakes_;
  MediumAlbedos albedos_;
  T rho_;
  T shadowing_ = 1, hidden_ = 0;  ///< A and 1 - A
  T multiple_norm_ = 0;           ///< 1 / (4 pi R_G)
};

using LobeMedium = BasicLobeMedium<float>;
using SggxMedium = BasicSggxMedium<float>;

}  // namespace farfield
