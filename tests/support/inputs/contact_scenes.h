// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <random>

#include "dyop/contact/contact_problem.h"

/// Contact problems as steps of scenes pose them, made from simple geometry: every body has the
/// velocity from one step of gravity (9.81 over 0.01), and must be held by its contacts.
namespace dyop::testing {

/// A box of the given size and mass with rotation R_WB and free velocity v, w.
ContactBody box_body(const Vector3& size, Scalar mass, const Matrix3& R_WB, const Vector3& v_W,
                     const Vector3& w_W = Vector3::Zero());

/// A box on the plane z = 0 (body 0, immovable), rotated by `angle` about z, touching with its four
/// lower corners; body 1 has free velocity v.
ContactProblem box_on_plane(const Vector3& size, Scalar mass, Scalar angle, Scalar friction,
                            const Vector3& v_W);

/// `count` cubes on top of each other. Body 0 is the ground here and below.
ContactProblem stack_scene(int count, Scalar friction = 0.5);

/// `layers` of n x n boxes, each layer shifted at random, so that a box rests on up to four others.
ContactProblem pile_scene(int n, int layers, Scalar friction = 0.5);

/// Bricks in running bond, without contacts between the bricks of one row.
ContactProblem wall_scene(int columns, int rows, Scalar friction = 0.5);

/// A half circle of wedges between two immovable ones, radius 1, thickness 0.3.
ContactProblem arch_scene(int count, Scalar friction = 0.6);

/// A light tool (mass 0.1), pressed against a plane with four contacts, sliding.
ContactProblem haptic_scene(int contacts = 4, Scalar friction = 0.3);

/// Parameters of random_contact_problem().
struct RandomContacts {
  int bodies = 5;
  int contacts = 12;
  Scalar length = 1;  ///< lever arms
  Scalar mass = 1;
  Scalar speed = 1;
  Scalar friction = 0.7;         ///< largest; some contacts have none
  Scalar largest_ratio = 10;     ///< of masses
  bool has_degenerates = false;  ///< contacts twice, lever arms of zero, locked axes, flat bodies
};

/// Bodies of any inertia with contacts between any of them, body 0 immovable. Normals of the
/// contacts with body 0 point up, and targets are zero there, so that a solution exists.
ContactProblem random_contact_problem(const RandomContacts& wanted, std::mt19937_64& random);

/// The same with every movable body in two parts that share its mobility and its free velocity: a
/// contact's point moves with both. Part two of body i is body i + the count of bodies; of what
/// cannot move it is another one that cannot.
ContactProblem with_divided_bodies(const ContactProblem& problem, std::mt19937_64& random);
/// The answer of the divided problem in terms of the whole one.
void join_bodies(const ContactProblem& divided, ContactProblem& problem);

}  // namespace dyop::testing
