// SPDX-License-Identifier: BSD-3-Clause

// 2. Meshes from files, the distance between them, and the distance of a point.
#include <dyop/dyop.h>
#include <dyop/io/mesh_file.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

int main() {
  // A roof: a prism over a 4 x 2 rectangle with its ridge at height 1. OBJ, STL, PLY, OFF, glTF ...
  const std::filesystem::path file = std::filesystem::temp_directory_path() / "dyop_roof.obj";
  std::ofstream(file) << "v -2 -1 0\nv 2 -1 0\nv 2 1 0\nv -2 1 0\nv -2 0 1\nv 2 0 1\n"
                         "f 4 3 2 1\nf 1 2 6 5\nf 3 4 5 6\nf 4 1 5\nf 2 3 6\n";
  const dyop::TriangleMesh roof = dyop::load_mesh(file);
  std::printf("roof: %zu vertices, %zu triangles, %s\n", roof.vertices().size(),
              roof.triangles().size(), roof.is_closed() ? "closed" : "open");
  std::printf("mass at density 2: %.6f\n", roof.compute_mass_properties(2).mass);

  // The distance comes with proven bounds: lower <= d <= upper, rounding included.
  const dyop::RigidPose here;
  const dyop::RigidPose above(dyop::Vector3(0, 0, 3));
  const dyop::DistanceResult gap = dyop::distance(roof, here, roof, above);
  std::printf("a roof over it: %.6f, bounds %s apart, triangle %d below\n", gap.lower,
              gap.upper - gap.lower < 1e-12 ? "less than 1e-12" : "more", *gap.triangle_a);

  // Distance of a point. With signs, a closed mesh is a solid, and distances inside are negative.
  dyop::PointDistanceOptions options;
  options.is_signed = true;
  for (const double z : {2.0, 0.25}) {
    const dyop::PointDistance d = dyop::point_distance(roof, here, {0, 0.5, z}, options);
    std::printf("point at height %.2f: %+.6f, nearest (%.3f, %.3f, %.3f)\n", z, d.lower, d.p_WC.x(),
                d.p_WC.y(), d.p_WC.z());
  }

  // A damaged file gives an error that names the line, never half a mesh.
  std::ofstream(file) << "v 0 0 0\nv 1 0 0\nv 0 1 zero\nf 1 2 3\n";
  try {
    dyop::load_mesh(file);
  } catch (const dyop::Error& error) {
    const std::string words = error.what();
    std::printf("refused: %s\n", words.substr(words.find("roof.obj")).c_str());
  }
  std::filesystem::remove(file);
}
// Prints:
// roof: 6 vertices, 8 triangles, closed
// mass at density 2: 8.000000
// a roof over it: 2.000000, bounds less than 1e-12 apart, triangle 7 below
// point at height 2.00: +1.118034, nearest (0.000, 0.000, 1.000)
// point at height 0.25: -0.176777, nearest (0.000, 0.625, 0.375)
// refused: roof.obj:3: vertex z: expected a finite number, found 'zero'
