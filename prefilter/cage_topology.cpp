// SPDX-License-Identifier: Apache-2.0
#include "prefilter/cage_topology.h"

#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/topologyDescriptor.h>

#include <array>

#include "base/check.h"

namespace farfield {
namespace {

namespace osd = OpenSubdiv;
using Descriptor = osd::Far::TopologyDescriptor;

osd::Sdc::Options sdc_options(const LimitRules& rules) {
  using Options = osd::Sdc::Options;
  Options options;
  options.SetVtxBoundaryInterpolation(rules.boundary == CageBoundary::EdgeOnly ? Options::VTX_BOUNDARY_EDGE_ONLY
                                                                               : Options::VTX_BOUNDARY_EDGE_AND_CORNER);
  options.SetCreasingMethod(rules.creasing == CageCreasing::Chaikin ? Options::CREASE_CHAIKIN
                                                                    : Options::CREASE_UNIFORM);
  constexpr std::array kUv = {Options::FVAR_LINEAR_NONE,          Options::FVAR_LINEAR_CORNERS_ONLY,
                              Options::FVAR_LINEAR_CORNERS_PLUS1, Options::FVAR_LINEAR_CORNERS_PLUS2,
                              Options::FVAR_LINEAR_BOUNDARIES,    Options::FVAR_LINEAR_ALL};
  options.SetFVarLinearInterpolation(kUv[static_cast<size_t>(rules.uv)]);
  return options;
}

osd::Sdc::SchemeType scheme_of(SubdivisionScheme scheme) {
  switch (scheme) {
    case SubdivisionScheme::None:
      return osd::Sdc::SCHEME_BILINEAR;
    case SubdivisionScheme::Loop:
      return osd::Sdc::SCHEME_LOOP;
    case SubdivisionScheme::CatmullClark:
      break;
  }
  return osd::Sdc::SCHEME_CATMARK;
}

template <int N>
void add_channel(const CageChannel<N>& channel, std::vector<Descriptor::FVarChannel>& out) {
  if (channel.corner_value.empty()) return;
  out.emplace_back();
  out.back().numValues = static_cast<int>(channel.values.size());
  out.back().valueIndices = channel.corner_value.data();
}

/// A value as OpenSubdiv adds them up.
template <typename Value>
struct Sum {
  Value value{0.0};
  void Clear() { value = Value(0.0); }
  void AddWithWeight(const Sum& other, double weight) { value += weight * other.value; }
};

/// The values of the first level from those of the cage.
template <typename Value, typename Interpolate>
std::vector<Value> refine_values(const std::vector<Value>& coarse, int count, const Interpolate& interpolate) {
  std::vector<Sum<Value>> from, to(static_cast<size_t>(count));
  for (const Value& value : coarse) from.push_back({value});
  interpolate(from, to);
  std::vector<Value> fine;
  for (const Sum<Value>& sum : to) fine.push_back(sum.value);
  return fine;
}

template <int N>
void refine_channel(const CageChannel<N>& coarse, const osd::Far::TopologyRefiner& refiner, int channel,
                    CageChannel<N>& fine) {
  if (coarse.corner_value.empty()) return;
  const osd::Far::TopologyLevel& level = refiner.GetLevel(1);
  fine.values = refine_values(coarse.values, level.GetNumFVarValues(channel), [&](const auto& from, auto& to) {
    osd::Far::PrimvarRefinerReal<double>(refiner).InterpolateFaceVarying(1, from, to, channel);
  });
  for (int face = 0; face < level.GetNumFaces(); ++face) {
    const auto values = level.GetFaceFVarValues(face, channel);
    fine.corner_value.insert(fine.corner_value.end(), values.begin(), values.end());
  }
}

/// What is sharp at the first level, rims and all.
void refine_sharpness(const osd::Far::TopologyLevel& level, Cage& fine) {
  for (int edge = 0; edge < level.GetNumEdges(); ++edge) {
    if (!(level.GetEdgeSharpness(edge) > 0)) continue;
    const auto points = level.GetEdgeVertices(edge);
    fine.crease_points.insert(fine.crease_points.end(), points.begin(), points.end());
    fine.crease_sharpness.push_back(level.GetEdgeSharpness(edge));
  }
  for (int point = 0; point < level.GetNumVertices(); ++point) {
    if (!(level.GetVertexSharpness(point) > 0)) continue;
    fine.sharp_points.push_back(point);
    fine.point_sharpness.push_back(level.GetVertexSharpness(point));
  }
}

}  // namespace

std::unique_ptr<osd::Far::TopologyRefiner> make_refiner(const Cage& cage, const LimitRules& rules) {
  Descriptor descriptor;
  descriptor.numVertices = static_cast<int>(cage.points.size());
  descriptor.numFaces = static_cast<int>(cage.face_size.size());
  descriptor.numVertsPerFace = cage.face_size.data();
  descriptor.vertIndicesPerFace = cage.corner_point.data();
  descriptor.numCreases = static_cast<int>(cage.crease_sharpness.size());
  descriptor.creaseVertexIndexPairs = cage.crease_points.data();
  descriptor.creaseWeights = cage.crease_sharpness.data();
  descriptor.numCorners = static_cast<int>(cage.point_sharpness.size());
  descriptor.cornerVertexIndices = cage.sharp_points.data();
  descriptor.cornerWeights = cage.point_sharpness.data();
  descriptor.numHoles = static_cast<int>(cage.holes.size());
  descriptor.holeIndices = cage.holes.data();
  std::vector<Descriptor::FVarChannel> channels;
  add_channel(cage.uv, channels);
  add_channel(cage.color, channels);
  descriptor.numFVarChannels = static_cast<int>(channels.size());
  descriptor.fvarChannels = channels.data();
  using Factory = osd::Far::TopologyRefinerFactory<Descriptor>;
  std::unique_ptr<osd::Far::TopologyRefiner> refiner(
      Factory::Create(descriptor, Factory::Options(scheme_of(rules.scheme), sdc_options(rules))));
  FARFIELD_CHECK(refiner != nullptr);  // make_cage() has taken out whatever it refuses
  return refiner;
}

Cage refine_to_quads(const Cage& cage, const LimitRules& rules) {
  const auto refiner = make_refiner(cage, rules);
  osd::Far::TopologyRefiner::UniformOptions options(1);
  options.fullTopologyInLastLevel = true;  // with edges, for their sharpness
  refiner->RefineUniform(options);
  const osd::Far::TopologyLevel& level = refiner->GetLevel(1);
  Cage fine;
  fine.side = cage.side;
  fine.points = refine_values(cage.points, level.GetNumVertices(), [&](const auto& from, auto& to) {
    osd::Far::PrimvarRefinerReal<double>(*refiner).Interpolate(1, from, to);
  });
  for (int face = 0; face < level.GetNumFaces(); ++face) {
    const auto points = level.GetFaceVertices(face);
    fine.face_size.push_back(points.size());
    fine.corner_point.insert(fine.corner_point.end(), points.begin(), points.end());
    fine.face.push_back(cage.face[static_cast<size_t>(level.GetFaceParentFace(face))]);
    if (level.IsFaceHole(face)) fine.holes.push_back(face);
  }
  refine_sharpness(level, fine);
  refine_channel(cage.uv, *refiner, 0, fine.uv);
  refine_channel(cage.color, *refiner, refiner->GetNumFVarChannels() - 1, fine.color);
  return fine;
}

}  // namespace farfield
