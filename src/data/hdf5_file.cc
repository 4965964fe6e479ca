#include "data/formats.h"
#include "data/hdf5_handle.h"

namespace mbv::internal {
namespace {

bool AddText(hid_t object, const std::string& name, const std::string& text) {
  const Hdf5Handle type(H5Tcopy(H5T_C_S1), &H5Tclose);
  H5Tset_size(type.id(), text.empty() ? 1 : text.size());
  H5Tset_cset(type.id(), H5T_CSET_UTF8);
  const Hdf5Handle space(H5Screate(H5S_SCALAR), &H5Sclose);
  const Hdf5Handle attribute(
      H5Acreate2(object, name.c_str(), type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT), &H5Aclose);
  const std::string written = text.empty() ? std::string(1, '\0') : text;
  return attribute.good() && H5Awrite(attribute.id(), type.id(), written.data()) >= 0;
}

using Texts = std::vector<std::pair<std::string, std::string>>;

bool AddNumbers(hid_t group, const std::string& name, const double* values, size_t count,
                const Texts& attributes) {
  const hsize_t size = count;
  const Hdf5Handle space(H5Screate_simple(1, &size, nullptr), &H5Sclose);
  const Hdf5Handle undated = Undated(H5P_DATASET_CREATE);
  const Hdf5Handle data(H5Dcreate2(group, name.c_str(), H5T_IEEE_F64LE, space.id(), H5P_DEFAULT,
                                   undated.id(), H5P_DEFAULT),
                        &H5Dclose);
  if (!data.good()) return false;
  bool good = H5Dwrite(data.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0;
  for (const auto& [key, text] : attributes) good = AddText(data.id(), key, text) && good;
  return good;
}

bool AddTrace(hid_t file, const Trace& trace) {
  const Hdf5Handle undated = Undated(H5P_GROUP_CREATE);
  const Hdf5Handle group(
      H5Gcreate2(file, trace.witness.c_str(), H5P_DEFAULT, undated.id(), H5P_DEFAULT), &H5Gclose);
  if (!group.good()) return false;
  const size_t n = trace.time_s.size();
  bool good = AddNumbers(group.id(), "time_s", trace.time_s.data(), n, {{"unit", "s"}});
  for (size_t k = 0; k < trace.channels.size(); ++k) {
    const Channel& c = trace.channels[k];
    good = AddNumbers(group.id(), c.name, trace.values.col(static_cast<Eigen::Index>(k)).data(), n,
                      {{"unit", c.unit},
                       {"quantity", SignalWord(c)},
                       {"subject", c.subject},
                       {"frame", c.frame}}) &&
           good;
  }
  return good;
}

}  // namespace

std::string WriteHdf5(const std::string& path, const DataAbout& about,
                      const std::vector<const Trace*>& traces) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // its own words go to standard error
  const Hdf5Handle undated = Undated(H5P_FILE_CREATE);
  const Hdf5Handle file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, undated.id(), H5P_DEFAULT),
                        &H5Fclose);
  if (!file.good()) return "cannot write " + path;
  bool good = true;
  for (const auto& [key, text] : about) good = AddText(file.id(), key, text) && good;
  for (const Trace* trace : traces) good = AddTrace(file.id(), *trace) && good;
  good = H5Fflush(file.id(), H5F_SCOPE_LOCAL) >= 0 && good;
  return good ? "" : "cannot write " + path;
}

}  // namespace mbv::internal
