#include "pipeline/own_run_bytes.h"

#include <cstdint>
#include <cstring>

namespace mbv {
namespace {

// Both directions visit the same members in the same order.
class Writer {
 public:
  void operator()(const double& value) { Raw(&value, sizeof value); }
  void operator()(const int& value) { (*this)(static_cast<double>(value)); }
  void operator()(const bool& value) { (*this)(value ? 1.0 : 0.0); }
  void operator()(const std::string& text) {
    Size(text.size());
    bytes += text;
  }
  template <typename E>
  requires std::is_enum_v<E>
  void operator()(const E& value) { (*this)(static_cast<int>(value)); }
  template <typename T>
  void operator()(const std::vector<T>& values) {
    Size(values.size());
    for (const T& value : values) (*this)(value);
  }
  void operator()(const Channel& c) {
    (*this)(c.name), (*this)(c.unit), (*this)(c.frame), (*this)(c.quantity), (*this)(c.subject);
    (*this)(c.component);
  }
  void operator()(const OwnRun::Gap& g) {
    (*this)(g.position_m), (*this)(g.position_at_s), (*this)(g.rotation_rad);
    (*this)(g.rotation_at_s);
  }
  void operator()(const MatX& values) {
    Size(static_cast<size_t>(values.rows()));
    Size(static_cast<size_t>(values.cols()));
    Raw(values.data(), static_cast<size_t>(values.size()) * sizeof(double));
  }
  std::string bytes;

 private:
  void Size(size_t size) { (*this)(static_cast<double>(size)); }
  void Raw(const void* from, size_t count) { bytes.append(static_cast<const char*>(from), count); }
};

class Reader {
 public:
  explicit Reader(const std::string& bytes) : bytes_(bytes) {}

  void operator()(double& value) { Raw(&value, sizeof value); }
  void operator()(int& value) { value = static_cast<int>(Next()); }
  void operator()(bool& value) { value = Next() != 0.0; }
  void operator()(std::string& text) {
    text.assign(Size(1), '\0');
    Raw(text.data(), text.size());
  }
  template <typename E>
  requires std::is_enum_v<E>
  void operator()(E& value) { value = static_cast<E>(static_cast<int>(Next())); }
  template <typename T>
  void operator()(std::vector<T>& values) {
    values.resize(Size(sizeof(double)));
    for (size_t i = 0; i < values.size(); ++i) {
      T value{};
      (*this)(value);
      values[i] = std::move(value);
    }
  }
  void operator()(Channel& c) {
    (*this)(c.name), (*this)(c.unit), (*this)(c.frame), (*this)(c.quantity), (*this)(c.subject);
    (*this)(c.component);
  }
  void operator()(OwnRun::Gap& g) {
    (*this)(g.position_m), (*this)(g.position_at_s), (*this)(g.rotation_rad);
    (*this)(g.rotation_at_s);
  }
  void operator()(MatX& values) {
    const size_t rows = Size(0), columns = Size(0);
    if (!good_ || rows * columns > (bytes_.size() - at_) / sizeof(double)) {
      good_ = false;
      return;
    }
    values.resize(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(columns));
    Raw(values.data(), rows * columns * sizeof(double));
  }
  [[nodiscard]] bool good() const { return good_ && at_ == bytes_.size(); }

 private:
  double Next() {
    double value = 0.0;
    Raw(&value, sizeof value);
    return value;
  }
  // A count of things that take `each` bytes at least.
  size_t Size(size_t each) {
    constexpr double kMost = 1e8;
    const double size = Next();
    if (size >= 0.0 && size <= kMost &&
        size * static_cast<double>(each) <= static_cast<double>(bytes_.size() - at_)) {
      return static_cast<size_t>(size);
    }
    good_ = false;
    return 0;
  }
  void Raw(void* to, size_t count) {
    if (!good_ || count > bytes_.size() - at_) {
      good_ = false;
      return;
    }
    if (count > 0) std::memcpy(to, bytes_.data() + at_, count);
    at_ += count;
  }

  const std::string& bytes_;
  size_t at_ = 0;
  bool good_ = true;
};

template <typename Visit, typename Run>
void VisitAll(Visit& visit, Run& run) {
  auto& s = run.summary;
  visit(s.stop), visit(s.message), visit(s.time_s);
  auto& f = run.facts;
  visit(f.step_s), visit(f.integrator), visit(f.solver), visit(f.tolerance), visit(f.iterations);
  visit(f.rough_solver), visit(f.closures), visit(f.solref), visit(f.solimp), visit(f.leads);
  visit(f.motors), visit(f.left_out), visit(f.held), visit(f.couplings), visit(f.pushers);
  visit(f.damped);
  visit(run.trace.time_s), visit(run.trace.channels), visit(run.trace.values);
  visit(run.gaps), visit(run.tracking), visit(run.notes), visit(run.step_s), visit(run.cost_ms);
}

}  // namespace

std::string ToBytes(const OwnRun& run) {
  Writer writer;
  VisitAll(writer, run);
  return std::move(writer.bytes);
}

std::optional<OwnRun> OwnRunOf(const std::string& bytes) {
  OwnRun run;
  Reader reader(bytes);
  VisitAll(reader, run);
  if (!reader.good()) return std::nullopt;
  return run;
}

}  // namespace mbv
