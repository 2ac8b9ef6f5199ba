// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/shape.h"
#include "dyop/geometry/triangle_mesh.h"

/// The one list of the shapes that a few numbers define. Scenes, query records, recordings, the
/// player and the command line read and write shapes through it, so none of them names a shape.
namespace dyop::geometry_internal {

/// A number that defines a shape, or a vector of three; called like its getter.
struct ShapeNumber {
  std::string_view name;
  std::size_t count = 1;
};

/// A kind of shape that a few numbers define.
struct ShapeForm {
  std::string_view name;  ///< in files and commands
  std::vector<ShapeNumber> numbers;
  /// The values of all numbers, one after another; empty if the shape is of another form.
  std::vector<Scalar> (*read)(const Shape& shape);
  /// The shape of value_count() values.
  /// @throws InvalidArgument if a value is out of range.
  std::shared_ptr<const Shape> (*make)(std::span<const Scalar> values);

  DYOP_EXPORT std::size_t value_count() const;
};

DYOP_EXPORT std::span<const ShapeForm> shape_forms();

/// Null if no form has this name.
DYOP_EXPORT const ShapeForm* find_shape_form(std::string_view name);

/// A shape with the numbers that define it.
struct FormedShape {
  const ShapeForm* form;
  std::vector<Scalar> values;

  /// Calls f(name, values of this number) for each number.
  template <typename Function>
  void for_each_number(Function f) const;
};

/// @throws InvalidArgument if no form describes the shape: one of the user's own.
DYOP_EXPORT FormedShape formed_shape(const Shape& shape);

/// Makes a sink of several functions.
template <typename... Functions>
struct ShapeSink : Functions... {
  using Functions::operator()...;
};
template <typename... Functions>
ShapeSink(Functions...) -> ShapeSink<Functions...>;

/// Calls `sink` with the shape as what it is: a TriangleMesh, ConvexHull, CompoundShape or
/// FormedShape.
/// @throws InvalidArgument if it is one of the user's own.
template <typename Sink>
decltype(auto) visit_shape(const Shape& shape, Sink&& sink) {
  if (shape.kind() == ShapeKind::TriangleMesh) {
    return sink(static_cast<const TriangleMesh&>(shape));
  }
  if (shape.kind() == ShapeKind::Compound) return sink(static_cast<const CompoundShape&>(shape));
  if (const auto* hull = dynamic_cast<const ConvexHull*>(&shape)) return sink(*hull);
  return sink(static_cast<const FormedShape&>(formed_shape(shape)));
}

template <typename Function>
void FormedShape::for_each_number(Function f) const {
  std::size_t first = 0;
  for (const ShapeNumber& number : form->numbers) {
    f(number.name, std::span<const Scalar>(values).subspan(first, number.count));
    first += number.count;
  }
}

}  // namespace dyop::geometry_internal
