// Traces in the binary files of other programs, with units and frames.
//
//   mat   traces.mat, MATLAB's version 5, which GNU Octave, SciPy, Julia and others read: the
//   struct
//         `info`, and one struct per witness with time_s (n × 1), values (n × m), and cells of m
//         texts: names, units, quantities, subjects, frames
//   mat73 traces_v73.mat, MATLAB's version 7.3 (HDF5), for traces beyond version 5's 2 GB: the same
//         variables; texts keep all their letters
//   h5    traces.h5, HDF5: a group per witness with the data sets time_s and one per channel, whose
//         attributes are unit, quantity, subject and frame; what `info` has, as attributes of the
//         root
//
// The bytes follow from the values alone: no date, no place.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/types.h"
#include "math/trace.h"

namespace mbv {

/// Of what the traces are, as pairs (key, text): program, mechanism, scenario, verdict, …
using DataAbout = std::vector<std::pair<std::string, std::string>>;

struct DataFormat {
  const char* word;  ///< on the command line
  const char* file;  ///< its name in a result folder
  /// Writes a file; "" or what went wrong. Null where this program was built without the library
  /// (`option`).
  std::string (*write)(const std::string& path, const DataAbout& about,
                       const std::vector<const Trace*>& traces);
  const char* option;  ///< of CMake: MBV_WITH_…
};

/// All formats other than traces.csv, which is always written.
[[nodiscard]] const std::array<DataFormat, 3>& DataFormats();
/// The row of this word; null if there is none.
[[nodiscard]] const DataFormat* FindDataFormat(const std::string& word);

/// The bytes of the file; empty, with the reason in `trouble`, where it cannot be made.
[[nodiscard]] std::string DataBytes(const DataFormat& format, const DataAbout& about,
                                    const std::vector<const Trace*>& traces, std::string* trouble);

/// Matrices by name for `mat`: the struct `info`, a variable per matrix, and cells of texts.
struct DataMatrices {
  DataAbout about;
  std::vector<std::pair<std::string, MatX>> matrices;
  std::vector<std::pair<std::string, std::vector<std::string>>> names;
};
/// The bytes of the file; empty, with the reason in `trouble`, where it cannot be made.
[[nodiscard]] std::string MatBytes(const DataMatrices& data, std::string* trouble);

}  // namespace mbv

// Writers of the formats of data_file.h. Internal to data/.

namespace mbv::internal {

[[nodiscard]] std::string WriteMat(const std::string& path, const DataAbout& about,
                                   const std::vector<const Trace*>& traces);
[[nodiscard]] std::string WriteMat(const std::string& path, const DataMatrices& data);
[[nodiscard]] std::string WriteMat73(const std::string& path, const DataAbout& about,
                                     const std::vector<const Trace*>& traces);
[[nodiscard]] std::string WriteHdf5(const std::string& path, const DataAbout& about,
                                    const std::vector<const Trace*>& traces);

}  // namespace mbv::internal
