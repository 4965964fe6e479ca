#include "scenario/blended_path_reader.h"

#include <fmt/format.h>

namespace mbv {

std::optional<PolylinePlan> ReadBlendedPlan(ValueReader* values, const YamlMap& map) {
  YamlReader& yaml = values->yaml();
  PolylinePlan plan;
  plan.start_s = values->InUnit(map, "start_s", {kPlain}).value_or(0.0);
  if (const YamlNode* law = map.Find("law")) {
    const auto choice = yaml.Choice(*law, map.PathOf("law"), {"trapezoid", "s_curve"});
    if (!choice) return std::nullopt;
    plan.s_curve = *choice == 1;
  }
  if (!plan.s_curve && map.Has("j_max")) {
    yaml.Error(*map.Find("j_max"), map.PathOf("j_max") + " has a meaning with law: s_curve only");
    return std::nullopt;
  }
  const auto v_max = values->RequiredPositive(map, "v_max");
  const auto a_max = values->RequiredPositive(map, "a_max");
  const auto j_max = plan.s_curve ? values->RequiredPositive(map, "j_max") : 1.0;
  const auto blend = values->InUnit(map, "blend", {kPlain, kMm});
  if (!v_max || !a_max || !j_max || !blend) return std::nullopt;
  plan.blend = *blend;
  plan.limits = {.v_max = *v_max, .a_max = *a_max, .j_max = *j_max};
  if (plan.blend > 0.0) return plan;
  yaml.Error(*map.node(), fmt::format("{} = {} violates blend > 0", map.PathOf("blend"), *blend),
             "without blend the path rests at each point");
  return std::nullopt;
}

std::vector<Piecewise> PlanPath(YamlReader* yaml, const YamlNode& node, const PolylinePlan& plan) {
  for (size_t i = 0; i + 1 < plan.points.size(); ++i) {
    if (plan.points[i] != plan.points[i + 1]) continue;
    yaml->Error(node, fmt::format("motion.path.points: points {} and {} are equal", i, i + 1));
    return {};
  }
  const PolylineTrouble trouble = TroubleOf(plan);
  if (trouble.text.empty()) return BlendedPolyline(plan);
  yaml->Error(node, "motion.path: " + trouble.text, trouble.hint);
  return {};
}

}  // namespace mbv
