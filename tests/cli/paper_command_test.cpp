// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "cli/command.h"
#include "support/oracles/triangle_oracle.h"

namespace dyop {
namespace {

namespace fs = std::filesystem;

using testing::CommandResult;
using testing::run_command;
using testing::TemporaryDirectory;

using Row = std::map<std::string, std::string>;

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields(1);
  bool is_quoted = false;
  for (const char c : line) {
    if (c == '"') {
      is_quoted = !is_quoted;
    } else if (c == ',' && !is_quoted) {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

std::vector<Row> read_csv(const fs::path& file) {
  std::istringstream text(TemporaryDirectory::read(file));
  std::string line;
  std::getline(text, line);
  const std::vector<std::string> names = fields_of(line);
  std::vector<Row> rows;
  while (std::getline(text, line)) {
    const std::vector<std::string> fields = fields_of(line);
    EXPECT_EQ(fields.size(), names.size()) << line;
    Row& row = rows.emplace_back();
    for (std::size_t k = 0; k < names.size() && k < fields.size(); ++k) row[names[k]] = fields[k];
  }
  return rows;
}

Scalar number(const Row& row, const std::string& name) {
  return std::stod(row.at(name));
}

Triangle triangle_of(const Row& row, const std::string& name) {
  Triangle triangle;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::string vertex = name + std::to_string(k);
    triangle[k] = {number(row, vertex + "x"), number(row, vertex + "y"), number(row, vertex + "z")};
  }
  return triangle;
}

// One run for all tests, with few repetitions: times are rough, everything else is as ever.
class PaperCommand : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    directory_ = new TemporaryDirectory;
    result_ = new CommandResult(run_command({"paper", "--out", out().string(), "--repetitions", "3",
                                             "--error-pairs", "2000", "--json"}));
    ASSERT_EQ(result_->exit_code, 0) << result_->err;
  }
  static void TearDownTestSuite() {
    delete result_;
    delete directory_;
  }
  static fs::path out() { return directory_->path() / "paper"; }
  static std::vector<Row> tests() { return read_csv(out() / "tests.csv"); }

  static TemporaryDirectory* directory_;
  static CommandResult* result_;
};

TemporaryDirectory* PaperCommand::directory_ = nullptr;
CommandResult* PaperCommand::result_ = nullptr;

TEST_F(PaperCommand, WritesTablesFiguresAndDrawings) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(out())) {
    names.insert(entry.path().filename().string());
  }
  for (const char* name : {"paper.md", "times.csv", "tests.csv", "times-2d.svg", "times-3d.svg",
                           "times-2d-moving.svg", "times-3d-moving.svg", "gains-2d.svg",
                           "gains-3d.svg", "gains-2d-moving.svg", "gains-3d-moving.svg"}) {
    EXPECT_TRUE(names.contains(name)) << name;
  }
  const auto drawings = std::count_if(names.begin(), names.end(), [](const std::string& name) {
    return name.starts_with("construction-");
  });
  EXPECT_EQ(drawings, 4);  // in 2D and 3D, one right and one wrong
}

TEST_F(PaperCommand, EveryDrawingIsASmallSvgWithoutNan) {
  int drawings = 0;
  for (const auto& entry : fs::directory_iterator(out())) {
    if (entry.path().extension() != ".svg") continue;
    const std::string text = TemporaryDirectory::read(entry.path());
    EXPECT_TRUE(text.starts_with("<svg xmlns=")) << entry.path();
    EXPECT_TRUE(text.ends_with("</svg>\n")) << entry.path();
    EXPECT_LT(text.size(), 60000u) << entry.path();
    for (const char* broken : {"\"nan", "\"-nan", "\"inf", "\"-inf", "nan,", "inf,"}) {
      EXPECT_EQ(text.find(broken), std::string::npos) << entry.path() << ": " << broken;
    }
    ++drawings;
  }
  EXPECT_EQ(drawings, 12);
}

TEST_F(PaperCommand, HasNinetyTestsInEachDimension) {
  std::set<std::vector<std::string>> seen;
  for (const Row& row : tests()) {
    EXPECT_NE(row.at("object"), row.at("against"));
    seen.insert({row.at("dimension"), row.at("object"), row.at("against")});
  }
  EXPECT_EQ(tests().size(), 180u);
  EXPECT_EQ(seen.size(), 180u);
}

TEST_F(PaperCommand, CertifiedDyopIsRightInEveryTest) {
  for (const Row& row : tests()) {
    const auto truth =
        testing::oracle_triangle_distance(triangle_of(row, "a"), triangle_of(row, "b"));
    EXPECT_LE(static_cast<long double>(number(row, "lower")), truth.upper());
    EXPECT_GE(static_cast<long double>(number(row, "upper")), truth.lower());
    EXPECT_LT(number(row, "upper") - number(row, "lower"), 1e-12);
    EXPECT_EQ(number(row, "certified DyOP"), number(row, "upper"));
    EXPECT_NEAR(static_cast<double>(truth.distance), 0.1, 1e-12);
  }
}

TEST_F(PaperCommand, RivalsAreRightAndPublishedDyopIsAbove) {
  int wrong = 0;
  for (const Row& row : tests()) {
    for (const char* name : {"GJK", "Lin-Canny", "libccd GJK", "certified GJK"}) {
      EXPECT_NEAR(number(row, name), 0.1, 1e-9) << name;
    }
    EXPECT_GE(number(row, "published DyOP"), number(row, "lower") - 1e-12);
    wrong += number(row, "published DyOP") > 0.1 + 1e-9;
  }
  EXPECT_GT(wrong, 60);
  EXPECT_LT(wrong, 150);
}

TEST_F(PaperCommand, TheTablesAgreeWithTheTests) {
  std::map<std::pair<std::string, std::string>, int> wrong;  // by dimension and object
  for (const Row& row : tests()) {
    wrong[{row.at("dimension"), row.at("object")}] += number(row, "published DyOP") > 0.1 + 1e-9;
  }
  int rows = 0;
  for (const Row& row : read_csv(out() / "times.csv")) {
    const bool is_published = row.at("algorithm") == "published DyOP";
    EXPECT_EQ(number(row, "wrong_tests_of_9"),
              is_published ? wrong.at({row.at("dimension"), row.at("object")}) : 0);
    EXPECT_GT(number(row, "median_ns"), 0);
    EXPECT_LE(number(row, "lower_quartile_ns"), number(row, "median_ns"));
    EXPECT_LE(number(row, "median_ns"), number(row, "upper_quartile_ns"));
    ++rows;
  }
  EXPECT_EQ(rows, 10 * (6 + 6 + 7 + 8));  // moving: also the warm ones
}

TEST_F(PaperCommand, TheSummaryIsOneJsonObject) {
  const auto json = nlohmann::json::parse(result_->out);
  EXPECT_EQ(json.at("results").size(), 27u);
  for (const auto& row : json.at("results")) {
    if (row.at("is_certified")) {
      EXPECT_EQ(row.at("wrong_tests"), 0) << row.at("algorithm");
      EXPECT_EQ(row.at("wrong_query_share"), 0) << row.at("algorithm");
    }
  }
}

TEST_F(PaperCommand, TheSeedDecidesTheTests) {
  const auto tests_with = [&](const std::string& seed, const std::string& name) {
    const fs::path directory = directory_->path() / name;
    const CommandResult run = run_command({"paper", "--out", directory.string(), "--seed", seed,
                                           "--repetitions", "1", "--error-pairs", "1"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return TemporaryDirectory::read(directory / "tests.csv");
  };
  EXPECT_EQ(tests_with("1", "same"), TemporaryDirectory::read(out() / "tests.csv"));
  EXPECT_NE(tests_with("2", "other"), TemporaryDirectory::read(out() / "tests.csv"));
}

TEST_F(PaperCommand, DrawsThePairThatIsAskedFor) {
  const fs::path directory = directory_->path() / "pair";
  const CommandResult run = run_command({"paper", "--out", directory.string(), "--pair", "3,7",
                                         "--repetitions", "1", "--error-pairs", "1"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  for (const char* name : {"construction-2d-3-7.svg", "construction-3d-3-7.svg"}) {
    const std::string text = TemporaryDirectory::read(directory / name);
    EXPECT_NE(text.find("Obj3 against Obj7"), std::string::npos) << name;
  }
  EXPECT_NE(run.out.find("| certified DyOP |"), std::string::npos);
}

TEST_F(PaperCommand, APairThatDoesNotExistIsBadInput) {
  for (const char* pair : {"0,1", "1,11", "4,4", "1,2,3", "5"}) {
    const CommandResult run =
        run_command({"paper", "--out", (directory_->path() / "bad").string(), "--pair", pair});
    EXPECT_EQ(run.exit_code, 2) << pair;
    EXPECT_NE(run.err.find("--pair"), std::string::npos) << run.err;
  }
}

TEST_F(PaperCommand, ADirectoryThatCannotBeMadeIsBadInput) {
  const fs::path file = directory_->write("file", "");
  const CommandResult run = run_command({"paper", "--out", (file / "below").string()});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("could not be created"), std::string::npos) << run.err;
}

}  // namespace
}  // namespace dyop
