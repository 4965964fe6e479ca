// A small study as a user types it.
#pragma once

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/run_program.h"

namespace mbv {

// A mass on a slide: holding it against gravity takes m g; the study varies m.
class StudyCommand : public testing::Test {
 protected:
  StudyCommand() {
    Write("model.yaml",
          "name: lift\nparameters: {m: {value: 2, unit: kg}, g: {value: 10, unit: m/s^2}}\n"
          "gravity: [0, 0, -g]\nbodies: {cart: {mass: m, inertia: [1, 1, 1]}}\n"
          "joints: {slide: {kind: prismatic, parent: world, child: cart, axis: z}}\n"
          "drives: {x: {kind: joint, joint: slide}}\n");
    Write("hold.yaml",
          "mechanism: model.yaml\nmotion: {duration_s: 0.1, sample_s: 0.01, commands: {x: {sine: "
          "{amplitude: 0.1, period_s: 1}}}}\nanalytic: none\nsimulation: {mode: inverse}\n");
  }
  // A study of mass and gravity with this design and what follows it.
  void WriteStudy(const std::string& design, const std::string& more = "") const {
    Write("s.yaml",
          "study: s\nscenario: hold.yaml\n"
          "vary: {m: {uniform: {min: 1, max: 3}}, g: {uniform: {min: 9, max: 11}}}\n"
          "design: " +
              design + "\nquantities: [x.force.mean, closure_m]\n" + more);
  }
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(mbverify.folder() / name, std::ios::binary) << text;
  }
  [[nodiscard]] std::string File(const std::string& name) const {
    return (mbverify.folder() / name).string();
  }
  [[nodiscard]] ProgramResult Study(const std::string& out, const std::string& more = "") const {
    return mbverify("study " + File("s.yaml") + " --out " + File(out) + " " + more);
  }
  [[nodiscard]] std::string Points(const std::string& out) const {
    return ReadAll(File(out + "/s/points.csv"));
  }
  [[nodiscard]] nlohmann::json Summary(const std::string& out) const {
    return nlohmann::json::parse(ReadAll(File(out + "/s/summary.json")));
  }
  Program mbverify{std::string("study_") +
                   testing::UnitTest::GetInstance()->current_test_info()->name()};
};

}  // namespace mbv
