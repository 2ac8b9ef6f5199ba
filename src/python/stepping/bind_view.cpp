// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "dyop/motion/steady_motions.h"
#include "dyop/view/page_encoder.h"
#include "dyop/view/run_files.h"
#include "python/bindings.h"
#include "python/glue/arguments.h"

namespace dyop::python {
namespace {

// A shape that is shown: name, shape, pose or motion.
using Shown = std::tuple<std::string, std::shared_ptr<const Shape>, py::object>;

// The part of an interval where a motion is defined; a pose holds from its beginning.
PageSegment segment_of(std::size_t slot, const py::object& X_WB, const TimeInterval& interval) {
  if (!py::isinstance<Motion>(X_WB)) {
    const TimeInterval instant{interval.begin, interval.begin};
    return {BodyId(slot), instant, std::make_shared<RestMotion>(pose_of(X_WB))};
  }
  const auto motion = X_WB.cast<std::shared_ptr<const Motion>>();
  const TimeInterval domain = motion->domain();
  const TimeInterval part{std::max(interval.begin, domain.begin),
                          std::min(interval.end, domain.end)};
  DYOP_REQUIRE(part.begin <= part.end, "a motion is defined from ", domain.begin, " to ",
               domain.end, " only, not where it is to be shown");
  return {BodyId(slot), part, motion};
}

std::string shown_page(const std::string& title, const std::vector<Shown>& shown,
                       const IntervalArgument& interval) {
  PageScene scene;
  scene.title = title;
  scene.begin_time = interval.interval.begin;
  scene.end_time = interval.interval.end;
  PageSpan span;
  for (const auto& [name, shape, X_WB] : shown) {
    DYOP_REQUIRE(shape, "'", name, "' has no shape");
    const bool moves = py::isinstance<Motion>(X_WB);
    PageBody body;
    body.name = name;
    body.kind = moves ? BodyKind::Kinematic : BodyKind::Static;
    body.shape = shape;
    span.segments.push_back(segment_of(scene.bodies.size(), X_WB, interval.interval));
    scene.bodies.push_back(std::move(body));
  }
  span.steps.push_back(interval.interval);
  const py::gil_scoped_release unlocked;
  const PageEncoder encoder(std::move(scene));
  const std::vector<std::string> blocks{encoder.head(), encoder.span(span)};
  return page_html(title, blocks);
}

}  // namespace

void bind_view(py::module_& m) {
  m.def("has_page", &has_page, "Whether this dyop was built with the page that shows runs.");
  m.def("page_html", &shown_page, py::arg("title"), py::arg("bodies"), py::arg("interval"),
        "A page (docs/player.md) that shows bodies over an interval (begin, end): tuples (name,\n"
        "shape, pose or Motion).");
  m.def(
      "recorded_page_html",
      [](const py::object& file) {
        const std::filesystem::path path = path_of(file);
        const py::gil_scoped_release unlocked;
        return recorded_page_html(path);
      },
      py::arg("file"), "The page (docs/player.md) of a recorded run.");
  // What a notebook asks of a value, and what a reader does.
  for (const char* name :
       {"Shape", "Robot", "PlanningScene", "ObstacleSet", "Scene", "World", "RecordingReader"}) {
    if (!py::hasattr(m, name)) continue;
    const py::object type = m.attr(name);
    type.attr("_repr_html_") = py::cpp_function(
        [](const py::object& self) {
          return py::module_::import("dyop._view").attr("repr_html")(self);
        },
        py::name("_repr_html_"), py::is_method(type));
    type.attr("show") = py::cpp_function(
        [](const py::object& self, const py::args& args, const py::kwargs& options) {
          py::module_::import("dyop._view").attr("view")(self, *args, **options).attr("show")();
        },
        py::name("show"), py::is_method(type),
        "Shows it: dyop.view() with the same arguments, in the notebook or the browser.");
  }
}

}  // namespace dyop::python
