#pragma once

#include "dyop/contact/contact_problem.h"

namespace dyop::testing {

/// A box of the given size and mass, turned by `X`; its free velocity is v, w.
inline ContactBody box_body(const Vector3& size, Scalar mass, const Matrix3& R_WB,
                            const Vector3& v_W, const Vector3& w_W = Vector3::Zero()) {
  const Vector3 sq = size.cwiseAbs2();
  const Vector3 inertia = mass / 12 * Vector3(sq[1] + sq[2], sq[0] + sq[2], sq[0] + sq[1]);
  ContactBody body;
  body.inverse_mass_W = Matrix3::Identity() / mass;
  body.inverse_inertia_W = R_WB * inertia.cwiseInverse().asDiagonal() * R_WB.transpose();
  body.free_v_W = v_W;
  body.free_w_W = w_W;
  return body;
}

/// A box on the plane z = 0 (body 0, fixed), turned by `angle` about z, touching with its four
/// lower corners; body 1 has free velocity v.
inline ContactProblem box_on_plane(const Vector3& size, Scalar mass, Scalar angle, Scalar friction,
                                   const Vector3& v_W) {
  const Matrix3 R_WB = Eigen::AngleAxisd(angle, Vector3::UnitZ()).toRotationMatrix();
  ContactProblem problem;
  problem.bodies = {ContactBody{}, box_body(size, mass, R_WB, v_W)};
  for (const Scalar x : {-0.5, 0.5}) {
    for (const Scalar y : {-0.5, 0.5}) {
      PointContact contact;
      contact.body_a = 0;
      contact.body_b = 1;
      contact.r_b_W = R_WB * Vector3(x * size[0], y * size[1], -0.5 * size[2]);
      contact.r_a_W = contact.r_b_W;
      contact.nhat_AB_W = Vector3::UnitZ();
      contact.friction = friction;
      problem.contacts.push_back(contact);
    }
  }
  return problem;
}

}  // namespace dyop::testing
