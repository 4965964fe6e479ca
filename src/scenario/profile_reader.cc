#include "scenario/section_readers.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "math/profile.h"
#include "scenario/tables/motion_table.h"

namespace mbv {
namespace {

class ProfileReader : AmountReader {
 public:
  ProfileReader(ValueReader* values, const ProfileContext& context)
      : AmountReader(values, context) {}

  void Read(const YamlNode& node, const std::string& path, Profile* profile) {
    if (node.is_sequence()) {
      for (size_t i = 0; i < node.items.size(); ++i) {
        ReadOne(*node.items[i], fmt::format("{}[{}]", path, i), profile);
      }
    } else {
      ReadOne(node, path, profile);
    }
  }

 private:
  void ReadOne(const YamlNode& node, const std::string& path, Profile* profile) {
    if (node.is_map()) {
      ReadTerm(node, path, profile);
    } else if (node.is_scalar() && node.text == "home") {
      if (context_.home) {
        profile->terms.emplace_back(ConstantTerm{*context_.home});
      } else {
        values_->yaml().Error(node, path + " = 'home' has no meaning here");
      }
    } else if (const auto number = values_->Number(node, path)) {
      profile->terms.emplace_back(ConstantTerm{*number});
    }
  }

  void ReadTerm(const YamlNode& node, const std::string& path, Profile* profile) {
    std::vector<std::string> keys = {"value",     "value_deg", "value_mm", "sine", "ramp",  "bump",
                                     "trapezoid", "s_curve",   "fourier",  "via",  "table", "cam"};
    keys.insert(keys.end(), StepLaws().begin(), StepLaws().end());
    if (context_.may_jump) keys.insert(keys.end(), {"step", "pulse"});
    YamlMap map(&values_->yaml(), &node, path, keys);
    if (!map.valid()) return;
    if (node.entries.size() != 1) {
      values_->yaml().Error(node,
                            fmt::format("{} has {} terms in one map", path, node.entries.size()),
                            "write a list to add terms: [0.2, {sine: …}]");
      return;
    }
    const std::string& key = node.entries.front().key;
    const YamlNode* value = node.entries.front().value.get();
    const std::string term_path = JoinPath(path, key);
    const size_t terms = profile->terms.size();
    if (key.starts_with("value")) {
      if (const auto number = Amount(map, "value"))
        profile->terms.emplace_back(ConstantTerm{*number});
    } else if (key == "sine") {
      ReadSine(value, term_path, profile);
    } else if (key == "ramp") {
      ReadRamp(*value, term_path, profile);
    } else if (key == "step") {
      YamlMap term = Map(value, term_path, "height", {"at_s"});
      const auto height = RequiredAmount(term, "height");
      const auto at_s = values_->InUnit(term, "at_s", {kPlain});
      if (term.Required("at_s") != nullptr && height && at_s) {
        profile->terms.emplace_back(JumpTerm{*at_s, *height});
      }
    } else if (key == "pulse") {
      ReadPulse(value, term_path, profile);
    } else if (key == "trapezoid" || key == "s_curve") {
      ReadLimited(key == "s_curve", value, term_path, profile);
    } else if (key == "fourier") {
      ReadFourier(value, term_path, profile);
    } else if (key == "via") {
      ReadVia(value, term_path, profile);
    } else if (key == "cam") {
      ReadCam(values_, *value, term_path, context_, profile);
    } else if (key == "table") {
      ReadTable(*value, term_path, profile);
    } else {
      ReadStep(key, value, term_path, profile);
    }
    if (key != "table" && key != "cam") NoteEnd(node, term_path, terms, *profile);
  }

  // Of what was added to the `terms` before.
  void NoteEnd(const YamlNode& node, const std::string& path, size_t terms,
               const Profile& profile) {
    if (context_.tables == nullptr || profile.terms.size() <= terms) return;
    const std::vector<double> breaks = BreakTimes({{profile.terms.back()}});
    if (breaks.empty()) return;
    context_.tables->laws.push_back({&node, path, breaks.front(), breaks.back()});
  }

  // Without an end, or, of a force, between two times.
  void ReadRamp(const YamlNode& node, const std::string& path, Profile* profile) {
    std::vector<std::string> keys;
    if (context_.may_jump) keys = {"start_s", "duration_s"};
    YamlMap term = Map(&node, path, "rate", keys);
    const auto rate = RequiredAmount(term, "rate");
    if (!rate) return;
    if (!term.Has("start_s") && !term.Has("duration_s")) {
      profile->terms.emplace_back(RampTerm{*rate});
      return;
    }
    const auto duration_s = values_->RequiredPositive(term, "duration_s");
    const double start_s = values_->InUnit(term, "start_s", {kPlain}).value_or(0.0);
    if (!duration_s) return;
    auto ramp = std::make_shared<Piecewise>();
    ramp->knots = ramp->breaks = {start_s, start_s + *duration_s};
    ramp->coefficients = {{0.0, *rate}};
    profile->terms.emplace_back(PiecewiseTerm{std::move(ramp)});
  }

  void ReadPulse(const YamlNode* node, const std::string& path, Profile* profile) {
    constexpr int kMostPulses = 10000;
    YamlMap term = Map(node, path, "height", {"start_s", "duration_s", "period_s", "count"});
    if (!term.valid()) return;
    const auto height = RequiredAmount(term, "height");
    const auto duration_s = values_->RequiredPositive(term, "duration_s");
    const double start_s = values_->InUnit(term, "start_s", {kPlain}).value_or(0.0);
    std::optional<double> period_s = 0.0;
    std::optional<int> count = 1;
    if (const YamlNode* many = term.Find("count")) {
      count = values_->yaml().Integer(*many, term.PathOf("count"));
      period_s = values_->RequiredPositive(term, "period_s");
      if (count && (*count < 1 || *count > kMostPulses)) {
        values_->yaml().Error(*many, fmt::format("{} = {} violates 1 <= count <= {}",
                                                 term.PathOf("count"), *count, kMostPulses));
        return;
      }
    } else if (const YamlNode* period = term.Find("period_s")) {
      values_->yaml().Error(*period,
                            fmt::format("{} needs count as well", term.PathOf("period_s")));
      return;
    }
    if (!height || !duration_s || !period_s || !count) return;
    if (*count > 1 && *period_s <= *duration_s) {
      values_->yaml().Error(
          *node, fmt::format("{}: period_s = {} violates period_s > duration_s = {}", path,
                             *period_s, *duration_s));
      return;
    }
    for (int k = 0; k < *count; ++k) {
      const double from_s = start_s + k * *period_s;
      profile->terms.emplace_back(JumpTerm{from_s, *height});
      profile->terms.emplace_back(JumpTerm{from_s + *duration_s, -*height});
    }
  }

  void ReadSine(const YamlNode* node, const std::string& path, Profile* profile) {
    YamlMap term = Map(node, path, "amplitude", {"frequency_hz", "period_s", "phase", "phase_deg"});
    if (!term.valid()) return;
    const auto amplitude = RequiredAmount(term, "amplitude");
    const auto frequency_hz = Frequency(term, *node);
    const double phase_rad = values_->InUnit(term, "phase", {kPlain, kDeg}).value_or(0.0);
    if (!amplitude || !frequency_hz) return;
    profile->terms.emplace_back(SineTerm{*amplitude, *frequency_hz, phase_rad});
  }

  // One of frequency_hz and period_s.
  std::optional<double> Frequency(const YamlMap& term, const YamlNode& node) {
    const YamlNode *frequency = term.Find("frequency_hz"), *period = term.Find("period_s");
    if ((frequency == nullptr) == (period == nullptr)) {
      values_->yaml().Error(node,
                            fmt::format("{} needs one of frequency_hz and period_s", term.path()));
      return {};
    }
    if (frequency != nullptr) return values_->Positive(*frequency, term.PathOf("frequency_hz"));
    const auto period_s = values_->Positive(*period, term.PathOf("period_s"));
    return period_s ? std::optional(1.0 / *period_s) : std::nullopt;
  }

  // From rest to rest within limits of rate, acceleration and jerk.
  void ReadLimited(bool s_curve, const YamlNode* node, const std::string& path, Profile* profile) {
    std::vector<std::string> keys = {"start_s"};
    for (const char* limit : {"v_max", "a_max", "j_max"}) {
      if (!s_curve && *limit == 'j') continue;
      for (std::string& key : InEveryUnit(limit)) keys.push_back(std::move(key));
    }
    YamlMap term = Map(node, path, "delta", keys);
    if (!term.valid()) return;
    const auto delta = RequiredAmount(term, "delta");
    const auto v_max = PositiveAmount(term, "v_max"), a_max = PositiveAmount(term, "a_max");
    const auto j_max = s_curve ? PositiveAmount(term, "j_max") : 1.0;
    const double start_s = values_->InUnit(term, "start_s", {kPlain}).value_or(0.0);
    if (!delta || !v_max || !a_max || !j_max || *delta == 0.0) return;
    const MotionLimits limits{*v_max, *a_max, *j_max};
    AddPieces(s_curve ? SCurve(start_s, *delta, limits) : Trapezoid(start_s, *delta, limits),
              profile);
  }

  void ReadFourier(const YamlNode* node, const std::string& path, Profile* profile) {
    std::vector<std::string> keys = {"frequency_hz", "period_s"};
    for (const char* list : {"a", "b"}) {
      for (std::string& key : InEveryUnit(list)) keys.push_back(std::move(key));
    }
    YamlMap term = Map(node, path, "offset", keys);
    if (!term.valid()) return;
    FourierTerm fourier;
    const auto frequency_hz = Frequency(term, *node);
    fourier.offset = Amount(term, "offset").value_or(0.0);
    const auto a = Amounts(term, "a"), b = Amounts(term, "b");
    if (!frequency_hz || !a || !b) return;
    if (a->size() != b->size() || a->empty()) {
      values_->yaml().Error(*node,
                            fmt::format("{}: {} numbers a and {} numbers b violate 1 <= "
                                        "count of a = count of b",
                                        path, a->size(), b->size()),
                            "write 0 for a harmonic that is left out");
      return;
    }
    fourier.frequency_hz = *frequency_hz;
    fourier.a = *a;
    fourier.b = *b;
    profile->terms.emplace_back(std::move(fourier));
  }

  void ReadVia(const YamlNode* node, const std::string& path, Profile* profile) {
    YamlMap term = Map(node, path, "values", {"times_s", "rests_s"});
    if (!term.valid()) return;
    const YamlNode* times_node = term.Required("times_s");
    const auto times = times_node == nullptr
                           ? std::nullopt
                           : values_->Numbers(*times_node, term.PathOf("times_s"));
    const auto amounts = Amounts(term, "values");
    if (!times || !amounts || !CheckVia(*times_node, path, *times, amounts->size())) return;
    const auto rest = ReadRests(term, *times);
    if (rest) AddPieces(Via(*times, *amounts, *rest), profile);
  }

  bool CheckVia(const YamlNode& node, const std::string& path, const std::vector<double>& times,
                size_t amounts) {
    if (times.size() != amounts || amounts < 2) {
      values_->yaml().Error(node, fmt::format("{}: {} times and {} values violate 2 <= count of "
                                              "times_s = count of values",
                                              path, times.size(), amounts));
      return false;
    }
    const auto back = std::adjacent_find(times.begin(), times.end(), std::greater_equal<>());
    if (back == times.end()) return true;
    values_->yaml().Error(node, fmt::format("{}.times_s: {} after {} violates increasing times",
                                            path, *(back + 1), *back));
    return false;
  }

  // `all`, or times of points between the first and the last.
  std::optional<std::vector<bool>> ReadRests(const YamlMap& term,
                                             const std::vector<double>& times) {
    const YamlNode* node = term.Find("rests_s");
    if (node == nullptr) return std::vector<bool>(times.size(), false);
    if (node->is_scalar() && node->text == "all") return std::vector<bool>(times.size(), true);
    const auto rests = values_->Numbers(*node, term.PathOf("rests_s"));
    if (!rests) return {};
    std::vector<bool> rest(times.size(), false);
    for (const double at : *rests) {
      const auto found = std::find(times.begin(), times.end(), at);
      if (found == times.end()) {
        values_->yaml().Error(
            *node, fmt::format("{} = {} is not one of times_s", term.PathOf("rests_s"), at),
            "rests_s: all rests at every point");
        return {};
      }
      rest[static_cast<size_t>(found - times.begin())] = true;
    }
    return rest;
  }

  void ReadTable(const YamlNode& node, const std::string& path, Profile* profile) {
    ProfileTables* tables = context_.tables;
    if (tables == nullptr) {
      values_->yaml().Error(node, path + ": a table has no meaning here");
      return;
    }
    auto table =
        LoadMotionTable(values_, node, path, {context_.name, context_.unit, context_.moves},
                        *tables->mechanism, tables->files);
    tables->failed = tables->failed || !table;
    if (!table) return;
    profile->terms.emplace_back(PiecewiseTerm{table->spline});
    tables->places.push_back({node.Find("csv"), path});
    tables->loaded.push_back(std::move(*table));
  }

  static void AddPieces(Piecewise pieces, Profile* profile) {
    profile->terms.emplace_back(
        PiecewiseTerm{std::make_shared<const Piecewise>(std::move(pieces))});
  }

  void ReadStep(const std::string& key, const YamlNode* node, const std::string& path,
                Profile* profile) {
    const std::string size = key == "bump" ? "height" : "delta";
    YamlMap term = Map(node, path, size, {"start_s", "duration_s"});
    if (!term.valid()) return;
    const auto amount = RequiredAmount(term, size);
    const auto duration_s = values_->RequiredPositive(term, "duration_s");
    const double start_s = values_->InUnit(term, "start_s", {kPlain}).value_or(0.0);
    if (!amount || !duration_s) return;
    if (key == "bump") {
      profile->terms.emplace_back(BumpTerm{start_s, *duration_s, *amount});
    } else {
      profile->terms.push_back(StepTerm(key, start_s, *duration_s, *amount));
    }
  }
};

}  // namespace

Profile ReadProfile(ValueReader* values, const YamlNode& node, const std::string& path,
                    const ProfileContext& context) {
  Profile profile;
  ProfileReader(values, context).Read(node, path, &profile);
  return profile;
}

YamlMap AmountReader::Map(const YamlNode* node, const std::string& path, const std::string& amount,
                          std::vector<std::string> keys) {
  for (std::string& key : InEveryUnit(amount)) keys.push_back(std::move(key));
  return {&values_->yaml(), node, path, keys};
}

YamlMap::InUnit AmountReader::FindAmount(const YamlMap& map, const std::string& key) {
  const YamlMap::InUnit found = map.FindInUnit(key, {kPlain, kDeg, kMm});
  if (found.node == nullptr || found.unit.Suits(context_.unit)) return found;
  values_->yaml().Error(
      *found.node,
      fmt::format("{} is given, but this value is in {}", map.PathOf(found.key), context_.unit),
      fmt::format("write {}", map.PathOf(key)));
  return {};
}

std::optional<double> AmountReader::Amount(const YamlMap& map, const std::string& key) {
  const YamlMap::InUnit found = FindAmount(map, key);
  if (found.node == nullptr) return {};
  const auto number = values_->Number(*found.node, map.PathOf(found.key));
  if (!number) return {};
  return found.unit.to_si(*number);
}

std::optional<std::vector<double>> AmountReader::Amounts(const YamlMap& map,
                                                         const std::string& key) {
  if (map.FindInUnit(key, {kPlain, kDeg, kMm}).node == nullptr) {
    (void)map.Required(key);  // reports it
    return {};
  }
  const YamlMap::InUnit found = FindAmount(map, key);
  if (found.node == nullptr) return {};
  auto numbers = values_->Numbers(*found.node, map.PathOf(found.key));
  if (!numbers) return {};
  for (double& number : *numbers) number = found.unit.to_si(number);
  return numbers;
}

std::optional<double> AmountReader::PositiveAmount(const YamlMap& map, const std::string& key) {
  const auto amount = RequiredAmount(map, key);
  if (!amount || *amount > 0.0) return amount;
  const YamlMap::InUnit found = map.FindInUnit(key, {kPlain, kDeg, kMm});
  values_->yaml().Error(*found.node, fmt::format("{0} = {1} violates {0} > 0",
                                                 map.PathOf(found.key), found.node->text));
  return {};
}

std::optional<double> AmountReader::RequiredAmount(const YamlMap& map, const std::string& key) {
  if (!map.valid()) return {};
  if (map.FindInUnit(key, {kPlain, kDeg, kMm}).node == nullptr) {
    (void)map.Required(key);  // reports it
    return {};
  }
  return Amount(map, key);
}

namespace {

struct CamSegment {
  std::string law;
  double duration_s = 0.0, delta = 0.0;
};

class CamReader : AmountReader {
 public:
  CamReader(ValueReader* values, const ProfileContext& context) : AmountReader(values, context) {}

  // Rises, dwells and returns one after the other, and all of it `cycles` times.
  void Read(const YamlNode& node, const std::string& path, Profile* profile) {
    const YamlMap cam(&values_->yaml(), &node, path, {"law", "start_s", "cycles", "segments"});
    const YamlNode* list = cam.valid() ? cam.Required("segments") : nullptr;
    if (list == nullptr) return;
    const auto law = LawOf(cam, "poly345");
    const auto cycles = Cycles(cam);
    const auto items = values_->yaml().Items(*list, cam.PathOf("segments"));
    if (!law || !cycles || !items) return;
    std::vector<CamSegment> segments;
    for (size_t i = 0; i < items->size(); ++i) {
      const auto segment =
          ReadSegment(*(*items)[i], fmt::format("{}[{}]", cam.PathOf("segments"), i), *law);
      if (segment) segments.push_back(*segment);
    }
    if (segments.size() != items->size() || !CheckRound(*list, cam, segments, *cycles)) return;
    double t_s = values_->InUnit(cam, "start_s", {kPlain}).value_or(0.0);
    for (int i = 0; i < *cycles; ++i) {
      for (const CamSegment& segment : segments) {
        if (segment.delta != 0.0) {
          profile->terms.push_back(StepTerm(segment.law, t_s, segment.duration_s, segment.delta));
        }
        t_s += segment.duration_s;
      }
    }
  }

 private:
  std::optional<std::string> LawOf(const YamlMap& map, const std::string& otherwise) {
    const YamlNode* node = map.Find("law");
    if (node == nullptr) return otherwise;
    const auto law = values_->yaml().Choice(*node, map.PathOf("law"), StepLaws());
    return law ? std::optional(StepLaws()[static_cast<size_t>(*law)]) : std::nullopt;
  }

  std::optional<int> Cycles(const YamlMap& cam) {
    constexpr int kMost = 1000;
    const YamlNode* node = cam.Find("cycles");
    if (node == nullptr) return 1;
    const auto cycles = values_->yaml().Integer(*node, cam.PathOf("cycles"));
    if (!cycles || (*cycles >= 1 && *cycles <= kMost)) return cycles;
    values_->yaml().Error(*node, fmt::format("{} = {} violates 1 <= cycles <= {}",
                                             cam.PathOf("cycles"), *cycles, kMost));
    return {};
  }

  std::optional<CamSegment> ReadSegment(const YamlNode& node, const std::string& path,
                                        const std::string& law) {
    std::vector<std::string> keys = {"dwell_s", "duration_s", "law"};
    for (const char* way : {"rise", "return"}) {
      for (std::string& key : InEveryUnit(way)) keys.push_back(std::move(key));
    }
    const YamlMap map(&values_->yaml(), &node, path, keys);
    if (!map.valid()) return {};
    if (map.Has("dwell_s")) {
      const auto dwell_s = values_->RequiredPositive(map, "dwell_s");
      return dwell_s ? std::optional(CamSegment{law, *dwell_s, 0.0}) : std::nullopt;
    }
    const bool falls = map.FindInUnit("return", {kPlain, kDeg, kMm}).node != nullptr;
    const auto amount = PositiveAmount(map, falls ? "return" : "rise");
    const auto duration_s = values_->RequiredPositive(map, "duration_s");
    const auto own = LawOf(map, law);
    if (!amount || !duration_s || !own) return {};
    return CamSegment{*own, *duration_s, falls ? -*amount : *amount};
  }

  // What is repeated must come back to where it began.
  bool CheckRound(const YamlNode& node, const YamlMap& cam, const std::vector<CamSegment>& segments,
                  int cycles) {
    double sum = 0.0, size = 0.0;
    for (const CamSegment& segment : segments) {
      sum += segment.delta;
      size += std::abs(segment.delta);
    }
    if (cycles == 1 || std::abs(sum) <= 1e-12 * size) return true;
    values_->yaml().Error(node,
                          fmt::format("{}: rises less returns are {:g} {}, which violates 0 where "
                                      "cycles = {}",
                                      cam.PathOf("segments"), sum, context_.unit, cycles),
                          "a round must end where it began; without cycles it may end elsewhere");
    return false;
  }
};

}  // namespace

const std::vector<std::string>& StepLaws() {
  static const std::vector<std::string> kLaws = {"poly345", "poly4567", "cycloid", "modified_sine"};
  return kLaws;
}

ProfileTerm StepTerm(const std::string& law, double start_s, double duration_s, double delta) {
  if (law == "poly4567") return Poly4567StepTerm{start_s, duration_s, delta};
  if (law == "cycloid") return CycloidStepTerm{start_s, duration_s, delta};
  if (law == "modified_sine") return ModifiedSineTerm{start_s, duration_s, delta};
  return PolyStepTerm{start_s, duration_s, delta};
}

void ReadCam(ValueReader* values, const YamlNode& node, const std::string& path,
             const ProfileContext& context, Profile* profile) {
  CamReader(values, context).Read(node, path, profile);
}

}  // namespace mbv
