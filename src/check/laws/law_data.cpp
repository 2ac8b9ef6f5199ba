// SPDX-License-Identifier: BSD-3-Clause
#include "check/laws/law_data.h"

#include "check/trusted/segments.h"

namespace dyop_check {
namespace {

BodyLaw body_law(const RecordedBody& body) {
  BodyLaw law;
  const Json& line = body.lines.front().json;
  law.mass = line.at("mass").to_number();
  for (const Line& later : body.lines) {
    const Json* has_wrench = later.json.find("has_wrench");
    law.materials.push_back({later.from, later.json.at("restitution").to_number(),
                             later.json.at("friction").to_number(),
                             has_wrench != nullptr && has_wrench->to_boolean()});
  }
  if (!body.is_dynamic) return law;
  const std::vector<double> inertia = line.at("inertia").to_numbers(9);
  std::copy(inertia.begin(), inertia.end(), law.inertia.m.begin());
  for (std::size_t k = 0; k < 3; ++k) {
    law.locked_translation[k] = line.at("locked_translation").list.at(k).to_boolean();
    law.locked_rotation[k] = line.at("locked_rotation").list.at(k).to_boolean();
  }
  return law;
}

Combine combine_from(const Json* word, Combine otherwise) {
  if (word == nullptr) return otherwise;
  const std::map<std::string, Combine> rules{{"geometric_mean", Combine::GeometricMean},
                                             {"mean", Combine::Mean},
                                             {"product", Combine::Product},
                                             {"minimum", Combine::Minimum},
                                             {"maximum", Combine::Maximum}};
  const auto found = rules.find(word->text);
  if (found == rules.end()) throw BadFile("the rule '" + word->text + "' is unknown");
  return found->second;
}

Pose frame_of(const Json& json) {
  return {matrix_of(json.at("R").to_numbers(9)), vector_of(json.at("p").to_numbers(3))};
}

JointLaw joint_law(const Json& line) {
  JointLaw joint;
  joint.kind = line.at("kind").text;
  joint.a = std::uint32_t(index_of(line.at("a"), 1U << 31));
  joint.b = std::uint32_t(index_of(line.at("b"), 1U << 31));
  joint.X_AJ = frame_of(line.at("X_AJ"));
  joint.X_BJ = frame_of(line.at("X_BJ"));
  const Json* limits = line.find("limits");
  const bool is_distance = joint.kind == "distance";
  if (is_distance && limits != nullptr) {
    joint.least = limits->list.at(0).to_number();
    joint.most = limits->list.at(1).to_number();
  }
  joint.has_more = joint.kind == "coupling" || line.find("swing_twist") != nullptr ||
                   (limits != nullptr) != is_distance;
  return joint;
}

// Null or absent is none.
std::optional<double> number_at(const Json& json, const char* key) {
  const Json* found = json.find(key);
  if (found == nullptr || found->kind == Json::Kind::Null) return std::nullopt;
  return found->to_number();
}

RuleLaw rule_law(const Rules& rules) {
  RuleLaw law;
  law.from = rules.from;
  const Json& line = rules.line;
  if (line.kind == Json::Kind::Null) return law;
  law.gravity = vector_of(line.at("gravity").to_numbers(3));
  law.rest_offset = number_at(line, "rest_offset").value_or(0);
  law.separation_speed = number_at(line, "separation_speed");
  for (const Json& entry : line.at("joints").list) {
    const JointLaw joint = joint_law(entry);
    law.joints_at[joint.a].push_back(joint);
    law.joints_at[joint.b].push_back(joint);
  }
  law.friction = combine_from(line.find("combine_friction"), law.friction);
  law.restitution = combine_from(line.find("combine_restitution"), law.restitution);
  for (const Json& rule : line.at("pairs").list) {
    const Json* material = rule.find("material");
    if (material == nullptr || material->kind != Json::Kind::Object) continue;
    law.materials[ordered(index_of(rule.at("a"), 1U << 31), index_of(rule.at("b"), 1U << 31))] = {
        material->at("friction").to_number(), material->at("restitution").to_number()};
  }
  return law;
}

class ChangeReader {
 public:
  ChangeReader(const Hdf5Reader& file, const Recording& recording)
      : file_(file), recording_(recording), table_(file, "velocity_changes", "change_count") {}

  std::vector<Change> read() {
    const std::vector<double> begin = table_.reals("begin");
    const std::vector<double> end = table_.reals("end");
    const auto kind = table_.integers("kind");
    changes_.resize(begin.size());
    for (std::size_t k = 0; k < changes_.size(); ++k) {
      if (kind[k] > std::uint64_t(Change::Kind::Set) || !(begin[k] <= end[k]))
        throw BadFile("a velocity change is none");
      changes_[k].kind = Change::Kind(kind[k]);
      changes_[k].begin = begin[k];
      changes_[k].end = end[k];
    }
    set_frames();
    read_momenta();
    read_contacts();
    read_links();
    read_wrenches();
    return std::move(changes_);
  }

  double longest_advance() const { return longest_advance_; }

 private:
  void set_frames() {
    const std::uint64_t count = file_.length("frames");
    const auto until = file_.integers("frames", "change_count", count);
    const std::vector<double> begin = file_.reals("frames", "begin", count);
    const std::vector<double> end = file_.reals("frames", "end", count);
    for (std::size_t k = 0; k < count; ++k)
      longest_advance_ = std::max(longest_advance_, end[k] - begin[k]);
    std::size_t frame = 0;
    for (std::size_t k = 0; k < changes_.size(); ++k) {
      while (until[frame] <= k) ++frame;  // the last one is their number
      changes_[k].frame_begin = begin[frame];
    }
  }

  // Every change has the next so many rows of a table. `make` gives the row of a number and a time.
  template <typename Row, typename Make>
  void deal_out(const char* counts, std::size_t rows, std::vector<Row> Change::*part,
                const Make& make) {
    const auto count = table_.integers(counts);
    std::size_t next = 0;
    for (std::size_t k = 0; k < changes_.size(); ++k) {
      if (count[k] > rows - next) throw BadFile("a change has more rows than there are");
      for (std::uint64_t i = 0; i < count[k]; ++i)
        (changes_[k].*part).push_back(make(next++, changes_[k].frame_begin));
    }
  }

  void read_momenta() {
    const Table t(file_, "momenta", "momentum_count");
    const auto body = t.integers("body");
    const auto is_before = t.integers("is_before");
    const std::vector<Vec> v = t.vectors("v");
    const std::vector<Vec> L = t.vectors("L");
    deal_out("momentum_count", body.size(), &Change::momenta, [&](std::size_t k, double at) {
      return MomentumRow{recording_.body_at(body[k], at), is_before[k] != 0, v[k], L[k]};
    });
  }

  void read_contacts() {
    const Table t(file_, "contact_impulses", "contact_impulse_count");
    const auto a = t.integers("a");
    const auto b = t.integers("b");
    const std::vector<Vec> p = t.vectors("p");
    const std::vector<Vec> normal = t.vectors("normal");
    const std::vector<Vec> impulse = t.vectors("impulse");
    const std::vector<double> target = t.reals("target");
    const std::vector<double> friction = t.reals("friction");
    deal_out("contact_count", a.size(), &Change::contacts, [&](std::size_t k, double at) {
      return ContactRow{recording_.body_at(a[k], at),
                        recording_.body_at(b[k], at),
                        p[k],
                        normal[k],
                        impulse[k],
                        target[k],
                        friction[k]};
    });
  }

  void read_links() {
    const Table t(file_, "link_impulses", "link_impulse_count");
    const auto a = t.integers("a");
    const auto b = t.integers("b");
    const std::vector<Vec> impulse = t.vectors("impulse");
    const std::vector<Vec> angular_a = t.vectors("angular_a");
    const std::vector<Vec> angular_b = t.vectors("angular_b");
    deal_out("link_count", a.size(), &Change::links, [&](std::size_t k, double at) {
      return LinkRow{recording_.body_at(a[k], at), recording_.body_at(b[k], at), impulse[k],
                     angular_a[k], angular_b[k]};
    });
  }

  void read_wrenches() {
    const Table t(file_, "wrench_impulses", "wrench_impulse_count");
    const auto body = t.integers("body");
    const std::vector<Vec> impulse = t.vectors("impulse");
    const std::vector<Vec> angular = t.vectors("angular");
    deal_out("wrench_count", body.size(), &Change::wrenches, [&](std::size_t k, double at) {
      return WrenchRow{recording_.body_at(body[k], at), impulse[k], angular[k]};
    });
  }

  const Hdf5Reader& file_;
  const Recording& recording_;
  Table table_;
  std::vector<Change> changes_;
  double longest_advance_ = 0;
};

}  // namespace

double JointLaw::error(const Pose& X_WA, const Pose& X_WB, double radius) const {
  const Pose A = X_WA * X_AJ;
  const Pose B = X_WB * X_BJ;
  const auto axis = [](const Pose& X, std::size_t k) {
    return Vec{X.R.m[k], X.R.m[3 + k], X.R.m[6 + k]};
  };
  const Vec apart = B.p - A.p;
  const Vec z = axis(A, 2);
  const Vec across = apart - dot(apart, z) * z;
  const double lean = norm(cross(z, axis(B, 2)));
  const double turn = norm(rotation_vector(transpose(A.R) * B.R));
  if (kind == "ball") return norm(apart);
  if (kind == "hinge") return norm(apart) + radius * lean;
  if (kind == "slider") return norm(across) + radius * turn;
  if (kind == "fixed") return norm(apart) + radius * turn;
  if (kind == "distance") return std::max({least - norm(apart), norm(apart) - most, 0.0});
  if (kind == "universal") return norm(apart) + radius * std::abs(dot(axis(A, 0), axis(B, 1)));
  if (kind == "cylindrical") return norm(across) + radius * lean;
  return 0;  // a coupling
}

double combine(Combine rule, double a, double b) {
  switch (rule) {
    case Combine::GeometricMean:
      return std::sqrt(a * b);
    case Combine::Mean:
      return (a + b) / 2;
    case Combine::Product:
      return a * b;
    case Combine::Minimum:
      return std::min(a, b);
    case Combine::Maximum:
      break;
  }
  return std::max(a, b);
}

PairMaterial LawData::pair_material(const Recording& recording, std::uint32_t a, std::uint32_t b,
                                    double t) const {
  const RuleLaw& now = at_time(rules, t);
  const auto own = now.materials.find(ordered(recording.bodies[a].slot, recording.bodies[b].slot));
  if (own != now.materials.end()) return own->second;
  const Material& x = bodies[a].material(t);
  const Material& y = bodies[b].material(t);
  return {combine(now.friction, x.friction, y.friction),
          combine(now.restitution, x.restitution, y.restitution)};
}

LawData read_law_data(const Hdf5Reader& file, const Recording& recording) {
  LawData data;
  for (const RecordedBody& body : recording.bodies) data.bodies.push_back(body_law(body));
  for (const Rules& rules : recording.rules) data.rules.push_back(rule_law(rules));
  ChangeReader reader(file, recording);
  data.changes = reader.read();
  data.longest_advance = reader.longest_advance();
  return data;
}

}  // namespace dyop_check
