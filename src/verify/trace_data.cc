#include "verify/trace_data.h"

#include "base/demand.h"
#include "comparison/force_band.h"
#include "report/csv.h"
#include "report/data/data_file.h"

namespace mbv {
namespace {

DataAbout AboutOf(const Report& report) {
  DataAbout about = {
      {"mechanism", report.mechanism},      {"scenario", report.scenario},
      {"description", report.description},  {"verdict", ToText(report.comparison.verdict)},
      {"reason", report.comparison.reason}, {"simulation", report.simulation}};
  for (const auto& [program, version] : report.versions) {
    if (program == "mbverify") about.emplace_back(program, version);
  }
  return about;
}

constexpr const char* kCsvWord = "csv";

}  // namespace

std::vector<std::string> DataWords() {
  std::vector<std::string> words = {kCsvWord};
  for (const DataFormat& format : DataFormats()) words.emplace_back(format.word);
  return words;
}

std::vector<std::pair<std::string, std::string>> DataFilesOf(const Report& report,
                                                             const std::vector<std::string>& words,
                                                             std::string* trouble) {
  std::vector<Trace> shown;
  for (const WitnessRecord& witness : report.witnesses) {
    if (!witness.trace.time_s.empty()) shown.push_back(AsShown(witness.trace));
  }
  std::vector<const Trace*> traces;
  traces.reserve(shown.size());
  for (const Trace& trace : shown) traces.push_back(&trace);
  std::vector<std::pair<std::string, std::string>> files;
  for (const std::string& word : words) {
    if (word == kCsvWord) {
      files.emplace_back(kCsvMetadataFile, CsvMetadata(report));
      continue;
    }
    const DataFormat* format = FindDataFormat(word);
    MBV_DEMAND(format != nullptr, word);
    files.emplace_back(format->file, DataBytes(*format, AboutOf(report), traces, trouble));
    if (!trouble->empty()) return {};
  }
  return files;
}

}  // namespace mbv
