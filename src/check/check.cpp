// SPDX-License-Identifier: BSD-3-Clause
#include "check/check.h"

#include <ostream>

#include "check/json.h"
#include "check/prover.h"

namespace dyop_check {
namespace {

// Names come from the file: what could steer a terminal is not printed.
std::string printable(const std::string& name) {
  std::string text;
  for (const char c : name) text += static_cast<unsigned char>(c) < ' ' || c == 127 ? '?' : c;
  return text;
}

void print_findings(std::ostream& out, const Recording& recording, const char* word,
                    const std::vector<Finding>& findings, std::int64_t count) {
  for (const Finding& finding : findings) {
    out << "  " << word << ": " << printable(recording.bodies[finding.a].name) << " and "
        << printable(recording.bodies[finding.b].name);
    if (std::string(word) == "refuted") {
      out << " are at most " << finding.distance << " apart at t = " << finding.begin
          << ", the target is " << finding.target << '\n';
    } else {
      out << " from t = " << finding.begin << " to " << finding.end << '\n';
    }
  }
  if (count > std::int64_t(findings.size()))
    out << "  ... and " << count - std::int64_t(findings.size()) << " more\n";
}

int print_verdict(std::ostream& out, const Recording& recording, const Verdict& verdict) {
  out.precision(10);
  out << "geometry   ";
  if (verdict.is_proven()) {
    out << "proven: every pair keeps its target distance from t = " << recording.begin << " to "
        << recording.end << '\n';
  } else if (verdict.refuted_count + verdict.jump_count > 0) {
    out << "REFUTED\n";
  } else {
    out << "undecided\n";
  }
  for (const Jump& jump : verdict.jumps) {
    out << "  jump: " << printable(recording.bodies[jump.body].name) << " by " << jump.length
        << " at t = " << jump.t << '\n';
  }
  print_findings(out, recording, "refuted", verdict.refuted, verdict.refuted_count);
  print_findings(out, recording, "undecided", verdict.undecided, verdict.undecided_count);
  if (verdict.uncertified > 0) {
    out << "  not proven for " << recording.uncertified.size()
        << " pairs that the run itself calls uncertified (they began too near, or crossed)\n";
  }
  if (!recording.has_scene)
    out << "  the file has no scene: all pairs count, at default distances unless it says others\n";
  if (!recording.is_complete) out << "  the run has no end: it goes on, or was killed\n";
  out << "work       " << verdict.pairs << " pairs of bodies, " << recording.steps.size()
      << " steps, " << verdict.intervals << " intervals of near pairs, " << verdict.node_pairs
      << " node pairs\n";
  if (verdict.refuted_count + verdict.jump_count > 0) return 1;
  return verdict.undecided_count > 0 ? 3 : 0;
}

}  // namespace

int check_file(const std::string& file, double scale, std::ostream& out, std::ostream& errors) {
  try {
    const Recording recording = read_recording(file);
    CheckOptions options;
    options.scale = scale;
    return print_verdict(out, recording, check_geometry(recording, options));
  } catch (const BadFile& error) {
    errors << "dyop-check: error: " << file << ": " << error.what() << '\n';
  } catch (const std::exception& error) {
    errors << "dyop-check: error: " << file << ": damaged (" << error.what() << ")\n";
  }
  return 2;
}

}  // namespace dyop_check
