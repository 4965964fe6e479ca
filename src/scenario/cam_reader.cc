#include "scenario/cam_reader.h"

#include <fmt/format.h>

#include <cmath>

#include "scenario/profile_amounts.h"

namespace mbv {
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
