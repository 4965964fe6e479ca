#include "pipeline/study_bands.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "study/statistics.h"

namespace mbv {
namespace {

// One drive's part of every record: points × times.
std::vector<std::vector<float>> DriveRecords(const StudyForces& forces, size_t drive,
                                             std::ifstream* stream) {
  const size_t times = forces.time_s.size();
  const auto bytes = static_cast<std::streamsize>(times * sizeof(float));
  std::vector<std::vector<float>> records;
  for (std::uint64_t k = 0;; ++k) {
    std::vector<float> samples(times);
    stream->clear();
    stream->seekg(static_cast<std::streamoff>(sizeof(float) * (k * forces.size() + drive * times)));
    stream->read(reinterpret_cast<char*>(samples.data()), bytes);
    if (stream->gcount() != bytes) return records;
    records.push_back(std::move(samples));
  }
}

}  // namespace

std::vector<StudyBand> StudyBands(const StudyBench& bench, const std::filesystem::path& file) {
  std::vector<StudyBand> bands;
  const StudyForces& forces = bench.forces();
  const size_t times = forces.time_s.size();
  std::ifstream stream(file, std::ios::binary);
  for (size_t d = 0; d < forces.drives.size() && stream.is_open(); ++d) {
    StudyBand band{.drive = forces.drives[d],
                   .unit = forces.units[d],
                   .time_s = forces.time_s,
                   .nominal = {},
                   .p5 = {},
                   .p50 = {},
                   .p95 = {}};
    auto records = DriveRecords(forces, d, &stream);
    const size_t all = records.size();
    std::erase_if(records, [](const std::vector<float>& r) {
      return !std::all_of(r.begin(), r.end(), [](float v) { return std::isfinite(v); });
    });
    band.points = records.size();
    band.left_out = all - records.size();
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
