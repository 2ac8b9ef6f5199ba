// SPDX-License-Identifier: BSD-3-Clause

// Rules of the code base that no compiler checks: who may include whom, where constants live, which
// packages the build may ask for, and that the README shows code that is compiled.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

namespace {

namespace fs = std::filesystem;

const fs::path kRoot = DYOP_SOURCE_DIR;

std::string read_text(const fs::path& path) {
  std::ifstream in(path);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::vector<std::string> read_lines(const fs::path& path) {
  std::ifstream in(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::vector<fs::path> code_files(const std::vector<std::string>& folders) {
  std::vector<fs::path> files;
  for (const std::string& folder : folders) {
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder)) {
      const std::string extension = entry.path().extension().string();
      if (extension == ".h" || extension == ".cpp") files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<fs::path> build_files() {
  std::vector<fs::path> files{kRoot / "CMakeLists.txt"};
  for (const char* folder : {"src", "tests", "examples"}) {
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder)) {
      if (entry.path().filename() == "CMakeLists.txt") files.push_back(entry.path());
    }
  }
  return files;
}

// The headers that belong to no room: for users, and for users of C.
const fs::path kUmbrella = kRoot / "include/dyop/dyop.h";
const std::vector<fs::path> kCHeaders = {kRoot / "include/dyop/dyop_c.h",
                                         kRoot / "include/dyop/dyop_c_io.h"};

// The headers and sources of the rooms.
std::vector<fs::path> room_files(const std::vector<std::string>& folders) {
  std::vector<fs::path> files = code_files(folders);
  std::erase(files, kUmbrella);
  for (const fs::path& header : kCHeaders) std::erase(files, header);
  return files;
}

// The ladder: a room may include itself and rooms of a lower level. Rooms of one level do not know
// each other.
const std::map<std::string, int> kLevel{
    {"core", 0},     {"check", 0},  {"exact", 1},    {"adapters", 11}, {"hierarchy", 2},
    {"geometry", 3}, {"motion", 3}, {"distance", 4}, {"paper", 5},     {"toi", 5},
    {"contact", 6},  {"chain", 6},  {"dynamics", 7}, {"haptics", 7},   {"ompl", 7},
    {"tissue", 8},   {"io", 9},     {"view", 10},    {"c", 11},        {"python", 11},
    {"cli", 11}};

bool may_include(const std::string& from, const std::string& to) {
  return from == to || kLevel.at(to) < kLevel.at(from);
}

// The room of a file below include/dyop/ or src/.
std::string room_of(const fs::path& path) {
  const fs::path relative = fs::relative(path, kRoot);
  auto part = relative.begin();
  if (*part == "include") ++part;
  return std::next(part)->string();
}

TEST(Ladder, HasEveryRoomThatExists) {
  for (const char* folder : {"include/dyop", "src"}) {
    for (const auto& entry : fs::directory_iterator(kRoot / folder)) {
      if (entry.is_directory() && entry.path().filename() != "packaging") {
        EXPECT_TRUE(kLevel.contains(entry.path().filename().string())) << entry.path();
      }
    }
  }
}

TEST(Ladder, IncludesPointDownOnly) {
  const std::regex include("^#include \"(?:dyop/)?([a-z_]+)/[^\"]+\"");
  int checked = 0;
  for (const fs::path& file : room_files({"include", "src"})) {
    const std::string room = room_of(file);
    for (const std::string& line : read_lines(file)) {
      std::smatch match;
      if (!std::regex_search(line, match, include)) continue;
      if (match[1] == "dyop") {  // a header that belongs to no room
        EXPECT_EQ(room, "c") << file << ": " << line;
        continue;
      }
      ASSERT_TRUE(kLevel.contains(match[1].str())) << file << ": " << line;
      EXPECT_TRUE(may_include(room, match[1].str())) << file << ": " << line;
      ++checked;
    }
  }
  EXPECT_GT(checked, 100);
}

TEST(Ladder, TheRuleItselfRefusesUpAndSideways) {
  EXPECT_TRUE(may_include("toi", "core"));
  EXPECT_FALSE(may_include("core", "toi"));
  EXPECT_FALSE(may_include("geometry", "motion"));
}

// The classes, structs and enumerations that a file defines outside anonymous namespaces, and the
// private namespaces that it opens.
struct PrivateNames {
  std::set<std::string> types;
  std::set<std::string> namespaces;
};

PrivateNames private_names(const std::vector<std::string>& lines) {
  const std::regex space("^(?:inline )?namespace (?:dyop::)?([a-z_]+_internal)\\b");
  const std::regex type("^(?:class|struct|enum class) (?:DYOP_EXPORT )?([A-Za-z]+)[^;]*$");
  PrivateNames names;
  bool is_private = false;
  bool is_anonymous = false;
  for (const std::string& line : lines) {
    std::smatch match;
    if (line == "namespace {") is_anonymous = true;
    if (line == "}  // namespace") is_anonymous = false;
    if (std::regex_search(line, match, space)) {
      names.namespaces.insert(match[1]);
      is_private = true;
    }
    if (line.starts_with("}  // namespace") && line.ends_with("_internal")) is_private = false;
    if (is_private && !is_anonymous && std::regex_search(line, match, type))
      names.types.insert(match[1]);
  }
  return names;
}

TEST(Namespaces, EachRoomHasAPrivateOneOfItsOwn) {
  std::map<std::string, fs::path> home;
  for (const fs::path& file : room_files({"include", "src"})) {
    if (file.filename() == "namespaces.h") continue;
    const PrivateNames names = private_names(read_lines(file));
    for (const std::string& space : names.namespaces) {
      // A forward declaration may name the namespace of a room below.
      const std::string room = space.substr(0, space.rfind("_internal"));
      ASSERT_TRUE(kLevel.contains(room)) << file << " opens " << space;
      EXPECT_TRUE(may_include(room_of(file), room)) << file << " opens " << space;
    }
    for (const std::string& type : names.types) {
      const auto [known, is_new] = home.emplace(type, file);
      EXPECT_TRUE(is_new) << type << " is a private type of " << known->second << " and " << file;
    }
  }
  EXPECT_GT(home.size(), 200u);
}

TEST(Namespaces, TheRuleItselfFindsTypes) {
  const PrivateNames names =
      private_names({"namespace dyop::toi_internal {", "class Known;", "struct Found {",
                     "namespace {", "struct Hidden {", "}  // namespace",
                     "}  // namespace dyop::toi_internal", "struct Public {"});
  EXPECT_EQ(names.types, (std::set<std::string>{"Found"}));
  EXPECT_EQ(names.namespaces, (std::set<std::string>{"toi_internal"}));
}

// Numerical constants live in core/tolerance.h; elsewhere a floating literal below 1e-3 needs a
// reason on its line or just above.
std::vector<std::string> unexplained_literals(const std::vector<std::string>& lines) {
  const std::regex literal("[^A-Za-z0-9_.]([0-9]+\\.?[0-9]*e-[0-9]+|0\\.000[0-9]+)");
  std::vector<std::string> found;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::string without_text = std::regex_replace(lines[i], std::regex("\"[^\"]*\""), "");
    const std::string code = without_text.substr(0, without_text.find("//"));
    std::smatch match;
    if (!std::regex_search(code, match, literal) || std::stod(match[1].str()) >= 1e-3) continue;
    bool has_reason = false;
    for (std::size_t back = 0; back <= 3 && back <= i; ++back) {
      has_reason = has_reason || lines[i - back].find("literal:") != std::string::npos;
    }
    if (!has_reason) found.push_back(lines[i]);
  }
  return found;
}

TEST(Constants, LiveInOneHome) {
  for (const fs::path& file : room_files({"include", "src"})) {
    if (file.filename() == "tolerance.h") continue;
    for (const std::string& line : unexplained_literals(read_lines(file))) {
      ADD_FAILURE() << file << ": literal without a reason: " << line;
    }
  }
}

TEST(Constants, TheRuleItselfFindsOne) {
  EXPECT_EQ(unexplained_literals({"if (x < 1e-12) return;"}).size(), 1u);
  EXPECT_EQ(unexplained_literals({"x = y * 0.0001;"}).size(), 1u);
  EXPECT_TRUE(unexplained_literals({"// literal: why", "if (x < 1e-12) return;"}).empty());
  EXPECT_TRUE(unexplained_literals({"x = 0.5 * 1e-2;"}).empty());
}

TEST(Headers, AreListedInTheirRoom) {
  for (const fs::path& file : room_files({"include"})) {
    std::string lists;
    for (const fs::path& list : build_files()) {
      if (list.string().starts_with((kRoot / "src" / room_of(file) / "").string()))
        lists += read_text(list);
    }
    const std::regex stem("\\b" + file.stem().string() + "\\b");
    EXPECT_TRUE(std::regex_search(lists, stem)) << file << " is not installed";
  }
}

TEST(Headers, AreIncludedByATestOfTheirRoom) {
  // Plain data and bases come with the headers that use them.
  const std::set<std::string> plain{
      "types",      "export",     "namespaces",       "shape",
      "toi_result", "rigid_body", "contact_features", "triangle_block"};
  for (const fs::path& file : room_files({"include"})) {
    const std::string room = room_of(file);
    if (plain.contains(file.stem().string())) continue;
    const std::string include = "#include \"dyop/" + room + "/" + file.filename().string() + "\"";
    bool is_included = false;
    for (const fs::path& test : code_files({"tests/" + room})) {
      is_included = is_included || read_text(test).find(include) != std::string::npos;
    }
    EXPECT_TRUE(is_included) << file << " is not included by any test of its room";
  }
}

std::vector<fs::path> pages() {
  std::vector<fs::path> files{kRoot / "README.md"};
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / "docs")) {
    if (entry.path().extension() == ".md") files.push_back(entry.path());
  }
  return files;
}

std::vector<std::string> all_matches(const std::string& text, const std::regex& pattern) {
  std::vector<std::string> found;
  for (std::sregex_iterator match(text.begin(), text.end(), pattern), end; match != end; ++match) {
    found.push_back((*match)[1].str());
  }
  return found;
}

TEST(Docs, LinkToFilesThatExist) {
  const std::regex link("\\]\\(([^)#:\\s]+)(#[^)]*)?\\)");
  int checked = 0;
  for (const fs::path& page : pages()) {
    for (const std::string& target : all_matches(read_text(page), link)) {
      EXPECT_TRUE(fs::exists(page.parent_path() / target)) << page << " links to " << target;
      ++checked;
    }
  }
  EXPECT_GT(checked, 100);
}

TEST(Docs, NameHeadersThatExist) {
  const std::regex header("[`<](dyop/[a-z_0-9/]+\\.h)[`>]");
  for (const fs::path& page : pages()) {
    if (page.filename() == "CHANGELOG.md") continue;  // has those of earlier versions
    for (const std::string& name : all_matches(read_text(page), header)) {
      EXPECT_TRUE(fs::exists(kRoot / "include" / name)) << page << " names " << name;
    }
  }
}

TEST(Docs, AreThereWhereCodeNamesThem) {
  const std::regex page("\\b(docs/[A-Za-z_0-9/-]+\\.md)\\b");
  for (const fs::path& file : code_files({"include", "src", "tests", "examples"})) {
    for (const std::string& name : all_matches(read_text(file), page)) {
      EXPECT_TRUE(fs::exists(kRoot / name)) << file << " names " << name;
    }
  }
}

TEST(Umbrella, IncludesAllThatAQueryNeeds) {
  // Kernels on single triangles, and what motions are made of.
  const std::set<std::string> left_out{"triangle_block", "triangle_distance_batch", "steady_turn",
                                       "namespaces"};
  const std::string umbrella = read_text(kUmbrella);
  int checked = 0;
  for (const fs::path& file : room_files({"include"})) {
    const std::string room = room_of(file);
    const bool is_query = kLevel.at(room) <= kLevel.at("toi") && room != "paper";
    const std::string include = "#include \"dyop/" + room + "/" + file.filename().string() + "\"";
    const bool is_wanted = is_query && !left_out.contains(file.stem().string());
    EXPECT_EQ(umbrella.find(include) != std::string::npos, is_wanted) << include;
    checked += is_wanted;
  }
  EXPECT_GT(checked, 30);
}

TEST(Umbrella, IsForUsersOnly) {
  for (const fs::path& file : room_files({"include", "src"})) {
    EXPECT_EQ(read_text(file).find("dyop/dyop.h"), std::string::npos) << file;
  }
}

TEST(Examples, AreShortAndNumberedAndSayWhatTheyPrint) {
  int number = 0;
  for (const fs::path& file : code_files({"examples"})) {
    if (file.parent_path() != kRoot / "examples") continue;  // of one use: examples/planning
    const std::string name = file.filename().string();
    EXPECT_EQ(std::stoi(name.substr(0, 2)), ++number) << name;
    EXPECT_EQ(name[2], '_') << name;
    const std::vector<std::string> lines = read_lines(file);
    const auto prints = std::find(lines.begin(), lines.end(), "// Prints:");
    EXPECT_LT(prints - lines.begin(), 60) << name;
    EXPECT_GE(lines.end() - prints, 2) << name << " does not say what it prints";
    const std::string list = read_text(kRoot / "examples/CMakeLists.txt");
    EXPECT_NE(list.find(file.stem().string()), std::string::npos) << name << " is not built";
  }
  EXPECT_GE(number, 8);
}

TEST(Packages, TheBuildAsksForListedOnesOnly) {
  const std::string list = read_text(kRoot / ".ci/install.sh");
  const std::regex find("dyop_find\\([\\w-]+ ([a-z0-9.+-]+)");
  std::set<fs::path> asking;
  for (const fs::path& file : build_files()) {
    const std::string text = read_text(file);
    for (auto match = std::sregex_iterator(text.begin(), text.end(), find);
         match != std::sregex_iterator(); ++match) {
      const std::string package = (*match)[1];
      if (package == "libc6-dev") continue;  // comes with every compiler
      EXPECT_TRUE(std::regex_search(list, std::regex("\\b" + package + "\\b")))
          << package << " of " << file;
      asking.insert(file);
    }
  }
  EXPECT_GT(asking.size(), 5u);
}

// Characters, not bytes.
std::size_t width_of(const std::string& line) {
  return std::size_t(std::count_if(line.begin(), line.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0u) != 0x80u;
  }));
}

TEST(Headers, HaveLinesOfAHundredColumnsAtMost) {
  for (const fs::path& file : code_files({"include"})) {
    for (const std::string& line : read_lines(file))
      EXPECT_LE(width_of(line), 100u) << file << line;
  }
}

// True if the licence stands in the first two lines (a script's first one names its interpreter).
bool names_its_licence(const std::vector<std::string>& lines) {
  const auto end = lines.begin() + std::ptrdiff_t(std::min<std::size_t>(lines.size(), 2));
  return std::any_of(lines.begin(), end, [](const std::string& line) {
    return line == "// SPDX-License-Identifier: BSD-3-Clause" ||
           line == "# SPDX-License-Identifier: BSD-3-Clause" ||
           line == "/* SPDX-License-Identifier: BSD-3-Clause */";
  });
}

TEST(Licence, IsNamedByEveryCodeFile) {
  const std::set<std::string> extensions{".c", ".h", ".cpp", ".sh", ".cmake", ".py", ".js", ".mjs"};
  int checked = 0;
  for (const char* folder : {"include", "src", "examples", "tests", ".ci"}) {
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder)) {
      const fs::path& file = entry.path();
      if (!extensions.contains(file.extension().string()) && file.filename() != "CMakeLists.txt")
        continue;
      EXPECT_TRUE(names_its_licence(read_lines(file))) << file;
      ++checked;
    }
  }
  EXPECT_GT(checked, 500);
  EXPECT_FALSE(names_its_licence({"#pragma once"}));
}

TEST(Headers, ShowTheirNamespaceInASharedLibrary) {
  for (const fs::path& file : code_files({"include"})) {
    if (file.filename() == "namespaces.h") continue;  // declares nothing that could be exported
    for (const std::string& line : read_lines(file)) {
      EXPECT_NE(line, "namespace dyop {") << file << ": write `namespace DYOP_EXPORT dyop {`";
    }
  }
}

// Members without an initial value of structs that users fill in, which would warn at
// `WorldOptions{.gravity_W = g}`.
std::vector<std::string> members_without_defaults(const std::vector<std::string>& lines) {
  const std::regex begins(
      "struct (\\w*(Options|Definition|Limits|Filter|Motor|Query)|Obstacle|Link|Joint)( : .*)? "
      "\\{");
  const std::regex member("  (?!using |friend |static |enum |struct )[\\w:][^=()]*;.*");
  const std::regex arguments("<[^;]*>");  // of templates, which may have parentheses
  std::vector<std::string> found;
  bool is_inside = false;
  for (const std::string& line : lines) {
    if (std::regex_match(line, begins)) is_inside = true;
    if (line.starts_with("};")) is_inside = false;
    const std::string code = std::regex_replace(line.substr(0, line.find("//")), arguments, "");
    if (is_inside && std::regex_match(code, member)) found.push_back(line);
  }
  return found;
}

TEST(Headers, GiveEveryMemberOfOptionsAnInitialValue) {
  for (const fs::path& file : code_files({"include"})) {
    for (const std::string& line : members_without_defaults(read_lines(file))) {
      ADD_FAILURE() << file << ": write ` = {}` in" << line;
    }
  }
  const std::vector<std::string> lines{"struct AOptions {",
                                       "  int a = 0;",
                                       "  Pose b;  ///< x = 1",
                                       "  std::function<void(int)> c;",
                                       "  bool d() const;",
                                       "};",
                                       "struct Other {",
                                       "  int a;",
                                       "};"};
  EXPECT_EQ(members_without_defaults(lines), (std::vector<std::string>{lines[2], lines[3]}));
}

// Lines of code without indentation; no blank lines, comments or includes.
std::vector<std::string> code_lines(const std::vector<std::string>& lines) {
  std::vector<std::string> code;
  for (const std::string& line : lines) {
    const std::size_t first = line.find_first_not_of(' ');
    if (first == std::string::npos) continue;
    const std::string text = line.substr(first);
    if (text.starts_with("//") || text.starts_with("#include")) continue;
    code.push_back(text);
  }
  return code;
}

// Passages of this many lines that stand in more than one place, by their first line.
std::set<std::string> repeated_passages(const std::vector<std::vector<std::string>>& files,
                                        std::size_t length) {
  std::set<std::string> seen;
  std::set<std::string> repeated;
  for (const std::vector<std::string>& lines : files) {
    for (std::size_t i = 0; i + length <= lines.size(); ++i) {
      std::string passage;
      for (std::size_t k = i; k < i + length; ++k) passage += lines[k] + '\n';
      if (!seen.insert(passage).second) repeated.insert(lines[i]);
    }
  }
  return repeated;
}

TEST(Sizes, NoPassageStandsTwice) {
  std::vector<std::vector<std::string>> files;
  for (const fs::path& file : code_files({"include", "src"}))
    files.push_back(code_lines(read_lines(file)));
  for (const std::string& first : repeated_passages(files, 15))
    ADD_FAILURE() << "15 lines stand twice, from: " << first;
  EXPECT_EQ(repeated_passages({{"a", "b", "c"}, {"x", "b", "c"}}, 2).size(), 1u);
  EXPECT_TRUE(repeated_passages({{"a", "b", "c"}, {"x", "b", "d"}}, 2).empty());
}

TEST(Readme, ShowsTheConsumerThatIsCompiled) {
  const std::string readme = read_text(kRoot / "README.md");
  const std::string consumer = read_text(kRoot / "tests/consumer/find_package/main.cpp");
  EXPECT_NE(readme.find(consumer), std::string::npos)
      << "README.md must hold tests/consumer/find_package/main.cpp word for word";
}

TEST(TopLevel, HoldsOnlyWhatToolsInsistOn) {
  const std::set<std::string> allowed{
      ".ci",        ".clang-format",  ".clang-tidy",       ".editorconfig", ".git",
      ".gitignore", "CMakeLists.txt", "CMakePresets.json", "LICENSE",       "README.md",
      "build",      "docs",           "examples",          "include",       "pyproject.toml",
      "src",        "tests"};
  for (const auto& entry : fs::directory_iterator(kRoot)) {
    EXPECT_TRUE(allowed.contains(entry.path().filename().string())) << entry.path();
  }
}

}  // namespace
