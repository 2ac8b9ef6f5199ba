// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/tool_io/tool_log.h"

#include <algorithm>
#include <cstring>
#include <string_view>

#include "dyop/io/file_error.h"
#include "io/file_bytes.h"

namespace dyop {
namespace {

// A log starts with its name and its version. Numbers are little-endian.
constexpr std::string_view kMagic = "dyop tool log 1\n";

// Bit 0 of a tick's first byte: it was cut off.
constexpr std::uint8_t kIsCutOff = 1;

template <typename Number>
void put(std::string& buffer, const Number& number) {
  char bytes[sizeof(Number)];
  std::memcpy(bytes, &number, sizeof(Number));
  buffer.append(bytes, sizeof(Number));
}

void put(std::string& buffer, const Vector3& p) {
  for (int k = 0; k < 3; ++k) put(buffer, p[k]);
}

void put(std::string& buffer, const Quaternion& q) {
  for (int k = 0; k < 4; ++k) put(buffer, q.coeffs()[k]);
}

void put_single(std::string& buffer, const Vector3& p) {
  for (int k = 0; k < 3; ++k) put(buffer, float(p[k]));
}

// Values that a replay must reproduce.
void put_results(std::string& buffer, const ToolTick& tick, std::size_t hinge_count) {
  put(buffer, std::uint8_t(tick.status));
  put(buffer, tick.tool.X_WT.translation());
  put(buffer, float(tick.energy_returned));
  put_single(buffer, rotation_vector(tick.tool.X_WT.rotation()));
  for (std::size_t k = 0; k < hinge_count; ++k) put(buffer, tick.tool.angles[k]);
  put_single(buffer, tick.wrench.force_W);
  put_single(buffer, tick.wrench.torque_W);
  for (const ToolClearance& clearance : tick.clearances) {
    put(buffer, float(clearance.lower));
    put(buffer, float(clearance.upper));
  }
}

class Reader {
 public:
  Reader(const std::filesystem::path& file, const std::string& bytes)
      : file_(file), bytes_(bytes) {}

  bool is_at_end() const { return place_ == bytes_.size(); }
  std::string_view text(std::size_t length) {
    if (bytes_.size() - place_ < length) throw FileError(file_, "the log is cut short");
    place_ += length;
    return std::string_view(bytes_).substr(place_ - length, length);
  }
  template <typename Number>
  Number number() {
    Number number;
    std::memcpy(&number, text(sizeof(Number)).data(), sizeof(Number));
    return number;
  }
  Vector3 vector3() {
    Vector3 p;
    for (int k = 0; k < 3; ++k) p[k] = number<Scalar>();
    return p;
  }

 private:
  const std::filesystem::path& file_;
  const std::string& bytes_;
  std::size_t place_ = 0;
};

struct LoggedInputs {
  DevicePose device;
  Scalar dt = 0;
  std::optional<TickCutoff> cutoff;
  std::vector<std::uint8_t> new_snapshots;
};

LoggedInputs read_inputs(Reader& reader, std::size_t hinge_count, std::size_t obstacle_count) {
  LoggedInputs inputs;
  const auto flags = reader.number<std::uint8_t>();
  inputs.dt = reader.number<Scalar>();
  inputs.device.p_WD = reader.vector3();
  for (int k = 0; k < 4; ++k) inputs.device.q_WD.coeffs()[k] = reader.number<Scalar>();
  for (std::size_t k = 0; k < hinge_count; ++k) inputs.device.angles[k] = reader.number<Scalar>();
  for (std::size_t k = 0; k < obstacle_count; ++k) {
    inputs.new_snapshots.push_back(reader.number<std::uint8_t>());
  }
  if ((flags & kIsCutOff) != 0) {
    const auto checkpoint = reader.number<std::int64_t>();
    inputs.cutoff = TickCutoff{checkpoint, reader.number<std::int64_t>()};
  }
  return inputs;
}

// A feed that delivers its snapshots at the ticks of the log.
struct ReplayFeed {
  const TissueFeed& feed;
  std::vector<Vector3> vertices;
  std::int64_t number = 0;
};

}  // namespace

ToolLogWriter::ToolLogWriter(const std::filesystem::path& file, const ToolRun& run)
    : file_(file),
      out_(file, std::ios::binary),
      hinge_count_(run.scene.hinges.size()),
      snapshots_(run.scene.obstacles.size()) {
  if (!out_) throw FileError(file, "could not be written");
  out_ << kMagic;
  buffer_.clear();
  put(buffer_, std::uint64_t(run.text.size()));
  out_ << buffer_ << run.text;
}

void ToolLogWriter::add(const TickRecord& record) {
  const ToolTick& tick = record.tick;
  buffer_.clear();
  put(buffer_, tick.cutoff ? kIsCutOff : std::uint8_t{0});
  put(buffer_, record.dt);
  put(buffer_, record.device.p_WD);
  put(buffer_, record.device.q_WD);
  for (std::size_t k = 0; k < hinge_count_; ++k) put(buffer_, record.device.angles[k]);
  for (std::size_t k = 0; k < snapshots_.size(); ++k) {
    put(buffer_, std::uint8_t(tick.snapshots[k] - snapshots_[k]));
    snapshots_[k] = tick.snapshots[k];
  }
  if (tick.cutoff) {
    put(buffer_, tick.cutoff->checkpoint);
    put(buffer_, tick.cutoff->node_pairs);
  }
  put_results(buffer_, tick, hinge_count_);
  out_ << buffer_;
  bytes_of_ticks_ += std::int64_t(buffer_.size());
  if (!out_) throw FileError(file_, "could not be written");
}

void ToolLogWriter::close() {
  out_.close();
  if (!out_) throw FileError(file_, "could not be written completely");
}

ToolReplay replay_tool_log(const std::filesystem::path& file,
                           const std::filesystem::path& scene_file) {
  const std::string bytes = internal::read_bytes(file);
  Reader reader(file, bytes);
  if (bytes.size() < kMagic.size() || reader.text(kMagic.size()) != kMagic) {
    throw FileError(file, "expected a log of dyop tool");
  }
  const auto length = reader.number<std::uint64_t>();
  const ToolRun run = parse_tool_run(scene_file, std::string(reader.text(length)));
  ToolSession session(run.scene, run.options);
  std::vector<ReplayFeed> feeds;
  for (const TissueFeed& feed : run.tissue) {
    feeds.push_back({feed, session.tissue_vertices(feed.obstacle)});
  }
  const std::size_t hinge_count = run.scene.hinges.size();
  ToolReplay replay;
  std::string expected;
  for (; !reader.is_at_end(); ++replay.ticks) {
    const LoggedInputs inputs = read_inputs(reader, hinge_count, run.scene.obstacles.size());
    for (ReplayFeed& feed : feeds) {
      if (inputs.new_snapshots[feed.feed.obstacle] == 0) continue;
      feed.feed.shape(++feed.number, feed.vertices);
      session.give_snapshot(feed.feed.obstacle, feed.vertices, feed.feed.period);
    }
    const ToolTick& tick = session.replay(inputs.device, inputs.dt, inputs.cutoff);
    expected.clear();
    put_results(expected, tick, hinge_count);
    if (reader.text(expected.size()) == expected) continue;
    ++replay.differing;
    if (!replay.first_difference) replay.first_difference = replay.ticks;
  }
  return replay;
}

}  // namespace dyop
