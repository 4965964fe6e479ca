#include <matio.h>

#include <cstdint>
#include <memory>

#include "report/data/data_file.h"

namespace mbv::internal {
namespace {

// MATLAB's header says who wrote the file, and when; the latter is left out.
constexpr const char* kHeader = "MATLAB 5.0 MAT-file, written by mbverify";

struct CloseFile {
  void operator()(mat_t* file) const { Mat_Close(file); }
};
struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using File = std::unique_ptr<mat_t, CloseFile>;
using Variable = std::unique_ptr<matvar_t, FreeVariable>;

Variable Create(const char* name, matio_classes kind, matio_types type, size_t rows, size_t columns,
                const void* data) {
  size_t dims[2] = {rows, columns};
  // The data is copied.
  return Variable(Mat_VarCreate(name, kind, type, 2, dims, const_cast<void*>(data), 0));
}

Variable Number(const char* name, const double* values, size_t rows, size_t columns) {
  return Create(name, MAT_C_DOUBLE, MAT_T_DOUBLE, rows, columns, values);
}

// MATLAB's characters have two bytes; Others but ASCII's become a question mark.
Variable Text(const char* name, const std::string& text) {
  std::vector<std::uint16_t> letters;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte & 0xC0U) == 0x80U) continue;  // the rest of a letter of UTF-8
    letters.push_back(byte < 0x80U ? byte : '?');
  }
  return Create(name, MAT_C_CHAR, MAT_T_UINT16, letters.empty() ? 0 : 1, letters.size(),
                letters.data());
}

// A column of texts.
template <typename List, typename TextOf>
Variable Cells(const char* name, const List& list, const TextOf& text_of) {
  Variable cells = Create(name, MAT_C_CELL, MAT_T_CELL, list.size(), 1, nullptr);
  for (size_t k = 0; cells != nullptr && k < list.size(); ++k) {
    Mat_VarSetCell(cells.get(), static_cast<int>(k), Text(nullptr, text_of(list[k])).release());
  }
  return cells;
}

// A struct of one element; it owns its fields.
Variable Struct(const std::string& name, std::vector<Variable> fields) {
  size_t dims[2] = {1, 1};
  std::vector<const char*> names;
  for (const Variable& field : fields) {
    if (field == nullptr) return nullptr;
    names.push_back(field->name);
  }
  Variable made(Mat_VarCreateStruct(name.c_str(), 2, dims, names.data(),
                                    static_cast<unsigned>(names.size())));
  for (Variable& field : fields) {
    const std::string field_name = field->name;
    if (made != nullptr) {
      Mat_VarSetStructFieldByName(made.get(), field_name.c_str(), 0, field.release());
    }
  }
  return made;
}

Variable InfoOf(const DataAbout& about) {
  std::vector<Variable> fields;
  for (const auto& [key, text] : about) fields.push_back(Text(key.c_str(), text));
  return Struct("info", std::move(fields));
}

Variable WitnessOf(const Trace& trace) {
  const std::vector<Channel>& channels = trace.channels;
  std::vector<Variable> fields;
  fields.push_back(Number("time_s", trace.time_s.data(), trace.time_s.size(), 1));
  fields.push_back(Number("values", trace.values.data(), trace.time_s.size(), channels.size()));
  fields.push_back(Cells("names", channels, [](const Channel& c) { return c.name; }));
  fields.push_back(Cells("units", channels, [](const Channel& c) { return c.unit; }));
  fields.push_back(Cells("quantities", channels, [](const Channel& c) { return SignalWord(c); }));
  fields.push_back(Cells("subjects", channels, [](const Channel& c) { return c.subject; }));
  fields.push_back(Cells("frames", channels, [](const Channel& c) { return c.frame; }));
  return Struct(trace.witness, std::move(fields));
}

std::string WriteAll(const std::string& path, const std::vector<Variable>& variables) {
  static_assert(!MatX::IsRowMajor, "MATLAB's matrices are stored by columns");
  const File file(Mat_CreateVer(path.c_str(), kHeader, MAT_FT_MAT5));
  if (file == nullptr) return "cannot write " + path;
  for (const Variable& variable : variables) {
    if (variable == nullptr) return "cannot make the variables of " + path;
    if (Mat_VarWrite(file.get(), variable.get(), MAT_COMPRESSION_ZLIB) != 0) {
      return "cannot write " + std::string(variable->name) + " to " + path;
    }
  }
  return "";
}

}  // namespace

std::string WriteMat(const std::string& path, const DataAbout& about,
                     const std::vector<const Trace*>& traces) {
  std::vector<Variable> variables;
  variables.push_back(InfoOf(about));
  for (const Trace* trace : traces) variables.push_back(WitnessOf(*trace));
  return WriteAll(path, variables);
}

std::string WriteMat(const std::string& path, const DataMatrices& data) {
  std::vector<Variable> variables;
  variables.push_back(InfoOf(data.about));
  for (const auto& [name, list] : data.names) {
    variables.push_back(Cells(name.c_str(), list, [](const std::string& text) { return text; }));
  }
  for (const auto& [name, matrix] : data.matrices) {
    variables.push_back(Number(name.c_str(), matrix.data(), static_cast<size_t>(matrix.rows()),
                               static_cast<size_t>(matrix.cols())));
  }
  return WriteAll(path, variables);
}

}  // namespace mbv::internal
