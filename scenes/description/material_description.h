#pragma once
/// @file scenes/description/material_description.h
/// A material as a scene file gives it.

#include <Eigen/Core>

#include "scenes/keys/key_visitor.h"

namespace tensorray {

enum class MaterialKind { diffuse, principled, metal, glass };
enum class Metal { gold, silver, copper, aluminium };

struct MaterialDescription {
  MaterialKind kind = MaterialKind::principled;
  Eigen::Vector3d color{0.7, 0.7, 0.7};  ///< Used if the surface has no colours of its own; linear Rec. 709.
  double roughness = 0.4;
  double metallic = 0, specular = 0.5, clearcoat = 0;  ///< principled.
  Metal metal = Metal::gold;                           ///< metal.
  double index = 1.5;                                  ///< glass: index of refraction.
};

inline Choices<MaterialKind> choices(MaterialKind) {
  return {{"diffuse", MaterialKind::diffuse},
          {"principled", MaterialKind::principled},
          {"metal", MaterialKind::metal},
          {"glass", MaterialKind::glass}};
}

inline Choices<Metal> choices(Metal) {
  return {{"gold", Metal::gold}, {"silver", Metal::silver}, {"copper", Metal::copper}, {"aluminium", Metal::aluminium}};
}

inline void describe(MaterialDescription& material, KeyVisitor& visit) {
  visit("kind", material.kind, "kind of material");
  visit("color", material.color, "colour of a surface without colours of its own, linear Rec. 709", between(0, 1));
  visit("roughness", material.roughness, "roughness: 0 polished, 1 matt (not diffuse)", between(0, 1));
  visit("metallic", material.metallic, "principled: share of metal: 0 plastic, 1 metal", between(0, 1));
  visit("specular", material.specular, "principled: reflection of plastic, 0.5 is 4 %", between(0, 1));
  visit("clearcoat", material.clearcoat, "principled: strength of the clear coat", between(0, 1));
  visit("metal", material.metal, "metal: its kind");
  visit("index", material.index, "glass: index of refraction", between(1.01, 5));
  visit.only_for({"roughness"}, "kind", material.kind,
                 {MaterialKind::principled, MaterialKind::metal, MaterialKind::glass});
  visit.only_for({"metallic", "specular", "clearcoat"}, "kind", material.kind, {MaterialKind::principled});
  visit.only_for({"metal"}, "kind", material.kind, {MaterialKind::metal});
  visit.only_for({"index"}, "kind", material.kind, {MaterialKind::glass});
}

}  // namespace tensorray
