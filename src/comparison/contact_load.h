// What the ground bears of each foot (Contact in mechanism/mechanism.h), and whether it can: ground
// pushes and does not pull, friction is limited, and the pressure acts within the sole.
//
//   N = f_z                        normal force; the foot lifts where N < 0                (1)
//   |(f_x, f_y)| / N               the friction that holds the foot; it slips beyond μ    (2)
//   c = (−m_y, m_x) / N            centre of pressure; the foot tips outside its outline  (3)
//   |m_z − c_x f_y + c_y f_x| / N  lever of the moment about the normal through c; the
//                                  foot twists beyond `torsion`                           (4)
//
// with force and moment of the ground on the foot in the contact's frame. Of all feet on one plane
// together the sums of (1) to (3) follow from the motion alone, whatever the feet share. On ground
// of any shape it is the sum w of their wrenches that follows; the ground holds the robot where
//
//   w = Σ_v [f_v; p_v × f_v],  f_v · n_v ≥ 0,  |f_v − n_v (f_v · n_v)| ≤ s μ_v f_v · n_v        (5)
//
// has a solution with s = 1: forces f_v that push at the corners p_v of the outlines and at the
// points, within friction [Hirukawa et al. 2006]. Judged by the least s; friction cones are
// pyramids of 32 sides inside them, which makes s up to 0.5 % too large.
#pragma once

#include <string>
#include <vector>

#include "math/trace.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// Over the samples of one witness.
struct ContactLoad {
  enum class Limit { kLift, kSlip, kTip, kTwist, kFall };
  struct Use {
    Limit limit = Limit::kLift;
    /// The least normal force [N], the largest (2) [1], the least distance of the centre of
    /// pressure from the outline's edges, negative outside [m], the largest (4) [m], the largest
    /// least s of (5) [1], infinite where no friction would do.
    double worst = kNan;
    double time_s = kNan;   ///< of it
    double allowed = kNan;  ///< least, or largest value that the ground bears; NaN: not stated
    double from_s = kNan;   ///< first sample beyond it; NaN if none
    size_t beyond = 0;      ///< samples
    bool unique = true;     ///< else statics leaves open what feet share; judged is one choice

    [[nodiscard]] bool exceeded() const { return beyond > 0; }
  };

  std::string contact = {};  ///< "" of all feet together
  std::string kind = {};     ///< "point", "line", "sole"; "" of all
  std::string witness = {};
  std::string phase = {};                         ///< of a scenario with phases
  double most_normal = kNan, mean_normal = kNan;  ///< [N]
  std::vector<Eigen::Vector2d> outline = {};      ///< that was judged by
  std::vector<Eigen::Vector2d> pressure = {};     ///< (3) per sample that the foot is pushed at
  std::vector<Use> uses = {};                     ///< those that can be measured

  [[nodiscard]] std::string name() const { return contact.empty() ? "all feet together" : contact; }
  [[nodiscard]] const Use* Find(Limit limit) const;
  [[nodiscard]] bool unique() const;  ///< all of them
};

/// "lift", "slip", "tip", "twist", "fall".
[[nodiscard]] const char* ToText(ContactLoad::Limit limit);

/// Of every contact that holds; then of all together, if there are several and nothing else ties
/// the robot to the ground: of feet that do not stand on one plane by (5), if all of them state
/// friction and what touches the ground. Empty where the witness records no reactions.
/// `not_unique`: channels of reactions that statics leaves open.
[[nodiscard]] std::vector<ContactLoad> ContactLoadsOf(const Mechanism& mechanism,
                                                      const Trace& trace,
                                                      const std::vector<std::string>& not_unique);

/// One sentence about a limit that is exceeded, "left slips: …".
[[nodiscard]] std::string ExceededText(const ContactLoad& load, const ContactLoad::Use& use);

}  // namespace mbv
