#include "pipeline/study_points.h"

#include <fmt/format.h>

#include <fstream>
#include <functional>
#include <optional>

#include "core/growing_file.h"
#include "core/in_children.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

std::string BytesOfForces(const StudyPoint& point) {
  if (point.row.point >= kBandPoints) return "";
  return {reinterpret_cast<const char*>(point.forces.data()), point.forces.size() * sizeof(float)};
}

// Once more, alone: what killed the child may have been none of the point's doing.
std::optional<std::string> Again(const std::function<std::string(size_t)>& work, size_t point,
                                 double timeout_s) {
  return InChildren(1, timeout_s, [&](size_t) { return work(point); }).front();
}

std::uint64_t FileSize(const fs::path& path) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  return error ? 0 : size;
}

}  // namespace

PointsDone FindDone(const StudyBench& bench, const StudyShare& share, const fs::path& folder) {
  PointsDone done;
  std::ifstream stream(folder / kPointsFile, std::ios::binary);
  std::string line;
  const std::uint64_t record = bench.forces().size() * sizeof(float);
  const std::uint64_t forces = FileSize(folder / kForcesFile);
  if (!std::getline(stream, line) || stream.eof()) return done;
  if (line + "\n" != PointHeader(bench.study())) return done;
  done.csv_bytes = line.size() + 1;
  while (std::getline(stream, line) && !stream.eof()) {  // eof: the line has no end
    const auto row = ReadPointLine(line, bench.study());
    if (!row || row->point != share.number(done.rows)) break;
    const std::uint64_t force_bytes = record * share.records(done.rows + 1);
    if (force_bytes > forces) break;
    ++done.rows;
    done.csv_bytes += line.size() + 1;
    done.force_bytes = force_bytes;
  }
  return done;
}

std::string ComputePoints(const StudyBench& bench, const PointsOptions& options,
                          const PointsDone& done, const fs::path& folder) {
  GrowingFile csv(folder / kPointsFile), forces(folder / kForcesFile);
  std::string trouble = csv.Open(done.csv_bytes);
  if (trouble.empty()) trouble = forces.Open(done.force_bytes);
  if (trouble.empty() && done.csv_bytes == 0) trouble = csv.Append(PointHeader(bench.study()));
  if (!trouble.empty()) return trouble;
  const std::uint64_t all = options.share.size(bench.points().count());
  const auto number = [&](size_t i) { return options.share.number(done.rows + i); };
  const auto work = [&](size_t i) {  // in a child
    const StudyPoint point = bench.Run(number(i));
    return PointLine(point.row, bench.study()) + BytesOfForces(point);
  };
  const std::string lost =
      fmt::format("ended by a crash, or not finished after {:g} s", options.timeout_s);
  const auto take = [&](size_t i, std::optional<std::string> text) {
    std::string line, bytes;
    if (!text) text = Again(work, i, options.timeout_s);
    if (text) {
      const size_t end = text->find('\n') + 1;
      line = text->substr(0, end);
      bytes = text->substr(end);
    } else {
      const StudyPoint point = bench.Lost(number(i), lost);
      line = PointLine(point.row, bench.study());
      bytes = BytesOfForces(point);
    }
    trouble = forces.Append(bytes);  // first: a row has its forces
    if (trouble.empty()) trouble = csv.Append(line);
    if (options.progress) options.progress(done.rows + i + 1, all);
    return trouble.empty();
  };
  StreamFromChildren(all - done.rows, {.parallel = options.jobs, .timeout_s = options.timeout_s},
                     work, take);
  if (trouble.empty()) trouble = forces.Finish();
  return trouble.empty() ? csv.Finish() : trouble;
}

}  // namespace mbv
