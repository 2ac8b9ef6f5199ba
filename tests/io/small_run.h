#pragma once

#include <memory>

#include "dyop/geometry/sphere.h"
#include "dyop/io/scene_file.h"
#include "dyop/motion/hermite_motion.h"
#include "dyop/motion/rest_motion.h"

namespace dyop::test {

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
      TimeInterval{0, 1},
      HermiteMotion::State{RigidPose(), {Vector3(1, 2, 3), Vector3(0.1, 0.2, 0.3)}},
      HermiteMotion::State{RigidPose(R, Vector3(1, 1, 1)), {Vector3(-1, 0, 1), Vector3(1, 0, 0)}});
}

inline ImpactEvent small_impact() {
  ImpactEvent event;
  event.t = 1.0 / 3;
  event.a = BodyId(0);
  event.b = BodyId(1);
  event.toi.status = ToiStatus::Impact;
  event.toi.t_safe = 1.0 / 3;
  event.toi.t_hit = 0.34;
  event.toi.rounding_allowance = 1e-15;
  event.toi.statistics = {11, 22, 33, 44};
  event.toi.X_WB = RigidPose(Vector3(0.1, 0.2, 0.7));
  ImpactContact contact;
  contact.distance_lower = 0.1;
  contact.distance_upper = 0.2;
  contact.p_WCa = Vector3(1.0 / 7, 2, 3);
  contact.nhat_AB_W = Vector3(0.6, 0.8, 0);
  contact.closing_speed = 2.5;
  contact.feature_a = {FeatureKind::Edge, {4, 5, -1}};
  contact.feature_b = {FeatureKind::Smooth, {-1, -1, -1}};
  contact.triangle_a = 17;
  event.toi.contact = contact;
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
  report.work.pairs_by_query = 8;
  return report;
}

}  // namespace dyop::test
