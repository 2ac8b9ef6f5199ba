// SPDX-License-Identifier: BSD-3-Clause
#include "check/trusted/shape_reader.h"

#include "check/trusted/segments.h"

namespace dyop_check {
namespace {

// A smaller support than the true one would prove too much.
double length_at(const Json& line, const char* key) {
  const double length = line.at(key).to_number();
  if (length < 0) throw BadFile(std::string("a shape's ") + key + " is negative");
  return length;
}

std::vector<Vec> corners(const Json& line) {
  const Vec h = vector_of(line.at("half_extents").to_numbers(3));
  std::vector<Vec> points;
  for (int k = 0; k < 8; ++k)
    points.push_back({k & 1 ? h.x : -h.x, k & 2 ? h.y : -h.y, k & 4 ? h.z : -h.z});
  return points;
}

Piece half_space(const Json& line) {
  Piece piece;
  piece.kind = Piece::Kind::HalfSpace;
  const Vec normal = vector_of(line.at("normal").to_numbers(3));
  const double length = norm(normal);
  if (!(length > 0) || !std::isfinite(length)) throw BadFile("a half-space has no normal");
  piece.normal = (1 / length) * normal;
  piece.offset = line.at("offset").to_number();
  return piece;
}

Piece simple(const std::string& kind, const Json& line) {
  if (kind == "half_space") return half_space(line);
  Piece piece;
  const auto with_ends = [&](Piece::Kind core, double below, double above) {
    piece.kind = core;
    piece.size = {below, above, length_at(line, "half_length")};
  };
  if (kind == "box" || kind == "rounded_box") {
    piece.points = corners(line);
  } else if (kind == "sphere") {
    piece.points = {{}};
  } else if (kind == "capsule") {
    const double h = length_at(line, "half_length");
    piece.points = {{0, 0, -h}, {0, 0, h}};
  } else if (kind == "cylinder" || kind == "rounded_cylinder") {
    const double r = length_at(line, "radius");
    with_ends(Piece::Kind::Discs, r, r);
  } else if (kind == "cone") {
    with_ends(Piece::Kind::Discs, length_at(line, "radius"), 0);
  } else if (kind == "tapered_capsule") {
    with_ends(Piece::Kind::Balls, length_at(line, "bottom_radius"), length_at(line, "top_radius"));
  } else if (kind == "ellipsoid") {
    piece.kind = Piece::Kind::Ellipsoid;
    piece.size = vector_of(line.at("semi_axes").to_numbers(3));
  } else {
    throw BadFile("the kind of shape '" + kind + "' is unknown");
  }
  if (kind == "rounded_box" || kind == "sphere" || kind == "capsule")
    piece.radius = length_at(line, "radius");
  if (kind == "rounded_cylinder") piece.radius = length_at(line, "edge_radius");
  return piece;
}

}  // namespace

Piece placed(const Pose& X, Piece piece) {
  if (piece.kind == Piece::Kind::HalfSpace) throw BadFile("a compound holds a half-space");
  for (Vec& point : piece.points) point = X * point;
  piece.X = X * piece.X;
  return piece;
}

std::vector<Piece> ShapeReader::pieces(std::size_t shape, int depth) const {
  const Json& line = lines_.at(shape);
  const std::string& kind = line.at("kind").text;
  if (kind == "mesh") return triangles_of(line);
  if (kind == "compound") return children_of(shape, depth);
  if (kind != "hull") return {simple(kind, line)};
  Piece hull;
  hull.points = points_of(line);
  if (line.find("radius")) hull.radius = length_at(line, "radius");
  return {hull};
}

Vec ShapeReader::vertex(std::size_t number) const {
  if (3 * number + 2 >= vertices_.size()) throw BadFile("a vertex is out of range");
  const Vec v = vector_of(vertices_, 3 * number);
  if (!std::isfinite(v.x + v.y + v.z)) throw BadFile("a vertex is not finite");
  return v;
}

const Json& ShapeReader::mesh_line(std::size_t mesh) const {
  const Json& line = lines_.at(mesh);
  if (line.at("kind").text != "mesh") throw BadFile("a surface that deforms is no mesh");
  return line;
}

std::vector<Vec> ShapeReader::vertices(std::size_t mesh) const {
  return points_of(mesh_line(mesh));
}

std::vector<std::int32_t> ShapeReader::corners(std::size_t mesh) const {
  triangles_of(mesh_line(mesh));  // throws where one is out of range
  const Json& line = mesh_line(mesh);
  const auto first = triangles_.begin() + std::ptrdiff_t(3 * line.at("first_triangle").to_number());
  return {first, first + std::ptrdiff_t(3 * line.at("triangle_count").to_number())};
}

std::vector<Vec> ShapeReader::points_of(const Json& line) const {
  const std::size_t first = index_of(line.at("first_vertex"), vertices_.size() + 1);
  const std::size_t count = index_of(line.at("vertex_count"), vertices_.size() + 1);
  std::vector<Vec> points;
  for (std::size_t k = 0; k < count; ++k) points.push_back(vertex(first + k));
  if (points.empty()) throw BadFile("a hull has no points");
  return points;
}

std::vector<Piece> ShapeReader::triangles_of(const Json& line) const {
  const std::size_t first_vertex = index_of(line.at("first_vertex"), vertices_.size() + 1);
  const std::size_t first = index_of(line.at("first_triangle"), triangles_.size() + 1);
  const std::size_t count = index_of(line.at("triangle_count"), triangles_.size() + 1);
  if (count == 0 || first + count > triangles_.size() / 3)
    throw BadFile("a mesh has no triangles, or they are out of range");
  const std::size_t vertex_count = index_of(line.at("vertex_count"), vertices_.size() + 1);
  std::vector<Piece> pieces(count);
  for (std::size_t k = 0; k < 3 * count; ++k) {
    const std::int32_t corner = triangles_[3 * first + k];
    if (corner < 0 || std::size_t(corner) >= vertex_count)
      throw BadFile("a triangle is out of range");
    pieces[k / 3].points.push_back(vertex(first_vertex + std::size_t(corner)));
  }
  return pieces;
}

std::vector<Piece> ShapeReader::children_of(std::size_t shape, int depth) const {
  constexpr int kMostNested = 20;
  constexpr std::size_t kMostPieces = 5'000'000;
  if (depth > kMostNested) throw BadFile("compounds are nested too deeply");
  std::vector<Piece> all;
  for (const Json& child : lines_[shape].at("children").list) {
    const std::size_t number = index_of(child.at("shape"), lines_.size());
    if (number >= shape) throw BadFile("a compound contains what comes after it");
    const Pose pose = pose_of(child.at("X_CS"));
    for (Piece& piece : pieces(number, depth + 1)) all.push_back(placed(pose, std::move(piece)));
    if (all.size() > kMostPieces) throw BadFile("a compound has too many pieces");
  }
  if (all.empty()) throw BadFile("a compound has no children");
  return all;
}

}  // namespace dyop_check
