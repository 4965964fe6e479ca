#include "pipeline/study_bands.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "study/statistics.h"

namespace mbv {
std::vector<std::vector<float>> DriveRecords(const StudyForces& forces, size_t drive,
                                             const std::filesystem::path& file, size_t* left_out) {
  const size_t times = forces.time_s.size();
  const auto bytes = static_cast<std::streamsize>(times * sizeof(float));
  std::vector<std::vector<float>> records;
  std::ifstream stream(file, std::ios::binary);
  size_t all = 0;
  for (;; ++all) {
    std::vector<float> samples(times);
    stream.clear();
    stream.seekg(
        static_cast<std::streamoff>(sizeof(float) * (all * forces.size() + drive * times)));
    stream.read(reinterpret_cast<char*>(samples.data()), bytes);
    if (stream.gcount() != bytes) break;
    const bool numbers =
        std::all_of(samples.begin(), samples.end(), [](float v) { return std::isfinite(v); });
    if (numbers) records.push_back(std::move(samples));
  }
  if (left_out != nullptr) *left_out = all - records.size();
  return records;
}

std::vector<StudyBand> StudyBands(const StudyBench& bench, const std::filesystem::path& file) {
  std::vector<StudyBand> bands;
  const StudyForces& forces = bench.forces();
  const size_t times = forces.time_s.size();
  for (size_t d = 0; d < forces.drives.size(); ++d) {
    StudyBand band{.drive = forces.drives[d],
                   .unit = forces.units[d],
                   .time_s = forces.time_s,
                   .nominal = {},
                   .p5 = {},
                   .p50 = {},
                   .p95 = {}};
    size_t left_out = 0;
    const auto records = DriveRecords(forces, d, file, &left_out);
    band.points = records.size();
    band.left_out = left_out;
    for (size_t t = 0; t < times && !records.empty(); ++t) {
      std::vector<double> values;
      values.reserve(records.size());
      for (const auto& record : records) values.push_back(static_cast<double>(record[t]));
      std::sort(values.begin(), values.end());
      band.nominal.push_back(static_cast<double>(bench.nominal().forces[d * times + t]));
      band.p5.push_back(Percentile(values, 0.05));
      band.p50.push_back(Percentile(values, 0.50));
      band.p95.push_back(Percentile(values, 0.95));
    }
    if (band.points > 0) bands.push_back(std::move(band));
  }
  return bands;
}

}  // namespace mbv
