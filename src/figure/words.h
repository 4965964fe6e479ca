// The words of figures in the languages that they can be drawn in.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace mbv {

enum class Language { kEnglish, kChinese, kGerman };

/// "en", "zh", "de", in the order of Language.
[[nodiscard]] const std::vector<std::string>& LanguageCodes();
[[nodiscard]] Language LanguageOf(const std::string& code);

/// What a figure says.
enum class FigureWord {
  kTime,
  kDriveForce,
  kDriveTorque,
  kDriveStroke,
  kDriveAngle,
  kDriveSpeed,
  kDriveRate,
  kReactionForce,
  kReactionMoment,
  kPower,
  kEnergy,
  kTotal,
  kKinetic,
  kGravity,
  kSprings,
  kDifference,
  kStep,
  kTimeConstant,
  kForceError,
  kCorrectedEngine,
  kStockEngine,
  kStepAlone,
  kAxisDistance,
  kAzimuth,
  kCount_,
};
[[nodiscard]] std::string WordFor(FigureWord word, Language language);

/// "simulation", of a role's name in files (core/roles.h).
[[nodiscard]] std::string SayWitness(std::string_view name, Language language);

/// "Drive force *F* (kN)": name, symbol in markup, unit as shown ("" and "1" have none).
[[nodiscard]] std::string AxisLabel(const std::string& name, const std::string& symbol,
                                    const std::string& unit);

}  // namespace mbv
