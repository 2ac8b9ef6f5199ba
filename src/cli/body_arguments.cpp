// SPDX-License-Identifier: BSD-3-Clause
#include "cli/body_arguments.h"

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <sstream>
#include <system_error>

#include "cli/suggestion.h"
#include "dyop/io/motion_file.h"
#include "dyop/motion/steady_motions.h"
#include "geometry/shape_forms.h"

namespace dyop::cli {
namespace {

Vector3 vector_or_zero(const std::vector<Scalar>& numbers) {
  return numbers.empty() ? Vector3::Zero() : Vector3(numbers[0], numbers[1], numbers[2]);
}

// The numbers after the colon of a primitive shape.
std::vector<Scalar> parse_sizes(const std::string& text, std::size_t count) {
  std::vector<Scalar> sizes;
  std::size_t begin = text.find(':') + 1;
  while (begin <= text.size()) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    Scalar value = 0;
    const auto [stop, error] = std::from_chars(text.data() + begin, text.data() + end, value);
    DYOP_REQUIRE(error == std::errc() && stop == text.data() + end, "expected a number, found '",
                 text.substr(begin, end - begin), "'");
    sizes.push_back(value);
    begin = end + 1;
  }
  DYOP_REQUIRE(sizes.size() == count, "expected ", count, " numbers, found ", sizes.size());
  return sizes;
}

// A word before a colon is that of a shape, unless there is such a file.
void require_shape_or_file(const std::string& text) {
  const std::size_t colon = text.find(':');
  std::error_code ignored;
  if (colon == std::string::npos || std::filesystem::exists(text, ignored)) return;
  std::vector<std::string> words;
  for (const geometry_internal::ShapeForm& form : geometry_internal::shape_forms()) {
    words.emplace_back(form.name);
  }
  throw InvalidArgument("there is no such file, and no shape '" + text.substr(0, colon) + "'" +
                        suggestion(text.substr(0, colon), words));
}

MeshPlacement make_placement(const PlacementArguments& arguments) {
  MeshPlacement placement;
  placement.scale = arguments.scale;
  if (arguments.center == "bounds") placement.center = MeshCenter::Bounds;
  if (arguments.center == "mass") placement.center = MeshCenter::Mass;
  return placement;
}

}  // namespace

std::string require_count(const std::string& text) {
  std::int64_t value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  const bool is_count = error == std::errc() && stop == end && value > 0;
  return is_count ? "" : "expected an integer from 1 to 2^63 - 1, found '" + text + "'";
}

std::string require_positive(const std::string& text) {
  Scalar value = 0;
  const bool is_right = CLI::detail::lexical_cast(text, value) && value > 0 && value < kInfinity;
  return is_right ? "" : "expected a finite number > 0, found '" + text + "'";
}

std::string require_non_negative(const std::string& text) {
  Scalar value = 0;
  const bool is_right = CLI::detail::lexical_cast(text, value) && value >= 0 && value < kInfinity;
  return is_right ? "" : "expected a finite number >= 0, found '" + text + "'";
}

void add_placement_options(CLI::App& app, PlacementArguments& placement) {
  app.add_option("--scale", placement.scale, "Scale of meshes, > 0")->capture_default_str();
  app.add_option("--center", placement.center,
                 "Origin of a mesh: none (as in the file), centre of its bounds, "
                 "or centre of mass")
      ->check(CLI::IsMember({"none", "bounds", "mass"}))
      ->capture_default_str();
}

void add_pose_options(CLI::App& app, BodyArguments& body) {
  const std::string group = "Body " + body.side;
  app.add_option(body.option("position"), body.position, "Position x y z of its origin")
      ->expected(3)
      ->group(group);
  auto* quaternion = app.add_option(body.option("rotation"), body.quaternion,
                                    "Rotation as a unit quaternion w x y z")
                         ->expected(4)
                         ->group(group);
  app.add_option(body.option("axis-angle"), body.axis_angle,
                 "Rotation as an axis x y z and an angle in degrees")
      ->expected(4)
      ->excludes(quaternion)
      ->group(group);
  app.add_option(body.option("scale"), body.scale, "Scale of its mesh, overrides --scale")
      ->group(group);
}

void add_motion_options(CLI::App& app, BodyArguments& body) {
  const std::string group = "Body " + body.side;
  app.add_option(body.option("velocity"), body.velocity, "Constant velocity x y z of its origin")
      ->expected(3)
      ->group(group);
  app.add_option(body.option("spin"), body.spin,
                 "Constant angular velocity x y z, radians per unit of time")
      ->expected(3)
      ->group(group);
  auto* motion = app.add_option(body.option("motion"), body.motion_file,
                                "Motion from a JSON file (docs/formats.md)")
                     ->group(group);
  for (const char* other : {"position", "rotation", "axis-angle", "velocity", "spin"}) {
    motion->excludes(app.get_option(body.option(other)));
  }
}

std::shared_ptr<const Shape> make_shape(const BodyArguments& body, PlacementArguments placement) {
  placement.scale = body.scale.value_or(placement.scale);
  return make_shape(body.shape, placement);
}

std::shared_ptr<const Shape> make_shape(const std::string& text,
                                        const PlacementArguments& placement) {
  DYOP_REQUIRE(!text.empty(), "expected a mesh file or a shape, found ''");
  return guard_option(text, [&]() -> std::shared_ptr<const Shape> {
    for (const geometry_internal::ShapeForm& form : geometry_internal::shape_forms()) {
      if (!text.starts_with(std::string(form.name) + ":")) continue;
      return form.make(parse_sizes(text, form.value_count()));
    }
    require_shape_or_file(text);
    return std::make_shared<TriangleMesh>(place_mesh(load_mesh(text), make_placement(placement)));
  });
}

RigidPose make_pose(const BodyArguments& body) {
  const Vector3 p = vector_or_zero(body.position);
  if (!body.quaternion.empty()) {
    const Quaternion q(body.quaternion[0], body.quaternion[1], body.quaternion[2],
                       body.quaternion[3]);
    return guard_option(body.option("rotation"), [&] { return RigidPose(q, p); });
  }
  if (!body.axis_angle.empty()) {
    return guard_option(body.option("axis-angle"), [&] {
      const Vector3 axis = vector_or_zero(body.axis_angle);
      const Scalar degrees = body.axis_angle[3];
      DYOP_REQUIRE(axis.allFinite() && !axis.isZero(0),
                   "the axis must be finite and not zero, not ", axis.transpose());
      DYOP_REQUIRE(std::isfinite(degrees), "the angle must be finite, not ", degrees);
      const Scalar angle = degrees * std::numbers::pi / 180;
      return RigidPose(Quaternion(Eigen::AngleAxis<Scalar>(angle, axis.stableNormalized())), p);
    });
  }
  return guard_option(body.option("position"), [&] { return RigidPose(p); });
}

std::shared_ptr<const Motion> make_motion(const BodyArguments& body) {
  if (!body.motion_file.empty()) return load_motion(body.motion_file);
  const RigidPose X_WB0 = make_pose(body);
  if (body.velocity.empty() && body.spin.empty()) return std::make_shared<RestMotion>(X_WB0);
  const Twist twist{vector_or_zero(body.velocity), vector_or_zero(body.spin)};
  return guard_option(body.option("velocity") + ", " + body.option("spin"),
                      [&] { return std::make_shared<ConstantTwistMotion>(X_WB0, twist); });
}

std::vector<std::filesystem::path> mesh_directories(const std::vector<std::string>& mesh_path) {
  std::vector<std::filesystem::path> directories(mesh_path.begin(), mesh_path.end());
  if (const char* variable = std::getenv("DYOP_MESH_PATH")) {
    std::istringstream list(variable);
    for (std::string directory; std::getline(list, directory, ':');) {
      if (!directory.empty()) directories.emplace_back(directory);
    }
  }
  return directories;
}

}  // namespace dyop::cli
