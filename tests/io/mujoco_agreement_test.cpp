// SPDX-License-Identifier: BSD-3-Clause

// MuJoCo itself as a second opinion on the reader of its format, and the adapter for it.

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <sstream>
#include <string>

#include "dyop/adapters/mujoco_geoms.h"
#include "dyop/distance/ray_cast.h"
#include "dyop/io/robot_file.h"
#include "support/inputs/random_inputs.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

using testing::random_direction;
using testing::random_number;

// MuJoCo's rays pass what is fully transparent, so that is what visual geoms are. A random model: a tree of bodies with every kind of joint, of geom and of orientation.
class RandomModel {
 public:
  explicit RandomModel(std::uint64_t seed) : random_(seed) {}

  std::string text() {
    uses_degrees_ = one_of(2) == 0;
    std::ostringstream xml;
    xml << "<mujoco model='random'>\n<compiler angle='" << (uses_degrees_ ? "degree" : "radian")
        << "' eulerseq='" << sequence() << "' inertiafromgeom='true'/>\n"
        << "<option><flag filterparent='" << (one_of(3) == 0 ? "disable" : "enable")
        << "'/></option>\n<size njmax='100' nconmax='2000' nstack='500000'/>\n"
        << "<default><geom margin='100' density='100'/><joint axis='1 0 0'/>\n"
        << "<default class='thin'><geom type='capsule' size='.1 .3'/>"
        << "<joint type='slide'/></default>\n"
        << "<default class='seen'><geom contype='0' conaffinity='0' rgba='0 0 0 0'/></default>\n"
        << "</default>\n<asset>" << mesh("solid", true) << mesh("hull", false) << "</asset>\n"
        << "<worldbody><geom name='floor' type='plane' size='0 0 1' pos='0 0 -4'/>\n"
        << (one_of(2) == 0 ? geom() : "");
    bodies_ = 0;
    while (bodies_ < 6) xml << body(0);
    xml << "</worldbody>\n<contact>" << exclusion() << "</contact></mujoco>\n";
    return xml.str();
  }

 private:
  int one_of(int count) { return int(random_() % std::uint64_t(count)); }
  Scalar number(Scalar lower, Scalar upper) { return random_number(lower, upper, random_); }

  std::string vector(int count, Scalar lower, Scalar upper) {
    std::ostringstream text;
    text.precision(17);
    for (int k = 0; k < count; ++k) text << number(lower, upper) << ' ';
    return text.str();
  }
  Scalar angle() { return number(-3, 3) * (uses_degrees_ ? 57 : 1); }

  std::string sequence() {
    std::string letters;
    for (int k = 0; k < 3; ++k) letters += "xyzXYZ"[one_of(6)];
    return letters;
  }

  std::string orientation() {
    switch (one_of(6)) {
      case 0:
        return " quat='" + vector(4, -2, 2) + "'";
      case 1:
        return " axisangle='" + vector(3, -1, 1) + std::to_string(angle()) + "'";
      case 2:
        return " euler='" + std::to_string(angle()) + " " + std::to_string(angle()) + " " +
               std::to_string(angle()) + "'";
      case 3:
        return " xyaxes='" + vector(6, -1, 1) + "'";
      case 4:
        return " zaxis='" + vector(3, -1, 1) + "'";
      default:
        return "";
    }
  }
  std::string place() { return " pos='" + vector(3, -1, 1) + "'" + orientation(); }

  // An irregular tetrahedron, with or without its faces.
  std::string mesh(const std::string& name, bool has_faces) {
    std::string text = "<mesh name='" + name + "' vertex='0 0 0 .5 .1 0 .1 .6 0 0 .1 .7'";
    if (has_faces) text += " face='0 2 1 0 1 3 1 2 3 0 3 2'";
    if (one_of(2) == 0) text += " scale='" + std::string(one_of(2) ? "1 -2 .5'" : "2 1 1.5'");
    if (one_of(2) == 0) text += " refpos='" + vector(3, -1, 1) + "'";
    if (one_of(2) == 0) text += " refquat='" + vector(4, -1, 1) + "'";
    return text + "/>";
  }

  std::string geom() {
    std::string text = "<geom";
    if (one_of(4) == 0) text += " class='seen'";
    if (one_of(4) == 0) {
      text += " contype='" + std::to_string(1 << one_of(2)) + "' conaffinity='" +
              std::to_string(1 << one_of(2)) + "' rgba='1 1 1 1'";
    }
    const int kind = one_of(8);
    constexpr const char* kTypes[] = {"sphere", "capsule", "cylinder", "box", "ellipsoid"};
    if (kind < 5) {
      text += std::string(" type='") + kTypes[kind] + "'";
      const bool is_long = kind > 0 && one_of(2) == 0;
      text += " size='" + vector(3, .05, .5) + "'";
      text += is_long ? " fromto='" + vector(6, -1, 1) + "'" : place();
    } else if (kind < 7) {
      // By default MuJoCo 2.2 only approximates the volume of a mesh.
      text += " type='mesh' mass='2' mesh='" + std::string(kind == 5 ? "solid'" : "hull'");
      text += place();
    } else {
      text = "<geom class='thin'" + place();
    }
    return text + "/>\n";
  }

  // Only the last joint of a body may be a ball.
  std::string joint(bool is_last) {
    std::string text = "<joint name='j" + std::to_string(joints_++) + "'";
    const int kind = is_last ? one_of(5) : one_of(3);
    if (kind == 4) return text + " class='thin' ref='" + std::to_string(number(-1, 1)) + "'/>\n";
    if (kind == 3) return text + " type='ball' pos='" + vector(3, -1, 1) + "'/>\n";
    text += kind == 2 ? " type='slide'" : " type='hinge'";
    if (one_of(2) == 0) text += " pos='" + vector(3, -1, 1) + "'";
    if (one_of(2) == 0) text += " axis='" + vector(3, -1, 1) + "'";
    if (one_of(2) == 0)
      text += " ref='" + std::to_string(kind == 2 ? number(-1, 1) : angle()) + "'";
    return text + "/>\n";
  }

  std::string body(int depth) {
    const std::string name = "b" + std::to_string(bodies_++);
    std::string text = "<body name='" + name + "'" + place();
    if (one_of(5) == 0) text += " childclass='thin'";
    text += ">\n";
    const bool is_free = depth == 0 && one_of(4) == 0;
    if (is_free) {
      text += "<freejoint name='j" + std::to_string(joints_++) + "'/>\n";
    } else {
      for (int k = one_of(4); k > 0; --k) text += joint(k == 1);
    }
    // A body that moves needs a mass, so one geom that is no flat mesh.
    text += "<geom type='sphere' size='.2' pos='" + vector(3, -1, 1) + "'/>\n";
    for (int k = one_of(3); k > 0; --k) text += geom();
    while (bodies_ < 12 && depth < 4 && one_of(2) == 0) text += body(depth + 1);
    return text + "</body>\n";
  }

  std::string exclusion() {
    if (one_of(2) == 0) return "";
    return "<exclude body1='b0' body2='b" + std::to_string(1 + one_of(bodies_ - 1)) + "'/>";
  }

  std::mt19937_64 random_;
  bool uses_degrees_ = true;
  int joints_ = 0;
  int bodies_ = 0;
};

struct Deleter {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
  void operator()(mjData* data) const { mj_deleteData(data); }
};

// One model in both programs, in the same state.
class Both {
 public:
  explicit Both(const std::filesystem::path& file) : robot(load_robot(file)) {
    char error[1000] = "";
    model.reset(mj_loadXML(file.c_str(), nullptr, error, sizeof error));
    EXPECT_NE(model, nullptr) << error;
    if (model) data.reset(mj_makeData(model.get()));
  }

  int body(const std::string& link) const {
    return mj_name2id(model.get(), mjOBJ_BODY, link.c_str());
  }
  // A plane is a link of its own here, a geom of the world there.
  int body_of_link(std::size_t link) const {
    return std::max(body(robot.chain->links()[link].name), 0);
  }

  void move(std::mt19937_64& random) {
    JointVector q(Eigen::Index(robot.free_count()));
    for (Eigen::Index k = 0; k < q.size(); ++k) q[k] = random_number(-2, 2, random);
    for (int joint = 0; joint < model->njnt; ++joint) set(joint, q);
    mj_kinematics(model.get(), data.get());
    mj_collision(model.get(), data.get());
    poses = robot.chain->link_poses(robot.expand(q));
  }

  Robot robot;
  std::unique_ptr<mjModel, Deleter> model;
  std::unique_ptr<mjData, Deleter> data;
  std::vector<RigidPose> poses;

 private:
  Scalar coordinate(const std::string& joint, const JointVector& q) const {
    return q[robot.free_index(joint).value()];
  }

  void set(int joint, const JointVector& q) {
    const std::string name = mj_id2name(model.get(), mjOBJ_JOINT, joint);
    mjtNum* address = data->qpos + model->jnt_qposadr[joint];
    const int type = model->jnt_type[joint];
    if (type == mjJNT_HINGE || type == mjJNT_SLIDE) {
      *address = coordinate(name, q);
      return;
    }
    const auto turn = [&](const char* part, const Vector3& axis) {
      return rotation_from_vector(coordinate(name + part, q) * axis);
    };
    const Matrix3 R = turn("/yaw", Vector3::UnitZ()) * turn("/pitch", Vector3::UnitY()) *
                      turn("/roll", Vector3::UnitX());
    RigidPose X(R, Vector3::Zero());
    if (type == mjJNT_FREE) {
      const Vector3 p(coordinate(name + "/x", q), coordinate(name + "/y", q),
                      coordinate(name + "/z", q));
      const mjtNum* start = model->qpos0 + model->jnt_qposadr[joint];
      const Quaternion turned(start[3], start[4], start[5], start[6]);
      X = RigidPose(turned, Vector3(start[0], start[1], start[2])) * RigidPose(R, p);
      for (int k = 0; k < 3; ++k) *address++ = X.translation()[k];
    }
    const Quaternion turned = X.quaternion();
    for (const Scalar number : {turned.w(), turned.x(), turned.y(), turned.z()})
      *address++ = number;
  }
};

// MuJoCo keeps meshes in single precision, and counts visual ones.
void expect_same_masses(const Both& both) {
  const Robot& robot = both.robot;
  for (std::size_t link = 0; link < robot.masses.size(); ++link) {
    const std::string& name = robot.chain->links()[link].name;
    const int body = both.body(name);
    const std::string note = "the mass of '" + name + "' leaves out a mesh";
    if (body < 0 || std::count(robot.notes.begin(), robot.notes.end(), note) > 0) continue;
    const Scalar mass = both.model->body_mass[body];
    EXPECT_NEAR(robot.masses[link], mass, 1e-6 * mass) << name;
  }
}

void expect_same_poses(const Both& both) {
  for (std::size_t link = 0; link < both.poses.size(); ++link) {
    const int body = both.body(both.robot.chain->links()[link].name);
    if (body < 0) continue;
    const RigidPose& X_WL = both.poses[link];
    const mjtNum* p = both.data->xpos + 3 * body;
    const mjtNum* R = both.data->xmat + 9 * body;
    for (int row = 0; row < 3; ++row) {
      ASSERT_NEAR(X_WL.translation()[row], p[row], 1e-12) << both.robot.chain->links()[link].name;
      for (int column = 0; column < 3; ++column) {
        ASSERT_NEAR(X_WL.rotation()(row, column), R[3 * row + column], 1e-12);
      }
    }
  }
}

Scalar first_hit(const Both& both, const Vector3& origin, const Vector3& direction) {
  Scalar first = kInfinity;
  for (std::size_t link = 0; link < both.poses.size(); ++link) {
    const std::shared_ptr<const Shape>& shape = both.robot.chain->links()[link].shape;
    if (!shape) continue;
    const RayHit hit = ray_cast(*shape, both.poses[link], {origin, direction});
    if (hit.status != RayStatus::Miss) first = std::min(first, hit.distance);
  }
  return first;
}

// Rays from outside. MuJoCo keeps meshes in single precision, and either program may miss by
// rounding what the ray grazes: such rays are few.
void expect_same_shapes(const Both& both, std::mt19937_64& random) {
  int different = 0;
  constexpr int kRays = 40;
  for (int k = 0; k < kRays; ++k) {
    Vector3 origin = 30 * random_direction(random);
    origin.z() = std::abs(origin.z());  // above the floor
    const Vector3 target = 3 * random_number(0, 1, random) * random_direction(random);
    const Vector3 direction = (target - origin).normalized();
    int geom = -1;
    const mjtNum there = mj_ray(both.model.get(), both.data.get(), origin.data(), direction.data(),
                                nullptr, 1, -1, &geom);
    const Scalar here = first_hit(both, origin, direction);
    const bool agree = there < 0 ? here == kInfinity : std::abs(here - there) < 1e-5;
    if (!agree) ++different;
  }
  EXPECT_LE(different, 1);
}

// With margins as wide as the model, every pair that MuJoCo examines becomes a contact.
void expect_same_pairs(const Both& both) {
  using Pairs = std::set<std::pair<int, int>>;
  Pairs there;
  for (int k = 0; k < both.data->ncon; ++k) {
    const mjContact& contact = both.data->contact[k];
    there.insert(std::minmax(both.model->geom_bodyid[contact.geom1],
                             both.model->geom_bodyid[contact.geom2]));
  }
  Pairs here;
  for (const KinematicChain::LinkPair& pair : both.robot.chain->self_pairs()) {
    here.insert(std::minmax(both.body_of_link(pair.first), both.body_of_link(pair.second)));
  }
  EXPECT_EQ(here, there);
}

TEST(MujocoAgreement, HoldsForRandomModels) {
  const testing::TemporaryDirectory directory;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    const auto file = directory.write("model.xml", RandomModel(seed).text());
    Both both(file);
    ASSERT_TRUE(both.data);
    expect_same_masses(both);
    std::mt19937_64 random(seed);
    for (int state = 0; state < 3; ++state) {
      both.move(random);
      expect_same_poses(both);
      expect_same_shapes(both, random);
      expect_same_pairs(both);
    }
    if (::testing::Test::HasFailure()) return;
  }
}

// --- the adapter ---------------------------------------------------------------------------------

bool is_round(int type) {
  return type == mjGEOM_SPHERE || type == mjGEOM_CAPSULE;
}

// What MuJoCo computes in closed form.
bool is_exact(const mjModel& model, int geom1, int geom2) {
  const int a = std::min(model.geom_type[geom1], model.geom_type[geom2]);
  const int b = std::max(model.geom_type[geom1], model.geom_type[geom2]);
  return (a == mjGEOM_PLANE && is_round(b)) || (is_round(a) && is_round(b));
}

// The least distance of two geoms among the contacts, which MuJoCo lists within wide margins.
std::map<std::pair<int, int>, Scalar> contact_distances(const Both& both) {
  std::map<std::pair<int, int>, Scalar> least;
  for (int k = 0; k < both.data->ncon; ++k) {
    const mjContact& contact = both.data->contact[k];
    const auto [at, is_new] = least.try_emplace({contact.geom1, contact.geom2}, contact.dist);
    at->second = std::min(at->second, contact.dist);
  }
  return least;
}

TEST(MujocoGeoms, DistancesAreThoseOfMujocoInClosedForm) {
  const testing::TemporaryDirectory directory;
  int compared = 0;
  int overlapping = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Both both(directory.write("model.xml", RandomModel(seed).text()));
    std::mt19937_64 random(seed);
    both.move(random);
    const adapters::MujocoGeoms geoms(*both.model);
    for (const auto& [pair, expected] : contact_distances(both)) {
      if (!is_exact(*both.model, pair.first, pair.second)) continue;
      std::array<mjtNum, 6> fromto{};
      const Scalar found =
          geoms.signed_distance(*both.data, pair.first, pair.second, 1e3, fromto.data());
      const bool is_deep = expected < 0;
      EXPECT_NEAR(found, expected, is_deep ? 1e-4 : 1e-12) << seed;
      const Scalar length =
          (Vector3(fromto[3], fromto[4], fromto[5]) - Vector3(fromto[0], fromto[1], fromto[2]))
              .norm();
      EXPECT_NEAR(length, std::abs(expected), is_deep ? 1e-4 : 1e-12);
      ++compared;
      if (is_deep) ++overlapping;
    }
  }
  EXPECT_GT(compared, 500);
  EXPECT_GT(overlapping, 5);
}

// The same geometry on two ways: through the reader, and through MuJoCo's compiler, which keeps
// meshes in single precision.
TEST(MujocoGeoms, DistancesAreThoseOfTheReader) {
  const testing::TemporaryDirectory directory;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    Both both(directory.write("model.xml", RandomModel(seed).text()));
    std::mt19937_64 random(seed);
    both.move(random);
    const adapters::MujocoGeoms geoms(*both.model, adapters::MujocoGeoms::Meshes::Surfaces);
    std::map<std::pair<int, int>, Scalar> least;
    for (int a = 0; a < both.model->ngeom; ++a) {
      for (int b = a + 1; b < both.model->ngeom; ++b) {
        const bool is_visual =
            both.model->geom_rgba[4 * a + 3] == 0 || both.model->geom_rgba[4 * b + 3] == 0;
        if (is_visual) continue;
        const std::pair<int, int> bodies =
            std::minmax(both.model->geom_bodyid[a], both.model->geom_bodyid[b]);
        const auto at = least.try_emplace(bodies, kInfinity).first;
        at->second = std::min(at->second, geoms.distance(*both.data, a, b).upper);
      }
    }
    for (const KinematicChain::LinkPair& pair : both.robot.chain->self_pairs()) {
      const Link& a = both.robot.chain->links()[pair.first];
      const Link& b = both.robot.chain->links()[pair.second];
      if (as_half_space(*a.shape)) continue;  // a link of its own here, one geom of the world there
      const Scalar here =
          distance(*a.shape, both.poses[pair.first], *b.shape, both.poses[pair.second]).upper;
      const std::pair<int, int> bodies =
          std::minmax(both.body_of_link(pair.first), both.body_of_link(pair.second));
      const Scalar there = least.at(bodies);
      // The world has a floor besides its other geoms.
      if (bodies.first == 0) {
        EXPECT_LE(there, here + 1e-6);
      } else {
        EXPECT_NEAR(here, there, 1e-6);
      }
    }
  }
}

TEST(MujocoGeoms, ReadsHeightFieldsAndStopsAtTheLargestDistance) {
  const testing::TemporaryDirectory directory;
  const auto file = directory.write("model.xml", R"(<mujoco><asset>
      <hfield name="h" nrow="3" ncol="5" size="4 2 1 1"/></asset><worldbody>
      <geom type="hfield" hfield="h"/><body pos="1 1 3"><freejoint/><geom size=".5"/></body>
      </worldbody></mujoco>)");
  std::array<char, 1000> error{};
  const std::unique_ptr<mjModel, Deleter> model(
      mj_loadXML(file.c_str(), nullptr, error.data(), int(error.size())));
  ASSERT_TRUE(model) << error.data();
  for (int k = 0; k < 15; ++k) model->hfield_data[k] = 0.5F;
  const std::unique_ptr<mjData, Deleter> data(mj_makeData(model.get()));
  mj_kinematics(model.get(), data.get());
  const adapters::MujocoGeoms geoms(*model);
  std::array<mjtNum, 6> fromto{};
  EXPECT_NEAR(geoms.signed_distance(*data, 0, 1, 9, fromto.data()), 2, 1e-12);
  EXPECT_NEAR(fromto[2], 0.5, 1e-12);
  EXPECT_NEAR(fromto[5], 2.5, 1e-12);
  EXPECT_EQ(geoms.signed_distance(*data, 0, 1, 1, fromto.data()), 1);
  EXPECT_EQ(fromto[5], 0);
  EXPECT_THROW(geoms.signed_distance(*data, 0, 1, -1, nullptr), InvalidArgument);
}

}  // namespace
}  // namespace dyop
