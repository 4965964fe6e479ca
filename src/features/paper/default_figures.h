// The figures that a paper usually shows of a motion.
//
//   drive_forces, drive_torques   lines of one witness, markers of the others; below, the largest
//                                 difference of all drives, for each pair of witnesses, in
//                                 120 spans of time
//   drive_strokes, drive_angles   positions, and rates below
//   reactions                     magnitudes of joint forces and moments, the largest ones
//   power_energy                  power of each drive; energies
//   force_speed, torque_speed     force over speed
//
// Drives are parted by unit, and where there are more than kMostCurves into several figures.
#pragma once

#include <string>
#include <vector>

#include "features/paper/signals.h"
#include "plot/figure.h"
#include "report/report.h"

namespace mbv {

inline constexpr size_t kMostCurves = 8;  ///< of one panel, each with its own dashes and colour

struct FigureSet {
  std::vector<Figure> figures;
  std::vector<std::string> left_out;  ///< sentences: what is not shown, and why
};
[[nodiscard]] FigureSet DefaultFigures(const Report& report, Language language);

}  // namespace mbv
