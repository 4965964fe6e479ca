// --data of run: results for other programs.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/run_program.h"

namespace mbv {
namespace {

TEST(RunData, TracesAreThereForOctaveAndHdf5) {
  const Program mbverify("data");
  const ProgramResult run = mbverify(
      "run scenarios/four_bar/turn_inverse.yaml --no-pictures --no-report --data mat,h5 "
      "--out " +
      mbverify.Out());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const ProgramResult read = mbverify.Script(
      "cd " + mbverify.Out() +
      "/four_bar/turn_inverse && octave-cli --no-init-file --quiet --eval '"
      "load traces.mat; k = strcmp(reference.names, \"motor.force\");"
      "printf(\"%s %s %.17g\\n\", info.verdict, reference.units{k}, reference.values(3, k))'; "
      "h5dump -m %.17g -d /reference/motor.force -s 2 -c 1 traces.h5");
  std::istringstream lines(read.out);
  std::string verdict, newton, metre, force;
  lines >> verdict >> newton >> metre >> force;
  EXPECT_EQ(verdict + " " + newton + " " + metre, "agree N m") << read.out << read.err;
  EXPECT_NE(read.out.find("(2): " + force), std::string::npos) << read.out;
}

TEST(RunData, TheColumnsOfTheCsvAreDescribedInTheirOrder) {
  const Program mbverify("data_csv");
  const ProgramResult run = mbverify(
      "run scenarios/four_bar/turn_inverse.yaml --no-pictures --no-report --data csv --out " +
      mbverify.Out());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const std::string folder = mbverify.Out() + "/four_bar/turn_inverse/";
  const auto json = nlohmann::json::parse(ReadAll(folder + "traces.csv-metadata.json"));
  std::string header;
  for (const auto& column : json["tableSchema"]["columns"]) {
    header += (header.empty() ? "" : ",") + column["name"].get<std::string>();
    if (column["name"] != "motor.force.simulated") continue;
    EXPECT_EQ(column["schema:unitText"], "N m");
    EXPECT_EQ(column["urn:mbverify:subject"], "motor");
    EXPECT_EQ(column["urn:mbverify:quantity"], "force");
  }
  const std::string csv = ReadAll(folder + json["url"].get<std::string>());
  EXPECT_EQ(csv.substr(0, csv.find('\n')), header);
  EXPECT_NE(header.find("motor.force.simulated"), std::string::npos);
}

TEST(RunData, AnUnknownFormatIsRefused) {
  const Program mbverify("data_format");
  const ProgramResult run = mbverify("run scenarios/four_bar/turn_inverse.yaml --data xls");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("xls"), std::string::npos) << run.err;
  EXPECT_NE(run.err.find("csv, mat, mat73, h5"), std::string::npos) << run.err;
}

}  // namespace
}  // namespace mbv
