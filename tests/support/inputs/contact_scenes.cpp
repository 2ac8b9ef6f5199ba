// SPDX-License-Identifier: BSD-3-Clause
#include "support/inputs/contact_scenes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "support/inputs/random_inputs.h"

namespace dyop::testing {
namespace {

const Vector3 kFall(0, 0, -9.81 * 0.01);

void add_contact(ContactProblem& problem, std::size_t a, std::size_t b, const Vector3& p_WC,
                 const Vector3& p_WA, const Vector3& p_WB, const Vector3& nhat_AB_W,
                 Scalar friction) {
  PointContact contact;
  contact.body_a = a;
  contact.body_b = b;
  contact.r_a_W = p_WC - p_WA;
  contact.r_b_W = p_WC - p_WB;
  contact.nhat_AB_W = nhat_AB_W;
  contact.friction = friction;
  problem.contacts.push_back(contact);
}

// Boxes with axes along the world's; contacts at the corners of overlapping horizontal faces.
class Boxes {
 public:
  Boxes(Scalar friction) : friction_(friction) { problem_.bodies.emplace_back(); }

  void add(const Vector3& center, const Vector3& size) {
    const std::size_t b = problem_.bodies.size();
    problem_.bodies.push_back(box_body(size, size.prod(), Matrix3::Identity(), kFall));
    const Scalar bottom = center[2] - size[2] / 2;
    if (bottom == 0) touch(0, Vector3::Zero(), Vector3::Constant(kInfinity), b, center, size);
    for (std::size_t a = 1; a < b; ++a) {
      const Vector3& c = centers_[a - 1];
      const Vector3& s = sizes_[a - 1];
      if (std::abs(c[2] + s[2] / 2 - bottom) < 1e-9) touch(a, c, s, b, center, size);
    }
    centers_.push_back(center);
    sizes_.push_back(size);
  }

  ContactProblem take() { return std::move(problem_); }

 private:
  void touch(std::size_t a, const Vector3& c_a, const Vector3& s_a, std::size_t b,
             const Vector3& c_b, const Vector3& s_b) {
    const Vector3 low = (c_a - s_a / 2).cwiseMax(c_b - s_b / 2);
    const Vector3 high = (c_a + s_a / 2).cwiseMin(c_b + s_b / 2);
    if (!(high[0] - low[0] > 1e-6 && high[1] - low[1] > 1e-6)) return;
    for (const Scalar x : {low[0], high[0]}) {
      for (const Scalar y : {low[1], high[1]}) {
        add_contact(problem_, a, b, Vector3(x, y, c_b[2] - s_b[2] / 2), c_a, c_b, Vector3::UnitZ(),
                    friction_);
      }
    }
  }

  Scalar friction_;
  ContactProblem problem_;
  std::vector<Vector3> centers_, sizes_;
};

Matrix3 random_turn(std::mt19937_64& random) {
  return Eigen::AngleAxisd(random_number(-3, 3, random), random_vector(1, random).normalized())
      .toRotationMatrix();
}

// A box, a plate or a rod; sometimes with a locked axis.
ContactBody random_body(const RandomContacts& wanted, std::mt19937_64& random) {
  Vector3 size = Vector3::Constant(wanted.length);
  for (Scalar& s : size) s *= random_number(0.3, 1, random);
  if (wanted.has_degenerates) size[random_index(3, random)] *= random_magnitude(-4, 0, random);
  const Scalar mass = wanted.mass * random_magnitude(0, std::log10(wanted.largest_ratio), random);
  ContactBody body = box_body(size, mass, random_turn(random), random_vector(wanted.speed, random),
                              random_vector(wanted.speed / wanted.length, random));
  if (wanted.has_degenerates && random_index(4, random) == 0) {
    const Vector3 axis = random_vector(1, random).normalized();
    body.inverse_mass_W -= axis * axis.transpose() / mass;
    body.free_v_W -= axis * axis.dot(body.free_v_W);
  }
  return body;
}

}  // namespace

ContactBody box_body(const Vector3& size, Scalar mass, const Matrix3& R_WB, const Vector3& v_W,
                     const Vector3& w_W) {
  const Vector3 sq = size.cwiseAbs2();
  const Vector3 inertia = mass / 12 * Vector3(sq[1] + sq[2], sq[0] + sq[2], sq[0] + sq[1]);
  ContactBody body;
  body.inverse_mass_W = Matrix3::Identity() / mass;
  body.inverse_inertia_W = R_WB * inertia.cwiseInverse().asDiagonal() * R_WB.transpose();
  body.free_v_W = v_W;
  body.free_w_W = w_W;
  return body;
}

ContactProblem box_on_plane(const Vector3& size, Scalar mass, Scalar angle, Scalar friction,
                            const Vector3& v_W) {
  const Matrix3 R_WB = Eigen::AngleAxisd(angle, Vector3::UnitZ()).toRotationMatrix();
  ContactProblem problem;
  problem.bodies = {ContactBody{}, box_body(size, mass, R_WB, v_W)};
  for (const Scalar x : {-0.5, 0.5}) {
    for (const Scalar y : {-0.5, 0.5}) {
      const Vector3 corner = R_WB * Vector3(x * size[0], y * size[1], -0.5 * size[2]);
      add_contact(problem, 0, 1, corner, Vector3::Zero(), Vector3::Zero(), Vector3::UnitZ(),
                  friction);
    }
  }
  return problem;
}

ContactProblem stack_scene(int count, Scalar friction) {
  Boxes boxes(friction);
  for (int i = 0; i < count; ++i) boxes.add(Vector3(0, 0, i + 0.5), Vector3::Ones());
  return boxes.take();
}

ContactProblem pile_scene(int n, int layers, Scalar friction) {
  Boxes boxes(friction);
  std::mt19937_64 random(7);
  for (int layer = 0; layer < layers; ++layer) {
    const Scalar dx = random_number(-0.45, 0.45, random);
    const Scalar dy = random_number(-0.45, 0.45, random);
    for (int i = 0; i < n * n; ++i) {
      const Vector3 shift(dx + random_number(-0.02, 0.02, random),
                          dy + random_number(-0.02, 0.02, random), 0);
      boxes.add(Vector3(1.1 * (i % n), 1.1 * (i / n), layer + 0.5) + shift, Vector3::Ones());
    }
  }
  return boxes.take();
}

ContactProblem wall_scene(int columns, int rows, Scalar friction) {
  Boxes boxes(friction);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      boxes.add(Vector3(2.02 * column + (row % 2), 0, row + 0.5), Vector3(2, 1, 1));
    }
  }
  return boxes.take();
}

ContactProblem arch_scene(int count, Scalar friction) {
  constexpr Scalar kInner = 0.85;
  constexpr Scalar kOuter = 1.15;
  constexpr Scalar kWidth = 0.3;
  const Scalar angle = std::numbers::pi / count;
  const auto direction = [](Scalar t) { return Vector3(-std::cos(t), 0, std::sin(t)); };
  ContactProblem problem;
  problem.bodies.emplace_back();
  std::vector<Vector3> centers{Vector3::Zero()};
  for (int i = 0; i < count; ++i) {
    const Scalar middle = (i + 0.5) * angle;
    const Vector3 radial = direction(middle);
    Matrix3 R_WB;
    R_WB << radial, Vector3::UnitY(), radial.cross(Vector3::UnitY());
    const Vector3 size(kOuter - kInner, kWidth, angle);  // the wedge's middle has length `angle`
    problem.bodies.push_back(box_body(size, size.prod(), R_WB, kFall));
    centers.push_back(radial);
  }
  for (int joint = 0; joint <= count; ++joint) {
    const std::size_t a = std::size_t(joint);
    const std::size_t b = joint == count ? 0 : a + 1;
    const Vector3 radial = direction(joint * angle);
    const Vector3 along(radial[2], 0, -radial[0]);  // towards growing angle
    for (const Scalar r : {kInner, kOuter}) {
      for (const Scalar y : {-kWidth / 2, kWidth / 2}) {
        const Vector3 p = r * radial + y * Vector3::UnitY();
        add_contact(problem, a, b, p, centers[a], centers[b], along, friction);
      }
    }
  }
  return problem;
}

ContactProblem haptic_scene(int contacts, Scalar friction) {
  ContactProblem problem;
  problem.bodies = {
      ContactBody{},
      box_body(Vector3(0.02, 0.02, 0.2), 0.1,
               Eigen::AngleAxisd(0.3, Vector3(1, 2, 3).normalized()).toRotationMatrix(),
               Vector3(0.1, 0.02, -0.05), Vector3(0.3, 0.1, -0.2))};
  for (int i = 0; i < contacts; ++i) {
    const Scalar angle = 2 * std::numbers::pi * i / contacts;
    const Vector3 r(0.01 * std::cos(angle), 0.01 * std::sin(angle), -0.1);
    const Vector3 normal = Vector3(0.2 * std::cos(angle), 0.2 * std::sin(angle), 1).normalized();
    add_contact(problem, 0, 1, r, Vector3::Zero(), Vector3::Zero(), normal, friction);
  }
  return problem;
}

ContactProblem random_contact_problem(const RandomContacts& wanted, std::mt19937_64& random) {
  ContactProblem problem;
  problem.bodies.emplace_back();
  for (int i = 0; i < wanted.bodies; ++i) problem.bodies.push_back(random_body(wanted, random));
  const std::size_t count = problem.bodies.size();
  for (int i = 0; i < wanted.contacts; ++i) {
    if (wanted.has_degenerates && i > 0 && random_index(5, random) == 0) {
      problem.contacts.push_back(problem.contacts.back());
      continue;
    }
    PointContact contact;
    contact.body_b = 1 + std::size_t(random_index(int(count) - 1, random));
    contact.body_a = std::size_t(random_index(int(count), random));
    if (contact.body_a == contact.body_b) contact.body_a = 0;
    contact.r_a_W = random_vector(wanted.length, random);
    contact.r_b_W = random_vector(wanted.length, random);
    if (wanted.has_degenerates && random_index(5, random) == 0) contact.r_b_W.setZero();
    contact.nhat_AB_W = random_vector(1, random).normalized();
    if (contact.body_a == 0) {
      contact.nhat_AB_W = (contact.nhat_AB_W + 2 * Vector3::UnitZ()).normalized();
    }
    const int kind = random_index(4, random);
    contact.friction = kind == 0 ? 0 : random_number(0, wanted.friction, random);
    contact.target = kind == 1 ? random_number(-0.5, 0, random) * wanted.speed : 0;
    problem.contacts.push_back(contact);
  }
  return problem;
}

ContactProblem with_divided_bodies(const ContactProblem& problem, std::mt19937_64& random) {
  ContactProblem divided = problem;
  const std::size_t count = problem.bodies.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Scalar part = random_number(0, 1, random);
    ContactBody& first = divided.bodies[i];
    ContactBody second = first;
    first.inverse_mass_W *= part;
    first.inverse_inertia_W *= part;
    second.inverse_mass_W *= 1 - part;
    second.inverse_inertia_W *= 1 - part;
    const Vector3 v_W = random_vector(1, random), w_W = random_vector(1, random);
    first.free_v_W += v_W;
    second.free_v_W = -v_W;
    first.free_w_W += w_W;
    second.free_w_W = -w_W;
    divided.bodies.push_back(second);
  }
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const PointContact& contact = problem.contacts[k];
    divided.carriers.push_back({k, contact.body_b + count, false, contact.r_b_W});
    divided.carriers.push_back({k, contact.body_a + count, true, contact.r_a_W});
  }
  return divided;
}

void join_bodies(const ContactProblem& divided, ContactProblem& problem) {
  const std::size_t count = problem.bodies.size();
  for (std::size_t i = 0; i < count; ++i) {
    problem.bodies[i].v_W = divided.bodies[i].v_W + divided.bodies[i + count].v_W;
    problem.bodies[i].w_W = divided.bodies[i].w_W + divided.bodies[i + count].w_W;
  }
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    problem.contacts[k].impulse_W = divided.contacts[k].impulse_W;
  }
}

}  // namespace dyop::testing
