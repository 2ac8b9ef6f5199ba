// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <memory>

#include "cli/picture/query_picture.h"
#include "dyop/io/file_error.h"

#ifdef DYOP_HAS_RSVG
#include <cairo.h>
#include <librsvg/rsvg.h>
#endif

namespace dyop::cli {

#ifdef DYOP_HAS_RSVG

namespace {

// Pixels of the PNG for one of the SVG.
constexpr double kPixelsOfOne = 2;

struct Unref {
  void operator()(RsvgHandle* handle) const { g_object_unref(handle); }
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};

cairo_status_t append(void* bytes, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace

std::string png_of(const std::filesystem::path& file, const std::string& svg) {
  const std::unique_ptr<RsvgHandle, Unref> handle(
      rsvg_handle_new_from_data(reinterpret_cast<const guint8*>(svg.data()), svg.size(), nullptr));
  double width = 0;
  double height = 0;
  if (!handle || rsvg_handle_get_intrinsic_size_in_pixels(handle.get(), &width, &height) == 0) {
    throw FileError(file, "cannot be drawn by librsvg");
  }
  const RsvgRectangle all{0, 0, std::ceil(kPixelsOfOne * width), std::ceil(kPixelsOfOne * height)};
  const std::unique_ptr<cairo_surface_t, Unref> surface(cairo_image_surface_create(
      CAIRO_FORMAT_RGB24, static_cast<int>(all.width), static_cast<int>(all.height)));
  const std::unique_ptr<cairo_t, Unref> context(cairo_create(surface.get()));
  std::string png;
  const bool is_drawn =
      rsvg_handle_render_document(handle.get(), context.get(), &all, nullptr) != 0 &&
      cairo_surface_write_to_png_stream(surface.get(), &append, &png) == CAIRO_STATUS_SUCCESS;
  if (!is_drawn) throw FileError(file, "cannot be drawn by librsvg");
  return png;
}

#else

std::string png_of(const std::filesystem::path& file, const std::string&) {
  throw FileError(file,
                  "this dyop was built without librsvg (on Debian: librsvg2-dev); "
                  ".svg and .html need nothing");
}

#endif

}  // namespace dyop::cli
