// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/view/page_encoder.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <map>

#include "dyop/core/error.h"
#include "geometry/shape_forms.h"
#include "view/column_block.h"
#include "view/motion_rows.h"
#include "view/shape_surface.h"

namespace dyop {
namespace {

using view_internal::ColumnBlock;
using view_internal::MotionRows;
using Json = nlohmann::json;

// With more bodies than this, round ones are drawn with fewer triangles.
constexpr std::size_t kManyBodies = 100;
constexpr int kFine = 4;
constexpr int kCoarse = 3;
constexpr int kMoving[] = {2, 1};  // many, while the picture moves and there is no graphics card

constexpr std::uint32_t kNoBody = ~std::uint32_t{0};

Json vector_json(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}

const char* word_of(BodyKind kind) {
  switch (kind) {
    case BodyKind::Dynamic:
      return "dynamic";
    case BodyKind::Kinematic:
      return "kinematic";
    case BodyKind::Static:
      return "static";
  }
  throw InternalError("unknown kind of body");
}

// Columns of values computed from each row of a list.
template <typename Rows>
class RowColumns {
 public:
  RowColumns(ColumnBlock& block, std::string name, const Rows& rows)
      : block_(block), name_(std::move(name)), rows_(rows) {}

  template <typename Get>
  void numbers(const char* column, Get get) {
    std::vector<double> values;
    for (const auto& row : rows_) values.push_back(double(get(row)));
    block_.add(name_ + "." + column, std::span<const double>(values));
  }
  template <typename Get>
  void vectors(const char* column, Get get) {
    std::vector<Vector3> values;
    for (const auto& row : rows_) values.push_back(get(row));
    block_.add(name_ + "." + column, std::span<const Vector3>(values));
  }
  // In single precision: for what is drawn, not computed with.
  template <typename Get>
  void rough_vectors(const char* column, Get get) {
    std::vector<float> values;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      for (const auto& row : rows_) values.push_back(float(get(row)[axis]));
    }
    block_.add(name_ + "." + column, std::span<const float>(values));
  }
  template <typename Get>
  void bytes(const char* column, Get get) {
    std::vector<std::uint8_t> values;
    for (const auto& row : rows_) values.push_back(std::uint8_t(get(row)));
    block_.add(name_ + "." + column, std::span<const std::uint8_t>(values));
  }
  template <typename Get>
  void bodies(const char* column, Get get) {
    std::vector<std::uint32_t> values;
    for (const auto& row : rows_) values.push_back(get(row).slot);
    block_.add(name_ + "." + column, std::span<const std::uint32_t>(values));
  }

 private:
  ColumnBlock& block_;
  std::string name_;
  const Rows& rows_;
};

void add_steps(ColumnBlock& block, const PageSpan& span) {
  RowColumns steps(block, "step", span.steps);
  steps.numbers("begin", [](const TimeInterval& s) { return s.begin; });
  steps.numbers("end", [](const TimeInterval& s) { return s.end; });
  RowColumns rows(block, "frame", span.frames);
  rows.numbers("begin", [](const PageFrame& f) { return f.interval.begin; });
  rows.numbers("end", [](const PageFrame& f) { return f.interval.end; });
  rows.numbers("steps", [](const PageFrame& f) { return f.work.steps; });
  rows.numbers("substeps", [](const PageFrame& f) { return f.work.substeps; });
  rows.numbers("islands", [](const PageFrame& f) { return f.work.islands; });
  rows.numbers("rounds", [](const PageFrame& f) { return f.work.rounds; });
  rows.numbers("stalls", [](const PageFrame& f) { return f.work.stalls; });
  rows.numbers("contacts", [](const PageFrame& f) { return f.work.contacts; });
  rows.numbers("unconverged", [](const PageFrame& f) { return f.work.unconverged; });
  rows.numbers("residual", [](const PageFrame& f) { return f.work.residual; });
  rows.numbers("kinetic", [](const PageFrame& f) { return f.kinetic_energy; });
  rows.numbers("potential", [](const PageFrame& f) { return f.potential_energy; });
  rows.vectors("momentum", [](const PageFrame& f) { return f.momentum_W; });
  rows.vectors("angular_momentum", [](const PageFrame& f) { return f.angular_momentum_W; });
}

const ImpactContact& contact_of(const ImpactEvent& event) {
  static const ImpactContact kNone;
  return event.toi.contact ? *event.toi.contact : kNone;
}

// A contact of an impact, with the impact's place in the list.
struct ImpactRow {
  std::uint32_t impact;
  const WorldContact* contact;
};

void add_impacts(ColumnBlock& block, const std::vector<ImpactEvent>& impacts) {
  RowColumns rows(block, "impact", impacts);
  rows.numbers("t", [](const ImpactEvent& e) { return e.t; });
  rows.numbers("t_safe", [](const ImpactEvent& e) { return e.toi.t_safe; });
  rows.numbers("t_hit", [](const ImpactEvent& e) { return e.toi.t_hit.value_or(std::nan("")); });
  rows.bodies("a", [](const ImpactEvent& e) { return e.a; });
  rows.bodies("b", [](const ImpactEvent& e) { return e.b; });
  rows.numbers("lower", [](const ImpactEvent& e) { return contact_of(e).lower; });
  rows.numbers("upper", [](const ImpactEvent& e) { return contact_of(e).upper; });
  rows.numbers("closing", [](const ImpactEvent& e) { return contact_of(e).closing_speed; });
  rows.vectors("pa", [](const ImpactEvent& e) { return contact_of(e).p_WCa; });
  rows.vectors("pb", [](const ImpactEvent& e) { return contact_of(e).p_WCb; });
  rows.vectors("normal", [](const ImpactEvent& e) { return contact_of(e).nhat_AB_W; });
  std::vector<ImpactRow> list;
  for (std::size_t k = 0; k < impacts.size(); ++k) {
    for (const WorldContact& contact : impacts[k].contacts) {
      list.push_back({std::uint32_t(k), &contact});
    }
  }
  RowColumns points(block, "hit", list);
  points.numbers("impact", [](const ImpactRow& r) { return r.impact; });
  points.bodies("a", [](const ImpactRow& r) { return r.contact->a; });
  points.bodies("b", [](const ImpactRow& r) { return r.contact->b; });
  points.vectors("pa", [](const ImpactRow& r) { return r.contact->contact.p_WCa; });
  points.vectors("pb", [](const ImpactRow& r) { return r.contact->contact.p_WCb; });
  points.vectors("normal", [](const ImpactRow& r) { return r.contact->contact.nhat_AB_W; });
  points.vectors("impulse", [](const ImpactRow& r) { return r.contact->impulse_W; });
  points.numbers("gap", [](const ImpactRow& r) { return r.contact->contact.lower; });
  points.numbers("speed", [](const ImpactRow& r) { return r.contact->normal_velocity; });
}

const Vector3 kNoPoint = Vector3::Constant(std::numeric_limits<Scalar>::quiet_NaN());

void add_gaps(ColumnBlock& block, const std::vector<PageGap>& gaps) {
  RowColumns rows(block, "gap", gaps);
  rows.numbers("t", [](const PageGap& g) { return g.t; });
  rows.bodies("a", [](const PageGap& g) { return g.a; });
  rows.bodies("b", [](const PageGap& g) { return g.b; });
  rows.numbers("lower", [](const PageGap& g) { return g.lower; });
  rows.numbers("upper", [](const PageGap& g) { return g.upper; });
  rows.bytes("resting", [](const PageGap& g) { return g.is_resting; });
  rows.bytes("proof", [](const PageGap& g) { return g.proof ? 1 + int(*g.proof) : 0; });
  rows.vectors("pa", [](const PageGap& g) { return g.witness_W ? g.witness_W->first : kNoPoint; });
  // From the point of A, so that single precision shows the narrowest gap.
  rows.rough_vectors("pb", [](const PageGap& g) -> Vector3 {
    return g.witness_W ? g.witness_W->second - g.witness_W->first : kNoPoint;
  });
  rows.rough_vectors("pivot", [](const PageGap& g) -> Vector3 {
    const Vector3 origin = g.witness_W ? g.witness_W->first : Vector3(Vector3::Zero());
    return g.pivot_W.value_or(kNoPoint) - origin;
  });
}

void add_contacts(ColumnBlock& block, const std::vector<PageContact>& contacts) {
  RowColumns rows(block, "contact", contacts);
  rows.numbers("begin", [](const PageContact& c) { return c.interval.begin; });
  rows.numbers("end", [](const PageContact& c) { return c.interval.end; });
  rows.bodies("a", [](const PageContact& c) { return c.a; });
  rows.bodies("b", [](const PageContact& c) { return c.b; });
  rows.bytes("resting", [](const PageContact& c) { return c.is_resting; });
  rows.rough_vectors("p", [](const PageContact& c) { return c.p_WC; });
  rows.rough_vectors("normal", [](const PageContact& c) { return c.nhat_AB_W; });
  rows.rough_vectors("impulse", [](const PageContact& c) { return c.impulse_W; });
}

void add_touches(ColumnBlock& block, const std::vector<PageTouch>& touches) {
  RowColumns rows(block, "touch", touches);
  rows.numbers("t", [](const PageTouch& touch) { return touch.t; });
  rows.bodies("a", [](const PageTouch& touch) { return touch.a; });
  rows.bodies("b", [](const PageTouch& touch) { return touch.b; });
}

Json marks_json(const std::vector<PageMark>& marks) {
  Json list = Json::array();
  for (const PageMark& mark : marks) {
    Json json{{"t", mark.t}, {"kind", mark.kind}, {"text", mark.text}, {"bodies", Json::array()}};
    for (const BodyId& id : mark.bodies) {
      if (id.slot != kNoBody) json["bodies"].push_back(id.slot);
    }
    list.push_back(std::move(json));
  }
  return list;
}

// What ties bodies, as in the scene file.
Json links_json(const std::string& scene_file) {
  Json links = Json::object();
  const Json scene = Json::parse(scene_file, nullptr, false);
  if (!scene.is_object()) return links;
  const auto take = [&](const char* name, const char* place) {
    const Json::json_pointer pointer(place);
    if (scene.contains(pointer)) links[name] = scene.at(pointer);
  };
  take("joints", "/joints");
  take("springs", "/forces/springs");
  if (!scene.contains("bodies") || !scene["bodies"].is_array()) return links;
  for (const Json& body : scene["bodies"]) {
    if (!body.is_object() || !body.contains("locked")) continue;
    links["locked"][body.value("name", "")] = body["locked"];
  }
  return links;
}

Json body_json(const PageBody& body, std::size_t shape, Scalar plate) {
  Json json{{"name", body.name},
            {"kind", word_of(body.kind)},
            {"shape", shape},
            {"shape_name", body.shape_name},
            {"radius", view_internal::drawn_radius(*body.shape, plate)}};
  if (!body.color.empty()) json["color"] = body.color;
  if (body.is_ghost) json["ghost"] = true;
  if (body.mass_properties) {
    json["mass"] = body.mass_properties->mass;
    json["center"] = vector_json(body.mass_properties->p_BoBcm);
  }
  return json;
}

// The form of a shape that a few numbers define, for the page's close-ups.
Json form_json(const Shape& shape) {
  for (const geometry_internal::ShapeForm& form : geometry_internal::shape_forms()) {
    const std::vector<Scalar> values = form.read(shape);
    if (!values.empty()) return {{"name", form.name}, {"values", values}};
  }
  return {};
}

Json charts_json(const std::vector<PageChart>& charts) {
  Json list = Json::array();
  for (const PageChart& chart : charts) {
    list.push_back({{"title", chart.title}, {"series", chart.series}});
  }
  return list;
}

std::size_t series_count(const std::vector<PageChart>& charts) {
  std::size_t count = 0;
  for (const PageChart& chart : charts) count += chart.series.size();
  return count;
}

void add_samples(ColumnBlock& block, const std::vector<PageSample>& samples, std::size_t count) {
  RowColumns rows(block, "sample", samples);
  rows.numbers("t", [](const PageSample& s) { return s.t; });
  for (std::size_t k = 0; k < count; ++k) {
    rows.numbers(std::to_string(k).c_str(), [&](const PageSample& s) { return s.values.at(k); });
  }
}

const TriangleMesh& deforming_mesh(const PageScene& scene, const PageDeformation& deformation) {
  const auto slot = std::size_t(deformation.body.slot);
  DYOP_REQUIRE(slot < scene.bodies.size(), "the page has no body ", deformation.body);
  const auto* mesh = dynamic_cast<const TriangleMesh*>(scene.bodies[slot].shape.get());
  DYOP_REQUIRE(mesh != nullptr, "only a mesh can deform, and body ", slot, " is none");
  for (const std::vector<Vector3>& mode : deformation.modes) {
    DYOP_REQUIRE(mode.size() == mesh->vertices().size(), "a mode of body ", slot, " has ",
                 mode.size(), " displacements for ", mesh->vertices().size(), " vertices");
  }
  return *mesh;
}

void require_weights(const PageDeformation& deformation, bool is_whole) {
  const std::size_t count = deformation.weights.size();
  DYOP_REQUIRE(deformation.times.empty() ? count == 0
               : is_whole ? count == deformation.times.size() * deformation.modes.size()
                          : count % deformation.times.size() == 0,
               "the deformation of body ", deformation.body, " has ", count, " weights");
}

// The weights of each time as `count` numbers, those of modes that were unknown then as zero.
std::vector<Scalar> widened(const PageDeformation& deformation, std::size_t count) {
  std::vector<Scalar> weights;
  const std::size_t before =
      deformation.times.empty() ? 0 : deformation.weights.size() / deformation.times.size();
  for (std::size_t k = 0; k < deformation.times.size(); ++k) {
    const auto row = deformation.weights.begin() + std::ptrdiff_t(k * before);
    weights.insert(weights.end(), row, row + std::ptrdiff_t(before));
    weights.resize(weights.size() + count - before);
  }
  return weights;
}

void append_deformation(PageDeformation& whole, PageDeformation part) {
  const std::size_t rows = part.times.size();
  if (rows > 0) whole.weights = widened(whole, part.weights.size() / rows);
  const auto move_to = [](auto& to, auto& from) {
    to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  };
  move_to(whole.modes, part.modes);
  move_to(whole.times, part.times);
  move_to(whole.weights, part.weights);
}

Json deformations_json(ColumnBlock& block, const PageScene& scene,
                       const std::vector<PageDeformation>& deformations) {
  Json list = Json::array();
  for (const PageDeformation& deformation : deformations) {
    list.push_back(view_internal::add_deformation(
        block, "deformation" + std::to_string(list.size()), deformation,
        deforming_mesh(scene, deformation).triangles()));
  }
  return list;
}

MotionRows::Body motion_body(const PageScene& scene, std::size_t number) {
  const PageBody& body = scene.bodies[number];
  const Vector3 center =
      body.mass_properties ? body.mass_properties->p_BoBcm : Vector3(Vector3::Zero());
  return {std::uint32_t(number), center, body.shape->bounding_radius()};
}

MotionRows motions_of(const PageScene& scene, const PageSpan& span) {
  MotionRows motions(PageEncoder::kMotionTolerance);
  for (const PageSegment& segment : span.segments) {
    DYOP_REQUIRE(segment.body.slot < scene.bodies.size(), "the page has no body ", segment.body);
    motions.add(motion_body(scene, segment.body.slot), segment.interval, segment.motion.get());
  }
  return motions;
}

Json shape_json(ColumnBlock& block, const std::string& number, const Shape& shape, int fineness,
                Scalar plate) {
  const view_internal::ShapeSurface surface = view_internal::surface_of(shape, fineness, plate);
  Json json = add_surface(block, "shape" + number, surface);
  if (fineness == kCoarse) {
    for (const int fewer : kMoving) {
      const auto moving = view_internal::surface_of(shape, fewer, plate);
      if (moving.triangles.size() >= surface.triangles.size()) break;
      const std::string name = "moving" + number + "." + std::to_string(fewer);
      json["moving"].push_back(add_surface(block, name, moving));
      json["moving"].back()["name"] = name;
    }
  }
  if (Json form = form_json(shape); !form.empty()) json["form"] = std::move(form);
  return json;
}

// Their shapes are numbered from 0 in the block, and each is stored once.
void write_bodies(ColumnBlock& block, Json& header, const std::vector<PageBody>& bodies,
                  int fineness) {
  std::vector<const Shape*> shapes;
  for (const PageBody& body : bodies) shapes.push_back(body.shape.get());
  const Scalar plate = view_internal::plate_beside(shapes);
  std::map<const Shape*, std::size_t> numbers;
  for (const PageBody& body : bodies) {
    const auto [entry, is_new] = numbers.try_emplace(body.shape.get(), numbers.size());
    if (is_new) {
      header["shapes"].push_back(
          shape_json(block, std::to_string(entry->second), *body.shape, fineness, plate));
    }
    header["bodies"].push_back(body_json(body, entry->second, plate));
  }
}

void require_shape(const PageBody& body) {
  DYOP_REQUIRE(body.shape != nullptr, "body '", body.name, "' has no shape to show");
}

}  // namespace

void append(PageSpan& whole, PageSpan part) {
  const auto move_to = [](auto& to, auto& from) {
    to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  };
  move_to(whole.segments, part.segments);
  move_to(whole.steps, part.steps);
  move_to(whole.frames, part.frames);
  move_to(whole.impacts, part.impacts);
  move_to(whole.gaps, part.gaps);
  move_to(whole.contacts, part.contacts);
  move_to(whole.marks, part.marks);
  move_to(whole.samples, part.samples);
  move_to(whole.touches, part.touches);
  move_to(whole.bodies, part.bodies);
  for (PageDeformation& deformation : part.deformations) {
    const auto same = std::ranges::find(whole.deformations, deformation.body,
                                        [](const PageDeformation& one) { return one.body; });
    if (same == whole.deformations.end()) {
      whole.deformations.push_back(std::move(deformation));
    } else {
      append_deformation(*same, std::move(deformation));
    }
  }
}

PageEncoder::PageEncoder(PageScene scene) : scene_(std::move(scene)) {
  for (const PageBody& body : scene_.bodies) require_shape(body);
  for (const PageDeformation& deformation : scene_.deformations) {
    static_cast<void>(deforming_mesh(scene_, deformation));
    require_weights(deformation, true);
  }
}

std::string PageEncoder::head() const {
  ColumnBlock block;
  Json header{{"block", "scene"},
              {"title", scene_.title},
              {"gravity", vector_json(scene_.gravity_W)},
              {"begin", scene_.begin_time},
              {"end", scene_.end_time},
              {"source", scene_.source},
              {"bodies", Json::array()},
              {"shapes", Json::array()}};
  if (Json links = links_json(scene_.scene_file); !links.empty()) {
    header["links"] = std::move(links);
  }
  if (scene_.verdict) {
    header["check"] = {{"proven", scene_.verdict->is_proven}, {"words", scene_.verdict->words}};
  }
  write_bodies(block, header, scene_.bodies, scene_.bodies.size() < kManyBodies ? kFine : kCoarse);
  header["charts"] = charts_json(scene_.charts);
  header["deformations"] = deformations_json(block, scene_, scene_.deformations);
  if (scene_.keeps_time) header["keeps_time"] = true;
  return block.bytes(std::move(header));
}

std::string PageEncoder::chunk(const TimeInterval& time, const PageSpan& span) const {
  ColumnBlock block;
  std::vector<MotionRows::Body> bodies;
  for (std::size_t k = 0; k < scene_.bodies.size(); ++k) bodies.push_back(motion_body(scene_, k));
  const MotionRows motions = motions_of(scene_, span);
  view_internal::TimeTable times;
  motions.add_times_to(times);
  for (const PageGap& gap : span.gaps) times.add(gap.t);
  for (const PageContact& contact : span.contacts) {
    times.add(contact.interval.begin);
    times.add(contact.interval.end);
  }
  times.sort();
  times.add_to(block);
  const auto rounding = view_internal::Rounding::of(scene_, time, span);
  motions.add_rounded_to(block, rounding, bodies, times);
  view_internal::add_rounded_gaps(block, span.gaps, rounding, times);
  view_internal::add_rounded_contacts(block, span.contacts, rounding, times);
  std::string bytes(1 + 2 * sizeof(double), 'D');
  std::memcpy(&bytes[1], &time.begin, sizeof(double));
  std::memcpy(&bytes[1 + sizeof(double)], &time.end, sizeof(double));
  const Json steps{{"place", rounding.place},
                   {"velocity", rounding.velocity},
                   {"contact", rounding.contact},
                   {"impulse", rounding.impulse},
                   {"direction", view_internal::Rounding::kDirection}};
  return bytes + block.bytes({{"block", "chunk"}, {"steps", steps}}, ColumnBlock::Packing::Quick);
}

void PageEncoder::add_bodies(const std::vector<PageBody>& bodies) {
  for (const PageBody& body : bodies) require_shape(body);
  scene_.bodies.insert(scene_.bodies.end(), bodies.begin(), bodies.end());
}

std::string PageEncoder::span(const PageSpan& span) const {
  ColumnBlock block;
  motions_of(scene_, span).add_to(block);
  add_touches(block, span.touches);
  add_steps(block, span);
  add_impacts(block, span.impacts);
  add_gaps(block, span.gaps);
  add_contacts(block, span.contacts);
  add_samples(block, span.samples, series_count(scene_.charts));
  Json header{{"block", "span"}, {"marks", marks_json(span.marks)}};
  if (!span.bodies.empty()) {
    header["bodies"] = header["shapes"] = Json::array();
    write_bodies(block, header, span.bodies, kFine);
  }
  for (const PageDeformation& deformation : span.deformations) require_weights(deformation, false);
  if (!span.deformations.empty()) {
    header["deformations"] = deformations_json(block, scene_, span.deformations);
  }
  if (span.ordinary_impulse > 0) header["ordinary_impulse"] = span.ordinary_impulse;
  return block.bytes(std::move(header));
}

}  // namespace dyop
