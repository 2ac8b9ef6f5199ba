// SPDX-License-Identifier: BSD-3-Clause
#include "cli/picture/shaded_image.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>

namespace dyop::cli {
namespace {

// An edge is drawn where the depth bends by more than this across a pixel, in pixels, or the light
// changes by more.
constexpr float kDepthOfEdge = 4;
constexpr float kLightOfEdge = 0.14F;
constexpr Scalar kDarknessOfEdge = 0.45;

void put_number(std::string& bytes, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) {
    bytes.push_back(static_cast<char>((value >> shift) & 0xFFU));
  }
}

void put_chunk(std::string& file, const std::string& kind, const std::string& data) {
  put_number(file, static_cast<std::uint32_t>(data.size()));
  const std::string body = kind + data;
  file += body;
  const auto* bytes = reinterpret_cast<const Bytef*>(body.data());
  put_number(file, static_cast<std::uint32_t>(crc32(0, bytes, static_cast<uInt>(body.size()))));
}

std::string deflated(const std::string& bytes) {
  uLongf length = compressBound(static_cast<uLong>(bytes.size()));
  std::string result(length, '\0');
  compress(reinterpret_cast<Bytef*>(result.data()), &length,
           reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uLong>(bytes.size()));
  result.resize(length);
  return result;
}

std::uint8_t mixed(std::uint8_t below, Scalar above, Scalar opacity) {
  const Scalar value = (1 - opacity) * Scalar(below) + opacity * above;
  return static_cast<std::uint8_t>(std::clamp(value, Scalar(0), Scalar(255)));
}

}  // namespace

Vector2 Camera::project(const Vector3& p_W) const {
  const Vector3 d = p_W - center_W;
  return {width / 2.0 + pixels_per_length * right_W.dot(d),
          height / 2.0 - pixels_per_length * up_W.dot(d)};
}

ShadedImage::ShadedImage(const Camera& camera)
    : camera_(camera),
      pixels_(std::size_t(camera.width) * std::size_t(camera.height)),
      depth_(pixels_.size(), -std::numeric_limits<float>::infinity()) {}

void ShadedImage::draw(const view_internal::ShapeSurface& surface, const RigidPose& X_WB,
                       Rgb colour, Scalar opacity) {
  std::vector<Sample> samples(pixels_.size());
  for (const TriangleIndices& t : surface.triangles) {
    draw_triangle(samples, {X_WB * surface.vertices[std::size_t(t[0])],
                            X_WB * surface.vertices[std::size_t(t[1])],
                            X_WB * surface.vertices[std::size_t(t[2])]});
  }
  blend(samples, colour, opacity);
}

void ShadedImage::draw_triangle(std::vector<Sample>& samples,
                                const std::array<Vector3, 3>& corners) const {
  const Vector3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  if (!(normal.norm() > 0)) return;
  const Vector3 lamp = (camera_.back_W + 0.8 * camera_.up_W - 0.5 * camera_.right_W).normalized();
  const Vector3 seen = normal.dot(camera_.back_W) < 0 ? Vector3(-normal) : normal;
  const auto light =
      static_cast<float>(0.42 + 0.58 * std::max(Scalar(0), lamp.dot(seen.normalized())));
  std::array<Vector2, 3> p;
  std::array<Scalar, 3> depth;
  for (std::size_t k = 0; k < 3; ++k) {
    p[k] = camera_.project(corners[k]);
    depth[k] = camera_.pixels_per_length * camera_.back_W.dot(corners[k] - camera_.center_W);
  }
  const auto cross = [](const Vector2& u, const Vector2& v) {
    return u.x() * v.y() - u.y() * v.x();
  };
  const Scalar area = cross(p[1] - p[0], p[2] - p[0]);
  if (area == 0) return;
  const auto limit = [](Scalar x, int size) { return int(std::clamp(x, Scalar(0), Scalar(size))); };
  const auto [x_least, x_most] = std::minmax({p[0].x(), p[1].x(), p[2].x()});
  const auto [y_least, y_most] = std::minmax({p[0].y(), p[1].y(), p[2].y()});
  for (int y = limit(std::floor(y_least), camera_.height); y < limit(y_most + 1, camera_.height);
       ++y) {
    for (int x = limit(std::floor(x_least), camera_.width); x < limit(x_most + 1, camera_.width);
         ++x) {
      const Vector2 at(x + 0.5, y + 0.5);
      const Scalar w0 = cross(p[1] - at, p[2] - at) / area;
      const Scalar w1 = cross(p[2] - at, p[0] - at) / area;
      const Scalar w2 = 1 - w0 - w1;
      if (w0 < 0 || w1 < 0 || w2 < 0) continue;
      const auto z = static_cast<float>(w0 * depth[0] + w1 * depth[1] + w2 * depth[2]);
      Sample& sample = samples[std::size_t(y) * std::size_t(camera_.width) + std::size_t(x)];
      if (z > sample.depth) sample = {z, light, true};
    }
  }
}

void ShadedImage::blend(const std::vector<Sample>& samples, Rgb colour, Scalar opacity) {
  const auto width = std::size_t(camera_.width);
  // Across a pixel, from one neighbour to the other.
  const auto is_edge = [&](std::size_t k, std::size_t step) {
    const bool has_both = k >= step && k + step < samples.size();
    const Sample& here = samples[k];
    const Sample& before = samples[has_both ? k - step : k];
    const Sample& after = samples[has_both ? k + step : k];
    if (!before.is_there || !after.is_there) return true;
    return std::abs(before.depth + after.depth - 2 * here.depth) > kDepthOfEdge ||
           std::abs(here.light - after.light) > kLightOfEdge;
  };
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const Sample& here = samples[k];
    if (!here.is_there || here.depth < depth_[k]) continue;
    const bool is_dark = is_edge(k, 1) || is_edge(k, width);
    const Scalar light = Scalar(here.light) * (is_dark ? kDarknessOfEdge : 1);
    pixels_[k] = {mixed(pixels_[k].red, light * colour.red, opacity),
                  mixed(pixels_[k].green, light * colour.green, opacity),
                  mixed(pixels_[k].blue, light * colour.blue, opacity)};
    if (opacity >= 1) depth_[k] = here.depth;
  }
}

std::string ShadedImage::png() const {
  std::string rows;
  for (std::size_t k = 0; k < pixels_.size(); ++k) {
    if (k % std::size_t(camera_.width) == 0) rows.push_back('\0');  // no filter
    rows.push_back(static_cast<char>(pixels_[k].red));
    rows.push_back(static_cast<char>(pixels_[k].green));
    rows.push_back(static_cast<char>(pixels_[k].blue));
  }
  std::string header;
  put_number(header, static_cast<std::uint32_t>(camera_.width));
  put_number(header, static_cast<std::uint32_t>(camera_.height));
  header += std::string({8, 2, 0, 0, 0});  // eight bits each of red, green and blue
  std::string file = "\x89PNG\r\n\x1a\n";
  put_chunk(file, "IHDR", header);
  put_chunk(file, "IDAT", deflated(rows));
  put_chunk(file, "IEND", "");
  return file;
}

std::string base64(const std::string& bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    std::uint32_t group = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      group = group << 8U;
      if (k + i < bytes.size()) group |= static_cast<unsigned char>(bytes[k + i]);
    }
    for (std::size_t i = 0; i < 4; ++i) {
      const bool is_there = i == 0 || k + i - 1 < bytes.size();
      text.push_back(is_there ? kDigits[(group >> (18 - 6 * i)) & 63U] : '=');
    }
  }
  return text;
}

}  // namespace dyop::cli
