// What writers of HDF5 files share. Internal to data/.

#include <hdf5.h>
#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>

#include "report/data/data_file.h"

namespace mbv::internal {

/// One of HDF5's numbers, and how it is given back; negative: there is none.
class Hdf5Handle {
 public:
  Hdf5Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Hdf5Handle() {
    if (id_ >= 0) close_(id_);
  }
  Hdf5Handle(const Hdf5Handle&) = delete;
  Hdf5Handle& operator=(const Hdf5Handle&) = delete;

  [[nodiscard]] hid_t id() const { return id_; }
  [[nodiscard]] bool good() const { return id_ >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// Properties without the times at which things are made: the same values give the same bytes.
[[nodiscard]] inline Hdf5Handle Undated(hid_t kind) {
  const hid_t list = H5Pcreate(kind);
  H5Pset_obj_track_times(list, false);
  return {list, &H5Pclose};
}

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

// MATLAB's version 7.3: HDF5 behind a header of 512 bytes, with MATLAB's classes as attributes.
// matio writes such files, too, but with the time of day in every data set.
//
//   double, char   a data set; the order of sizes is reversed, since MATLAB stores columns first
//   cell           a data set of references to what lies in the group #refs#
//   struct         a group; its attribute MATLAB_fields keeps the order of fields
//   empty          a data set of its sizes, with the attribute MATLAB_empty

namespace {

constexpr const char* kMat73Header = "MATLAB 7.3 MAT-file, written by mbverify";
constexpr hsize_t kUserBlock = 512;
constexpr const char* kRefs = "#refs#";

// UTF-8 → UTF-16; what is not UTF-8 becomes U+FFFD.
std::vector<std::uint16_t> Utf16(const std::string& text) {
  std::vector<std::uint16_t> letters;
  for (size_t i = 0; i < text.size();) {
    const auto first = static_cast<unsigned char>(text[i++]);
    const int more = first < 0x80 ? 0 : first < 0xC2 ? -1 : first < 0xE0 ? 1 : first < 0xF0 ? 2 : 3;
    std::uint32_t code = more <= 0 ? first : first & (0x3FU >> more);
    bool good = more >= 0 && first < 0xF5;
    for (int k = 0; good && k < more; ++k) {
      const auto next = i < text.size() ? static_cast<unsigned char>(text[i]) : 0U;
      good = (next & 0xC0U) == 0x80U;
      if (good) code = code << 6 | (next & 0x3FU), ++i;
    }
    if (!good) code = 0xFFFD;
    if (code > 0xFFFF) {
      letters.push_back(static_cast<std::uint16_t>(0xD7C0 + (code >> 10)));
      code = 0xDC00 + (code & 0x3FF);
    }
    letters.push_back(static_cast<std::uint16_t>(code));
  }
  return letters;
}

bool AddClass(hid_t object, const std::string& name) {
  const Hdf5Handle type(H5Tcopy(H5T_C_S1), &H5Tclose);
  H5Tset_size(type.id(), name.size());
  const Hdf5Handle space(H5Screate(H5S_SCALAR), &H5Sclose);
  const Hdf5Handle attribute(
      H5Acreate2(object, "MATLAB_class", type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT),
      &H5Aclose);
  return attribute.good() && H5Awrite(attribute.id(), type.id(), name.data()) >= 0;
}

bool AddInteger(hid_t object, const char* name, hid_t type, std::uint32_t value) {
  const Hdf5Handle space(H5Screate(H5S_SCALAR), &H5Sclose);
  const Hdf5Handle attribute(H5Acreate2(object, name, type, space.id(), H5P_DEFAULT, H5P_DEFAULT),
                             &H5Aclose);
  return attribute.good() && H5Awrite(attribute.id(), H5T_NATIVE_UINT32, &value) >= 0;
}

// What a data set is to MATLAB, and in HDF5.
struct Mat73Kind {
  const char* name;
  hid_t stored, given;
};

class Mat73Writer {
 public:
  explicit Mat73Writer(hid_t file)
      : file_(file),
        refs_(H5Gcreate2(file, kRefs, H5P_DEFAULT, Undated(H5P_GROUP_CREATE).id(), H5P_DEFAULT),
              &H5Gclose) {}

  bool AddNumbers(hid_t group, const std::string& name, const double* values, size_t rows,
                  size_t columns) {
    return AddSet(group, name, {"double", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE}, values, rows,
                  columns);
  }

  bool AddText(hid_t group, const std::string& name, const std::string& text) {
    const std::vector<std::uint16_t> letters = Utf16(text);
    return AddSet(group, name, {"char", H5T_STD_U16LE, H5T_NATIVE_UINT16}, letters.data(),
                  letters.empty() ? 0 : 1, letters.size());
  }

  // A column of texts.
  template <typename TextOf>
  bool AddCells(hid_t group, const std::string& name, const std::vector<Channel>& channels,
                const TextOf& text_of) {
    std::vector<hobj_ref_t> references(channels.size());
    for (size_t k = 0; k < channels.size(); ++k) {
      const std::string place = std::to_string(texts_++);
      if (!AddText(refs_.id(), place, text_of(channels[k]))) return false;
      if (H5Rcreate(&references[k], refs_.id(), place.c_str(), H5R_OBJECT, -1) < 0) return false;
    }
    return AddSet(group, name, {"cell", H5T_STD_REF_OBJ, H5T_STD_REF_OBJ}, references.data(),
                  references.size(), 1);
  }

  // A struct; `fill` adds its fields.
  template <typename Fill>
  bool AddStruct(const std::string& name, const std::vector<std::string>& fields,
                 const Fill& fill) {
    const Hdf5Handle undated = Undated(H5P_GROUP_CREATE);
    const Hdf5Handle group(H5Gcreate2(file_, name.c_str(), H5P_DEFAULT, undated.id(), H5P_DEFAULT),
                           &H5Gclose);
    return group.good() && AddClass(group.id(), "struct") && AddFields(group.id(), fields) &&
           fill(group.id());
  }

 private:
  static bool AddSet(hid_t group, const std::string& name, const Mat73Kind& kind,
                     const void* values, size_t rows, size_t columns) {
    const bool empty = rows * columns == 0;
    const std::array<hsize_t, 2> reversed = {columns, rows}, two = {2, 0};
    const std::array<std::uint64_t, 2> sizes = {rows, columns};
    const Hdf5Handle space(
        H5Screate_simple(empty ? 1 : 2, empty ? two.data() : reversed.data(), nullptr), &H5Sclose);
    const Hdf5Handle undated = Undated(H5P_DATASET_CREATE);
    const Hdf5Handle data(H5Dcreate2(group, name.c_str(), empty ? H5T_STD_U64LE : kind.stored,
                                     space.id(), H5P_DEFAULT, undated.id(), H5P_DEFAULT),
                          &H5Dclose);
    if (!data.good() || !AddClass(data.id(), kind.name)) return false;
    if (empty && !AddInteger(data.id(), "MATLAB_empty", H5T_STD_U32LE, 1)) return false;
    const bool text = !empty && std::strcmp(kind.name, "char") == 0;
    if (text && !AddInteger(data.id(), "MATLAB_int_decode", H5T_STD_I32LE, 2)) return false;
    const void* written = empty ? static_cast<const void*>(sizes.data()) : values;
    return H5Dwrite(data.id(), empty ? H5T_NATIVE_UINT64 : kind.given, H5S_ALL, H5S_ALL,
                    H5P_DEFAULT, written) >= 0;
  }

  // A list of names, each a list of letters.
  static bool AddFields(hid_t group, const std::vector<std::string>& fields) {
    const Hdf5Handle letter(H5Tcopy(H5T_C_S1), &H5Tclose);
    const Hdf5Handle type(H5Tvlen_create(letter.id()), &H5Tclose);
    const hsize_t count = fields.size();
    const Hdf5Handle space(H5Screate_simple(1, &count, nullptr), &H5Sclose);
    const Hdf5Handle attribute(
        H5Acreate2(group, "MATLAB_fields", type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT),
        &H5Aclose);
    std::vector<hvl_t> lists;
    lists.reserve(fields.size());
    for (const std::string& field : fields) {
      lists.push_back({field.size(), const_cast<char*>(field.data())});
    }
    return attribute.good() && H5Awrite(attribute.id(), type.id(), lists.data()) >= 0;
  }

  hid_t file_;
  const Hdf5Handle refs_;
  size_t texts_ = 0;
};

bool AddInfo(const DataAbout& about, Mat73Writer* writer) {
  std::vector<std::string> fields;
  for (const auto& [key, text] : about) fields.push_back(key);
  return writer->AddStruct("info", fields, [&](hid_t group) {
    bool good = true;
    for (const auto& [key, text] : about) good = writer->AddText(group, key, text) && good;
    return good;
  });
}

bool AddWitness(const Trace& trace, Mat73Writer* writer) {
  const std::vector<Channel>& channels = trace.channels;
  const size_t n = trace.time_s.size();
  const auto fill = [&](hid_t group) {
    const auto cells = [&](const char* name, const auto& text_of) {
      return writer->AddCells(group, name, channels, text_of);
    };
    return writer->AddNumbers(group, "time_s", trace.time_s.data(), n, 1) &&
           writer->AddNumbers(group, "values", trace.values.data(), n, channels.size()) &&
           cells("names", [](const Channel& c) { return c.name; }) &&
           cells("units", [](const Channel& c) { return c.unit; }) &&
           cells("quantities", [](const Channel& c) { return SignalWord(c); }) &&
           cells("subjects", [](const Channel& c) { return c.subject; }) &&
           cells("frames", [](const Channel& c) { return c.frame; });
  };
  return writer->AddStruct(
      trace.witness, {"time_s", "values", "names", "units", "quantities", "subjects", "frames"},
      fill);
}

// What a reader looks at first: text, place of a subsystem's data (none), version, order of bytes.
bool AddMat73Header(const std::string& path) {
  std::string header = kMat73Header;
  header.resize(124, ' ');
  header += std::string("\x00\x02IM", 4);
  header.resize(kUserBlock, '\0');
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  file.write(header.data(), static_cast<std::streamsize>(header.size()));
  file.close();
  return file.good();
}

}  // namespace

std::string WriteMat73(const std::string& path, const DataAbout& about,
                       const std::vector<const Trace*>& traces) {
  static_assert(!MatX::IsRowMajor, "MATLAB's matrices are stored by columns");
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // its own words go to standard error
  const std::string failure = "cannot write " + path;
  {
    const Hdf5Handle undated = Undated(H5P_FILE_CREATE);
    H5Pset_userblock(undated.id(), kUserBlock);
    const Hdf5Handle file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, undated.id(), H5P_DEFAULT),
                          &H5Fclose);
    if (!file.good()) return failure;
    Mat73Writer writer(file.id());
    bool good = AddInfo(about, &writer);
    for (const Trace* trace : traces) good = AddWitness(*trace, &writer) && good;
    good = H5Fflush(file.id(), H5F_SCOPE_LOCAL) >= 0 && good;
    if (!good) return failure;
  }
  return AddMat73Header(path) ? "" : failure;
}

}  // namespace mbv::internal
