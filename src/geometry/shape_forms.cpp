// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/shape_forms.h"

#include <algorithm>
#include <array>

#include "dyop/core/error.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/primitives.h"

namespace dyop::geometry_internal {
namespace {

using Values = std::vector<Scalar>;
using Made = std::shared_ptr<const Shape>;

Values values_of(const Sphere& sphere) {
  return {sphere.radius()};
}

Values values_of(const Box& box) {
  const Vector3 half_extents = box.half_extents();
  return {half_extents.x(), half_extents.y(), half_extents.z()};
}

Values values_of(const Capsule& capsule) {
  return {capsule.radius(), capsule.half_length()};
}

Values values_of(const Cylinder& cylinder) {
  return {cylinder.radius(), cylinder.half_length()};
}

Values values_of(const Cone& cone) {
  return {cone.radius(), cone.half_length()};
}

Values values_of(const Ellipsoid& ellipsoid) {
  const Vector3& semi_axes = ellipsoid.semi_axes();
  return {semi_axes.x(), semi_axes.y(), semi_axes.z()};
}

Values values_of(const RoundedBox& box) {
  const Vector3 half_extents = box.half_extents();
  return {half_extents.x(), half_extents.y(), half_extents.z(), box.radius()};
}

Values values_of(const RoundedCylinder& cylinder) {
  return {cylinder.radius(), cylinder.half_length(), cylinder.edge_radius()};
}

Values values_of(const TaperedCapsule& capsule) {
  return {capsule.bottom_radius(), capsule.top_radius(), capsule.half_length()};
}

Values values_of(const HalfSpace& half_space) {
  const Vector3& normal = half_space.normal();
  return {normal.x(), normal.y(), normal.z(), half_space.offset()};
}

// A form whose numbers are those of values_of(const Type&).
template <typename Type>
ShapeForm form(std::string_view name, std::vector<ShapeNumber> numbers,
               Made (*make)(std::span<const Scalar> values)) {
  const auto read = [](const Shape& shape) {
    const auto* typed = dynamic_cast<const Type*>(&shape);
    return typed == nullptr ? Values{} : values_of(*typed);
  };
  return {name, std::move(numbers), read, make};
}

}  // namespace

std::span<const ShapeForm> shape_forms() {
  static const std::array forms{
      form<Sphere>(
          "sphere", {{"radius"}},
          [](std::span<const Scalar> x) -> Made { return std::make_shared<Sphere>(x[0]); }),
      form<Box>("box", {{"half_extents", 3}},
                [](std::span<const Scalar> x) -> Made {
                  return std::make_shared<Box>(Vector3(x[0], x[1], x[2]));
                }),
      form<Capsule>(
          "capsule", {{"radius"}, {"half_length"}},
          [](std::span<const Scalar> x) -> Made { return std::make_shared<Capsule>(x[0], x[1]); }),
      form<Cylinder>(
          "cylinder", {{"radius"}, {"half_length"}},
          [](std::span<const Scalar> x) -> Made { return std::make_shared<Cylinder>(x[0], x[1]); }),
      form<Cone>(
          "cone", {{"radius"}, {"half_length"}},
          [](std::span<const Scalar> x) -> Made { return std::make_shared<Cone>(x[0], x[1]); }),
      form<Ellipsoid>("ellipsoid", {{"semi_axes", 3}},
                      [](std::span<const Scalar> x) -> Made {
                        return std::make_shared<Ellipsoid>(Vector3(x[0], x[1], x[2]));
                      }),
      form<RoundedBox>("rounded_box", {{"half_extents", 3}, {"radius"}},
                       [](std::span<const Scalar> x) -> Made {
                         return std::make_shared<RoundedBox>(Vector3(x[0], x[1], x[2]), x[3]);
                       }),
      form<RoundedCylinder>("rounded_cylinder", {{"radius"}, {"half_length"}, {"edge_radius"}},
                            [](std::span<const Scalar> x) -> Made {
                              return std::make_shared<RoundedCylinder>(x[0], x[1], x[2]);
                            }),
      form<TaperedCapsule>("tapered_capsule", {{"bottom_radius"}, {"top_radius"}, {"half_length"}},
                           [](std::span<const Scalar> x) -> Made {
                             return std::make_shared<TaperedCapsule>(x[0], x[1], x[2]);
                           }),
      form<HalfSpace>("half_space", {{"normal", 3}, {"offset"}},
                      [](std::span<const Scalar> x) -> Made {
                        return std::make_shared<HalfSpace>(Vector3(x[0], x[1], x[2]), x[3]);
                      }),
  };
  return forms;
}

std::size_t ShapeForm::value_count() const {
  std::size_t count = 0;
  for (const ShapeNumber& number : numbers) count += number.count;
  return count;
}

const ShapeForm* find_shape_form(std::string_view name) {
  const std::span<const ShapeForm> forms = shape_forms();
  const auto found = std::find_if(forms.begin(), forms.end(),
                                  [&](const ShapeForm& form) { return form.name == name; });
  return found == forms.end() ? nullptr : &*found;
}

FormedShape formed_shape(const Shape& shape) {
  for (const ShapeForm& form : shape_forms()) {
    Values values = form.read(shape);
    if (!values.empty()) return {&form, std::move(values)};
  }
  throw InvalidArgument("a shape that is none of dyop's own cannot be written");
}

}  // namespace dyop::geometry_internal
