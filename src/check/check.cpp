// SPDX-License-Identifier: BSD-3-Clause
#include "check/check.h"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "check/enclosure.h"
#include "check/laws/laws.h"
#include "check/trusted/haptic_prover.h"
#include "check/trusted/prover.h"

namespace dyop_check {
namespace {

// The bytes of a character at `at` that could steer a terminal or turn text around; 0 for others: C0,
// delete, C1, and in UTF-8 U+200E, U+200F, U+202A to U+202E and U+2066 to U+2069.
std::size_t steering_length(const std::string& text, std::size_t at) {
  const auto byte = [&](std::size_t i) {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0;
  };
  const int c = byte(at);
  const int second = byte(at + 1);
  const int third = byte(at + 2);
  if (c < ' ' || c == 127) return 1;
  if (c == 0xC2 && second >= 0x80 && second < 0xA0) return 2;
  if (c != 0xE2) return 0;
  const bool is_mark = second == 0x80 && (third == 0x8E || third == 0x8F);
  const bool is_embedding = second == 0x80 && third >= 0xAA && third <= 0xAE;
  const bool is_isolate = second == 0x81 && third >= 0xA6 && third <= 0xA9;
  return is_mark || is_embedding || is_isolate ? 3 : 0;
}

// Names come from the file: what could steer a terminal is not printed.
std::string printable(const std::string& name) {
  std::string text;
  for (std::size_t at = 0; at < name.size();) {
    const std::size_t length = steering_length(name, at);
    text += length > 0 ? '?' : name[at];
    at += length > 0 ? length : 1;
  }
  return text;
}

std::string times(std::int64_t count) {
  return count == 1 ? "once" : std::to_string(count) + " times";
}

void print_more(std::ostream& out, std::int64_t count) {
  if (count > 0) out << "  ... and " << count << " more\n";
}

void print_findings(std::ostream& out, const Recording& recording, const char* word,
                    const Findings<Finding>& findings) {
  for (const Finding& finding : findings.listed) {
    out << "  " << word << ": " << printable(recording.bodies[finding.a].name) << " and "
        << printable(recording.bodies[finding.b].name);
    if (std::string(word) == "refuted") {
      out << " are at most " << finding.distance << " apart at t = " << finding.begin
          << ", the target is " << finding.target << '\n';
    } else {
      out << " from t = " << finding.begin << " to " << finding.end << '\n';
    }
  }
  print_more(out, findings.count - std::int64_t(findings.listed.size()));
}

void print_enclosures(std::ostream& out, const Recording& recording) {
  for (const Enclosure& found : find_enclosures(recording)) {
    out << "  inside: " << printable(recording.bodies[found.inner].name)
        << " begins within the surface of " << printable(recording.bodies[found.outer].name)
        << " at t = " << found.t << '\n';
  }
}

int print_verdict(std::ostream& out, const Recording& recording, const Verdict& verdict) {
  out.precision(10);
  out << "geometry   ";
  if (verdict.is_proven()) {
    out << "proven: every pair " << (verdict.uncertified > 0 ? "but those below " : "")
        << "keeps its target distance from t = " << recording.begin << " to " << recording.end
        << '\n';
    if (verdict.intervals > 0) {
      out << "  distances asked of near pairs: " << verdict.least_target << " to "
          << verdict.largest_target << '\n';
    }
  } else if (verdict.is_refuted()) {
    out << "REFUTED\n";
  } else {
    out << "undecided\n";
  }
  for (const Jump& jump : verdict.jumps.listed) {
    out << "  jump: " << printable(recording.bodies[jump.body].name) << " by " << jump.length
        << " at t = " << jump.t << '\n';
  }
  print_findings(out, recording, "refuted", verdict.refuted);
  print_findings(out, recording, "undecided", verdict.undecided);
  print_enclosures(out, recording);
  if (verdict.uncertified > 0) {
    out << "  not proven for " << recording.uncertified.size()
        << " pairs that the run itself calls uncertified (they began too near, or crossed)\n";
  }
  std::size_t placed = 0;
  for (const RecordedBody& body : recording.bodies) placed += body.placed.size();
  if (placed > 0)
    out << "  the caller put a body elsewhere " << times(std::int64_t(placed)) << '\n';
  if (recording.rules.front().line.kind == Json::Kind::Null)
    out << "  the file has no rules: all pairs count, at default distances unless it says others\n";
  if (!recording.is_complete) out << "  the run has no end: it goes on, or was killed\n";
  out << "work       " << verdict.pairs << " pairs of bodies, " << recording.steps.size()
      << " steps, " << verdict.intervals << " intervals of near pairs, " << verdict.node_pairs
      << " node pairs\n";
  if (verdict.is_refuted()) return 1;
  return verdict.undecided.count > 0 ? 3 : 0;
}

void print_worst(std::ostream& out, const Recording& recording, const char* what,
                 const Worst& worst) {
  out << "  " << what << ' ' << worst.value;
  if (worst.value > 0) {
    out << " (" << printable(recording.bodies[worst.a].name);
    if (worst.b != worst.a) out << ", " << printable(recording.bodies[worst.b].name);
    out << " at t = " << worst.t << ')';
  }
  out << '\n';
}

void print_flights(std::ostream& out, const Recording& recording, const FlightLaw& law) {
  out.precision(3);
  out << "flight     " << (law.holds() ? "holds" : "FAILS") << ": " << law.flights << " flights";
  if (law.with_wrench > 0) out << ", " << law.with_wrench << " of them under wrenches, not checked";
  out << '\n';
  print_worst(out, recording, "unexplained change of momentum        ", law.linear);
  print_worst(out, recording, "unexplained change of angular momentum", law.angular);
}

void print_contacts(std::ostream& out, const Recording& recording, const ContactLaw& law) {
  out << "contact    " << (law.holds() ? "holds" : "FAILS") << ": " << law.changes
      << " changes of velocity, " << law.contacts << " impulses of contacts, " << law.links
      << " of joints and springs\n";
  print_worst(out, recording, "unexplained impulse                   ", law.linear);
  print_worst(out, recording, "unexplained angular impulse           ", law.angular);
  print_worst(out, recording, "velocity after a flight               ", law.gap);
  print_worst(out, recording, "outside a friction cone               ", law.cone);
  print_worst(out, recording, "complementarity                       ", law.complementarity);
  print_worst(out, recording, "restitution                           ", law.restitution);
  print_worst(out, recording, "energy created at an impact           ", law.energy);
  print_worst(out, recording, "recovery of gaps and joints           ", law.recovery);
  print_worst(out, recording, "speed given up for sleep              ", law.sleep);
  if (law.stalls > 0) out << "  bodies were stopped " << times(law.stalls) << '\n';
  if (law.settings > 0) out << "  the caller set a velocity " << times(law.settings) << '\n';
  if (law.without_law > 0) out << "  " << law.without_law << " contacts were not checked\n";
  for (const std::string& fault : law.faults) out << "  FAULT: " << printable(fault) << '\n';
}

void print_findings(std::ostream& out, const char* word, const Findings<HapticFinding>& findings) {
  for (const HapticFinding& finding : findings.listed) {
    out << "  " << word << ": " << printable(finding.a) << " and " << printable(finding.b)
        << " in tick " << finding.tick;
    if (std::string(word) == "refuted")
      out << " are at most " << finding.distance << " apart, the margin is " << finding.margin;
    out << '\n';
  }
  print_more(out, findings.count - std::int64_t(findings.listed.size()));
}

int print_verdict(std::ostream& out, const HapticRecording& recording,
                  const HapticVerdict& verdict) {
  out.precision(10);
  const bool is_proven = verdict.refuted.count + verdict.undecided.count == 0;
  const bool has_exceptions = verdict.leaving + verdict.crossing > 0;
  if (is_proven) {
    out << "geometry   proven: every part of a tool " << (has_exceptions ? "but those below " : "")
        << "keeps its margin in every motion of " << recording.tick_count << " ticks\n";
  } else {
    out << "geometry   " << (verdict.refuted.count > 0 ? "REFUTED\n" : "undecided\n");
  }
  print_findings(out, "refuted", verdict.refuted);
  print_findings(out, "undecided", verdict.undecided);
  for (const auto& [part, obstacle] : find_enclosures(recording)) {
    out << "  inside: " << printable(part) << " begins within the surface of "
        << printable(obstacle) << '\n';
  }
  if (verdict.leaving > 0) {
    out << "  a part was nearer than its margin " << times(verdict.leaving)
        << ", as its tick says, and is proven not to touch\n";
  }
  if (verdict.crossing > 0) {
    out << "  a part is not proven " << times(verdict.crossing)
        << ", as its tick says that the tool crosses something\n";
  }
  if (verdict.placed > 1) out << "  tools began afresh " << times(verdict.placed - 1) << '\n';
  if (verdict.replaced > 0)
    out << "  tissue became another mesh " << times(verdict.replaced) << '\n';
  if (recording.missing_ticks > 0) {
    out << "  " << recording.missing_ticks
        << " ticks are not in the file, as the log was too slow for them: nothing is said of "
           "these\n";
  }
  if (!recording.is_complete) out << "  the run has no end: it goes on, or was killed\n";
  out << "work       " << verdict.motions << " motions, " << verdict.proven
      << " pairs of bodies proven, " << verdict.node_pairs << " node pairs\n";
  if (verdict.refuted.count > 0) return 1;
  return verdict.undecided.count > 0 ? 3 : 0;
}

// FNV-1a over words of 64 bits.
std::uint64_t digest_of(const std::vector<std::uint64_t>& words) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const std::uint64_t word : words) hash = (hash ^ word) * 0x100000001b3;
  return hash;
}

// Damage after the file was written: the first dataset of which a block of rows is not what its
// digest in `/digests` says. None where there are no digests, as of a run that goes on.
std::optional<std::string> find_damage(const Hdf5Reader& file) {
  constexpr const char* kTable = "digests";
  if (!file.has(kTable)) return std::nullopt;
  const std::uint64_t count = file.length(kTable);
  const std::vector<std::string> datasets = file.names(kTable, "dataset", count);
  const std::vector<std::uint64_t> first = file.integers(kTable, "first", count);
  const std::vector<std::uint64_t> rows = file.integers(kTable, "count", count);
  const std::vector<std::uint64_t> digest = file.integers(kTable, "digest", count);
  for (std::size_t k = 0; k < count; ++k) {
    if (digest_of(file.words(datasets[k], first[k], rows[k])) != digest[k]) return datasets[k];
  }
  return std::nullopt;
}

int check_recording(const Hdf5Reader& reader, const CheckOptions& options, std::ostream& out) {
  if (reader.text_attribute("format") == "dyop tool recording") {
    const HapticRecording recording(reader);
    return print_verdict(out, recording, check_haptic_run(recording, options));
  }
  const Recording recording = read_recording(reader);
  const int code = print_verdict(out, recording, check_geometry(recording, options));
  const LawData data = read_law_data(reader, recording);
  if (data.changes.empty()) {
    out << "flight, contact: not checked, the file has no impulses\n";
    return code;
  }
  const FlightLaw flights = check_flights(recording, data);
  print_flights(out, recording, flights);
  const ContactLaw contacts = check_contacts(recording, data);
  print_contacts(out, recording, contacts);
  return flights.holds() && contacts.holds() ? code : 1;
}

}  // namespace

int check_file(const std::string& file, double scale, std::ostream& out, std::ostream& errors,
               const char* program) {
  const std::string begin = std::string(program) + ": error: " + printable(file) + ": ";
  try {
    if (!std::filesystem::exists(file)) throw BadFile("no such file");
    const Hdf5Reader reader(file);
    CheckOptions options;
    options.scale = scale;
    const int code = check_recording(reader, options, out);
    if (const std::optional<std::string> damaged = find_damage(reader)) {
      errors << begin << "the dataset " << printable(*damaged)
             << " is damaged: not what was recorded, whatever is proven of it\n";
      return code == 1 ? 1 : 2;
    }
    return code;
  } catch (const BadFile& error) {
    errors << begin << printable(error.what()) << '\n';
  } catch (const std::exception& error) {
    errors << begin << "damaged (" << error.what() << ")\n";
  }
  return 2;
}

}  // namespace dyop_check
