// Simbody 3.7 as a witness: a mechanism's drive forces by another engine with its own mathematics.
//
// mbverify calls it in a folder with mechanism.json, motion.csv and loads.csv, and it leaves
// witness.json and traces.csv there (docs/how-to/external_solvers.md). Joints of the spanning tree
// are Simbody's mobilizers, closures its constraints, drives constraints on a mobilizer's
// coordinate or on the distance of two points.
#include <iostream>

#include "commanded.h"
#include "free.h"

using namespace simbody_witness;

int main() {
  json answer = {{"schema", "mbverify/witness/1"},
                 {"program", "Simbody"},
                 {"version", "3.7"},
                 {"units", "SI"},
                 {"method", "mobilizers of a spanning tree, constraints with multipliers"},
                 {"declined", {{{"what", "joint reactions"}, {"why", "not read out"}}}}};
  try {
    std::ifstream file("mechanism.json");
    json mechanism = json::parse(file);
    double compute_s = 0.0;
    if (std::ifstream("start.csv").good()) {
      FreeMotion motion(std::move(mechanism));
      const Stopwatch watch(&compute_s);
      motion.Run();
    } else {
      CommandedMotion motion(std::move(mechanism));
      const Stopwatch watch(&compute_s);
      motion.Run();
    }
    answer["compute_s"] = compute_s;
  } catch (const Refused& why) {
    answer["refused"] = why.what();
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  std::ofstream("witness.json") << answer.dump(1) << '\n';
  return 0;
}
