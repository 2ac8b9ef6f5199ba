// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "dyop/geometry/primitives.h"
#include "dyop/io/scene_file.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/small_impact.h"

namespace dyop::testing {

/// Two bodies, one of which moves, without any simulation: what a recorder gets.
inline Scene small_scene() {
  Scene scene;
  scene.title = "Small";
  scene.source = R"({"title":"Small"})";
  for (const char* name : {"mover", "rester"}) {
    BodyDefinition body;
    body.name = name;
    body.kind = std::string(name) == "mover" ? BodyKind::Dynamic : BodyKind::Static;
    body.shape = std::make_shared<Sphere>(1);
    scene.bodies.push_back(body);
    scene.shape_names.push_back("sphere");
  }
  scene.end_time = 2;
  scene.step = 1;
  return scene;
}

inline std::shared_ptr<const Motion> small_motion() {
  const Matrix3 R = rotation_from_vector(Vector3(0.3, -0.2, 0.9));
  return std::make_shared<HermiteMotion>(
      TimeInterval{0, 1}, MotionState{RigidPose(), {Vector3(1, 2, 3), Vector3(0.1, 0.2, 0.3)}},
      MotionState{RigidPose(R, Vector3(1, 1, 1)), {Vector3(-1, 0, 1), Vector3(1, 0, 0)}});
}

inline ImpactEvent small_impact() {
  ImpactEvent event;
  event.t = 1.0 / 3;
  event.a = BodyId(0);
  event.b = BodyId(1);
  event.toi = small_impact_result();
  WorldContact world_contact;
  world_contact.a = BodyId(0);
  world_contact.b = BodyId(1);
  world_contact.contact.lower = 0.15;
  world_contact.contact.upper = 0.16;
  world_contact.contact.feature_b = {FeatureKind::Face, {7, 8, 9}};
  world_contact.contact.triangle_b = 3;
  world_contact.normal_velocity = -2.5;
  world_contact.impulse_W = Vector3(0, 0, 1.0 / 9);
  event.contacts.push_back(world_contact);
  return event;
}

inline AdvanceReport small_report() {
  AdvanceReport report;
  report.status = AdvanceStatus::Completed;
  report.t = 1;
  const auto rest = std::make_shared<RestMotion>(RigidPose(Vector3(9, 9, 9)));
  const std::vector<std::shared_ptr<const Motion>> motions{small_motion(), rest};
  report.steps = {{{0, 1.0 / 3}, motions}, {{1.0 / 3, 1}, motions}};
  report.impacts = {small_impact()};
  report.fell_asleep = {BodyId(0)};
  report.woke = {BodyId(0)};
  report.too_near = {{BodyId(0), BodyId(1)}};
  report.integrator = {5, 6, 7};
  report.toi = {1, 2, 3, 4};
  report.work.steps = 2;
  report.work.pairs_by_query = 8;
  return report;
}

}  // namespace dyop::testing
